//! Lidar measurements compared with closed-form worlds, and lidar errors compared with the spec.

use approx::assert_relative_eq;
use std::f64::consts::PI;
use zsim::geometry::{Kinematics, Pose, Trajectory, Vector, from_roll_pitch_yaw};
use zsim::measurement::LidarScan;
use zsim::random::Seed;
use zsim::sensors::{BeamModel, Lidar, LidarErrors, LidarSpec, ScanTiming, Scenery, SurfaceHit, Switch, Track};
use zsim::spec::{self, Kind, Source};
use zsim::time::Stamp;
use zsim::world::World;

fn spec_of(name: &str) -> LidarSpec {
    spec::load(name).unwrap()
}

fn lidar(spec: &LidarSpec) -> Lidar {
    Lidar::new(spec, &Source::in_memory("test.ron", "")).unwrap()
}

/// The inside of a sphere around the world origin.
struct Globe {
    radius_m: f64,
    reflectance: f32,
}

impl Scenery for Globe {
    fn first_hit(&self, origin: &Vector, direction: &Vector, reach_m: f64, _t_s: f64) -> Option<SurfaceHit> {
        // |o + s d| = R: s = -o.d + sqrt((o.d)^2 + R^2 - o.o).
        let along = origin.dot(direction);
        let range_m = -along + (along * along + self.radius_m.powi(2) - origin.norm_squared()).sqrt();
        let normal = (origin + direction * range_m) / self.radius_m;
        let cos_incidence = normal.dot(direction).abs() as f32;
        let hit = SurfaceHit { range_m, cos_incidence, reflectance: self.reflectance, transmission: 0.0 };
        (range_m <= reach_m).then_some(hit)
    }
}

/// Planes normal to the x axis in front of the origin; each may end at a y on its left.
struct Walls(Vec<Wall>);

struct Wall {
    x_m: f64,
    ends_at_y_m: f64,
    transmission: f32,
}

impl Scenery for Walls {
    fn first_hit(&self, origin: &Vector, direction: &Vector, reach_m: f64, _t_s: f64) -> Option<SurfaceHit> {
        let hit_of = |wall: &Wall| {
            let range_m = (wall.x_m - origin.x) / direction.x;
            let seen = range_m > 0.0 && range_m <= reach_m && origin.y + direction.y * range_m < wall.ends_at_y_m;
            let cos_incidence = direction.x.abs() as f32;
            seen.then_some(SurfaceHit { range_m, cos_incidence, reflectance: 0.5, transmission: wall.transmission })
        };
        self.0.iter().filter_map(hit_of).min_by(|a, b| a.range_m.total_cmp(&b.range_m))
    }
}

fn wall(x_m: f64) -> Wall {
    Wall { x_m, ends_at_y_m: f64::INFINITY, transmission: 0.0 }
}

fn pane(x_m: f64) -> Wall {
    Wall { transmission: 0.96, ..wall(x_m) }
}

fn resting() -> Track {
    Track::new(0, 1e-3, vec![Kinematics::at_rest(Pose::identity()); 101]).unwrap()
}

fn firing(index: u64) -> ScanTiming {
    ScanTiming { index, start_s: 0.0, pace: 1.0, stamp: Stamp::from_nanos(1_000_000_000) }
}

/// Scan `index` of a lidar at rest at the origin.
fn scan(spec: &LidarSpec, scenery: &dyn Scenery, seed: u64, index: u64) -> LidarScan {
    let lidar = lidar(spec);
    lidar.measure(&lidar.sweep(scenery, &resting(), &firing(index)), &LidarErrors::new(&lidar, Seed(seed)))
}

fn mean_and_sigma(x: &[f64]) -> (f64, f64) {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    (mean, (x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (x.len() - 1) as f64).sqrt())
}

#[test]
fn every_shipped_lidar_loads() {
    let names = spec::names(Kind::Lidar);
    assert!(names.len() >= 4, "{names:?}");
    for name in names {
        lidar(&spec_of(&name));
    }
}

