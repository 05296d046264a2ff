//! Figure 3: gain curves of several heads.

use super::kept::Kept;
use super::{DesignedSpec, Extent, Finding, Fit, FittedPeak, GainCurvesSpec, Row, fit_damping, gain_plots};
use crate::dynamics::{DampingSpec, HeadModel, HeadSpec, Peak};
use crate::motion::Axis;
use crate::spec::{self, Source};
use crate::study::gains::{AXES, GainCurve, GainPlan, axis_name, csv, gain_curve, with_damping};
use crate::study::watch::PieceProgress;
use crate::study::{OnProgress, StudyError};
use rayon::prelude::*;

/// A head with fitted damping, and how it answers.
pub(super) struct Answer<'a> {
    pub design: &'a DesignedSpec,
    pub fit: Fit,
    pub curves: Vec<GainCurve>,
}

/// Fits the heads, measures their gains, draws, and tells.
pub(super) fn run(
    spec: &GainCurvesSpec,
    heads: &[HeadSpec],
    extent: Extent,
    kept: &Kept,
    on_progress: OnProgress<'_>,
) -> Result<Finding, StudyError> {
    let plan = plan(spec, extent);
    let designs: Vec<(&DesignedSpec, &HeadSpec)> = spec.designs.iter().zip(heads).collect();
    let fitted = designs.par_iter().map(|(design, head)| {
        let source = Source::in_memory(design.head.clone(), "");
        kept.part(&format!("{}-fit", design.letter), || {
            fit_damping(head, &source, &design.peaks, spec.ratios, spec.up_to_hz)
        })
    });
    let fitted: Vec<Fit> = fitted.collect::<Result<_, StudyError>>()?;
    let tasks: Vec<(usize, Axis)> = (0..designs.len()).flat_map(|k| AXES.map(|axis| (k, axis))).collect();
    let pieces = PieceProgress::new(tasks.len() * plan.realisations, on_progress);
    let curves = tasks.par_iter().map(|(k, axis)| {
        let (design, head) = designs[*k];
        let name = format!("{}-{}", design.letter, axis_name(*axis));
        if kept.has(&name) {
            (0..plan.realisations).for_each(|_| pieces.finish_one());
        }
        kept.part(&name, || {
            let head = with_damping(head, fitted[*k].damping_ratio);
            let head = HeadModel::new(&head, &Source::in_memory(design.head.clone(), ""))?;
            gain_curve(&head, *axis, &plan, &|_| pieces.finish_one())
        })
    });
    let curves: Vec<GainCurve> = curves.collect::<Result<_, StudyError>>()?;
    let answers: Vec<Answer<'_>> = designs
        .iter()
        .zip(fitted)
        .zip(curves.chunks(AXES.len()))
        .map(|(((design, _), fit), curves)| Answer { design, fit, curves: curves.to_vec() })
        .collect();
    for (answer, head) in answers.iter().zip(heads) {
        let letter = &answer.design.letter;
        kept.write(&format!("{letter}/gains.csv"), &csv(&answer.curves))?;
        let head = with_damping(head, answer.fit.damping_ratio);
        kept.write(&format!("{letter}/head.ron"), &(spec::to_text(&head)? + "\n"))?;
    }
    gain_plots::gains(&answers, spec.shown_to_hz).save(kept.folder(), "gains")?;
    gain_plots::coherence(&answers, spec.shown_to_hz).save(kept.folder(), "coherence")?;
    Ok(finding(spec, &answers))
}

fn plan(spec: &GainCurvesSpec, extent: Extent) -> GainPlan {
    let whole = GainPlan { up_to_hz: spec.up_to_hz, ..GainPlan::default() };
    match extent {
        Extent::Whole => whole,
        Extent::Quick => GainPlan { realisations: 2, period_s: Some(5.0), longest_settling_s: 2.0, ..whole },
    }
}

fn finding(spec: &GainCurvesSpec, answers: &[Answer<'_>]) -> Finding {
    let rows = answers.iter().flat_map(|answer| rows(&spec.figure, answer)).collect();
    let mut notes = vec![
        "The paper's peaks are read off the scales of its plots. They tell neither which axis of a panel reaches the top nor at \
         which frequency; each axis of a panel is taken to."
            .to_owned(),
        format!(
            "\"Fitted\" is the highest peak of the closed form up to {} Hz, with the damping ratios that bring all peaks \
             nearest to the paper's; \"simulated\" is measured by cross spectra (H1) with the same ratios. In brackets: the \
             logarithm of the fitted peak over the paper's.",
            spec.up_to_hz
        ),
    ];
    notes.extend(answers.iter().map(|answer| {
        let DampingSpec { rocking, sway, bounce, yaw } = answer.fit.damping_ratio;
        format!(
            "{}{}, {} (head `{}`): damping ratios rocking {rocking:.4}, sway {sway:.4}, bounce {bounce:.4}, yaw {yaw:.4}.",
            spec.figure, answer.design.letter, answer.design.title, answer.design.head
        )
    }));
    notes.extend(answers.iter().filter_map(|answer| beyond(spec, answer)));
    Finding { rows, notes }
}

/// What to say of peaks that the paper's plot would not have shown.
fn beyond(spec: &GainCurvesSpec, answer: &Answer<'_>) -> Option<String> {
    let outside =
        |fitted: &&FittedPeak| fitted.paper.is_some() && fitted.peak.is_some_and(|p| p.freq_hz > spec.shown_to_hz);
    let axes: Vec<&str> = answer.fit.peaks.iter().filter(outside).map(|fitted| words_for(fitted.axis)).collect();
    (!axes.is_empty()).then(|| {
        format!(
            "{}{}: the peaks of {} lie above the {} Hz at which the paper's plots end, below which its own must lie: its linkage \
             was softer there than ours. No damping changes that.",
            spec.figure,
            answer.design.letter,
            axes.join(" and "),
            spec.shown_to_hz
        )
    })
}

/// A row an axis, and one for the misfit of all.
fn rows(figure: &str, answer: &Answer<'_>) -> Vec<Row> {
    let figure = format!("{figure}{}", answer.design.letter);
    let of_axis = answer.fit.peaks.iter().zip(&answer.curves).map(|(fitted, curve)| Row {
        figure: figure.clone(),
        what: format!("peak gain, {}", words_for(fitted.axis)),
        paper: fitted.paper.map_or("-".to_owned(), |peak| format!("about {peak}")),
        ours: ours(fitted, curve),
    });
    let mut rows: Vec<Row> = of_axis.collect();
    rows.extend(answer.fit.rms_log_ratio().map(|rms| Row {
        figure,
        what: "misfit of all peaks".to_owned(),
        paper: "-".to_owned(),
        ours: format!("{rms:.2} rms of the logarithms (a factor of {:.2})", rms.exp()),
    }));
    rows
}

fn ours(fitted: &FittedPeak, curve: &GainCurve) -> String {
    let peak = |peak: Option<Peak>| match peak {
        Some(peak) => format!("{:.1} at {:.2} Hz", peak.gain, peak.freq_hz),
        None => "no peak".to_owned(),
    };
    let ratio = fitted.log_ratio().map_or(String::new(), |ratio| format!(" ({ratio:+.2})"));
    format!("fitted {}{ratio}; simulated {}", peak(fitted.peak), peak(curve.peak))
}

fn words_for(axis: Axis) -> &'static str {
    match axis {
        Axis::X => "acceleration along x",
        Axis::Y => "acceleration along y",
        Axis::Z => "acceleration along z",
        Axis::Roll => "rate about x",
        Axis::Pitch => "rate about y",
        Axis::Yaw => "rate about z",
    }
}
