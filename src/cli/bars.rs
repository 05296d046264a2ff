//! Progress bars and notes on stderr.

use super::arguments::Global;
use super::output::printable;
pub(super) use super::signals::stop_flag;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::time::Duration;
use zsim::study::{Stage, StudyEvent};

/// Number of steps of a bar.
const STEPS: u64 = 1000;

/// Progress bar of the current stage, with notes above it.
pub(super) struct Bars {
    quiet: bool,
    current: Option<(Stage, ProgressBar)>,
}

impl Bars {
    pub(super) fn new(global: &Global) -> Self {
        Self { quiet: global.quiet, current: None }
    }

    /// Displays an event of an experiment.
    pub(super) fn update(&mut self, event: StudyEvent) {
        if self.quiet {
            return;
        }
        match event {
            StudyEvent::Data(_) => {}
            StudyEvent::Note(text) => self.note(text),
            StudyEvent::Progress { stage, fraction, done_s } => {
                let bar = self.bar_of(stage, fraction.is_some());
                match fraction {
                    Some(fraction) => bar.set_position((fraction * STEPS as f64) as u64),
                    None => bar.tick(),
                }
                if done_s > 0.0 {
                    bar.set_message(format!("{done_s:.0} s of data"));
                }
            }
        }
    }

    /// Prints a note above the bar.
    pub(super) fn note(&self, text: &str) {
        if self.quiet {
            return;
        }
        match &self.current {
            Some((_, bar)) => bar.suspend(|| eprintln!("note: {}", printable(text))),
            None => eprintln!("note: {}", printable(text)),
        }
    }

    fn bar_of(&mut self, stage: Stage, has_end: bool) -> &ProgressBar {
        if self.current.as_ref().is_none_or(|(current, _)| *current != stage) {
            self.finish();
            let bar = bar(has_end);
            bar.set_prefix(name(stage));
            return &self.current.insert((stage, bar)).1;
        }
        &self.current.get_or_insert_with(|| (stage, ProgressBar::hidden())).1
    }

    /// Removes the bar.
    pub(super) fn finish(&mut self) {
        if let Some((_, bar)) = self.current.take() {
            bar.finish_and_clear();
        }
    }
}

/// Progress bar of parallel work; removed when it is dropped.
pub(super) struct WorkBar(ProgressBar);

impl WorkBar {
    /// Creates a bar with the prefix `name`; hidden with `--quiet`.
    pub(super) fn new(global: &Global, name: &'static str) -> Self {
        if global.quiet {
            return Self(ProgressBar::hidden());
        }
        let bar = bar(true);
        bar.set_prefix(name);
        Self(bar)
    }

    /// Sets the name of the current task.
    pub(super) fn set_task(&self, task: String) {
        self.0.set_message(task);
    }

    /// Sets the completed fraction of the work.
    pub(super) fn set_fraction(&self, fraction: f64) {
        self.0.set_position((fraction * STEPS as f64) as u64);
    }
}

impl Drop for WorkBar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// A bar on stderr, drawn only on terminals.
fn bar(has_end: bool) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr());
    bar.set_style(style(has_end));
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

fn style(has_end: bool) -> ProgressStyle {
    let template =
        if has_end { "{prefix:12} {bar:30} {percent:>3} %  {eta:>4}  {msg}" } else { "{prefix:12} {spinner} {msg}" };
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

fn name(stage: Stage) -> &'static str {
    match stage {
        Stage::Simulating => "simulating",
        Stage::Estimating => "estimating",
        Stage::ClosingLoops => "closing loops",
        Stage::Registering => "registering",
        Stage::Bounding => "bounding",
        Stage::Reporting => "reporting",
    }
}
