//! The command `zsim`.

fn main() {}
