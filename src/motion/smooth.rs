//! Piecewise constant or linear motion, smoothed by convolution with a kernel.
//!
//! The kernel is the triweight `k(u) = 35/32 (1 - u^2)^3` on -1..1, scaled to a half-width in time. The smoothed value
//! is a moving average: it stays within the range (a position: the convex hull) of the input and depends on a bounded
//! interval. A path of straight segments, and a level that changes in steps, get three continuous derivatives.

use super::jet::Jet;
use zsim_base::geometry::Vector;

/// Maximum of the kernel, at the centre. The peak rate of a smoothed unit step is this divided by the half-width.
pub(super) const PEAK: f64 = 35.0 / 32.0;

/// Deviation of a smoothed corner with a unit change of slope, in half-widths: the value of the ramp at the corner.
#[cfg(test)]
pub(super) const CORNER_CUT: f64 = 35.0 / 256.0;

/// A unit step at `centre_s`, smoothed over `half_s` on either side.
fn step(t_s: f64, centre_s: f64, half_s: f64) -> Jet {
    let u = (t_s - centre_s) / half_s;
    if u <= -1.0 {
        return Jet::constant(0.0);
    }
    if u >= 1.0 {
        return Jet::constant(1.0);
    }
    let u2 = u * u;
    let bump = 1.0 - u2;
    Jet {
        x: 0.5 + PEAK * u * (1.0 - u2 * (1.0 - u2 * (0.6 - u2 / 7.0))),
        d: PEAK * bump * bump * bump / half_s,
        dd: -6.0 * PEAK * u * bump * bump / (half_s * half_s),
    }
}

/// Rate of a unit step at `centre_s`, smoothed over `half_s` on either side: the kernel itself.
fn bump(t_s: f64, centre_s: f64, half_s: f64) -> Jet {
    let u = (t_s - centre_s) / half_s;
    if u.abs() >= 1.0 {
        return Jet::constant(0.0);
    }
    let (u2, bump) = (u * u, 1.0 - u * u);
    let rate = PEAK / half_s;
    Jet {
        x: rate * bump * bump * bump,
        d: -6.0 * rate * u * bump * bump / half_s,
        dd: -6.0 * rate * bump * (1.0 - 5.0 * u2) / (half_s * half_s),
    }
}

/// Ramp of unit slope from `centre_s` on, smoothed over `half_s` on either side, minus the unsmoothed ramp.
fn ramp_rounding(t_s: f64, centre_s: f64, half_s: f64) -> Jet {
    let u = (t_s - centre_s) / half_s;
    if u.abs() >= 1.0 {
        return Jet::constant(0.0);
    }
    let slope = step(t_s, centre_s, half_s);
    let u2 = u * u;
    let even = 0.5 - u2 * (0.25 - u2 * (0.1 - u2 / 56.0));
    let smooth = 0.5 * u + PEAK * u2 * even + 35.0 / 256.0;
    let (sharp, sharp_slope) = if u >= 0.0 { (u, 1.0) } else { (0.0, 0.0) };
    Jet { x: (smooth - sharp) * half_s, d: slope.x - sharp_slope, dd: slope.d }
}

/// A piecewise constant level with smoothed steps.
#[derive(Debug, Clone, Default)]
pub(super) struct SmoothSteps {
    centres_s: Vec<f64>,
    halves_s: Vec<f64>,
    changes: Vec<f64>,
    /// The level before each step, and after the last one: one more than there are steps.
    levels: Vec<f64>,
    widest_s: f64,
}

impl SmoothSteps {
    /// A level that stays at `level`.
    pub fn from_level(level: f64) -> Self {
        Self { levels: vec![level], ..Self::default() }
    }

    /// Adds a step of `change` centred on `centre_s`, which must not precede the previous step.
    pub fn push(&mut self, centre_s: f64, half_s: f64, change: f64) {
        self.centres_s.push(centre_s);
        self.halves_s.push(half_s);
        self.changes.push(change);
        self.levels.push(self.last() + change);
        self.widest_s = self.widest_s.max(half_s);
    }

    /// The level after the last step.
    pub fn last(&self) -> f64 {
        self.levels.last().copied().unwrap_or_default()
    }

    /// The level at `t_s`.
    pub fn at(&self, t_s: f64) -> Jet {
        let first = self.first_near(t_s);
        let before = self.levels.get(first).copied().unwrap_or_default();
        self.sum_near(first, t_s, Jet::constant(before), step)
    }

