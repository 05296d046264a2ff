//! Replay of a recorded trajectory, from a file of poses or a recording.
//!
//! A natural cubic spline interpolates the recorded positions and quaternion components; the quaternion is then
//! normalised. The result is twice continuously differentiable and passes through every pose. The replay speeds up from
//! rest and slows down to rest, whatever the recorded motion.

use super::jet::{Jet, PoseJet};
use super::smooth::SmoothPath;
use super::stand::start_on_route;
use super::{BaseMotion, MotionError};
use nalgebra::{Quaternion, UnitQuaternion};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use zsim_base::geometry::{Kinematics, Pose, Rotation, Route, Trajectory, Vector, from_roll_pitch_yaw};
use zsim_base::spec::checked::{NonNegative, Positive};
use zsim_base::spec::{Source, SpecError};
use zsim_base::time::Stamp;
use zsim_recording::{Reader, read_tum};

/// A recorded trajectory that the base follows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReplaySpec {
    /// The poses `world_from_base`.
    pub poses: PosesSpec,
    /// If true, the trajectory is translated and turned about the vertical so that it starts at the start of the
    /// scene's route; if false, it is replayed as recorded.
    #[serde(default = "crate::usual::from_route")]
    pub from_route: bool,
    /// Time at rest at the start, s.
    #[serde(default = "crate::usual::still_s", with = "NonNegative")]
    pub still_s: f64,
    /// Half of the time in which the replay reaches full speed, and stops, s.
    #[serde(default = "crate::usual::ease_s", with = "Positive")]
    pub ease_s: f64,
}

/// Source of recorded poses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum PosesSpec {
    /// A file in the TUM format; a relative path is resolved from the folder of the spec.
    Tum(String),
    /// An MCAP recording, by zsim or another system.
    Recording {
        /// The file, or the folder that contains it; a relative path is resolved from the folder of the spec.
        file: String,
        /// Topic of type `nav_msgs/Odometry` or `geometry_msgs/PoseStamped`. Default: `/ground_truth/odom`, else the
        /// first such topic by name.
        #[serde(default)]
        topic: Option<String>,
    },
    /// Poses in this file: time in s, position in m, roll, pitch and yaw in degrees.
    Here(Vec<(f64, [f64; 3], [f64; 3])>),
}

/// Maximum rotation between two poses, rad: beyond 90 degrees the direction of rotation is ambiguous.
const MAX_TURN_RAD: f64 = std::f64::consts::FRAC_PI_2;

/// Motion along a recorded trajectory.
pub(super) struct Replay {
    /// Time of the recording over time, on the first axis.
    play: SmoothPath,
    spline: Spline<7>,
    world_from_recorded: Pose,
}

impl Replay {
    pub fn new(spec: &ReplaySpec, source: &Source, route: Option<&Route>) -> Result<Self, MotionError> {
        let trajectory = spec.poses.trajectory(source)?;
        let error = |message: String| SpecError::about(source, "poses", message);
        let (Some((start, end)), Some(first)) = (trajectory.span(), trajectory.poses().first()) else {
            return Err(error("the trajectory has no poses".to_owned()).into());
        };
        if trajectory.len() < 3 {
            return Err(
                error(format!("a spline needs at least 3 poses; the trajectory has {}", trajectory.len())).into()
            );
        }
        let world_from_recorded = if spec.from_route {
            let (floor, heading) = start_on_route(route);
            align_start(&floor, heading, first)
        } else {
            Pose::identity()
        };
        let length_s = end.seconds_since(start);
        let mut play = SmoothPath::new(Vector::zeros(), spec.still_s + spec.ease_s, spec.ease_s);
        play.move_to(Vector::new(length_s, 0.0, 0.0), length_s);
        let spline = fit_spline(&trajectory, start).map_err(error)?;
        Ok(Self { play, spline, world_from_recorded })
    }
}

/// Translation and turn about the vertical that move `first` to the start of the route; the height does not change.
fn align_start(floor: &Vector, heading: f64, first: &Pose) -> Pose {
    let (_, _, yaw) = first.rotation.euler_angles();
    let turn = from_roll_pitch_yaw(0.0, 0.0, heading - yaw);
    let below = Vector::new(first.translation.x, first.translation.y, 0.0);
    Pose::from_parts((floor - turn * below).into(), turn)
}

