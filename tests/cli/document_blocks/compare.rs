//! Compares the output that a document shows with that of the command.

/// The tolerance of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Numbers {
    /// One unit of the last digit in the document.
    Rounded,
    /// Any number; to find the place of changed numbers in an excerpt.
    Any,
}

/// Matches any text: the rest of a word, or as the last word the rest of the line.
const ANY_TEXT: &str = "[..]";
/// Matches any number of lines.
const ANY_LINES: &str = "...";

/// Finds the line of the output for each line of the document; `None` if document and output differ.
pub fn align(document: &[String], output: &[String], numbers: Numbers) -> Option<Vec<Option<usize>>> {
    let is_any = |line: &String| line.trim() == ANY_LINES;
    let mut places = vec![None; document.len()];
    let (mut shown, mut printed) = (0, 0);
    // The last `...` and the first line of the output behind what it covers: it covers one more after each mismatch.
    let mut excerpt = None;
    while printed < output.len() {
        if document.get(shown).is_some_and(is_any) {
            excerpt = Some((shown, printed));
            shown += 1;
        } else if document.get(shown).is_some_and(|line| line_matches(line, &output[printed], numbers)) {
            places[shown] = Some(printed);
            (shown, printed) = (shown + 1, printed + 1);
        } else {
            let (mark, covered) = excerpt?;
            excerpt = Some((mark, covered + 1));
            (shown, printed) = (mark + 1, covered + 1);
        }
    }
    document[shown..].iter().all(is_any).then_some(places)
}

/// Updates the lines of a document to those of the output; keeps `[..]` and `...` where they match.
pub fn rewrite(document: &[String], output: &[String]) -> Vec<String> {
    let has_any = |line: &str| line.contains(ANY_TEXT);
    let Some(places) = align(document, output, Numbers::Any) else {
        let kept = |line: &String| document.iter().find(|d| has_any(d) && line_matches(d, line, Numbers::Any)).cloned();
        return output.iter().map(|line| kept(line).unwrap_or_else(|| line.clone())).collect();
    };
    let line = |(line, place): (&String, Option<usize>)| match place {
        Some(printed) if !has_any(line) => output[printed].clone(),
        _ => line.clone(),
    };
    document.iter().zip(places).map(line).collect()
}

/// Compares two lines word by word.
fn line_matches(document: &str, output: &str, numbers: Numbers) -> bool {
    let (mut shown, mut printed) = (document.split_whitespace().peekable(), output.split_whitespace());
    while let Some(word) = shown.next() {
        if word == ANY_TEXT && shown.peek().is_none() {
            return true;
        }
        if !printed.next().is_some_and(|other| word_matches(word, other, numbers)) {
            return false;
        }
    }
    printed.next().is_none()
}

/// Compares two words: text is equal, numbers agree within the tolerance.
fn word_matches(document: &str, output: &str, numbers: Numbers) -> bool {
    if let Some((start, end)) = document.split_once(ANY_TEXT) {
        return output.strip_prefix(start).is_some_and(|rest| rest.ends_with(end));
    }
    let (shown, printed) = (parts(document), parts(output));
    shown.len() == printed.len() && shown.iter().zip(&printed).all(|(a, b)| part_matches(*a, *b, numbers))
}

