//! Merges the files of batches into one table, with the same bytes for any order and division of the work.

use super::folder::Batch;
use super::outcome::{RunOutcome, Stored};
use super::table::{Column, ColumnType, TableWriter, open, read_columns};
use super::{Measure, Shard, Sweep};
use crate::StudyError;
use serde::Serialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use zsim_base::files::write_text;
use zsim_base::spec::{SpecError, split_unit};

/// Progress of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SweepStatus {
    /// Total number of runs.
    pub points: u64,
    /// Finished runs.
    pub done: u64,
    /// Finished runs that failed.
    pub failed: u64,
    /// Runs that are not finished or whose files are damaged; `zsim sweep run` runs them.
    pub missing: u64,
    /// Missing runs whose files are damaged or belong to other runs.
    pub damaged: u64,
    /// Extrapolated computing time of the missing runs on one thread, s.
    pub thread_s_left: Option<f64>,
}

impl Sweep {
    /// Progress of a shard of the sweep.
    ///
    /// # Errors
    /// If a file cannot be opened.
    pub fn status(&self, shard: Shard) -> Result<SweepStatus, StudyError> {
        let mut counter = ProgressCounter::default();
        for batch in shard.select(&self.jobs).flatten().map(|batch| &self.batches[*batch as usize]) {
            counter.add(batch, &self.read_batch(batch)?);
        }
        Ok(counter.status())
    }

    /// Writes `table.csv`, its schema `table.schema.json`, and `times.csv`: one row per finished run, in the order of the plan.
    ///
    /// The table depends only on the plan and on the set of finished runs; computing times are in a file of their own. At
    /// most one batch is in memory.
    ///
    /// # Errors
    /// If a file cannot be opened, or if the tables cannot be written.
    pub fn merge(&self) -> Result<SweepStatus, StudyError> {
        let mut table = TableWriter::create(&self.temporary(), &self.table(), &self.table_columns())?;
        let mut times = TableWriter::create(&self.temporary(), &self.times(), &self.time_columns())?;
        let mut counter = ProgressCounter::default();
        for batch in &self.batches {
            let stored = self.read_batch(batch)?;
            counter.add(batch, &stored);
            let Stored::Done(outcomes) = stored else { continue };
            table.write(&self.table_cells(batch, &outcomes))?;
            times.write(&self.time_cells(batch, &outcomes))?;
        }
        times.finish()?;
        write_text(&self.temporary(), &self.folder.join("table.schema.json"), &table_schema(&self.table_columns())?)?;
        table.finish()?;
        Ok(counter.status())
    }

    /// Cells of a batch in the table of results.
    fn table_cells(&self, batch: &Batch, outcomes: &[RunOutcome]) -> Vec<Column> {
        let identity = |run: u64| Some(self.identities[run as usize].to_string());
        let mut cells = vec![index_cells(batch)];
        cells.extend(self.plan.setting_cells(&batch.runs().collect::<Vec<_>>()));
        cells.extend(number_cells(self.plan.result_measures().len(), outcomes, |outcome| &outcome.figures));
        cells.push(Column::Text(outcomes.iter().map(|outcome| outcome.error.clone()).collect()));
        cells.push(Column::Text(batch.runs().map(identity).collect()));
        cells
    }

    /// Cells of a batch in the table of computing times.
    fn time_cells(&self, batch: &Batch, outcomes: &[RunOutcome]) -> Vec<Column> {
        let times = number_cells(self.plan.time_measures().len(), outcomes, |outcome| &outcome.times);
        std::iter::once(index_cells(batch)).chain(times).collect()
    }

    /// Path of the table of results.
    pub(super) fn table(&self) -> PathBuf {
        self.folder.join("table.csv")
    }

    /// Path of the table of computing times.
    fn times(&self) -> PathBuf {
        self.folder.join("times.csv")
    }

    /// Reads columns of a merged table.
    ///
    /// # Errors
    /// If it does not exist, or if it is damaged.
    pub(super) fn read_merged(&self, path: &Path, columns: &[(&str, ColumnType)]) -> Result<Vec<Column>, StudyError> {
        let unmerged = || SpecError::plain(path.display().to_string(), "does not exist: merge the sweep first");
        read_columns(open(path)?.ok_or_else(unmerged)?, columns).map_err(StudyError::table(path))
    }

    /// Reads a measure of all rows of its merged table; `None` for a missing figure.
    ///
    /// # Errors
    /// As [`read_merged`](Self::read_merged).
    pub(super) fn read_measure(&self, measure: Measure) -> Result<Vec<Option<f64>>, StudyError> {
        let path = if measure.is_time() { self.times() } else { self.table() };
        let columns = self.read_merged(&path, &[(measure.key(), ColumnType::Numbers)])?;
        Ok(columns.into_iter().flat_map(Column::numbers).collect())
    }

