use super::Clock;
use crate::random::Stream;
use crate::time::{Span, Stamp};
use rand_distr::{Distribution, StandardNormal};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Jitter is cut off here, in standard deviations: seven in ten million stamps.
const CUT: f64 = 5.0;

/// The stamps that a clock gives to samples taken evenly by its crystal: with jitter, rounded down, and in order.
///
/// Jitter changes stamps, never the order of samples: a driver passes them on in the order in which they were taken,
/// with stamps that increase strictly. Where jitter would put a stamp before its predecessor's, the two stamps are
/// exchanged: sample `k` gets the `k`-th smallest of all the noisy stamps. Holding each stamp back to its predecessor's
/// instead would make them late on average; sorting leaves the mean of the stamps as it is, so that the clock's offset
/// is what the spec says even where jitter exceeds the period (its spread is then less than the spec's). Two stamps
/// that rounding makes equal are set 1 ns apart.
#[derive(Debug, Clone)]
pub struct Stamper {
    clock: Clock,
    first: Stamp,
    period_s: f64,
    noise: Stream,
    /// Noisy stamps of samples not yet stamped, and of as many after them as could come before.
    ahead: BinaryHeap<Reverse<Stamp>>,
    drawn: u64,
    given: u64,
    last: Option<Stamp>,
}

impl Stamper {
    /// Stamps for samples at `first`, `first + period_s`, ... on the crystal of `clock`.
    pub fn new(clock: Clock, first: Stamp, period_s: f64, noise: Stream) -> Self {
        Self { clock, first, period_s, noise, ahead: BinaryHeap::new(), drawn: 0, given: 0, last: None }
    }

    fn draw(&mut self) -> Stamp {
        let z: f64 = StandardNormal.sample(&mut self.noise);
        let jitter_s = self.clock.jitter_s() * z.clamp(-CUT, CUT);
        let since_first = self.drawn as f64 * self.period_s + jitter_s;
        self.drawn += 1;
        self.first + Span::from_seconds(since_first)
    }
}

impl Iterator for Stamper {
    type Item = Stamp;

    /// The stamp of the next sample; there is always one.
    fn next(&mut self) -> Option<Stamp> {
        // A later sample comes before this one only if their jitters differ by the time between them, 2 CUT sigma at
        // most.
        let reach = (2.0 * CUT * self.clock.jitter_s() / self.period_s).ceil() as u64;
        while self.drawn <= self.given + reach {
            let stamp = self.draw();
            self.ahead.push(Reverse(stamp));
        }
        let Reverse(noisy) = self.ahead.pop()?;
        let rounded = noisy.floor_to(self.clock.resolution());
        let stamp = self.last.map_or(rounded, |last| rounded.max(last + Span::from_nanos(1)));
        self.given += 1;
        self.last = Some(stamp);
        Some(stamp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Seed;
    use crate::sensors::ClockSpec;
    use crate::spec::Source;

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
        assert!(sigma < 10e-3, "sorted stamps spread less: {sigma}");
    }

    #[test]
    fn a_coarse_clock_is_late_by_half_its_resolution() {
        // Samples half-way between ticks, at a period of whole ticks: every one loses exactly half of one.
        assert!(errors_s(0.0, 1.0, 0.025, 100).iter().all(|e| (e + 0.5e-3).abs() < 1e-9));
        let (mean, _) = mean_and_sigma(&errors_s(1.0, 1.0, 0.025, 40_000));
        assert!((mean + 0.5e-3).abs() < 4.0 * 1.05e-3 / 200.0, "{mean}");
    }
}
