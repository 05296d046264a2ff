//! Wavefront OBJ.

use super::part::Part;
use crate::material::one_word;
use std::fmt::Write;

/// The text of the file: a group and a material name for each part, corners in order of the triangles.
pub(super) fn encode(name: &str, parts: &[Part<'_>]) -> String {
    let mut text = format!("# {}: metres, z up\n", one_word(name));
    let mut corners = 0;
    for part in parts {
        let material = one_word(&part.material.name);
        let _ = writeln!(text, "g {material}\nusemtl {material}");
        for triangle in &part.triangles {
            for corner in triangle {
                let _ = writeln!(text, "v {} {} {}", corner.x, corner.y, corner.z);
            }
            let _ = writeln!(text, "f {} {} {}", corners + 1, corners + 2, corners + 3);
            corners += 3;
        }
    }
    text
}
