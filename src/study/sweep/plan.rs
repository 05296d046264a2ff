//! A sweep with its specs loaded and checked: the list of runs and the specs of each.

use super::axis::{Axis, Change, Level, SpecSet, apply_changes};
use super::check::{MAX_RUNS, check};
use super::component::{Component, JourneySettings, NamedComponent, ShakeSettings, Slot};
use super::design::{AxisSize, Design};
use super::identity::{ComponentHashes, ContentHash};
use super::{BaseSpec, LimitSpec, Measure, Setting, SweepSpec};
use crate::random::Seed;
use crate::simulation::{Scenario, Simulation, Sources, Specs};
use crate::spec::{Source, SpecError};
use crate::study::StudyError;
use std::collections::BTreeMap;

/// A sweep with resolved specs; [`Plan::write`] stores it in a folder.
#[derive(Debug, Clone)]
pub struct Plan {
    name: String,
    spec: SweepSpec,
    specs: SpecSet,
    identities: BTreeMap<Slot, ComponentHashes>,
    axes: Vec<Axis>,
    design: Design,
}

/// A run of a sweep with its specs and hashes.
#[derive(Debug, Clone)]
pub(super) struct ResolvedRun {
    /// Specs that differ from the base run.
    pub changed: BTreeMap<Slot, NamedComponent>,
    /// Hash of everything that determines the run's result.
    pub identity: ContentHash,
    /// Hash of the recording: equal for runs with the same recording.
    pub simulation: ContentHash,
    /// Hash of physics and rays: equal for runs with the same physics and rays.
    pub rays: ContentHash,
}

impl Plan {
    /// Loads and checks all specs that `spec`, read from `source`, refers to; `name` is the sweep's name in tables.
    ///
    /// # Errors
    /// If a spec is missing or invalid, with the position in `source`.
    pub fn new(name: &str, spec: &SweepSpec, source: &Source) -> Result<Self, StudyError> {
        let mut specs = SpecSet { base: load_base(&spec.base, name)?, ..SpecSet::default() };
        let plan = Self::with_specs(name, spec, &mut specs, source)?;
        if let BaseSpec::Journey { .. } = spec.base {
            plan.simulation(&BTreeMap::new(), plan.spec.seeds[0])?;
        }
        Ok(plan)
    }

