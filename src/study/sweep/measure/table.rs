//! The table of measures.

use zsim_run::{Needs, Results};

/// A measure in the table.
pub(super) struct Entry {
    pub key: &'static str,
    pub description: &'static str,
    pub needs: Needs,
    pub of: fn(&Results) -> Option<f64>,
    pub short: &'static str,
    pub quantity: &'static str,
    pub unit: Unit,
}

/// Display unit in tables and on axes, and the factor from the unit of the key to it.
#[derive(Clone, Copy)]
pub(super) struct Unit {
    pub text: &'static str,
    pub on_axis: &'static str,
    pub factor: f64,
}

/// Declares the table: `/// description`, `key: Needs |results| figure => (short name, quantity, unit);`
macro_rules! measures {
    ($($(#[doc = $doc:literal])* $key:ident: $needs:ident |$results:tt| $of:expr => ($short:literal, $quantity:literal, $unit:ident);)*) => {
        pub(super) const TABLE: &[Entry] = &[$(Entry {
            key: stringify!($key),
            description: concat!($($doc),*),
            needs: Needs::$needs,
            of: |$results| $of,
            short: $short,
            quantity: $quantity,
            unit: $unit,
        }),*];
        pub(super) const KEYS: &[&str] = &[$(stringify!($key)),*];
    };
}

const fn unit(text: &'static str, on_axis: &'static str, factor: f64) -> Unit {
    Unit { text, on_axis, factor }
}

const ONE: Unit = unit("1", "", 1.0);
const PERCENT: Unit = unit("%", "%", 1e2);
const M: Unit = unit("m", "m", 1.0);
const MM: Unit = unit("mm", "mm", 1e3);
const MM_AS_IS: Unit = unit("mm", "mm", 1.0);
const MM_PER_MIN: Unit = unit("mm/min", "mm/min", 1e3);
const DEG: Unit = unit("deg", "\u{b0}", 1.0);
const DEG_PER_MIN: Unit = unit("deg/min", "\u{b0}/min", 1.0);
const DEG_PER_S: Unit = unit("deg/s", "\u{b0}/s", 1.0);
const S: Unit = unit("s", "s", 1.0);
const MS: Unit = unit("ms", "ms", 1e3);
const HZ: Unit = unit("Hz", "Hz", 1.0);
const G: Unit = unit("g", "g", 1.0);
const PER_SR_S: Unit = unit("1/sr/s", "1/sr/s", 1.0);

/// The ratio of two figures, if both are known.
fn ratio(figure: Option<f64>, of: Option<f64>) -> Option<f64> {
    Some(figure? / of?)
}

measures! {
    /// Position error of the open-loop estimate after rigid alignment, root mean square, m.
    position_rmse_m: OpenLoop |r| r.metrics.open_loop.position_rmse_m => ("position", "Position error, open loop, RMS", MM);
    /// Rotation error (angle) of the open-loop estimate after rigid alignment, root mean square, degrees.
    rotation_rmse_deg: OpenLoop |r| r.metrics.open_loop.rotation_rmse_deg => ("rotation", "Rotation error, open loop, RMS", DEG);
    /// Position drift of the open-loop estimate, m/min.
    drift_m_per_min: OpenLoop |r| r.metrics.open_loop.drift_m_per_min => ("drift", "Drift, open loop", MM_PER_MIN);
    /// Yaw drift of the open-loop estimate, degrees/min.
    yaw_drift_deg_per_min: OpenLoop |r| r.metrics.open_loop.yaw_drift_deg_per_min => ("yaw drift", "Yaw drift, open loop", DEG_PER_MIN);
    /// Error of the estimated clock offset over the complete run including its start, root mean square, s.
    clock_rmse_s: OpenLoop |r| r.metrics.clock.offset_rmse_s => ("clock", "Clock offset error, RMS", MS);
    /// Absolute error of the estimated clock offset 30 s after the first estimate, s; the offset starts from 0.
    clock_error_30s_s: ClockCurve |r| r.metrics.clock.error_after_30s_s => ("clock 30 s", "Clock offset error after 30 s", MS);
    /// The same after 120 s, s.
    clock_error_120s_s: ClockCurve |r| r.metrics.clock.error_after_120s_s => ("clock 120 s", "Clock offset error after 120 s", MS);
    /// Position error of the base computed from the open-loop estimate of the head as if the link between them were rigid,
    /// after rigid alignment, root mean square, m.
    rigid_link_rmse_m: OpenLoop |r| r.rigid_link_rmse_m => ("rigid link", "Position error of the base, rigid link, RMS", MM);
    /// Position error after loop closure and rigid alignment, root mean square, m. Loops are closed only if this measure
    /// or the next is requested.
    closed_position_rmse_m: ClosedLoop |r| r.metrics.closed_loop.position_rmse_m => ("closed loop", "Position error, closed loop, RMS", MM);
    /// Ratio of that error to the information bound with an unknown map (`zsim bound --map unknown`), for runs of up to
    /// 300 s. The bound takes up to a minute for a recording of 150 s, which `wall_s` does not include.
    error_over_slam_bound: SlamBound |r| ratio(r.metrics.closed_loop.position_rmse_m, r.slam_bound_m) => ("error/CRLB", "Closed-loop error over information bound", ONE);
    /// Integrity verdict on the estimate: 0 good, 1 degraded, 2 lost.
    status: OpenLoop |r| r.status() => ("status", "Verdict (0 good, 1 degraded, 2 lost)", ONE);
    /// Position error of the final trajectory (loop-closed if that is requested) after rigid alignment over the first
    /// 20 s (half of a shorter run), root mean square, m.
    aligned_rmse_m: OpenLoop |r| r.metrics.integrity.aligned_rmse_m => ("aligned", "Position error, aligned over the first 20 s, RMS", MM);
    /// 95 % quantile of the position error over the poses, after the same alignment, m.
    aligned_p95_m: OpenLoop |r| r.metrics.integrity.aligned_p95_m => ("95 % quantile", "Position error, 95 % quantile", MM);
    /// Fraction of the time in which a cause degrades the estimate: the length of all intervals that the verdict names.
    degraded_fraction: OpenLoop |r| r.metrics.integrity.degraded_fraction => ("degraded", "Time degraded", PERCENT);
    /// Largest position error after the same alignment, m.
    largest_error_m: OpenLoop |r| r.metrics.integrity.largest_error_m => ("largest", "Largest position error", MM);
    /// Median of the 99 % bound on the aligned position error, m.
    bound_m_99: OpenLoop |r| r.metrics.integrity.bound_m_99 => ("bound", "99 % bound on the position error, median", MM);
    /// Fraction of the poses whose position error is within the bound.
    within_bound: OpenLoop |r| r.metrics.integrity.within_bound => ("within", "Poses within their bound", PERCENT);
    /// Ratio of bound to position error, median over the poses.
    bound_over_error: OpenLoop |r| r.metrics.integrity.bound_over_error => ("bound/error", "99 % bound over error, median", ONE);
    /// Length of the estimated path, from positions one second apart, m.
    way_m: OpenLoop |r| r.metrics.integrity.path_length_m => ("path", "Length of the path", M);
    /// Open loop aligned over the first 20 s: position error at the end over the length of the path.
    drift_over_path: OpenLoop |r| ratio(r.metrics.open_loop.end_error_m, r.metrics.integrity.path_length_m) => ("drift/path", "Drift over the length of the path", PERCENT);
    /// Standard deviation of the map's points about the true surfaces, along their normals, m.
    cloud_sigma_m: Cloud |r| r.metrics.cloud.sigma_m => ("cloud", "Standard deviation of the cloud", MM);
    /// Mean signed distance of the map's points to the true surfaces, m: positive where they are too near to the sensor.
    cloud_bias_m: Cloud |r| r.metrics.cloud.bias_m => ("cloud bias", "Bias of the cloud", MM);
    /// Ratio of that standard deviation to that of the same beams projected by the true trajectory; without timing errors.
    cloud_over_truth: Cloud |r| ratio(r.metrics.cloud.sigma_m, r.metrics.cloud.sigma_by_truth_m) => ("cloud/truth", "Cloud sigma over that with the true trajectory", ONE);
    /// Standard deviation of the map's points about the surfaces of the reference system's map, along their normals, m
    /// (Bosse, Zlot and Flick 2012, section IV-A). Both maps are aligned with the truth. It is missing if the reference
    /// system is lost.
    reference_sigma_m: Reference |r| r.reference.sigma_m => ("from reference", "Standard deviation from the reference cloud", MM);
    /// Mean signed distance of the same points, m: positive where they are too near to the sensor.
    reference_bias_m: Reference |r| r.reference.bias_m => ("reference bias", "Bias from the reference", MM);
    /// Position error of the reference system after rigid alignment, root mean square, m.
    reference_rmse_m: Reference |r| r.reference.rmse_m => ("reference", "Position error of the reference, RMS", MM);
    /// Error of the estimated clock offset at the end of a run with timing errors, s.
    clock_error_s: Timing |r| r.metrics.clock.offset_end_error_s => ("clock error", "Clock offset error at the end", MS);
    /// Fraction of the sphere of directions that the lidar observed.
    fraction_seen: Swing |r| Some(r.swing.as_ref()?.coverage.fraction_seen) => ("coverage", "Observed fraction of the sphere", PERCENT);
    /// Fraction of the sphere observed in one second, mean over the seconds.
    fraction_seen_1s: Swing |r| r.swing.as_ref()?.coverage.fraction_in_1s => ("in 1 s", "Coverage in a second", PERCENT);
    /// Time until 90 % of `fraction_seen` was observed, s.
    covered_s: Swing |r| Some(r.swing.as_ref()?.coverage.covered_s) => ("cover time", "Time to 90 % of the coverage", S);
    /// Beams per steradian and second, mean over the observed part of the sphere.
    density_per_sr_s: Swing |r| Some(r.swing.as_ref()?.coverage.density_per_sr_s.mean) => ("density", "Beam density, mean", PER_SR_S);
    /// Elevation range of the forward beam, degrees. In a journey: from the 2.5 % to the 97.5 % quantile. In closed form: twice the
    /// head's pitch amplitude.
    field_of_view_deg: SwingOrHead |r| r.swing.as_ref().map(|swing| swing.coverage.field_of_view_deg).or(r.head.map(|head| head.field_of_view_deg)) => ("view", "Elevation range of the forward beam", DEG);
    /// Maximum angular rate on an axis of the gyroscope, degrees/s.
    rate_deg_per_s: SwingOrHead |r| r.swing.as_ref().map(|swing| swing.coverage.gyro.most_deg_per_s).or(r.head.map(|head| head.rate_deg_per_s)) => ("rate", "Maximum rate", DEG_PER_S);
    /// 99 % quantile over time of the largest rate among the gyroscope's axes, degrees/s.
    rate_p99_deg_per_s: Swing |r| Some(r.swing.as_ref()?.coverage.gyro.p99_deg_per_s) => ("rate 99 %", "Rate, 99 % quantile", DEG_PER_S);
    /// Fraction of the time in which at least one axis of the gyroscope is saturated.
    saturated: Swing |r| Some(r.swing.as_ref()?.coverage.gyro.saturated) => ("saturated", "Time with a saturated gyroscope", PERCENT);
    /// Fraction of the gyroscope's range above the maximum angular rate on an axis; negative if the rate exceeds the range.
    gyro_range_left: Swing |r| Some(r.swing.as_ref()?.coverage.gyro.range_left()) => ("range left", "Range of the gyroscope left", PERCENT);
    /// Time in which coils of the spring touch, s. A design should have none: the motion after a clash is approximate.
    coil_contact_s: Swing |r| Some(r.swing.as_ref()?.coil_contact_s) => ("contact", "Time with touching coils", S);
    /// Frequency of the slowest mode, Hz.
    rocking_hz: Head |r| Some(r.head?.rocking_hz) => ("rocking", "Rocking frequency", HZ);
    /// Peak gain, head over base: of the pitch rate in closed form, along or about the axis of a gain measurement.
    peak_gain: Head |r| r.peak_gain.or(r.head.map(|head| head.peak_gain)) => ("gain", "Peak gain", ONE);
    /// Static compression of the spring under the head's weight, mm; negative for an extension.
    sag_mm: Head |r| r.head?.sag_mm => ("sag", "Static compression", MM_AS_IS);
    /// Mass of the spring's active wire, g.
    spring_mass_g: Head |r| r.head?.spring_mass_g => ("mass", "Mass of the spring", G);
    /// Maximum stress in the wire over the yield strength.
    stress_share: Head |r| r.head?.stress_share => ("stress", "Stress over yield strength", PERCENT);
    /// Margin of the wire's stress cycle by Goodman's line: over the mission of a spring search, else over 1000 hours of the
    /// shake. Above 1 the spring lasts as long.
    fatigue_margin: Head |r| r.head?.fatigue_margin => ("fatigue", "Margin of fatigue", ONE);
    /// Computing time of the open loop on one thread over the length of the recording. Like the next two it is reported in
    /// `times.csv`, not in the table of results.
    open_loop_time_ratio: OpenLoopTime |r| r.metrics.open_loop.fraction_of_acquisition => ("loop time", "Open-loop computing time over recording", PERCENT);
    /// The same of the loop closure.
    closed_loop_time_ratio: ClosedLoopTime |r| r.metrics.closed_loop.fraction_of_acquisition => ("closure time", "Loop-closure computing time over recording", PERCENT);
    /// Computing time of the run on its thread, s.
    wall_s: WallClock |_| None => ("time", "Computing time", S);
}
