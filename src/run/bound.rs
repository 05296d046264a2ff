//! The information bound of a recording in its scene.

use super::beams::{BeamReader, read_beams};
use super::calibration::calibration;
use super::manifest::RecordedSensors;
use super::true_clock::TrueClock;
use super::truth_cursor::{TrueState, TruthCursor};
use super::{CalibrationSpec, Manifest, ProgressMonitor, RunError, Stage};
use rayon::prelude::*;
use zsim_base::geometry::{Pose, Rotation, Vector};
use zsim_base::measurement::{Calibration, ImuSample, LidarReturn, LidarScan};
use zsim_base::time::{Span, Stamp};
use zsim_evaluation::{BeamObservation, BoundModel, FisherInformation, InformationBound, MapKnowledge};
use zsim_recording::{Reader, RecordingError, Selection, TopicPreference, Truth};
use zsim_sensors::ImuSpec;
use zsim_simulation::Run;
use zsim_world::{Hit, PlaneMap, Ray, TimedRay, World};

/// Prior standard deviations of the clock offset, s, and the clock rate, s/s: wide, so that they carry no information.
const CLOCK_PRIOR: (f64, f64) = (0.1, 1e-3);
/// Maximum difference between measured and true range for a beam and a ray to hit the same surface, m. A larger one
/// means that the beam hit an object that the ray does not meet, such as the carrier.
const SAME_SURFACE_M: f64 = 0.15;
/// A point within this distance of a moving object belongs to that object, m.
const MOVER_DISTANCE_M: f64 = 0.05;
/// Number of rays that are cast together: a multiple of the size of their groups, so that a thread has several groups.
const RAYS_TOGETHER: usize = 272;
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

/// Computes the information bound of the recording of `reader` in `world`, for an estimate with the knowledge `map`.
///
/// # Errors
/// When the recording cannot be read, has no sensors or no truth, or the computation is stopped.
pub fn information_bound(
    reader: &Reader,
    world: &World,
    map: MapKnowledge,
    watch: &mut ProgressMonitor,
) -> Result<RecordingBound, RunError> {
    let selection = reader.select(&TopicPreference::default())?;
    let manifest = Manifest::in_recording(reader)?;
    let run = manifest.as_ref().and_then(|manifest| manifest.run.as_ref());
    let mut bound = BoundAccumulator::new(reader, &selection, (world, map), run)?;
    for truth in reader.truth() {
        bound.add_truth(&truth?);
    }
    let Some((first, last)) = bound.span else {
        let message = "the recording has no true trajectory, which the bound requires".to_owned();
        return Err(RunError::Plan { what: "information bound", message });
    };
    read_beams((reader, &selection), true, vec![&mut bound], &mut |stamp| {
        watch.progress(Stage::Bounding, stamp.seconds_since(first), Some(last.seconds_since(first)));
        watch.check_stop()
    })?;
    bound.finish()
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

/// Accumulates the information of a recording: first all of its truth, then its measurements.
pub(super) struct BoundAccumulator<'a> {
    world: &'a World,
    /// Planes of the world, if the map is unknown.
    planes: Option<PlaneMap>,
    calibration: Calibration,
    imu_shift: Span,
    clock: TrueClock,
    /// Time span of the truth, lidar time; `None` without truth.
    span: Option<(Stamp, Stamp)>,
    information: FisherInformation,
    beams: u64,
    rejected: u64,
}

