//! Printable form of text from files: names could otherwise move the cursor of a terminal, or make an SVG invalid.

use std::borrow::Cow;

/// Escapes control characters and characters that reorder text, except line ends and tabs.
pub fn printable(text: &str) -> Cow<'_, str> {
    escaped(text, |c| c.escape_default().to_string())
}

/// As [`printable`], with line ends escaped too, for a name within a line or a table.
pub fn printable_name(name: &str) -> String {
    printable(name).replace('\n', "\\n")
}

/// Escapes the same characters as [`printable`] in the text of a JSON document (RFC 8259, section 7).
pub fn printable_json(json: &str) -> Cow<'_, str> {
    escaped(json, |c| format!("\\u{:04x}", u32::from(c)))
}

fn escaped(text: &str, escape: impl Fn(char) -> String) -> Cow<'_, str> {
    if text.chars().all(is_harmless) {
        return Cow::Borrowed(text);
    }
    Cow::Owned(text.chars().map(|c| if is_harmless(c) { c.to_string() } else { escape(c) }).collect())
}

/// Whether a character needs no escape: a line end, a tab, or neither a control character, nor one without width or that
/// changes the direction of the text (Unicode Standard Annex 9), nor one that XML 1.0 forbids.
fn is_harmless(c: char) -> bool {
    let is_direction = matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    ['\n', '\t'].contains(&c) || !c.is_control() && !is_direction && !matches!(c, '\u{fffe}' | '\u{ffff}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_control_characters_are_escaped() {
        assert_eq!(printable("\u{1b}]0;x\u{7}\n\u{9b}2J\u{202e}"), "\\u{1b}]0;x\\u{7}\n\\u{9b}2J\\u{202e}");
        assert_eq!(printable("0.5\u{b0} \u{4e16}"), "0.5\u{b0} \u{4e16}");
        let json = printable_json("\u{9b}\u{202e}");
        assert_eq!(serde_json::from_str::<String>(&format!("\"{json}\"")).unwrap(), "\u{9b}\u{202e}");
        assert_eq!(printable_name("/a\nerror: b"), "/a\\nerror: b");
    }
}
