//! The tree and the crate `ron` read the same values from the same texts, and refuse the same texts.

use super::form::{Buffered, Form};
use super::read;
use crate::spec::{Kind, find, names};
use proptest::prelude::*;
use ron::extensions::Extensions;

fn by_ron(text: &str) -> Option<Form> {
    let options = ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
    options.from_str(text).ok().map(|Buffered::Any(form)| form)
}

fn by_tree(text: &str) -> Option<Form> {
    read(text).ok().map(|Buffered::Any(form)| form)
}

/// Whether a text has a notation that the tree treats differently on purpose: ranges, literals with brackets, and unit
/// values with white space inside.
fn is_exempt(text: &str) -> bool {
    let words = ["inf", "NaN", "None", "true", "false", "inff32", "inff64", "NaNf32", "NaNf64"];
    let has_bracket = |after: &str| after.trim_start().starts_with(['(', '/']);
    let opens = |word: &str| text.match_indices(word).any(|(at, _)| has_bracket(&text[at + word.len()..]));
    let has_spaced_unit = text.split('(').skip(1).any(|after| {
        let rest = after.trim_start();
        rest.starts_with('/') || (rest.starts_with(')') && rest.len() < after.len())
    });
    text.contains("..") || text.contains("r#") || words.into_iter().any(opens) || has_spaced_unit
}

fn shipped() -> Vec<String> {
    let sources = Kind::ALL.into_iter().flat_map(|kind| names(kind).into_iter().map(move |name| find(kind, &name)));
    sources.map(|source| source.unwrap().text).collect()
}

#[test]
fn every_shipped_spec_has_the_same_form() {
    for text in shipped() {
        let form = by_tree(&text);
        assert!(form.is_some() && form == by_ron(&text), "{text}");
    }
}

/// A number in any notation, right or wrong.
fn number() -> impl Strategy<Value = String> {
    prop_oneof![
        any::<f64>().prop_map(|x| format!("{x:?}")),
        any::<i64>().prop_map(|x| x.to_string()),
        any::<u64>().prop_map(|x| format!("{x:#x}")),
        "[+-]?[0-9_]{1,25}(\\.[0-9_]{0,20})?([eE][+-]?[0-9]{1,3})?",
        "[+-]?0[xob][0-9a-f_]{1,18}",
        "[0-9]{1,3}(u8|i16|f32|f64|u64)",
    ]
}

/// A text of nested values.
fn document() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        number(),
        "\"([a-zé ]|\\\\[nrt0\"\\\\]|\\\\x[0-7][0-9a-f]|\\\\u\\{[0-9a-f]{1,5}\\})*\"",
        "'([a-zé]|\\\\n|\\\\')'",
        "r##\"[a-z\"\\\\]*\"##",
        "b\"[a-z]{0,4}\"",
        Just("b'x'".to_owned()),
        Just("()".to_owned()),
        prop_oneof!["true", "false", "None", "inf", "-inf", "NaN", "[A-Z][a-z_0-9]{0,5}"],
    ];
    let space = prop_oneof![4 => Just(""), 1 => Just(" "), 1 => Just("\n // c\n"), 1 => Just(" /* /* */ */")];
    leaf.prop_recursive(5, 60, 6, move |inner| {
        let value = (space.clone(), inner).prop_map(|(space, value)| format!("{space}{value}"));
        let field = (value.clone(), "[a-z_][a-z0-9_]{0,6}").prop_map(|(value, key)| format!("{key}:{value}"));
        let list = |item: BoxedStrategy<String>| prop::collection::vec(item, 0..6).prop_map(|items| items.join(","));
        prop_oneof![
            list(value.clone().boxed()).prop_map(|items| format!("[{items}]")),
            list(value.clone().boxed()).prop_map(|items| format!("({items})")),
            list(field.clone().boxed()).prop_map(|items| format!("({items})")),
            (list(field.boxed()), "[A-Z][a-z]{1,4}").prop_map(|(items, name)| format!("{name}({items})")),
            (list(value.clone().boxed()), "[A-Z][a-z]{1,4}").prop_map(|(items, name)| format!("{name} ({items},)")),
            (value.clone(), value.clone()).prop_map(|(a, b)| format!("{{{a}:{b},}}")),
            value.prop_map(|value| format!("Some({value})")),
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 800, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_values_have_the_same_form(text in document()) {
        prop_assert!(is_exempt(&text) || by_tree(&text) == by_ron(&text), "{}", text);
    }

    #[test]
    fn random_numbers_have_the_same_bits(text in number()) {
        prop_assert_eq!(by_tree(&text), by_ron(&text), "{}", text);
        prop_assert_eq!(read::<f64>(&text).ok().map(f64::to_bits), ron::from_str::<f64>(&text).ok().map(f64::to_bits));
        prop_assert_eq!(read::<f32>(&text).ok().map(f32::to_bits), ron::from_str::<f32>(&text).ok().map(f32::to_bits));
        prop_assert_eq!(read::<u8>(&text).ok(), ron::from_str::<u8>(&text).ok());
        prop_assert_eq!(read::<i64>(&text).ok(), ron::from_str::<i64>(&text).ok());
        prop_assert_eq!(read::<u64>(&text).ok(), ron::from_str::<u64>(&text).ok());
    }

    #[test]
    fn damaged_specs_are_refused_by_both(
        file in any::<prop::sample::Index>(), at in any::<prop::sample::Index>(), removed in 0_usize..8,
        inserted in "|[(){}\\[\\],:\"'/*.0-9a-z_+#-]{1,3}|//|/\\*|Some\\(|é",
    ) {
        let texts = shipped();
        let text = file.get(&texts);
        let places: Vec<usize> = text.char_indices().map(|(at, _)| at).collect();
        let place = at.index(places.len());
        let end = places.get(place + removed).copied().unwrap_or(text.len());
        let damaged = format!("{}{inserted}{}", &text[..places[place]], &text[end..]);
        prop_assert!(is_exempt(&damaged) || by_tree(&damaged) == by_ron(&damaged), "{}", damaged);
    }
}
