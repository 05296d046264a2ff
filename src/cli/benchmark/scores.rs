//! Tables of the scores of a benchmark.

use super::suite::{Item, Suite};
use serde_json::{Map, Value, json};
use zsim_evaluation::TrajectoryErrors;
use zsim_report::{Content, Document, Table};

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

/// Maximum number of failures in the list.
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

/// The content of `scores.csv`: one row per recording and system.
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
    let rows = scores(suite, systems).map(|(item, system, score)| {
        let values = values(score);
        let cell =
            |key: &str| values.get(key).filter(|value| !value.is_null()).map(Value::to_string).unwrap_or_default();
        let failure = score.failure.clone().unwrap_or_default();
        [item.name.clone(), system.name.clone()].into_iter().chain(KEYS.map(cell)).chain([failure]).collect()
    });
    Table::new(["recording", "system"].into_iter().chain(KEYS).chain(["failure"]), rows).csv()
}

/// The scores, recording by recording.
fn scores<'a>(suite: &'a Suite, systems: &'a [System]) -> impl Iterator<Item = (&'a Item, &'a System, &'a Score)> {
    let of_recording = |(index, item)| systems.iter().map(move |system| (item, system, &system.scores[index]));
    suite.recordings.iter().enumerate().flat_map(of_recording)
}

/// The result for the terminal and the page.
pub(super) fn document(suite: &Suite, systems: &[System], min_coverage: f64) -> Document {
    let summary = format!(
        "{} on the {} recordings of the suite {}, simulated by zsim {}. Medians over all recordings; one without a trajectory, \
         or of which less than {:.0} % is estimated, counts as failed, with an infinite error.",
        systems.iter().map(|system| system.name.as_str()).collect::<Vec<_>>().join(", "),
        suite.recordings.len(),
        suite.suite,
        suite.version,
        100.0 * min_coverage,
    );
    let mut document = Document::new("Benchmark", summary);
    document.footer = "APE: position error after a rigid alignment, as evo_ape -a. RPE: over 1 m of path. Drift: after an alignment over the \
                       first 20 s."
        .to_owned();
    let names = FIGURES.map(|(name, _)| name);
    let header = ["system", "succeeded"].into_iter().chain(names).chain(["worst APE"]);
    document.heading("Systems");
    document.add(Table::new(header, systems.iter().map(System::row)));
    let failed = |(item, system, score): (&Item, &System, &Score)| {
        Some(format!("{}, {}: {}", system.name, item.name, score.failure.as_ref()?))
    };
    let mut failures: Vec<String> = scores(suite, systems).filter_map(failed).collect();
    if failures.len() > MAX_FAILURES {
        let more = format!("and {} more, in scores.csv", failures.len() - MAX_FAILURES);
        failures.truncate(MAX_FAILURES);
        failures.push(more);
    }
    document.heading("Failed");
    document.add(Content::List(failures));
    let rows = scores(suite, systems).map(|(item, system, score)| {
        let cells = FIGURES.map(|(_, of)| length(score.errors.as_ref().and_then(of)));
        let failure = score.failure.clone().unwrap_or_default();
        [item.name.clone(), system.name.clone()].into_iter().chain(cells).chain([failure]).collect()
    });
    document.heading("Recordings");
    document.add_detail(Table::new(["recording", "system"].into_iter().chain(names).chain(["failure"]), rows));
    document
}