    /// Rate of change of the level at `t_s`, with two further derivatives.
    pub fn rate_at(&self, t_s: f64) -> Jet {
        self.sum_near(self.first_near(t_s), t_s, Jet::default(), bump)
    }

    /// Index of the first step that may still be in progress at `t_s`.
    fn first_near(&self, t_s: f64) -> usize {
        self.centres_s.partition_point(|centre| centre + self.widest_s <= t_s)
    }

    fn sum_near(&self, first: usize, t_s: f64, start: Jet, form: fn(f64, f64, f64) -> Jet) -> Jet {
        let mut sum = start;
        for k in first..self.centres_s.len() {
            if self.centres_s[k] - self.widest_s >= t_s {
                break;
            }
            sum += form(t_s, self.centres_s[k], self.halves_s[k]) * self.changes[k];
        }
        sum
    }
}

/// A path of straight segments at constant velocity, smoothed; at rest before the first knot and after the last.
#[derive(Debug, Clone)]
pub(super) struct SmoothPath {
    half_s: f64,
    times_s: Vec<f64>,
    points: Vec<Vector>,
    /// Velocity from each knot to the next, m/s; zero after the last.
    velocities: Vec<Vector>,
}

impl SmoothPath {
    /// A path that stays at `start` until `from_s`, smoothed over `half_s` on either side.
    pub fn new(start: Vector, from_s: f64, half_s: f64) -> Self {
        Self { half_s, times_s: vec![from_s], points: vec![start], velocities: vec![Vector::zeros()] }
    }

    /// Adds a segment to `point` that takes `duration_s`, above zero.
    pub fn move_to(&mut self, point: Vector, duration_s: f64) {
        let last = self.points.len() - 1;
        self.velocities[last] = (point - self.points[last]) / duration_s;
        self.times_s.push(self.times_s[last] + duration_s);
        self.points.push(point);
        self.velocities.push(Vector::zeros());
    }

    /// Time of the last knot, s.
    pub fn end_s(&self) -> f64 {
        self.times_s[self.times_s.len() - 1]
    }

    /// Position of the last knot, m.
    pub fn end(&self) -> Vector {
        self.points[self.points.len() - 1]
    }

    /// Number of knots.
    pub fn knots(&self) -> usize {
        self.times_s.len()
    }

    /// Speed along the path as a fraction of `full_m_per_s`, smoothed with the same kernel.
    pub fn speed_fraction(&self, full_m_per_s: f64) -> SmoothSteps {
        let mut fraction = SmoothSteps::from_level(0.0);
        for (time_s, velocity) in self.times_s.iter().zip(&self.velocities) {
            let change = velocity.norm() / full_m_per_s - fraction.last();
            if change != 0.0 {
                fraction.push(*time_s, self.half_s, change);
            }
        }
        fraction
    }

    /// Distance along the path, m: a straight path on the first axis with the same timing.
    pub fn odometer(&self) -> SmoothPath {
        let mut odometer = Self::new(Vector::zeros(), self.times_s[0], self.half_s);
        for (points, times) in self.points.windows(2).zip(self.times_s.windows(2)) {
            let led_m = odometer.end().x + (points[1] - points[0]).norm();
            odometer.move_to(Vector::new(led_m, 0.0, 0.0), times[1] - times[0]);
        }
        odometer
    }

    /// Position at `t_s`, m.
    pub fn at(&self, t_s: f64) -> [Jet; 3] {
        let after = self.times_s.partition_point(|time| *time <= t_s);
        let mut position = self.straight(after, t_s);
        let first = self.times_s[..after].iter().rposition(|time| *time <= t_s - self.half_s).map_or(0, |k| k + 1);
        for k in first..self.times_s.len() {
            if self.times_s[k] >= t_s + self.half_s {
                break;
            }
            let before = if k == 0 { Vector::zeros() } else { self.velocities[k - 1] };
            let change = self.velocities[k] - before;
            let rounding = ramp_rounding(t_s, self.times_s[k], self.half_s);
            for (axis, part) in position.iter_mut().enumerate() {
                *part += rounding * change[axis];
            }
        }
        position
    }

