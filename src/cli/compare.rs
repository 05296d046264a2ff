//! `zsim compare`: errors of several trajectories side by side, with limits for CI.

use super::arguments::{Global, OutArguments};
use super::limit::{Limit, fraction};
use super::trajectory_file::{self, Truth, TruthTimes};
use super::{Completion, message, output};
use anyhow::{Context, bail};
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use zsim_base::files::replace_text;
use zsim_base::geometry::Trajectory;
use zsim_base::printable::printable_name;
use zsim_evaluation::{Errors, TrajectoryErrors};

/// Files of --out.
const FILES: [&str; 5] = ["comparison.json", "errors.svg", "errors.png", "trajectories.svg", "trajectories.png"];

/// Coverage below which a limit of the errors says little, for a note.
const LOW_COVERAGE: f64 = 0.95;

/// Compare estimated trajectories with the true one, and fail above a limit
///
/// Estimates are TUM files with stamps of the clock of the truth. The denser of two trajectories is interpolated at the stamps
/// of the sparser one. Each estimate is aligned with the truth (rigid, by positions, as evo_ape -a). The table has the time
/// covered, the absolute error of the position (APE: RMSE and maximum) and of the rotation (RMSE), the relative error of the
/// position over 1 m of path and 1 s (RPE: RMSE), and the drift. --out writes comparison.json and the plots errors and
/// trajectories.
///
/// The exit code is 1 if an estimate exceeds a limit, or is too short for the figure.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  zsim compare --truth run.mcap open_loop.tum closed_loop.tum --out results/compared\n  \
                  zsim compare --truth truth.tum a.tum --fail-above position_rmse=5mm --min-coverage 95%"
)]
pub(super) struct Arguments {
    /// The estimated trajectories
    #[arg(value_name = "A.tum", required = true)]
    estimates: Vec<PathBuf>,
    /// The true trajectory (TUM, EuRoC or KITTI; `t x y z` for positions only), or a recording with the ground truth
    #[arg(long, value_name = "T.tum|T.csv|T.mcap")]
    truth: PathBuf,
    #[command(flatten)]
    times: TruthTimes,
    /// Fail if a figure of an estimate is above this limit; can be repeated. The names are those of --json without the
    /// unit: position_rmse=5mm, rotation_rmse=0.1deg, drift=2cm/min, relative_error_per_metre=1cm
    #[arg(long, value_name = "NAME=LIMIT", value_parser = Limit::parse)]
    fail_above: Vec<Limit>,
    /// Fail if an estimate covers less of the truth's time (95% or 0.95); gaps of more than 1 s are not covered
    #[arg(long, value_name = "FRACTION", value_parser = fraction)]
    min_coverage: Option<f64>,
    #[command(flatten)]
    out: OutArguments,
}

/// An estimate with its errors.
struct Compared {
    /// The path as given.
    name: String,
    /// The name in tables and plots: the file's name without its ending, if no other estimate has the same.
    label: String,
    errors: TrajectoryErrors,
    over_time: Errors,
    /// The trajectory after the alignment, `world_from_head`.
    aligned: Trajectory,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let truth = Truth::read(&arguments.truth, &arguments.times)?;
    let compare = |path: &PathBuf| {
        compare(path, &truth, global.quiet)
            .with_context(|| format!("{} cannot be compared with {}", path.display(), arguments.truth.display()))
    };
    let mut compared = arguments.estimates.iter().map(compare).collect::<anyhow::Result<Vec<_>>>()?;
    label(&mut compared);
    let violations = violations(arguments, &compared);
    let figures = figures(arguments, &compared, &violations);
    let out = &arguments.out;
    let folder = out.out.as_ref().map(|wanted| output::folder(wanted, out.force)).transpose()?;
    if let Some(folder) = &folder {
        let inputs = arguments.estimates.iter().chain([&arguments.truth]);
        output::check_not_inputs(inputs, FILES.map(|name| folder.join(name)))?;
        write(folder, &truth.trajectory, &compared, &figures)?;
    }
    output::print_result(global, &text(&compared, global.verbose), figures, folder.as_deref())?;
    if !violations.is_empty() {
        bail!("a limit is exceeded: {}", violations.join("; "));
    }
    if !global.quiet {
        truth.note(&arguments.truth);
    }
    let partial = compared.iter().find(|each| each.errors.coverage < LOW_COVERAGE);
    let is_unlimited = !arguments.fail_above.is_empty() && arguments.min_coverage.is_none();
    if let Some(each) = partial.filter(|_| is_unlimited && !global.quiet) {
        let (name, covered) = (printable_name(&each.name), 100.0 * each.errors.coverage);
        message::note(&format!("{name} covers {covered:.1} % of the truth; --min-coverage 95% would fail on it"));
    }
    Ok(Completion::Done)
}

