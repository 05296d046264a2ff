//! Parts become one table: the same bytes, whoever did them, when, and in which order.

use super::folder::{STRETCH, Unit};
use super::part::Part;
use super::table::{Column, Held, TableWriter, quoted};
use super::{Measure, Share, Sweep};
use crate::study::StudyError;
use crate::study::atomic_file::AtomicFile;
use serde::Serialize;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

/// How far a sweep is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Status {
    /// Runs.
    pub points: u64,
    /// Those that are done.
    pub done: u64,
    /// Those of them that failed.
    pub failed: u64,
    /// Those that are not done, or whose parts are damaged: `zsim sweep run` does them.
    pub missing: u64,
    /// Those of the missing runs whose parts are damaged, or belong to other runs.
    pub damaged: u64,
    /// Time that one thread takes for what is missing, if it goes on as it did so far, s.
    pub thread_s_left: Option<f64>,
}

impl Sweep {
    /// How far it is, or a share of it.
    ///
    /// # Errors
    /// When a part cannot be opened.
    pub fn status(&self, share: Share) -> Result<Status, StudyError> {
        let mut tally = Tally::default();
        for unit in share.of(&self.tasks).flatten() {
            let unit = &self.units[*unit as usize];
            tally.take(unit, &self.kept(unit)?);
        }
        Ok(tally.status())
    }

    /// Makes `table.parquet`, `table.csv` and `times.parquet` of what is done, a row a run in the order of the plan.
    /// The two tables depend on the plan and on which of its runs are done, and on nothing else; times are kept apart.
    /// Memory holds a stretch of rows.
    ///
    /// # Errors
    /// When a part cannot be opened, or the tables cannot be written.
    pub fn merge(&self) -> Result<Status, StudyError> {
        let mut tables = Tables::create(self)?;
        let mut tally = Tally::default();
        let mut stretch = self.empty_stretch();
        for unit in &self.units {
            let kept = self.kept(unit)?;
            tally.take(unit, &kept);
            let Part::Done(kept) = kept else { continue };
            stretch.take(self, unit, kept);
            if stretch.numbers.len() as u64 >= STRETCH {
                tables.write(self, std::mem::replace(&mut stretch, self.empty_stretch()))?;
            }
        }
        if !stretch.numbers.is_empty() {
            tables.write(self, stretch)?;
        }
        tables.finish()?;
        Ok(tally.status())
    }

    /// The table of results.
    pub(super) fn table(&self) -> PathBuf {
        self.folder.join("table.parquet")
    }

    /// The table of the times that runs took.
    pub(super) fn times(&self) -> PathBuf {
        self.folder.join("times.parquet")
    }

    fn table_columns(&self) -> Vec<(String, Held)> {
        let mut columns = vec![("point".to_owned(), Held::Counts)];
        columns.extend(self.plan.setting_columns());
        columns.extend(self.plan.told().into_iter().map(|measure| (measure.key().to_owned(), Held::Numbers)));
        columns.extend([("error".to_owned(), Held::Words), ("id".to_owned(), Held::Words)]);
        columns
    }

    fn empty_stretch(&self) -> Stretch {
        let figures = vec![Vec::new(); self.plan.told().len()];
        Stretch { numbers: Vec::new(), figures, errors: Vec::new(), times: Vec::new() }
    }
}

/// Rows that are gathered.
struct Stretch {
    numbers: Vec<u64>,
    figures: Vec<Vec<Option<f64>>>,
    errors: Vec<Option<String>>,
    times: Vec<Option<f64>>,
}

impl Stretch {
    fn take(&mut self, sweep: &Sweep, unit: &Unit, kept: Vec<Column>) {
        self.numbers.extend(unit.first..unit.first + unit.count);
        let told = sweep.plan.told().len();
        for (k, column) in kept.into_iter().enumerate() {
            match k {
                k if k < told => self.figures[k].extend(column.numbers()),
                k if k == told => self.errors.extend(column.words()),
                _ => self.times.extend(column.numbers()),
            }
        }
    }
}

/// The files that are being written.
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
        let of_times = [("point".to_owned(), Held::Counts), (Measure::WallS.key().to_owned(), Held::Numbers)];
        let times = TableWriter::create(&temporary, &sweep.times(), &of_times)?;
        Ok(Self { parquet, csv, times })
    }

    fn write(&mut self, sweep: &Sweep, stretch: Stretch) -> Result<(), StudyError> {
        let identity = |index: &u64| Some(sweep.identities[*index as usize].to_string());
        let mut columns = vec![Column::Counts(stretch.numbers.iter().map(|index| Some(*index as i64)).collect())];
        columns.extend(sweep.plan.setting_stretch(&stretch.numbers));
        columns.extend(stretch.figures.into_iter().map(Column::Numbers));
        columns.push(Column::Words(stretch.errors));
        columns.push(Column::Words(stretch.numbers.iter().map(identity).collect()));
        self.parquet.write(&columns)?;
        self.times.write(&[columns[0].clone(), Column::Numbers(stretch.times)])?;
        for row in 0..stretch.numbers.len() {
            let cells: Vec<String> = columns.iter().map(|column| column.cell(row)).collect();
            let line = writeln!(self.csv, "{}", cells.join(","));
            line.map_err(StudyError::file(self.csv.get_ref().target()))?;
        }
        Ok(())
    }

    fn finish(self) -> Result<(), StudyError> {
        self.parquet.finish()?;
        self.times.finish()?;
        let place = self.csv.get_ref().target().to_owned();
        let flushed = self.csv.into_inner().map_err(std::io::IntoInnerError::into_error);
        flushed.map_err(StudyError::file(&place))?.finish()
    }
}

/// Counts runs.
#[derive(Default)]
struct Tally {
    done: u64,
    failed: u64,
    missing: u64,
    damaged: u64,
    wall_s: f64,
}

impl Tally {
    fn take(&mut self, unit: &Unit, part: &Part) {
        let Part::Done(kept) = part else {
            self.missing += unit.count;
            self.damaged += if *part == Part::Damaged { unit.count } else { 0 };
            return;
        };
        self.done += unit.count;
        for column in kept {
            if let Column::Words(errors) = column {
                self.failed += errors.iter().flatten().count() as u64;
            }
        }
        if let Some(Column::Numbers(times)) = kept.last() {
            self.wall_s += times.iter().flatten().sum::<f64>();
        }
    }

    fn status(&self) -> Status {
        let each_s = (self.done > 0).then(|| self.wall_s / self.done as f64);
        Status {
            points: self.done + self.missing,
            done: self.done,
            failed: self.failed,
            missing: self.missing,
            damaged: self.damaged,
            thread_s_left: each_s.map(|each_s| each_s * self.missing as f64),
        }
    }
}
