//! The information bound of a recording in its scene.

use super::calibration::calibration;
use super::true_clock::TrueClock;
use super::truth_near::{TrueInstant, TruthNear};
use super::{CalibrationSpec, Manifest, Stage, StudyError, Watch};
use crate::evaluation::{BoundModel, Information, InformationBound, Sight};
use crate::geometry::{Pose, Rotation, Vector};
use crate::measurement::{Calibration, LidarReturn, LidarScan, Measurement};
use crate::recording::{Preference, Reader, Truth};
use crate::sensors::ImuSpec;
use crate::time::{Span, Stamp};
use crate::world::{Hit, Ray, World};
use rayon::prelude::*;

/// What an estimator may believe of the clocks beforehand, one standard deviation: next to nothing, s and s/s.
const CLOCK: (f64, f64) = (0.1, 1e-3);
/// A beam whose range is farther from the truth than this did not end where the ray does: on the carrier, say, m.
const SAME_SURFACE_M: f64 = 0.15;
/// What is nearer to a mover than this is of it, m.
const OF_A_MOVER_M: f64 = 0.05;
/// Most panes of glass that a beam passes.
const MOST_GLASS: usize = 8;
/// Time between the true poses of a scan: that between those recorded.
const STEP: Span = Span::from_nanos(1_000_000);

/// The bound, and what it rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounded {
    /// The bound.
    pub bound: InformationBound,
    /// Beams that told of a surface that stands.
    pub beams: u64,
    /// Echoes that were left out: of what carries the lidar, of what moves, or where the truth does not reach.
    pub left_out: u64,
}

/// The information bound of the recording that `reader` reads, in `world`.
///
/// # Errors
/// When the recording cannot be read, has no sensors or no truth, or somebody stops it.
pub fn information_bound(reader: &Reader, world: &World, watch: &mut Watch) -> Result<Bounded, StudyError> {
    let selection = reader.select(&Preference::default())?;
    let found = calibration(reader, &selection, &CalibrationSpec::default(), None)?;
    let clock = TrueClock::read(reader, &selection)?;
    let mut span: Option<(Stamp, Stamp)> = None;
    let heads = reader.truth().filter_map(|told| match told {
        Ok(Truth::Head(stamp, pose)) => {
            span = Some((span.map_or(stamp, |(first, _)| first), stamp));
            Some(Ok((stamp, pose)))
        }
        Ok(Truth::Base(..) | Truth::Clock(..)) => None,
        Err(error) => Some(Err(error)),
    });
    let information = Information::new(model(reader, &found.calibration), heads)?;
    let Some((first, last)) = span else {
        let message = "the recording has no truth, without which no bound can be told".to_owned();
        return Err(StudyError::Plan { what: "bound", message });
    };
    let near = TruthNear::new(reader.truth());
    let calibration = &found.calibration;
    let mut gathering = Gathering { world, calibration, near, information, beams: 0, left_out: 0 };
    for measurement in reader.measurements(&selection) {
        match measurement? {
            Measurement::Imu(sample) => gathering.information.hear(clock.on_lidar_clock(sample.stamp), &sample),
            Measurement::Lidar(scan) => {
                if watch.is_stopped() {
                    return Err(StudyError::Stopped);
                }
                let (done_s, whole_s) = (scan.stamp.seconds_since(first), last.seconds_since(first));
                watch.progress(Stage::Bounding, done_s, Some(whole_s));
                gathering.take(&scan)?;
            }
        }
    }
    let Gathering { information, beams, left_out, .. } = gathering;
    Ok(Bounded { bound: information.bound()?, beams, left_out })
}

/// What is known of the sensors: of our own recordings what they were made with, of others their noise alone.
fn model(reader: &Reader, calibration: &Calibration) -> BoundModel {
    let specs = Manifest::within(reader).and_then(|manifest| manifest.specs);
    let matrix = |of: fn(&ImuSpec) -> (f64, f64)| {
        let (scale_percent, misalignment_deg) = specs.as_ref().map_or((0.0, 0.0), |specs| of(&specs.imu));
        (scale_percent * 1e-2, misalignment_deg.to_radians())
    };
    BoundModel {
        head_from_imu: calibration.head_from_imu,
        imu: calibration.imu,
        gyro_matrix: matrix(|imu| (imu.gyro.scale_percent, imu.gyro.misalignment_deg)),
        accel_matrix: matrix(|imu| (imu.accel.scale_percent, imu.accel.misalignment_deg)),
        range_offset_m: specs.as_ref().map_or(0.0, |specs| specs.lidar.errors.range.bias_sigma_m),
        clock_offset_s: CLOCK.0,
        clock_rate: CLOCK.1,
    }
}

