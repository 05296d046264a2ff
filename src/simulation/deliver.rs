//! Delivery of the events of a motion chunk to the sink, in order of true time.

use super::SimulationError;
use super::measure::Events;
use zsim_base::measurement::Sink;
use zsim_base::time::Stamp;
use zsim_truth::TruthSink;

/// Delivers all events. At equal times the order is: truth, clocks, IMUs, lidar.
pub(super) fn deliver<S: Sink + TruthSink + ?Sized>(events: &Events, sink: &mut S) -> Result<(), SimulationError> {
    let Events { truth, clocks, samples, base_samples, scans, .. } = events;
    let mut at = [0_usize; 5];
    loop {
        let next = [
            time_of(truth, at[0]),
            time_of(clocks, at[1]),
            time_of(samples, at[2]),
            time_of(base_samples, at[3]),
            time_of(scans, at[4]),
        ];
        let Some((kind, now)) = earliest(&next) else { return Ok(()) };
        let index = at[kind];
        at[kind] += 1;
        match kind {
            0 => sink.truth(now, &truth[index].1),
            1 => sink.clock(now, &clocks[index].1),
            2 => sink.imu(now, &samples[index].1),
            3 => sink.base_imu(now, &base_samples[index].1),
            _ => sink.lidar(now, &scans[index].1),
        }
        .map_err(SimulationError::Sink)?;
    }
}

fn time_of<T>(events: &[(Stamp, T)], index: usize) -> Option<Stamp> {
    events.get(index).map(|(stamp, _)| *stamp)
}

/// The kind with the earliest next event (the first of equal ones), and the time.
fn earliest(next: &[Option<Stamp>]) -> Option<(usize, Stamp)> {
    next.iter().enumerate().filter_map(|(kind, at)| at.map(|at| (kind, at))).min_by_key(|(kind, at)| (*at, *kind))
}
