//! A run's figures as rows of words, for the terminal and the page alike.

use super::Metrics;
use super::quantity::{count, digits, length, percent, time};

/// A figure with its name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Row {
    pub(super) name: &'static str,
    pub(super) value: String,
}

/// Figures of one kind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Group {
    pub(super) title: &'static str,
    pub(super) rows: Vec<Row>,
}

/// What the run was, in one line.
pub(super) fn title(metrics: &Metrics) -> String {
    let scene = metrics.scene.as_deref().map_or_else(String::new, |scene| format!("{scene}, "));
    let seed = metrics.seed.map_or_else(String::new, |seed| format!(", seed {seed}"));
    format!("{scene}{}{seed}", time(metrics.duration_s))
}

/// The groups that have something to tell.
pub(super) fn groups(metrics: &Metrics) -> Vec<Group> {
    let all = [
        simulation(metrics),
        open_loop(metrics),
        closed_loop(metrics),
        clock(metrics),
        lidar(metrics),
        cloud(metrics),
        memory(metrics),
    ];
    all.into_iter().filter(|group| !group.rows.is_empty()).collect()
}

/// Gathers the rows whose figures are known.
struct Rows(Vec<Row>);

impl Rows {
    fn add<T: Copy>(&mut self, name: &'static str, figure: Option<T>, words: impl Fn(T) -> String) {
        self.0.extend(figure.map(|figure| Row { name, value: words(figure) }));
    }

    fn titled(self, title: &'static str) -> Group {
        Group { title, rows: self.0 }
    }
}

fn simulation(metrics: &Metrics) -> Group {
    let (m, duration_s) = (&metrics.simulation, metrics.duration_s);
    let mut rows = Rows(Vec::new());
    rows.add("took", m.wall_s, |s| format!("{} ({} x real time)", time(s), digits(duration_s / s)));
    rows.add("physics, in parallel", m.physics_wall_s, time);
    rows.add("rays, in parallel", m.rays_wall_s, time);
    rows.add("beams", m.beams, count);
    let returned = m.returns.zip(m.beams).map(|(returns, beams)| (returns, returns as f64 / beams.max(1) as f64));
    rows.add("echoes", returned, |(returns, share)| format!("{} ({})", count(returns), percent(share)));
    rows.titled("simulation")
}

fn open_loop(metrics: &Metrics) -> Group {
    let m = &metrics.open_loop;
    let mut rows = Rows(Vec::new());
    let took = m.wall_s.zip(m.fraction_of_acquisition);
    rows.add("took", took, |(s, share)| format!("{} ({} of acquisition)", time(s), percent(share)));
    rows.add("fixed views", m.fixed_views, count);
    rows.add("position RMSE", m.position_rmse_m, length);
    rows.add("rotation RMSE", m.rotation_rmse_deg, degrees);
    rows.add("drift", m.drift_m_per_min, per_minute);
    rows.add("yaw drift", m.yaw_drift_deg_per_min, |deg| format!("{}/min", degrees(deg)));
    rows.add("error within a minute", m.relative_error_per_minute_m, length);
    rows.add("error at the end", m.end_error_m, length);
    rows.add("drift of the IMU alone", m.imu_only_drift_m_per_min, per_minute);
    rows.titled("open loop")
}

fn closed_loop(metrics: &Metrics) -> Group {
    let m = &metrics.closed_loop;
    let mut rows = Rows(Vec::new());
    let took = m.wall_s.zip(m.fraction_of_acquisition);
    rows.add("took", took, |(s, share)| format!("{} ({} of acquisition)", time(s), percent(share)));
    rows.add("position RMSE", m.position_rmse_m, length);
    rows.add("rotation RMSE", m.rotation_rmse_deg, degrees);
    rows.add("information bound", m.bound_rmse_m, length);
    let loops = m.loops.proposed.zip(m.loops.verified).zip(m.loops.closed).filter(|((proposed, _), _)| *proposed > 0);
    rows.add("places recognised", loops, |((proposed, verified), closed)| {
        format!("{} ({} proposed, {} verified)", count(closed), count(proposed), count(verified))
    });
    rows.add("left as the open loop", m.left.as_deref(), str::to_owned);
    rows.titled("closed loop")
}

fn clock(metrics: &Metrics) -> Group {
    let mut rows = Rows(Vec::new());
    rows.add("offset at the end", metrics.clock.offset_end_s, time);
    rows.add("offset RMSE", metrics.clock.offset_rmse_s, time);
    rows.add("offset error at the end", metrics.clock.offset_end_error_s, time);
    rows.titled("clock")
}

fn lidar(metrics: &Metrics) -> Group {
    let m = &metrics.lidar;
    let each = |by: [f64; 3], words: fn(f64) -> String| by.map(words).join(", ");
    let mut rows = Rows(Vec::new());
    rows.add("ranges corrected by", m.range_correction_m, length);
    rows.add("turned (x, y, z) by", m.rotation_correction_deg, |deg| each(deg, degrees));
    rows.add("shifted (x, y, z) by", m.translation_correction_m, |by_m| each(by_m, length));
    rows.titled("lidar")
}

fn cloud(metrics: &Metrics) -> Group {
    let m = &metrics.cloud;
    let mut rows = Rows(Vec::new());
    rows.add("points", m.points, count);
    rows.add("bias", m.bias_m, length);
    rows.add("sigma", m.sigma_m, length);
    rows.add("sigma by the true trajectory", m.sigma_by_truth_m, length);
    rows.add("95 % within", m.p95_m, length);
    rows.add("farther than 1 m", m.far_fraction, percent);
    rows.add("on the carrier", m.on_carrier_fraction, percent);
    rows.add("on what moves", m.on_movers_fraction, percent);
    let share = |dropped: Option<u64>| dropped.zip(m.points).map(|(dropped, all)| dropped as f64 / all.max(1) as f64);
    rows.add("left out, of two surfaces", share(m.filter.dropped_mixed), percent);
    rows.add("left out, isolated", share(m.filter.dropped_isolated), percent);
    rows.add("left out, moving", share(m.filter.dropped_moving), percent);
    rows.add("left out of what stands", m.filter.standing_dropped_fraction, percent);
    rows.add("left out of what moves", m.filter.movers_dropped_fraction, percent);
    rows.add("sigma of what is kept", m.filter.kept_sigma_m, length);
    rows.titled("cloud")
}

fn memory(metrics: &Metrics) -> Group {
    let mut rows = Rows(Vec::new());
    rows.add("peak", metrics.peak_rss_mib, |mib| format!("{} MiB", digits(mib)));
    rows.titled("memory")
}

fn degrees(deg: f64) -> String {
    format!("{}\u{b0}", digits(deg))
}

fn per_minute(metres: f64) -> String {
    format!("{}/min", length(metres))
}
