//! Publishes an estimate while it is computed.

use super::bridge::Bridge;
use super::depth_of;
use super::frame::{Frame, Quality, RosTopic, TopicId};
use std::collections::VecDeque;
use std::time::{Duration, Instant};
use zsim_base::geometry::{Kinematics, Pose, Trajectory, Vector};
use zsim_base::measurement::{LidarScan, Measurement};
use zsim_base::time::{Span, Stamp};
use zsim_estimation::EstimatedPose;
use zsim_recording::{CloudPoint, Diagnostic, EstimateMessages, EstimateTopic};

/// Time between poses of the path, at first.
const PATH_PERIOD: Span = Span::from_nanos(200_000_000);
/// Maximum number of poses of the path: at more, every second one is dropped.
const MAX_PATH: usize = 2000;
/// Time between paths, and between diagnostics.
const SLOW_PERIOD: Duration = Duration::from_secs(1);
/// Maximum number of scans that wait for the poses of their time: 26 s of a lidar with 40 scans a second.
const MAX_WAITING: usize = 1024;
/// Final poses that are kept for the scans that wait, s.
const KEPT_POSES_S: f64 = 5.0;

/// Publishes poses, path and cloud.
pub(super) struct EstimatePublisher {
    messages: EstimateMessages,
    head_from_laser: Pose,
    /// The newest pose that was published, and its stamp.
    newest: Option<(Stamp, Pose)>,
    path: Vec<(Stamp, Pose)>,
    path_period: Span,
    path_published: Option<Instant>,
    /// Final poses of the last seconds.
    final_poses: VecDeque<(Stamp, Pose)>,
    waiting: VecDeque<LidarScan>,
}

impl EstimatePublisher {
    /// Announces the topics.
    pub(super) fn new(body_frame: &str, head_from_laser: Pose, bridge: &mut Bridge) -> anyhow::Result<Self> {
        for topic in EstimateTopic::ALL {
            let named = RosTopic { name: topic.name().to_owned(), type_name: topic.type_name().to_owned() };
            let quality = Quality { reliable: true, transient_local: false, depth: depth_of(topic.type_name()) };
            bridge.send(&Frame::Advertise(id(topic), named, quality))?;
        }
        Ok(Self::again(body_frame, head_from_laser))
    }

    /// Publishes another estimate on the topics that are announced already.
    pub(super) fn again(body_frame: &str, head_from_laser: Pose) -> Self {
        Self {
            messages: EstimateMessages { body_frame: body_frame.to_owned() },
            head_from_laser,
            newest: None,
            path: Vec::new(),
            path_period: PATH_PERIOD,
            path_published: None,
            final_poses: VecDeque::new(),
            waiting: VecDeque::new(),
        }
    }

    /// The frame whose pose is estimated.
    pub(super) fn body_frame(&self) -> &str {
        &self.messages.body_frame
    }

    /// Stamp of the newest pose that was published.
    pub(super) fn newest(&self) -> Option<Stamp> {
        self.newest.map(|(stamp, _)| stamp)
    }

    /// Keeps a scan until the poses of its time are final.
    pub(super) fn keep(&mut self, measurement: &Measurement) {
        if let Measurement::Lidar(scan) = measurement {
            if self.waiting.len() == MAX_WAITING {
                self.waiting.pop_front();
            }
            self.waiting.push_back(scan.clone());
        }
    }

