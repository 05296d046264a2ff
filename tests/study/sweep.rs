//! Sweeps: reproducible tables with any processes, threads and stops, and failures as rows.

use crate::command::run;
use rand::RngExt;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;
use zsim::random::Seed;

const ZSIM: &str = env!("CARGO_BIN_EXE_zsim");

fn run_ok(folder: &Path, arguments: &str) -> String {
    let (code, out, stderr) = run(folder, arguments);
    assert_eq!(code, 0, "`{arguments}`: {stderr}");
    out
}

/// The bytes of the table of results and of its schema.
fn tables(folder: &Path) -> [Vec<u8>; 2] {
    ["table.csv", "table.schema.json"].map(|name| std::fs::read(folder.join(name)).unwrap())
}

/// The cells of a column.
fn column(folder: &Path, name: &str) -> Vec<String> {
    let text = std::fs::read_to_string(folder.join("table.csv")).unwrap();
    let mut lines = text.lines();
    let place = lines.next().unwrap().split(',').position(|cell| cell == name).unwrap();
    lines.map(|line| line.split(',').nth(place).unwrap().to_owned()).collect()
}

fn numbers(folder: &Path, name: &str) -> Vec<f64> {
    column(folder, name).iter().map(|cell| cell.parse().unwrap()).collect()
}

/// Number of finished tasks of the sweep.
fn parts(folder: &Path) -> usize {
    std::fs::read_dir(folder.join("swept/parts")).map_or(0, Iterator::count)
}

/// Starts `run` in a process and kills it some time after `enough` tasks are done. Returns whether it had ended
/// before.
fn run_and_kill(folder: &Path, enough: usize, after: Duration) -> bool {
    let mut child = Command::new(ZSIM)
        .args(["sweep", "run", "--quiet", "--threads", "2", "swept"])
        .current_dir(folder)
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    while parts(folder) < enough && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
    std::thread::sleep(after);
    let ended = child.try_wait().unwrap().is_some();
    child.kill().unwrap();
    child.wait().unwrap();
    ended
}

const SPRINGS: &str = r#"(
    base: spring(head: "handheld", shake: (pitch_deg: 2.0)),
    axes: [
        linear(path: "head.coil_diameter_mm", from: 18.0, to: 34.0),
        log(path: "head.wire_diameter_mm", from: 1.6, to: 4.0),
        values(path: "head.material", values: ["spring_steel", "stainless"]),
    ],
    sampling: sobol(count: 4096),
    measures: [rocking_hz, spring_mass_g, field_of_view_deg],
    front: [(measure: spring_mass_g, aim: least), (measure: field_of_view_deg, aim: most)],
    limits: [(measure: spring_mass_g, least: 30.0)],
)"#;

