//! Mesh files as programs write them: concave faces, text encodings, materials, positions far from the origin.

use zsim::geometry::Vector;
use zsim::world::{Hit, Ray, World, WorldError};

/// A wall of 4 m x 3 m at y = 0 with an open doorway of 1 m x 2 m: x from 1.5 m to 2.5 m.
const DOOR: [[f64; 3]; 8] = [
    [0., 0., 3.],
    [0., 0., 0.],
    [1.5, 0., 0.],
    [1.5, 0., 2.],
    [2.5, 0., 2.],
    [2.5, 0., 0.],
    [4., 0., 0.],
    [4., 0., 3.],
];
const ROOM: &str = "v -5 -4 0\nv 5 -4 0\nv 5 4 0\nv -5 4 0\nv -5 -4 3\nv 5 -4 3\nv 5 4 3\nv -5 4 3\n\
                    f 1 2 3 4\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\n";

/// A scene of one mesh with these `keys` at `at_m_deg`; the scene has the materials `wall` and `glass`.
fn build(file: &str, bytes: &[u8], keys: &str, at: &str) -> Result<World, WorldError> {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join(file), bytes).unwrap();
    let text = format!(
        "(name: \"scene\", materials: {{\"wall\": (reflectance: 0.5), \"glass\": (reflectance: 0.1)}},\n items: [\n  \
         Solid(shape: Mesh(file: \"{file}\" {keys}), material: \"wall\", at_m_deg: [{at}]),\n])"
    );
    std::fs::write(here.path().join("scene.ron"), text).unwrap();
    World::load(here.path().join("scene.ron").to_str().unwrap())
}

fn world(file: &str, bytes: &[u8]) -> World {
    build(file, bytes, "", "(0, 0)").unwrap_or_else(|error| panic!("{error}"))
}

/// The error message about the mesh.
fn error(file: &str, bytes: &[u8]) -> String {
    match build(file, bytes, "", "(0, 0)").err() {
        Some(WorldError::Mesh(error)) => error.message().to_owned(),
        Some(WorldError::Scene(error)) => panic!("{error}"),
        None => panic!("{file} is accepted"),
    }
}

/// The hit of a beam along y through (x, z).
fn along_y(world: &World, x: f64, z: f64) -> Option<Hit> {
    world.cast(&Ray { origin_in_world: Vector::new(x, -9.0, z), direction_in_world: Vector::y() }, 30.0, 0.0)
}

fn numbers(points: &[[f64; 3]], before: &str) -> String {
    points.iter().map(|[x, y, z]| format!("{before}{x} {y} {z}\n")).collect()
}

fn obj(points: &[[f64; 3]]) -> Vec<u8> {
    let face: String = (1..=points.len()).map(|k| format!(" {k}")).collect();
    format!("{}f{face}\n", numbers(points, "v ")).into_bytes()
}

fn ply(points: &[[f64; 3]], format: &str) -> Vec<u8> {
    let count = points.len();
    let header = format!(
        "ply\nformat {format} 1.0\nelement vertex {count}\nproperty double x\nproperty double y\nproperty double z\n\
         element face 1\nproperty list uchar ushort vertex_indices\nend_header\n"
    );
    let mut bytes = header.into_bytes();
    match format {
        "ascii" => {
            let face: String = (0..count).map(|k| format!(" {k}")).collect();
            bytes.extend(format!("{}{count}{face}\n", numbers(points, "")).into_bytes());
        }
        _ => {
            points.iter().flatten().for_each(|x| bytes.extend(x.to_be_bytes()));
            bytes.push(count as u8);
            (0..count as u16).for_each(|k| bytes.extend(k.to_be_bytes()));
        }
    }
    bytes
}

/// A facet with any number of corners, as some programs write them.
fn stl(points: &[[f64; 3]]) -> Vec<u8> {
    format!("solid a\nfacet normal 0 0 0\nouter loop\n{}endloop\nendfacet\nendsolid a\n", numbers(points, "vertex "))
        .into_bytes()
}

