//! Plot of the clock offsets of the runs of a study over time.

use crate::StudyError;
use crate::sweep::{AxisSpec, Sweep};
use zsim_report::plot::{Chart, Colour, Figure, Mark, Series};
use zsim_run::ClockCurve;

/// Colours of the levels; further levels repeat them.
const COLOURS: [Colour; 5] = [Colour::Estimate, Colour::Second, Colour::Third, Colour::Fourth, Colour::Fifth];
/// Range of the lower chart, ms: the error after the offset has settled.
const SHOWN_ERROR_MS: f64 = 0.5;

/// Estimated offsets above, their errors below, with a line for each run; runs of a level have one colour.
///
/// `None` if a run failed.
pub(super) fn figure(sweep: &Sweep) -> Result<Option<Figure>, StudyError> {
    let [AxisSpec::Levels { levels, .. }] = sweep.plan().spec().axes.as_slice() else { return Ok(None) };
    let Some(curves) = sweep.details::<ClockCurve>()? else { return Ok(None) };
    let mut offsets = Chart::new("", "Time (s)", "Estimated clock offset (ms)");
    let mut errors = Chart::new("", "Time (s)", "Error of the offset (ms)");
    let end_s = curves.iter().filter_map(|curve| curve.t_s.last()).copied().fold(1.0, f64::max);
    let runs_per_level = curves.len().div_ceil(levels.len().max(1)).max(1);
    for (index, curve) in curves.iter().enumerate() {
        let level = index / runs_per_level;
        let colour = COLOURS[level % COLOURS.len()];
        let name = levels.get(level).filter(|_| index % runs_per_level == 0).map_or("", |level| level.name.as_str());
        let line = |name: &str, of: &[f64]| {
            let points = curve.t_s.iter().copied().zip(of.iter().copied()).collect();
            Series::line(name, colour, points).marked(Mark::Line(1.0))
        };
        offsets = offsets.with(line(name, &curve.offset_ms));
        let shown = |error_ms: &f64| if error_ms.abs() <= SHOWN_ERROR_MS { *error_ms } else { f64::NAN };
        errors = errors.with(line("", &curve.error_ms.iter().map(shown).collect::<Vec<_>>()));
    }
    let errors = errors.between((0.0, end_s), (-SHOWN_ERROR_MS, SHOWN_ERROR_MS));
    let mut figure = Figure::of(vec![offsets, errors]);
    figure.width = 900.0;
    Ok(Some(figure))
}
