//! Checks of the keys of a fault.

use super::{FaultKind, FaultSpec, FaultsSpec, FaultySensor};
use zsim_base::spec::{Position, Source, SpecError};

/// Maximum number of faults: bounds the memory.
const MAX_FAULTS: usize = 1000;
/// Maximum time in a spec, s: the longest run.
const MAX_S: f64 = 1e6;
/// Maximum clock change, s: three years keep stamps within the 32-bit seconds of ROS messages.
const MAX_CLOCK_S: f64 = 1e8;
/// Maximum mean delay, s: delayed messages are held in memory.
const MAX_DELAY_S: f64 = 2.0;
/// Maximum group size: a group is held in memory.
const MAX_BURST: usize = 1000;
/// Maximum time between the stamps of a group, us: 1 s.
const MAX_SPACING_US: f64 = 1e6;
/// Maximum number of bad samples of a fault.
const MAX_SPIKES: u32 = 1_000_000;

/// A problem with a fault: key, message, remedy.
struct Problem(&'static str, String, &'static str);

/// Checks all faults of a spec.
pub(super) fn check(spec: &FaultsSpec, source: &Source) -> Result<(), SpecError> {
    if spec.faults.len() > MAX_FAULTS {
        let message = format!("{} faults; {MAX_FAULTS} at most", spec.faults.len());
        return Err(SpecError::about(source, "faults", message));
    }
    for (index, fault) in spec.faults.iter().enumerate() {
        check_fault(fault).map_err(|Problem(key, message, help)| {
            let message = format!("fault {index} ({}): {message}", fault.fault.name());
            about(source, index, key, message).with_help(help)
        })?;
    }
    Ok(())
}

/// An error at `key` of fault `index`, or at the sensor if the key is not found after it.
pub(super) fn about(source: &Source, index: usize, key: &str, message: String) -> SpecError {
    let mut sensors = 0;
    let mut place = None;
    for (line, text) in source.text.lines().enumerate() {
        let code = text.split("//").next().unwrap_or_default();
        for (column, word) in words(code) {
            sensors += usize::from(word == "sensor");
            let here = Position { line: line + 1, column: code[..column].chars().count() + 1 };
            if sensors == index + 1 && place.is_none() {
                place = Some(here);
            }
            if sensors == index + 1 && word == key {
                return SpecError::at(source, here, message);
            }
        }
    }
    match place {
        Some(here) => SpecError::at(source, here, message),
        None => SpecError::plain(source.name.clone(), message),
    }
}

/// The words of a line with their byte offsets.
fn words(line: &str) -> impl Iterator<Item = (usize, &str)> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let starts = line.char_indices().scan(false, move |inside, (at, c)| {
        let starts = is_word(c) && !*inside;
        *inside = is_word(c);
        Some(starts.then_some(at))
    });
    starts.flatten().map(move |at| (at, line[at..].split(|c| !is_word(c)).next().unwrap_or_default()))
}

fn check_fault(fault: &FaultSpec) -> Result<(), Problem> {
    check_times(fault)?;
    check_sensor(fault)?;
    check_interval(fault)?;
    check_values(fault)
}

fn check_times(fault: &FaultSpec) -> Result<(), Problem> {
    let times =
        [("from_s", fault.from_s), ("to_s", fault.to_s), ("every_s", fault.every_s), ("lasts_s", fault.lasts_s)];
    for (key, time) in times {
        let is_wrong = |s: &f64| !(0.0..=MAX_S).contains(s);
        if let Some(wrong) = time.filter(is_wrong) {
            return Err(Problem(key, format!("{key} is {wrong} s"), "a time from 0 to 1e6 s"));
        }
    }
    let from_s = fault.from_s.unwrap_or(0.0);
    if let Some(to_s) = fault.to_s.filter(|to_s| *to_s <= from_s) {
        let message = format!("the fault ends at {to_s} s, not after its start at {from_s} s");
        return Err(Problem("to_s", message, "make to_s larger than from_s"));
    }
    match (fault.every_s, fault.lasts_s) {
        (None, None) => Ok(()),
        (Some(every_s), Some(lasts_s)) if 1e-9 <= lasts_s && lasts_s < every_s => Ok(()),
        (Some(every_s), Some(lasts_s)) => {
            let message = format!("a fault that lasts {lasts_s} s every {every_s} s");
            Err(Problem("lasts_s", message, "make lasts_s larger than 0 and smaller than every_s"))
        }
        _ => Err(Problem("every_s", "one of every_s and lasts_s is missing".to_owned(), "give both or neither")),
    }
}

