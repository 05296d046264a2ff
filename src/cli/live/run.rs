//! The state of a run as its live page shows it.

use super::frame::{Frame, Return};
use super::growing::Cursor;
use super::map::ThinnedMap;
use super::path::{GrowingPath, RecentPoses};
use std::collections::VecDeque;
use zsim_base::geometry::{Pose, Vector};
use zsim_base::time::Stamp;
use zsim_estimation::Event;
use zsim_report::page::{LiveEnd, LivePoint, LiveScan, LiveUpdate, LiveVerdict, TimedPose, TruePoses, Volume};
use zsim_run::Stage;

/// Maximum number of points and of poses in an update.
const MAX_ITEMS: usize = 20_000;
/// Maximum number of scans that wait for the poses of their time; 26 s of a lidar with 40 scans a second.
const MAX_WAITING: usize = 1024;
/// Number of scans that are kept for pages.
const KEPT_SCANS: usize = 24;
/// Time between kept scans, s.
const SCAN_PERIOD_S: f64 = 0.1;
/// Maximum number of events and of notes.
const MAX_EVENTS: usize = 100;

/// How much of a run a page has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct PageState {
    pub version: u64,
    pub points: Cursor,
    pub estimate: Cursor,
    pub truth: Cursor,
    /// Number of the first scan that it lacks.
    pub next_scan: u64,
}

/// The state of a run.
#[derive(Debug)]
pub(super) struct LiveRun {
    volume: Volume,
    version: u64,
    /// Stamp of the first measurement or pose, from which times count.
    origin: Option<Stamp>,
    stage: &'static str,
    fraction: Option<f64>,
    done_s: f64,
    head_from_laser: Pose,
    /// Alignment of the estimate at its first pose with the truth; the identity without truth.
    view_from_map: Option<Pose>,
    truth: GrowingPath<TruePoses>,
    estimate: GrowingPath<TimedPose>,
    recent: RecentPoses,
    waiting: VecDeque<Vec<Return>>,
    map: ThinnedMap,
    scans: VecDeque<LiveScan>,
    next_scan: u64,
    verdict: Option<LiveVerdict>,
    notes: Vec<String>,
    warnings: Vec<Event>,
    /// Notes and warnings.
    events: Vec<String>,
    end: Option<LiveEnd>,
}

impl LiveRun {
    pub(super) fn new(volume: Volume) -> Self {
        Self {
            volume,
            version: 1,
            origin: None,
            stage: "starting",
            fraction: None,
            done_s: 0.0,
            head_from_laser: Pose::identity(),
            view_from_map: None,
            truth: GrowingPath::default(),
            estimate: GrowingPath::default(),
            recent: RecentPoses::default(),
            waiting: VecDeque::new(),
            map: ThinnedMap::new(volume),
            scans: VecDeque::new(),
            next_scan: 0,
            verdict: None,
            notes: Vec::new(),
            warnings: Vec::new(),
            events: Vec::new(),
            end: None,
        }
    }

    /// Takes in a frame.
    pub(super) fn take(&mut self, frame: Frame) {
        self.version += 1;
        match frame {
            Frame::Start { stage, head_from_laser } => self.start(stage, head_from_laser),
            Frame::Progress { stage, fraction, done_s } => {
                (self.stage, self.fraction, self.done_s) = (name(stage), fraction, done_s);
            }
            Frame::Note(text) => {
                add(&mut self.notes, text);
                self.list_events();
            }
            Frame::Truth { stamp, head, base } => {
                let t_s = self.seconds(stamp);
                self.truth.push(TruePoses { t_s, head, base });
                self.recent.push(TimedPose { t_s, pose: head });
            }
            Frame::Scan(returns) => {
                self.waiting.push_back(returns);
                if self.waiting.len() > MAX_WAITING {
                    self.waiting.pop_front();
                }
            }
            Frame::Poses(poses) => poses.into_iter().for_each(|(stamp, pose)| self.take_pose(stamp, &pose)),
            Frame::Verdict { verdict, warnings } => {
                (self.verdict, self.warnings) = (Some(verdict), warnings);
                self.list_events();
            }
        }
        self.project();
    }

    /// Ends the run.
    pub(super) fn end(&mut self, end: LiveEnd, verdict: Option<LiveVerdict>) {
        self.version += 1;
        self.end = Some(end);
        self.verdict = verdict.or(self.verdict.take());
    }

    pub(super) fn has_ended(&self) -> bool {
        self.end.is_some()
    }

    /// Whether a page with this state lacks something.
    pub(super) fn is_newer_than(&self, page: &PageState) -> bool {
        page.version != self.version
            || !self.map.points().is_complete_at(page.points)
            || !self.estimate.poses().is_complete_at(page.estimate)
            || !self.truth.poses().is_complete_at(page.truth)
    }

