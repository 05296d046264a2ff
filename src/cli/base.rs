//! `zsim base`: where the base was, from the head's trajectory.

use super::arguments::{Global, OutArguments};
use super::{End, output};
use anyhow::Context;
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use zsim::dynamics::{self, HeadModel};
use zsim::estimation::BaseEstimate;
use zsim::evaluation::{Errors, Pairs};
use zsim::geometry::{Trajectory, Vector};
use zsim::recording::{Loss, Reader, Truth, read_tum, write_tum};
use zsim::report;
use zsim::study;

/// Compute the trajectory of the base (handle, vehicle) from that of the head on its spring
///
/// Twice: as if the head were screwed to the base as it rests (base_rigid_link.tum), and by the spring's own law: the
/// base that moves the head with the observed acceleration (base_spring.tum). The trajectory, a TUM file, has z up and
/// is of the head's frame, at an IMU's rate or more, as estimates and the truth of zsim are. With a recording of an IMU
/// on the base a third time: that IMU and the spring's law, smoothed together (base_imu.tum).
#[derive(Args)]
#[command(after_help = "Examples:\n  zsim base results/office/closed_loop.tum --head handheld --truth \
                        results/office/recording.mcap\n  zsim base results/office/closed_loop.tum --head handheld \
                        --base-imu results/office/recording.mcap")]
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
    /// A recording of an IMU on the base, as `zsim simulate --base-imu` makes them; where /tf_static has it not in the
    /// frame base, it is at the base's origin and along its axes
    #[arg(long, value_name = "FILE.mcap")]
    base_imu: Option<PathBuf>,
    /// The topic of that IMU [default: /base/imu]
    #[arg(long, value_name = "TOPIC", requires = "base_imu")]
    base_imu_topic: Option<String>,
    /// Time offset, IMU stamps minus trajectory stamps, accurate to a millisecond or two [default: found by
    /// how both turn, and followed as it drifts]
    #[arg(long, value_name = "MS", requires = "base_imu", allow_hyphen_values = true)]
    clock_offset_ms: Option<f64>,
    #[command(flatten)]
    out: OutArguments,
}

/// Poses of which a trajectory has one acceleration.
const LEAST_POSES: usize = 3;

/// A method that computes the base trajectory.
struct Way {
    key: &'static str,
    name: &'static str,
    base: Trajectory,
}

impl Way {
    /// The file name of the trajectory.
    fn file(&self) -> String {
        format!("base_{}.tum", self.key)
    }
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<End> {
    let (head, source) = dynamics::load(&arguments.head)?;
    let head = HeadModel::new(&head, &source)?;
    let seen = read_tum(&arguments.trajectory)?;
    anyhow::ensure!(
        seen.len() >= LEAST_POSES,
        "{}: a trajectory of {} poses; {LEAST_POSES} are needed, since the head's acceleration is a second difference",
        arguments.trajectory.display(),
        seen.len()
    );
    let truth = arguments.truth.as_deref().map(true_base).transpose()?;
    let by_spring = match &arguments.base_imu {
        Some(_) => study::base_by_law(&head, &seen)?,
        None => head.base_from_force_law(&seen)?,
    };
    let by_imu = arguments.base_imu.as_deref().map(|recording| by_imu(recording, arguments, &head, &seen));
    let by_imu = by_imu.transpose()?;

    let way = |key, name, base| Way { key, name, base };
    let mut ways = vec![
        way("rigid_link", "rigid link", Trajectory::from_poses(head.base_from_rigid_link(&seen))?),
        way("spring", "spring's law", Trajectory::from_poses(by_spring)?),
    ];
    let (estimate, loss) = by_imu.unzip();
    ways.extend(estimate.as_ref().map(|imu| way("imu", "with the base's IMU", imu.trajectory.clone())));
    let wanted = arguments.out.out.clone().unwrap_or_else(|| PathBuf::from("results/base"));
    let folder = output::folder(&wanted, arguments.out.force)?;
    let inputs: Vec<PathBuf> =
        [Some(&arguments.trajectory), arguments.truth.as_ref()].into_iter().flatten().cloned().collect();
    let written: Vec<PathBuf> = ways.iter().map(|way| folder.join(way.file())).collect();
    output::spare_inputs(&inputs, &written)?;
    let (mut words, mut figures) = tell(&ways, truth.as_ref(), &folder)?;
    if let Some(imu) = &estimate {
        let (offset_ms, sigma_ms) = (imu.clock_offset_s * 1e3, imu.clock_offset_sigma_s * 1e3);
        let tilt_deg = imu.up_in_world.angle(&Vector::z()).to_degrees();
        words += &format!("\nclock of the base's IMU ahead by {offset_ms:.2} ms at the end (sigma {sigma_ms:.2} ms)");
        words += &format!("\nthe trajectory's world leans by {tilt_deg:.2}\u{b0}\n");
        figures["imu"]["tilt_deg"] = json!(tilt_deg);
        figures["imu"]["clock_offset_ms"] = json!(offset_ms);
        figures["imu"]["clock_offset_sigma_ms"] = json!(sigma_ms);
    }
    output::tell(global, &words, figures, Some(&folder))?;
    let Some(loss) = loss.filter(|loss| !loss.is_none()) else { return Ok(End::Done) };
    loss.sentences().iter().for_each(|loss| eprintln!("loss: {}", output::printable(loss)));
    Ok(End::WithLoss)
}

fn by_imu(
    recording: &Path,
    arguments: &Arguments,
    head: &HeadModel,
    seen: &Trajectory,
) -> anyhow::Result<(BaseEstimate, Loss)> {
    let reader = Reader::open(recording)?;
    let record = reader.base_imu(arguments.base_imu_topic.as_deref())?;
    let offset_s = arguments.clock_offset_ms.map(|ms| ms * 1e-3);
    let estimate = study::base_by_imu(head, seen, (&reader, &record), offset_s);
    Ok((estimate.with_context(|| recording.display().to_string())?, record.loss))
}

/// Writes the trajectories to `folder`; their table, and their figures.
fn tell(ways: &[Way], truth: Option<&Trajectory>, folder: &Path) -> anyhow::Result<(String, Value)> {
    let (mut rows, mut figures) = (Vec::new(), json!({}));
    for way @ Way { key, name, base } in ways {
        write_tum(&folder.join(way.file()), base)?;
        let errors = truth.filter(|_| !base.is_empty()).map(|truth| errors(base, truth)).transpose()?;
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
    Ok((report::table(&heading, &rows, true), figures))
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
