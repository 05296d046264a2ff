use super::faults::Injector;
use super::run::simulate_together;
use super::{EPOCH, Faults, Rig, STEP_S, Scenario, SimulationError, SimulationSummary, Sources, Specs, simulate};
use crate::dynamics::{CarrierSpec, HeadModel, HeadSimulation, HeadSpec};
use crate::geometry::{Route, Vector};
use crate::measurement::{Calibration, Sink};
use crate::motion::BaseMotion;
use crate::sensors::{Clocks, Cylinder, Imu, Lidar};
use crate::spec::{Source, SpecError};
use crate::truth::TruthSink;
use crate::world::World;

/// A scenario whose specs are found and checked, ready to run.
pub struct Simulation {
    scenario: Scenario,
    specs: Specs,
    world: World,
    head: HeadModel,
    carrier: Vec<Cylinder>,
    motion: Box<dyn BaseMotion>,
    lidar: Lidar,
    imu: Imu,
    base_imu: Option<Imu>,
    clocks: Clocks,
    faults: Option<Faults>,
}

impl Simulation {
    /// Finds the specs that `scenario` names, and builds all that they describe.
    ///
    /// # Errors
    /// When a spec is missing or wrong, alone or with the others.
    pub fn prepare(scenario: &Scenario) -> Result<Self, SimulationError> {
        let (specs, sources) = Specs::load(scenario)?;
        Self::build(scenario, specs, &sources)
    }

    /// Builds what `specs` describe, which need not be what `scenario` names: a sweep changes them in between.
    ///
    /// # Errors
    /// When they are wrong, alone or with each other.
    pub fn build(scenario: &Scenario, specs: Specs, sources: &Sources) -> Result<Self, SimulationError> {
        let world = World::build(&specs.scene, &sources.scene)?;
        let head = HeadModel::new(&specs.head, &sources.head)?;
        let carrier = carrier_of(&specs.head);
        let route = route(scenario, &world)?;
        let motion = specs.motion.build(&sources.motion, route, scenario.duration_s, scenario.seed)?;
        let lidar = Lidar::new(&specs.lidar, &sources.lidar)?;
        let imu = Imu::new(&specs.imu, &sources.imu)?;
        let base_imu = specs.base_imu.as_ref().zip(sources.base_imu.as_ref());
        let base_imu = base_imu.map(|(spec, source)| Imu::new(spec, source)).transpose()?;
        let clocks = Clocks::new(&specs.clock, &sources.clock, EPOCH)?;
        let faults = faults(&specs, sources, &lidar)?;
        let scenario = scenario.clone();
        Ok(Self { scenario, specs, world, head, carrier, motion, lidar, imu, base_imu, clocks, faults })
    }

    /// What was asked for.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The specs as used.
    pub fn specs(&self) -> &Specs {
        &self.specs
    }

    /// The world.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// The head.
    pub fn head(&self) -> &HeadModel {
        &self.head
    }

    /// What of its carrier the lidar may see, in the base's frame.
    pub fn carrier(&self) -> &[Cylinder] {
        &self.carrier
    }

    /// How the base moves.
    pub fn motion(&self) -> &dyn BaseMotion {
        self.motion.as_ref()
    }

    /// The lidar.
    pub fn lidar(&self) -> &Lidar {
        &self.lidar
    }

    /// The inertial measurement unit.
    pub fn imu(&self) -> &Imu {
        &self.imu
    }

    /// The inertial measurement unit on the base, where it has one.
    pub fn base_imu(&self) -> Option<&Imu> {
        self.base_imu.as_ref()
    }

    /// How the sensors sit in the head, and how well they measure, as it is published: with the errors that faults of
    /// the extrinsics make.
    pub fn calibration(&self) -> Calibration {
        let calibration = self.rig().calibration();
        match &self.faults {
            Some(faults) => faults.published(calibration),
            None => calibration,
        }
    }

    /// Runs it: `sink` takes what the sensors say and what really happened, `progress` hears the fraction that is done.
    ///
    /// Every run of one scenario gives the same bytes, with any number of threads.
    ///
    /// # Errors
    /// When the head's motion fails, or the sink refuses.
    pub fn run<S: Sink + TruthSink + ?Sized>(
        &self,
        sink: &mut S,
        progress: &mut dyn FnMut(f64),
    ) -> Result<SimulationSummary, SimulationError> {
        let mut motion = HeadSimulation::new(&self.head, self.motion.as_ref(), STEP_S)?;
        let rig = self.rig();
        let Some(faults) = &self.faults else { return simulate(&rig, &mut motion, sink, progress) };
        let mut injector = Injector::new(Some(faults), &rig, sink);
        let summary = simulate(&rig, &mut motion, &mut injector, progress)?;
        injector.finish().map_err(SimulationError::Sink)?;
        Ok(summary)
    }