fn from_folder(source: &Source, file: &str) -> PathBuf {
    source.folder.as_deref().unwrap_or(Path::new("")).join(file)
}

impl PosesSpec {
    /// The file, or the folder of a recording; a relative path is resolved from the folder of `source`.
    pub(super) fn file(&self, source: &Source) -> Option<PathBuf> {
        match self {
            PosesSpec::Tum(file) | PosesSpec::Recording { file, .. } => Some(from_folder(source, file)),
            PosesSpec::Here(_) => None,
        }
    }

    fn trajectory(&self, source: &Source) -> Result<Trajectory, SpecError> {
        let error = |message: String| SpecError::about(source, "poses", message);
        let resolve = |file: &str| from_folder(source, file);
        match self {
            PosesSpec::Tum(file) => read_tum(&resolve(file)).map_err(|cause| error(cause.to_string())),
            PosesSpec::Recording { file, topic } => {
                let poses = Reader::open(&resolve(file)).and_then(|reader| reader.poses(topic.as_deref()));
                poses.map_err(|cause| error(cause.to_string()))
            }
            PosesSpec::Here(rows) => {
                let stamped = rows.iter().map(|(t_s, position_m, degrees)| {
                    let [roll, pitch, yaw] = degrees.map(f64::to_radians);
                    let rotation = from_roll_pitch_yaw(roll, pitch, yaw);
                    let nanos = zsim_base::time::Span::from_seconds(*t_s).nanos();
                    (Stamp::from_nanos(nanos), Pose::from_parts(Vector::from(*position_m).into(), rotation))
                });
                if let Some(bad) = rows.iter().position(|row| !row.0.is_finite()) {
                    return Err(error(format!("the time of pose {bad} (counted from 0) is not finite")));
                }
                Trajectory::from_poses(stamped).map_err(|cause| error(cause.to_string()))
            }
        }
    }
}

/// Fits the spline to the positions and quaternions of a trajectory.
fn fit_spline(trajectory: &Trajectory, start: Stamp) -> Result<Spline<7>, String> {
    let mut times_s = Vec::with_capacity(trajectory.len());
    let mut values: Vec<[f64; 7]> = Vec::with_capacity(trajectory.len());
    let mut last: Option<Rotation> = None;
    for (stamp, pose) in trajectory.iter() {
        let mut rotation = pose.rotation;
        if let Some(last) = &last {
            // q and -q are the same rotation: take the one closer to the previous quaternion.
            if last.coords.dot(&rotation.coords) < 0.0 {
                rotation = UnitQuaternion::new_unchecked(-rotation.into_inner());
            }
            let turn = last.angle_to(&rotation);
            if turn > MAX_TURN_RAD {
                return Err(format!(
                    "at {:.3} s the trajectory turns by {:.0} degrees between two poses; above 90 degrees the direction of rotation is ambiguous: provide more poses",
                    stamp.seconds_since(start),
                    turn.to_degrees()
                ));
            }
        }
        let (position, q) = (&pose.translation, &rotation.coords);
        times_s.push(stamp.seconds_since(start));
        values.push([position.x, position.y, position.z, q.x, q.y, q.z, q.w]);
        last = Some(rotation);
    }
    Ok(Spline::natural(times_s, values))
}

impl BaseMotion for Replay {
    fn at(&self, t_s: f64) -> Kinematics {
        let [played, ..] = self.play.at(t_s);
        let [x, y, z, q @ ..] = self.spline.at(played.x).map(|jet| jet.compose(played));
        let part = |component: fn(&Jet) -> f64| {
            let [i, j, k, w] = q.each_ref().map(component);
            Quaternion::new(w, i, j, k)
        };
        let (q, rate, rise) = (part(|jet| jet.x), part(|jet| jet.d), part(|jet| jet.dd));
        // For p of any norm N = |p|^2: omega = 2 Im(p' p*) / N, and alpha = 2 Im(p'' p*) / N - omega N' / N.
        let norm = q.norm_squared();
        let angular_velocity = (rate * q.conjugate()).imag() * (2.0 / norm);
        let angular_acceleration =
            (rise * q.conjugate()).imag() * (2.0 / norm) - angular_velocity * (2.0 * q.dot(&rate) / norm);

        let moved = PoseJet { position: [x, y, z], ..PoseJet::default() }.kinematics();
        let turn = &self.world_from_recorded.rotation;
        let recorded = Pose::from_parts(moved.world_from_body.translation, UnitQuaternion::from_quaternion(q));
        Kinematics {
            world_from_body: self.world_from_recorded * recorded,
            velocity_in_world: turn * moved.velocity_in_world,
            angular_velocity_in_world: turn * angular_velocity,
            acceleration_in_world: turn * moved.acceleration_in_world,
            angular_acceleration_in_world: turn * angular_acceleration,
        }
    }
}

