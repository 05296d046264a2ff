//! `zsim base`: the trajectory of the base from the trajectory of the head.

use super::arguments::{Global, OutArguments};
use super::{Completion, message, output, quantity};
use anyhow::Context;
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use zsim_base::geometry::{Pose, Trajectory, Vector};
use zsim_base::time::Stamp;
use zsim_dynamics::{self, DynamicsError, HeadModel};
use zsim_estimation::BaseEstimate;
use zsim_evaluation::{Errors, Pairs};
use zsim_recording::{Loss, Reader, Truth, read_tum, write_tum};

/// Compute the trajectory of the base (handle, vehicle) from that of the head on its spring
///
/// There are two methods, three with a base IMU. Rigid link (base_rigid_link.tum): the head is fixed to the base in its
/// rest pose. Spring law (base_spring.tum): the base pose that gives the observed acceleration of the head. Base IMU
/// (base_imu.tum): smoother with the samples of an IMU on the base and the spring law. The input is a TUM file of the
/// head frame with z up, at the IMU rate or more, such as the estimates and the truth of zsim.
#[derive(Args)]
#[command(after_help = "Examples:\n  zsim base results/office/closed_loop.tum --head handheld --truth \
                        results/office/recording.mcap\n  zsim --scene office --base-imu 3dm_gx2 --out \
                        results/imus\n  zsim base results/imus/closed_loop.tum --head handheld --base-imu \
                        results/imus/recording.mcap")]
pub(super) struct Arguments {
    /// Trajectory of the head
    #[arg(value_name = "HEAD.tum")]
    trajectory: PathBuf,
    /// The head and its spring, a name under specs/heads/ or a file
    #[arg(long, value_name = "NAME|FILE", default_value = "handheld")]
    head: String,
    /// True trajectory of the base: a TUM file, or a recording that has it
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Recording with an IMU on the base, as from `zsim simulate --base-imu`; if /tf_static does not have the pose of the
    /// IMU in the frame base, it is the identity
    #[arg(long, value_name = "FILE.mcap")]
    base_imu: Option<PathBuf>,
    /// Topic of the base IMU [default: /base/imu]
    #[arg(long, value_name = "TOPIC", requires = "base_imu")]
    base_imu_topic: Option<String>,
    /// Time offset, IMU stamps minus trajectory stamps, accurate to 1 to 2 ms [default: estimated from the angular
    /// velocities, with drift]
    #[arg(long, value_name = "TIME", requires = "base_imu", allow_hyphen_values = true, value_parser = quantity::milliseconds)]
    clock_offset_ms: Option<f64>,
    #[command(flatten)]
    out: OutArguments,
}

/// Minimum number of poses: the acceleration is a second difference.
const MIN_POSES: usize = 3;

/// The base trajectory by one method.
struct MethodResult {
    key: &'static str,
    name: &'static str,
    base: Trajectory,
}

impl MethodResult {
    /// The file name of the trajectory.
    fn file(&self) -> String {
        format!("base_{}.tum", self.key)
    }
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let (head, source) = zsim_dynamics::load(&arguments.head)?;
    let head = HeadModel::new(&head, &source)?;
    let head_trajectory = read_tum(&arguments.trajectory)?;
    anyhow::ensure!(
        head_trajectory.len() >= MIN_POSES,
        "{}: a trajectory of {} poses; {MIN_POSES} are needed, because the acceleration of the head is a second difference",
        arguments.trajectory.display(),
        head_trajectory.len()
    );
    let truth = arguments.truth.as_deref().map(true_base).transpose()?;
    let by_spring = by_force_law(&head, &head_trajectory, global)?;
    let by_imu = arguments.base_imu.as_deref().map(|recording| by_imu(recording, arguments, &head, &head_trajectory));
    let by_imu = by_imu.transpose()?;

