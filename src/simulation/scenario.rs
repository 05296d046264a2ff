use super::{FaultsSpec, SimulationError};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use zsim_base::random::Seed;
use zsim_base::spec::{Named, Source, checked, name_from, to_json};
use zsim_dynamics::HeadSpec;
use zsim_motion::MotionSpec;
use zsim_sensors::{ClocksSpec, ImuSpec, LidarSpec};
use zsim_world::SceneSpec;

/// Defines [`Scenario`] and [`Run`] from one list of the specs of a run, with the names of the default scenario.
macro_rules! inputs {
    (
        specs: { $($(#[$meaning:meta])* $spec:ident: $type:ty = $usual:literal,)* }
        optional: { $($(#[$optional_meaning:meta])* $optional:ident: $optional_type:ty,)* }
    ) => {
        /// What to simulate: specs by name. A name is a path, or a name in the library.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct Scenario {
            $($(#[$meaning])* pub $spec: String,)*
            $($(#[$optional_meaning])*
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub $optional: Option<String>,)*
            /// Route of the scene; `None` for the default route.
            pub route: Option<String>,
            /// Duration, s.
            #[serde(with = "checked::Positive")]
            pub duration_s: f64,
            /// Random seed. The same seed and specs give the same bytes.
            pub seed: Seed,
        }

        /// All inputs of a simulation, self-contained: they reproduce it on any machine.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        pub struct Run {
            $($(#[$meaning])* pub $spec: Named<$type>,)*
            $($(#[$optional_meaning])*
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub $optional: Option<Named<$optional_type>>,)*
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
                let default = Self {
                    $($spec: $usual.to_owned(),)*
                    $($optional: None,)*
                    route: None,
                    duration_s: 120.0,
                    seed: Seed(1),
                };
                Self { scene: scene.to_owned(), ..default }
            }

            /// The scenario with names of files that are relative to the folder of `source`.
            #[must_use]
            pub fn relative_to(self, source: &Source) -> Self {
                let named = |name: String| name_from(source, &name);
                Self { $($spec: named(self.$spec),)* $($optional: self.$optional.map(named),)* ..self }
            }
        }

        impl Run {
            /// Finds and parses the specs that `scenario` names.
            ///
            /// # Errors
            /// If a spec is missing or invalid.
            pub fn load(scenario: &Scenario) -> Result<Self, SimulationError> {
                Ok(Self {
                    $($spec: Named::load(&scenario.$spec)?,)*
                    $($optional: scenario.$optional.as_deref().map(Named::load).transpose()?,)*
                    route: scenario.route.clone(),
                    duration_s: scenario.duration_s,
                    seed: scenario.seed,
                })
            }

            /// The run without the folders of its specs, which differ between machines.
            #[must_use]
            pub fn without_folders(mut self) -> Self {
                $(self.$spec.folder = None;)*
                $(self.$optional.iter_mut().for_each(|spec| spec.folder = None);)*
                self
            }
        }
    };
}

inputs! {
    specs: {
        /// The scene, from `scenes/`, with included scenes merged.
        scene: SceneSpec = "",
        /// The head and the linkage, from `specs/heads/`.
        head: HeadSpec = "handheld",
        /// The motion of the base, from `specs/motions/`.
        motion: MotionSpec = "hand",
        /// The lidar, from `specs/lidars/`.
        lidar: LidarSpec = "utm30lx",
        /// The inertial measurement unit, from `specs/imus/`.
        imu: ImuSpec = "3dm_gx2",
        /// The clocks of the sensors, from `specs/clocks/`.
        clock: ClocksSpec = "drifting",
    }
    optional: {
        /// A second IMU at the origin and along the axes of the base; `None` for none.
        base_imu: ImuSpec,
        /// Faults of the sensors and of their delivery, with the content of referenced files; `None` for none.
        faults: FaultsSpec,
    }
}

impl Run {
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
}
