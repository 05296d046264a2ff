//! Coverage of the sphere by lidars, compared with closed forms.

use std::f64::consts::{PI, TAU};
use zsim::dynamics::{HeadModel, load};
use zsim::geometry::{Kinematics, Pose, Rotation, Vector};
use zsim::head::coverage::{Coverage, CoveragePlan, coverage, coverage_figure, density_csv};
use zsim::motion::BaseMotion;
use zsim::sensors::Lidar;
use zsim::spec::{Kind, find, parse};

/// A base that rotates about its x axis at a constant rate.
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

fn coverage_of(turns_per_s: f64, lidar: &Lidar, plan: &CoveragePlan) -> Coverage {
    let (spec, source) = load("rigid").unwrap();
    let head = HeadModel::new(&spec, &source).unwrap();
    coverage(&head, &Spinner { turns_per_s }, lidar, plan, |_| ()).unwrap()
}

/// Beams per second: the integral of the density over the sphere.
fn flux(coverage: &Coverage) -> f64 {
    coverage.density_per_sr_s.mean * coverage.fraction_seen * 4.0 * PI
}

#[test]
fn a_level_scanner_at_rest_covers_only_its_arc() {
    let lidar = lidar("utm30lx");
    let coverage = coverage_of(0.0, &lidar, &CoveragePlan { duration_s: 1.0, ..CoveragePlan::default() });
    // 270 degrees ahead, in the two rows of cells at the horizon.
    for cell in coverage.cells.iter().filter(|cell| cell.beams_per_sr_s > 0.0) {
        assert!(cell.elevation_deg.0.abs() < 1e-9 || cell.elevation_deg.1.abs() < 1e-9, "{cell:?}");
        assert!(cell.azimuth_deg.0 <= 135.0 + 1e-9 && cell.azimuth_deg.1 >= -135.0 - 1e-9, "{cell:?}");
    }
    let ahead =
        |cell: &&zsim::head::coverage::CoverageCell| cell.azimuth_deg.0 >= -135.0 && cell.azimuth_deg.1 <= 135.0;
    let rows = 32.0 * coverage.cells.iter().filter(ahead).map(|cell| cell.beams_per_sr_s).sum::<f64>()
        / coverage.cells.iter().filter(ahead).count() as f64;
    // 1081 beams less the two at the ends, 40 times a second. A row is 4 pi / 32 sr, and 3/4 of it is ahead.
    let even = 1081.0 * 40.0 / (0.75 * 4.0 * PI / 32.0);
    assert!((rows / even - 1.0).abs() < 0.003, "{rows} {even}");
    assert!((flux(&coverage) / (1081.0 * 40.0) - 1.0).abs() < 1e-9, "{}", flux(&coverage));
    assert_eq!((coverage.gyro.most_deg_per_s, coverage.gyro.saturated, coverage.sweep_s), (0.0, 0.0, None));
}

#[test]
fn a_180_degree_scanner_spun_about_its_middle_ray_covers_a_hemisphere() {
    // 0.97 revolutions/s, so that no two scans of 100 s coincide.
    let half = lidar("lms291_0_5deg");
    let plan = CoveragePlan { duration_s: 20.0, ..CoveragePlan::default() };
    let of_half = coverage_of(0.97, &half, &plan);
    // The two outermost beams are on the border between cells: at most one more column of cells on either side.
    assert!((0.5..0.5 + 2.0 / 64.0 + 1e-9).contains(&of_half.fraction_seen), "{}", of_half.fraction_seen);
    // A 270-degree scanner does not cover a rear cone of 45 degrees: 1 - (1 - cos 45) / 2 = 0.854, plus cells on its rim.
    let most = coverage_of(0.97, &lidar("utm30lx"), &plan);
    assert!((0.854..0.854 + 0.03).contains(&most.fraction_seen), "{}", most.fraction_seen);
}

#[test]
fn the_coverage_of_a_second_is_that_of_its_part_of_a_turn() {
    // A quarter of a turn in a second is half of the hemisphere that half a turn covers, plus the cells on its border.
    let plan = CoveragePlan { duration_s: 8.0, ..CoveragePlan::default() };
    let quarter = coverage_of(0.25, &lidar("lms291_0_5deg"), &plan).fraction_in_1s.unwrap();
    assert!((0.25..0.25 + 0.05).contains(&quarter), "{quarter}");
    // At rest each second observes the same.
    let at_rest = coverage_of(0.0, &lidar("utm30lx"), &plan);
    assert_eq!(at_rest.fraction_in_1s, Some(at_rest.fraction_seen));
    let short = CoveragePlan { duration_s: 0.9, ..CoveragePlan::default() };
    assert_eq!(coverage_of(0.25, &lidar("utm30lx"), &short).fraction_in_1s, None);
}

