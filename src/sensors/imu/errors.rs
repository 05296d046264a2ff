use super::{GaussMarkovSpec, Imu, MeanMotion};
use crate::geometry::{Matrix, Vector};
use crate::random::{Seed, Stream};
use rand_distr::{Distribution, StandardNormal};

/// The errors of three like axes, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TriadModel {
    pub density: f64,
    pub turn_on: f64,
    pub walk: f64,
    pub wander: Option<GaussMarkov>,
    pub scale: f64,
    pub misalignment: f64,
    pub limit: f64,
    pub resolution: f64,
}

/// A first-order Gauss-Markov process in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GaussMarkov {
    sigma: f64,
    time_s: f64,
}

impl GaussMarkov {
    pub fn from_spec(spec: &GaussMarkovSpec, unit: f64) -> Self {
        Self { sigma: spec.sigma * unit, time_s: spec.time_s }
    }
}

/// What a seed makes of an IMU's errors: its scale and misalignment in this run, and its biases as they walk.
///
/// A sample over `dt` is `round(clamp((I + S + M) true + bias + white))`, with white noise of `density / sqrt(dt)` and
/// a bias `b' = b + walk sqrt(dt) w` from one sample to the next, beside an optional wandering part `b' = phi b + sigma
/// sqrt(1 - phi^2) w`, `phi = exp(-dt / time)`. (Noise as Kalibr's IMU model writes it; the axes' scale errors `S` are
/// a diagonal, their misalignments `M` the other six entries.)
#[derive(Debug, Clone)]
pub struct ImuErrors {
    gyro: Triad,
    accel: Triad,
}

impl ImuErrors {
    /// The errors of `imu` in the run of `seed`.
    pub fn new(imu: &Imu, seed: Seed) -> Self {
        let dt_s = imu.period_s();
        Self {
            gyro: Triad::new(&imu.gyro, dt_s, seed, "imu/gyro"),
            accel: Triad::new(&imu.accel, dt_s, seed, "imu/accel"),
        }
    }

    /// What the IMU says next, given what an ideal one would.
    pub fn measure(&mut self, ideal: &MeanMotion) -> MeanMotion {
        MeanMotion {
            angular_velocity_rad_per_s: self.gyro.measure(&ideal.angular_velocity_rad_per_s),
            specific_force_m_per_s2: self.accel.measure(&ideal.specific_force_m_per_s2),
        }
    }

    /// The biases of gyroscope, rad/s, and accelerometer, m/s^2, that the next sample will have.
    pub fn biases(&self) -> (Vector, Vector) {
        (self.gyro.bias + self.gyro.wandering, self.accel.bias + self.accel.wandering)
    }
}

#[derive(Debug, Clone)]
struct Triad {
    response: Matrix,
    bias: Vector,
    wandering: Vector,
    /// Per sample, as are the two below.
    white_sigma: f64,
    walk_sigma: f64,
    /// What is left of the wandering bias after a sample, and what comes in.
    wander: Option<(f64, f64)>,
    limit: f64,
    resolution: f64,
    white: Stream,
    walk: Stream,
    wander_noise: Stream,
}

impl Triad {
    fn new(model: &TriadModel, dt_s: f64, seed: Seed, name: &str) -> Self {
        let stream = |source: &str| seed.stream(&format!("{name}/{source}"));
        let scale = normal(&mut stream("scale")) * model.scale;
        let mut misalignment = stream("misalignment");
        let (upper, lower) = (normal(&mut misalignment), normal(&mut misalignment));
        #[rustfmt::skip]
        let response = Matrix::from_diagonal(&scale.add_scalar(1.0)) + Matrix::new(
            0.0, upper.x, upper.y,
            lower.x, 0.0, upper.z,
            lower.y, lower.z, 0.0,
        ) * model.misalignment;
        let mut wander_noise = stream("wander");
        let wandering = model.wander.map_or(Vector::zeros(), |wander| normal(&mut wander_noise) * wander.sigma);
        Self {
            response,
            bias: normal(&mut stream("turn_on")) * model.turn_on,
            wandering,
            white_sigma: model.density / dt_s.sqrt(),
            walk_sigma: model.walk * dt_s.sqrt(),
            wander: model.wander.map(|wander| {
                let phi = (-dt_s / wander.time_s).exp();
                (phi, wander.sigma * (1.0 - phi * phi).sqrt())
            }),
            limit: model.limit,
            resolution: model.resolution,
            white: stream("white"),
            walk: stream("walk"),
            wander_noise,
        }
    }

    fn measure(&mut self, ideal: &Vector) -> Vector {
        let noisy = self.response * ideal + self.bias + self.wandering + normal(&mut self.white) * self.white_sigma;
        self.bias += normal(&mut self.walk) * self.walk_sigma;
        if let Some((left, comes)) = self.wander {
            self.wandering = self.wandering * left + normal(&mut self.wander_noise) * comes;
        }
        noisy.map(|x| self.rounded(x).clamp(-self.limit, self.limit))
    }

    fn rounded(&self, x: f64) -> f64 {
        if self.resolution > 0.0 { (x / self.resolution).round() * self.resolution } else { x }
    }
}

/// Three independent standard normal numbers.
fn normal(stream: &mut Stream) -> Vector {
    Vector::from_fn(|_, _| StandardNormal.sample(stream))
}
