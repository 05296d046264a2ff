//! `zsim check`: are these scenes and specs right?

use super::arguments::{Global, any_route};
use super::{Completion, message, output, usage};
use clap::Args;
use serde_json::json;
use std::path::Path;
use zsim_base::random::Seed;
use zsim_base::similar::did_you_mean;
use zsim_base::spec::{Kind, NamedSpec, Source, SpecError, Tree, find, kind_by_keys, names};
use zsim_dynamics::{HeadModel, HeadSpec};
use zsim_elasticity::{ElasticityError, SpringSpec};
use zsim_estimation::{EstimationError, EstimatorSpec};
use zsim_motion::MotionSpec;
use zsim_sensors::{Clocks, ClocksSpec, Imu, ImuSpec, Lidar, LidarSpec};
use zsim_simulation::{EPOCH, Faults, FaultsSpec};
use zsim_study::StudyError;
use zsim_study::design::{DesignSearch, DesignSpec};
use zsim_study::reproduction::ExperimentSpec;
use zsim_study::sweep::{Plan, SweepSpec};
use zsim_world::{SceneSpec, World, WorldError};

/// The kinds that there is a check for.
const KINDS: [Kind; 11] = [
    Kind::Scene,
    Kind::Head,
    Kind::Spring,
    Kind::Motion,
    Kind::Lidar,
    Kind::Imu,
    Kind::Clock,
    Kind::Faults,
    Kind::Estimator,
    Kind::Study,
    Kind::Experiment,
];

/// Check scenes and specs; report line and column of each error
///
/// The kind of a file follows from its folder (scenes/, specs/heads/, ...), or else from trying each parser.
#[derive(Args)]
#[command(after_help = "Example:\n  zsim check scenes/office.ron specs/heads/handheld.ron")]
pub(super) struct Arguments {
    /// Files, or names in scenes/ and specs/
    #[arg(value_name = "FILE", required = true)]
    files: Vec<String>,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let checked: Vec<_> = arguments.files.iter().map(|file| (file, check(file))).collect();
    let mut words = String::new();
    let mut figures = Vec::new();
    for (file, result) in &checked {
        match result {
            Ok((kind, warnings)) => {
                let count = match warnings.len() {
                    0 => String::new(),
                    1 => ", 1 warning".to_owned(),
                    count => format!(", {count} warnings"),
                };
                words += &format!("{file}: {}, OK{count}\n", kind.noun());
                figures.push(json!({ "file": file, "kind": kind.noun(), "error": null, "warnings": warnings }));
                warnings.iter().for_each(|warning| message::warning(&format!("{file}: {warning}")));
            }
            Err(error) => {
                let at = error.line_and_column();
                figures.push(json!({ "file": file, "error": error.to_string(), "message": error.message(),
                    "line": at.map(|at| at.0), "column": at.map(|at| at.1) }));
                message::error(&error.to_string());
            }
        }
    }
    output::print_result(global, &words, json!({ "files": figures }), None)?;
    let invalid = checked.iter().filter(|(_, result)| result.is_err()).count();
    if invalid > 0 {
        return Err(usage::Usage(format!("{invalid} of {} files invalid", checked.len())).into());
    }
    Ok(Completion::Done)
}

/// Kind of a valid file, and warnings.
type Checked = (Kind, Vec<String>);

/// Checks a file, or a scene or spec of the library by name.
///
/// The folder of a file tells its kind, if it has the name of one; otherwise each kind is tried.
fn check(file: &str) -> Result<Checked, SpecError> {
    if let Some(kind) = kind_by_folder(file) {
        return build(kind, &find(kind, file)?).map(|warnings| (kind, warnings));
    }
    let path = Path::new(file);
    let source = match path.is_file() {
        true => Source::read(path)?,
        false => {
            let found = KINDS.iter().find_map(|kind| Some((*kind, find(*kind, file).ok()?)));
            let Some((kind, source)) = found else {
                let error = SpecError::plain(file, "no such file, and no scene or spec of this name");
                let known: Vec<String> = KINDS.into_iter().flat_map(names).collect();
                let question = did_you_mean(file, known.iter().map(String::as_str));
                return Err(question.map_or(error.clone(), |question| error.with_help(question)));
            };
            return build(kind, &source).map(|warnings| (kind, warnings));
        }
    };
    kind_by_trying(&source)
}

/// The kind whose parser accepts the text, checked; if none does, the error of the kind that has the most of its keys.
fn kind_by_trying(source: &Source) -> Result<Checked, SpecError> {
    if let Some(kind) = KINDS.into_iter().find(|kind| parse_as(*kind, source).is_ok()) {
        return build(kind, source).map(|warnings| (kind, warnings));
    }
    let found = kind_by_keys(&Tree::read(source)?.keys());
    let error = found.and_then(|found| parse_as(found.kind, source).err());
    Err(error.unwrap_or_else(|| SpecError::plain(source.name.clone(), "is neither a scene nor a spec")))
}