    /// Runs simulations that [share their rays](Self::shares_rays_with), each into a sink of its own, which is given
    /// the same as from a run alone: physics and rays are done once.
    ///
    /// # Errors
    /// When they do not share them, the head's motion fails, or a sink refuses.
    pub fn run_together<S: Sink + TruthSink + ?Sized>(
        simulations: &[Self],
        sinks: &mut [&mut S],
        progress: &mut dyn FnMut(f64),
    ) -> Result<Vec<SimulationSummary>, SimulationError> {
        let Some(first) = simulations.first() else { return Ok(Vec::new()) };
        if !simulations.iter().all(|other| first.shares_rays_with(other)) {
            return Err(SimulationError::Apart);
        }
        let rigs: Vec<Rig> = simulations.iter().map(Self::rig).collect();
        let mut motion = HeadSimulation::new(&first.head, first.motion.as_ref(), STEP_S)?;
        if simulations.iter().all(|simulation| simulation.faults.is_none()) {
            return simulate_together(&rigs, &mut motion, sinks, progress);
        }
        let each = simulations.iter().zip(&rigs).zip(sinks.iter_mut());
        let mut injectors: Vec<_> =
            each.map(|((simulation, rig), sink)| Injector::new(simulation.faults.as_ref(), rig, &mut **sink)).collect();
        let mut sinks: Vec<_> = injectors.iter_mut().collect();
        let summaries = simulate_together(&rigs, &mut motion, &mut sinks, progress)?;
        injectors.into_iter().try_for_each(Injector::finish).map_err(SimulationError::Sink)?;
        Ok(summaries)
    }

    /// Whether physics and rays of `other` are the same: it differs in the IMUs, the lidar's errors and
    /// the faults at most.
    pub fn shares_rays_with(&self, other: &Self) -> bool {
        let without_noise = |simulation: &Self| {
            let mut specs = simulation.specs.clone();
            (specs.imu, specs.lidar.errors) = (self.specs.imu.clone(), self.specs.lidar.errors.clone());
            specs.lidar.noise = self.specs.lidar.noise;
            (specs.base_imu, specs.faults) = (self.specs.base_imu.clone(), self.specs.faults.clone());
            specs
        };
        let walk = |simulation: &Self| {
            (simulation.scenario.route.clone(), simulation.scenario.duration_s, simulation.scenario.seed)
        };
        walk(self) == walk(other) && self.specs == without_noise(other)
    }

    fn rig(&self) -> Rig<'_> {
        Rig {
            scenery: &self.world,
            carrier: &self.carrier,
            lidar: &self.lidar,
            imu: &self.imu,
            base_imu: self.base_imu.as_ref(),
            clocks: self.clocks,
            head_from_laser: *self.head.head_from_laser(),
            head_from_imu: *self.head.head_from_imu(),
            duration_s: self.scenario.duration_s,
            seed: self.scenario.seed,
        }
    }
}

/// The faults of a run, where it has any.
fn faults(specs: &Specs, sources: &Sources, lidar: &Lidar) -> Result<Option<Faults>, SpecError> {
    let Some(spec) = &specs.faults else { return Ok(None) };
    let unnamed = Source::in_memory("faults", "");
    let source = sources.faults.as_ref().unwrap_or(&unnamed);
    let faults = Faults::new(spec, source)?;
    faults.check_with(lidar, source)?;
    Ok(Some(faults))
}

/// What of a head's carrier the lidar may see, in the base's frame.
pub fn carrier_of(head: &HeadSpec) -> Vec<Cylinder> {
    let cylinder = |part: &CarrierSpec| Cylinder {
        foot_in_base: Vector::from(part.foot_in_base_m),
        radius_m: part.radius_m,
        height_m: part.height_m,
        reflectance: part.reflectance as f32,
    };
    head.carrier.iter().map(cylinder).collect()
}

/// The way that is asked for: the named one, or the scene's default, if it has any.
fn route<'w>(scenario: &Scenario, world: &'w World) -> Result<Option<&'w Route>, SpecError> {
    let Some(name) = &scenario.route else { return Ok(world.default_route()) };
    world.routes().get(name).map(Some).ok_or_else(|| {
        let names: Vec<&str> = world.routes().keys().map(String::as_str).collect();
        let help = if names.is_empty() { "it has none".to_owned() } else { format!("it has: {}", names.join(", ")) };
        SpecError::plain(&scenario.scene, format!("the scene has no route `{name}`")).with_help(help)
    })
}