impl<'a> BoundAccumulator<'a> {
    /// Creates an accumulator for the measurements of `selection`, with the calibration in the recording.
    ///
    /// `run` has the sensor models of a simulated recording.
    pub(super) fn new(
        reader: &Reader,
        selection: &Selection,
        (world, map): (&'a World, MapKnowledge),
        run: Option<&Run>,
    ) -> Result<Self, RunError> {
        let recorded = run.map(RecordedSensors::of).unwrap_or_default();
        let (found, _) = calibration(reader, selection, &CalibrationSpec::default(), &recorded, None)?;
        Ok(Self {
            world,
            planes: (map == MapKnowledge::Unknown).then(|| world.planes()),
            information: FisherInformation::new(model(run, &found.calibration), map),
            calibration: found.calibration,
            imu_shift: selection.imu_shift(),
            clock: TrueClock::default(),
            span: None,
            beams: 0,
            rejected: 0,
        })
    }

    /// Adds the next item of the truth.
    pub(super) fn add_truth(&mut self, truth: &Truth) {
        match truth {
            Truth::Head(stamp, pose) => {
                self.span = Some((self.span.map_or(*stamp, |(first, _)| first), *stamp));
                self.information.add_head(*stamp, pose);
            }
            Truth::Base(..) => {}
            Truth::Clock(now, clock) => self.clock.add(*now, clock, self.imu_shift),
        }
    }

    /// The bound of the measurements so far.
    ///
    /// # Errors
    /// If they do not determine it.
    pub(super) fn finish(self) -> Result<RecordingBound, RunError> {
        Ok(RecordingBound { bound: self.information.bound()?, beams: self.beams, rejected: self.rejected })
    }

    /// The observations of successive beams, each if it hit a static surface.
    fn observations(
        &self,
        scan: &LidarScan,
        hits: &[LidarReturn],
        scan_motion: &ScanMotion,
    ) -> Vec<Option<BeamObservation>> {
        let beams: Vec<Option<TrueBeam>> = hits.iter().map(|hit| self.true_beam(scan, hit, scan_motion)).collect();
        let rays: Vec<TimedRay> = beams.iter().flatten().map(TrueBeam::timed_ray).collect();
        let mut first_hits = self.world.cast_all(&rays).into_iter();
        let observation = |beam: Option<TrueBeam>| {
            let beam = beam?;
            let first = first_hits.next().flatten()?;
            self.observation(&beam, first)
        };
        beams.into_iter().map(observation).collect()
    }

    /// A beam along the true ray; `None` at times without truth.
    fn true_beam(&self, scan: &LidarScan, hit: &LidarReturn, scan_motion: &ScanMotion) -> Option<TrueBeam> {
        let stamp = scan.stamp + hit.offset;
        let motion = scan_motion.at(stamp)?;
        let world_from_laser = motion.world_from_head * self.calibration.head_from_laser;
        let point_in_laser: Vector = hit.point_in_laser.cast();
        let range_m = point_in_laser.norm();
        let ray = Ray {
            origin_in_world: world_from_laser.translation.vector,
            direction_in_world: world_from_laser.rotation * (point_in_laser / range_m),
        };
        Some(TrueBeam { stamp, motion, ray, range_m })
    }

    /// The observation of a beam, if it hit a static surface; `first` is the first surface on its ray.
    fn observation(&self, beam: &TrueBeam, first: Hit) -> Option<BeamObservation> {
        let TrueBeam { stamp, motion, ray, .. } = beam;
        let surface = self.surface_at_range(beam, first)?;
        let hit_in_world = ray.at(surface.distance_m);
        let plane = match &self.planes {
            None => 0,
            Some(planes) => planes.plane(surface.face?).0,
        };
        let is_moving = self.world.distance_to_movers_m(&hit_in_world, MOVER_DISTANCE_M, motion.t_s).is_some();
        (!is_moving).then(|| BeamObservation {
            stamp: *stamp,
            world_from_head: motion.world_from_head,
            velocity_in_world: motion.velocity_in_world,
            angular_velocity_in_world: motion.angular_velocity_in_world,
            hit_in_world,
            direction_in_world: ray.direction_in_world,
            normal_in_world: surface.normal_in_world,
            range_sigma_m: self.calibration.lidar.sigma_m(surface.distance_m),
            plane,
        })
    }

    /// The surface at the measured range of a beam, the `first` one on its ray or one behind glass panes.
    fn surface_at_range(&self, beam: &TrueBeam, first: Hit) -> Option<Hit> {
        let TrueBeam { ray, range_m, motion, .. } = beam;
        let mut hit = first;
        for _ in 0..MAX_PANES {
            if (hit.distance_m - range_m).abs() <= SAME_SURFACE_M {
                return Some(hit);
            }
            if self.world.material(hit.material).transmission <= 0.0 {
                return None;
            }
            hit = self.world.cast_beyond(ray, hit.distance_m, beam.timed_ray().reach_m, motion.t_s)?;
        }
        None
    }
}

impl BeamReader for BoundAccumulator<'_> {
    fn imu(&mut self, sample: &ImuSample) {
        self.information.add_imu_sample(self.clock.on_lidar_clock(sample.stamp), sample);
    }