    /// Builds the plan from specs that are loaded already.
    pub(super) fn with_specs(
        name: &str,
        spec: &SweepSpec,
        specs: &mut SpecSet,
        source: &Source,
    ) -> Result<Self, StudyError> {
        check(spec, source)?;
        if name.chars().any(char::is_control) {
            let message = format!("the sweep's name {name:?} has control characters: rename its file");
            return Err(SpecError::plain(&source.name, message).into());
        }
        let axes = spec.axes.iter().map(|axis| Axis::new(axis, spec.sampling, specs, source));
        let axes: Vec<Axis> = axes.collect::<Result<_, _>>()?;
        let sizes: Vec<AxisSize> = axes.iter().map(Axis::size).collect();
        let about = |message: String| SpecError::about(source, "sampling", message);
        let design = Design::new(spec.sampling, sizes).filter(|design| design.count() <= MAX_RUNS);
        let design = design.ok_or_else(|| about(format!("more than {MAX_RUNS} runs: reduce levels or samples")))?;
        let of = |(slot, component): (&Slot, &NamedComponent)| Ok((*slot, ComponentHashes::of(*slot, component)?));
        let identities = specs.base.iter().map(of).collect::<Result<_, StudyError>>()?;
        let plan = Self { name: name.to_owned(), spec: spec.clone(), specs: specs.clone(), identities, axes, design };
        if plan.points() > MAX_RUNS {
            return Err(about(format!("{} runs with all seeds: expected at most {MAX_RUNS}", plan.points())).into());
        }
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
    pub fn points(&self) -> u64 {
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

    /// The measures in the table of results: all but the computing time.
    pub(super) fn result_measures(&self) -> Vec<Measure> {
        self.spec.measures.iter().copied().filter(|measure| *measure != Measure::WallS).collect()
    }

    /// Time and memory limits of a run; `None` for closed forms.
    pub(super) fn limit(&self) -> Option<LimitSpec> {
        match self.spec.base {
            BaseSpec::Spring { .. } => None,
            BaseSpec::Journey { limit, .. } => Some(limit),
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

    /// Specs of run `index` that differ from the base run.
    ///
    /// # Errors
    /// If the combination of settings is invalid.
    pub(super) fn changed_specs(&self, index: u64) -> Result<BTreeMap<Slot, NamedComponent>, StudyError> {
        let levels = self.levels(index);
        let changes: Vec<&Change> = levels.iter().flat_map(|level| &level.changes).collect();
        apply_changes(&self.specs, &changes).map_err(|message| {
            let named = self.axes.iter().zip(&levels).map(|(axis, level)| format!("{} {}", axis.name, level.setting));
            let named: Vec<String> = named.collect();
            StudyError::Plan { what: "run", message: format!("{}: {message}", named.join(", ")) }
        })
    }

    /// Resolves run `index`.
    ///
    /// # Errors
    /// If the combination of settings is invalid.
    pub(super) fn resolve(&self, index: u64) -> Result<ResolvedRun, StudyError> {
        let changed = self.changed_specs(index)?;
        let mut identities = self.identities.clone();
        for (slot, component) in &changed {
            identities.insert(*slot, ComponentHashes::of(*slot, component)?);
        }
        let version = env!("CARGO_PKG_VERSION").as_bytes();
        let seed = self.seed(index).map(u64::to_le_bytes).unwrap_or_default();
        let measures: Vec<&str> = self.result_measures().into_iter().map(Measure::key).collect();
        let measures = measures.join(" ");
        let of = |slots: &dyn Fn(Slot) -> bool, full: bool, more: &[u8]| {
            let chosen = identities.iter().filter(|(slot, _)| slots(**slot));
            let parts = chosen.map(|(_, hashes)| if full { hashes.full.bytes() } else { hashes.without_noise.bytes() });
            ContentHash::of([version, &seed, more].into_iter().chain(parts))
        };
        Ok(ResolvedRun {
            identity: of(&|_| true, true, measures.as_bytes()),
            simulation: of(&|slot| slot != Slot::Estimator, true, b"simulation"),
            rays: of(&|slot| !matches!(slot, Slot::Estimator | Slot::Imu | Slot::Faults), false, b"rays"),
            changed,
        })
    }

    /// The component in a slot of a run.
    pub(super) fn component<'a>(
        &'a self,
        changed: &'a BTreeMap<Slot, NamedComponent>,
        slot: Slot,
    ) -> Result<&'a NamedComponent, StudyError> {
        let missing = || StudyError::Plan { what: "plan", message: format!("this run has no {}", slot.key()) };
        changed.get(&slot).or_else(|| self.specs.base.get(&slot)).ok_or_else(missing)
    }

    /// Builds the simulation of a run.
    pub(super) fn simulation(
        &self,
        changed: &BTreeMap<Slot, NamedComponent>,
        seed: u64,
    ) -> Result<Simulation, StudyError> {
        let component = |slot| self.component(changed, slot);
        let slots = [Slot::Scene, Slot::Head, Slot::Motion, Slot::Lidar, Slot::Imu, Slot::Clock];
        let [scene, head, motion, lidar, imu, clock] = slots.map(component);
        let (scene, head, motion, lidar, imu, clock) = (scene?, head?, motion?, lidar?, imu?, clock?);
        let faults = component(Slot::Faults).ok();
        let faults_spec = faults.and_then(|component| match &component.component {
            Component::Faults(spec) => Some((**spec).clone()),
            _ => None,
        });
        let components = (
            &component(Slot::Run)?.component,
            (&scene.component, &head.component, &motion.component),
            (&lidar.component, &imu.component, &clock.component),
        );
        let (
            Component::Journey(JourneySettings { route, duration_s }),
            (Component::Scene(scene_spec), Component::Head(head_spec), Component::Motion(motion_spec)),
            (Component::Lidar(lidar_spec), Component::Imu(imu_spec), Component::Clock(clock_spec)),
        ) = components
        else {
            let message = "unexpected kind of spec in a slot".to_owned();
            return Err(StudyError::Plan { what: "plan", message });
        };
        let scenario = Scenario {
            scene: scene.name.clone(),
            head: head.name.clone(),
            motion: motion.name.clone(),
            lidar: lidar.name.clone(),
            imu: imu.name.clone(),
            clock: clock.name.clone(),
            base_imu: None,
            faults: faults.map(|component| component.name.clone()),
            route: route.clone(),
            duration_s: *duration_s,
            seed: Seed(seed),
        };
        let specs = Specs {
            scene: (**scene_spec).clone(),
            head: (**head_spec).clone(),
            motion: (**motion_spec).clone(),
            lidar: (**lidar_spec).clone(),
            imu: (**imu_spec).clone(),
            clock: (**clock_spec).clone(),
            base_imu: None,
            faults: faults_spec,
        };
        let sources = Sources {
            scene: scene.source(),
            head: head.source(),
            motion: motion.source(),
            lidar: lidar.source(),
            imu: imu.source(),
            clock: clock.source(),
            base_imu: None,
            faults: faults.map(NamedComponent::source),
        };
        Ok(Simulation::build(&scenario, specs, &sources)?)
    }
}

/// Loads the specs of a base run. The run has the plan's name, not its path, so that `./a.ron` and `a.ron` are equal.
fn load_base(spec: &BaseSpec, name: &str) -> Result<BTreeMap<Slot, NamedComponent>, StudyError> {
    let (run, named) = match spec {
        BaseSpec::Spring { head, shake } => {
            (Component::Shake(ShakeSettings { shake: *shake }), vec![(Slot::Head, head)])
        }
        BaseSpec::Journey { scene, head, motion, lidar, imu, clock, faults, estimator, route, duration_s, .. } => {
            let run = Component::Journey(JourneySettings { route: route.clone(), duration_s: *duration_s });
            let mut named = vec![
                (Slot::Scene, scene),
                (Slot::Head, head),
                (Slot::Motion, motion),
                (Slot::Lidar, lidar),
                (Slot::Imu, imu),
                (Slot::Clock, clock),
                (Slot::Estimator, estimator),
            ];
            named.extend(faults.as_ref().map(|name| (Slot::Faults, name)));
            (run, named)
        }
    };
    let run = NamedComponent { name: name.to_owned(), folder: None, component: run };
    let named = named.into_iter().map(|(slot, name)| Ok((slot, NamedComponent::load(slot, name)?)));
    std::iter::once(Ok((Slot::Run, run))).chain(named).collect()
}