/// `N` natural cubic splines over the same knots.
struct Spline<const N: usize> {
    times_s: Vec<f64>,
    /// Value and second derivative at each knot.
    knots: Vec<([f64; N], [f64; N])>,
}

impl<const N: usize> Spline<N> {
    /// The spline through `values` at increasing times, at least two.
    ///
    /// The second derivatives m solve
    /// `h[i-1] m[i-1] + 2 (h[i-1] + h[i]) m[i] + h[i] m[i+1] = 6 (slope[i] - slope[i-1])` with zero at both ends. The
    /// tridiagonal system is diagonally dominant, so elimination needs no pivoting.
    fn natural(times_s: Vec<f64>, values: Vec<[f64; N]>) -> Self {
        let count = times_s.len();
        let mut upper = vec![0.0; count];
        let mut second = vec![[0.0; N]; count];
        for i in 1..count - 1 {
            let (before, after) = (times_s[i] - times_s[i - 1], times_s[i + 1] - times_s[i]);
            let pivot = 2.0 * (before + after) - before * upper[i - 1];
            upper[i] = after / pivot;
            for k in 0..N {
                let bend = (values[i + 1][k] - values[i][k]) / after - (values[i][k] - values[i - 1][k]) / before;
                second[i][k] = (6.0 * bend - before * second[i - 1][k]) / pivot;
            }
        }
        for i in (1..count - 1).rev() {
            let (here, after) = second.split_at_mut(i + 1);
            for (m, next) in here[i].iter_mut().zip(&after[0]) {
                *m -= upper[i] * next;
            }
        }
        Self { times_s, knots: values.into_iter().zip(second).collect() }
    }

    /// The splines at a time within the knots, with their derivatives.
    fn at(&self, t_s: f64) -> [Jet; N] {
        let after = self.times_s.partition_point(|time| *time <= t_s).clamp(1, self.times_s.len() - 1);
        let (t0, t1) = (self.times_s[after - 1], self.times_s[after]);
        let ((y0, m0), (y1, m1)) = (&self.knots[after - 1], &self.knots[after]);
        let h = t1 - t0;
        let (a, b) = (t1 - t_s, t_s - t0);
        std::array::from_fn(|k| {
            let (p, q) = (y0[k] / h - m0[k] * h / 6.0, y1[k] / h - m1[k] * h / 6.0);
            Jet {
                x: (m0[k] * a * a * a + m1[k] * b * b * b) / (6.0 * h) + p * a + q * b,
                d: (m1[k] * b * b - m0[k] * a * a) / (2.0 * h) + q - p,
                dd: (m0[k] * a + m1[k] * b) / h,
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_error_of_a_spline_through_a_sine_is_of_fourth_order() {
        // The second derivative of sin is zero at 0 and at pi, so the natural spline has no boundary error: |error| <=
        // 5/384 h^4 max|y''''|.
        let error = |count: i32| {
            let h = std::f64::consts::PI / f64::from(count);
            let times: Vec<f64> = (0..=count).map(|k| h * f64::from(k)).collect();
            let values = times.iter().map(|t| [t.sin()]).collect();
            let spline = Spline::natural(times, values);
            let errors = (0..1000).map(|k| {
                let t = std::f64::consts::PI * f64::from(k) / 1000.0;
                (spline.at(t)[0].x - t.sin()).abs()
            });
            (errors.fold(0.0, f64::max), 5.0 / 384.0 * h.powi(4))
        };
        let ((coarse, bound), (fine, _)) = (error(10), error(20));
        assert!(coarse < bound, "{coarse} against {bound}");
        assert_relative_eq!(coarse / fine, 16.0, epsilon = 1.0);
    }
}
