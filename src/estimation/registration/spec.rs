use super::PlacesSpec;
use crate::estimation::EstimationError;
use crate::estimation::spec::{MatchingSpec, SurfelSpec};
use serde::{Deserialize, Serialize};

/// How the whole is registered.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RegistrationSpec {
    /// Spacing of the knots of the correction's spline, s.
    #[serde(with = "crate::spec::checked::Positive")]
    pub knot_spacing_s: f64,
    /// Edge of the finest voxels, m.
    #[serde(with = "crate::spec::checked::Positive")]
    pub finest_voxel_m: f64,
    /// How many resolutions, each double the last.
    pub levels: usize,
    /// Fewest points of a surfel.
    pub min_points: usize,
    /// Points of a cell are split when they span more than this, s.
    #[serde(with = "crate::spec::checked::Positive")]
    pub max_duration_s: f64,
    /// Length of the chapters whose surfels are matched with each other's, s.
    #[serde(with = "crate::spec::checked::Positive")]
    pub chapter_s: f64,
    /// A chapter becomes a reference, with which others are matched, where fewer references than this have seen the
    /// same.
    pub references: usize,
    /// Most references that a chapter is matched with.
    pub partners: usize,
    /// Neighbours of a surfel looked up in each of them.
    pub neighbours: usize,
    /// Greatest distance along the normal of finest surfels, m; of coarser ones, in proportion to their edges, until
    /// those are settled.
    #[serde(with = "crate::spec::checked::Positive")]
    pub max_plane_distance_m: f64,
    /// Cauchy threshold, in standard deviations.
    #[serde(with = "crate::spec::checked::Positive")]
    pub cauchy: f64,
    /// Standard deviation of a match beside what its points' number says, m.
    #[serde(with = "crate::spec::checked::Positive")]
    pub match_sigma_m: f64,
    /// Weight of a surfel's matches together against one that stood alone.
    #[serde(with = "crate::spec::checked::Positive")]
    pub match_weight: f64,
    /// Time in which the open loop's error, of the size that its covariance tells, becomes another, s.
    #[serde(with = "crate::spec::checked::Positive")]
    pub correlation_s: f64,
    /// Drift of the open loop's position beside what its covariance tells, a random walk, m/sqrt(s).
    #[serde(with = "crate::spec::checked::Positive")]
    pub drift_m_per_sqrt_s: f64,
    /// Likewise of its attitude, degrees/sqrt(s).
    #[serde(with = "crate::spec::checked::Positive")]
    pub turn_deg_per_sqrt_s: f64,
    /// Standard deviation of the open loop's roll and pitch against gravity, degrees.
    #[serde(with = "crate::spec::checked::Positive")]
    pub level_sigma_deg: f64,
    /// Most iterations of match and solve a resolution.
    pub max_iterations: usize,
    /// Iterations end when no knot moves by more than this, m.
    #[serde(with = "crate::spec::checked::Positive")]
    pub settled_m: f64,
    /// Least over greatest information that the matches hold about the position along any direction, 0..1: with less
    /// that direction is weak.
    #[serde(with = "crate::spec::checked::Fraction")]
    pub weak_conditioning: f64,
    /// What was seen so long apart was seen again, s: what was seen within it the open loop's windows have weighed.
    #[serde(with = "crate::spec::checked::Positive")]
    pub again_after_s: f64,
    /// Fraction of what holds a weak direction that must have been seen again, 0..1: with less the open loop stays,
    /// whose windows and IMU know that direction better.
    #[serde(with = "crate::spec::checked::Fraction")]
    pub min_seen_again: f64,
    /// How places are recognised.
    pub places: PlacesSpec,
}

impl RegistrationSpec {
    /// The settings of the surfels that are registered, in other things those of the open loop's.
    pub(in crate::estimation) fn surfels(&self, open_loop: &SurfelSpec) -> SurfelSpec {
        SurfelSpec {
            finest_voxel_m: self.finest_voxel_m,
            levels: self.levels,
            min_points: self.min_points,
            max_duration_s: self.max_duration_s,
            ..open_loop.clone()
        }
    }

    /// The settings of their matches, likewise.
    pub(super) fn matching(&self, open_loop: &MatchingSpec) -> MatchingSpec {
        MatchingSpec { max_plane_distance_m: self.max_plane_distance_m, ..open_loop.clone() }
    }

    /// Checks the range of the counts.
    pub(in crate::estimation) fn check(&self) -> Result<(), EstimationError> {
        let require = |is_right: bool, key: &'static str, message: &str| {
            let message = message.to_owned();
            if is_right { Ok(()) } else { Err(EstimationError::Setting { key, message }) }
        };
        require((1..=6).contains(&self.levels), "registration.levels", "must be 1 to 6")?;
        require(self.min_points >= 4, "registration.min_points", "must be at least 4: fewer are no plane")?;
        require(
            self.chapter_s >= self.knot_spacing_s,
            "registration.chapter_s",
            "must be at least its knot_spacing_s",
        )?;
        for (key, count) in [
            ("registration.references", self.references),
            ("registration.partners", self.partners),
            ("registration.neighbours", self.neighbours),
            ("registration.max_iterations", self.max_iterations),
            ("registration.places.candidates", self.places.candidates),
            ("registration.places.tries", self.places.tries),
            ("registration.places.min_loops", self.places.min_loops),
        ] {
            require(count >= 1, key, "must be at least 1")?;
        }
        Ok(())
    }
}
