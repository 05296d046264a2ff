//! Metrics of a run as rows of text, for the terminal and for the page.

use super::Metrics;
use super::metrics::noise_sources;
use super::quantity::{count, digits, length, percent, time};

/// Rows of a name and a formatted value, under a common title.
type Group = (&'static str, Vec<Vec<String>>);

/// Title of a run: scene, duration and seed.
pub(super) fn title(metrics: &Metrics) -> String {
    let scene = metrics.scene.as_deref().map_or_else(String::new, |scene| format!("{scene}, "));
    let seed = metrics.seed.map_or_else(String::new, |seed| format!(", seed {seed}"));
    format!("{scene}{}{seed}", time(metrics.duration_s))
}

/// Returns the status with its first cause, the position error and its bound, as one line; `None` without an estimate.
///
/// The error is that of the better estimate, where the truth is known. The bound is left out for a lost run: it is infinite from
/// the loss on.
pub(super) fn verdict(metrics: &Metrics) -> Option<String> {
    let status = metrics.status.as_deref()?;
    let integrity = &metrics.integrity;
    let is_lost = status == "lost";
    let cause = integrity.causes.first().map(|cause| match is_lost {
        true => format!("{}, from {:.1} s", cause.sentence, cause.from_s),
        false => cause.line(),
    });
    let rmse_m = metrics.closed_loop.position_rmse_m.or(metrics.open_loop.position_rmse_m);
    let rmse = rmse_m.map(|m| format!("RMSE {}", length(m)));
    let bound = match (integrity.bound_m_99, integrity.largest_bound_m) {
        _ if is_lost => None,
        (Some(median_m), Some(largest_m)) => {
            Some(format!("99 % bound: median {}, at most {}", length(median_m), length(largest_m)))
        }
        _ => Some("no error bound".to_owned()),
    };
    let parts: Vec<String> = [cause, rmse, bound].into_iter().flatten().collect();
    Some(format!("{status}: {}", parts.join("; ")))
}

/// The groups with at least one known metric.
pub(super) fn groups(metrics: &Metrics) -> Vec<Group> {
    let mut groups = Groups(Vec::new());
    loops(metrics, &mut groups);
    sensors(metrics, &mut groups);
    cloud(metrics, &mut groups);
    groups.0.into_iter().filter(|(_, rows)| !rows.is_empty()).collect()
}

/// Collects the rows of the known metrics.
struct Groups(Vec<Group>);

impl Groups {
    fn start(&mut self, title: &'static str) {
        self.0.push((title, Vec::new()));
    }

    /// Adds a row to the last group if the value is known.
    fn add<T>(&mut self, name: &'static str, value: Option<T>, format: impl Fn(T) -> String) {
        if let (Some((_, rows)), Some(value)) = (self.0.last_mut(), value) {
            rows.push(vec![name.to_owned(), format(value)]);
        }
    }
}

/// The simulation, the open loop and the closed loop.
fn loops(metrics: &Metrics, groups: &mut Groups) {
    let (m, duration_s) = (&metrics.simulation, metrics.duration_s);
    groups.start("simulation");
    groups.add("wall time", m.wall_s, |s| format!("{} ({} x real time)", time(s), digits(duration_s / s)));
    groups.add("physics (parallel)", m.physics_wall_s, time);
    groups.add("ray casting (parallel)", m.rays_wall_s, time);
    groups.add("beams", m.beams, count);
    let returned = m.returns.zip(m.beams).map(|(returns, beams)| (returns, returns as f64 / beams.max(1) as f64));
    groups.add("returns", returned, |(returns, fraction)| format!("{} ({})", count(returns), percent(fraction)));
    let took = |(s, fraction): (f64, f64)| format!("{} ({} of the recording)", time(s), percent(fraction));
    let m = &metrics.open_loop;
    groups.start("open loop");
    groups.add("wall time", m.wall_s.zip(m.fraction_of_acquisition), took);
    groups.add("fixed views (setting)", m.fixed_views, count);
    groups.add("position RMSE", m.position_rmse_m, length);
    groups.add("rotation RMSE", m.rotation_rmse_deg, degrees);
    groups.add("drift", m.drift_m_per_min, per_minute);
    groups.add("yaw drift", m.yaw_drift_deg_per_min, |deg| format!("{}/min", degrees(deg)));
    groups.add("relative error over 1 min", m.relative_error_per_minute_m, length);
    groups.add("error at end", m.end_error_m, length);
    groups.add("drift, IMU only", m.imu_only_drift_m_per_min, per_minute);
    let m = &metrics.closed_loop;
    groups.start("closed loop");
    groups.add("wall time", m.wall_s.zip(m.fraction_of_acquisition), took);
    groups.add("position RMSE", m.position_rmse_m, length);
    groups.add("rotation RMSE", m.rotation_rmse_deg, degrees);
    groups.add("information bound, known map", m.bound_rmse_m, length);
    let loops = m.loops.proposed.zip(m.loops.verified).zip(m.loops.closed).filter(|((proposed, _), _)| *proposed > 0);
    groups.add("loop closures", loops, |((proposed, verified), closed)| {
        format!("{} ({} proposed, {} verified)", count(closed), count(proposed), count(verified))
    });
    groups.add("not applied", m.left.as_deref(), str::to_owned);
}

/// The clocks, and what is estimated or known of the sensors.
fn sensors(metrics: &Metrics, groups: &mut Groups) {
    groups.start("clock");
    groups.add("offset at end", metrics.clock.offset_end_s, time);
    groups.add("offset RMSE", metrics.clock.offset_rmse_s, time);
    groups.add("offset error at end", metrics.clock.offset_end_error_s, time);
    let m = &metrics.lidar;
    let each = |by: [f64; 3], format: fn(f64) -> String| by.map(format).join(", ");
    groups.start("lidar");
    groups.add("range correction", m.range_correction_m, length);
    groups.add("rotation correction (x, y, z)", m.rotation_correction_deg, |deg| each(deg, degrees));
    groups.add("translation correction (x, y, z)", m.translation_correction_m, |by_m| each(by_m, length));
    let m = &metrics.sensors;
    let averaging = m.imu_averaging.as_deref().zip(m.imu_averaging_source.as_deref());
    groups.start("sensors");
    groups.add("IMU averaging", averaging, |(kind, source)| format!("{kind}, {source}"));
    groups.add("IMU noise", noise_sources(&m.noise, "imu."), |sources| sources);
    groups.add("range noise", noise_sources(&m.noise, "lidar."), |sources| sources);
}

/// The cloud, and the memory.
fn cloud(metrics: &Metrics, groups: &mut Groups) {
    let m = &metrics.cloud;
    groups.start("cloud");
    groups.add("points before filtering", m.points, count);
    groups.add("points in the file", m.filter.kept, count);
    groups.add("bias", m.bias_m, length);
    groups.add("sigma, static points", m.sigma_m, length);
    groups.add("sigma, true trajectory", m.sigma_by_truth_m, length);
    groups.add("95th percentile of the distance, static points", m.p95_m, length);
    groups.add("more than 1 m off", m.far_fraction, percent);
    groups.add("on the carrier", m.on_carrier_fraction, percent);
    groups.add("on moving objects", m.on_movers_fraction, percent);
    let fraction =
        |dropped: Option<u64>| dropped.zip(m.points).map(|(dropped, all)| dropped as f64 / all.max(1) as f64);
    groups.add("removed: mixed pixels", fraction(m.filter.dropped_mixed), percent);
    groups.add("removed: isolated", fraction(m.filter.dropped_isolated), percent);
    groups.add("removed: moving", fraction(m.filter.dropped_moving), percent);
    groups.add("static points removed by mistake", m.filter.standing_dropped_fraction, percent);
    groups.add("moving points removed", m.filter.movers_dropped_fraction, percent);
    groups.add("sigma, static points in the file", m.filter.kept_static_sigma_m, length);
    groups.add("sigma, all points in the file", m.filter.kept_all_sigma_m, length);
    groups.start("memory");
    groups.add("peak", metrics.peak_rss_mib, |mib| format!("{} MiB", digits(mib)));
}

pub(super) fn degrees(deg: f64) -> String {
    format!("{}\u{b0}", digits(deg))
}

fn per_minute(metres: f64) -> String {
    format!("{}/min", length(metres))
}
