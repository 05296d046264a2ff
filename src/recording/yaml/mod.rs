//! Reads YAML into types of serde.
//!
//! The files are those that rosbag2, Kalibr and PyYAML write: one document, whose keys are scalars. Tags are ignored.
//! Depth and size of a document are limited, also after its aliases are expanded, so that no file can exhaust memory or
//! stack.

mod error;
mod node;
mod tree;

pub use self::error::YamlError;
use serde::de::DeserializeOwned;

/// Reads a document; an empty one is null.
///
/// # Errors
/// When the text is not YAML, repeats a key, is deeper or larger than the limits, or does not fit the type.
pub fn parse_yaml<T: DeserializeOwned>(text: &str) -> Result<T, YamlError> {
    T::deserialize(tree::read(text)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;
    use serde::de::IgnoredAny;
    use std::collections::BTreeMap;

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Sensor {
        name: String,
        rate: f64,
        rows: Option<Vec<Vec<f64>>>,
        other: Option<IgnoredAny>,
    }

    fn sensor(text: &str) -> Result<Sensor, String> {
        parse_yaml(text).map_err(|error| error.to_string())
    }

    #[test]
    fn documents_of_other_programs_are_read() {
        let block = "%YAML 1.1\n---\n# A sensor.\nname: '0012'\nrate: 1.0e-05 # Hz\nrows:\n- [1, -2.5]\n- - .inf\n  - +3\n\
                     other: {a: [], b: !!float 1, ? c : ~}\n...\n";
        let rows = Some(vec![vec![1.0, -2.5], vec![f64::INFINITY, 3.0]]);
        assert_eq!(sensor(block).unwrap().rows, rows);
        assert_eq!(sensor(block).unwrap().name, "0012");
        // Scalars are what the type asks for; a byte order mark is no content.
        let flow = sensor("\u{feff}{name: 0012, rate: 7, rows: ~, \"other\":}").unwrap();
        assert_eq!((flow.name.as_str(), flow.rate, flow.rows, flow.other), ("0012", 7.0, None, None));
        let any: BTreeMap<String, serde_json::Value> = parse_yaml("a: [true, 1.5, x, '1', null]").unwrap();
        assert_eq!(any["a"], serde_json::json!([true, 1.5, "x", "1", null]));
        assert_eq!(parse_yaml::<Option<f64>>("# nothing\n"), Ok(None));
        assert!(parse_yaml::<f64>(".NaN").unwrap().is_nan());
    }

    #[test]
    fn aliases_repeat_their_anchor() {
        let rows = sensor("name: x\nrate: 1\nother: &row [1, &two 2]\nrows: [*row, [*two], *row]\n").unwrap().rows;
        assert_eq!(rows.unwrap(), [vec![1.0, 2.0], vec![2.0], vec![1.0, 2.0]]);
    }

    #[test]
    fn errors_have_their_position() {
        for (text, error) in [
            ("name: x\nrate: fast\n", "invalid type: string \"fast\", expected f64 at line 2, column 7"),
            ("name: x\nrate: [1]\n", "invalid type: sequence, expected f64 at line 2, column 7"),
            ("name: x\n rat: 1\n", "mapping values are not allowed in this context at line 2, column 5"),
            (
                "{name: x,\n rat: 1}\n",
                "unknown field `rat`, expected one of `name`, `rate`, `rows`, `other` at line 2, column 2",
            ),
            ("\nrate: 1\n", "missing field `name` at line 2, column 1"),
            ("name: x\nrate: 1\nrate: 2\n", "the key `rate` is repeated at line 3, column 1"),
            ("name: x\nother:\n  a: 1\n  a: 2\n", "the key `a` is repeated at line 4, column 3"),
            (
                "name: x\nrate: 1\nrows:\n- [1]\n- [2, x]\n",
                "invalid type: string \"x\", expected f64 at line 5, column 7",
            ),
            ("name: x\n[1]: 2\n", "a key must be a scalar at line 2, column 1"),
            ("- name\n", "invalid type: sequence, expected struct Sensor at line 1, column 1"),
            ("", "missing field `name` at line 1, column 1"),
            ("name: x\n---\nname: y\n", "a second document starts; only one is supported at line 2, column 1"),
            ("rows: &a [*a]\n", "an alias refers to a node that contains it at line 1, column 11"),
        ] {
            assert_eq!(sensor(text).unwrap_err(), error, "{text}");
        }
        for text in ["name: [x\n", "name: *x\n", "name: \"x\n", "a: b: c\n"] {
            assert!(sensor(text).unwrap_err().contains(" at line "), "{text}");
        }
    }

    #[test]
    fn hostile_documents_are_errors() {
        let error = |text: &str| parse_yaml::<IgnoredAny>(text).unwrap_err().to_string();
        for deep in ["[", "{a: ", "- ", "? "] {
            assert!(!error(&deep.repeat(100_000)).is_empty());
        }
        assert!(error(&format!("{}{}", "[".repeat(100), "]".repeat(100))).contains("nested deeper than 64 levels"));
        // 10^9 numbers; 10^5 copies of a text of 2 MB; 60 anchors, each around the next one, with 2 MB.
        let levels = "abcdefgh".chars().zip("bcdefghi".chars());
        let bomb: String =
            levels.map(|(a, b)| format!("{b}: &{b} [{}]\n", vec![format!("*{a}"); 10].join(","))).collect();
        let text = "x".repeat(2 << 20);
        let nested = format!("{}{text}{}", (0..60).map(|k| format!("&k{k} [")).collect::<String>(), "]".repeat(60));
        for text in [
            format!("a: &a [0,0,0,0,0,0,0,0,0,0]\n{bomb}"),
            format!("- &a {text}\n{}", "- *a\n".repeat(100_000)),
            nested,
            "- 1\n".repeat(300_000),
        ] {
            assert!(error(&text).contains("too large"), "{}", error(&text));
        }
    }
}
