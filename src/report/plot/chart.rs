use super::Colour;

/// Line style or marker of a series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mark {
    /// A line of this width in points.
    Line(f64),
    /// A dashed line of this width in points.
    Dashes(f64),
    /// Dots of this diameter in points.
    Dots(f64),
    /// Diagonal crosses of this width in points.
    Crosses(f64),
}

/// Size of the marks of start and end, points.
const END_SIZE: f64 = 7.0;

/// A data series of a chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend; an empty name has no entry.
    pub name: String,
    /// Colour.
    pub colour: Colour,
    /// Line style or marker.
    pub mark: Mark,
    /// Points (x, y) in the units of the axes; a non-finite point interrupts the line.
    pub points: Vec<(f64, f64)>,
    /// A band behind the points, such as a confidence interval.
    pub band: Vec<BandPoint>,
}

/// The ends of a band at one x, in the units of the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BandPoint {
    /// Position along the x axis.
    pub x: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Series {
    /// A series as a line.
    pub fn line(name: &str, colour: Colour, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.to_owned(), colour, mark: Mark::Line(1.5), points, band: Vec::new() }
    }

    /// A series as dots.
    pub fn dots(name: &str, colour: Colour, points: Vec<(f64, f64)>) -> Self {
        Self { mark: Mark::Dots(1.5), ..Self::line(name, colour, points) }
    }

    /// Sets the line style or marker.
    #[must_use]
    pub fn marked(mut self, mark: Mark) -> Self {
        self.mark = mark;
        self
    }

    /// Sets the band.
    #[must_use]
    pub fn with_band(mut self, band: Vec<BandPoint>) -> Self {
        self.band = band;
        self
    }

    /// All finite points, including the ends of the band.
    pub(super) fn extent(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let band = self.band.iter().flat_map(|at| [(at.x, at.low), (at.x, at.high)]);
        self.points.iter().copied().chain(band).filter(|(x, y)| x.is_finite() && y.is_finite())
    }
}

/// A rectangle of a [`Cells`] map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Left and right edge, in the unit of the x axis.
    pub x: (f64, f64),
    /// Lower and upper edge, in the unit of the y axis.
    pub y: (f64, f64),
    /// The value that the colour represents; a cell with NaN is not shown.
    pub value: f64,
}

/// A heat map behind all series.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells {
    /// Quantity and unit of the values, for the legend.
    pub unit: String,
    /// The values of the lightest and the darkest colour.
    pub range: (f64, f64),
    /// The rectangles.
    pub cells: Vec<Cell>,
}

impl Cells {
    /// A heat map whose colours cover the [`robust_range`] of the values; values outside have the colour of its ends.
    pub fn with_robust_range(unit: &str, cells: Vec<Cell>) -> Self {
        let range = robust_range(cells.iter().map(|cell| cell.value)).unwrap_or((0.0, 1.0));
        let range = if range.0 < range.1 { range } else { (range.0 - 1.0, range.1) };
        Self { unit: unit.to_owned(), range, cells }
    }
}

/// Range of the finite values without outliers: those more than three interquartile ranges outside the quartiles (Tukey
/// 1977: "far out"). `None` without finite values.
pub fn robust_range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let mut sorted: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let (least, most) = (*sorted.first()?, *sorted.last()?);
    let (low, high) = (sorted[sorted.len() / 4], sorted[3 * sorted.len() / 4]);
    let fence = 3.0 * (high - low);
    // Without spread in the middle half, all other values would count as outliers.
    if fence > 0.0 { Some((least.max(low - fence), most.min(high + fence))) } else { Some((least, most)) }
}

/// Dots with colours by a signed value, in front of all series; dots outside the axes are not shown.
#[derive(Debug, Clone, PartialEq)]
pub struct SignedDots {
    /// Quantity and unit of the values, for the legend; an empty text has no entry.
    pub unit: String,
    /// Magnitude of the value at which the colour saturates.
    pub limit: f64,
    /// Diameter, points.
    pub size: f64,
    /// The dots.
    pub dots: Vec<SignedDot>,
}

/// A dot with a colour by its value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignedDot {
    /// Position along the x axis.
    pub x: f64,
    /// Position along the y axis.
    pub y: f64,
    /// The value that the colour represents; a dot with NaN is not shown.
    pub value: f64,
}

/// A tick of an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// Position on the axis.
    pub at: f64,
    /// Label.
    pub label: String,
}

