//! `zsim coverage`: the part of the sphere that a lidar on a moving head observes.

use super::arguments::{Global, OutArguments};
use super::bars::WorkBar;
use super::{Completion, output, quantity};
use clap::Args;
use std::path::Path;
use zsim_base::files::replace_text;
use zsim_base::random::Seed;
use zsim_base::spec::{Kind, NamedSpec, find};
use zsim_dynamics::{self, ContactWatch, HeadModel, HeadState};
use zsim_head::coverage::{Coverage, CoveragePlan, coverage, coverage_figure, density_csv, document, over_time_csv};
use zsim_sensors::{Imu, ImuSpec, Lidar, LidarSpec};

/// Compute the coverage of the sphere by a lidar on a moving head: fraction, density and time, and the required gyroscope
/// range
///
/// No scene is needed: the directions of the beams are relative to the heading of the base. Walking motions go around a
/// hall of 20 m by 10 m. With --out, writes coverage.csv (by time), density.csv (by direction), and a plot.
#[derive(Args)]
#[command(after_help = "Example:\n  zsim coverage --head handheld --motion hand --duration 30s --out results/coverage")]
pub(super) struct Arguments {
    /// The head and its spring, a name under specs/heads/ or a file
    #[arg(long, value_name = "NAME|FILE", default_value = "handheld")]
    head: String,
    /// Motion of the base, a name under specs/motions/ or a file
    #[arg(long, value_name = "NAME|FILE", default_value = "hand")]
    motion: String,
    /// The lidar, a name under specs/lidars/ or a file
    #[arg(long, value_name = "NAME|FILE", default_value = "utm30lx")]
    lidar: String,
    /// The IMU with the gyroscope range for comparison, a name under specs/imus/ or a file
    #[arg(long, value_name = "NAME|FILE", default_value = "3dm_gx2")]
    imu: String,
    /// Duration of the observation: 30s, 2min, 90
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = quantity::seconds, allow_hyphen_values = true)]
    duration: f64,
    /// Start of the observation; motions/hand.ron rests until then
    #[arg(long, value_name = "TIME", default_value = "5s", value_parser = quantity::seconds_from_zero, allow_hyphen_values = true)]
    from: f64,
    /// Random seed of the motion
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    out: OutArguments,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let (head, head_source) = zsim_dynamics::load(&arguments.head)?;
    let head = HeadModel::new(&head, &head_source)?;
    let lidar_source = find(Kind::Lidar, &arguments.lidar)?;
    let lidar = Lidar::new(&LidarSpec::parse(&lidar_source)?, &lidar_source)?;
    let imu_source = find(Kind::Imu, &arguments.imu)?;
    let imu = Imu::new(&ImuSpec::parse(&imu_source)?, &imu_source)?;
    let (motion, motion_source) = zsim_motion::load(&arguments.motion)?;
    let until_s = arguments.from + arguments.duration;
    let motion = motion.build(&motion_source, Some(&zsim_motion::any_route()), until_s, Seed(arguments.seed))?;
    let plan = CoveragePlan {
        from_s: arguments.from,
        duration_s: arguments.duration,
        rate_limit_deg_per_s: imu.spec().gyro.limit_deg_per_s,
        ..CoveragePlan::default()
    };
    let bar = WorkBar::new(global, "swinging");
    let mut contact = ContactWatch::new(&head);
    let mut watch = |state: &HeadState| {
        bar.set_fraction(state.t_s / until_s);
        contact.check(state.t_s, &state.base, &state.head);
    };
    let seen = coverage(&head, motion.as_ref(), &lidar, &plan, &mut watch)?;
    bar.set_phase("plotting");
    let folder =
        arguments.out.out.as_ref().map(|wanted| write_results(&seen, wanted, arguments.out.force)).transpose()?;
    contact.contact().iter().for_each(|contact| bar.note(&contact.warning()));
    drop(bar);
    output::print_result(global, &document(&seen).text(), serde_json::to_value(&seen)?, folder.as_deref())
}

fn write_results(seen: &Coverage, wanted: &Path, force: bool) -> anyhow::Result<output::Folder> {
    let folder = output::folder(wanted, force)?;
    for (name, text) in [("coverage.csv", over_time_csv(seen)), ("density.csv", density_csv(seen))] {
        replace_text(&folder.join(name), &text)?;
    }
    coverage_figure(seen).save(&folder, "coverage")?;
    Ok(folder)
}