fn compare(path: &Path, truth: &Truth, is_quiet: bool) -> anyhow::Result<Compared> {
    let estimate = trajectory_file::estimate(path)?;
    let pairs = truth.pairs(&estimate)?;
    if !is_quiet {
        trajectory_file::note_interpolation(path, &pairs);
    }
    let (errors, over_time) = TrajectoryErrors::of(&pairs, &truth.trajectory)?;
    let aligned = estimate.transformed(&pairs.world_from_map()?);
    let name = path.display().to_string();
    Ok(Compared { label: name.clone(), name, errors, over_time, aligned })
}

/// Shortens labels to the last parts of the path that no other estimate has, without the ending.
fn label(compared: &mut [Compared]) {
    let paths: Vec<PathBuf> = compared.iter().map(|each| Path::new(&each.name).with_extension("")).collect();
    let end = |path: &Path, parts: usize| -> PathBuf {
        path.components().skip(path.components().count().saturating_sub(parts)).collect()
    };
    for (each, path) in compared.iter_mut().zip(&paths) {
        let differs = |parts: &usize| {
            let label = end(path, *parts);
            paths.iter().filter(|other| end(other, *parts) == label).count() == 1
        };
        if let Some(parts) = (1..=path.components().count()).find(differs) {
            each.label = end(path, parts).display().to_string();
        }
    }
}

fn violations(arguments: &Arguments, compared: &[Compared]) -> Vec<String> {
    let mut violations = Vec::new();
    for each in compared {
        let figures = zsim_report::trajectory_figures(&each.errors);
        violations.extend(arguments.fail_above.iter().filter_map(|limit| limit.violation(&each.name, &figures)));
        if let Some(needed) = arguments.min_coverage.filter(|needed| each.errors.coverage < *needed) {
            let (name, covered) = (&each.name, 100.0 * each.errors.coverage);
            violations.push(format!("{name}: covers {covered:.1} % of the truth (limit {:.1} %)", 100.0 * needed));
        }
    }
    violations
}

fn figures(arguments: &Arguments, compared: &[Compared], violations: &[String]) -> Value {
    let trajectory = |each: &Compared| {
        let mut figures = zsim_report::trajectory_figures(&each.errors);
        figures.shift_insert(0, "file".to_owned(), json!(each.name));
        Value::Object(figures)
    };
    json!({
        "truth": arguments.truth.display().to_string(),
        "trajectories": compared.iter().map(trajectory).collect::<Vec<_>>(),
        "passed": violations.is_empty(),
        "violations": violations,
    })
}

fn text(compared: &[Compared], is_verbose: bool) -> String {
    let named: Vec<(&str, &TrajectoryErrors)> = compared.iter().map(|each| (&*each.label, &each.errors)).collect();
    let details = if is_verbose { format!("\n{}", zsim_report::comparison_details(&named)) } else { String::new() };
    zsim_report::comparison_table(&named) + &details
}

/// Writes the figures and plots into `folder`.
fn write(folder: &Path, truth: &Trajectory, compared: &[Compared], figures: &Value) -> anyhow::Result<()> {
    let errors: Vec<(&str, &Errors)> = compared.iter().map(|each| (&*each.label, &each.over_time)).collect();
    zsim_report::compared_errors(&errors).save(folder, "errors")?;
    let paths: Vec<(&str, &Trajectory)> = compared.iter().map(|each| (&*each.label, &each.aligned)).collect();
    zsim_report::compared_trajectories(truth, &paths).save(folder, "trajectories")?;
    replace_text(&folder.join("comparison.json"), &(serde_json::to_string_pretty(figures)? + "\n"))?;
    Ok(())
}
