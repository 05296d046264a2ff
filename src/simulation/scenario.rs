use super::{FaultsSpec, SimulationError};
use crate::dynamics::HeadSpec;
use crate::motion::MotionSpec;
use crate::random::Seed;
use crate::sensors::{ClocksSpec, ImuSpec, LidarSpec};
use crate::spec::{Kind, Source, checked, find, parse};
use crate::world::SceneSpec;
use serde::{Deserialize, Serialize};

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
}

/// All specs of a run as used. Together with the scenario they reproduce the run on any machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Specs {
    /// The scene, with included scenes merged.
    pub scene: SceneSpec,
    /// The head and the linkage.
    pub head: HeadSpec,
    /// The motion of the base.
    pub motion: MotionSpec,
    /// The lidar.
    pub lidar: LidarSpec,
    /// The inertial measurement unit.
    pub imu: ImuSpec,
    /// The clocks of the sensors.
    pub clock: ClocksSpec,
    /// The IMU of the base, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_imu: Option<ImuSpec>,
    /// The faults, with the content of referenced files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub faults: Option<FaultsSpec>,
}

/// Source texts of the specs of a run, for errors and for the folder of meshes.
#[derive(Debug, Clone)]
pub struct Sources {
    /// Source of the scene.
    pub scene: Source,
    /// Source of the head.
    pub head: Source,
    /// Source of the motion.
    pub motion: Source,
    /// Source of the lidar.
    pub lidar: Source,
    /// Source of the IMU.
    pub imu: Source,
    /// Source of the clocks.
    pub clock: Source,
    /// Source of the base IMU, if any.
    pub base_imu: Option<Source>,
    /// Source of the faults, if any.
    pub faults: Option<Source>,
}

impl Specs {
    /// Finds and parses the specs that `scenario` names.
    ///
    /// # Errors
    /// If a spec is missing or invalid.
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
