//! Journeys of a search: what a spring means for coverage, gyroscope and map.

use super::spec::{DesignJourneySpec, DesignSpec};
use crate::StudyError;
use crate::sweep::{
    AxisSpec, BaseSpec, Figures, JourneySpec, LimitSpec, Measure, Plan, Runner, Setting, Shard, SweepSpec,
};
use std::collections::BTreeMap;
use std::path::Path;
use zsim_base::spec::{Named, Source, SpecError, name_from};
use zsim_dynamics::HeadSpec;
use zsim_estimation::Status;

/// The journeys of the heads of a search: a sweep over heads and seeds.
pub(super) struct Journeys {
    sweep: SweepSpec,
    source: Source,
    /// Number of designs to simulate.
    pub designs: usize,
}

/// Figures of a design: means over its journeys.
pub(super) type JourneyFigures = BTreeMap<Measure, f64>;

impl Journeys {
    /// The journeys in `spec`, a part of `design` that is read from `source`, for figures of `measures`.
    ///
    /// The sweep has the measures that need a journey, the verdict if there is an estimate, and the contact of coils.
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
        let mut measures: Vec<Measure> = measures.filter(|measure| measure.needs_journey()).collect();
        if measures.iter().any(|measure| measure.is_of_estimate()) {
            measures.push(Measure::STATUS);
        }
        measures.push(Measure::COIL_CONTACT_S);
        measures.sort_unstable();
        measures.dedup();
        let base = JourneySpec {
            head: design.head.clone(),
            motion: spec.motion.clone(),
            lidar: design.lidar.clone(),
            imu: spec.imu.clone(),
            clock: spec.clock.clone(),
            estimator: spec.estimator.clone(),
            route: spec.route.clone(),
            duration_s: spec.duration_s,
            limit: LimitSpec { time_s: spec.time_limit_s, ..LimitSpec::default() },
            ..JourneySpec::in_scene(&spec.scene)
        };
        let sweep = SweepSpec { seeds: spec.seeds.clone(), measures, ..SweepSpec::of(BaseSpec::Journey(base)) };
        let journeys = Self { sweep, source: source.clone(), designs: spec.designs };
        let own = Named::<HeadSpec>::load(&name_from(source, &design.head))?;
        journeys.plan(&[own])?;
        Ok(journeys)
    }

    /// Simulates and estimates the journeys of heads as a sweep in `folder`, which an interrupted search continues.
    ///
    /// Returns the figures of each head, or why it has none: a journey could not be simulated or estimated, took too long, or
    /// its estimate is lost.
    ///
    /// # Errors
    /// If the folder has the journeys of another search, or if it cannot be written, or if the search is stopped.
    pub fn figures(
        &self,
        heads: &[Named<HeadSpec>],
        folder: &Path,
        anew: bool,
        runner: &Runner<'_>,
    ) -> Result<Vec<Result<JourneyFigures, String>>, StudyError> {
        if heads.is_empty() {
            return Ok(Vec::new());
        }
        let sweep = self.plan(heads)?.write(folder, anew)?;
        sweep.run(Shard::WHOLE, runner)?;
        sweep.merge()?;
        let runs = sweep.outcomes()?;
        Ok(runs.chunks(self.sweep.seeds.len()).map(|runs| self.means(runs)).collect())
    }

    fn plan(&self, heads: &[Named<HeadSpec>]) -> Result<Plan, StudyError> {
        let names = heads.iter().map(|head| Setting::Text(head.name.clone())).collect();
        let axes = vec![AxisSpec::values("head", names)];
        Plan::with_heads("journeys", &SweepSpec { axes, ..self.sweep.clone() }, heads, &self.source)
    }

    /// Means of the measures over the journeys of a head, one for each seed.
    fn means(&self, runs: &[Result<Figures, String>]) -> Result<JourneyFigures, String> {
        let mut means = JourneyFigures::new();
        for (figures, seed) in runs.iter().zip(&self.sweep.seeds) {
            for (measure, value) in self.sweep.measures.iter().zip(figures.as_ref().map_err(Clone::clone)?) {
                if *measure == Measure::STATUS && *value == Some(f64::from(Status::Lost as u8)) {
                    return Err(format!("journey: lost estimate (seed {seed})"));
                }
                let value = value.ok_or_else(|| format!("journey: no {} (seed {seed})", measure.key()))?;
                *means.entry(*measure).or_default() += value / runs.len() as f64;
            }
        }
        Ok(means)
    }
}
