//! What came of runs: rows, and the parts that they are kept in.

use super::folder::Unit;
use super::identity::Identity;
use super::table::{Column, Held, Table, TableWriter};
use super::{Measure, Sweep};
use crate::study::StudyError;
use parquet::errors::ParquetError;
use std::error::Error;

/// Keys of a part's metadata: the unit that it belongs to, and a hash of its cells.
const UNIT: &str = "zsim.unit";
const CHECKSUM: &str = "zsim.checksum";

/// What is on disk of a unit.
#[derive(Debug, PartialEq)]
pub(super) enum Part {
    /// Its columns: a measure each, errors, times.
    Done(Vec<Column>),
    /// A file that is cut short or changed, or that belongs to another unit.
    Damaged,
    /// Nothing.
    Missing,
}

/// What came of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Row {
    /// A figure for each measure of the table; none where it could not be told.
    pub figures: Vec<Option<f64>>,
    /// Why the run failed, if it did.
    pub error: Option<String>,
    /// Time that it took, s.
    pub wall_s: Option<f64>,
}

impl Row {
    /// That of a run that failed by an error, which is told with its causes.
    pub fn failed_by(measures: usize, error: &StudyError) -> Self {
        let mut told = vec![error.to_string()];
        let mut cause = error.source();
        while let Some(error) = cause {
            let text = error.to_string();
            if !told.last().is_some_and(|last| last.contains(&text)) {
                told.push(text);
            }
            cause = error.source();
        }
        Self::failed(measures, &told.join(": "))
    }

    /// That of a run that failed.
    pub fn failed(measures: usize, error: &str) -> Self {
        // One line: a spec's error shows its place below it.
        let line = error.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join("; ");
        Self { figures: vec![None; measures], error: Some(line), wall_s: None }
    }
}

impl Sweep {
    fn part_columns(&self) -> Vec<(String, Held)> {
        let told = self.plan.told().into_iter().map(|measure| (measure.key().to_owned(), Held::Numbers));
        told.chain([("error".to_owned(), Held::Words), (Measure::WallS.key().to_owned(), Held::Numbers)]).collect()
    }

    /// Writes a unit's rows, whole or not at all.
    pub(super) fn keep(&self, unit: &Unit, rows: &[Row]) -> Result<(), StudyError> {
        let mut table = TableWriter::create(&self.temporary(), &self.part(unit), &self.part_columns())?;
        let measures = self.plan.told().len();
        let figures =
            |k: usize| rows.iter().map(|row| row.figures.get(k).copied().flatten().filter(|x| x.is_finite())).collect();
        let mut columns: Vec<Column> = (0..measures).map(|k| Column::Numbers(figures(k))).collect();
        columns.push(Column::Words(rows.iter().map(|row| row.error.clone()).collect()));
        columns.push(Column::Numbers(rows.iter().map(|row| row.wall_s).collect()));
        table.write(&columns)?;
        table.mark(UNIT, unit.identity.to_string());
        table.mark(CHECKSUM, checksum(&columns, rows.len()).to_string());
        table.finish()
    }

    /// What is on disk of a unit.
    ///
    /// # Errors
    /// When its file exists and cannot be opened. A damaged file is no error: the unit is to be done again.
    pub(super) fn kept(&self, unit: &Unit) -> Result<Part, StudyError> {
        match self.read(unit) {
            Ok(Some(columns)) => Ok(Part::Done(columns)),
            Ok(None) => Ok(Part::Missing),
            Err(StudyError::Table { .. }) => Ok(Part::Damaged),
            Err(error) => Err(error),
        }
    }

    /// The columns of a unit's part, if there is one: measures, errors, times. One that is cut short or changed, or
    /// that belongs to another unit, is an error of its table.
    fn read(&self, unit: &Unit) -> Result<Option<Vec<Column>>, StudyError> {
        let path = self.part(unit);
        let Some(table) = Table::open(&path)? else { return Ok(None) };
        let wrong = |what: &str| StudyError::table(&path)(ParquetError::General(what.to_owned()));
        if table.mark(UNIT) != Some(&unit.identity.to_string()) {
            return Err(wrong("belongs to another part of a sweep"));
        }
        if table.groups() != 1 || u64::try_from(table.rows()) != Ok(unit.count) {
            return Err(wrong("has another number of rows"));
        }
        let columns = self.part_columns();
        let columns: Vec<(&str, Held)> = columns.iter().map(|(name, held)| (name.as_str(), *held)).collect();
        let kept = table.read(0, &columns)?;
        let rows = unit.count as usize;
        if kept.iter().any(|column| column.len() != rows) {
            return Err(wrong("has columns of different lengths"));
        }
        if table.mark(CHECKSUM) != Some(&checksum(&kept, rows).to_string()) {
            return Err(wrong("was changed"));
        }
        Ok(Some(kept))
    }

    /// Whether a unit's part is on disk and undamaged.
    ///
    /// # Errors
    /// As [`kept`](Self::kept).
    pub(super) fn is_done(&self, unit: &Unit) -> Result<bool, StudyError> {
        Ok(matches!(self.kept(unit)?, Part::Done(_)))
    }
}

/// A hash of all cells.
fn checksum(columns: &[Column], rows: usize) -> Identity {
    let cells: Vec<String> = columns.iter().flat_map(|column| (0..rows).map(move |row| column.cell(row))).collect();
    Identity::of(cells.iter().map(String::as_bytes))
}
