//! The command `zsim`.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
