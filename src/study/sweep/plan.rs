//! A sweep whose specs are found and checked: which runs there are, and what each of them is.

use super::axis::{Axis, Change, Level, Shelf, composed};
use super::check::{MOST_POINTS, check};
use super::component::{Component, Kept, Nod, Slot, Walk};
use super::design::{Design, Extent};
use super::identity::{Identities, Identity};
use super::{BaseSpec, LimitSpec, Measure, Setting, SweepSpec};
use crate::random::Seed;
use crate::simulation::{Scenario, Simulation, Sources, Specs};
use crate::spec::{Source, SpecError};
use crate::study::StudyError;
use std::collections::BTreeMap;

/// A sweep, ready to be planned on disk.
#[derive(Debug, Clone)]
pub struct Plan {
    name: String,
    spec: SweepSpec,
    shelf: Shelf,
    identities: BTreeMap<Slot, Identities>,
    axes: Vec<Axis>,
    design: Design,
}

/// A run of a sweep.
#[derive(Debug, Clone)]
pub(super) struct Point {
    /// What differs from the base.
    pub changed: BTreeMap<Slot, Kept>,
    pub identity: Identity,
    /// Equal for runs that share their recording.
    pub simulation: Identity,
    /// Equal for runs that share physics and rays.
    pub rays: Identity,
}

impl Plan {
    /// Finds and checks all that `spec`, read from `source`, names; `name` is what tables call it.
    ///
    /// # Errors
    /// At the place in the spec that is wrong.
    pub fn new(name: &str, spec: &SweepSpec, source: &Source) -> Result<Self, StudyError> {
        let mut shelf = Shelf { base: base(&spec.base, name)?, ..Shelf::default() };
        let plan = Self::with(name, spec, &mut shelf, source)?;
        if let BaseSpec::Journey { .. } = spec.base {
            plan.simulation(&BTreeMap::new(), plan.spec.seeds[0])?;
        }
        Ok(plan)
    }

    /// The same with specs that were found before.
    pub(super) fn with(name: &str, spec: &SweepSpec, shelf: &mut Shelf, source: &Source) -> Result<Self, StudyError> {
        check(spec, source)?;
        if name.chars().any(char::is_control) {
            let message = format!("the sweep's name {name:?} has control characters: rename its file");
            return Err(SpecError::plain(&source.name, message).into());
        }
        let axes = spec.axes.iter().map(|axis| Axis::new(axis, spec.sampling, shelf, source));
        let axes: Vec<Axis> = axes.collect::<Result<_, _>>()?;
        let extents: Vec<Extent> = axes.iter().map(Axis::extent).collect();
        let about = |message: String| SpecError::about(source, "sampling", message);
        let design = Design::new(spec.sampling, extents).filter(|design| design.count() <= MOST_POINTS);
        let design = design.ok_or_else(|| about(format!("more than {MOST_POINTS} runs")))?;
        let of = |(slot, kept): (&Slot, &Kept)| Ok((*slot, Identities::of(*slot, kept)?));
        let identities = shelf.base.iter().map(of).collect::<Result<_, StudyError>>()?;
        let plan = Self { name: name.to_owned(), spec: spec.clone(), shelf: shelf.clone(), identities, axes, design };
        if plan.points() > MOST_POINTS {
            return Err(about(format!("{} runs with all seeds; {MOST_POINTS} at most", plan.points())).into());
        }
        Ok(plan)
    }

    /// What tables call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The spec as it was written.
    pub fn spec(&self) -> &SweepSpec {
        &self.spec
    }

    /// How many runs there are.
    pub fn points(&self) -> u64 {
        self.design.count() * self.seeds() as u64
    }

    fn seeds(&self) -> usize {
        self.spec.seeds.len().max(1)
    }

    pub(super) fn shelf(&self) -> &Shelf {
        &self.shelf
    }

    pub(super) fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// What is told of a run in the table of results.
    pub(super) fn told(&self) -> Vec<Measure> {
        self.spec.measures.iter().copied().filter(|measure| *measure != Measure::WallS).collect()
    }

    /// What a run may take, where that is limited.
    pub(super) fn limit(&self) -> Option<LimitSpec> {
        match self.spec.base {
            BaseSpec::Spring { .. } => None,
            BaseSpec::Journey { limit, .. } => Some(limit),
        }
    }

    /// Where run `index` is on each axis, as a level's number where the axis has levels.
    pub(super) fn places(&self, index: u64) -> Vec<super::design::Place> {
        self.design.sample(index / self.seeds() as u64)
    }

    /// What run `index` has on each axis.
    pub(super) fn settings(&self, index: u64) -> Vec<Setting> {
        self.levels(index).into_iter().map(|level| level.setting).collect()
    }

    /// The seed of run `index`.
    pub(super) fn seed(&self, index: u64) -> Option<u64> {
        self.spec.seeds.get((index % self.seeds() as u64) as usize).copied()
    }

    fn levels(&self, index: u64) -> Vec<Level> {
        self.axes.iter().zip(self.places(index)).map(|(axis, place)| axis.level(place)).collect()
    }

