//! Settings in a tree of keys, by their path.

use serde_json::Value;

/// Most settings that an error lists.
const LISTED: usize = 12;

/// The one setting of `tree` that `keys` tell: they lead to it in order, and may leave out some on the way.
///
/// # Errors
/// A sentence, when there is none (with those that come near) or more than one.
pub(super) fn find(tree: &Value, keys: &[&str]) -> Result<Vec<String>, String> {
    let mut all = Vec::new();
    gather(tree, &mut Vec::new(), &mut all);
    if let Some(exact) = all.iter().find(|path| path.as_slice() == keys) {
        return Ok(exact.clone());
    }
    let told: Vec<&Vec<String>> = all.iter().filter(|path| leads_to(keys, path)).collect();
    let wanted = keys.join(".");
    match told.as_slice() {
        [one] => Ok((*one).clone()),
        [] => Err(format!("there is no setting `{wanted}`; there are: {}", list(&near(&all, keys)))),
        several => Err(format!("`{wanted}` may be any of {}: write more of the path", list(several))),
    }
}

/// Sets what is at `path`, which [`find`] gave, perhaps for another tree: `None` where this one has no such place.
#[must_use]
pub(super) fn set(tree: &mut Value, path: &[String], value: Value) -> Option<()> {
    let mut at = tree;
    for key in path {
        at = match at {
            Value::Object(object) => object.get_mut(key)?,
            Value::Array(list) => list.get_mut(key.parse::<usize>().ok()?)?,
            _ => return None,
        };
    }
    *at = value;
    Some(())
}

/// The paths of all settings that are no groups.
fn gather(tree: &Value, above: &mut Vec<String>, into: &mut Vec<Vec<String>>) {
    let mut below = |key: String, value: &Value| {
        above.push(key);
        gather(value, above, into);
        above.pop();
    };
    match tree {
        Value::Object(object) => object.iter().for_each(|(key, value)| below(key.clone(), value)),
        Value::Array(list) => list.iter().enumerate().for_each(|(k, value)| below(k.to_string(), value)),
        _ => into.push(above.clone()),
    }
}

/// Whether `keys` are in `path` in their order, the last at its end.
fn leads_to(keys: &[&str], path: &[String]) -> bool {
    let mut wanted = keys.iter().peekable();
    for key in path {
        wanted.next_if(|next| **next == key);
    }
    wanted.peek().is_none() && keys.last().copied() == path.last().map(String::as_str)
}

/// The settings whose last key is nearly that of `keys`, or else those that share the longest beginning.
fn near<'a>(all: &'a [Vec<String>], keys: &[&str]) -> Vec<&'a Vec<String>> {
    let last = keys.last().copied().unwrap_or_default();
    let alike = |path: &&Vec<String>| path.last().is_some_and(|key| key.contains(last) || last.contains(key.as_str()));
    let same_end: Vec<_> = all.iter().filter(alike).collect();
    if !same_end.is_empty() {
        return same_end;
    }
    let shared = |path: &Vec<String>| path.iter().zip(keys).take_while(|(a, b)| a == *b).count();
    let most = all.iter().map(shared).max().unwrap_or_default();
    all.iter().filter(|path| shared(path) == most).collect()
}

fn list(paths: &[&Vec<String>]) -> String {
    let more = if paths.len() > LISTED { format!(", and {} more", paths.len() - LISTED) } else { String::new() };
    let words: Vec<String> = paths.iter().take(LISTED).map(|path| path.join(".")).collect();
    words.join(", ") + &more
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn tree() -> Value {
        json!({
            "parts": [{ "block": { "mass_kg": 0.2 } }, { "block": { "mass_kg": 0.1 } }],
            "linkage": { "spring": { "spring": { "coil": { "wire_mm": 3.0 } }, "stop": { "angle_deg": 80.0 } } },
            "hold": null,
        })
    }

    #[test]
    fn a_setting_is_told_by_its_path_or_by_enough_of_it() {
        let told = |path: &str| find(&tree(), &path.split('.').collect::<Vec<_>>()).map(|found| found.join("."));
        let whole = "linkage.spring.spring.coil.wire_mm";
        for path in [whole, "wire_mm", "linkage.wire_mm", "spring.coil.wire_mm"] {
            assert_eq!(told(path).as_deref(), Ok(whole));
        }
        assert_eq!(told("parts.1.mass_kg").as_deref(), Ok("parts.1.block.mass_kg"));
        assert_eq!(told("hold").as_deref(), Ok("hold"));
        assert!(told("mass_kg").unwrap_err().contains("parts.0.block.mass_kg, parts.1.block.mass_kg: write more"));
        assert!(told("linkage.spring.coil.wire").unwrap_err().contains(whole));
        assert!(told("stop.wire_mm").unwrap_err().contains("no setting `stop.wire_mm`"));
        assert!(told("linkage.spring").is_err(), "a group is no setting");
    }

    #[test]
    fn setting_one_changes_no_other() {
        let mut changed = tree();
        let path = ["parts", "1", "block", "mass_kg"].map(str::to_owned);
        assert!(set(&mut changed, &path, json!(0.3)).is_some());
        assert_eq!(changed["parts"][1]["block"]["mass_kg"], json!(0.3));
        assert!(set(&mut changed, &path, json!(0.1)).is_some());
        assert_eq!(changed, tree());
        assert!(set(&mut changed, &["parts", "2", "block"].map(str::to_owned), json!(0.1)).is_none());
    }
}