#[test]
fn a_sweep_is_the_same_in_one_call_in_parts_and_after_kills() {
    let here = tempfile::tempdir().unwrap();
    let at = |name: &str| here.path().join(name);
    std::fs::write(at("springs.ron"), SPRINGS).unwrap();
    run_ok(here.path(), "sweep plan springs.ron -o whole");
    run_ok(here.path(), "sweep run whole --threads 1");
    run_ok(here.path(), "sweep merge whole");

    run_ok(here.path(), "sweep plan springs.ron -o shares");
    for index in [2, 0, 1] {
        run_ok(here.path(), &format!("sweep run shares --threads 2 --index {index} --count 3"));
    }
    let (code, _, stderr) = run(here.path(), "sweep run shares --index 3 --count 3");
    assert!(code == 2 && stderr.contains("counted from 0"), "{stderr}");
    run_ok(here.path(), "sweep merge shares");
    assert!(tables(&at("whole")) == tables(&at("shares")));

    run_ok(here.path(), "sweep plan springs.ron -o swept");
    let mut stream = Seed(7).stream("kills");
    let mut kills = 0;
    // The kill depends on the number of finished tasks, not only on time: a fast machine could finish the sweep first.
    while kills < 10 && !run_and_kill(here.path(), kills, Duration::from_millis(stream.random_range(0..20))) {
        kills += 1;
    }
    assert!(kills > 2, "the sweep ended before the kill");
    let (code, out, _) = run(here.path(), "sweep merge swept --json");
    let left = serde_json::from_str::<Value>(&out).map_or(1, |result| result["status"]["missing"].as_u64().unwrap());
    assert!(code == 3 && left > 0 || code == 0 && left == 0 || code == 2, "{code} {left}");
    run_ok(here.path(), "sweep run swept");
    run_ok(here.path(), "sweep merge swept");
    assert!(tables(&at("whole")) == tables(&at("swept")));

    // Spring mass: m = rho pi^2 D d^2 n / 4.
    let [coil, wire, mass] =
        ["coil_diameter_mm", "wire_diameter_mm", "spring_mass_g"].map(|name| column(&at("whole"), name));
    let material = column(&at("whole"), "material");
    let mut stable = 0;
    for row in (0..4096).filter(|row| !mass[*row].is_empty()) {
        let [coil, wire, mass] = [&coil, &wire, &mass].map(|cells| cells[row].parse::<f64>().unwrap());
        let density = if material[row] == "stainless" { 7900.0 } else { 7850.0 };
        let law = density * std::f64::consts::PI.powi(2) / 4.0 * coil * wire * wire * 12.0 * 1e-6;
        assert!((mass / law - 1.0).abs() < 0.02, "{mass} g, {law} g");
        stable += 1;
    }
    assert!(stable > 1000, "{stable} stable heads");
    // The lightest head would be in the front, but its spring is lighter than the limit.
    let masses: Vec<f64> = mass.iter().filter_map(|cell| cell.parse().ok()).collect();
    let front = std::fs::read_to_string(at("whole").join("front.csv")).unwrap();
    let at_mass = front.lines().next().unwrap().split(',').position(|name| name == "spring_mass_g").unwrap();
    let mass_of = |line: &str| line.split(',').nth(at_mass).unwrap().parse::<f64>().unwrap();
    assert!(front.lines().count() > 1 && masses.iter().any(|mass| *mass < 30.0));
    assert!(front.lines().skip(1).map(mass_of).all(|mass| mass >= 30.0), "{front}");
    let failed = column(&at("whole"), "error").iter().filter(|error| !error.is_empty()).count();
    assert_eq!(stable + failed, 4096, "an unstable head is a row with its error");
    for name in
        ["study.md", "report.html", "trends.csv", "front.csv", "plots/front.png", "plots/effects_rocking_hz.svg"]
    {
        assert!(at("whole").join(name).metadata().unwrap().len() > 100, "{name}");
    }
}

#[test]
fn a_plan_is_continued_and_replaced_only_with_force() {
    let here = tempfile::tempdir().unwrap();
    let few = SPRINGS.replace("4096", "256");
    std::fs::write(here.path().join("a.ron"), &few).unwrap();
    std::fs::write(here.path().join("b.ron"), few.replace("to: 34.0", "to: 33.0")).unwrap();
    run_ok(here.path(), "sweep plan a.ron -o swept");
    run_ok(here.path(), "sweep run swept");
    run_ok(here.path(), "sweep plan a.ron -o swept");
    let out = run_ok(here.path(), "sweep status swept --json");
    assert_eq!(serde_json::from_str::<Value>(&out).unwrap()["done"], 256);
    let (code, _, stderr) = run(here.path(), "sweep plan b.ron -o swept");
    assert!(code == 2 && stderr.contains("another experiment"), "{stderr}");
    run_ok(here.path(), "sweep plan b.ron -o swept --force");
    let out = run_ok(here.path(), "sweep status swept --json");
    assert_eq!(serde_json::from_str::<Value>(&out).unwrap()["done"], 0);
    // Back to the first plan: its finished runs are found by their content.
    run_ok(here.path(), "sweep plan a.ron -o swept --force");
    let out = run_ok(here.path(), "sweep status swept --json");
    assert_eq!(serde_json::from_str::<Value>(&out).unwrap()["done"], 256);
    let (code, _, stderr) = run(here.path(), "sweep run nowhere");
    assert!(code == 2 && stderr.contains("contains no sweep"), "{stderr}");
}

