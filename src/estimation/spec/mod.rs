//! Settings of the estimator.

mod defaults;
mod places;
mod registration;
mod removed;
mod surfel;

use super::EstimationError;
pub use places::PlacesSpec;
pub use registration::RegistrationSpec;
use serde::{Deserialize, Serialize};
use surfel::MAX_LEVELS;
pub use surfel::{MatchingSpec, SurfelSpec};
use zsim_base::spec::SpecError;

/// Settings of the estimator; the defaults are in `specs/estimators/default.ron`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(default)]
pub struct EstimatorSpec {
    /// Length of the sliding window, s. A longer window uses more matches and takes longer to solve.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub window_s: f64,
    /// Step by which the window advances, s; at most half of `window_s`. Also the length of the segments whose surfels are
    /// added and removed together.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub step_s: f64,
    /// Knot spacing of the correction splines, s; 0.03 s to `step_s`.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub knot_spacing_s: f64,
    /// Maximum number of fixed views (keyframes) that a window is matched with; 0 for none.
    pub fixed_views: usize,
    /// Surfel extraction.
    pub surfels: SurfelSpec,
    /// Surfel matching.
    pub matching: MatchingSpec,
    /// Solution of a window.
    pub solve: SolveSpec,
    /// IMU errors in addition to the calibrated noise, gaps, and initial rest.
    pub inertial: InertialSpec,
    /// Clock offset between IMU and lidar.
    pub clock: ClockSpec,
    /// Uncertainty of the lidar extrinsics.
    pub extrinsics: ExtrinsicsSpec,
    /// Selection of fixed views.
    pub views: ViewSpec,
    /// Global registration after the open loop.
    pub registration: RegistrationSpec,
}

/// Solution of a window.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(default)]
pub struct SolveSpec {
    /// Maximum number of iterations: match, then solve.
    pub max_iterations: usize,
    /// Iterations end when the largest correction is below this, m or rad.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub settled_m: f64,
    /// Threshold of the Cauchy kernel in the last iteration, in standard deviations; twice this in the first one.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub cauchy: f64,
    /// Standard deviation of the match distance in addition to the surfel thickness, m (`sigma_r` in Bosse et al. 2012).
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub match_sigma_m: f64,
    /// Minimum number of matches of a window; with fewer, the window is dead reckoning with the IMU.
    pub min_matches: usize,
    /// Conditioning below which the geometry of a window is degenerate: smallest over largest eigenvalue of the position
    /// information of the matches.
    #[serde(with = "zsim_base::spec::checked::NonNegative")]
    pub weak_conditioning: f64,
}

/// IMU errors in addition to the calibrated noise, gaps, and initial rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(default)]
pub struct InertialSpec {
    /// Factor on the calibrated noise densities; accounts for errors that are not white.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub noise_inflation: f64,
    /// Least prior standard deviation of the estimated scale errors and misalignments (rad) of gyroscope and accelerometer,
    /// 0..1; a larger one of the IMU's model is used instead. 0 to estimate none.
    #[serde(with = "zsim_base::spec::checked::Fraction")]
    pub matrix_sigma: f64,
    /// Residual error of the gyroscope in proportion to the reading, added to the noise, 0..1.
    #[serde(with = "zsim_base::spec::checked::Fraction")]
    pub gyro_scale_error: f64,
    /// Residual error of the accelerometer in proportion to the reading, added to the noise, 0..1.
    #[serde(with = "zsim_base::spec::checked::Fraction")]
    pub accel_scale_error: f64,
    /// Longest IMU gap that is bridged by interpolation, s; gaps above 0.13 s only where the motion before them is slow
    /// enough. After other gaps the estimate restarts and relocalises in the surfaces seen before.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub max_gap_s: f64,
    /// Duration of the initial rest, s. Rest or motion is decided from this time at the start.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub rest_s: f64,
}

/// Clock offset between IMU and lidar.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(default)]
pub struct ClockSpec {
    /// Whether clock offset and rate are estimated; if not, the offset is `start_s`.
    pub estimated: bool,
    /// Initial clock offset, s, positive if IMU stamps are later: 0, or the estimate of an earlier run.
    #[serde(with = "zsim_base::spec::checked::Finite")]
    pub start_s: f64,
    /// Standard deviation of `start_s`, s.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub start_sigma_s: f64,
    /// Prior standard deviation of the clock rate, parts per million.
    #[serde(with = "zsim_base::spec::checked::NonNegative")]
    pub drift_ppm: f64,
    /// Minimum jitter of the stamps assumed by the stamp filter, s; 0 disables the filter.
    #[serde(with = "zsim_base::spec::checked::NonNegative")]
    pub jitter_s: f64,
}

