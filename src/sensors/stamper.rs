use super::Clock;
use rand_distr::{Distribution, StandardNormal};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use zsim_base::random::Stream;
use zsim_base::time::{Span, Stamp};

/// Jitter is limited to this many standard deviations: it affects 6 stamps in 10 million.
const MAX_JITTER_SIGMAS: f64 = 5.0;

/// Stamps for samples at the constant period of a clock's crystal: with jitter, rounded down, in order.
///
/// Jitter changes stamps, not the order of samples: a driver delivers samples in the order in which they were taken,
/// with strictly increasing stamps. Sample `k` therefore gets the `k`-th smallest of the noisy stamps. To delay each
/// stamp to its predecessor's instead would bias the mean; sorting leaves the mean unchanged, so that the clock offset
/// matches the spec even where the jitter exceeds the period (the spread is then smaller than in the spec). Where
/// rounding makes two stamps equal, the second is 1 ns later.
#[derive(Debug, Clone)]
pub struct Stamper {
    clock: Clock,
    first: Stamp,
    period_s: f64,
    noise: Stream,
    /// Noisy stamps that are not yet assigned: as many as can precede the stamp of the next sample.
    pending: BinaryHeap<Reverse<Stamp>>,
    generated: u64,
    returned: u64,
    last: Option<Stamp>,
}

impl Stamper {
    /// Stamps for samples at `first`, `first + period_s`, ... on the crystal of `clock`.
    pub fn new(clock: Clock, first: Stamp, period_s: f64, noise: Stream) -> Self {
        Self { clock, first, period_s, noise, pending: BinaryHeap::new(), generated: 0, returned: 0, last: None }
    }

    fn draw(&mut self) -> Stamp {
        let z: f64 = StandardNormal.sample(&mut self.noise);
        let jitter_s = self.clock.jitter_s() * z.clamp(-MAX_JITTER_SIGMAS, MAX_JITTER_SIGMAS);
        let since_first = self.generated as f64 * self.period_s + jitter_s;
        self.generated += 1;
        self.first + Span::from_seconds(since_first)
    }
}

impl Iterator for Stamper {
    type Item = Stamp;

    /// The stamp of the next sample; never `None`.
    fn next(&mut self) -> Option<Stamp> {
        // A later sample gets an earlier stamp only if their jitters differ by the time between them, which is at most
        // 2 MAX_JITTER_SIGMAS sigma.
        let lookahead = (2.0 * MAX_JITTER_SIGMAS * self.clock.jitter_s() / self.period_s).ceil() as u64;
        while self.generated <= self.returned + lookahead {
            let stamp = self.draw();
            self.pending.push(Reverse(stamp));
        }
        let Reverse(noisy) = self.pending.pop()?;
        let rounded = noisy.floor_to(self.clock.resolution());
        let stamp = self.last.map_or(rounded, |last| rounded.max(last + Span::from_nanos(1)));
        self.returned += 1;
        self.last = Some(stamp);
        Some(stamp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ClockSpec;
    use zsim_base::random::Seed;
    use zsim_base::spec::Source;

    fn errors_s(jitter_ms: f64, resolution_ms: f64, period_s: f64, count: usize) -> Vec<f64> {
        let spec = ClockSpec { offset_ms: 0.0, rate_ppm: 0.0, jitter_ms, resolution_ms };
        let clock = Clock::new(&spec, &Source::in_memory("", ""), Stamp::default()).unwrap();
        let first = Stamp::from_nanos(500_000);
        let stamps: Vec<Stamp> = Stamper::new(clock, first, period_s, Seed(7).stream("test")).take(count).collect();
        assert!(stamps.windows(2).all(|pair| pair[0] < pair[1]), "stamps increase strictly");
        stamps.iter().enumerate().map(|(k, stamp)| stamp.seconds_since(first) - k as f64 * period_s).collect()
    }

    fn mean_and_sigma(x: &[f64]) -> (f64, f64) {
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        (mean, (x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len() as f64).sqrt())
    }

    #[test]
    fn small_jitter_is_white_with_the_sigma_of_the_spec() {
        let (mean, sigma) = mean_and_sigma(&errors_s(0.1, 0.0, 0.01, 40_000));
        // Standard errors: 0.1 ms / sqrt(n) and 0.1 ms / sqrt(2 n).
        assert!(mean.abs() < 4.0 * 1e-4 / 200.0, "{mean}");
        assert!((sigma - 1e-4).abs() < 4.0 * 1e-4 / 282.0, "{sigma}");
    }

    #[test]
    fn jitter_as_long_as_the_period_keeps_order_and_mean() {
        let (mean, sigma) = mean_and_sigma(&errors_s(10.0, 0.0, 0.01, 40_000));
        assert!(mean.abs() < 4.0 * 10e-3 / 200.0, "{mean}");
        assert!(sigma < 10e-3, "sorting reduces the spread: {sigma}");
    }

    #[test]
    fn a_coarse_clock_is_late_by_half_its_resolution() {
        // Samples half-way between ticks, with a period of whole ticks: each loses exactly half a tick.
        assert!(errors_s(0.0, 1.0, 0.025, 100).iter().all(|e| (e + 0.5e-3).abs() < 1e-9));
        let (mean, _) = mean_and_sigma(&errors_s(1.0, 1.0, 0.025, 40_000));
        assert!((mean + 0.5e-3).abs() < 4.0 * 1.05e-3 / 200.0, "{mean}");
    }
}
