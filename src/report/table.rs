//! Tables for the terminal (at most 80 columns) and for Markdown.

use super::wrap::{MAX_WIDTH, wrapped};
use super::{Metrics, rows, verdict};
use comfy_table::{CellAlignment, ColumnConstraint, ContentArrangement, LineStyle, Table, TableStyle, Width};

/// Row names that are narrower are not worth whole numbers.
const MIN_NAME_WIDTH: usize = 12;

/// Maximum length of a cell, characters: a longer one is cut.
///
/// The time of the layout grows with the square of the length.
const MAX_CELL: usize = 200;

/// Formats a table for the terminal, without rules between rows.
///
/// The first column is text; with `numbers`, the other columns are right-aligned. Cells of more than 200 characters are cut.
pub fn table(header: &[&str], rows: &[Vec<String>], numbers: bool) -> String {
    let rows: &[Vec<String>] = &rows.iter().map(|row| row.iter().map(|cell| cut(cell)).collect()).collect::<Vec<_>>();
    let mut table = Table::new();
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
fn keep_whole(table: &mut Table, header: &[&str], rows: &[Vec<String>], numbers: bool, padding: u16) {
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

/// Formats a table in Markdown; columns of numbers, except the first, are right-aligned.
pub fn markdown(header: &[&str], rows: &[Vec<String>]) -> String {
    let line = |cells: &mut dyn Iterator<Item = &str>| {
        cells.fold("|".to_owned(), |line, cell| line + " " + &cell.replace('|', "\\|").replace('\n', " ") + " |") + "\n"
    };
    let is_number =
        |cell: &String| cell.is_empty() || cell.starts_with(|c: char| c.is_ascii_digit() || "+-\u{2212}".contains(c));
    let is_right = |k: usize| k > 0 && rows.iter().filter_map(|row| row.get(k)).all(is_number);
    let rule: String = (0..header.len()).map(|k| if is_right(k) { " ---: |" } else { " --- |" }).collect();
    let body = rows.iter().map(|row| line(&mut row.iter().map(String::as_str)));
    line(&mut header.iter().copied()) + "|" + &rule + "\n" + &body.collect::<String>()
}

/// The summary of a run for the terminal: title, verdict and metrics.
pub fn summary(metrics: &Metrics) -> String {
    let mut cells = Vec::new();
    for group in rows::groups(metrics) {
        for (index, row) in group.rows.into_iter().enumerate() {
            let title = if index == 0 { group.title } else { "" };
            cells.push(vec![title.to_owned(), row.name.to_owned(), row.value]);
        }
    }
    let verdict = verdict::verdict(metrics).map_or_else(String::new, |verdict| format!("verdict: {verdict}\n"));
    let head = wrapped(&format!("{}\n{verdict}", rows::title(metrics)), "  ");
    head + &table(&[], &cells, false)
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
}
