use super::Colour;

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mark {
    /// A line of this width in points.
    Line(f64),
    /// A dashed line of this width in points.
    Dashes(f64),
    /// Dots of this diameter in points.
    Dots(f64),
}

/// Points of one kind in a chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its name in the legend; empty for none.
    pub name: String,
    /// Its colour.
    pub colour: Colour,
    /// Line, dashes or dots.
    pub mark: Mark,
    /// Abscissa and ordinate, in the axes' units; where one is not finite the line is broken.
    pub points: Vec<(f64, f64)>,
    /// A band behind the points: abscissa, lower and upper end (a confidence interval).
    pub band: Vec<(f64, f64, f64)>,
}

impl Series {
    /// A line.
    pub fn line(name: &str, colour: Colour, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.to_owned(), colour, mark: Mark::Line(1.5), points, band: Vec::new() }
    }

    /// Dots.
    pub fn dots(name: &str, colour: Colour, points: Vec<(f64, f64)>) -> Self {
        Self { mark: Mark::Dots(1.5), ..Self::line(name, colour, points) }
    }

    /// The same, marked in another way.
    #[must_use]
    pub fn marked(mut self, mark: Mark) -> Self {
        self.mark = mark;
        self
    }

    /// The same, with a band behind it.
    #[must_use]
    pub fn with_band(mut self, band: Vec<(f64, f64, f64)>) -> Self {
        self.band = band;
        self
    }

    /// All finite points, the band's ends among them.
    pub(super) fn extent(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let band = self.band.iter().flat_map(|(x, low, high)| [(*x, *low), (*x, *high)]);
        self.points.iter().copied().chain(band).filter(|(x, y)| x.is_finite() && y.is_finite())
    }
}

/// A rectangle of a [`Cells`] map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// From left to right, in the abscissa's unit.
    pub x: (f64, f64),
    /// From below to above, in the ordinate's unit.
    pub y: (f64, f64),
    /// The amount that its colour shows; one that is no number is not drawn.
    pub value: f64,
}

/// Amounts as colours, behind all series.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells {
    /// What the amounts are, with their unit.
    pub unit: String,
    /// The amounts of the lightest and the darkest colour.
    pub range: (f64, f64),
    /// The rectangles.
    pub cells: Vec<Cell>,
}

/// Dots whose colour shows an amount of either sign, in front of all series. Those beyond the axes are not drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct SignedDots {
    /// What the amounts are, with their unit, for the legend; empty for none.
    pub unit: String,
    /// The amount, of either sign, from which on the colour is the end's.
    pub limit: f64,
    /// Diameter in points.
    pub size: f64,
    /// Abscissa, ordinate, amount.
    pub dots: Vec<(f64, f64, f64)>,
}

/// One pair of axes with what is drawn on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// What it shows, above it; empty for none.
    pub title: String,
    /// Label of the abscissa with its unit, `"Time (s)"`.
    pub x_label: String,
    /// Label of the ordinate with its unit.
    pub y_label: String,
    /// Whether a unit is as long on both axes, as on a map.
    pub equal_axes: bool,
    /// Whether the ordinate begins at zero at the latest.
    pub from_zero: bool,
    /// Ends of abscissa and ordinate; without, those of what is drawn.
    pub range: Option<[(f64, f64); 2]>,
    /// Amounts as colours.
    pub cells: Option<Cells>,
    /// Dots coloured by an amount.
    pub signed_dots: Option<SignedDots>,
    /// Marks of the abscissa with their words, instead of round numbers; those beyond the data are left out.
    pub x_marks: Vec<(f64, String)>,
    /// The same of the ordinate.
    pub y_marks: Vec<(f64, String)>,
    /// What is drawn, from the back to the front.
    pub series: Vec<Series>,
}

impl Chart {
    /// A chart without series.
    pub fn new(title: &str, x_label: &str, y_label: &str) -> Self {
        Self {
            title: title.to_owned(),
            x_label: x_label.to_owned(),
            y_label: y_label.to_owned(),
            equal_axes: false,
            from_zero: false,
            range: None,
            cells: None,
            signed_dots: None,
            x_marks: Vec::new(),
            y_marks: Vec::new(),
            series: Vec::new(),
        }
    }

    /// The same with another series in front.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// The same with amounts as colours behind its series.
    #[must_use]
    pub fn with_cells(mut self, cells: Cells) -> Self {
        self.cells = Some(cells);
        self
    }

    /// The same with dots coloured by an amount in front.
    #[must_use]
    pub fn with_signed_dots(mut self, dots: SignedDots) -> Self {
        self.signed_dots = Some(dots);
        self
    }

    /// The same with abscissa and ordinate between these ends.
    #[must_use]
    pub fn between(mut self, x: (f64, f64), y: (f64, f64)) -> Self {
        self.range = Some([x, y]);
        self
    }

    /// The same with marks of its own on the abscissa.
    #[must_use]
    pub fn with_x_marks(mut self, marks: Vec<(f64, String)>) -> Self {
        self.x_marks = marks;
        self
    }

    /// The same with marks of its own on the ordinate.
    #[must_use]
    pub fn with_y_marks(mut self, marks: Vec<(f64, String)>) -> Self {
        self.y_marks = marks;
        self
    }

    /// The same as a map.
    #[must_use]
    pub fn as_map(mut self) -> Self {
        self.equal_axes = true;
        self
    }

    /// The same with zero on its ordinate.
    #[must_use]
    pub fn starting_at_zero(mut self) -> Self {
        self.from_zero = true;
        self
    }

    /// Least and greatest abscissa and ordinate of all that is drawn; a unit square where nothing is.
    pub(super) fn extent(&self) -> [(f64, f64); 2] {
        let mut ends = [(f64::INFINITY, f64::NEG_INFINITY); 2];
        let corners = |cell: &Cell| [(cell.x.0, cell.y.0), (cell.x.1, cell.y.1)];
        let cells = self.cells.iter().flat_map(|cells| cells.cells.iter().flat_map(corners));
        let dots = self.signed_dots.iter().flat_map(|dots| dots.dots.iter().map(|(x, y, _)| (*x, *y)));
        for (x, y) in self.series.iter().flat_map(Series::extent).chain(cells).chain(dots) {
            for (end, value) in ends.iter_mut().zip([x, y]) {
                *end = (end.0.min(value), end.1.max(value));
            }
        }
        ends.map(|(low, high)| if low <= high { (low, high) } else { (0.0, 1.0) })
    }
}
