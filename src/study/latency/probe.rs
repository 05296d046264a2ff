//! What every run is judged by: a sample of the beams, and the truth.

use super::cut::Cut;
use crate::evaluation::Thinning;
use crate::geometry::{Pose, Trajectory, Vector};
use crate::measurement::{Calibration, LidarScan, Measurement};
use crate::recording::{Reader, Selection};
use crate::study::StudyError;
use crate::study::cloud::Surroundings;
use crate::study::true_clock::TrueClock;
use crate::study::truth_cursor::TruthCursor;
use crate::time::{Span, Stamp};
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering};

/// About how many beams are judged.
const JUDGED: usize = 60_000;
/// Most beams in the cut.
const SHOWN: usize = 6000;

/// What of the cut is shown, along it and up, m, and how far from its centre that may lie.
const SHOWN_M: (f64, f64) = (3.6, 2.8);
const REACH_M: (f64, f64) = (5.0, 2.4);
/// Side of the cells by which it is told where most is seen, m.
const CELL_M: f64 = 0.05;

/// A beam that truly ended on what stands.
#[derive(Debug, Clone, Copy)]
pub(super) struct ProbeBeam {
    /// Its scan, by the order in which they came.
    pub scan: usize,
    /// When it was fired, after the scan's stamp.
    pub offset: Span,
    /// Where it ended, in the lidar's frame, m.
    pub point_in_laser: Vector,
}

/// The recording as far as runs are judged by it.
pub(super) struct Probe {
    /// `world_from_head` in lidar time.
    pub truth: Trajectory,
    /// The clocks' true offset.
    pub clock: TrueClock,
    /// The stamps of the scans, in the order in which they came.
    pub scan_stamps: Vec<Stamp>,
    /// The beams that are judged.
    pub judged: Vec<ProbeBeam>,
    /// The cut that is shown.
    pub cut: Cut,
    /// What of it is shown, along it and up, m.
    pub range_m: ((f64, f64), (f64, f64)),
    /// The beams in that.
    pub shown: Vec<ProbeBeam>,
    /// The head's true rate of rotation in the cut's plane for each of these, degrees/s.
    pub shown_rates_deg_per_s: Vec<f64>,
}

impl Probe {
    /// Reads what is needed. `returns` is about how many echoes there are, `shown_s` how much of the run the cut shows.
    pub(super) fn read(
        reader: &Reader,
        (selection, calibration): (&Selection, &Calibration),
        surroundings: Surroundings<'_>,
        (returns, shown_s): (usize, f64),
        stop: &AtomicBool,
    ) -> Result<Self, StudyError> {
        let truth = reader.truth_trajectory()?;
        let Some(cut) = Cut::through(&truth, shown_s) else {
            let message = "the recording has no truth to judge by".to_owned();
            return Err(StudyError::Plan { what: "latency", message });
        };
        let mut sampling = Sampling {
            near: TruthCursor::new(reader.truth()),
            surroundings,
            head_from_laser: calibration.head_from_laser,
            cut,
            thinning: Thinning::to(JUDGED, returns),
            index: 0,
            scan_stamps: Vec::new(),
            judged: Vec::new(),
            shown: Vec::new(),
        };
        for measurement in reader.measurements(selection) {
            if stop.load(Ordering::Relaxed) {
                return Err(StudyError::Stopped);
            }
            if let Measurement::Lidar(scan) = measurement? {
                sampling.take(&scan)?;
            }
        }
        let Sampling { scan_stamps, judged, shown, .. } = sampling;
        let places: Vec<(f64, f64)> = shown.iter().map(|(_, place)| *place).collect();
        let range_m = most_seen(&places);
        let ((left, right), (low, high)) = range_m;
        let within = |(x, y): (f64, f64)| (left..=right).contains(&x) && (low..=high).contains(&y);
        let shown: Vec<ProbeBeam> =
            shown.into_iter().filter(|(_, place)| within(*place)).map(|(beam, _)| beam).collect();
        let thinning = Thinning::to(SHOWN, shown.len());
        let kept = shown.into_iter().enumerate().filter(|(index, _)| thinning.keeps(*index));
        let shown: Vec<ProbeBeam> = kept.map(|(_, beam)| beam).collect();
        let rate = |beam: &ProbeBeam| cut.rate_deg_per_s(&truth, scan_stamps[beam.scan] + beam.offset);
        let shown_rates_deg_per_s = shown.iter().map(|beam| rate(beam).unwrap_or(f64::NAN)).collect();
        let clock = TrueClock::read(reader, selection)?;
        Ok(Self { truth, clock, scan_stamps, judged, cut, range_m, shown, shown_rates_deg_per_s })
    }
}

