//! Colours that people with any colour vision tell apart (Okabe and Ito 2008), on white.

/// Red, green, blue.
pub(super) type Rgb = (u8, u8, u8);

/// Text and axes.
pub(super) const INK: Rgb = (38, 38, 38);
/// Lines of the grid.
pub(super) const GRID: Rgb = (228, 228, 228);
/// What stands behind the data.
pub(super) const BACKDROP: Rgb = (196, 200, 204);

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
