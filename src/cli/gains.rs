//! `zsim gains`: gain curves of a head.

use super::arguments::{Global, OutArguments};
use super::bars::WorkBar;
use super::limit::fraction;
use super::usage::Usage;
use super::{Completion, output, quantity};
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use zsim_base::files::replace_text;
use zsim_base::files::subfolder;
use zsim_base::random::Seed;
use zsim_dynamics::{AccelerationKind, DampingSpec, HeadModel, load};
use zsim_head::gains::{
    AXES, GainCurve, GainPlan, GainWatch, SwingStudy, axis_name, coherence_figure, csv, document, gain_curves,
    gain_figure, min_coherence, swing_csv, swing_figure, swing_study, with_damping,
};
use zsim_motion::Axis;

/// Measure a head's gain curves: head motion over base motion by frequency, from simulation and in closed form
///
/// The base is excited on one axis at a time, about the foot of the spring, by a periodic multisine; the motion of the
/// head is measured at the IMU. Writes gains.csv, swing.csv with --swing, plots, and report.html, a
/// page with gain and phase of each axis.
#[derive(Args)]
#[command(after_help = "Example:\n  zsim gains --head handheld --out results/gains")]
pub(super) struct Arguments {
    /// The head and its spring, a name under specs/heads/ or a file
    #[arg(long, value_name = "NAME|FILE", default_value = "handheld")]
    head: String,
    #[command(flatten)]
    out: OutArguments,
    /// Maximum frequency: 10Hz, 10
    #[arg(long, value_name = "HZ", default_value = "10Hz", value_parser = quantity::hertz, allow_hyphen_values = true)]
    up_to: f64,
    /// Period of the multisine, s: the line spacing is 2 over it [default: two lines in the narrowest peak]
    #[arg(long, value_name = "TIME", value_parser = quantity::seconds, allow_hyphen_values = true)]
    period: Option<f64>,
    /// RMS angular rate of the base about an axis, degrees/s; along an axis, 0.1 m/s^2 for each degree/s
    #[arg(long, value_name = "DEG/S", default_value = "0.1deg/s", value_parser = quantity::degrees_per_second,
        allow_hyphen_values = true)]
    amplitude: f64,
    /// Quantity compared along x, y and z
    #[arg(long, value_enum, default_value_t = Along::Acceleration)]
    along: Along,
    /// Damping ratio of all modes, instead of that of the head
    #[arg(long, value_name = "RATIO", value_parser = fraction)]
    damping: Option<f64>,
    /// Number of realisations with different phases to average
    #[arg(long, value_name = "N", default_value_t = 4)]
    realisations: usize,
    /// Time step of the simulation, s
    #[arg(long, value_name = "TIME", default_value = "1ms", value_parser = quantity::seconds, allow_hyphen_values = true)]
    step: f64,
    /// Random seed of the phases
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Also measure resonance and gain at these rotation amplitudes of the head, degrees RMS; the base is
    /// excited about x and y, and along x and y
    #[arg(long, value_name = "DEG,...", value_parser = quantity::degrees, value_delimiter = ',', num_args = 0.., default_missing_value = "0.2,2,5,10,15,20")]
    swing: Option<Vec<f64>>,
}

/// The quantity compared along x, y and z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Along {
    /// Acceleration.
    Acceleration,
    /// Specific force, as measured by an accelerometer.
    SpecificForce,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let head = head(arguments)?;
    let plan = plan(arguments)?;
    let bar = WorkBar::new(global, "shaking");
    let curves = gain_curves(
        &head,
        &plan,
        GainWatch { on_progress: &|fraction| bar.set_fraction(fraction), ..GainWatch::silent() },
    )?;
    let swings = arguments.swing.as_ref().map(|degrees| swings(&head, degrees, &plan, &bar)).transpose()?;
    bar.set_phase("plotting");

    let wanted =
        arguments.out.out.clone().unwrap_or_else(|| PathBuf::from(format!("results/gains-{}", name(arguments))));
    let folder = output::folder(&wanted, arguments.out.force)?;
    replace_text(&folder.join("gains.csv"), &csv(&curves))?;
    let plots = subfolder(&folder, "plots")?;
    gain_figure(&curves).save(&plots, "gains")?;
    coherence_figure(&curves).save(&plots, "coherence")?;
    if let Some(swings) = &swings {
        replace_text(&folder.join("swing.csv"), &swing_csv(swings))?;
        swing_figure(swings).save(&plots, "swing")?;
    }
    let swings = swings.unwrap_or_default();
    let document = document(&name(arguments), &head, &curves, &swings)?;
    replace_text(&folder.join("report.html"), &document.html())?;
    drop(bar);
    output::print_result(global, &document.text(), figures(&curves, &swings)?, Some(&folder))
}

