//! Trees from JSON are read as `serde_json` reads it.

use crate::spec::Tree;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Debug;

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Seed(u64);

#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Inner {
    letter: char,
    pair: (f64, i8),
    none: Option<u8>,
    nested: Option<Seed>,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
enum Variant {
    Unit,
    Newtype(Seed),
    Tuple(u8, String),
    Struct { inner: Inner },
    Optional(Option<f64>),
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Whole {
    #[serde(flatten)]
    inner: Inner,
    variants: Vec<Variant>,
    map: BTreeMap<String, f64>,
    unit: (),
}

fn inner() -> Inner {
    Inner { letter: 'ß', pair: (0.1, -128), none: None, nested: Some(Seed(u64::MAX)) }
}

fn read<T: DeserializeOwned>(value: &Value) -> Result<T, String> {
    Tree::from_json("test", value).to().map_err(|error| error.message().to_owned())
}

#[test]
fn a_value_that_serde_json_writes_is_read_back() {
    let variants = vec![
        Variant::Unit,
        Variant::Newtype(Seed(1)),
        Variant::Tuple(2, "two".to_owned()),
        Variant::Struct { inner: inner() },
        Variant::Optional(None),
        Variant::Optional(Some(1e300)),
    ];
    let map = BTreeMap::from([("a".to_owned(), 5e-324), ("b".to_owned(), -0.0), ("c".to_owned(), 3.0)]);
    let whole = Whole { inner: inner(), variants, map, unit: () };
    let value = serde_json::to_value(&whole).unwrap();
    assert_eq!(read::<Whole>(&value).unwrap(), whole);
    assert_eq!(read::<Value>(&value).unwrap(), value);
}

#[test]
fn values_that_serde_json_refuses_are_refused() {
    fn refused<T: DeserializeOwned + Debug>(value: &Value, message: &str) {
        assert!(serde_json::from_value::<T>(value.clone()).is_err(), "{value}");
        let error = Tree::from_json("test", value).to::<T>().unwrap_err();
        assert_eq!(error.to_string(), format!("test: {message}"));
    }
    refused::<u8>(&json!(256), "expected an integer from 0 to 255, found 256");
    refused::<u8>(&json!(-1), "expected an integer from 0 to 255, found -1");
    refused::<u8>(&json!(1.5), "expected an integer from 0 to 255, found 1.5");
    refused::<f64>(&json!(null), "Expected float");
    refused::<f64>(&json!("inf"), "Expected float");
    refused::<bool>(&json!(1), "Expected boolean");
    refused::<(u8, u8)>(&json!([1, 2, 3]), "Expected 2 elements but found 3 instead");
    refused::<Variant>(
        &json!("None"),
        "Unexpected variant named `None` in enum `Variant`, \
         expected one of `Unit`, `Newtype`, `Tuple`, `Struct`, or `Optional` instead",
    );
    refused::<Variant>(&json!({ "Unit": 1 }), "Expected unit");
    refused::<Variant>(
        &json!({ "Newtype": 1, "Unit": null }),
        "Expected a map with a single key, the name of a variant",
    );
    refused::<Inner>(
        &json!({ "letter": "a", "colour": 1 }),
        "Unexpected field named `colour` in `Inner`, \
         expected one of `letter`, `pair`, `none`, or `nested` instead",
    );
}

#[test]
fn a_path_leads_through_json() {
    let tree = Tree::from_json("test", &json!({ "parts": [{ "block": { "mass_kg": 0.2 } }], "hold": null }));
    assert_eq!(tree.get(&["parts", "0", "block", "mass_kg"]).unwrap().to::<f64>().unwrap(), 0.2);
    assert_eq!(tree.get(&["hold"]).unwrap().to::<Option<f64>>().unwrap(), None);
    assert!(tree.get(&["parts", "1"]).is_none());
}
