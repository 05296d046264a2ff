//! Axes with their settings found.

use super::component::{Kept, Slot};
use super::design::Extent;
use super::spec::LevelSpec;
use super::{AxisSpec, Sampling, Setting, settings};
use crate::spec::{Source, SpecError};
use crate::study::StudyError;
use serde_json::Value;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

/// What is varied, ready to be applied.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    pub name: String,
    pub levels: Levels,
    /// Share of the samples at the first level, where it differs from that of the others.
    first_share: Option<f64>,
}

/// Where a run can be on an axis.
#[derive(Debug, Clone)]
pub(super) enum Levels {
    /// At one of these.
    Some(Vec<Level>),
    /// Anywhere between two ends of one setting.
    Range { setting: Place, from: f64, to: f64, logarithmic: bool },
}

/// A place on an axis.
#[derive(Debug, Clone)]
pub(super) struct Level {
    pub setting: Setting,
    pub changes: Vec<Change>,
}

/// A setting, found: where it is.
#[derive(Debug, Clone)]
pub(super) struct Place {
    pub slot: Slot,
    pub path: Vec<String>,
}

/// What becomes of a run at a level.
#[derive(Debug, Clone)]
pub(super) enum Change {
    /// Another spec, by name.
    Whole(Slot, String),
    /// Another value of a setting.
    Set(Place, Value),
}

/// The specs of a sweep: those of its base, and those that an axis names.
#[derive(Debug, Clone, Default)]
pub(super) struct Shelf {
    pub base: BTreeMap<Slot, Kept>,
    pub others: BTreeMap<String, Kept>,
}

impl Shelf {
    /// The spec `name` of `slot`, loaded when it is not there yet.
    fn load(&mut self, slot: Slot, name: &str) -> Result<(), StudyError> {
        if let Entry::Vacant(free) = self.others.entry(Self::key(slot, name)) {
            free.insert(Kept::load(slot, name)?);
        }
        Ok(())
    }

    fn key(slot: Slot, name: &str) -> String {
        format!("{}/{name}", slot.key())
    }

    pub fn named(&self, slot: Slot, name: &str) -> Option<&Kept> {
        self.others.get(&Self::key(slot, name))
    }
}

impl Axis {
    /// Finds the settings of `spec`; specs that it names go to `shelf`.
    pub fn new(spec: &AxisSpec, sampling: Sampling, shelf: &mut Shelf, source: &Source) -> Result<Self, StudyError> {
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
                    let changes = vec![change(path, setting, shelf).map_err(|error| about(path, error))?];
                    Ok(Level { setting: setting.clone(), changes })
                };
                Levels::Some(values.iter().map(level).collect::<Result<_, StudyError>>()?)
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
                        .map(|(path, setting)| change(path, setting, shelf).map_err(|error| about(path, error)));
                    let changes = changes.collect::<Result<_, StudyError>>()?;
                    Ok(Level { setting: Setting::Word(level.name.clone()), changes })
                };
                Levels::Some(levels.iter().map(level).collect::<Result<_, StudyError>>()?)
            }
            AxisSpec::Linear { path, from, to, steps, .. } | AxisSpec::Log { path, from, to, steps, .. } => {
                let setting = place(path, shelf).map_err(|error| about(path, error))?;
                let logarithmic = matches!(spec, AxisSpec::Log { .. });
                let range = Levels::Range { setting, from: *from, to: *to, logarithmic };
                match (sampling, steps) {
                    (Sampling::Grid, Some(steps)) if *steps >= 2 => range.stepped(*steps),
                    (Sampling::Grid, _) => {
                        return Err(about("from", "needs `steps` of 2 or more in a grid".to_owned()));
                    }
                    (_, None) => range,
                    (_, Some(_)) => return Err(about("steps", "has `steps`, which only a grid takes".to_owned())),
                }
            }
        };
        let first_share = first_share(spec, sampling).map_err(|error| about("first_share", error))?;
        let axis = Self { name: spec.name().to_owned(), levels, first_share };
        axis.check(shelf).map_err(|(value, error)| about(&value, error))?;
        Ok(axis)
    }

    pub fn extent(&self) -> Extent {
        match &self.levels {
            Levels::Some(levels) => match self.first_share {
                Some(share) => Extent::Weighted(levels.len(), share),
                None => Extent::Levels(levels.len()),
            },
            Levels::Range { .. } => Extent::Range,
        }
    }

    /// Whether all places on it are numbers.
    pub fn is_number(&self) -> bool {
        match &self.levels {
            Levels::Some(levels) => levels.iter().all(|level| level.setting.number().is_some()),
            Levels::Range { .. } => true,
        }
    }

    /// What is at a place.
    pub fn level(&self, place: super::design::Place) -> Level {
        use super::design::Place::{Along, Level as At};
        match (&self.levels, place) {
            (Levels::Some(levels), At(index)) => levels[index].clone(),
            (Levels::Some(levels), Along(u)) => {
                levels[((u * levels.len() as f64) as usize).min(levels.len() - 1)].clone()
            }
            (range @ Levels::Range { .. }, Along(u)) => range.at(u),
            (range @ Levels::Range { .. }, At(_)) => range.at(0.0),
        }
    }

    /// Applies each level, or the ends of a range, to the base. With an error the value that it is about, as it is
    /// written.
    fn check(&self, shelf: &Shelf) -> Result<(), (String, String)> {
        let ends;
        let levels = match &self.levels {
            Levels::Some(levels) => levels,
            range @ Levels::Range { .. } => {
                ends = vec![range.at(0.0), range.at(1.0)];
                &ends
            }
        };
        for level in levels {
            let word = match &level.setting {
                Setting::Word(word) => format!("\"{word}\""),
                other => other.to_string(),
            };
            composed(shelf, &level.changes.iter().collect::<Vec<_>>()).map_err(|error| (word, error))?;
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
        // The ends are met to the bit.
        let value = match u {
            0.0 => *from,
            1.0 => *to,
            _ if *logarithmic => from * (to / from).powf(u),
            _ => from + (to - from) * u,
        };
        Level { setting: Setting::Number(value), changes: vec![Change::Set(setting.clone(), value.into())] }
    }

    fn stepped(&self, steps: usize) -> Self {
        Self::Some((0..steps).map(|k| self.at(k as f64 / (steps - 1) as f64)).collect())
    }
}

