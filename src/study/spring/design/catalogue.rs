//! Catalogue of available springs, as CSV with the columns that suppliers print.

use super::spec::CoilDesign;
use crate::elasticity::{EndsSpec, Material};
use crate::spec::{Source, SpecError, name_from};
use std::path::Path;

/// The built-in catalogue: `specs/springs/catalogue.csv`.
pub const STOCK: &str = include_str!("../../../../specs/springs/catalogue.csv");

/// A quantity of a spring, and the names of its column. Lengths are in mm.
const NAME: [&str; 5] = ["name", "part", "part_number", "article", "order_number"];
const MEAN_DIAMETER: [&str; 4] = ["coil_diameter_mm", "mean_diameter_mm", "mean_diameter", "dm"];
const OUTER_DIAMETER: [&str; 5] = ["outer_diameter_mm", "outer_diameter", "outside_diameter", "od", "de"];
const INNER_DIAMETER: [&str; 5] = ["inner_diameter_mm", "inner_diameter", "inside_diameter", "id", "di"];
const WIRE_DIAMETER: [&str; 3] = ["wire_diameter_mm", "wire_diameter", "wire"];
const ACTIVE_COILS: [&str; 2] = ["active_coils", "active"];
const TOTAL_COILS: [&str; 3] = ["total_coils", "coils", "nt"];
const FREE_LENGTH: [&str; 3] = ["free_length_mm", "free_length", "l0"];
const ENDS: [&str; 2] = ["ends", "end_type"];
const MATERIAL: [&str; 2] = ["material", "wire_material"];

/// Reads the catalogue that the spec `referring` calls `name`: a CSV file, in the folder of `referring` or in the current
/// one, or `"stock"` for the built-in one.
///
/// The columns are found by their names, in any order and case, between commas, semicolons or tabs; others are ignored.
/// Needed are the wire diameter, one of mean, outer and inner diameter, active or total coils, and the free length. A
/// name, ends (`open`, `closed`, `closed_ground`, or `active_only` for a free length without ends) and material are
/// optional; defaults: the line number, `active_only`, `spring_steel`.
///
/// # Errors
/// When the file cannot be read, a column is missing or a line is invalid; the error has the line number.
pub fn catalogue(name: &str, referring: &Source) -> Result<Vec<CoilDesign>, SpecError> {
    let source = match name {
        "stock" => Source::in_memory("specs/springs/catalogue.csv (built in)", STOCK),
        name => Source::read(Path::new(&name_from(referring, name)))?,
    };
    let lines = source.text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let mut lines = lines.map(|(index, line)| (index + 1, line.trim()));
    let header = lines.next().map_or("", |(_, line)| line);
    let columns = Columns::of(header).map_err(|problem| SpecError::plain(&source.name, problem))?;
    let spring = |(number, line): (usize, &str)| {
        columns
            .spring(number, line)
            .map_err(|problem| SpecError::plain(&source.name, format!("line {number}: {problem}")))
    };
    lines.map(spring).collect()
}

/// The columns of a catalogue.
struct Columns {
    separator: char,
    names: Vec<String>,
}

impl Columns {
    fn of(header: &str) -> Result<Self, String> {
        let separator = [';', '\t'].into_iter().find(|c| header.contains(*c)).unwrap_or(',');
        let names =
            header.split(separator).map(|name| unquoted(name).to_lowercase().replace([' ', '-'], "_")).collect();
        let columns = Self { separator, names };
        let has = |names: &[&str]| columns.index(names).is_some();
        let needed = [
            ("wire_diameter_mm", has(&WIRE_DIAMETER)),
            (
                "coil_diameter_mm, outer_diameter_mm or inner_diameter_mm",
                has(&MEAN_DIAMETER) || has(&OUTER_DIAMETER) || has(&INNER_DIAMETER),
            ),
            ("active_coils or total_coils", has(&ACTIVE_COILS) || has(&TOTAL_COILS)),
            ("free_length_mm", has(&FREE_LENGTH)),
        ];
        match needed.into_iter().find(|(_, is_there)| !is_there) {
            None => Ok(columns),
            Some((missing, _)) => {
                Err(format!("the first line of a spring catalogue must name a column {missing}; it is \"{header}\""))
            }
        }
    }

    fn index(&self, names: &[&str]) -> Option<usize> {
        self.names.iter().position(|column| names.contains(&column.as_str()))
    }

