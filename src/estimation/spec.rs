use super::{EstimationError, RegistrationSpec};
use crate::spec::{Kind, SpecError};
use serde::{Deserialize, Serialize};

/// The estimator's settings; `specs/estimators/default.ron` holds the defaults and says what each is for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EstimatorSpec {
    /// How much of the past a window solves again, s.
    #[serde(with = "crate::spec::checked::Positive")]
    pub window_s: f64,
    /// By how much a window advances, s; also the length of the stretches whose surfels live and leave together.
    #[serde(with = "crate::spec::checked::Positive")]
    pub step_s: f64,
    /// Spacing of the knots of the correction splines, s.
    #[serde(with = "crate::spec::checked::Positive")]
    pub knot_spacing_s: f64,
    /// How many fixed views a window's surfels may match beside each other; 0 for none.
    pub fixed_views: usize,
    /// Surfels.
    pub surfels: SurfelSpec,
    /// Matches.
    pub matching: MatchingSpec,
    /// Iterations and their ends.
    pub solve: SolveSpec,
    /// What is believed of the IMU beyond its noise in the calibration.
    pub inertial: InertialSpec,
    /// What is believed of the two clocks.
    pub clock: ClockSpec,
    /// How well it is known how the lidar sits beside the IMU.
    pub extrinsics: ExtrinsicsSpec,
    /// Choice and keeping of fixed views.
    pub views: ViewSpec,
    /// The global registration behind the open loop.
    pub registration: RegistrationSpec,
}

/// How surfels are made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfelSpec {
    /// Edge of the finest voxels, m.
    #[serde(with = "crate::spec::checked::Positive")]
    pub finest_voxel_m: f64,
    /// How many resolutions, each double the last.
    pub levels: usize,
    /// Whether each resolution has a second grid, offset by half a cell.
    pub offset_grids: bool,
    /// Fewest points of a surfel.
    pub min_points: usize,
    /// Points of a cell are split where their times leave a gap of this, s.
    #[serde(with = "crate::spec::checked::Positive")]
    pub split_gap_s: f64,
    /// Points of a cell are split when they span more than this, s.
    #[serde(with = "crate::spec::checked::Positive")]
    pub max_duration_s: f64,
    /// Least planarity `2 (l2 - l1) / (l1 + l2 + l3)`, 0..1 (Bosse and Zlot 2009).
    #[serde(with = "crate::spec::checked::Fraction")]
    pub min_planarity: f64,
    /// Greatest thickness (standard deviation along the normal), as a multiple of the range's noise.
    #[serde(with = "crate::spec::checked::Positive")]
    pub max_thickness_sigmas: f64,
    /// A patch is flat whose variance along the normal exceeds what noise makes of a plane by less than this multiple
    /// of its own standard deviation, `sqrt(2 / N)` of it for `N` points.
    #[serde(with = "crate::spec::checked::NonNegative")]
    pub flat_within_sigmas: f64,
    /// The variance of a patch's place along the normal, as a multiple of that excess; 0 to take all patches for flat.
    #[serde(with = "crate::spec::checked::NonNegative")]
    pub excess_doubt: f64,
    /// Least velocity of a planar scan's beams out of their plane, by rotation, degrees/s.
    #[serde(with = "crate::spec::checked::NonNegative")]
    pub min_sweep_deg_per_s: f64,
    /// Greatest angle between a patch's normal and the beams that saw it, degrees: beyond, a patch is not told from the
    /// slice that a planar scan cuts out of a corner or a pipe.
    #[serde(with = "crate::spec::checked::Positive")]
    pub max_incidence_deg: f64,
    /// Nearest range used, m. Nearer returns are of the carrier (who holds the head, or what it is mounted on): it
    /// moves along, and matched as a static surface it constrains the head not to move. 0.7 m is an arm's reach.
    #[serde(with = "crate::spec::checked::NonNegative")]
    pub min_range_m: f64,
    /// Standard deviation of an offset common to all ranges, which is estimated, m; 0 for none.
    #[serde(with = "crate::spec::checked::NonNegative")]
    pub range_offset_sigma_m: f64,
    /// Farthest range used, m.
    #[serde(with = "crate::spec::checked::Positive")]
    pub max_range_m: f64,
}

