//! Merges part files into one table, with the same bytes for any order and division of the work.

use super::folder::{ROWS_PER_GROUP, Unit};
use super::part::Part;
use super::table::{Column, ColumnType, Table, TableWriter, quoted};
use super::{Measure, Shard, Sweep};
use crate::StudyError;
use crate::atomic_file::AtomicFile;
use serde::Serialize;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use zsim_base::spec::SpecError;

/// Progress of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SweepStatus {
    /// Total number of runs.
    pub points: u64,
    /// Finished runs.
    pub done: u64,
    /// Finished runs that failed.
    pub failed: u64,
    /// Runs that are not finished or whose parts are damaged; `zsim sweep run` runs them.
    pub missing: u64,
    /// Missing runs whose parts are damaged or belong to other runs.
    pub damaged: u64,
    /// Extrapolated computing time of the missing runs on one thread, s.
    pub thread_s_left: Option<f64>,
}

impl Sweep {
    /// Progress of a shard of the sweep.
    ///
    /// # Errors
    /// If a part cannot be opened.
    pub fn status(&self, shard: Shard) -> Result<SweepStatus, StudyError> {
        let mut counter = ProgressCounter::default();
        for unit in shard.select(&self.tasks).flatten() {
            let unit = &self.units[*unit as usize];
            counter.add(unit, &self.read_part(unit)?);
        }
        Ok(counter.status())
    }

    /// Writes `table.parquet`, `table.csv` and `times.parquet`: one row per finished run, in the order of the plan.
    ///
    /// The two tables depend only on the plan and on the set of finished runs; computing times are in a file of their own.
    /// At most one row group is in memory.
    ///
    /// # Errors
    /// If a part cannot be opened, or if the tables cannot be written.
    pub fn merge(&self) -> Result<SweepStatus, StudyError> {
        let mut tables = Tables::create(self)?;
        let mut counter = ProgressCounter::default();
        let mut buffer = self.empty_buffer();
        for unit in &self.units {
            let part = self.read_part(unit)?;
            counter.add(unit, &part);
            let Part::Done { columns, .. } = part else { continue };
            buffer.append(self, unit, columns);
            if buffer.numbers.len() as u64 >= ROWS_PER_GROUP {
                tables.write(self, std::mem::replace(&mut buffer, self.empty_buffer()))?;
            }
        }
        if !buffer.numbers.is_empty() {
            tables.write(self, buffer)?;
        }
        tables.finish()?;
        Ok(counter.status())
    }

    /// Path of the table of results.
    pub(super) fn table(&self) -> PathBuf {
        self.folder.join("table.parquet")
    }

    /// Opens a merged table.
    ///
    /// # Errors
    /// If it does not exist, or if it is damaged.
    pub(super) fn open_merged(&self, path: &Path) -> Result<Table, StudyError> {
        let unmerged = || SpecError::plain(path.display().to_string(), "does not exist: merge the sweep first");
        Ok(Table::open(path)?.ok_or_else(unmerged)?)
    }

    /// Path of the table of computing times.
    fn times(&self) -> PathBuf {
        self.folder.join("times.parquet")
    }

    /// Path of the table that contains `measure`.
    pub(super) fn table_of(&self, measure: Measure) -> PathBuf {
        if measure.is_time() { self.times() } else { self.table() }
    }

    fn table_columns(&self) -> Vec<(String, ColumnType)> {
        let mut columns = vec![("point".to_owned(), ColumnType::Counts)];
        columns.extend(self.plan.setting_columns());
        columns.extend(
            self.plan.result_measures().into_iter().map(|measure| (measure.key().to_owned(), ColumnType::Numbers)),
        );
        columns.extend([("error".to_owned(), ColumnType::Text), ("id".to_owned(), ColumnType::Text)]);
        columns
    }

    fn empty_buffer(&self) -> RowBuffer {
        let figures = vec![Vec::new(); self.plan.result_measures().len()];
        let times = vec![Vec::new(); self.plan.time_measures().len()];
        RowBuffer { numbers: Vec::new(), figures, errors: Vec::new(), times }
    }
}

