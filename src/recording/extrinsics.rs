//! Reads the extrinsics of a recording's sensors from `/tf_static`, or from `/tf` if they are constant there.

use crate::container::{ChannelId, Messages};
use crate::frames::FrameTree;
use crate::message::transforms::{self, ReadTransform};
use crate::topics::{HEAD, shortened};
use crate::{Reader, RecordingError, Selection};
use std::collections::BTreeMap;
use zsim_base::geometry::Pose;
use zsim_base::measurement::Calibration;

/// Last part of the name of the topic of static transforms.
const STATIC: &str = "tf_static";
/// Last part of the name of the topic of repeated transforms.
const REPEATED: &str = "tf";

const REMEDY: &str = "Select another lidar or IMU topic, or give both poses in a calibration (`zsim estimate`: --lidar-topic, --imu-topic, \
                      --calibration); a lidar on a rotating mount is not supported";

/// Calibration, and the origin of the poses.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundCalibration {
    /// Calibration; the head is the body frame.
    pub calibration: Calibration,
    /// Frame whose pose an estimate reports.
    pub body_frame: String,
    /// Whether the poses are from the recording's transforms; otherwise they are the defaults.
    pub from_recording: bool,
    /// Source of the poses if not `/tf_static`, and broken frames that are not needed.
    ///
    /// One sentence each.
    pub notes: Vec<String>,
}

/// The trees of static transforms: `/tf_static`, and those of namespaces.
#[derive(Debug, Default)]
pub(super) struct Frames(BTreeMap<String, FrameTree>);

impl Frames {
    /// Whether a tree connects two frames; true if there is no tree.
    pub fn connects(&self, target: &str, source: &str) -> bool {
        self.is_empty() || matches!(self.target_from_source(target, source), Ok(Some(_)))
    }

    fn is_empty(&self) -> bool {
        self.0.values().all(FrameTree::is_empty)
    }

    /// Computes `target_from_source` by the first tree that connects the frames.
    ///
    /// `None` if none does.
    ///
    /// # Errors
    /// When a transform between them is not usable: which, and why.
    pub fn target_from_source(&self, target: &str, source: &str) -> Result<Option<Pose>, String> {
        let mut refusal = Ok(None);
        for tree in self.0.values() {
            match tree.target_from_source(target, source) {
                Ok(None) => {}
                Ok(pose) => return Ok(pose),
                Err(problem) => refusal = Err(problem),
            }
        }
        refusal
    }
}

impl Reader {
    /// Calibration of the selected sensors: poses from `/tf_static`, noise from `defaults`.
    ///
    /// If `/tf_static` does not connect the sensors, that of a namespace is used, then transforms of `/tf` that do not change.
    /// Without transforms the poses are from `defaults` too.
    ///
    /// The body is `body_frame` if given, else `head` if the tree contains it, else the IMU's frame.
    ///
    /// # Errors
    /// When the file cannot be read, the transforms do not connect the sensors and the body, or one between them is not usable.
    pub fn calibration(
        &self,
        selection: &Selection,
        defaults: &Calibration,
        body_frame: Option<&str>,
    ) -> Result<FoundCalibration, RecordingError> {
        let frames = self.frames()?;
        let wanted = Wanted { selection, body_frame, defaults };
        let static_refusal = match wanted.of_static(&frames) {
            Ok(found) => return Ok(found),
            Err(refusal) => refusal,
        };
        let repeated = self.read_trees(REPEATED, FrameTree::add_repeated)?;
        let refusals = match wanted.of_repeated(&frames, &repeated) {
            Ok(found) => return Ok(found),
            Err(refusal) => static_refusal.into_iter().chain(refusal).collect::<Vec<_>>(),
        };
        if !refusals.is_empty() {
            let problem = format!("{}. {REMEDY}", refusals.join(". "));
            return Err(RecordingError::Frames { name: self.name().to_owned(), problem });
        }
        let (calibration, body_frame) = (defaults.clone(), body_frame.unwrap_or(HEAD).to_owned());
        Ok(FoundCalibration { calibration, body_frame, from_recording: false, notes: Vec::new() })
    }

    /// Reads the trees of static transforms.
    ///
    /// # Errors
    /// When the file cannot be read. Transforms that are not usable are part of the tree.
    pub(super) fn frames(&self) -> Result<Frames, RecordingError> {
        Ok(Frames(self.read_trees(STATIC, FrameTree::add_static)?))
    }

    /// Reads the tree of each topic whose name ends with `ending`.
    fn read_trees(
        &self,
        ending: &str,
        add: fn(&mut FrameTree, ReadTransform),
    ) -> Result<BTreeMap<String, FrameTree>, RecordingError> {
        let is_wanted = |topic: &str| topic.rsplit('/').next() == Some(ending);
        let channels = self.channels().iter().filter(|c| is_wanted(&c.topic) && transforms::is_type(&c.type_name));
        let topics: BTreeMap<ChannelId, &str> = channels.map(|channel| (channel.id, channel.topic.as_str())).collect();
        if topics.is_empty() {
            return Ok(BTreeMap::new());
        }
        let ids: Vec<ChannelId> = topics.keys().copied().collect();
        let trees = read_trees_from(self.messages_in_blocks_of(&ids), &topics, add)?;
        // An index has no checksum and may be wrong.
        if trees.is_empty() { read_trees_from(self.messages(), &topics, add) } else { Ok(trees) }
    }
}