/// Name of the head without folder and extension.
fn name(arguments: &Arguments) -> String {
    Path::new(&arguments.head).file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn head(arguments: &Arguments) -> anyhow::Result<HeadModel> {
    let (mut spec, source) = load(&arguments.head)?;
    if let Some(ratio) = arguments.damping {
        if !(ratio.is_finite() && ratio >= 0.0) {
            return Err(Usage(format!("--damping {ratio}: must be at least 0")).into());
        }
        spec = with_damping(&spec, DampingSpec { rocking: ratio, sway: ratio, bounce: ratio, yaw: ratio });
    }
    Ok(HeadModel::new(&spec, &source)?)
}

fn plan(arguments: &Arguments) -> anyhow::Result<GainPlan> {
    let given = [
        ("--up-to", Some(arguments.up_to)),
        ("--period", arguments.period),
        ("--step", Some(arguments.step)),
        ("--amplitude", Some(arguments.amplitude)),
    ];
    for (name, value) in given {
        if let Some(value) = value.filter(|x| !(x.is_finite() && *x > 0.0)) {
            return Err(Usage(format!("{name} {value}: expected a number above 0")).into());
        }
    }
    Ok(GainPlan {
        acceleration: match arguments.along {
            Along::Acceleration => AccelerationKind::Kinematic,
            Along::SpecificForce => AccelerationKind::SpecificForce,
        },
        up_to_hz: arguments.up_to,
        period_s: arguments.period,
        rotation_deg_per_s: arguments.amplitude,
        acceleration_m_per_s2: 0.1 * arguments.amplitude,
        realisations: arguments.realisations,
        step_s: arguments.step,
        seed: Seed(arguments.seed),
        ..GainPlan::default()
    })
}

fn swings(head: &HeadModel, degrees: &[f64], plan: &GainPlan, bar: &WorkBar) -> anyhow::Result<Vec<SwingStudy>> {
    if let Some(invalid) = degrees.iter().find(|x| !(x.is_finite() && **x > 0.0)) {
        return Err(Usage(format!("--swing {invalid}: expected degrees above 0")).into());
    }
    let axes = [Axis::Roll, Axis::Pitch, Axis::X, Axis::Y];
    // Large amplitudes affect mainly the slowest resonance.
    let slowest_hz = head.linear_modes().first().map_or(plan.up_to_hz, |mode| mode.frequency_hz);
    let plan = GainPlan { up_to_hz: plan.up_to_hz.min(3.0 * slowest_hz), ..plan.clone() };
    let study = |(before, axis): (usize, &Axis)| {
        bar.set_task(format!("swinging, {}", zsim_report::quantity_name(axis_name(*axis))));
        let on_progress = |fraction: f64| bar.set_fraction((before as f64 + fraction) / axes.len() as f64);
        Ok(swing_study(head, *axis, degrees, &plan, GainWatch { on_progress: &on_progress, ..GainWatch::silent() })?)
    };
    axes.iter().enumerate().map(study).collect()
}

fn figures(curves: &[GainCurve], swings: &[SwingStudy]) -> anyhow::Result<Value> {
    let axes = AXES.iter().zip(curves).map(|(axis, curve)| {
        json!({ "axis": axis_name(*axis), "peak": curve.peak, "peak_model": curve.peak_model,
            "least_coherence": min_coherence(curve), "swing_rms_deg": curve.swing_rms_deg, "coil_contact": curve.coil_contact })
    });
    Ok(json!({ "axes": axes.collect::<Vec<_>>(), "swing": serde_json::to_value(swings)? }))
}
