//! A sweep with its specs loaded and checked: the list of runs and the specs of each.

use super::axis::{Axis, Level, SpecSet};
use super::check::{MAX_RUNS, check};
use super::design::{AxisSize, Design};
use super::identity::{ContentHash, InputHashes, input_hashes, is_after_recording};
use super::tree::Tree;
use super::{BaseSpec, JourneySpec, LimitSpec, Measure, Setting, SweepSpec};
use crate::StudyError;
use zsim_base::spec::{Kind, Named, NamedSpec, Source, SpecError, parse_named, to_json};
use zsim_dynamics::HeadSpec;
use zsim_run::RunInputs;
use zsim_simulation::Simulation;

/// A sweep with resolved specs; [`Plan::write`] stores it in a folder.
#[derive(Debug, Clone)]
pub struct Plan {
    name: String,
    spec: SweepSpec,
    specs: SpecSet,
    /// Hashes of the base run's inputs.
    hashes: InputHashes,
    axes: Vec<Axis>,
    design: Design,
}

/// A journey of a sweep with its hashes.
#[derive(Debug, Clone)]
pub(super) struct PlannedJourney {
    pub inputs: RunInputs,
    /// Hash of the recording: equal for runs with the same recording.
    pub recording: ContentHash,
    /// Hash of physics and rays: equal for runs with the same physics and rays.
    pub rays: ContentHash,
}

impl Plan {
    /// Loads and checks all specs that `spec`, read from `source`, refers to; `name` is the sweep's name in tables.
    ///
    /// # Errors
    /// If a spec is missing or invalid, with the position in `source`.
    pub fn new(name: &str, spec: &SweepSpec, source: &Source) -> Result<Self, StudyError> {
        let mut specs = SpecSet { base: Tree::load(&spec.base, source)?, ..SpecSet::default() };
        let plan = Self::with_specs(name, spec, &mut specs, source)?;
        if let BaseSpec::Journey(_) = spec.base {
            let journey = specs.base.journey(plan.spec.seeds[0]);
            Simulation::build(journey.map_err(|message| StudyError::Plan { what: "base", message })?.simulation)?;
        }
        Ok(plan)
    }

    /// The plan of runs with `heads`, which the axes of `spec`, read from `source`, refer to by name.
    ///
    /// # Errors
    /// If the spec, or one that its base run names, is missing or invalid.
    pub(crate) fn with_heads(
        name: &str,
        spec: &SweepSpec,
        heads: &[Named<HeadSpec>],
        source: &Source,
    ) -> Result<Self, StudyError> {
        let named = heads.iter().map(|head| Ok((format!("head/{}", head.name), to_json(head)?)));
        let named = named.collect::<Result<_, StudyError>>()?;
        Self::with_specs(name, spec, &mut SpecSet { base: Tree::load(&spec.base, source)?, named }, source)
    }

    /// Builds the plan from specs that are loaded already.
    pub(super) fn with_specs(
        name: &str,
        spec: &SweepSpec,
        specs: &mut SpecSet,
        source: &Source,
    ) -> Result<Self, StudyError> {
        check(spec, source)?;
        let name = spec.name.as_deref().unwrap_or(name);
        check_folder_name(spec.name.as_deref(), source)?;
        if name.chars().any(char::is_control) {
            let message = format!("the sweep's name {name:?} has control characters: rename its file");
            return Err(SpecError::plain(&source.name, message).into());
        }
        specs.base.check(&spec.base).map_err(|message| SpecError::about(source, "base", message))?;
        let axes = spec.axes.iter().map(|axis| Axis::new(axis, &spec.base, spec.sampling, specs, source));
        let axes: Vec<Axis> = axes.collect::<Result<_, _>>()?;
        let sizes: Vec<AxisSize> = axes.iter().map(Axis::size).collect();
        let about = |message: String| SpecError::about(source, "sampling", message);
        let design = Design::new(spec.sampling, sizes).filter(|design| design.count() <= MAX_RUNS);
        let design = design.ok_or_else(|| about(format!("more than {MAX_RUNS} runs: reduce levels or samples")))?;
        let hashes = input_hashes(&specs.base, None)?;
        let plan = Self { name: name.to_owned(), spec: spec.clone(), specs: specs.clone(), hashes, axes, design };
        if plan.runs() > MAX_RUNS {
            return Err(about(format!("{} runs with all seeds: expected at most {MAX_RUNS}", plan.runs())).into());
        }
        plan.check_claims(source)?;
        Ok(plan)
    }

    /// Name in tables.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The spec of the sweep.
    pub fn spec(&self) -> &SweepSpec {
        &self.spec
    }

    /// Number of runs.
    pub fn runs(&self) -> u64 {
        self.design.count() * self.seeds() as u64
    }

    fn seeds(&self) -> usize {
        self.spec.seeds.len().max(1)
    }

    pub(super) fn specs(&self) -> &SpecSet {
        &self.specs
    }

    pub(super) fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// The measures in the table of results: all but computing times.
    pub(super) fn result_measures(&self) -> Vec<Measure> {
        self.spec.measures.iter().copied().filter(|measure| !measure.is_time()).collect()
    }

    /// The measures in the table of computing times: that of the run first, then those of the study.
    pub(super) fn time_measures(&self) -> Vec<Measure> {
        let others = self.spec.measures.iter().copied().filter(|of| of.is_time() && *of != Measure::WALL_S);
        std::iter::once(Measure::WALL_S).chain(others).collect()
    }

