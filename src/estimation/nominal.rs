//! Nominal trajectory of the IMU: strapdown integration plus the corrections of all windows so far.

use super::spline::Basis;
use super::strapdown::{Biases, ImuScaleMisalignment, Interval, State};
use zsim_base::geometry::{Matrix, Pose, Rotation, Vector};

/// Nominal trajectory: states at the boundaries of the IMU intervals, in IMU time.
///
/// In IMU time a change of the clock offset does not change the trajectory. In lidar time, the corrections would have to
/// shift the fast motion, which only the IMU measures. Lidar time `tau` corresponds to `u = tau + l(tau)`.
#[derive(Debug, Clone, Default)]
pub(super) struct Nominal {
    times_s: Vec<f64>,
    states: Vec<State>,
    /// Measured angular velocity at the nodes, including the bias, in the IMU frame, rad/s.
    rates: Vec<Vector>,
    intervals: Vec<Interval>,
    /// Rotation vector from the start to the end of each interval, which each pose within it needs.
    turns: Vec<Vector>,
}

/// Pose, velocity and angular velocity of the IMU at a time, in the map frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion {
    pub(super) rotation: Matrix,
    pub(super) position: Vector,
    pub(super) velocity: Vector,
    pub(super) angular_velocity: Vector,
}

impl Nominal {
    /// A trajectory that starts at `start_s` with `state`.
    pub(super) fn starting(start_s: f64, state: State) -> Self {
        let (intervals, turns) = (Vec::new(), Vec::new());
        Self { times_s: vec![start_s], states: vec![state], rates: vec![Vector::zeros()], intervals, turns }
    }

    pub(super) fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    pub(super) fn states(&self) -> &[State] {
        &self.states
    }

    pub(super) fn intervals(&self) -> &[Interval] {
        &self.intervals
    }

    /// Time of the last node, s; minus infinity without nodes.
    pub(super) fn end_s(&self) -> f64 {
        self.times_s.last().copied().unwrap_or(f64::NEG_INFINITY)
    }

    /// State at the last node.
    pub(super) fn end_state(&self) -> &State {
        &self.states[self.states.len() - 1]
    }

    /// Integrates the next interval.
    pub(super) fn extend(&mut self, interval: Interval, biases: &Biases, gravity: &Vector) {
        let (Some(time), Some(state)) = (self.times_s.last(), self.states.last()) else { return };
        let (time, state) = (time + interval.h, state.after(&interval, biases, gravity));
        self.times_s.push(time);
        self.states.push(state);
        // At a boundary the measured rate is about the mean of both sides; the outermost nodes have one side only.
        let half_slope = interval.gyro_slope * (0.5 * interval.h);
        if let Some(rate) = self.rates.last_mut() {
            let from_this = interval.gyro - half_slope;
            *rate = if self.intervals.is_empty() { from_this } else { (*rate + from_this) * 0.5 };
        }
        self.rates.push(interval.gyro + half_slope);
        self.intervals.push(interval);
        self.update_turns_from(self.turns.len());
    }

    /// Computes the turn of each interval from `first` on.
    fn update_turns_from(&mut self, first: usize) {
        self.turns.truncate(first);
        let turn = |ends: &[State]| (ends[0].rotation.inverse() * ends[1].rotation).scaled_axis();
        self.turns.extend(self.states[first..].windows(2).map(turn));
    }

    /// Removes the nodes before `time_s`, except the last one at or before it.
    pub(super) fn forget_before(&mut self, time_s: f64) {
        let keep = self.times_s.partition_point(|t| *t <= time_s).saturating_sub(1);
        self.times_s.drain(..keep);
        self.states.drain(..keep);
        self.rates.drain(..keep);
        self.intervals.drain(..keep);
        self.turns.drain(..keep);
    }

    /// Adds a correction spline to the nodes from `first` on: `R' = exp(dr) R`, `t' = t + dt` (Bosse et al. 2012, eq. 1-2).
    ///
    /// The velocity changes by the derivative of the spline.
    pub(super) fn correct(&mut self, first: usize, curve: impl Fn(usize) -> Correction) {
        for (index, state) in self.states.iter_mut().enumerate().skip(first) {
            let correction = curve(index);
            state.rotation = Rotation::from_scaled_axis(correction.rotation) * state.rotation; // eq. (2)
            state.rotation.renormalize_fast();
            state.position += correction.translation; // eq. (2)
            state.velocity += correction.velocity;
        }
        self.update_turns_from(first.saturating_sub(1));
    }

    /// Corrects the stored readings for scale errors and misalignments; the states do not change.
    pub(super) fn correct_readings(&mut self, scale_misalignment: &ImuScaleMisalignment) {
        for interval in &mut self.intervals {
            *interval = interval.corrected_by(scale_misalignment);
        }
        for rate in &mut self.rates {
            *rate -= scale_misalignment.gyro * *rate;
        }
    }