/// A head that nods by 45 degrees at 1.5 Hz and sways, in closed form.
fn nodding(t: f64) -> Kinematics {
    let w = 3.0 * PI;
    let (sin, cos) = (w * t).sin_cos();
    Kinematics {
        world_from_body: Pose::from_parts(
            Vector::new(0.1 * sin, 0.5 * t, 0.0).into(),
            from_roll_pitch_yaw(0.0, 0.25 * PI * sin, 0.0),
        ),
        velocity_in_world: Vector::new(0.1 * w * cos, 0.5, 0.0),
        angular_velocity_in_world: Vector::y() * (0.25 * PI * w * cos),
        acceleration_in_world: Vector::new(-0.1 * w * w * sin, 0.0, 0.0),
        angular_acceleration_in_world: Vector::y() * (-0.25 * PI * w * w * sin),
    }
}

#[test]
fn beams_projected_by_poses_at_1_khz_lie_on_the_surface() {
    // Linear interpolation of the ground truth: the error in a nod is A w^2 h^2 / 8 = 9 urad, 0.1 mm at 10 m.
    let track = Track::new(0, 1e-3, (0..200).map(|k| nodding(f64::from(k) * 1e-3)).collect()).unwrap();
    let stamped = (0..200).map(|k| (Stamp::from_nanos(k * 1_000_000), nodding(k as f64 * 1e-3).world_from_body));
    let truth = Trajectory::from_poses(stamped).unwrap();
    let globe = Globe { radius_m: 10.0, reflectance: 0.5 };
    let firing = ScanTiming { index: 3, start_s: 0.0751, pace: 1.0, stamp: Stamp::from_nanos(75_100_000) };
    for (name, beams) in [("utm30lx_exact", 1081), ("lms291_0_25deg", 721), ("vlp16", 28_928), ("mid360", 20_000)] {
        let mut spec = spec_of(name);
        (spec.noise, spec.beam) = (Switch::Off, BeamModel::Single);
        let lidar = lidar(&spec);
        let scan = lidar.measure(&lidar.sweep(&globe, &track, &firing), &LidarErrors::new(&lidar, Seed(1)));
        assert_eq!(scan.returns.len(), beams);
        for beam in &scan.returns {
            let world_from_laser = truth.at(scan.stamp + beam.offset).unwrap();
            let point = world_from_laser * nalgebra::Point3::from(beam.point_in_laser.cast::<f64>());
            assert!((point.coords.norm() - 10.0).abs() < 2e-4, "{name}: {}", point.coords.norm());
        }
    }
}

#[test]
fn a_sweep_hits_the_same_surfaces_as_single_rays() {
    // A sweep searches rays in groups; the office has edges, glass and open doors. On the common edge of two faces of one
    // plane either can be found, and their planes, computed from other corners, differ in the last bits of 5 m: 1e-15.
    let office = World::load("office").unwrap();
    let mut spec = spec_of("utm30lx");
    spec.range_max_m = 12.0;
    let lidar = lidar(&spec);
    let at = |x: f64, y: f64, pitch: f64| {
        Pose::from_parts(Vector::new(x, y, 1.2).into(), from_roll_pitch_yaw(0.1, pitch, x + y))
    };
    let mut met = 0;
    for k in 0..60 {
        let (x, y) = (1.0 + 0.3 * f64::from(k), 1.0 + 0.17 * f64::from(k));
        let pose = at(x, y, 0.7 * f64::from(k).sin());
        let track = Track::new(0, 1e-3, vec![Kinematics::at_rest(pose); 101]).unwrap();
        let sweep = lidar.sweep(&office, &track, &firing(0));
        for (ray, beam) in lidar.beams().iter().enumerate() {
            let world_from_laser = track.pose(beam.offset_s);
            let direction = world_from_laser.rotation * beam.direction_in_laser;
            let alone = office.first_hit(&world_from_laser.translation.vector, &direction, 12.0, beam.offset_s);
            let first = sweep.surfaces(ray).first();
            let same_range = |hit: &SurfaceHit| alone.map(|alone| SurfaceHit { range_m: hit.range_m, ..alone });
            assert_eq!(first.copied(), first.and_then(same_range).or(alone), "{k}: ray {ray}");
            let difference_m = first.zip(alone).map_or(0.0, |(first, alone)| (first.range_m - alone.range_m).abs());
            assert!(difference_m < 1e-12, "{k}: ray {ray} differs by {difference_m} m");
            met += usize::from(alone.is_some());
        }
    }
    assert!((1..60 * lidar.beams().len()).contains(&met), "some rays must hit nothing within range: {met}");
}

