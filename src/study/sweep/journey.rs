//! Runs that are simulated and estimated.

use super::Measure;
use super::component::{Component, Slot};
use super::measure::Told;
use super::part::Row;
use super::{LimitSpec, Plan, plan::Point};
use crate::estimation::{EstimatorSpec, Status};
use crate::recording::{Preference, Reader, Writer};
use crate::report::IntegrityMetrics;
use crate::simulation::Simulation;
use crate::study::calibration::calibration;
use crate::study::closed_loop::run_closed_loop;
use crate::study::coverage::{Coverage, CoveragePlan, coverage};
use crate::study::integrity::{Integrity, path_length_m};
use crate::study::open_loop::{OpenLoopOptions, run_open_loop};
use crate::study::record::{description, record_together};
use crate::study::{CalibrationSpec, StudyError, Watch, judge};
use std::fs::File;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Recordings that are made at once.
pub(super) const MOST_TAPES: usize = 16;

/// A simulation and its recording, which has no name: it is gone with the process, however that ends.
pub(super) struct Tape {
    simulation: Simulation,
    /// One a thread.
    handles: Vec<File>,
}

/// Runs simulations that share physics and rays, for `readers` threads to read what they recorded. With `recorded`
/// unset there is nothing to read.
pub(super) fn tapes(
    simulations: Vec<Simulation>,
    (recorded, readers): (bool, usize),
    limit: LimitSpec,
) -> Result<Vec<Tape>, StudyError> {
    let without = |simulation| Tape { simulation, handles: Vec::new() };
    if !recorded {
        return Ok(simulations.into_iter().map(without).collect());
    }
    let mut writers = Vec::new();
    let mut handles = Vec::new();
    for simulation in &simulations {
        let file = tempfile::NamedTempFile::new().map_err(StudyError::file(&std::env::temp_dir()))?;
        let open = || file.reopen().map_err(StudyError::file(file.path()));
        handles.push((0..readers).map(|_| open()).collect::<Result<Vec<_>, _>>()?);
        writers.push(Writer::new(open()?, description(simulation, false)?)?);
        // The name goes here; the handles keep what is behind it.
    }
    within(limit, |stop| record_together(&simulations, writers, &Watch { stop, report: &mut |_| {} }))?;
    Ok(simulations.into_iter().zip(handles).map(|(simulation, handles)| Tape { simulation, handles }).collect())
}

impl Tape {
    /// What comes of a run on this recording, read by thread `reader`.
    pub fn row(&self, plan: &Plan, point: &Point, reader: usize) -> Row {
        let told = plan.told();
        let started = Instant::now();
        let row = match self.figures(plan, point, &told, reader) {
            Ok(figures) => Row { figures, ..Row::default() },
            Err(error) => Row::failed_by(told.len(), &error),
        };
        Row { wall_s: Some(started.elapsed().as_secs_f64()), ..row }
    }

    fn figures(
        &self,
        plan: &Plan,
        point: &Point,
        told: &[Measure],
        reader: usize,
    ) -> Result<Vec<Option<f64>>, StudyError> {
        let limit = plan.limit().ok_or_else(|| wrong_kind("limit"))?;
        let is_of = |told_by: Told| told.iter().any(|measure| measure.told() == told_by);
        let swing = match is_of(Told::Swing) || is_of(Told::SwingOrClosedForm) {
            true => Some(self.swing()?),
            false => None,
        };
        let estimated = match self.handles.get(reader).filter(|_| is_of(Told::Estimate)) {
            Some(handle) => {
                let Component::Estimator(estimator) = &plan.filled(&point.changed, Slot::Estimator)?.component else {
                    return Err(wrong_kind("estimator"));
                };
                let file = handle.try_clone().map_err(StudyError::file(&std::env::temp_dir()))?;
                let closes_loops = told.contains(&Measure::ClosedPositionRmseM);
                Some(within(limit, |stop| estimate(file, estimator, closes_loops, stop))?)
            }
            None => None,
        };
        let figure = |measure: &Measure| {
            let by_swing = swing.as_ref().and_then(|seen| of_swing(*measure, seen));
            by_swing.or_else(|| estimated.as_ref().and_then(|estimated| estimated.figure(*measure)))
        };
        Ok(told.iter().map(figure).collect())
    }

    /// What the lidar sees from 5 s on to the run's end, and what the gyroscope makes of it.
    fn swing(&self) -> Result<Coverage, StudyError> {
        let simulation = &self.simulation;
        let usual = CoveragePlan::default();
        let plan = CoveragePlan {
            duration_s: simulation.scenario().duration_s - usual.from_s,
            rate_limit_deg_per_s: simulation.imu().spec().gyro.limit_deg_per_s,
            ..usual
        };
        coverage(simulation.head(), simulation.motion(), simulation.lidar(), &plan, |_| ())
    }
}

fn wrong_kind(what: &str) -> StudyError {
    StudyError::Plan { what: "the plan", message: format!("a journey has no {what}") }
}

