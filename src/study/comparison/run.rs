//! The runs of a comparison: each place and seed is simulated once, and estimated by every variant, one thread each.

use super::ledger::Ledger;
use super::{BASE, ComparisonSpec, Measure, PlaceSpec, Row, Setting, Summary, with_setting};
use crate::estimation::{self, EstimationError, EstimatorSpec};
use crate::evaluation::Errors;
use crate::random::Seed;
use crate::recording::{Preference, Reader};
use crate::simulation::{Scenario, Simulation};
use crate::spec::{Source, SpecError, to_text};
use crate::study::calibration::calibration;
use crate::study::closed_loop::run_closed_loop;
use crate::study::open_loop::{How, run_open_loop};
use crate::study::{CalibrationSpec, Stage, StudyError, Watch, judge, record};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;

/// A comparison whose specs are found and checked, ready to run.
#[derive(Debug, Clone)]
pub struct Comparison {
    spec: ComparisonSpec,
    variants: Vec<Variant>,
}

/// Settings with their name.
#[derive(Debug, Clone)]
struct Variant {
    name: String,
    estimator: EstimatorSpec,
}

/// What a folder was begun with; it may be gone on with only by the same.
#[derive(Serialize)]
struct Begun<'a> {
    version: &'static str,
    study: &'a ComparisonSpec,
    estimator: &'a EstimatorSpec,
}

impl Comparison {
    /// Checks `spec`, which `source` says: its names, its settings, and that every place can be simulated.
    ///
    /// # Errors
    /// At the place in the spec that is wrong.
    pub fn new(spec: &ComparisonSpec, source: &Source) -> Result<Self, StudyError> {
        let base = estimation::load(&spec.base.estimator)?;
        let about = |key: &str, message: String| SpecError::about(source, key, message);
        let empty = [
            ("places", spec.places.is_empty()),
            ("seeds", spec.seeds.is_empty()),
            ("measures", spec.measures.is_empty()),
            ("variants", spec.variants.is_empty()),
        ];
        if let Some((key, _)) = empty.iter().find(|(_, empty)| *empty) {
            return Err(about(key, format!("at least one of `{key}` is needed")).into());
        }
        let names = std::iter::once(BASE).chain(spec.variants.iter().map(|variant| variant.name.as_str()));
        let names: Vec<&str> = names.collect();
        let places: Vec<String> = spec.places.iter().map(|place| names_of(place).join(",")).collect();
        for (key, twice) in [("variants", again(&names)), ("places", again(&places)), ("seeds", again(&spec.seeds))] {
            if let Some(twice) = twice {
                return Err(about(key, format!("`{key}` has {twice} more than once")).into());
            }
        }
        let unfit = |name: &&&str| name.is_empty() || name.contains([',', '"', '|', '\n', '\r']);
        if let Some(name) = names.iter().find(unfit) {
            let message =
                format!("\"{name}\" cannot be a name in a table: leave out commas, quotes, bars and new lines");
            return Err(about("variants", message).into());
        }
        let mut variants = vec![Variant { name: BASE.to_owned(), estimator: base.clone() }];
        for variant in &spec.variants {
            let estimator = changed(&base, variant, source)?;
            variants.push(Variant { name: variant.name.clone(), estimator });
        }
        let comparison = Self { spec: spec.clone(), variants };
        for place in &spec.places {
            Simulation::prepare(&comparison.scenario(place, spec.seeds[0]))?;
        }
        Ok(comparison)
    }

    /// How many runs there are in all.
    pub fn runs(&self) -> usize {
        self.spec.places.len() * self.spec.seeds.len() * self.variants.len()
    }

    /// Runs what is missing in `folder`, which is made, and sums up. Each run's figures are in `runs.csv` as soon as they are
    /// known; a folder that was begun by the same comparison is gone on with, whatever stopped it.
    ///
    /// Rows and summary are the same for any number of threads, but for the time that runs took.
    ///
    /// # Errors
    /// When a run fails, a file cannot be written, the folder holds another comparison, or somebody stops it.
    pub fn run(&self, folder: &Path, watch: &mut Watch) -> Result<Summary, StudyError> {
        std::fs::create_dir_all(folder).map_err(StudyError::file(folder))?;
        self.begin(folder)?;
        let mut ledger = Ledger::open(&folder.join("runs.csv"))?;
        let recordings = folder.join("recordings");
        for place in &self.spec.places {
            for seed in &self.spec.seeds {
                self.run_one(place, *seed, &recordings, &mut ledger, watch)?;
            }
        }
        if recordings.exists() {
            std::fs::remove_dir_all(&recordings).map_err(StudyError::file(&recordings))?;
        }
        let rows = ledger.close(|row| self.place_of(row))?;
        let names: Vec<&str> = self.variants.iter().skip(1).map(|variant| variant.name.as_str()).collect();
        Ok(Summary::of(&rows, &names, &self.spec.measures))
    }

