//! `zsim spring`: all about a spring, and the search for one.

use super::arguments::{Global, OutArguments};
use super::bars::{WorkBar, end_polling, stop_flag};
use super::{Completion, output, quantity};
use anyhow::Context;
use clap::{Args, Subcommand};
use std::path::{Path, PathBuf};
use zsim_base::files::{replace_bytes, replace_text};
use zsim_base::spec::{Kind, NamedSpec, Source, SpecError, find};
use zsim_dynamics::{self, HeadModel, HeadSpec, LinkageSpec};
use zsim_elasticity::SpringSpec;
use zsim_head::coverage::{CoveragePlan, coverage_figure};
use zsim_head::spring::{HeadExport, Shake, SpringReport, document, mode_figure, spring_report};
use zsim_sensors::{Imu, ImuSpec, Lidar, LidarSpec};
use zsim_study::design::{self, DesignSearch, DesignSpec, csv, pareto_figure, rejected_csv};
use zsim_study::sweep::{Runner, SweepSpec};

/// Report stiffness, rest, modes, field of view and limits of a spring, or another linkage, under its head; or
/// search for one
///
/// FILE is a head, or a spring, which is then put under the head given by --head. That the head falls is an answer.
#[derive(Args)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "Examples:\n  zsim spring handheld --json\n  zsim spring design spring_design --out results/springs"
)]
pub(super) struct Arguments {
    #[command(subcommand)]
    search: Option<Command>,
    /// A head or a spring: a name under specs/heads/ or specs/springs/, or a file
    #[arg(value_name = "FILE", required = true)]
    file: Option<String>,
    /// The head on a spring that is given without one
    #[arg(long, value_name = "NAME|FILE", default_value = "handheld")]
    head: String,
    /// The lidar whose field of view is reported
    #[arg(long, value_name = "NAME|FILE", default_value = "utm30lx")]
    lidar: String,
    /// The IMU whose range is reported
    #[arg(long, value_name = "NAME|FILE", default_value = "3dm_gx2")]
    imu: String,
    /// Amplitude of the hand's nod, degrees
    #[arg(long, value_name = "DEG", default_value = "2deg", value_parser = quantity::degrees, allow_hyphen_values = true)]
    pitch: f64,
    /// Frequency of the hand's nod, Hz [default: the head's slowest mode]
    #[arg(long, value_name = "HZ", value_parser = quantity::hertz, allow_hyphen_values = true)]
    frequency: Option<f64>,
    /// Folder for the page (report.html), plots of the modes and of the lidar coverage, and all figures (spring.json)
    #[command(flatten)]
    out: OutArguments,
}

#[derive(Subcommand)]
enum Command {
    Design(Design),
    Export(Export),
}

/// Write a head and its spring as a robot model: URDF (RViz, Foxglove), SDF (Gazebo) and MJCF (MuJoCo)
///
/// The spring becomes six elastic joints with the modes of the head at rest; URDF has their stiffness as comments. The frames are
/// those of recordings: base, head, laser, imu_link. The wire of the springs at rest is a mesh in the base frame, spring.stl.
#[derive(Args)]
#[command(after_help = "Example:\n  zsim spring export handheld --out results/robot")]
struct Export {
    /// A head or a spring: a name under specs/heads/ or specs/springs/, or a file
    #[arg(value_name = "FILE")]
    file: String,
    /// The head on a spring that is given without one
    #[arg(long, value_name = "NAME|FILE", default_value = "handheld")]
    head: String,
    #[command(flatten)]
    out: OutArguments,
}

/// Search for a spring that meets targets: the Pareto set as table, CSV and plot, verified by simulation
///
/// The journeys of a search are a sweep in DIR/journeys: a second start in the same folder skips finished ones and continues.
#[derive(Args)]
#[command(after_help = "Example:\n  zsim spring design spring_design --out results/springs")]
struct Design {
    /// The design goals, a name under specs/studies/ or a file
    #[arg(value_name = "FILE")]
    file: String,
    #[command(flatten)]
    out: OutArguments,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    match (&arguments.search, &arguments.file) {
        (Some(Command::Design(design)), _) => search(design, global),
        (Some(Command::Export(wanted)), _) => export(wanted, global),
        (None, Some(file)) => print_report(file, arguments, global),
        (None, None) => Err(super::usage::Usage("name a head or a spring".to_owned()).into()),
    }
}

/// Writes `head.urdf`, `head.sdf`, `head.xml`, and `spring.stl` of springs with coils.
fn export(wanted: &Export, global: &Global) -> anyhow::Result<Completion> {
    let Subject { name, spec, source } = head_of(&wanted.file, &wanted.head)?;
    let exported = HeadExport::new(&spec, &HeadModel::new(&spec, &source)?)?;
    let out = wanted.out.out.clone().unwrap_or_else(|| PathBuf::from(format!("results/robot-{name}")));
    let folder = output::folder(&out, wanted.out.force)?;
    let files = [("head.urdf", exported.urdf()), ("head.sdf", exported.sdf()), ("head.xml", exported.mjcf())];
    for (file, text) in &files {
        replace_text(&folder.join(file), text)?;
    }
    let mut names = files.map(|(file, _)| file).to_vec();
    if let Some(mesh) = exported.spring_mesh()? {
        replace_bytes(&folder.join("spring.stl"), &mesh)?;
        names.push("spring.stl");
    }
    output::print_result(global, &names.join("\n"), serde_json::json!({ "files": names }), Some(&folder))?;
    Ok(Completion::Done)
}

