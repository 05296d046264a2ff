//! Sensor faults: the effect of each on an otherwise unchanged simulation.

mod delivery;
mod spec;
mod values;

use crate::simulation::memory_sink::MemorySink;
use std::sync::OnceLock;
use zsim::random::Seed;
use zsim::simulation::{EPOCH, Named, Run, Scenario, Simulation, SimulationError};
use zsim::spec::Source;
use zsim::time::Stamp;

const DURATION_S: f64 = 8.0;

fn scenario(scene: &str, imu: &str, seed: u64) -> Scenario {
    let (lidar, imu) = ("utm30lx".to_owned(), imu.to_owned());
    Scenario { duration_s: DURATION_S, seed: Seed(seed), lidar, imu, ..Scenario::in_scene(scene) }
}

fn faults(list: &str) -> Source {
    Source::in_memory("test.ron", format!("(faults: [\n{list}\n])"))
}

/// The simulation of `scenario` with faults.
fn simulation(scenario: &Scenario, list: Option<&str>) -> Result<Simulation, String> {
    let mut run = Run::load(scenario).unwrap();
    let wrong = |error: SimulationError| error.to_string();
    run.faults =
        list.map(|list| Named::parse(faults(list))).transpose().map_err(|error| wrong(SimulationError::from(error)))?;
    Simulation::build(run).map_err(wrong)
}

fn run(scenario: &Scenario, list: Option<&str>) -> MemorySink {
    let mut recorded = MemorySink::default();
    simulation(scenario, list).unwrap().run(&mut recorded, &mut |_| ()).unwrap();
    recorded
}

/// The reference run without faults.
fn reference() -> &'static MemorySink {
    static KEPT: OnceLock<MemorySink> = OnceLock::new();
    KEPT.get_or_init(|| run(&usual(), None))
}

fn usual() -> Scenario {
    scenario("mocap_room", "3dm_gx2", 1)
}

fn with(list: &str) -> MemorySink {
    run(&usual(), Some(list))
}

fn since_start_s(stamp: Stamp) -> f64 {
    stamp.seconds_since(EPOCH)
}

#[test]
fn an_empty_list_changes_nothing() {
    assert!(with("") == *reference());
}

#[test]
fn random_faults_depend_only_on_the_seed() {
    let list = "(sensor: both, fault: drop(share: 0.2)), (sensor: imu, fault: delay(mean_s: 0.02)),
        (sensor: lidar, fault: reorder(share: 0.3)), (sensor: imu, fault: duplicate(share: 0.1))";
    let once = with(list);
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert!(pool.install(|| with(list)) == once);
    }
    // The seeds lose different scans: equal arrivals by chance have a probability of 1e-100.
    let other = run(&scenario("mocap_room", "3dm_gx2", 2), Some(list));
    let arrivals = |recorded: &MemorySink| recorded.scans.iter().map(|(arrival, _)| *arrival).collect::<Vec<_>>();
    assert_ne!(arrivals(&once), arrivals(&other));
}

#[test]
fn faults_share_physics_and_rays() {
    let lists =
        [None, Some("(sensor: imu, fault: drop(share: 0.5))"), Some("(sensor: lidar, fault: delay(mean_s: 0.1))")];
    let simulations: Vec<_> = lists.iter().map(|list| simulation(&usual(), *list).unwrap()).collect();
    let mut recorded: Vec<MemorySink> = lists.iter().map(|_| MemorySink::default()).collect();
    Simulation::run_together(&simulations, &mut recorded.iter_mut().collect::<Vec<_>>(), &mut |_| ()).unwrap();
    for (together, list) in recorded.iter().zip(lists) {
        assert!(*together == run(&usual(), list), "{list:?}");
    }
}

#[test]
fn faults_act_in_the_order_listed() {
    let clip = "(sensor: imu, fault: clip(gyro_rad_per_s: 0.1))";
    let step = "(sensor: imu, from_s: 0, fault: bias_step(gyro_rad_per_s: (1, 1, 1)))";
    let largest = |recorded: MemorySink| {
        recorded.samples.iter().map(|(_, s)| s.angular_velocity_rad_per_s.amax()).fold(0.0, f64::max)
    };
    assert!((largest(with(&format!("{clip}, {step}"))) - 1.1).abs() < 1e-12);
    assert!((largest(with(&format!("{step}, {clip}"))) - 0.1).abs() < 1e-12);
}
