//! What the notations of RON mean, by the book of the crate `ron` and the types of serde.

use super::read;
use crate::spec::{Source, Tree};
use serde::Deserialize;
use std::collections::BTreeMap;

#[derive(Debug, PartialEq, Deserialize)]
struct Seed(u64);

#[derive(Debug, PartialEq, Deserialize)]
struct Pair(f64, f64);

#[derive(Debug, PartialEq, Deserialize)]
struct Marker;

#[derive(Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Point {
    x: f64,
    #[serde(default)]
    y: Option<f64>,
}

#[derive(Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Shape {
    None,
    Scaled(f64),
    Seeded(Seed),
    Wrapped(Point),
    Both(f64, bool),
    Box { size: [f64; 3], label: Option<String> },
}

#[derive(Debug, PartialEq, Deserialize)]
#[serde(untagged)]
enum Setting {
    Switch(bool),
    Count(u64),
    Number(f64),
    Text(String),
    Shape(Shape),
}

#[derive(Debug, PartialEq, Deserialize)]
struct Flattened {
    name: String,
    #[serde(flatten)]
    point: Point,
}

#[derive(Debug, PartialEq, Deserialize)]
#[serde(tag = "kind")]
enum Tagged {
    Point { x: f64 },
}

#[test]
fn numbers_are_exact() {
    for (text, bits) in [
        ("0.1", 0.1_f64),
        ("-0", -0.0),
        ("+5", 5.0),
        ("1_000.5_0", 1000.5),
        ("9007199254740993", 9_007_199_254_740_992.0),
        ("123456789012345678901234567890", 1.234_567_890_123_456_8e29),
        ("4.9e-324", 5e-324),
        (".5", 0.5),
        ("5.", 5.0),
        ("-inf", f64::NEG_INFINITY),
        ("inf", f64::INFINITY),
        ("2.5f64", 2.5),
    ] {
        assert_eq!(read::<f64>(text).unwrap().to_bits(), bits.to_bits(), "{text}");
    }
    assert!(read::<f64>("NaN").unwrap().is_nan());
    // The nearest number of 32 bits is above, the nearest one of 64 bits is halfway between two of 32 bits.
    assert_eq!(read::<f32>("1.000000059604644775390625000001").unwrap(), 1.000_000_1);
    assert_eq!(read::<u64>("18446744073709551615").unwrap(), u64::MAX);
    assert_eq!(read::<i64>("-9223372036854775808").unwrap(), i64::MIN);
    assert_eq!(read::<(u8, u8, u16, i8)>("(0xff, 0b1_01, 0o17, -0)").unwrap(), (255, 5, 15, 0));
    assert_eq!(read::<(u8, i16)>("(b'a', -3i16)").unwrap(), (97, -3));
}

