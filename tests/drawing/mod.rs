//! Drawing of the rooms and what they use, for `docs/architecture.md`.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// Places of the rooms: half columns from the left, rows from the top. Every room needs one, and no arrow may cross a box.
const PLACES: [(&str, usize, usize); 16] = [
    ("cli", 4, 0),
    ("study", 4, 1),
    ("run", 4, 2),
    ("head", 4, 3),
    ("report", 4, 4),
    ("simulation", 2, 5),
    ("evaluation", 6, 5),
    ("dynamics", 1, 6),
    ("sensors", 4, 6),
    ("estimation", 6, 6),
    ("motion", 0, 7),
    ("elasticity", 2, 7),
    ("world", 4, 7),
    ("recording", 0, 8),
    ("truth", 0, 9),
    ("base", 3, 10),
];

/// Size of a box, distances between half columns and rows, and the margin, px.
const BOX: (usize, usize) = (104, 32);
const STEP: (usize, usize) = (62, 66);
const MARGIN: usize = 12;

/// Uses between rooms: each room with the rooms that its manifest names.
pub type Uses = BTreeMap<String, BTreeSet<String>>;

/// Returns the rooms that `room` uses directly and not through another one.
fn direct(uses: &Uses, room: &str) -> BTreeSet<String> {
    let all = &uses[room];
    let through = |used: &String| all.iter().any(|other| other != used && reaches(uses, other, used));
    all.iter().filter(|used| !through(used)).cloned().collect()
}

fn reaches(uses: &Uses, from: &str, to: &str) -> bool {
    uses[from].iter().any(|used| used == to || reaches(uses, used, to))
}

/// Draws the rooms as SVG, with arrows to the rooms that each one uses directly and not through another one.
///
/// # Panics
/// If a room has no place.
pub fn svg(uses: &Uses) -> String {
    let corner = |(name, x, y): &(&str, usize, usize)| ((*name).to_owned(), (MARGIN + x * STEP.0, MARGIN + y * STEP.1));
    let corners: BTreeMap<String, (usize, usize)> = PLACES.iter().map(corner).collect();
    assert!(uses.keys().eq(corners.keys()), "PLACES has other rooms than src/");
    let width = corners.values().map(|corner| corner.0).max().unwrap_or(0) + BOX.0 + MARGIN;
    let height = corners.values().map(|corner| corner.1).max().unwrap_or(0) + BOX.1 + MARGIN;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         font-family=\"sans-serif\" font-size=\"14\">\n<defs><marker id=\"tip\" viewBox=\"0 0 8 8\" refX=\"8\" \
         refY=\"4\" markerWidth=\"8\" markerHeight=\"8\" orient=\"auto\"><path d=\"M0 0 8 4 0 8z\" fill=\"#667\"/></marker></defs>\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n"
    );
    for room in uses.keys() {
        let from = corners[room];
        for used in direct(uses, room) {
            let to = corners[&used];
            let (x1, y1, x2, y2) = (from.0 + BOX.0 / 2, from.1 + BOX.1, to.0 + BOX.0 / 2, to.1);
            let line = "stroke=\"#667\" marker-end=\"url(#tip)\"";
            writeln!(text, "<path d=\"M{x1} {y1} {x2} {y2}\" {line}/>").unwrap();
        }
    }
    for (room, (x, y)) in corners {
        let (width, height) = BOX;
        writeln!(text, "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" rx=\"4\" fill=\"#eef3fa\" stroke=\"#345\"/>").unwrap();
        let (x, y) = (x + width / 2, y + height / 2 + 5);
        writeln!(text, "<text x=\"{x}\" y=\"{y}\" text-anchor=\"middle\" fill=\"#123\">{room}</text>").unwrap();
    }
    text + "</svg>\n"
}
