//! The motion that the sensors measured, without the influence of fixed views: input of the registration.

use crate::observed::{MotionByViews, ObservedSurfels};
use crate::views::Views;
use crate::window::{Linearised, LocalMotion, Window};
use std::collections::VecDeque;
use zsim_base::geometry::Pose;

/// The motion is taken from this part of the window: in the middle it has most matches on both sides.
const MIDDLE: f64 = 0.5;

/// Motion without views of times that are not final yet.
#[derive(Debug, Default)]
pub(super) struct SensedMotion {
    pending: VecDeque<PendingMotion>,
    /// End of the last pending motion, trajectory time, s.
    until_s: Option<f64>,
}

/// Motion between two times, trajectory time, s.
#[derive(Debug)]
struct PendingMotion {
    from_s: f64,
    until_s: f64,
    motion: LocalMotion,
    /// `map_from_imu` at `from_s` and lidar time, s, when they are final.
    start: Option<(Pose, f64)>,
}

impl SensedMotion {
    /// Takes the motion from the middle of `window`, whose poses up to `final_s`, trajectory time, become final.
    pub(super) fn advance(
        &mut self,
        window: &mut Window,
        at: &Linearised,
        views: &Views,
        final_s: f64,
        observed: &mut ObservedSurfels,
    ) {
        let from_s = self.until_s.unwrap_or(f64::NEG_INFINITY).max(window.start_s());
        let until_s = final_s + MIDDLE * (window.nominal.end_s() - final_s);
        if until_s > from_s {
            let motion = window.motion_without_views(from_s, until_s, at, views);
            self.pending.extend(motion.map(|motion| PendingMotion { from_s, until_s, motion, start: None }));
            self.until_s = Some(until_s);
        }
        // The first motion begins with the window, whose states from there on are still known.
        self.settle(window, final_s, observed);
    }

    /// Moves motion before `final_s` to `observed`.
    pub(super) fn settle(&mut self, window: &Window, final_s: f64, observed: &mut ObservedSurfels) {
        let clock = &window.unknowns.clock;
        for motion in self.pending.iter_mut().filter(|motion| motion.from_s <= final_s && motion.start.is_none()) {
            motion.start = Some((window.pose_at(motion.from_s), clock.lidar_s(motion.from_s)));
        }
        let settled = self.pending.iter().take_while(|motion| motion.until_s <= final_s).count();
        for PendingMotion { until_s, motion, start, .. } in self.pending.drain(..settled) {
            let Some((map_from_imu, from_s)) = start else { continue };
            let LocalMotion { imu_from_later_imu, covariance_per_s } = motion;
            let change = map_from_imu * imu_from_later_imu * window.pose_at(until_s).inverse();
            let until_s = clock.lidar_s(until_s);
            observed.by_views.push(MotionByViews { from_s, until_s, change, covariance_per_s });
        }
    }
}