#[test]
fn a_study_continues_for_the_same_spec_and_keeps_files_of_other_origin() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("a.ron"), SPRINGS.replace("4096", "256")).unwrap();
    run_ok(here.path(), "study a.ron -o swept");
    run_ok(here.path(), "study ./a.ron -o swept");
    let foreign = here.path().join("thesis");
    std::fs::create_dir(&foreign).unwrap();
    std::fs::write(foreign.join("table.csv"), "years of work").unwrap();
    for command in ["study a.ron -o thesis", "sweep plan a.ron -o thesis"] {
        let (code, _, stderr) = run(here.path(), command);
        assert!(code == 2 && stderr.contains("another experiment"), "{stderr}");
    }
    assert_eq!(std::fs::read_to_string(foreign.join("table.csv")).unwrap(), "years of work");
    assert_eq!(std::fs::read_dir(&foreign).unwrap().count(), 1, "no file is added");
}

#[test]
fn damaged_and_swapped_parts_are_computed_again() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("a.ron"), SPRINGS.replace("4096", "1000")).unwrap();
    run_ok(here.path(), "study a.ron -o swept");
    let whole = tables(&here.path().join("swept"));
    let parts: Vec<_> =
        std::fs::read_dir(here.path().join("swept/parts")).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(parts.len(), 4, "parts have 250 runs each");
    let damage: [(&dyn Fn(), u64); 3] = [
        (&|| std::fs::write(&parts[0], &std::fs::read(&parts[0]).unwrap()[..1000]).unwrap(), 250),
        (&|| std::fs::write(&parts[1], "").unwrap(), 250),
        (
            &|| {
                let [a, b] = [&parts[0], &parts[1]].map(|path| std::fs::read(path).unwrap());
                std::fs::write(&parts[0], b).unwrap();
                std::fs::write(&parts[1], a).unwrap();
            },
            500,
        ),
    ];
    for (harm, damaged) in damage {
        harm();
        let status = run_ok(here.path(), "sweep status swept --json");
        let status: Value = serde_json::from_str(&status).unwrap();
        assert_eq!((status["missing"].as_u64(), status["damaged"].as_u64()), (Some(damaged), Some(damaged)));
        let (code, _, stderr) = run(here.path(), "sweep merge swept");
        assert_eq!(code, 3, "a merge without the damaged parts must report loss: {stderr}");
        run_ok(here.path(), "sweep run swept");
        run_ok(here.path(), "sweep merge swept");
        assert!(tables(&here.path().join("swept")) == whole);
    }
}

#[test]
fn a_folder_with_parts_of_another_format_is_planned_again_and_computed_again() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("a.ron"), SPRINGS.replace("4096", "250")).unwrap();
    run_ok(here.path(), "study a.ron -o swept");
    let swept = here.path().join("swept");
    let whole = tables(&swept);
    let part = std::fs::read_dir(swept.join("parts")).unwrap().next().unwrap().unwrap().path();
    std::fs::rename(&part, part.with_extension("parquet")).unwrap();
    std::fs::rename(swept.join("points.csv"), swept.join("points.parquet")).unwrap();
    let (code, _, stderr) = run(here.path(), "sweep run swept");
    assert!(code == 2 && stderr.contains("plan the sweep again"), "{stderr}");
    run_ok(here.path(), "sweep plan a.ron -o swept");
    let status: Value = serde_json::from_str(&run_ok(here.path(), "sweep status swept --json")).unwrap();
    assert_eq!((status["missing"].as_u64(), status["damaged"].as_u64()), (Some(250), Some(0)));
    run_ok(here.path(), "study a.ron -o swept");
    assert!(tables(&swept) == whole);
}

