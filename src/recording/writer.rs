//! Writes the recording of a simulated run.

use crate::RecordingError;
use crate::mcap_writer::McapWriter;
use crate::message::clock::{self, ClockReading};
use crate::message::imu::Variances;
use crate::message::transforms::Transform;
use crate::message::{imu, points, pose, scan, transforms};
use crate::topics::{self, Topic};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use zsim_base::files;
use zsim_base::geometry::{Pose, PoseCovariance};
use zsim_base::measurement::{Calibration, ImuNoise, ImuSample, LidarScan, Sink, SinkError};
use zsim_base::time::{Span, Stamp};
use zsim_truth::{ClockTruth, TruthSample, TruthSink};

/// Interval between messages of `/ground_truth/odom` and `/tf`: 100 Hz.
const ODOMETRY_PERIOD: Span = Span::from_nanos(10_000_000);

/// IMU on the base, at the base's origin and along its axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseImuDescription {
    /// Noise.
    pub noise: ImuNoise,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Pose of the base in the head with the spring at rest.
    ///
    /// It is written to `/tf_static` like a joint without an encoder in a robot description: the deflection of the
    /// spring is not measured.
    pub head_from_base: Pose,
}

/// Description of the run in a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct RunDescription {
    /// Extrinsics and noise of the sensors, for `/tf_static` and the IMU's covariances.
    pub calibration: Calibration,
    /// Sample rate of the IMU, Hz.
    pub imu_rate_hz: f64,
    /// IMU on the base, if there is one.
    pub base_imu: Option<BaseImuDescription>,
    /// Manifest of the run, stored under the name `zsim`, key `manifest`.
    pub manifest: String,
    /// Whether to write the true head pose in `map` to `/tf`, for visualisation; it conflicts with an estimate's.
    pub truth_tf: bool,
}

/// Writes an MCAP recording.
///
/// Measurements are in the sensors' frames and clocks; ground truth is under `/ground_truth/` only.
///
/// The log time of a message is its arrival in true time. Memory is bounded for runs of any length. Dropping a writer
/// makes the messages so far readable; [`finish`](Self::finish) also reports errors.
pub struct Writer {
    mcap: McapWriter,
    run: RunDescription,
    variances: Variances,
    base_variances: Variances,
    has_started: bool,
    next_odometry: Stamp,
}

impl Writer {
    /// Creates a recording in a new file at `path`, replacing an existing one.
    ///
    /// # Errors
    /// When the file cannot be created or written.
    pub fn create(path: &Path, run: RunDescription) -> Result<Self, RecordingError> {
        let file = files::create(path).map_err(|source| RecordingError::File { path: path.to_owned(), source })?;
        Self::new(file, run)
    }