    fn spring(&self, line_number: usize, line: &str) -> Result<CoilDesign, String> {
        let fields: Vec<&str> = line.split(self.separator).map(unquoted).collect();
        if fields.len() != self.names.len() {
            return Err(format!("found {} fields, expected {}", fields.len(), self.names.len()));
        }
        let text = |names: &[&str]| self.index(names).map(|k| fields[k]).filter(|field| !field.is_empty());
        let number = |names: &[&str]| text(names).map(|field| self.number(field)).transpose();
        let needed = |value: Option<f64>, name: &str| value.ok_or_else(|| format!("there is no {name}"));
        let wire_mm = needed(number(&WIRE_DIAMETER)?, "wire diameter")?;
        let by_outer = number(&OUTER_DIAMETER)?.map(|outer_mm| outer_mm - wire_mm);
        let by_inner = number(&INNER_DIAMETER)?.map(|inner_mm| inner_mm + wire_mm);
        let ends = text(&ENDS).map_or(Ok(EndsSpec::default()), ends)?;
        let by_total = number(&TOTAL_COILS)?.map(|total| total - ends.inactive_coils());
        Ok(CoilDesign {
            name: text(&NAME).map_or_else(|| format!("line {line_number}"), str::to_owned),
            coil_diameter_mm: needed(number(&MEAN_DIAMETER)?.or(by_outer).or(by_inner), "coil diameter")?,
            wire_diameter_mm: wire_mm,
            active_coils: needed(number(&ACTIVE_COILS)?.or(by_total), "number of coils")?,
            free_length_mm: needed(number(&FREE_LENGTH)?, "free length")?,
            ends,
            material: text(&MATERIAL).map_or(Ok(Material::SpringSteel), material)?,
        })
    }

    /// A positive number; with semicolons or tabs between the columns, the decimal separator can be a comma.
    fn number(&self, field: &str) -> Result<f64, String> {
        let text = if self.separator == ',' { field.to_owned() } else { field.replace(',', ".") };
        match text.parse::<f64>() {
            Ok(x) if x.is_finite() && x > 0.0 => Ok(x),
            _ => Err(format!("expected a finite number above 0, found \"{field}\"")),
        }
    }
}

fn unquoted(field: &str) -> &str {
    field.trim().trim_matches('"').trim()
}

fn ends(text: &str) -> Result<EndsSpec, String> {
    match text.to_lowercase().replace([' ', '-'], "_").as_str() {
        "active_only" => Ok(EndsSpec::ActiveOnly),
        "open" => Ok(EndsSpec::Open),
        "closed" => Ok(EndsSpec::Closed),
        "closed_ground" | "closed_and_ground" | "ground" => Ok(EndsSpec::ClosedGround),
        _ => Err(format!("expected active_only, open, closed or closed_ground, found \"{text}\"")),
    }
}

fn material(text: &str) -> Result<Material, String> {
    match text.to_lowercase().replace([' ', '-'], "_").as_str() {
        "spring_steel" | "music_wire" | "en_10270_1" => Ok(Material::SpringSteel),
        "stainless" | "stainless_302" | "en_10270_3" | "1.4310" => Ok(Material::Stainless),
        _ => Err(format!("expected spring_steel or stainless, found \"{text}\"")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_spring_of_the_built_in_catalogue_is_valid() {
        let springs = catalogue("stock", &Source::in_memory("design.ron", "")).unwrap();
        assert!(springs.len() > 100);
        for spring in springs {
            assert!(spring.spring().design().is_ok(), "{spring:?}");
        }
    }

    /// Reads a catalogue with this text.
    fn read(text: &str) -> Result<Vec<CoilDesign>, String> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("springs.csv"), text).unwrap();
        let referring = Source { folder: Some(folder.path().to_owned()), ..Source::in_memory("design.ron", "") };
        catalogue("springs.csv", &referring).map_err(|error| error.to_string())
    }

    #[test]
    fn columns_are_found_by_the_names_that_suppliers_use() {
        // 25 mm mean diameter from 28 mm outside and from 22 mm inside; 14 coils with closed ends are 12 active ones.
        let text = "Part number;OD;Wire;Price;Free length;Total coils;End type;Material\n\
                    \"X 1\";28,0;3,0;1,20;126,0;14;closed and ground;1.4310\n";
        let [spring] = &read(text).unwrap()[..] else { panic!("one spring") };
        let expected = CoilDesign {
            name: "X 1".to_owned(),
            coil_diameter_mm: 25.0,
            wire_diameter_mm: 3.0,
            active_coils: 12.0,
            free_length_mm: 126.0,
            ends: EndsSpec::ClosedGround,
            material: Material::Stainless,
        };
        assert_eq!(*spring, expected);
        let inner = read("id,wire,active,l0\n22,3,12,120\n").unwrap();
        assert_eq!((inner[0].coil_diameter_mm, inner[0].label()), (25.0, "line 2".to_owned()));
        let error = read("id,wire,l0\n22,3,120\n").unwrap_err();
        assert!(error.contains("active_coils or total_coils"), "{error}");
    }

    #[test]
    fn the_error_of_an_invalid_line_has_its_number() {
        let header = "name,coil_diameter_mm,wire_diameter_mm,active_coils,free_length_mm,material";
        let error = read(&format!("{header}\na,25,3,12,120,spring_steel\nb,25,-3,12,120,stainless\n")).unwrap_err();
        assert!(error.contains("line 3") && error.contains("-3"), "{error}");
        let error = read(&format!("{header}\na,25,3,12\n")).unwrap_err();
        assert!(error.contains("found 4 fields, expected 6"), "{error}");
    }
}
