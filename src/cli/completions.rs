//! `zsim completions`: for shells.

use super::{Cli, End, output};
use clap::{Args, CommandFactory};
use clap_complete::Shell;

/// Print completions for a shell
#[derive(Args)]
#[command(after_help = "Example:\n  zsim completions bash > ~/.local/share/bash-completion/completions/zsim")]
pub(super) struct Arguments {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<End> {
    let mut text = Vec::new();
    clap_complete::generate(arguments.shell, &mut Cli::command(), "zsim", &mut text);
    output::write_to_stdout(&String::from_utf8_lossy(&text))?;
    Ok(End::Done)
}