    /// Time and memory limits of a run; `None` for closed forms.
    pub(super) fn limit(&self) -> Option<LimitSpec> {
        match self.spec.base {
            BaseSpec::Spring { .. } | BaseSpec::Gains { .. } => None,
            BaseSpec::Journey(JourneySpec { limit, .. }) => Some(limit),
        }
    }

    /// Position of run `index` on each axis.
    pub(super) fn positions(&self, index: u64) -> Vec<super::design::AxisPosition> {
        self.design.sample(index / self.seeds() as u64)
    }

    /// Value of each axis in run `index`.
    pub(super) fn settings(&self, index: u64) -> Vec<Setting> {
        self.levels(index).into_iter().map(|level| level.setting).collect()
    }

    /// The seed of run `index`.
    pub(super) fn seed(&self, index: u64) -> Option<u64> {
        self.spec.seeds.get((index % self.seeds() as u64) as usize).copied()
    }

    fn levels(&self, index: u64) -> Vec<Level> {
        self.axes.iter().zip(self.positions(index)).map(|(axis, position)| axis.level(position)).collect()
    }

    /// The inputs of run `index`, checked.
    ///
    /// # Errors
    /// If the combination of settings is invalid.
    pub(super) fn inputs(&self, index: u64) -> Result<Tree, StudyError> {
        let levels = self.levels(index);
        let inputs = self.specs.base.with(levels.iter().flat_map(|level| &level.assignments));
        let checked = inputs.and_then(|inputs| inputs.check(&self.spec.base).map(|()| inputs));
        checked.map_err(|message| {
            let named = self.axes.iter().zip(&levels).map(|(axis, level)| format!("{} {}", axis.name, level.setting));
            let named: Vec<String> = named.collect();
            StudyError::Plan { what: "run", message: format!("{}: {message}", named.join(", ")) }
        })
    }

    /// Hash of everything that determines the result of run `index`.
    pub(super) fn identity(&self, index: u64, inputs: &Tree) -> Result<ContentHash, StudyError> {
        let measures: Vec<&str> = self.result_measures().into_iter().map(Measure::key).collect();
        let hashes = self.hashes(inputs)?;
        Ok(self.hash(index, measures.join(" ").as_bytes(), hashes.iter().map(|(_, hash)| hash.full.bytes())))
    }

    /// The journey of run `index` with these inputs.
    ///
    /// # Errors
    /// If the combination of settings is invalid.
    pub(super) fn journey(&self, index: u64, inputs: &Tree) -> Result<PlannedJourney, StudyError> {
        let journey = inputs.journey(self.seed(index).unwrap_or_default());
        let journey = journey.map_err(|message| StudyError::Plan { what: "run", message })?;
        let hashes = self.hashes(inputs)?;
        let rays = journey.simulation.ray_inputs()?.to_string();
        let files = hashes.iter().map(|(_, hash)| hash.files.bytes());
        let recorded = hashes.iter().filter(|(key, _)| !is_after_recording(key)).map(|(_, hash)| hash.full.bytes());
        Ok(PlannedJourney {
            inputs: journey,
            recording: self.hash(index, b"simulation", recorded),
            rays: self.hash(index, b"rays", std::iter::once(rays.as_bytes()).chain(files)),
        })
    }

    fn hashes(&self, inputs: &Tree) -> Result<InputHashes, StudyError> {
        input_hashes(inputs, Some((&self.specs.base, &self.hashes)))
    }

    /// Hash of a kind of data of run `index`, of the version, the seed and `parts`.
    fn hash<'a>(&self, index: u64, kind: &[u8], parts: impl Iterator<Item = &'a [u8]>) -> ContentHash {
        let seed = self.seed(index).map(u64::to_le_bytes).unwrap_or_default();
        let mut all: Vec<&[u8]> = vec![env!("CARGO_PKG_VERSION").as_bytes(), &seed, kind];
        parts.for_each(|part| all.push(part));
        ContentHash::of(all)
    }
}

/// Checks the name that a study gives to its folder.
///
/// # Errors
/// If it is not the name of a folder.
pub(crate) fn check_folder_name(name: Option<&str>, source: &Source) -> Result<(), SpecError> {
    match name.filter(|name| !is_folder_name(name)) {
        None => Ok(()),
        Some(name) => {
            let message =
                format!("name {name:?} must be the name of a folder: letters, digits, spaces, -, _ and dots inside");
            Err(SpecError::about(source, "name", message))
        }
    }
}

/// Whether a folder for results can have this name on all systems.
fn is_folder_name(name: &str) -> bool {
    let is_usual = |c: char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_' | '.');
    let is_end = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    name.chars().all(is_usual) && is_end(name.chars().next()) && is_end(name.chars().next_back())
}

impl NamedSpec for SweepSpec {
    const KIND: Kind = Kind::Study;
    type Error = SpecError;

    fn parse(source: &Source) -> Result<Self, SpecError> {
        parse_named(source).map(Self::with_usual_values)
    }

    fn check_model(&self, source: &Source) -> Result<Vec<String>, SpecError> {
        match Plan::new("study", self, source) {
            Ok(_) => Ok(Vec::new()),
            Err(StudyError::Spec(error)) => Err(error),
            Err(error) => Err(SpecError::plain(&source.name, error.to_string())),
        }
    }
}