    let result = |key, name, base| MethodResult { key, name, base };
    let mut results =
        vec![result("rigid_link", "rigid link", Trajectory::from_poses(head.base_from_rigid_link(&head_trajectory))?)];
    let by_spring = by_spring.map(Trajectory::from_poses).transpose()?;
    results.extend(by_spring.map(|base| result("spring", "spring law", base)));
    let (estimate, loss) = by_imu.unzip();
    results.extend(estimate.as_ref().map(|imu| result("imu", "base IMU and spring law", imu.trajectory.clone())));
    let wanted = arguments.out.out.clone().unwrap_or_else(|| PathBuf::from("results/base"));
    let folder = output::folder(&wanted, arguments.out.force)?;
    let inputs = [Some(&arguments.trajectory), arguments.truth.as_ref(), arguments.base_imu.as_ref()];
    output::check_not_inputs(inputs.iter().flatten(), results.iter().map(|result| folder.join(result.file())))?;
    let (mut words, mut figures) = write_results(&results, truth.as_ref(), &folder)?;
    if let Some(imu) = &estimate {
        let (offset_ms, sigma_ms) = (imu.clock_offset_s * 1e3, imu.clock_offset_sigma_s * 1e3);
        let tilt_deg = imu.up_in_world.angle(&Vector::z()).to_degrees();
        words += &format!("\nclock offset of the base IMU at the end: {offset_ms:.2} ms (sigma {sigma_ms:.2} ms)");
        words += &format!("\ntilt of the world frame of the trajectory: {tilt_deg:.2}\u{b0}\n");
        figures["imu"]["tilt_deg"] = json!(tilt_deg);
        figures["imu"]["clock_offset_ms"] = json!(offset_ms);
        figures["imu"]["clock_offset_sigma_ms"] = json!(sigma_ms);
    }
    output::print_result(global, &words, figures, Some(&folder))?;
    let Some(loss) = loss.filter(|loss| !loss.is_none()) else { return Ok(Completion::Done) };
    loss.sentences().iter().for_each(|loss| message::loss(loss));
    Ok(Completion::WithLoss)
}

/// Computes the base by the spring law; `None`, with a note, if the linkage has no such law.
fn by_force_law(
    head: &HeadModel,
    head_trajectory: &Trajectory,
    global: &Global,
) -> anyhow::Result<Option<Vec<(Stamp, Pose)>>> {
    match head.base_from_force_law(head_trajectory) {
        Err(error @ DynamicsError::BaseUnknown { .. }) => {
            if !global.quiet {
                message::note(&format!("base_spring.tum is not written: {error}"));
            }
            Ok(None)
        }
        poses => Ok(Some(poses?)),
    }
}

fn by_imu(
    recording: &Path,
    arguments: &Arguments,
    head: &HeadModel,
    head_trajectory: &Trajectory,
) -> anyhow::Result<(BaseEstimate, Loss)> {
    let reader = Reader::open(recording)?;
    let record = reader.base_imu(arguments.base_imu_topic.as_deref())?;
    let offset_s = arguments.clock_offset_ms.map(|ms| ms * 1e-3);
    let estimate = zsim_run::base_by_imu(head, head_trajectory, &reader, &record, offset_s);
    Ok((estimate.with_context(|| recording.display().to_string())?, record.loss))
}

/// Writes the trajectories to `folder`; returns their errors as a table and as JSON.
fn write_results(
    results: &[MethodResult],
    truth: Option<&Trajectory>,
    folder: &Path,
) -> anyhow::Result<(String, Value)> {
    let (mut rows, mut figures) = (Vec::new(), json!({}));
    for result @ MethodResult { key, name, base } in results {
        write_tum(&folder.join(result.file()), base)?;
        let errors = truth.filter(|_| !base.is_empty()).map(|truth| errors(base, truth)).transpose()?;
        let rmse = errors.as_ref().map(|e| (e.position_rmse_m(), e.rotation_rmse_rad().to_degrees()));
        figures[*key] = json!({
            "poses": base.len(),
            "position_rmse_m": rmse.map(|(position_m, _)| position_m),
            "rotation_rmse_deg": rmse.map(|(_, rotation_deg)| rotation_deg),
        });
        let or_dash = |value: Option<String>| value.unwrap_or_else(|| "-".to_owned());
        let position = or_dash(rmse.map(|(position_m, _)| format!("{:.2}", position_m * 1e3)));
        let rotation = or_dash(rmse.map(|(_, rotation_deg)| format!("{rotation_deg:.3}")));
        rows.push(vec![(*name).to_owned(), base.len().to_string(), position, rotation]);
    }
    let heading = ["method", "poses", "position RMSE (mm)", "rotation RMSE (\u{b0})"];
    Ok((zsim_report::table(&heading, &rows, true), figures))
}

/// Errors after rigid alignment.
fn errors(base: &Trajectory, truth: &Trajectory) -> anyhow::Result<Errors> {
    let pairs = Pairs::associate(base, truth)?;
    Ok(Errors::after(&pairs, &pairs.world_from_map()?))
}

/// The true trajectory of the base in a TUM file or a recording.
fn true_base(path: &Path) -> anyhow::Result<Trajectory> {
    if path.extension().is_some_and(|ending| ending == "tum" || ending == "txt") {
        return Ok(read_tum(path)?);
    }
    let reader = Reader::open(path)?;
    let mut base = Trajectory::new();
    for truth in reader.truth() {
        if let Truth::Base(stamp, pose) = truth? {
            base.push(stamp, pose).with_context(|| format!("{}: true trajectory of the base", path.display()))?;
        }
    }
    anyhow::ensure!(!base.is_empty(), "{} has no true trajectory of the base: omit --truth", path.display());
    Ok(base)
}
