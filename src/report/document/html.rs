//! The page of a document.

use super::{Content, Document, Part, Plot};
use crate::page::html::{self, escaped};
use crate::page::scripts::{DATA, READY, TABLES};
use crate::page::table::{linked, table};

/// A wider plot does not share its row with another, points.
const BROAD_PLOT: f64 = 800.0;

impl Document {
    /// The document as a page; the same document gives the same bytes.
    pub fn html(&self) -> String {
        let interactive = self.parts.iter().find_map(|part| match &part.content {
            Content::Interactive(interactive) => Some(interactive),
            _ => None,
        });
        let page = html::Page {
            kind: "paper",
            title: &self.title,
            introduction: format!("<p class=\"summary\">{}</p>", escaped(&self.summary)),
            without_scripts: "Sorting the tables needs scripts; nothing else does.",
            sections: self.sections(),
            footer: &self.footer,
            data: "{}".to_owned(),
            scripts: &[DATA, TABLES, READY],
            ..html::Page::default()
        };
        match interactive {
            Some(interactive) => interactive.complete(page).html(),
            None => page.html(),
        }
    }

    /// The parts, in a section for each heading.
    fn sections(&self) -> String {
        let (mut html, mut is_open, mut label) = (String::new(), false, self.title.as_str());
        for Part { content, .. } in &self.parts {
            let has_own_sections = matches!(content, Content::Interactive(_));
            if is_open && (has_own_sections || matches!(content, Content::Heading(_))) {
                html += "</section>\n";
                is_open = false;
            }
            if !is_open && !has_own_sections {
                html += "<section>";
                is_open = true;
            }
            if let Content::Heading(title) = content {
                label = title;
            }
            html += &content.html(label);
        }
        html + if is_open { "</section>\n" } else { "" }
    }
}

impl Content {
    /// The content as HTML, under the heading `label`.
    fn html(&self, label: &str) -> String {
        match self {
            Self::Heading(title) => format!("<h2>{}</h2>\n", escaped(title)),
            Self::Paragraph(text) => format!("<p class=\"help\">{}</p>\n", html::with_code(text)),
            Self::List(items) => {
                let item = |item: &String| format!("<li>{}</li>\n", html::with_code(item));
                format!("<ul>\n{}</ul>\n", items.iter().map(item).collect::<String>())
            }
            Self::Table(rows) => table(rows, label),
            Self::Plots(plots) => {
                format!("<div class=\"drawings\">\n{}</div>\n", plots.iter().map(plot).collect::<String>())
            }
            Self::Links(links) => {
                let links: Vec<String> = links.iter().map(|(name, address)| linked(name, Some(address))).collect();
                format!("<p>{}</p>\n", links.join(", "))
            }
            Self::Interactive(interactive) => interactive.html(),
        }
    }
}

/// A plot under its name.
fn plot(Plot { name, svg, .. }: &Plot) -> String {
    let class = if width_of(svg) > BROAD_PLOT { "drawing broad" } else { "drawing" };
    format!("<figure class=\"{class}\" tabindex=\"0\">\n<figcaption>{}</figcaption>\n{svg}</figure>\n", escaped(name))
}

/// Width of an SVG by its first attribute of that name; 0 without one.
fn width_of(svg: &str) -> f64 {
    let rest = svg.split_once(" width=\"").map_or("", |(_, rest)| rest);
    rest.split('"').next().and_then(|width| width.parse().ok()).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Table;
    use crate::page::Interactive;
    use crate::page::{PointColumn, RunPoints};

    #[test]
    fn a_broad_plot_has_its_own_row() {
        let of_width = |width: &str| {
            let svg = format!("<svg viewBox=\"0 0 9 9\" width=\"{width}\"></svg>");
            plot(&Plot { name: "a".into(), address: String::new(), svg })
        };
        assert!(of_width("1180").contains("class=\"drawing broad\"") && of_width("720").contains("class=\"drawing\""));
    }

    #[test]
    fn names_cannot_become_markup() {
        let hostile = || "\"><script>".to_owned();
        let mut document = Document::new(hostile(), hostile());
        document.footer = hostile();
        document.heading(hostile());
        document.add(hostile());
        document.add(Content::List(vec![hostile()]));
        document.add(Table::facts([(hostile(), hostile())]));
        let mut runs = Table::new([hostile(), "mm".to_owned()], [vec![hostile(), "{{version}}".to_owned()]]);
        runs.links = vec![Some(hostile())];
        document.add(runs.clone());
        let svg = "<svg></svg>".to_owned();
        document.add(Content::Plots(vec![Plot { name: hostile(), address: hostile(), svg }]));
        document.add(Content::Links(vec![(hostile(), hostile())]));
        let column = PointColumn { label: "</script><script>".to_owned(), values: vec![1.0] };
        let points = RunPoints { columns: vec![column], folder: Some(hostile()), ..RunPoints::default() };
        document.add_detail(Interactive::Runs { runs, note: hostile(), points });
        let html = document.html();
        assert_eq!(html.matches("<script>").count(), 1, "that of the page");
        // Title twice, summary and footer; heading, paragraph, list, 2 facts; table 4, plot, link 2; runs 3 and note.
        assert_eq!(html.matches("&lt;script&gt;").count(), 4 + 5 + 7 + 4);
        assert_eq!(html.matches("<td class=\"text\">{{version}}</td>").count(), 2);
        assert!(html.contains("<svg></svg>"));
    }
}