    /// Rotates the trajectory about `pivot`.
    pub(super) fn rotate(&mut self, rotation: &Rotation, pivot: &Vector) {
        for state in &mut self.states {
            state.rotation = rotation * state.rotation;
            state.position = pivot + rotation * (state.position - pivot);
            state.velocity = rotation * state.velocity;
        }
        self.update_turns_from(0);
    }

    /// Transforms the trajectory by `a_from_b`.
    pub(super) fn move_by(&mut self, a_from_b: &Pose) {
        for state in &mut self.states {
            state.rotation = a_from_b.rotation * state.rotation;
            state.position = a_from_b.rotation * state.position + a_from_b.translation.vector;
            state.velocity = a_from_b.rotation * state.velocity;
        }
        self.update_turns_from(0);
    }

    /// Pose and velocities at `u_s`, trajectory time; constant before the first and after the last node.
    pub(super) fn at(&self, u_s: f64, gyro_bias: &Vector) -> Motion {
        let after = self.times_s.partition_point(|t| *t <= u_s).clamp(1, self.times_s.len().max(2) - 1);
        self.within(after - 1, u_s, gyro_bias)
    }

    /// The same as [`Nominal::at`] for ordered times: `cursor` is the index of the last interval, and is updated.
    pub(super) fn at_cursor(&self, cursor: &mut usize, u_s: f64, gyro_bias: &Vector) -> Motion {
        while *cursor + 2 < self.times_s.len() && self.times_s[*cursor + 1] <= u_s {
            *cursor += 1;
        }
        self.within(*cursor, u_s, gyro_bias)
    }

    /// Cubic Hermite interpolation of the position, and of the rotation vector from the start of the interval.
    fn within(&self, k: usize, u_s: f64, gyro_bias: &Vector) -> Motion {
        if self.intervals.is_empty() {
            let state = &self.states[0];
            let rotation = state.rotation.to_rotation_matrix().into_inner();
            let (velocity, angular_velocity) = (state.velocity, Vector::zeros());
            return Motion { rotation, position: state.position, velocity, angular_velocity };
        }
        let (a, b) = (&self.states[k], &self.states[k + 1]);
        let h = self.times_s[k + 1] - self.times_s[k];
        let x = ((u_s - self.times_s[k]) / h).clamp(0.0, 1.0);
        let (h10, h01, h11) = (x * (1.0 - x) * (1.0 - x), x * x * (3.0 - 2.0 * x), x * x * (x - 1.0));
        let position = a.position + (b.position - a.position) * h01 + (a.velocity * h10 + b.velocity * h11) * h;
        let turn = self.turns[k];
        let (rate_a, rate_b) = (self.rates[k] - gyro_bias, self.rates[k + 1] - gyro_bias);
        // Derivative of the rotation vector at the end: J_r(turn)^-1 rate ~ rate + turn x rate / 2, for a small rotation.
        let rate_end = rate_b + turn.cross(&rate_b) * 0.5;
        let turned = turn * h01 + (rate_a * h10 + rate_end * h11) * h;
        let rotation = (a.rotation * Rotation::from_scaled_axis(turned)).to_rotation_matrix().into_inner();
        Motion {
            rotation,
            position,
            velocity: a.velocity.lerp(&b.velocity, x),
            angular_velocity: rotation * rate_a.lerp(&rate_b, x),
        }
    }
}

/// A pose correction, in the map frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Correction {
    /// Rotation vector, rad.
    pub(super) rotation: Vector,
    /// Translation, m.
    pub(super) translation: Vector,
    /// Derivative of the translation, m/s.
    pub(super) velocity: Vector,
}

impl Correction {
    /// The sum of two small corrections.
    pub(super) fn plus(&self, other: &Self) -> Self {
        Self {
            rotation: self.rotation + other.rotation,
            translation: self.translation + other.translation,
            velocity: self.velocity + other.velocity,
        }
    }

    /// The value of the correction spline; `coefficients` has `[dr, dt]` for each knot from index `first` on.
    pub(super) fn of_spline(basis: &Basis, first: i64, coefficients: &[f64]) -> Self {
        let mut sum = Self { rotation: Vector::zeros(), translation: Vector::zeros(), velocity: Vector::zeros() };
        let from = (basis.first - first) as usize * 6;
        for (a, c) in coefficients[from..from + 24].chunks_exact(6).enumerate() {
            let translation = Vector::new(c[3], c[4], c[5]);
            sum.rotation += Vector::new(c[0], c[1], c[2]) * basis.value[a];
            sum.translation += translation * basis.value[a];
            sum.velocity += translation * basis.rate[a];
        }
        sum
    }
}
