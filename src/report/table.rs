//! Tables for the terminal (at most 80 columns), Markdown and CSV; prose for the terminal.

use super::quantity::{percent, time};
use super::{Metrics, rows};
use comfy_table::{CellAlignment, ColumnConstraint, ContentArrangement, LineStyle, TableStyle, Width};
use zsim_estimation::Timing;

/// Row names that are narrower are not worth whole numbers.
const MIN_NAME_WIDTH: usize = 12;

/// Maximum length of a cell, characters: a longer one is cut.
///
/// The time of the layout grows with the square of the length.
const MAX_CELL: usize = 200;

/// A table of text; the first cell of a row names it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Table {
    /// Names of the columns; empty if each row is a name and its value.
    pub header: Vec<String>,
    /// Rows, each with as many cells as the header.
    pub rows: Vec<Vec<String>>,
    /// For each row, the address that its name links to on a page; empty if no row has one.
    pub links: Vec<Option<String>>,
    /// Columns that the terminal has no room for.
    pub details: Vec<usize>,
    /// Number of columns after the first that the terminal shows at once; 0 for all.
    pub columns_at_once: usize,
}

impl Table {
    /// A table with these names of columns and rows.
    pub fn new<N: Into<String>>(
        header: impl IntoIterator<Item = N>,
        rows: impl IntoIterator<Item = Vec<String>>,
    ) -> Self {
        let header = header.into_iter().map(Into::into).collect();
        Self { header, rows: rows.into_iter().collect(), ..Self::default() }
    }

    /// A table of names and values, without a header.
    pub fn facts<N: Into<String>>(rows: impl IntoIterator<Item = (N, String)>) -> Self {
        Self::new([""; 0], rows.into_iter().map(|(name, value)| vec![name.into(), value]))
    }

    /// The table for the terminal, without details.
    pub fn text(&self) -> String {
        if self.header.is_empty() {
            let is_number = |cell: &String| cell == "-" || cell.parse::<f64>().is_ok();
            return table(&[], &self.rows, self.rows.iter().filter_map(|row| row.get(1)).all(is_number));
        }
        let shown: Vec<usize> = (1..self.header.len()).filter(|k| !self.details.contains(k)).collect();
        let at_once = if self.columns_at_once == 0 { shown.len().max(1) } else { self.columns_at_once };
        let part = |columns: &[usize]| {
            let columns: Vec<usize> = [&[0], columns].concat();
            let header: Vec<&str> = columns.iter().map(|k| self.header[*k].as_str()).collect();
            let cells = |row: &Vec<String>| columns.iter().map(|k| row[*k].clone()).collect();
            let has_numbers = columns[1..].iter().any(|k| self.has_numbers(*k));
            table(&header, &self.rows.iter().map(cells).collect::<Vec<_>>(), has_numbers)
        };
        shown.chunks(at_once).map(part).collect::<Vec<_>>().join("\n")
    }

    /// The table as Markdown; columns of numbers are right-aligned.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| {
            let cell = |cell: &String| format!(" {} |", cell.replace('|', "\\|").replace('\n', " "));
            format!("|{}\n", cells.iter().map(cell).collect::<String>())
        };
        let header = if self.header.is_empty() { &vec![String::new(); 2] } else { &self.header };
        let rule = |k: usize| if self.has_numbers(k) { " ---: |" } else { " --- |" };
        let rule: String = (0..header.len()).map(rule).collect();
        format!("{}|{rule}\n{}", line(header), self.rows.iter().map(|row| line(row)).collect::<String>())
    }

    /// The table as CSV (RFC 4180).
    pub fn csv(&self) -> String {
        let line = |cells: &Vec<String>| cells.iter().map(|cell| quoted(cell)).collect::<Vec<_>>().join(",") + "\n";
        [&self.header].into_iter().chain(&self.rows).map(line).collect()
    }

    /// Whether all cells of column `k`, after the first column, are numbers or missing.
    pub(super) fn has_numbers(&self, k: usize) -> bool {
        k > 0 && self.rows.iter().filter_map(|row| row.get(k)).all(|cell| is_number(cell))
    }
}

/// Whether a cell starts with a number, or has the mark of a missing one.
fn is_number(cell: &str) -> bool {
    matches!(cell, "" | "-" | "lost") || cell.starts_with(|c: char| c.is_ascii_digit() || "+-\u{2212}".contains(c))
}

/// Quotes text for CSV where needed (RFC 4180).
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

