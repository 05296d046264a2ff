//! Parquet tables, written atomically.

use crate::StudyError;
use crate::atomic_file::AtomicFile;
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

    /// A cell as CSV; numbers are read back to the same bits.
    pub fn cell(&self, row: usize) -> String {
        match self {
            Self::Counts(cells) => cells[row].map_or_else(String::new, |count| count.to_string()),
            Self::Numbers(cells) => cells[row].map_or_else(String::new, |number| number.to_string()),
            Self::Text(cells) => cells[row].as_deref().map_or_else(String::new, quoted),
        }
    }
}

/// Quotes text for CSV where needed (RFC 4180).
pub(crate) fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

/// Writer of a Parquet table.
pub(super) struct TableWriter {
    writer: SerializedFileWriter<File>,
    partial: AtomicFile,
}

impl TableWriter {
    /// Starts a table for `target`; it stays in `folder` until [`finish`](Self::finish) moves it.
    pub fn create(folder: &Path, target: &Path, columns: &[(String, ColumnType)]) -> Result<Self, StudyError> {
        let mut partial = AtomicFile::new(folder, target)?;
        let failed = |error| StudyError::table(target)(error);
        let fields: Vec<Arc<Type>> = columns
            .iter()
            .map(|(name, column_type)| Ok(Arc::new(field(name, *column_type)?)))
            .collect::<Result<_, _>>()
            .map_err(failed)?;
        let schema = Type::group_type_builder("zsim").with_fields(fields).build().map_err(failed)?;
        let properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_created_by(concat!("zsim ", env!("CARGO_PKG_VERSION")).to_owned())
            .build();
        let file = partial.file().try_clone().map_err(StudyError::file(target))?;
        let writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties)).map_err(failed)?;
        Ok(Self { writer, partial })
    }

    /// Appends a row group: cells of all columns, of equal length.
    pub fn write(&mut self, columns: &[Column]) -> Result<(), StudyError> {
        let target = self.partial.target().to_owned();
        self.write_group(columns).map_err(StudyError::table(&target))
    }

    fn write_group(&mut self, columns: &[Column]) -> Result<(), ParquetError> {
        let mut group = self.writer.next_row_group()?;
        for column in columns {
            let Some(mut writer) = group.next_column()? else { break };
            match column {
                Column::Counts(cells) => {
                    let present: Vec<i64> = cells.iter().flatten().copied().collect();
                    writer.typed::<Int64Type>().write_batch(&present, Some(&definition_levels(cells)), None)?;
                }
                Column::Numbers(cells) => {
                    let present: Vec<f64> = cells.iter().flatten().copied().collect();
                    writer.typed::<DoubleType>().write_batch(&present, Some(&definition_levels(cells)), None)?;
                }
                Column::Text(cells) => {
                    let bytes = |text: &String| ByteArray::from(text.as_bytes().to_vec());
                    let present: Vec<ByteArray> = cells.iter().flatten().map(bytes).collect();
                    writer.typed::<ByteArrayType>().write_batch(&present, Some(&definition_levels(cells)), None)?;
                }
            }
            writer.close()?;
        }
        group.close().map(drop)
    }

    /// Stores a key-value pair in the file's metadata.
    pub fn set_metadata(&mut self, key: &str, value: String) {
        self.writer.append_key_value_metadata(KeyValue::new(key.to_owned(), value));
    }

    /// Closes the table and moves it to its target.
    pub fn finish(self) -> Result<(), StudyError> {
        let Self { writer, partial } = self;
        writer.close().map_err(StudyError::table(partial.target()))?;
        partial.finish()
    }
}