/// One face in every format that has polygons.
fn files_of(points: &[[f64; 3]]) -> [(&'static str, Vec<u8>); 4] {
    [
        ("a.obj", obj(points)),
        ("a.ply", ply(points, "ascii")),
        ("b.ply", ply(points, "binary_big_endian")),
        ("a.stl", stl(points)),
    ]
}

/// A face of one or two corners in a PLY file caused a panic.
#[test]
fn a_face_of_fewer_than_three_corners_is_an_error_in_every_format() {
    for count in 0..3 {
        for (name, bytes) in files_of(&DOOR[..count]) {
            let error = error(name, &bytes);
            assert!(error.contains("at least three corners"), "{name}, {count} corners: {error}");
        }
    }
}

#[test]
fn beams_pass_an_open_doorway_in_every_format_and_from_every_first_corner() {
    for start in 0..DOOR.len() {
        let mut points = DOOR;
        points.rotate_left(start);
        for (name, bytes) in files_of(&points) {
            let world = world(name, &bytes);
            for k in 0..69 {
                let (x, z) = (1.51 + 0.98 * f64::from(k) / 68.0, 0.05 + f64::from(k * 7 % 69) / 68.0 * 1.9);
                assert!(along_y(&world, x, z).is_none(), "{name} from corner {start}: a beam at {x}, {z} hits");
                assert!(along_y(&world, x, 2.0 + 0.5 * z).is_some(), "{name}: above the doorway");
                assert!(
                    along_y(&world, x - 1.5, z).is_some() && along_y(&world, x + 1.5, z).is_some(),
                    "{name}: beside it"
                );
            }
        }
    }
}

#[test]
fn a_face_that_crosses_itself_or_is_warped_is_named() {
    let [mut crossed, mut warped] = [DOOR; 2];
    crossed.swap(3, 4);
    warped[3][1] = 0.5;
    for (name, bytes) in files_of(&crossed) {
        assert!(error(name, &bytes).contains("face 1 crosses itself"), "{name}: {}", error(name, &bytes));
    }
    for (name, bytes) in files_of(&warped) {
        let message = error(name, &bytes);
        assert!(message.contains("face 1 is not flat") && message.contains("the maximum is 2 %"), "{name}: {message}");
    }
    let second = format!("{ROOM}v 0 0 0\nv 1 0 1\nv 1 0 0\nv 0 0 1\nf -4 -3 -2 -1\n");
    assert!(error("room.obj", second.as_bytes()).contains("face 5 crosses itself"));
}

/// The room in text formats.
fn texts() -> [(&'static str, String); 3] {
    let points: Vec<[f64; 3]> = ROOM
        .lines()
        .filter_map(|line| line.strip_prefix("v "))
        .map(|line| line.split(' ').map(|x| x.parse().unwrap()).collect::<Vec<f64>>().try_into().unwrap())
        .collect();
    let faces = [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [2, 3, 7, 6]];
    let facets = faces.map(|face| String::from_utf8(stl(&face.map(|k: usize| points[k]))).unwrap()).concat();
    let ply_faces: String = faces.iter().map(|[a, b, c, d]| format!("4 {a} {b} {c} {d}\n")).collect();
    let header = "ply\nformat ascii 1.0\ncomment BÜRO\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n\
                  element face 4\nproperty list uchar int vertex_indices\nend_header\n";
    [
        ("room.obj", format!("# BÜRO\no BÜRO\n{ROOM}")),
        ("room.stl", facets.replace("solid a", "solid BÜRO")),
        ("room.ply", format!("{header}{}{ply_faces}", numbers(&points, ""))),
    ]
}

#[test]
fn a_mark_latin_1_and_any_line_ends_are_read() {
    let latin_1 = |text: &str| text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect::<Vec<u8>>();
    for (name, text) in texts() {
        let variants = [
            text.clone().into_bytes(),
            format!("\u{feff}{text}").into_bytes(),
            latin_1(&text),
            text.replace('\n', "\r\n").into_bytes(),
            text.replace('\n', "\r").into_bytes(),
            latin_1(&text.replace('\n', "\r")),
        ];
        for (k, bytes) in variants.iter().enumerate() {
            let world = world(name, bytes);
            assert_eq!(
                world.bounds(),
                (Vector::new(-5.0, -4.0, 0.0), Vector::new(5.0, 4.0, 3.0)),
                "{name}, variant {k}"
            );
            assert_eq!(world.triangle_count(), 8, "{name}, variant {k}");
        }
        let utf16 = text.encode_utf16();
        let little: Vec<u8> = [0xfeff].into_iter().chain(utf16.clone()).flat_map(u16::to_le_bytes).collect();
        let unmarked: Vec<u8> = utf16.flat_map(u16::to_be_bytes).collect();
        for bytes in [little, unmarked] {
            assert!(error(name, &bytes).contains("is UTF-16 text: save it as UTF-8"), "{name}");
        }
    }
}

#[test]
fn ascii_stl_has_keywords_in_any_case_leading_blanks_and_several_solids() {
    let [_, (name, text), _] = texts();
    for text in [
        text.to_uppercase(),
        format!("\n \t\n{text}"),
        text.replace("endsolid", "EndSolid").replace("solid BÜRO", "  Solid facet vertex 1"),
        text,
    ] {
        assert_eq!(world(name, text.as_bytes()).triangle_count(), 8, "four solids of two triangles each");
    }
    let cut = b"solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n";
    assert!(error(name, cut).contains("ends within a facet"));
    assert!(
        error(name, b"solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0\n")
            .contains("line 4: `vertex` wants three numbers")
    );
    assert!(error(name, b"solid a\nhello\n").contains("line 2"));
}

#[test]
fn faces_have_the_materials_of_the_scene_that_their_names_select() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 2 0 0\nv 2 0 1\nv 3 0 0\nv 3 0 1\nv 4 0 0\nv 4 0 1\n\
                f 1 2 3 4\nusemtl glass\nf 2 5 6 3\nusemtl Wood.001\nf 5 7 8 6\nusemtl wall\nf 7 9 10 8\n";
    let world = world("wall.obj", text.as_bytes());
    let material = |x: f64| world.material(along_y(&world, x, 0.5).unwrap().material).name.clone();
    assert_eq!([0.5, 1.5, 2.5, 3.5].map(material), ["wall", "glass", "wall", "wall"]);
    assert_eq!(world.notes(), ["wall.obj: the scene has no material `Wood.001`; these faces are `wall`"]);
}

#[test]
fn an_exported_scene_keeps_its_materials() {
    let office = World::load("office").unwrap();
    let names: Vec<String> =
        office.materials().iter().map(|material| format!("\"{}\": (reflectance: 0.5)", material.name)).collect();
    let areas = |world: &World| {
        let mut areas = std::collections::BTreeMap::new();
        for ([a, b, c], material) in world.triangles() {
            *areas.entry(world.material(material).name.clone()).or_insert(0.0) += (b - a).cross(&(c - a)).norm() / 2.0;
        }
        areas
    };
    for format in [zsim::world::MeshFormat::Glb, zsim::world::MeshFormat::Obj] {
        let here = tempfile::tempdir().unwrap();
        let file = if format == zsim::world::MeshFormat::Glb { "office.glb" } else { "office.obj" };
        std::fs::write(here.path().join(file), office.mesh(format).unwrap()).unwrap();
        let first = &office.materials()[0].name;
        let text = format!(
            "(name: \"s\", materials: {{{}}}, items: [Solid(shape: Mesh(file: \"{file}\"), material: \"{first}\")])",
            names.join(", ")
        );
        std::fs::write(here.path().join("scene.ron"), text).unwrap();
        let read = World::load(here.path().join("scene.ron").to_str().unwrap()).unwrap();
        let (expected, found) = (areas(&office), areas(&read));
        assert_eq!(expected.len(), found.len(), "{file}");
        for (name, area) in expected {
            assert!((found[&name] - area).abs() < 1e-3 * area, "{file}, {name}: {} of {area} m^2", found[&name]);
        }
    }
}

#[test]
fn a_mesh_far_from_the_origin_has_an_offset_as_remedy() {
    let room = |east: f64, north: f64| {
        let shift = |line: &str| match line.strip_prefix("v ") {
            Some(numbers) => {
                let x: Vec<f64> = numbers.split(' ').map(|x| x.parse().unwrap()).collect();
                format!("v {} {} {}\n", x[0] + east, x[1] + north, x[2])
            }
            None => format!("{line}\n"),
        };
        ROOM.lines().map(shift).collect::<String>()
    };
    let survey = room(691_608.0, 5_334_764.0);
    let message = build("room.obj", survey.as_bytes(), "", "(0, 0)").err().unwrap().to_string();
    assert!(
        message.contains("more than 100 km from the origin") && message.contains("10.0 x 8.0 x 3.0 m"),
        "{message}"
    );
    let offset = message.rsplit_once("at_m_deg: [").and_then(|(_, rest)| rest.split_once(']')).unwrap().0;
    let world = build("room.obj", survey.as_bytes(), "", offset).unwrap_or_else(|error| panic!("{error}"));
    assert!(world.notes().is_empty(), "{:?}", world.notes());
    assert!(world.bounds().0.amax() < 6.0 && world.bounds().1.amax() < 6.0);
    let near = build("room.obj", room(50_000.0, 0.0).as_bytes(), "", "(0, 0)").unwrap();
    assert!(near.notes()[0].starts_with("room.obj is 50.0 km from the origin"), "{:?}", near.notes());
}
