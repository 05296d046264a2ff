//! The information bound of a recording in its scene.

use super::calibration::calibration;
use super::true_clock::TrueClock;
use super::truth_cursor::{TrueState, TruthCursor};
use super::{CalibrationSpec, Manifest, ProgressMonitor, Stage, StudyError};
use crate::evaluation::{BeamObservation, BoundModel, FisherInformation, InformationBound};
use crate::geometry::{Pose, Rotation, Vector};
use crate::measurement::{Calibration, LidarReturn, LidarScan, Measurement};
use crate::recording::{Reader, TopicPreference, Truth};
use crate::sensors::ImuSpec;
use crate::simulation::Run;
use crate::time::{Span, Stamp};
use crate::world::{Hit, Ray, World};
use rayon::prelude::*;

/// Prior standard deviations of the clock offset, s, and the clock rate, s/s: wide, so that they carry no information.
const CLOCK_PRIOR: (f64, f64) = (0.1, 1e-3);
/// Maximum difference between measured and true range for a beam and a ray to hit the same surface, m. A larger one
/// means that the beam hit an object that the ray does not meet, such as the carrier.
const SAME_SURFACE_M: f64 = 0.15;
/// A point within this distance of a moving object belongs to that object, m.
const MOVER_DISTANCE_M: f64 = 0.05;
/// Maximum number of glass panes on the path of a beam.
const MAX_PANES: usize = 8;
/// Time between the true poses of a scan: the period of the recorded truth.
const TRUTH_STEP: Span = Span::from_nanos(1_000_000);

/// The information bound of a recording, with the number of beams that it uses.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingBound {
    /// The bound.
    pub bound: InformationBound,
    /// Beams on static surfaces, which the bound uses.
    pub beams: u64,
    /// Rejected returns: on the carrier of the lidar, on moving objects, or at times without truth.
    pub rejected: u64,
}

/// Computes the information bound of the recording of `reader` in `world`.
///
/// # Errors
/// When the recording cannot be read, has no sensors or no truth, or the computation is stopped.
pub fn information_bound(
    reader: &Reader,
    world: &World,
    watch: &mut ProgressMonitor,
) -> Result<RecordingBound, StudyError> {
    let selection = reader.select(&TopicPreference::default())?;
    let manifest = Manifest::in_recording(reader)?;
    let run = manifest.as_ref().and_then(|manifest| manifest.run.as_ref());
    let (found, _) = calibration(reader, &selection, &CalibrationSpec::default(), run, None)?;
    let clock = TrueClock::read(reader, &selection)?;
    let mut span: Option<(Stamp, Stamp)> = None;
    let heads = reader.truth().filter_map(|record| match record {
        Ok(Truth::Head(stamp, pose)) => {
            span = Some((span.map_or(stamp, |(first, _)| first), stamp));
            Some(Ok((stamp, pose)))
        }
        Ok(Truth::Base(..) | Truth::Clock(..)) => None,
        Err(error) => Some(Err(error)),
    });
    let information = FisherInformation::new(model(run, &found.calibration), heads)?;
    let Some((first, last)) = span else {
        let message = "the recording has no true trajectory, which the bound requires".to_owned();
        return Err(StudyError::Plan { what: "information bound", message });
    };
    let truth = TruthCursor::new(reader.truth());
    let calibration = &found.calibration;
    let mut accumulator = BoundAccumulator { world, calibration, truth, information, beams: 0, rejected: 0 };
    for measurement in reader.measurements(&selection) {
        match measurement? {
            Measurement::Imu(sample) => {
                accumulator.information.add_imu_sample(clock.on_lidar_clock(sample.stamp), &sample);
            }
            Measurement::Lidar(scan) => {
                if watch.is_stopped() {
                    return Err(StudyError::Stopped);
                }
                let (done_s, total_s) = (scan.stamp.seconds_since(first), last.seconds_since(first));
                watch.progress(Stage::Bounding, done_s, Some(total_s));
                accumulator.take(&scan)?;
            }
        }
    }
    let BoundAccumulator { information, beams, rejected, .. } = accumulator;
    Ok(RecordingBound { bound: information.bound()?, beams, rejected })
}

/// Sensor model of the bound: the specs in the manifest of a simulated recording, else only the sensor noise.
fn model(run: Option<&Run>, calibration: &Calibration) -> BoundModel {
    let matrix = |errors: fn(&ImuSpec) -> (f64, f64)| {
        let (scale_percent, misalignment_deg) = run.map_or((0.0, 0.0), |run| errors(&run.imu.spec));
        (scale_percent * 1e-2, misalignment_deg.to_radians())
    };
    BoundModel {
        head_from_imu: calibration.head_from_imu,
        imu: calibration.imu,
        gyro_matrix: matrix(|imu| (imu.gyro.scale_percent, imu.gyro.misalignment_deg)),
        accel_matrix: matrix(|imu| (imu.accel.scale_percent, imu.accel.misalignment_deg)),
        range_offset_m: run.map_or(0.0, |run| run.lidar.spec.errors.range.bias_sigma_m),
        clock_offset_s: CLOCK_PRIOR.0,
        clock_rate: CLOCK_PRIOR.1,
    }
}