#[test]
fn the_polar_form_agrees_with_the_points() {
    let scan = scan(&spec_of("utm30lx"), &Globe { radius_m: 4.0, reflectance: 0.5 }, 1, 0);
    let planar = scan.planar.unwrap();
    assert_eq!((planar.ranges_m.len(), planar.intensities.len()), (1081, 1081));
    for (k, beam) in scan.returns.iter().enumerate() {
        let angle = planar.angle_min_rad + k as f64 * planar.angle_increment_rad;
        let range = f64::from(planar.ranges_m[k]);
        let point = Vector::new(angle.cos(), angle.sin(), 0.0) * range;
        assert_relative_eq!(beam.point_in_laser.cast::<f64>(), point, epsilon = 1e-6);
        assert!((beam.offset.seconds() - k as f64 * planar.time_increment_s).abs() < 1e-9);
        assert_eq!(beam.intensity, planar.intensities[k]);
        let millimetres = range * 1e3;
        assert!((millimetres - millimetres.round()).abs() < 1e-3, "rounded to 1 mm: {range}");
    }
}

#[test]
fn range_noise_is_10_mm_close_up_and_20_mm_at_20_m_with_a_common_bias() {
    for (radius_m, sigma_m) in [(5.0, 0.010), (20.0, 0.020)] {
        let spec = spec_of("utm30lx");
        let lidar = lidar(&spec);
        let (globe, errors) = (Globe { radius_m, reflectance: 0.9 }, LidarErrors::new(&lidar, Seed(11)));
        let ranges: Vec<f64> = (0..20)
            .flat_map(|k| lidar.measure(&lidar.sweep(&globe, &resting(), &firing(k)), &errors).planar.unwrap().ranges_m)
            .filter(|range| range.is_finite())
            .map(|range| f64::from(range) - radius_m)
            .collect();
        let (mean, sigma) = mean_and_sigma(&ranges);
        // Weak returns are late by 10 mm times the ratio of half power to power: (0.9 / 60^2) / (0.9 / r^2) = (r / 60)^2.
        let late = 0.010 * (radius_m / 60.0).powi(2);
        // 21,620 ranges: standard errors of 0.7 % and 0.5 % of sigma. Rounding to 1 mm adds 0.3 mm in quadrature.
        assert!((mean - errors.bias_m() - late).abs() < 3.5 * 0.007 * sigma_m, "{mean}");
        assert!((sigma / sigma_m - 1.0).abs() < 0.02, "{sigma}");
    }
}

#[test]
fn the_range_bias_has_a_standard_deviation_of_5_mm_over_runs() {
    let lidar = lidar(&spec_of("utm30lx"));
    let biases: Vec<f64> = (0..4000).map(|seed| LidarErrors::new(&lidar, Seed(seed)).bias_m()).collect();
    let (mean, sigma) = mean_and_sigma(&biases);
    assert!(mean.abs() < 4.0 * 0.005 / 63.0 && (sigma / 0.005 - 1.0).abs() < 0.045, "{mean} {sigma}");
}

#[test]
fn half_of_the_returns_at_the_threshold_are_missed_and_no_strong_ones() {
    // Power at the threshold: 0.9 / 60^2 = reflectance / r^2, so at 20 m a reflectance of 0.1.
    let mut spec = spec_of("utm30lx");
    spec.errors.range.far_sigma_m = None;
    let seen = |reflectance: f32| {
        let globe = Globe { radius_m: 20.0, reflectance };
        (0..4).map(|k| scan(&spec, &globe, 2, k).returns.len()).sum::<usize>() as f64 / 4324.0
    };
    // Standard error of a fraction of one half: 0.76 %.
    assert!((seen(0.1) - 0.5).abs() < 0.03, "{}", seen(0.1));
    // The odds change by a factor e per 0.15 in the logarithm of power: at 1.15 times the power, ln 1.15 / 0.15 = 0.932.
    assert!((seen(0.115) - 1.0 / (1.0 + (-0.932_f64).exp())).abs() < 0.03, "{}", seen(0.115));
    assert_eq!(seen(0.9), 1.0);
    assert!(seen(0.03) < 0.01);
}