/// Gathers what beams tell, scan by scan.
struct Gathering<'a> {
    world: &'a World,
    calibration: &'a Calibration,
    near: TruthNear<'a>,
    information: Information,
    beams: u64,
    left_out: u64,
}

impl Gathering<'_> {
    fn take(&mut self, scan: &LidarScan) -> Result<(), StudyError> {
        let mut moved = Moved { first: scan.stamp - STEP, instants: Vec::new() };
        let sweep = scan.returns.iter().map(|hit| hit.offset).max().unwrap_or(Span::ZERO);
        let steps = (sweep.nanos() / STEP.nanos()).max(0) + 3;
        for step in 0..=steps {
            let stamp = moved.first + Span::from_nanos(step * STEP.nanos());
            moved.instants.push(self.near.at(stamp)?);
        }
        let sights: Vec<Option<Sight>> = scan.returns.par_iter().map(|hit| self.sight(scan, hit, &moved)).collect();
        for sight in sights {
            match sight {
                Some(sight) => {
                    self.information.see(&sight);
                    self.beams += 1;
                }
                None => self.left_out += 1,
            }
        }
        Ok(())
    }

    /// What a beam truly met, if that stands.
    fn sight(&self, scan: &LidarScan, hit: &LidarReturn, moved: &Moved) -> Option<Sight> {
        let stamp = scan.stamp + hit.offset;
        let motion = moved.at(stamp)?;
        let world_from_laser = motion.world_from_head * self.calibration.head_from_laser;
        let point_in_laser: Vector = hit.point_in_laser.cast();
        let range_m = point_in_laser.norm();
        let ray = Ray {
            origin_in_world: world_from_laser.translation.vector,
            direction_in_world: world_from_laser.rotation * (point_in_laser / range_m),
        };
        let met = self.met(&ray, range_m, motion.t_s)?;
        let hit_in_world = ray.at(met.distance_m);
        let moves = self.world.distance_to_movers_m(&hit_in_world, OF_A_MOVER_M, motion.t_s).is_some();
        (!moves).then(|| Sight {
            stamp,
            world_from_head: motion.world_from_head,
            velocity_in_world: motion.velocity_in_world,
            angular_velocity_in_world: motion.angular_velocity_in_world,
            hit_in_world,
            direction_in_world: ray.direction_in_world,
            normal_in_world: met.normal_in_world,
            range_sigma_m: self.calibration.lidar.sigma_m(met.distance_m),
        })
    }

    /// The surface about as far away as the beam says, behind glass if need be.
    fn met(&self, ray: &Ray, range_m: f64, t_s: f64) -> Option<Hit> {
        let reach_m = range_m + SAME_SURFACE_M;
        let mut hit = self.world.cast(ray, reach_m, t_s)?;
        for _ in 0..MOST_GLASS {
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

/// How the head moved during a scan.
struct Moved {
    first: Stamp,
    /// One a [`STEP`].
    instants: Vec<Option<TrueInstant>>,
}

/// How the head moved at an instant.
struct Motion {
    world_from_head: Pose,
    velocity_in_world: Vector,
    angular_velocity_in_world: Vector,
    t_s: f64,
}

impl Moved {
    fn at(&self, stamp: Stamp) -> Option<Motion> {
        let since = (stamp - self.first).nanos();
        let index = usize::try_from(since / STEP.nanos()).ok()?;
        let (before, after) = ((*self.instants.get(index)?)?, (*self.instants.get(index + 1)?)?);
        let u = (since % STEP.nanos()) as f64 / STEP.nanos() as f64;
        let (a, b) = (before.world_from_head, after.world_from_head);
        let shift = b.translation.vector - a.translation.vector;
        let turn = (b.rotation * a.rotation.inverse()).scaled_axis();
        let rotation = Rotation::from_scaled_axis(turn * u) * a.rotation;
        Some(Motion {
            world_from_head: Pose::from_parts((a.translation.vector + shift * u).into(), rotation),
            velocity_in_world: shift / STEP.seconds(),
            angular_velocity_in_world: turn / STEP.seconds(),
            t_s: before.t_s + u * STEP.seconds(),
        })
    }
}
