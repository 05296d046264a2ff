//! Prose for the terminal.

/// Maximum width of a line of prose or of a table, columns of the terminal.
pub(super) const MAX_WIDTH: u16 = 80;

/// Breaks lines that are wider than a table at spaces; the continued lines start with `indent`.
///
/// A word that is longer than a line, for example a path, stays whole. A number stays with its unit.
pub fn wrapped(text: &str, indent: &str) -> String {
    let mut lines = String::new();
    for line in text.lines() {
        let mut width = 0;
        for (index, word) in unbroken(line).enumerate() {
            let length = word.chars().count();
            if index > 0 && width + 1 + length > usize::from(MAX_WIDTH) {
                lines += "\n";
                lines += indent;
                width = indent.chars().count();
            } else if index > 0 {
                lines.push(' ');
                width += 1;
            }
            lines += word;
            width += length;
        }
        lines.push('\n');
    }
    lines
}

/// Splits a line at spaces, but not between a number and the word after it.
fn unbroken(line: &str) -> impl Iterator<Item = &str> {
    let is_number = |word: &str| {
        let unsigned = word.trim_start_matches(['+', '-', '\u{2212}', '(']);
        unsigned.starts_with(|c: char| c.is_ascii_digit())
            && unsigned.chars().all(|c| c.is_ascii_digit() || ".eE+-".contains(c))
    };
    let mut rest = Some(line);
    std::iter::from_fn(move || {
        let line = rest?;
        let mut start = 0;
        for (space, _) in line.match_indices(' ') {
            if !is_number(&line[start..space]) {
                rest = Some(&line[space + 1..]);
                return Some(&line[..space]);
            }
            start = space + 1;
        }
        rest = None;
        Some(line)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_are_broken_at_spaces_and_words_stay_whole() {
        let words = "ab ".repeat(40);
        let text = wrapped(words.trim_end(), "  ");
        // 27 words of 2 and 26 spaces between them are 80; the second line starts with two spaces.
        assert_eq!(text, format!("{}\n  {}\n", "ab ".repeat(27).trim_end(), "ab ".repeat(13).trim_end()));
        let path = "/".repeat(100);
        assert_eq!(wrapped(&format!("see {path} now"), ""), format!("see\n{path}\nnow\n"));
        assert_eq!(wrapped("  a  b\n\nc", ""), "  a  b\n\nc\n");
    }

    #[test]
    fn a_number_stays_with_its_unit() {
        let path = "/".repeat(68);
        assert_eq!(wrapped(&format!("{path}: 12.5 s, 3.5 MiB"), "  "), format!("{path}: 12.5 s,\n  3.5 MiB\n"));
        assert_eq!(wrapped(&format!("{path}.a: -7 mm (90 %)"), "  "), format!("{path}.a: -7 mm\n  (90 %)\n"));
        assert_eq!(wrapped(&"1 ".repeat(60), "").matches("1 1 1").count(), 20, "numbers alone are one word");
    }
}