    /// What a page with this state lacks, as JSON.
    pub(super) fn update(&self, page: &PageState) -> Result<String, serde_json::Error> {
        let oldest = self.next_scan - self.scans.len() as u64;
        let known = page.next_scan.saturating_sub(oldest).min(self.scans.len() as u64) as usize;
        let update = LiveUpdate {
            version: self.version,
            stage: self.stage,
            fraction: self.fraction,
            done_s: self.done_s,
            points: self.map.points().since(page.points, MAX_ITEMS),
            estimate: self.estimate.poses().since(page.estimate, MAX_ITEMS),
            truth: self.truth.poses().since(page.truth, MAX_ITEMS),
            scans: self.scans.range(known..).collect(),
            next_scan: self.next_scan,
            verdict: self.verdict.as_ref(),
            events: &self.events,
            end: self.end.as_ref(),
        };
        update.json(&self.volume)
    }

    /// Starts a stage: the map grows again, from its scans.
    fn start(&mut self, stage: Stage, head_from_laser: Pose) {
        (self.stage, self.fraction, self.done_s) = (name(stage), None, 0.0);
        self.head_from_laser = head_from_laser;
        self.recent.clear();
        self.waiting.clear();
        self.scans.clear();
        self.map.clear();
    }

    fn take_pose(&mut self, stamp: Stamp, map_from_head: &Pose) {
        let t_s = self.seconds(stamp);
        let Some(view_from_map) = self.view_from_map.or_else(|| self.aligned(t_s, map_from_head)) else { return };
        self.view_from_map = Some(view_from_map);
        let pose = TimedPose { t_s, pose: view_from_map * map_from_head };
        self.estimate.push(pose);
        self.recent.push(pose);
    }

    /// The transform from the map to the world that is right for this pose; the identity without truth, and `None` if
    /// the truth does not cover the time.
    fn aligned(&self, t_s: f64, map_from_head: &Pose) -> Option<Pose> {
        let truth = self.truth.poses().items();
        if truth.is_empty() {
            return Some(Pose::identity());
        }
        let after = truth.partition_point(|poses| poses.t_s < t_s).max(1);
        let [before, next] = [after - 1, after].map(|k| truth.get(k).copied());
        let share = (t_s - before?.t_s) / (next?.t_s - before?.t_s);
        let world_from_head = before?.head.try_lerp_slerp(&next?.head, share, 1e-6)?;
        Some(world_from_head * map_from_head.inverse())
    }

    /// Projects the waiting scans whose poses are known.
    fn project(&mut self) {
        while let (Some(end_s), Some(scan)) = (self.recent.end_s(), self.waiting.front()) {
            let Some(last) = scan.last().map(|last| last.stamp) else {
                self.waiting.pop_front();
                continue;
            };
            if self.seconds(last) > end_s {
                return;
            }
            let scan = self.waiting.pop_front().unwrap_or_default();
            self.project_scan(&scan);
        }
    }

    fn project_scan(&mut self, scan: &[Return]) {
        let mut points: Vec<Vector> = Vec::with_capacity(scan.len());
        let mut last_s = 0.0;
        for each in scan {
            let t_s = self.seconds(each.stamp);
            let Some(view_from_head) = self.recent.at(t_s) else { continue };
            let laser = view_from_head * self.head_from_laser;
            let position = laser.rotation * each.point_in_laser + laser.translation.vector;
            self.map.add(LivePoint { position, t_s });
            points.push(position);
            last_s = t_s;
        }
        let is_due = self.scans.back().is_none_or(|last| last_s - last.t_s >= SCAN_PERIOD_S);
        points.retain(|point| self.volume.contains(point));
        if is_due && !points.is_empty() {
            self.scans.push_back(LiveScan { t_s: last_s, points });
            self.next_scan += 1;
            if self.scans.len() > KEPT_SCANS {
                self.scans.pop_front();
            }
        }
    }

    /// Time since the first stamp, s.
    fn seconds(&mut self, stamp: Stamp) -> f64 {
        stamp.seconds_since(*self.origin.get_or_insert(stamp))
    }

    /// Lists notes and warnings. At the end of the estimate its warnings are notes too, which are not repeated.
    fn list_events(&mut self) {
        let timed = |warning: &Event| {
            let t_s = self.origin.map_or(0.0, |origin| warning.from.seconds_since(origin));
            (t_s, warning.kind.to_string())
        };
        let warnings: Vec<(f64, String)> = self.warnings.iter().map(timed).collect();
        let is_repeated = |note: &&String| warnings.iter().any(|(_, sentence)| note.contains(sentence));
        let notes = self.notes.iter().filter(|note| !is_repeated(note)).cloned();
        self.events = notes.chain(warnings.iter().map(|(t_s, sentence)| format!("{t_s:.1} s: {sentence}"))).collect();
    }
}

/// Adds a text; if there are too many, the oldest one is removed.
fn add(texts: &mut Vec<String>, text: String) {
    if texts.len() >= MAX_EVENTS {
        texts.remove(0);
    }
    texts.push(text);
}

