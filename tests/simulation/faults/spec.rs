//! Specs of faults: shipped lists, errors, files of arrival times.

use super::{MemorySink, simulation, usual};
use zsim::simulation::{FaultsSpec, Run, Scenario, Simulation};
use zsim::spec::{Kind, Source, names, parse};

#[test]
fn every_shipped_list_of_faults_builds_and_runs() {
    for name in names(Kind::Faults) {
        let scenario = Scenario { faults: Some(name.clone()), duration_s: 0.5, ..usual() };
        let simulation = Simulation::prepare(&scenario).unwrap_or_else(|error| panic!("{name}: {error}"));
        simulation.run(&mut MemorySink::default(), &mut |_| ()).unwrap();
        // A manifest has the complete specs, including referenced files: it must reproduce the run.
        let text = zsim::spec::to_text(simulation.inputs()).unwrap();
        let read: Run = parse(&Source::in_memory("manifest", text)).unwrap();
        assert_eq!(&read, simulation.inputs(), "{name}");
    }
}

#[test]
fn an_invalid_fault_is_refused_with_its_line_and_a_remedy() {
    for (list, place, words) in [
        ("(sensor: imu, fault: gap)", "2:15", "give from_s and to_s"),
        ("(sensor: imu, fault: drop(share: 1.5))", "2:", "a number from 0 to 1"),
        ("(sensor: imu, fault: lose(share: 0.5))", "2:", "lose"),
        ("(sensor: imu, from_s: 3, to_s: 2, fault: freeze)", "2:26", "larger than from_s"),
        ("(sensor: imu, every_s: 3, fault: freeze)", "2:15", "give both or neither"),
        ("(sensor: imu, from_s: 1, every_s: 3, lasts_s: 3, fault: freeze)", "2:38", "smaller than every_s"),
        ("(sensor: imu, to_s: 1e300, fault: freeze)", "2:15", "0 to 1e6 s"),
        ("(sensor: imu, from_s: NaN, fault: freeze)", "2:15", "0 to 1e6 s"),
        ("(sensor: lidar, fault: clip(gyro_deg_per_s: 400))", "2:2", "use `sensor: imu`"),
        ("(sensor: imu, fault: misses(encoding: zero))", "2:2", "use `sensor: lidar`"),
        ("(sensor: both, fault: extrinsics(position_m: (1, 0, 0)))", "2:2", "one fault each"),
        ("(sensor: imu, fault: clip(gyro_deg_per_s: 400, gyro_rad_per_s: 7))", "2:27", "give one of them"),
        ("(sensor: imu, fault: clip(accel_m_per_s2: -1))", "2:22", "above 0"),
        ("(sensor: imu, fault: clip())", "2:", "neither a rate nor a specific force"),
        ("(sensor: imu, fault: spike(gyro_deg_per_s: (1, 2, inf), count: 3))", "2:", "finite"),
        ("(sensor: imu, fault: spike(gyro_deg_per_s: (1, 2, 3)))", "2:22", "needs times_s or count"),
        ("(sensor: imu, fault: spike(gyro_deg_per_s: (1, 2, 3), count: 4000000000))", "2:55", "at most 1e6"),
        ("(sensor: imu, fault: bias_step(gyro_deg_per_s: (1, 2, 3)))", "2:", "give from_s"),
        ("(sensor: imu, fault: clock_jump(jump_s: 1))", "2:", "give from_s"),
        ("(sensor: imu, from_s: 1, fault: clock_jump(jump_s: 1e30))", "2:", "at most 1e8"),
        ("(sensor: lidar, from_s: 1, fault: clock_jump(jump_s: -1))", "2:46", "jump forward"),
        ("(sensor: imu, fault: delay(mean_s: 1e9))", "2:28", "at most 2"),
        ("(sensor: imu, fault: burst(size: 1000000000, spacing_us: 1))", "2:28", "2 to 1000"),
        ("(sensor: imu, fault: cut())", "2:22", "start_s"),
        ("(sensor: imu, fault: thin())", "2:22", "give arrivals_s or file"),
        ("(sensor: imu, fault: thin(arrivals_s: [3, 2]))", "2:27", "not in order"),
        ("(sensor: imu, fault: thin(arrivals_s: [1, 2], repeat_s: 2))", "2:47", "larger than the last"),
        ("(sensor: imu, fault: thin(file: \"missing.txt\"))", "2:27", "missing.txt"),
        ("(sensor: imu, fault: axes(gyro_scale: 0))", "2:22", "above 0"),
    ] {
        // With another fault before it, and its key in a comment, the location must be that of the second fault.
        let Err(first) = simulation(&usual(), Some(list)) else { panic!("{list} is accepted") };
        assert!(first.starts_with(&format!("test.ron:{place}")) && first.contains(words), "{list}: {first}");
        let later = format!(
            "(sensor: imu, fault: clip(gyro_deg_per_s: 1)), // sensor: clip\n(sensor: lidar, fault: drop(share: 0)),\n{list}"
        );
        let Err(error) = simulation(&usual(), Some(&later)) else { panic!("{list} is accepted") };
        assert!(error.starts_with(&format!("test.ron:4:{}", &place[2..])), "{list}: {error}");
    }
    let round = Scenario { lidar: "vlp16".to_owned(), ..usual() };
    let Err(error) = simulation(&round, Some("(sensor: lidar, fault: misses(encoding: zero))")) else {
        panic!("no LaserScan")
    };
    assert!(error.contains("is not planar"), "{error}");
}

#[test]
fn a_file_of_arrival_times_is_checked_line_by_line() {
    let here = tempfile::tempdir().unwrap();
    let place = here.path().join("thin.ron");
    std::fs::write(&place, "(faults: [(sensor: imu, fault: thin(file: \"times.txt\"))])").unwrap();
    let source = Source::read(&place).unwrap();
    let read = |text: &str| {
        std::fs::write(here.path().join("times.txt"), text).unwrap();
        parse::<FaultsSpec>(&source).unwrap().with_files(&source).map_err(|error| error.to_string())
    };
    assert!(read("# times\n0.1\n0.1\n 0.25 # s\n").is_ok());
    for (text, line) in [("0.1\nten\n", 2), ("0.2\n0.1\n", 2), ("nan\n", 1), ("1\n-2\n", 2)] {
        let error = read(text).unwrap_err();
        assert!(error.contains(&format!("times.txt:{line}: ")) && !error.contains("ten"), "{error}");
    }
}
