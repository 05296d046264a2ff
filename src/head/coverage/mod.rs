//! Coverage of the sphere of directions by a swinging lidar: fraction, density and time, and use of the gyroscope's range.
//!
//! Directions are in the heading frame: vertical z axis, rotated with the base's yaw, so that turning the base does not
//! increase the coverage.

mod figure;
mod result;
mod sphere;
mod track;

pub use figure::coverage_figure;
pub(crate) use result::main_values;
pub use result::{Coverage, CoverageCell, CoveragePlan, Density, GyroUsage, density_csv, document, over_time_csv};

use crate::HeadError;
use sphere::Sphere;
use track::SwingTrack;
use zsim_base::geometry::Rotation;
use zsim_dynamics::{HeadModel, HeadState};
use zsim_motion::BaseMotion;
use zsim_sensors::Lidar;

/// Maximum end of the observation, s: one hour takes about 200 MB of memory.
const MAX_END_S: f64 = 3600.0;

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
) -> Result<Coverage, HeadError> {
    if !(plan.duration_s >= 2.0 * lidar.period_s() && plan.from_s >= 0.0) {
        let message = format!("{} s from {} s on: less than two scans of the lidar", plan.duration_s, plan.from_s);
        return Err(HeadError::Plan { what: "observation time", message });
    }
    let until_s = plan.from_s + plan.duration_s;
    if until_s > MAX_END_S {
        let message = format!("ends at {until_s} s: expected at most {MAX_END_S} s");
        return Err(HeadError::Plan { what: "observation time", message });
    }
    let track = SwingTrack::record(head, motion, plan, watch)?;
    let turning = track.turning_points();
    let mut sphere = Sphere::default();
    let (mut over_time, mut seconds) = (Vec::new(), Vec::new());
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
        let end_s = start_s + lidar.period_s();
        over_time.push((end_s, sphere.observed_fraction()));
        // The end of a scan may be below a whole number of seconds by rounding.
        if end_s + 1e-9 >= (seconds.len() + 1) as f64 {
            seconds.push(sphere.end_second());
        }
    }
    let time_to = |share_of_final: f64| {
        let target = share_of_final * sphere.observed_fraction();
        over_time.iter().find(|(_, observed)| *observed >= target).map_or(plan.duration_s, |(t, _)| *t)
    };
    let observed_s = scans as f64 * lidar.period_s();
    Ok(Coverage {
        fraction_seen: sphere.observed_fraction(),
        fraction_in_1s: (!seconds.is_empty()).then(|| seconds.iter().sum::<f64>() / seconds.len() as f64),
        fraction_in_a_sweep: sweeps.mean(|(fraction, _)| *fraction),
        sweep_s: (turning.len() > 1).then(|| (turning[turning.len() - 1] - turning[0]) / (turning.len() - 1) as f64),
        density_in_a_sweep_per_sr: sweeps.mean(|(_, density_per_sr)| *density_per_sr),
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
    /// Observed fraction of the sphere, and beams per steradian.
    complete: Vec<(f64, f64)>,
    /// Whether the first turning point has passed.
    has_started: bool,
}

impl Sweeps {
    /// Ends a sweep at a turning point; the time before the first one is not a sweep.
    fn end(&mut self, sphere: &mut Sphere) {
        let sweep = sphere.end_sweep();
        if std::mem::replace(&mut self.has_started, true) {
            self.complete.push(sweep);
        }
    }

    /// Mean of a value over the complete sweeps.
    fn mean(&self, value: fn(&(f64, f64)) -> f64) -> Option<f64> {
        (!self.complete.is_empty()).then(|| self.complete.iter().map(value).sum::<f64>() / self.complete.len() as f64)
    }
}
