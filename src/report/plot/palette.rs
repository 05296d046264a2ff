//! Colours on white that remain distinct under colour blindness (Okabe and Ito 2008).

/// Red, green, blue.
pub(super) type Rgb = (u8, u8, u8);

/// Text and axes.
pub(super) const INK: Rgb = (38, 38, 38);
/// Grid lines.
pub(super) const GRID: Rgb = (228, 228, 228);
/// Background elements, such as walls.
pub(super) const BACKDROP: Rgb = (196, 200, 204);

/// Sequential colour map: ColorBrewer's YlGnBu (Harrower and Brewer 2003) without the lightest colour.
const SHADES: [Rgb; 8] = [
    (237, 248, 177),
    (199, 233, 180),
    (127, 205, 187),
    (65, 182, 196),
    (29, 145, 192),
    (34, 94, 168),
    (37, 52, 148),
    (8, 29, 88),
];

/// Diverging colour map: blue for negative, grey for zero, vermilion for positive values.
const SIGNED_SHADES: [Rgb; 3] = [(0, 114, 178), (206, 206, 200), (213, 94, 0)];

/// The sequential colour of a value from 0 to 1; values outside are clamped.
pub(super) fn shade(fraction: f64) -> Rgb {
    interpolated(&SHADES, fraction)
}

/// The diverging colour of a value from 0 (most negative) to 1 (most positive); values outside are clamped.
pub(super) fn signed_shade(fraction: f64) -> Rgb {
    interpolated(&SIGNED_SHADES, fraction)
}

fn interpolated(shades: &[Rgb], fraction: f64) -> Rgb {
    let position = fraction.clamp(0.0, 1.0) * (shades.len() - 1) as f64;
    let below = (position as usize).min(shades.len() - 2);
    let (a, b, u) = (shades[below], shades[below + 1], position - below as f64);
    let mix = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * u).round() as u8;
    (mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}

/// The role of a series, which determines its colour in all figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    /// Truth and closed-form results: dark grey.
    Truth,
    /// Estimates and measurements: blue.
    Estimate,
    /// Second category: vermilion.
    Second,
    /// Third category: bluish green.
    Third,
    /// Fourth category: orange.
    Fourth,
    /// Fifth category: reddish purple.
    Fifth,
    /// Background: light grey.
    Backdrop,
}

impl Colour {
    pub(super) fn rgb(self) -> Rgb {
        match self {
            Colour::Truth => (60, 60, 60),
            Colour::Estimate => (0, 114, 178),
            Colour::Second => (213, 94, 0),
            Colour::Third => (0, 158, 115),
            Colour::Fourth => (230, 159, 0),
            Colour::Fifth => (204, 121, 167),
            Colour::Backdrop => BACKDROP,
        }
    }
}
