//! A result as a document, for the terminal, a page and Markdown.

mod html;

use crate::page::Interactive;
use crate::{Table, wrapped};

/// A result in its order of reading; all renderings have the same words and values.
#[derive(Default)]
pub struct Document {
    /// Title.
    pub title: String,
    /// The result in a sentence or two; a detail.
    pub summary: String,
    /// Last line of the page.
    pub footer: String,
    pub(crate) parts: Vec<Part>,
    /// Heading of the next part.
    heading: Option<String>,
}

/// A part of a document.
pub(crate) struct Part {
    pub(crate) content: Content,
    /// Whether the terminal omits it.
    is_detail: bool,
}

/// Content of a part of a document.
pub enum Content {
    /// Title of the parts up to the next heading.
    Heading(String),
    /// Sentences; code is between backticks.
    Paragraph(String),
    /// A list of sentences.
    List(Vec<String>),
    /// A table.
    Table(Table),
    /// Plots, on pages; Markdown has links to them.
    Plots(Vec<Plot>),
    /// Files, each with its name and its address relative to the page.
    Links(Vec<(String, String)>),
    /// What needs scripts, on pages only.
    Interactive(Interactive),
}

/// A plot with its file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plot {
    /// Name above the plot.
    pub name: String,
    /// Address of the file relative to the page.
    pub address: String,
    /// The plot as SVG.
    pub svg: String,
}

impl Document {
    /// An empty document.
    pub fn new(title: impl Into<String>, summary: impl Into<String>) -> Self {
        Self { title: title.into(), summary: summary.into(), ..Self::default() }
    }

    /// Appends a part; an empty list has no effect.
    pub fn add(&mut self, content: impl Into<Content>) {
        self.push(content.into(), false);
    }

    /// Appends a part that the terminal omits.
    pub fn add_detail(&mut self, content: impl Into<Content>) {
        self.push(content.into(), true);
    }

    /// Appends a heading; it is omitted where nothing is shown below it.
    pub fn heading(&mut self, title: impl Into<String>) {
        self.heading = Some(title.into());
    }

    fn push(&mut self, content: Content, is_detail: bool) {
        let is_empty = match &content {
            Content::List(items) => items.is_empty(),
            Content::Plots(plots) => plots.is_empty(),
            Content::Links(links) => links.is_empty(),
            _ => false,
        };
        if !is_empty {
            let heading = self.heading.take().map(|title| Part { content: Content::Heading(title), is_detail: false });
            self.parts.extend(heading);
            self.parts.push(Part { content, is_detail });
        }
    }

    /// The document for the terminal, without details.
    pub fn text(&self) -> String {
        let (mut text, mut heading) = (String::new(), None);
        for Part { content, is_detail } in &self.parts {
            if let Content::Heading(title) = content {
                heading = Some(title);
                continue;
            }
            let body = if *is_detail { String::new() } else { content.text() };
            if body.is_empty() {
                continue;
            }
            text += if text.is_empty() { "" } else { "\n" };
            text += &heading.take().map_or_else(String::new, |title| wrapped(title, "  "));
            text += &body;
        }
        text
    }

    /// The document as Markdown, for a file from which `folder` leads to the page: empty, or with `/` at its end.
    pub fn markdown(&self, folder: &str) -> String {
        let body: String = self.parts.iter().map(|part| part.content.markdown(folder)).collect();
        format!("# {}\n\n{}\n{body}", self.title, self.summary)
    }
}

impl Content {
    /// The content for the terminal; empty for what it cannot show.
    fn text(&self) -> String {
        match self {
            Self::Paragraph(text) => wrapped(text, ""),
            Self::List(items) => items.iter().map(|item| wrapped(item, "  ")).collect(),
            Self::Table(table) => table.text(),
            Self::Heading(_) | Self::Plots(_) | Self::Links(_) | Self::Interactive(_) => String::new(),
        }
    }

    /// The content as Markdown after an empty line; empty for what it cannot show.
    fn markdown(&self, folder: &str) -> String {
        let link = |name: &str, address: &str| format!("[{name}]({folder}{address})");
        let list = |items: Vec<String>| items.iter().map(|item| format!("- {item}\n")).collect::<String>();
        let text = match self {
            Self::Heading(title) => format!("## {title}\n"),
            Self::Paragraph(text) => format!("{text}\n"),
            Self::List(items) => list(items.clone()),
            Self::Table(table) => table.markdown(),
            Self::Plots(plots) => list(plots.iter().map(|plot| link(&plot.name, &plot.address)).collect()),
            Self::Links(links) => list(links.iter().map(|(name, address)| link(name, address)).collect()),
            Self::Interactive(_) => String::new(),
        };
        if text.is_empty() { text } else { format!("\n{text}") }
    }
}

impl From<Table> for Content {
    fn from(table: Table) -> Self {
        Self::Table(table)
    }
}

impl From<String> for Content {
    fn from(text: String) -> Self {
        Self::Paragraph(text)
    }
}

impl From<&str> for Content {
    fn from(text: &str) -> Self {
        Self::Paragraph(text.to_owned())
    }
}

impl From<Interactive> for Content {
    fn from(interactive: Interactive) -> Self {
        Self::Interactive(interactive)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document() -> Document {
        let mut document = Document::new("a & b", "The <result>.");
        document.heading("Numbers");
        let mut table = Table::new(["name", "mm", "quartiles"], [["x|y", "1", "0..2"].map(str::to_owned).to_vec()]);
        table.details = vec![2];
        document.add(table);
        document.add("Run `a<b`.");
        document.heading("Plots");
        let svg = "<svg></svg>".to_owned();
        document.add(Content::Plots(vec![Plot { name: "errors".to_owned(), address: "e.svg".to_owned(), svg }]));
        document
    }

    #[test]
    fn the_terminal_omits_details_and_headings_without_text() {
        let text = document().text();
        assert_eq!(
            text.lines().map(str::trim).filter(|line| !line.starts_with('\u{2500}')).collect::<Vec<_>>(),
            ["Numbers", "name   mm", "x|y     1", "", "Run `a<b`."]
        );
    }

    #[test]
    fn markdown_has_all_columns_and_links_to_the_plots() {
        let expected = "# a & b\n\nThe <result>.\n\n## Numbers\n\n| name | mm | quartiles |\n| --- | ---: | ---: |\n\
                        | x\\|y | 1 | 0..2 |\n\nRun `a<b`.\n\n## Plots\n\n- [errors](paper/e.svg)\n";
        assert_eq!(document().markdown("paper/"), expected);
    }
}
