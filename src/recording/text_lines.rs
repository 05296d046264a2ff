//! Lines of text files with numbers.

use crate::RecordingError;
use std::io::{BufRead, BufReader, Read};

/// Maximum length of a line, bytes; a pose has about 100.
const MAX_LINE_BYTES: u64 = 4096;

/// Passes each line of `text` to `take`, which returns what is wrong with it; `name` is that of the file in errors.
///
/// Lines are trimmed. Empty lines and lines that start with `#` are left out.
///
/// # Errors
/// When the text cannot be read, a line is too long or not UTF-8, or `take` refuses it; with the line number.
pub(crate) fn for_each_line(
    name: &str,
    text: impl Read,
    mut take: impl FnMut(&str) -> Result<(), String>,
) -> Result<(), RecordingError> {
    let mut text = BufReader::new(text);
    let mut bytes = Vec::new();
    for line in 1.. {
        bytes.clear();
        let read = (&mut text).take(MAX_LINE_BYTES).read_until(b'\n', &mut bytes).map_err(RecordingError::Read)?;
        if read == 0 {
            break;
        }
        let error = |problem: String| RecordingError::Line { name: name.to_owned(), line, problem };
        let is_complete = read < MAX_LINE_BYTES as usize;
        let is_first = line == 1;
        let line = std::str::from_utf8(&bytes).ok().filter(|_| is_complete).map(str::trim);
        // Some editors write a byte order mark at the start.
        let line = line.map(|line| if is_first { line.trim_start_matches('\u{feff}').trim() } else { line });
        let line = line.ok_or_else(|| error("this is not a line of text of at most 4096 bytes".to_owned()))?;
        if !line.is_empty() && !line.starts_with('#') {
            take(line).map_err(error)?;
        }
    }
    Ok(())
}