/// Checks that the fault applies to the sensor.
fn check_sensor(fault: &FaultSpec) -> Result<(), Problem> {
    let only = match fault.fault {
        FaultKind::Clip { .. } | FaultKind::Spike { .. } | FaultKind::BiasStep { .. } | FaultKind::Axes { .. } => {
            Some((FaultySensor::Imu, "use `sensor: imu`"))
        }
        FaultKind::ConstantRange { .. } | FaultKind::Misses { .. } => {
            Some((FaultySensor::Lidar, "use `sensor: lidar`"))
        }
        FaultKind::Extrinsics { .. } if fault.sensor == FaultySensor::Both => {
            Some((FaultySensor::Lidar, "use `sensor: lidar` or `sensor: imu`, one fault each"))
        }
        _ => None,
    };
    match only {
        Some((sensor, help)) if sensor != fault.sensor => {
            Err(Problem("sensor", "this fault does not apply to the sensor".to_owned(), help))
        }
        _ => Ok(()),
    }
}

/// Checks that the fault has an interval if it needs one, and none if it does not take one.
fn check_interval(fault: &FaultSpec) -> Result<(), Problem> {
    let is_limited = fault.from_s.is_some() || fault.to_s.is_some() || fault.every_s.is_some();
    let refuse = |help: &'static str| Err(Problem("sensor", "this fault does not take an interval".to_owned(), help));
    match fault.fault {
        FaultKind::Gap if !is_limited => {
            let message = "without an interval all measurements are lost".to_owned();
            Err(Problem("fault", message, "give from_s and to_s, or every_s and lasts_s"))
        }
        FaultKind::BiasStep { .. } | FaultKind::ClockJump { .. } if fault.from_s.is_none() => {
            Err(Problem("fault", "the time of the step is missing".to_owned(), "give from_s"))
        }
        FaultKind::ClockJump { .. } if fault.to_s.is_some() || fault.every_s.is_some() => {
            refuse("give from_s only; a clock that jumps back is a second fault with the opposite jump")
        }
        FaultKind::ClockOffset { .. } if is_limited => {
            refuse("remove the interval; an offset from a time on is a clock_jump")
        }
        FaultKind::Cut { .. } if is_limited => refuse("remove the interval; start_s and end_s are the interval"),
        FaultKind::Extrinsics { .. } if is_limited => {
            refuse("remove the interval; /tf_static applies to the whole recording")
        }
        _ => Ok(()),
    }
}

fn check_values(fault: &FaultSpec) -> Result<(), Problem> {
    match &fault.fault {
        FaultKind::Cut { start_s, end_s } => check_cut(*start_s, *end_s),
        FaultKind::Thin { arrivals_s, file, repeat_s } => check_thin(arrivals_s.as_deref(), file.is_some(), *repeat_s),
        FaultKind::Delay { mean_s } => check_at_most("mean_s", *mean_s, MAX_DELAY_S, "s, at most 2"),
        FaultKind::Burst { size, spacing_us } => {
            if !(2..=MAX_BURST).contains(size) {
                return Err(Problem("size", format!("groups of {size} messages"), "give 2 to 1000"));
            }
            check_at_most("spacing_us", *spacing_us, MAX_SPACING_US, "us, at most 1e6")
        }
        FaultKind::Clip { gyro_rad_per_s, gyro_deg_per_s, accel_m_per_s2 } => {
            let limits = [*gyro_rad_per_s, *gyro_deg_per_s, *accel_m_per_s2];
            check_imu_values(limits.map(|limit| limit.map(|x| [x; 3])))?;
            match limits.into_iter().flatten().find(|limit| *limit <= 0.0) {
                Some(limit) => Err(Problem("clip", format!("a limit of {limit}"), "give a limit above 0")),
                None => Ok(()),
            }
        }
        FaultKind::Spike { gyro_rad_per_s, gyro_deg_per_s, accel_m_per_s2, times_s, count } => {
            check_imu_values([*gyro_rad_per_s, *gyro_deg_per_s, *accel_m_per_s2])?;
            check_spikes(times_s.as_deref(), *count)
        }
        FaultKind::BiasStep { gyro_rad_per_s, gyro_deg_per_s, accel_m_per_s2 } => {
            check_imu_values([*gyro_rad_per_s, *gyro_deg_per_s, *accel_m_per_s2])
        }
        FaultKind::ClockJump { jump_s: s } | FaultKind::ClockOffset { offset_s: s } => {
            check_at_most("fault", s.abs(), MAX_CLOCK_S, "s, at most 1e8 either way")
        }
        FaultKind::Axes { gyro_scale, accel_scale, .. } => {
            let is_wrong = |scale: &&f64| !scale.is_finite() || **scale <= 0.0;
            match [gyro_scale, accel_scale].into_iter().flatten().find(is_wrong) {
                Some(scale) => Err(Problem("axes", format!("a factor of {scale}"), "factors are finite and above 0")),
                None => Ok(()),
            }
        }
        FaultKind::Extrinsics { position_m, roll_pitch_yaw_deg } => {
            match [position_m, roll_pitch_yaw_deg].into_iter().flatten().flatten().find(|x| !x.is_finite()) {
                Some(x) => Err(Problem("extrinsics", format!("{x} is not finite"), "give finite numbers")),
                None => Ok(()),
            }
        }
        _ => Ok(()),
    }
}

