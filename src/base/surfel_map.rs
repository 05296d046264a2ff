//! Persistent map of surfels with their uncertainty.
//!
//! Data only: the estimator builds and uses the map, `recording` reads and writes it.

use crate::geometry::{Matrix, Vector};

/// Maximum number of resolutions of a map.
pub const MAX_LEVELS: usize = 6;
/// Tolerance on the length of a unit normal: rounding in a text file.
const NORMAL_TOLERANCE: f64 = 1e-6;
/// Negative eigenvalues of a second moment are accepted down to this fraction of the largest, as rounding.
const EIGENVALUE_TOLERANCE: f64 = 1e-9;

/// Surface element (surfel) of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapSurfel {
    /// Centre, m.
    pub centre_in_map: Vector,
    /// Unit normal, towards the side from which the surface was observed.
    pub normal_in_map: Vector,
    /// Second central moment of the points, m^2.
    pub covariance_in_map: Matrix,
    /// Number of points.
    pub points: f64,
    /// Standard deviation of the position along the normal, m: from the number of points and from the trajectory.
    pub sigma_m: f64,
    /// Resolution level; 0 is the finest.
    pub level: usize,
}

/// Validated surfels of several resolutions, each twice as coarse as the one before: see [`SurfelMap::new`].
#[derive(Debug, Clone, PartialEq)]
pub struct SurfelMap {
    finest_voxel_m: f64,
    levels: usize,
    surfels: Vec<MapSurfel>,
}

/// Reason why surfels do not form a valid map.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SurfelMapError {
    /// The resolutions are out of range.
    #[error(
        "a map with {levels} resolutions from {finest_voxel_m} m; it needs 1 to {MAX_LEVELS} resolutions and a finest voxel above 0 m and up to 100 m"
    )]
    Resolutions {
        /// Edge of the finest voxel, m.
        finest_voxel_m: f64,
        /// Number of resolutions.
        levels: usize,
    },
    /// A surfel is invalid.
    #[error("surfel {index}: {problem}")]
    Surfel {
        /// Index of the surfel, from 0.
        index: usize,
        /// Description of the problem.
        problem: &'static str,
    },
}

impl SurfelMap {
    /// Builds a map from surfels of `levels` resolutions, the finest with voxels of `finest_voxel_m`.
    ///
    /// # Errors
    /// When the resolutions are out of range, or a surfel has a number that is not finite, a normal that is not of unit
    /// length, a second moment that is not positive semi-definite, fewer than one point, a negative standard deviation,
    /// or a level outside the map's.
    pub fn new(finest_voxel_m: f64, levels: usize, surfels: Vec<MapSurfel>) -> Result<Self, SurfelMapError> {
        let is_valid = finest_voxel_m > 0.0 && finest_voxel_m <= 100.0 && (1..=MAX_LEVELS).contains(&levels);
        if !is_valid {
            return Err(SurfelMapError::Resolutions { finest_voxel_m, levels });
        }
        for (index, surfel) in surfels.iter().enumerate() {
            surfel.check(levels).map_err(|problem| SurfelMapError::Surfel { index, problem })?;
        }
        Ok(Self { finest_voxel_m, levels, surfels })
    }

    /// Edge of the voxels of the finest level, m.
    pub fn finest_voxel_m(&self) -> f64 {
        self.finest_voxel_m
    }

    /// Number of resolutions.
    pub fn levels(&self) -> usize {
        self.levels
    }

    /// The surfels.
    pub fn surfels(&self) -> &[MapSurfel] {
        &self.surfels
    }
}

impl MapSurfel {
    fn check(&self, levels: usize) -> Result<(), &'static str> {
        let vectors = self.centre_in_map.iter().chain(&self.normal_in_map).chain(&self.covariance_in_map);
        if !vectors.chain([&self.points, &self.sigma_m]).all(|x| x.is_finite()) {
            return Err("one of its numbers is not finite");
        }
        if (self.normal_in_map.norm() - 1.0).abs() > NORMAL_TOLERANCE {
            return Err("its normal is not of unit length");
        }
        let eigenvalues = self.covariance_in_map.symmetric_eigenvalues();
        if self.covariance_in_map != self.covariance_in_map.transpose()
            || eigenvalues.max() <= 0.0
            || eigenvalues.min() < -EIGENVALUE_TOLERANCE * eigenvalues.max()
        {
            return Err("its second moment is not that of points");
        }
        if self.points < 1.0 {
            return Err("it has fewer than one point");
        }
        if self.sigma_m < 0.0 {
            return Err("its standard deviation is negative");
        }
        if self.level >= levels {
            return Err("its level is outside the map's levels");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surfel() -> MapSurfel {
        MapSurfel {
            centre_in_map: Vector::new(1.0, 2.0, 3.0),
            normal_in_map: Vector::z(),
            covariance_in_map: Matrix::from_diagonal(&Vector::new(0.02, 0.02, 1e-4)),
            points: 40.0,
            sigma_m: 0.003,
            level: 1,
        }
    }

    #[test]
    fn an_invalid_surfel_is_rejected_with_its_index() {
        assert_eq!(SurfelMap::new(0.5, 4, vec![surfel(); 3]).unwrap().surfels().len(), 3);
        let error = |invalid: MapSurfel| SurfelMap::new(0.5, 4, vec![surfel(), invalid]).unwrap_err().to_string();
        let valid = surfel;
        for (invalid, cause) in [
            (MapSurfel { centre_in_map: Vector::new(f64::NAN, 0.0, 0.0), ..valid() }, "not finite"),
            (MapSurfel { sigma_m: f64::INFINITY, ..valid() }, "not finite"),
            (MapSurfel { normal_in_map: Vector::new(0.0, 0.0, 1.1), ..valid() }, "normal"),
            (
                MapSurfel { covariance_in_map: Matrix::from_diagonal(&Vector::new(0.1, 0.1, -0.01)), ..valid() },
                "moment",
            ),
            (MapSurfel { covariance_in_map: Matrix::zeros(), ..valid() }, "moment"),
            (MapSurfel { points: 0.0, ..valid() }, "point"),
            (MapSurfel { sigma_m: -1.0, ..valid() }, "deviation"),
            (MapSurfel { level: 4, ..valid() }, "level"),
        ] {
            let message = error(invalid);
            assert!(message.starts_with("surfel 1: ") && message.contains(cause), "{message}");
        }
        for (voxel_m, levels) in [(0.0, 4), (f64::NAN, 4), (0.5, 0), (0.5, 7), (1e9, 2)] {
            assert!(matches!(SurfelMap::new(voxel_m, levels, vec![]), Err(SurfelMapError::Resolutions { .. })));
        }
    }
}
