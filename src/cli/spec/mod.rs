//! `zsim spec`: lists, shows and documents the specs.

mod reference;

use super::arguments::Global;
use super::{Completion, output};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand};
use serde_json::json;
use zsim_base::spec::{Kind, find, names};
use zsim_study::spec_types::schema;

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
        #[arg(value_parser = kind())]
        kind: Option<Kind>,
    },
    /// Print the text of a spec
    #[command(after_help = "Example:\n  zsim spec show head handheld > my_head.ron")]
    Show {
        /// The kind
        #[arg(value_parser = kind())]
        kind: Kind,
        /// A name that `zsim spec list` prints, or a file
        name: String,
    },
    /// Print the JSON schema of a kind of spec
    ///
    /// RON and JSON have the same structure here: RON's (a: 1) is JSON's {"a": 1}, Variant(x) is {"Variant": x}.
    #[command(after_help = "Example:\n  zsim spec schema head > head.schema.json")]
    Schema {
        /// The kind
        #[arg(value_parser = kind())]
        kind: Kind,
    },
    /// Print every key of a kind of spec with type, unit, default and range, as Markdown
    #[command(after_help = "Example:\n  zsim spec reference head > head.md")]
    Reference {
        /// The kind
        #[arg(value_parser = kind())]
        kind: Kind,
    },
}

/// Parses a kind of spec.
fn kind() -> impl TypedValueParser<Value = Kind> {
    let keys = PossibleValuesParser::new(Kind::ALL.map(Kind::key));
    keys.try_map(|key| Kind::of_input(&key).ok_or("no such kind"))
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    match &arguments.command {
        Command::List { kind } => return list(*kind, global),
        Command::Show { kind, name } => output::write_to_stdout(&find(*kind, name)?.text)?,
        Command::Schema { kind } => {
            let text = serde_json::to_string_pretty(&schema(*kind))? + "\n";
            output::write_to_stdout(&text)?;
        }
        Command::Reference { kind } => {
            output::write_to_stdout(&reference::markdown(*kind, &schema(*kind)))?;
        }
    }
    Ok(Completion::Done)
}

fn list(wanted: Option<Kind>, global: &Global) -> anyhow::Result<Completion> {
    let kinds: Vec<Kind> = Kind::ALL.into_iter().filter(|kind| wanted.is_none_or(|wanted| wanted == *kind)).collect();
    let width = kinds.iter().map(|kind| kind.folder().len()).max().unwrap_or_default();
    let line = |kind: &Kind| format!("{:width$}  {}", kind.folder(), names(*kind).join(", "));
    let lines = kinds.iter().map(|kind| zsim_report::wrapped(&line(kind), &" ".repeat(width + 2)));
    let figures = kinds.iter().map(|kind| (kind.folder().to_owned(), json!(names(*kind)))).collect();
    output::print_result(global, &lines.collect::<String>(), serde_json::Value::Object(figures), None)
}
