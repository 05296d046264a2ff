//! The simulation loop: physics, sensors and delivery, pipelined over chunks of motion.

use super::deliver::deliver;
use super::measure::{Events, Sensors, measure};
use super::motion::{HeadMotion, MotionChunk, MotionChunks, STEP_S};
use super::{Rig, SimulationError, SimulationSummary};
use std::time::Instant;
use zsim_base::measurement::Sink;
use zsim_truth::TruthSink;

/// Steps per chunk: 0.5 s.
const CHUNK_STEPS: u64 = 500;
/// Minimum and maximum duration, s.
const DURATION_S: (f64, f64) = (0.1, 1e6);

/// Simulates `rig` on `motion`, and passes measurements and ground truth to `sink` in order of true time.
///
/// Three stages run in parallel on successive chunks: the calling thread delivers one chunk, while rayon's threads
/// measure the next and simulate the motion of the one after. The result does not depend on the timing: each stage
/// processes chunks in order, and scans of a chunk, computed in parallel, are collected in order. Memory holds these
/// three chunks only. `progress` receives the delivered fraction.
///
/// # Errors
/// If the duration is out of range, or the motion or the sink fails.
pub fn simulate<S: Sink + TruthSink + ?Sized>(
    rig: &Rig,
    motion: &mut HeadMotion<'_>,
    sink: &mut S,
    progress: &mut dyn FnMut(f64),
) -> Result<SimulationSummary, SimulationError> {
    let summaries = simulate_together(&[*rig], motion, &mut [sink], progress)?;
    Ok(summaries.into_iter().next().unwrap_or_default())
}

/// As [`simulate`], for rigs that differ only in the IMUs and the lidar errors, with one sink each: physics and rays
/// are computed once. Each sink receives the same data as from a separate run.
pub(super) fn simulate_together<S: Sink + TruthSink + ?Sized>(
    rigs: &[Rig],
    motion: &mut HeadMotion<'_>,
    sinks: &mut [&mut S],
    progress: &mut dyn FnMut(f64),
) -> Result<Vec<SimulationSummary>, SimulationError> {
    let Some(rig) = rigs.first() else { return Ok(Vec::new()) };
    let (min_s, max_s) = DURATION_S;
    if !(min_s..=max_s).contains(&rig.duration_s) {
        return Err(SimulationError::Duration { duration_s: rig.duration_s, min_s, max_s });
    }
    let started = Instant::now();
    let last = (rig.duration_s / STEP_S).ceil() as u64;
    let overlap = rigs.iter().map(Rig::overlap).max().unwrap_or_default();
    let mut chunks = MotionChunks::new(motion, CHUNK_STEPS, overlap, last);
    let mut sensors: Vec<Sensors> = rigs.iter().map(Sensors::new).collect();
    let blank = SimulationSummary { duration_s: rig.duration_s, ..SimulationSummary::default() };
    let mut summaries = vec![blank; rigs.len()];
    let mut physics_wall_s = 0.0;

    let mut moved = timed(&mut physics_wall_s, || chunks.next())?;
    let mut events: Option<Vec<Events>> = None;
    while moved.is_some() || events.is_some() {
        let mut next_moved: Result<Option<MotionChunk>, SimulationError> = Ok(None);
        let mut next_events = None;
        let delivered = rayon::in_place_scope(|scope| {
            if let Some(chunk) = moved.take() {
                scope.spawn(|_| next_moved = timed(&mut physics_wall_s, || chunks.next()));
                scope.spawn(|_| next_events = measure(&mut sensors, chunk, &mut summaries));
            }
            let mut each = events.iter().flatten().zip(sinks.iter_mut());
            each.try_for_each(|(events, sink)| deliver(events, &mut **sink))
        });
        delivered?;
        if let Some(events) = events.iter().flatten().next() {
            progress((events.until_s / rig.duration_s).min(1.0));
        }
        (moved, events) = (next_moved?, next_events);
    }
    let wall_s = started.elapsed().as_secs_f64();
    summaries.iter_mut().for_each(|summary| (summary.physics_wall_s, summary.wall_s) = (physics_wall_s, wall_s));
    Ok(summaries)
}

/// Adds the time that `work` takes to `wall_s`.
fn timed<T>(wall_s: &mut f64, work: impl FnOnce() -> T) -> T {
    let started = Instant::now();
    let result = work();
    *wall_s += started.elapsed().as_secs_f64();
    result
}
