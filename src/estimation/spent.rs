//! Where the time of a window goes. Measured walls of time are told, and enter no result.

use std::iter::Sum;
use std::ops::AddAssign;
use std::time::Instant;

/// Time that the parts of the estimator's work took, s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TimeSpent {
    /// Integrating the IMU.
    pub integration_s: f64,
    /// Making surfels of beams: projection, voxels, shapes.
    pub surfels_s: f64,
    /// Placing the window's surfels in the map.
    pub placing_s: f64,
    /// Looking for neighbours in six dimensions: trees and searches.
    pub neighbours_s: f64,
    /// Telling which neighbours match, and by which plane.
    pub matches_s: f64,
    /// Summing the normal equations: IMU, priors, weighted matches.
    pub equations_s: f64,
    /// Factoring and solving them.
    pub solve_s: f64,
    /// Correcting the trajectory by their solution.
    pub correction_s: f64,
    /// Keeping and choosing fixed views.
    pub views_s: f64,
}

impl TimeSpent {
    /// Each part by its name, in the order of the work.
    pub fn parts(&self) -> [(&'static str, f64); 9] {
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
    }
}

impl AddAssign for TimeSpent {
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

impl Sum for TimeSpent {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), |mut sum, one| {
            sum += one;
            sum
        })
    }
}

/// Tells the time from one look to the next.
pub(super) struct Stopwatch(Instant);

impl Stopwatch {
    pub(super) fn start() -> Self {
        Self(Instant::now())
    }

    /// The time since the last look, or the start, s.
    pub(super) fn lap_s(&mut self) -> f64 {
        let now = Instant::now();
        let passed = now - std::mem::replace(&mut self.0, now);
        passed.as_secs_f64()
    }
}
