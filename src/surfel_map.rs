//! The map that lasts: surfels with their uncertainty. Data only; the estimator makes and uses it, the door keeps it.

use crate::geometry::{Matrix, Vector};

/// Most resolutions of a map.
pub const MOST_LEVELS: usize = 6;
/// How far the length of a normal may be from one.
const UNIT: f64 = 1e-6;
/// By what share of the greatest an eigenvalue of a second moment may be below zero, by rounding.
const ROUNDING: f64 = 1e-9;

/// A patch of surface in the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapSurfel {
    /// Its centre, m.
    pub centre_in_map: Vector,
    /// Its unit normal, to the side from which it was seen.
    pub normal_in_map: Vector,
    /// Second central moment of its points, m^2.
    pub covariance_in_map: Matrix,
    /// Number of its points.
    pub points: f64,
    /// Standard deviation of its place along its normal, m: by the points' number and by the trajectory.
    pub sigma_m: f64,
    /// Resolution, 0 the finest.
    pub level: usize,
}

/// Surfels of several resolutions, each double the last, all sound: see [`SurfelMap::new`].
#[derive(Debug, Clone, PartialEq)]
pub struct SurfelMap {
    finest_voxel_m: f64,
    levels: usize,
    surfels: Vec<MapSurfel>,
}

/// Why surfels are no map.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SurfelMapError {
    /// The resolutions make no sense.
    #[error(
        "a map of {levels} resolutions from {finest_voxel_m} m on; there must be 1 to {MOST_LEVELS}, from above 0 m to 100 m"
    )]
    Resolutions {
        /// The finest, m.
        finest_voxel_m: f64,
        /// How many.
        levels: usize,
    },
    /// A surfel that cannot be one.
    #[error("surfel {index}: {problem}")]
    Surfel {
        /// Which, from 0.
        index: usize,
        /// What is wrong with it.
        problem: &'static str,
    },
}

impl SurfelMap {
    /// A map of surfels from voxels of `finest_voxel_m`, in `levels` resolutions.
    ///
    /// # Errors
    /// When the resolutions make no sense, or a surfel has a number that is not finite, a normal that is not of length
    /// one, a second moment that is none, less than one point, a standard deviation below zero, or a level that the map
    /// has not.
    pub fn new(finest_voxel_m: f64, levels: usize, surfels: Vec<MapSurfel>) -> Result<Self, SurfelMapError> {
        let sound = finest_voxel_m > 0.0 && finest_voxel_m <= 100.0 && (1..=MOST_LEVELS).contains(&levels);
        if !sound {
            return Err(SurfelMapError::Resolutions { finest_voxel_m, levels });
        }
        for (index, surfel) in surfels.iter().enumerate() {
            surfel.check(levels).map_err(|problem| SurfelMapError::Surfel { index, problem })?;
        }
        Ok(Self { finest_voxel_m, levels, surfels })
    }

    /// Edge of the finest voxels that the surfels came from, m.
    pub fn finest_voxel_m(&self) -> f64 {
        self.finest_voxel_m
    }

    /// How many resolutions.
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
            return Err("a number of it is not finite");
        }
        if (self.normal_in_map.norm() - 1.0).abs() > UNIT {
            return Err("its normal is not of length one");
        }
        let eigenvalues = self.covariance_in_map.symmetric_eigenvalues();
        if self.covariance_in_map != self.covariance_in_map.transpose()
            || eigenvalues.max() <= 0.0
            || eigenvalues.min() < -ROUNDING * eigenvalues.max()
        {
            return Err("its second moment is none of points");
        }
        if self.points < 1.0 {
            return Err("it has less than one point");
        }
        if self.sigma_m < 0.0 {
            return Err("its standard deviation is below zero");
        }
        if self.level >= levels {
            return Err("its level is not among the map's");
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
    fn what_is_no_surfel_is_refused_and_named() {
        assert_eq!(SurfelMap::new(0.5, 4, vec![surfel(); 3]).unwrap().surfels().len(), 3);
        let said = |wrong: MapSurfel| SurfelMap::new(0.5, 4, vec![surfel(), wrong]).unwrap_err().to_string();
        let of = surfel;
        for (wrong, about) in [
            (MapSurfel { centre_in_map: Vector::new(f64::NAN, 0.0, 0.0), ..of() }, "not finite"),
            (MapSurfel { sigma_m: f64::INFINITY, ..of() }, "not finite"),
            (MapSurfel { normal_in_map: Vector::new(0.0, 0.0, 1.1), ..of() }, "normal"),
            (MapSurfel { covariance_in_map: Matrix::from_diagonal(&Vector::new(0.1, 0.1, -0.01)), ..of() }, "moment"),
            (MapSurfel { covariance_in_map: Matrix::zeros(), ..of() }, "moment"),
            (MapSurfel { points: 0.0, ..of() }, "point"),
            (MapSurfel { sigma_m: -1.0, ..of() }, "deviation"),
            (MapSurfel { level: 4, ..of() }, "level"),
        ] {
            let said = said(wrong);
            assert!(said.starts_with("surfel 1: ") && said.contains(about), "{said}");
        }
        for (voxel_m, levels) in [(0.0, 4), (f64::NAN, 4), (0.5, 0), (0.5, 7), (1e9, 2)] {
            assert!(matches!(SurfelMap::new(voxel_m, levels, vec![]), Err(SurfelMapError::Resolutions { .. })));
        }
    }
}