/// A pair of axes with its data.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Title above the axes; can be empty.
    pub title: String,
    /// Label of the x axis with unit, such as `"Time (s)"`.
    pub x_label: String,
    /// Label of the y axis with unit.
    pub y_label: String,
    /// Whether both axes have the same scale, as on a map.
    pub equal_axes: bool,
    /// Whether the y axis includes zero.
    pub from_zero: bool,
    /// Ranges of the x and y axes; `None` for the range of the data.
    pub range: Option<[(f64, f64); 2]>,
    /// Heat map.
    pub cells: Option<Cells>,
    /// Dots with colours by a signed value.
    pub signed_dots: Option<SignedDots>,
    /// Custom ticks of the x axis. Ticks outside the data range are omitted; empty for round numbers.
    pub x_ticks: Vec<Tick>,
    /// Custom ticks of the y axis, as `x_ticks`.
    pub y_ticks: Vec<Tick>,
    /// The series, from back to front.
    pub series: Vec<Series>,
}

impl Chart {
    /// A chart without data.
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
            x_ticks: Vec::new(),
            y_ticks: Vec::new(),
            series: Vec::new(),
        }
    }

    /// Adds a series in front of the others.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Marks the start of a path with a dot and its end with a cross, which differ in print without colour too.
    #[must_use]
    pub fn with_ends(self, start: (f64, f64), end: Option<(f64, f64)>) -> Self {
        let chart = self.with(Series::dots("start", Colour::Third, vec![start]).marked(Mark::Dots(END_SIZE)));
        match end {
            Some(end) => chart.with(Series::dots("end", Colour::Second, vec![end]).marked(Mark::Crosses(END_SIZE))),
            None => chart,
        }
    }

    /// Sets the heat map.
    #[must_use]
    pub fn with_cells(mut self, cells: Cells) -> Self {
        self.cells = Some(cells);
        self
    }

    /// Sets the dots with colours by a signed value.
    #[must_use]
    pub fn with_signed_dots(mut self, dots: SignedDots) -> Self {
        self.signed_dots = Some(dots);
        self
    }

    /// Sets the ranges of the axes.
    #[must_use]
    pub fn between(mut self, x: (f64, f64), y: (f64, f64)) -> Self {
        self.range = Some([x, y]);
        self
    }

    /// Sets custom ticks of the x axis.
    #[must_use]
    pub fn with_x_ticks(mut self, ticks: Vec<Tick>) -> Self {
        self.x_ticks = ticks;
        self
    }

    /// Sets custom ticks of the y axis.
    #[must_use]
    pub fn with_y_ticks(mut self, ticks: Vec<Tick>) -> Self {
        self.y_ticks = ticks;
        self
    }

    /// Gives both axes the same scale, as on a map.
    #[must_use]
    pub fn as_map(mut self) -> Self {
        self.equal_axes = true;
        self
    }

    /// Extends the y axis to zero.
    #[must_use]
    pub fn starting_at_zero(mut self) -> Self {
        self.from_zero = true;
        self
    }

    /// Range of the data in x and y; the unit square if there are no data.
    pub(super) fn extent(&self) -> [(f64, f64); 2] {
        let mut ends = [(f64::INFINITY, f64::NEG_INFINITY); 2];
        let corners = |cell: &Cell| [(cell.x.0, cell.y.0), (cell.x.1, cell.y.1)];
        let cells = self.cells.iter().flat_map(|cells| cells.cells.iter().flat_map(corners));
        let dots = self.signed_dots.iter().flat_map(|dots| dots.dots.iter().map(|dot| (dot.x, dot.y)));
        for (x, y) in self.series.iter().flat_map(Series::extent).chain(cells).chain(dots) {
            for (end, value) in ends.iter_mut().zip([x, y]) {
                *end = (end.0.min(value), end.1.max(value));
            }
        }
        ends.map(|(low, high)| if low <= high { (low, high) } else { (0.0, 1.0) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_outlier_does_not_determine_the_range() {
        // Fields of view from 40 to 79 degrees; one of a spring near instability.
        let mut values: Vec<f64> = (40..80).map(f64::from).collect();
        assert_eq!(robust_range(values.iter().copied()), Some((40.0, 79.0)));
        values.extend([4518.0, f64::INFINITY, f64::NAN]);
        // 41 finite values: quartiles 50 and 70, fences at 50 - 60 and 70 + 60.
        assert_eq!(robust_range(values.into_iter()), Some((40.0, 130.0)));
        assert_eq!(robust_range([1.0, 1.0, 1.0, 5.0].into_iter()), Some((1.0, 5.0)));
        assert_eq!(robust_range([f64::NAN].into_iter()), None);
    }
}