    /// What of the base is other in run `index`.
    ///
    /// # Errors
    /// When its settings do not go together.
    pub(super) fn changed(&self, index: u64) -> Result<BTreeMap<Slot, Kept>, StudyError> {
        let levels = self.levels(index);
        let changes: Vec<&Change> = levels.iter().flat_map(|level| &level.changes).collect();
        composed(&self.shelf, &changes).map_err(|message| {
            let named = self.axes.iter().zip(&levels).map(|(axis, level)| format!("{} {}", axis.name, level.setting));
            let named: Vec<String> = named.collect();
            StudyError::Plan { what: "a run", message: format!("with {}: {message}", named.join(", ")) }
        })
    }

    /// What run `index` is.
    ///
    /// # Errors
    /// When its settings do not go together.
    pub(super) fn point(&self, index: u64) -> Result<Point, StudyError> {
        let changed = self.changed(index)?;
        let mut identities = self.identities.clone();
        for (slot, kept) in &changed {
            identities.insert(*slot, Identities::of(*slot, kept)?);
        }
        let version = env!("CARGO_PKG_VERSION").as_bytes();
        let seed = self.seed(index).map(u64::to_le_bytes).unwrap_or_default();
        let measures: Vec<&str> = self.told().into_iter().map(Measure::key).collect();
        let measures = measures.join(" ");
        let of = |slots: &dyn Fn(Slot) -> bool, whole: bool, more: &[u8]| {
            let chosen = identities.iter().filter(|(slot, _)| slots(**slot));
            let parts = chosen.map(|(_, both)| if whole { both.whole.bytes() } else { both.without_noise.bytes() });
            Identity::of([version, &seed, more].into_iter().chain(parts))
        };
        Ok(Point {
            identity: of(&|_| true, true, measures.as_bytes()),
            simulation: of(&|slot| slot != Slot::Estimator, true, b"simulation"),
            rays: of(&|slot| !matches!(slot, Slot::Estimator | Slot::Imu | Slot::Faults), false, b"rays"),
            changed,
        })
    }

    /// What fills a slot of a run.
    pub(super) fn filled<'a>(&'a self, changed: &'a BTreeMap<Slot, Kept>, slot: Slot) -> Result<&'a Kept, StudyError> {
        let missing = || StudyError::Plan { what: "the plan", message: format!("this run has no {}", slot.key()) };
        changed.get(&slot).or_else(|| self.shelf.base.get(&slot)).ok_or_else(missing)
    }

    /// The simulation of a run.
    pub(super) fn simulation(&self, changed: &BTreeMap<Slot, Kept>, seed: u64) -> Result<Simulation, StudyError> {
        let kept = |slot| self.filled(changed, slot);
        let slots = [Slot::Scene, Slot::Head, Slot::Motion, Slot::Lidar, Slot::Imu, Slot::Clock];
        let [scene, head, motion, lidar, imu, clock] = slots.map(kept);
        let (scene, head, motion, lidar, imu, clock) = (scene?, head?, motion?, lidar?, imu?, clock?);
        let faults = kept(Slot::Faults).ok();
        let faults_spec = faults.and_then(|kept| match &kept.component {
            Component::Faults(spec) => Some((**spec).clone()),
            _ => None,
        });
        let components = (
            &kept(Slot::Run)?.component,
            (&scene.component, &head.component, &motion.component),
            (&lidar.component, &imu.component, &clock.component),
        );
        let (
            Component::Walk(Walk { route, duration_s }),
            (Component::Scene(scene_spec), Component::Head(head_spec), Component::Motion(motion_spec)),
            (Component::Lidar(lidar_spec), Component::Imu(imu_spec), Component::Clock(clock_spec)),
        ) = components
        else {
            let message = "a spec is not of its slot's kind".to_owned();
            return Err(StudyError::Plan { what: "the plan", message });
        };
        let scenario = Scenario {
            scene: scene.name.clone(),
            head: head.name.clone(),
            motion: motion.name.clone(),
            lidar: lidar.name.clone(),
            imu: imu.name.clone(),
            clock: clock.name.clone(),
            base_imu: None,
            faults: faults.map(|kept| kept.name.clone()),
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
            faults: faults.map(Kept::source),
        };
        Ok(Simulation::build(&scenario, specs, &sources)?)
    }
}

/// The specs of a base. The run itself is called by the plan's name, not by its file's path: `./a.ron` is `a.ron`.
fn base(spec: &BaseSpec, name: &str) -> Result<BTreeMap<Slot, Kept>, StudyError> {
    let (run, named) = match spec {
        BaseSpec::Spring { head, shake } => (Component::Nod(Nod { shake: *shake }), vec![(Slot::Head, head)]),
        BaseSpec::Journey { scene, head, motion, lidar, imu, clock, faults, estimator, route, duration_s, .. } => {
            let run = Component::Walk(Walk { route: route.clone(), duration_s: *duration_s });
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
    let run = Kept { name: name.to_owned(), folder: None, component: run };
    let named = named.into_iter().map(|(slot, name)| Ok((slot, Kept::load(slot, name)?)));
    std::iter::once(Ok((Slot::Run, run))).chain(named).collect()
}
