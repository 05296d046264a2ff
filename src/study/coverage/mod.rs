//! What a swinging lidar sees of the sphere about it, how densely, how soon, and what its gyroscope makes of it.
//!
//! Directions are written in the heading's frame: upright, turned with the base's yaw, so that walking round a corner
//! does not count as seeing more.

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

/// Latest time that is looked at, s: an hour, of which some 200 MB are held in memory.
const LONGEST_S: f64 = 3600.0;

/// What is run and looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoveragePlan {
    /// When looking begins, s after the motion's start: after its first seconds at rest.
    pub from_s: f64,
    /// How long is looked, s.
    pub duration_s: f64,
    /// The simulation's time step, s.
    pub step_s: f64,
    /// Greatest rate that the gyroscope reads on an axis, degrees/s.
    pub rate_limit_deg_per_s: f64,
}

impl Default for CoveragePlan {
    /// From 5 s on for 30 s, in steps of 1 ms, with the 600 degrees/s of the paper's gyroscope.
    fn default() -> Self {
        Self { from_s: 5.0, duration_s: 30.0, step_s: 1e-3, rate_limit_deg_per_s: 600.0 }
    }
}

/// What a lidar saw.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coverage {
    /// Share of the sphere that was seen at all.
    pub fraction_seen: f64,
    /// Share of the sphere that a sweep sees, from one turning point of the swing to the next; `None` without two of
    /// them.
    pub fraction_in_a_sweep: Option<f64>,
    /// How long a sweep takes, s.
    pub sweep_s: Option<f64>,
    /// Beams per steradian in a sweep, where it looks at all: the middle one of all places.
    pub density_in_a_sweep_per_sr: Option<f64>,
    /// Beams per steradian and second over the whole time: mean of all that was seen, the tenth part seen least, the
    /// median.
    pub density_per_sr_s: Density,
    /// Time until half of what was ever seen has been seen, s.
    pub half_covered_s: f64,
    /// Time until nine tenths of it have, s.
    pub covered_s: f64,
    /// Angle between the 2.5 % and 97.5 % quantiles of the forward beam's elevation, degrees.
    pub field_of_view_deg: f64,
    /// Greatest angle of the lidar's plane from level, degrees.
    pub most_tilt_deg: f64,
    /// What the gyroscope saw.
    pub gyro: GyroUsage,
    /// Beams per steradian and second by elevation (degrees), the whole circle of azimuths averaged.
    pub by_elevation: Vec<(f64, f64)>,
    /// Share of the sphere seen by time (s).
    pub over_time: Vec<(f64, f64)>,
    /// How densely beams lie in each cell of the sphere, from below.
    #[serde(skip)]
    pub cells: Vec<CoverageCell>,
}

/// A cell of the sphere of directions; all are equally large.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoverageCell {
    /// Left and right end, degrees from where the base heads; positive to the left.
    pub azimuth_deg: (f64, f64),
    /// Lower and upper end, degrees above the horizon.
    pub elevation_deg: (f64, f64),
    /// Beams per steradian and second; 0 where none was seen.
    pub beams_per_sr_s: f64,
}

/// How densely beams lie.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Density {
    /// Mean over all places that were seen.
    pub mean: f64,
    /// A tenth of them got less.
    pub p10: f64,
    /// Half of them got less.
    pub median: f64,
}

/// A gyroscope's rates against its limit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GyroUsage {
    /// Greatest rate on an axis that it reads, degrees/s.
    pub limit_deg_per_s: f64,
    /// Greatest rate on an axis that there was, degrees/s.
    pub most_deg_per_s: f64,
    /// The rate on the busiest axis that was not exceeded in 99 % of the time, degrees/s.
    pub p99_deg_per_s: f64,
    /// Share of the time in which some axis was beyond its limit.
    pub saturated: f64,
}

/// Runs `head` on `motion` and tells what `lidar` sees; `watch` is shown every instant that is looked at.
///
/// # Errors
/// When the plan has no time to look or looks at more than an hour, or the simulation fails.
pub fn coverage(
    head: &HeadModel,
    motion: &dyn BaseMotion,
    lidar: &Lidar,
    plan: &CoveragePlan,
    watch: impl FnMut(&HeadState),
) -> Result<Coverage, StudyError> {
    if !(plan.duration_s >= 2.0 * lidar.period_s() && plan.from_s >= 0.0) {
        let message = format!("{} s from {} s on: less than two scans of the lidar", plan.duration_s, plan.from_s);
        return Err(StudyError::Plan { what: "time to look", message });
    }
    let until_s = plan.from_s + plan.duration_s;
    if until_s > LONGEST_S {
        let message = format!("until {until_s} s; {LONGEST_S} s at most");
        return Err(StudyError::Plan { what: "time to look", message });
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
        let turned = lidar.scan_rotation(scan as u64).unwrap_or_else(Rotation::identity);
        for beam in lidar.beams() {
            let heading_from_laser = track.heading_from_laser(start_s + beam.offset_s);
            sphere.see(&(heading_from_laser * (turned * beam.direction_in_laser)));
        }
        over_time.push((start_s + lidar.period_s(), sphere.fraction_seen()));
    }
    let reach = |share: f64| {
        let wanted = share * sphere.fraction_seen();
        over_time.iter().find(|(_, seen)| *seen >= wanted).map_or(plan.duration_s, |(t, _)| *t)
    };
    let looked_s = scans as f64 * lidar.period_s();
    Ok(Coverage {
        fraction_seen: sphere.fraction_seen(),
        fraction_in_a_sweep: sweeps.mean(|s| s.fraction),
        sweep_s: (turning.len() > 1).then(|| (turning[turning.len() - 1] - turning[0]) / (turning.len() - 1) as f64),
        density_in_a_sweep_per_sr: sweeps.mean(|s| s.density_per_sr),
        density_per_sr_s: sphere.density_per_sr(looked_s),
        half_covered_s: reach(0.5),
        covered_s: reach(0.9),
        field_of_view_deg: track.field_of_view_rad().to_degrees(),
        most_tilt_deg: track.most_tilt_rad.to_degrees(),
        gyro: track.gyro_usage(plan.rate_limit_deg_per_s),
        by_elevation: sphere.by_elevation(looked_s),
        cells: sphere.cells(looked_s),
        over_time,
    })
}

/// What single sweeps saw.
#[derive(Debug, Default)]
struct Sweeps {
    whole: Vec<Sweep>,
    begun: bool,
}

#[derive(Debug, Clone, Copy)]
struct Sweep {
    fraction: f64,
    density_per_sr: f64,
}

impl Sweeps {
    /// Ends a sweep. What came before the first turning point was none.
    fn end(&mut self, sphere: &mut Sphere) {
        let (fraction, density_per_sr) = sphere.end_sweep();
        if std::mem::replace(&mut self.begun, true) {
            self.whole.push(Sweep { fraction, density_per_sr });
        }
    }

    fn mean(&self, of: fn(&Sweep) -> f64) -> Option<f64> {
        (!self.whole.is_empty()).then(|| self.whole.iter().map(of).sum::<f64>() / self.whole.len() as f64)
    }
}
