//! Tables as CSV (RFC 4180), written atomically and read a row at a time.

use crate::StudyError;
use csv::{Reader, StringRecord, Writer};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use zsim_base::files;
use zsim_base::files::AtomicFile;
use zsim_base::files::FileError;

/// Type of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ColumnType {
    /// 64-bit integers.
    Counts,
    /// 64-bit floating-point numbers.
    Numbers,
    /// UTF-8 strings.
    Text,
}

/// Cells of a column; `None` is an empty cell.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Column {
    Counts(Vec<Option<i64>>),
    Numbers(Vec<Option<f64>>),
    Text(Vec<Option<String>>),
}

impl Column {
    pub fn empty(column_type: ColumnType) -> Self {
        match column_type {
            ColumnType::Counts => Self::Counts(Vec::new()),
            ColumnType::Numbers => Self::Numbers(Vec::new()),
            ColumnType::Text => Self::Text(Vec::new()),
        }
    }

    pub fn numbers(self) -> Vec<Option<f64>> {
        if let Self::Numbers(cells) = self { cells } else { Vec::new() }
    }

    pub fn texts(self) -> Vec<Option<String>> {
        if let Self::Text(cells) = self { cells } else { Vec::new() }
    }

    pub fn counts(self) -> Vec<Option<i64>> {
        if let Self::Counts(cells) = self { cells } else { Vec::new() }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        match self {
            Self::Counts(cells) => cells.len(),
            Self::Numbers(cells) => cells.len(),
            Self::Text(cells) => cells.len(),
        }
    }

    /// A cell as text; numbers are read back to the same bits.
    fn cell(&self, row: usize) -> String {
        match self {
            Self::Counts(cells) => cells[row].map_or_else(String::new, |count| count.to_string()),
            Self::Numbers(cells) => cells[row].map_or_else(String::new, |number| number.to_string()),
            Self::Text(cells) => cells[row].clone().unwrap_or_default(),
        }
    }

    /// Appends a cell; `None` if it does not have the type of the column.
    fn push(&mut self, cell: &str) -> Option<()> {
        let cell = Some(cell).filter(|cell| !cell.is_empty());
        match self {
            Self::Counts(cells) => cells.push(cell.map(str::parse).transpose().ok()?),
            Self::Numbers(cells) => {
                let number: Option<f64> = cell.map(str::parse).transpose().ok()?;
                cells.push(number);
                return number.is_none_or(f64::is_finite).then_some(());
            }
            Self::Text(cells) => cells.push(cell.map(str::to_owned)),
        }
        Some(())
    }
}

/// Writer of a table.
pub(super) struct TableWriter {
    writer: Writer<AtomicFile>,
    target: PathBuf,
}

impl TableWriter {
    /// Starts a table for `target`; it stays in `folder` until [`finish`](Self::finish) moves it.
    pub fn create(folder: &Path, target: &Path, columns: &[(String, ColumnType)]) -> Result<Self, StudyError> {
        let mut writer = Writer::from_writer(AtomicFile::new(folder, target)?);
        let written = writer.write_record(columns.iter().map(|(name, _)| name));
        written.map_err(|error| FileError::at(target)(error.into()))?;
        Ok(Self { writer, target: target.to_owned() })
    }

    /// Appends rows: cells of all columns, of equal length.
    pub fn write(&mut self, columns: &[Column]) -> Result<(), StudyError> {
        let mut rows = 0..columns.first().map_or(0, Column::len);
        let written = rows.try_for_each(|row| self.writer.write_record(columns.iter().map(|column| column.cell(row))));
        Ok(written.map_err(|error| FileError::at(&self.target)(error.into()))?)
    }

    /// Closes the table and moves it to its target.
    pub fn finish(self) -> Result<(), StudyError> {
        let flushed = self.writer.into_inner().map_err(csv::IntoInnerError::into_error);
        Ok(flushed.map_err(FileError::at(&self.target))?.finish()?)
    }
}

/// Opens a file; `None` if it does not exist.
pub(super) fn open(path: &Path) -> Result<Option<File>, StudyError> {
    match files::open(path) {
        Ok(file) => Ok(Some(file)),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(FileError::at(path)(error).into()),
    }
}

