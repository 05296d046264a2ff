//! A suite of recordings for other systems: those of the journeys of a plan.

use super::{BaseSpec, Plan, Setting};
use crate::StudyError;
use std::collections::BTreeSet;
use std::path::Path;
use zsim_run::ProgressMonitor;
use zsim_run::record_with_truth_apart;
use zsim_simulation::Simulation;

/// A recording of a suite.
#[derive(Debug, Clone, PartialEq)]
pub struct SuiteRecording {
    /// Name: the number and the settings, in letters, digits, `.`, `_` and `-`.
    pub name: String,
    /// Value of each axis that the recording depends on.
    pub settings: Vec<(String, Setting)>,
    /// Random seed.
    pub seed: u64,
    /// Hash of everything that determines the recording.
    pub identity: String,
    /// Index of its first run in the plan.
    run: u64,
}

impl Plan {
    /// The recordings of the plan, in the order of its runs; runs that differ in the estimator only have the same.
    ///
    /// # Errors
    /// If the runs are not journeys, or if a combination of settings is invalid.
    pub fn suite(&self) -> Result<Vec<SuiteRecording>, StudyError> {
        if !matches!(self.spec().base, BaseSpec::Journey(_)) {
            let message = "a suite of recordings needs a study of journeys".to_owned();
            return Err(StudyError::Plan { what: "benchmark", message });
        }
        let mut known = BTreeSet::new();
        let mut recordings = Vec::new();
        for run in 0..self.runs() {
            let identity = self.journey(run, &self.inputs(run)?)?.recording.to_string();
            if known.insert(identity.clone()) {
                recordings.push(self.suite_recording(run, recordings.len(), identity));
            }
        }
        Ok(recordings)
    }

    fn suite_recording(&self, run: u64, number: usize, identity: String) -> SuiteRecording {
        let names = self.axes().iter().map(|axis| axis.name.clone());
        let settings: Vec<(String, Setting)> = names.zip(self.settings(run)).collect();
        let seed = self.seed(run).unwrap_or_default();
        let words: Vec<String> = settings.iter().map(|(_, setting)| plain(&setting.to_string())).collect();
        SuiteRecording { name: format!("{number:03}-{}-s{seed}", words.join("-")), settings, seed, identity, run }
    }

    /// Simulates a recording of the suite: the measurements to the MCAP file `file`, without the truth, and the true
    /// trajectory of the head to the TUM file `truth`.
    ///
    /// # Errors
    /// When a file cannot be written, the simulation fails or it is stopped.
    pub fn record(
        &self,
        recording: &SuiteRecording,
        file: &Path,
        truth: &Path,
        watch: &mut ProgressMonitor,
    ) -> Result<(), StudyError> {
        let journey = self.journey(recording.run, &self.inputs(recording.run)?)?.inputs;
        Ok(record_with_truth_apart(&Simulation::build(journey.simulation)?, file, truth, watch)?)
    }
}

/// The text as a part of a file name.
fn plain(text: &str) -> String {
    let stem = Path::new(text).file_stem().unwrap_or_default().to_string_lossy();
    let is_plain = |c: char| c.is_ascii_alphanumeric() || ['.', '_'].contains(&c);
    stem.chars().map(|c| if is_plain(c) { c } else { '_' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::spec::{Source, parse};

    #[test]
    fn recordings_have_plain_names_and_do_not_depend_on_the_estimator() {
        let text = r#"(
            base: journey(
                scene: "office", head: "handheld", motion: "hand", lidar: "utm30lx", imu: "3dm_gx2", clock: "drifting",
                estimator: "default", duration_s: 5.0, limit: (time_s: 300.0, memory_mib: 2048),
            ),
            axes: [
                values(path: "scene", values: ["office", "mocap_room"]),
                values(path: "estimator.fixed_views", values: [0, 5]),
            ],
            sampling: grid,
            seeds: [7, 8],
            measures: [position_rmse_m],
        )"#;
        let source = Source::in_memory("suite.ron", text);
        let plan = Plan::new("suite", &parse(&source).unwrap(), &source).unwrap();
        let names: Vec<String> = plan.suite().unwrap().into_iter().map(|recording| recording.name).collect();
        assert_eq!(names, ["000-office-0-s7", "001-office-0-s8", "002-mocap_room-0-s7", "003-mocap_room-0-s8"]);
        assert_eq!(plain("../a b\u{1b}/c d.ron"), "c_d");
    }
}
