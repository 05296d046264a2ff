use super::faults::Injector;
use super::run::simulate_together;
use super::{EPOCH, Faults, Outputs, Rig, Run, STEP_S, Scenario, SimulationError, SimulationSummary, simulate};
use zsim_base::geometry::{Route, Vector};
use zsim_base::measurement::{Calibration, Sink};
use zsim_base::spec::SpecError;
use zsim_dynamics::{CarrierSpec, ContactWatch, DynamicsError, HeadModel, HeadSimulation, HeadSpec, HeadState};
use zsim_motion::BaseMotion;
use zsim_sensors::{Clocks, Cylinder, Imu, Lidar};
use zsim_truth::TruthSink;
use zsim_world::World;

/// A run with all models built.
pub struct Simulation {
    run: Run,
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
        Self::build(Run::load(scenario)?)
    }

    /// Builds the models of a run.
    ///
    /// # Errors
    /// If the specs are invalid or inconsistent with each other.
    pub fn build(run: Run) -> Result<Self, SimulationError> {
        let world = World::build(&run.scene.spec, &run.scene.source())?;
        let head = HeadModel::new(&run.head.spec, &run.head.source())?;
        let carrier = carrier_of(&run.head.spec);
        let route = route(&run, &world)?;
        let motion = run.motion.spec.build(&run.motion.source(), route, run.duration_s, run.seed)?;
        let lidar = Lidar::new(&run.lidar.spec, &run.lidar.source())?;
        let imu = Imu::new(&run.imu.spec, &run.imu.source())?;
        let base_imu = run.base_imu.as_ref().map(|imu| Imu::new(&imu.spec, &imu.source())).transpose()?;
        let clocks = Clocks::new(&run.clock.spec, &run.clock.source(), EPOCH)?;
        let faults = faults(&run, &lidar)?;
        Ok(Self { run, world, head, carrier, motion, lidar, imu, base_imu, clocks, faults })
    }

    /// The inputs of the simulation.
    pub fn inputs(&self) -> &Run {
        &self.run
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
        self.run_outputs(Outputs::All, sink, progress)
    }

    /// As [`run`](Self::run), with the given outputs only.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn run_outputs<S: Sink + TruthSink + ?Sized>(
        &self,
        outputs: Outputs,
        sink: &mut S,
        progress: &mut dyn FnMut(f64),
    ) -> Result<SimulationSummary, SimulationError> {
        let mut watch = ContactWatch::new(&self.head);
        let mut motion = self.watched_motion(&mut watch)?;
        let rig = Rig { outputs, ..self.rig() };
        let summary = match &self.faults {
            None => simulate(&rig, &mut motion, sink, progress)?,
            Some(faults) => {
                let mut injector = Injector::new(Some(faults), &rig, sink);
                let summary = simulate(&rig, &mut motion, &mut injector, progress)?;
                injector.finish().map_err(SimulationError::Sink)?;
                summary
            }
        };
        drop(motion);
        Ok(SimulationSummary { coil_contact: watch.contact(), ..summary })
    }

    /// The motion of the head, in which `watch` checks each state.
    fn watched_motion<'a>(
        &'a self,
        watch: &'a mut ContactWatch<'_>,
    ) -> Result<impl Iterator<Item = Result<HeadState, DynamicsError>> + Send + 'a, SimulationError> {
        let motion = HeadSimulation::new(&self.head, self.motion.as_ref(), STEP_S)?;
        Ok(motion.inspect(move |state| {
            if let Ok(state) = state {
                watch.check(state.t_s, &state.base, &state.head);
            }
        }))
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
        let mut watch = ContactWatch::new(&first.head);
        let mut motion = first.watched_motion(&mut watch)?;
        let summaries = if simulations.iter().all(|simulation| simulation.faults.is_none()) {
            simulate_together(&rigs, &mut motion, sinks, progress)?
        } else {
            let each = simulations.iter().zip(&rigs).zip(sinks.iter_mut());
            let mut injectors: Vec<_> = each
                .map(|((simulation, rig), sink)| Injector::new(simulation.faults.as_ref(), rig, &mut **sink))
                .collect();
            let mut sinks: Vec<_> = injectors.iter_mut().collect();
            let summaries = simulate_together(&rigs, &mut motion, &mut sinks, progress)?;
            injectors.into_iter().try_for_each(Injector::finish).map_err(SimulationError::Sink)?;
            summaries
        };
        drop(motion);
        let coil_contact = watch.contact();
        Ok(summaries.into_iter().map(|summary| SimulationSummary { coil_contact, ..summary }).collect())
    }

    /// Whether `other` has the same physics and rays: it may differ in the IMUs, the lidar errors and the faults only.
    pub fn shares_rays_with(&self, other: &Self) -> bool {
        matches!((self.run.ray_inputs(), other.run.ray_inputs()), (Ok(ours), Ok(theirs)) if ours == theirs)
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
            duration_s: self.run.duration_s,
            seed: self.run.seed,
            outputs: Outputs::All,
        }
    }
}

/// The faults of a run, if any.
fn faults(run: &Run, lidar: &Lidar) -> Result<Option<Faults>, SpecError> {
    let Some(named) = &run.faults else { return Ok(None) };
    let faults = Faults::new(&named.spec, &named.source())?;
    faults.check_with(lidar, &named.source())?;
    Ok(Some(faults))
}

/// The solids of what carries the head (a person, a vehicle), which the beams can hit, in the base frame.
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
fn route<'w>(run: &Run, world: &'w World) -> Result<Option<&'w Route>, SpecError> {
    let Some(name) = &run.route else { return Ok(world.default_route()) };
    world.routes().get(name).map(Some).ok_or_else(|| {
        let names: Vec<&str> = world.routes().keys().map(String::as_str).collect();
        let help = if names.is_empty() { "it has none".to_owned() } else { format!("it has: {}", names.join(", ")) };
        SpecError::plain(&run.scene.name, format!("the scene has no route `{name}`")).with_help(help)
    })
}
