//! What came of runs: rows, and the parts that they are kept in.

use super::folder::Unit;
use super::table::{Column, Held, Table, TableWriter};
use super::{Measure, Sweep};
use crate::study::StudyError;
use std::error::Error;

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
        table.finish()
    }

    /// The columns of a unit's part: a measure each, errors, times; `None` while it is not done.
    pub(super) fn kept(&self, unit: &Unit) -> Result<Option<Vec<Column>>, StudyError> {
        let Some(table) = Table::open(&self.part(unit))? else { return Ok(None) };
        let columns = self.part_columns();
        let columns: Vec<(&str, Held)> = columns.iter().map(|(name, held)| (name.as_str(), *held)).collect();
        let mut kept = Vec::new();
        for group in 0..table.groups() {
            kept = table.read(group, &columns)?;
        }
        Ok(Some(kept))
    }

    pub(super) fn is_done(&self, unit: &Unit) -> bool {
        self.part(unit).is_file()
    }
}