    /// Leaves `study.ron` in a new folder, and finds the same in one that was begun.
    fn begin(&self, folder: &Path) -> Result<(), StudyError> {
        let (version, estimator) = (env!("CARGO_PKG_VERSION"), &self.variants[0].estimator);
        let text = to_text(&Begun { version, study: &self.spec, estimator })? + "\n";
        let path = folder.join("study.ron");
        if !path.exists() {
            return std::fs::write(&path, text).map_err(StudyError::file(&path));
        }
        if std::fs::read_to_string(&path).map_err(StudyError::file(&path))? == text {
            return Ok(());
        }
        let message =
            "is of another study, or of other settings: give another folder, or move this one away".to_owned();
        Err(SpecError::plain(path.display().to_string(), message).into())
    }

    /// Simulates a place with a seed, and estimates it by the variants that are missing.
    fn run_one(
        &self,
        place: &PlaceSpec,
        seed: u64,
        recordings: &Path,
        ledger: &mut Ledger,
        watch: &mut Watch,
    ) -> Result<(), StudyError> {
        let [scene, motion] = names_of(place);
        let is_of = |row: &Row| (&row.scene, &row.motion, row.seed) == (&scene, &motion, seed);
        let is_done = |variant: &Variant| ledger.rows().iter().any(|row| is_of(row) && row.variant == variant.name);
        let missing: Vec<&Variant> = self.variants.iter().filter(|variant| !is_done(variant)).collect();
        if missing.is_empty() {
            return Ok(());
        }
        let recording = recordings.join(format!("{scene}-{motion}-{seed}.mcap"));
        if !recording.exists() {
            simulate(&self.scenario(place, seed), &recording, watch)?;
        }
        let (stop, next) = (watch.stop, AtomicUsize::new(0));
        let closes_loops = self.spec.measures.contains(&Measure::ClosedPositionRmseM);
        let (tell, hear) = mpsc::channel();
        std::thread::scope(|scope| {
            for _ in 0..rayon::current_num_threads().min(missing.len()) {
                let (tell, next, missing, recording) = (tell.clone(), &next, &missing, &recording);
                scope.spawn(move || {
                    while let Some(variant) = missing.get(next.fetch_add(1, Ordering::Relaxed)) {
                        let figures = estimate(recording, &variant.estimator, closes_loops, stop);
                        if tell.send((variant.name.clone(), figures)).is_err() {
                            return; // nobody listens: another one failed
                        }
                    }
                });
            }
            drop(tell);
            for (variant, figures) in hear {
                let row = Row { variant, scene: scene.clone(), motion: motion.clone(), seed, figures: figures? };
                ledger.add(row)?;
                let seconds = |runs: usize| runs as f64 * self.spec.base.duration_s;
                watch.progress(Stage::Estimating, seconds(ledger.rows().len()), Some(seconds(self.runs())));
            }
            Ok::<(), StudyError>(())
        })?;
        std::fs::remove_file(&recording).map_err(StudyError::file(&recording))
    }

    fn scenario(&self, place: &PlaceSpec, seed: u64) -> Scenario {
        let base = &self.spec.base;
        Scenario {
            scene: place.scene.clone(),
            motion: place.motion.clone(),
            head: base.head.clone(),
            lidar: base.lidar.clone(),
            imu: base.imu.clone(),
            clock: base.clock.clone(),
            route: None,
            duration_s: base.duration_s,
            seed: Seed(seed),
        }
    }

