//! `--live`: a page on the loopback that shows a run while it runs.
//!
//! The run passes its data to a queue that never blocks it. A thread keeps the state of the run for the pages, and
//! another one serves them. Neither changes the results.

mod connections;
mod frame;
mod growing;
mod map;
mod path;
mod queue;
mod request;
mod run;
mod server;
mod shared;
mod viewers;

use self::frame::Framer;
pub(super) use self::frame::verdict;
use self::queue::Queue;
use self::run::LiveRun;
use self::shared::Shared;
use super::message;
use anyhow::Context;
use clap::Args;
use std::path::Path;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use zsim_base::printable::printable;
use zsim_report::page::{LiveEnd, LivePage, LiveVerdict};
use zsim_run::{EstimateResult, RunError, RunEvent};

/// Time between two changes of the state: pages are updated up to 20 times a second.
const CHANGE_PERIOD: Duration = Duration::from_millis(50);
/// Maximum time that open pages get at the end for the final state and the report.
const FAREWELL: Duration = Duration::from_secs(10);
/// Time between checks whether all pages have left.
const FAREWELL_STEP: Duration = Duration::from_millis(10);

/// Whether to show the run while it runs.
#[derive(Args)]
pub(super) struct LiveArguments {
    /// Show the run on a page while it runs, at http://127.0.0.1:PORT/ [default: a free port]
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = "0")]
    live: Option<u16>,
}

impl LiveArguments {
    /// Starts the server of the page and prints its address to stderr; `None` without `--live`.
    pub(super) fn start(&self, page: impl FnOnce() -> LivePage) -> anyhow::Result<Option<Live>> {
        let Some(port) = self.live else { return Ok(None) };
        let page = page();
        let shared = Arc::new(Shared::new(page.html(), LiveRun::new(page.volume)));
        let address = server::start(port, shared.clone())
            .with_context(|| format!("--live {port}: the port cannot be opened on 127.0.0.1"))?;
        message::line(&format!("live: http://{address}/"));
        Live::new(shared).map(Some)
    }
}

/// A run that is shown on a page.
pub(super) struct Live {
    framer: Framer,
    queue: Arc<Queue>,
    shared: Arc<Shared>,
    updating: JoinHandle<()>,
}

impl Live {
    fn new(shared: Arc<Shared>) -> anyhow::Result<Self> {
        let queue = Arc::new(Queue::default());
        let (frames, state) = (queue.clone(), shared.clone());
        let update = move || {
            while let Some(frames) = frames.take() {
                state.change(|run| frames.into_iter().for_each(|frame| run.take(frame)));
                std::thread::sleep(CHANGE_PERIOD);
            }
        };
        let updating = std::thread::Builder::new().name("live state".to_owned()).spawn(update)?;
        Ok(Self { framer: Framer::default(), queue, shared, updating })
    }

    /// Passes an event of the run on to the pages.
    pub(super) fn observe(&mut self, event: &RunEvent) {
        if let Some(frame) = self.framer.frame(event) {
            self.queue.push(frame);
        }
    }

    /// Shows the end of the run, and waits until all open pages have it and the report, but at most some seconds.
    pub(super) fn finish(self, outcome: &Result<EstimateResult, RunError>, folder: &Path) {
        self.queue.close();
        // A thread that has panicked has left a state that can still be shown.
        let _ = self.updating.join();
        // With --metrics-only there is no report.
        let report = Some(folder.join("report.html")).filter(|report| report.is_file());
        let path = report.as_ref().map(|report| {
            let path = std::path::absolute(report).unwrap_or_else(|_| report.clone());
            printable(&path.display().to_string()).into_owned()
        });
        match outcome {
            Ok(EstimateResult { metrics, .. }) => {
                let end = LiveEnd { sentence: "the run is complete".to_owned(), report: path };
                self.shared.end(end, LiveVerdict::of(metrics), report.as_deref());
            }
            Err(error) => {
                let sentence = match error {
                    RunError::Stopped(_) => "the run was stopped".to_owned(),
                    error => format!("the run failed: {error}"),
                };
                self.shared.end(LiveEnd { sentence, report: None }, None, None);
            }
        }
        let until = Instant::now() + FAREWELL;
        while self.shared.viewers().are_present() && Instant::now() < until {
            std::thread::sleep(FAREWELL_STEP);
        }
    }
}