    /// Starts a recording in `file`, which is written sequentially.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn new<W: Write + Send + 'static>(file: W, run: RunDescription) -> Result<Self, RecordingError> {
        let version = ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned());
        let metadata = BTreeMap::from([("manifest".to_owned(), run.manifest.clone()), version]);
        let variances = Variances::from_noise(&run.calibration.imu, run.imu_rate_hz);
        // Zero covariances mean unknown in `sensor_msgs/Imu`.
        let unknown = Variances { gyro: 0.0, accel: 0.0 };
        let base_variances = run.base_imu.map_or(unknown, |imu| Variances::from_noise(&imu.noise, imu.rate_hz));
        let next_odometry = Stamp::from_nanos(i64::MIN);
        let mcap = McapWriter::new(file, metadata)?;
        Ok(Self { mcap, run, variances, base_variances, has_started: false, next_odometry })
    }

    /// Writes the last chunk, the summary and the index.
    ///
    /// # Errors
    /// When the file cannot be written; the part written before is readable.
    pub fn finish(self) -> Result<(), RecordingError> {
        self.mcap.finish()
    }

    /// Writes `/tf_static` before all other messages.
    fn start(&mut self, now: Stamp) -> Result<(), RecordingError> {
        if self.has_started {
            return Ok(());
        }
        self.has_started = true;
        let transform = |parent: &str, child: &str, parent_from_child: Pose| Transform {
            parent: parent.to_owned(),
            child: child.to_owned(),
            parent_from_child,
        };
        let mut sensors = vec![
            transform(topics::HEAD, topics::LASER, self.run.calibration.head_from_laser),
            transform(topics::HEAD, topics::IMU, self.run.calibration.head_from_imu),
        ];
        if let Some(imu) = &self.run.base_imu {
            sensors.push(transform(topics::HEAD, topics::BASE, imu.head_from_base));
            sensors.push(transform(topics::BASE, topics::BASE_IMU, Pose::identity()));
        }
        self.mcap.message(Topic::TfStatic, now, |out| transforms::encode(out, now, &sensors))
    }

    fn write_truth(&mut self, now: Stamp, sample: &TruthSample) -> Result<(), RecordingError> {
        self.start(now)?;
        let stamp = sample.lidar_stamp;
        let (head, base) = (&sample.head, &sample.base);
        let frame = topics::TRUTH_MAP;
        self.mcap.message(Topic::TruthPose, now, |out| pose::encode(out, frame, stamp, &head.world_from_body))?;
        self.mcap.message(Topic::TruthBase, now, |out| pose::encode(out, frame, stamp, &base.world_from_body))?;
        if now < self.next_odometry {
            return Ok(());
        }
        self.next_odometry = now.floor_to(ODOMETRY_PERIOD) + ODOMETRY_PERIOD;
        let child = topics::TRUTH_HEAD;
        // The truth has no covariance.
        let head_exactly = (head, &PoseCovariance::zeros());
        self.mcap
            .message(Topic::TruthOdometry, now, |out| pose::encode_odometry(out, frame, child, stamp, head_exactly))?;
        if !self.run.truth_tf {
            return Ok(());
        }
        let head_in_map = Transform {
            parent: topics::MAP.to_owned(),
            child: topics::HEAD.to_owned(),
            parent_from_child: head.world_from_body,
        };
        self.mcap.message(Topic::Tf, now, |out| transforms::encode(out, stamp, &[head_in_map]))
    }

    fn write_scan(&mut self, arrival: Stamp, scan: &LidarScan) -> Result<(), RecordingError> {
        self.start(arrival)?;
        if let Some(planar) = &scan.planar {
            let stamp = scan.stamp;
            self.mcap.message(Topic::Scan, arrival, |out| scan::encode(out, topics::LASER, stamp, planar))?;
        }
        self.mcap.message(Topic::Points, arrival, |out| points::encode(out, topics::LASER, scan))
    }

    fn write_imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), RecordingError> {
        self.start(arrival)?;
        let variances = self.variances;
        self.mcap.message(Topic::Imu, arrival, |out| imu::encode(out, topics::IMU, sample, &variances))
    }

    fn write_base_imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), RecordingError> {
        self.start(arrival)?;
        let variances = self.base_variances;
        self.mcap.message(Topic::BaseImu, arrival, |out| imu::encode(out, topics::BASE_IMU, sample, &variances))
    }

    fn write_clock(&mut self, now: Stamp, clock: &ClockTruth) -> Result<(), RecordingError> {
        self.start(now)?;
        let readings = [(topics::LASER, "lidar", clock.lidar_offset), (topics::IMU, "imu", clock.imu_offset)];
        for (frame, source, offset) in readings {
            let reading = ClockReading { now, clock_time: now + offset, source };
            self.mcap.message(Topic::TruthClock, now, |out| clock::encode(out, frame, &reading))?;
        }
        Ok(())
    }
}

impl Sink for Writer {
    fn imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), SinkError> {
        Ok(self.write_imu(arrival, sample)?)
    }

    fn base_imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), SinkError> {
        Ok(self.write_base_imu(arrival, sample)?)
    }

    fn lidar(&mut self, arrival: Stamp, scan: &LidarScan) -> Result<(), SinkError> {
        Ok(self.write_scan(arrival, scan)?)
    }
}

impl TruthSink for Writer {
    fn truth(&mut self, now: Stamp, sample: &TruthSample) -> Result<(), SinkError> {
        Ok(self.write_truth(now, sample)?)
    }

    fn clock(&mut self, now: Stamp, clock: &ClockTruth) -> Result<(), SinkError> {
        Ok(self.write_clock(now, clock)?)
    }
}