#[test]
fn beam_density_is_inverse_to_the_sine_of_the_angle_from_the_spin_axis() {
    let lidar = lidar("utm30lx");
    let coverage = coverage_of(0.97, &lidar, &CoveragePlan { duration_s: 40.0, ..CoveragePlan::default() });
    // A scan has 1080 / (3/2 pi) = 229.2 beams/rad on either side, over a ring of 2 pi sin(angle) sr/rad. The density is
    // 40 * 2 * 229.2 / (2 pi sin(angle)) beams/(sr s).
    let closed = |angle: f64| 40.0 * 1080.0 / (1.5 * PI) / (PI * angle.sin());
    let middle = |ends: (f64, f64)| (0.5 * (ends.0 + ends.1)).to_radians();
    let mut looked_at = 0;
    for cell in &coverage.cells {
        let (azimuth, elevation) = (middle(cell.azimuth_deg), middle(cell.elevation_deg));
        let angle = (azimuth.cos() * elevation.cos()).acos();
        // Excludes the axis, where the density varies within a cell, the rim of the blind cone, and the narrow cells at
        // the poles.
        if (0.6..2.0).contains(&angle) && elevation.abs() < 1.0 {
            assert!((cell.beams_per_sr_s / closed(angle) - 1.0).abs() < 0.1, "{cell:?} {}", closed(angle));
            looked_at += 1;
        }
    }
    assert!(looked_at > 500, "{looked_at}");
    assert!((flux(&coverage) / (1081.0 * 40.0) - 1.0).abs() < 1e-3, "{}", flux(&coverage));
}

#[test]
fn a_spin_faster_than_the_gyroscope_saturates_it_all_the_time() {
    let lidar = lidar("utm30lx");
    let gyro = |limit: f64| {
        let plan = CoveragePlan { duration_s: 1.0, rate_limit_deg_per_s: limit, ..CoveragePlan::default() };
        coverage_of(0.97, &lidar, &plan).gyro
    };
    let rate = 0.97 * 360.0;
    assert!((gyro(600.0).most_deg_per_s / rate - 1.0).abs() < 1e-3, "{:?}", gyro(600.0));
    assert_eq!((gyro(600.0).saturated, gyro(300.0).saturated), (0.0, 1.0));
}

#[test]
fn a_pattern_that_does_not_repeat_fills_its_band() {
    // -7 to 52 degrees all around: (sin 52 + sin 7) / 2 of the sphere, plus cells on the rims.
    let lidar = lidar("mid360");
    let coverage_over = |plan: &CoveragePlan| coverage_of(0.0, &lidar, plan);
    let coverage = coverage_over(&CoveragePlan { duration_s: 2.0, ..CoveragePlan::default() });
    let band = 0.5 * (52_f64.to_radians().sin() + 7_f64.to_radians().sin());
    assert!((band..band + 2.0 / 32.0).contains(&coverage.fraction_seen), "{} {band}", coverage.fraction_seen);
    // Repeated scans would keep the unevenness of two scans; scans that fill the gaps reduce it.
    let uneven = |duration_s: f64| {
        let plan = CoveragePlan { duration_s, ..CoveragePlan::default() };
        let cells = coverage_over(&plan).cells;
        let band: Vec<f64> =
            cells.iter().filter(|c| c.elevation_deg.0.abs() < 1e-9).map(|c| c.beams_per_sr_s).collect();
        let (least, most) = band.iter().fold((f64::INFINITY, 0.0), |(a, b), x| (f64::min(a, *x), f64::max(b, *x)));
        (most - least) * band.len() as f64 / band.iter().sum::<f64>()
    };
    assert!(uneven(2.0) < 0.25 * uneven(0.2), "{} {}", uneven(2.0), uneven(0.2));
}

#[test]
fn coverage_is_written_as_a_table_and_a_plot() {
    let coverage = coverage_of(0.97, &lidar("utm30lx"), &CoveragePlan { duration_s: 1.0, ..CoveragePlan::default() });
    assert_eq!(density_csv(&coverage).lines().count(), 1 + 32 * 64);
    let svg = coverage_figure(&coverage).svg().unwrap();
    assert!(svg.contains("Beam density (1/sr/s)") && svg.contains("Bearing"));
}
