//! The simulation pipeline with a closed-form head motion in a closed-form world.

use crate::simulation::memory_sink::MemorySink;
use crate::strapdown::integrate;
use std::f64::consts::PI;
use zsim::dynamics::{DynamicsError, HeadState};
use zsim::geometry::{Kinematics, Pose, Rotation, Vector, from_roll_pitch_yaw};
use zsim::measurement::{ImuSample, LidarScan, Sink, SinkError};
use zsim::random::Seed;
use zsim::sensors::{ClockSpec, Clocks, ClocksSpec, Cylinder, Imu, Lidar, Scenery, SurfaceHit};
use zsim::simulation::{EPOCH, Outputs, Rig, STEP_S, SimulationError, SimulationSummary, simulate};
use zsim::spec::{self, Source};
use zsim::time::{Span, Stamp};
use zsim::truth::{ClockTruth, TruthSample, TruthSink};

/// The inside of a box around the origin, 12 x 8 x 5 m.
struct Room;

const HALF: [f64; 3] = [6.0, 4.0, 2.5];

impl Scenery for Room {
    fn first_hit(&self, origin: &Vector, direction: &Vector, reach_m: f64, _t_s: f64) -> Option<SurfaceHit> {
        let exits = (0..3).map(|k| ((HALF[k].copysign(direction[k]) - origin[k]) / direction[k], direction[k].abs()));
        let (range_m, cos) = exits.filter(|(range, _)| *range > 0.0).min_by(|a, b| a.0.total_cmp(&b.0))?;
        let hit = SurfaceHit { range_m, cos_incidence: cos as f32, reflectance: 0.6, transmission: 0.0 };
        (range_m <= reach_m).then_some(hit)
    }
}

/// Distance of a point from the closest wall of the room, m.
fn distance_to_walls(point: &Vector) -> f64 {
    (0..3).map(|k| (point[k].abs() - HALF[k]).abs()).fold(f64::INFINITY, f64::min)
}

/// A head that nods by 40 degrees at 1.2 Hz while it rotates and moves on a circle.
struct Nodding {
    step: u64,
}

fn nodding(t: f64) -> Kinematics {
    // Rz(c t) Ry(b): omega = c z + b' y', with y' the rotated y axis.
    let (w, c) = (2.4 * PI, 0.3);
    let (b, b1, b2) = (0.7 * (w * t).sin(), 0.7 * w * (w * t).cos(), -0.7 * w * w * (w * t).sin());
    let node = Rotation::from_scaled_axis(Vector::z() * (c * t)) * Vector::y();
    let (sin, cos) = (c * t).sin_cos();
    Kinematics {
        world_from_body: Pose::from_parts(
            Vector::new(cos, sin, 0.05 * (w * t).sin()).into(),
            from_roll_pitch_yaw(0.0, b, c * t),
        ),
        velocity_in_world: Vector::new(-c * sin, c * cos, 0.05 * w * (w * t).cos()),
        angular_velocity_in_world: Vector::z() * c + node * b1,
        acceleration_in_world: Vector::new(-c * c * cos, -c * c * sin, -0.05 * w * w * (w * t).sin()),
        angular_acceleration_in_world: node * b2 + Vector::z().cross(&node) * (c * b1),
    }
}

impl Iterator for Nodding {
    type Item = Result<HeadState, DynamicsError>;

    fn next(&mut self) -> Option<Self::Item> {
        let t_s = self.step as f64 * STEP_S;
        self.step += 1;
        Some(Ok(HeadState { t_s, head: nodding(t_s), base: Kinematics::at_rest(Pose::identity()) }))
    }
}

fn clock(offset_ms: f64, rate_ppm: f64, jitter_ms: f64, resolution_ms: f64) -> ClockSpec {
    ClockSpec { offset_ms, rate_ppm, jitter_ms, resolution_ms }
}

fn exact() -> ClockSpec {
    clock(0.0, 0.0, 0.0, 0.0)
}

struct Run {
    lidar: &'static str,
    imu: &'static str,
    clocks: ClocksSpec,
    carrier: Vec<Cylinder>,
    duration_s: f64,
    seed: u64,
    outputs: Outputs,
}

impl Run {
    fn of(lidar: &'static str, imu: &'static str, duration_s: f64) -> Self {
        let clocks = ClocksSpec { lidar: exact(), imu: exact() };
        Self { lidar, imu, clocks, carrier: vec![], duration_s, seed: 1, outputs: Outputs::All }
    }