    /// Position without smoothing; `after` is the number of knots at or before `t_s`.
    fn straight(&self, after: usize, t_s: f64) -> [Jet; 3] {
        match after.checked_sub(1) {
            None => std::array::from_fn(|axis| Jet::constant(self.points[0][axis])),
            Some(k) => {
                let since_s = t_s - self.times_s[k];
                let (point, velocity) = (&self.points[k], &self.velocities[k]);
                std::array::from_fn(|axis| Jet::linear(since_s, velocity[axis], point[axis]))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Simpson's rule for the convolution of `f` with the kernel of half-width `half` at `t`.
    fn smoothed(f: impl Fn(f64) -> f64, t: f64, half: f64) -> f64 {
        let n = 20_000;
        let h = 2.0 / f64::from(n);
        let term = |k: i32| {
            let u = -1.0 + h * f64::from(k);
            let weight = if k == 0 || k == n { 1.0 } else { 2.0 + 2.0 * f64::from(k % 2) };
            weight * PEAK * (1.0 - u * u).powi(3) * f(t - half * u)
        };
        (0..=n).map(term).sum::<f64>() * h / 3.0
    }

    #[test]
    fn closed_forms_are_the_convolutions() {
        let mut steps = SmoothSteps::from_level(1.0);
        steps.push(1.0, 0.5, 2.0);
        steps.push(1.3, 0.5, -0.7);
        let sharp = |t: f64| 1.0 + if t >= 1.0 { 2.0 } else { 0.0 } - if t >= 1.3 { 0.7 } else { 0.0 };
        let mut path = SmoothPath::new(Vector::zeros(), 1.0, 0.5);
        path.move_to(Vector::new(2.0, 0.0, 0.0), 1.0);
        path.move_to(Vector::new(2.0, -0.3, 0.0), 0.2);
        let sharp_y = |t: f64| -0.3 * ((t - 2.0) / 0.2).clamp(0.0, 1.0);
        for k in 0..60 {
            let t = 0.4 + 0.043 * f64::from(k);
            assert_relative_eq!(steps.at(t).x, smoothed(sharp, t, 0.5), epsilon = 2e-4);
            assert_relative_eq!(path.at(t)[0].x, smoothed(|s| 2.0 * (s - 1.0).clamp(0.0, 1.0), t, 0.5), epsilon = 1e-7);
            assert_relative_eq!(path.at(t)[1].x, smoothed(sharp_y, t, 0.5), epsilon = 1e-7);
        }
    }

    #[test]
    fn a_corner_is_cut_by_a_known_distance() {
        // At the corner the smoothed ramp deviates by half_s * E[max(0, u)] = half_s * 35/256 along the change of
        // velocity.
        let mut path = SmoothPath::new(Vector::zeros(), 0.0, 0.8);
        path.move_to(Vector::new(2.0, 0.0, 0.0), 2.0);
        path.move_to(Vector::new(2.0, 2.0, 0.0), 2.0);
        let at_corner = path.at(2.0);
        assert_relative_eq!(2.0 - at_corner[0].x, 0.8 * CORNER_CUT, epsilon = 1e-14);
        assert_relative_eq!(at_corner[1].x, 0.8 * CORNER_CUT, epsilon = 1e-14);
        assert_relative_eq!(at_corner[1].dd, PEAK / 0.8, epsilon = 1e-14);
    }

    #[test]
    fn the_rate_of_a_level_is_its_derivative() {
        let mut steps = SmoothSteps::from_level(0.3);
        steps.push(1.0, 0.5, 2.0);
        let h = 1e-4;
        for k in 0..30 {
            let t = 0.45 + 0.04 * f64::from(k);
            let (level, rate) = (steps.at(t), steps.rate_at(t));
            assert_relative_eq!(rate.x, level.d, epsilon = 1e-12);
            assert_relative_eq!(rate.d, level.dd, epsilon = 1e-11);
            let change = (steps.rate_at(t + h).d - steps.rate_at(t - h).d) / (2.0 * h);
            assert_relative_eq!(rate.dd, change, epsilon = 1e-2);
        }
    }

    #[test]
    fn steps_of_different_widths_add_up() {
        let mut steps = SmoothSteps::from_level(0.0);
        steps.push(1.0, 2.0, 1.0);
        steps.push(1.5, 0.1, 1.0);
        let expected = |t: f64| step(t, 1.0, 2.0).x + step(t, 1.5, 0.1).x;
        for k in 0..80 {
            let t = -1.5 + 0.07 * f64::from(k);
            assert_relative_eq!(steps.at(t).x, expected(t), epsilon = 1e-14);
        }
        assert_relative_eq!(steps.at(10.0).x, 2.0);
        assert_relative_eq!(steps.at(-10.0).x, 0.0);
    }
}
