//! Exported meshes, read back by the importer and sized by the rules of their formats.

use std::path::Path;
use zsim::geometry::Vector;
use zsim::world::{MeshFormat, Ray, World};

const FORMATS: [(&str, MeshFormat); 3] =
    [("scene.glb", MeshFormat::Glb), ("scene.obj", MeshFormat::Obj), ("scene.stl", MeshFormat::Stl)];
/// Exported corners are of single precision: this is the step at 64 m, m.
const SINGLE_STEP_M: f64 = 7.7e-6;

/// A world of one mesh file.
fn imported(folder: &Path, mesh: &str, bytes: &[u8]) -> World {
    std::fs::write(folder.join(mesh), bytes).unwrap();
    let text = format!(
        "(name: \"scene\", materials: {{\"a\": (reflectance: 0.5)}}, items: [\n\
         Solid(shape: Mesh(file: \"{mesh}\"), material: \"a\"),\n])"
    );
    std::fs::write(folder.join("scene.ron"), text).unwrap();
    World::load(folder.join("scene.ron").to_str().unwrap()).unwrap_or_else(|error| panic!("{error}"))
}

/// Rays in directions of a spiral on the sphere, from a point.
fn rays(origin_in_world: Vector) -> impl Iterator<Item = Ray> {
    (0..400).map(move |k| {
        let z = (f64::from(k) + 0.5) / 200.0 - 1.0;
        let (sine, cosine) = (f64::from(k) * 2.399_963).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        Ray { origin_in_world, direction_in_world: Vector::new(radius * cosine, radius * sine, z) }
    })
}

#[test]
fn an_exported_scene_has_the_same_surfaces_when_it_is_imported() {
    let folder = tempfile::tempdir().unwrap();
    for scene in ["office", "stairwell", "courtyard"] {
        let world = World::load(scene).unwrap();
        let origin = world.default_route().unwrap().points_in_world[0] + Vector::z();
        for (name, format) in FORMATS {
            let again = imported(folder.path(), name, &world.mesh(format).unwrap());
            assert_eq!(again.triangles().count(), world.triangles().count(), "{scene} {name}");
            let (bounds, expected) = (again.bounds(), world.bounds());
            assert!((bounds.0 - expected.0).norm() < 3.0 * SINGLE_STEP_M, "{scene} {name}: {bounds:?}");
            assert!((bounds.1 - expected.1).norm() < 3.0 * SINGLE_STEP_M, "{scene} {name}: {bounds:?}");
            // A rounded corner moves a silhouette, and what is behind it: such a ray hits something else.
            let differ = rays(origin)
                .filter(|ray| {
                    let [here, there] = [&world, &again].map(|world| world.cast(ray, 100.0, 0.0));
                    match (here, there) {
                        (Some(here), Some(there)) => (here.distance_m - there.distance_m).abs() > 1e-3,
                        (here, there) => here.is_some() != there.is_some(),
                    }
                })
                .count();
            assert!(differ <= 2, "{scene} {name}: {differ} of 400 rays differ");
        }
    }
}

#[test]
fn a_glb_declares_its_lengths_its_materials_and_metres() {
    let world = World::load("office").unwrap();
    let bytes = world.mesh(MeshFormat::Glb).unwrap();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
    let json: serde_json::Value = serde_json::from_slice(&bytes[20..20 + word(12)]).unwrap();
    let names: Vec<&str> =
        json["materials"].as_array().unwrap().iter().map(|material| material["name"].as_str().unwrap()).collect();
    assert!(names.contains(&"plaster") && names.contains(&"glass"), "{names:?}");
    // glTF has y up, so the height is the second coordinate.
    let (lower, upper) = world.bounds();
    for accessor in json["accessors"].as_array().unwrap().iter().filter(|accessor| accessor["type"] == "VEC3") {
        let height = |end: &str| accessor[end][1].as_f64().unwrap();
        assert!(height("min") >= lower.z - SINGLE_STEP_M && height("max") <= upper.z + SINGLE_STEP_M, "{accessor}");
    }
}