/// A number in a word, or the text between numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part<'a> {
    Text(&'a str),
    Number(&'a str),
}

fn part_matches(document: Part, output: Part, numbers: Numbers) -> bool {
    match (document, output) {
        (Part::Text(a), Part::Text(b)) => a == b,
        (Part::Number(_), Part::Number(_)) if numbers == Numbers::Any => true,
        (Part::Number(a), Part::Number(b)) => is_within_rounding(a, b),
        _ => false,
    }
}

/// Whether `output` differs from `document` by at most one unit of the last digit of `document`.
fn is_within_rounding(document: &str, output: &str) -> bool {
    let (Ok(a), Ok(b)) = (document.parse::<f64>(), output.parse::<f64>()) else { return document == output };
    a == b || (a - b).abs() <= last_digit(document) * (1.0 + 1e-6)
}

/// Returns the value of a unit of the last digit of a number.
fn last_digit(number: &str) -> f64 {
    let (mantissa, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    let decimals = mantissa.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let exponent: i32 = exponent.parse().unwrap_or(0);
    10_f64.powi(exponent.saturating_sub(decimals.try_into().unwrap_or(i32::MAX)))
}

/// Splits a word into numbers and the text between them. Digits of a name (`25x3x12`), date or version are text.
fn parts(word: &str) -> Vec<Part<'_>> {
    let (mut parts, mut text, mut at) = (Vec::new(), 0, 0);
    while let Some(next) = word[at..].chars().next() {
        let Some(end) = number_end(word, at) else {
            at += next.len_utf8();
            continue;
        };
        if text < at {
            parts.push(Part::Text(&word[text..at]));
        }
        parts.push(Part::Number(&word[at..end]));
        (text, at) = (end, end);
    }
    if text < word.len() {
        parts.push(Part::Text(&word[text..]));
    }
    parts
}

/// Returns the end of the number that starts at `at`, if one does.
fn number_end(word: &str, at: usize) -> Option<usize> {
    let joins = |c: char| c.is_alphanumeric() || "_-.".contains(c);
    if word[..at].ends_with(joins) {
        return None;
    }
    let mut rest = word[at..].trim_start_matches(['-', '+']);
    if word.len() - at - rest.len() > 1 {
        return None;
    }
    rest = digits(rest)?;
    rest = rest.strip_prefix('.').and_then(digits).unwrap_or(rest);
    let exponent = rest.strip_prefix(['e', 'E']).and_then(|e| digits(e.strip_prefix(['-', '+']).unwrap_or(e)));
    rest = exponent.unwrap_or(rest);
    let after = rest.strip_prefix(['.', '-']).unwrap_or(rest);
    let is_name = after.starts_with(|c: char| c.is_alphanumeric() || c == '_');
    (!is_name).then_some(word.len() - rest.len())
}

/// Returns what follows the digits at the start of a text, or `None` without digits.
fn digits(text: &str) -> Option<&str> {
    let rest = text.trim_start_matches(|c: char| c.is_ascii_digit());
    (rest.len() < text.len()).then_some(rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str) -> Vec<String> {
        text.lines().map(str::to_owned).collect()
    }

    fn agree(document: &str, output: &str) -> bool {
        align(&lines(document), &lines(output), Numbers::Rounded).is_some()
    }

    #[test]
    fn numbers_agree_within_one_unit_of_the_last_digit() {
        assert!(agree("RMSE 0.776 mm, (97.4 %), 0.0296°", "RMSE  0.7770 mm, (97.35 %), 0.0297°"));
        assert!(agree("5e-5 -0.134 12", "4.0e-5 -0.133 13"));
        assert!(!agree("RMSE 0.776 mm", "RMSE 0.779 mm"));
        assert!(!agree("RMSE 0.776 mm", "RMSE 0.773 mm"));
        assert!(!agree("-0.134", "0.134"));
    }

    #[test]
    fn words_and_the_digits_of_names_are_equal() {
        assert!(agree("verdict: good", "verdict: good"));
        assert!(!agree("verdict: good", "verdict: lost"));
        assert!(!agree("verdict: good", "verdict: good enough"));
        assert!(!agree("25x3x12x120", "25x3x12x121"));
        assert!(!agree("results/office-2 0.1.0", "results/office-2 0.1.1"));
        assert!(!agree("1 run", "- run"));
        assert!(!agree("one\ntwo", "one"));
        assert!(!agree("one", "one\ntwo"));
    }

    #[test]
    fn marks_match_the_rest_of_a_word_of_a_line_and_lines() {
        assert!(agree("time: [..] s ([..] % of run), [..]", "time: 1.98 s (4.14 % of run), and 3 others"));
        assert!(!agree("time: [..] s", "time: 1.98 min"));
        assert!(agree("a\n...\nd 4\n...", "a\nb\nd 7\nc\nd 4"));
        assert!(!agree("a\n...\nd 4", "a\nd 4\ne"));
        assert!(agree("...", ""));
    }

    #[test]
    fn rewriting_updates_numbers_and_keeps_marks() {
        let rewritten = |document, output| rewrite(&lines(document), &lines(output)).join("\n");
        assert_eq!(rewritten("a 1\n...\nc 2 mm\nin [..] s", "a 5\nb\nc 9 mm\nin 3 s"), "a 5\n...\nc 9 mm\nin [..] s");
        assert_eq!(rewritten("old\nin [..] s", "new\nin 3 s"), "new\nin [..] s");
        assert_eq!(rewritten("", "new"), "new");
    }

    #[test]
    fn words_split_into_numbers_and_text() {
        assert_eq!(parts("(4.14"), [Part::Text("("), Part::Number("4.14")]);
        assert_eq!(parts("-1.5e-3,"), [Part::Number("-1.5e-3"), Part::Text(",")]);
        for name in ["10mm", "utm30lx", "2026-11-27", "--3", "1.2.3", "[..]", "-", "é7é"] {
            assert_eq!(parts(name), [Part::Text(name)], "{name}");
        }
    }
}
