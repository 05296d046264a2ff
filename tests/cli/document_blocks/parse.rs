//! Finds the fenced blocks of a Markdown file, the marks in comments before them, and the commands in console blocks.

use std::ops::Range;

/// The reasons for which a block with commands or text is not executed.
pub const REASONS: [&str; 9] =
    ["cargo", "pip", "ROS 2", "Slurm", "Kubernetes", "another program", "does not end", "minutes", "notation"];

/// A fenced block with the marks before it.
#[derive(Debug)]
pub struct Block {
    pub language: String,
    /// Indentation of the fences.
    pub indent: usize,
    /// Indices of the lines between the fences.
    pub body: Range<usize>,
    pub marks: Marks,
}

/// States how a block is executed; from the comments directly before it.
#[derive(Debug, Default)]
pub struct Marks {
    /// `<!-- exit N -->`: exit code of the last command.
    pub exit: i32,
    /// `<!-- long -->`: only the test of the long blocks executes it.
    pub is_long: bool,
    /// `<!-- not run: REASON -->`
    pub not_run: Option<String>,
    /// `<!-- setup: COMMAND -->`: executed before the block, not shown.
    pub setup: Vec<String>,
}

impl Marks {
    /// Adds the mark in a comment; other comments have no effect.
    fn add(&mut self, comment: &str) {
        if comment == "long" {
            self.is_long = true;
        } else if let Some(code) = comment.strip_prefix("exit ") {
            self.exit = code.trim().parse().unwrap_or(0);
        } else if let Some(reason) = comment.strip_prefix("not run:") {
            self.not_run = Some(reason.trim().to_owned());
        } else if let Some(command) = comment.strip_prefix("setup:") {
            self.setup.push(command.trim().to_owned());
        }
    }
}

/// A command of a console block and the output that the document shows.
#[derive(Debug, PartialEq)]
pub struct Step {
    /// The lines of the command, without the prompt.
    pub command: Vec<String>,
    pub output: Vec<String>,
}

/// Finds the fenced blocks of a Markdown file. A block that is not closed ends with the file.
pub fn blocks(text: &str) -> Vec<Block> {
    let lines: Vec<&str> = text.lines().collect();
    let (mut blocks, mut marks) = (Vec::new(), Marks::default());
    let mut at = 0;
    while at < lines.len() {
        let line = lines[at].trim();
        if line.starts_with("<!--") {
            let (comment, end) = comment_at(&lines, at);
            marks.add(&comment);
            at = end;
        } else if let Some(language) = line.strip_prefix("```") {
            let body = at + 1..closing_fence(&lines, at + 1);
            let indent = lines[at].len() - lines[at].trim_start().len();
            at = body.end + 1;
            blocks.push(Block {
                language: language.trim().to_owned(),
                indent,
                body,
                marks: std::mem::take(&mut marks),
            });
        } else {
            if !line.is_empty() {
                marks = Marks::default();
            }
            at += 1;
        }
    }
    blocks
}

/// Returns the text of the comment that starts at a line, and the line after it.
fn comment_at(lines: &[&str], start: usize) -> (String, usize) {
    let length = lines[start..].iter().position(|line| line.contains("-->")).map_or(lines.len() - start, |n| n + 1);
    let text = lines[start..start + length].join("\n");
    let text = text.trim().trim_start_matches("<!--");
    (text.split("-->").next().unwrap_or_default().trim().to_owned(), start + length)
}

/// Returns the line of the fence that closes a block, or the number of lines.
fn closing_fence(lines: &[&str], start: usize) -> usize {
    lines[start..].iter().position(|line| line.trim() == "```").map_or(lines.len(), |n| start + n)
}

/// Splits the lines of a console block into commands and their outputs.
pub fn steps(lines: &[String]) -> Result<Vec<Step>, String> {
    let mut steps: Vec<Step> = Vec::new();
    let mut is_continued = false;
    for line in lines {
        let prompt = line.strip_prefix("$ ").filter(|_| !is_continued);
        match (prompt, steps.last_mut()) {
            (Some(command), _) => steps.push(Step { command: vec![command.to_owned()], output: Vec::new() }),
            (None, Some(step)) if is_continued => step.command.push(line.clone()),
            (None, Some(step)) => step.output.push(line.clone()),
            (None, None) => return Err(format!("output without a command: {line}")),
        }
        is_continued = (prompt.is_some() || is_continued) && line.ends_with('\\');
    }
    Ok(steps)
}

/// Formats the lines of a console block; the inverse of [`steps`].
pub fn lines(steps: &[Step]) -> Vec<String> {
    let lines_of = |step: &Step| {
        let mut command = step.command.clone();
        if let Some(first) = command.first_mut() {
            first.insert_str(0, "$ ");
        }
        command.into_iter().chain(step.output.clone())
    };
    steps.iter().flat_map(lines_of).collect()
}
