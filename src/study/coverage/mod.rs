//! Coverage of the sphere of directions by a swinging lidar: fraction, density and time, and use of the gyroscope's range.
//!
//! Directions are in the heading frame: vertical z axis, rotated with the base's yaw, so that turning the base does not
//! increase the coverage.

mod figure;
mod sphere;
mod table;
mod track;

pub use figure::coverage_figure;
pub use table::{density_csv, over_time_csv};

use crate::dynamics::{HeadModel, HeadState};
use crate::geometry::Rotation;
use crate::motion::BaseMotion;
use crate::sensors::Lidar;
use crate::study::StudyError;
use serde::Serialize;
use sphere::Sphere;
use track::SwingTrack;

/// Maximum end of the observation, s: one hour takes about 200 MB of memory.
const MAX_END_S: f64 = 3600.0;

/// Settings of a coverage computation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoveragePlan {
    /// Start of the observation after the motion's start, s; skips the rest at the beginning.
    pub from_s: f64,
    /// Duration of the observation, s.
    pub duration_s: f64,
    /// Time step of the simulation, s.
    pub step_s: f64,
    /// Range of the gyroscope per axis, degrees/s.
    pub rate_limit_deg_per_s: f64,
}

impl Default for CoveragePlan {
    /// 30 s from 5 s on, steps of 1 ms, 600 degrees/s as the paper's gyroscope.
    fn default() -> Self {
        Self { from_s: 5.0, duration_s: 30.0, step_s: 1e-3, rate_limit_deg_per_s: 600.0 }
    }
}

/// Coverage of the sphere by a lidar.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coverage {
    /// Observed fraction of the sphere.
    pub fraction_seen: f64,
    /// Mean fraction of the sphere observed per sweep, from one turning point of the swing to the next; `None` without a
    /// complete sweep.
    pub fraction_in_a_sweep: Option<f64>,
    /// Mean duration of a sweep, s.
    pub sweep_s: Option<f64>,
    /// Beams per steradian in a sweep: median over the observed cells, mean over the sweeps.
    pub density_in_a_sweep_per_sr: Option<f64>,
    /// Beams per steradian and second over the complete observation, in the observed cells.
    pub density_per_sr_s: Density,
    /// Time until 50 % of the finally observed fraction is observed, s.
    pub half_covered_s: f64,
    /// Time until 90 % of the finally observed fraction is observed, s.
    pub covered_s: f64,
    /// Angle between the 2.5 % and 97.5 % quantiles of the forward beam's elevation, degrees.
    pub field_of_view_deg: f64,
    /// Maximum tilt of the lidar's scan plane from horizontal, degrees.
    pub most_tilt_deg: f64,
    /// Use of the gyroscope's range.
    pub gyro: GyroUsage,
    /// Elevation (degrees) and beams per steradian and second, averaged over all azimuths.
    pub by_elevation: Vec<(f64, f64)>,
    /// Time (s) and observed fraction of the sphere.
    pub over_time: Vec<(f64, f64)>,
    /// Beam density of each cell of the sphere, from the bottom up.
    #[serde(skip)]
    pub cells: Vec<CoverageCell>,
}

/// A cell of the sphere of directions; all cells have the same solid angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoverageCell {
    /// Limits in azimuth, degrees from the base's heading, positive to the left.
    pub azimuth_deg: (f64, f64),
    /// Limits in elevation, degrees above the horizon.
    pub elevation_deg: (f64, f64),
    /// Beams per steradian and second.
    pub beams_per_sr_s: f64,
}

/// Statistics of the beam density over the observed cells, beams per steradian and second.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Density {
    /// Mean.
    pub mean: f64,
    /// 10 % quantile.
    pub p10: f64,
    /// Median.
    pub median: f64,
}

/// Angular rates in comparison with a gyroscope's range.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GyroUsage {
    /// Range per axis, degrees/s.
    pub limit_deg_per_s: f64,
    /// Maximum angular rate on an axis, degrees/s.
    pub most_deg_per_s: f64,
    /// 99 % quantile over time of the largest rate among the axes, degrees/s.
    pub p99_deg_per_s: f64,
    /// Fraction of the time in which at least one axis is saturated.
    pub saturated: f64,
}