/// Uncertainty of the lidar extrinsics (lidar to IMU).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(default)]
pub struct ExtrinsicsSpec {
    /// Whether rotation and translation are estimated; if not, they are as calibrated.
    pub estimated: bool,
    /// Prior standard deviation of the rotation about each axis, degrees.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub rotation_sigma_deg: f64,
    /// Prior standard deviation of the translation along each axis, m.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub translation_sigma_m: f64,
}

impl ExtrinsicsSpec {
    /// Standard deviations of rotation (rad) and translation (m); zero if the extrinsics are not estimated.
    pub(super) fn sigmas(&self) -> (f64, f64) {
        if self.estimated { (self.rotation_sigma_deg.to_radians(), self.translation_sigma_m) } else { (0.0, 0.0) }
    }
}

/// Selection of fixed views (keyframes).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(default)]
pub struct ViewSpec {
    /// Duration of a view, s; at least `step_s`.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub length_s: f64,
    /// A new view is stored if the stored ones cover less than this fraction of its cells (1 m).
    #[serde(with = "zsim_base::spec::checked::Fraction")]
    pub keep_below_coverage: f64,
    /// Maximum number of stored views, at least `fixed_views`; limits the memory of the estimator.
    pub max_kept: usize,
    /// Number of nearest neighbours of a surfel in each fixed view.
    pub neighbours: usize,
}

/// Loads the spec `name`: a path, or a name under `specs/estimators/`.
///
/// # Errors
/// If the spec does not exist or is invalid.
pub fn load(name: &str) -> Result<EstimatorSpec, SpecError> {
    zsim_base::spec::load(name)
}

impl EstimatorSpec {
    /// Checks relations between settings, and ranges of counts.
    ///
    /// # Errors
    /// The first invalid setting, with the valid values.
    pub fn check(&self) -> Result<(), EstimationError> {
        let require = |is_valid: bool, key: &'static str, message: String| {
            if is_valid { Ok(()) } else { Err(EstimationError::Setting { key, message }) }
        };
        let (window, step) = (self.window_s, self.step_s);
        require(
            step <= window / 2.0,
            "step_s",
            format!("{step} s is more than half of window_s = {window} s; windows must overlap"),
        )?;
        require(
            self.knot_spacing_s <= step,
            "knot_spacing_s",
            format!("{} s is more than step_s = {step} s", self.knot_spacing_s),
        )?;
        require(
            self.knot_spacing_s >= 0.03,
            "knot_spacing_s",
            format!("{} s is less than 0.03 s; there must be IMU samples between knots", self.knot_spacing_s),
        )?;
        require(
            window / self.knot_spacing_s <= 400.0,
            "knot_spacing_s",
            "gives more than 400 knots per window".into(),
        )?;
        require((1..=MAX_LEVELS).contains(&self.surfels.levels), "levels", format!("must be 1 to {MAX_LEVELS}"))?;
        for min_points in [self.surfels.min_points, self.surfels.fine.min_points] {
            require(min_points >= 4, "min_points", "must be at least 4 to define a plane".into())?;
        }
        require(self.matching.neighbours >= 1, "neighbours", "must be at least 1".into())?;
        for (key, degrees) in [
            ("max_incidence_deg", self.surfels.max_incidence_deg),
            ("max_normal_angle_deg", self.matching.max_normal_angle_deg),
        ] {
            require(degrees <= 90.0, key, format!("{degrees} degrees is more than 90"))?;
        }
        require(self.solve.max_iterations >= 1, "max_iterations", "must be at least 1".into())?;
        require(self.views.max_kept >= self.fixed_views, "max_kept", "must be at least fixed_views".into())?;
        require(self.views.length_s >= step, "length_s", format!("must be at least step_s = {step} s"))?;
        self.registration.check()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_spec_loads_and_is_valid() {
        let spec = load("default").unwrap();
        spec.check().unwrap();
        assert_eq!(spec.fixed_views, 5);
    }

    #[test]
    fn angles_above_90_degrees_are_rejected() {
        let mut spec = load("default").unwrap();
        spec.surfels.max_incidence_deg = 90.0;
        spec.check().unwrap();
        spec.surfels.max_incidence_deg = 120.0;
        let error = spec.check().unwrap_err();
        assert!(matches!(error, EstimationError::Setting { key: "max_incidence_deg", .. }), "{error}");
    }

    #[test]
    fn windows_that_do_not_overlap_are_rejected() {
        let mut spec = load("default").unwrap();
        spec.step_s = spec.window_s;
        let error = spec.check().unwrap_err();
        assert!(matches!(error, EstimationError::Setting { key: "step_s", .. }), "{error}");
    }
}