/// How surfels are matched.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MatchingSpec {
    /// Neighbours looked up for each surfel.
    pub neighbours: usize,
    /// Whether a match must be found from both sides.
    pub reciprocal: bool,
    /// Weight of a unit of normal in the six-dimensional distance, in voxel edges.
    #[serde(with = "crate::spec::checked::Positive")]
    pub normal_scale: f64,
    /// Greatest six-dimensional distance, in voxel edges.
    #[serde(with = "crate::spec::checked::Positive")]
    pub max_distance: f64,
    /// Greatest angle between normals, degrees.
    #[serde(with = "crate::spec::checked::Positive")]
    pub max_normal_angle_deg: f64,
    /// Least difference of the two times, s: half the nominal sweep.
    #[serde(with = "crate::spec::checked::NonNegative")]
    pub min_time_difference_s: f64,
    /// Greatest distance along the normal in a settled window, m; three times it in the first iterations.
    #[serde(with = "crate::spec::checked::Positive")]
    pub max_plane_distance_m: f64,
}

/// How a window is solved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolveSpec {
    /// Most iterations of place, match, solve.
    pub max_iterations: usize,
    /// Iterations end when the head moves by no more than this anywhere, m.
    #[serde(with = "crate::spec::checked::Positive")]
    pub settled_m: f64,
    /// Cauchy threshold of the first iteration, in standard deviations.
    #[serde(with = "crate::spec::checked::Positive")]
    pub cauchy_start: f64,
    /// Cauchy threshold of the last iterations.
    #[serde(with = "crate::spec::checked::Positive")]
    pub cauchy_end: f64,
    /// Standard deviation of a match beside its surfels' own thickness, m (sigma_r of the paper).
    #[serde(with = "crate::spec::checked::Positive")]
    pub match_sigma_m: f64,
    /// Weight of a match against one that stood alone: matches of one surface share their errors.
    #[serde(with = "crate::spec::checked::Positive")]
    pub match_weight: f64,
    /// Fewest matches that a window's solution may rest on.
    pub min_matches: usize,
    /// Multiple of the covariance that a window's own measurements give: matches of one surface share their errors, and
    /// windows share their measurements, of which the equations do not know.
    #[serde(with = "crate::spec::checked::Positive")]
    pub covariance_inflation: f64,
    /// Conditioning below which a window is said to have weak geometry.
    #[serde(with = "crate::spec::checked::NonNegative")]
    pub weak_conditioning: f64,
}

/// What is believed of the IMU beyond its noise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InertialSpec {
    /// Multiple of the calibrated noise densities: scale factors and misalignment are not white.
    #[serde(with = "crate::spec::checked::Positive")]
    pub noise_inflation: f64,
    /// Standard deviation of the gyroscope's scale factors and misalignment, which are estimated, 0..1; 0 for none.
    #[serde(with = "crate::spec::checked::Fraction")]
    pub gyro_matrix_sigma: f64,
    /// The same of the accelerometer.
    #[serde(with = "crate::spec::checked::Fraction")]
    pub accel_matrix_sigma: f64,
    /// Error of the gyroscope in proportion to its reading that is left, and counts as noise, 0..1.
    #[serde(with = "crate::spec::checked::Fraction")]
    pub gyro_scale_error: f64,
    /// Error of the accelerometer in proportion to its reading, which counts as noise, 0..1.
    #[serde(with = "crate::spec::checked::Fraction")]
    pub accel_scale_error: f64,
    /// Longest stretch without IMU samples that is bridged, s; behind a longer one the estimate begins again, and looks
    /// for the head in what was seen before.
    #[serde(with = "crate::spec::checked::Positive")]
    pub max_gap_s: f64,
    /// How long the head should rest at the start, s.
    #[serde(with = "crate::spec::checked::Positive")]
    pub rest_s: f64,
}

/// What is believed of the two clocks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClockSpec {
    /// Whether offset and rate are estimated; if not, the offset stays at `start_s`.
    pub estimated: bool,
    /// How much later the IMU stamps an instant, at the start, s: zero, or where an earlier run settled.
    #[serde(with = "crate::spec::checked::Finite")]
    pub start_s: f64,
    /// Standard deviation of that, s.
    #[serde(with = "crate::spec::checked::Positive")]
    pub start_sigma_s: f64,
    /// Greatest rate error between the clocks that is expected, one standard deviation, parts per million.
    #[serde(with = "crate::spec::checked::NonNegative")]
    pub drift_ppm: f64,
    /// Jitter of the sensors' stamps, s, by which their smoothing starts; 0 takes every stamp as it is.
    #[serde(with = "crate::spec::checked::NonNegative")]
    pub jitter_s: f64,
}

