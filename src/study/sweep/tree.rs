//! The inputs of a run as one tree of settings: an axis of a sweep is a path into it.

use super::{BaseSpec, JourneySpec, ReferenceSpec, settings};
use crate::StudyError;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use zsim_base::random::Seed;
use zsim_base::spec::{self, Kind, Named, Source, SpecError, name_from, to_json};
use zsim_dynamics::{HeadSpec, LinkageSpec};
use zsim_head::gains::GainsSpec;
use zsim_head::spring::Shake;
use zsim_run::{ReferenceInputs, RunInputs, load_input};
use zsim_simulation::{Run, Scenario};

impl JourneySpec {
    /// Loads the specs, whose names are relative to `source`; the seed is 0.
    ///
    /// # Errors
    /// If a spec is missing or invalid.
    pub(super) fn load(&self, source: &Source) -> Result<RunInputs, StudyError> {
        let Self { scene, head, motion, lidar, imu, clock, base_imu, faults, route, duration_s, .. } = self.clone();
        let seed = Seed(0);
        let scenario = Scenario { scene, head, motion, lidar, imu, clock, base_imu, faults, route, duration_s, seed };
        let simulation = Run::load(&scenario.relative_to(source))?;
        let of_reference = |ReferenceSpec { head, motion, lidar }: &ReferenceSpec| {
            let (head, motion) = (name_from(source, head), name_from(source, motion));
            Ok::<_, StudyError>(ReferenceInputs {
                head: Named::load(&head)?,
                motion: Named::load(&motion)?,
                lidar: Named::load(&name_from(source, lidar))?,
            })
        };
        Ok(RunInputs {
            simulation,
            estimator: Named::load(&name_from(source, &self.estimator))?,
            timing: self.timing,
            reference: self.reference.as_ref().map(of_reference).transpose()?,
            ignore_manifest: self.ignore_manifest,
        })
    }
}

/// Inputs of a closed form.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct ClosedForm {
    pub shake: Shake,
    pub head: Named<HeadSpec>,
}

/// Inputs of a gain measurement.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct GainRun {
    pub gains: GainsSpec,
    pub head: Named<HeadSpec>,
}

/// The inputs of a run as JSON, without the seed: named specs, and settings without a name.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct Tree(pub Map<String, Value>);

/// Sets one input of a run: a named spec, or a setting.
#[derive(Debug, Clone)]
pub(super) struct Assignment {
    pub path: Vec<String>,
    pub value: Value,
}

/// Key of the seed, which the tree does not contain: it is the only input that no axis may vary.
const SEED: &str = "seed";

impl Tree {
    /// Loads the specs of the base run of a sweep, read from `source`.
    pub fn load(base: &BaseSpec, source: &Source) -> Result<Self, StudyError> {
        let named = |name: &String| name_from(source, name);
        match base {
            BaseSpec::Spring { head, shake } => {
                Self::of(&ClosedForm { shake: *shake, head: Named::load(&named(head))? })
            }
            BaseSpec::Gains { head, gains } => Self::of(&GainRun { gains: *gains, head: Named::load(&named(head))? }),
            BaseSpec::Journey(journey) => Self::of(&journey.load(source)?),
        }
    }

    /// The tree of the inputs of a run.
    pub fn of<T: Serialize>(inputs: &T) -> Result<Self, StudyError> {
        let Value::Object(mut inputs) = to_json(inputs)? else { return Ok(Self::default()) };
        inputs.retain(|key, _| key != SEED);
        Ok(Self(inputs))
    }

    /// Keys of the named specs.
    pub fn named_keys(&self) -> impl Iterator<Item = &str> {
        self.0.iter().filter(|(_, input)| input.get("spec").is_some()).map(|(key, _)| key.as_str())
    }

    /// Whether a key is that of a named spec.
    pub fn is_named(&self, key: &str) -> bool {
        self.named_keys().any(|named| named == key)
    }

    /// The settings without a name: duration and route, or the shake of the hand.
    pub fn unnamed(&self) -> Map<String, Value> {
        self.0.iter().filter(|(key, _)| !self.is_named(key)).map(|(key, value)| (key.clone(), value.clone())).collect()
    }

    /// Locates the setting `path`.
    ///
    /// # Errors
    /// A message if no setting or several settings match.
    pub fn locate(&self, path: &str) -> Result<Vec<String>, String> {
        let keys: Vec<&str> = path.split('.').collect();
        // `split` yields at least one part.
        if !self.is_named(keys[0]) {
            let named: Vec<&str> = self.named_keys().collect();
            return settings::find(&Value::Object(self.unnamed()), &keys)
                .map_err(|error| format!("{error}, and the settings of {}", named.join(", ")));
        }
        if keys.len() == 1 {
            return Err(format!(
                "`{path}` is a spec, not a setting: give names of specs as values, or extend the path to a setting"
            ));
        }
        let found = settings::find(&self.0[keys[0]]["spec"], &keys[1..])?;
        Ok([keys[0].to_owned(), "spec".to_owned()].into_iter().chain(found).collect())
    }

