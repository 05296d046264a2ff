//! Lines of a PLY file, which end with LF, CR LF or CR as its first line does.

use super::Problem;
use std::io::{BufRead, Read};

/// Mark at the end of each line. A file has one kind: after the header, a binary element may start with the byte of another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LineEnd {
    Lf,
    CrLf,
    Cr,
}

/// Maximum length of the first line, bytes: `ply`, a byte order mark, and blanks.
const MAX_FIRST_LINE_BYTES: usize = 80;

/// Reads the lines of a file and counts them.
pub(super) struct Lines<R> {
    pub input: R,
    /// Number of lines read.
    pub count: usize,
    end: LineEnd,
}

impl<R: BufRead> Lines<R> {
    /// Reads the first line, which is `ply`, and recognises how lines end.
    pub fn start(mut input: R) -> Result<Self, Problem> {
        let wrong = || (1, "this is not a PLY file: it does not start with `ply`".to_owned());
        let mut first = Vec::new();
        while first.len() < MAX_FIRST_LINE_BYTES && !first.ends_with(b"\n") && !first.ends_with(b"\r") {
            let mut byte = [0];
            input.read_exact(&mut byte).map_err(|_| wrong())?;
            first.extend(byte);
        }
        if first.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&first).trim_ascii() != b"ply" {
            return Err(wrong());
        }
        let is_lf_next = input.fill_buf().map_err(|error| (1, error.to_string()))?.starts_with(b"\n");
        let end = match first.ends_with(b"\n") {
            true => LineEnd::Lf,
            false if is_lf_next => LineEnd::CrLf,
            false => LineEnd::Cr,
        };
        input.consume(usize::from(end == LineEnd::CrLf));
        Ok(Self { input, count: 1, end })
    }

    /// Reads a line of at most `max_bytes`, in UTF-8 or Latin-1; `None` at the end of the file.
    pub fn next(&mut self, max_bytes: usize) -> Result<Option<String>, Problem> {
        self.count += 1;
        let mark = if self.end == LineEnd::Cr { b'\r' } else { b'\n' };
        let mut bytes = Vec::new();
        let mut input = (&mut self.input).take(max_bytes as u64);
        input.read_until(mark, &mut bytes).map_err(|error| (self.count, error.to_string()))?;
        if bytes.len() == max_bytes {
            return Err((self.count, format!("the line has more than {max_bytes} bytes")));
        }
        if bytes.is_empty() {
            return Ok(None);
        }
        let text = String::from_utf8(bytes);
        Ok(Some(text.unwrap_or_else(|error| error.as_bytes().iter().copied().map(char::from).collect())))
    }
}
