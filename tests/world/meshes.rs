//! Mesh files: the same solid in every format, and invalid files.

use approx::assert_relative_eq;
use proptest::prelude::*;
use std::path::Path;
use zsim::geometry::Vector;
use zsim::world::{Ray, World, WorldError};

/// Corners of a box of 2 x 1 x 3 m around the point (0.5, 0, 0).
const CORNERS: [[f32; 3]; 8] = [
    [-0.5, -0.5, -1.5],
    [1.5, -0.5, -1.5],
    [1.5, 0.5, -1.5],
    [-0.5, 0.5, -1.5],
    [-0.5, -0.5, 1.5],
    [1.5, -0.5, 1.5],
    [1.5, 0.5, 1.5],
    [-0.5, 0.5, 1.5],
];
const FACES: [[u8; 4]; 6] = [[3, 2, 1, 0], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

fn triangles() -> Vec<[u8; 3]> {
    FACES.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect()
}

fn obj() -> Vec<u8> {
    let mut text = String::from("# a box\nmtllib none.mtl\no box\nvn 0 0 1\nvt 0 0\n");
    for [x, y, z] in CORNERS {
        text += &format!("v {x} {y} {z}\n");
    }
    for (k, face) in FACES.iter().enumerate() {
        let corners = face.map(|corner| match k % 3 {
            0 => format!("{}", corner + 1),
            1 => format!("{}//1", corner + 1),
            _ => format!("{}/1/1", i32::from(corner) - 8),
        });
        text += &format!("f {} {} \\\n {} {}\n", corners[0], corners[1], corners[2], corners[3]);
    }
    text.into_bytes()
}

fn stl_binary(header: &str) -> Vec<u8> {
    let mut bytes = format!("{header:<80}").into_bytes();
    bytes.extend(12_u32.to_le_bytes());
    for triangle in triangles() {
        bytes.extend([0; 12]);
        let corners = triangle.iter().flat_map(|corner| CORNERS[usize::from(*corner)]);
        bytes.extend(corners.flat_map(f32::to_le_bytes));
        bytes.extend([0; 2]);
    }
    bytes
}

fn stl_ascii() -> Vec<u8> {
    let mut text = String::from("solid box\n");
    for triangle in triangles() {
        text += "facet normal 0 0 0\n outer loop\n";
        for [x, y, z] in triangle.map(|corner| CORNERS[usize::from(corner)]) {
            text += &format!("  vertex {x} {y} {z}\n");
        }
        text += " endloop\nendfacet\n";
    }
    (text + "endsolid box\n").into_bytes()
}

fn ply_header(format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment a box\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nelement face 6\nproperty list uchar int vertex_indices\nend_header\n"
    )
}

fn ply_ascii() -> Vec<u8> {
    let mut text = ply_header("ascii");
    for [x, y, z] in CORNERS {
        text += &format!("{x} {y} {z} 200\n");
    }
    for [a, b, c, d] in FACES {
        text += &format!("4 {a} {b} {c} {d}\n");
    }
    text.into_bytes()
}

fn ply_binary(is_little: bool) -> Vec<u8> {
    let mut bytes = ply_header(if is_little { "binary_little_endian" } else { "binary_big_endian" }).into_bytes();
    for corner in CORNERS {
        bytes.extend(corner.map(|x| if is_little { x.to_le_bytes() } else { x.to_be_bytes() }).concat());
        bytes.push(200);
    }
    for face in FACES {
        bytes.push(4);
        let indices = face.map(i32::from);
        bytes.extend(indices.map(|k| if is_little { k.to_le_bytes() } else { k.to_be_bytes() }).concat());
    }
    bytes
}

/// The box as a glTF buffer: glTF has y up, so z becomes y and y becomes -z.
fn gltf_buffer() -> Vec<u8> {
    let corners = CORNERS.iter().flat_map(|[x, y, z]| [*x, *z, -*y]).flat_map(f32::to_le_bytes);
    corners.chain(triangles().concat()).collect()
}

