//! Ground truth and a sample of the lidar's returns, which all runs are evaluated against.

use super::cross_section::CrossSection;
use crate::RunError;
use crate::beams::{BeamReader, read_beams};
use crate::cloud::Surroundings;
use crate::run_recording::RunRecording;
use crate::true_clock::TrueClock;
use crate::truth_cursor::TruthCursor;
use std::collections::BTreeSet;
use std::sync::atomic::AtomicBool;
use zsim_base::geometry::{Pose, Trajectory, Vector};
use zsim_base::measurement::LidarScan;
use zsim_base::parallel::check;
use zsim_base::time::{Span, Stamp};
use zsim_evaluation::Thinning;
use zsim_simulation::Simulation;

/// Approximate number of returns for the cloud's errors: the computing time of an evaluation is proportional to it.
const EVALUATED_RETURNS: usize = 60_000;
/// Maximum number of returns in the section's plot: limits the size of the SVG.
const SHOWN_RETURNS: usize = 6000;

/// Maximum size of the shown part of the section (along it, up), m.
const SECTION_SIZE_M: (f64, f64) = (3.6, 2.8);
/// Maximum distance of the shown part's edges from the section's centre (along it, up), m.
const REACH_M: (f64, f64) = (5.0, 2.4);
/// Side of the grid cells for the choice of the shown part, m.
const CELL_M: f64 = 0.05;
/// Fraction of the occupied cells on each side that do not determine the shown range.
const OUTERMOST: f64 = 0.03;
/// Margin of the shown range about its cells: at least this, m, and this fraction of it.
const MARGIN_M: f64 = 0.15;
const MARGIN: f64 = 0.05;
/// Minimum ratio of the shorter to the longer side of the shown range.
const MIN_SIDE_RATIO: f64 = 0.36;

/// A return that truly is from a static surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct SampledReturn {
    /// Index of the scan, in order of arrival.
    pub scan: usize,
    /// Time of the beam after the scan's stamp.
    pub offset: Span,
    /// Measured point in the lidar's frame, m.
    pub point_in_laser: Vector,
}

/// Ground truth and sampled returns of the recording.
pub(crate) struct Reference {
    /// `world_from_head` in lidar time.
    pub(super) truth: Trajectory,
    /// True offset of the clocks.
    pub(super) clock: TrueClock,
    /// True stamps of the scans, in order of arrival.
    pub(super) scan_stamps: Vec<Stamp>,
    /// Returns for the cloud's errors.
    pub(super) evaluated: Vec<SampledReturn>,
    /// The section through the map.
    pub(super) section: CrossSection,
    /// Shown range of the section (along it, up), m.
    pub(super) range_m: ((f64, f64), (f64, f64)),
    /// Returns in the shown range.
    pub(super) shown: Vec<SampledReturn>,
    /// True angular rate of the head in the section's plane for each shown return, degrees/s.
    pub(super) shown_rates_deg_per_s: Vec<f64>,
}

impl Reference {
    /// Reads the recording of `simulation`; the section has the returns of the middle `shown_s`.
    pub(crate) fn read(
        recording: &RunRecording,
        simulation: &Simulation,
        shown_s: f64,
        stop: &AtomicBool,
    ) -> Result<Self, RunError> {
        let RunRecording { reader, selection, calibration } = recording;
        let truth = reader.truth_trajectory()?;
        let Some(section) = CrossSection::through(&truth, shown_s) else {
            let message = "the recording has no ground truth".to_owned();
            return Err(RunError::Plan { what: "latency", message });
        };
        let surroundings = Surroundings { world: simulation.world(), carrier: simulation.carrier() };
        let lidar = simulation.lidar();
        let scans = simulation.inputs().duration_s / lidar.period_s();
        let returns = (scans * lidar.beams().len() as f64) as usize;
        let mut sampling = ReturnSampler {
            surroundings,
            head_from_laser: calibration.head_from_laser,
            section,
            thinning: Thinning::to_at_most(EVALUATED_RETURNS, returns),
            index: 0,
            scan_stamps: Vec::new(),
            evaluated: Vec::new(),
            shown: Vec::new(),
        };
        read_beams((reader, selection), true, vec![&mut sampling], &mut |_| check(stop))?;
        let ReturnSampler { scan_stamps, evaluated, shown, .. } = sampling;
        let coordinates: Vec<(f64, f64)> = shown.iter().map(|(_, coordinates)| *coordinates).collect();
        let range_m = densest_range(&coordinates);
        let ((left, right), (low, high)) = range_m;
        let within = |(x, y): (f64, f64)| (left..=right).contains(&x) && (low..=high).contains(&y);
        let shown: Vec<SampledReturn> =
            shown.into_iter().filter(|(_, coordinates)| within(*coordinates)).map(|(hit, _)| hit).collect();
        let thinning = Thinning::to_at_most(SHOWN_RETURNS, shown.len());
        let thinned = shown.into_iter().enumerate().filter(|(index, _)| thinning.keeps(*index));
        let shown: Vec<SampledReturn> = thinned.map(|(_, hit)| hit).collect();
        let rate = |hit: &SampledReturn| section.rate_deg_per_s(&truth, scan_stamps[hit.scan] + hit.offset);
        let shown_rates_deg_per_s = shown.iter().map(|hit| rate(hit).unwrap_or(f64::NAN)).collect();
        let clock = TrueClock::read(reader, selection)?;
        Ok(Self { truth, clock, scan_stamps, evaluated, section, range_m, shown, shown_rates_deg_per_s })
    }
}

