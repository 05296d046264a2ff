//! Detects how drivers encode beams without a return.
//!
//! REP-117 specifies +inf. Drivers also use 0, NaN, `range_max` or more, the origin of a cloud, or a constant greater
//! than any measured range.

/// Maximum credible `range_max`, m: some drivers write the largest float, or 0.
const MAX_RANGE_LIMIT_M: f32 = 10_000.0;

/// Ranges within this fraction of the largest one are equal to it.
const EQUAL_TOLERANCE: f32 = 1e-4;

/// The largest range is an encoding if it is this many times as frequent as ranges below it within the fraction
/// [`NEIGHBOURHOOD`].
const MIN_FREQUENCY_RATIO: usize = 4;
const NEIGHBOURHOOD: f32 = 0.05;

/// Minimum fraction of the beams, and minimum number of them, for a constant to be significant.
const MIN_FRACTION: f64 = 0.005;
const MIN_COUNT: usize = 20;

/// Maximum number of ranges stored for the detection: bounds the memory.
const MAX_RANGES: usize = 1 << 20;

/// Range limits of a scanner, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeLimits {
    min_m: f32,
    max_m: f32,
}

impl RangeLimits {
    /// Valid range limits from the limits that a scan states; `no_return_range_m` is the constant for beams without a
    /// return.
    pub fn new(range_min_m: f32, range_max_m: f32, no_return_range_m: Option<f32>) -> Self {
        let min_m = if range_min_m.is_finite() { range_min_m.max(0.0) } else { 0.0 };
        let stated_m =
            if range_max_m > min_m && range_max_m <= MAX_RANGE_LIMIT_M { range_max_m } else { f32::INFINITY };
        let min_m = if min_m > MAX_RANGE_LIMIT_M { 0.0 } else { min_m };
        Self {
            min_m,
            max_m: no_return_range_m
                .map_or(stated_m, |no_return_m| stated_m.min(no_return_m * (1.0 - EQUAL_TOLERANCE))),
        }
    }

    /// Whether a beam with this range has a return.
    pub fn is_return(&self, range_m: f32) -> bool {
        range_m.is_finite() && range_m > 0.0 && range_m >= self.min_m && range_m < self.max_m
    }
}

/// Counts the encodings of beams without a return in sampled messages of a topic.
#[derive(Debug, Default)]
pub struct NoReturnDetector {
    beams: usize,
    zero: usize,
    not_a_number: usize,
    at_limit: usize,
    limit_m: f32,
    ranges_m: Vec<f32>,
}

impl NoReturnDetector {
    /// Counts a beam of a scan with the stated range limits.
    pub fn add_range(&mut self, range_m: f32, range_min_m: f32, range_max_m: f32) {
        let limits = RangeLimits::new(range_min_m, range_max_m, None);
        if range_m.is_finite() && range_m >= limits.max_m {
            self.beams += 1;
            self.at_limit += 1;
            self.limit_m = range_max_m;
        } else {
            self.add_distance(range_m);
        }
    }

    /// Counts a point at this distance, or a range below the scanner's limit.
    pub fn add_distance(&mut self, distance_m: f32) {
        self.beams += 1;
        if distance_m.is_nan() {
            self.not_a_number += 1;
        } else if distance_m == 0.0 {
            self.zero += 1;
        } else if distance_m.is_finite() && distance_m > 0.0 && self.ranges_m.len() < MAX_RANGES {
            self.ranges_m.push(distance_m);
        }
    }

    /// Counts a point whose coordinates are not finite, as in organised clouds.
    pub fn add_invalid_point(&mut self) {
        self.beams += 1;
    }

    /// Detects the constant range that encodes beams without a return, m.
    ///
    /// Also returns the number of such beams; `None` if there is no constant.
    fn find_constant(&self) -> Option<(f32, usize)> {
        let largest = self.ranges_m.iter().copied().fold(0.0, f32::max);
        let at_least = |m: f32| self.ranges_m.iter().filter(|range| **range >= m).count();
        let same = at_least(largest * (1.0 - EQUAL_TOLERANCE));
        let near = at_least(largest * (1.0 - NEIGHBOURHOOD)) - same;
        let is_significant =
            same >= MIN_COUNT && same as f64 >= MIN_FRACTION * self.beams as f64 && same >= MIN_FREQUENCY_RATIO * near;
        // Without other ranges, the constant could also be a wall.
        let others = self.ranges_m.len() - same - near;
        (is_significant && others * 10 >= same).then_some((largest, same))
    }

    /// Constant range, m, at or above which a beam has no return; `None` if `range_max` or REP-117 applies.
    pub fn no_return_range_m(&self) -> Option<f32> {
        self.find_constant().map(|(range, _)| range)
    }

    /// Describes encodings that deviate from REP-117, with the fraction of the beams; `None` if there are none.
    pub fn note(&self, topic: &str) -> Option<String> {
        let percentage = |count: usize| 100.0 * count as f64 / self.beams.max(1) as f64;
        let counted =
            |count: usize, how: String| (count > 0).then(|| format!("{how} ({:.1} % of its beams)", percentage(count)));
        let constant = self.find_constant();
        let encodings = [
            counted(self.at_limit, format!("its range_max of {} m or more", self.limit_m)),
            constant.and_then(|(range, count)| counted(count, format!("a constant {range} m"))),
            counted(self.zero, "0".to_owned()),
            counted(self.not_a_number, "NaN".to_owned()),
        ];
        let encodings: Vec<_> = encodings.into_iter().flatten().collect();
        (!encodings.is_empty()).then(|| {
            format!("{topic} encodes beams without a return as {}; they are ignored.", encodings.join(" and as "))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A room of 3 to 6 m, in which `no_returns` of 1000 beams have the range `at`, m.
    fn detector(no_returns: usize, at: f32) -> NoReturnDetector {
        let mut detector = NoReturnDetector::default();
        for k in 0..1000 {
            detector.add_distance(if k < no_returns { at } else { 3.0 + 3.0 * ((k * 7919) % 1000) as f32 * 1e-3 });
        }
        detector
    }

    #[test]
    fn a_constant_is_detected_and_a_wall_is_not() {
        assert_eq!(detector(100, 81.91).no_return_range_m(), Some(81.91));
        assert_eq!(detector(3, 81.91).no_return_range_m(), None);
        // Without a constant, the largest range is the farthest corner of the room.
        assert_eq!(detector(0, 0.0).no_return_range_m(), None);
        // A single distance: a wall around the lidar.
        assert_eq!(detector(1000, 2.0).no_return_range_m(), None);
        assert_eq!(
            detector(100, 0.0).note("/scan").unwrap(),
            "/scan encodes beams without a return as 0 (10.0 % of its beams); they are ignored."
        );
    }

    #[test]
    fn implausible_range_limits_are_ignored() {
        for implausible in [0.0, -1.0, f32::NAN, f32::INFINITY, f32::MAX, 0.05] {
            let limits = RangeLimits::new(0.1, implausible, None);
            assert!(limits.is_return(50.0) && !limits.is_return(0.05) && !limits.is_return(0.0), "{implausible}");
        }
        let limits = RangeLimits::new(f32::NAN, 30.0, None);
        assert!(limits.is_return(29.9) && [30.0, 65.5, f32::NAN].iter().all(|range| !limits.is_return(*range)));
    }
}
