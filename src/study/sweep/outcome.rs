//! Outcomes of runs, and the files that store those of a batch.

use super::folder::Batch;
use super::identity::ContentHash;
use super::table::open;
use super::{Measure, Sweep};
use crate::StudyError;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::error::Error;
use std::io::{BufReader, Read, Seek, SeekFrom};
use zsim_base::files::write_bytes;
use zsim_base::spec::{self, Source};

/// Length of a checksum in the first line of a file.
const CHECKSUM_DIGITS: usize = 32;

/// State of the file of a batch.
#[derive(Debug, PartialEq)]
pub(super) enum Stored {
    /// Complete: the outcome of each run.
    Done(Vec<RunOutcome>),
    /// Truncated, modified, or of another batch.
    Damaged,
    /// No file.
    Missing,
}

/// Figures of a run, one per measure; `None` if it could not be computed.
pub(crate) type Figures = Vec<Option<f64>>;

/// Outcome of a run: a row of the tables.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct RunOutcome {
    /// One figure per measure of the table; `None` if it could not be computed.
    pub figures: Vec<Option<f64>>,
    /// Error message of a failed run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// One figure per measure of the computing time.
    pub times: Vec<Option<f64>>,
    /// What the table does not contain, as RON: the errors over time and the map of a run with timing errors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
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
    /// Writes the file of a batch atomically: a line with the batch and the checksum of the rest, and the outcomes as JSON.
    pub(super) fn write_batch(&self, batch: &Batch, outcomes: &[RunOutcome]) -> Result<(), StudyError> {
        let bytes = file_bytes(batch, &self.plan.time_measures(), outcomes)?;
        Ok(write_bytes(&self.temporary(), &self.batch_path(batch), &bytes)?)
    }

    /// Reads the file of a batch.
    ///
    /// # Errors
    /// If the file exists and cannot be opened. A damaged file is not an error: its runs are repeated.
    pub(super) fn read_batch(&self, batch: &Batch) -> Result<Stored, StudyError> {
        let Some(file) = open(&self.batch_path(batch))? else { return Ok(Stored::Missing) };
        Ok(read_intact(file, batch, &self.plan.time_measures()).map_or(Stored::Damaged, Stored::Done))
    }

    /// The figures of the table, or the error, of each run in the order of the plan.
    ///
    /// # Errors
    /// If a run is missing, or if a file cannot be opened.
    pub(crate) fn outcomes(&self) -> Result<Vec<Result<Figures, String>>, StudyError> {
        let mut all = Vec::new();
        for batch in &self.batches {
            let Stored::Done(outcomes) = self.read_batch(batch)? else { return Err(self.failed()) };
            all.extend(outcomes.into_iter().map(|outcome| outcome.error.map_or(Ok(outcome.figures), Err)));
        }
        Ok(all)
    }

    /// Details of all runs in the order of the plan; `None` if a run failed, is missing, or has no details.
    ///
    /// # Errors
    /// If a file cannot be opened.
    pub(crate) fn details<T: DeserializeOwned>(&self) -> Result<Option<Vec<T>>, StudyError> {
        let mut all = Vec::new();
        for batch in &self.batches {
            let Stored::Done(outcomes) = self.read_batch(batch)? else { return Ok(None) };
            for outcome in outcomes {
                let Some(details) = outcome.details else { return Ok(None) };
                all.push(spec::parse(&Source::in_memory("the details of a run", details))?);
            }
        }
        Ok(Some(all))
    }

    /// The error of a study that needs all runs.
    pub(crate) fn failed(&self) -> StudyError {
        let message = format!("a run failed: see {}", self.folder.join("table.csv").display());
        StudyError::Plan { what: "study", message }
    }

    /// Whether the file of a batch exists and is undamaged.
    ///
    /// # Errors
    /// As [`read_batch`](Self::read_batch).
    pub(super) fn is_done(&self, batch: &Batch) -> Result<bool, StudyError> {
        Ok(matches!(self.read_batch(batch)?, Stored::Done(_)))
    }
}

/// First line of the file of a batch, up to the checksum.
fn first_words(batch: &Batch) -> String {
    format!("zsim part 2, runs {}, checksum ", batch.identity)
}

/// Content of the file of a batch. Numbers are read back to the same bits; one that is not finite is none.
fn file_bytes(batch: &Batch, times: &[Measure], outcomes: &[RunOutcome]) -> Result<Vec<u8>, StudyError> {
    let text = serde_json::to_vec(&(times, outcomes))?;
    let checksum = ContentHash::of_bytes(&text);
    Ok([format!("{}{checksum}\n", first_words(batch)).as_bytes(), &text].concat())
}

