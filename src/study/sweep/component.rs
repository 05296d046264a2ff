//! The specs that a run is made of, each as data that can be kept, changed and told apart.

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

/// A part of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Slot {
    /// What the sweep itself says: duration and route, or the hand's nod.
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

    /// Its first key in a path; settings of the run itself have none.
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

    pub(super) fn of_key(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|slot| *slot != Self::Run && slot.key() == key)
    }

    /// The kind of spec that fills it.
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

/// What a journey's spec says of its runs beside names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Walk {
    pub route: Option<String>,
    #[serde(with = "checked::Positive")]
    pub duration_s: f64,
}

/// What a closed form's spec says of its runs beside names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Nod {
    pub shake: Shake,
}

/// What fills a slot, whole: with the specs that it includes or names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Component {
    Walk(Walk),
    Nod(Nod),
    Scene(Box<SceneSpec>),
    Head(Box<HeadSpec>),
    Motion(Box<MotionSpec>),
    Lidar(Box<LidarSpec>),
    Imu(Box<ImuSpec>),
    Clock(Box<ClocksSpec>),
    Faults(Box<FaultsSpec>),
    Estimator(Box<EstimatorSpec>),
}

/// A component with what it is called and where the files that it names are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Kept {
    pub name: String,
    pub folder: Option<PathBuf>,
    pub component: Component,
}

impl Kept {
    /// Finds the spec `name` for `slot`, and takes in what it refers to.
    pub(super) fn load(slot: Slot, name: &str) -> Result<Self, StudyError> {
        let Some(kind) = slot.kind() else {
            return Err(SpecError::plain(name, "is no spec").into());
        };
        let source = find(kind, name)?;
        let component = match slot {
            Slot::Run => return Err(SpecError::plain(name, "is no spec").into()),
            Slot::Scene => {
                let scene: SceneSpec = parse(&source)?;
                let whole = scene.with_includes(&source).map_err(crate::simulation::SimulationError::from)?;
                Component::Scene(Box::new(whole))
            }
            Slot::Head => Component::Head(Box::new(described(parse(&source)?)?)),
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

    /// What to call it in errors, and where its files are.
    pub(super) fn source(&self) -> Source {
        Source { name: self.name.clone(), folder: self.folder.clone(), text: String::new() }
    }

    /// The same with other settings.
    ///
    /// # Errors
    /// A sentence, when these are no such settings.
    pub(super) fn with(&self, value: Value) -> Result<Self, String> {
        Ok(Self { component: self.component.with(value)?, ..self.clone() })
    }
}

impl Component {
    /// As a tree of keys and values.
    pub(super) fn value(&self) -> Result<Value, serde_json::Error> {
        match self {
            Self::Walk(spec) => serde_json::to_value(spec),
            Self::Nod(spec) => serde_json::to_value(spec),
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

    fn with(&self, value: Value) -> Result<Self, String> {
        use serde_json::from_value;
        let read = match self {
            Self::Walk(_) => from_value(value).map(Self::Walk),
            Self::Nod(_) => from_value(value).map(Self::Nod),
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

/// The head with its spring described where it was named, so that its settings are there to change.
fn described(mut head: HeadSpec) -> Result<HeadSpec, SpecError> {
    if let LinkageSpec::Spring { spring, .. } = &mut head.linkage {
        *spring = spring.resolved()?;
    }
    Ok(head)
}
