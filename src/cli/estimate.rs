//! `zsim estimate`: the estimator on any recording.

use super::Completion;
use super::arguments::{EstimatorArguments, Global, OutArguments, calibration, start};
use super::bars::Bars;
use super::live::LiveArguments;
use super::{full_run, output};
use clap::Args;
use std::path::PathBuf;
use zsim_base::geometry::Pose;
use zsim_recording::{Reader, TopicPreference};
use zsim_report::page::LivePage;
use zsim_run::{EstimateOptions, MapOptions, ProgressMonitor};

/// Estimate trajectory and map from a recording of any program
///
/// Lidar and IMU are found among the topics (LaserScan, MultiEchoLaserScan, PointCloud2 or Livox CustomMsg, and Imu),
/// and where they sit in the head is read from /tf_static. Where the recording has the truth, the estimate is judged by
/// it.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  zsim estimate recording.mcap --out results/recording --fixed-views 2\n  zsim estimate \
                        tuesday.mcap --map results/monday/map.ply --start 4.2,0.5,0,90 --extend-map"
)]
pub(super) struct Arguments {
    /// The recording: MCAP, a ROS 1 bag, a rosbag2 database, or a folder of rosbag2
    #[arg(value_name = "RECORDING")]
    recording: PathBuf,
    #[command(flatten)]
    estimator: EstimatorArguments,
    /// RON file with extrinsics and noise of the sensors, for values that the recording does not contain:
    /// (head_from_laser: (position_m: (0, 0, 0)), head_from_imu: (position_m: (0, 0, -0.08), roll_pitch_yaw_deg: (0, 0,
    /// 180))); docs/guide/recordings.md has all keys, noise among them. Or a YAML file of Kalibr or allan_variance_ros
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Ignore the sensor models (noise, IMU averaging) in the manifest of a simulated recording, and assume those of unknown
    /// sensors; the evaluation against the truth still uses the manifest
    #[arg(long)]
    ignore_manifest: bool,
    /// The frame whose pose is written [default: head where /tf_static has it, else the IMU's]
    #[arg(long, value_name = "NAME")]
    body_frame: Option<String>,
    /// The lidar's topic [default: found]
    #[arg(long, value_name = "TOPIC")]
    lidar_topic: Option<String>,
    /// The IMU's topic [default: found]
    #[arg(long, value_name = "TOPIC")]
    imu_topic: Option<String>,
    /// Localise the head in this map of an earlier run (its map.ply); the trajectory is then in the frame of
    /// the map
    #[arg(long, value_name = "MAP.ply")]
    map: Option<PathBuf>,
    /// Initial position and yaw in the map, accurate to a metre and twenty degrees: metres, and degrees about the
    /// vertical [default: the whole map is searched]
    #[arg(long, value_name = "X,Y,Z,YAW", value_parser = start, requires = "map", allow_hyphen_values = true)]
    start: Option<Pose>,
    /// Extend the map with this recording and write it as map.ply
    #[arg(long, requires = "map")]
    extend_map: bool,
    #[command(flatten)]
    out: OutArguments,
    #[command(flatten)]
    live: LiveArguments,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let within = |path: &PathBuf| MapOptions::read(path, arguments.start, arguments.extend_map);
    let options = EstimateOptions {
        map: arguments.map.as_ref().map(within).transpose()?,
        calibration: calibration(arguments.calibration.as_deref())?,
        ignore_manifest: arguments.ignore_manifest,
        body_frame: arguments.body_frame.clone(),
        ..arguments.estimator.options()?
    };
    // Open the recording first: a recording that is missing, or lacks a sensor, must not create a folder.
    let reader = Reader::open(&arguments.recording)?;
    let (lidar_topic, imu_topic) = (arguments.lidar_topic.clone(), arguments.imu_topic.clone());
    let selection = reader.select(&TopicPreference { lidar_topic, imu_topic })?;
    let stem = arguments.recording.file_stem().unwrap_or_default().to_string_lossy();
    let live = arguments.live.start(|| LivePage::of_recording(&stem))?;
    let wanted = arguments.out.out.clone().unwrap_or_else(|| full_run::default_folder(&stem));
    let folder = output::folder(&wanted, arguments.out.force)?;
    let files = [Some(arguments.recording.clone()), arguments.map.clone(), arguments.calibration.clone()];
    let inputs = files.into_iter().chain([arguments.estimator.settings.file()]).flatten();
    output::check_not_inputs(inputs, zsim_run::estimate_files().iter().map(|name| folder.join(name)))?;

    let bars = Bars::new(global);
    full_run::note_other_folder(&folder, &wanted, &bars);
    let work =
        |watch: &mut ProgressMonitor| zsim_run::estimate_recording(&reader, &selection, &folder, &options, watch);
    let outcome = full_run::observed(work, live, bars, &folder)?;
    full_run::print_outcome(global, &outcome, arguments.estimator.profile, &folder)
}