#[test]
fn names_in_a_plan_cannot_inject_into_a_slurm_script() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("a.ron"), SPRINGS.replace("4096", "256")).unwrap();
    run_ok(here.path(), "sweep plan a.ron -o swept");
    let plan = here.path().join("swept/plan.ron");
    let text = std::fs::read_to_string(&plan).unwrap();
    let named = |name: &str| {
        assert!(text.contains("name: \"a\""));
        std::fs::write(&plan, text.replacen("name: \"a\"", &format!("name: \"{name}\""), 1)).unwrap();
        run(here.path(), "sweep submit swept --slurm --dry-run")
    };
    let (code, _, stderr) = named("a --uid=0; $(touch b)");
    assert_eq!(code, 0, "{stderr}");
    let script = std::fs::read_to_string(here.path().join("swept/slurm/array.sh")).unwrap();
    assert!(script.contains("#SBATCH --job-name=zsim-a_--uid_0____touch_b_\n"), "{script}");
    let (code, _, stderr) = named("a\\ntouch b\\u{1b}[2J");
    assert!(code == 2 && stderr.contains("control characters") && !stderr.contains('\u{1b}'), "{stderr}");
}

const WALKS: &str = r#"(
    base: journey(
        scene: "mocap_room", head: "handheld", motion: "hand", lidar: "utm30lx", imu: "3dm_gx2", clock: "drifting",
        estimator: "default", duration_s: 7.0, limit: (time_s: 300.0, memory_mib: 2048),
    ),
    axes: [
        values(path: "imu", values: ["3dm_gx2", "tactical"]),
        levels(name: "variant", levels: [
            (name: "base"),
            (name: "the same"),
            (name: "short window", set: { "estimator.window_s": 3.0 }),
        ]),
    ],
    sampling: grid,
    seeds: [3],
    measures: [position_rmse_m, drift_m_per_min, fraction_seen, open_loop_time_ratio, wall_s],
)"#;

#[test]
fn full_runs_share_work_and_give_the_results_of_single_runs() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("walks.ron"), WALKS).unwrap();
    let out = run_ok(here.path(), "sweep plan walks.ron -o swept --json");
    let planned: Value = serde_json::from_str(&out).unwrap();
    // Six runs, two of which equal another, with one simulated motion.
    assert_eq!((planned["points"].as_u64(), planned["tasks"].as_u64()), (Some(6), Some(1)));
    let mut kills = 0;
    while kills < 3 && !run_and_kill(here.path(), kills, Duration::from_millis(500)) {
        kills += 1;
    }
    run_ok(here.path(), "sweep run swept --threads 2");
    run_ok(here.path(), "sweep merge swept");
    assert_eq!(std::fs::read_dir(here.path().join("swept/parts")).unwrap().count(), 4);
    run_ok(here.path(), "study walks.ron -o again --threads 1");
    assert!(tables(&here.path().join("swept")) == tables(&here.path().join("again")));

    let errors = numbers(&here.path().join("swept"), "position_rmse_m");
    assert_eq!(errors[0], errors[1]);
    assert!(errors[0] != errors[2] && errors[0] != errors[3], "{errors:?}");
    // Runs of 7 s are too short for a drift.
    assert!(column(&here.path().join("swept"), "drift_m_per_min").iter().all(String::is_empty));
    for (row, imu) in [(0, "3dm_gx2"), (3, "tactical")] {
        let alone = format!("--scene mocap_room --duration 7s --seed 3 --imu {imu} --out {imu} --json");
        let result: Value = serde_json::from_str(&run_ok(here.path(), &alone)).unwrap();
        // A decimal number may differ in its last digit.
        let one = result["open_loop"]["position_rmse_m"].as_f64().unwrap();
        assert!((one - errors[row]).abs() < 1e-12, "{one} and {}", errors[row]);
    }
}

