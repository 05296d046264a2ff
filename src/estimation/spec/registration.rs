use super::PlacesSpec;
use super::surfel::{MAX_LEVELS, SurfelSpec};
use crate::EstimationError;
use serde::{Deserialize, Serialize};

/// Global registration (loop-closed trajectory) settings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(default)]
pub struct RegistrationSpec {
    /// Spacing of the knots of the correction spline, s.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub knot_spacing_s: f64,
    /// Minimum number of points of a surfel. It may be a line: the normal of a match is that of both surfels together, and two
    /// lines on one surface determine it.
    pub min_points: usize,
    /// Number of points from which on a surfel has its full weight; with fewer, its variance along the normal counts in
    /// inverse proportion to the number. 0: all have their full weight.
    #[serde(default)]
    #[schemars(default = "usual_full_weight_points")]
    pub full_weight_points: usize,
    /// Maximum duration of a surfel, s; points of a cell that span more are split.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub max_duration_s: f64,
    /// Duration of a submap, s; surfels are matched between pairs of submaps.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub chapter_s: f64,
    /// Number of reference submaps that must observe each cell, and maximum number of references that a submap is
    /// matched with. More references give more matches and longer computing times.
    pub references: usize,
    /// Maximum distance along the normal of a match at the finest resolution, m; while coarser resolutions are registered
    /// it is larger in proportion to the voxel edge.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub max_plane_distance_m: f64,
    /// Threshold of the Cauchy kernel, in standard deviations.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub cauchy: f64,
    /// Standard deviation of a match in addition to surfel thickness, m.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub match_sigma_m: f64,
    /// Prior standard deviation of the range bias of an echo of median intensity, m; the bias is inversely proportional to the
    /// square of the intensity. 0 to estimate none.
    #[serde(with = "zsim_base::spec::checked::NonNegative")]
    pub weak_bias_sigma_m: f64,
    /// Correlation time of the open-loop error, s; the size of the error is that of the open-loop covariance.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub correlation_s: f64,
    /// Random walk of the position of the open loop by errors that views repeat, m/sqrt(s); with the covariance of the motion
    /// without views it determines how much of that motion is used.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub view_drift_m_per_sqrt_s: f64,
    /// Random walk of the attitude of the open loop by errors that views repeat, degrees/sqrt(s).
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub view_turn_deg_per_sqrt_s: f64,
    /// Random walk of the open-loop position in addition to the covariance, m/sqrt(s).
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub drift_m_per_sqrt_s: f64,
    /// Random walk of the open-loop attitude in addition to the covariance, degrees/sqrt(s).
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub turn_deg_per_sqrt_s: f64,
    /// Standard deviation of the open-loop roll and pitch relative to gravity, degrees.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub level_sigma_deg: f64,
    /// The geometry is weak if the smallest over the largest eigenvalue of the position information of the matches is below
    /// this, 0..1.
    #[serde(with = "zsim_base::spec::checked::Fraction")]
    pub weak_conditioning: f64,
    /// Minimum fraction of the information along a weak direction due to revisits, 0..1; with less, the
    /// registration is rejected, because the IMU constrains that direction better in the open loop.
    #[serde(with = "zsim_base::spec::checked::Fraction")]
    pub min_seen_again: f64,
    /// Loop closure by place recognition.
    pub places: PlacesSpec,
}

/// The default; recordings without the key are from before it existed, and their surfels had full weight.
fn usual_full_weight_points() -> usize {
    RegistrationSpec::default().full_weight_points
}

impl RegistrationSpec {
    /// Surfel settings of the registration: a resolution more; the others equal `open_loop`.
    pub(crate) fn surfels(&self, open_loop: &SurfelSpec) -> SurfelSpec {
        SurfelSpec {
            levels: (open_loop.levels + 1).min(MAX_LEVELS),
            min_points: self.min_points,
            min_planarity: 0.0,
            max_duration_s: self.max_duration_s,
            ..open_loop.clone()
        }
    }

    /// Checks the ranges of the counts.
    pub(crate) fn check(&self) -> Result<(), EstimationError> {
        let require = |is_right: bool, key: &'static str, message: &str| {
            let message = message.to_owned();
            if is_right { Ok(()) } else { Err(EstimationError::Setting { key, message }) }
        };
        require(
            self.min_points >= 4,
            "registration.min_points",
            "must be at least 4: fewer points do not determine a plane",
        )?;
        require(
            self.chapter_s >= self.knot_spacing_s,
            "registration.chapter_s",
            "must be at least registration.knot_spacing_s",
        )?;
        for (key, count) in [
            ("registration.references", self.references),
            ("registration.places.candidates", self.places.candidates),
            ("registration.places.tries", self.places.tries),
            ("registration.places.min_loops", self.places.min_loops),
        ] {
            require(count >= 1, key, "must be at least 1")?;
        }
        Ok(())
    }
}
