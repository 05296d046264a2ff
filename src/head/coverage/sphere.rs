//! Histogram of beams over the sphere of directions, in cells of equal solid angle.

use super::{CoverageCell, Density};
use std::f64::consts::{PI, TAU};
use zsim_base::geometry::Vector;

/// Bands of equal height and thus (Archimedes) equal area.
const BANDS: usize = 32;
/// Cells per band. A cell has 6.1e-3 sr, about 4.5 degrees across.
const CELLS: usize = 64;

/// Number of beams per cell.
#[derive(Debug, Clone)]
pub(super) struct Sphere {
    beams: Vec<u32>,
    /// Beams per cell in the current sweep.
    in_sweep: Vec<u32>,
    /// Whether a cell has a beam in the current second.
    in_second: Vec<bool>,
    /// Number of cells with a beam.
    observed: usize,
}

impl Default for Sphere {
    fn default() -> Self {
        let cells = BANDS * CELLS;
        Self { beams: vec![0; cells], in_sweep: vec![0; cells], in_second: vec![false; cells], observed: 0 }
    }
}

/// Solid angle of a cell, sr.
const CELL_SR: f64 = 4.0 * PI / (BANDS * CELLS) as f64;

impl Sphere {
    /// Counts a beam along a unit vector.
    pub fn count_beam(&mut self, direction: &Vector) {
        let band = ((direction.z + 1.0) * 0.5 * BANDS as f64) as usize;
        let turn = (direction.y.atan2(direction.x) / TAU + 0.5) * CELLS as f64;
        let cell = band.min(BANDS - 1) * CELLS + (turn as usize).min(CELLS - 1);
        self.observed += usize::from(self.beams[cell] == 0);
        self.beams[cell] += 1;
        self.in_sweep[cell] += 1;
        self.in_second[cell] = true;
    }

    /// Observed fraction of the sphere.
    pub fn observed_fraction(&self) -> f64 {
        self.observed as f64 / self.beams.len() as f64
    }

    /// Fraction of the sphere observed since the last call, and median of the beams per steradian in those cells.
    pub fn end_sweep(&mut self) -> (f64, f64) {
        let mut counts: Vec<u32> = self.in_sweep.iter().copied().filter(|n| *n > 0).collect();
        self.in_sweep.fill(0);
        counts.sort_unstable();
        let median = counts.get(counts.len() / 2).copied().unwrap_or(0);
        (counts.len() as f64 / (BANDS * CELLS) as f64, f64::from(median) / CELL_SR)
    }

    /// Fraction of the sphere observed since the last call.
    pub fn end_second(&mut self) -> f64 {
        let observed = self.in_second.iter().filter(|observed| **observed).count();
        self.in_second.fill(false);
        observed as f64 / self.in_second.len() as f64
    }

    /// Beams per steradian and second in the observed cells.
    pub fn density_per_sr(&self, observed_s: f64) -> Density {
        let mut counts: Vec<u32> = self.beams.iter().copied().filter(|n| *n > 0).collect();
        counts.sort_unstable();
        let scale = 1.0 / (CELL_SR * observed_s);
        let quantile = |fraction: f64| {
            counts.get((fraction * counts.len() as f64) as usize).map_or(0.0, |n| f64::from(*n) * scale)
        };
        let mean = counts.iter().map(|n| f64::from(*n)).sum::<f64>() / counts.len().max(1) as f64 * scale;
        Density { mean, p10: quantile(0.1), median: quantile(0.5) }
    }

    /// All cells with their beams per steradian and second, from the bottom up.
    pub fn cells(&self, observed_s: f64) -> Vec<CoverageCell> {
        let cell = |(index, beams): (usize, &u32)| {
            let edge = |band: usize| (2.0 * band as f64 / BANDS as f64 - 1.0).asin().to_degrees();
            let side = |cell: usize| (cell as f64 / CELLS as f64 - 0.5) * 360.0;
            let (band, column) = (index / CELLS, index % CELLS);
            CoverageCell {
                azimuth_deg: (side(column), side(column + 1)),
                elevation_deg: (edge(band), edge(band + 1)),
                beams_per_sr_s: f64::from(*beams) / (CELL_SR * observed_s),
            }
        };
        self.beams.iter().enumerate().map(cell).collect()
    }

    /// Elevation (degrees) and beams per steradian and second of each band.
    pub fn by_elevation(&self, observed_s: f64) -> Vec<(f64, f64)> {
        let bands = self.beams.chunks(CELLS).enumerate();
        let density = |(band, cells): (usize, &[u32])| {
            let elevation = ((2.0 * band as f64 + 1.0) / BANDS as f64 - 1.0).asin();
            let beams: f64 = cells.iter().map(|n| f64::from(*n)).sum();
            (elevation.to_degrees(), beams / (CELLS as f64 * CELL_SR * observed_s))
        };
        bands.map(density).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniform_beams_give_a_uniform_density() {
        // A golden spiral is uniform: 200,000 beams over 4 pi sr are 15,915 per sr.
        let mut sphere = Sphere::default();
        let count = 200_000;
        for k in 0..count {
            let z: f64 = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(count);
            let (sin, cos) = (f64::from(k) * PI * (3.0 - 5_f64.sqrt())).sin_cos();
            let rim = (1.0 - z * z).sqrt();
            sphere.count_beam(&Vector::new(rim * cos, rim * sin, z));
        }
        assert_eq!(sphere.observed_fraction(), 1.0);
        let density = sphere.density_per_sr(1.0);
        let even = f64::from(count) / (4.0 * PI);
        assert!((density.mean / even - 1.0).abs() < 1e-9 && (density.median / even - 1.0).abs() < 0.05, "{density:?}");
        assert!(sphere.by_elevation(2.0).iter().all(|(_, d)| (d * 2.0 / even - 1.0).abs() < 0.02));
        assert_eq!(sphere.end_sweep().0, 1.0);
        assert_eq!(sphere.end_sweep(), (0.0, 0.0));
        assert_eq!((sphere.end_second(), sphere.end_second()), (1.0, 0.0));
    }

    #[test]
    fn a_horizontal_scan_covers_one_band() {
        let mut sphere = Sphere::default();
        for k in 0..1080 {
            let (sin, cos) = (f64::from(k) * TAU / 1080.0).sin_cos();
            sphere.count_beam(&Vector::new(cos, sin, 1e-9));
        }
        assert_eq!(sphere.observed_fraction(), 1.0 / BANDS as f64);
    }
}