    fn run<S: Sink + TruthSink>(&self, sink: &mut S) -> Result<SimulationSummary, SimulationError> {
        let source = Source::in_memory("test", "");
        let rig = Rig {
            scenery: &Room,
            carrier: &self.carrier,
            lidar: &Lidar::new(&spec::load(self.lidar).unwrap(), &source).unwrap(),
            imu: &Imu::new(&spec::load(self.imu).unwrap(), &source).unwrap(),
            base_imu: None,
            clocks: Clocks::new(&self.clocks, &source, EPOCH).unwrap(),
            head_from_laser: head_from_laser(),
            head_from_imu: head_from_imu(),
            duration_s: self.duration_s,
            seed: Seed(self.seed),
            outputs: self.outputs,
        };
        simulate(&rig, &mut Nodding { step: 0 }, sink, &mut |_| ())
    }

    fn recorded(&self) -> MemorySink {
        let mut recorded = MemorySink::default();
        self.run(&mut recorded).unwrap();
        recorded
    }
}

fn head_from_laser() -> Pose {
    Pose::from_parts(Vector::new(0.02, 0.0, 0.06).into(), from_roll_pitch_yaw(0.0, 0.1, 0.0))
}

fn head_from_imu() -> Pose {
    Pose::from_parts(Vector::new(-0.03, 0.01, -0.04).into(), from_roll_pitch_yaw(0.2, 0.0, -0.4))
}

#[test]
fn beams_projected_by_truth_lie_within_a_millimetre_of_the_walls() {
    let mut run = Run::of("utm30lx_exact", "3dm_gx2", 2.2);
    // The ground truth is stamped by the lidar's clock, with any error of that clock.
    run.clocks.lidar = clock(-7.3, 80.0, 0.0, 0.0);
    let recorded = run.recorded();
    let truth = recorded.trajectory();
    assert_eq!(recorded.scans.len(), 88);
    for (_, scan) in &recorded.scans {
        assert_eq!(scan.returns.len(), 1081);
        for beam in &scan.returns {
            let world_from_laser = truth.at(scan.stamp + beam.offset).unwrap() * head_from_laser();
            let point = world_from_laser * nalgebra::Point3::from(beam.point_in_laser.cast::<f64>());
            assert!(distance_to_walls(&point.coords) < 1e-3);
        }
    }
}

#[test]
fn the_carrier_is_visible_at_its_position() {
    // A post of 0.4 m diameter next to the head's circle, from the floor to 0.5 m above the base, which is at rest at
    // the origin.
    let foot_in_base = Vector::new(0.5, -2.0, -HALF[2]);
    let mut run = Run::of("utm30lx_exact", "3dm_gx2", 1.0);
    run.carrier = vec![Cylinder { foot_in_base, radius_m: 0.2, height_m: 3.0, reflectance: 0.4 }];
    let recorded = run.recorded();
    let truth = recorded.trajectory();
    let mut on_post = 0;
    for (_, scan) in &recorded.scans {
        assert_eq!(scan.returns.len(), 1081);
        for beam in &scan.returns {
            let world_from_laser = truth.at(scan.stamp + beam.offset).unwrap() * head_from_laser();
            let point = (world_from_laser * nalgebra::Point3::from(beam.point_in_laser.cast::<f64>())).coords;
            let off_the_side = ((point - foot_in_base).xy().norm() - 0.2).abs();
            let off_the_top = (point.z - 0.5).abs();
            assert!(distance_to_walls(&point).min(off_the_side).min(off_the_top) < 1e-3, "{point}");
            on_post += usize::from(distance_to_walls(&point) > 0.1);
        }
    }
    // At a distance of 2.06 to 2.34 m the post is 2 asin(0.2 / 2.06) = 11.1 to 9.8 degrees wide: 45 to 39 beams in each
    // of about 40 scans, at most 1,800 if all scans are level. During part of each nod the beams pass above its top.
    assert!((800..1800).contains(&on_post), "{on_post}");
}

#[test]
fn the_ideal_imu_integrates_to_the_truth_over_10_s() {
    let recorded = Run::of("utm30lx_exact", "ideal_1khz", 10.0).recorded();
    let start = recorded.truth[0].1.head.of_frame(&head_from_imu());
    assert_eq!(recorded.samples.len(), 10_000);
    let readings = recorded.samples.iter().map(|(_, s)| (s.angular_velocity_rad_per_s, s.specific_force_m_per_s2));
    let integrated = integrate(&start, readings, 1e-3);
    let end = recorded.truth[10_000].1.head.of_frame(&head_from_imu()).world_from_body;
    let error = integrated.translation.vector - end.translation.vector;
    assert!(error.norm() < 2e-3, "{error}");
    assert!(integrated.rotation.angle_to(&end.rotation).to_degrees() < 0.02);
}

