//! What every run is judged by: a sample of the beams, and the truth.

use super::cut::Cut;
use crate::evaluation::Thinning;
use crate::geometry::{Pose, Trajectory, Vector};
use crate::measurement::{Calibration, LidarScan, Measurement};
use crate::recording::{Reader, Selection};
use crate::study::StudyError;
use crate::study::cloud::Surroundings;
use crate::study::true_clock::TrueClock;
use crate::study::truth_near::TruthNear;
use crate::time::{Span, Stamp};
use std::sync::atomic::{AtomicBool, Ordering};

/// About how many beams are judged.
const JUDGED: usize = 60_000;
/// Most beams in the cut.
const SHOWN: usize = 3500;

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
    /// The beams in it.
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
            near: TruthNear::new(reader.truth()),
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
        let thinning = Thinning::to(SHOWN, shown.len());
        let kept = shown.into_iter().enumerate().filter(|(index, _)| thinning.keeps(*index));
        let shown: Vec<ProbeBeam> = kept.map(|(_, beam)| beam).collect();
        let rate = |beam: &ProbeBeam| cut.rate_deg_per_s(&truth, scan_stamps[beam.scan] + beam.offset);
        let shown_rates_deg_per_s = shown.iter().map(|beam| rate(beam).unwrap_or(f64::NAN)).collect();
        let clock = TrueClock::read(reader)?;
        Ok(Self { truth, clock, scan_stamps, judged, cut, shown, shown_rates_deg_per_s })
    }
}

/// Gathers beams scan by scan.
struct Sampling<'a> {
    near: TruthNear<'a>,
    surroundings: Surroundings<'a>,
    head_from_laser: Pose,
    cut: Cut,
    thinning: Thinning,
    index: usize,
    scan_stamps: Vec<Stamp>,
    judged: Vec<ProbeBeam>,
    shown: Vec<ProbeBeam>,
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
            let (judged, shown) = (self.thinning.keeps(index), self.cut.shows(&end, stamp));
            if !(judged || shown) || !self.surroundings.ends_on_what_stands(&end, &instant) {
                continue;
            }
            if judged {
                self.judged.push(beam);
            }
            if shown {
                self.shown.push(beam);
            }
        }
        Ok(())
    }
}
