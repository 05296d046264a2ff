//! Every shipped lidar, IMU and pair of clocks runs in a short simulation in a closed-form world.

use zsim::dynamics::{DynamicsError, HeadState};
use zsim::geometry::{Kinematics, Pose, Vector};
use zsim::measurement::{ImuSample, LidarScan, Sink, SinkError};
use zsim::random::Seed;
use zsim::sensors::{Clocks, Imu, Lidar, Scenery, SurfaceHit};
use zsim::simulation::{EPOCH, Outputs, Rig, STEP_S, simulate};
use zsim::spec::{Kind, find, names, parse};
use zsim::time::Stamp;
use zsim::truth::{ClockTruth, TruthSample, TruthSink};

const RADIUS_M: f64 = 6.0;
const DURATION_S: f64 = 0.5;
const TURN_RAD_PER_S: f64 = 1.5;

/// The inside of a sphere around the lidar.
struct Globe;

impl Scenery for Globe {
    fn first_hit(&self, _: &Vector, _: &Vector, reach_m: f64, _: f64) -> Option<SurfaceHit> {
        let hit = SurfaceHit { range_m: RADIUS_M, cos_incidence: 1.0, reflectance: 0.9, transmission: 0.0 };
        (RADIUS_M <= reach_m).then_some(hit)
    }
}

/// A head that rotates about z at a fixed position.
fn turning(step: u64) -> HeadState {
    let t_s = step as f64 * STEP_S;
    let world_from_head = Pose::rotation(Vector::z() * (TURN_RAD_PER_S * t_s));
    let head =
        Kinematics { angular_velocity_in_world: Vector::z() * TURN_RAD_PER_S, ..Kinematics::at_rest(world_from_head) };
    HeadState { t_s, head, base: Kinematics::at_rest(Pose::identity()) }
}

#[derive(Default)]
struct MemorySink {
    samples: Vec<ImuSample>,
    scans: Vec<LidarScan>,
}

impl Sink for MemorySink {
    fn imu(&mut self, _: Stamp, sample: &ImuSample) -> Result<(), SinkError> {
        self.samples.push(*sample);
        Ok(())
    }

    fn lidar(&mut self, _: Stamp, scan: &LidarScan) -> Result<(), SinkError> {
        self.scans.push(scan.clone());
        Ok(())
    }
}

impl TruthSink for MemorySink {
    fn truth(&mut self, _: Stamp, _: &TruthSample) -> Result<(), SinkError> {
        Ok(())
    }

    fn clock(&mut self, _: Stamp, _: &ClockTruth) -> Result<(), SinkError> {
        Ok(())
    }
}

/// Runs the named lidar, IMU and clocks, and checks rates and values.
fn run(lidar: &str, imu: &str, clock: &str) {
    let [of_lidar, of_imu, of_clock] =
        [(Kind::Lidar, lidar), (Kind::Imu, imu), (Kind::Clock, clock)].map(|(kind, name)| find(kind, name).unwrap());
    let lidar_model = Lidar::new(&parse(&of_lidar).unwrap(), &of_lidar).unwrap();
    let imu_model = Imu::new(&parse(&of_imu).unwrap(), &of_imu).unwrap();
    let rig = Rig {
        scenery: &Globe,
        carrier: &[],
        lidar: &lidar_model,
        imu: &imu_model,
        base_imu: None,
        clocks: Clocks::new(&parse(&of_clock).unwrap(), &of_clock, EPOCH).unwrap(),
        head_from_laser: Pose::identity(),
        head_from_imu: Pose::identity(),
        duration_s: DURATION_S,
        seed: Seed(1),
        outputs: Outputs::All,
    };
    let mut recorded = MemorySink::default();
    simulate(&rig, &mut (0..).map(|step| Ok::<_, DynamicsError>(turning(step))), &mut recorded, &mut |_| ()).unwrap();

    let name = format!("{lidar}, {imu}, {clock}");
    // One measurement may be missing at the end, and one at the start if a clock is ahead.
    let enough = |count: usize, period_s: f64| count as f64 >= DURATION_S / period_s - 3.0;
    assert!(enough(recorded.samples.len(), imu_model.period_s()), "{name}: {} samples", recorded.samples.len());
    assert!(enough(recorded.scans.len(), lidar_model.period_s()), "{name}: {} scans", recorded.scans.len());
    assert!(
        recorded.samples.is_sorted_by(|a, b| a.stamp < b.stamp)
            && recorded.scans.is_sorted_by(|a, b| a.stamp < b.stamp)
    );

    let errors = &lidar_model.spec().errors.range;
    let most_m = 6.0 * errors.near_sigma_m + 4.0 * errors.bias_sigma_m + errors.resolution_m + 1e-5;
    for scan in &recorded.scans {
        assert_eq!(scan.returns.len(), lidar_model.beams().len(), "{name}");
        assert!(scan.returns.is_sorted_by_key(|beam| beam.offset), "{name}: returns are not in firing order");
        for beam in &scan.returns {
            let range_m = f64::from(beam.point_in_laser.norm());
            assert!((range_m - RADIUS_M).abs() < most_m, "{name}: {range_m} m");
        }
    }
    let spec = &imu_model.spec().gyro;
    let sample_sigma = spec.density_deg_per_s_per_sqrt_hz.to_radians() / imu_model.period_s().sqrt();
    let steady = spec.turn_on_bias_deg_per_s.to_radians() + spec.scale_percent * 1e-2 * TURN_RAD_PER_S;
    let most = 6.0 * sample_sigma + 4.0 * steady + spec.resolution_deg_per_s.to_radians() + 1e-3;
    for sample in &recorded.samples {
        let rate = sample.angular_velocity_rad_per_s.z;
        assert!((rate - TURN_RAD_PER_S).abs() < most, "{name}: {rate} rad/s");
    }
}

#[test]
fn every_shipped_lidar_runs() {
    for lidar in names(Kind::Lidar) {
        run(&lidar, "3dm_gx2", "drifting");
    }
}

#[test]
fn every_shipped_imu_runs() {
    for imu in names(Kind::Imu) {
        run("utm30lx", &imu, "drifting");
    }
}

#[test]
fn every_shipped_pair_of_clocks_runs() {
    for clock in names(Kind::Clock) {
        run("utm30lx", "3dm_gx2", &clock);
    }
}
