//! The limits of scenes and meshes that docs/reference/limits.md lists: each is exceeded by one.

use std::path::Path;
use zsim::spec::{Source, parse};
use zsim::world::World;

/// The error of a scene in a folder with these files; a file can be extended by zeros to a length.
fn error(scene: &str, files: &[(&str, &str, u64)]) -> String {
    let here = tempfile::tempdir().unwrap();
    for (name, text, length) in files {
        let path = here.path().join(name);
        std::fs::write(&path, text).unwrap();
        if *length > 0 {
            std::fs::File::options().write(true).open(path).unwrap().set_len(*length).unwrap();
        }
    }
    let source = Source { folder: Some(here.path().to_owned()), ..Source::in_memory("scene.ron", scene) };
    let built = parse(&source).map_err(Into::into).and_then(|spec| World::build(&spec, &source));
    built.err().unwrap_or_else(|| panic!("accepted: {scene}")).to_string()
}

/// The error of a scene with these items.
fn items(items: &str) -> String {
    let text = format!(
        "(name: \"s\", materials: {{\"a\": (reflectance: 0.5)}}, templates: {{\"t\": [Solid(shape: Rectangle(size_m: (1, 1)), \
         material: \"a\")], \"b\": [Solid(shape: Box(size_m: (1, 1, 1)), material: \"a\")], \"n\": [Place(template: \"n\")]}}, items: [{items}])"
    );
    error(&text, &[])
}

fn solid(shape: &str) -> String {
    format!("Solid(shape: {shape}, material: \"a\")")
}

/// The error of a scene with one mesh.
fn mesh(file: &str, text: &str, length: u64) -> String {
    mesh_of(file, &[(file, text, length)])
}

fn mesh_of(file: &str, files: &[(&str, &str, u64)]) -> String {
    let item = solid(&format!("Mesh(file: \"{file}\")"));
    error(&format!("(name: \"s\", materials: {{\"a\": (reflectance: 0.5)}}, items: [{item}])"), files)
}

fn scatter(count: u32, keys: &str) -> String {
    format!("Scatter((template: \"t\", seed: 1, count: {count}, region_m: ((0, 0, 0), (9, 9, 9)), {keys} turn: Fixed))")
}

/// A glTF document with one mesh of indexed triangles in `buffer.bin`.
fn gltf(nodes: &str, mode: u32, indices: u64, bytes: u64) -> String {
    format!(
        r#"{{"scenes":[{{"nodes":[0]}}],"nodes":[{nodes}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"mode":{mode}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":1,"type":"VEC3"}},
                     {{"bufferView":0,"componentType":5121,"count":{indices},"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":{bytes}}}],"buffers":[{{"byteLength":{bytes},"uri":"buffer.bin"}}]}}"#
    )
}

fn gltf_error(document: &str, buffer_bytes: u64) -> String {
    mesh_of("m.gltf", &[("m.gltf", document, 0), ("buffer.bin", "", buffer_bytes)])
}

/// A row of the table, what exceeds it, and a part of the message.
type Case = (&'static str, String, &'static str);

fn many(count: usize, text: &str) -> String {
    text.repeat(count)
}

/// Limits of the items of a scene.
fn scene_cases() -> Vec<Case> {
    let rolling = |cells: &str| {
        solid(&format!(
            "HeightField(size_m: (9, 9), heights: Rolling(seed: 1, cells: {cells}, amplitude_m: 1, wavelength_m: 5))"
        ))
    };
    vec![
        (
            "| size and position of an item of a scene | 100 km |",
            items(&solid("Box(size_m: (100001, 1, 1))")),
            "100 km",
        ),
        (
            "| sides, steps and cells of a shape | 4096 each, 4 million cells |",
            items(&solid("Stairs(steps: 4097, width_m: 1, rise_m: 0.1, tread_m: 0.1)")),
            "from 1 to 4096",
        ),
        (
            "| sides, steps and cells of a shape | 4096 each, 4 million cells |",
            items(&rolling("(4096, 4096)")),
            "more than 4000000",
        ),
        ("| templates that contain each other | 8 levels |", items("Place(template: \"n\")"), "deeper than 8"),
        (
            "| copies of a scatter; of all scatters of a scene | 200 000; 1 million |",
            items(&scatter(200_001, "min_spacing_m: 0,")),
            "1 to 200000",
        ),
        (
            "| copies of a scatter; of all scatters of a scene | 200 000; 1 million |",
            items(&many(6, &(scatter(170_000, "min_spacing_m: 0,") + ","))),
            "more than 1000000 copies",
        ),
        (
            "| search for the positions of all scatters of a scene | about 5 s |",
            items(&scatter(200_000, "min_spacing_m: 0.5,")),
            "within the limit of time",
        ),
        (
            "| triangles of a scene or a mesh | 10 million |",
            items(&many(5, &(scatter(170_000, "min_spacing_m: 0,").replace("\"t\"", "\"b\"") + ","))),
            "more than 10000000 triangles",
        ),
    ]
}

