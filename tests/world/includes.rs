//! Scenes that include scenes: contents, and errors with the file that causes them.

use zsim::geometry::{Surface, Vector};
use zsim::spec::{Source, parse, to_text};
use zsim::world::{SceneSpec, World, WorldError};

const HALL: &str = r#"(
    name: "hall",
    materials: { "stone": (reflectance: 0.5) },
    templates: { "pillar": [Solid(shape: Box(size_m: (1, 1, 3)), material: "stone")] },
    items: [Place(template: "pillar", at_m_deg: [(5, 0)])],
    routes: { "way": (closed: false, points_m: [(0, 0, 0), (1, 0, 0)]) },
    default_route: "way",
)"#;

const GUEST: &str = r#"(
    name: "guest",
    include: ["hall"],
    materials: { "cloth": (reflectance: 0.3) },
    templates: { "post": [Solid(shape: Box(size_m: (0.2, 0.2, 2)), material: "cloth")] },
    items: [Place(template: "post", at_m_deg: [(2, 0)])],
    movers: [(template: "pillar", repeats: false, waypoints: [(time_s: 0, at_m_deg: (-3, 0))])],
)"#;

/// The scene `name` of a folder with `files`, built.
fn built(files: &[(&str, &str)], name: &str) -> Result<World, WorldError> {
    let here = tempfile::tempdir().unwrap();
    for (file, text) in files {
        let path = here.path().join(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    let source = Source::read(&here.path().join(name))?;
    World::build(&parse(&source)?, &source)
}

#[test]
fn a_scene_has_its_own_and_its_included_contents() {
    let world = built(&[("hall.ron", HALL), ("guest.ron", GUEST)], "guest.ron").unwrap();
    assert_eq!(world.name(), "guest");
    assert_eq!(world.triangle_count(), 24, "pillar and post, without movers");
    assert!(world.nearest(&Vector::new(4.49, 0.0, 1.0), 0.02).is_some(), "the hall's pillar");
    assert!(world.nearest(&Vector::new(1.89, 0.0, 1.0), 0.02).is_some(), "the guest's post");
    assert_eq!(world.default_route().unwrap().points_in_world.len(), 2, "the hall's way");
}

#[test]
fn a_resolved_scene_is_written_with_its_includes() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("hall.ron"), HALL).unwrap();
    std::fs::write(here.path().join("guest.ron"), GUEST).unwrap();
    let source = Source::read(&here.path().join("guest.ron")).unwrap();
    let whole = parse::<SceneSpec>(&source).unwrap().with_includes(&source).unwrap();
    let alone = Source::in_memory("manifest", to_text(&whole).unwrap());
    assert_eq!(parse::<SceneSpec>(&alone).unwrap(), whole);
    assert_eq!(World::build(&whole, &alone).unwrap().triangle_count(), 24);
    assert_eq!((whole.include.len(), whole.items.len(), whole.movers.len()), (0, 2, 1));
}

#[test]
fn a_built_in_scene_can_be_included_from_anywhere() {
    let text = GUEST.replace("\"hall\"", "\"mocap_room\"").replace("template: \"pillar\"", "template: \"post\"");
    let world = built(&[("guest.ron", &text)], "guest.ron").unwrap();
    assert_eq!(world.triangle_count(), World::load("mocap_room").unwrap().triangle_count() + 12);
}

/// The error message of an invalid scene.
fn fault(files: &[(&str, &str)], name: &str) -> String {
    built(files, name).err().unwrap_or_else(|| panic!("{name} is accepted")).to_string()
}