#[test]
fn a_sweep_shows_which_springs_clash() {
    let here = tempfile::tempdir().unwrap();
    // 12 coils of 3 mm leave gaps of 4 mm minus 0.9 mm by the weight, which close at about 14 degrees.
    let text = zsim::spec::find(zsim::spec::Kind::Head, "handheld").unwrap().text;
    let tight = text.replace("free_length_mm: 120.0", "free_length_mm: 40.0");
    std::fs::write(here.path().join("tight.ron"), tight).unwrap();
    let sweep = two_walks(r#"path: "head", values: ["handheld", "tight.ron"]"#).replace("7.0", "15.0");
    let sweep = sweep.replace("measures: [", "measures: [coil_contact_s, ");
    std::fs::write(here.path().join("springs.ron"), sweep).unwrap();
    run_ok(here.path(), "study springs.ron -o swept");
    let [usual_s, tight_s] = numbers(&here.path().join("swept"), "coil_contact_s")[..] else { panic!() };
    assert_eq!(usual_s, 0.0);
    let alone = "simulate --scene mocap_room --head tight.ron --duration 15s --seed 3 --out tight.mcap --json";
    let result: Value = serde_json::from_str(&run_ok(here.path(), alone)).unwrap();
    let contact = |key: &str| result["coil_contact"][key].as_f64().unwrap();
    // Measures of the swing start at 5 s.
    let (before_s, left_out_s) = ((5.0 - contact("first_t_s")).max(0.0), contact("contact_s") - tight_s);
    assert!(tight_s > 1.0 && (-1e-9..=before_s + 1e-9).contains(&left_out_s), "{} {tight_s}", result["coil_contact"]);
}

/// The spec of two short runs with the values `axis`.
fn two_walks(axis: &str) -> String {
    let (head, rest) = WALKS.split_once("axes: [").unwrap();
    let (_, tail) = rest.split_once("sampling:").unwrap();
    format!("{head}axes: [values({axis})], sampling:{tail}")
}

#[test]
fn a_study_keeps_its_runs_and_its_page_links_to_theirs() {
    let here = tempfile::tempdir().unwrap();
    let kept = here.path().join("kept");
    let walks = two_walks(r#"path: "imu", values: ["3dm_gx2", "tactical"]"#);
    std::fs::write(here.path().join("walks.ron"), walks).unwrap();
    run_ok(here.path(), "study walks.ron -o kept");
    let page = || std::fs::read_to_string(kept.join("report.html")).unwrap();
    assert!(!kept.join("runs").exists() && !page().contains("href=\"runs/"));
    let before = tables(&kept);

    run_ok(here.path(), "sweep run kept --keep-runs");
    run_ok(here.path(), "sweep merge kept");
    let errors = numbers(&kept, "position_rmse_m");
    let identities = column(&kept, "id");
    for (number, error) in errors.iter().enumerate() {
        let address = format!("runs/{number}-{}/report.html", &identities[number][..8]);
        assert!(page().contains(&format!("<a href=\"{address}\">{number}</a>")), "{address}");
        let figures = std::fs::read_to_string(kept.join(&address).with_file_name("metrics.json")).unwrap();
        let figures: Value = serde_json::from_str(&figures).unwrap();
        let repeated = figures["open_loop"]["position_rmse_m"].as_f64().unwrap();
        // A decimal number may differ in its last digit.
        assert!((repeated - error).abs() < 1e-12, "{repeated} and {error}");
    }
    assert!(tables(&kept) == before, "the tables do not depend on the runs that are kept");

    let out: Value = serde_json::from_str(&run_ok(here.path(), "sweep repeat kept --run 1 --out one --json")).unwrap();
    assert!((out["open_loop"]["position_rmse_m"].as_f64().unwrap() - errors[1]).abs() < 1e-12);
    assert!(here.path().join("one/report.html").is_file());
    let (code, _, stderr) = run(here.path(), "sweep repeat kept --run 2");
    assert!(code == 2 && stderr.contains("runs 0 to 1"), "{stderr}");
}

#[test]
fn a_closed_form_is_repeated_with_its_head_and_keeps_no_runs() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("springs.ron"), SPRINGS.replace("count: 4096", "count: 8")).unwrap();
    run_ok(here.path(), "study springs.ron -o swept");
    let masses = column(&here.path().join("swept"), "spring_mass_g");
    let run_of_mass = masses.iter().position(|mass| !mass.is_empty()).unwrap();
    let out = run_ok(here.path(), &format!("sweep repeat swept --run {run_of_mass} --out one --json"));
    let figures: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(figures["spring_mass_g"].as_f64().unwrap().to_string(), masses[run_of_mass]);
    // The head that is written is the one of the run: its spring has this mass.
    let report: Value = serde_json::from_str(&run_ok(here.path(), "spring one/head.ron --json")).unwrap();
    let mass_g: f64 = masses[run_of_mass].parse().unwrap();
    assert!((report["coil"]["mass_g"].as_f64().unwrap() / mass_g - 1.0).abs() < 1e-9, "{report}");
    let (code, _, stderr) = run(here.path(), "study springs.ron -o swept --keep-runs");
    assert!(code == 2 && stderr.contains("only full runs"), "{stderr}");
}

