//! The recording of a simulated run.

use crate::geometry::Pose;
use crate::measurement::{Calibration, ImuNoise, ImuSample, LidarScan, Sink, SinkError};
use crate::recording::RecordingError;
use crate::recording::message::clock::{self, Reading};
use crate::recording::message::imu::Variances;
use crate::recording::message::transforms::Transform;
use crate::recording::message::{imu, points, pose, scan, transforms};
use crate::recording::spool::Spool;
use crate::recording::topics::{self, Topic};
use crate::time::{Span, Stamp};
use crate::truth::{ClockTruth, TruthSample, TruthSink};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

/// Time between messages of `/ground_truth/odom` and `/tf`: 100 a second.
const ODOMETRY_PERIOD: Span = Span::from_nanos(10_000_000);

/// The IMU on the base, at its origin and along its axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseImuDescription {
    /// Its noise.
    pub noise: ImuNoise,
    /// Its rate, Hz.
    pub rate_hz: f64,
    /// Where the base is when nothing moves. `/tf_static` says this of it, as a robot's description does of a joint
    /// without an encoder: where the spring has it since, nobody measures.
    pub head_from_base: Pose,
}

/// What a recording says of the run beside its measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct RunDescription {
    /// How the sensors sit in the head, and their noise: for `/tf_static` and the IMU's covariances.
    pub calibration: Calibration,
    /// Rate of the IMU, Hz.
    pub imu_rate_hz: f64,
    /// The base's IMU, where it has one.
    pub base_imu: Option<BaseImuDescription>,
    /// The run's manifest, kept under the name `zsim`, key `manifest`.
    pub manifest: String,
    /// Whether `/tf` shows the true head in `map`, for looking; an estimate of one's own would contradict it.
    pub truth_tf: bool,
}

/// Writes an MCAP recording: measurements in the sensors' frames and clocks, truth under `/ground_truth/` alone.
///
/// A message's log time is its arrival, in true time. Memory is bounded, whatever the length of the run. Dropping a
/// writer makes what came so far readable; [`finish`](Self::finish) also tells whether that worked.
pub struct Writer {
    spool: Spool,
    run: RunDescription,
    variances: Variances,
    base_variances: Variances,
    began: bool,
    next_odometry: Stamp,
}

impl Writer {
    /// Begins a recording in a new file at `path`; one that is there is replaced.
    ///
    /// # Errors
    /// When the file cannot be made or written.
    pub fn create(path: &Path, run: RunDescription) -> Result<Self, RecordingError> {
        let file =
            std::fs::File::create(path).map_err(|source| RecordingError::File { path: path.to_owned(), source })?;
        Self::new(file, run)
    }

    /// Begins a recording in `file`, which is written from the start to the end.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn new<W: Write + Send + 'static>(file: W, run: RunDescription) -> Result<Self, RecordingError> {
        let version = ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned());
        let metadata = BTreeMap::from([("manifest".to_owned(), run.manifest.clone()), version]);
        let variances = Variances::of(&run.calibration.imu, run.imu_rate_hz);
        // Zeros, where nothing is known of it: that is how `sensor_msgs/Imu` says so.
        let unknown = Variances { gyro: 0.0, accel: 0.0 };
        let base_variances = run.base_imu.map_or(unknown, |imu| Variances::of(&imu.noise, imu.rate_hz));
        let next_odometry = Stamp::from_nanos(i64::MIN);
        let spool = Spool::new(file, metadata)?;
        Ok(Self { spool, run, variances, base_variances, began: false, next_odometry })
    }

    /// Writes what is left, then the summary and the index.
    ///
    /// # Errors
    /// When the file cannot be written; what was written before can be read.
    pub fn finish(self) -> Result<(), RecordingError> {
        self.spool.finish()
    }

    /// Writes `/tf_static` before everything else.
    fn begin(&mut self, now: Stamp) -> Result<(), RecordingError> {
        if self.began {
            return Ok(());
        }
        self.began = true;
        let within = |parent: &str, child: &str, parent_from_child: Pose| Transform {
            parent: parent.to_owned(),
            child: child.to_owned(),
            parent_from_child,
        };
        let mut sensors = vec![
            within(topics::HEAD, topics::LASER, self.run.calibration.head_from_laser),
            within(topics::HEAD, topics::IMU, self.run.calibration.head_from_imu),
        ];
        if let Some(imu) = &self.run.base_imu {
            sensors.push(within(topics::HEAD, topics::BASE, imu.head_from_base));
            sensors.push(within(topics::BASE, topics::BASE_IMU, Pose::identity()));
        }
        self.spool.message(Topic::TfStatic, now, |out| transforms::encode(out, now, &sensors))
    }

    fn write_truth(&mut self, now: Stamp, sample: &TruthSample) -> Result<(), RecordingError> {
        self.begin(now)?;
        let stamp = sample.lidar_stamp;
        let (head, base) = (&sample.head, &sample.base);
        let frame = topics::TRUTH_MAP;
        self.spool.message(Topic::TruthPose, now, |out| pose::encode(out, frame, stamp, &head.world_from_body))?;
        self.spool.message(Topic::TruthBase, now, |out| pose::encode(out, frame, stamp, &base.world_from_body))?;
        if now < self.next_odometry {
            return Ok(());
        }
        self.next_odometry = now.floor_to(ODOMETRY_PERIOD) + ODOMETRY_PERIOD;
        let frames = (frame, topics::TRUTH_HEAD);
        self.spool.message(Topic::TruthOdometry, now, |out| pose::encode_odometry(out, frames, stamp, head))?;
        if !self.run.truth_tf {
            return Ok(());
        }
        let head_in_map = Transform {
            parent: topics::MAP.to_owned(),
            child: topics::HEAD.to_owned(),
            parent_from_child: head.world_from_body,
        };
        self.spool.message(Topic::Tf, now, |out| transforms::encode(out, stamp, &[head_in_map]))
    }

    fn write_scan(&mut self, arrival: Stamp, scan: &LidarScan) -> Result<(), RecordingError> {
        self.begin(arrival)?;
        if let Some(planar) = &scan.planar {
            let stamp = scan.stamp;
            self.spool.message(Topic::Scan, arrival, |out| scan::encode(out, topics::LASER, stamp, planar))?;
        }
        self.spool.message(Topic::Points, arrival, |out| points::encode(out, topics::LASER, scan))
    }

    fn write_imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), RecordingError> {
        self.begin(arrival)?;
        let variances = self.variances;
        self.spool.message(Topic::Imu, arrival, |out| imu::encode(out, topics::IMU, sample, &variances))
    }

    fn write_base_imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), RecordingError> {
        self.begin(arrival)?;
        let variances = self.base_variances;
        self.spool.message(Topic::BaseImu, arrival, |out| imu::encode(out, topics::BASE_IMU, sample, &variances))
    }

    fn write_clock(&mut self, now: Stamp, clock: &ClockTruth) -> Result<(), RecordingError> {
        self.begin(now)?;
        let readings = [(topics::LASER, "lidar", clock.lidar_ahead), (topics::IMU, "imu", clock.imu_ahead)];
        for (frame, source, ahead) in readings {
            let reading = Reading { now, says: now + ahead, source };
            self.spool.message(Topic::TruthClock, now, |out| clock::encode(out, frame, &reading))?;
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