fn check_at_most(key: &'static str, value: f64, most: f64, unit: &'static str) -> Result<(), Problem> {
    if value <= most { Ok(()) } else { Err(Problem(key, format!("{value} is too large"), unit)) }
}

fn check_cut(start_s: Option<f64>, end_s: Option<f64>) -> Result<(), Problem> {
    let remedy = "give start_s, end_s, or both: from 0 to 1e6 s, end_s after start_s";
    let is_time = |s: Option<f64>| s.is_none_or(|s| (0.0..=MAX_S).contains(&s));
    let is_order = start_s.zip(end_s).is_none_or(|(start_s, end_s)| start_s < end_s);
    if !is_time(start_s) || !is_time(end_s) || !is_order || (start_s.is_none() && end_s.is_none()) {
        let text = |s: Option<f64>| s.map_or("none".to_owned(), |s| format!("{s} s"));
        return Err(Problem("cut", format!("start {}, end {}", text(start_s), text(end_s)), remedy));
    }
    Ok(())
}

fn check_thin(arrivals_s: Option<&[f64]>, has_file: bool, repeat_s: Option<f64>) -> Result<(), Problem> {
    let Some(arrivals_s) = arrivals_s else {
        if has_file {
            return Ok(());
        }
        return Err(Problem("thin", "no arrival times".to_owned(), "give arrivals_s or file"));
    };
    if has_file {
        return Err(Problem("file", "both arrivals_s and file".to_owned(), "give one of them"));
    }
    let is_time = |s: &f64| (0.0..=MAX_S).contains(s);
    let (Some(last_s), true) = (arrivals_s.last(), arrivals_s.is_sorted()) else {
        return Err(Problem("arrivals_s", "arrival times are not in order".to_owned(), "sort them; give at least one"));
    };
    if let Some(wrong) = arrivals_s.iter().find(|s| !is_time(s)) {
        return Err(Problem("arrivals_s", format!("an arrival at {wrong} s"), "times are from 0 to 1e6 s"));
    }
    match repeat_s.filter(|repeat_s| !(is_time(repeat_s) && repeat_s > last_s)) {
        Some(s) => {
            let message = format!("arrival times up to {last_s} s repeat every {s} s");
            Err(Problem("repeat_s", message, "make repeat_s larger than the last arrival time"))
        }
        None => Ok(()),
    }
}

/// Checks rates in rad/s and deg/s, and specific forces.
fn check_imu_values([rad, deg, accel]: [Option<[f64; 3]>; 3]) -> Result<(), Problem> {
    if rad.is_some() && deg.is_some() {
        return Err(Problem("gyro_deg_per_s", "the rate in two units".to_owned(), "give one of them"));
    }
    if rad.or(deg).or(accel).is_none() {
        let help = "give gyro_rad_per_s, gyro_deg_per_s or accel_m_per_s2";
        return Err(Problem("fault", "neither a rate nor a specific force".to_owned(), help));
    }
    match [rad, deg, accel].into_iter().flatten().flatten().find(|x| !x.is_finite()) {
        Some(x) => Err(Problem("fault", format!("{x} is not finite"), "give finite numbers")),
        None => Ok(()),
    }
}

fn check_spikes(times_s: Option<&[f64]>, count: Option<u32>) -> Result<(), Problem> {
    match (times_s, count) {
        (Some(times_s), None) => match times_s.iter().find(|s| !(0.0..=MAX_S).contains(*s)) {
            Some(s) => Err(Problem("times_s", format!("a bad sample at {s} s"), "times are from 0 to 1e6 s")),
            None => Ok(()),
        },
        (None, Some(count)) if count <= MAX_SPIKES => Ok(()),
        (None, Some(count)) => Err(Problem("count", format!("{count} bad samples"), "at most 1e6")),
        _ => Err(Problem("spike", "needs times_s or count, and not both".to_owned(), "give one of them")),
    }
}
