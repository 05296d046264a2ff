//! Settings of the extraction and matching of surfels.

use serde::{Deserialize, Serialize};

/// Maximum number of resolutions.
pub(super) const MAX_LEVELS: usize = 6;

/// Surfel extraction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(default)]
pub struct SurfelSpec {
    /// Edge length of the finest voxels, m.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub finest_voxel_m: f64,
    /// Number of resolutions, 1 to 6; each has voxels twice as large as the previous one.
    pub levels: usize,
    /// Minimum number of points of a surfel, at least 4.
    pub min_points: usize,
    /// Additional surfels where the geometry is weak.
    #[serde(default)]
    pub fine: FineSurfelSpec,
    /// The points of a voxel are split where consecutive times differ by more than this, s.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub split_gap_s: f64,
    /// The points of a voxel are split when they span more than this, s.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub max_duration_s: f64,
    /// Minimum planarity `2 (l2 - l1) / (l1 + l2 + l3)`, 0..1 (Bosse and Zlot 2009).
    #[serde(with = "zsim_base::spec::checked::Fraction")]
    pub min_planarity: f64,
    /// Maximum thickness (standard deviation along the normal), as a multiple of the range noise. A surfel counts as flat if
    /// its variance along the normal exceeds that of a plane with range noise by less than this multiple of the standard
    /// deviation of the variance, which is `sqrt(2 / N)` of it for `N` points.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub max_thickness_sigmas: f64,
    /// Extra variance of the position of a surfel that is not flat, along the normal, as a multiple of its excess; 0
    /// treats all surfels as flat.
    #[serde(with = "zsim_base::spec::checked::NonNegative")]
    pub excess_doubt: f64,
    /// Minimum rotation rate out of the scan plane for surfels of a planar lidar, degrees/s. At lower rates the points
    /// of a voxel lie on a line.
    #[serde(with = "zsim_base::spec::checked::NonNegative")]
    pub min_sweep_deg_per_s: f64,
    /// Maximum angle between normal and beams, degrees, up to 90. At larger angles a surfel cannot be distinguished from
    /// the slice of a corner or pipe in the scan plane.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub max_incidence_deg: f64,
    /// Minimum range, m. Closer returns are from the carrier (person or vehicle), which moves with the head; matched as a
    /// static surface it would suppress the motion. 0.7 m is the reach of an arm.
    #[serde(with = "zsim_base::spec::checked::NonNegative")]
    pub min_range_m: f64,
    /// Prior standard deviation of the estimated range bias, m; 0 to estimate none.
    #[serde(with = "zsim_base::spec::checked::NonNegative")]
    pub range_offset_sigma_m: f64,
    /// Maximum range, m.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub max_range_m: f64,
}

/// Additional surfels where the geometry is weak, as along a corridor or on stairs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(default)]
pub struct FineSurfelSpec {
    /// While the conditioning of the last windows is below this, surfels are also built of voxels of half the finest edge;
    /// 0 for never.
    #[serde(with = "zsim_base::spec::checked::Fraction")]
    pub below_conditioning: f64,
    /// Minimum number of points of all surfels there, at least 4.
    pub min_points: usize,
}

/// Surfel matching.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(default)]
pub struct MatchingSpec {
    /// Number of nearest neighbours searched for each surfel, at least 1; each of a match must be one of the other.
    pub neighbours: usize,
    /// Scale of the normal in the six-dimensional distance (position and normal), in voxel edges per unit.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub normal_scale: f64,
    /// Maximum distance in position and scaled normal, in voxel edges.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub max_distance: f64,
    /// Maximum angle between normals, degrees, up to 90.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub max_normal_angle_deg: f64,
    /// Minimum difference of the two times, s; about half a sweep of the lidar.
    #[serde(with = "zsim_base::spec::checked::NonNegative")]
    pub min_time_difference_s: f64,
    /// Maximum distance along the normal, m, multiplied by 3 in the first iteration and by 1.5 in the later ones.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub max_plane_distance_m: f64,
}
