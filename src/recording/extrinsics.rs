//! How a recording's sensors sit in its head, from `/tf_static`.

use crate::geometry::Pose;
use crate::measurement::Calibration;
use crate::recording::container::{ChannelId, Messages};
use crate::recording::message::transforms::{self, Transform};
use crate::recording::schema::MessageType;
use crate::recording::topics::HEAD;
use crate::recording::{Reader, RecordingError, Selection};
use std::collections::BTreeMap;

/// A calibration, and where its poses come from.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundCalibration {
    /// The calibration; its head is the body frame.
    pub calibration: Calibration,
    /// The frame whose pose an estimate tells.
    pub body_frame: String,
    /// Whether the poses are those of `/tf_static`; else they are the defaults'.
    pub from_recording: bool,
}

impl Reader {
    /// The poses of the selected sensors from `/tf_static`, the noise from `defaults`; where the recording has no
    /// `/tf_static`, all from `defaults`.
    ///
    /// The body is `body_frame` where it is given, else `head` where the tree has it, else the IMU's frame.
    ///
    /// # Errors
    /// When the file cannot be read, or the tree does not connect the sensors and the body.
    pub fn calibration(
        &self,
        selection: &Selection,
        defaults: &Calibration,
        body_frame: Option<&str>,
    ) -> Result<FoundCalibration, RecordingError> {
        let tree = self.frames()?;
        let fallback = if tree.knows(HEAD) { HEAD } else { selection.imu_frame.as_str() };
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
                    "does not connect frame {frame} to {body}; it has {}. Name another sensor with --lidar-topic or --imu-topic, \
                     or tell both poses with --calibration; a lidar that a motor turns, by /tf, cannot be estimated with",
                    tree.names()
                ),
            })
        };
        calibration.head_from_laser = find(&selection.lidar_frame)?;
        calibration.head_from_imu = find(&selection.imu_frame)?;
        Ok(FoundCalibration { calibration, body_frame: body.to_owned(), from_recording: true })
    }

    /// Whether `/tf_static` connects two frames, or there is none to say so.
    pub(super) fn connects(&self, target: &str, source: &str) -> bool {
        // What is wrong with the tree is said where poses are asked of it.
        let tree = self.frames().unwrap_or_default();
        tree.is_empty() || tree.target_from_source(target, source).is_some()
    }

    /// The tree of `/tf_static`.
    pub(super) fn frames(&self) -> Result<FrameTree, RecordingError> {
        let is_static = |topic: &str| topic.trim_start_matches('/') == "tf_static";
        let channels =
            self.channels().iter().filter(|c| is_static(&c.topic) && MessageType::Transforms.is_named(&c.type_name));
        let ids: Vec<ChannelId> = channels.map(|channel| channel.id).collect();
        let tree = self.frames_among(self.messages_near(&ids), &ids)?;
        if ids.is_empty() || !tree.is_empty() { Ok(tree) } else { self.frames_among(self.messages(), &ids) }
    }

    fn frames_among(&self, mut messages: Messages<'_>, ids: &[ChannelId]) -> Result<FrameTree, RecordingError> {
        let mut tree = FrameTree::default();
        while let Some(message) = messages.next()? {
            if !ids.contains(&message.channel) {
                continue;
            }
            let found = transforms::decode(message.data).map_err(|error| error.to_string());
            for transform in found.map_err(|problem| self.frames_error(problem))? {
                tree.add(transform).map_err(|problem| self.frames_error(problem))?;
            }
        }
        Ok(tree)
    }

    fn frames_error(&self, problem: String) -> RecordingError {
        RecordingError::Frames { name: self.name().to_owned(), problem }
    }
}

/// Frames, each in its parent.
#[derive(Debug, Clone, Default)]
pub(super) struct FrameTree {
    parents: BTreeMap<String, (String, Pose)>,
}

impl FrameTree {
    fn is_empty(&self) -> bool {
        self.parents.is_empty()
    }

    fn knows(&self, frame: &str) -> bool {
        self.parents.iter().any(|(child, (parent, _))| child == frame || parent == frame)
    }

    fn names(&self) -> String {
        let edges: Vec<_> = self.parents.iter().map(|(child, (parent, _))| format!("{parent} -> {child}")).collect();
        edges.join(", ")
    }

    /// Takes up a transform. One that is told again is told anew; another parent is a contradiction.
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

    /// `target_from_source`, where both hang from one root.
    pub(super) fn target_from_source(&self, target: &str, source: &str) -> Option<Pose> {
        let (target_root, root_from_target) = self.root_of(target)?;
        let (source_root, root_from_source) = self.root_of(source)?;
        (target_root == source_root).then(|| root_from_target.inverse() * root_from_source)
    }

    /// The root above `frame`, and `root_from_frame`; `None` where the tree goes in a circle.
    fn root_of<'a>(&'a self, frame: &'a str) -> Option<(&'a str, Pose)> {
        let (mut at, mut root_from_frame) = (frame, Pose::identity());
        for _ in 0..=self.parents.len() {
            match self.parents.get(at) {
                None => return Some((at, root_from_frame)),
                Some((parent, parent_from_at)) => {
                    root_from_frame = parent_from_at * root_from_frame;
                    at = parent;
                }
            }
        }
        None
    }
}
