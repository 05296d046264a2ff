//! Tables with a title, for pages, the terminal and Markdown.

use super::html::escaped;
use crate::{markdown, table, wrapped};

/// A table of text; rows have as many cells as the header.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct PageTable {
    /// Title.
    pub title: String,
    /// Names of the columns.
    pub header: Vec<String>,
    /// Rows; the first cell names the row.
    pub rows: Vec<Vec<String>>,
    /// For each row, the address that its name links to; empty if no row has one.
    pub links: Vec<Option<String>>,
}

impl PageTable {
    /// The table for the terminal, under its title.
    pub fn text(&self) -> String {
        format!("{}{}\n", wrapped(&self.title, "  "), self.body())
    }

    /// The table for the terminal, without its title.
    pub fn body(&self) -> String {
        table(&self.names(), &self.rows, true)
    }

    /// The table as Markdown, under its title.
    pub fn markdown(&self) -> String {
        format!("\n{}\n\n{}", self.title, markdown(&self.names(), &self.rows))
    }

    fn names(&self) -> Vec<&str> {
        self.header.iter().map(String::as_str).collect()
    }

    /// The table under its title.
    pub(super) fn section(&self) -> String {
        format!("<section><h2>{}</h2>\n{}</section>\n", escaped(&self.title), self.html())
    }

    /// The table, which scrolls if it is too wide.
    pub(super) fn html(&self) -> String {
        // A column is aligned as a whole.
        let of_figures: Vec<bool> = (0..self.header.len())
            .map(|k| k > 0 && self.rows.iter().filter_map(|row| row.get(k)).all(|cell| is_figure(cell)))
            .collect();
        let has_figures = |k: usize| of_figures.get(k).copied().unwrap_or_default();
        let class = |k: usize| if has_figures(k) { " class=\"figure\"" } else { "" };
        let name = |(k, cell): (usize, &String)| match cell.as_str() {
            "" => "<td></td>".to_owned(),
            name => format!("<th scope=\"col\"{}>{}</th>", class(k), escaped(name)),
        };
        let header: String = self.header.iter().enumerate().map(name).collect();
        let row = |(row, cells): (usize, &Vec<String>)| {
            let cells = cells.iter().enumerate().map(|(k, cell)| match k {
                0 => format!("<th scope=\"row\">{}</th>", self.named(row, cell)),
                _ if has_figures(k) => format!("<td>{}</td>", escaped(cell)),
                _ => format!("<td class=\"text\">{}</td>", escaped(cell)),
            });
            format!("<tr>{}</tr>\n", cells.collect::<String>())
        };
        format!(
            "<div class=\"wide\" tabindex=\"0\" role=\"group\" aria-label=\"{}\">\n<table class=\"sortable\">\n<thead><tr>{header}</tr></thead>\n\
             <tbody>\n{}</tbody>\n</table>\n</div>\n",
            escaped(&self.title),
            self.rows.iter().enumerate().map(row).collect::<String>()
        )
    }

    /// The name of a row as HTML, as a link if the row has an address.
    fn named(&self, row: usize, name: &str) -> String {
        match self.links.get(row).and_then(Option::as_ref) {
            Some(address) => format!("<a href=\"{}\">{}</a>", escaped(address), escaped(name)),
            None => escaped(name),
        }
    }
}

/// Whether a cell has a number, or the mark of a missing one.
fn is_figure(cell: &str) -> bool {
    matches!(cell, "" | "-" | "lost") || cell.starts_with(|c: char| c.is_ascii_digit() || "+-\u{2212}".contains(c))
}
