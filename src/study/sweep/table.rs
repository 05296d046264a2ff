//! Tables on disk: Parquet, there whole or not at all.

use crate::study::StudyError;
use crate::study::atomic_file::AtomicFile;
use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::column::reader::get_typed_column_reader;
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, RowGroupReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Held {
    Counts,
    Numbers,
    Words,
}

/// A stretch of a column; cells may be empty.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Column {
    Counts(Vec<Option<i64>>),
    Numbers(Vec<Option<f64>>),
    Words(Vec<Option<String>>),
}

impl Column {
    pub fn empty(held: Held) -> Self {
        match held {
            Held::Counts => Self::Counts(Vec::new()),
            Held::Numbers => Self::Numbers(Vec::new()),
            Held::Words => Self::Words(Vec::new()),
        }
    }

    pub fn numbers(self) -> Vec<Option<f64>> {
        if let Self::Numbers(cells) = self { cells } else { Vec::new() }
    }

    pub fn words(self) -> Vec<Option<String>> {
        if let Self::Words(cells) = self { cells } else { Vec::new() }
    }

    pub fn counts(self) -> Vec<Option<i64>> {
        if let Self::Counts(cells) = self { cells } else { Vec::new() }
    }

    /// How many cells there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Counts(cells) => cells.len(),
            Self::Numbers(cells) => cells.len(),
            Self::Words(cells) => cells.len(),
        }
    }

    /// The cell as CSV has it: numbers read back to the same bits.
    pub fn cell(&self, row: usize) -> String {
        match self {
            Self::Counts(cells) => cells[row].map_or_else(String::new, |count| count.to_string()),
            Self::Numbers(cells) => cells[row].map_or_else(String::new, |number| number.to_string()),
            Self::Words(cells) => cells[row].as_deref().map_or_else(String::new, quoted),
        }
    }
}

/// A word as CSV has it (RFC 4180).
pub(super) fn quoted(word: &str) -> String {
    if word.contains([',', '"', '\n', '\r']) { format!("\"{}\"", word.replace('"', "\"\"")) } else { word.to_owned() }
}

/// A table that is being written.
pub(super) struct TableWriter {
    writer: SerializedFileWriter<File>,
    partial: AtomicFile,
}

impl TableWriter {
    /// Begins a table for `place`, kept in `folder` until it is whole.
    pub fn create(folder: &Path, place: &Path, columns: &[(String, Held)]) -> Result<Self, StudyError> {
        let mut partial = AtomicFile::new(folder, place)?;
        let wrong = |error| StudyError::table(place)(error);
        let fields: Vec<Arc<Type>> = columns
            .iter()
            .map(|(name, held)| Ok(Arc::new(field(name, *held)?)))
            .collect::<Result<_, _>>()
            .map_err(wrong)?;
        let schema = Type::group_type_builder("zsim").with_fields(fields).build().map_err(wrong)?;
        let properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_created_by(concat!("zsim ", env!("CARGO_PKG_VERSION")).to_owned())
            .build();
        let file = partial.file().try_clone().map_err(StudyError::file(place))?;
        let writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties)).map_err(wrong)?;
        Ok(Self { writer, partial })
    }

    /// Adds rows: a stretch of each column, equally long.
    pub fn write(&mut self, columns: &[Column]) -> Result<(), StudyError> {
        let place = self.partial.target().to_owned();
        self.group(columns).map_err(StudyError::table(&place))
    }

    fn group(&mut self, columns: &[Column]) -> Result<(), ParquetError> {
        let mut group = self.writer.next_row_group()?;
        for column in columns {
            let Some(mut writer) = group.next_column()? else { break };
            match column {
                Column::Counts(cells) => {
                    let there: Vec<i64> = cells.iter().flatten().copied().collect();
                    writer.typed::<Int64Type>().write_batch(&there, Some(&levels(cells)), None)?;
                }
                Column::Numbers(cells) => {
                    let there: Vec<f64> = cells.iter().flatten().copied().collect();
                    writer.typed::<DoubleType>().write_batch(&there, Some(&levels(cells)), None)?;
                }
                Column::Words(cells) => {
                    let bytes = |word: &String| ByteArray::from(word.as_bytes().to_vec());
                    let there: Vec<ByteArray> = cells.iter().flatten().map(bytes).collect();
                    writer.typed::<ByteArrayType>().write_batch(&there, Some(&levels(cells)), None)?;
                }
            }
            writer.close()?;
        }
        group.close().map(drop)
    }

    /// Writes a word under `key` into the file's metadata.
    pub fn mark(&mut self, key: &str, word: String) {
        self.writer.append_key_value_metadata(KeyValue::new(key.to_owned(), word));
    }

    /// Closes the table and moves it to its place.
    pub fn finish(self) -> Result<(), StudyError> {
        let Self { writer, partial } = self;
        writer.close().map_err(StudyError::table(partial.target()))?;
        partial.finish()
    }
}

