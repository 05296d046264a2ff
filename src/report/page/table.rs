//! Tables on a page.

use super::html::escaped;
use crate::quantity::{percent, time};
use crate::{Metrics, Table, rows};
use zsim_estimation::PartTime;

/// The table, which scrolls if it is too wide; `label` names it for screen readers.
pub(crate) fn table(table: &Table, label: &str) -> String {
    if table.header.is_empty() {
        return format!("<div class=\"tables\">\n{}</div>\n", named_values("", &table.rows));
    }
    // A column is aligned as a whole.
    let has_numbers: Vec<bool> = (0..table.header.len()).map(|k| table.has_numbers(k)).collect();
    let name = |(name, is_figure): (&String, &bool)| match name.as_str() {
        "" => "<td></td>".to_owned(),
        name if *is_figure => format!("<th scope=\"col\" class=\"figure\">{}</th>", escaped(name)),
        name => format!("<th scope=\"col\">{}</th>", escaped(name)),
    };
    let header: String = table.header.iter().zip(&has_numbers).map(name).collect();
    let row = |(row, cells): (usize, &Vec<String>)| {
        let cells = cells.iter().enumerate().map(|(k, cell)| match k {
            0 => format!("<th scope=\"row\">{}</th>", linked(cell, table.links.get(row).and_then(Option::as_deref))),
            _ if has_numbers[k] => format!("<td>{}</td>", escaped(cell)),
            _ => format!("<td class=\"text\">{}</td>", escaped(cell)),
        });
        format!("<tr>{}</tr>\n", cells.collect::<String>())
    };
    format!(
        "<div class=\"wide\" tabindex=\"0\" role=\"group\" aria-label=\"{}\">\n<table class=\"sortable\">\n<thead><tr>{header}</tr></thead>\n\
         <tbody>\n{}</tbody>\n</table>\n</div>\n",
        escaped(label),
        table.rows.iter().enumerate().map(row).collect::<String>()
    )
}

/// A name as HTML, as a link if it has an address.
pub(crate) fn linked(name: &str, address: Option<&str>) -> String {
    match address {
        Some(address) => format!("<a href=\"{}\">{}</a>", escaped(address), escaped(name)),
        None => escaped(name),
    }
}

/// A table of names and values; no caption if it is empty.
pub(crate) fn named_values(caption: &str, rows: &[Vec<String>]) -> String {
    let caption = if caption.is_empty() { String::new() } else { format!("<caption>{}</caption>\n", escaped(caption)) };
    let row = |row: &Vec<String>| match row.as_slice() {
        [name, value, ..] => {
            format!("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", escaped(name), escaped(value))
        }
        _ => String::new(),
    };
    format!("<table>\n{caption}{}</table>\n", rows.iter().map(row).collect::<String>())
}

/// The metrics in groups, and the run time of each part of the estimator.
pub(crate) fn metrics_tables(metrics: &Metrics, parts: &[PartTime]) -> String {
    let mut html = String::new();
    for (title, rows) in rows::groups(metrics) {
        html += &named_values(title, &rows);
    }
    let total_s = metrics.open_loop.wall_s.filter(|wall_s| *wall_s > 0.0);
    let part = |PartTime { name, seconds }: &PartTime| {
        let share = total_s.map_or_else(String::new, |total_s| format!(" ({})", percent(seconds / total_s)));
        vec![(*name).to_owned(), time(*seconds) + &share]
    };
    if !parts.is_empty() {
        html += &named_values("open loop, by part", &parts.iter().map(part).collect::<Vec<_>>());
    }
    html
}
