//! Lines of text files as programs write them: with a byte order mark, in UTF-8 or Latin-1, ended by LF, CR LF or CR.

use std::borrow::Cow;
use zsim_base::geometry::Vector;

/// Returns the bytes after a byte order mark of UTF-8.
pub(super) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// Whether the bytes are text in UTF-16: with its byte order mark, or every second byte of the start is zero.
pub(super) fn is_utf16(bytes: &[u8]) -> bool {
    let pairs = || bytes.chunks_exact(2).take(8);
    let alternates = |at: usize| pairs().count() > 1 && pairs().all(|pair| pair[at] == 0 && pair[1 - at] != 0);
    bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") || alternates(0) || alternates(1)
}

/// Lines with their numbers, from 1.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut rest = without_mark(bytes);
    let line = move || {
        let end = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(rest.len());
        let (line, after) = rest.split_at(end);
        let mark = if after.starts_with(b"\r\n") { 2 } else { after.len().min(1) };
        let is_last = rest.is_empty();
        rest = &after[mark..];
        (!is_last).then(|| decoded(line))
    };
    (1..).zip(std::iter::from_fn(line))
}

/// The first three numbers of a line; a weight or a colour can follow.
pub(super) fn point<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Vector> {
    let mut number = || words.next()?.parse().ok();
    Some(Vector::new(number()?, number()?, number()?))
}

/// Decodes a line; what is not UTF-8 is Latin-1, in which each byte is the character of its number.
fn decoded(line: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(line) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(line.iter().copied().map(char::from).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_with_any_mark_and_keep_their_numbers() {
        for text in ["a\nb \n\nc", "a\r\nb \r\n\r\nc\r\n", "a\rb \r\rc\r", "\u{feff}a\nb \n\nc\n"] {
            let found: Vec<(usize, String)> =
                lines(text.as_bytes()).map(|(at, line)| (at, line.into_owned())).collect();
            let expected = [(1, "a"), (2, "b "), (3, ""), (4, "c")].map(|(at, line)| (at, line.to_owned()));
            assert_eq!(found, expected, "{text:?}");
        }
        assert_eq!(lines(b"").count(), 0);
    }

    #[test]
    fn a_line_is_utf_8_or_latin_1() {
        let words: Vec<_> = lines(b"B\xfcro\nB\xc3\xbcro").map(|(_, line)| line.into_owned()).collect();
        assert_eq!(words, ["Büro", "Büro"]);
    }

    #[test]
    fn utf_16_is_recognised_with_and_without_its_mark() {
        let little: Vec<u8> = "v 0 0 0\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = "# Büro 1\n".encode_utf16().flat_map(u16::to_be_bytes).collect();
        assert!(is_utf16(&little) && is_utf16(&big) && is_utf16(&[&b"\xff\xfe"[..], &little].concat()));
        assert!(!is_utf16(b"v 0 0 0\n") && !is_utf16(&[0; 84]) && !is_utf16(b""));
    }
}
