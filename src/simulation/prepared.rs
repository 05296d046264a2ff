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

/// A scenario with all models built, ready to run.
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
    /// Loads the specs that `scenario` names, and builds their models.
    ///
    /// # Errors
    /// If a spec is missing, invalid, or inconsistent with another one.
    pub fn prepare(scenario: &Scenario) -> Result<Self, SimulationError> {
        let (specs, sources) = Specs::load(scenario)?;
        Self::build(scenario, specs, &sources)
    }

    /// Builds the models of `specs`, which can differ from those that `scenario` names: a sweep modifies them.
    ///
    /// # Errors
    /// If the specs are invalid or inconsistent with each other.
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

    /// The scenario.
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

    /// Solids of the carrier that the lidar can see, in the base frame.
    pub fn carrier(&self) -> &[Cylinder] {
        &self.carrier
    }

    /// The motion of the base.
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

    /// The IMU on the base, if any.
    pub fn base_imu(&self) -> Option<&Imu> {
        self.base_imu.as_ref()
    }

    /// Published calibration: mounting poses and noise of the sensors, including the errors of extrinsics faults.
    pub fn calibration(&self) -> Calibration {
        let calibration = self.rig().calibration();
        match &self.faults {
            Some(faults) => faults.published_calibration(calibration),
            None => calibration,
        }
    }

    /// Runs the simulation. `sink` receives measurements and ground truth, `progress` the completed fraction.
    ///
    /// Each run of a scenario gives the same bytes, with any number of threads.
    ///
    /// # Errors
    /// If the head simulation or the sink fails.
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

    /// Runs simulations that [share their rays](Self::shares_rays_with), each with its own sink.
    ///
    /// Physics and rays are computed once. Each sink receives the same data as from a separate run.
    ///
    /// # Errors
    /// If the simulations do not share their rays, or the head simulation or a sink fails.
    pub fn run_together<S: Sink + TruthSink + ?Sized>(
        simulations: &[Self],
        sinks: &mut [&mut S],
        progress: &mut dyn FnMut(f64),
    ) -> Result<Vec<SimulationSummary>, SimulationError> {
        let Some(first) = simulations.first() else { return Ok(Vec::new()) };
        if !simulations.iter().all(|other| first.shares_rays_with(other)) {
            return Err(SimulationError::DifferentRays);
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

    /// Whether `other` has the same physics and rays: it may differ in the IMUs, the lidar errors and the faults only.
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

/// The faults of a run, if any.
fn faults(specs: &Specs, sources: &Sources, lidar: &Lidar) -> Result<Option<Faults>, SpecError> {
    let Some(spec) = &specs.faults else { return Ok(None) };
    let unnamed = Source::in_memory("faults", "");
    let source = sources.faults.as_ref().unwrap_or(&unnamed);
    let faults = Faults::new(spec, source)?;
    faults.check_with(lidar, source)?;
    Ok(Some(faults))
}

/// Solids of a head's carrier that the lidar can see, in the base frame.
pub fn carrier_of(head: &HeadSpec) -> Vec<Cylinder> {
    let cylinder = |part: &CarrierSpec| Cylinder {
        foot_in_base: Vector::from(part.foot_in_base_m),
        radius_m: part.radius_m,
        height_m: part.height_m,
        reflectance: part.reflectance as f32,
    };
    head.carrier.iter().map(cylinder).collect()
}

/// The named route, or the default route of the scene, if any.
fn route<'w>(scenario: &Scenario, world: &'w World) -> Result<Option<&'w Route>, SpecError> {
    let Some(name) = &scenario.route else { return Ok(world.default_route()) };
    world.routes().get(name).map(Some).ok_or_else(|| {
        let names: Vec<&str> = world.routes().keys().map(String::as_str).collect();
        let help = if names.is_empty() { "it has none".to_owned() } else { format!("it has: {}", names.join(", ")) };
        SpecError::plain(&scenario.scene, format!("the scene has no route `{name}`")).with_help(help)
    })
}