#[test]
fn runs_over_an_axis_of_faults_share_rays() {
    let here = tempfile::tempdir().unwrap();
    let (head, rest) = WALKS.split_once("axes: [").unwrap();
    let (_, tail) = rest.split_once("sampling:").unwrap();
    let axis = r#"values(path: "faults", values: ["none", "imu_dropout_50pct"])"#;
    let spec = format!("{head}axes: [{axis}], sampling:{tail}");
    let spec = spec.replace(r#"clock: "drifting","#, r#"clock: "drifting", faults: "none","#);
    std::fs::write(here.path().join("faults.ron"), spec).unwrap();
    let planned: Value = serde_json::from_str(&run_ok(here.path(), "sweep plan faults.ron -o swept --json")).unwrap();
    assert_eq!((planned["points"].as_u64(), planned["tasks"].as_u64()), (Some(2), Some(1)));
    run_ok(here.path(), "sweep run swept --threads 2");
    run_ok(here.path(), "sweep merge swept");
    let errors = numbers(&here.path().join("swept"), "position_rmse_m");
    assert_ne!(errors[0], errors[1]);
    for (error, faults) in errors.iter().zip(["", " --faults imu_dropout_50pct"]) {
        let alone = format!("--scene mocap_room --duration 7s --seed 3 --out alone --force --json{faults}");
        let (_, out, stderr) = run(here.path(), &alone);
        let figures: Value = serde_json::from_str(&out).unwrap_or_else(|_| panic!("{stderr}"));
        // A decimal number may differ in its last digit.
        let one = figures["open_loop"]["position_rmse_m"].as_f64().unwrap();
        assert!((one - error).abs() < 1e-12, "{one} and {error}");
    }
}

#[test]
fn a_failed_run_is_a_row_and_the_others_continue() {
    let here = tempfile::tempdir().unwrap();
    let spec = WALKS
        .replace(
            r#"values(path: "imu", values: ["3dm_gx2", "tactical"])"#,
            r#"values(path: "head.parts.0.mass_kg", values: [0.21, 2.0])"#,
        )
        .replace(r#"(name: "the same"),"#, "");
    std::fs::write(here.path().join("falls.ron"), &spec).unwrap();
    run_ok(here.path(), "study falls.ron -o falls --threads 2");
    let errors = column(&here.path().join("falls"), "error");
    assert!(errors[0].is_empty() && errors[1].is_empty(), "{errors:?}");
    assert!(errors[2].contains("cannot stand on the spring") && errors[3] == errors[2], "{errors:?}");

    std::fs::write(here.path().join("late.ron"), spec.replace("time_s: 300.0", "time_s: 0.01")).unwrap();
    let (code, _, stderr) = run(here.path(), "study late.ron -o late");
    assert!(code == 1 && stderr.contains("all 4 runs failed: took longer than 0.01 s"), "{code} {stderr}");
    assert!(column(&here.path().join("late"), "error")[0].contains("took longer than 0.01 s"));

    if cfg!(target_os = "linux") {
        std::fs::write(here.path().join("large.ron"), spec.replace("memory_mib: 2048", "memory_mib: 12")).unwrap();
        assert_eq!(run(here.path(), "study large.ron -o large").0, 1);
        let table = std::fs::read_to_string(here.path().join("large/table.csv")).unwrap();
        assert!(table.lines().nth(1).is_some_and(|first| first.contains("memory")), "{table}");
    }
}

#[test]
fn invalid_sweeps_are_errors_with_the_line() {
    let here = tempfile::tempdir().unwrap();
    let wrong = |spec: &str, old: &str, new: &str, words: &[&str]| {
        assert!(spec.contains(old), "{old}");
        let text = spec.replacen(old, new, 1);
        std::fs::write(here.path().join("bad.ron"), &text).unwrap();
        let (code, _, stderr) = run(here.path(), "sweep plan bad.ron -o bad");
        assert_eq!(code, 2, "{new}: {stderr}");
        words.iter().for_each(|word| assert!(stderr.contains(word), "{new}: {stderr}"));
        let (checked, _, _) = run(here.path(), "check bad.ron");
        assert_eq!(checked, 2, "{new}");
        assert!(!here.path().join("bad").exists());
    };
    wrong(SPRINGS, "head.coil_diameter_mm", "head.coil_diameter", &["bad.ron:4:", "coil_diameter_mm", "axis"]);
    wrong(SPRINGS, "head.coil_diameter_mm", "head.mass_kg", &["is ambiguous", "parts.0.block.mass_kg"]);
    wrong(SPRINGS, "head.coil_diameter_mm", "lidar.rate_hz", &["bad.ron:4:", "no setting"]);
    wrong(SPRINGS, "from: 18.0", "from: -1.0", &["bad.ron:4:", "above 0"]);
    wrong(SPRINGS, "from: 1.6", "from: 0.0", &["bad.ron:5:"]);
    wrong(SPRINGS, "\"stainless\"", "\"wood\"", &["bad.ron:6:", "wood"]);
    wrong(SPRINGS, "sobol(count: 4096)", "grid", &["steps"]);
    wrong(SPRINGS, "count: 4096", "count: 0", &["count"]);
    wrong(SPRINGS, "[rocking_hz", "[position_rmse_m", &["does not measure position_rmse_m"]);
    wrong(SPRINGS, "[rocking_hz", "[rocking_hz, rocking_hz", &["more than once"]);
    wrong(WALKS, "seeds: [3]", "seeds: [3, 3]", &["more than once"]);
    wrong(WALKS, "\"tactical\"", "\"nosuch\"", &["no such IMU"]);
    wrong(WALKS, "(name: \"the same\")", "(name: \"base\")", &["more than once"]);
    wrong(WALKS, "(name: \"the same\")", "(name: \"a, b\")", &["commas"]);
    wrong(WALKS, "estimator.window_s", "estimator.windw_s", &["bad.ron:11:", "windw_s"]);
    wrong(WALKS, "\"mocap_room\"", "\"nowhere\"", &["no such scene"]);
    wrong(WALKS, "memory_mib: 2048", "memory_mib: 2048, cores: 2", &["cores"]);
}

#[test]
fn specs_that_a_sweep_names_are_relative_to_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let specs = folder.path().join("specs");
    std::fs::create_dir(&specs).unwrap();
    let text = |name: &str| zsim::spec::find(zsim::spec::Kind::Head, name).unwrap().text;
    std::fs::write(specs.join("mine.ron"), text("handheld")).unwrap();
    std::fs::write(specs.join("other.ron"), text("handheld_2")).unwrap();
    let sweep = r#"(
        base: spring(head: "mine.ron", shake: (pitch_deg: 2.0)),
        axes: [values(path: "head", values: ["mine.ron", "other", "handheld_2"])],
        sampling: grid,
        measures: [rocking_hz],
    )"#;
    std::fs::write(specs.join("heads.ron"), sweep).unwrap();
    run_ok(folder.path(), "sweep plan specs/heads.ron -o swept");
    run_ok(folder.path(), "sweep run swept");
    run_ok(folder.path(), "sweep merge swept");
    let [mine, other, shipped] = numbers(&folder.path().join("swept"), "rocking_hz")[..] else { panic!() };
    assert!(other == shipped && mine != shipped, "{mine} {other} {shipped}");
}

#[test]
fn every_shipped_study_is_valid() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let files = std::fs::read_dir(root.join("specs/studies")).unwrap();
    let files: Vec<_> = files.map(|entry| entry.unwrap().path()).collect();
    let output = Command::new(ZSIM).current_dir(root).arg("check").args(&files).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