fn name(stage: Stage) -> &'static str {
    match stage {
        Stage::Simulating => "simulating: true trajectory, points in their true places",
        Stage::Estimating => "estimating: trajectory and map by the estimator",
        Stage::ClosingLoops => "closing loops; the map is that of the open loop",
        Stage::Evaluating => "comparing with the truth, and writing the map",
        Stage::Registering => "registering the cloud",
        Stage::Bounding => "computing the information bound",
        Stage::Reporting => "writing plots and report",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::geometry::Rotation;
    use zsim_base::time::Span;
    use zsim_estimation::EventKind;

    fn stamp(t_s: f64) -> Stamp {
        Stamp::from_nanos(1_000_000_000_000) + Span::from_seconds(t_s)
    }

    fn at_x(x_m: f64) -> Pose {
        Pose::translation(x_m, 0.0, 1.0)
    }

    fn scan(t_s: f64) -> Frame {
        Frame::Scan(vec![Return { stamp: stamp(t_s), point_in_laser: Vector::new(3.0, 0.0, 0.0) }])
    }

    fn start(stage: Stage) -> Frame {
        Frame::Start { stage, head_from_laser: Pose::translation(0.0, 0.0, 0.5) }
    }

    fn points(run: &LiveRun) -> Vec<Vector> {
        run.map.points().items().iter().map(|point| point.position).collect()
    }

    #[test]
    fn a_scan_waits_for_the_poses_of_its_time() {
        let mut run = LiveRun::new(Volume::default());
        run.take(start(Stage::Estimating));
        run.take(Frame::Poses(vec![(stamp(0.0), at_x(0.0))]));
        run.take(scan(0.5));
        assert!(points(&run).is_empty());
        run.take(Frame::Poses(vec![(stamp(1.0), at_x(2.0))]));
        // Half way between the poses the laser is at x = 1 and z = 1.5, and the point 3 m ahead of it.
        assert!((points(&run)[0] - Vector::new(4.0, 0.0, 1.5)).norm() < 1e-9, "{:?}", points(&run));
    }

    #[test]
    fn the_estimate_is_aligned_with_the_truth_at_its_first_pose() {
        let mut run = LiveRun::new(Volume::default());
        let turned = Rotation::from_euler_angles(0.0, 0.0, 1.0);
        let truth = |x_m: f64| Pose::from_parts(Vector::new(x_m, 5.0, 1.0).into(), turned);
        run.take(start(Stage::Simulating));
        for k in 0..100 {
            let (t_s, head) = (f64::from(k) * 0.02, truth(f64::from(k) * 0.1));
            run.take(Frame::Truth { stamp: stamp(t_s), head, base: head });
        }
        run.take(start(Stage::Estimating));
        run.take(Frame::Poses(vec![(stamp(0.2), Pose::identity()), (stamp(0.4), Pose::translation(1.0, 0.0, 0.0))]));
        let estimate: Vec<Pose> = run.estimate.poses().items().iter().map(|each| each.pose).collect();
        assert!((estimate[0].translation.vector - Vector::new(1.0, 5.0, 1.0)).norm() < 1e-9);
        // One metre ahead in the map is one metre at a yaw of 1 rad in the world.
        let moved = estimate[1].translation.vector - estimate[0].translation.vector;
        assert!((moved - Vector::new(1_f64.cos(), 1_f64.sin(), 0.0)).norm() < 1e-9);
    }

    #[test]
    fn a_warning_that_is_also_a_note_is_listed_once() {
        let mut run = LiveRun::new(Volume::default());
        run.take(Frame::Poses(vec![(stamp(0.0), at_x(0.0))]));
        let verdict = LiveVerdict { status: "good".to_owned(), reason: String::new() };
        run.take(Frame::Verdict { verdict, warnings: vec![Event::at(stamp(4.0), EventKind::ImuGap { seconds: 0.1 })] });
        let sentence = "no IMU sample for 0.100 s; bridged by interpolation";
        run.take(Frame::Note(format!("4.00 s: {sentence} (2 times, last at 5.00 s)")));
        run.take(Frame::Note("another note".to_owned()));
        assert_eq!(run.events, ["another note", &format!("4.0 s: {sentence}")]);
    }

    #[test]
    fn a_page_that_has_everything_lacks_nothing_until_the_next_frame() {
        let mut run = LiveRun::new(Volume::default());
        run.take(start(Stage::Estimating));
        run.take(scan(0.0));
        run.take(Frame::Poses(vec![(stamp(0.0), at_x(0.0))]));
        let one = Cursor { restart: 1, count: 1 };
        let truth = Cursor { restart: 1, count: 0 };
        let points = Cursor { restart: 2, count: 1 };
        let page = PageState { version: run.version, points, estimate: one, truth, next_scan: 1 };
        assert!(!run.is_newer_than(&page));
        run.take(Frame::Note("a note".to_owned()));
        assert!(run.is_newer_than(&page));
        let update: serde_json::Value = serde_json::from_str(&run.update(&page).unwrap()).unwrap();
        assert_eq!((&update["points"]["count"], &update["scans"]), (&0.into(), &serde_json::json!([])));
        assert_eq!(update["events"][0], "a note");
    }
}
