//! Run time of the parts of a window. It is reported and does not affect results.

use std::iter::Sum;
use std::ops::AddAssign;
use std::time::Instant;

/// Run time of the parts of the estimator, s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Timing {
    /// IMU integration.
    pub integration_s: f64,
    /// Surfel extraction: projection, voxels, shapes.
    pub surfels_s: f64,
    /// Transformation of the surfels into the map frame.
    pub placing_s: f64,
    /// Neighbour search in six dimensions.
    pub neighbours_s: f64,
    /// Match gates and common planes.
    pub matches_s: f64,
    /// Assembly of the normal equations: IMU, priors, weighted matches.
    pub equations_s: f64,
    /// Solution of the normal equations.
    pub solve_s: f64,
    /// Correction of the trajectory.
    pub correction_s: f64,
    /// Storage and selection of fixed views.
    pub views_s: f64,
}

/// Run time of a part of the estimator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartTime {
    /// Name of the part.
    pub name: &'static str,
    /// Run time, s.
    pub seconds: f64,
}

impl Timing {
    /// Returns the run time of each part, in order of execution.
    pub fn parts(&self) -> [PartTime; 9] {
        [
            ("integration", self.integration_s),
            ("surfels", self.surfels_s),
            ("placing", self.placing_s),
            ("neighbours", self.neighbours_s),
            ("matches", self.matches_s),
            ("equations", self.equations_s),
            ("solve", self.solve_s),
            ("correction", self.correction_s),
            ("views", self.views_s),
        ]
        .map(|(name, seconds)| PartTime { name, seconds })
    }
}

impl AddAssign for Timing {
    fn add_assign(&mut self, other: Self) {
        self.integration_s += other.integration_s;
        self.surfels_s += other.surfels_s;
        self.placing_s += other.placing_s;
        self.neighbours_s += other.neighbours_s;
        self.matches_s += other.matches_s;
        self.equations_s += other.equations_s;
        self.solve_s += other.solve_s;
        self.correction_s += other.correction_s;
        self.views_s += other.views_s;
    }
}

impl Sum for Timing {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), |mut sum, one| {
            sum += one;
            sum
        })
    }
}

/// Measures the run time between laps.
pub(super) struct Stopwatch(Instant);

impl Stopwatch {
    pub(super) fn start() -> Self {
        Self(Instant::now())
    }

    /// Time since the last lap, or since the start, s.
    pub(super) fn lap_s(&mut self) -> f64 {
        let now = Instant::now();
        let passed = now - std::mem::replace(&mut self.0, now);
        passed.as_secs_f64()
    }
}