#[test]
fn ranges_at_grazing_incidence_are_too_short_and_then_missing() {
    // A wall 0.5 m from the lidar, which beams hit at up to 89 degrees incidence.
    let mut spec = spec_of("utm30lx");
    spec.errors.range.near_sigma_m = 0.0;
    spec.errors.range.bias_sigma_m = 0.0;
    spec.errors.detection.weak_bias_m = 0.0;
    spec.errors.range.resolution_m = 0.0;
    let planar = scan(&spec, &Walls(vec![wall(0.5)]), 1, 0).planar.unwrap();
    let range_at = |degrees: f64| f64::from(planar.ranges_m[((degrees + 135.0) * 4.0) as usize]);
    let exact = |degrees: f64| 0.5 / degrees.to_radians().cos();
    assert_relative_eq!(range_at(60.0), exact(60.0), epsilon = 1e-5);
    // The bias is -20 mm (1 - cos(85) / cos(70)) = -14.9 mm.
    let bias = -0.020 * (1.0 - 85_f64.to_radians().cos() / 70_f64.to_radians().cos());
    assert_relative_eq!(range_at(85.0), exact(85.0) + bias, epsilon = 1e-5);
    // At 89 degrees the range is 28.6 m and the power 0.5 cos(89) / 28.6^2, a twentieth of the threshold.
    assert_eq!(range_at(89.0), f64::INFINITY);
}

#[test]
fn glass_transmits_most_beams_and_delays_them() {
    let mut spec = spec_of("utm30lx");
    (spec.errors.range.near_sigma_m, spec.errors.range.bias_sigma_m, spec.errors.detection.weak_bias_m) =
        (0.0, 0.0, 0.0);
    spec.errors.range.resolution_m = 0.0;
    spec.pattern = spec::parse(&Source::in_memory(
        "narrow",
        "planar(beams: 1000, first_deg: -0.5, step_deg: 0.001, slots_per_turn: 1440)",
    ))
    .unwrap();
    let window = Walls(vec![pane(2.0), pane(2.006), wall(5.0)]);
    let ranges: Vec<f32> = (0..4).flat_map(|k| scan(&spec, &window, 1, k).planar.unwrap().ranges_m).collect();
    let behind = ranges.iter().filter(|r| (**r - 5.003).abs() < 3e-4).count();
    let from_glass = ranges.iter().filter(|r| **r < 2.008).count();
    assert_eq!(behind + from_glass, 4000);
    // Two surfaces with a return probability of 5 % each: 1 - 0.95^2 = 9.75 %, with a standard error of 0.47 %.
    assert!((from_glass as f64 / 4000.0 - 0.0975).abs() < 0.02, "{from_glass}");
    // Without errors every beam passes, to the exact range.
    spec.noise = Switch::Off;
    let exact = scan(&spec, &window, 1, 0).planar.unwrap().ranges_m;
    assert!(exact.iter().all(|r| (*r - 5.0).abs() < 3e-4), "5 m / cos(0.5 degrees) is 5.0002 m");
}

#[test]
fn a_divergent_beam_mixes_close_surfaces_and_resolves_distant_ones() {
    // The axis of beam 540 is along x; the closer wall ends there, so that it covers the right half of the beam.
    let edge = |depth_m: f64| Walls(vec![Wall { ends_at_y_m: -1e-6, ..wall(5.0) }, wall(5.0 + depth_m)]);
    let mut spec = spec_of("utm30lx_exact");
    let middle = |spec: &LidarSpec, depth_m: f64| scan(spec, &edge(depth_m), 1, 0).planar.unwrap().ranges_m[540];
    assert!((middle(&spec, 0.3) - 5.3).abs() < 1e-6, "one ray sees one wall");
    spec.beam = BeamModel::Divergent;
    // Of seven rays, three of a twelfth fall on the near wall (at 120, 180 and 240 degrees from the left); the powers
    // go as 1 / r^2: (3 / 25, 9 / 5.3^2) / 12.
    let (near, far) = (3.0 / 25.0, 9.0 / (5.3 * 5.3));
    let mixed = (5.0 * near + 5.3 * far) / (near + far);
    assert!((f64::from(middle(&spec, 0.3)) - mixed).abs() < 1e-4, "{} {mixed}", middle(&spec, 0.3));
    assert!(
        (middle(&spec, 3.0) - 8.0).abs() < 1e-4,
        "surfaces further apart than the pulse: the strongest return counts"
    );

    spec.echoes = 3;
    let returns = scan(&spec, &edge(3.0), 1, 0).returns;
    let offset = lidar(&spec).beams()[540].offset;
    let of_middle: Vec<f32> = returns.iter().filter(|r| r.offset == offset).map(|r| r.point_in_laser.x).collect();
    assert_eq!(of_middle.len(), 2);
    assert!((of_middle[0] - 5.0).abs() < 1e-4 && (of_middle[1] - 8.0).abs() < 1e-4, "{of_middle:?}");
}

