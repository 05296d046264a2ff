use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};
use serde::ser::{Serialize, Serializer};
use std::fmt;
use zsim_base::geometry::{Pose, Vector, from_roll_pitch_yaw};

/// A pose in a scene: `(x, y)`, `(x, y, z)`, `(x, y, z, yaw)`, or `(x, y, z, yaw, pitch, roll)`, in metres and degrees;
/// omitted numbers are 0.
///
/// The rotation is about the fixed x, then y, then z axis (roll, pitch, yaw; REP-103).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    numbers: [f64; 6],
}

impl Placement {
    /// A list with the origin only.
    pub(super) fn at_origin() -> Vec<Self> {
        vec![Self { numbers: [0.0; 6] }]
    }

    /// The pose.
    pub fn world_from_body(&self) -> Pose {
        let [x, y, z, yaw, pitch, roll] = self.numbers;
        let rotation = from_roll_pitch_yaw(roll.to_radians(), pitch.to_radians(), yaw.to_radians());
        Pose::from_parts(Vector::new(x, y, z).into(), rotation)
    }
}

impl<'de> Deserialize<'de> for Placement {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(PlacementVisitor)
    }
}

struct PlacementVisitor;

impl<'de> Visitor<'de> for PlacementVisitor {
    type Value = Placement;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("(x, y, z, yaw, pitch, roll) in metres and degrees, at least x and y")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Placement, A::Error> {
        let (mut numbers, mut count) = ([0.0; 6], 0);
        while let Some(number) = seq.next_element::<f64>()? {
            if !number.is_finite() {
                return Err(A::Error::custom(format!("expected finite numbers in a pose, found {number}")));
            }
            match numbers.get_mut(count) {
                Some(slot) => *slot = number,
                None => return Err(A::Error::invalid_length(count + 1, &self)),
            }
            count += 1;
        }
        if count < 2 { Err(A::Error::invalid_length(count, &self)) } else { Ok(Placement { numbers }) }
    }
}

impl schemars::JsonSchema for Placement {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Placement".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "A pose: x, y, z (m), yaw, pitch, roll (degrees); omitted trailing numbers are 0.",
            "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 6
        })
    }
}

impl Serialize for Placement {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let used = self.numbers.iter().rposition(|x| *x != 0.0).map_or(0, |last| last + 1).max(2);
        serializer.collect_seq(&self.numbers[..used])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::spec::{Source, parse, to_text};

    fn placement(text: &str) -> Result<Placement, String> {
        parse(&Source::in_memory("test", text)).map_err(|error| error.message().to_owned())
    }

    #[test]
    fn a_placement_takes_two_to_six_numbers_in_either_bracket() {
        for text in ["(1, 2)", "[1.0, 2]", "(1, 2, 0, 0)", "(1, 2, 0, 0, 0, 0)"] {
            assert_eq!(placement(text).unwrap().numbers, [1.0, 2.0, 0.0, 0.0, 0.0, 0.0], "{text}");
        }
        for text in ["(1)", "()", "(1, 2, 3, 4, 5, 6, 7)", "(1, NaN)", "(1, inf)", "\"a\"", "3"] {
            assert!(placement(text).is_err(), "{text}");
        }
    }

    #[test]
    fn yaw_turns_x_towards_y_and_pitch_turns_x_down() {
        // REP-103: right-handed, x forward, y left, z up; a positive turn about y brings x to -z.
        let at = |text: &str| placement(text).unwrap().world_from_body().rotation * Vector::x();
        assert_relative_eq!(at("(0, 0, 0, 90)"), Vector::y(), epsilon = 1e-12);
        assert_relative_eq!(at("(0, 0, 0, 0, 90)"), -Vector::z(), epsilon = 1e-12);
    }

    #[test]
    fn a_placement_survives_writing_and_reading() {
        for text in ["(0, 0)", "(1, 2, 3.5, -90)", "(1, 2, 0, 0, 0, 1e-3)"] {
            let read = placement(text).unwrap();
            assert_eq!(placement(&to_text(&read).unwrap()).unwrap(), read, "{text}");
        }
    }
}
