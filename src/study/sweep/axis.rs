//! Axes of a sweep, resolved to settings of its specs.

use super::component::{NamedComponent, Slot};
use super::design::AxisSize;
use super::spec::LevelSpec;
use super::{AxisSpec, Sampling, Setting, settings};
use crate::spec::{Source, SpecError};
use crate::study::StudyError;
use serde_json::Value;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

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
    Range { setting: SettingPath, from: f64, to: f64, logarithmic: bool },
}

/// One level of an axis: its label and the changes to the specs.
#[derive(Debug, Clone)]
pub(super) struct Level {
    pub setting: Setting,
    pub changes: Vec<Change>,
}

/// Location of a setting: the spec's slot and the keys within the spec.
#[derive(Debug, Clone)]
pub(super) struct SettingPath {
    pub slot: Slot,
    pub path: Vec<String>,
}

/// A change to the specs of the base run.
#[derive(Debug, Clone)]
pub(super) enum Change {
    /// Replace the spec of a slot by the named one.
    ReplaceSpec(Slot, String),
    /// Set one setting to a value.
    SetValue(SettingPath, Value),
}

/// All specs of a sweep: of the base run, and of axes that refer to specs by name.
#[derive(Debug, Clone, Default)]
pub(super) struct SpecSet {
    pub base: BTreeMap<Slot, NamedComponent>,
    pub others: BTreeMap<String, NamedComponent>,
}

impl SpecSet {
    /// Loads the spec `name` for `slot` unless it is loaded already.
    fn load(&mut self, slot: Slot, name: &str) -> Result<(), StudyError> {
        if let Entry::Vacant(free) = self.others.entry(Self::key(slot, name)) {
            free.insert(NamedComponent::load(slot, name)?);
        }
        Ok(())
    }

    fn key(slot: Slot, name: &str) -> String {
        format!("{}/{name}", slot.key())
    }

    pub fn named(&self, slot: Slot, name: &str) -> Option<&NamedComponent> {
        self.others.get(&Self::key(slot, name))
    }
}

impl Axis {
    /// Locates the settings of `spec`; loads the specs that it names into `specs`.
    pub fn new(spec: &AxisSpec, sampling: Sampling, specs: &mut SpecSet, source: &Source) -> Result<Self, StudyError> {
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
                    let changes = vec![change(path, setting, specs).map_err(|error| about(path, error))?];
                    Ok(Level { setting: setting.clone(), changes })
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
                    let changes = level
                        .set
                        .iter()
                        .map(|(path, setting)| change(path, setting, specs).map_err(|error| about(path, error)));
                    let changes = changes.collect::<Result<_, StudyError>>()?;
                    Ok(Level { setting: Setting::Text(level.name.clone()), changes })
                };
                Levels::Discrete(levels.iter().map(level).collect::<Result<_, StudyError>>()?)
            }
            AxisSpec::Linear { path, from, to, steps, .. } | AxisSpec::Log { path, from, to, steps, .. } => {
                let setting = locate(path, specs).map_err(|error| about(path, error))?;
                let logarithmic = matches!(spec, AxisSpec::Log { .. });
                let range = Levels::Range { setting, from: *from, to: *to, logarithmic };
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
        axis.check(specs).map_err(|(value, error)| about(&value, error))?;
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
    fn check(&self, specs: &SpecSet) -> Result<(), (String, String)> {
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
            apply_changes(specs, &level.changes.iter().collect::<Vec<_>>()).map_err(|error| (word, error))?;
        }
        Ok(())
    }
}

impl Levels {
    /// The level at `u` from 0 to 1 of a range.
    fn at(&self, u: f64) -> Level {
        let Self::Range { setting, from, to, logarithmic } = self else {
            return Level { setting: Setting::Number(u), changes: Vec::new() };
        };
        // Exact at both ends, without rounding.
        let value = match u {
            0.0 => *from,
            1.0 => *to,
            _ if *logarithmic => from * (to / from).powf(u),
            _ => from + (to - from) * u,
        };
        Level { setting: Setting::Number(value), changes: vec![Change::SetValue(setting.clone(), value.into())] }
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
            "`first_share` {share} of {} values: expected a number between 0 and 1, and at least two values",
            values.len()
        ));
    }
    Ok(Some(*share))
}

/// The change that sets `path` to `setting`.
fn change(path: &str, setting: &Setting, specs: &mut SpecSet) -> Result<Change, String> {
    if let (Some(slot), Setting::Text(name)) = (Slot::from_key(path), setting)
        && specs.base.contains_key(&slot)
    {
        specs.load(slot, name).map_err(|error| error.to_string())?;
        return Ok(Change::ReplaceSpec(slot, name.clone()));
    }
    Ok(Change::SetValue(locate(path, specs)?, setting.value()))
}

/// Locates the setting `path` in the base run's specs.
fn locate(path: &str, specs: &SpecSet) -> Result<SettingPath, String> {
    let mut keys: Vec<&str> = path.split('.').collect();
    let slot = Slot::from_key(keys[0]).filter(|slot| specs.base.contains_key(slot));
    if slot.is_some() {
        keys.remove(0);
    }
    let slot = slot.unwrap_or(Slot::Run);
    let Some(spec) = specs.base.get(&slot) else { return Err(format!("no setting `{path}`")) };
    if keys.is_empty() {
        return Err(format!(
            "`{path}` is a spec, not a setting: give names of specs as values, or extend the path to a setting"
        ));
    }
    let tree = spec.component.value().map_err(|error| error.to_string())?;
    let found = settings::find(&tree, &keys).map_err(|error| {
        let slots: Vec<&str> = specs.base.keys().filter(|slot| **slot != Slot::Run).map(|slot| slot.key()).collect();
        if slot == Slot::Run { format!("{error}, and the settings of {}", slots.join(", ")) } else { error }
    })?;
    Ok(SettingPath { slot, path: found })
}

/// Applies `changes` to the base run: replaces specs first, then sets values in them. Returns only the changed slots.
pub(super) fn apply_changes(specs: &SpecSet, changes: &[&Change]) -> Result<BTreeMap<Slot, NamedComponent>, String> {
    let mut changed: BTreeMap<Slot, NamedComponent> = BTreeMap::new();
    for change in changes {
        if let Change::ReplaceSpec(slot, name) = change {
            let spec = specs.named(*slot, name).ok_or_else(|| format!("the plan does not contain \"{name}\""))?;
            changed.insert(*slot, spec.clone());
        }
    }
    let mut trees: BTreeMap<Slot, Value> = BTreeMap::new();
    for change in changes {
        let Change::SetValue(SettingPath { slot, path }, value) = change else { continue };
        let spec = changed.get(slot).or_else(|| specs.base.get(slot));
        let spec = spec.ok_or_else(|| format!("this run has no {}", slot.key()))?;
        if !trees.contains_key(slot) {
            trees.insert(*slot, spec.component.value().map_err(|error| error.to_string())?);
        }
        let Some(tree) = trees.get_mut(slot) else { continue };
        let missing = || format!("\"{}\" has no setting `{}`", spec.name, path.join("."));
        settings::set(tree, path, value.clone()).ok_or_else(missing)?;
    }
    for (slot, tree) in trees {
        if let Some(spec) = changed.get(&slot).or_else(|| specs.base.get(&slot)) {
            let replaced = spec.with_value(tree)?;
            changed.insert(slot, replaced);
        }
    }
    Ok(changed)
}
