//! Consistency checks of a sweep's spec.

use super::design::MAX_SOBOL_AXES;
use super::{AxisSpec, BaseSpec, Measure, Sampling, SweepSpec};
use zsim_base::spec::{Source, SpecError};

/// Maximum number of runs of a sweep: limits the plan's memory and the table of runs.
pub(super) const MAX_RUNS: u64 = 10_000_000;
/// Maximum number of axes, of values of an axis, and of seeds: each value is checked when the plan is made.
const MAX_AXES: usize = 1000;
const MAX_LEVELS: usize = 10_000;
const MAX_SEEDS: usize = 10_000;
/// Maximum number of coordinates of a sampled design, axes times samples: they are in memory.
const MAX_COORDINATES: usize = 100_000_000;

/// Checks the fields of a spec against each other.
pub(super) fn check(spec: &SweepSpec, source: &Source) -> Result<(), SpecError> {
    let about = |key: &str, message: String| SpecError::about(source, key, message);
    let is_journey = matches!(spec.base, BaseSpec::Journey(_));
    if spec.axes.is_empty() {
        return Err(about("axes", "a sweep needs at least one axis".to_owned()));
    }
    if spec.measures.is_empty() {
        return Err(about("measures", "`measures` is empty: at least one is needed".to_owned()));
    }
    if is_journey && spec.seeds.is_empty() {
        return Err(about("seeds", "`seeds` is empty: at least one is needed".to_owned()));
    }
    if !is_journey && !spec.seeds.is_empty() {
        return Err(about("seeds", "only journeys have seeds: remove `seeds`".to_owned()));
    }
    check_sizes(spec, source)?;
    if let Some(twice) = duplicate(&spec.seeds) {
        return Err(about("seeds", format!("`seeds` contains {twice} more than once")));
    }
    if let Some(seed) = spec.seeds.iter().find(|seed| i64::try_from(**seed).is_err()) {
        return Err(about("seeds", format!("seed {seed} is too large for the table: at most {}", i64::MAX)));
    }
    if let Some(twice) = duplicate(&spec.measures) {
        return Err(about("measures", format!("`measures` contains {twice} more than once")));
    }
    if let Some(measure) = spec.measures.iter().find(|measure| !measure.is_available_for(&spec.base)) {
        let has: Vec<&str> =
            Measure::all().filter(|measure| measure.is_available_for(&spec.base)).map(Measure::key).collect();
        let message = format!("the run in `base` does not measure {}; it measures {}", measure.key(), has.join(", "));
        return Err(about(measure.key(), message));
    }
    if let Some(goal) = spec.front.iter().find(|goal| !spec.measures.contains(&goal.measure)) {
        return Err(about("front", format!("{} is not in `measures`: add it", goal.measure.key())));
    }
    if let Some(limit) = spec.limits.iter().find(|limit| !spec.measures.contains(&limit.measure)) {
        return Err(about("limits", format!("{} is not in `measures`: add it", limit.measure.key())));
    }
    if spec.front.len() == 1 {
        return Err(about("front", "a Pareto front needs at least two goals".to_owned()));
    }
    check_table_names(spec, source)?;
    let count = match spec.sampling {
        Sampling::Grid => return Ok(()),
        Sampling::Sobol { .. } if spec.axes.len() > MAX_SOBOL_AXES => {
            return Err(about(
                "sobol",
                format!("{} axes: a Sobol design has at most {MAX_SOBOL_AXES}", spec.axes.len()),
            ));
        }
        Sampling::LatinHypercube { count, .. } | Sampling::Sobol { count } => count,
    };
    if !(1..=MAX_RUNS as usize).contains(&count) {
        return Err(about("count", format!("{count} samples: expected 1 to {MAX_RUNS}")));
    }
    if count > MAX_COORDINATES / spec.axes.len() {
        let (axes, most) = (spec.axes.len(), MAX_COORDINATES / spec.axes.len());
        return Err(about("count", format!("{count} samples of {axes} axes: expected at most {most} samples")));
    }
    Ok(())
}

/// Checks the numbers of axes, of their values and of seeds.
fn check_sizes(spec: &SweepSpec, source: &Source) -> Result<(), SpecError> {
    for (key, found, most) in [("axes", spec.axes.len(), MAX_AXES), ("seeds", spec.seeds.len(), MAX_SEEDS)] {
        if found > most {
            return Err(SpecError::about(source, key, format!("{found} {key}: expected at most {most}")));
        }
    }
    for axis in &spec.axes {
        let (key, found) = match axis {
            AxisSpec::Values { values, .. } => ("values", values.len()),
            AxisSpec::Levels { levels, .. } => ("levels", levels.len()),
            AxisSpec::Linear { steps, .. } | AxisSpec::Log { steps, .. } => ("steps", steps.unwrap_or_default()),
        };
        if found > MAX_LEVELS {
            let message = format!("axis \"{}\": {found} {key}: expected at most {MAX_LEVELS}", axis.name());
            return Err(SpecError::about_after(source, &axis.anchor(), key, message));
        }
    }
    Ok(())
}

/// Checks that names are valid as columns and cells of tables.
fn check_table_names(spec: &SweepSpec, source: &Source) -> Result<(), SpecError> {
    let names: Vec<&str> = spec.axes.iter().map(AxisSpec::name).collect();
    let reserved: Vec<&str> =
        ["point", "seed", "error", "id"].into_iter().chain(Measure::all().map(Measure::key)).collect();
    for (k, axis) in spec.axes.iter().enumerate() {
        let about = |message: String| Err(SpecError::about(source, axis.anchor().trim_matches('"'), message));
        let name = axis.name();
        if names[..k].contains(&name) || reserved.contains(&name) {
            return about(format!("the column \"{name}\" exists already: give this axis another `name`"));
        }
        if is_invalid_name(name) {
            return about(format!("\"{name}\" {INVALID_NAME}"));
        }
        let AxisSpec::Levels { levels, .. } = axis else { continue };
        let words: Vec<&str> = levels.iter().map(|level| level.name.as_str()).collect();
        if let Some(word) = words.iter().find(|word| is_invalid_name(word)) {
            return about(format!("\"{word}\" {INVALID_NAME}"));
        }
        if let Some(twice) = duplicate(&words) {
            return about(format!("axis \"{name}\" contains the level {twice} more than once"));
        }
    }
    match &spec.by {
        Some(by) if !names.contains(&by.as_str()) => {
            let message = format!("no axis is named \"{by}\"; the axes are {}", names.join(", "));
            Err(SpecError::about(source, "by", message))
        }
        _ => Ok(()),
    }
}

const INVALID_NAME: &str = "cannot be a name in a table: remove commas, quotes, bars and control characters";

fn is_invalid_name(name: &str) -> bool {
    name.is_empty() || name.contains(|c: char| c.is_control() || [',', '"', '|'].contains(&c))
}

/// The first element that occurs twice in a list.
fn duplicate<T: PartialEq + std::fmt::Debug>(list: &[T]) -> Option<String> {
    let twice = list.iter().enumerate().find(|(k, x)| list[..*k].contains(x));
    twice.map(|(_, x)| format!("{x:?}"))
}