/// Formats a table for the terminal, without rules between rows.
///
/// The first column is text; with `numbers`, the other columns are right-aligned. Cells of more than 200 characters are cut.
pub fn table(header: &[&str], rows: &[Vec<String>], numbers: bool) -> String {
    let rows: &[Vec<String>] = &rows.iter().map(|row| row.iter().map(|cell| cut(cell)).collect()).collect::<Vec<_>>();
    let mut table = comfy_table::Table::new();
    let rule = LineStyle::none().left('\u{2500}').fill('\u{2500}').junction('\u{2500}').right('\u{2500}');
    table.load_style(TableStyle::new().header_separator(rule));
    table.set_content_arrangement(ContentArrangement::Dynamic).set_width(MAX_WIDTH);
    if !header.is_empty() {
        table.set_header(header.to_vec());
    }
    table.add_rows(rows.iter().cloned());
    // Tables of many or broad columns have less padding; row names are not wrapped.
    let columns = table.column_count();
    let content: usize = (0..columns).map(|k| widest(rows, k)).sum();
    let is_broad = numbers && content + 2 * columns > room(columns);
    let padding = if columns > 6 || is_broad { (0, 1) } else { (1, 1) };
    table.column_iter_mut().for_each(|column| {
        column.set_padding(padding);
    });
    keep_whole(&mut table, header, rows, numbers, padding.0 + padding.1);
    if numbers {
        table.column_iter_mut().skip(1).for_each(|column| {
            column.set_cell_alignment(CellAlignment::Right);
        });
    }
    let text = table.to_string();
    text.lines().map(|line| line.trim_end().to_owned() + "\n").collect()
}

/// The start of a cell that is too long, with an ellipsis.
fn cut(cell: &str) -> String {
    let end = cell.char_indices().nth(MAX_CELL).map_or(cell.len(), |(index, _)| index);
    if end == cell.len() { cell.to_owned() } else { format!("{}\u{2026}", &cell[..end]) }
}

/// Keeps names, `numbers` and the words above them whole as far as the width permits.
///
/// A broken number would be read as two.
fn keep_whole(table: &mut comfy_table::Table, header: &[&str], rows: &[Vec<String>], numbers: bool, padding: u16) {
    let limit = room(table.column_count());
    let names = table.column_max_content_widths().first().map_or(0, |width| usize::from(*width));
    let cells: Vec<usize> = (1..table.column_count()).map(|k| widest(rows, k) + usize::from(padding)).collect();
    let words =
        |text: &&str| text.split(' ').map(|word| word.chars().count()).max().unwrap_or(0) + usize::from(padding);
    let with_words: Vec<usize> =
        cells.iter().enumerate().map(|(k, cell)| header.get(k + 1).map_or(0, words).max(*cell)).collect();
    let remaining_of = |widths: &[usize]| limit.saturating_sub(widths.iter().sum());
    let figures = if remaining_of(&with_words) > MIN_NAME_WIDTH { with_words } else { cells };
    let remaining = remaining_of(&figures);
    if let Some(column) = table.column_mut(0).filter(|_| names <= limit / 2)
        && (!numbers || names + usize::from(padding) <= remaining)
    {
        column.set_constraint(ColumnConstraint::ContentWidth);
    }
    if numbers && remaining > MIN_NAME_WIDTH {
        table.column_iter_mut().skip(1).zip(figures).for_each(|(column, width)| {
            column.set_constraint(ColumnConstraint::LowerBoundary(Width::Fixed(width as u16)));
        });
    }
}

/// The width of the columns of a table together: one column of the terminal is on each side of each of them.
fn room(columns: usize) -> usize {
    usize::from(MAX_WIDTH).saturating_sub(columns + 1)
}

/// Width of the widest cell of column `k`.
fn widest(rows: &[Vec<String>], k: usize) -> usize {
    rows.iter().filter_map(|row| row.get(k)).map(|cell| cell.chars().count()).max().unwrap_or(0)
}

/// The summary of a run for the terminal: title, verdict and metrics.
pub fn summary(metrics: &Metrics) -> String {
    let mut cells = Vec::new();
    for (title, rows) in rows::groups(metrics) {
        let titles = std::iter::once(title).chain(std::iter::repeat(""));
        cells.extend(titles.zip(rows).map(|(title, row)| [vec![title.to_owned()], row].concat()));
    }
    let verdict = rows::verdict(metrics).map_or_else(String::new, |verdict| format!("verdict: {verdict}\n"));
    let head = wrapped(&format!("{}\n{verdict}", rows::title(metrics)), "  ");
    head + &table(&[], &cells, false)
}

