//! Figure 3 of the paper: gain curves of several heads.

use super::head_response::HeadResponse;
use super::{DampingFit, ExperimentResult, Extent, FittedPeak, GainCurvesSpec, fit_damping, gain_plots};
use crate::StudyError;
use crate::sweep::{AxisSpec, BaseSpec, ComparedNumber, Comparison, Measure, Plan, Runner, Setting, Shard, SweepSpec};
use rayon::prelude::*;
use std::path::Path;
use zsim_base::files::FileError;
use zsim_base::files::subfolder;
use zsim_base::files::write_text;
use zsim_base::spec::{self, Named, Source};
use zsim_dynamics::{DampingSpec, HeadSpec, Peak};
use zsim_head::gains::{AXES, GainCurve, GainPlan, GainsSpec, csv, with_damping};
use zsim_motion::Axis;

/// Fits the damping of the heads, measures their gains, draws figures, and compares with the paper.
pub(super) fn run(
    spec: &GainCurvesSpec,
    source: &Source,
    extent: Extent,
    folder: &Path,
    anew: bool,
    runner: &Runner,
) -> Result<ExperimentResult, StudyError> {
    let heads = spec.heads(source)?;
    let fitted = spec.designs.par_iter().zip(&heads).map(|(design, head)| {
        let source = Source::in_memory(design.head.clone(), "");
        fit_damping(head, &source, &design.peaks, spec.ratios, spec.up_to_hz)
    });
    let fitted: Vec<DampingFit> = fitted.collect::<Result<_, StudyError>>()?;
    let damped: Vec<HeadSpec> =
        heads.iter().zip(&fitted).map(|(head, fit)| with_damping(head, fit.damping_ratio)).collect();
    let sweep = plan(spec, &damped, extent, source)?.write(folder, anew)?;
    sweep.run(Shard::WHOLE, runner)?;
    sweep.merge_and_report()?;
    let curves: Vec<GainCurve> = sweep.details()?.ok_or_else(|| sweep.failed())?;
    let responses: Vec<HeadResponse<'_>> = spec
        .designs
        .iter()
        .zip(fitted)
        .zip(curves.chunks(AXES.len()))
        .map(|((design, fit), curves)| HeadResponse { design, fit, curves: curves.to_vec() })
        .collect();
    for (response, head) in responses.iter().zip(&damped) {
        let folder = subfolder(folder, &response.design.letter).map_err(FileError::at(folder))?;
        write_text(&folder, &folder.join("gains.csv"), &csv(&response.curves))?;
        write_text(&folder, &folder.join("head.ron"), &(spec::to_text(head)? + "\n"))?;
    }
    gain_plots::gains(&responses, spec.shown_to_hz).save(folder, "gains")?;
    gain_plots::coherence(&responses, spec.shown_to_hz).save(folder, "coherence")?;
    Ok(compare(spec, &responses))
}

/// The sweep over the heads and the axes.
fn plan(spec: &GainCurvesSpec, damped: &[HeadSpec], extent: Extent, source: &Source) -> Result<Plan, StudyError> {
    let full = GainPlan::default();
    let (realisations, period_s, longest_settling_s) = match extent {
        Extent::Whole => (full.realisations, full.period_s, full.longest_settling_s),
        Extent::Quick => (2, Some(5.0), 2.0),
    };
    let gains = GainsSpec { axis: AXES[0], up_to_hz: spec.up_to_hz, realisations, period_s, longest_settling_s };
    let heads = spec.designs.iter().zip(damped);
    let heads: Vec<Named<HeadSpec>> =
        heads.map(|(design, head)| Named::in_memory(design.letter.clone(), head.clone())).collect();
    let letters = heads.iter().map(|head| Setting::Text(head.name.clone())).collect();
    let axes = AXES.iter().map(|axis| Setting::Text(format!("{axis:?}"))).collect();
    let sweep = SweepSpec {
        axes: vec![AxisSpec::values("head", letters), AxisSpec::values("gains.axis", axes)],
        measures: vec![Measure::PEAK_GAIN],
        ..SweepSpec::of(BaseSpec::Gains { head: spec.designs[0].head.clone(), gains })
    };
    Plan::with_heads(&format!("figure {}", spec.figure), &sweep, &heads, source)
}