    /// The tree with changed inputs: named specs are replaced first, then settings are set in them.
    ///
    /// # Errors
    /// A message if a replaced spec does not have a setting.
    pub fn with<'a>(&self, assignments: impl IntoIterator<Item = &'a Assignment>) -> Result<Self, String> {
        let mut assignments: Vec<&Assignment> = assignments.into_iter().collect();
        assignments.sort_by_key(|assignment| assignment.path.len() > 1);
        let mut tree = Value::Object(self.0.clone());
        for Assignment { path, value } in assignments {
            if settings::set(&mut tree, path, value.clone()).is_none() {
                let setting = path.iter().skip(2).map(String::as_str).collect::<Vec<_>>().join(".");
                return Err(format!("{} has no setting `{setting}`", tree[path[0].as_str()]["name"]));
            }
        }
        Ok(if let Value::Object(inputs) = tree { Self(inputs) } else { Self::default() })
    }

    /// The inputs of a journey with this seed.
    ///
    /// # Errors
    /// A message if a value is invalid.
    pub fn journey(&self, seed: u64) -> Result<RunInputs, String> {
        let mut inputs = self.0.clone();
        inputs.insert(SEED.to_owned(), seed.into());
        let journey: RunInputs = read(inputs)?;
        journey.estimator.spec.check().map_err(|error| error.to_string())?;
        journey.timing.map_or(Ok(()), |timing| timing.check(journey.simulation.duration_s))?;
        Ok(journey)
    }

    /// The inputs of a closed form.
    ///
    /// # Errors
    /// A message if a value is invalid.
    pub fn closed_form(&self) -> Result<ClosedForm, String> {
        let inputs: ClosedForm = read(self.0.clone())?;
        inputs.shake.check()?;
        Ok(inputs)
    }

    /// The inputs of a gain measurement.
    ///
    /// # Errors
    /// A message if a value is invalid.
    pub fn gain_run(&self) -> Result<GainRun, String> {
        let inputs: GainRun = read(self.0.clone())?;
        if inputs.gains.realisations < 2 {
            return Err("`realisations` must be at least 2".to_owned());
        }
        match inputs.head.spec.linkage {
            LinkageSpec::Rigid { .. } | LinkageSpec::Actuated { .. } => {
                Err(format!("the head {} has no spring, so it has no gains", inputs.head.name))
            }
            LinkageSpec::Spring { .. } | LinkageSpec::Suspension { .. } => Ok(inputs),
        }
    }

    /// Checks that the values are valid for a base run.
    ///
    /// # Errors
    /// A message if a value is invalid.
    pub fn check(&self, base: &BaseSpec) -> Result<(), String> {
        match base {
            BaseSpec::Spring { .. } => self.closed_form().map(drop),
            BaseSpec::Gains { .. } => self.gain_run().map(drop),
            BaseSpec::Journey(_) => self.journey(0).map(drop),
        }
    }
}

fn read<T: DeserializeOwned>(inputs: Map<String, Value>) -> Result<T, String> {
    let tree = spec::Tree::from_json("the inputs of a run", &Value::Object(inputs));
    tree.to().map_err(|error| error.message().to_owned())
}

/// Loads the spec `name` for the key `key` of a tree.
///
/// # Errors
/// If the spec is missing or invalid.
pub(super) fn load_named(key: &str, name: &str) -> Result<Value, StudyError> {
    match Kind::of_input(key) {
        Some(kind) => Ok(load_input(kind, name)?),
        None => Err(SpecError::plain(name, format!("`{key}` is not set by the name of a spec")).into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::spec::names;

    fn base() -> Tree {
        let source = spec::find(Kind::Study, "integrity").unwrap();
        Tree::load(&spec::parse::<super::super::SweepSpec>(&source).unwrap().base, &source).unwrap()
    }

    #[test]
    fn every_shipped_spec_survives_the_tree_and_the_plan_file() {
        let tree = base();
        let kinds = [Kind::Scene, Kind::Head, Kind::Motion, Kind::Lidar, Kind::Imu, Kind::Clock, Kind::Faults];
        let keys = ["scene", "head", "motion", "lidar", "imu", "clock", "faults", "estimator"];
        for (kind, key) in kinds.into_iter().chain([Kind::Estimator]).zip(keys) {
            for name in names(kind) {
                let value = load_named(key, &name).unwrap();
                let changed = tree.with([&Assignment { path: vec![key.to_owned()], value }]).unwrap();
                let stored: Tree = spec::parse(&Source::in_memory("plan", spec::to_text(&changed).unwrap())).unwrap();
                assert_eq!(serde_json::to_string(&stored).unwrap(), serde_json::to_string(&changed).unwrap(), "{name}");
                let again = serde_json::to_value(changed.journey(0).unwrap()).unwrap();
                assert_eq!(again[key], changed.0[key], "{name}");
            }
        }
    }

    #[test]
    fn a_setting_is_set_in_the_spec_that_replaces_another() {
        let tree = base();
        let mass = Assignment { path: tree.locate("head.parts.0.mass_kg").unwrap(), value: 0.25.into() };
        let head = Assignment { path: vec!["head".to_owned()], value: load_named("head", "handheld_2").unwrap() };
        let changed = tree.with([&mass, &head]).unwrap();
        assert!(changed.0["head"]["spec"]["parts"][0].to_string().contains("\"mass_kg\":0.25"));
        let changed = changed.journey(3).unwrap();
        assert_eq!((changed.simulation.head.name.as_str(), changed.simulation.seed), ("handheld_2", Seed(3)));
        assert!(tree.locate("head").unwrap_err().contains("is a spec, not a setting"));
        assert!(tree.locate("seed").is_err());
    }
}