/// Reads the file of a batch; `None` if it is truncated, modified, of another batch, or has other computing times.
///
/// The checksum is compared before the outcomes are read, so that no other file is kept in memory.
fn read_intact(mut file: impl Read + Seek, batch: &Batch, times: &[Measure]) -> Option<Vec<RunOutcome>> {
    let start = first_words(batch);
    let mut line = vec![0; start.len() + CHECKSUM_DIGITS + 1];
    file.read_exact(&mut line).ok()?;
    let checksum = line.strip_prefix(start.as_bytes())?;
    if checksum != format!("{}\n", ContentHash::of_stream(&mut file).ok()?).as_bytes() {
        return None;
    }
    file.seek(SeekFrom::Start(line.len() as u64)).ok()?;
    let (stored, outcomes): (Vec<Measure>, Vec<RunOutcome>) = serde_json::from_reader(BufReader::new(file)).ok()?;
    (stored == times && outcomes.len() as u64 == batch.count).then_some(outcomes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    const TIMES: [Measure; 1] = [Measure::WALL_S];

    fn batch_of(name: &str, count: u64) -> Batch {
        Batch { identity: ContentHash::of([name.as_bytes()]), first: 0, count }
    }

    fn read(bytes: &[u8], batch: &Batch) -> Option<Vec<RunOutcome>> {
        read_intact(Cursor::new(bytes), batch, &TIMES)
    }

    /// A file with this text under a valid checksum.
    fn with_text(batch: &Batch, text: &str) -> Vec<u8> {
        format!("{}{}\n{text}", first_words(batch), ContentHash::of_bytes(text.as_bytes())).into_bytes()
    }

    #[test]
    fn a_file_is_read_back_and_damage_of_any_byte_is_found() {
        let batch = batch_of("a", 2);
        let details = Some("(\n    map: \"a,\",\r\n)\n".to_owned());
        let good = RunOutcome { figures: vec![Some(0.1 + 0.2), Some(-0.0)], details, ..RunOutcome::default() };
        let bad =
            RunOutcome { error: Some("no \"spring\", \u{e4}".to_owned()), times: vec![Some(1e-300)], ..good.clone() };
        let infinite = RunOutcome { figures: vec![Some(f64::INFINITY), Some(f64::NAN)], ..bad.clone() };
        let all = [good, RunOutcome { figures: vec![None, None], ..bad }];
        let bytes = file_bytes(&batch, &TIMES, &all).unwrap();
        assert_eq!(read(&bytes, &batch), Some(all.to_vec()));
        assert_eq!(read(&file_bytes(&batch, &TIMES, &[all[0].clone(), infinite]).unwrap(), &batch), Some(all.to_vec()));
        for at in 0..bytes.len() {
            assert_eq!(read(&bytes[..at], &batch), None, "truncated to {at} bytes");
            for bit in 0..8 {
                let mut flipped = bytes.clone();
                flipped[at] ^= 1 << bit;
                assert_eq!(read(&flipped, &batch), None, "bit {bit} of byte {at}");
            }
        }
        assert_eq!(read(&[bytes.as_slice(), b"\n"].concat(), &batch), None);
        assert_eq!(read(&bytes, &batch_of("b", 2)), None, "a file of another batch");
        assert_eq!(read(&bytes, &Batch { count: 3, ..batch }), None);
        assert_eq!(read_intact(Cursor::new(&bytes), &batch, &[]), None, "other computing times");
    }

    #[test]
    fn foreign_files_and_invalid_outcomes_are_damage() {
        let batch = batch_of("a", 1);
        let outcome = r#"{"figures":[1.5],"times":[]}"#;
        assert!(read(&with_text(&batch, &format!(r#"[["wall_s"],[{outcome}]]"#)), &batch).is_some());
        for text in [
            "",
            "sag_mm,error,details\n1.5,,\n",
            r#"[["wall_s"],[]]"#,
            r#"[["wall_s"],[{"figures":[1.5]}]]"#,
            r#"[["wall_s"],[{"figures":[NaN],"times":[]}]]"#,
            r#"[["wall_s"],[{"figures":[1e999],"times":[]}]]"#,
            r#"[["wall_s"],[{"figures":["1.5"],"times":[]}]]"#,
            &format!(r#"[["wall_s"],[{outcome},{outcome}]]"#),
            &format!(r#"[["nosuch"],[{outcome}]]"#),
            "\0\u{1}\u{2}",
        ] {
            assert_eq!(read(&with_text(&batch, text), &batch), None, "{text:?}");
        }
        assert_eq!(read(&[0xff; 4096], &batch), None);
    }
}