/// Reads columns of a table by name; other columns are not kept in memory.
///
/// # Errors
/// A message if the table is no CSV, has no such column, or has a cell of another type; numbers must be finite.
pub(super) fn read_columns<N: AsRef<str>>(
    table: impl Read,
    columns: &[(N, ColumnType)],
) -> Result<Vec<Column>, String> {
    let mut reader = Reader::from_reader(table);
    let header = reader.headers().map_err(|error| error.to_string())?;
    let place = |(name, _): &(N, ColumnType)| {
        let place = header.iter().position(|other| other == name.as_ref());
        place.ok_or_else(|| format!("has no column `{}`", name.as_ref()))
    };
    let places: Vec<usize> = columns.iter().map(place).collect::<Result<_, _>>()?;
    let mut read: Vec<Column> = columns.iter().map(|(_, column_type)| Column::empty(*column_type)).collect();
    let mut row = StringRecord::new();
    while reader.read_record(&mut row).map_err(|error| error.to_string())? {
        for (column, place) in read.iter_mut().zip(&places) {
            column.push(&row[*place]).ok_or_else(|| {
                let line = row.position().map_or(0, csv::Position::line);
                format!("line {line}, column {}: \"{}\" has another type", place + 1, row[*place].escape_debug())
            })?;
        }
    }
    Ok(read)
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLUMNS: [(&str, ColumnType); 3] =
        [("n", ColumnType::Counts), ("x, y", ColumnType::Numbers), ("w", ColumnType::Text)];

    fn rows() -> Vec<Column> {
        vec![
            Column::Counts(vec![Some(1), Some(i64::MIN), None, Some(i64::MAX)]),
            Column::Numbers(vec![Some(0.1 + 0.2), None, Some(-0.0), Some(f64::MIN_POSITIVE)]),
            Column::Text(vec![None, Some("a, \"b\"\r\nc".to_owned()), Some(" d ".to_owned()), None]),
        ]
    }

    #[test]
    fn a_table_is_read_back_to_the_same_bits_and_does_not_exist_until_it_is_finished() {
        let here = tempfile::tempdir().unwrap();
        let target = here.path().join("a.csv");
        let named = COLUMNS.map(|(name, column_type)| (name.to_owned(), column_type));
        let mut writer = TableWriter::create(here.path(), &target, &named).unwrap();
        writer.write(&rows()).unwrap();
        assert!(open(&target).unwrap().is_none());
        writer.finish().unwrap();
        let bytes = std::fs::read(&target).unwrap();
        let read = read_columns(bytes.as_slice(), &COLUMNS).unwrap();
        assert_eq!(read, rows());
        // -0.0 equals 0.0.
        assert!(read[1].clone().numbers()[2].unwrap().is_sign_negative());
        assert_eq!(read_columns(bytes.as_slice(), &COLUMNS[2..]).unwrap(), rows()[2..]);
        assert!(
            bytes.starts_with(b"n,\"x, y\",w\n1,0.30000000000000004,\n-9223372036854775808,,\"a, \"\"b\"\"\r\nc\"\n")
        );
    }

    #[test]
    #[cfg(unix)]
    fn a_pipe_in_place_of_a_table_is_an_error() {
        let here = tempfile::tempdir().unwrap();
        let pipe = here.path().join("points.csv");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let error = open(&pipe).unwrap_err().to_string();
        assert!(error.contains("points.csv") && error.contains("is a FIFO (pipe)"), "{error}");
    }

    #[test]
    fn an_invalid_table_is_an_error_with_the_line() {
        let error = |text: &[u8]| read_columns(text, &COLUMNS[..2]).unwrap_err();
        assert!(error(b"").contains("no column `n`"));
        assert!(error(b"n,w\n1,2\n").contains("no column `x, y`"));
        for cell in ["NaN", "inf", "-inf", "1e999", "1,5", "0x1", " 1"] {
            let message = error(format!("n,\"x, y\"\n1,2\n1,\"{cell}\"\n").as_bytes());
            assert!(message.contains("line 3, column 2") && message.contains(cell), "{message}");
        }
        assert!(error(b"n,\"x, y\"\n1.0,2\n").contains("line 2, column 1"));
        assert!(error(b"n,\"x, y\"\n1,2,3\n").contains("line: 2"));
        assert!(error(b"n,\"x, y\"\n\xff,2\n").contains("UTF-8"));
    }
}
