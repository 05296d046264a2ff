//! Catalogue of available springs, as CSV with the columns that suppliers print.

use super::spec::CoilDesign;
use std::path::Path;
use zsim_base::spec::{Kind, Source, SpecError, name_from, text_file};
use zsim_elasticity::{EndsSpec, Material};

/// The built-in catalogue, a file of `specs/springs/`.
const STOCK: &str = "catalogue.csv";

/// The names of the column of each quantity, without a unit; lengths are in mm. A single letter is not another case of itself:
/// `D` and `d` are the mean and the wire diameter of EN 13906-1.
const NAME: &[&str] = &["name", "part", "part_number", "part_no", "article", "article_number", "order_number", "sku"];
const MEAN_DIAMETER: &[&str] = &["coil_diameter", "mean_diameter", "mean_coil_diameter", "dm", "D"];
const OUTER_DIAMETER: &[&str] = &["outer_diameter", "outside_diameter", "od", "de"];
const INNER_DIAMETER: &[&str] = &["inner_diameter", "inside_diameter", "id", "di"];
const WIRE_DIAMETER: &[&str] = &["wire_diameter", "wire", "wire_size", "wire_d", "d"];
const ACTIVE_COILS: &[&str] = &["active_coils", "active", "n"];
const TOTAL_COILS: &[&str] = &["total_coils", "coils", "nt"];
const FREE_LENGTH: &[&str] = &["free_length", "l0"];
const ENDS: &[&str] = &["ends", "end_type", "end"];
const MATERIAL: &[&str] = &["material", "wire_material"];

/// Reads the catalogue that the spec `referring` calls `name`: a CSV file, in the folder of `referring` or in the current
/// one, or `"stock"` for the built-in one.
///
/// The columns are found by their names, in any order and case, between commas, semicolons or tabs; others are ignored.
/// Needed are the wire diameter, one of mean, outer and inner diameter, active coils, or total coils with ends, and the free
/// length. A name, ends (`open`, `closed`, `closed_ground`, or `active_only` for a free length without ends) and material are
/// optional; defaults: the line number, `active_only` for active coils, `spring_steel`.
///
/// # Errors
/// When the file cannot be read, a column is missing or a line is invalid; the error has the line number.
pub fn catalogue(name: &str, referring: &Source) -> Result<Vec<CoilDesign>, SpecError> {
    let source = match name {
        "stock" => text_file(Kind::Spring, &Source::in_memory(STOCK, ""), STOCK)?,
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
        let names: Vec<&str> = header.split(separator).map(unquoted).collect();
        let lengths = [MEAN_DIAMETER, OUTER_DIAMETER, INNER_DIAMETER, WIRE_DIAMETER, FREE_LENGTH].concat();
        let in_inches = |name: &&&str| without_inches(name).is_some_and(|length| lengths.contains(&length.as_str()));
        if let Some(name) = names.iter().find(in_inches) {
            return Err(format!("the column \"{name}\" is in inches; lengths must be in mm"));
        }
        let columns = Self { separator, names: names.into_iter().map(normalised).collect() };
        let has = |names: &[&str]| columns.index(names).is_some();
        let (diameters, coils) =
            ([MEAN_DIAMETER, OUTER_DIAMETER, INNER_DIAMETER].concat(), [ACTIVE_COILS, TOTAL_COILS].concat());
        let needed = [
            ("wire diameter", WIRE_DIAMETER),
            ("coil diameter", &diameters),
            ("coils", &coils),
            ("free length", FREE_LENGTH),
        ];
        match needed.into_iter().find(|(_, names)| !has(names)) {
            None => Ok(columns),
            Some((missing, names)) => {
                let names = names.join(", ");
                Err(format!("the first line of a spring catalogue needs a column for the {missing}, named {names}"))
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
        let (active, total) = (number(ACTIVE_COILS)?, number(TOTAL_COILS)?);
        let needs_ends = active.is_none() && total.is_some();
        if needs_ends && text(ENDS).is_none() {
            let message =
                "total coils need their ends (open, closed or closed_ground): how many are active depends on them";
            return Err(message.to_owned());
        }
        let needed = |value: Option<f64>, name: &str| value.ok_or_else(|| format!("there is no {name}"));
        let wire_mm = needed(number(WIRE_DIAMETER)?, "wire diameter")?;
        let by_outer = number(OUTER_DIAMETER)?.map(|outer_mm| outer_mm - wire_mm);
        let by_inner = number(INNER_DIAMETER)?.map(|inner_mm| inner_mm + wire_mm);
        let ends = text(ENDS).map_or(Ok(EndsSpec::default()), ends)?;
        let by_total = total.map(|total| total - ends.inactive_coils());
        Ok(CoilDesign {
            name: text(NAME).map_or_else(|| format!("line {line_number}"), str::to_owned),
            coil_diameter_mm: needed(number(MEAN_DIAMETER)?.or(by_outer).or(by_inner), "coil diameter")?,
            wire_diameter_mm: wire_mm,
            active_coils: needed(active.or(by_total), "number of coils")?,
            free_length_mm: needed(number(FREE_LENGTH)?, "free length")?,
            ends,
            material: text(MATERIAL).map_or(Ok(Material::SpringSteel), material)?,
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

/// A column's name for comparison: without the unit mm, words joined by underscores, in lower case but for a single letter.
fn normalised(name: &str) -> String {
    joined(&words(name).filter(|word| !word.eq_ignore_ascii_case("mm")).collect::<Vec<_>>())
}

/// A column's name as from [`normalised`] without the unit inch; `None` if this is not its unit.
fn without_inches(name: &str) -> Option<String> {
    let words: Vec<&str> = words(name).collect();
    let (unit, quantity) = words.split_last()?;
    ["in", "inch", "inches"].contains(&unit.to_lowercase().as_str()).then(|| joined(quantity))
}

fn words(name: &str) -> impl Iterator<Item = &str> {
    name.split(['(', '[', ')', ']', '/', '.', ' ', '-', '_']).filter(|word| !word.is_empty())
}

fn joined(words: &[&str]) -> String {
    match words {
        [letter] if letter.len() == 1 => (*letter).to_owned(),
        words => words.join("_").to_lowercase(),
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
        assert!(error.contains("active_coils") && error.contains("total_coils"), "{error}");
        // EN 13906-1: d of the wire, D of the coil, n active coils; and names with units.
        let of_standard = read("D,d,n,L0\n25,3,12,120\n").unwrap();
        let with_units = read("Mean diameter (mm),Wire d [mm],Active coils,Free length_mm\n25,3,12,120\n").unwrap();
        assert_eq!(of_standard, with_units);
        assert_eq!((of_standard[0].coil_diameter_mm, of_standard[0].wire_diameter_mm), (25.0, 3.0));
        let error = read("OD (in),wire,active,l0\n1.1,3,12,120\n").unwrap_err();
        assert!(error.contains("inches"), "{error}");
        assert_eq!(read("Built in,D,d,n,L0\nHalle,25,3,12,120\n").unwrap(), of_standard, "not a length");
        // Of 10.5 closed coils 8.5 are active.
        let error = read("wire,od,total coils,free length\n3.2,35.2,10.5,100\n").unwrap_err();
        assert!(error.contains("line 2: total coils need their ends"), "{error}");
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