#[test]
fn invalid_includes_are_errors_with_file_and_line() {
    let missing = fault(&[("guest.ron", GUEST)], "guest.ron");
    assert!(missing.contains("guest.ron:3:") && missing.contains("`hall` cannot be used: no such scene"), "{missing}");

    let itself = fault(&[("guest.ron", &GUEST.replace("\"hall\"", "\"guest.ron\""))], "guest.ron");
    assert!(itself.contains("guest.ron:3:") && itself.contains("includes itself"), "{itself}");
    let circle = HALL.replace("name: \"hall\",", "name: \"hall\", include: [\"guest\"],");
    let circle = fault(&[("hall.ron", &circle), ("guest.ron", GUEST)], "guest.ron");
    assert!(circle.contains("hall.ron:2:") && circle.contains("`guest` includes itself"), "{circle}");

    let twice = fault(&[("hall.ron", HALL), ("guest.ron", &GUEST.replace("\"post\"", "\"pillar\""))], "guest.ron");
    assert!(twice.contains("guest.ron:5:") && twice.contains("define the template `pillar`"), "{twice}");
    let twice =
        fault(&[("hall.ron", HALL), ("guest.ron", &GUEST.replace("[\"hall\"]", "[\"hall\", \"hall\"]"))], "guest.ron");
    assert!(twice.contains("define the material `stone`"), "{twice}");

    // An error in the included scene refers to the included file.
    let wrong = fault(&[("hall.ron", &HALL.replace("(1, 1, 3)", "(1, -1, 3)")), ("guest.ron", GUEST)], "guest.ron");
    assert!(wrong.contains("hall.ron:4:") && wrong.contains("found -1"), "{wrong}");
    let unknown = fault(
        &[("hall.ron", &HALL.replace("material: \"stone\"", "material: \"cloth\"")), ("guest.ron", GUEST)],
        "guest.ron",
    );
    assert!(unknown.contains("hall.ron:4:") && unknown.contains("no material `cloth`"), "{unknown}");
}

#[test]
fn an_error_of_an_included_file_does_not_show_its_content() {
    for name in ["secret.txt", "secret", "sub/secret.conf"] {
        let scene = GUEST.replace("\"hall\"", &format!("\"{name}\""));
        let message = fault(&[(name, "password: swordfish\n"), ("guest.ron", &scene)], "guest.ron");
        assert!(
            message.contains("guest.ron:3:") && message.contains(name) && message.contains("does not end in .ron"),
            "{message}"
        );
        assert!(!message.contains("password") && !message.contains("swordfish"), "{message}");
    }
}

#[test]
fn a_scene_with_meshes_can_only_be_included_from_its_folder() {
    let mesh = "items: [Solid(shape: Mesh(file: \"wall.obj\"), material: \"stone\"), ";
    let hall = HALL.replace("items: [", mesh);
    let wall = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let beside = [("hall.ron", hall.as_str()), ("wall.obj", wall), ("guest.ron", GUEST)];
    assert_eq!(built(&beside, "guest.ron").unwrap().triangle_count(), 25);
    let below = GUEST.replace("\"hall\"", "\"sub/hall.ron\"");
    let apart = [("sub/hall.ron", hall.as_str()), ("sub/wall.obj", wall), ("guest.ron", &below)];
    let message = fault(&apart, "guest.ron");
    assert!(message.contains("guest.ron:3:") && message.contains("keep it in the folder"), "{message}");
}

#[test]
fn a_deep_chain_of_includes_is_an_error() {
    let scene = |name: &str, included: &[String]| {
        format!(
            "(name: \"{name}\", include: {included:?}, materials: {{}}, items: [Solid(shape: Box(size_m: (1, 1, 1)), \
             material: \"stone\")])"
        )
    };
    let last = HALL.replace("hall", "last");
    let chain = |length: usize| {
        let mut files: Vec<(String, String)> =
            (0..length).map(|k| (format!("s{k}.ron"), scene(&format!("s{k}"), &[format!("s{}", k + 1)]))).collect();
        files.push((format!("s{length}.ron"), last.clone()));
        let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
        built(&files, "s0.ron").map(|world| world.triangle_count())
    };
    assert_eq!(chain(16).unwrap(), 12 * 17);
    let error = chain(5000).unwrap_err().to_string();
    assert!(error.contains("17 levels deep; 16 at most"), "{error}");
}
