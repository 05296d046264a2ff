//! Runs the console blocks of one document.

use super::compare::{Numbers, align, rewrite};
use super::parse::{self, Block, Step};
use std::path::Path;
use std::process::{Command, Stdio};

/// What the run of a document gave.
pub struct Outcome {
    /// The document with the outputs of the commands.
    pub text: String,
    /// Commands that failed, and outputs that differ from the document, with the line of the block.
    pub problems: Vec<String>,
    pub differences: Vec<String>,
    pub executed: usize,
}

/// A folder in which the commands of a document run.
struct Shell {
    folder: tempfile::TempDir,
}

impl Shell {
    /// Runs a command, with zsim first on the `PATH`; returns its exit code, stdout and stderr.
    fn run(&self, command: &str) -> Result<(i32, String, String), String> {
        let zsim = Path::new(env!("CARGO_BIN_EXE_zsim")).parent().unwrap_or(Path::new("."));
        let others = std::env::var_os("PATH").unwrap_or_default();
        let paths = [zsim.to_path_buf()].into_iter().chain(std::env::split_paths(&others));
        let path = std::env::join_paths(paths).map_err(|error| error.to_string())?;
        let mut shell = Command::new("sh");
        shell.args(["-c", command]).current_dir(self.folder.path()).stdin(Stdio::null());
        shell.env("PATH", path).env("REPO", env!("CARGO_MANIFEST_DIR")).env("NO_COLOR", "1").env("COLUMNS", "80");
        let output = shell.output().map_err(|error| error.to_string())?;
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        Ok((output.status.code().unwrap_or(-1), text(&output.stdout), text(&output.stderr)))
    }

    /// Runs a command that must exit with `code`; returns the lines of its output.
    fn lines(&self, command: &str, code: i32) -> Result<Vec<String>, String> {
        let (exit, stdout, stderr) = self.run(command)?;
        if exit != code {
            return Err(format!("$ {command}\nexit code {exit}, not {code}\n{stdout}{stderr}"));
        }
        let lines = stdout.trim_end().lines().map(|line| line.trim_end().to_owned());
        Ok(lines.collect())
    }
}

/// Runs the console blocks of a document in their order; the long ones only if `with_long`.
pub fn run(text: &str, with_long: bool) -> std::io::Result<Outcome> {
    let shell = Shell { folder: tempfile::tempdir()? };
    let document: Vec<&str> = text.lines().collect();
    let mut outcome = Outcome { text: String::new(), problems: Vec::new(), differences: Vec::new(), executed: 0 };
    let mut copied = 0;
    for block in parse::blocks(text).iter().filter(|b| b.language == "console" && (with_long || !b.marks.is_long)) {
        copy(&document[copied..block.body.start], &mut outcome.text);
        let body = &document[block.body.clone()];
        let lines: Vec<String> = body.iter().map(|line| line.get(block.indent..).unwrap_or("").to_owned()).collect();
        let lines = run_block(&shell, block, lines, &mut outcome);
        let indent = " ".repeat(block.indent);
        let lines: Vec<String> = lines.iter().map(|line| format!("{indent}{line}").trim_end().to_owned()).collect();
        copy(&lines, &mut outcome.text);
        copied = block.body.end;
        outcome.executed += 1;
    }
    copy(&document[copied..], &mut outcome.text);
    Ok(outcome)
}

/// Appends lines to a text.
fn copy(lines: &[impl AsRef<str>], text: &mut String) {
    for line in lines {
        text.push_str(line.as_ref());
        text.push('\n');
    }
}

/// Runs a block; returns its lines with the outputs of the commands.
fn run_block(shell: &Shell, block: &Block, lines: Vec<String>, outcome: &mut Outcome) -> Vec<String> {
    let place = format!("line {}", block.body.start);
    let steps = block.marks.setup.iter().try_for_each(|command| shell.lines(command, 0).map(drop));
    let mut steps = match steps.and_then(|()| parse::steps(&lines)) {
        Ok(steps) => steps,
        Err(problem) => {
            outcome.problems.push(format!("{place}: {problem}"));
            return lines;
        }
    };
    let last = steps.len().saturating_sub(1);
    for (number, step) in steps.iter_mut().enumerate() {
        let code = if number == last { block.marks.exit } else { 0 };
        match run_step(shell, step, code) {
            Ok(None) => {}
            Ok(Some(difference)) => outcome.differences.push(format!("{place}: {difference}")),
            Err(problem) => outcome.problems.push(format!("{place}: {problem}")),
        }
    }
    parse::lines(&steps)
}

/// Runs a command and updates its output; returns the difference, if there is one.
fn run_step(shell: &Shell, step: &mut Step, code: i32) -> Result<Option<String>, String> {
    let command = step.command.join("\n");
    let output = shell.lines(&command, code)?;
    let shown = step.output.join("\n").trim_end().lines().map(str::to_owned).collect::<Vec<_>>();
    let is_equal = align(&shown, &output, Numbers::Rounded).is_some();
    let difference = format!("$ {command}\n--- document\n{}\n--- output\n{}", shown.join("\n"), output.join("\n"));
    step.output = rewrite(&shown, &output);
    Ok((!is_equal).then_some(difference))
}