    /// The error of the first failed run of a merged sweep, if one failed.
    ///
    /// # Errors
    /// If the sweep is not merged, or its table cannot be read.
    pub fn first_failure(&self) -> Result<Option<String>, StudyError> {
        let columns = self.read_merged(&self.table(), &[("error", ColumnType::Text)])?;
        Ok(columns.into_iter().flat_map(Column::texts).flatten().find(|error| !error.is_empty()))
    }

    fn table_columns(&self) -> Vec<(String, ColumnType)> {
        let mut columns = vec![("point".to_owned(), ColumnType::Counts)];
        columns.extend(self.plan.setting_columns());
        columns.extend(number_columns(&self.plan.result_measures()));
        columns.extend([("error".to_owned(), ColumnType::Text), ("id".to_owned(), ColumnType::Text)]);
        columns
    }

    fn time_columns(&self) -> Vec<(String, ColumnType)> {
        let mut columns = vec![("point".to_owned(), ColumnType::Counts)];
        columns.extend(number_columns(&self.plan.time_measures()));
        columns
    }
}

fn number_columns(measures: &[Measure]) -> impl Iterator<Item = (String, ColumnType)> {
    measures.iter().map(|measure| (measure.key().to_owned(), ColumnType::Numbers))
}

/// Cells of the indices of the runs.
fn index_cells(batch: &Batch) -> Column {
    Column::Counts(batch.runs().map(|run| Some(run as i64)).collect())
}

/// Cells of `count` measures; a run that failed early has fewer figures.
fn number_cells(
    count: usize,
    outcomes: &[RunOutcome],
    figures: fn(&RunOutcome) -> &[Option<f64>],
) -> impl Iterator<Item = Column> {
    let cell = move |outcome: &RunOutcome, k: usize| figures(outcome).get(k).copied().flatten();
    (0..count).map(move |k| Column::Numbers(outcomes.iter().map(|outcome| cell(outcome, k)).collect()))
}

/// Types and units of the columns as a Frictionless Table Schema (<https://datapackage.org/standard/table-schema/>).
fn table_schema(columns: &[(String, ColumnType)]) -> Result<String, StudyError> {
    let field = |(name, column_type): &(String, ColumnType)| {
        let json_type = match column_type {
            ColumnType::Counts => "integer",
            ColumnType::Numbers => "number",
            ColumnType::Text => "string",
        };
        let mut field = json!({ "name": name, "type": json_type });
        if let Some(unit) = split_unit(name).1.filter(|_| *column_type == ColumnType::Numbers) {
            field["unit"] = unit.into();
        }
        if let Some(measure) = Measure::all().find(|measure| measure.key() == name) {
            field["description"] = measure.quantity().into();
        }
        field
    };
    let fields: Vec<Value> = columns.iter().map(field).collect();
    let schema = json!({ "fields": fields, "missingValues": [""], "primaryKey": ["point"] });
    Ok(serde_json::to_string_pretty(&schema)? + "\n")
}

/// Counts finished, failed and missing runs.
#[derive(Default)]
struct ProgressCounter {
    done: u64,
    failed: u64,
    missing: u64,
    damaged: u64,
    wall_s: f64,
}

impl ProgressCounter {
    fn add(&mut self, batch: &Batch, stored: &Stored) {
        let Stored::Done(outcomes) = stored else {
            self.missing += batch.count;
            self.damaged += if *stored == Stored::Damaged { batch.count } else { 0 };
            return;
        };
        self.done += batch.count;
        self.failed += outcomes.iter().filter(|outcome| outcome.error.is_some()).count() as u64;
        // The computing time of the run is the first.
        self.wall_s += outcomes.iter().filter_map(|outcome| *outcome.times.first()?).sum::<f64>();
    }

    fn status(&self) -> SweepStatus {
        let mean_s = (self.done > 0).then(|| self.wall_s / self.done as f64);
        SweepStatus {
            points: self.done + self.missing,
            done: self.done,
            failed: self.failed,
            missing: self.missing,
            damaged: self.damaged,
            thread_s_left: mean_s.map(|mean_s| mean_s * self.missing as f64),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_schema_has_the_type_and_the_unit_of_each_column() {
        let columns = [
            ("point", ColumnType::Counts),
            ("material", ColumnType::Text),
            ("head.wire_diameter_mm", ColumnType::Numbers),
            ("drift_m_per_min", ColumnType::Numbers),
        ];
        let columns = columns.map(|(name, column_type)| (name.to_owned(), column_type));
        let schema: Value = serde_json::from_str(&table_schema(&columns).unwrap()).unwrap();
        let expected = json!({
            "fields": [
                { "name": "point", "type": "integer" },
                { "name": "material", "type": "string" },
                { "name": "head.wire_diameter_mm", "type": "number", "unit": "mm" },
                { "name": "drift_m_per_min", "type": "number", "unit": "m/min", "description": "Drift, open loop" },
            ],
            "missingValues": [""],
            "primaryKey": ["point"],
        });
        assert_eq!(schema, expected);
    }
}
