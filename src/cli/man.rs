//! `zsim man`: manual pages of all commands.

use super::arguments::{Global, OutArguments};
use super::{Completion, output};
use anyhow::Context;
use clap::{Args, Command};
use clap_mangen::Man;
use serde_json::json;
use std::path::{Path, PathBuf};
use zsim_base::files::replace_text;

/// Write the manual pages of all commands: zsim.1, zsim-simulate.1, zsim-sweep-plan.1, ...
///
/// With --force the pages are added to a folder that has others, for example ~/.local/share/man/man1.
#[derive(Args)]
#[command(after_help = "Example:\n  zsim man --out ~/.local/share/man/man1 --force")]
pub(super) struct Arguments {
    #[command(flatten)]
    out: OutArguments,
}

pub(super) fn run(arguments: &Arguments, command: Command, global: &Global) -> anyhow::Result<Completion> {
    let wanted = arguments.out.out.clone().unwrap_or_else(|| PathBuf::from("man"));
    let pages = pages(command)?;
    let folder = output::folder(&wanted, arguments.out.force)?;
    for page in &pages {
        replace_text(&folder.join(&page.file), &page.roff)?;
    }
    let files: Vec<&Path> = pages.iter().map(|page| page.file.as_path()).collect();
    let words = format!("{} manual pages", pages.len());
    output::print_result(global, &words, json!({ "pages": files }), Some(&folder))
}

/// A manual page in section 1.
struct Page {
    file: PathBuf,
    roff: String,
}

/// The page of the command itself, and one of each subcommand that is not hidden.
fn pages(command: Command) -> anyhow::Result<Vec<Page>> {
    // Without this, `zsim help` and the `help` of each subcommand have pages too.
    let mut command = command.disable_help_subcommand(true);
    command.build();
    let mut pages = Vec::new();
    add_pages(&command, &mut pages)?;
    Ok(pages)
}

fn add_pages(command: &Command, pages: &mut Vec<Page>) -> anyhow::Result<()> {
    let man = Man::new(command.clone()).source(format!("zsim {}", env!("CARGO_PKG_VERSION"))).manual("zsim manual");
    let mut roff = Vec::new();
    man.render(&mut roff).with_context(|| format!("the manual page of {} cannot be made", command.get_name()))?;
    let roff = without_hyphens(&with_examples(&String::from_utf8(roff)?));
    pages.push(Page { file: PathBuf::from(man.get_filename()), roff });
    let shown = command.get_subcommands().filter(|subcommand| !subcommand.is_hide_set());
    shown.into_iter().try_for_each(|subcommand| add_pages(subcommand, pages))
}

/// The page with the text after the help, which is the examples, as lines in a section of that name.
fn with_examples(roff: &str) -> String {
    let Some((before, text)) = roff.split_once("\n.SH EXTRA\n") else { return roff.to_owned() };
    let (text, after) = text.split_at(text.find("\n.SH ").unwrap_or(text.len()));
    let text = ["Examples:\n", "Example:\n"].into_iter().find_map(|title| text.strip_prefix(title)).unwrap_or(text);
    format!("{before}\n.SH EXAMPLES\n.nf\n{}\n.fi{after}", text.trim_end())
}

/// The page without hyphenation, which would change commands and names.
fn without_hyphens(roff: &str) -> String {
    let title_end = roff.find("\n.SH ").unwrap_or(0);
    format!("{}\n.nh{}", &roff[..title_end], &roff[title_end..])
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    use std::collections::BTreeSet;

    /// Names of the pages that the help of each command lists: from its text, not from clap's tree.
    fn listed(command: &Command, name: &str, into: &mut BTreeSet<String>) {
        into.insert(format!("{name}.1"));
        let help = command.clone().render_long_help().to_string();
        let list = help.split("Commands:\n").nth(1).and_then(|rest| rest.split("\n\n").next()).unwrap_or_default();
        // The lines that continue a description are indented further.
        let entries = list.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   "));
        for entry in entries.filter_map(|line| line.split_whitespace().next()).filter(|entry| *entry != "help") {
            let subcommand = command.find_subcommand(entry).unwrap();
            listed(subcommand, &format!("{name}-{entry}"), into);
        }
    }

    #[test]
    fn every_command_of_the_help_has_a_page_and_no_other() {
        let command = crate::Cli::command();
        let mut expected = BTreeSet::new();
        listed(&command, "zsim", &mut expected);
        let pages = pages(command).unwrap();
        let files: BTreeSet<String> = pages.iter().map(|page| page.file.display().to_string()).collect();
        assert_eq!(files, expected);
        assert!(files.contains("zsim-sweep-plan.1") && !files.contains("zsim-sweep-task.1"));
        for page in &pages {
            assert!(page.roff.contains("\n.nh\n.SH NAME\n") && !page.roff.contains("\nExample"), "{}", page.roff);
            assert!(
                page.roff.contains("\n.SH EXAMPLES\n.nf\n  zsim")
                    || page.file.to_string_lossy().matches('-').count() > 1
            );
        }
    }
}