fn field(name: &str, held: Held) -> Result<Type, ParquetError> {
    let (physical, logical) = match held {
        Held::Counts => (Physical::INT64, None),
        Held::Numbers => (Physical::DOUBLE, None),
        Held::Words => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    Type::primitive_type_builder(name, physical)
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(logical)
        .build()
}

/// For each cell whether it is there.
fn levels<T>(cells: &[Option<T>]) -> Vec<i16> {
    cells.iter().map(|cell| i16::from(cell.is_some())).collect()
}

/// A table on disk.
pub(super) struct Table {
    path: PathBuf,
    reader: SerializedFileReader<File>,
}

impl Table {
    /// Opens the table at `path`; `None` when there is none.
    pub fn open(path: &Path) -> Result<Option<Self>, StudyError> {
        let file = match File::open(path) {
            Ok(file) => file,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(StudyError::file(path)(error)),
        };
        let reader = SerializedFileReader::new(file).map_err(StudyError::table(path))?;
        Ok(Some(Self { path: path.to_owned(), reader }))
    }

    /// How many stretches of rows there are.
    pub fn groups(&self) -> usize {
        self.reader.num_row_groups()
    }

    /// The word that the file's metadata has under `key`.
    pub fn mark(&self, key: &str) -> Option<&str> {
        let marks = self.reader.metadata().file_metadata().key_value_metadata()?;
        marks.iter().find(|mark| mark.key == key)?.value.as_deref()
    }

    /// How many rows there are.
    pub fn rows(&self) -> i64 {
        self.reader.metadata().file_metadata().num_rows()
    }

    /// These columns of a stretch of rows.
    pub fn read(&self, group: usize, columns: &[(&str, Held)]) -> Result<Vec<Column>, StudyError> {
        let read = || -> Result<Vec<Column>, ParquetError> {
            let group = self.reader.get_row_group(group)?;
            columns.iter().map(|(name, held)| read_column(group.as_ref(), name, *held)).collect()
        };
        read().map_err(StudyError::table(&self.path))
    }

    /// A whole column.
    pub fn column(&self, name: &str, held: Held) -> Result<Column, StudyError> {
        let mut whole = Column::empty(held);
        for group in 0..self.groups() {
            for column in self.read(group, &[(name, held)])? {
                match (&mut whole, column) {
                    (Column::Counts(all), Column::Counts(more)) => all.extend(more),
                    (Column::Numbers(all), Column::Numbers(more)) => all.extend(more),
                    (Column::Words(all), Column::Words(more)) => all.extend(more),
                    _ => {}
                }
            }
        }
        Ok(whole)
    }
}

fn read_column(group: &dyn RowGroupReader, name: &str, held: Held) -> Result<Column, ParquetError> {
    let schema = group.metadata().schema_descr();
    let place = (0..schema.num_columns()).find(|k| schema.column(*k).name() == name);
    let place = place.ok_or_else(|| ParquetError::General(format!("has no column `{name}`")))?;
    Ok(match held {
        Held::Counts => Column::Counts(cells::<Int64Type>(group, place)?),
        Held::Numbers => Column::Numbers(cells::<DoubleType>(group, place)?),
        Held::Words => {
            let word = |bytes: ByteArray| bytes.as_utf8().map(str::to_owned);
            let cells = cells::<ByteArrayType>(group, place)?;
            Column::Words(cells.into_iter().map(|cell| cell.map(word).transpose()).collect::<Result<_, _>>()?)
        }
    })
}

fn cells<T: DataType>(group: &dyn RowGroupReader, place: usize) -> Result<Vec<Option<T::T>>, ParquetError> {
    if group.metadata().schema_descr().column(place).physical_type() != T::get_physical_type() {
        return Err(ParquetError::General(format!("column {place} holds something else")));
    }
    let rows = group.metadata().num_rows() as usize;
    let mut reader = get_typed_column_reader::<T>(group.get_column_reader(place)?);
    let (mut levels, mut values) = (Vec::new(), Vec::new());
    reader.read_records(rows, Some(&mut levels), None, &mut values)?;
    let mut values = values.into_iter();
    Ok(levels.into_iter().map(|level| if level > 0 { values.next() } else { None }).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_read_back_to_the_same_bits_and_is_absent_until_it_is_whole() {
        let here = tempfile::tempdir().unwrap();
        let place = here.path().join("a.parquet");
        let columns = [("n", Held::Counts), ("x", Held::Numbers), ("w", Held::Words)];
        let named: Vec<(String, Held)> = columns.iter().map(|(name, held)| ((*name).to_owned(), *held)).collect();
        let stretch = |k: i64| {
            vec![
                Column::Counts(vec![Some(k), Some(i64::MAX)]),
                Column::Numbers(vec![Some(0.1 + 0.2), None]),
                Column::Words(vec![None, Some("a, \"b\"".to_owned())]),
            ]
        };
        let mut writer = TableWriter::create(here.path(), &place, &named).unwrap();
        writer.write(&stretch(1)).unwrap();
        writer.write(&stretch(2)).unwrap();
        assert!(Table::open(&place).unwrap().is_none());
        writer.finish().unwrap();
        let table = Table::open(&place).unwrap().unwrap();
        assert_eq!(table.groups(), 2);
        assert_eq!(table.read(1, &columns).unwrap(), stretch(2));
        assert_eq!(table.column("n", Held::Counts).unwrap().counts(), [1, i64::MAX, 2, i64::MAX].map(Some));
        assert!(table.column("y", Held::Numbers).err().unwrap().to_string().contains("no column `y`"));
        assert!(table.column("x", Held::Words).is_err());
        assert_eq!(stretch(1)[2].cell(1), "\"a, \"\"b\"\"\"");
        let bytes = || std::fs::read(&place).unwrap();
        let first = bytes();
        let mut again = TableWriter::create(here.path(), &place, &named).unwrap();
        again.write(&stretch(1)).unwrap();
        again.write(&stretch(2)).unwrap();
        again.finish().unwrap();
        assert!(first == bytes(), "the same rows, the same bytes");
    }
}
