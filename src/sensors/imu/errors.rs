use super::triad_model::TriadModel;
use super::{Imu, InertialReading};
use rand_distr::{Distribution, StandardNormal};
use zsim_base::geometry::{Matrix, Vector};
use zsim_base::random::{Seed, Stream};

/// Below this fraction of the limit, the mean over a sample shows that no axis saturated within the sample: a shock of a tenth of
/// the sample that reaches the limit several times over exceeds it.
const IN_RANGE_THROUGHOUT: f64 = 0.25;

/// Errors of an IMU in one run, sampled with a seed: scale, misalignment, and biases that change over time.
///
/// A sample over `dt` is `clamp(round((I + S + M) true + bias + white))`, with white noise of `density / sqrt(dt)`; with an
/// output filter, `clamp(round(filter(clamp((I + S + M) true + bias + white))))` over the steps `dt` of the filter. The
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
        let dt_s = imu.step_s();
        Self {
            gyro: Triad::new(&imu.gyro, dt_s, seed, "imu/gyro"),
            accel: Triad::new(&imu.accel, dt_s, seed, "imu/accel"),
        }
    }

    /// The next sample, given the ideal one.
    pub fn measure(&mut self, ideal: &InertialReading) -> InertialReading {
        self.by_triad(ideal, |triad, ideal| {
            let sensed = triad.sense(ideal);
            triad.read_out(&sensed)
        })
    }

    /// Whether the sensors do not saturate within an interval with this mean.
    pub(super) fn is_in_range_throughout(&self, mean: &InertialReading) -> bool {
        mean.angular_velocity_rad_per_s.amax() < IN_RANGE_THROUGHOUT * self.gyro.limit
            && mean.specific_force_m_per_s2.amax() < IN_RANGE_THROUGHOUT * self.accel.limit
    }

    /// The next sample, given the ideal one over an interval and those of its equal parts, which saturate.
    pub(super) fn measure_mean(
        &mut self,
        ideal: &InertialReading,
        parts: impl Iterator<Item = InertialReading>,
    ) -> InertialReading {
        let (rates, forces): (Vec<Vector>, Vec<Vector>) =
            parts.map(|part| (part.angular_velocity_rad_per_s, part.specific_force_m_per_s2)).unzip();
        InertialReading {
            angular_velocity_rad_per_s: self.gyro.measure_mean(&ideal.angular_velocity_rad_per_s, &rates),
            specific_force_m_per_s2: self.accel.measure_mean(&ideal.specific_force_m_per_s2, &forces),
        }
    }

    /// The next input of the output filter, given the ideal reading: with errors and saturation.
    pub(super) fn sense(&mut self, ideal: &InertialReading) -> InertialReading {
        self.by_triad(ideal, |triad, ideal| {
            let sensed = triad.sense(ideal);
            triad.clamped(&sensed)
        })
    }

    /// The sample of an output of the filter: rounded, and within the range.
    pub(super) fn read_out(&mut self, filtered: &InertialReading) -> InertialReading {
        self.by_triad(filtered, |triad, filtered| triad.read_out(filtered))
    }

    fn by_triad(
        &mut self,
        reading: &InertialReading,
        apply: impl Fn(&mut Triad, &Vector) -> Vector,
    ) -> InertialReading {
        InertialReading {
            angular_velocity_rad_per_s: apply(&mut self.gyro, &reading.angular_velocity_rad_per_s),
            specific_force_m_per_s2: apply(&mut self.accel, &reading.specific_force_m_per_s2),
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
    warm_up: WarmingBias,
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

/// A bias that changes while the sensor warms up.
#[derive(Debug, Clone)]
struct WarmingBias {
    /// The bias of the warm sensor relative to that of the cold one.
    when_warm: Vector,
    /// Remaining part of the rise of temperature, and its decay factor per sample.
    cold: f64,
    decay: f64,
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
            warm_up: WarmingBias {
                when_warm: normal(&mut stream("warm_up")) * model.warm_up.sigma,
                cold: 1.0,
                decay: (-dt_s / model.warm_up.time_s).exp(),
            },
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
        let warming = self.warm_up.when_warm * (1.0 - self.warm_up.cold);
        self.wandering_biases.iter().fold(self.walking_bias + warming, |sum, wandering| sum + wandering.value)
    }

    /// The next reading with errors, neither limited nor rounded.
    fn sense(&mut self, ideal: &Vector) -> Vector {
        let noisy = self.response * ideal + self.bias() + normal(&mut self.white) * self.white_sigma;
        self.walking_bias += normal(&mut self.walk) * self.walk_sigma;
        for wandering in &mut self.wandering_biases {
            wandering.value = wandering.value * wandering.decay + normal(&mut self.wander) * wandering.sigma;
        }
        self.warm_up.cold *= self.warm_up.decay;
        noisy
    }

    /// The next reading with errors, given the ideal one and those of equal parts of the interval, which saturate.
    fn measure_mean(&mut self, ideal: &Vector, parts: &[Vector]) -> Vector {
        let sensed = self.sense(ideal);
        let (errors, limit) = (sensed - ideal, self.limit);
        let saturated = Vector::from_fn(|axis, _| {
            let within = parts.iter().map(|part| part[axis] + errors[axis]);
            if within.clone().all(|x| x.abs() >= limit) {
                return sensed[axis].signum() * limit;
            }
            sensed[axis] - within.map(|x| x - x.clamp(-limit, limit)).sum::<f64>() / parts.len() as f64
        });
        self.read_out(&saturated)
    }

    fn read_out(&self, reading: &Vector) -> Vector {
        self.clamped(&reading.map(|x| self.quantised(x)))
    }

    fn clamped(&self, reading: &Vector) -> Vector {
        reading.map(|x| x.clamp(-self.limit, self.limit))
    }

    fn quantised(&self, x: f64) -> f64 {
        if self.resolution > 0.0 { (x / self.resolution).round() * self.resolution } else { x }
    }
}

/// Three independent standard normal numbers.
fn normal(stream: &mut Stream) -> Vector {
    Vector::from_fn(|_, _| StandardNormal.sample(stream))
}