#[test]
fn a_vlp16_fires_300_000_beams_per_second_in_revolutions_of_100_ms() {
    // 1808 firing cycles of 55.296 us fit into 100 ms, with 16 beams each; the manual rounds to 300,000 points/s.
    let spec = spec_of("vlp16");
    let vlp = lidar(&spec);
    assert_eq!(vlp.beams().len(), 1808 * 16);
    let scan = scan(&spec, &Globe { radius_m: 20.0, reflectance: 0.5 }, 1, 0);
    assert!(scan.planar.is_none());
    assert_eq!(scan.returns.len(), 1808 * 16);
    let elevation = |k: usize| {
        let point = scan.returns[k].point_in_laser;
        (point.z / point.norm()).asin().to_degrees()
    };
    assert!((elevation(0) + 15.0).abs() < 1e-3 && (elevation(1) - 1.0).abs() < 1e-3);
    // The second firing cycle is rotated by 360 degrees x 55.296 us / 100 ms = 0.199 degrees to the right.
    let point = scan.returns[16].point_in_laser;
    assert!((point.y.atan2(point.x).to_degrees() + 0.199_07).abs() < 1e-3);
}

#[test]
fn an_lms291_scans_13_575_beams_per_second_and_only_its_1_degree_scans_have_a_polar_form() {
    // 181 beams 75 times a second. Interlaced scans share the end beams: 361 x 37.5 and 721 x 18.75.
    for (name, beams, rate_hz, planar) in
        [("lms291", 181, 75.0, true), ("lms291_0_5deg", 361, 37.5, false), ("lms291_0_25deg", 721, 18.75, false)]
    {
        let scan = scan(&spec_of(name), &Globe { radius_m: 20.0, reflectance: 0.9 }, 1, 0);
        assert_eq!((scan.returns.len(), scan.planar.is_some()), (beams, planar), "{name}");
        assert_eq!(spec_of(name).rate_hz, rate_hz);
        // The last beam of a scan is fired before the next scan, and within the last mirror revolution of 1 / 75 s.
        let last_s = scan.returns[beams - 1].offset.seconds();
        assert!(last_s < 1.0 / rate_hz && last_s > 1.0 / rate_hz - 1.0 / 75.0, "{name}: {last_s}");
        for beam in &scan.returns {
            let centimetres = f64::from(beam.point_in_laser.norm()) * 100.0;
            assert!((centimetres - centimetres.round()).abs() < 1e-3, "{name}: rounded to 10 mm");
        }
    }
}

/// Azimuth, 0..360, and elevation of the returns of scan `index` of a Mid-360 inside a sphere, degrees.
fn angles_of_mid360(index: u64) -> Vec<(f64, f64)> {
    let scan = scan(&spec_of("mid360"), &Globe { radius_m: 10.0, reflectance: 0.9 }, 1, index);
    let angles = |point: nalgebra::Vector3<f64>| {
        (point.y.atan2(point.x).to_degrees().rem_euclid(360.0), (point.z / point.norm()).asin().to_degrees())
    };
    scan.returns.iter().map(|beam| angles(beam.point_in_laser.cast())).collect()
}

