//! Fewer elements in an SVG: successive lines of one style become one path.
//!
//! A floor plan has thousands of separate lines; as elements of their own they slow viewers and checkers of pages down.

use std::fmt::Write;

/// How the drawing library writes a line: attributes of the style, then the points.
const START: &str = "<polyline ";
const POINTS: &str = "points=\"";
const END: &str = "\"/>";

/// The SVG in which successive opaque lines of the same style are one path.
///
/// The result looks the same: lines of one opaque colour do not show which of them is above.
pub(super) fn merged_lines(svg: &str) -> String {
    let mut merged = String::with_capacity(svg.len());
    let mut open: Option<&str> = None;
    for line in svg.lines() {
        let opaque = style_and_points(line).filter(|(style, _)| style.contains("opacity=\"1\""));
        if open.is_some() && open != opaque.map(|(style, _)| style) {
            merged.push_str("\"/>\n");
        }
        match opaque {
            Some((style, points)) => {
                if open != Some(style) {
                    let _ = write!(merged, "<path {style}d=\"");
                }
                let _ = write!(merged, "M{}", points.trim());
            }
            None => {
                merged.push_str(line);
                merged.push('\n');
            }
        }
        open = opaque.map(|(style, _)| style);
    }
    merged
}

/// Style and points of a line that is an element of its own.
fn style_and_points(line: &str) -> Option<(&str, &str)> {
    let (style, rest) = line.strip_prefix(START)?.split_once(POINTS)?;
    Some((style, rest.strip_suffix(END)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn successive_opaque_lines_of_one_style_are_one_path() {
        let line = |colour: &str, opacity: &str, points: &str| {
            format!("<polyline fill=\"none\" opacity=\"{opacity}\" stroke=\"{colour}\" points=\"{points}\"/>\n")
        };
        let svg = "<svg>\n".to_owned()
            + &line("#111", "1", "0,0 5,5 ")
            + &line("#111", "1", "7,7 8,9 ")
            + &line("#222", "1", "1,1 2,2 ")
            + &line("#222", "0.5", "3,3 4,4 ")
            + "<text/>\n"
            + &line("#222", "1", "6,6 9,9 ")
            + "</svg>\n";
        let path = |colour: &str, data: &str| {
            format!("<path fill=\"none\" opacity=\"1\" stroke=\"{colour}\" d=\"{data}\"/>\n")
        };
        let expected = "<svg>\n".to_owned()
            + &path("#111", "M0,0 5,5M7,7 8,9")
            + &path("#222", "M1,1 2,2")
            + &line("#222", "0.5", "3,3 4,4 ")
            + "<text/>\n"
            + &path("#222", "M6,6 9,9")
            + "</svg>\n";
        assert_eq!(merged_lines(&svg), expected);
    }
}
