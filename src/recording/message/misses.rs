//! Beams without a return, in each way that drivers encode them.
//!
//! REP-117 encodes them as +inf. Others write 0, NaN, `range_max` or more, the origin of a cloud, or a constant that is
//! greater than any range that is measured.

/// Greatest `range_max` that is taken for one, m: some drivers write the greatest float, or leave it 0.
const GREATEST_LIMIT_M: f32 = 10_000.0;

/// Ranges closer to the greatest one than this share of it are equal to it.
const SAME: f32 = 1e-4;

/// The greatest range is an encoding where it is met this many times as often as ranges within [`BELOW`] of it.
const OFTENER: usize = 4;
const BELOW: f32 = 0.05;

/// Least share of beams, and least number of them, that show a constant.
const LEAST_SHARE: f64 = 0.005;
const LEAST_COUNT: usize = 20;

/// Ranges that are kept for finding a constant.
const MOST_KEPT: usize = 1 << 20;

/// The limits of a scanner's ranges, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    least_m: f32,
    beyond_m: f32,
}

impl Limits {
    /// The limits that a scan states, as far as they can be meant; `farthest_m` is the constant that encodes misses.
    pub fn new(range_min_m: f32, range_max_m: f32, farthest_m: Option<f32>) -> Self {
        let least_m = if range_min_m.is_finite() { range_min_m.max(0.0) } else { 0.0 };
        let stated_m =
            if range_max_m > least_m && range_max_m <= GREATEST_LIMIT_M { range_max_m } else { f32::INFINITY };
        let least_m = if least_m > GREATEST_LIMIT_M { 0.0 } else { least_m };
        Self { least_m, beyond_m: farthest_m.map_or(stated_m, |farthest| stated_m.min(farthest * (1.0 - SAME))) }
    }

    /// Whether a beam with this range came back.
    pub fn is_return(&self, range_m: f32) -> bool {
        range_m.is_finite() && range_m > 0.0 && range_m >= self.least_m && range_m < self.beyond_m
    }
}

/// Counts how the beams of a topic's sampled messages encode misses.
#[derive(Debug, Default)]
pub struct Census {
    beams: usize,
    zero: usize,
    not_a_number: usize,
    at_limit: usize,
    limit_m: f32,
    ranges_m: Vec<f32>,
}

impl Census {
    /// Counts a beam of a scan with such limits.
    pub fn add_range(&mut self, range_m: f32, (range_min_m, range_max_m): (f32, f32)) {
        let limits = Limits::new(range_min_m, range_max_m, None);
        if range_m.is_finite() && range_m >= limits.beyond_m {
            self.beams += 1;
            self.at_limit += 1;
            self.limit_m = range_max_m;
        } else {
            self.add_distance(range_m);
        }
    }

    /// Counts a point at such a distance, or a range below the scanner's limit.
    pub fn add_distance(&mut self, distance_m: f32) {
        self.beams += 1;
        if distance_m.is_nan() {
            self.not_a_number += 1;
        } else if distance_m == 0.0 {
            self.zero += 1;
        } else if distance_m.is_finite() && distance_m > 0.0 && self.ranges_m.len() < MOST_KEPT {
            self.ranges_m.push(distance_m);
        }
    }

    /// Counts a point whose coordinates are not finite, as organised clouds have them.
    pub fn add_no_point(&mut self) {
        self.beams += 1;
    }

    /// The constant that encodes misses, m, with how many beams have it; `None` where there is none.
    fn constant(&self) -> Option<(f32, usize)> {
        let greatest = self.ranges_m.iter().copied().fold(0.0, f32::max);
        let at_least = |m: f32| self.ranges_m.iter().filter(|range| **range >= m).count();
        let same = at_least(greatest * (1.0 - SAME));
        let near = at_least(greatest * (1.0 - BELOW)) - same;
        let shown = same >= LEAST_COUNT && same as f64 >= LEAST_SHARE * self.beams as f64 && same >= OFTENER * near;
        // Where nothing else is measured, nothing shows that it is not a wall.
        let others = self.ranges_m.len() - same - near;
        (shown && others * 10 >= same).then_some((greatest, same))
    }

    /// The range at which, or beyond which, a beam is a miss, m, where it is not what `range_max` states.
    pub fn farthest_m(&self) -> Option<f32> {
        self.constant().map(|(range, _)| range)
    }

    /// How misses are encoded, where it is not as REP-117 has it, with the share of the beams.
    pub fn note(&self, topic: &str) -> Option<String> {
        let share = |count: usize| 100.0 * count as f64 / self.beams.max(1) as f64;
        let counted =
            |count: usize, how: String| (count > 0).then(|| format!("{how} ({:.1} % of its beams)", share(count)));
        let constant = self.constant();
        let encodings = [
            counted(self.at_limit, format!("its range_max of {} m or more", self.limit_m)),
            constant.and_then(|(range, count)| counted(count, format!("a constant {range} m"))),
            counted(self.zero, "0".to_owned()),
            counted(self.not_a_number, "NaN".to_owned()),
        ];
        let encodings: Vec<_> = encodings.into_iter().flatten().collect();
        (!encodings.is_empty()).then(|| {
            format!("{topic} encodes beams without a return as {}; they are no walls.", encodings.join(" and as "))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A room of 3 to 6 m with `misses` of 1000 beams at `at` m.
    fn census(misses: usize, at: f32) -> Census {
        let mut census = Census::default();
        for k in 0..1000 {
            census.add_distance(if k < misses { at } else { 3.0 + 3.0 * ((k * 7919) % 1000) as f32 * 1e-3 });
        }
        census
    }

    #[test]
    fn a_constant_is_found_and_a_wall_is_not() {
        assert_eq!(census(100, 81.91).farthest_m(), Some(81.91));
        assert_eq!(census(3, 81.91).farthest_m(), None);
        // The farthest corner of the room itself.
        assert_eq!(census(0, 0.0).farthest_m(), None);
        // Nothing but one distance: a wall round the lidar.
        assert_eq!(census(1000, 2.0).farthest_m(), None);
        assert_eq!(
            census(100, 0.0).note("/scan").unwrap(),
            "/scan encodes beams without a return as 0 (10.0 % of its beams); they are no walls."
        );
    }

    #[test]
    fn limits_that_cannot_be_meant_are_not_used() {
        for absurd in [0.0, -1.0, f32::NAN, f32::INFINITY, f32::MAX, 0.05] {
            let limits = Limits::new(0.1, absurd, None);
            assert!(limits.is_return(50.0) && !limits.is_return(0.05) && !limits.is_return(0.0), "{absurd}");
        }
        let limits = Limits::new(f32::NAN, 30.0, None);
        assert!(limits.is_return(29.9) && [30.0, 65.5, f32::NAN].iter().all(|range| !limits.is_return(*range)));
    }
}
