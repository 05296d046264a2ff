//! Plots of figure 3: one column per design with the paper's three panels.

use super::head_response::HeadResponse;
use zsim_head::gains::{GainCurve, coherence_panels, gain_panels};
use zsim_report::plot::{Chart, Figure};

/// Gain curves: simulation as dots, closed form as lines.
pub(super) fn gains(responses: &[HeadResponse<'_>], up_to_hz: f64) -> Figure {
    columns(responses, |response| gain_panels(&shown(response, up_to_hz)))
}

/// Coherence in the same panels.
pub(super) fn coherence(responses: &[HeadResponse<'_>], up_to_hz: f64) -> Figure {
    columns(responses, |response| coherence_panels(&shown(response, up_to_hz)))
}

fn shown(response: &HeadResponse<'_>, up_to_hz: f64) -> Vec<GainCurve> {
    response.curves.iter().map(|curve| curve.up_to(up_to_hz)).collect()
}

fn columns(responses: &[HeadResponse<'_>], panels: impl Fn(&HeadResponse<'_>) -> Vec<Chart>) -> Figure {
    let mut of_designs: Vec<std::vec::IntoIter<Chart>> = responses
        .iter()
        .map(|response| {
            let mut panels = panels(response);
            panels.iter_mut().for_each(|panel| panel.title.clear());
            if let Some(top) = panels.first_mut() {
                top.title = format!("({}) {}", response.design.letter, response.design.title);
            }
            panels.into_iter()
        })
        .collect();
    let mut charts = Vec::new();
    while of_designs.iter().any(|panels| panels.len() > 0) {
        charts.extend(of_designs.iter_mut().filter_map(Iterator::next));
    }
    let mut figure = Figure::of(charts).in_columns(responses.len());
    figure.width = 480.0 * responses.len() as f64;
    figure
}