/// Limits of meshes in any format.
fn mesh_cases() -> Vec<Case> {
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let ply = "ply\nformat binary_little_endian 1.0\nelement vertex 30000001\nproperty uchar x\nproperty uchar y\nproperty uchar z\n\
               element face 1\nproperty list uchar uchar vertex_indices\nend_header\n";
    vec![
        ("| vertices of a mesh | 30 million |", mesh("m.ply", ply, 31_000_000), "more than 30000000 vertices"),
        (
            "| corners of a face | 10 000 |",
            mesh("m.obj", &format!("{triangle}f{}\n", many(10_001, " 1")), 0),
            "the maximum is 10000",
        ),
        (
            "| corners of a face | 10 000 |",
            mesh("m.stl", &format!("solid\nouter loop\n{}endloop\n", many(10_001, "vertex 0 0 0\n")), 0),
            "the maximum is 10000",
        ),
        (
            "| squares of the numbers of corners of all faces, summed | 1e10 |",
            mesh("m.obj", &(triangle.to_owned() + &many(101, &format!("f{}\n", many(5_000, " 1 2")))), 0),
            "too many faces with thousands of corners",
        ),
        (
            "| distance of a corner from the plane of its face | 2 % of the face's size |",
            mesh("m.obj", &format!("{triangle}v 1 1 0.2\nf 1 2 4 3\n"), 0),
            "the maximum is 2 %",
        ),
        (
            "| materials of a mesh | 65 535 |",
            mesh("m.obj", &(0..65_536).map(|k| format!("usemtl {k}\n")).collect::<String>(), 0),
            "more than 65535 materials",
        ),
        (
            "| triangles of a mesh without area | a tenth of them; they are removed, with a note |",
            mesh("m.obj", &format!("{triangle}f 1 2 3\nf 1 1 2\n"), 0),
            "the maximum is 10 %",
        ),
        (
            "| a mesh's file; the buffers of a glTF file together | 1 GiB each |",
            mesh("m.stl", "", (1 << 30) + 1),
            "at most 1073741824",
        ),
    ]
}

/// Limits of glTF files.
fn gltf_cases() -> Vec<Case> {
    // Each of 21 nodes has the next one twice.
    let doubled: Vec<String> = (1..22).map(|k| format!("{{\"children\":[{k},{k}]}}")).collect();
    let nested: Vec<String> = (1..66).map(|k| format!("{{\"children\":[{k}]}}")).collect();
    let last = ",{\"mesh\":0}";
    vec![
        (
            "| triangles of a scene or a mesh | 10 million |",
            gltf_error(&gltf(&last[1..], 5, 10_000_003, 10_000_003), 10_000_003),
            "more than 10000000 triangles",
        ),
        (
            "| a mesh's file; the buffers of a glTF file together | 1 GiB each |",
            gltf_error(&gltf(&last[1..], 4, 3, 12), (1 << 30) + 1),
            "more than 1073741824 bytes",
        ),
        (
            "| document of a glTF file | 256 MiB, 1 million objects of a kind |",
            mesh("m.gltf", "{", (256 << 20) + 1),
            "the maximum is 268435456",
        ),
        (
            "| document of a glTF file | 256 MiB, 1 million objects of a kind |",
            mesh("m.gltf", &format!("{{\"nodes\":[{}{{}}]}}", many(1_000_000, "{},")), 0),
            "more than 1000000 objects",
        ),
        (
            "| nodes of a glTF file | 64 levels, 1 million visits |",
            gltf_error(&gltf(&(doubled.join(",") + last), 4, 0, 12), 12),
            "more than 1000000 times",
        ),
        (
            "| nodes of a glTF file | 64 levels, 1 million visits |",
            gltf_error(&gltf(&(nested.join(",") + last), 4, 0, 12), 12),
            "deeper than 64",
        ),
    ]
}

