//! The run itself: physics, sensors and delivery, one window each at a time, all three at once.

use super::deliver::deliver;
use super::measure::{Events, Sensors, measure};
use super::motion::{HeadMotion, STEP_S, Window, Windows};
use super::{Rig, SimulationError, SimulationSummary};
use crate::measurement::Sink;
use crate::truth::TruthSink;
use std::time::Instant;

/// Instants of motion in a window: half a second.
const BLOCK: u64 = 500;
/// The shortest and the longest run, s.
const DURATION_S: (f64, f64) = (0.1, 1e6);

/// Simulates `rig` carried by `motion`, and gives `sink` what its sensors say and what really happened, in order.
///
/// Three stages work at once on three windows that follow each other: the calling thread delivers one, while rayon's
/// threads take the samples of the next and move the head through the one after it. What is computed depends on none of
/// this: each stage sees its windows in order, and scans of one window, computed in parallel, are gathered in order.
/// Memory holds the windows and no more. `progress` hears the fraction that is delivered.
///
/// # Errors
/// When the run's duration makes no sense, the motion cannot go on, or the sink refuses.
pub fn simulate<S: Sink + TruthSink + ?Sized>(
    rig: &Rig,
    motion: &mut HeadMotion<'_>,
    sink: &mut S,
    progress: &mut dyn FnMut(f64),
) -> Result<SimulationSummary, SimulationError> {
    let summaries = simulate_together(&[*rig], motion, &mut [sink], progress)?;
    Ok(summaries.into_iter().next().unwrap_or_default())
}

/// The same for rigs that differ in the IMUs and the lidar's errors alone, each with a sink of its own: physics and
/// rays are done once. Each sink is given what it would be given alone.
pub(super) fn simulate_together<S: Sink + TruthSink + ?Sized>(
    rigs: &[Rig],
    motion: &mut HeadMotion<'_>,
    sinks: &mut [&mut S],
    progress: &mut dyn FnMut(f64),
) -> Result<Vec<SimulationSummary>, SimulationError> {
    let Some(rig) = rigs.first() else { return Ok(Vec::new()) };
    let (least_s, most_s) = DURATION_S;
    if !(least_s..=most_s).contains(&rig.duration_s) {
        return Err(SimulationError::Duration { duration_s: rig.duration_s, least_s, most_s });
    }
    let started = Instant::now();
    let last = (rig.duration_s / STEP_S).ceil() as u64;
    let overlap = rigs.iter().map(Rig::overlap).max().unwrap_or_default();
    let mut windows = Windows::new(motion, BLOCK, overlap, last);
    let mut sensors: Vec<Sensors> = rigs.iter().map(Sensors::new).collect();
    let blank = SimulationSummary { duration_s: rig.duration_s, ..SimulationSummary::default() };
    let mut summaries = vec![blank; rigs.len()];
    let mut physics_wall_s = 0.0;

    let mut moved = timed(&mut physics_wall_s, || windows.next())?;
    let mut events: Option<Vec<Events>> = None;
    while moved.is_some() || events.is_some() {
        let mut next_moved: Result<Option<Window>, SimulationError> = Ok(None);
        let mut next_events = None;
        let delivered = rayon::in_place_scope(|scope| {
            if let Some(window) = moved.take() {
                scope.spawn(|_| next_moved = timed(&mut physics_wall_s, || windows.next()));
                scope.spawn(|_| next_events = measure(&mut sensors, window, &mut summaries));
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
