//! What must hold between the fields of a sweep's spec.

use super::design::MOST_SOBOL_AXES;
use super::{AxisSpec, BaseSpec, Measure, Sampling, SweepSpec};
use crate::spec::{Source, SpecError};

/// Most runs of a sweep.
pub(super) const MOST_POINTS: u64 = 10_000_000;

/// Checks what concerns several fields of a spec.
pub(super) fn check(spec: &SweepSpec, source: &Source) -> Result<(), SpecError> {
    let about = |key: &str, message: String| SpecError::about(source, key, message);
    let is_journey = matches!(spec.base, BaseSpec::Journey { .. });
    if spec.axes.is_empty() {
        return Err(about("axes", "a sweep varies something: it needs at least one axis".to_owned()));
    }
    if spec.measures.is_empty() {
        return Err(about("measures", "at least one of `measures` is needed".to_owned()));
    }
    if is_journey && spec.seeds.is_empty() {
        return Err(about("seeds", "at least one of `seeds` is needed".to_owned()));
    }
    if !is_journey && !spec.seeds.is_empty() {
        return Err(about("seeds", "a closed form has no chance in it: leave `seeds` out".to_owned()));
    }
    if let Some(twice) = again(&spec.seeds) {
        return Err(about("seeds", format!("`seeds` has {twice} more than once")));
    }
    if let Some(seed) = spec.seeds.iter().find(|seed| i64::try_from(**seed).is_err()) {
        return Err(about("seeds", format!("the seed {seed} does not fit into a table: {} at most", i64::MAX)));
    }
    if let Some(twice) = again(&spec.measures) {
        return Err(about("measures", format!("`measures` has {twice} more than once")));
    }
    if let Some(measure) = spec.measures.iter().find(|measure| !measure.is_of(&spec.base)) {
        let has: Vec<&str> =
            Measure::ALL.into_iter().filter(|measure| measure.is_of(&spec.base)).map(Measure::key).collect();
        let message = format!("a run of this base does not tell {}; it tells {}", measure.key(), has.join(", "));
        return Err(about(measure.key(), message));
    }
    if let Some(goal) = spec.front.iter().find(|goal| !spec.measures.contains(&goal.measure)) {
        return Err(about("front", format!("{} is not among the measures", goal.measure.key())));
    }
    if spec.front.len() == 1 {
        return Err(about("front", "one goal has a best run, no front: give two or more".to_owned()));
    }
    check_names(spec, source)?;
    let count = match spec.sampling {
        Sampling::Grid => return Ok(()),
        Sampling::Sobol { .. } if spec.axes.len() > MOST_SOBOL_AXES => {
            return Err(about("sobol", format!("{} axes; Sobol's sequence takes {MOST_SOBOL_AXES}", spec.axes.len())));
        }
        Sampling::LatinHypercube { count, .. } | Sampling::Sobol { count } => count,
    };
    if !(1..=MOST_POINTS as usize).contains(&count) {
        return Err(about("count", format!("{count} samples: from 1 to {MOST_POINTS}")));
    }
    Ok(())
}

/// Checks names: they are columns and cells of tables.
fn check_names(spec: &SweepSpec, source: &Source) -> Result<(), SpecError> {
    let names: Vec<&str> = spec.axes.iter().map(AxisSpec::name).collect();
    let taken: Vec<&str> = ["point", "seed", "error", "id"].into_iter().chain(Measure::ALL.map(Measure::key)).collect();
    for (k, axis) in spec.axes.iter().enumerate() {
        let about = |message: String| Err(SpecError::about(source, axis.anchor().trim_matches('"'), message));
        let name = axis.name();
        if names[..k].contains(&name) || taken.contains(&name) {
            return about(format!("the column \"{name}\" is there already: give this axis another `name`"));
        }
        if unfit(name) {
            return about(format!("\"{name}\" {UNFIT}"));
        }
        let AxisSpec::Levels { levels, .. } = axis else { continue };
        let words: Vec<&str> = levels.iter().map(|level| level.name.as_str()).collect();
        if let Some(word) = words.iter().find(|word| unfit(word)) {
            return about(format!("\"{word}\" {UNFIT}"));
        }
        if let Some(twice) = again(&words) {
            return about(format!("axis \"{name}\" has the level {twice} more than once"));
        }
    }
    match &spec.by {
        Some(by) if !names.contains(&by.as_str()) => {
            let message = format!("there is no axis \"{by}\"; there are {}", names.join(", "));
            Err(SpecError::about(source, "by", message))
        }
        _ => Ok(()),
    }
}

const UNFIT: &str = "cannot be a name in a table: leave out commas, quotes, bars and control characters";

fn unfit(name: &str) -> bool {
    name.is_empty() || name.contains(|c: char| c.is_control() || [',', '"', '|'].contains(&c))
}

/// What a list has twice.
fn again<T: PartialEq + std::fmt::Debug>(list: &[T]) -> Option<String> {
    let twice = list.iter().enumerate().find(|(k, x)| list[..*k].contains(x));
    twice.map(|(_, x)| format!("{x:?}"))
}