#[test]
fn each_limit_of_scenes_and_meshes_is_documented_and_holds() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference/limits.md");
    let documented = std::fs::read_to_string(path).unwrap();
    for (row, message, part) in [scene_cases(), mesh_cases(), gltf_cases()].concat() {
        assert!(documented.contains(row), "not documented: {row}");
        assert!(message.contains(part), "{row}: {message}");
    }
}

#[cfg(unix)]
#[test]
fn devices_and_pipes_are_not_opened() {
    let here = tempfile::tempdir().unwrap();
    let fifo = here.path().join("buffer.bin");
    assert!(std::process::Command::new("mkfifo").arg(&fifo).status().unwrap().success());
    std::os::unix::fs::symlink("/dev/zero", here.path().join("zero.obj")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", here.path().join("scene.ron")).unwrap();
    std::fs::write(here.path().join("m.gltf"), gltf("{\"mesh\":0}", 4, 3, 12)).unwrap();
    std::fs::write(here.path().join("z.gltf"), gltf("{\"mesh\":0}", 4, 3, 12).replace("buffer.bin", "zero.obj"))
        .unwrap();
    let scene = |include: &str, file: &str| {
        let text = format!(
            "(name: \"s\", include: [{include}], materials: {{\"a\": (reflectance: 0.5)}}, items: [{}])",
            solid(&format!("Mesh(file: \"{file}\")"))
        );
        let source = Source { folder: Some(here.path().to_owned()), ..Source::in_memory("s.ron", text) };
        World::build(&parse(&source).unwrap(), &source).err().unwrap().to_string()
    };
    for file in ["m.gltf", "z.gltf", "zero.obj"] {
        assert!(scene("", file).contains("not a regular file"), "{}", scene("", file));
    }
    assert!(scene("\"scene.ron\"", "m.gltf").contains("no such scene"), "{}", scene("\"scene.ron\"", "m.gltf"));
}

#[test]
fn many_buffers_share_one_binary_chunk() {
    // 401 buffers of 4 MiB each, which were copied: 1.6 GiB.
    let (count, bytes) = (401, 4 << 20);
    let mut json = gltf("{\"mesh\":0}", 4, 3, 48)
        .replacen("\"buffers\":[", &format!("\"buffers\":[{}", format!("{{\"byteLength\":{bytes}}},").repeat(count)), 1)
        .into_bytes();
    json = String::from_utf8(json).unwrap().replace(",\"uri\":\"buffer.bin\"", "").into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut blob = vec![0_u8; bytes];
    blob[..4].copy_from_slice(&[0, 0, 0, 0]);
    let chunk = |kind: &[u8; 4], data: &[u8]| [&(data.len() as u32).to_le_bytes()[..], kind, data].concat();
    let chunks = [chunk(b"JSON", &json), chunk(b"BIN\0", &blob)].concat();
    let glb = [b"glTF", &2_u32.to_le_bytes()[..], &(12 + chunks.len() as u32).to_le_bytes(), &chunks].concat();
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("m.glb"), glb).unwrap();
    let text =
        format!("(name: \"s\", materials: {{\"a\": (reflectance: 0.5)}}, items: [{}])", solid("Mesh(file: \"m.glb\")"));
    std::fs::write(here.path().join("s.ron"), text).unwrap();
    // All its triangles are one point, so the mesh is refused after the buffers.
    let script = "ulimit -v 1000000; exec \"$0\" check s.ron";
    let mut command = std::process::Command::new("sh");
    let output = command.args(["-c", script, env!("CARGO_BIN_EXE_zsim")]).current_dir(here.path()).output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && stderr.contains("1 of its 1 triangles have no area"), "{stderr}");
}