    /// Where a row stands in the order of the spec: by variant, place and seed.
    fn place_of(&self, row: &Row) -> usize {
        let at = |found: Option<usize>| found.unwrap_or(usize::MAX / 2);
        let variant = at(self.variants.iter().position(|variant| variant.name == row.variant));
        let of_row = |place: &PlaceSpec| names_of(place) == [row.scene.as_str(), &row.motion];
        let place = at(self.spec.places.iter().position(of_row));
        let seed = at(self.spec.seeds.iter().position(|seed| *seed == row.seed));
        let (places, seeds) = (self.spec.places.len(), self.spec.seeds.len());
        variant.saturating_mul(places).saturating_add(place).saturating_mul(seeds).saturating_add(seed)
    }
}

/// The names of scene and motion without folder and ending.
fn names_of(place: &PlaceSpec) -> [String; 2] {
    let stem = |name: &str| Path::new(name).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    [stem(&place.scene), stem(&place.motion)]
}

/// What a list has twice.
fn again<T: PartialEq + std::fmt::Debug>(list: &[T]) -> Option<String> {
    let twice = list.iter().enumerate().find(|(k, x)| list[..*k].contains(x));
    twice.map(|(_, x)| format!("{x:?}"))
}

/// The base's settings with those of a variant.
fn changed(base: &EstimatorSpec, variant: &super::VariantSpec, source: &Source) -> Result<EstimatorSpec, SpecError> {
    let about = |path: &str, message: String| {
        let message = format!("variant \"{}\": {message}", variant.name);
        SpecError::about_after(source, &format!("\"{}\"", variant.name), &format!("\"{path}\""), message)
    };
    let set = |spec: EstimatorSpec, (path, setting): (&String, &Setting)| {
        with_setting(&spec, path, *setting).map_err(|message| about(path, message))
    };
    let estimator = variant.set.iter().try_fold(base.clone(), set)?;
    estimator.check().map_err(|error| match error {
        EstimationError::Setting { key, .. } => about(key, error.to_string()),
        other => about("", other.to_string()),
    })?;
    Ok(estimator)
}

/// Records a run; the file is there when it is whole.
fn simulate(scenario: &Scenario, recording: &Path, watch: &mut Watch) -> Result<(), StudyError> {
    let folder = recording.parent().map_or_else(PathBuf::new, Path::to_path_buf);
    std::fs::create_dir_all(&folder).map_err(StudyError::file(&folder))?;
    let part = folder.join("part.mcap");
    record(&Simulation::prepare(scenario)?, &part, &folder.join("part.tum"), false, watch)?;
    std::fs::rename(&part, recording).map_err(StudyError::file(recording))
}

/// The figures of a recording's estimate, made on one thread.
fn estimate(
    recording: &Path,
    estimator: &EstimatorSpec,
    closes_loops: bool,
    stop: &AtomicBool,
) -> Result<BTreeMap<Measure, f64>, StudyError> {
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    alone.install(|| {
        let mut watch = Watch { stop, tell: &mut |_| {} };
        let reader = Reader::open(recording)?;
        let selection = reader.select(&Preference::default())?;
        let found = calibration(&reader, &selection, &CalibrationSpec::default(), None)?;
        let how = How { estimator, calibration: &found.calibration, surveying: closes_loops };
        let run = run_open_loop(&reader, &selection, how, None, None, &mut watch)?;
        let known = judge::truth_of(&reader, &run.map_from_head, &mut watch)?;
        let open_loop = judge::open_loop_metrics(&run, known.as_ref(), None);
        let clock = judge::clock_metrics(&run, known.as_ref());
        let closed_errors = match closes_loops {
            true => judge::truth_of(&reader, &run_closed_loop(&run, estimator).map_from_head, &mut watch)?,
            false => None,
        }
        .and_then(|known| known.errors);
        let figures = Measure::ALL.map(|measure| {
            let figure = match measure {
                Measure::PositionRmseM => open_loop.position_rmse_m,
                Measure::RotationRmseDeg => open_loop.rotation_rmse_deg,
                Measure::DriftMPerMin => open_loop.drift_m_per_min,
                Measure::YawDriftDegPerMin => open_loop.yaw_drift_deg_per_min,
                Measure::ClockRmseS => clock.offset_rmse_s,
                Measure::ClosedPositionRmseM => closed_errors.as_ref().map(Errors::position_rmse_m),
                Measure::WallS => open_loop.wall_s,
            };
            Some((measure, figure.filter(|figure| figure.is_finite())?))
        });
        Ok(figures.into_iter().flatten().collect())
    })
}