/// The glTF document: the node shifts the box by 10 along x, and its parent shifts it back.
fn gltf_json(uri: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
        "nodes":[{{"children":[1],"translation":[-10,0,0]}},{{"mesh":0,"translation":[10,0,0]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3","min":[-0.5,-1.5,-0.5],"max":[1.5,1.5,0.5]}},
                     {{"bufferView":1,"componentType":5121,"count":36,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":96}},{{"buffer":0,"byteOffset":96,"byteLength":36}}],
        "buffers":[{{"byteLength":132{uri}}}]}}"#
    )
}

fn glb() -> Vec<u8> {
    let mut json = gltf_json("").into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let chunk = |kind: &[u8; 4], data: &[u8]| [&(data.len() as u32).to_le_bytes()[..], kind, data].concat();
    let chunks = [chunk(b"JSON", &json), chunk(b"BIN\0", &gltf_buffer())].concat();
    [b"glTF", &2_u32.to_le_bytes()[..], &(12 + chunks.len() as u32).to_le_bytes(), &chunks].concat()
}

fn gltf_embedded() -> Vec<u8> {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let groups = gltf_buffer()
        .chunks(3)
        .map(|group| group.iter().fold(0, |bits, byte| bits << 8 | usize::from(*byte)))
        .collect::<Vec<_>>();
    let text: String =
        groups.iter().flat_map(|bits| [18, 12, 6, 0].map(|at| char::from(DIGITS[bits >> at & 63]))).collect();
    gltf_json(&format!(r#","uri":"data:application/octet-stream;base64,{text}""#)).into_bytes()
}

/// A folder with a scene of one mesh.
struct Scene {
    folder: tempfile::TempDir,
}

impl Scene {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn build(&self, mesh: &str, bytes: &[u8]) -> Result<World, WorldError> {
        self.build_with(mesh, bytes, "scale: 2")
    }

    /// A world with one mesh and these `keys`.
    fn build_with(&self, mesh: &str, bytes: &[u8], keys: &str) -> Result<World, WorldError> {
        std::fs::write(self.path().join(mesh), bytes).unwrap();
        let text = format!(
            "(name: \"scene\",\n materials: {{\"a\": (reflectance: 0.5)}},\n items: [\n  \
             Solid(shape: Mesh(file: \"{mesh}\", {keys}), material: \"a\", at_m_deg: [(1, 2, 3, 90)]),\n])"
        );
        std::fs::write(self.path().join("scene.ron"), text).unwrap();
        World::load(self.path().join("scene.ron").to_str().unwrap())
    }

    /// The error message without its location, which is the mesh's name in the scene.
    fn error(&self, mesh: &str, bytes: &[u8]) -> String {
        match self.build(mesh, bytes).err().unwrap_or_else(|| panic!("{mesh} is accepted")) {
            WorldError::Mesh(error) => {
                assert_eq!(error.line_and_column().unwrap().0, 4, "{error}");
                error.message().to_owned()
            }
            WorldError::Scene(error) => panic!("{error}"),
        }
    }
}

#[test]
fn a_box_is_the_same_box_from_every_format() {
    // 2 x 1 x 3 m around (0.5, 0, 0), scaled by two, rotated by 90 degrees about z, and shifted to (1, 2, 3): x from
    // 1 - 1 to 1 + 1, y from 2 - 1 to 2 + 3, z from 3 - 3 to 3 + 3.
    let scene = Scene::new();
    std::fs::write(scene.path().join("box data.bin"), gltf_buffer()).unwrap();
    let files = [
        ("box.obj", obj()),
        ("box.stl", stl_binary("made by a program")),
        ("solid.stl", stl_binary("solid by name, binary by nature")),
        ("ascii.STL", stl_ascii()),
        ("ascii.ply", ply_ascii()),
        ("little.ply", ply_binary(true)),
        ("big.ply", ply_binary(false)),
        ("box.glb", glb()),
        ("box.gltf", gltf_json(r#","uri":"box%20data.bin""#).into_bytes()),
        ("embedded.gltf", gltf_embedded()),
    ];
    for (name, bytes) in files {
        let world = scene.build(name, &bytes).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(world.triangle_count(), 12, "{name}");
        assert!(world.notes().is_empty());
        let (lower, upper) = world.bounds();
        assert_relative_eq!(lower, Vector::new(0.0, 1.0, 0.0), epsilon = 1e-12);
        assert_relative_eq!(upper, Vector::new(2.0, 5.0, 6.0), epsilon = 1e-12);
        for axis in 0..3 {
            let direction_in_world = Vector::ith(axis, 1.0);
            let ray =
                Ray { origin_in_world: Vector::new(1.2, 3.3, 2.9) - direction_in_world * 20.0, direction_in_world };
            let face = [0.0, 1.0, 0.0][axis];
            let expected = face - ray.origin_in_world[axis];
            assert_relative_eq!(world.cast(&ray, 30.0, 0.0).unwrap().distance_m, expected, epsilon = 1e-9);
        }
    }
}

#[test]
fn the_unit_and_the_up_axis_of_a_mesh_can_be_specified() {
    // The box is 2 x 1 x 3 of its units, around (0.5, 0, 0). With y up, its y points along z and its z along -y: 2 x 3 x
    // 1. It is rotated by 90 degrees about z at (1, 2, 3).
    let scene = Scene::new();
    let size = |file: &str, bytes: &[u8], keys: &str| {
        let (lower, upper) = scene.build_with(file, bytes, keys).unwrap_or_else(|error| panic!("{error}")).bounds();
        upper - lower
    };
    for (keys, metres) in
        [("unit: m", 1.0), ("unit: cm", 0.01), ("unit: mm", 1e-3), ("unit: inch", 0.0254), ("unit: foot", 0.3048)]
    {
        assert_relative_eq!(size("box.obj", &obj(), keys), Vector::new(1.0, 2.0, 3.0) * metres, epsilon = 1e-12);
    }
    assert_relative_eq!(size("box.obj", &obj(), "scale: 3, unit: cm"), Vector::new(0.03, 0.06, 0.09), epsilon = 1e-12);
    assert_relative_eq!(size("box.stl", &stl_binary("x"), "up: y"), Vector::new(3.0, 2.0, 1.0), epsilon = 1e-12);
    assert_relative_eq!(size("box.stl", &stl_binary("x"), "up: z"), Vector::new(1.0, 2.0, 3.0), epsilon = 1e-12);
    assert_relative_eq!(size("box.glb", &glb(), "up: y"), Vector::new(1.0, 2.0, 3.0), epsilon = 1e-12);
    assert_relative_eq!(size("box.glb", &glb(), "up: z"), Vector::new(3.0, 2.0, 1.0), epsilon = 1e-12);
    assert!(scene.build_with("box.obj", &obj(), "unit: furlong").is_err());
}

#[test]
fn an_invalid_mesh_is_an_error_with_the_reason() {
    let scene = Scene::new();
    let faults: [(&str, Vec<u8>, &str); 17] = [
        ("hall.dae", b"<COLLADA/>".to_vec(), "convert it to glTF"),
        ("empty.obj", b"".to_vec(), "has no triangles"),
        ("points.ply", ply_ascii()[..0].to_vec(), "does not start with `ply`"),
        ("nan.obj", b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec(), "triangle 1 has a corner that is not finite"),
        ("huge.obj", b"v 0 0 1e999\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec(), "not finite"),
        ("index.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n".to_vec(), "face 1 names the vertex 3; there are 3"),
        ("back.obj", b"v 0 0 0\nf -1 -2 -3\n".to_vec(), "face 1 names the vertex -1"),
        ("zero.obj", b"v 0 0 0\nf 0 1 1\n".to_vec(), "line 2"),
        ("overflow.obj", b"v 0 0 0\nf 99999999999999999999 1 1\n".to_vec(), "line 2"),
        ("two.obj", b"v 0 0 0\nv 1 1 1\nf 1 2\n".to_vec(), "at least three corners"),
        ("flat.obj", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n".to_vec(), "1 of its 1 triangles have no area"),
        ("short.stl", stl_binary("x")[..400].to_vec(), "declares 12 triangles (684 bytes), but contains 400 bytes"),
        ("tiny.stl", b"abc".to_vec(), "3 bytes"),
        ("cut.ply", ply_binary(true)[..250].to_vec(), "declares 8 of `vertex`, but contains "),
        ("cut.glb", glb()[..500].to_vec(), "declares"),
        ("up.gltf", gltf_json(r#","uri":"../secret.bin""#).into_bytes(), "not a file in the mesh's folder"),
        ("box.fbx", b"x".to_vec(), "ends in neither"),
    ];
    for (name, bytes, part) in faults {
        let sentence = scene.error(name, &bytes);
        assert!(sentence.contains(part), "{name}: {sentence}");
        assert!(sentence.contains(name), "{name}: {sentence}");
    }
}

#[test]
fn a_header_that_declares_too_much_is_refused_at_once() {
    let scene = Scene::new();
    let ply = String::from_utf8(ply_ascii()).unwrap().replace("vertex 8", "vertex 4000000000");
    assert!(scene.error("many.ply", ply.as_bytes()).contains("4000000000 of `vertex`"));
    let bare = "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nelement face 0\nend_header\n";
    assert!(scene.error("bare.ply", bare.as_bytes()).contains("4000000000 of `vertex` with 0 properties"));
    let mut stl = stl_binary("x");
    stl[80..84].fill(0xff);
    assert!(scene.error("many.stl", &stl).contains("declares 4294967295 triangles"));
    let gltf = gltf_json(r#","uri":"data:x;base64,AAAA""#).replace("132", "4000000000");
    assert!(scene.error("many.gltf", gltf.as_bytes()).contains("4000000000 bytes in a buffer"));
    let count = gltf_json("").replace("\"count\":36", "\"count\":18446744073709551615");
    assert!(scene.build("count.gltf", count.as_bytes()).is_err());
}

#[test]
fn cyclic_nodes_are_an_error() {
    let scene = Scene::new();
    std::fs::write(scene.path().join("box.bin"), gltf_buffer()).unwrap();
    let round = gltf_json(r#","uri":"box.bin""#).replace("\"mesh\":0,", "\"mesh\":0,\"children\":[0],");
    assert!(scene.error("round.gltf", round.as_bytes()).contains("form a cycle"));
}

#[test]
fn a_few_triangles_without_area_are_removed_with_a_note() {
    let scene = Scene::new();
    let mut text = String::from_utf8(obj()).unwrap();
    let grid = (0..20).flat_map(|i| (0..20).map(move |j| (i, j)));
    for (i, j) in grid {
        text += &format!("v {i} {j} 0\nv {} {j} 0\nv {i} {} 0\nf -3 -2 -1\n", i + 1, j + 1);
    }
    text += "v 0 0 0\nv 1 1 1\nv 2 2 2\nf -3 -2 -1\n";
    let world = scene.build("patched.obj", text.as_bytes()).unwrap();
    assert_eq!(world.notes(), ["patched.obj: removed 1 of 413 triangles, which have no area"]);
    assert_eq!(world.triangle_count(), 412);
}

#[test]
fn a_mesh_that_is_probably_in_another_unit_has_a_note() {
    let scene = Scene::new();
    let of_length = |x: f64| format!("v 0 0 0\nv {x} 0 0\nv 0 1 0\nf 1 2 3\n");
    let notes =
        |x: f64, keys: &str| scene.build_with("stair.obj", of_length(x).as_bytes(), keys).unwrap().notes().to_vec();
    assert_eq!(
        notes(2400.0, "scale: 1"),
        ["stair.obj is 2400 m long: if it is drawn in mm (2.4 m) or cm (24 m), add `unit: mm` or `unit: cm`"]
    );
    assert!(notes(2400.0, "unit: mm").is_empty() && notes(100.0, "scale: 1").is_empty());
    assert_eq!(notes(10.0, "unit: mm"), ["stair.obj is only 10.000 mm long: its `unit` or `scale` is probably wrong"]);
}

#[test]
fn up_to_a_tenth_of_the_triangles_may_have_no_area() {
    let scene = Scene::new();
    let flat = |count: usize| "v 0 0 0\nv 1 1 1\nv 2 2 2\nf -3 -2 -1\n".repeat(count);
    let sound: String = (0..90).map(|k| format!("v 0 0 {k}\nv 1 0 {k}\nv 0 1 {k}\nf -3 -2 -1\n")).collect();
    let world = scene.build("hall.obj", (sound.clone() + &flat(10)).as_bytes()).unwrap();
    assert_eq!(world.notes(), ["hall.obj: removed 10 of 100 triangles, which have no area"]);
    assert_eq!(world.triangle_count(), 90);
    let error = scene.error("hall.obj", (sound + &flat(11)).as_bytes());
    assert!(error.contains("11 of its 101 triangles have no area") && error.contains("10 %"), "{error}");
}

#[test]
fn a_mesh_of_slivers_is_refused() {
    let scene = Scene::new();
    let text: String = (0..1000).map(|k| format!("v 0 0 {k}\nv 1 0 {k}\nv 2 1e-9 {k}\nf -3 -2 -1\n")).collect();
    assert!(scene.error("slivers.obj", text.as_bytes()).contains("1000 of its 1000 triangles have no area"));
}

/// Every valid file of this test with its file name.
fn valid_files() -> [(&'static str, Vec<u8>); 8] {
    [
        ("m.obj", obj()),
        ("m.stl", stl_binary("x")),
        ("a.stl", stl_ascii()),
        ("a.ply", ply_ascii()),
        ("l.ply", ply_binary(true)),
        ("b.ply", ply_binary(false)),
        ("m.glb", glb()),
        ("m.gltf", gltf_embedded()),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_are_an_error_or_a_mesh(which in 0..8_usize, bytes in proptest::collection::vec(any::<u8>(), 0..600)) {
        let scene = Scene::new();
        let _ = scene.build(valid_files()[which].0, &bytes);
    }

    #[test]
    fn a_truncated_and_changed_file_is_an_error_or_a_mesh(
        which in 0..8_usize,
        keep in 0.0..1.0_f64,
        changes in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 0..6),
    ) {
        let (name, mut bytes) = valid_files()[which].clone();
        for (at, byte) in &changes {
            let at = at.index(bytes.len());
            bytes[at] = *byte;
        }
        if changes.len() < 3 {
            bytes.truncate((bytes.len() as f64 * keep) as usize);
        }
        let scene = Scene::new();
        if let Ok(world) = scene.build(name, &bytes) {
            // An accepted mesh must support ray casts.
            let ray = Ray { origin_in_world: Vector::new(1.2, 3.3, -20.0), direction_in_world: Vector::z() };
            let hit = world.cast(&ray, 1e6, 0.0);
            prop_assert!(hit.is_none_or(|hit| hit.distance_m.is_finite() && (hit.normal_in_world.norm() - 1.0).abs() < 1e-9));
        }
    }

    #[test]
    fn a_number_replaced_in_a_text_file_is_an_error_or_a_mesh(which in 0..3_usize, at in any::<proptest::sample::Index>(), number in any::<i64>()) {
        let (name, bytes) = valid_files()[[0, 3, 7][which]].clone();
        let text = String::from_utf8(bytes).unwrap();
        let numbers: Vec<(usize, &str)> = text.match_indices(|c: char| c.is_ascii_digit()).collect();
        let (from, digit) = numbers[at.index(numbers.len())];
        let changed = format!("{}{number}{}", &text[..from], &text[from + digit.len()..]);
        let _ = Scene::new().build(name, changed.as_bytes());
    }
}
