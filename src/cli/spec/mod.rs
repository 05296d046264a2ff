//! `zsim spec`: lists, shows and documents the specs.

mod reference;

use super::arguments::Global;
use super::{Completion, output};
use clap::{Args, Subcommand, ValueEnum};
use schemars::{Schema, SchemaGenerator, json_schema, schema_for};
use serde_json::json;
use zsim_base::spec::{Kind, find, names};
use zsim_dynamics::HeadSpec;
use zsim_elasticity::SpringSpec;
use zsim_estimation::EstimatorSpec;
use zsim_motion::MotionSpec;
use zsim_sensors::{ClocksSpec, ImuSpec, LidarSpec};
use zsim_simulation::FaultsSpec;
use zsim_study::design::DesignSpec;
use zsim_study::reproduction::ExperimentSpec;
use zsim_study::sweep::SweepSpec;
use zsim_world::SceneSpec;

/// List and show the specs that ship, and the keys of each kind of spec
#[derive(Args)]
#[command(
    after_help = "Example:\n  zsim spec list head\n  zsim spec show head handheld > my_head.ron\n  zsim spec schema head > head.schema.json"
)]
pub(super) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// List the specs that are built into zsim
    #[command(after_help = "Example:\n  zsim spec list head")]
    List {
        /// List only this kind
        #[arg(value_enum)]
        kind: Option<KindArgument>,
    },
    /// Print the text of a spec
    #[command(after_help = "Example:\n  zsim spec show head handheld > my_head.ron")]
    Show {
        /// The kind
        #[arg(value_enum)]
        kind: KindArgument,
        /// A name that `zsim spec list` prints, or a file
        name: String,
    },
    /// Print the JSON schema of a kind of spec
    ///
    /// RON and JSON have the same structure here: RON's (a: 1) is JSON's {"a": 1}, Variant(x) is {"Variant": x}.
    #[command(after_help = "Example:\n  zsim spec schema head > head.schema.json")]
    Schema {
        /// The kind
        #[arg(value_enum)]
        kind: KindArgument,
    },
    /// Print every key of a kind of spec with type, unit, default and range, as Markdown
    #[command(after_help = "Example:\n  zsim spec reference head > head.md")]
    Reference {
        /// The kind
        #[arg(value_enum)]
        kind: KindArgument,
    },
}

/// A kind of spec on the command line.
#[derive(Clone, Copy, ValueEnum)]
enum KindArgument {
    Scene,
    Head,
    Spring,
    Lidar,
    Imu,
    Clock,
    Faults,
    Motion,
    Estimator,
    Study,
    Experiment,
}

impl From<KindArgument> for Kind {
    fn from(kind: KindArgument) -> Self {
        match kind {
            KindArgument::Scene => Kind::Scene,
            KindArgument::Head => Kind::Head,
            KindArgument::Spring => Kind::Spring,
            KindArgument::Lidar => Kind::Lidar,
            KindArgument::Imu => Kind::Imu,
            KindArgument::Clock => Kind::Clock,
            KindArgument::Faults => Kind::Faults,
            KindArgument::Motion => Kind::Motion,
            KindArgument::Estimator => Kind::Estimator,
            KindArgument::Study => Kind::Study,
            KindArgument::Experiment => Kind::Experiment,
        }
    }
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    match &arguments.command {
        Command::List { kind } => list(kind.map(Kind::from), global)?,
        Command::Show { kind, name } => output::write_to_stdout(&find((*kind).into(), name)?.text)?,
        Command::Schema { kind } => {
            let text = serde_json::to_string_pretty(&schema((*kind).into()))? + "\n";
            output::write_to_stdout(&text)?;
        }
        Command::Reference { kind } => {
            let kind = (*kind).into();
            output::write_to_stdout(&reference::markdown(kind, &schema(kind)))?;
        }
    }
    Ok(Completion::Done)
}

fn list(wanted: Option<Kind>, global: &Global) -> anyhow::Result<()> {
    let kinds: Vec<Kind> = Kind::ALL.into_iter().filter(|kind| wanted.is_none_or(|wanted| wanted == *kind)).collect();
    let width = kinds.iter().map(|kind| kind.folder().len()).max().unwrap_or_default();
    let line = |kind: &Kind| format!("{:width$}  {}", kind.folder(), names(*kind).join(", "));
    let lines = kinds.iter().map(|kind| zsim_report::wrapped(&line(kind), &" ".repeat(width + 2)));
    let figures = kinds.iter().map(|kind| (kind.folder().to_owned(), json!(names(*kind)))).collect();
    output::print_result(global, &lines.collect::<String>(), serde_json::Value::Object(figures), None)
}

/// The JSON schema of a kind of spec.
fn schema(kind: Kind) -> Schema {
    match kind {
        Kind::Scene => schema_for!(SceneSpec),
        Kind::Head => schema_for!(HeadSpec),
        Kind::Spring => schema_for!(SpringSpec),
        Kind::Lidar => schema_for!(LidarSpec),
        Kind::Imu => schema_for!(ImuSpec),
        Kind::Clock => schema_for!(ClocksSpec),
        Kind::Faults => schema_for!(FaultsSpec),
        Kind::Motion => schema_for!(MotionSpec),
        Kind::Estimator => schema_for!(EstimatorSpec),
        Kind::Study => study_schema(),
        Kind::Experiment => schema_for!(ExperimentSpec),
    }
}

/// The schema of a study: a sweep or the design of a spring.
fn study_schema() -> Schema {
    let mut generator = SchemaGenerator::default();
    let alternatives = [generator.subschema_for::<SweepSpec>(), generator.subschema_for::<DesignSpec>()];
    let definitions = generator.take_definitions(true);
    json_schema!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "anyOf": alternatives,
        "$defs": definitions
    })
}
