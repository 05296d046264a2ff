//! Invalid scenes: each is an error with the reason and the line.

use proptest::prelude::*;
use zsim::spec::{Kind, Source, find, names, parse, to_text};
use zsim::world::{SceneSpec, World, WorldError};

/// A valid scene, with one statement per line.
const VALID: &str = r#"(
    name: "hall",
    materials: {
        "stone": (reflectance: 0.5),
        "pane": (reflectance: 0.1, kind: Glass(transmission: 0.8)),
    },
    templates: {
        "pillar": [Solid(shape: Cylinder(radius_m: 0.2, height_m: 3), material: "stone")],
        "outer": [Place(template: "pillar")],
    },
    items: [
        Solid(shape: Box(size_m: (10, 8, 0.2)), material: "stone", at_m_deg: [(0, 0, -0.2)]),
        Solid(shape: Wall(length_m: 10, height_m: 3, thickness_m: 0.2, openings: [(from_m: 1, to_m: 2, head_m: 2)]), material: "stone"),
        Solid(shape: HeightField(size_m: (4, 4), heights: Grid([[0, 0.1], [0.1, 0]])), material: "stone"),
        Place(template: "outer", at_m_deg: [(1, 1), (2, 2, 0, 45)]),
        Scatter((template: "pillar", seed: 1, count: 4, region_m: ((-4, -3, 0), (4, 3, 0)), min_spacing_m: 0.5, turn: Upright)),
    ],
    movers: [
        (template: "pillar", repeats: true, waypoints: [
            (time_s: 0, at_m_deg: (0, 0, 0, 10)),
            (time_s: 4, at_m_deg: (3, 0, 0, 90)),
        ]),
    ],
    routes: {
        "way": (closed: false, points_m: [(0, 0, 0), (1, 0, 0)]),
    },
    default_route: "way",
)"#;

fn build(text: &str) -> Result<World, WorldError> {
    let source = Source::in_memory("hall.ron", text);
    World::build(&parse(&source)?, &source)
}

#[test]
fn the_reference_scene_is_valid() {
    let world = build(VALID).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(world.routes().len(), 1);
    assert_eq!(world.default_route().unwrap().points_in_world.len(), 2);
}

#[test]
fn the_only_route_is_the_default_route() {
    let without = VALID.replacen("    default_route: \"way\",\n", "", 1);
    assert_eq!(build(&without).unwrap().default_route().unwrap().points_in_world.len(), 2);
    let way = "\"way\": (closed: false, points_m: [(0, 0, 0), (1, 0, 0)]),";
    let two = without.replacen(way, &format!("{way}\n{}", way.replace("way", "other")), 1);
    let world = build(&two).unwrap();
    assert_eq!((world.routes().len(), world.default_route()), (2, None));
}

#[test]
fn each_error_has_its_line() {
    // Text, its replacement, line of the error, and a part of the message.
    let faults = [
        ("(10, 8, 0.2)", "(10, -8, 0.2)", 12, "above 0, found -8"),
        ("(10, 8, 0.2)", "(10, NaN, 0.2)", 12, "NaN"),
        ("(10, 8, 0.2)", "(10, 8)", 12, "3"),
        ("reflectance: 0.5", "reflectance: 1.5", 4, "from 0 to 1, found 1.5"),
        ("transmission: 0.8", "transmission: 0.95", 5, "more than all of the light"),
        ("reflectance: 0.5", "reflectence: 0.5", 4, "reflectence"),
        ("kind: Glass", "kind: Water", 5, "Water"),
        ("shape: Box", "shape: Cube", 12, "Cube"),
        ("Place(template: \"outer\"", "Place(template: \"inner\"", 15, "no template `inner`"),
        ("material: \"stone\", at_m_deg", "material: \"stome\", at_m_deg", 12, "no material `stome`"),
        ("[(1, 1), (2, 2, 0, 45)]", "[]", 9, "empty list"),
        ("[(1, 1), (2, 2, 0, 45)]", "[(1)]", 15, "at least x and y"),
        ("[Place(template: \"pillar\")]", "[]", 9, "the template `outer` is empty"),
        ("[Place(template: \"pillar\")]", "[Place(template: \"outer\")]", 9, "nest deeper than 8"),
        ("to_m: 2,", "to_m: 20,", 13, "beyond the wall of 10 m"),
        ("[0.1, 0]]", "[0.1]]", 14, "row 2 of the grid has 1 heights"),
        ("count: 4,", "count: 4000,", 16, "of 4000 copies of `pillar`"),
        ("count: 4,", "count: 0,", 16, "`count` is 0"),
        ("(time_s: 4,", "(time_s: 0,", 18, "times do not increase"),
        ("(3, 0, 0, 90)", "(3, 0, 0, 190)", 18, "turns by 180 degrees"),
        ("[(0, 0, 0), (1, 0, 0)]", "[(0, 0, 0)]", 25, "has 1 points; it needs at least 2"),
        ("[(0, 0, 0), (1, 0, 0)]", "[(0, 0, 0), (0, 0, 0)]", 25, "the same point twice"),
        ("(1, 0, 0)]", "(NaN, 0, 0)]", 25, "not within 100 km"),
        ("default_route: \"way\"", "default_route: \"path\"", 27, "no route `path`"),
        ("default_route: \"way\",", "default_route: \"way\"; ", 27, ""),
    ];
    for (right, wrong, line, part) in faults {
        assert!(VALID.contains(right), "{right}");
        let WorldError::Scene(error) =
            build(&VALID.replacen(right, wrong, 1)).err().unwrap_or_else(|| panic!("{wrong} is accepted"))
        else {
            panic!("{wrong} gives a mesh error")
        };
        assert!(error.message().contains(part), "{wrong}: {error}");
        assert_eq!(error.line_and_column().map(|(line, _)| line), Some(line), "{wrong}: {error}");
    }
}