fn field(name: &str, column_type: ColumnType) -> Result<Type, ParquetError> {
    let (physical, logical) = match column_type {
        ColumnType::Counts => (Physical::INT64, None),
        ColumnType::Numbers => (Physical::DOUBLE, None),
        ColumnType::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    Type::primitive_type_builder(name, physical)
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(logical)
        .build()
}

/// Parquet definition levels: 1 for a present cell, 0 for an empty one.
fn definition_levels<T>(cells: &[Option<T>]) -> Vec<i16> {
    cells.iter().map(|cell| i16::from(cell.is_some())).collect()
}

/// Reader of a Parquet table.
pub(super) struct Table {
    path: PathBuf,
    reader: SerializedFileReader<File>,
}

impl Table {
    /// Opens the table at `path`; `None` if the file does not exist.
    pub fn open(path: &Path) -> Result<Option<Self>, StudyError> {
        let file = match File::open(path) {
            Ok(file) => file,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(StudyError::file(path)(error)),
        };
        let reader = SerializedFileReader::new(file).map_err(StudyError::table(path))?;
        Ok(Some(Self { path: path.to_owned(), reader }))
    }

    /// Number of row groups.
    pub fn groups(&self) -> usize {
        self.reader.num_row_groups()
    }

    /// Value of `key` in the file's metadata.
    pub fn metadata(&self, key: &str) -> Option<&str> {
        let pairs = self.reader.metadata().file_metadata().key_value_metadata()?;
        pairs.iter().find(|pair| pair.key == key)?.value.as_deref()
    }

    /// Number of rows.
    pub fn rows(&self) -> i64 {
        self.reader.metadata().file_metadata().num_rows()
    }

    /// Reads columns of one row group.
    pub fn read(&self, group: usize, columns: &[(&str, ColumnType)]) -> Result<Vec<Column>, StudyError> {
        let read = || -> Result<Vec<Column>, ParquetError> {
            let group = self.reader.get_row_group(group)?;
            columns.iter().map(|(name, column_type)| read_column(group.as_ref(), name, *column_type)).collect()
        };
        read().map_err(StudyError::table(&self.path))
    }

    /// Reads a column of all row groups.
    pub fn column(&self, name: &str, column_type: ColumnType) -> Result<Column, StudyError> {
        let mut cells = Column::empty(column_type);
        for group in 0..self.groups() {
            for column in self.read(group, &[(name, column_type)])? {
                match (&mut cells, column) {
                    (Column::Counts(all), Column::Counts(more)) => all.extend(more),
                    (Column::Numbers(all), Column::Numbers(more)) => all.extend(more),
                    (Column::Text(all), Column::Text(more)) => all.extend(more),
                    _ => {}
                }
            }
        }
        Ok(cells)
    }
}

fn read_column(group: &dyn RowGroupReader, name: &str, column_type: ColumnType) -> Result<Column, ParquetError> {
    let schema = group.metadata().schema_descr();
    let index = (0..schema.num_columns()).find(|k| schema.column(*k).name() == name);
    let index = index.ok_or_else(|| ParquetError::General(format!("has no column `{name}`")))?;
    Ok(match column_type {
        ColumnType::Counts => Column::Counts(read_cells::<Int64Type>(group, index)?),
        ColumnType::Numbers => Column::Numbers(read_cells::<DoubleType>(group, index)?),
        ColumnType::Text => {
            let text = |bytes: ByteArray| bytes.as_utf8().map(str::to_owned);
            let cells = read_cells::<ByteArrayType>(group, index)?;
            Column::Text(cells.into_iter().map(|cell| cell.map(text).transpose()).collect::<Result<_, _>>()?)
        }
    })
}

/// Reads the cells of column `index` in a row group; a null cell is `None`.
fn read_cells<T: DataType>(group: &dyn RowGroupReader, index: usize) -> Result<Vec<Option<T::T>>, ParquetError> {
    if group.metadata().schema_descr().column(index).physical_type() != T::get_physical_type() {
        return Err(ParquetError::General(format!("column {index} has another type")));
    }
    let rows = group.metadata().num_rows() as usize;
    let mut reader = get_typed_column_reader::<T>(group.get_column_reader(index)?);
    let (mut levels, mut values) = (Vec::new(), Vec::new());
    reader.read_records(rows, Some(&mut levels), None, &mut values)?;
    let mut values = values.into_iter();
    Ok(levels.into_iter().map(|level| if level > 0 { values.next() } else { None }).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_read_back_to_the_same_bits_and_does_not_exist_until_it_is_finished() {
        let here = tempfile::tempdir().unwrap();
        let target = here.path().join("a.parquet");
        let columns = [("n", ColumnType::Counts), ("x", ColumnType::Numbers), ("w", ColumnType::Text)];
        let named: Vec<(String, ColumnType)> =
            columns.iter().map(|(name, column_type)| ((*name).to_owned(), *column_type)).collect();
        let rows = |k: i64| {
            vec![
                Column::Counts(vec![Some(k), Some(i64::MAX)]),
                Column::Numbers(vec![Some(0.1 + 0.2), None]),
                Column::Text(vec![None, Some("a, \"b\"".to_owned())]),
            ]
        };
        let mut writer = TableWriter::create(here.path(), &target, &named).unwrap();
        writer.write(&rows(1)).unwrap();
        writer.write(&rows(2)).unwrap();
        assert!(Table::open(&target).unwrap().is_none());
        writer.finish().unwrap();
        let table = Table::open(&target).unwrap().unwrap();
        assert_eq!(table.groups(), 2);
        assert_eq!(table.read(1, &columns).unwrap(), rows(2));
        assert_eq!(table.column("n", ColumnType::Counts).unwrap().counts(), [1, i64::MAX, 2, i64::MAX].map(Some));
        assert!(table.column("y", ColumnType::Numbers).err().unwrap().to_string().contains("no column `y`"));
        assert!(table.column("x", ColumnType::Text).is_err());
        assert_eq!(rows(1)[2].cell(1), "\"a, \"\"b\"\"\"");
        let bytes = || std::fs::read(&target).unwrap();
        let first = bytes();
        let mut again = TableWriter::create(here.path(), &target, &named).unwrap();
        again.write(&rows(1)).unwrap();
        again.write(&rows(2)).unwrap();
        again.finish().unwrap();
        assert!(first == bytes(), "equal rows give equal bytes");
    }
}
