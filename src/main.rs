//! The command `zsim`.

fn main() -> std::process::ExitCode {
    zsim_cli::run()
}