#[test]
fn ground_truth_is_the_motion_at_full_milliseconds_of_lidar_time() {
    let mut run = Run::of("utm30lx_exact", "3dm_gx2", 1.0);
    run.clocks.lidar = clock(2.6, 40.0, 0.0, 1.0);
    let recorded = run.recorded();
    // Stamps are late by half a clock tick on average: the first has a mean of 2.1 ms, the last 1002.14 ms.
    let of = |ms: i64| EPOCH + Span::from_nanos(ms * 1_000_000);
    assert_eq!((recorded.truth[0].1.lidar_stamp, recorded.truth.last().unwrap().1.lidar_stamp), (of(3), of(1002)));
    for (now, truth) in &recorded.truth {
        // lidar = 1.00004 t + 2.1 ms, so t = (lidar - 2.1 ms) / 1.00004.
        let t = (truth.lidar_stamp.seconds_since(EPOCH) - 2.1e-3) / 1.000_04;
        assert!((now.seconds_since(EPOCH) - t).abs() < 2e-9);
        let expected = nodding(t);
        assert!(
            (truth.head.world_from_body.translation.vector - expected.world_from_body.translation.vector).norm() < 1e-8
        );
        assert!((truth.head.velocity_in_world - expected.velocity_in_world).norm() < 1e-7);
        assert!(truth.head.world_from_body.rotation.angle_to(&expected.world_from_body.rotation) < 1e-8);
    }
    let (first, last) = recorded.trajectory().span().unwrap();
    let sweep = Span::from_nanos(18_750_000);
    assert!(recorded.scans.iter().all(|(_, scan)| scan.stamp >= first && scan.stamp + sweep <= last));
}

#[test]
fn stamps_agree_with_the_ground_truth_of_the_clocks() {
    let mut run = Run::of("utm30lx_exact", "3dm_gx2", 20.0);
    run.clocks.lidar = clock(1.0, -30.0, 0.2, 1.0);
    run.clocks.imu = clock(-4.0, 100.0, 0.3, 0.5);
    let recorded = run.recorded();
    assert_eq!(recorded.clocks.len(), 200, "ten times a second");
    let ahead_at = |t_s: f64, of: fn(&ClockTruth) -> Span| {
        let (first, last) = (of(&recorded.clocks[0].1).seconds(), of(&recorded.clocks[199].1).seconds());
        first + (last - first) * t_s / recorded.clocks[199].0.seconds_since(EPOCH)
    };
    // A scan arrives with its last beam, 18.75 ms of lidar time after the stamped first beam. A sample arrives 5 ms of
    // IMU time after the middle of its interval, which is the stamp.
    let scans = recorded.scans.iter().map(|(arrival, scan)| {
        let fired_s = arrival.seconds_since(EPOCH) - 0.01875 / (1.0 - 30e-6);
        scan.stamp.seconds_since(EPOCH) - fired_s - ahead_at(fired_s, |clock| clock.lidar_offset)
    });
    let samples = recorded.samples.iter().map(|(arrival, sample)| {
        let middle_s = arrival.seconds_since(EPOCH) - 0.005 / (1.0 + 100e-6);
        sample.stamp.seconds_since(EPOCH) - middle_s - ahead_at(middle_s, |clock| clock.imu_offset)
    });
    // Standard deviation: jitter and rounding, uniform over a tick (tick / sqrt(12)), in quadrature.
    for (errors, sigma) in [
        (scans.collect::<Vec<f64>>(), 0.2e-3_f64.hypot(1e-3 / 12_f64.sqrt())),
        (samples.collect(), 0.3e-3_f64.hypot(0.5e-3 / 12_f64.sqrt())),
    ] {
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        assert!(mean.abs() < 4.0 * sigma / (errors.len() as f64).sqrt(), "{mean} of {sigma}");
    }
}

#[test]
fn stamps_increase_with_any_jitter() {
    let mut run = Run::of("utm30lx", "3dm_gx2", 2.0);
    (run.clocks.lidar.jitter_ms, run.clocks.imu.jitter_ms) = (10.0, 10.0);
    let recorded = run.recorded();
    assert!(recorded.samples.windows(2).all(|pair| pair[0].1.stamp < pair[1].1.stamp));
    assert!(recorded.scans.windows(2).all(|pair| pair[0].1.stamp < pair[1].1.stamp));
}

