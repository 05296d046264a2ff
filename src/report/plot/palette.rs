//! Colours that people with any colour vision tell apart (Okabe and Ito 2008), on white.

/// Red, green, blue.
pub(super) type Rgb = (u8, u8, u8);

/// Text and axes.
pub(super) const INK: Rgb = (38, 38, 38);
/// Lines of the grid.
pub(super) const GRID: Rgb = (228, 228, 228);
/// What stands behind the data.
pub(super) const BACKDROP: Rgb = (196, 200, 204);

/// From light to dark, for amounts: ColorBrewer's YlGnBu (Harrower and Brewer 2003) without its lightest colour.
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

/// From one sign over little to the other: blue, grey, vermilion.
const SIGNED_SHADES: [Rgb; 3] = [(0, 114, 178), (206, 206, 200), (213, 94, 0)];

/// The colour of an amount, from 0 to 1; what is beyond has the end's.
pub(super) fn shade(share: f64) -> Rgb {
    between(&SHADES, share)
}

/// The colour of an amount that has a sign: 0 for the most negative, 1 for the most positive.
pub(super) fn signed_shade(share: f64) -> Rgb {
    between(&SIGNED_SHADES, share)
}

fn between(shades: &[Rgb], share: f64) -> Rgb {
    let place = share.clamp(0.0, 1.0) * (shades.len() - 1) as f64;
    let below = (place as usize).min(shades.len() - 2);
    let (a, b, u) = (shades[below], shades[below + 1], place - below as f64);
    let mix = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * u).round() as u8;
    (mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}

/// What a series shows, which decides its colour in every figure alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    /// The truth, and closed forms: near black.
    Truth,
    /// The estimate, and what was measured: blue.
    Estimate,
    /// A second kind of what was estimated: vermilion.
    Second,
    /// A third: bluish green.
    Third,
    /// A fourth: orange.
    Fourth,
    /// A fifth: reddish purple.
    Fifth,
    /// What stands behind the data: light grey.
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
