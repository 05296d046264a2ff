//! The page of a spring, or another linkage, under a head.

use super::data::{ShownMode, SpringView};
use super::html::{self, NamedValue, escaped};
use super::stage::Stage;
use super::table::PageTable;
use super::{encode, scripts};
use crate::plot::PlotError;

const SECTION: &str = include_str!("assets/spring.html");
const CONTROLS: &str = include_str!("assets/modes.html");

/// The page of a spring, or another linkage, under a head: rest pose, modes, stiffness and limits.
pub struct SpringPage {
    /// Title.
    pub title: String,
    /// The result in a sentence or two.
    pub summary: String,
    /// The three-dimensional view.
    pub view: SpringView,
    /// Tables under the view.
    pub tables: Vec<NotedTable>,
    /// Load, rest pose and limits.
    pub properties: Vec<NamedValue>,
}

/// A table with a note under it.
pub struct NotedTable {
    /// The table.
    pub table: PageTable,
    /// The note.
    pub note: String,
}

impl SpringPage {
    /// The HTML of the page; the same data give the same bytes.
    ///
    /// # Errors
    /// When a value cannot be written as JSON.
    pub fn html(&self) -> Result<String, PlotError> {
        let sections = format!(
            "{}{}<section id=\"properties\"><h2>Load and limits</h2>\n<div class=\"tables\">\n{}</div></section>\n",
            self.view.section(),
            self.tables.iter().map(NotedTable::section).collect::<String>(),
            html::table("Head and linkage", self.properties.iter().cloned()),
        );
        let data = encode::spring_json(&self.view).map_err(|error| PlotError::Drawing(error.to_string()))?;
        Ok(html::Document {
            kind: "spring",
            title: &self.title,
            status: "",
            introduction: &html::summary(&self.summary),
            without_scripts: "The three-dimensional view needs scripts; the tables do not.",
            sections: &sections,
            footer: "All values are in spring.json.",
            version: env!("CARGO_PKG_VERSION"),
            data: &data,
            scripts: &scripts::MODES,
        }
        .html())
    }
}

impl SpringView {
    fn section(&self) -> String {
        let stage = Stage {
            title: "Head and spring",
            overlays: "<p id=\"scale\" class=\"tag\"></p>\n",
            slider: "Phase",
            speeds: "<option value=\"slow\" selected>2 s a cycle</option><option value=\"0.1\">real time / 10</option>\
                     <option value=\"1\">real time</option>",
        };
        let mode = |(k, mode): (usize, &ShownMode)| {
            format!(
                "<li><label><input type=\"radio\" name=\"mode\" value=\"{k}\"> <span>{}<small>{}</small></span></label></li>\n",
                escaped(&capitalised(&mode.name)),
                escaped(&mode.details),
            )
        };
        let modes: String = self.modes.iter().enumerate().map(mode).collect();
        let (title, player, controls) = match self.modes.is_empty() {
            true => ("Without load", String::new(), "<p>No modes: the head has no rest pose.</p>\n".to_owned()),
            false => (
                "At rest and in its modes",
                stage.playbar(),
                html::fill(CONTROLS, &[("modes", &modes), ("shake", &escaped(&self.shake))]),
            ),
        };
        let note = escaped(&self.note);
        let values = [("view_title", title), ("player", &player), ("controls", &controls), ("note", &note)];
        stage.fill(SECTION, &values)
    }
}

impl NotedTable {
    fn section(&self) -> String {
        let title = escaped(&self.table.title);
        let note = escaped(&self.note);
        format!("<section><h2>{title}</h2>\n{}<p class=\"help\">{note}</p></section>\n", self.table.html())
    }
}

fn capitalised(name: &str) -> String {
    let mut characters = name.chars();
    characters.next().map(|first| first.to_uppercase().chain(characters).collect()).unwrap_or_default()
}
