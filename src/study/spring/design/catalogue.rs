//! Catalogue of available springs, as CSV: `name,coil_diameter_mm,wire_diameter_mm,active_coils,free_length_mm,material`.

use super::spec::CoilDesign;
use crate::elasticity::Material;
use crate::spec::{Source, SpecError, name_from};
use std::path::Path;

/// The built-in catalogue: `specs/springs/catalogue.csv`.
pub const STOCK: &str = include_str!("../../../../specs/springs/catalogue.csv");

const HEADER: &str = "name,coil_diameter_mm,wire_diameter_mm,active_coils,free_length_mm,material";

/// Reads the catalogue that the spec `referring` calls `name`: a CSV file, in the folder of `referring` or in the current
/// one, or `"stock"` for the built-in one.
///
/// # Errors
/// When the file cannot be read or a line is invalid; the error has the line number.
pub fn catalogue(name: &str, referring: &Source) -> Result<Vec<CoilDesign>, SpecError> {
    let source = match name {
        "stock" => Source::in_memory("specs/springs/catalogue.csv (built in)", STOCK),
        name => Source::read(Path::new(&name_from(referring, name)))?,
    };
    let lines = source.text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let mut lines = lines.map(|(index, line)| (index + 1, line.trim()));
    match lines.next() {
        Some((_, HEADER)) => {}
        _ => {
            return Err(SpecError::plain(
                &source.name,
                format!("the first line of a spring catalogue must be \"{HEADER}\""),
            ));
        }
    }
    lines.map(|(number, line)| spring(line).map_err(|problem| line_error(&source, number, &problem))).collect()
}

fn line_error(source: &Source, line: usize, problem: &str) -> SpecError {
    SpecError::plain(&source.name, format!("line {line}: {problem}"))
}

fn spring(line: &str) -> Result<CoilDesign, String> {
    let fields: Vec<&str> = line.split(',').map(str::trim).collect();
    let [name, coil, wire, coils, length, material] = fields[..] else {
        return Err(format!("found {} fields, expected 6", fields.len()));
    };
    let number = |text: &str| match text.parse::<f64>() {
        Ok(x) if x.is_finite() && x > 0.0 => Ok(x),
        _ => Err(format!("expected a finite number above 0, found \"{text}\"")),
    };
    let material = match material {
        "spring_steel" => Material::SpringSteel,
        "stainless" => Material::Stainless,
        other => return Err(format!("expected spring_steel or stainless, found \"{other}\"")),
    };
    Ok(CoilDesign {
        name: name.to_owned(),
        coil_diameter_mm: number(coil)?,
        wire_diameter_mm: number(wire)?,
        active_coils: number(coils)?,
        free_length_mm: number(length)?,
        material,
    })
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

    #[test]
    fn the_error_of_an_invalid_line_has_its_number() {
        let folder = tempfile::tempdir().unwrap();
        let text = format!("{HEADER}\na,25,3,12,120,spring_steel\nb,25,-3,12,120,stainless\n");
        std::fs::write(folder.path().join("springs.csv"), text).unwrap();
        let referring = Source { folder: Some(folder.path().to_owned()), ..Source::in_memory("design.ron", "") };
        let error = catalogue("springs.csv", &referring).unwrap_err().to_string();
        assert!(error.contains("line 3") && error.contains("-3"), "{error}");
    }
}
