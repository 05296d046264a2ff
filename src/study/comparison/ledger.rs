//! `runs.csv`: what is done, a row a run, on disk as soon as it is known.

use super::Row;
use crate::study::StudyError;
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The rows of a study, in memory and on disk.
pub(super) struct Ledger {
    path: PathBuf,
    file: File,
    rows: Vec<Row>,
}

impl Ledger {
    /// Opens `path`, or begins it; a last line that was cut off is forgotten.
    ///
    /// # Errors
    /// When the file cannot be read or written, is no such file, or another process has it open.
    pub(super) fn open(path: &Path) -> Result<Self, StudyError> {
        let error = |source| StudyError::file(path)(source);
        let mut file =
            OpenOptions::new().create(true).truncate(false).read(true).write(true).open(path).map_err(error)?;
        file.try_lock().map_err(|busy| error(std::io::Error::other(format!("somebody else writes it: {busy}"))))?;
        let mut text = String::new();
        file.read_to_string(&mut text).map_err(error)?;
        text.truncate(text.rfind('\n').map_or(0, |end| end + 1));
        let mut rows = Vec::new();
        for (index, line) in text.lines().enumerate() {
            match Row::parse(line) {
                None if index == 0 && line == Row::header() => {}
                Some(row) if index > 0 => rows.push(row),
                _ => {
                    let message = format!("line {} is no row of a study; move the file away", index + 1);
                    return Err(error(std::io::Error::other(message)));
                }
            }
        }
        file.set_len(text.len() as u64).map_err(error)?;
        file.seek(SeekFrom::End(0)).map_err(error)?;
        let mut ledger = Self { path: path.to_owned(), file, rows };
        if text.is_empty() {
            ledger.write(&Row::header())?;
        }
        Ok(ledger)
    }

    /// What is done.
    pub(super) fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Adds a row.
    pub(super) fn add(&mut self, row: Row) -> Result<(), StudyError> {
        self.write(&row.line())?;
        self.rows.push(row);
        Ok(())
    }

    fn write(&mut self, line: &str) -> Result<(), StudyError> {
        self.file.write_all(format!("{line}\n").as_bytes()).map_err(StudyError::file(&self.path))
    }

    /// Puts the rows in order, in which threads do not finish them, on disk too.
    pub(super) fn close(mut self, place: impl Fn(&Row) -> usize) -> Result<Vec<Row>, StudyError> {
        self.rows.sort_by_key(|row| place(row));
        let lines: Vec<String> = self.rows.iter().map(Row::line).collect();
        let text = format!("{}\n{}\n", Row::header(), lines.join("\n"));
        let ordered = self.path.with_extension("csv.part");
        std::fs::write(&ordered, text).map_err(StudyError::file(&ordered))?;
        std::fs::rename(&ordered, &self.path).map_err(StudyError::file(&self.path))?;
        Ok(self.rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::comparison::Measure;

    fn row(seed: u64) -> Row {
        let name = |text: &str| text.to_owned();
        let figures = [(Measure::PositionRmseM, 0.1 + 0.2), (Measure::WallS, 1.5)].into();
        Row { variant: name("no offset grids"), scene: name("office"), motion: name("hand"), seed, figures }
    }

    #[test]
    fn what_was_written_before_a_kill_is_there_after_it() {
        let here = tempfile::tempdir().unwrap();
        let path = here.path().join("runs.csv");
        let mut ledger = Ledger::open(&path).unwrap();
        ledger.add(row(2)).unwrap();
        ledger.add(row(1)).unwrap();
        assert!(Ledger::open(&path).is_err(), "one writer at a time");
        drop(ledger);
        // The kill came in the middle of a line.
        let mut file = OpenOptions::new().append(true).open(&path).unwrap();
        file.write_all(b"no offset grids,office,hand,3,0.0").unwrap();
        let mut ledger = Ledger::open(&path).unwrap();
        assert_eq!(ledger.rows(), [row(2), row(1)]);
        ledger.add(row(3)).unwrap();
        assert_eq!(ledger.close(|row| row.seed as usize).unwrap(), [row(1), row(2), row(3)]);
        assert_eq!(Ledger::open(&path).unwrap().rows(), [row(1), row(2), row(3)]);
    }

    #[test]
    fn another_file_is_left_alone() {
        let here = tempfile::tempdir().unwrap();
        let path = here.path().join("runs.csv");
        std::fs::write(&path, "t,x\n1,2\n").unwrap();
        let error = Ledger::open(&path).err().unwrap().to_string();
        assert!(error.contains("line 1"), "{error}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "t,x\n1,2\n");
    }
}
