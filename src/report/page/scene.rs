//! The page of a scene.

use super::data::View;
use super::html::NamedValue;
use super::{encode, html, scripts, stage};
use crate::plot::{Figure, PlotError};

/// The page of a scene: its surfaces in three dimensions, a floor plan and its materials.
pub struct ScenePage<'a> {
    /// Name of the scene.
    pub name: &'a str,
    /// The surfaces, coloured by material, and the default route as the estimate.
    pub view: View,
    /// Size, routes and other properties.
    pub properties: Vec<NamedValue>,
    /// The materials in use.
    pub materials: Vec<MaterialRow>,
    /// Floor plan and elevation.
    pub plan: Figure,
}

/// A material with the surface that it covers.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialRow {
    /// Name.
    pub name: String,
    /// Fraction of light scattered back at normal incidence.
    pub reflectance: f64,
    /// Fraction of light transmitted.
    pub transmission: f64,
    /// Area, m^2.
    pub area_m2: f64,
}

impl ScenePage<'_> {
    /// The HTML of the page; the same data give the same bytes.
    ///
    /// # Errors
    /// When the plan cannot be drawn, or a value cannot be written as JSON.
    pub fn html(&self) -> Result<String, PlotError> {
        let sections = format!(
            "{}<section id=\"plan\"><h2>Floor plan and elevation</h2>\n{}</section>\n\
             <section id=\"properties\"><h2>Contents</h2>\n<div class=\"tables\">\n{}{}</div></section>\n",
            stage::view_section("Surfaces and route", "route", "route"),
            self.plan.svg()?,
            html::table("scene", self.properties.iter().cloned()),
            html::table("materials", self.materials.iter().map(MaterialRow::row)),
        );
        let data = encode::view_json(&self.view).map_err(|error| PlotError::Drawing(error.to_string()))?;
        Ok(html::Document {
            kind: "scene",
            title: self.name,
            status: "",
            introduction: "",
            without_scripts: "The three-dimensional view needs scripts; the floor plan below does not.",
            sections: &sections,
            footer: "",
            version: env!("CARGO_PKG_VERSION"),
            data: &data,
            scripts: &scripts::VIEW,
        }
        .html())
    }
}

impl MaterialRow {
    fn row(&self) -> NamedValue {
        let transmission =
            if self.transmission > 0.0 { format!(", transmits {:.2}", self.transmission) } else { String::new() };
        let value = format!("reflectance {:.2}{transmission}, {:.0} m\u{b2}", self.reflectance, self.area_m2);
        NamedValue { name: self.name.clone(), value }
    }
}
