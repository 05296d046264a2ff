//! `zsim map`: maps that last.

use super::arguments::{Global, spec_file, start};
use super::{Completion, output};
use clap::{Args, Subcommand};
use serde_json::json;
use std::path::PathBuf;
use zsim_base::geometry::{Pose, roll_pitch_yaw};
use zsim_base::spec::Kind;

/// Put maps together
///
/// `zsim estimate` leaves a map, map.ply: surfels with their uncertainty. Another recording is localised in it with
/// `zsim estimate --map`, and extended with --extend-map.
#[derive(Args)]
#[command(after_help = "Example:\n  zsim map merge monday/map.ply tuesday/map.ply --out both.ply")]
pub(super) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Merge(MergeArguments),
}

/// Merge two maps by their common surfaces
///
/// The second map is searched for in the first: everywhere, or within a metre and twenty degrees of a given pose.
#[derive(Args)]
#[command(after_help = "Example:\n  zsim map merge monday/map.ply tuesday/map.ply --out both.ply")]
struct MergeArguments {
    /// The map that defines the frame
    #[arg(value_name = "A.ply")]
    first: PathBuf,
    /// The map that is aligned with the first and added to it
    #[arg(value_name = "B.ply")]
    second: PathBuf,
    /// Approximate pose of the second map's origin in the first map: metres, and degrees about the vertical
    /// [default: the whole first map is searched]
    #[arg(long, value_name = "X,Y,Z,YAW", value_parser = start, allow_hyphen_values = true)]
    start: Option<Pose>,
    /// The estimator's settings, a name under specs/estimators/ or a file
    #[arg(long, value_name = "NAME|FILE", default_value = "default")]
    estimator: String,
    /// File for the merged map
    #[arg(long, short, value_name = "C.ply")]
    out: PathBuf,
    /// Replace the file if it exists
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let Command::Merge(merge) = &arguments.command;
    let estimator = zsim_estimation::load(&merge.estimator)?;
    let out = &merge.out;
    output::check_file(out, merge.force)?;
    let estimator_file = spec_file(Kind::Estimator, &merge.estimator);
    let inputs = [merge.first.clone(), merge.second.clone()].into_iter().chain(estimator_file);
    output::check_not_inputs(inputs, [out])?;
    let merged = zsim_run::merge_map_files(&merge.first, &merge.second, merge.start.as_ref(), &estimator, out)?;
    let [first, second, both] = merged.surfels;
    let at = merged.located.map_from_query;
    let (position, yaw_deg) = (at.translation.vector, roll_pitch_yaw(&at.rotation).2.to_degrees());
    let (fraction, residual_m) = (merged.located.inlier_ratio, merged.located.residual_rms_m);
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let rows = [
        row("surfels, first map", first.to_string()),
        row("surfels, second map", second.to_string()),
        row("surfels, merged map", both.to_string()),
        row(
            "second map in the first: x, y, z, yaw",
            format!("{:.3}, {:.3}, {:.3} m, {yaw_deg:.3}\u{b0}", position.x, position.y, position.z),
        ),
        row("surfels of the second map that match", format!("{:.0} %", 100.0 * fraction)),
        row("residual, RMS", format!("{:.1} mm", 1e3 * residual_m)),
    ];
    let figures = json!({
        "surfels": { "first": first, "second": second, "both": both },
        "first_from_second": { "position_m": [position.x, position.y, position.z], "yaw_deg": yaw_deg },
        "share_on_first": fraction,
        "residual_rms_m": residual_m,
    });
    output::print_result(global, &zsim_report::table(&[], &rows, true), figures, Some(out))
}
