//! Arguments that several commands share.

use super::quantity;
use super::usage::Usage;
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use zsim_base::geometry::{Pose, Rotation, Vector};
use zsim_base::random::Seed;
use zsim_base::spec::{Kind, find};
use zsim_estimation::{self, EstimatorSpec};
use zsim_run::{CalibrationSpec, CloudFormat, CloudOptions, EstimateOptions};
use zsim_simulation::Scenario;

/// Arguments that every command accepts.
#[derive(Args)]
pub(super) struct Global {
    /// Print results as JSON
    #[arg(long, global = true)]
    pub json: bool,
    /// Suppress progress and notes; print results and errors only
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// Print all figures of a run, not the most important ones only
    #[arg(long, short, global = true)]
    pub verbose: bool,
    /// Use this many threads (default: all of the machine's); results do not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = threads)]
    pub threads: Option<NonZeroUsize>,
}

/// Maximum number of threads.
const MAX_THREADS: usize = 1024;

fn threads(text: &str) -> Result<NonZeroUsize, String> {
    let wrong = || format!("`{text}` is not a number of threads from 1 to {MAX_THREADS}");
    text.parse().ok().filter(|threads: &NonZeroUsize| threads.get() <= MAX_THREADS).ok_or_else(wrong)
}

/// Parts of the simulation other than the scene. A name is resolved as a path, then in scenes/ and specs/, then in the
/// program.
#[derive(Args)]
pub(super) struct ScenarioArguments {
    /// The head and its spring, a name under specs/heads/ or a file [default: handheld]
    #[arg(long, value_name = "NAME|FILE")]
    head: Option<String>,
    /// Motion of the base, under specs/motions/ [default: hand]
    #[arg(long, value_name = "NAME|FILE")]
    motion: Option<String>,
    /// The lidar, under specs/lidars/ [default: utm30lx]
    #[arg(long, value_name = "NAME|FILE")]
    lidar: Option<String>,
    /// The IMU, under specs/imus/ [default: 3dm_gx2]
    #[arg(long, value_name = "NAME|FILE")]
    imu: Option<String>,
    /// A second IMU, under specs/imus/, on the base (the handle, the vehicle): for `zsim base` [default: none]
    #[arg(long, value_name = "NAME|FILE")]
    base_imu: Option<String>,
    /// Sensor clocks (offset, drift, jitter, resolution), under specs/clocks/ [default: drifting]
    #[arg(long, value_name = "NAME|FILE")]
    clock: Option<String>,
    /// Faults of the sensors and of their delivery, under specs/faults/ [default: none]
    #[arg(long, value_name = "NAME|FILE")]
    faults: Option<String>,
    /// The route through the scene [default: the scene's own]
    #[arg(long, value_name = "NAME")]
    route: Option<String>,
    /// Duration: 120s, 2min, 90 [default: 120s]
    #[arg(long, value_name = "TIME", value_parser = quantity::seconds, allow_hyphen_values = true)]
    duration: Option<f64>,
    /// Random seed [default: 1]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
}

impl ScenarioArguments {
    pub(super) fn scenario(&self, scene: &str) -> Scenario {
        let default = Scenario::in_scene(scene);
        let or = |given: &Option<String>, default: String| given.clone().unwrap_or(default);
        Scenario {
            scene: default.scene,
            head: or(&self.head, default.head),
            motion: or(&self.motion, default.motion),
            lidar: or(&self.lidar, default.lidar),
            imu: or(&self.imu, default.imu),
            clock: or(&self.clock, default.clock),
            base_imu: self.base_imu.clone(),
            faults: self.faults.clone(),
            route: self.route.clone(),
            duration_s: self.duration.unwrap_or(default.duration_s),
            seed: self.seed.map_or(default.seed, Seed),
        }
    }
}

impl ScenarioArguments {
    /// The input files of a simulation in `scene` that are known by name: specs, and a recorded motion.
    pub(super) fn inputs(&self, scene: &str) -> Vec<PathBuf> {
        let scenario = self.scenario(scene);
        let inputs = zsim_base::spec::to_json(&scenario).unwrap_or_default();
        let names = inputs.as_object().into_iter().flatten();
        let files = names.filter_map(|(key, name)| spec_file(Kind::of_input(key)?, name.as_str()?));
        let recorded = zsim_motion::load(&scenario.motion).ok().and_then(|(spec, source)| spec.recorded_file(&source));
        files.chain(recorded).collect()
    }
}