#[test]
fn excessive_scenes_are_refused_before_they_are_built() {
    let fault = |right: &str, wrong: &str| build(&VALID.replacen(right, wrong, 1)).err().unwrap().to_string();
    assert!(fault("(10, 8, 0.2)", "(10, 8e6, 0.2)").contains("100 km"));
    assert!(fault("(0, 0, -0.2)", "(0, 1e300, -0.2)").contains("100 km"));
    assert!(fault("count: 4,", "count: 18446744073709551615,").contains("200000"));
    assert!(fault("height_m: 3)", "height_m: 3, sides: 5000)").contains("from 3 to 4096"));
    let shape =
        "HeightField(size_m: (4, 4), heights: Rolling(seed: 1, cells: (4000, 4000), amplitude_m: 1, wavelength_m: 1))";
    assert!(fault("Box(size_m: (10, 8, 0.2))", shape).contains("4000 x 4000 cells are more than"));
    // Five templates that each place the previous one a hundred times are 10^10 pillars.
    let mut text = VALID.replacen("[Place(template: \"pillar\")]", "[Place(template: \"t4\")]", 1);
    let places = "(0, 0),".repeat(100);
    for k in 0..5 {
        let inner = if k == 0 { "pillar".to_owned() } else { format!("t{}", k - 1) };
        text = text.replacen(
            "templates: {",
            &format!("templates: {{ \"t{k}\": [Place(template: \"{inner}\", at_m_deg: [{places}])],"),
            1,
        );
    }
    let error = build(&text).err().unwrap().to_string();
    assert!(error.contains("more than 10000000 triangles"), "{error}");
}

#[test]
fn a_scene_without_surfaces_and_a_missing_file_are_errors() {
    let empty = r#"(name: "x", materials: {}, items: [])"#;
    assert!(build(empty).err().unwrap().to_string().contains("no surfaces"));
    let missing = World::load("no_such_scene").err().unwrap().to_string();
    assert!(missing.contains("no such scene") && missing.contains("office"), "{missing}");
    let mesh = r#"(name: "x", materials: {"a": (reflectance: 0.5)}, items: [Solid(shape: Mesh(file: "a.obj"), material: "a")])"#;
    let error = build(mesh).err().unwrap();
    assert!(matches!(error, WorldError::Mesh(_)) && error.to_string().contains("without a folder"), "{error}");
}

#[test]
fn every_scene_survives_writing_and_reading() {
    for name in names(Kind::Scene) {
        let spec: SceneSpec = parse(&find(Kind::Scene, &name).unwrap()).unwrap();
        let again: SceneSpec = parse(&Source::in_memory("again", to_text(&spec).unwrap())).unwrap();
        assert_eq!(spec, again, "{name}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_scene_with_a_number_changed_is_a_world_or_an_error(at in any::<proptest::sample::Index>(), number in any::<f64>()) {
        let numbers: Vec<(usize, &str)> = VALID.match_indices(|c: char| c.is_ascii_digit()).collect();
        let (from, digit) = numbers[at.index(numbers.len())];
        let _ = build(&format!("{}{number:e}{}", &VALID[..from], &VALID[from + digit.len()..]));
    }

    #[test]
    fn a_scene_with_a_byte_changed_is_a_world_or_an_error(at in any::<proptest::sample::Index>(), byte in 32_u8..127) {
        let mut bytes = VALID.as_bytes().to_vec();
        let at = at.index(bytes.len());
        bytes[at] = byte;
        let _ = build(&String::from_utf8(bytes).unwrap());
    }
}

#[test]
fn invalid_plants_and_canopies_are_refused() {
    let plants = r#"    canopies: [(size_m: (4, 3, 1), extinction_per_m: 2, material: "stone", at_m_deg: [(1, 0)])],
    swaying: [(scatter: (template: "pillar", seed: 1, count: 3, region_m: ((-4, -3, 0), (4, 3, 0)), min_spacing_m: 0.5, turn: Fixed),
        wind_deg: 0, lean_deg: 5, amplitude_deg: 5, frequency_hz: 1, gust_speed_m_per_s: 3)],
    routes: {"#;
    let valid = VALID.replacen("    routes: {", plants, 1);
    assert_eq!(build(&valid).unwrap_or_else(|error| panic!("{error}")).moving_triangles(0.0).count(), 4 * 24 * 4);
    for (right, wrong, part) in [
        ("material: \"stone\", at_m_deg: [(1, 0)]", "material: \"hay\"", "no material `hay`"),
        ("at_m_deg: [(1, 0)]", "at_m_deg: []", "empty list"),
        ("extinction_per_m: 2", "extinction_per_m: 0", "above 0, found 0"),
        ("size_m: (4, 3, 1)", "size_m: (4, 3, -1)", "above 0, found -1"),
        ("scatter: (template: \"pillar\"", "scatter: (template: \"reed\"", "no template `reed`"),
        ("count: 3", "count: 3000", "of 3000 copies"),
        ("frequency_hz: 1", "frequency_hz: NaN", "NaN"),
        ("gust_speed_m_per_s: 3", "gust_speed_m_per_s: 0", "above 0, found 0"),
    ] {
        assert!(valid.contains(right), "{right}");
        let error = build(&valid.replacen(right, wrong, 1)).err().unwrap_or_else(|| panic!("{wrong} is accepted"));
        assert!(error.to_string().contains(part), "{wrong}: {error}");
    }
}
