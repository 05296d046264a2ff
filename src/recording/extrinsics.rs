//! Reads the extrinsics of a recording's sensors from `/tf_static`.

use crate::container::{ChannelId, Messages};
use crate::message::transforms::{self, Transform};
use crate::schema::MessageType;
use crate::topics::HEAD;
use crate::{Reader, RecordingError, Selection};
use std::collections::BTreeMap;
use zsim_base::geometry::Pose;
use zsim_base::measurement::Calibration;

/// Calibration, and the origin of the poses.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundCalibration {
    /// Calibration; the head is the body frame.
    pub calibration: Calibration,
    /// Frame whose pose an estimate reports.
    pub body_frame: String,
    /// Whether the poses are from `/tf_static`; otherwise they are the defaults.
    pub from_recording: bool,
}

impl Reader {
    /// Calibration of the selected sensors: poses from `/tf_static`, noise from `defaults`.
    ///
    /// Without `/tf_static`, the poses are from `defaults` too.
    ///
    /// The body is `body_frame` if given, else `head` if the tree contains it, else the IMU's frame.
    ///
    /// # Errors
    /// When the file cannot be read, or the tree does not connect the sensors and the body.
    pub fn calibration(
        &self,
        selection: &Selection,
        defaults: &Calibration,
        body_frame: Option<&str>,
    ) -> Result<FoundCalibration, RecordingError> {
        let tree = self.frame_tree()?;
        let fallback = if tree.contains(HEAD) { HEAD } else { selection.imu_frame.as_str() };
        let body = body_frame.unwrap_or(fallback);
        let mut calibration = defaults.clone();
        if tree.is_empty() {
            let body_frame = body_frame.unwrap_or(HEAD).to_owned();
            return Ok(FoundCalibration { calibration, body_frame, from_recording: false });
        }
        let find = |frame: &str| {
            tree.target_from_source(body, frame).ok_or_else(|| RecordingError::Frames {
                name: self.name().to_owned(),
                problem: format!(
                    "does not connect frame {frame} to {body}; it has {}. Select another sensor with --lidar-topic or --imu-topic, \
                     or give both poses with --calibration; a lidar on a rotating mount (/tf) is not supported",
                    tree.names()
                ),
            })
        };
        calibration.head_from_laser = find(&selection.lidar_frame)?;
        calibration.head_from_imu = find(&selection.imu_frame)?;
        Ok(FoundCalibration { calibration, body_frame: body.to_owned(), from_recording: true })
    }

    /// Whether `/tf_static` connects two frames; true if there is no tree.
    pub(super) fn connects(&self, target: &str, source: &str) -> bool {
        // Errors of the tree are reported where poses are read from it.
        let tree = self.frame_tree().unwrap_or_default();
        tree.is_empty() || tree.target_from_source(target, source).is_some()
    }

    /// Reads the tree of `/tf_static`.
    pub(super) fn frame_tree(&self) -> Result<FrameTree, RecordingError> {
        let is_static = |topic: &str| topic.trim_start_matches('/') == "tf_static";
        let channels =
            self.channels().iter().filter(|c| is_static(&c.topic) && MessageType::Transforms.is_named(&c.type_name));
        let ids: Vec<ChannelId> = channels.map(|channel| channel.id).collect();
        let tree = self.read_frame_tree(self.messages_in_blocks_of(&ids), &ids)?;
        if ids.is_empty() || !tree.is_empty() { Ok(tree) } else { self.read_frame_tree(self.messages(), &ids) }
    }

    fn read_frame_tree(&self, mut messages: Messages<'_>, ids: &[ChannelId]) -> Result<FrameTree, RecordingError> {
        let mut tree = FrameTree::default();
        while let Some(message) = messages.next()? {
            if !ids.contains(&message.channel) {
                continue;
            }
            let decoded = transforms::decode(message.data).map_err(|error| error.to_string());
            for transform in decoded.map_err(|problem| self.frames_error(problem))? {
                tree.add(transform).map_err(|problem| self.frames_error(problem))?;
            }
        }
        Ok(tree)
    }

    fn frames_error(&self, problem: String) -> RecordingError {
        RecordingError::Frames { name: self.name().to_owned(), problem }
    }
}

/// Tree of frames, each with a parent and the pose in it.
#[derive(Debug, Clone, Default)]
pub(super) struct FrameTree {
    parents: BTreeMap<String, (String, Pose)>,
}

impl FrameTree {
    fn is_empty(&self) -> bool {
        self.parents.is_empty()
    }

    fn contains(&self, frame: &str) -> bool {
        self.parents.iter().any(|(child, (parent, _))| child == frame || parent == frame)
    }

    fn names(&self) -> String {
        let edges: Vec<_> = self.parents.iter().map(|(child, (parent, _))| format!("{parent} -> {child}")).collect();
        edges.join(", ")
    }

    /// Adds a transform.
    ///
    /// A repeated transform replaces the earlier one; a different parent is an error.
    fn add(&mut self, transform: Transform) -> Result<(), String> {
        let Transform { parent, child, parent_from_child } = transform;
        match self.parents.get(&child) {
            Some((known, _)) if *known != parent => {
                Err(format!("gives frame {child} two parents, {known} and {parent}"))
            }
            _ => {
                self.parents.insert(child, (parent, parent_from_child));
                Ok(())
            }
        }
    }

    /// Computes `target_from_source`; `None` if the frames have different roots.
    pub(super) fn target_from_source(&self, target: &str, source: &str) -> Option<Pose> {
        let (target_root, root_from_target) = self.root_of(target)?;
        let (source_root, root_from_source) = self.root_of(source)?;
        (target_root == source_root).then(|| root_from_target.inverse() * root_from_source)
    }

    /// Root above `frame` and `root_from_frame`; `None` if the tree has a cycle.
    fn root_of<'a>(&'a self, frame: &'a str) -> Option<(&'a str, Pose)> {
        let (mut current, mut root_from_frame) = (frame, Pose::identity());
        for _ in 0..=self.parents.len() {
            match self.parents.get(current) {
                None => return Some((current, root_from_frame)),
                Some((parent, parent_from_at)) => {
                    root_from_frame = parent_from_at * root_from_frame;
                    current = parent;
                }
            }
        }
        None
    }
}
