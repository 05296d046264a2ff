use super::{FaultsSpec, SimulationError};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use zsim_base::random::Seed;
use zsim_base::spec::{Named, Source, checked, name_from, to_json};
use zsim_dynamics::HeadSpec;
use zsim_motion::MotionSpec;
use zsim_sensors::{ClocksSpec, ImuSpec, LidarSpec};
use zsim_world::SceneSpec;

/// What to simulate: specs by name. A name is a path, or a name in the library.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Scene, from `scenes/`.
    pub scene: String,
    /// Head and linkage, from `specs/heads/`.
    pub head: String,
    /// Motion of the base, from `specs/motions/`.
    pub motion: String,
    /// Lidar, from `specs/lidars/`.
    pub lidar: String,
    /// IMU, from `specs/imus/`.
    pub imu: String,
    /// Clocks of the sensors, from `specs/clocks/`.
    pub clock: String,
    /// A second IMU at the origin and along the axes of the base; `None` for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_imu: Option<String>,
    /// Faults of the sensors and of their delivery; `None` for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub faults: Option<String>,
    /// Route of the scene; `None` for the default route.
    pub route: Option<String>,
    /// Duration, s.
    #[serde(with = "checked::Positive")]
    pub duration_s: f64,
    /// Random seed. The same seed and specs give the same bytes.
    pub seed: Seed,
}

impl Scenario {
    /// Default scenario in `scene`: the paper's handheld head, carried for two minutes.
    pub fn in_scene(scene: &str) -> Self {
        Self {
            scene: scene.to_owned(),
            head: "handheld".to_owned(),
            motion: "hand".to_owned(),
            lidar: "utm30lx".to_owned(),
            imu: "3dm_gx2".to_owned(),
            clock: "drifting".to_owned(),
            base_imu: None,
            faults: None,
            route: None,
            duration_s: 120.0,
            seed: Seed(1),
        }
    }

    /// The scenario with names of files that are relative to the folder of `source`.
    #[must_use]
    pub fn relative_to(self, source: &Source) -> Self {
        let named = |name: String| name_from(source, &name);
        Self {
            scene: named(self.scene),
            head: named(self.head),
            motion: named(self.motion),
            lidar: named(self.lidar),
            imu: named(self.imu),
            clock: named(self.clock),
            base_imu: self.base_imu.map(named),
            faults: self.faults.map(named),
            ..self
        }
    }
}

/// All inputs of a simulation, self-contained: they reproduce it on any machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// The scene, with included scenes merged.
    pub scene: Named<SceneSpec>,
    /// The head and the linkage.
    pub head: Named<HeadSpec>,
    /// The motion of the base.
    pub motion: Named<MotionSpec>,
    /// The lidar.
    pub lidar: Named<LidarSpec>,
    /// The inertial measurement unit.
    pub imu: Named<ImuSpec>,
    /// The clocks of the sensors.
    pub clock: Named<ClocksSpec>,
    /// The IMU of the base, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_imu: Option<Named<ImuSpec>>,
    /// The faults, with the content of referenced files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub faults: Option<Named<FaultsSpec>>,
    /// Route of the scene; `None` for the default route.
    pub route: Option<String>,
    /// Duration, s.
    #[serde(with = "checked::Positive")]
    pub duration_s: f64,
    /// Random seed. The same seed and specs give the same bytes.
    pub seed: Seed,
}

impl Run {
    /// Finds and parses the specs that `scenario` names.
    ///
    /// # Errors
    /// If a spec is missing or invalid.
    pub fn load(scenario: &Scenario) -> Result<Self, SimulationError> {
        Ok(Self {
            scene: Named::load(&scenario.scene)?,
            head: Named::load(&scenario.head)?,
            motion: Named::load(&scenario.motion)?,
            lidar: Named::load(&scenario.lidar)?,
            imu: Named::load(&scenario.imu)?,
            clock: Named::load(&scenario.clock)?,
            base_imu: scenario.base_imu.as_deref().map(Named::load).transpose()?,
            faults: scenario.faults.as_deref().map(Named::load).transpose()?,
            route: scenario.route.clone(),
            duration_s: scenario.duration_s,
            seed: scenario.seed,
        })
    }

    /// Everything that determines physics and rays: all inputs but the IMUs, the lidar's errors and the faults.
    ///
    /// Runs with equal values share one simulation of physics and rays.
    ///
    /// # Errors
    /// If a number is not finite.
    pub fn ray_inputs(&self) -> Result<Value, serde_json::Error> {
        let mut lidar = to_json(&self.lidar.spec)?;
        if let Some(lidar) = lidar.as_object_mut() {
            lidar.retain(|key, _| !["errors", "noise"].contains(&key.as_str()));
        }
        let specs = (&self.scene.spec, &self.head.spec, &self.motion.spec, &self.clock.spec);
        to_json(&(specs, lidar, &self.route, self.duration_s, self.seed))
    }

    /// The run without the folders of its specs, which differ between machines.
    #[must_use]
    pub fn without_folders(mut self) -> Self {
        (self.scene.folder, self.head.folder, self.motion.folder) = (None, None, None);
        (self.lidar.folder, self.imu.folder, self.clock.folder) = (None, None, None);
        self.base_imu.iter_mut().for_each(|imu| imu.folder = None);
        self.faults.iter_mut().for_each(|faults| faults.folder = None);
        self
    }
}
