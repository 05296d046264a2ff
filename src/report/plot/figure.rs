use super::canvas::{Canvas, Pen, PlotError, register_fonts};
use super::merged_lines::merged_lines;
use super::raster::Raster;
use super::{Chart, frame};
use plotters::prelude::{BitMapBackend, DrawingBackend, IntoDrawingArea, SVGBackend};
use std::io::Write;
use std::path::Path;
use zsim_base::files;

/// SVG units per point; the backends have integer coordinates, so one unit per point would be too coarse.
const SVG_UNITS_PER_POINT: u32 = 4;
/// Pixels of a PNG per point.
const PNG_PIXELS_PER_POINT: u32 = 2;
/// Oversampling factor of a PNG in each direction, for antialiasing: the backend draws without it.
const OVERSAMPLING: u32 = 2;

/// A plot of one or more charts, in one or more columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Width, points.
    pub width: f64,
    /// Height of each chart, points; the height of a map follows from its range.
    pub chart_height: f64,
    /// Number of charts in a row.
    pub columns: usize,
    /// The charts, row by row from the top.
    pub charts: Vec<Chart>,
}

impl Figure {
    /// A figure of page width with these charts, in one column.
    pub fn of(charts: Vec<Chart>) -> Self {
        Self { width: 720.0, chart_height: 250.0, columns: 1, charts }
    }

    /// Sets the number of charts in a row, at least 1.
    #[must_use]
    pub fn in_columns(mut self, columns: usize) -> Self {
        self.columns = columns.max(1);
        self
    }

    fn rows(&self) -> impl Iterator<Item = (&[Chart], f64)> {
        let width = self.width / self.columns as f64;
        let height = move |chart| frame::height_of(chart, width, self.chart_height);
        self.charts.chunks(self.columns).map(move |row| (row, row.iter().map(height).fold(0.0, f64::max)))
    }

    fn size(&self) -> (u32, u32) {
        let height: f64 = self.rows().map(|(_, height)| height).sum();
        (self.width.ceil() as u32, height.ceil().max(1.0) as u32)
    }

    fn draw<DB: DrawingBackend>(&self, backend: DB, scale: u32, pen: Pen) -> Result<(), PlotError> {
        register_fonts()?;
        let area = backend.into_drawing_area();
        let canvas = Canvas { area: &area, scale: f64::from(scale), pen };
        canvas.clear()?;
        let mut top = 0.0;
        let width = self.width / self.columns as f64;
        for (row, height) in self.rows() {
            let header = row.iter().try_fold(0.0, |most: f64, chart| {
                Ok::<_, PlotError>(most.max(frame::extra_header_height(&canvas, chart, width)?))
            })?;
            for (column, chart) in row.iter().enumerate() {
                let corner = (column as f64 * width, top);
                frame::draw(&canvas, chart, corner, (width, height), header)?;
            }
            top += height;
        }
        area.present().map_err(PlotError::drawing)
    }

    /// Draws the figure as an SVG and returns the text.
    ///
    /// # Errors
    /// When it cannot be drawn.
    pub fn svg(&self) -> Result<String, PlotError> {
        let (width, height) = self.size();
        let (wide, high) = (width * SVG_UNITS_PER_POINT, height * SVG_UNITS_PER_POINT);
        let mut text = String::new();
        self.draw(SVGBackend::with_string(&mut text, (wide, high)), SVG_UNITS_PER_POINT, Pen::Vector)?;
        let size_in_units = format!("width=\"{wide}\" height=\"{high}\"");
        let size_in_points = format!("width=\"{width}\" height=\"{height}\"");
        Ok(merged_lines(&text.replacen(&size_in_units, &size_in_points, 1)))
    }

    /// Draws the figure in pixels.
    fn raster(&self) -> Result<Raster, PlotError> {
        let (width, height) = self.size();
        let scale = PNG_PIXELS_PER_POINT * OVERSAMPLING;
        let mut raster = Raster::new(width * scale, height * scale);
        let size = (raster.width, raster.height);
        self.draw(BitMapBackend::with_buffer(&mut raster.pixels, size), scale, Pen::Pixels)?;
        Ok(raster.downsampled(OVERSAMPLING))
    }