/// Settings of the estimator.
#[derive(Args)]
pub(super) struct EstimatorSettings {
    /// The estimator's settings, a name under specs/estimators/ or a file
    #[arg(long, value_name = "NAME|FILE", default_value = "default")]
    estimator: String,
    /// How many fixed views to keep [default: the settings', 5]
    #[arg(long, value_name = "N")]
    fixed_views: Option<usize>,
}

impl EstimatorSettings {
    /// The file of the settings; `None` if they are built in.
    pub(super) fn file(&self) -> Option<PathBuf> {
        spec_file(Kind::Estimator, &self.estimator)
    }

    pub(super) fn spec(&self) -> anyhow::Result<EstimatorSpec> {
        let mut estimator = zsim_estimation::load(&self.estimator)?;
        estimator.fixed_views = self.fixed_views.unwrap_or(estimator.fixed_views);
        estimator.check().map_err(|error| Usage(error.to_string()))?;
        Ok(estimator)
    }
}

/// How to estimate.
#[derive(Args)]
pub(super) struct EstimatorArguments {
    #[command(flatten)]
    pub settings: EstimatorSettings,
    /// Stop before the global registration
    #[arg(long)]
    open_loop: bool,
    /// Estimate the lidar extrinsics too, starting from the calibration
    #[arg(long)]
    refine_extrinsics: bool,
    /// The cloud's files: cloud.ply, cloud.las, or both
    #[arg(long, value_name = "FORMAT", value_parser = cloud_format(), default_value = "ply")]
    cloud_format: CloudFormat,
    /// Keep mixed pixels, isolated points and moving points in the cloud
    #[arg(long)]
    keep_outliers: bool,
    /// Write trajectories, map and metrics alone: no cloud, no result.mcap, no plots, no page
    #[arg(long, conflicts_with_all = ["cloud_format", "keep_outliers"])]
    metrics_only: bool,
    /// Report the time that each part of the open loop took
    #[arg(long)]
    pub profile: bool,
}

/// Parses the formats in which the cloud is written.
fn cloud_format() -> impl TypedValueParser<Value = CloudFormat> {
    PossibleValuesParser::new(["ply", "las", "both"]).map(|name| match name.as_str() {
        "las" => CloudFormat::Las,
        "both" => CloudFormat::Both,
        _ => CloudFormat::Ply,
    })
}

impl EstimatorArguments {
    pub(super) fn options(&self) -> anyhow::Result<EstimateOptions> {
        let mut estimator = self.settings.spec()?;
        estimator.extrinsics.estimated |= self.refine_extrinsics;
        let options = CloudOptions { format: self.cloud_format, keep_outliers: self.keep_outliers };
        let cloud = (!self.metrics_only).then_some(options);
        Ok(EstimateOptions { closed_loop: !self.open_loop, cloud, ..EstimateOptions::with(estimator) })
    }
}

/// The file of a spec; `None` for a built-in one.
pub(super) fn spec_file(kind: Kind, name: &str) -> Option<PathBuf> {
    let source = find(kind, name).ok()?;
    source.folder.is_some().then(|| PathBuf::from(source.name))
}

/// Where results go.
#[derive(Args)]
pub(super) struct OutArguments {
    /// Folder for results; if it exists and is not empty, a number is appended to the name
    #[arg(long, short, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Write into the folder even if it exists
    #[arg(long)]
    pub force: bool,
}

/// Reads a calibration that a user wrote.
pub(super) fn calibration(path: Option<&Path>) -> anyhow::Result<CalibrationSpec> {
    match path {
        Some(path) => Ok(CalibrationSpec::read(path)?),
        None => Ok(CalibrationSpec::default()),
    }
}

/// Parses a pose on a map, `x,y,z,yaw` such as `4.2,50cm,0,90`: lengths, and the angle about the vertical.
pub(super) fn start(text: &str) -> Result<Pose, String> {
    let words: Vec<&str> = text.split(',').collect();
    let [x, y, z, yaw] = words[..] else {
        return Err(format!("x,y,z,yaw are needed, as in 4.2,0.5,0,90; here are {} numbers", words.len()));
    };
    let [x, y, z] = [x, y, z].map(quantity::metres);
    let (x, y, z, yaw_deg) = (x?, y?, z?, quantity::degrees(yaw)?);
    let turn = Rotation::from_axis_angle(&Vector::z_axis(), yaw_deg.to_radians());
    Ok(Pose::from_parts(Vector::new(x, y, z).into(), turn))
}
