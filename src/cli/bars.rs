//! Progress bars and notes on stderr.

use super::arguments::Global;
use super::message;
pub(super) use super::signals::{end_polling, stop_flag};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use zsim_run::{RunEvent, Stage};

/// Number of steps of a bar.
const STEPS: u64 = 1000;
/// From this fraction a bar would show 100 %.
const NEAR_END: f64 = 0.995;

/// Progress bar of the current stage, with notes above it.
pub(super) struct Bars {
    quiet: bool,
    current: Option<(Stage, Bar)>,
}

impl Bars {
    pub(super) fn new(global: &Global) -> Self {
        Self { quiet: global.quiet, current: None }
    }

    /// Displays an event of an experiment.
    pub(super) fn update(&mut self, event: RunEvent) {
        if self.quiet {
            return;
        }
        match event {
            RunEvent::Data(_) => {}
            RunEvent::Note(text) => self.note(text),
            RunEvent::Progress { stage, fraction, done_s } => {
                let bar = self.bar_of(stage);
                bar.set_fraction(fraction);
                if done_s > 0.0 {
                    bar.drawn.set_message(format!("{done_s:.0} s of data"));
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
            Some((_, bar)) => bar.drawn.suspend(|| message::note(text)),
            None => message::note(text),
        }
    }

    fn bar_of(&mut self, stage: Stage) -> &Bar {
        if self.current.as_ref().is_none_or(|(current, _)| *current != stage) {
            self.finish();
        }
        &self.current.get_or_insert_with(|| (stage, Bar::new(name(stage)))).1
    }

    /// Removes the bar.
    pub(super) fn finish(&mut self) {
        if let Some((_, bar)) = self.current.take() {
            bar.drawn.finish_and_clear();
        }
    }
}

/// Progress bar of parallel work; removed when it is dropped.
pub(super) struct WorkBar(Bar);

impl WorkBar {
    /// Creates a bar with the prefix `name`; hidden with `--quiet`.
    pub(super) fn new(global: &Global, name: &'static str) -> Self {
        Self(if global.quiet { Bar::hidden() } else { Bar::new(name) })
    }

    /// Prints a note above the bar.
    pub(super) fn note(&self, text: &str) {
        self.0.drawn.suspend(|| message::note(text));
    }

    /// Sets the name of the current task.
    pub(super) fn set_task(&self, task: String) {
        self.0.drawn.set_message(task);
    }

    /// Sets the completed fraction of the work.
    pub(super) fn set_fraction(&self, fraction: f64) {
        self.0.set_fraction(Some(fraction));
    }

    /// Starts another phase, whose duration is not known.
    pub(super) fn set_phase(&self, name: &'static str) {
        self.0.drawn.set_prefix(name);
        self.0.drawn.set_message("");
        self.0.set_fraction(None);
    }
}

impl Drop for WorkBar {
    fn drop(&mut self) {
        self.0.drawn.finish_and_clear();
    }
}

/// A bar on stderr, drawn only on terminals.
///
/// Without a fraction it is a spinner. It is one at the end too: the work goes on until the bar is removed.
struct Bar {
    drawn: ProgressBar,
    is_spinner: AtomicBool,
}

impl Bar {
    fn new(name: &'static str) -> Self {
        let drawn = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr());
        drawn.set_style(style(true));
        drawn.set_prefix(name);
        drawn.enable_steady_tick(Duration::from_millis(200));
        Self { drawn, is_spinner: AtomicBool::new(true) }
    }

    fn hidden() -> Self {
        Self { drawn: ProgressBar::hidden(), is_spinner: AtomicBool::new(true) }
    }

    /// Sets the completed fraction, 0 to 1; `None` if it is not known.
    fn set_fraction(&self, fraction: Option<f64>) {
        let position =
            fraction.filter(|fraction| *fraction < NEAR_END).map(|fraction| (fraction * STEPS as f64) as u64);
        if self.is_spinner.swap(position.is_none(), Ordering::Relaxed) != position.is_none() {
            self.drawn.set_style(style(position.is_none()));
        }
        match position {
            Some(position) => self.drawn.set_position(position),
            None => self.drawn.tick(),
        }
    }
}

/// The layout of a line, which is cut off at the width of the terminal.
fn style(is_spinner: bool) -> ProgressStyle {
    let template = if is_spinner {
        "{prefix:13} {spinner} {wide_msg}"
    } else {
        "{prefix:13} {bar:30} {percent:>3} %  {eta:>4}  {wide_msg}"
    };
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

fn name(stage: Stage) -> &'static str {
    match stage {
        Stage::Simulating => "simulating",
        Stage::Estimating => "estimating",
        Stage::Evaluating => "evaluating",
        Stage::ClosingLoops => "closing loops",
        Stage::Registering => "registering",
        Stage::Bounding => "bounding",
        Stage::Reporting => "reporting",
    }
}
