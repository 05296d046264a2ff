//! `zsim evaluate`: errors of a trajectory and of a cloud.

use super::arguments::Global;
use super::trajectory_file::{self, Truth, TruthTimes};
use super::{Completion, output};
use anyhow::Context;
use clap::Args;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use zsim_base::geometry::{Pose, SmoothCursor, Trajectory, Vector};
use zsim_evaluation::{CloudErrors, Thinning, TrajectoryErrors};
use zsim_recording::PlyReader;
use zsim_world::World;

/// Maximum number of points of a cloud that are evaluated.
const MAX_EVALUATED_POINTS: usize = 200_000;
/// Search radius around a point for the true surface, m.
const REACH_M: f64 = 1.0;

/// Evaluate a trajectory against the true trajectory, and a cloud against the true surfaces
///
/// The estimate is a TUM file (`t x y z qx qy qz qw`) with stamps of the clock of the truth. The denser of both is interpolated
/// at the stamps of the sparser one. The estimate is aligned with the truth (rigid, by positions, as evo_ape -a). The same
/// alignment is applied to a cloud in the map frame of the estimate; without trajectories, the cloud is in the world frame.
#[derive(Args)]
#[command(
    group = clap::ArgGroup::new("what").required(true).multiple(true).args(["estimate", "cloud"]),
    after_help = "Examples:\n  zsim evaluate --estimate open_loop.tum --truth truth.tum\n  zsim evaluate --estimate \
                  open_loop.tum --truth truth.tum --cloud cloud.ply --scene office"
)]
pub(super) struct Arguments {
    /// The estimated trajectory
    #[arg(long, value_name = "A.tum", requires = "truth")]
    estimate: Option<PathBuf>,
    /// The true trajectory (TUM, EuRoC or KITTI; `t x y z` for positions only), or a recording with the ground truth
    #[arg(long, value_name = "B.tum|B.csv|FILE.mcap", requires = "estimate")]
    truth: Option<PathBuf>,
    #[command(flatten)]
    times: TruthTimes,
    /// The cloud
    #[arg(long, value_name = "C.ply", requires = "scene")]
    cloud: Option<PathBuf>,
    /// The scene of the cloud, a name under scenes/ or a file
    #[arg(long, value_name = "NAME|FILE", requires = "cloud")]
    scene: Option<String>,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let mut metrics = Map::new();
    let mut estimated = None;
    if let (Some(estimated_path), Some(truth)) = (&arguments.estimate, &arguments.truth) {
        let estimate = trajectory_file::estimate(estimated_path)?;
        let known = Truth::read(truth, &arguments.times)?;
        let pairs = known.pairs(&estimate)?;
        let (errors, _) = TrajectoryErrors::of(&pairs, &known.trajectory)?;
        if !global.quiet {
            known.note(truth);
            trajectory_file::note_interpolation(estimated_path, &pairs);
        }
        metrics = zsim_report::trajectory_figures(&errors);
        estimated = Some((estimate, pairs.world_from_map()?));
    }
    if let (Some(cloud), Some(scene)) = (&arguments.cloud, &arguments.scene) {
        let world = World::load(scene)?;
        evaluate_cloud(cloud, &world, estimated.as_ref(), &mut metrics)?;
    }
    output::print_result(global, &text(&metrics), Value::Object(metrics), None)
}

fn evaluate_cloud(
    path: &Path,
    world: &World,
    estimated: Option<&(Trajectory, Pose)>,
    metrics: &mut Map<String, Value>,
) -> anyhow::Result<()> {
    let reader = PlyReader::open(path)?;
    let total = reader.remaining() as usize;
    let thinning = Thinning::to_at_most(MAX_EVALUATED_POINTS, total);
    let world_from_map = estimated.map_or_else(Pose::identity, |(_, world_from_map)| *world_from_map);
    let in_world = |at: &Vector| world_from_map.rotation * at + world_from_map.translation.vector;
    let mut cursor = estimated.map(|(trajectory, _)| SmoothCursor::new(trajectory));
    let mut seen = Vec::new();
    for (index, point) in reader.enumerate() {
        let point = point.with_context(|| format!("cannot read the next point of {}", path.display()))?;
        if thinning.keeps(index) {
            let head = cursor.as_mut().and_then(|cursor| cursor.at(point.stamp));
            let from = head.map(|pose| in_world(&pose.translation.vector));
            seen.push((in_world(&point.point_in_map.cast()), from));
        }
    }
    let summary = CloudErrors::to_surface(world, &seen, REACH_M).summary();
    let mut insert = |key: &str, value: Option<f64>| metrics.insert(key.to_owned(), json!(value));
    insert("bias_m", summary.map(|cloud| cloud.bias_m));
    insert("sigma_m", summary.map(|cloud| cloud.sigma_m));
    insert("p95_m", summary.map(|cloud| cloud.p95_m));
    insert("far_fraction", Some(summary.map_or(1.0, |cloud| cloud.beyond_reach)));
    metrics.insert("points".to_owned(), json!(total));
    Ok(())
}

fn text(metrics: &Map<String, Value>) -> String {
    let value = |value: &Value| match value.as_f64() {
        Some(number) if value.is_f64() => format!("{number:.6}"),
        None if value.is_null() => "-".to_owned(),
        _ => value.to_string(),
    };
    zsim_report::Table::facts(metrics.iter().map(|(key, metric)| (key, value(metric)))).text()
}
