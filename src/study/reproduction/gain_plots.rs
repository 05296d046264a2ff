//! Figure 3 as a picture: a column a design, the paper's three panels in each.

use super::gain_curves::Answer;
use crate::report::plot::{Chart, Figure};
use crate::study::gains::{GainCurve, coherence_panels, gain_panels};

/// The gains: dots as simulated, lines in closed form.
pub(super) fn gains(answers: &[Answer<'_>], up_to_hz: f64) -> Figure {
    columns(answers, |answer| gain_panels(&shown(answer, up_to_hz)))
}

/// The coherence in the same panels.
pub(super) fn coherence(answers: &[Answer<'_>], up_to_hz: f64) -> Figure {
    columns(answers, |answer| coherence_panels(&shown(answer, up_to_hz)))
}

fn shown(answer: &Answer<'_>, up_to_hz: f64) -> Vec<GainCurve> {
    answer.curves.iter().map(|curve| curve.up_to(up_to_hz)).collect()
}

fn columns(answers: &[Answer<'_>], panels: impl Fn(&Answer<'_>) -> Vec<Chart>) -> Figure {
    let mut of_designs: Vec<std::vec::IntoIter<Chart>> = answers
        .iter()
        .map(|answer| {
            let mut panels = panels(answer);
            panels.iter_mut().for_each(|panel| panel.title.clear());
            if let Some(top) = panels.first_mut() {
                top.title = format!("({}) {}", answer.design.letter, answer.design.title);
            }
            panels.into_iter()
        })
        .collect();
    let mut charts = Vec::new();
    while of_designs.iter().any(|panels| panels.len() > 0) {
        charts.extend(of_designs.iter_mut().filter_map(Iterator::next));
    }
    let mut figure = Figure::of(charts).in_columns(answers.len());
    figure.width = 480.0 * answers.len() as f64;
    figure
}
