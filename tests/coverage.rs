//! What lidars see of the sphere, against closed forms.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::f64::consts::{PI, TAU};
use zsim::dynamics::{HeadModel, load};
use zsim::geometry::{Kinematics, Pose, Rotation, Vector};
use zsim::motion::BaseMotion;
use zsim::sensors::Lidar;
use zsim::spec::{Kind, find, parse};
use zsim::study::coverage::{Coverage, CoveragePlan, coverage, coverage_figure, density_csv};

/// A base that turns about its x axis, evenly.
struct Spinner {
    turns_per_s: f64,
}

impl BaseMotion for Spinner {
    fn at(&self, t_s: f64) -> Kinematics {
        let omega = TAU * self.turns_per_s;
        let rotation = Rotation::from_axis_angle(&Vector::x_axis(), omega * t_s);
        let mut base = Kinematics::at_rest(Pose::from_parts(Default::default(), rotation));
        base.angular_velocity_in_world = Vector::x() * omega;
        base
    }
}

fn lidar(name: &str) -> Lidar {
    let source = find(Kind::Lidar, name).unwrap();
    Lidar::new(&parse(&source).unwrap(), &source).unwrap()
}

fn seen(turns_per_s: f64, lidar: &Lidar, plan: &CoveragePlan) -> Coverage {
    let (spec, source) = load("rigid").unwrap();
    let head = HeadModel::new(&spec, &source).unwrap();
    coverage(&head, &Spinner { turns_per_s }, lidar, plan, |_| ()).unwrap()
}

/// Beams per second by the density: its integral over the sphere.
fn flux(seen: &Coverage) -> f64 {
    seen.density_per_sr_s.mean * seen.fraction_seen * 4.0 * PI
}

#[test]
fn a_level_scanner_that_stands_sees_its_arc_and_nothing_else() {
    let lidar = lidar("utm30lx");
    let seen = seen(0.0, &lidar, &CoveragePlan { duration_s: 1.0, ..CoveragePlan::default() });
    // 270 degrees ahead, in the two rows of cells that meet at the horizon.
    for cell in seen.cells.iter().filter(|cell| cell.beams_per_sr_s > 0.0) {
        assert!(cell.elevation_deg.0.abs() < 1e-9 || cell.elevation_deg.1.abs() < 1e-9, "{cell:?}");
        assert!(cell.azimuth_deg.0 <= 135.0 + 1e-9 && cell.azimuth_deg.1 >= -135.0 - 1e-9, "{cell:?}");
    }
    let ahead =
        |cell: &&zsim::study::coverage::CoverageCell| cell.azimuth_deg.0 >= -135.0 && cell.azimuth_deg.1 <= 135.0;
    let rows = 32.0 * seen.cells.iter().filter(ahead).map(|cell| cell.beams_per_sr_s).sum::<f64>()
        / seen.cells.iter().filter(ahead).count() as f64;
    // Each of 1081 beams, 40 times a second, less the two at the ends; a row is 4 pi / 32 sr, of it 3/4 ahead.
    let even = 1081.0 * 40.0 / (0.75 * 4.0 * PI / 32.0);
    assert!((rows / even - 1.0).abs() < 0.003, "{rows} {even}");
    assert!((flux(&seen) / (1081.0 * 40.0) - 1.0).abs() < 1e-9, "{}", flux(&seen));
    assert_eq!((seen.gyro.most_deg_per_s, seen.gyro.saturated, seen.sweep_s), (0.0, 0.0, None));
}

#[test]
fn spun_about_its_middle_ray_a_scanner_of_180_degrees_covers_the_half_sphere() {
    // 0.97 turns a second, so that no two scans of 100 s lie on each other.
    let half = lidar("lms291_0_5deg");
    let plan = CoveragePlan { duration_s: 20.0, ..CoveragePlan::default() };
    let of_half = seen(0.97, &half, &plan);
    // Its two outermost beams lie on the border between cells: at most a column of them more on either side.
    assert!((0.5..0.5 + 2.0 / 64.0 + 1e-9).contains(&of_half.fraction_seen), "{}", of_half.fraction_seen);
    // One of 270 degrees leaves a cone of 45 degrees behind: 1 - (1 - cos 45) / 2 = 0.854, and the cells on its rim.
    let most = seen(0.97, &lidar("utm30lx"), &plan);
    assert!((0.854..0.854 + 0.03).contains(&most.fraction_seen), "{}", most.fraction_seen);
}

