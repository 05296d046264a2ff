//! From echoes to the scan that the sensor reports.

use super::draws::ScanDraws;
use super::{Beam, Lidar, LidarErrors, Sweep};
use zsim_base::geometry::Vector;
use zsim_base::measurement::{LidarReturn, LidarScan, PlanarScan};
use zsim_base::time::Span;

impl Lidar {
    /// The scan that the sensor reports for the ray intersections of `sweep`.
    ///
    /// With errors switched off, a beam passes all glass and canopies, and each echo has the exact range without rounding.
    pub fn measure(&self, sweep: &Sweep, errors: &LidarErrors) -> LidarScan {
        let mut draws = errors.scan_draws(sweep.timing.index);
        let mut returns = Vec::with_capacity(self.beams.len());
        let mut planar = self.empty_scan();
        for beam in 0..self.beams.len() {
            let (range, intensity) = self.measure_beam(sweep, beam, errors, draws.as_mut(), &mut returns);
            if let Some(scan) = planar.as_mut() {
                scan.ranges_m.push(range);
                scan.intensities.push(intensity);
            }
        }
        LidarScan { stamp: sweep.timing.stamp, stamped_after: Span::ZERO, returns, planar }
    }

    /// Appends the returns of a beam, and returns range and intensity of the strongest echo, encoded by REP-117.
    fn measure_beam(
        &self,
        sweep: &Sweep,
        beam: usize,
        errors: &LidarErrors,
        mut draws: Option<&mut ScanDraws>,
        returns: &mut Vec<LidarReturn>,
    ) -> (f32, f32) {
        let canopy_rays = if sweep.has_canopies() { self.rays_per_beam() } else { 0 };
        let draw = draws.as_deref_mut().map(|draws| draws.next_beam(canopy_rays));
        let mut echoes = self.echoes(sweep, beam, draw.as_ref());
        echoes.keep_strongest(usize::from(self.spec.echoes));
        let (mut best, mut best_power) = ((f32::INFINITY, 0.0), f64::NEG_INFINITY);
        for (order, echo) in echoes.as_slice().iter().enumerate() {
            let mut range_m = echo.range_m;
            if let (Some(draw), Some(draws)) = (&draw, draws.as_deref_mut()) {
                let z = if order == 0 { draw.range } else { draws.next_later_echo() };
                if !errors.detects(echo, draw.threshold) {
                    continue;
                }
                range_m = errors.quantised_m(errors.range_m(echo, z));
            }
            let intensity = (self.spec.intensity_at_1_m * echo.power.sqrt()).round() as f32;
            let reported = self.within_limits(range_m);
            if echo.power > best_power {
                (best, best_power) = ((reported, if reported.is_finite() { intensity } else { 0.0 }), echo.power);
            }
            if reported.is_finite() {
                let Beam { direction_in_laser, offset, .. } = self.beams[beam];
                let direction = sweep.rotation.map_or(direction_in_laser, |turn| turn * direction_in_laser);
                let point: Vector = direction * range_m;
                returns.push(LidarReturn { offset, point_in_laser: point.cast(), intensity });
            }
        }
        best
    }

    /// A range encoded by REP-117: `-inf` below the minimum range, `+inf` above the maximum.
    fn within_limits(&self, range_m: f64) -> f32 {
        if range_m < self.spec.range_min_m {
            f32::NEG_INFINITY
        } else if range_m > self.spec.range_max_m {
            f32::INFINITY
        } else {
            range_m as f32
        }
    }

    /// An empty planar scan; `None` for a lidar that is not planar.
    fn empty_scan(&self) -> Option<PlanarScan> {
        self.plane.map(|plane| PlanarScan {
            angle_min_rad: plane.angle_min_rad,
            angle_increment_rad: plane.angle_increment_rad,
            time_increment_s: plane.time_increment_s,
            scan_time_s: self.period_s(),
            range_min_m: self.spec.range_min_m as f32,
            range_max_m: self.spec.range_max_m as f32,
            ranges_m: Vec::with_capacity(self.beams.len()),
            intensities: Vec::with_capacity(self.beams.len()),
        })
    }
}
