use zsim_base::geometry::{Kinematics, Rotation, Vector, gravity_in_world};
use zsim_base::measurement::ImuAveraging;

/// Duration of an instantaneous reading, s.
///
/// A difference over it is consistent with the integrated motion; the angular velocity that a
/// [`Track`](crate::Track) interpolates between its nodes differs from the derivative of the attitude by enough to
/// drift by millimetres in half a minute.
const INSTANT_S: f64 = 1e-5;
/// Subintervals of an interval for the mean in body axes and for saturation within the interval.
pub(super) const SUBINTERVALS: usize = 10;

/// Angular velocity and specific force in the IMU frame: the content of an IMU sample.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct InertialReading {
    /// Angular velocity, rad/s.
    pub angular_velocity_rad_per_s: Vector,
    /// Specific force, gravity included, m/s^2.
    pub specific_force_m_per_s2: Vector,
}

/// The reading of an ideal IMU over the interval from `from_s` to `to_s`; `motion` is that of the IMU frame, by time.
pub fn ideal_reading(
    averaging: ImuAveraging,
    motion: impl Fn(f64) -> Kinematics,
    (from_s, to_s): (f64, f64),
) -> InertialReading {
    match averaging {
        ImuAveraging::None => {
            let middle_s = 0.5 * (from_s + to_s);
            let [before, after] = [-0.5, 0.5].map(|side| motion(middle_s + side * INSTANT_S));
            coning_corrected(&before, &after, INSTANT_S)
        }
        ImuAveraging::BodyMean => body_mean(motion, (from_s, to_s)),
        ImuAveraging::ConingCorrected => coning_corrected(&motion(from_s), &motion(to_s), to_s - from_s),
    }
}

/// The compensated reading over the interval from `start` to `end`, of length `dt_s`.
///
/// It is the change of attitude and velocity over the interval, divided by the length, as a strapdown unit reports it
/// that integrates at a high rate inside (coning and sculling included).
///
/// The angular velocity is `log(R_start^T R_end) / dt`. The specific force is `R_mid^T ((v_end - v_start) / dt - g)`,
/// with `R_mid` half-way along that rotation. Integration by `exp(angular_velocity dt)` and `R_mid specific_force + g`
/// therefore reproduces attitude and velocity exactly, for any motion within the interval.
pub fn coning_corrected(start: &Kinematics, end: &Kinematics, dt_s: f64) -> InertialReading {
    let from = start.world_from_body.rotation;
    let turn = (from.inverse() * end.world_from_body.rotation).scaled_axis();
    let middle = from * Rotation::from_scaled_axis(turn * 0.5);
    let acceleration = (end.velocity_in_world - start.velocity_in_world) / dt_s;
    InertialReading {
        angular_velocity_rad_per_s: turn / dt_s,
        specific_force_m_per_s2: middle.inverse() * (acceleration - gravity_in_world()),
    }
}

/// The compensated readings over `count` equal parts of the interval from `from_s` to `to_s`.
pub(super) fn parts(
    motion: impl Fn(f64) -> Kinematics,
    (from_s, to_s): (f64, f64),
    count: usize,
) -> impl Iterator<Item = InertialReading> {
    let dt_s = (to_s - from_s) / count as f64;
    let mut start = motion(from_s);
    (1..=count).map(move |k| {
        let end = motion(from_s + k as f64 * dt_s);
        let part = coning_corrected(&start, &end, dt_s);
        start = end;
        part
    })
}

/// The means of angular velocity and specific force over an interval, in the axes of the body.
///
/// A compensated reading differs from the mean by coning and sculling terms proportional to the squared length of the
/// interval. The average of compensated readings over `n` subintervals has `1 / n^2` of them, which the extrapolation
/// (Richardson) removes.
fn body_mean(motion: impl Fn(f64) -> Kinematics, (from_s, to_s): (f64, f64)) -> InertialReading {
    let n = SUBINTERVALS as f64;
    let whole = coning_corrected(&motion(from_s), &motion(to_s), to_s - from_s);
    let (mut rate, mut force) = (Vector::zeros(), Vector::zeros());
    for part in parts(motion, (from_s, to_s), SUBINTERVALS) {
        rate += part.angular_velocity_rad_per_s / n;
        force += part.specific_force_m_per_s2 / n;
    }
    let extrapolated = |average: Vector, whole: Vector| average + (average - whole) / (n * n - 1.0);
    InertialReading {
        angular_velocity_rad_per_s: extrapolated(rate, whole.angular_velocity_rad_per_s),
        specific_force_m_per_s2: extrapolated(force, whole.specific_force_m_per_s2),
    }
}