/// Samples returns scan by scan.
struct ReturnSampler<'a> {
    surroundings: Surroundings<'a>,
    head_from_laser: Pose,
    section: CrossSection,
    thinning: Thinning,
    index: usize,
    scan_stamps: Vec<Stamp>,
    evaluated: Vec<SampledReturn>,
    /// Returns in the section, with their coordinates there.
    shown: Vec<(SampledReturn, (f64, f64))>,
}

impl BeamReader for ReturnSampler<'_> {
    fn scan(&mut self, scan: &LidarScan, truth: Option<&mut TruthCursor>) -> Result<(), RunError> {
        let Some(truth) = truth else { return Ok(()) };
        let number = self.scan_stamps.len();
        self.scan_stamps.push(scan.stamp);
        for hit in &scan.returns {
            let stamp = scan.stamp + hit.offset;
            let index = self.index;
            self.index += 1;
            let Some(state) = truth.at(stamp)? else { continue };
            let sampled = SampledReturn { scan: number, offset: hit.offset, point_in_laser: hit.point_in_laser.cast() };
            let world_from_laser = state.world_from_head * self.head_from_laser;
            let end = world_from_laser.transform_point(&sampled.point_in_laser.into()).coords;
            let (is_evaluated, is_shown) = (self.thinning.keeps(index), self.section.contains(&end, stamp));
            if !(is_evaluated || is_shown) || !self.surroundings.hits_static_surface(&end, &state) {
                continue;
            }
            if is_evaluated {
                self.evaluated.push(sampled);
            }
            if is_shown {
                self.shown.push((sampled, self.section.coordinates(&end)));
            }
        }
        Ok(())
    }
}

/// The range that shows the part of the section with the most occupied grid cells, of at most [`SECTION_SIZE_M`].
///
/// Counting cells rather than points keeps a dense nearby surface from dominating. Of several equal parts, the leftmost
/// and then the lowest is chosen. The range fits the occupied cells of the part, so that these fill the plot.
fn densest_range(coordinates: &[(f64, f64)]) -> ((f64, f64), (f64, f64)) {
    let cells: BTreeSet<(i64, i64)> =
        coordinates.iter().map(|(x, y)| ((x / CELL_M).round() as i64, (y / CELL_M).round() as i64)).collect();
    let size = ((SECTION_SIZE_M.0 / CELL_M) as i64, (SECTION_SIZE_M.1 / CELL_M) as i64);
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
    let (left, low) = best.1;
    let within = cells.iter().filter(|(x, y)| (left..left + size.0).contains(x) && (low..low + size.1).contains(y));
    let (across, up): (Vec<i64>, Vec<i64>) = within.copied().unzip();
    let (across, up) = (fitted(across), fitted(up));
    let length = |(low, high): (f64, f64)| high - low;
    (widened(across, length(up) * MIN_SIDE_RATIO), widened(up, length(across) * MIN_SIDE_RATIO))
}

/// The range of these cells with a margin, m, without a few outermost cells on each side.
fn fitted(mut cells: Vec<i64>) -> (f64, f64) {
    cells.sort_unstable();
    let left_out = (cells.len() as f64 * OUTERMOST) as usize;
    let ends = cells.get(left_out).zip(cells.iter().rev().nth(left_out));
    let (low, high) = ends.map_or((0.0, 0.0), |(first, last)| (*first as f64 * CELL_M, *last as f64 * CELL_M));
    let margin_m = MARGIN_M.max(MARGIN * (high - low));
    (low - margin_m, high + margin_m)
}

/// The range with the same middle and at least this length.
fn widened((low, high): (f64, f64), length: f64) -> (f64, f64) {
    let more = 0.5 * (length - (high - low)).max(0.0);
    (low - more, high + more)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_of_two_walls_is_preferred_to_a_dense_floor() {
        // 1000 points of floor within 0.2 m, and two walls of 1.5 m that meet at (2, 1).
        let floor = (0..1000).map(|k| (-2.0 + 0.0002 * f64::from(k), -1.5));
        let walls = (0..60).flat_map(|k| [(2.0, 1.0 - 0.025 * f64::from(k)), (2.0 - 0.025 * f64::from(k), 1.0)]);
        let ((left, right), (low, high)) = densest_range(&floor.chain(walls).collect::<Vec<_>>());
        // The walls end at 0.525 and 2, and at -0.475 and 1; they fill at least three quarters of the range each way.
        assert!(left < 0.6 && right > 2.1 && low < -0.4 && high > 1.1, "{left} {right} {low} {high}");
        assert!(right - left < 1.475 / 0.75 && high - low < 1.475 / 0.75, "{left} {right} {low} {high}");
    }

    #[test]
    fn the_range_of_one_wall_is_narrow_and_that_of_no_points_not_empty() {
        // A wall of 2 m at x = 1; one point far from it does not matter.
        let wall = (0..80).map(|k| (1.0, -1.0 + 0.025 * f64::from(k))).chain([(2.5, 0.0)]);
        let ((left, right), (low, high)) = densest_range(&wall.collect::<Vec<_>>());
        assert!((left + right - 2.0).abs() < 2.0 * CELL_M && right - left < 1.0, "{left} {right}");
        assert!(low < -1.0 && high > 0.975 && high - low < 2.5, "{low} {high}");
        let ((left, right), (low, high)) = densest_range(&[]);
        assert!(left < right && low < high);
    }
}