#[test]
fn a_mid360_fires_200_000_beams_per_second_into_its_field_of_view() {
    let angles = angles_of_mid360(0);
    assert_eq!(angles.len() as f64 * spec_of("mid360").rate_hz, 200_000.0);
    let (low, high) = angles.iter().fold((90.0_f64, -90.0_f64), |(low, high), (_, e)| (low.min(*e), high.max(*e)));
    assert!((low + 7.0).abs() < 0.01 && (high - 52.0).abs() < 0.01, "{low} {high}");
    // Each eighth of the circle gets an eighth of the beams, to within the beams of one of the 16.6 revolutions.
    for octant in 0..8 {
        let share = angles.iter().filter(|(azimuth, _)| (azimuth / 45.0) as usize == octant).count() as f64 / 20_000.0;
        assert!((share - 0.125).abs() < 0.125 / 16.0, "{octant}: {share}");
    }
}

#[test]
fn each_scan_of_a_mid360_is_rotated_and_fills_the_gaps_of_earlier_scans() {
    // 16.618034 revolutions per scan, of which 0.618034 matter: 1.854102 after three scans, of which 0.854102 matter.
    let (first, fourth) = (angles_of_mid360(0), angles_of_mid360(3));
    for (a, b) in first.iter().zip(&fourth) {
        let turned = (b.0 - a.0 - 0.854_102 * 360.0 + 180.0).rem_euclid(360.0) - 180.0;
        assert!(turned.abs() < 1e-3 && (a.1 - b.1).abs() < 1e-3, "{a:?} {b:?}");
    }
    // Cells of a degree, 360 x 59 of them.
    let mut seen = vec![false; 360 * 59];
    let mut shares = Vec::new();
    for index in 0..10 {
        for (azimuth, elevation) in angles_of_mid360(index) {
            let row = ((elevation + 7.0).max(0.0) as usize).min(58);
            seen[row * 360 + (azimuth as usize).min(359)] = true;
        }
        shares.push(seen.iter().filter(|seen| **seen).count() as f64 / seen.len() as f64);
    }
    assert!(shares[0] < 0.75 && shares[9] > 0.98, "{shares:?}");
}

#[test]
fn out_of_range_is_plus_infinity_and_too_close_is_minus_infinity() {
    let spec = spec_of("utm30lx");
    let far = scan(&spec, &Globe { radius_m: 31.0, reflectance: 0.9 }, 1, 0);
    assert!(far.returns.is_empty() && far.planar.unwrap().ranges_m.iter().all(|r| *r == f32::INFINITY));
    let near = scan(&spec, &Globe { radius_m: 0.04, reflectance: 0.9 }, 1, 0);
    assert!(near.returns.is_empty() && near.planar.unwrap().ranges_m.iter().all(|r| *r == f32::NEG_INFINITY));
}

#[test]
fn a_scan_depends_only_on_its_index_and_the_seed() {
    let spec = spec_of("utm30lx");
    let globe = Globe { radius_m: 6.0, reflectance: 0.5 };
    let alone = scan(&spec, &globe, 1, 5);
    for index in [7, 3] {
        assert_ne!(scan(&spec, &globe, 1, index).planar, alone.planar);
    }
    assert_eq!(scan(&spec, &globe, 1, 5), alone);
    assert_ne!(scan(&spec, &globe, 2, 5).planar, alone.planar);
}

#[test]
fn invalid_values_in_a_spec_are_refused_with_their_line() {
    let text = std::fs::read_to_string("specs/lidars/utm30lx.ron").unwrap();
    let about = |from: &str, to: &str| {
        let source = Source::in_memory("lidar.ron", text.replace(from, to));
        let error = spec::parse::<LidarSpec>(&source).and_then(|spec| Lidar::new(&spec, &source)).unwrap_err();
        (error.line_and_column().unwrap(), error.message().to_owned())
    };
    assert!(about("rate_hz: 40", "rate_hz: NaN").1.contains("finite number above 0"));
    assert!(about("range_min_m: 0.1", "range_min_m: 40").1.contains("is not below range_max_m 30"));
    assert!(about("beams: 1081", "beams: 2000").1.contains("2000 beams in 1440 slots"));
    assert!(about("echoes: 1", "echoes: 0").1.contains("0 echoes"));
    assert!(about("noise: on", "noise: perhaps").1.contains("perhaps"));
}
