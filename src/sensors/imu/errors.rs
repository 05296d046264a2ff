use super::triad_model::TriadModel;
use super::{Imu, InertialReading};
use crate::geometry::{Matrix, Vector};
use crate::random::{Seed, Stream};
use rand_distr::{Distribution, StandardNormal};

/// Errors of an IMU in one run, sampled with a seed: scale, misalignment, and biases that change over time.
///
/// A sample over `dt` is `round(clamp((I + S + M) true + bias + white))`, with white noise of `density / sqrt(dt)`. The
/// bias follows a random walk, `b' = b + walk sqrt(dt) w`, as Kalibr writes it, plus an optional Gauss-Markov process,
/// `b' = phi b + sigma sqrt(1 - phi^2) w` with `phi = exp(-dt / time)`, plus the bias instability, a sum of such processes.
/// `S` (scale errors) is diagonal; `M` (misalignments) has the other six entries.
#[derive(Debug, Clone)]
pub struct ImuErrors {
    gyro: Triad,
    accel: Triad,
}

impl ImuErrors {
    /// The errors of `imu` in the run with `seed`.
    pub fn new(imu: &Imu, seed: Seed) -> Self {
        let dt_s = imu.period_s();
        Self {
            gyro: Triad::new(&imu.gyro, dt_s, seed, "imu/gyro"),
            accel: Triad::new(&imu.accel, dt_s, seed, "imu/accel"),
        }
    }

    /// The next sample, given the ideal one.
    pub fn measure(&mut self, ideal: &InertialReading) -> InertialReading {
        InertialReading {
            angular_velocity_rad_per_s: self.gyro.measure(&ideal.angular_velocity_rad_per_s),
            specific_force_m_per_s2: self.accel.measure(&ideal.specific_force_m_per_s2),
        }
    }

    /// Biases of the next sample: gyroscope, rad/s, and accelerometer, m/s^2.
    pub fn biases(&self) -> (Vector, Vector) {
        (self.gyro.bias(), self.accel.bias())
    }
}

#[derive(Debug, Clone)]
struct Triad {
    response: Matrix,
    /// The constant part of the bias and its random walk.
    walking_bias: Vector,
    wandering_biases: Vec<WanderingBias>,
    /// Standard deviation per sample; so is `walk_sigma`.
    white_sigma: f64,
    walk_sigma: f64,
    limit: f64,
    resolution: f64,
    white: Stream,
    walk: Stream,
    wander: Stream,
}

/// A Gauss-Markov process, sampled.
#[derive(Debug, Clone)]
struct WanderingBias {
    value: Vector,
    /// Decay factor per sample, and standard deviation of the increment.
    decay: f64,
    sigma: f64,
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
        let mut wander = stream("wander");
        let wandering_biases = model.processes().map(|process| {
            let decay = (-dt_s / process.time_s).exp();
            let value = normal(&mut wander) * process.sigma;
            WanderingBias { value, decay, sigma: process.sigma * (1.0 - decay * decay).sqrt() }
        });
        let wandering_biases = wandering_biases.collect();
        Self {
            response,
            walking_bias: normal(&mut stream("turn_on")) * model.turn_on,
            wandering_biases,
            white_sigma: model.density / dt_s.sqrt(),
            walk_sigma: model.walk * dt_s.sqrt(),
            limit: model.limit,
            resolution: model.resolution,
            white: stream("white"),
            walk: stream("walk"),
            wander,
        }
    }

    fn bias(&self) -> Vector {
        self.wandering_biases.iter().fold(self.walking_bias, |sum, wandering| sum + wandering.value)
    }

    fn measure(&mut self, ideal: &Vector) -> Vector {
        let noisy = self.response * ideal + self.bias() + normal(&mut self.white) * self.white_sigma;
        self.walking_bias += normal(&mut self.walk) * self.walk_sigma;
        for wandering in &mut self.wandering_biases {
            wandering.value = wandering.value * wandering.decay + normal(&mut self.wander) * wandering.sigma;
        }
        noisy.map(|x| self.quantised(x).clamp(-self.limit, self.limit))
    }

    fn quantised(&self, x: f64) -> f64 {
        if self.resolution > 0.0 { (x / self.resolution).round() * self.resolution } else { x }
    }
}

/// Three independent standard normal numbers.
fn normal(stream: &mut Stream) -> Vector {
    Vector::from_fn(|_, _| StandardNormal.sample(stream))
}