fn of_swing(measure: Measure, seen: &Coverage) -> Option<f64> {
    match measure {
        Measure::FractionSeen => Some(seen.fraction_seen),
        Measure::CoveredS => Some(seen.covered_s),
        Measure::DensityPerSrS => Some(seen.density_per_sr_s.mean),
        Measure::FieldOfViewDeg => Some(seen.field_of_view_deg),
        Measure::RateDegPerS => Some(seen.gyro.most_deg_per_s),
        Measure::RateP99DegPerS => Some(seen.gyro.p99_deg_per_s),
        Measure::Saturated => Some(seen.gyro.saturated),
        _ => None,
    }
}

/// An estimate's figures.
struct Estimated {
    open_loop: crate::report::OpenLoopMetrics,
    clock: crate::report::ClockMetrics,
    closed_position_rmse_m: Option<f64>,
    status: Status,
    integrity: IntegrityMetrics,
    way_m: f64,
}

impl Estimated {
    fn figure(&self, measure: Measure) -> Option<f64> {
        let figure = match measure {
            Measure::PositionRmseM => self.open_loop.position_rmse_m,
            Measure::RotationRmseDeg => self.open_loop.rotation_rmse_deg,
            Measure::DriftMPerMin => self.open_loop.drift_m_per_min,
            Measure::YawDriftDegPerMin => self.open_loop.yaw_drift_deg_per_min,
            Measure::ClockRmseS => self.clock.offset_rmse_s,
            Measure::ClosedPositionRmseM => self.closed_position_rmse_m,
            Measure::Status => Some(f64::from(self.status as u8)),
            Measure::AlignedRmseM => self.integrity.aligned_rmse_m,
            Measure::LargestErrorM => self.integrity.largest_error_m,
            Measure::BoundM99 => self.integrity.bound_m_99,
            Measure::WithinBound => self.integrity.within_bound,
            Measure::BoundOverError => self.integrity.bound_over_error,
            Measure::WayM => Some(self.way_m),
            _ => None,
        };
        figure.filter(|figure| figure.is_finite())
    }
}

/// An estimate from a recording, on one thread.
fn estimate(
    recording: File,
    estimator: &EstimatorSpec,
    closes_loops: bool,
    stop: &AtomicBool,
) -> Result<Estimated, StudyError> {
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    alone.install(|| {
        let mut watch = Watch { stop, report: &mut |_| {} };
        let reader = Reader::new("the recording", recording)?;
        let selection = reader.select(&Preference::default())?;
        let found = calibration(&reader, &selection, &CalibrationSpec::default(), None)?;
        let how = OpenLoopOptions { estimator, calibration: &found.calibration, surveying: closes_loops, map: None };
        let run = run_open_loop(&reader, &selection, how, None, None, &mut watch)?;
        let known = judge::compare_with_truth(&reader, (&run.map_from_head, &run.covariances), &mut watch)?;
        let open_loop = judge::open_loop_metrics(&run, known.as_ref(), None);
        let closed = closes_loops.then(|| run_closed_loop(&run, &found.calibration, estimator));
        let map_from_head = closed.as_ref().map_or(&run.map_from_head, |closed| &closed.map_from_head);
        let integrity = Integrity::of(&run, closed.as_ref(), map_from_head);
        let pairs = judge::pairs_of(&reader, map_from_head)?;
        let of_closed = match closed {
            Some(_) => judge::compare_with_truth(&reader, (map_from_head, &[]), &mut watch)?,
            None => None,
        };
        Ok(Estimated {
            open_loop,
            clock: judge::clock_metrics(&run, known.as_ref()),
            closed_position_rmse_m: of_closed.and_then(|known| known.errors).map(|errors| errors.position_rmse_m),
            status: integrity.status(),
            integrity: integrity.metrics(&run, Some(pairs)),
            way_m: path_length_m(map_from_head),
        })
    })
}

/// Does `work`, which is told to stop when it takes longer than it may.
fn within<T>(limit: LimitSpec, work: impl FnOnce(&AtomicBool) -> Result<T, StudyError>) -> Result<T, StudyError> {
    let stop = AtomicBool::new(false);
    let (done, is_done) = channel::<()>();
    let time = Duration::from_secs_f64(limit.time_s.min(1e9));
    let result = std::thread::scope(|scope| {
        let stop = &stop;
        scope.spawn(move || {
            if is_done.recv_timeout(time) == Err(RecvTimeoutError::Timeout) {
                stop.store(true, Ordering::Relaxed);
            }
        });
        let result = work(stop);
        drop(done);
        result
    });
    match result {
        Err(_) if stop.load(Ordering::Relaxed) => Err(StudyError::TooLong { time_s: limit.time_s }),
        result => result,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_takes_longer_than_it_may_is_told_to_stop() {
        let limit = LimitSpec { time_s: 0.05, memory_mib: 1 };
        let forever = |stop: &AtomicBool| {
            while !stop.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(1));
            }
            Err::<(), _>(StudyError::Stopped)
        };
        let error = within(limit, forever).unwrap_err().to_string();
        assert!(error.contains("0.05 s"), "{error}");
        assert_eq!(within(limit, |_| Ok(3)).unwrap(), 3);
    }
}
