//! Outcomes of runs, and the part files that store them.

use super::folder::Unit;
use super::identity::ContentHash;
use super::table::{Column, ColumnType, open, read_columns, to_csv};
use super::{Measure, Sweep};
use crate::StudyError;
use serde::de::DeserializeOwned;
use std::error::Error;
use std::io::{Read, Seek, SeekFrom};
use zsim_base::files::FileError;
use zsim_base::files::write_bytes;
use zsim_base::spec::{self, Source};

/// Length of a checksum in the first line of a part file.
const CHECKSUM_DIGITS: usize = 32;

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
    pub fn from_error(measures: usize, error: &dyn Error) -> Self {
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
        let text = |name: &str| [(name.to_owned(), ColumnType::Text)];
        measures.chain(text("error")).chain(times).chain(text("details")).collect()
    }

    /// Writes a unit's part file atomically: a line with the unit and the checksum of the rest, and a table.
    pub(super) fn write_part(&self, unit: &Unit, rows: &[RunOutcome]) -> Result<(), StudyError> {
        let (measures, times) = (self.plan.result_measures().len(), self.plan.time_measures().len());
        let cell = |figures: &[Option<f64>], k: usize| figures.get(k).copied().flatten().filter(|x| x.is_finite());
        let mut columns: Vec<Column> =
            (0..measures).map(|k| Column::Numbers(rows.iter().map(|row| cell(&row.figures, k)).collect())).collect();
        columns.push(Column::Text(rows.iter().map(|row| row.error.clone()).collect()));
        columns.extend((0..times).map(|k| Column::Numbers(rows.iter().map(|row| cell(&row.times, k)).collect())));
        columns.push(Column::Text(rows.iter().map(|row| row.details.clone()).collect()));
        let path = self.part_path(unit);
        let bytes = part_bytes(unit, &self.part_columns(), &columns).map_err(FileError::at(&path))?;
        Ok(write_bytes(&self.temporary(), &path, &bytes)?)
    }

    /// Reads a unit's part file.
    ///
    /// # Errors
    /// If the file exists and cannot be opened. A damaged file is not an error: its runs are repeated.
    pub(super) fn read_part(&self, unit: &Unit) -> Result<Part, StudyError> {
        let Some(file) = open(&self.part_path(unit))? else { return Ok(Part::Missing) };
        Ok(read_intact(file, unit, &self.part_columns()).unwrap_or(Part::Damaged))
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

/// First line of a unit's part file, up to the checksum.
fn first_words(unit: &Unit) -> String {
    format!("zsim part 1, runs {}, checksum ", unit.identity)
}

/// Content of a unit's part file.
fn part_bytes(unit: &Unit, columns: &[(String, ColumnType)], cells: &[Column]) -> std::io::Result<Vec<u8>> {
    let table = to_csv(columns, cells)?;
    let checksum = ContentHash::of_stream(&mut table.as_slice())?;
    Ok([format!("{}{checksum}\n", first_words(unit)).as_bytes(), &table].concat())
}

/// Reads a unit's part file; `None` if it is truncated, modified, or of another unit.
///
/// The checksum is compared before the table is read, so that no other file is kept in memory.
fn read_intact(mut file: impl Read + Seek, unit: &Unit, columns: &[(String, ColumnType)]) -> Option<Part> {
    let start = first_words(unit);
    let mut line = vec![0; start.len() + CHECKSUM_DIGITS + 1];
    file.read_exact(&mut line).ok()?;
    let checksum = line.strip_prefix(start.as_bytes())?;
    if checksum != format!("{}\n", ContentHash::of_stream(&mut file).ok()?).as_bytes() {
        return None;
    }
    file.seek(SeekFrom::Start(line.len() as u64)).ok()?;
    let mut columns = read_columns(file, columns).ok()?;
    let details = columns.pop()?.texts();
    let is_complete = details.len() as u64 == unit.count;
    is_complete.then(|| Part::Done { columns, details: details.into_iter().flatten().next() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn columns() -> Vec<(String, ColumnType)> {
        let of = |(name, column_type): (&str, ColumnType)| (name.to_owned(), column_type);
        [("sag_mm", ColumnType::Numbers), ("error", ColumnType::Text), ("details", ColumnType::Text)].map(of).to_vec()
    }

    fn unit_of(name: &str, count: u64) -> Unit {
        Unit { identity: ContentHash::of([name.as_bytes()]), first: 0, count }
    }

    fn read(bytes: &[u8], unit: &Unit) -> Option<Part> {
        read_intact(Cursor::new(bytes), unit, &columns())
    }

    /// A part with this table under a valid checksum.
    fn with_table(unit: &Unit, table: &str) -> Vec<u8> {
        let checksum = ContentHash::of_stream(&mut table.as_bytes()).unwrap();
        format!("{}{checksum}\n{table}", first_words(unit)).into_bytes()
    }

    #[test]
    fn a_part_is_read_back_and_damage_of_any_byte_is_found() {
        let unit = unit_of("a", 2);
        let figures = Column::Numbers(vec![Some(0.1 + 0.2), None]);
        let errors = Column::Text(vec![None, Some("no \"spring\", \u{e4}".to_owned())]);
        let details = "(\n    map: \"a,\",\r\n)\n";
        let all = [figures.clone(), errors.clone(), Column::Text(vec![Some(details.to_owned()), None])];
        let bytes = part_bytes(&unit, &columns(), &all).unwrap();
        let whole = Part::Done { columns: vec![figures, errors], details: Some(details.to_owned()) };
        assert_eq!(read(&bytes, &unit), Some(whole));
        for at in 0..bytes.len() {
            assert_eq!(read(&bytes[..at], &unit), None, "truncated to {at} bytes");
            for bit in 0..8 {
                let mut flipped = bytes.clone();
                flipped[at] ^= 1 << bit;
                assert_eq!(read(&flipped, &unit), None, "bit {bit} of byte {at}");
            }
        }
        assert_eq!(read(&[bytes.as_slice(), b"\n"].concat(), &unit), None);
        assert_eq!(read(&bytes, &unit_of("b", 2)), None, "a part of another unit");
        assert_eq!(read(&bytes, &Unit { count: 3, ..unit }), None);
    }

    #[test]
    fn foreign_files_and_invalid_cells_are_damage() {
        let unit = unit_of("a", 1);
        assert!(read(&with_table(&unit, "sag_mm,error,details\n1.5,,\n"), &unit).is_some());
        for table in [
            "",
            "sag_mm,error,details\n",
            "sag_mm,error\n1.5,\n",
            "sag_mm,error,details\nNaN,,\n",
            "sag_mm,error,details\n-inf,,\n",
            "sag_mm,error,details\n1.5,,\n1.5,,\n",
            "sag_mm,error,details\n1.5,\n",
            "\0\u{1}\u{2}",
        ] {
            assert_eq!(read(&with_table(&unit, table), &unit), None, "{table:?}");
        }
        assert_eq!(read(&[0xff; 4096], &unit), None);
    }
}
