//! `zsim evaluate`: errors of a trajectory and of a cloud.

use super::arguments::Global;
use super::{End, output};
use anyhow::{Context, bail, ensure};
use clap::Args;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use zsim::evaluation::{CloudErrors, Errors, Pairs, Thinning, drift, relative_error};
use zsim::geometry::{Pose, SmoothCursor, Trajectory, Vector};
use zsim::recording::{PlyReader, read_tum};
use zsim::report;
use zsim::time::Span;
use zsim::world::World;

/// Most points of a cloud that are judged.
const JUDGED: usize = 200_000;
/// Search radius around a point for the true surface, m.
const REACH_M: f64 = 1.0;

/// Farthest that a position is from the origin, m: farther than the Sun.
const FARTHEST_M: f64 = 1e12;

/// Judge a trajectory by the true one, and a cloud by the true surfaces
///
/// Trajectories are TUM files (`t x y z qx qy qz qw`) stamped by one clock. The estimate is aligned with the truth
/// first (rigid, by positions, as evo_ape -a). With both, a cloud in the estimate's map is aligned the same way;
/// without them it is in the world frame.
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
    /// The true trajectory
    #[arg(long, value_name = "B.tum", requires = "estimate")]
    truth: Option<PathBuf>,
    /// A cloud
    #[arg(long, value_name = "C.ply", requires = "scene")]
    cloud: Option<PathBuf>,
    /// The world that the cloud is of, a name under scenes/ or a file
    #[arg(long, value_name = "NAME|FILE", requires = "cloud")]
    scene: Option<String>,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<End> {
    let mut figures = Map::new();
    let mut estimated = None;
    if let (Some(estimated_path), Some(truth)) = (&arguments.estimate, &arguments.truth) {
        let estimate = read_tum(estimated_path)?;
        let known = read_tum(truth)?;
        for (path, trajectory) in [(estimated_path, &estimate), (truth, &known)] {
            check_positions(path, trajectory)?;
        }
        let pairs = Pairs::associate(&estimate, &known)?;
        let world_from_map = pairs.world_from_map()?;
        judge_trajectory(&pairs, &world_from_map, &mut figures)?;
        estimated = Some((estimate, world_from_map));
    }
    if let (Some(cloud), Some(scene)) = (&arguments.cloud, &arguments.scene) {
        let world = World::load(scene)?;
        judge_cloud(cloud, &world, estimated.as_ref(), &mut figures)?;
    }
    output::tell(global, &words(&figures), Value::Object(figures), None)?;
    Ok(End::Done)
}

/// Refuses positions whose squares no sum can hold.
fn check_positions(path: &Path, trajectory: &Trajectory) -> anyhow::Result<()> {
    let far = trajectory.iter().find(|(_, pose)| pose.translation.vector.amax() > FARTHEST_M);
    let Some((stamp, pose)) = far else { return Ok(()) };
    bail!(
        "{}: the pose of t = {:.9} s has a coordinate of {:e} m; {FARTHEST_M:e} m at most: is the file of another format?",
        path.display(),
        stamp.nanos() as f64 * 1e-9,
        pose.translation.vector.amax()
    );
}

fn judge_trajectory(pairs: &Pairs, world_from_map: &Pose, figures: &mut Map<String, Value>) -> anyhow::Result<()> {
    let errors = Errors::after(pairs, world_from_map);
    let drifted = drift(pairs).ok();
    let relative = relative_error(pairs, Span::from_seconds(60.0)).ok();
    let mut tell = |key: &str, figure: Option<f64>| figures.insert(key.to_owned(), json!(figure));
    tell("duration_s", Some(pairs.duration_s()));
    ensure!(
        errors.position_rmse_m().is_finite() && errors.rotation_rmse_rad().is_finite(),
        "the errors of the estimate are too large for a number"
    );
    tell("position_rmse_m", Some(errors.position_rmse_m()));
    tell("rotation_rmse_deg", Some(errors.rotation_rmse_rad().to_degrees()));
    tell("drift_m_per_min", drifted.map(|drift| drift.position_m_per_min));
    tell("yaw_drift_deg_per_min", drifted.map(|drift| drift.yaw_rad_per_min.to_degrees()));
    tell("end_error_m", drifted.map(|drift| drift.end_error_m));
    tell("relative_error_per_minute_m", relative.map(|error| error.position_rmse_m));
    tell("relative_error_per_minute_deg", relative.map(|error| error.rotation_rmse_rad.to_degrees()));
    figures.insert("poses".to_owned(), json!(pairs.len()));
    Ok(())
}

fn judge_cloud(
    path: &Path,
    world: &World,
    estimated: Option<&(Trajectory, Pose)>,
    figures: &mut Map<String, Value>,
) -> anyhow::Result<()> {
    let reader = PlyReader::open(path)?;
    let total = reader.left() as usize;
    let thinning = Thinning::to(JUDGED, total);
    let world_from_map = estimated.map_or_else(Pose::identity, |(_, world_from_map)| *world_from_map);
    let in_world = |at: &Vector| world_from_map.rotation * at + world_from_map.translation.vector;
    let mut cursor = estimated.map(|(trajectory, _)| SmoothCursor::new(trajectory));
    let mut seen = Vec::new();
    for (index, point) in reader.enumerate() {
        let point = point.with_context(|| format!("{} cannot be read on", path.display()))?;
        if thinning.keeps(index) {
            let head = cursor.as_mut().and_then(|cursor| cursor.at(point.stamp));
            let from = head.map(|pose| in_world(&pose.translation.vector));
            seen.push((in_world(&point.point_in_map.cast()), from));
        }
    }
    let summary = CloudErrors::to_surface(world, &seen, REACH_M).summary();
    let mut tell = |key: &str, figure: Option<f64>| figures.insert(key.to_owned(), json!(figure));
    tell("bias_m", summary.map(|cloud| cloud.bias_m));
    tell("sigma_m", summary.map(|cloud| cloud.sigma_m));
    tell("p95_m", summary.map(|cloud| cloud.p95_m));
    tell("far_fraction", Some(summary.map_or(1.0, |cloud| cloud.beyond_reach)));
    figures.insert("points".to_owned(), json!(total));
    Ok(())
}

fn words(figures: &Map<String, Value>) -> String {
    let known = figures.iter().filter(|(_, value)| !value.is_null());
    let value = |value: &Value| match value.as_f64() {
        Some(number) if value.is_f64() => format!("{number:.6}"),
        _ => value.to_string(),
    };
    let rows: Vec<Vec<String>> = known.map(|(key, figure)| vec![key.clone(), value(figure)]).collect();
    report::table(&[], &rows, true)
}
