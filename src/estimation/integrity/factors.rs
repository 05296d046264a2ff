//! Factors on the error bound where the estimator's assumptions fail.

use super::evidence::median;
use crate::{EventKind, WindowReport};
use zsim_base::time::Stamp;

/// Contradiction, residual (m), and IMU scale over its standard deviation, up to which the bound is not enlarged.
const NOMINAL_EVIDENCE: (f64, f64, f64) = (0.4, 0.006, 1.8);
/// Convergence is evaluated over this number of windows, 20 s at the default step.
const CONVERGENCE_WINDOWS: usize = 40;
/// Root mean square of the last corrections of converged windows, m or rad.
///
/// 0.1 to 0.5 mm in runs with errors of millimetres; 1 to 4 mm in runs with errors of centimetres, where the choice of
/// matches changes the solution.
const CONVERGED_RMS: f64 = 0.0005;
/// Upper limit of the correction of a window, m or rad: the first window after a gap or shock has a large one.
const MAX_CORRECTION: f64 = 0.02;
/// A window with a larger last correction has not converged, m or rad.
const NOT_CONVERGED: f64 = 0.0002;
/// Fraction of windows without convergence up to which the bound is not enlarged: 3 to 15 % in most places, 40 to 60 %
/// on stairs.
pub(super) const NOT_CONVERGED_FRACTION: f64 = 0.15;
/// Growth of the bound with the excess of that fraction.
pub(super) const FACTOR_PER_FRACTION: f64 = 4.0;
/// Median conditioning over the same windows below which the bound is enlarged, and the lower limit.
///
/// Errors of the normals are then a large part of the information along the weakest direction.
const CONDITIONING: (f64, f64) = (0.002, 0.0001);
/// Number of consecutive windows with degenerate geometry from which on the bound is enlarged by [`WEAK_FACTOR`].
const WEAK_WINDOWS: usize = 12;
/// Factor by which the covariance is too small then, because errors of the normals count as information.
const WEAK_FACTOR: f64 = 4.0;
/// Upper limit of the factor on the bound.
const MAX_FACTOR: f64 = 1000.0;
/// Upper limit of the factor from the IMU scale, which after a shock is a poor measure of the trajectory error.
const MAX_SCALE_FACTOR: f64 = 10.0;

/// Factors on the covariance-based error bound, at the end of each window.
///
/// The covariance assumes that IMU, lidar and calibration are as specified. If IMU and lidar contradict each other,
/// surfaces fit badly, or the IMU scale is far from the prior, the covariance is too small by a similar factor. An error
/// persists in the map, so the factors never decrease.
pub fn bound_factors(windows: &[WindowReport]) -> Vec<(Stamp, f64)> {
    let mut largest = 1.0_f64;
    let of = CONVERGENCE_WINDOWS.min(windows.len());
    let neighbourhood = |k: usize| &windows[k.saturating_sub(2)..(k + 3).min(windows.len())];
    let factor = |k: usize| {
        let contradiction = median(neighbourhood(k).iter().map(|w| w.imu_contradiction).collect());
        let residual_m = median(neighbourhood(k).iter().map(|w| w.residual_rms_m).collect());
        let is_weak = |w: &WindowReport| matches!(w.problem, Some(EventKind::WeakGeometry { .. }));
        let stays_weak = k + 1 >= WEAK_WINDOWS && windows[k + 1 - WEAK_WINDOWS..=k].iter().all(is_weak);
        let weak = if stays_weak { WEAK_FACTOR } else { 1.0 };
        let scale = (windows[k].imu_matrix.over_model() / NOMINAL_EVIDENCE.2).powi(2).min(MAX_SCALE_FACTOR);
        let late = &windows[(k + 1).saturating_sub(of)..=k];
        let not_converged = not_converged(late, of).max(ill_conditioned(late, of));
        // A contradiction that noise does not explain causes an error that grows faster than linearly.
        (contradiction / NOMINAL_EVIDENCE.0)
            .powi(2)
            .max(residual_m / NOMINAL_EVIDENCE.1)
            .max(scale)
            .max(weak)
            .max(not_converged)
            .clamp(1.0, MAX_FACTOR)
    };
    let enlarge = |k: usize| {
        largest = largest.max(factor(k));
        (windows[k].stamp, largest)
    };
    (0..windows.len()).map(enlarge).collect()
}

/// Factor by which errors exceed the covariance without convergence, over the last `of` windows.
fn not_converged(windows: &[WindowReport], of: usize) -> f64 {
    let squares: f64 = windows.iter().map(|w| w.last_correction_m.min(MAX_CORRECTION).powi(2)).sum();
    let not_converged = windows.iter().filter(|w| w.last_correction_m > NOT_CONVERGED).count();
    let fraction = not_converged as f64 / of as f64;
    let rms = (squares / of as f64).sqrt();
    (rms / CONVERGED_RMS).max(1.0 + FACTOR_PER_FRACTION * (fraction - NOT_CONVERGED_FRACTION))
}

/// Factor by which the covariance is too small in the weakest direction of badly conditioned windows.
fn ill_conditioned(windows: &[WindowReport], of: usize) -> f64 {
    let matched: Vec<f64> = windows.iter().filter(|w| w.matches > 0 && !w.resting).map(|w| w.conditioning).collect();
    let enough = 2 * matched.len() > of;
    if enough { (CONDITIONING.0 / median(matched).max(CONDITIONING.1)).sqrt() } else { 1.0 }
}
