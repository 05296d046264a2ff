//! Axis ranges and ticks.

use super::chart::Tick;

/// The range of an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Axis {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Axis {
    /// An axis over the data range, extended on both sides by the fraction `margin` of it; never empty.
    pub(super) fn over((low, high): (f64, f64), margin: f64) -> Self {
        let range = high - low;
        let min_range = 1e-9 * (low.abs() + high.abs()) + 1e-12;
        if range <= min_range {
            let margin = if low == 0.0 { 1.0 } else { low.abs() * 0.5 };
            return Self { low: low - margin, high: high + margin };
        }
        Self { low: low - margin * range, high: high + margin * range }
    }

    /// Rounds each end outwards if the round number is within 2 % of the range: a run of 119.99 s ends at 120.
    pub(super) fn to_round_ends(self) -> Self {
        let range = self.high - self.low;
        let step = round_step(range / 10.0);
        let rounded = |end: f64, round: f64| if (end - round).abs() <= range / 50.0 { round } else { end };
        let low = rounded(self.low, (self.low / step).floor() * step);
        Self { low, high: rounded(self.high, (self.high / step).ceil() * step) }
    }

    /// Relative position of `value` on the axis: 0 at the low end, 1 at the high end.
    pub(super) fn fraction(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    /// About `wanted` ticks at round numbers, with labels of equal decimals.
    pub(super) fn ticks(&self, wanted: usize) -> Vec<Tick> {
        let step = round_step((self.high - self.low) / wanted.max(1) as f64);
        let decimals = decimals_of(step);
        let tolerance = step * 1e-6;
        let (first, last) =
            (((self.low - tolerance) / step).ceil() as i64, ((self.high + tolerance) / step).floor() as i64);
        (first..=last).map(|k| k as f64 * step).map(|at| Tick { at, label: label(at, decimals) }).collect()
    }
}

/// The smallest number of the form 1, 2, 2.5 or 5 times a power of ten that is at least `step`.
fn round_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    let mantissa = [1.0, 2.0, 2.5, 5.0].into_iter().find(|m| *m * power >= step * (1.0 - 1e-9));
    mantissa.unwrap_or(10.0) * power
}

/// Number of decimals that represent the multiples of `step` exactly.
fn decimals_of(step: f64) -> usize {
    (0..12).find(|d| ((step * 10_f64.powi(*d)).round() - step * 10_f64.powi(*d)).abs() < 1e-6).unwrap_or(12) as usize
}

/// Formats a number with at most three significant digits, without an exponent.
pub(super) fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return label(value, 0);
    }
    let power = value.abs().log10().floor() as i32;
    let decimals = (1 - power).clamp(0, 9) as usize;
    let unit = 10_f64.powi(power - 2);
    label(if unit > 1.0 { (value / unit).round() * unit } else { value }, decimals)
}

/// Formats a number with the minus sign U+2212, and zero without a sign.
fn label(value: f64, decimals: usize) -> String {
    let digits = format!("{:.decimals$}", value.abs());
    if value < 0.0 && digits.bytes().any(|c| (b'1'..=b'9').contains(&c)) { format!("\u{2212}{digits}") } else { digits }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64, wanted: usize) -> Vec<String> {
        Axis { low, high }.ticks(wanted).into_iter().map(|tick| tick.label).collect()
    }

    #[test]
    fn ticks_are_round_numbers_with_equal_decimals() {
        assert_eq!(labels(0.0, 120.0, 6), ["0", "20", "40", "60", "80", "100", "120"]);
        assert_eq!(labels(-0.31, 0.27, 5), ["\u{2212}0.2", "0.0", "0.2"]);
        assert_eq!(labels(0.0, 1.1, 5), ["0.00", "0.25", "0.50", "0.75", "1.00"]);
        assert_eq!(labels(1e4, 3.1e4, 4), ["10000", "20000", "30000"]);
    }

    #[test]
    fn short_numbers_have_two_or_three_digits() {
        let numbers = [0.0, 0.012_34, 8.54, 782.3, 24_960.0, -1456.0];
        assert_eq!(numbers.map(short), ["0", "0.012", "8.5", "782", "25000", "\u{2212}1460"]);
    }

    #[test]
    fn an_end_close_to_a_round_number_is_rounded() {
        assert_eq!(Axis { low: 0.0, high: 119.99 }.to_round_ends(), Axis { low: 0.0, high: 120.0 });
        assert_eq!(Axis { low: 0.0, high: 113.0 }.to_round_ends(), Axis { low: 0.0, high: 113.0 });
    }

    #[test]
    fn an_axis_over_a_single_value_is_not_empty() {
        let axis = Axis::over((3.0, 3.0), 0.05);
        assert!(axis.low < 3.0 && axis.high > 3.0);
        assert!(Axis::over((0.0, 0.0), 0.05).high > 0.0);
    }
}
