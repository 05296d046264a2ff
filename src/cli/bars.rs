//! Progress bars and notes on stderr.

use super::arguments::Global;
use super::output::printable;
pub(super) use super::signals::stop_flag;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::time::Duration;
use zsim::study::{Stage, StudyEvent};

/// Steps of a full bar.
const STEPS: u64 = 1000;

/// A progress bar for the stage that runs, on a terminal; remarks above it.
pub(super) struct Bars {
    quiet: bool,
    shown: Option<(Stage, ProgressBar)>,
}

impl Bars {
    pub(super) fn new(global: &Global) -> Self {
        Self { quiet: global.quiet, shown: None }
    }

    /// Shows the messages of an experiment.
    pub(super) fn tell(&mut self, news: StudyEvent) {
        if self.quiet {
            return;
        }
        match news {
            StudyEvent::Note(text) => self.remark(text),
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

    /// Prints a remark above the bar.
    pub(super) fn remark(&self, text: &str) {
        if self.quiet {
            return;
        }
        match &self.shown {
            Some((_, bar)) => bar.suspend(|| eprintln!("note: {}", printable(text))),
            None => eprintln!("note: {}", printable(text)),
        }
    }

    fn bar_of(&mut self, stage: Stage, has_end: bool) -> &ProgressBar {
        if self.shown.as_ref().is_none_or(|(shown, _)| *shown != stage) {
            self.finish();
            let bar = bar(has_end);
            bar.set_prefix(name(stage));
            return &self.shown.insert((stage, bar)).1;
        }
        &self.shown.get_or_insert_with(|| (stage, ProgressBar::hidden())).1
    }

    /// Takes the bar away.
    pub(super) fn finish(&mut self) {
        if let Some((_, bar)) = self.shown.take() {
            bar.finish_and_clear();
        }
    }
}

/// A progress bar on a terminal for work that threads do in pieces; removed when it is dropped.
pub(super) struct WorkBar(ProgressBar);

impl WorkBar {
    /// A bar that is called `name`; none when the command is to be quiet.
    pub(super) fn new(global: &Global, name: &'static str) -> Self {
        if global.quiet {
            return Self(ProgressBar::hidden());
        }
        let bar = bar(true);
        bar.set_prefix(name);
        Self(bar)
    }

    /// Shows the current task.
    pub(super) fn say(&self, what: String) {
        self.0.set_message(what);
    }

    /// Shows the fraction of the work that is done.
    pub(super) fn show(&self, share: f64) {
        self.0.set_position((share * STEPS as f64) as u64);
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