/// Gathers beams scan by scan.
struct Sampling<'a> {
    near: TruthCursor<'a>,
    surroundings: Surroundings<'a>,
    head_from_laser: Pose,
    cut: Cut,
    thinning: Thinning,
    index: usize,
    scan_stamps: Vec<Stamp>,
    judged: Vec<ProbeBeam>,
    /// With their places in the cut.
    shown: Vec<(ProbeBeam, (f64, f64))>,
}

impl Sampling<'_> {
    fn take(&mut self, scan: &LidarScan) -> Result<(), StudyError> {
        let number = self.scan_stamps.len();
        self.scan_stamps.push(scan.stamp);
        for hit in &scan.returns {
            let stamp = scan.stamp + hit.offset;
            let index = self.index;
            self.index += 1;
            let Some(instant) = self.near.at(stamp)? else { continue };
            let beam = ProbeBeam { scan: number, offset: hit.offset, point_in_laser: hit.point_in_laser.cast() };
            let world_from_laser = instant.world_from_head * self.head_from_laser;
            let end = world_from_laser.transform_point(&beam.point_in_laser.into()).coords;
            let (judged, shown) = (self.thinning.keeps(index), self.cut.has(&end, stamp));
            if !(judged || shown) || !self.surroundings.hits_static_surface(&end, &instant) {
                continue;
            }
            if judged {
                self.judged.push(beam);
            }
            if shown {
                self.shown.push((beam, self.cut.place(&end)));
            }
        }
        Ok(())
    }
}

/// The part of the cut, [`SHOWN_M`] long and high, in which most is seen: most small cells with a point in them, so
/// that a surface close by does not count for all others. Of equals the first from the left, from below.
fn most_seen(places: &[(f64, f64)]) -> ((f64, f64), (f64, f64)) {
    let cells: BTreeSet<(i64, i64)> =
        places.iter().map(|(x, y)| ((x / CELL_M).round() as i64, (y / CELL_M).round() as i64)).collect();
    let size = ((SHOWN_M.0 / CELL_M) as i64, (SHOWN_M.1 / CELL_M) as i64);
    let (reach, step) = (((REACH_M.0 / CELL_M) as i64, (REACH_M.1 / CELL_M) as i64), 4);
    let mut best = (0, (-size.0 / 2, -size.1 / 2));
    for left in (-reach.0..=reach.0 - size.0).step_by(step) {
        for low in (-reach.1..=reach.1 - size.1).step_by(step) {
            let within = |(x, y): &&(i64, i64)| (left..left + size.0).contains(x) && (low..low + size.1).contains(y);
            let count = cells.iter().filter(within).count();
            if count > best.0 {
                best = (count, (left, low));
            }
        }
    }
    let (left, low) = (best.1.0 as f64 * CELL_M, best.1.1 as f64 * CELL_M);
    ((left, left + SHOWN_M.0), (low, low + SHOWN_M.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_with_two_walls_is_shown_rather_than_a_dense_floor() {
        // A thousand points of floor within 0.2 m, and two walls of 1.5 m that meet at (2, 1).
        let floor = (0..1000).map(|k| (-2.0 + 0.0002 * f64::from(k), -1.5));
        let walls = (0..60).flat_map(|k| [(2.0, 1.0 - 0.025 * f64::from(k)), (2.0 - 0.025 * f64::from(k), 1.0)]);
        let ((left, right), (low, high)) = most_seen(&floor.chain(walls).collect::<Vec<_>>());
        assert!(left <= 0.6 && right >= 2.0 && low <= -0.4 && high >= 1.0, "{left} {right} {low} {high}");
        assert!((right - left - SHOWN_M.0).abs() < 1e-12 && (high - low - SHOWN_M.1).abs() < 1e-12);
    }
}
