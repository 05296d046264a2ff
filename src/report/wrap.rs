//! Prose for the terminal.

/// Maximum width of a line of prose or of a table, columns of the terminal.
pub(super) const MAX_WIDTH: u16 = 80;

/// Breaks lines that are wider than a table at spaces; the continued lines start with `indent`.
///
/// A word that is longer than a line, for example a path, stays whole.
pub fn wrapped(text: &str, indent: &str) -> String {
    let mut lines = String::new();
    for line in text.lines() {
        let mut width = 0;
        for (index, word) in line.split(' ').enumerate() {
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
}