/// Accumulates the information of the beams, scan by scan.
struct BoundAccumulator<'a> {
    world: &'a World,
    calibration: &'a Calibration,
    truth: TruthCursor<'a>,
    information: FisherInformation,
    beams: u64,
    rejected: u64,
}

impl BoundAccumulator<'_> {
    fn take(&mut self, scan: &LidarScan) -> Result<(), StudyError> {
        let mut scan_motion = ScanMotion { first: scan.stamp - TRUTH_STEP, states: Vec::new() };
        let sweep = scan.returns.iter().map(|hit| hit.offset).max().unwrap_or(Span::ZERO);
        let steps = (sweep.nanos() / TRUTH_STEP.nanos()).max(0) + 3;
        for step in 0..=steps {
            let stamp = scan_motion.first + Span::from_nanos(step * TRUTH_STEP.nanos());
            scan_motion.states.push(self.truth.at(stamp)?);
        }
        let beams: Vec<Option<BeamObservation>> =
            scan.returns.par_iter().map(|hit| self.observation(scan, hit, &scan_motion)).collect();
        for beam in beams {
            match beam {
                Some(beam) => {
                    self.information.add_beam(&beam);
                    self.beams += 1;
                }
                None => self.rejected += 1,
            }
        }
        Ok(())
    }

    /// The observation of a beam, if it hit a static surface.
    fn observation(&self, scan: &LidarScan, hit: &LidarReturn, scan_motion: &ScanMotion) -> Option<BeamObservation> {
        let stamp = scan.stamp + hit.offset;
        let motion = scan_motion.at(stamp)?;
        let world_from_laser = motion.world_from_head * self.calibration.head_from_laser;
        let point_in_laser: Vector = hit.point_in_laser.cast();
        let range_m = point_in_laser.norm();
        let ray = Ray {
            origin_in_world: world_from_laser.translation.vector,
            direction_in_world: world_from_laser.rotation * (point_in_laser / range_m),
        };
        let surface = self.surface_at_range(&ray, range_m, motion.t_s)?;
        let hit_in_world = ray.at(surface.distance_m);
        let is_moving = self.world.distance_to_movers_m(&hit_in_world, MOVER_DISTANCE_M, motion.t_s).is_some();
        (!is_moving).then(|| BeamObservation {
            stamp,
            world_from_head: motion.world_from_head,
            velocity_in_world: motion.velocity_in_world,
            angular_velocity_in_world: motion.angular_velocity_in_world,
            hit_in_world,
            direction_in_world: ray.direction_in_world,
            normal_in_world: surface.normal_in_world,
            range_sigma_m: self.calibration.lidar.sigma_m(surface.distance_m),
        })
    }

    /// The surface at the measured range along a ray, through glass panes if necessary.
    fn surface_at_range(&self, ray: &Ray, range_m: f64, t_s: f64) -> Option<Hit> {
        let reach_m = range_m + SAME_SURFACE_M;
        let mut hit = self.world.cast(ray, reach_m, t_s)?;
        for _ in 0..MAX_PANES {
            if (hit.distance_m - range_m).abs() <= SAME_SURFACE_M {
                return Some(hit);
            }
            if self.world.material(hit.material).transmission <= 0.0 {
                return None;
            }
            hit = self.world.cast_beyond(ray, hit.distance_m, reach_m, t_s)?;
        }
        None
    }
}

/// True poses of the head during a scan.
struct ScanMotion {
    first: Stamp,
    /// One state for each [`TRUTH_STEP`].
    states: Vec<Option<TrueState>>,
}

/// True pose and velocity of the head at one time.
struct HeadMotion {
    world_from_head: Pose,
    velocity_in_world: Vector,
    angular_velocity_in_world: Vector,
    t_s: f64,
}

impl ScanMotion {
    fn at(&self, stamp: Stamp) -> Option<HeadMotion> {
        let since = (stamp - self.first).nanos();
        let index = usize::try_from(since / TRUTH_STEP.nanos()).ok()?;
        let (before, after) = ((*self.states.get(index)?)?, (*self.states.get(index + 1)?)?);
        let u = (since % TRUTH_STEP.nanos()) as f64 / TRUTH_STEP.nanos() as f64;
        let (a, b) = (before.world_from_head, after.world_from_head);
        let shift = b.translation.vector - a.translation.vector;
        let turn = (b.rotation * a.rotation.inverse()).scaled_axis();
        let rotation = Rotation::from_scaled_axis(turn * u) * a.rotation;
        Some(HeadMotion {
            world_from_head: Pose::from_parts((a.translation.vector + shift * u).into(), rotation),
            velocity_in_world: shift / TRUTH_STEP.seconds(),
            angular_velocity_in_world: turn / TRUTH_STEP.seconds(),
            t_s: before.t_s + u * TRUTH_STEP.seconds(),
        })
    }
}
