//! `zsim check`: are these scenes and specs right?

use super::arguments::Global;
use super::{Completion, message, output, usage};
use clap::Args;
use serde_json::json;
use std::path::Path;
use zsim_base::similar::did_you_mean;
use zsim_base::spec::{Kind, Source, SpecError, Tree, find, kind_by_keys, names};
use zsim_study::spec_types;

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
        return spec_types::check(kind, &find(kind, file)?).map(|warnings| (kind, warnings));
    }
    let path = Path::new(file);
    let source = match path.is_file() {
        true => Source::read(path)?,
        false => {
            let found = Kind::ALL.into_iter().find_map(|kind| Some((kind, find(kind, file).ok()?)));
            let Some((kind, source)) = found else {
                let error = SpecError::plain(file, "no such file, and no scene or spec of this name");
                let known: Vec<String> = Kind::ALL.into_iter().flat_map(names).collect();
                let question = did_you_mean(file, known.iter().map(String::as_str));
                return Err(question.map_or(error.clone(), |question| error.with_help(question)));
            };
            return spec_types::check(kind, &source).map(|warnings| (kind, warnings));
        }
    };
    kind_by_trying(&source)
}

/// The kind whose parser accepts the text, checked; if none does, the error of the kind that has the most of its keys.
fn kind_by_trying(source: &Source) -> Result<Checked, SpecError> {
    if let Some(kind) = Kind::ALL.into_iter().find(|kind| spec_types::parse(*kind, source).is_ok()) {
        return spec_types::check(kind, source).map(|warnings| (kind, warnings));
    }
    let found = kind_by_keys(&Tree::read(source)?.keys());
    let error = found.and_then(|found| spec_types::parse(found.kind, source).err());
    Err(error.unwrap_or_else(|| SpecError::plain(source.name.clone(), "is neither a scene nor a spec")))
}

fn kind_by_folder(file: &str) -> Option<Kind> {
    let folder = Path::new(file).parent()?.file_name()?.to_str()?;
    Kind::ALL.into_iter().find(|kind| kind.folder().rsplit('/').next() == Some(folder))
}
