//! The information bound with an unknown map, compared with simulated least-squares estimates of a lift in a shaft.

use super::bound::{exact, stamp};
use super::slam_bound::{EPOCH_S, SIGMA_M, times, weights};
use approx::assert_relative_eq;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix2};
use rand_distr::{Distribution, StandardNormal};
use zsim::evaluation::{BeamObservation, FisherInformation, InformationBound, MapKnowledge};
use zsim::geometry::{Pose, STANDARD_GRAVITY_M_PER_S2, Vector};
use zsim::measurement::ImuSample;
use zsim::random::Seed;

/// Density of the accelerometer's noise of the shaft, m/s^2/sqrt(Hz).
const ACCEL_DENSITY: f64 = 0.05;
const SHAFT_S: f64 = 3.0;
/// Beams of the shaft per epoch and direction.
const SHAFT_BEAMS: usize = 4;

/// Whether a lift in a shaft sees the floor and the ceiling at an epoch: first the floor only, last the ceiling only.
fn sees(epoch: usize) -> (bool, bool) {
    (epoch < 85, epoch > 65)
}

fn shaft_bound() -> InformationBound {
    let mut model = exact();
    model.imu.accel_density_m_per_s2_per_sqrt_hz = ACCEL_DENSITY;
    let mut information = FisherInformation::new(model, MapKnowledge::Unknown);
    for ms in 0..=(SHAFT_S * 1e3) as i64 {
        let t = ms as f64 * 1e-3;
        information.add_head(stamp(t), &Pose::identity());
        let specific_force_m_per_s2 = Vector::z() * STANDARD_GRAVITY_M_PER_S2;
        let sample =
            ImuSample { stamp: stamp(t), angular_velocity_rad_per_s: Vector::zeros(), specific_force_m_per_s2 };
        information.add_imu_sample(stamp(t), &sample);
    }
    for epoch in 0..=(SHAFT_S / EPOCH_S) as usize {
        let (floor, ceiling) = sees(epoch);
        for (plane, direction, seen) in [(0, -Vector::z(), floor), (1, Vector::z(), ceiling)] {
            let beam = BeamObservation {
                stamp: stamp(epoch as f64 * EPOCH_S),
                world_from_head: Pose::identity(),
                velocity_in_world: Vector::zeros(),
                angular_velocity_in_world: Vector::zeros(),
                hit_in_world: direction * 2.0,
                direction_in_world: direction,
                normal_in_world: -direction,
                range_sigma_m: SIGMA_M,
                plane,
            };
            (0..SHAFT_BEAMS).filter(|_| seen).for_each(|_| information.add_beam(&beam));
        }
    }
    information.bound().unwrap()
}

/// Least squares of a lift in a shaft: heights and velocities of all epochs, heights of floor and ceiling.
struct Shaft {
    epochs: usize,
    /// Rows of the whitened problem: coefficients of the unknowns.
    rows: Vec<Vec<(usize, f64)>>,
}

impl Shaft {
    fn new() -> Self {
        let epochs = (SHAFT_S / EPOCH_S) as usize + 1;
        let mut rows = vec![vec![(0, 1e6)], vec![(1, 0.1)]];
        let whitening = step_noise().cholesky().unwrap().l().try_inverse().unwrap();
        for epoch in 0..epochs - 1 {
            let at = 2 * epoch;
            let height = [(at + 2, 1.0), (at, -1.0), (at + 1, -EPOCH_S)];
            let velocity = [(at + 3, 1.0), (at + 1, -1.0)];
            for white in whitening.row_iter() {
                let of =
                    |row: &[(usize, f64)], weight: f64| row.iter().map(|(k, x)| (*k, x * weight)).collect::<Vec<_>>();
                rows.push([of(&height, white[0]), of(&velocity, white[1])].concat());
            }
        }
        for epoch in 0..epochs {
            let (floor, ceiling) = sees(epoch);
            for (seen, surface, sign) in [(floor, 2 * epochs, 1.0), (ceiling, 2 * epochs + 1, -1.0)] {
                let row = vec![(2 * epoch, sign / SIGMA_M), (surface, -sign / SIGMA_M)];
                (0..SHAFT_BEAMS).filter(|_| seen).for_each(|_| rows.push(row.clone()));
            }
        }
        Self { epochs, rows }
    }

    fn factor(&self) -> Cholesky<f64, Dyn> {
        let mut normal = DMatrix::zeros(2 * self.epochs + 2, 2 * self.epochs + 2);
        for row in &self.rows {
            for (i, x) in row {
                row.iter().for_each(|(j, y)| normal[(*i, *j)] += x * y);
            }
        }
        normal.cholesky().unwrap()
    }
}

/// Covariance of height and velocity after a step under white acceleration noise.
fn step_noise() -> Matrix2<f64> {
    let (q, h) = (ACCEL_DENSITY * ACCEL_DENSITY, EPOCH_S);
    Matrix2::new(h.powi(3) / 3.0, h * h / 2.0, h * h / 2.0, h) * q
}

#[test]
fn simulated_estimates_of_a_lift_between_unknown_surfaces_scatter_as_the_bound_says() {
    // A lift that hands over from the floor to the ceiling, both of unknown height. The errors of least squares on simulated
    // noise have the variance of the bound: 4000 runs determine it to 2.2 %.
    const RUNS: usize = 4000;
    let shaft = Shaft::new();
    let factor = shaft.factor();
    let mut stream = Seed(6).stream("shaft");
    let bound = shaft_bound();
    let times = times(&bound);
    let (weights, mut squares) = (weights(&times), vec![0.0; times.len()]);
    for _ in 0..RUNS {
        // The true errors are zero, so each whitened row measures noise; the first two are priors.
        let mut right = DVector::zeros(2 * shaft.epochs + 2);
        for row in shaft.rows.iter().skip(2) {
            let noise: f64 = StandardNormal.sample(&mut stream);
            row.iter().for_each(|(k, x)| right[*k] += x * noise);
        }
        let errors = factor.solve(&right);
        let heights: Vec<f64> = times.iter().map(|t| errors[2 * (t / EPOCH_S).round() as usize]).collect();
        // The lift is at one point, so an alignment shifts it by the mean error.
        let mean: f64 = heights.iter().zip(&weights).map(|(height, weight)| height * weight).sum();
        squares.iter_mut().zip(&heights).for_each(|(sum, height)| *sum += (height - mean).powi(2));
    }
    for (sigma, sum) in bound.position_sigma_m.iter().zip(&squares) {
        assert_relative_eq!(sigma.z.powi(2), sum / RUNS as f64, max_relative = 0.08);
    }
    // The handover loses accuracy: floor and ceiling are most of the error.
    let both = (0..times.len()).find(|k| times[*k] >= SHAFT_S / 2.0).unwrap();
    assert!(bound.position_sigma_m[2].z > 1.2 * bound.position_sigma_m[both].z);
}
