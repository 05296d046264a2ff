//! `zsim completions`: completion scripts for shells.

use super::{Completion, output};
use clap::{Args, Command};
use clap_complete::Shell;

/// Print completions for a shell
#[derive(Args)]
#[command(after_help = "Example:\n  zsim completions bash > ~/.local/share/bash-completion/completions/zsim")]
pub(super) struct Arguments {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

pub(super) fn run(arguments: &Arguments, command: &mut Command) -> anyhow::Result<Completion> {
    let mut text = Vec::new();
    clap_complete::generate(arguments.shell, command, "zsim", &mut text);
    output::write_to_stdout(&String::from_utf8_lossy(&text))?;
    Ok(Completion::Done)
}