/// A table of the time of each part of the estimator, and its percentage of the open loop's `wall_s`.
///
/// The remaining time is reading the recording, ordering the measurements and writing the poses.
pub fn timing_table(timing: &Timing, wall_s: f64) -> String {
    let parts = timing.parts();
    let rest_s = wall_s - parts.iter().map(|part| part.seconds).sum::<f64>();
    let row = |name: &str, seconds: f64| vec![name.to_owned(), time(seconds), percent(seconds / wall_s)];
    let mut rows: Vec<_> = parts.iter().map(|part| row(part.name, part.seconds)).collect();
    rows.push(row("reading and other", rest_s.max(0.0)));
    rows.push(row("open loop", wall_s));
    table(&["part", "time", "percent"], &rows, true)
}

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
    fn a_table_that_is_nearly_too_wide_has_80_columns() {
        let numbers = ["108.34 \u{b1}39.52", "81.18 \u{b1}19.88", "8.59 \u{b1}0.00", "2.00 \u{b1}0.15", "+0.337"];
        let row = std::iter::once("noise 10 ms").chain(numbers).map(str::to_owned).collect();
        let header = ["timing", "cloud", "position", "cloud, on", "position, on", "clock ms"];
        let text = table(&header, &[row], true);
        assert!(text.lines().all(|line| line.chars().count() <= usize::from(MAX_WIDTH)), "{text}");
        assert!(numbers.iter().all(|number| text.contains(number)), "{text}");
    }

    #[test]
    fn words_above_numbers_are_not_broken() {
        let row = ["/vrpn_client_node/jackal/pose", "PoseStamped", "2283", "120.0", "1.000", "2282", "0", "0"]
            .map(str::to_owned);
        let text = table(&["topic", "type", "count", "Hz", "max s", "gaps", "lost", "late"], &[row.to_vec()], true);
        assert!(["count", "late", "PoseStamped"].iter().all(|word| text.contains(word)), "{text}");
        let row = ["/vrpn_client_node/jackal/pose", "-1771452805676.324", "118996138.54", "375.883", "regular"]
            .map(str::to_owned);
        let text = table(
            &["stamps against log time", "offset ms", "drift ppm", "jitter ms", "pattern"],
            &[row.to_vec()],
            true,
        );
        assert!(["jitter", "regular", "-1771452805676.324"].iter().all(|word| text.contains(word)), "{text}");
    }

    #[test]
    fn long_cells_are_cut() {
        // A name of 4 MB took over a minute.
        let rows = [vec!["\u{e9}".repeat(4 << 20), "12.5".to_owned()]];
        let text = table(&["topic", "Hz"], &rows, true);
        assert_eq!(text.matches('\u{e9}').count(), 200, "{text}");
        assert!(text.contains('\u{2026}') && text.contains("12.5"), "{text}");
    }

    #[test]
    fn numbers_are_not_broken_in_a_table_with_long_names() {
        let names = ["courtyard vehicle vehicle_three_springs", "mocap_room band_noise universal_joint"];
        let row = |name: &&str| {
            std::iter::once((*name).to_owned()).chain((0..6).map(|k| format!("{}.5", 17_530 + k))).collect()
        };
        let rows: Vec<Vec<String>> = names.iter().map(row).collect();
        let text = table(&["place", "closed loop mm", "ratio", "aligned mm", "ratio", "status", "ratio"], &rows, true);
        assert!(text.lines().all(|line| line.chars().count() <= usize::from(MAX_WIDTH)), "{text}");
        for number in rows.iter().flat_map(|row| &row[1..]) {
            assert_eq!(text.matches(number.as_str()).count(), 2, "{number} in\n{text}");
        }
    }

    #[test]
    fn percentages_relate_to_the_total_and_the_remainder_is_a_row() {
        let timing = Timing { surfels_s: 1.0, solve_s: 2.0, ..Timing::default() };
        let table = timing_table(&timing, 4.0);
        let percentage = |name: &str| {
            let line = table.lines().find(|line| line.trim_start().starts_with(name)).unwrap();
            line.split_whitespace().rev().nth(1).unwrap().to_owned()
        };
        assert_eq!([percentage("surfels"), percentage("solve"), percentage("reading")], ["25.0", "50.0", "25.0"]);
    }

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