/// Rows of the next row group.
struct RowBuffer {
    numbers: Vec<u64>,
    figures: Vec<Vec<Option<f64>>>,
    errors: Vec<Option<String>>,
    times: Vec<Vec<Option<f64>>>,
}

impl RowBuffer {
    fn append(&mut self, sweep: &Sweep, unit: &Unit, columns: Vec<Column>) {
        self.numbers.extend(unit.first..unit.first + unit.count);
        let measures = sweep.plan.result_measures().len();
        for (k, column) in columns.into_iter().enumerate() {
            match k {
                k if k < measures => self.figures[k].extend(column.numbers()),
                k if k == measures => self.errors.extend(column.texts()),
                _ => self.times[k - measures - 1].extend(column.numbers()),
            }
        }
    }
}

/// Writers of the three files.
struct Tables {
    parquet: TableWriter,
    csv: BufWriter<AtomicFile>,
    times: TableWriter,
}

impl Tables {
    fn create(sweep: &Sweep) -> Result<Self, StudyError> {
        let (temporary, columns) = (sweep.temporary(), sweep.table_columns());
        let parquet = TableWriter::create(&temporary, &sweep.table(), &columns)?;
        let mut csv = BufWriter::new(AtomicFile::new(&temporary, &sweep.folder.join("table.csv"))?);
        let names: Vec<String> = columns.iter().map(|(name, _)| quoted(name)).collect();
        writeln!(csv, "{}", names.join(",")).map_err(StudyError::file(csv.get_ref().target()))?;
        let times = sweep.plan.time_measures().into_iter();
        let times = times.map(|measure| (measure.key().to_owned(), ColumnType::Numbers));
        let time_columns: Vec<_> = [("point".to_owned(), ColumnType::Counts)].into_iter().chain(times).collect();
        let times = TableWriter::create(&temporary, &sweep.times(), &time_columns)?;
        Ok(Self { parquet, csv, times })
    }

    fn write(&mut self, sweep: &Sweep, buffer: RowBuffer) -> Result<(), StudyError> {
        let identity = |index: &u64| Some(sweep.identities[*index as usize].to_string());
        let mut columns = vec![Column::Counts(buffer.numbers.iter().map(|index| Some(*index as i64)).collect())];
        columns.extend(sweep.plan.setting_cells(&buffer.numbers));
        columns.extend(buffer.figures.into_iter().map(Column::Numbers));
        columns.push(Column::Text(buffer.errors));
        columns.push(Column::Text(buffer.numbers.iter().map(identity).collect()));
        self.parquet.write(&columns)?;
        let times = buffer.times.into_iter().map(Column::Numbers);
        self.times.write(&[columns[0].clone()].into_iter().chain(times).collect::<Vec<_>>())?;
        for row in 0..buffer.numbers.len() {
            let cells: Vec<String> = columns.iter().map(|column| column.cell(row)).collect();
            let line = writeln!(self.csv, "{}", cells.join(","));
            line.map_err(StudyError::file(self.csv.get_ref().target()))?;
        }
        Ok(())
    }

    fn finish(self) -> Result<(), StudyError> {
        self.parquet.finish()?;
        self.times.finish()?;
        let target = self.csv.get_ref().target().to_owned();
        let flushed = self.csv.into_inner().map_err(std::io::IntoInnerError::into_error);
        flushed.map_err(StudyError::file(&target))?.finish()
    }
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
    fn add(&mut self, unit: &Unit, part: &Part) {
        let Part::Done { columns, .. } = part else {
            self.missing += unit.count;
            self.damaged += if *part == Part::Damaged { unit.count } else { 0 };
            return;
        };
        self.done += unit.count;
        // The computing time of the run follows the errors.
        let Some(at) = columns.iter().position(|column| matches!(column, Column::Text(_))) else { return };
        if let Column::Text(errors) = &columns[at] {
            self.failed += errors.iter().flatten().count() as u64;
        }
        if let Some(Column::Numbers(times)) = columns.get(at + 1) {
            self.wall_s += times.iter().flatten().sum::<f64>();
        }
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
