//! Axes of a sweep, resolved to settings of its specs.

use super::design::AxisSize;
use super::spec::LevelSpec;
use super::tree::{Assignment, Tree, load_named};
use super::{AxisSpec, BaseSpec, Sampling, Setting};
use crate::StudyError;
use serde_json::Value;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use zsim_base::spec::{Source, SpecError, name_from};

/// An axis whose settings are located in the specs.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    pub name: String,
    pub levels: Levels,
    /// Fraction of the samples at the first level; `None` if all levels have equal fractions.
    first_share: Option<f64>,
}

/// The values of an axis.
#[derive(Debug, Clone)]
pub(super) enum Levels {
    /// A list of levels.
    Discrete(Vec<Level>),
    /// A continuous range of one numeric setting.
    Range { path: Vec<String>, from: f64, to: f64, logarithmic: bool },
}

/// One level of an axis: its label and the inputs that it sets.
#[derive(Debug, Clone)]
pub(super) struct Level {
    pub setting: Setting,
    pub assignments: Vec<Assignment>,
}

/// The inputs of a sweep's base run, and the specs that axes refer to by name.
#[derive(Debug, Clone, Default)]
pub(super) struct SpecSet {
    pub base: Tree,
    /// By key and name.
    pub named: BTreeMap<String, Value>,
}

impl SpecSet {
    /// The spec that `source` calls `name`, for the key `key`; loaded once.
    fn load(&mut self, key: &str, name: &str, source: &Source) -> Result<Value, StudyError> {
        Ok(match self.named.entry(format!("{key}/{name}")) {
            Entry::Occupied(loaded) => loaded.get().clone(),
            Entry::Vacant(free) => free.insert(load_named(key, &name_from(source, name))?).clone(),
        })
    }

    /// Sets `path` to `setting`; names of specs are relative to the folder of `source`.
    fn assignment(&mut self, path: &str, setting: &Setting, source: &Source) -> Result<Assignment, String> {
        if let Setting::Text(name) = setting
            && self.base.is_named(path)
        {
            let value = self.load(path, name, source).map_err(|error| error.to_string())?;
            return Ok(Assignment { path: vec![path.to_owned()], value });
        }
        Ok(Assignment { path: self.base.locate(path)?, value: setting.value() })
    }
}

impl Axis {
    /// Locates the settings of `spec`; loads the specs that it names into `specs`.
    pub fn new(
        spec: &AxisSpec,
        base: &BaseSpec,
        sampling: Sampling,
        specs: &mut SpecSet,
        source: &Source,
    ) -> Result<Self, StudyError> {
        let about = |words: &str, message: String| -> StudyError {
            let message = format!("axis \"{}\": {message}", spec.name());
            SpecError::about_after(source, &spec.anchor(), words, message).into()
        };
        let levels = match spec {
            AxisSpec::Values { path, values, .. } => {
                if values.is_empty() {
                    return Err(about("values", "needs at least one value".to_owned()));
                }
                let level = |setting: &Setting| {
                    let assignment = specs.assignment(path, setting, source).map_err(|error| about(path, error))?;
                    Ok(Level { setting: setting.clone(), assignments: vec![assignment] })
                };
                Levels::Discrete(values.iter().map(level).collect::<Result<_, StudyError>>()?)
            }
            AxisSpec::Levels { levels, .. } => {
                if levels.is_empty() {
                    return Err(about("levels", "needs at least one level".to_owned()));
                }
                let level = |level: &LevelSpec| {
                    let about = |path: &str, error: String| -> StudyError {
                        let message = format!("axis \"{}\", level \"{}\": {error}", spec.name(), level.name);
                        let (anchor, words) = (format!("\"{}\"", level.name), format!("\"{path}\""));
                        SpecError::about_after(source, &anchor, &words, message).into()
                    };
                    let set = level.set.iter();
                    let assignments = set.map(|(path, setting)| {
                        specs.assignment(path, setting, source).map_err(|error| about(path, error))
                    });
                    let assignments = assignments.collect::<Result<_, _>>()?;
                    Ok(Level { setting: Setting::Text(level.name.clone()), assignments })
                };
                Levels::Discrete(levels.iter().map(level).collect::<Result<_, StudyError>>()?)
            }
            AxisSpec::Linear { path, from, to, steps, .. } | AxisSpec::Log { path, from, to, steps, .. } => {
                let located = specs.base.locate(path).map_err(|error| about(path, error))?;
                let logarithmic = matches!(spec, AxisSpec::Log { .. });
                let range = Levels::Range { path: located, from: *from, to: *to, logarithmic };
                match (sampling, steps) {
                    (Sampling::Grid, Some(steps)) if *steps >= 2 => range.stepped(*steps),
                    (Sampling::Grid, _) => {
                        return Err(about("from", "a grid needs `steps` of at least 2".to_owned()));
                    }
                    (_, None) => range,
                    (_, Some(_)) => return Err(about("steps", "`steps` applies only to a grid: remove it".to_owned())),
                }
            }
        };
        let first_share = first_share(spec, sampling).map_err(|error| about("first_share", error))?;
        let axis = Self { name: spec.name().to_owned(), levels, first_share };
        axis.check(base, &specs.base).map_err(|(value, error)| about(&value, error))?;
        Ok(axis)
    }

