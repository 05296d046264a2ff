//! The console blocks of the documents: each command runs, and prints what the document shows.
//!
//! `CONTRIBUTING.md` has the notation. `ZSIM_DOCUMENTS=write` updates the outputs in the documents.

mod compare;
mod parse;
mod run;

use super::documents::{markdown, root};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Reads README.md, the pages of the book, the READMEs of the examples, and the golden outputs of `tests/golden`: paths
/// relative to the repository, and texts.
fn documents() -> Vec<(PathBuf, String)> {
    let mut files = markdown("docs");
    files.append(&mut markdown("examples"));
    files.append(&mut markdown("tests/golden"));
    files.insert(PathBuf::from("README.md"));
    let with_text = |file: PathBuf| {
        let text = std::fs::read_to_string(root().join(&file)).unwrap();
        (file, text)
    };
    files.into_iter().map(with_text).collect()
}

/// Runs a document, updates it if asked to, and returns what is wrong and the number of executed blocks.
fn check(file: &Path, text: &str, with_long: bool) -> (Vec<String>, usize) {
    let outcome = run::run(text, with_long).unwrap();
    let mut problems = outcome.problems;
    if std::env::var_os("ZSIM_DOCUMENTS").is_some_and(|value| value == "write") {
        if outcome.text != text {
            std::fs::write(root().join(file), &outcome.text).unwrap();
        }
    } else {
        problems.extend(outcome.differences);
    }
    let problems = problems.iter().map(|problem| format!("{}, {problem}", file.display()));
    (problems.collect(), outcome.executed)
}

/// Separates the tests of the short and of the long blocks: both may write the same files.
static DOCUMENTS: Mutex<()> = Mutex::new(());

/// Runs the documents that have a console block, or with `with_long` those that have a long one.
fn check_all(with_long: bool) {
    let _guard = DOCUMENTS.lock().unwrap_or_else(PoisonError::into_inner);
    let (mut problems, mut executed) = (Vec::new(), 0);
    for (file, text) in documents() {
        let is_run = |block: &parse::Block| block.language == "console" && (block.marks.is_long == with_long);
        if parse::blocks(&text).iter().any(is_run) {
            let (found, count) = check(&file, &text, with_long);
            problems.extend(found);
            executed += count;
        }
    }
    println!("{executed} console blocks executed");
    let hint = "ZSIM_DOCUMENTS=write cargo test --release document_blocks updates the documents";
    assert!(problems.is_empty(), "{}\n{hint}", problems.join("\n\n"));
}

#[test]
fn documents_show_what_the_commands_print() {
    check_all(false);
}

#[test]
#[ignore = "takes minutes; .ci/full runs it"]
fn documents_that_take_long_run() {
    check_all(true);
}

/// Classifies a block: what is done with it, or why it is not allowed.
fn class(block: &parse::Block) -> Result<String, String> {
    let language = block.language.as_str();
    match (language, block.marks.not_run.as_deref()) {
        ("console", None) => Ok(if block.marks.is_long { "executed by .ci/full" } else { "executed" }.to_owned()),
        ("console", Some(_)) => Err("a console block is executed: use sh".to_owned()),
        (_, Some(reason)) if parse::REASONS.contains(&reason) => Ok(format!("not run: {reason}")),
        (_, Some(reason)) => Err(format!("unknown reason: {reason}; known are {}", parse::REASONS.join(", "))),
        ("" | "sh" | "bash" | "shell" | "text" | "python", None) => {
            Err(format!("a block `{language}` is neither console nor marked `<!-- not run: REASON -->`"))
        }
        (_, None) => Ok(language.to_owned()),
    }
}

#[test]
fn each_block_is_executed_or_has_a_reason() {
    let (mut counts, mut problems) = (BTreeMap::<String, usize>::new(), Vec::new());
    for (file, text) in documents() {
        for block in parse::blocks(&text) {
            match class(&block) {
                Ok(class) => *counts.entry(class).or_default() += 1,
                Err(problem) => problems.push(format!("{}, line {}: {problem}", file.display(), block.body.start)),
            }
        }
    }
    for (class, count) in counts {
        println!("{count:3} {class}");
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// Runs a document from a text; returns the numbers of problems and differences, and the updated text.
fn outcome(text: &str) -> (usize, usize, String) {
    let outcome = run::run(text, false).unwrap();
    (outcome.problems.len(), outcome.differences.len(), outcome.text)
}

#[test]
fn a_false_number_or_word_fails_and_is_rewritten() {
    let document = |shown: &str| format!("# Title\n\n```console\n$ echo 'error 2.87 mm'\n{shown}\n```\n\nText\n");
    let right = document("error 2.87 mm");
    for agreeing in ["error 2.87 mm", "error 2.86 mm", "error 2.9 mm", "error [..] mm", "..."] {
        assert_eq!(outcome(&document(agreeing)).1, 0, "{agreeing}");
    }
    for wrong in ["error 2.84 mm", "error 2.90 mm", "errors 2.87 mm", "error 2.87 m", ""] {
        assert_eq!(outcome(&document(wrong)), (0, 1, right.clone()), "{wrong}");
    }
}

#[test]
fn commands_share_a_folder_and_state_their_exit_code() {
    let text = "<!-- setup: printf 'b\\n' > c -->\n<!-- exit 3 -->\n\n```console\n$ cat c > a\n$ cat \\\n  a\nb\n$ exit 3\n```\n";
    assert_eq!(outcome(text), (0, 0, text.to_owned()));
    assert_eq!(outcome(&text.replace("exit 3 --", "exit 4 --")).0, 1);
    assert_eq!(outcome(&text.replace("<!-- exit 3 -->\n", "")).0, 1);
    assert_eq!(outcome(&text.replace("printf", "no-such-command")).0, 1);
    assert_eq!(outcome(&text.replace("<!-- exit 3 -->", "<!-- long -->")).0, 0);
}

#[test]
fn odd_documents_are_refused_without_a_panic() {
    for text in
        ["```", "```console", "```console\n$ ", "<!--", "```\n```\n```", "<!-- exit x -->\n```console\n$ true\n```"]
    {
        assert_eq!(outcome(text).0, 0, "{text}");
    }
    assert_eq!(outcome("```console\nno command\n```\n").0, 1);
    let indented = "- item\n\n  ```console\n  $ echo é\n  é\n  ```\n";
    assert_eq!(outcome(indented), (0, 0, indented.to_owned()));
}

#[test]
fn each_block_without_a_known_reason_is_refused() {
    let class_of = |text: &str| parse::blocks(text).first().map(class);
    assert_eq!(class_of("<!-- not run: cargo -->\n```sh\ncargo test\n```\n"), Some(Ok("not run: cargo".to_owned())));
    assert_eq!(class_of("```ron\n()\n```\n"), Some(Ok("ron".to_owned())));
    let refused = ["```sh\nls\n```", "<!-- not run: laziness -->\n```sh\nls\n```", "```\nls\n```", "```python\n1\n```"];
    for text in refused {
        assert!(matches!(class_of(text), Some(Err(_))), "{text}");
    }
    // A mark belongs to the next block only.
    let text = "<!-- not run: cargo -->\ntext\n```sh\nls\n```";
    assert!(matches!(class_of(text), Some(Err(_))));
}
