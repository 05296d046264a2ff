//! `zsim base`: where the base was, from the head's trajectory.

use super::arguments::{Global, OutArguments};
use super::{End, output};
use anyhow::Context;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use zsim::dynamics::{self, HeadModel};
use zsim::evaluation::{Errors, Pairs};
use zsim::geometry::Trajectory;
use zsim::recording::{Reader, Truth, read_tum, write_tum};
use zsim::report;

/// Tell where the base (the handle, the vehicle) was, from the trajectory of the head on its spring
///
/// Twice: as if the head were screwed to the base as it rests (base_rigid_link.tum), and by the spring's own law: the base
/// that pushes the head as it is seen to accelerate (base_spring.tum). The trajectory, a TUM file, has z up and is of the
/// head's frame, at an IMU's rate or more, as estimates and the truth of zsim are.
#[derive(Args)]
#[command(
    after_help = "Example:\n  zsim base results/office/closed_loop.tum --head handheld --truth results/office/recording.mcap"
)]
pub(super) struct Arguments {
    /// The head's trajectory
    #[arg(value_name = "HEAD.tum")]
    trajectory: PathBuf,
    /// The head and its spring, a name under specs/heads/ or a file
    #[arg(long, value_name = "NAME|FILE", default_value = "handheld")]
    head: String,
    /// The base's true trajectory: a TUM file, or a recording that has it
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    #[command(flatten)]
    out: OutArguments,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<End> {
    let (head, source) = dynamics::load(&arguments.head)?;
    let head = HeadModel::new(&head, &source)?;
    let seen = read_tum(&arguments.trajectory)?;
    let truth = arguments.truth.as_deref().map(true_base).transpose()?;
    let ways = [
        ("rigid_link", "rigid link", Trajectory::from_poses(head.base_on_rigid_link(&seen))?),
        ("spring", "spring's law", Trajectory::from_poses(head.base_under(&seen)?)?),
    ];

    let wanted = arguments.out.out.clone().unwrap_or_else(|| PathBuf::from("results/base"));
    let folder = output::folder(&wanted, arguments.out.force)?;
    let (mut rows, mut figures) = (Vec::new(), json!({}));
    for (key, name, base) in &ways {
        write_tum(&folder.join(format!("base_{key}.tum")), base)?;
        let errors = truth.as_ref().map(|truth| errors(base, truth)).transpose()?;
        let told = errors.as_ref().map(|e| (e.position_rmse_m(), e.rotation_rmse_rad().to_degrees()));
        figures[*key] = json!({
            "poses": base.len(),
            "position_rmse_m": told.map(|(position_m, _)| position_m),
            "rotation_rmse_deg": told.map(|(_, rotation_deg)| rotation_deg),
        });
        let words = |figure: Option<String>| figure.unwrap_or_else(|| "-".to_owned());
        let position = words(told.map(|(position_m, _)| format!("{:.2}", position_m * 1e3)));
        let rotation = words(told.map(|(_, rotation_deg)| format!("{rotation_deg:.3}")));
        rows.push(vec![(*name).to_owned(), base.len().to_string(), position, rotation]);
    }
    let heading = ["base by", "poses", "position RMSE (mm)", "rotation RMSE (\u{b0})"];
    output::tell(global, &report::table(&heading, &rows, true), figures, Some(&folder))?;
    Ok(End::Done)
}

/// Errors after rigid alignment.
fn errors(base: &Trajectory, truth: &Trajectory) -> anyhow::Result<Errors> {
    let pairs = Pairs::associate(base, truth)?;
    Ok(Errors::after(&pairs, &pairs.world_from_map()?))
}

fn true_base(path: &Path) -> anyhow::Result<Trajectory> {
    if path.extension().is_some_and(|ending| ending == "tum" || ending == "txt") {
        return Ok(read_tum(path)?);
    }
    let reader = Reader::open(path)?;
    let mut base = Trajectory::new();
    for truth in reader.truth() {
        if let Truth::Base(stamp, pose) = truth? {
            base.push(stamp, pose).with_context(|| format!("{}: the base's truth", path.display()))?;
        }
    }
    anyhow::ensure!(!base.is_empty(), "{} has no truth of the base: leave --truth out", path.display());
    Ok(base)
}