    pub fn size(&self) -> AxisSize {
        match &self.levels {
            Levels::Discrete(levels) => match self.first_share {
                Some(share) => AxisSize::Weighted(levels.len(), share),
                None => AxisSize::Levels(levels.len()),
            },
            Levels::Range { .. } => AxisSize::Range,
        }
    }

    /// Whether all values of the axis are numbers.
    pub fn is_number(&self) -> bool {
        match &self.levels {
            Levels::Discrete(levels) => levels.iter().all(|level| level.setting.number().is_some()),
            Levels::Range { .. } => true,
        }
    }

    /// The level at a position.
    pub fn level(&self, position: super::design::AxisPosition) -> Level {
        use super::design::AxisPosition::{Along, Level as At};
        match (&self.levels, position) {
            (Levels::Discrete(levels), At(index)) => levels[index].clone(),
            (Levels::Discrete(levels), Along(u)) => {
                levels[((u * levels.len() as f64) as usize).min(levels.len() - 1)].clone()
            }
            (range @ Levels::Range { .. }, Along(u)) => range.at(u),
            (range @ Levels::Range { .. }, At(_)) => range.at(0.0),
        }
    }

    /// Applies each level, or both ends of a range, to the base run.
    ///
    /// # Errors
    /// The offending value as written in the spec, and a message.
    fn check(&self, base: &BaseSpec, inputs: &Tree) -> Result<(), (String, String)> {
        let ends;
        let levels = match &self.levels {
            Levels::Discrete(levels) => levels,
            range @ Levels::Range { .. } => {
                ends = vec![range.at(0.0), range.at(1.0)];
                &ends
            }
        };
        for level in levels {
            let word = match &level.setting {
                Setting::Text(word) => format!("\"{word}\""),
                other => other.to_string(),
            };
            let changed = inputs.with(&level.assignments);
            changed.and_then(|changed| changed.check(base)).map_err(|error| (word, error))?;
        }
        Ok(())
    }
}

impl Levels {
    /// The level at `u` from 0 to 1 of a range.
    fn at(&self, u: f64) -> Level {
        let Self::Range { path, from, to, logarithmic } = self else {
            return Level { setting: Setting::Number(u), assignments: Vec::new() };
        };
        // Exact at both ends, without rounding.
        let value = match u {
            0.0 => *from,
            1.0 => *to,
            _ if *logarithmic => from * (to / from).powf(u),
            _ => from + (to - from) * u,
        };
        let assignment = Assignment { path: path.clone(), value: value.into() };
        Level { setting: Setting::Number(value), assignments: vec![assignment] }
    }

    /// A range as `steps` evenly spaced levels.
    fn stepped(&self, steps: usize) -> Self {
        Self::Discrete((0..steps).map(|k| self.at(k as f64 / (steps - 1) as f64)).collect())
    }
}

/// Fraction of the samples at the first value of an axis, checked.
fn first_share(spec: &AxisSpec, sampling: Sampling) -> Result<Option<f64>, String> {
    let AxisSpec::Values { values, first_share: Some(share), .. } = spec else { return Ok(None) };
    if sampling == Sampling::Grid {
        return Err("`first_share` does not apply to a grid: remove it, or use latin_hypercube or sobol".to_owned());
    }
    if values.len() < 2 || !(*share > 0.0 && *share < 1.0) {
        return Err(format!(
            "`first_share` is {share} for {} values: it must be between 0 and 1, and needs at least two values",
            values.len()
        ));
    }
    Ok(Some(*share))
}