/// How well it is known how the lidar sits beside the IMU.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExtrinsicsSpec {
    /// Whether the lidar's attitude and place are estimated; if not, they are taken as calibrated.
    pub estimated: bool,
    /// Standard deviation of its attitude on each axis, degrees.
    #[serde(with = "crate::spec::checked::Positive")]
    pub rotation_sigma_deg: f64,
    /// Standard deviation of its place on each axis, m.
    #[serde(with = "crate::spec::checked::Positive")]
    pub translation_sigma_m: f64,
}

impl ExtrinsicsSpec {
    /// Standard deviations of attitude (rad) and place (m): none where they are taken as calibrated.
    pub(super) fn sigmas(&self) -> (f64, f64) {
        if self.estimated { (self.rotation_sigma_deg.to_radians(), self.translation_sigma_m) } else { (0.0, 0.0) }
    }
}

/// Choice and keeping of fixed views.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ViewSpec {
    /// Length of trajectory in a view, s.
    #[serde(with = "crate::spec::checked::Positive")]
    pub length_s: f64,
    /// A new view is kept when its cells are covered by those kept to less than this fraction.
    #[serde(with = "crate::spec::checked::Fraction")]
    pub keep_below_coverage: f64,
    /// Most views kept to choose from: the bound of the estimator's memory.
    pub max_kept: usize,
    /// Neighbours of a surfel among the fixed views.
    pub neighbours: usize,
}

/// Loads the spec called `name`: a path, or a name under `specs/estimators/`.
///
/// # Errors
/// When there is none, or it is wrong.
pub fn load(name: &str) -> Result<EstimatorSpec, SpecError> {
    crate::spec::load(Kind::Estimator, name)
}

impl EstimatorSpec {
    /// Checks what concerns several settings, or the range of a count.
    ///
    /// # Errors
    /// With the setting that is wrong, and what to do.
    pub fn check(&self) -> Result<(), EstimationError> {
        let require = |is_right: bool, key: &'static str, message: String| {
            if is_right { Ok(()) } else { Err(EstimationError::Setting { key, message }) }
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
            format!(
                "{} s is less than 0.03 s; between two knots there must be samples of the IMU",
                self.knot_spacing_s
            ),
        )?;
        require(window / self.knot_spacing_s <= 400.0, "knot_spacing_s", "makes over 400 knots a window".into())?;
        require((1..=6).contains(&self.surfels.levels), "levels", "must be 1 to 6".into())?;
        require(self.surfels.min_points >= 4, "min_points", "must be at least 4: fewer are no plane".into())?;
        require(self.matching.neighbours >= 1, "neighbours", "must be at least 1".into())?;
        for (key, degrees) in [
            ("max_incidence_deg", self.surfels.max_incidence_deg),
            ("max_normal_angle_deg", self.matching.max_normal_angle_deg),
        ] {
            require(degrees <= 90.0, key, format!("{degrees} degrees is more than 90, which is any angle"))?;
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
    fn the_default_spec_loads_and_is_right() {
        let spec = load("default").unwrap();
        spec.check().unwrap();
        assert_eq!(spec.fixed_views, 5);
    }

    #[test]
    fn angles_beyond_the_right_angle_are_refused() {
        let mut spec = load("default").unwrap();
        spec.surfels.max_incidence_deg = 90.0;
        spec.check().unwrap();
        spec.surfels.max_incidence_deg = 120.0;
        let error = spec.check().unwrap_err();
        assert!(matches!(error, EstimationError::Setting { key: "max_incidence_deg", .. }), "{error}");
    }

    #[test]
    fn windows_that_do_not_overlap_are_refused() {
        let mut spec = load("default").unwrap();
        spec.step_s = spec.window_s;
        let error = spec.check().unwrap_err();
        assert!(matches!(error, EstimationError::Setting { key: "step_s", .. }), "{error}");
    }
}