    fn scan(&mut self, scan: &LidarScan, truth: Option<&mut TruthCursor>) -> Result<(), RunError> {
        let Some(truth) = truth else { return Ok(()) };
        let sweep = scan.returns.iter().map(|hit| hit.offset).max().unwrap_or(Span::ZERO);
        let scan_motion = ScanMotion::during(scan.stamp, sweep, truth)?;
        let chunks = scan.returns.par_chunks(RAYS_TOGETHER);
        let beams: Vec<Option<BeamObservation>> =
            chunks.flat_map_iter(|hits| self.observations(scan, hits, &scan_motion)).collect();
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
}

/// A measured beam along its true ray.
struct TrueBeam {
    stamp: Stamp,
    motion: HeadMotion,
    ray: Ray,
    /// Measured range, m.
    range_m: f64,
}

impl TrueBeam {
    /// The ray, up to the farthest surface that the beam can have hit.
    fn timed_ray(&self) -> TimedRay {
        TimedRay { ray: self.ray, reach_m: self.range_m + SAME_SURFACE_M, t_s: self.motion.t_s }
    }
}

/// True motion of the head during a scan.
struct ScanMotion {
    first: Stamp,
    /// One part for each [`TRUTH_STEP`]; `None` without truth.
    parts: Vec<Option<MotionPart>>,
}

/// Uniform motion of the head for [`TRUTH_STEP`].
struct MotionPart {
    start: TrueState,
    /// Translation and rotation vector, in the world.
    shift: Vector,
    turn: Vector,
}

/// True pose and velocity of the head at one time.
struct HeadMotion {
    world_from_head: Pose,
    velocity_in_world: Vector,
    angular_velocity_in_world: Vector,
    t_s: f64,
}

impl ScanMotion {
    /// The motion from just before `stamp` to just after `sweep` later.
    fn during(stamp: Stamp, sweep: Span, truth: &mut TruthCursor) -> Result<Self, RecordingError> {
        let first = stamp - TRUTH_STEP;
        let parts = (sweep.nanos() / TRUTH_STEP.nanos()).max(0) + 3;
        let mut start = truth.at(first)?;
        let mut scan_motion = Self { first, parts: Vec::new() };
        for part in 1..=parts {
            let end = truth.at(first + Span::from_nanos(part * TRUTH_STEP.nanos()))?;
            scan_motion.parts.push(start.zip(end).map(|(start, end)| MotionPart::between(start, &end)));
            start = end;
        }
        Ok(scan_motion)
    }

    fn at(&self, stamp: Stamp) -> Option<HeadMotion> {
        let since = (stamp - self.first).nanos();
        let index = usize::try_from(since / TRUTH_STEP.nanos()).ok()?;
        let MotionPart { start, shift, turn } = self.parts.get(index)?.as_ref()?;
        let u = (since % TRUTH_STEP.nanos()) as f64 / TRUTH_STEP.nanos() as f64;
        let Pose { rotation, translation } = start.world_from_head;
        let rotation = Rotation::from_scaled_axis(turn * u) * rotation;
        Some(HeadMotion {
            world_from_head: Pose::from_parts((translation.vector + shift * u).into(), rotation),
            velocity_in_world: shift / TRUTH_STEP.seconds(),
            angular_velocity_in_world: turn / TRUTH_STEP.seconds(),
            t_s: start.t_s + u * TRUTH_STEP.seconds(),
        })
    }
}

impl MotionPart {
    fn between(start: TrueState, end: &TrueState) -> Self {
        let (a, b) = (start.world_from_head, end.world_from_head);
        let turn = (b.rotation * a.rotation.inverse()).scaled_axis();
        Self { start, shift: b.translation.vector - a.translation.vector, turn }
    }
}