#[test]
fn quotes_and_comments_are_those_of_ron() {
    for (text, expected) in [
        (r#""a\n\"\\\u{e9}\x41""#, "a\n\"\\é\x41"),
        ("r#\"raw \\ \"quoted\"\"#", "raw \\ \"quoted\""),
        ("// comment\n/* a /* nested */ one */ \"x\" // end", "x"),
        ("\"two \\\n      lines\"", "two lines"),
        (r#""\xc3\xa9""#, "é"),
    ] {
        assert_eq!(read::<String>(text).unwrap(), expected);
    }
    assert_eq!(read::<(char, char, char)>(r"('x', '\'', '\u{41}')").unwrap(), ('x', '\'', 'A'));
    assert_eq!(read::<Point>("(r#x: 1)").unwrap(), Point { x: 1.0, y: None });
}

#[test]
fn types_are_read_from_their_notation() {
    assert_eq!(read::<Seed>("(3)").unwrap(), Seed(3));
    assert_eq!(read::<Seed>("Seed(3,)").unwrap(), Seed(3));
    assert_eq!(read::<Pair>("Pair(1, 2)").unwrap(), Pair(1.0, 2.0));
    assert_eq!(read::<(Marker, Marker, ())>("(Marker, (), ())").unwrap(), (Marker, Marker, ()));
    assert_eq!(read::<Point>("Point(y: Some(2), x: 1,)").unwrap(), Point { x: 1.0, y: Some(2.0) });
    assert_eq!(read::<Vec<Option<f64>>>("[Some(1), 2, None]").unwrap(), [Some(1.0), Some(2.0), None]);
    assert_eq!(read::<BTreeMap<u8, char>>("{1: 'a', 2: 'b'}").unwrap(), BTreeMap::from([(1, 'a'), (2, 'b')]));
    assert_eq!(read::<Shape>("none").unwrap(), Shape::None);
    assert_eq!(read::<Shape>("both (1, true)").unwrap(), Shape::Both(1.0, true));
    assert_eq!(read::<Shape>("seeded((4))").unwrap(), Shape::Seeded(Seed(4)));
    let boxed = Shape::Box { size: [1.0, 2.0, 3.0], label: Some("b".to_owned()) };
    assert_eq!(read::<Shape>("box(size: (1, 2, 3), label: \"b\")").unwrap(), boxed);
}

#[test]
fn types_that_serde_buffers_are_read() {
    let settings = read::<Vec<Setting>>("[true, 3, -3, \"a\", both(1, false), none, 0x10]").unwrap();
    let shape = |shape| Setting::Shape(shape);
    let expected = [
        Setting::Switch(true),
        Setting::Count(3),
        Setting::Number(-3.0),
        Setting::Text("a".to_owned()),
        shape(Shape::Both(1.0, false)),
        Setting::Text("none".to_owned()),
        Setting::Count(16),
    ];
    assert_eq!(settings, expected);
    let flattened = Flattened { name: "n".to_owned(), point: Point { x: 1.0, y: Some(2.0) } };
    assert_eq!(read::<Flattened>("{\"name\": \"n\", \"y\": Some(2), \"x\": 1}").unwrap(), flattened);
    assert_eq!(read::<Tagged>("(kind: \"Point\", x: 1)").unwrap(), Tagged::Point { x: 1.0 });
}

#[test]
fn strings_are_borrowed_from_the_tree() {
    let tree = Tree::read(&Source::in_memory("test.ron", "[\"a\", \"\\u{62}\"]")).unwrap();
    assert_eq!(tree.to::<Vec<&str>>().unwrap(), ["a", "b"]);
}

#[test]
fn a_struct_in_a_variant_needs_one_pair_of_brackets() {
    let wrapped = Shape::Wrapped(Point { x: 1.0, y: Some(2.0) });
    assert_eq!(read::<Shape>("wrapped(x: 1, y: 2)").unwrap(), wrapped);
    assert_eq!(read::<Shape>("wrapped((x: 1, y: 2))").unwrap(), wrapped);
    let error = read::<Shape>("wrapped(x: 1, z: 2)").unwrap_err();
    assert_eq!(error.line_and_column(), Some((1, 15)), "{error}");
}

#[test]
fn extensions_of_the_header_apply() {
    let newtypes = "#![enable(implicit_some, unwrap_newtypes)]\n";
    assert_eq!(read::<Vec<Seed>>(&format!("{newtypes}[1, 2]")).unwrap(), [Seed(1), Seed(2)]);
    let variants = "#![enable(unwrap_variant_newtypes,)] #![type = \"zsim\"]\n";
    let wrapped = Shape::Wrapped(Point { x: 1.0, y: Some(2.0) });
    assert_eq!(read::<Shape>(&format!("{variants}wrapped(x: 1, y: 2)")).unwrap(), wrapped);
    assert_eq!(read::<Shape>(&format!("{variants}scaled(2)")).unwrap(), Shape::Scaled(2.0));
    assert_eq!(read::<Shape>(&format!("{variants}seeded(2)")).unwrap(), Shape::Seeded(Seed(2)));
    let names = "#![enable(explicit_struct_names)]";
    assert!(read::<Point>(&format!("{names}(x: 1)")).unwrap_err().message().contains("explicit struct name `Point`"));
    assert!(read::<Point>(&format!("{names}Point(x: 1)")).is_ok());
    assert!(read::<Point>("#![enable(magic)](x: 1)").unwrap_err().message().contains("No RON extension named `magic`"));
}

#[test]
fn a_path_leads_to_a_part_of_the_tree() {
    let text = "(run: Some((imu: (rate: 100, parts: [block(mass: 0.5), scaled((x: 2))]))), \"m\": 3)";
    assert!(Tree::read(&Source::in_memory("test.ron", text)).is_err(), "a key in quotes is not one of a struct");
    let text = text.replace(", \"m\": 3", ", map: {\"m\": 3}");
    let tree = Tree::read(&Source::in_memory("test.ron", text)).unwrap();
    let number = |path: &[&str]| tree.get(path).map(|part| part.to::<f64>().unwrap());
    assert_eq!(number(&["run", "imu", "rate"]), Some(100.0));
    assert_eq!(number(&["run", "imu", "parts", "0", "block", "mass"]), Some(0.5));
    assert_eq!(number(&["run", "imu", "parts", "0", "mass"]), Some(0.5));
    assert_eq!(number(&["run", "imu", "parts", "1", "scaled", "x"]), Some(2.0));
    assert_eq!(number(&["map", "m"]), Some(3.0));
    assert_eq!(tree.get(&["run"]).and_then(|run| run.get(&["imu", "rate"])).unwrap().to::<u8>().unwrap(), 100);
    assert!(tree.get(&["run", "lidar"]).is_none() && tree.get(&["run", "imu", "parts", "2"]).is_none());
    let error = tree.get(&["run", "imu"]).unwrap().to::<Point>().unwrap_err();
    assert_eq!(error.line_and_column(), Some((1, 19)), "{error}");
}
