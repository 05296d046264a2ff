use super::{FaultsSpec, SimulationError};
use crate::dynamics::HeadSpec;
use crate::motion::MotionSpec;
use crate::random::Seed;
use crate::sensors::{ClocksSpec, ImuSpec, LidarSpec};
use crate::spec::{Kind, Source, checked, find, parse};
use crate::world::SceneSpec;
use serde::{Deserialize, Serialize};

/// What to simulate, by name: each a path, or a name in the library.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// The world.
    pub scene: String,
    /// The head and what carries it.
    pub head: String,
    /// How the base moves.
    pub motion: String,
    /// The lidar.
    pub lidar: String,
    /// The inertial measurement unit.
    pub imu: String,
    /// The sensors' clocks.
    pub clock: String,
    /// A second inertial measurement unit, at the origin of the base and along its axes; `None` for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_imu: Option<String>,
    /// Faults of the sensors and of their delivery; `None` for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub faults: Option<String>,
    /// The scene's way to walk; `None` for its default one.
    pub route: Option<String>,
    /// How long, s.
    #[serde(with = "checked::Positive")]
    pub duration_s: f64,
    /// The seed from which all chance follows.
    pub seed: Seed,
}

impl Scenario {
    /// The paper's head carried by hand for two minutes through `scene`: what is simulated unless something else is
    /// asked.
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
}

/// The specs of a run as they were used, whole: with them and the scenario a run can be repeated anywhere.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Specs {
    /// The world, with the scenes that it includes.
    pub scene: SceneSpec,
    /// The head and what carries it.
    pub head: HeadSpec,
    /// How the base moves.
    pub motion: MotionSpec,
    /// The lidar.
    pub lidar: LidarSpec,
    /// The inertial measurement unit.
    pub imu: ImuSpec,
    /// The sensors' clocks.
    pub clock: ClocksSpec,
    /// The base's inertial measurement unit, where it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_imu: Option<ImuSpec>,
    /// Faults, with the files that they name read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub faults: Option<FaultsSpec>,
}

/// The texts that the specs of a run came from, for errors about them and for the folder of a scene's meshes.
#[derive(Debug, Clone)]
pub struct Sources {
    /// The world's.
    pub scene: Source,
    /// The head's.
    pub head: Source,
    /// The motion's.
    pub motion: Source,
    /// The lidar's.
    pub lidar: Source,
    /// The IMU's.
    pub imu: Source,
    /// The clocks'.
    pub clock: Source,
    /// The base's IMU's, where it has one.
    pub base_imu: Option<Source>,
    /// The faults'.
    pub faults: Option<Source>,
}

impl Specs {
    /// Finds and parses the specs that `scenario` names.
    ///
    /// # Errors
    /// When one is missing, or its text is wrong.
    pub fn load(scenario: &Scenario) -> Result<(Self, Sources), SimulationError> {
        let sources = Sources {
            scene: find(Kind::Scene, &scenario.scene)?,
            head: find(Kind::Head, &scenario.head)?,
            motion: find(Kind::Motion, &scenario.motion)?,
            lidar: find(Kind::Lidar, &scenario.lidar)?,
            imu: find(Kind::Imu, &scenario.imu)?,
            clock: find(Kind::Clock, &scenario.clock)?,
            base_imu: scenario.base_imu.as_deref().map(|name| find(Kind::Imu, name)).transpose()?,
            faults: scenario.faults.as_deref().map(|name| find(Kind::Faults, name)).transpose()?,
        };
        let specs = Self::parse(&sources)?;
        Ok((specs, sources))
    }

    fn parse(sources: &Sources) -> Result<Self, SimulationError> {
        Ok(Self {
            scene: parse::<SceneSpec>(&sources.scene)?.with_includes(&sources.scene)?,
            head: parse(&sources.head)?,
            motion: parse(&sources.motion)?,
            lidar: parse(&sources.lidar)?,
            imu: parse(&sources.imu)?,
            clock: parse(&sources.clock)?,
            base_imu: sources.base_imu.as_ref().map(parse).transpose()?,
            faults: sources
                .faults
                .as_ref()
                .map(|source| parse::<FaultsSpec>(source)?.with_files(source))
                .transpose()?,
        })
    }
}
