//! Settings by their path: `solve.match_weight`.

use super::Setting;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// `spec` with the setting at `path`, its keys joined by dots, set to another value.
///
/// # Errors
/// A sentence, when there is no such setting (with those that there are) or it takes no such value.
pub fn with_setting<T: Serialize + DeserializeOwned>(spec: &T, path: &str, setting: Setting) -> Result<T, String> {
    let mut whole = serde_json::to_value(spec).map_err(|error| error.to_string())?;
    let mut at = &mut whole;
    let mut above = String::new();
    for key in path.split('.') {
        let known = settings_of(at, &above);
        let missing = || format!("there is no setting \"{path}\"; there are: {known}");
        at = at.as_object_mut().and_then(|object| object.get_mut(key)).ok_or_else(missing)?;
        above = format!("{above}{key}.");
    }
    if let Value::Object(object) = at {
        return Err(format!("\"{path}\" is a group of settings; set one of: {}", names(object, &above)));
    }
    *at = match setting {
        Setting::Switch(on) => on.into(),
        Setting::Count(count) => count.into(),
        Setting::Number(number) => number.into(),
    };
    serde_json::from_value(whole).map_err(|error| format!("\"{path}\": {error}"))
}

fn settings_of(value: &Value, above: &str) -> String {
    match value {
        Value::Object(object) => names(object, above),
        _ => format!("\"{}\", which has none below it", above.trim_end_matches('.')),
    }
}

fn names(object: &Map<String, Value>, above: &str) -> String {
    object.keys().map(|key| format!("{above}{key}")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::load;

    #[test]
    fn a_setting_is_found_by_its_path_and_nothing_else_changes() {
        let base = load("default").unwrap();
        let changed = with_setting(&base, "solve.match_weight", Setting::Number(0.5)).unwrap();
        assert_eq!(changed.solve.match_weight, 0.5);
        assert_eq!(with_setting(&changed, "solve.match_weight", Setting::Number(base.solve.match_weight)), Ok(base));
    }

    #[test]
    fn what_is_not_there_is_answered_with_what_is() {
        let base = load("default").unwrap();
        let wrong = |path: &str, setting: Setting| with_setting(&base, path, setting).unwrap_err();
        assert!(wrong("solve.weight", Setting::Count(1)).contains("solve.match_weight, solve.min_matches"));
        assert!(wrong("windw_s", Setting::Count(1)).contains("window_s, step_s"));
        assert!(wrong("solve", Setting::Count(1)).contains("group of settings"));
        assert!(wrong("window_s.x", Setting::Count(1)).contains("none below"));
        // Out of its range, and of another kind.
        assert!(wrong("window_s", Setting::Number(-1.0)).contains("above 0"));
        assert!(wrong("matching.reciprocal", Setting::Number(0.5)).contains("boolean"));
        assert!(wrong("surfels.levels", Setting::Number(0.5)).contains("usize"));
    }
}
