//! Journeys of a search: what a spring means for coverage, gyroscope and map.

use super::spec::{DesignJourneySpec, DesignSpec};
use crate::StudyError;
use crate::sweep::{Measure, figures, needs};
use std::collections::BTreeMap;
use zsim_base::random::Seed;
use zsim_base::spec::{Named, Source, SpecError, name_from};
use zsim_dynamics::HeadSpec;
use zsim_estimation::Status;
use zsim_run::{RunInputs, run_alone};
use zsim_simulation::{Run, Scenario};

/// The journeys of the heads of a search, one per seed.
pub(super) struct Journeys {
    journeys: Vec<RunInputs>,
    /// The measures of goals and limits, the verdict if there is an estimate, and the contact of coils.
    measures: Vec<Measure>,
    /// Time limit of a simulation, and of each estimate from it, s.
    limit_s: f64,
    /// Number of designs to simulate.
    pub designs: usize,
}

/// Figures of a design: means over its journeys.
pub(super) type JourneyFigures = BTreeMap<Measure, f64>;

impl Journeys {
    /// The journeys in `spec`, a part of `design` that is read from `source`, for figures of `measures`.
    ///
    /// # Errors
    /// If a spec is missing or invalid, or if there are no seeds or designs.
    pub fn load(
        spec: &DesignJourneySpec,
        design: &DesignSpec,
        measures: impl Iterator<Item = Measure>,
        source: &Source,
    ) -> Result<Self, StudyError> {
        if spec.seeds.is_empty() || spec.designs == 0 {
            return Err(SpecError::about(source, "journey", "at least one seed and one design are required").into());
        }
        let estimator = Named::load(&name_from(source, &spec.estimator))?;
        let scenario = Scenario {
            head: design.head.clone(),
            motion: spec.motion.clone(),
            lidar: design.lidar.clone(),
            imu: spec.imu.clone(),
            clock: spec.clock.clone(),
            route: spec.route.clone(),
            duration_s: spec.duration_s,
            ..Scenario::in_scene(&spec.scene)
        };
        let run = Run::load(&scenario.relative_to(source))?;
        let of_seed = |seed: &u64| RunInputs::new(Run { seed: Seed(*seed), ..run.clone() }, estimator.clone());
        let mut measures: Vec<Measure> = measures.filter(|measure| measure.needs_journey()).collect();
        if measures.iter().any(|measure| measure.is_of_estimate()) {
            measures.push(Measure::STATUS);
        }
        measures.push(Measure::COIL_CONTACT_S);
        measures.sort_unstable();
        measures.dedup();
        Ok(Self {
            journeys: spec.seeds.iter().map(of_seed).collect(),
            measures,
            limit_s: spec.time_limit_s,
            designs: spec.designs,
        })
    }

    /// Simulates and estimates the journeys of a head on this thread.
    ///
    /// # Errors
    /// If a journey cannot be simulated or estimated, or exceeds its time limit, or if an estimate is lost.
    pub fn figures(&self, head: &HeadSpec) -> Result<JourneyFigures, StudyError> {
        let mut means = JourneyFigures::new();
        for journey in &self.journeys {
            let mut journey = journey.clone();
            journey.simulation.head.spec = head.clone();
            let results = run_alone(&journey, &needs(&self.measures), self.limit_s)?;
            let values = figures(&results, &self.measures);
            for (measure, value) in self.measures.iter().zip(values) {
                let is_lost = *measure == Measure::STATUS && value == Some(f64::from(Status::Lost as u8));
                let Some(value) = value.filter(|_| !is_lost) else {
                    let Seed(seed) = journey.simulation.seed;
                    let what = if is_lost { "lost estimate".to_owned() } else { format!("no {}", measure.key()) };
                    return Err(StudyError::Plan { what: "journey", message: format!("{what} (seed {seed})") });
                };
                *means.entry(*measure).or_default() += value / self.journeys.len() as f64;
            }
        }
        Ok(means)
    }
}
