//! `zsim live`: estimate from ROS 2 topics while they are published.

use super::NetworkArguments;
use super::bridge::Bridge;
use super::session::{Limits, Session, Setup};
use super::sources::Sources;
use super::start::gather;
use crate::arguments::{self, EstimatorSettings, Global, OutArguments, calibration};
use crate::bars::{WorkBar, stop_flag};
use crate::completion::Completion;
use crate::{output, quantity};
use clap::Args;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use zsim_base::geometry::Pose;
use zsim_recording::TopicPreference;
use zsim_run::MapOptions;

/// Estimate trajectory and map from live ROS 2 topics
///
/// Subscribes to a lidar and an IMU (and /tf_static, for where they sit), and publishes /tf and /odom (the newest poses,
/// with every step of the window), /path and /cloud (final poses, some seconds later) and /diagnostics (the status, once a
/// second). It is the open loop of `zsim estimate`: with --out the topics are recorded, and `zsim estimate
/// DIR/recording.mcap` closes the loops. DDS is that of the program zsim-ros2, which must be in the folder of zsim or on
/// the path.
#[derive(Args)]
#[command(after_help = "Examples:\n  zsim live --out results/today\n  zsim live --lidar-topic /scan --imu-topic \
                        /imu/data_raw --calibration head.ron --idle 5s")]
pub(crate) struct LiveCommand {
    /// The lidar's topic [default: found]
    #[arg(long, value_name = "TOPIC")]
    lidar_topic: Option<String>,
    /// The IMU's topic [default: found]
    #[arg(long, value_name = "TOPIC")]
    imu_topic: Option<String>,
    #[command(flatten)]
    estimator: EstimatorSettings,
    /// RON file with extrinsics and noise of the sensors, as of `zsim estimate`
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Localise the head in this map of an earlier run (its map.ply); the poses are then in the frame of the map
    #[arg(long, value_name = "MAP.ply")]
    map: Option<PathBuf>,
    /// Initial position and yaw in the map, accurate to a metre and twenty degrees: metres, and degrees about the
    /// vertical [default: the whole map is searched]
    #[arg(long, value_name = "X,Y,Z,YAW", value_parser = arguments::start, requires = "map", allow_hyphen_values = true)]
    start: Option<Pose>,
    /// End after this time [default: with Ctrl-C]
    #[arg(long, value_name = "TIME", value_parser = quantity::seconds, allow_hyphen_values = true)]
    duration: Option<f64>,
    /// End when no measurement has arrived for this time [default: never]
    #[arg(long, value_name = "TIME", value_parser = quantity::seconds, allow_hyphen_values = true)]
    idle: Option<f64>,
    /// Record the topics as recording.mcap, and the trajectory as open_loop.tum [default: neither]
    #[command(flatten)]
    out: OutArguments,
    #[command(flatten)]
    network: NetworkArguments,
}

pub(crate) fn run(command: &LiveCommand, global: &Global) -> anyhow::Result<Completion> {
    let (spec, given) = (command.estimator.spec()?, calibration(command.calibration.as_deref())?);
    let within = |path: &PathBuf| MapOptions::read(path, command.start, false);
    let map = command.map.as_ref().map(within).transpose()?;
    let mut bridge = Bridge::start(command.network.domain()?, &command.network.peers())?;
    let stop = stop_flag();
    let started = Instant::now();
    let until = command.duration.map(|seconds| started + Duration::from_secs_f64(seconds));
    let preference = TopicPreference { lidar_topic: command.lidar_topic.clone(), imu_topic: command.imu_topic.clone() };
    let bar = WorkBar::new(global, "live");
    let mut sources = Sources::new(preference.clone());
    let hint = command.network.hint();
    let start = gather(&mut bridge, &mut sources, until, || stop.load(Ordering::Relaxed), hint, &bar)?;
    let sensors = start.finish(&preference, &given)?;
    let unusable: Vec<String> = sensors.selection.unusable_topics().collect();
    sensors.selection.notes.iter().chain(&unusable).chain(&sensors.found.notes).for_each(|note| bar.note(note));
    if !sensors.found.from_recording && (given.head_from_laser.is_none() || given.head_from_imu.is_none()) {
        bar.note(
            "no /tf_static has arrived: assuming that lidar and IMU coincide and have the same axes; if not, pass the \
             extrinsics with --calibration",
        );
    }
    bar.note(&format!("lidar {}, IMU {}", sensors.selection.lidar_topic, sensors.selection.imu_topic));
    let used = TopicPreference {
        lidar_topic: Some(sensors.selection.lidar_topic.clone()),
        // The accelerations may have a topic of their own.
        imu_topic: sensors.selection.acceleration_topic().is_none().then(|| sensors.selection.imu_topic.clone()),
    };
    sources.keep(&used, &mut bridge)?;

    // A folder only once there is something to write.
    let folder = command.out.out.as_deref().map(|wanted| output::folder(wanted, command.out.force)).transpose()?;
    if let Some(folder) = &folder {
        let inputs = [&command.map, &command.calibration].into_iter().flatten();
        output::check_not_inputs(inputs, ["recording.mcap", "open_loop.tum"].map(|name| folder.join(name)))?;
    }
    let folder_path = folder.as_ref().map(|folder| folder.to_path_buf());
    let setup = Setup { spec, calibration: sensors.found.calibration.clone(), map };
    let mut session = Session::new(setup, &sensors, folder_path.as_deref(), bridge)?;
    let limits = Limits { stop, until, idle: command.idle.map(Duration::from_secs_f64) };
    session.take_start(&sensors)?;
    session.follow(&mut sources, &limits, &bar)?;
    drop(bar);
    session.finish(global, folder_path.as_deref())
}