#[test]
fn density_about_a_spin_axis_falls_with_the_sine_of_the_angle_to_it() {
    let lidar = lidar("utm30lx");
    let seen = seen(0.97, &lidar, &CoveragePlan { duration_s: 40.0, ..CoveragePlan::default() });
    // Of each scan 1080 / (3/2 pi) beams a radian on either side sweep a ring of 2 pi sin(angle) a radian: to sr and s,
    // 40 * 2 * 229.2 / (2 pi sin).
    let closed = |angle: f64| 40.0 * 1080.0 / (1.5 * PI) / (PI * angle.sin());
    let middle = |ends: (f64, f64)| (0.5 * (ends.0 + ends.1)).to_radians();
    let mut looked_at = 0;
    for cell in &seen.cells {
        let (azimuth, elevation) = (middle(cell.azimuth_deg), middle(cell.elevation_deg));
        let angle = (azimuth.cos() * elevation.cos()).acos();
        // Neither the axis, where a cell is no small one, nor the rim of the blind cone, nor the narrow cells at the
        // poles.
        if (0.6..2.0).contains(&angle) && elevation.abs() < 1.0 {
            assert!((cell.beams_per_sr_s / closed(angle) - 1.0).abs() < 0.1, "{cell:?} {}", closed(angle));
            looked_at += 1;
        }
    }
    assert!(looked_at > 500, "{looked_at}");
    assert!((flux(&seen) / (1081.0 * 40.0) - 1.0).abs() < 1e-3, "{}", flux(&seen));
}

#[test]
fn a_spin_faster_than_the_gyroscope_saturates_it_all_the_time() {
    let lidar = lidar("utm30lx");
    let gyro = |limit: f64| {
        let plan = CoveragePlan { duration_s: 1.0, rate_limit_deg_per_s: limit, ..CoveragePlan::default() };
        seen(0.97, &lidar, &plan).gyro
    };
    let rate = 0.97 * 360.0;
    assert!((gyro(600.0).most_deg_per_s / rate - 1.0).abs() < 1e-3, "{:?}", gyro(600.0));
    assert_eq!((gyro(600.0).saturated, gyro(300.0).saturated), (0.0, 1.0));
}

#[test]
fn a_pattern_that_does_not_repeat_fills_its_band() {
    // -7 to 52 degrees all around: (sin 52 + sin 7) / 2 of the sphere, and the cells on its rims.
    let lidar = lidar("mid360");
    let seen_from = |plan: &CoveragePlan| seen(0.0, &lidar, plan);
    let seen = seen_from(&CoveragePlan { duration_s: 2.0, ..CoveragePlan::default() });
    let band = 0.5 * (52_f64.to_radians().sin() + 7_f64.to_radians().sin());
    assert!((band..band + 2.0 / 32.0).contains(&seen.fraction_seen), "{} {band}", seen.fraction_seen);
    // Scans that lay on each other would leave the unevenness of two for ever; those that fill gaps lose it.
    let uneven = |duration_s: f64| {
        let plan = CoveragePlan { duration_s, ..CoveragePlan::default() };
        let cells = seen_from(&plan).cells;
        let band: Vec<f64> =
            cells.iter().filter(|c| c.elevation_deg.0.abs() < 1e-9).map(|c| c.beams_per_sr_s).collect();
        let (least, most) = band.iter().fold((f64::INFINITY, 0.0), |(a, b), x| (f64::min(a, *x), f64::max(b, *x)));
        (most - least) * band.len() as f64 / band.iter().sum::<f64>()
    };
    assert!(uneven(2.0) < 0.25 * uneven(0.2), "{} {}", uneven(2.0), uneven(0.2));
}

#[test]
fn what_was_seen_is_a_table_and_a_plot() {
    let seen = seen(0.97, &lidar("utm30lx"), &CoveragePlan { duration_s: 1.0, ..CoveragePlan::default() });
    assert_eq!(density_csv(&seen).lines().count(), 1 + 32 * 64);
    let svg = coverage_figure(&seen).svg().unwrap();
    assert!(svg.contains("beams per sr and s") && svg.contains("Bearing"));
}
