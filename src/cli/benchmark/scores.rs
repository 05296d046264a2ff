//! Tables of the scores of a benchmark.

use super::suite::Suite;
use serde_json::{Map, Value, json};
use zsim_evaluation::TrajectoryErrors;
use zsim_report::page::{BenchmarkPage, PageTable};

/// A system with a score for each recording of the suite.
pub(super) struct System {
    pub(super) name: String,
    pub(super) scores: Vec<Score>,
}

/// The score of a system on a recording.
pub(super) struct Score {
    pub(super) errors: Option<TrajectoryErrors>,
    /// Why it counts as failed.
    pub(super) failure: Option<String>,
}

/// A figure of a trajectory; `None` if it is too short for it.
type Figure = fn(&TrajectoryErrors) -> Option<f64>;

/// Figures of the tables: header, and the figure of a trajectory in SI units.
const FIGURES: [(&str, Figure); 4] = [
    ("APE", |errors| Some(errors.position_rmse_m)),
    ("APE max", |errors| Some(errors.position_max_m)),
    ("RPE 1 m", |errors| errors.per_metre.map(|error| error.position_rmse_m)),
    ("drift/min", |errors| errors.drift.map(|drift| drift.position_m_per_min)),
];

/// Maximum number of failures in the terminal.
const MAX_FAILURES: usize = 12;

impl Score {
    /// A figure; infinite if the recording failed, `None` if the trajectory is too short for it.
    fn figure(&self, of: Figure) -> Option<f64> {
        match (&self.errors, &self.failure) {
            (Some(errors), None) => of(errors),
            _ => Some(f64::INFINITY),
        }
    }
}

impl System {
    fn succeeded(&self) -> usize {
        self.scores.iter().filter(|score| score.failure.is_none()).count()
    }

    /// The median of a figure; `None` if no trajectory has it.
    fn median(&self, of: Figure) -> Option<f64> {
        let mut figures: Vec<f64> = self.scores.iter().filter_map(|score| score.figure(of)).collect();
        figures.sort_by(f64::total_cmp);
        let middle = figures.len().checked_sub(1)?;
        Some(0.5 * (figures[middle / 2] + figures[middle.div_ceil(2)]))
    }

    fn row(&self) -> Vec<String> {
        let succeeded = format!("{} of {}", self.succeeded(), self.scores.len());
        let worst = self.scores.iter().filter_map(|score| score.figure(FIGURES[0].1)).fold(0.0, f64::max);
        let medians = FIGURES.map(|(_, of)| length(self.median(of)));
        [self.name.clone(), succeeded].into_iter().chain(medians).chain([length(Some(worst))]).collect()
    }
}

/// A length, or a dash.
fn length(length_m: Option<f64>) -> String {
    length_m.filter(|length_m| length_m.is_finite()).map_or_else(|| "-".to_owned(), zsim_report::length)
}

fn systems_header() -> Vec<&'static str> {
    ["", "succeeded"].into_iter().chain(FIGURES.map(|(name, _)| name)).chain(["worst APE"]).collect()
}

/// The table of the systems for the terminal.
pub(super) fn systems_table(systems: &[System]) -> String {
    zsim_report::table(&systems_header(), &systems.iter().map(System::row).collect::<Vec<_>>(), true)
}

/// Why trajectories count as failed, for the terminal; empty if none does.
pub(super) fn failures(suite: &Suite, systems: &[System]) -> String {
    let of_system = |system: &System| {
        let scores = suite.recordings.iter().zip(&system.scores);
        let failed = scores.filter_map(|(item, score)| Some((item.name.clone(), score.failure.clone()?)));
        failed.map(|(item, failure)| format!("  {}, {item}: {failure}\n", system.name)).collect::<Vec<_>>()
    };
    let lines: Vec<String> = systems.iter().flat_map(of_system).collect();
    let shown = lines.iter().take(MAX_FAILURES).map(String::as_str).collect::<String>();
    match lines.len() {
        0 => String::new(),
        count if count > MAX_FAILURES => {
            format!("\nfailed:\n{shown}  and {} more, in scores.csv\n", count - MAX_FAILURES)
        }
        _ => format!("\nfailed:\n{shown}"),
    }
}