#[test]
fn a_run_depends_only_on_the_seed() {
    let mut run = Run::of("utm30lx", "3dm_gx2", 2.3);
    run.clocks.imu = clock(3.0, 16.67, 0.1, 0.0);
    let with_threads = |count: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap();
        pool.install(|| run.recorded())
    };
    let one = with_threads(1);
    assert!(one == with_threads(2));
    assert!(one == run.recorded());
    run.seed = 2;
    let other = run.recorded();
    assert!(one.truth == other.truth && one.scans != other.scans && one.samples != other.samples);
}

#[test]
fn the_summary_counts_what_was_delivered() {
    let run = Run::of("utm30lx_divergent", "3dm_gx2", 1.2);
    let mut recorded = MemorySink::default();
    let summary = run.run(&mut recorded).unwrap();
    assert_eq!((summary.scans, summary.imu_samples), (recorded.scans.len() as u64, recorded.samples.len() as u64));
    assert_eq!((summary.scans, summary.imu_samples), (48, 120));
    assert_eq!((summary.beams, summary.rays), (48 * 1081, 48 * 1081 * 7));
    assert_eq!(summary.returns, recorded.scans.iter().map(|(_, scan)| scan.returns.len() as u64).sum::<u64>());
}

#[test]
fn an_imu_alone_has_the_samples_of_the_whole_run() {
    let mut run = Run::of("utm30lx", "3dm_gx2", 1.7);
    run.clocks.imu = clock(3.1, -40.0, 0.2, 0.0);
    let whole = run.recorded();
    run.outputs = Outputs::Imus;
    let alone = run.recorded();
    assert!(whole.samples.len() > 160 && alone.samples == whole.samples);
    assert_eq!((alone.scans.len(), alone.truth.len(), alone.clocks.len()), (0, 0, 0));
}

/// Sink that fails after a hundred IMU samples.
#[derive(Default)]
struct Full(u32);

impl Sink for Full {
    fn imu(&mut self, _: Stamp, _: &ImuSample) -> Result<(), SinkError> {
        self.0 += 1;
        if self.0 > 100 { Err("no space left".into()) } else { Ok(()) }
    }

    fn lidar(&mut self, _: Stamp, _: &LidarScan) -> Result<(), SinkError> {
        Ok(())
    }
}

impl TruthSink for Full {
    fn truth(&mut self, _: Stamp, _: &TruthSample) -> Result<(), SinkError> {
        Ok(())
    }

    fn clock(&mut self, _: Stamp, _: &ClockTruth) -> Result<(), SinkError> {
        Ok(())
    }
}

#[test]
fn an_error_of_the_sink_stops_the_run_and_is_its_source() {
    let error = Run::of("utm30lx", "3dm_gx2", 60.0).run(&mut Full::default()).unwrap_err();
    assert!(std::error::Error::source(&error).unwrap().to_string().contains("no space left"), "{error}");
}

#[test]
fn a_motion_that_ends_before_the_run_is_an_error() {
    let source = Source::in_memory("test", "");
    let rig = Rig {
        scenery: &Room,
        carrier: &[],
        lidar: &Lidar::new(&spec::load("utm30lx").unwrap(), &source).unwrap(),
        imu: &Imu::new(&spec::load("3dm_gx2").unwrap(), &source).unwrap(),
        base_imu: None,
        clocks: Clocks::new(&ClocksSpec { lidar: exact(), imu: exact() }, &source, EPOCH).unwrap(),
        head_from_laser: head_from_laser(),
        head_from_imu: head_from_imu(),
        duration_s: 3.0,
        seed: Seed(1),
        outputs: Outputs::All,
    };
    let mut short = Nodding { step: 0 }.take(1200);
    let error = simulate(&rig, &mut short, &mut MemorySink::default(), &mut |_| ()).unwrap_err();
    assert_eq!(error.to_string(), "the head's motion ends 1.200 s after the start, before the run does");
}

#[test]
fn a_run_of_zero_duration_is_refused() {
    for duration_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = Run::of("utm30lx", "3dm_gx2", duration_s).run(&mut MemorySink::default()).unwrap_err();
        assert!(matches!(error, SimulationError::Duration { .. }), "{error}");
    }
}
