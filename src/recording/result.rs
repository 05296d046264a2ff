//! Writes an estimate as a recording for viewers: pose of the head, path, and point cloud.

use crate::mcap_writer::McapWriter;
use crate::message::transforms::Transform;
use crate::message::{points, pose, transforms};
use crate::topics::{MAP, Topic};
use crate::{CloudPoint, RecordingError};
use std::collections::BTreeMap;
use std::path::Path;
use zsim_base::files;
use zsim_base::geometry::{Pose, PoseCovariance, Trajectory};
use zsim_base::time::{Span, Stamp};

/// Interval between poses of `/path`.
const PATH_PERIOD: Span = Span::from_nanos(100_000_000);

/// Maximum time span of one `/cloud` message.
const CLOUD_PERIOD: Span = Span::from_nanos(500_000_000);

/// Maximum number of points in one `/cloud` message: 20 bytes each.
const CLOUD_POINTS: usize = 50_000;

/// Writes an estimate as a new MCAP file.
///
/// Topics: `/path`; `/pose` with the given covariances, each at the stamp of a pose and in order of time; `/tf` (`map`
/// to `body_frame`, one transform per pose); `/cloud` (x, y, z, intensity, error, in `map`), in the order of the given
/// points.
pub struct ResultWriter<'a> {
    mcap: McapWriter,
    body_frame: &'a str,
    map_from_body: &'a Trajectory,
    /// Number of written poses.
    written: usize,
    covariances: &'a [(Stamp, PoseCovariance)],
    /// Log time of the previous message: it never decreases, although point stamps may.
    last: Stamp,
    gathered: Vec<CloudPoint>,
}

impl<'a> ResultWriter<'a> {
    /// Creates the file at `path` and writes the path of the body.
    ///
    /// # Errors
    /// When the file cannot be created or written, or a stamp does not fit into a message.
    pub fn create(
        path: &Path,
        body_frame: &'a str,
        map_from_body: &'a Trajectory,
        covariances: &'a [(Stamp, PoseCovariance)],
    ) -> Result<Self, RecordingError> {
        let file = files::create(path).map_err(|source| RecordingError::File { path: path.to_owned(), source })?;
        let mcap = McapWriter::new(file, BTreeMap::new())?;
        let (last, gathered) = (Stamp::from_nanos(0), Vec::new());
        let mut result = Self { mcap, body_frame, map_from_body, written: 0, covariances, last, gathered };
        result.path()?;
        Ok(result)
    }

    /// Adds a point of the cloud, in the map frame.
    ///
    /// # Errors
    /// When the file cannot be written, or a stamp does not fit into a message.
    pub fn point(&mut self, point: CloudPoint) -> Result<(), RecordingError> {
        if self.is_full_before(&point) {
            self.transforms_until(self.latest_gathered())?;
            self.cloud()?;
        }
        self.gathered.push(point);
        Ok(())
    }

    /// Writes the remaining poses and points, and completes the file.
    ///
    /// # Errors
    /// When the file cannot be written, or a stamp does not fit into a message.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        if let Some((_, last)) = self.map_from_body.span() {
            self.transforms_until(last)?;
        }
        self.cloud()?;
        self.mcap.finish()
    }

    fn transforms_until(&mut self, end: Stamp) -> Result<(), RecordingError> {
        let (stamps, poses) = (self.map_from_body.stamps(), self.map_from_body.poses());
        while let Some(stamp) = stamps.get(self.written).filter(|stamp| **stamp <= end) {
            self.transform(*stamp, &poses[self.written])?;
            self.written += 1;
        }
        Ok(())
    }

    fn log_time(&mut self, stamp: Stamp) -> Stamp {
        self.last = self.last.max(stamp);
        self.last
    }

    fn path(&mut self) -> Result<(), RecordingError> {
        let Some((first, _)) = self.map_from_body.span() else { return Ok(()) };
        let mut next = first;
        let mut selected = Vec::new();
        for (stamp, pose) in self.map_from_body.iter() {
            if stamp >= next {
                selected.push((stamp, pose));
                next = stamp + PATH_PERIOD;
            }
        }
        let log_time = self.log_time(first);
        self.mcap.message(Topic::Path, log_time, |out| pose::encode_path(out, MAP, first, selected.into_iter()))
    }

    fn transform(&mut self, stamp: Stamp, map_from_body: &Pose) -> Result<(), RecordingError> {
        let transform =
            Transform { parent: MAP.to_owned(), child: self.body_frame.to_owned(), parent_from_child: *map_from_body };
        let log_time = self.log_time(stamp);
        self.mcap.message(Topic::Tf, log_time, |out| transforms::encode(out, stamp, &[transform]))?;
        while let Some(((at, covariance), rest)) = self.covariances.split_first().filter(|((at, _), _)| *at <= stamp) {
            self.covariances = rest;
            if *at == stamp {
                self.mcap.message(Topic::Pose, log_time, |out| {
                    pose::encode_uncertain(out, MAP, stamp, map_from_body, covariance)
                })?;
            }
        }
        Ok(())
    }

    fn is_full_before(&self, point: &CloudPoint) -> bool {
        let first = self.gathered.first().map_or(point.stamp, |first| first.stamp);
        self.gathered.len() >= CLOUD_POINTS || point.stamp - first >= CLOUD_PERIOD
    }

    fn latest_gathered(&self) -> Stamp {
        self.gathered.last().map_or(self.last, |point| point.stamp)
    }

    fn cloud(&mut self) -> Result<(), RecordingError> {
        if self.gathered.is_empty() {
            return Ok(());
        }
        let stamp = self.latest_gathered();
        let log_time = self.log_time(stamp);
        let gathered = std::mem::take(&mut self.gathered);
        let rows = gathered.iter().map(|point| {
            let p = &point.point_in_map;
            [p.x, p.y, p.z, point.intensity, point.error_m]
        });
        let names = ["x", "y", "z", "intensity", "error"];
        self.mcap.message(Topic::Cloud, log_time, |out| points::encode_floats(out, MAP, stamp, names, rows))?;
        self.gathered = gathered;
        self.gathered.clear();
        Ok(())
    }
}
