//! `zsim bound`: how accurate an estimate of a recording could be.

use super::arguments::Global;
use super::bars::{Bars, stop_flag};
use super::usage::Usage;
use super::{Completion, output};
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use zsim_base::files::replace_text;
use zsim_evaluation::MapKnowledge;
use zsim_recording::Reader;
use zsim_run::{Manifest, ProgressMonitor, RecordingBound, information_bound};
use zsim_world::World;

/// Compute the Cramer-Rao bound of a recording: the accuracy that no estimator can exceed
///
/// The bound includes each beam on a surface of the scene, with noise and incidence, and the IMU, with noise, biases,
/// scale errors and clock offset. With --map known the surfaces are known: the bound of localisation. With --map unknown
/// each plane of the scene is an unknown of three parameters: the bound of SLAM, for recordings of up to 300 s. The
/// recording must have the truth. With --out, writes bound.csv (by time) and a plot.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The recording
    #[arg(value_name = "FILE.mcap")]
    recording: PathBuf,
    /// The scene, a name under scenes/ or a file [default: that in the recording's manifest]
    #[arg(long, value_name = "NAME|FILE")]
    scene: Option<String>,
    /// What is known of the surfaces before the run
    #[arg(long, value_enum, default_value_t = Map::Known)]
    map: Map,
    /// Folder for results; if it exists and is not empty, a number is appended to the name [default: none is
    /// written]
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write into the folder even if it exists
    #[arg(long)]
    force: bool,
}

const EXAMPLES: &str = "Examples:\n  zsim bound run.mcap --scene office.ron --out results/bound
  zsim bound run.mcap --map unknown    # the bound of SLAM";

/// What to say if some beams are not on joint planes.
const CAVEAT: &str = "The other beams are on small planes, of which there are too many: each counts as a\n\
    new one every 2 s, so the bound is somewhat too high.\n";

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Map {
    /// All surfaces, exactly: the bound of localisation
    Known,
    /// Nothing: the bound of SLAM
    Unknown,
}

impl From<Map> for MapKnowledge {
    fn from(map: Map) -> Self {
        match map {
            Map::Known => Self::Known,
            Map::Unknown => Self::Unknown,
        }
    }
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let reader = Reader::open(&arguments.recording)?;
    let world = world(arguments, &reader)?;
    let mut bars = Bars::new(global);
    let mut watch = ProgressMonitor { stop: stop_flag(), report: &mut |event| bars.update(event) };
    let bounded = information_bound(&reader, &world, arguments.map.into(), &mut watch);
    bars.finish();
    let bounded = bounded?;
    let folder = arguments.out.as_ref().map(|wanted| write_results(&bounded, wanted, arguments)).transpose()?;
    output::print_result(global, &text(&bounded), figures(&bounded, world.name()), folder.as_deref())
}

fn world(arguments: &Arguments, reader: &Reader) -> anyhow::Result<World> {
    if let Some(scene) = &arguments.scene {
        return Ok(World::load(scene)?);
    }
    let Some(world) = Manifest::in_recording(reader)?.and_then(|manifest| manifest.world()) else {
        let message = format!("{} has no scene: pass one with --scene", reader.name());
        return Err(Usage(message).into());
    };
    Ok(world?)
}

fn write_results(bounded: &RecordingBound, wanted: &Path, arguments: &Arguments) -> anyhow::Result<output::Folder> {
    let folder = output::folder(wanted, arguments.force)?;
    let written = ["bound.csv", "bound.svg", "bound.png"].map(|name| folder.join(name));
    output::check_not_inputs([&arguments.recording], written)?;
    replace_text(&folder.join("bound.csv"), &csv(bounded))?;
    zsim_report::bound_over_time(&bounded.bound).save(&folder, "bound")?;
    Ok(folder)
}

/// Standard deviations by time: along and about each axis of the world.
fn csv(bounded: &RecordingBound) -> String {
    let bound = &bounded.bound;
    let mut text = "stamp_ns,x_m,y_m,z_m,about_x_rad,about_y_rad,about_z_rad\n".to_owned();
    for ((stamp, position), attitude) in bound.stamps.iter().zip(&bound.position_sigma_m).zip(&bound.attitude_sigma_rad)
    {
        let numbers = position.iter().chain(attitude.iter()).map(|sigma| format!("{sigma:e}"));
        text += &format!("{},{}\n", stamp.nanos(), numbers.collect::<Vec<_>>().join(","));
    }
    text
}

fn text(bounded: &RecordingBound) -> String {
    let bound = &bounded.bound;
    let mm = |m: f64| format!("{:.3} mm", m * 1e3);
    let axes = bound.axis_rmse_m;
    let mut rows = vec![("position RMSE, aligned", mm(bound.aligned_position_rmse_m))];
    // With an unknown map, all errors are after the alignment.
    let attitude = if bound.unknown_map.is_some() {
        "attitude RMSE, aligned"
    } else {
        rows.push(("position RMSE, in the world", mm(bound.position_rmse_m)));
        "attitude RMSE, in the world"
    };
    rows.extend([
        ("along x, y, z", format!("{}, {}, {}", mm(axes.x), mm(axes.y), mm(axes.z))),
        (attitude, format!("{:.4} deg", bound.attitude_rmse_rad.to_degrees())),
        ("clock offset at the end", format!("{:.3} us", bound.clock_offset_s * 1e6)),
        ("range offset", mm(bound.range_offset_m)),
        ("beams", format!("{} ({} skipped)", bounded.beams, bounded.rejected)),
    ]);
    if let Some(map) = &bound.unknown_map {
        rows.push(("unknown planes", map.planes.to_string()));
        rows.push(("beams on joint planes", format!("{:.1} %", 1e2 * map.joint_beam_fraction)));
    }
    let divided = bound.unknown_map.as_ref().is_some_and(|map| map.joint_beam_fraction < 1.0);
    let caveat = if divided { CAVEAT } else { "" };
    format!("No unbiased estimate can be better than:\n{}{caveat}", zsim_report::Table::facts(rows).text())
}

fn figures(bounded: &RecordingBound, scene: &str) -> Value {
    let bound = &bounded.bound;
    let map = bound.unknown_map.as_ref();
    json!({
        "scene": scene,
        "map": if map.is_some() { "unknown" } else { "known" },
        "bound_rmse_m": bound.aligned_position_rmse_m,
        "position_rmse_m": bound.position_rmse_m,
        "axis_rmse_m": bound.axis_rmse_m.as_slice(),
        "attitude_rmse_deg": bound.attitude_rmse_rad.to_degrees(),
        "clock_offset_s": bound.clock_offset_s,
        "range_offset_m": bound.range_offset_m,
        "beams": bounded.beams,
        "left_out": bounded.rejected,
        "planes": map.map(|map| map.planes),
        "joint_beam_fraction": map.map(|map| map.joint_beam_fraction),
    })
}
