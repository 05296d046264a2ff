//! Outcomes of runs, and the part files that store them.

use super::folder::Unit;
use super::identity::ContentHash;
use super::table::{Column, ColumnType, Table, TableWriter};
use super::{Measure, Sweep};
use crate::StudyError;
use parquet::errors::ParquetError;
use serde::de::DeserializeOwned;
use std::error::Error;
use zsim_base::spec::{self, Source};

/// Metadata keys of a part file: hash of its unit, checksum of its content, and details of its run.
const UNIT: &str = "zsim.unit";
const CHECKSUM: &str = "zsim.checksum";
const DETAILS: &str = "zsim.details";

/// State of a unit's part file.
#[derive(Debug, PartialEq)]
pub(super) enum Part {
    /// Complete.
    Done {
        /// One column per measure, errors, computing times.
        columns: Vec<Column>,
        /// Details of the run as RON, if it has any.
        details: Option<String>,
    },
    /// Truncated, modified, or of another unit.
    Damaged,
    /// No file.
    Missing,
}

/// Outcome of a run: a row of the table.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct RunOutcome {
    /// One figure per measure of the table; `None` if it could not be computed.
    pub figures: Vec<Option<f64>>,
    /// Error message of a failed run.
    pub error: Option<String>,
    /// One figure per measure of the computing time.
    pub times: Vec<Option<f64>>,
    /// What the table does not contain, as RON: the errors over time and the map of a run with timing errors.
    pub details: Option<String>,
}

impl RunOutcome {
    /// Outcome of a run that failed with `error`; the message includes its causes.
    pub fn from_error(measures: usize, error: &StudyError) -> Self {
        let mut messages = vec![error.to_string()];
        let mut cause = error.source();
        while let Some(error) = cause {
            let text = error.to_string();
            if !messages.last().is_some_and(|last| last.contains(&text)) {
                messages.push(text);
            }
            cause = error.source();
        }
        Self::failed(measures, &messages.join(": "))
    }

    /// Outcome of a run that failed with the message `error`.
    pub fn failed(measures: usize, error: &str) -> Self {
        // A cell has one line; errors of specs have several, which show the position.
        let line = error.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join("; ");
        Self { figures: vec![None; measures], error: Some(line), ..Self::default() }
    }
}

impl Sweep {
    fn part_columns(&self) -> Vec<(String, ColumnType)> {
        let numbers = |measure: Measure| (measure.key().to_owned(), ColumnType::Numbers);
        let measures = self.plan.result_measures().into_iter().map(numbers);
        let times = self.plan.time_measures().into_iter().map(numbers);
        measures.chain([("error".to_owned(), ColumnType::Text)]).chain(times).collect()
    }

    /// Writes a unit's part file atomically.
    pub(super) fn write_part(&self, unit: &Unit, rows: &[RunOutcome]) -> Result<(), StudyError> {
        let mut table = TableWriter::create(&self.temporary(), &self.part_path(unit), &self.part_columns())?;
        let (measures, times) = (self.plan.result_measures().len(), self.plan.time_measures().len());
        let cell = |figures: &[Option<f64>], k: usize| figures.get(k).copied().flatten().filter(|x| x.is_finite());
        let figures = |k: usize| Column::Numbers(rows.iter().map(|row| cell(&row.figures, k)).collect());
        let mut columns: Vec<Column> = (0..measures).map(figures).collect();
        columns.push(Column::Text(rows.iter().map(|row| row.error.clone()).collect()));
        columns.extend((0..times).map(|k| Column::Numbers(rows.iter().map(|row| cell(&row.times, k)).collect())));
        table.write(&columns)?;
        table.set_metadata(UNIT, unit.identity.to_string());
        let details = rows.iter().find_map(|row| row.details.as_deref());
        table.set_metadata(CHECKSUM, checksum(&columns, rows.len(), details).to_string());
        if let Some(details) = details {
            table.set_metadata(DETAILS, details.to_owned());
        }
        table.finish()
    }

    /// Reads a unit's part file.
    ///
    /// # Errors
    /// If the file exists and cannot be opened. A damaged file is not an error: its runs are repeated.
    pub(super) fn read_part(&self, unit: &Unit) -> Result<Part, StudyError> {
        match self.read_content(unit) {
            Err(StudyError::Table { .. }) => Ok(Part::Damaged),
            read => read,
        }
    }

    /// Content of a unit's part file.
    ///
    /// # Errors
    /// [`StudyError::Table`] if the file is truncated, modified, or of another unit.
    fn read_content(&self, unit: &Unit) -> Result<Part, StudyError> {
        let path = self.part_path(unit);
        let Some(table) = Table::open(&path)? else { return Ok(Part::Missing) };
        let damaged = |what: &str| StudyError::table(&path)(ParquetError::General(what.to_owned()));
        if table.metadata(UNIT) != Some(&unit.identity.to_string()) {
            return Err(damaged("belongs to other runs of a sweep"));
        }
        if table.groups() != 1 || u64::try_from(table.rows()) != Ok(unit.count) {
            return Err(damaged("has an unexpected number of rows"));
        }
        let columns = self.part_columns();
        let columns: Vec<(&str, ColumnType)> =
            columns.iter().map(|(name, column_type)| (name.as_str(), *column_type)).collect();
        let columns = table.read(0, &columns)?;
        let rows = unit.count as usize;
        if columns.iter().any(|column| column.len() != rows) {
            return Err(damaged("has columns of different lengths"));
        }
        let details = table.metadata(DETAILS);
        if table.metadata(CHECKSUM) != Some(&checksum(&columns, rows, details).to_string()) {
            return Err(damaged("checksum mismatch"));
        }
        Ok(Part::Done { details: details.map(str::to_owned), columns })
    }

    /// Details of all runs in the order of the plan; `None` if a run failed, is missing, or has no details.
    ///
    /// # Errors
    /// If a part cannot be opened.
    pub(crate) fn details<T: DeserializeOwned>(&self) -> Result<Option<Vec<T>>, StudyError> {
        let mut all = Vec::new();
        for unit in &self.units {
            let Part::Done { details: Some(details), .. } = self.read_part(unit)? else { return Ok(None) };
            all.push(spec::parse(&Source::in_memory("the details of a run", details))?);
        }
        Ok(Some(all))
    }

    /// The error of a study that needs all runs.
    pub(crate) fn failed(&self) -> StudyError {
        let message = format!("a run failed: see {}", self.folder.join("table.csv").display());
        StudyError::Plan { what: "study", message }
    }

    /// Whether a unit's part file exists and is undamaged.
    ///
    /// # Errors
    /// As [`read_part`](Self::read_part).
    pub(super) fn is_done(&self, unit: &Unit) -> Result<bool, StudyError> {
        Ok(matches!(self.read_part(unit)?, Part::Done { .. }))
    }
}

/// Hash of all cells as CSV text, and of the details.
fn checksum(columns: &[Column], rows: usize, details: Option<&str>) -> ContentHash {
    let cells: Vec<String> = columns.iter().flat_map(|column| (0..rows).map(move |row| column.cell(row))).collect();
    ContentHash::of(cells.iter().map(String::as_bytes).chain(details.map(str::as_bytes)))
}