fn read_trees_from(
    mut messages: Messages<'_>,
    topics: &BTreeMap<ChannelId, &str>,
    add: fn(&mut FrameTree, ReadTransform),
) -> Result<BTreeMap<String, FrameTree>, RecordingError> {
    let mut trees: BTreeMap<String, FrameTree> = BTreeMap::new();
    while let Some(message) = messages.next()? {
        let Some(topic) = topics.get(&message.channel) else { continue };
        // A message that cannot be decoded has no transform: the sensors are then not connected, which is reported.
        for transform in transforms::decode(message.data).unwrap_or_default() {
            let tree = trees.entry((*topic).to_owned()).or_default();
            add(tree, transform);
        }
    }
    Ok(trees)
}

/// Whether a topic of static transforms is in no namespace.
fn is_plain(topic: &str) -> bool {
    topic.trim_start_matches('/') == STATIC
}

/// Why the pose of a sensor is not known.
enum NoPose {
    /// The tree does not connect it to the body.
    Unconnected(String),
    /// A transform between them is not usable.
    Unusable(String),
}

/// Sensors whose poses are wanted.
struct Wanted<'a> {
    selection: &'a Selection,
    body_frame: Option<&'a str>,
    defaults: &'a Calibration,
}

impl Wanted<'_> {
    /// Finds the poses by the first tree of static transforms that connects the sensors.
    ///
    /// The error is why the first tree does not, if there is one.
    fn of_static(&self, frames: &Frames) -> Result<FoundCalibration, Option<String>> {
        let mut trees: Vec<_> = frames.0.iter().filter(|(_, tree)| !tree.is_empty()).collect();
        let is_of_lidar = |topic: &str| self.selection.lidar_topic.starts_with(topic.trim_end_matches(STATIC));
        trees.sort_by_key(|(topic, _)| (!is_plain(topic), !is_of_lidar(topic)));
        let mut refusal = None;
        for (topic, tree) in trees {
            let origin = (!is_plain(topic)).then(|| format!("The poses of the sensors are from {}.", shortened(topic)));
            match self.poses(tree, origin, tree.problems()) {
                Ok(found) => return Ok(found),
                Err(NoPose::Unconnected(text)) => {
                    refusal.get_or_insert_with(|| format!("{} {text}", shortened(topic)));
                }
                Err(NoPose::Unusable(problem)) => {
                    refusal.get_or_insert_with(|| format!("{} is not usable: {problem}", shortened(topic)));
                }
            }
        }
        Err(refusal)
    }

    /// Finds the poses by transforms of `repeated` that do not change.
    ///
    /// Static transforms of the same namespace belong to them. The error is why they are not usable, if they join the sensors.
    fn of_repeated(
        &self,
        frames: &Frames,
        repeated: &BTreeMap<String, FrameTree>,
    ) -> Result<FoundCalibration, Option<String>> {
        let [lidar, imu] = [&self.selection.lidar_frame, &self.selection.imu_frame];
        let mut refusal = None;
        for (topic, repeated) in repeated {
            let fixed = frames.0.get(&format!("{topic}_static")).cloned().unwrap_or_default();
            let problems = fixed.problems();
            let mut tree = fixed;
            tree.extend(repeated);
            if lidar == imu || !tree.contains(lidar) || !tree.contains(imu) {
                continue;
            }
            let topic = shortened(topic);
            let origin = format!("The poses of the sensors are from {topic}, where they are constant.");
            match self.poses(&tree, Some(origin), problems) {
                Ok(found) => return Ok(found),
                Err(NoPose::Unusable(problem)) => {
                    let (lidar, imu) = (shortened(lidar), shortened(imu));
                    refusal = Some(format!("{topic} joins the frames {lidar} and {imu}, but {problem}"));
                }
                Err(NoPose::Unconnected(_)) => {}
            }
        }
        Err(refusal)
    }

    /// Finds the poses by a tree.
    ///
    /// `origin` states where it is from, `problems` which of its transforms are not usable.
    fn poses(
        &self,
        tree: &FrameTree,
        origin: Option<String>,
        problems: Vec<String>,
    ) -> Result<FoundCalibration, NoPose> {
        let fallback = if tree.contains(HEAD) { HEAD } else { self.selection.imu_frame.as_str() };
        let body = self.body_frame.unwrap_or(fallback);
        let find = |frame: &str| {
            let pose = tree.target_from_source(body, frame).map_err(NoPose::Unusable)?;
            pose.ok_or_else(|| {
                let (frame, body) = (shortened(frame), shortened(body));
                NoPose::Unconnected(format!("does not connect frame {frame} to {body}; it has {}", tree.names()))
            })
        };
        let head_from_laser = find(&self.selection.lidar_frame)?;
        let head_from_imu = find(&self.selection.imu_frame)?;
        let calibration = Calibration { head_from_laser, head_from_imu, ..self.defaults.clone() };
        let unneeded = |problem: String| format!("Not used, and not needed: {problem}.");
        let notes = origin.into_iter().chain(problems.into_iter().map(unneeded)).collect();
        Ok(FoundCalibration { calibration, body_frame: body.to_owned(), from_recording: true, notes })
    }
}