    /// Publishes the newest poses on `/tf` and `/odom`.
    pub(super) fn publish_newest(&mut self, poses: &[EstimatedPose], bridge: &mut Bridge) -> anyhow::Result<()> {
        for pose in poses {
            let map_from_body = pose.map_from_head;
            let angular_velocity = self.newest.map_or_else(Vector::zeros, |(stamp, before)| {
                let turn = map_from_body.rotation * before.rotation.inverse();
                turn.scaled_axis() / pose.stamp.seconds_since(stamp).max(1e-6)
            });
            let motion = Kinematics {
                velocity_in_world: pose.velocity_in_map_m_per_s,
                angular_velocity_in_world: angular_velocity,
                ..Kinematics::at_rest(map_from_body)
            };
            let odometry = self.messages.odometry(pose.stamp, &motion, &pose.covariance)?;
            let transform = self.messages.transform(pose.stamp, &map_from_body)?;
            bridge.send(&Frame::Publish(id(EstimateTopic::Tf), transform))?;
            bridge.send(&Frame::Publish(id(EstimateTopic::Odometry), odometry))?;
            self.newest = Some((pose.stamp, map_from_body));
        }
        Ok(())
    }

    /// Publishes what has become final: the cloud of the scans, and from time to time the path.
    pub(super) fn publish_final(&mut self, poses: &[EstimatedPose], bridge: &mut Bridge) -> anyhow::Result<()> {
        for pose in poses {
            self.final_poses.push_back((pose.stamp, pose.map_from_head));
            if self.path.last().is_none_or(|(last, _)| pose.stamp - *last >= self.path_period) {
                self.path.push((pose.stamp, pose.map_from_head));
            }
        }
        if self.path.len() > MAX_PATH {
            self.thin_path();
        }
        let Some((newest, _)) = self.final_poses.back().copied() else { return Ok(()) };
        self.publish_cloud(newest, bridge)?;
        while self.final_poses.front().is_some_and(|(first, _)| newest.seconds_since(*first) > KEPT_POSES_S) {
            self.final_poses.pop_front();
        }
        if self.path_published.is_none_or(|last| last.elapsed() >= SLOW_PERIOD) {
            self.path_published = Some(Instant::now());
            let path = self.messages.path(newest, &self.path)?;
            bridge.send(&Frame::Publish(id(EstimateTopic::Path), path))?;
        }
        Ok(())
    }

    /// Drops every second pose of the path.
    fn thin_path(&mut self) {
        let kept = self.path.iter().step_by(2).copied().collect();
        self.path = kept;
        self.path_period = self.path_period + self.path_period;
    }

    /// Publishes the points of the scans that ended before `newest`.
    fn publish_cloud(&mut self, newest: Stamp, bridge: &mut Bridge) -> anyhow::Result<()> {
        let trajectory = Trajectory::from_poses(self.final_poses.iter().copied())?;
        let end = |scan: &LidarScan| scan.stamp + scan.returns.last().map_or(Span::ZERO, |last| last.offset);
        let mut points = Vec::new();
        while self.waiting.front().is_some_and(|scan| end(scan) <= newest) {
            let Some(scan) = self.waiting.pop_front() else { break };
            points.extend(scan.returns.iter().filter_map(|each| {
                let stamp = scan.stamp + each.offset;
                let map_from_laser = trajectory.at(stamp)? * self.head_from_laser;
                let point = map_from_laser * nalgebra::Point3::from(each.point_in_laser.cast::<f64>());
                let point_in_map = point.coords.cast();
                Some(CloudPoint { point_in_map, intensity: each.intensity, stamp, error_m: f32::NAN })
            }));
        }
        if points.is_empty() {
            return Ok(());
        }
        let cloud = self.messages.cloud(newest, &points)?;
        bridge.send(&Frame::Publish(id(EstimateTopic::Cloud), cloud))
    }

    /// Publishes the status.
    pub(super) fn publish_status(
        &self,
        stamp: Stamp,
        diagnostic: &Diagnostic,
        bridge: &mut Bridge,
    ) -> anyhow::Result<()> {
        let message = self.messages.diagnostics(stamp, diagnostic)?;
        bridge.send(&Frame::Publish(id(EstimateTopic::Diagnostics), message))
    }
}

/// Number of a topic, which is not that of a subscription: both have numbers of their own.
fn id(topic: EstimateTopic) -> TopicId {
    topic as TopicId
}