/// Compares the peaks with the paper's.
fn compare(spec: &GainCurvesSpec, responses: &[HeadResponse<'_>]) -> ExperimentResult {
    let rows = responses.iter().flat_map(|response| rows(&spec.figure, response)).collect();
    let mut notes = vec![
        "The paper's peaks are read off the scales of its plots, which show neither the axis nor the frequency of a peak; here \
         each axis of a panel is assumed to reach it."
            .to_owned(),
        format!(
            "\"Fitted\" is the highest peak of the closed form up to {} Hz, with damping ratios fitted to all peaks of the paper; \
             \"simulated\" is measured from cross spectra (H1) with the same ratios. In parentheses: logarithm of the ratio of \
             the fitted peak to the paper's.",
            spec.up_to_hz
        ),
    ];
    notes.extend(responses.iter().map(|response| {
        let DampingSpec { rocking, sway, bounce, yaw } = response.fit.damping_ratio;
        format!(
            "{}{}, {} (head `{}`): damping ratios rocking {rocking:.4}, sway {sway:.4}, bounce {bounce:.4}, yaw {yaw:.4}.",
            spec.figure, response.design.letter, response.design.title, response.design.head
        )
    }));
    notes.extend(responses.iter().filter_map(|response| out_of_range_note(spec, response)));
    ExperimentResult { rows, notes }
}

/// Note on peaks above the frequency range of the paper's plot.
fn out_of_range_note(spec: &GainCurvesSpec, response: &HeadResponse<'_>) -> Option<String> {
    let outside =
        |fitted: &&FittedPeak| fitted.paper.is_some() && fitted.peak.is_some_and(|p| p.freq_hz > spec.shown_to_hz);
    let axes: Vec<&str> = response.fit.peaks.iter().filter(outside).map(|fitted| axis_label(fitted.axis)).collect();
    (!axes.is_empty()).then(|| {
        format!(
            "{}{}: the peaks of {} are above {} Hz, where the paper's plots end and below which its peaks must be: its linkage was \
             softer in these directions than this model. Damping cannot explain the difference.",
            spec.figure,
            response.design.letter,
            axes.join(" and "),
            spec.shown_to_hz
        )
    })
}

/// One row per axis, and one for the misfit of all peaks.
fn rows(figure: &str, response: &HeadResponse<'_>) -> Vec<ComparedNumber> {
    let figure = format!("{figure}{}", response.design.letter);
    let of_axis = response.fit.peaks.iter().zip(&response.curves).map(|(fitted, curve)| ComparedNumber {
        figure: figure.clone(),
        what: format!("peak gain, {}", axis_label(fitted.axis)),
        paper: fitted.paper.map_or("-".to_owned(), |peak| format!("about {peak}")),
        ours: ours(fitted, curve),
        comparison: fitted.paper.map(|paper| {
            // A curve without a peak has no resonance: its gain counts as 1.
            Comparison::near("", paper, curve.peak.map_or(1.0, |peak| peak.gain))
        }),
    });
    let mut rows: Vec<ComparedNumber> = of_axis.collect();
    rows.extend(response.fit.rms_log_ratio().map(|rms| ComparedNumber {
        figure,
        what: "misfit of all peaks".to_owned(),
        paper: "-".to_owned(),
        ours: format!("{rms:.2} rms of the log ratios (a factor of {:.2})", rms.exp()),
        comparison: None,
    }));
    rows
}

/// Fitted and simulated peak as text.
fn ours(fitted: &FittedPeak, curve: &GainCurve) -> String {
    let peak = |peak: Option<Peak>| match peak {
        Some(peak) => format!("{:.1} at {:.2} Hz", peak.gain, peak.freq_hz),
        None => "no peak".to_owned(),
    };
    let ratio = fitted.log_ratio().map_or(String::new(), |ratio| format!(" ({ratio:+.2})"));
    format!("fitted {}{ratio}; simulated {}", peak(fitted.peak), peak(curve.peak))
}

/// Description of an axis's gain.
fn axis_label(axis: Axis) -> &'static str {
    match axis {
        Axis::X => "acceleration along x",
        Axis::Y => "acceleration along y",
        Axis::Z => "acceleration along z",
        Axis::Roll => "rate about x",
        Axis::Pitch => "rate about y",
        Axis::Yaw => "rate about z",
    }
}
