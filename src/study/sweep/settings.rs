//! Access to settings in a JSON tree by path.

use serde_json::Value;

/// Maximum number of settings in an error message.
const MAX_LISTED: usize = 12;

/// Finds the setting of `tree` that `keys` identify: the path contains all keys in order and ends with the last one.
///
/// # Errors
/// A message if no setting matches (with similar ones), or if several match.
pub(super) fn find(tree: &Value, keys: &[&str]) -> Result<Vec<String>, String> {
    let mut all = Vec::new();
    collect_paths(tree, &mut Vec::new(), &mut all);
    if let Some(exact) = all.iter().find(|path| path.as_slice() == keys) {
        return Ok(exact.clone());
    }
    let matches: Vec<&Vec<String>> = all.iter().filter(|path| matches_keys(keys, path)).collect();
    let wanted = keys.join(".");
    match matches.as_slice() {
        [one] => Ok((*one).clone()),
        [] => Err(format!("no setting `{wanted}`; similar settings: {}", list(&similar(&all, keys)))),
        several => Err(format!("`{wanted}` is ambiguous: {}: write more of the path", list(several))),
    }
}

/// Sets the value at `path`, which [`find`] returned for this or another tree; `None` if this tree has no such path.
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

/// Collects the paths of all leaves.
fn collect_paths(tree: &Value, above: &mut Vec<String>, into: &mut Vec<Vec<String>>) {
    let mut below = |key: String, value: &Value| {
        above.push(key);
        collect_paths(value, above, into);
        above.pop();
    };
    match tree {
        Value::Object(object) => object.iter().for_each(|(key, value)| below(key.clone(), value)),
        Value::Array(list) => list.iter().enumerate().for_each(|(k, value)| below(k.to_string(), value)),
        _ => into.push(above.clone()),
    }
}

/// Whether `path` contains `keys` in order and ends with the last one.
fn matches_keys(keys: &[&str], path: &[String]) -> bool {
    let mut wanted = keys.iter().peekable();
    for key in path {
        wanted.next_if(|next| **next == key);
    }
    wanted.peek().is_none() && keys.last().copied() == path.last().map(String::as_str)
}

/// Settings with a last key similar to that of `keys`, else those with the longest common prefix.
fn similar<'a>(all: &'a [Vec<String>], keys: &[&str]) -> Vec<&'a Vec<String>> {
    let last = keys.last().copied().unwrap_or_default();
    let has_similar_end =
        |path: &&Vec<String>| path.last().is_some_and(|key| key.contains(last) || last.contains(key.as_str()));
    let same_end: Vec<_> = all.iter().filter(has_similar_end).collect();
    if !same_end.is_empty() {
        return same_end;
    }
    let shared = |path: &Vec<String>| path.iter().zip(keys).take_while(|(a, b)| a == *b).count();
    let most = all.iter().map(shared).max().unwrap_or_default();
    all.iter().filter(|path| shared(path) == most).collect()
}

fn list(paths: &[&Vec<String>]) -> String {
    let more =
        if paths.len() > MAX_LISTED { format!(", and {} more", paths.len() - MAX_LISTED) } else { String::new() };
    let words: Vec<String> = paths.iter().take(MAX_LISTED).map(|path| path.join(".")).collect();
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
    fn a_setting_is_found_by_its_path_or_an_unambiguous_part_of_it() {
        let found = |path: &str| find(&tree(), &path.split('.').collect::<Vec<_>>()).map(|path| path.join("."));
        let full = "linkage.spring.spring.coil.wire_mm";
        for path in [full, "wire_mm", "linkage.wire_mm", "spring.coil.wire_mm"] {
            assert_eq!(found(path).as_deref(), Ok(full));
        }
        assert_eq!(found("parts.1.mass_kg").as_deref(), Ok("parts.1.block.mass_kg"));
        assert_eq!(found("hold").as_deref(), Ok("hold"));
        assert!(found("mass_kg").unwrap_err().contains("parts.0.block.mass_kg, parts.1.block.mass_kg: write more"));
        assert!(found("linkage.spring.coil.wire").unwrap_err().contains(full));
        assert!(found("stop.wire_mm").unwrap_err().contains("no setting `stop.wire_mm`"));
        assert!(found("linkage.spring").is_err(), "a group is not a setting");
    }

    #[test]
    fn setting_a_value_does_not_change_others() {
        let mut changed = tree();
        let path = ["parts", "1", "block", "mass_kg"].map(str::to_owned);
        assert!(set(&mut changed, &path, json!(0.3)).is_some());
        assert_eq!(changed["parts"][1]["block"]["mass_kg"], json!(0.3));
        assert!(set(&mut changed, &path, json!(0.1)).is_some());
        assert_eq!(changed, tree());
        assert!(set(&mut changed, &["parts", "2", "block"].map(str::to_owned), json!(0.1)).is_none());
    }
}
