//! Encodes the data of the page as JSON with binary arrays in base64 (RFC 4648).

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use zsim_base::geometry::Pose;

/// A pose with its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedPose {
    /// Time, s.
    pub t_s: f64,
    /// The pose in the frame of the view.
    pub pose: Pose,
}

/// Escapes the characters that end a script element or start a comment in it, and line ends that scripts do not allow.
pub(crate) fn inert(json: &str) -> String {
    let mut text = String::with_capacity(json.len());
    for c in json.chars() {
        match c {
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => text += &format!("\\u{:04x}", u32::from(c)),
            _ => text.push(c),
        }
    }
    text
}

/// Times; positions and quaternions, seven numbers a pose.
pub(super) fn path(poses: &[TimedPose]) -> Value {
    json!({
        "t": base64_f32(poses.iter().map(|timed| timed.t_s)),
        "pose": base64_f32(poses.iter().flat_map(|timed| seven(&timed.pose))),
    })
}

/// Position x, y, z and quaternion x, y, z, w.
pub(super) fn seven(pose: &Pose) -> [f64; 7] {
    let (p, q) = (pose.translation.vector, pose.rotation.coords);
    [p.x, p.y, p.z, q.x, q.y, q.z, q.w]
}

/// Little-endian single-precision numbers in base64.
pub(super) fn base64_f32(values: impl Iterator<Item = f64>) -> String {
    STANDARD.encode(values.flat_map(|value| (value as f32).to_le_bytes()).collect::<Vec<u8>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_in_a_script_element_cannot_end_it() {
        let hostile = "</script><script>alert(1)</script><!-- & \u{2028}";
        let text = inert(&serde_json::to_string(hostile).unwrap());
        assert!(!text.contains(['<', '>', '&', '\u{2028}']), "{text}");
        assert_eq!(serde_json::from_str::<String>(&text).unwrap(), hostile);
    }

    #[test]
    fn numbers_are_little_endian_base64() {
        // 1.0 is 3f800000 and -2.0 is c0000000 in IEEE 754; their bytes are 00 00 80 3f 00 00 00 c0.
        assert_eq!(base64_f32([1.0, -2.0].into_iter()), "AACAPwAAAMA=");
    }
}
