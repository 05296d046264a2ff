//! The page of a scene.

use super::data::View;
use super::table::named_values;
use super::{encode, html, scripts, stage};
use crate::Table;
use crate::plot::{Figure, PlotError};

/// The page of a scene: its surfaces in three dimensions, a floor plan and its materials.
pub struct ScenePage<'a> {
    /// Name of the scene.
    pub name: &'a str,
    /// The surfaces, coloured by material, and the default route as the estimate.
    pub view: View,
    /// Size, routes and other properties.
    pub properties: Table,
    /// The materials in use, with their properties.
    pub materials: Table,
    /// Floor plan and elevation.
    pub plan: Figure,
}

impl ScenePage<'_> {
    /// The HTML of the page; the same data give the same bytes.
    ///
    /// # Errors
    /// When the plan cannot be drawn.
    pub fn html(&self) -> Result<String, PlotError> {
        let sections = format!(
            "{}<section id=\"plan\"><h2>Floor plan and elevation</h2>\n{}</section>\n\
             <section id=\"properties\"><h2>Contents</h2>\n<div class=\"tables\">\n{}{}</div></section>\n",
            stage::view_section("Surfaces and route", "route", "route"),
            self.plan.svg()?,
            named_values("scene", &self.properties.rows),
            named_values("materials", &self.materials.rows),
        );
        Ok(html::Page {
            kind: "scene",
            title: self.name,
            status: "",
            introduction: "",
            without_scripts: "The three-dimensional view needs scripts; the floor plan below does not.",
            sections: &sections,
            footer: "",
            version: env!("CARGO_PKG_VERSION"),
            data: &encode::view_json(&self.view),
            scripts: &scripts::VIEW,
        }
        .html())
    }
}
