//! The command line interface of zsim: one file for each command.
//!
//! Results go to stdout, messages and progress to stderr. Exit codes: 0 done, 1 failed, 2 invalid usage or spec, 3 done
//! with losses, 130 and 143 stopped by SIGINT and SIGTERM.

// `message` and `output` print: the macros panic when stdout or stderr is closed or full.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod arguments;
mod bars;
mod base;
mod benchmark;
mod bound;
mod check;
mod compare;
mod completion;
mod completions;
mod coverage;
mod estimate;
mod evaluate;
mod failure;
mod full_run;
mod gains;
mod info;
mod latency;
mod limit;
mod live;
mod man;
mod map;
mod message;
mod outlook;
mod output;
mod quantity;
mod recording_files;
mod recording_size;
mod repeat;
mod reproduce;
mod ros2;
mod scene;
mod signals;
mod simulate;
mod spec;
mod spring;
mod study;
mod submit;
mod sweep;
mod trajectory_file;
mod usage;

use arguments::Global;
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};
use completion::Completion;
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
    full_run: full_run::Arguments,
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    global: Global,
}

#[derive(Subcommand)]
enum Command {
    Simulate(simulate::Arguments),
    Estimate(estimate::Arguments),
    Evaluate(evaluate::Arguments),
    Compare(compare::Arguments),
    Base(base::Arguments),
    Benchmark(benchmark::Arguments),
    Bound(bound::Arguments),
    Gains(gains::Arguments),
    Spring(spring::Arguments),
    Coverage(coverage::Arguments),
    Latency(latency::Arguments),
    Live(ros2::LiveCommand),
    Map(map::Arguments),
    Play(ros2::PlayCommand),
    Reproduce(reproduce::Arguments),
    Scene(scene::Arguments),
    Study(study::Arguments),
    Sweep(sweep::Arguments),
    Check(check::Arguments),
    Spec(spec::Arguments),
    Info(info::Arguments),
    Completions(completions::Arguments),
    Man(man::Arguments),
}

/// Parses the arguments, runs the command, and returns the exit code.
pub fn run() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        // Help and version (code 0), or invalid usage (code 2).
        Err(message) => {
            let printed = message.print();
            let is_lost =
                !message.use_stderr() && printed.is_err_and(|error| error.kind() != std::io::ErrorKind::BrokenPipe);
            return ExitCode::from(if is_lost { 1 } else { u8::try_from(message.exit_code()).unwrap_or(2) });
        }
    };
    match dispatch(&cli) {
        Ok(Completion::Done) => ExitCode::SUCCESS,
        Ok(Completion::WithLoss) => ExitCode::from(3),
        Err(error) => failure::report(&error),
    }
}

fn dispatch(cli: &Cli) -> anyhow::Result<Completion> {
    let global = &cli.global;
    if let Some(threads) = global.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.get()).build_global()?;
    }
    // The supervisor of a worker tells by its signal why it ended.
    if !matches!(&cli.command, Some(Command::Sweep(sweep)) if sweep.is_worker()) {
        signals::watch();
    }
    let Some(command) = &cli.command else { return full_run::run(&cli.full_run, global) };
    if cli.full_run.scene.is_some() {
        let message = "--scene before a command has no effect: put it after the command, or omit the command";
        Cli::command().error(ErrorKind::ArgumentConflict, message).exit();
    }
    match command {
        Command::Simulate(arguments) => simulate::run(arguments, global),
        Command::Estimate(arguments) => estimate::run(arguments, global),
        Command::Evaluate(arguments) => evaluate::run(arguments, global),
        Command::Compare(arguments) => compare::run(arguments, global),
        Command::Base(arguments) => base::run(arguments, global),
        Command::Benchmark(arguments) => benchmark::run(arguments, global),
        Command::Bound(arguments) => bound::run(arguments, global),
        Command::Gains(arguments) => gains::run(arguments, global),
        Command::Spring(arguments) => spring::run(arguments, global),
        Command::Coverage(arguments) => coverage::run(arguments, global),
        Command::Latency(arguments) => latency::run(arguments, global),
        Command::Live(arguments) => ros2::run_live(arguments, global),
        Command::Map(arguments) => map::run(arguments, global),
        Command::Play(arguments) => ros2::run_play(arguments, global),
        Command::Reproduce(arguments) => reproduce::run(arguments, global),
        Command::Scene(arguments) => scene::run(arguments, global),
        Command::Study(arguments) => study::run(arguments, global),
        Command::Sweep(arguments) => sweep::run(arguments, global),
        Command::Check(arguments) => check::run(arguments, global),
        Command::Spec(arguments) => spec::run(arguments, global),
        Command::Info(arguments) => info::run(arguments, global),
        Command::Completions(arguments) => completions::run(arguments, &mut Cli::command()),
        Command::Man(arguments) => man::run(arguments, Cli::command(), global),
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