/// Simulates `head` on `motion` and computes the coverage of `lidar`; `watch` receives each observed state.
///
/// # Errors
/// If the observation is shorter than two scans or ends after one hour, or if the simulation fails.
pub fn coverage(
    head: &HeadModel,
    motion: &dyn BaseMotion,
    lidar: &Lidar,
    plan: &CoveragePlan,
    watch: impl FnMut(&HeadState),
) -> Result<Coverage, StudyError> {
    if !(plan.duration_s >= 2.0 * lidar.period_s() && plan.from_s >= 0.0) {
        let message = format!("{} s from {} s on: less than two scans of the lidar", plan.duration_s, plan.from_s);
        return Err(StudyError::Plan { what: "observation time", message });
    }
    let until_s = plan.from_s + plan.duration_s;
    if until_s > MAX_END_S {
        let message = format!("ends at {until_s} s: expected at most {MAX_END_S} s");
        return Err(StudyError::Plan { what: "observation time", message });
    }
    let track = SwingTrack::record(head, motion, plan, watch)?;
    let turning = track.turning_points();
    let mut sphere = Sphere::default();
    let mut over_time = Vec::new();
    let mut sweeps = Sweeps::default();
    let scans = (plan.duration_s / lidar.period_s()).floor() as usize;
    let mut next = turning.iter().copied().peekable();
    for scan in 0..scans {
        let start_s = scan as f64 * lidar.period_s();
        while next.next_if(|t| *t <= start_s).is_some() {
            sweeps.end(&mut sphere);
        }
        let laser_rotation = lidar.scan_rotation(scan as u64).unwrap_or_else(Rotation::identity);
        for beam in lidar.beams() {
            let heading_from_laser = track.heading_from_laser(start_s + beam.offset_s);
            sphere.count_beam(&(heading_from_laser * (laser_rotation * beam.direction_in_laser)));
        }
        over_time.push((start_s + lidar.period_s(), sphere.observed_fraction()));
    }
    let time_to = |share_of_final: f64| {
        let target = share_of_final * sphere.observed_fraction();
        over_time.iter().find(|(_, observed)| *observed >= target).map_or(plan.duration_s, |(t, _)| *t)
    };
    let observed_s = scans as f64 * lidar.period_s();
    Ok(Coverage {
        fraction_seen: sphere.observed_fraction(),
        fraction_in_a_sweep: sweeps.mean(|s| s.fraction),
        sweep_s: (turning.len() > 1).then(|| (turning[turning.len() - 1] - turning[0]) / (turning.len() - 1) as f64),
        density_in_a_sweep_per_sr: sweeps.mean(|s| s.density_per_sr),
        density_per_sr_s: sphere.density_per_sr(observed_s),
        half_covered_s: time_to(0.5),
        covered_s: time_to(0.9),
        field_of_view_deg: track.field_of_view_rad().to_degrees(),
        most_tilt_deg: track.most_tilt_rad.to_degrees(),
        gyro: track.gyro_usage(plan.rate_limit_deg_per_s),
        by_elevation: sphere.by_elevation(observed_s),
        cells: sphere.cells(observed_s),
        over_time,
    })
}

/// Coverage of single sweeps.
#[derive(Debug, Default)]
struct Sweeps {
    complete: Vec<Sweep>,
    /// Whether the first turning point has passed.
    has_started: bool,
}

/// Coverage of one sweep.
#[derive(Debug, Clone, Copy)]
struct Sweep {
    fraction: f64,
    density_per_sr: f64,
}

impl Sweeps {
    /// Ends a sweep at a turning point; the time before the first one is not a sweep.
    fn end(&mut self, sphere: &mut Sphere) {
        let (fraction, density_per_sr) = sphere.end_sweep();
        if std::mem::replace(&mut self.has_started, true) {
            self.complete.push(Sweep { fraction, density_per_sr });
        }
    }

    /// Mean of a value over the complete sweeps.
    fn mean(&self, value: fn(&Sweep) -> f64) -> Option<f64> {
        (!self.complete.is_empty()).then(|| self.complete.iter().map(value).sum::<f64>() / self.complete.len() as f64)
    }
}