    /// Writes `NAME.svg` and `NAME.png` into `folder`, and returns the SVG.
    ///
    /// # Errors
    /// When the figure cannot be drawn, or a file cannot be written.
    pub fn save(&self, folder: &Path, name: &str) -> Result<String, PlotError> {
        let write = |ending: &str, bytes: &[u8]| {
            let path = folder.join(format!("{name}.{ending}"));
            let written = files::create(&path).and_then(|mut file| file.write_all(bytes));
            written.map_err(|source| PlotError::File { path: path.display().to_string(), source })
        };
        let svg = self.svg()?;
        write("svg", svg.as_bytes())?;
        write("png", &self.raster()?.png()?)?;
        Ok(svg)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{BandPoint, Colour, Series};

    fn figure() -> Figure {
        let wave = (0..200).map(|k| (k as f64 * 0.1, (k as f64 * 0.1).sin())).collect();
        let band = (0..200).map(|k| BandPoint { x: k as f64 * 0.1, low: -0.5, high: 0.5 }).collect();
        let series = Series::line("sine & <co>", Colour::Estimate, wave).with_band(band);
        Figure::of(vec![Chart::new("A wave", "Time (s)", "Height (m)").with(series)])
    }

    #[test]
    fn an_svg_contains_its_text_and_is_complete() {
        let svg = figure().svg().unwrap();
        for word in ["A wave", "Time (s)", "Height (m)", "sine &amp; &lt;co&gt;", "width=\"720\""] {
            assert!(svg.contains(word), "{word} is missing");
        }
        assert!(svg.trim_end().ends_with("</svg>"));
    }

    #[test]
    fn a_label_longer_than_its_axis_is_smaller() {
        let long = "Position error of the base by a rigid link, root mean square, over the run (mm)";
        let series = || Series::line("a", Colour::Truth, vec![(0.0, 0.0), (1.0, 1.0)]);
        let charts = [("Time (s)", "Height (m)"), (long, long)].map(|(x, y)| Chart::new("", x, y).with(series()));
        let svg = Figure::of(charts.to_vec()).svg().unwrap();
        let size = |label: &str| {
            // That of the vertical axis is the last.
            let before = &svg[..svg.rfind(label).unwrap()];
            let size = before.rsplit("font-size=\"").next().unwrap().split('"').next().unwrap();
            size.parse::<f64>().unwrap()
        };
        assert_eq!(size("Time (s)"), size("Height (m)"));
        assert!(size(long) < 0.9 * size("Time (s)"), "{} {}", size(long), size("Time (s)"));
    }

    #[test]
    fn control_characters_of_names_are_escaped() {
        let series = Series::line("a\u{1b}[31m\u{202e}\nb\u{ffff}", Colour::Truth, vec![(0.0, 0.0), (1.0, 1.0)]);
        let svg = Figure::of(vec![Chart::new("\u{7}title", "x\u{0}", "y").with(series)]).svg().unwrap();
        let is_forbidden = |c: char| c.is_control() && c != '\n' || ['\u{202e}', '\u{ffff}'].contains(&c);
        assert!(!svg.contains(is_forbidden), "{svg}");
        assert!(svg.contains("a\\u{1b}[31m\\u{202e}\\nb\\u{ffff}") && svg.contains("\\u{7}title"), "{svg}");
    }

    #[test]
    fn a_figure_is_saved_in_both_formats_and_is_reproducible() {
        let folder = tempfile::tempdir().unwrap();
        figure().save(folder.path(), "wave").unwrap();
        let bytes = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
        let (first, svg) = (bytes("wave.png"), bytes("wave.svg"));
        figure().save(folder.path(), "wave").unwrap();
        assert!(first == bytes("wave.png") && svg == bytes("wave.svg"));
        let mut reader = png::Decoder::new(std::io::Cursor::new(first)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height), (720 * PNG_PIXELS_PER_POINT, 250 * PNG_PIXELS_PER_POINT));
        assert!(pixels == figure().raster().unwrap().pixels);
    }

    #[test]
    fn a_chart_without_finite_data_is_drawn_empty() {
        let empty = Figure::of(vec![Chart::new("", "x", "y"), Chart::new("", "x", "y").as_map()]);
        assert!(empty.svg().is_ok());
        let nan = Series::line("nan", Colour::Truth, vec![(0.0, f64::NAN), (f64::INFINITY, 1.0)]);
        assert!(Figure::of(vec![Chart::new("", "x", "y").with(nan)]).svg().is_ok());
    }
}
