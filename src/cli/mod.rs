//! The command `zsim`: one verb a file.
//!
//! Results go to stdout, messages and progress to stderr. Exit codes: 0 done, 1 failed, 2 wrong usage or spec, 3 done
//! with loss, 130 and 143 stopped by SIGINT and SIGTERM.

mod arguments;
mod bars;
mod base;
mod bound;
mod check;
mod completions;
mod coverage;
mod coverage_words;
mod estimate;
mod evaluate;
mod failure;
mod gains;
mod info;
mod journey;
mod latency;
mod map;
mod output;
mod quantity;
mod recording_files;
mod recording_size;
mod reproduce;
mod signals;
mod simulate;
mod slurm;
mod spec;
mod spring;
mod spring_words;
mod study;
mod sweep;
mod sweep_words;

use arguments::Global;
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};
use std::process::ExitCode;

/// Design and simulate moving range sensors: a lidar and an IMU on a spring, and the continuous-time SLAM that makes a
/// map from their measurements.
///
/// With a scene and no command, zsim does a full run: simulate, record, estimate, evaluate, report.
#[derive(Parser)]
#[command(
    name = "zsim",
    version,
    subcommand_negates_reqs = true,
    arg_required_else_help = true,
    after_help = "Example:\n  zsim --scene office.ron --duration 120s --seed 1"
)]
struct Cli {
    #[command(flatten)]
    journey: journey::Arguments,
    #[command(subcommand)]
    verb: Option<Verb>,
    #[command(flatten)]
    global: Global,
}

#[derive(Subcommand)]
enum Verb {
    Simulate(simulate::Arguments),
    Estimate(estimate::Arguments),
    Evaluate(evaluate::Arguments),
    Base(base::Arguments),
    Bound(bound::Arguments),
    Gains(gains::Arguments),
    Spring(spring::Arguments),
    Coverage(coverage::Arguments),
    Latency(latency::Arguments),
    Map(map::Arguments),
    Reproduce(reproduce::Arguments),
    Study(study::Arguments),
    Sweep(sweep::Arguments),
    Check(check::Arguments),
    Spec(spec::Arguments),
    Info(info::Arguments),
    Completions(completions::Arguments),
}

/// How a command that did not fail ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    Done,
    WithLoss,
}

/// Parses the arguments, runs the command, and returns the exit code.
pub fn run() -> ExitCode {
    // clap itself prints help (code 0) and complaints about usage (code 2).
    let cli = Cli::parse();
    match dispatch(&cli) {
        Ok(End::Done) => ExitCode::SUCCESS,
        Ok(End::WithLoss) => ExitCode::from(3),
        Err(error) => failure::tell(&error),
    }
}

fn dispatch(cli: &Cli) -> anyhow::Result<End> {
    let global = &cli.global;
    if let Some(threads) = global.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.get()).build_global()?;
    }
    let Some(verb) = &cli.verb else { return journey::run(&cli.journey, global) };
    if cli.journey.scene.is_some() {
        let message =
            "--scene before a command belongs to no command: put it after the command, or leave the command out";
        Cli::command().error(ErrorKind::ArgumentConflict, message).exit();
    }
    match verb {
        Verb::Simulate(arguments) => simulate::run(arguments, global),
        Verb::Estimate(arguments) => estimate::run(arguments, global),
        Verb::Evaluate(arguments) => evaluate::run(arguments, global),
        Verb::Base(arguments) => base::run(arguments, global),
        Verb::Bound(arguments) => bound::run(arguments, global),
        Verb::Gains(arguments) => gains::run(arguments, global),
        Verb::Spring(arguments) => spring::run(arguments, global),
        Verb::Coverage(arguments) => coverage::run(arguments, global),
        Verb::Latency(arguments) => latency::run(arguments, global),
        Verb::Map(arguments) => map::run(arguments, global),
        Verb::Reproduce(arguments) => reproduce::run(arguments, global),
        Verb::Study(arguments) => study::run(arguments, global),
        Verb::Sweep(arguments) => sweep::run(arguments, global),
        Verb::Check(arguments) => check::run(arguments, global),
        Verb::Spec(arguments) => spec::run(arguments, global),
        Verb::Info(arguments) => info::run(arguments, global),
        Verb::Completions(arguments) => completions::run(arguments),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arguments_fit_together() {
        Cli::command().debug_assert();
    }

    #[test]
    fn every_help_ends_with_an_example() {
        let command = Cli::command();
        for each in command.get_subcommands().chain([&command]) {
            let help = each.clone().render_long_help().to_string();
            let last = help.trim_end().lines().last().unwrap_or_default();
            assert!(last.trim_start().starts_with("zsim"), "{}: {last}", each.get_name());
        }
    }
}