/// The share of the first value of an axis, checked.
fn first_share(spec: &AxisSpec, sampling: Sampling) -> Result<Option<f64>, String> {
    let AxisSpec::Values { values, first_share: Some(share), .. } = spec else { return Ok(None) };
    if sampling == Sampling::Grid {
        return Err("has `first_share`, which a grid does not take: use latin_hypercube or sobol".to_owned());
    }
    if values.len() < 2 || !(*share > 0.0 && *share < 1.0) {
        return Err(format!(
            "the first of {} values has a share of {share}: between 0 and 1, of two or more",
            values.len()
        ));
    }
    Ok(Some(*share))
}

/// What setting `path` to `setting` means.
fn change(path: &str, setting: &Setting, shelf: &mut Shelf) -> Result<Change, String> {
    if let (Some(slot), Setting::Word(name)) = (Slot::of_key(path), setting)
        && shelf.base.contains_key(&slot)
    {
        shelf.load(slot, name).map_err(|error| error.to_string())?;
        return Ok(Change::Whole(slot, name.clone()));
    }
    Ok(Change::Set(place(path, shelf)?, setting.value()))
}

/// Where the setting `path` is in the base.
fn place(path: &str, shelf: &Shelf) -> Result<Place, String> {
    let mut keys: Vec<&str> = path.split('.').collect();
    let slot = Slot::of_key(keys[0]).filter(|slot| shelf.base.contains_key(slot));
    if slot.is_some() {
        keys.remove(0);
    }
    let slot = slot.unwrap_or(Slot::Run);
    let Some(kept) = shelf.base.get(&slot) else { return Err(format!("there is no setting `{path}`")) };
    if keys.is_empty() {
        return Err(format!("`{path}` is a whole spec: give it names of specs, or go on to one of its settings"));
    }
    let tree = kept.component.value().map_err(|error| error.to_string())?;
    let found = settings::find(&tree, &keys).map_err(|error| {
        let slots: Vec<&str> = shelf.base.keys().filter(|slot| **slot != Slot::Run).map(|slot| slot.key()).collect();
        if slot == Slot::Run { format!("{error}, and those below {}", slots.join(", ")) } else { error }
    })?;
    Ok(Place { slot, path: found })
}

/// The base with `changes`: specs first, then settings within them. Slots that nothing changes are left out.
pub(super) fn composed(shelf: &Shelf, changes: &[&Change]) -> Result<BTreeMap<Slot, Kept>, String> {
    let mut changed: BTreeMap<Slot, Kept> = BTreeMap::new();
    for change in changes {
        if let Change::Whole(slot, name) = change {
            let kept = shelf.named(*slot, name).ok_or_else(|| format!("the plan does not hold \"{name}\""))?;
            changed.insert(*slot, kept.clone());
        }
    }
    let mut trees: BTreeMap<Slot, Value> = BTreeMap::new();
    for change in changes {
        let Change::Set(Place { slot, path }, value) = change else { continue };
        let kept = changed.get(slot).or_else(|| shelf.base.get(slot));
        let kept = kept.ok_or_else(|| format!("this run has no {}", slot.key()))?;
        if !trees.contains_key(slot) {
            trees.insert(*slot, kept.component.value().map_err(|error| error.to_string())?);
        }
        let Some(tree) = trees.get_mut(slot) else { continue };
        let missing = || format!("\"{}\" has no setting `{}`", kept.name, path.join("."));
        settings::set(tree, path, value.clone()).ok_or_else(missing)?;
    }
    for (slot, tree) in trees {
        if let Some(kept) = changed.get(&slot).or_else(|| shelf.base.get(&slot)) {
            let with = kept.with(tree)?;
            changed.insert(slot, with);
        }
    }
    Ok(changed)
}
