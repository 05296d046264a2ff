//! Metrics of a run as rows of text, for the terminal and for the page.

use super::Metrics;
use super::quantity::{count, digits, length, percent, time};
use super::sensors::noise_sources;

/// Rows of a name and a formatted value, under a common title.
type Group = (&'static str, Vec<Vec<String>>);

/// Title of a run: scene, duration and seed.
pub(super) fn title(metrics: &Metrics) -> String {
    let scene = metrics.scene.as_deref().map_or_else(String::new, |scene| format!("{scene}, "));
    let seed = metrics.seed.map_or_else(String::new, |seed| format!(", seed {seed}"));
    format!("{scene}{}{seed}", time(metrics.duration_s))
}

/// The groups with at least one known metric.
pub(super) fn groups(metrics: &Metrics) -> Vec<Group> {
    let all = [
        simulation(metrics),
        open_loop(metrics),
        closed_loop(metrics),
        clock(metrics),
        lidar(metrics),
        sensors(metrics),
        cloud(metrics),
        memory(metrics),
    ];
    all.into_iter().filter(|(_, rows)| !rows.is_empty()).collect()
}

/// Collects the rows of the known metrics.
struct RowBuilder(Vec<Vec<String>>);

impl RowBuilder {
    fn add<T: Copy>(&mut self, name: &'static str, value: Option<T>, format: impl Fn(T) -> String) {
        self.0.extend(value.map(|value| vec![name.to_owned(), format(value)]));
    }

    fn titled(self, title: &'static str) -> Group {
        (title, self.0)
    }
}

fn simulation(metrics: &Metrics) -> Group {
    let (m, duration_s) = (&metrics.simulation, metrics.duration_s);
    let mut rows = RowBuilder(Vec::new());
    rows.add("wall time", m.wall_s, |s| format!("{} ({} x real time)", time(s), digits(duration_s / s)));
    rows.add("physics (parallel)", m.physics_wall_s, time);
    rows.add("ray casting (parallel)", m.rays_wall_s, time);
    rows.add("beams", m.beams, count);
    let returned = m.returns.zip(m.beams).map(|(returns, beams)| (returns, returns as f64 / beams.max(1) as f64));
    rows.add("returns", returned, |(returns, fraction)| format!("{} ({})", count(returns), percent(fraction)));
    rows.titled("simulation")
}

fn open_loop(metrics: &Metrics) -> Group {
    let m = &metrics.open_loop;
    let mut rows = RowBuilder(Vec::new());
    let took = m.wall_s.zip(m.fraction_of_acquisition);
    rows.add("wall time", took, |(s, fraction)| format!("{} ({} of the recording)", time(s), percent(fraction)));
    rows.add("fixed views (setting)", m.fixed_views, count);
    rows.add("position RMSE", m.position_rmse_m, length);
    rows.add("rotation RMSE", m.rotation_rmse_deg, degrees);
    rows.add("drift", m.drift_m_per_min, per_minute);
    rows.add("yaw drift", m.yaw_drift_deg_per_min, |deg| format!("{}/min", degrees(deg)));
    rows.add("relative error over 1 min", m.relative_error_per_minute_m, length);
    rows.add("error at end", m.end_error_m, length);
    rows.add("drift, IMU only", m.imu_only_drift_m_per_min, per_minute);
    rows.titled("open loop")
}

fn closed_loop(metrics: &Metrics) -> Group {
    let m = &metrics.closed_loop;
    let mut rows = RowBuilder(Vec::new());
    let took = m.wall_s.zip(m.fraction_of_acquisition);
    rows.add("wall time", took, |(s, fraction)| format!("{} ({} of the recording)", time(s), percent(fraction)));
    rows.add("position RMSE", m.position_rmse_m, length);
    rows.add("rotation RMSE", m.rotation_rmse_deg, degrees);
    rows.add("information bound, known map", m.bound_rmse_m, length);
    let loops = m.loops.proposed.zip(m.loops.verified).zip(m.loops.closed).filter(|((proposed, _), _)| *proposed > 0);
    rows.add("loop closures", loops, |((proposed, verified), closed)| {
        format!("{} ({} proposed, {} verified)", count(closed), count(proposed), count(verified))
    });
    rows.add("not applied", m.left.as_deref(), str::to_owned);
    rows.titled("closed loop")
}

fn clock(metrics: &Metrics) -> Group {
    let mut rows = RowBuilder(Vec::new());
    rows.add("offset at end", metrics.clock.offset_end_s, time);
    rows.add("offset RMSE", metrics.clock.offset_rmse_s, time);
    rows.add("offset error at end", metrics.clock.offset_end_error_s, time);
    rows.titled("clock")
}

fn lidar(metrics: &Metrics) -> Group {
    let m = &metrics.lidar;
    let each = |by: [f64; 3], format: fn(f64) -> String| by.map(format).join(", ");
    let mut rows = RowBuilder(Vec::new());
    rows.add("range correction", m.range_correction_m, length);
    rows.add("rotation correction (x, y, z)", m.rotation_correction_deg, |deg| each(deg, degrees));
    rows.add("translation correction (x, y, z)", m.translation_correction_m, |by_m| each(by_m, length));
    rows.titled("lidar")
}

fn sensors(metrics: &Metrics) -> Group {
    let m = &metrics.sensors;
    let mut rows = RowBuilder(Vec::new());
    let averaging = m.imu_averaging.as_deref().zip(m.imu_averaging_source.as_deref());
    rows.add("IMU averaging", averaging, |(kind, source)| format!("{kind}, {source}"));
    for (name, sensor) in [("IMU noise", "imu."), ("range noise", "lidar.")] {
        rows.0.extend(noise_sources(&m.noise, sensor).map(|value| vec![name.to_owned(), value]));
    }
    rows.titled("sensors")
}

fn cloud(metrics: &Metrics) -> Group {
    let m = &metrics.cloud;
    let mut rows = RowBuilder(Vec::new());
    rows.add("points before filtering", m.points, count);
    rows.add("points in the file", m.filter.kept, count);
    rows.add("bias", m.bias_m, length);
    rows.add("sigma, static points", m.sigma_m, length);
    rows.add("sigma, true trajectory", m.sigma_by_truth_m, length);
    rows.add("95th percentile of the distance, static points", m.p95_m, length);
    rows.add("more than 1 m off", m.far_fraction, percent);
    rows.add("on the carrier", m.on_carrier_fraction, percent);
    rows.add("on moving objects", m.on_movers_fraction, percent);
    let fraction =
        |dropped: Option<u64>| dropped.zip(m.points).map(|(dropped, all)| dropped as f64 / all.max(1) as f64);
    rows.add("removed: mixed pixels", fraction(m.filter.dropped_mixed), percent);
    rows.add("removed: isolated", fraction(m.filter.dropped_isolated), percent);
    rows.add("removed: moving", fraction(m.filter.dropped_moving), percent);
    rows.add("static points removed by mistake", m.filter.standing_dropped_fraction, percent);
    rows.add("moving points removed", m.filter.movers_dropped_fraction, percent);
    rows.add("sigma, static points in the file", m.filter.kept_static_sigma_m, length);
    rows.add("sigma, all points in the file", m.filter.kept_all_sigma_m, length);
    rows.titled("cloud")
}

fn memory(metrics: &Metrics) -> Group {
    let mut rows = RowBuilder(Vec::new());
    rows.add("peak", metrics.peak_rss_mib, |mib| format!("{} MiB", digits(mib)));
    rows.titled("memory")
}

pub(super) fn degrees(deg: f64) -> String {
    format!("{}\u{b0}", digits(deg))
}

fn per_minute(metres: f64) -> String {
    format!("{}/min", length(metres))
}