fn print_report(file: &str, arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let subject = head_of(file, &arguments.head)?;
    let lidar_source = find(Kind::Lidar, &arguments.lidar)?;
    let lidar = Lidar::new(&LidarSpec::parse(&lidar_source)?, &lidar_source)?;
    let imu_source = find(Kind::Imu, &arguments.imu)?;
    let imu = Imu::new(&ImuSpec::parse(&imu_source)?, &imu_source)?;
    let given = [("--pitch", Some(arguments.pitch)), ("--frequency", arguments.frequency)];
    for (name, value) in given {
        if let Some(value) = value.filter(|x| !(x.is_finite() && *x > 0.0)) {
            return Err(super::usage::Usage(format!("{name} {value}: expected a number above 0")).into());
        }
    }
    let shake = Shake { pitch_deg: arguments.pitch, frequency_hz: arguments.frequency };
    let plan =
        CoveragePlan { from_s: 10.0, rate_limit_deg_per_s: imu.spec().gyro.limit_deg_per_s, ..CoveragePlan::default() };
    let report = spring_report(&subject.spec, &subject.source, &shake, &lidar, &plan)?;
    let head = report.stands.then(|| HeadModel::new(&subject.spec, &subject.source)).transpose()?;
    let document = document(&subject.name, &subject.spec, head.as_ref(), &report)?;
    let folder = match &arguments.out.out {
        None => None,
        Some(wanted) => {
            let folder = output::folder(wanted, arguments.out.force)?;
            write_plots(&folder, &subject.spec, head.as_ref(), &report)?;
            replace_text(&folder.join("report.html"), &document.html())?;
            replace_text(&folder.join("spring.json"), &(serde_json::to_string_pretty(&report)? + "\n"))?;
            Some(folder)
        }
    };
    output::print_result(global, &document.text(), serde_json::to_value(&report)?, folder.as_deref())?;
    Ok(Completion::Done)
}

/// The head of the report.
struct Subject {
    /// Name of the head, or of the spring and the head on it.
    name: String,
    spec: HeadSpec,
    source: Source,
}

fn write_plots(folder: &Path, spec: &HeadSpec, head: Option<&HeadModel>, report: &SpringReport) -> anyhow::Result<()> {
    if let Some(head) = head {
        mode_figure(spec, head).save(folder, "modes")?;
    }
    if let Some(seen) = report.shaken.as_ref().and_then(|shaken| shaken.coverage.as_ref()) {
        coverage_figure(seen).save(folder, "coverage")?;
    }
    Ok(())
}

/// The head in `file`, or `head` on the spring in it.
fn head_of(file: &str, head: &str) -> anyhow::Result<Subject> {
    let stem = |path: &str| Path::new(path).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let as_spring =
        find(Kind::Spring, file).and_then(|source| SpringSpec::parse(&source).map(|spring| (spring, source)));
    match (zsim_dynamics::load(file), as_spring) {
        (Ok((spec, source)), _) => Ok(Subject { name: stem(file), spec, source }),
        (Err(_), Ok((bare, source))) => {
            let (mut spec, _) = zsim_dynamics::load(head)?;
            let LinkageSpec::Spring { spring, .. } = &mut spec.linkage else {
                let message = format!("the head \"{head}\" has no spring to replace; name one that has with --head");
                return Err(SpecError::plain(head, message).into());
            };
            *spring = bare;
            Ok(Subject { name: format!("{} under {}", stem(file), stem(head)), spec, source })
        }
        (Err(as_head), Err(as_spring)) => {
            // The parser that accepted more lines determines the intended kind.
            let is_spring = as_spring.line_and_column() > as_head.line_and_column();
            Err(if is_spring { as_spring } else { as_head }.into())
        }
    }
}

fn search(wanted: &Design, global: &Global) -> anyhow::Result<Completion> {
    let source = find(Kind::Study, &wanted.file)?;
    let spec = DesignSpec::parse(&source).map_err(|error| match SweepSpec::parse(&source) {
        Ok(_) => {
            SpecError::plain(&source.name, format!("it is a sweep, not a spring search: zsim study {}", wanted.file))
        }
        Err(_) => error,
    })?;
    let search = DesignSearch::new(&spec, &source)?;
    let stem = Path::new(&wanted.file).file_stem().unwrap_or_default().to_string_lossy();
    let name = spec.name.as_deref().unwrap_or(&stem);
    let out = wanted.out.out.clone().unwrap_or_else(|| PathBuf::from(format!("results/{name}")));
    let folder = match spec.has_journeys_in(&out) {
        true => output::folder_to_resume(&out)?,
        false => output::folder(&out, wanted.out.force)?,
    };
    let program = std::env::current_exe().context("this program's own path is not known")?;
    let bar = WorkBar::new(global, "searching");
    let on_progress = |fraction: f64| bar.set_fraction(fraction);
    let runner = Runner { program: &program, stop: stop_flag(), on_progress: &on_progress };
    let study = search.run(&folder, wanted.out.force, &runner).inspect_err(|_| {
        if spec.has_journeys_in(&folder) {
            super::full_run::print_partial_results(&folder);
        }
    })?;
    drop(bar);
    end_polling();
    replace_text(&folder.join("pareto.csv"), &csv(&study))?;
    replace_text(&folder.join("rejected.csv"), &rejected_csv(&study))?;
    replace_text(&folder.join("design.ron"), &source.text)?;
    pareto_figure(&study).save(&folder, "pareto")?;
    output::print_result(global, &design::document(&study).text(), serde_json::to_value(&study)?, Some(&folder))?;
    Ok(if study.candidates.is_empty() { Completion::WithLoss } else { Completion::Done })
}