fn kind_by_folder(file: &str) -> Option<Kind> {
    let folder = Path::new(file).parent()?.file_name()?.to_str()?;
    KINDS.into_iter().find(|kind| kind.folder().rsplit('/').next() == Some(folder))
}

fn parse_as(kind: Kind, source: &Source) -> Result<(), SpecError> {
    match kind {
        Kind::Scene => SceneSpec::parse(source).map(drop),
        Kind::Head => HeadSpec::read(source).map(drop),
        Kind::Motion => MotionSpec::parse(source).map(drop),
        Kind::Lidar => LidarSpec::parse(source).map(drop),
        Kind::Imu => ImuSpec::parse(source).map(drop),
        Kind::Clock => ClocksSpec::parse(source).map(drop),
        Kind::Faults => FaultsSpec::parse(source).map(drop),
        Kind::Estimator => EstimatorSpec::parse(source).map(drop),
        Kind::Spring => SpringSpec::parse(source).map(drop),
        Kind::Study => study(source).map(drop),
        Kind::Experiment => ExperimentSpec::parse(source).map(drop),
    }
}

/// The kinds of studies.
enum Study {
    Design(DesignSpec),
    Sweep(SweepSpec),
}

/// Parses a study of either type; if neither fits, returns the error with the larger line number.
fn study(source: &Source) -> Result<Study, SpecError> {
    match (DesignSpec::parse(source), SweepSpec::parse(source)) {
        (Ok(design), _) => Ok(Study::Design(design)),
        (_, Ok(sweep)) => Ok(Study::Sweep(sweep)),
        (Err(design), Err(sweep)) => {
            let is_sweep = sweep.line_and_column() > design.line_and_column();
            Err(if is_sweep { sweep } else { design })
        }
    }
}

impl Study {
    fn build(&self, source: &Source) -> Result<(), StudyError> {
        match self {
            Self::Design(spec) => DesignSearch::new(spec, source).map(drop),
            Self::Sweep(spec) => Plan::new("study", spec, source).map(drop),
        }
    }
}

/// Builds the model that the spec describes, as a run does; returns the warnings about a scene.
fn build(kind: Kind, source: &Source) -> Result<Vec<String>, SpecError> {
    let spec_error = |error: &dyn std::error::Error| SpecError::plain(source.name.clone(), error.to_string());
    let mut warnings = Vec::new();
    let built = match kind {
        Kind::Scene => match World::build(&SceneSpec::parse(source)?, source) {
            Ok(world) => {
                warnings = [world.notes(), &world.route_warnings()].concat();
                Ok(())
            }
            Err(WorldError::Scene(error) | WorldError::Mesh(error)) => Err(error),
        },
        Kind::Head => match HeadModel::new(&HeadSpec::read(source)?, source) {
            Ok(_) => Ok(()),
            Err(zsim_dynamics::DynamicsError::Spec(error)) => Err(error),
            Err(error) => Err(spec_error(&error)),
        },
        Kind::Motion => match MotionSpec::parse(source)?.build(source, Some(&any_route()), 120.0, Seed(1)) {
            Ok(_) => Ok(()),
            Err(zsim_motion::MotionError::Spec(error)) => Err(error),
            Err(error) => Err(spec_error(&error)),
        },
        Kind::Lidar => Lidar::new(&LidarSpec::parse(source)?, source).map(drop),
        Kind::Imu => Imu::new(&ImuSpec::parse(source)?, source).map(drop),
        Kind::Clock => Clocks::new(&ClocksSpec::parse(source)?, source, EPOCH).map(drop),
        Kind::Faults => Faults::new(&FaultsSpec::parse(source)?.with_files(source)?, source).map(drop),
        Kind::Estimator => match EstimatorSpec::parse(source)?.check() {
            Ok(()) => Ok(()),
            Err(EstimationError::Setting { key, message }) => Err(SpecError::about(source, key, message)),
            Err(error) => Err(spec_error(&error)),
        },
        Kind::Spring => match SpringSpec::parse(source)?.design() {
            Ok(_) => Ok(()),
            Err(ElasticityError::Spec(error)) => Err(error),
            Err(error) => Err(SpecError::plain(source.name.clone(), error.to_string())),
        },
        Kind::Study => match study(source)?.build(source) {
            Ok(()) => Ok(()),
            Err(StudyError::Spec(error)) => Err(error),
            Err(error) => Err(spec_error(&error)),
        },
        Kind::Experiment => ExperimentSpec::parse(source)?.check(source),
    };
    built.map(|()| warnings)
}