/// The errors by key, and the failure.
fn values(score: &Score) -> Map<String, Value> {
    let mut values = score.errors.as_ref().map(zsim_report::trajectory_figures).unwrap_or_default();
    values.insert("failure".to_owned(), json!(score.failure));
    values
}

/// All figures, for `scores.json`.
pub(super) fn figures(suite: &Suite, systems: &[System], min_coverage: f64) -> Value {
    let finite = |figure: Option<f64>| figure.filter(|figure| figure.is_finite());
    let system = |system: &System| {
        let runs: Map<String, Value> = (suite.recordings.iter().zip(&system.scores))
            .map(|(item, score)| (item.name.clone(), Value::Object(values(score))))
            .collect();
        json!({
            "name": system.name,
            "succeeded": system.succeeded(),
            "median_position_rmse_m": finite(system.median(FIGURES[0].1)),
            "median_relative_error_per_metre_m": finite(system.median(FIGURES[2].1)),
            "recordings": runs,
        })
    };
    json!({
        "suite": suite.suite,
        "version": suite.version,
        "min_coverage": min_coverage,
        "recordings": suite.recordings.len(),
        "systems": systems.iter().map(system).collect::<Vec<_>>(),
    })
}

/// One row per recording and system, for `scores.csv`.
pub(super) fn runs_csv(suite: &Suite, systems: &[System]) -> String {
    const KEYS: [&str; 7] = [
        "coverage",
        "position_rmse_m",
        "position_max_m",
        "rotation_rmse_deg",
        "relative_error_per_metre_m",
        "relative_error_per_second_m",
        "drift_m_per_min",
    ];
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let mut text = format!("recording,system,{},failure\n", KEYS.join(","));
    for (index, item) in suite.recordings.iter().enumerate() {
        for system in systems {
            let score = &system.scores[index];
            let values = values(score);
            let cell = |key: &&str| values.get(*key).filter(|value| !value.is_null()).map(Value::to_string);
            let cells: Vec<String> = KEYS.iter().map(|key| cell(key).unwrap_or_default()).collect();
            let failure = score.failure.as_deref().map(quoted).unwrap_or_default();
            text += &format!("{},{},{},{failure}\n", quoted(&item.name), quoted(&system.name), cells.join(","));
        }
    }
    text
}

/// The page.
pub(super) fn page(suite: &Suite, systems: &[System], min_coverage: f64) -> String {
    let owned = |header: Vec<&str>| header.into_iter().map(str::to_owned).collect::<Vec<_>>();
    let run = |(index, system): (usize, &System)| {
        let score = &system.scores[index];
        let cells = FIGURES.map(|(_, of)| length(score.errors.as_ref().and_then(of)));
        let failure = score.failure.clone().unwrap_or_default();
        let named = [suite.recordings[index].name.clone(), system.name.clone()];
        named.into_iter().chain(cells).chain([failure]).collect::<Vec<String>>()
    };
    let runs = (0..suite.recordings.len()).flat_map(|index| systems.iter().map(move |system| (index, system)));
    let header = ["recording", "system"].into_iter().chain(FIGURES.map(|(name, _)| name)).chain(["failure"]).collect();
    let mut systems_header = owned(systems_header());
    "system".clone_into(&mut systems_header[0]);
    BenchmarkPage {
        summary: format!(
            "{} on the {} recordings of the suite {}, simulated by zsim {}. Medians over all recordings; one without a trajectory, \
             or of which less than {:.0} % is estimated, counts as failed, with an infinite error.",
            systems.iter().map(|system| system.name.as_str()).collect::<Vec<_>>().join(", "),
            suite.recordings.len(),
            suite.suite,
            suite.version,
            100.0 * min_coverage,
        ),
        systems: PageTable {
            title: "Systems".to_owned(),
            header: systems_header,
            rows: systems.iter().map(System::row).collect(),
            ..PageTable::default()
        },
        runs: PageTable { title: "Recordings".to_owned(), header: owned(header), rows: runs.map(run).collect(), ..PageTable::default() },
    }
    .html()
}
