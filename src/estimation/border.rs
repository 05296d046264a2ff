//! What is remembered of biases, gravity and clock from window to window.

use super::consider::{AT_IMU, IMU, OfBeginning};
use super::normal_equations::{Factor, NormalEquations};
use super::residual::prior::add_border;
use super::residual::{ACCEL_BIAS, BORDER, CLOCK, CLOCK_RATE, GRAVITY, GYRO_BIAS, Layout};
use crate::measurement::ImuNoise;
use nalgebra::{SMatrix, SVector};

/// Wander of the clock offset that its rate does not explain, s per square root of a second.
const CLOCK_WALK: f64 = 5e-6;
/// Wander of the clock's rate, 1 per square root of a second.
const RATE_WALK: f64 = 2e-7;

/// Prior and posterior information about the border.
///
/// Windows overlap: what a window adds to the prior is mostly measured again by the next one. So only the leaving stretch's
/// share of it is remembered, and the walks of biases and clock wear it down.
#[derive(Debug, Clone)]
pub(super) struct Border {
    prior: SMatrix<f64, BORDER, BORDER>,
    posterior: SMatrix<f64, BORDER, BORDER>,
    moved: SVector<f64, BORDER>,
    walks: [f64; BORDER],
}

impl Border {
    /// Knows `prior` at first; a clock that is not estimated does not wander.
    pub(super) fn new(prior: SMatrix<f64, BORDER, BORDER>, noise: &ImuNoise, clock_wanders: bool) -> Self {
        let mut walks = [0.0; BORDER];
        walks[GYRO_BIAS..GYRO_BIAS + 3].fill(noise.gyro_bias_walk_rad_per_s_per_sqrt_s);
        walks[ACCEL_BIAS..ACCEL_BIAS + 3].fill(noise.accel_bias_walk_m_per_s2_per_sqrt_s);
        walks[GRAVITY..GRAVITY + 2].fill(1e-6);
        if clock_wanders {
            walks[CLOCK] = CLOCK_WALK;
            walks[CLOCK_RATE] = RATE_WALK;
        }
        Self { prior, posterior: prior, moved: SVector::zeros(), walks }
    }

    /// A window begins from the values as they are.
    pub(super) fn begin_window(&mut self) {
        self.moved = SVector::zeros();
        self.posterior = self.prior;
    }

    /// A solve moved the border by `by`; `factor` is that of its equations.
    pub(super) fn moved(&mut self, by: &[f64], factor: &Factor) {
        self.moved += SVector::from_column_slice(by);
        self.posterior = factor.information_of_last::<BORDER>();
    }

    /// What the window knew before of the IMU's part, all else being unknown.
    pub(super) fn imu_information(&self) -> Option<SMatrix<f64, IMU, IMU>> {
        self.prior.try_inverse()?.fixed_view::<IMU, IMU>(0, 0).try_inverse()
    }

    /// By how much the IMU's part of what a window begins with wanders in `seconds`.
    pub(super) fn imu_wanders(&self, seconds: f64) -> OfBeginning {
        let mut by = OfBeginning::zeros();
        (0..IMU).for_each(|k| by[(AT_IMU + k, AT_IMU + k)] = self.walks[k].powi(2) * seconds);
        by
    }

    /// How far it has moved in this window.
    pub(super) fn moved_so_far(&self) -> &SVector<f64, BORDER> {
        &self.moved
    }

    pub(super) fn add_to(&self, equations: &mut NormalEquations, layout: &Layout) {
        add_border(equations, layout, &self.prior, &self.moved);
    }

    /// A stretch leaves that was `share` of the window: its share of what the window added becomes prior knowledge, and
    /// the walks of `seconds` wear it.
    pub(super) fn remember(&mut self, share: f64, seconds: f64) {
        let known = self.prior + (self.posterior - self.prior) * share;
        let Some(mut covariance) = known.try_inverse() else { return };
        for (k, walk) in self.walks.iter().enumerate() {
            covariance[(k, k)] += walk * walk * seconds;
        }
        if let Some(information) = covariance.try_inverse() {
            self.prior = (information + information.transpose()) * 0.5;
        }
    }

    /// The clock's offset is told from an instant `later_s` later: the offset's error gets the rate's share.
    pub(super) fn clock_told_from(&mut self, later_s: f64) {
        // offset_new = offset + rate later, so for information the columns change by the inverse map.
        let mut back = SMatrix::<f64, BORDER, BORDER>::identity();
        back[(CLOCK, CLOCK_RATE)] = -later_s;
        self.prior = back.transpose() * self.prior * back;
    }
}
