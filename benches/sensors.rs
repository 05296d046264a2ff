//! Speed of simulated sensors: ray casts and errors of a scan, IMU samples, and a full simulation with and without recording.

#![allow(clippy::unwrap_used, missing_docs, reason = "a bench fails by panicking; its items are criterion's")]

use criterion::{Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use std::time::Duration;
use zsim::dynamics::HeadSimulation;
use zsim::geometry::{STANDARD_GRAVITY_M_PER_S2, Vector};
use zsim::measurement::{ImuSample, LidarScan, Sink, SinkError};
use zsim::random::Seed;
use zsim::recording::{RunDescription, Writer};
use zsim::sensors::{ImuErrors, InertialReading, LidarErrors, ScanTiming, Track};
use zsim::simulation::{EPOCH, STEP_S, Scenario, Simulation};
use zsim::time::Stamp;
use zsim::truth::{ClockTruth, TruthSample, TruthSink};

/// Duration of the full simulation, s.
const DURATION_S: f64 = 8.0;

fn office() -> Simulation {
    Simulation::prepare(&Scenario { duration_s: DURATION_S, ..Scenario::in_scene("office") }).unwrap()
}

fn scan(criterion: &mut Criterion) {
    let office = office();
    let states = HeadSimulation::new(office.head(), office.motion(), STEP_S).unwrap().skip(6000).take(30);
    let head = Track::new(6000, STEP_S, states.map(|state| state.unwrap().head).collect()).unwrap();
    let laser = head.of_frame(office.head().head_from_laser());
    let firing = ScanTiming { index: 7, start_s: 6.005, pace: 1.0, stamp: EPOCH };
    let (lidar, errors) = (office.lidar(), LidarErrors::new(office.lidar(), Seed(1)));
    let sweep = lidar.sweep(office.world(), &laser, &firing);

    let mut group = criterion.benchmark_group("lidar");
    group.throughput(Throughput::Elements(lidar.beams().len() as u64));
    group.bench_function("rays of a scan", |bench| bench.iter(|| lidar.sweep(office.world(), &laser, &firing)));
    group.bench_function("errors of a scan", |bench| bench.iter(|| lidar.measure(black_box(&sweep), &errors)));
    group.finish();
}

fn imu(criterion: &mut Criterion) {
    let mut errors = ImuErrors::new(office().imu(), Seed(1));
    let ideal = InertialReading {
        angular_velocity_rad_per_s: Vector::zeros(),
        specific_force_m_per_s2: Vector::z() * STANDARD_GRAVITY_M_PER_S2,
    };
    criterion.bench_function("imu/errors of a sample", |bench| bench.iter(|| errors.measure(black_box(&ideal))));
}

/// Sink that discards everything.
struct NullSink;

impl Sink for NullSink {
    fn imu(&mut self, _: Stamp, sample: &ImuSample) -> Result<(), SinkError> {
        black_box(sample);
        Ok(())
    }

    fn lidar(&mut self, _: Stamp, scan: &LidarScan) -> Result<(), SinkError> {
        black_box(scan);
        Ok(())
    }
}

impl TruthSink for NullSink {
    fn truth(&mut self, _: Stamp, sample: &TruthSample) -> Result<(), SinkError> {
        black_box(sample);
        Ok(())
    }

    fn clock(&mut self, _: Stamp, clock: &ClockTruth) -> Result<(), SinkError> {
        black_box(clock);
        Ok(())
    }
}

/// Full simulation of 8 s; 50 times real time is 160 ms per run.
fn full_simulation(criterion: &mut Criterion) {
    let office = office();
    let run = RunDescription {
        calibration: office.calibration(),
        imu_rate_hz: office.imu().spec().rate_hz,
        base_imu: None,
        manifest: String::new(),
        truth_tf: false,
    };
    let mut group = criterion.benchmark_group("simulation");
    group.sample_size(10).sampling_mode(SamplingMode::Flat).measurement_time(Duration::from_secs(4));
    group.bench_function("8 s of the office", |bench| bench.iter(|| office.run(&mut NullSink, &mut |_| ()).unwrap()));
    group.bench_function("8 s of the office, recorded", |bench| {
        bench.iter(|| {
            let mut writer = Writer::new(std::io::sink(), run.clone()).unwrap();
            office.run(&mut writer, &mut |_| ()).unwrap();
            writer.finish().unwrap();
        });
    });
    group.finish();
}

criterion_group!(benches, scan, imu, full_simulation);
criterion_main!(benches);
