//! `zsim benchmark`: a suite of recordings for any SLAM system, and a table of the systems' errors.

mod plan;
mod score;
mod scores;
mod suite;

use super::Completion;
use super::arguments::Global;
use clap::{Args, Subcommand};

/// Test SLAM systems on a suite of recordings whose truth is known
#[derive(Args)]
#[command(
    after_help = "Example:\n  zsim benchmark plan -o suite\n  for f in suite/recordings/*.mcap; do my_slam $f estimates/$(basename \
                        $f .mcap).tum; done\n  zsim benchmark score suite --system mine=estimates"
)]
pub(super) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Plan(plan::Arguments),
    Score(score::Arguments),
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    match &arguments.command {
        Command::Plan(arguments) => plan::run(arguments, global),
        Command::Score(arguments) => score::run(arguments, global),
    }
}
