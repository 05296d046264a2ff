//! The documents: the book has every page, and relative links lead to files and headings.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// All Markdown files in `folder`, relative to the repository.
pub fn markdown(folder: &str) -> BTreeSet<PathBuf> {
    let mut files = BTreeSet::new();
    let mut folders = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                files.insert(path.strip_prefix(root()).unwrap().to_path_buf());
            }
        }
    }
    files
}

/// The lines of a Markdown file that are not in a code block.
fn prose(text: &str) -> impl Iterator<Item = &str> {
    let mut is_code = false;
    text.lines().filter(move |line| {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        !is_code && !is_fence
    })
}

/// The targets of the relative links and pictures in a Markdown file.
fn links(text: &str) -> Vec<&str> {
    prose(text)
        .flat_map(|line| line.split("](").skip(1))
        .filter_map(|rest| rest.split_once(')').map(|(target, _)| target))
        .filter(|target| !target.contains("://") && !target.starts_with("mailto:"))
        .collect()
}

/// The anchors of the headings of a Markdown file, as GitHub and mdBook name them.
fn anchors(text: &str) -> BTreeSet<String> {
    let headings = prose(text).filter(|line| line.starts_with('#'));
    headings
        .map(|line| {
            let title = line.trim_start_matches('#').trim().to_lowercase();
            title
                .chars()
                .filter(|c| c.is_alphanumeric() || "-_ ".contains(*c))
                .map(|c| if c == ' ' { '-' } else { c })
                .collect()
        })
        .collect()
}

/// A path without `.` and `..`.
fn normal(path: &Path) -> PathBuf {
    let mut parts = Vec::new();
    for part in path.components() {
        match part {
            Component::ParentDir => drop(parts.pop()),
            Component::CurDir => {}
            other => parts.push(other),
        }
    }
    parts.into_iter().collect()
}

#[test]
fn the_book_has_every_page_once() {
    let summary = std::fs::read_to_string(root().join("docs/SUMMARY.md")).unwrap();
    let chapters: Vec<PathBuf> = links(&summary).into_iter().map(|target| Path::new("docs").join(target)).collect();
    let mut pages = markdown("docs");
    pages.remove(Path::new("docs/SUMMARY.md"));
    let listed: BTreeSet<PathBuf> = chapters.iter().cloned().collect();
    assert_eq!(listed, pages, "docs/SUMMARY.md (left) and the files in docs/ (right) differ");
    assert_eq!(chapters.len(), listed.len(), "a chapter is listed twice");
}

#[test]
fn relative_links_lead_to_files_and_headings() {
    let mut files = markdown("docs");
    files.append(&mut markdown("examples"));
    files.extend(["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(PathBuf::from));
    let mut broken = Vec::new();
    for file in &files {
        let text = std::fs::read_to_string(root().join(file)).unwrap();
        for link in links(&text) {
            let (path, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target = if path.is_empty() { file.clone() } else { normal(&file.parent().unwrap().join(path)) };
            // A page of the book has no access to files outside docs/.
            let leaves_book = file.starts_with("docs") && !target.starts_with("docs");
            let exists = root().join(&target).exists();
            let has_heading = || anchors(&std::fs::read_to_string(root().join(&target)).unwrap()).contains(anchor);
            if leaves_book || !exists || !(anchor.is_empty() || has_heading()) {
                broken.push(format!("{}: {link}", file.display()));
            }
        }
    }
    assert!(broken.is_empty(), "links without target, or out of the book:\n{}", broken.join("\n"));
}

#[test]
fn links_anchors_and_code_blocks_are_recognised() {
    let text = "# A `b`, c\n[x](y.md#z) and ![p](../q.png), [w](https://example.org)\n```\n# no [n](m)\n```\n";
    assert_eq!(links(text), ["y.md#z", "../q.png"]);
    assert_eq!(anchors(text), BTreeSet::from(["a-b-c".to_owned()]));
    assert_eq!(normal(Path::new("docs/guide/../a/./b.md")), Path::new("docs/a/b.md"));
}
