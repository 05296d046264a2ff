//! The specs of a run as data that can be stored, modified and hashed.

use crate::dynamics::{HeadSpec, LinkageSpec};
use crate::estimation::EstimatorSpec;
use crate::motion::MotionSpec;
use crate::sensors::{ClocksSpec, ImuSpec, LidarSpec};
use crate::simulation::FaultsSpec;
use crate::spec::{Kind, Source, SpecError, checked, find, parse};
use crate::study::StudyError;
use crate::study::spring::Shake;
use crate::world::SceneSpec;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::PathBuf;

/// Role of a spec in a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Slot {
    /// Settings of the sweep's own spec: duration and route, or the shake of the hand.
    Run,
    Scene,
    Head,
    Motion,
    Lidar,
    Imu,
    Clock,
    Faults,
    Estimator,
}

impl Slot {
    const ALL: [Self; 9] = [
        Self::Run,
        Self::Scene,
        Self::Head,
        Self::Motion,
        Self::Lidar,
        Self::Imu,
        Self::Clock,
        Self::Faults,
        Self::Estimator,
    ];

    /// First key of a setting's path; paths to settings of the run itself have none.
    pub(super) fn key(self) -> &'static str {
        self.kind().map_or("run", |kind| match kind {
            Kind::Head => "head",
            Kind::Motion => "motion",
            Kind::Lidar => "lidar",
            Kind::Imu => "imu",
            Kind::Clock => "clock",
            Kind::Faults => "faults",
            Kind::Estimator => "estimator",
            _ => "scene",
        })
    }

    pub(super) fn from_key(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|slot| *slot != Self::Run && slot.key() == key)
    }

    /// Kind of the spec in this slot.
    pub(super) fn kind(self) -> Option<Kind> {
        match self {
            Self::Run => None,
            Self::Scene => Some(Kind::Scene),
            Self::Head => Some(Kind::Head),
            Self::Motion => Some(Kind::Motion),
            Self::Lidar => Some(Kind::Lidar),
            Self::Imu => Some(Kind::Imu),
            Self::Clock => Some(Kind::Clock),
            Self::Faults => Some(Kind::Faults),
            Self::Estimator => Some(Kind::Estimator),
        }
    }
}

/// Settings of a journey that are not names of specs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JourneySettings {
    pub route: Option<String>,
    #[serde(with = "checked::Positive")]
    pub duration_s: f64,
}

/// Settings of a closed form that are not names of specs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ShakeSettings {
    pub shake: Shake,
}

/// The spec of a slot, self-contained: included and referenced specs are resolved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Component {
    #[serde(rename = "walk")]
    Journey(JourneySettings),
    #[serde(rename = "nod")]
    Shake(ShakeSettings),
    Scene(Box<SceneSpec>),
    Head(Box<HeadSpec>),
    Motion(Box<MotionSpec>),
    Lidar(Box<LidarSpec>),
    Imu(Box<ImuSpec>),
    Clock(Box<ClocksSpec>),
    Faults(Box<FaultsSpec>),
    Estimator(Box<EstimatorSpec>),
}

/// A component with its name and the folder that its file paths are relative to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct NamedComponent {
    pub name: String,
    pub folder: Option<PathBuf>,
    pub component: Component,
}

impl NamedComponent {
    /// Loads the spec `name` for `slot` and resolves its references.
    pub(super) fn load(slot: Slot, name: &str) -> Result<Self, StudyError> {
        let Some(kind) = slot.kind() else {
            return Err(SpecError::plain(name, "is not a spec").into());
        };
        let source = find(kind, name)?;
        let component = match slot {
            Slot::Run => return Err(SpecError::plain(name, "is not a spec").into()),
            Slot::Scene => {
                let scene: SceneSpec = parse(&source)?;
                let whole = scene.with_includes(&source).map_err(crate::simulation::SimulationError::from)?;
                Component::Scene(Box::new(whole))
            }
            Slot::Head => Component::Head(Box::new(with_spring_resolved(parse(&source)?)?)),
            Slot::Motion => Component::Motion(Box::new(parse(&source)?)),
            Slot::Lidar => Component::Lidar(Box::new(parse(&source)?)),
            Slot::Imu => Component::Imu(Box::new(parse(&source)?)),
            Slot::Clock => Component::Clock(Box::new(parse(&source)?)),
            Slot::Faults => Component::Faults(Box::new(parse::<FaultsSpec>(&source)?.with_files(&source)?)),
            Slot::Estimator => Component::Estimator(Box::new(parse(&source)?)),
        };
        let folder = source.folder.map(|folder| folder.canonicalize().unwrap_or(folder));
        Ok(Self { name: name.to_owned(), folder, component })
    }

    /// Source for error messages and relative file paths.
    pub(super) fn source(&self) -> Source {
        Source { name: self.name.clone(), folder: self.folder.clone(), text: String::new() }
    }

    /// The component with its settings replaced by `value`.
    ///
    /// # Errors
    /// A message if `value` is not valid for this kind of spec.
    pub(super) fn with_value(&self, value: Value) -> Result<Self, String> {
        Ok(Self { component: self.component.with_value(value)?, ..self.clone() })
    }
}

impl Component {
    /// The spec as a JSON tree.
    pub(super) fn value(&self) -> Result<Value, serde_json::Error> {
        match self {
            Self::Journey(spec) => serde_json::to_value(spec),
            Self::Shake(spec) => serde_json::to_value(spec),
            Self::Scene(spec) => serde_json::to_value(spec),
            Self::Head(spec) => serde_json::to_value(spec),
            Self::Motion(spec) => serde_json::to_value(spec),
            Self::Lidar(spec) => serde_json::to_value(spec),
            Self::Imu(spec) => serde_json::to_value(spec),
            Self::Clock(spec) => serde_json::to_value(spec),
            Self::Faults(spec) => serde_json::to_value(spec),
            Self::Estimator(spec) => serde_json::to_value(spec),
        }
    }

    fn with_value(&self, value: Value) -> Result<Self, String> {
        use serde_json::from_value;
        let read = match self {
            Self::Journey(_) => from_value(value).map(Self::Journey),
            Self::Shake(_) => from_value(value).map(Self::Shake),
            Self::Scene(_) => from_value(value).map(Self::Scene),
            Self::Head(_) => from_value(value).map(Self::Head),
            Self::Motion(_) => from_value(value).map(Self::Motion),
            Self::Lidar(_) => from_value(value).map(Self::Lidar),
            Self::Imu(_) => from_value(value).map(Self::Imu),
            Self::Clock(_) => from_value(value).map(Self::Clock),
            Self::Faults(_) => from_value(value).map(Self::Faults),
            Self::Estimator(_) => from_value(value).map(Self::Estimator),
        };
        let component = read.map_err(|error| error.to_string())?;
        if let Self::Estimator(spec) = &component {
            spec.check().map_err(|error| error.to_string())?;
        }
        Ok(component)
    }
}

/// Replaces a spring that is given by name by its description, so that its settings can be varied.
fn with_spring_resolved(mut head: HeadSpec) -> Result<HeadSpec, SpecError> {
    if let LinkageSpec::Spring { spring, .. } = &mut head.linkage {
        *spring = spring.resolved()?;
    }
    Ok(head)
}
