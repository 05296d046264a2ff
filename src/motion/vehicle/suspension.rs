//! A body on four sprung wheels: its response to the road and to its own accelerations.
//!
//! The linear full-car model (Wong, Theory of Ground Vehicles, chapter 7): three coordinates of the body q = (heave,
//! roll, pitch), one per wheel; spring and damper between wheel and body; the tyre is a spring.

use crate::sines::SpectralLine;
use nalgebra::{Complex, Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use zsim_base::geometry::STANDARD_GRAVITY_M_PER_S2;
use zsim_base::spec::checked::{NonNegative, Positive};

/// A body on four sprung wheels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SuspensionSpec {
    /// Mass of the body, kg.
    #[serde(with = "Positive")]
    pub body_mass_kg: f64,
    /// Moment of inertia of the body about the forward axis, kg m^2.
    #[serde(with = "Positive")]
    pub roll_inertia_kg_m2: f64,
    /// Moment of inertia of the body about the lateral axis, kg m^2.
    #[serde(with = "Positive")]
    pub pitch_inertia_kg_m2: f64,
    /// Height of the body's centre of mass above the ground, m.
    #[serde(with = "Positive")]
    pub centre_height_m: f64,
    /// Distance from the centre of mass to the front axle, m.
    #[serde(with = "Positive")]
    pub front_m: f64,
    /// Distance from the centre of mass to the rear axle, m.
    #[serde(with = "Positive")]
    pub rear_m: f64,
    /// Distance between the left and the right wheels, m.
    #[serde(with = "Positive")]
    pub track_m: f64,
    /// Unsprung mass per wheel, kg.
    #[serde(with = "Positive")]
    pub wheel_mass_kg: f64,
    /// Stiffness of the spring of a wheel, N/m.
    #[serde(with = "Positive")]
    pub spring_n_per_m: f64,
    /// Damping of a wheel, N s/m.
    #[serde(with = "NonNegative")]
    pub damper_n_s_per_m: f64,
    /// Stiffness of a tyre, N/m.
    #[serde(with = "Positive")]
    pub tyre_n_per_m: f64,
}

impl SuspensionSpec {
    /// Forward and left position of each wheel, m, and the index of the track: 0 left, 1 right.
    fn wheels(&self) -> [(f64, f64, usize); 4] {
        let half = self.track_m / 2.0;
        [(self.front_m, half, 0), (self.front_m, -half, 1), (-self.rear_m, half, 0), (-self.rear_m, -half, 1)]
    }

    /// Response of heave (m), roll and pitch (rad) to the road at constant speed.
    ///
    /// Input: the spectral lines of the two tracks over distance. Output: the lines of the three coordinates over the
    /// distance of the centre of mass.
    pub(super) fn response(&self, road: &[SpectralLine<2>], speed_m_per_s: f64) -> Vec<SpectralLine<3>> {
        let body = |line: &SpectralLine<2>| {
            let height =
                |x: f64, track: usize| line.amplitudes[track] * Complex::from_polar(1.0, TAU * line.cycles * x);
            let rate = TAU * line.cycles * speed_m_per_s;
            SpectralLine { cycles: line.cycles, amplitudes: self.body_at(rate, height).into() }
        };
        road.iter().map(body).collect()
    }

    /// Complex amplitudes of heave, roll and pitch at the angular frequency `rate`; `height(x, track)` is the amplitude
    /// of the road under a wheel.
    ///
    /// A corner of the body at (x, y) moves by `j q` with `j = (1, y, -x)`. With `s = k + i w c` the equation of the
    /// wheel, `-w^2 m_w z_w = k_t (z_r - z_w) - s (z_w - j q)`, gives the force on the body
    /// `s (z_w - j q) = (s k_t / D) z_r - s (1 - s / D) j q`, where `D = k_t + s - w^2 m_w`.
    fn body_at(&self, rate: f64, height: impl Fn(f64, usize) -> Complex<f64>) -> Vector3<Complex<f64>> {
        let real = |x: f64| Complex::new(x, 0.0);
        let s = Complex::new(self.spring_n_per_m, rate * self.damper_n_s_per_m);
        let d = s + self.tyre_n_per_m - self.wheel_mass_kg * rate * rate;
        let (stiffness, push) = (s - s * s / d, s * self.tyre_n_per_m / d);
        let mass = Vector3::new(self.body_mass_kg, self.roll_inertia_kg_m2, self.pitch_inertia_kg_m2);
        let mut dynamic = Matrix3::from_diagonal(&(mass * (-rate * rate))).map(real);
        let mut force = Vector3::zeros();
        for (x, y, track) in self.wheels() {
            let j = Vector3::new(1.0, y, -x).map(real);
            dynamic += j * j.transpose() * stiffness;
            force += j * (push * height(x, track));
        }
        // The matrix is singular only without damping and exactly at a resonance: then the body does not move.
        dynamic.lu().solve(&force).unwrap_or_else(Vector3::zeros)
    }

    /// Roll, rad per m/s^2 to the left, and pitch, rad per m/s^2 forward, quasi-static: the body leans out of a turn
    /// and squats when it speeds up.
    pub(super) fn lean(&self) -> (f64, f64) {
        let corner = self.spring_n_per_m * self.tyre_n_per_m / (self.spring_n_per_m + self.tyre_n_per_m);
        let stiffness =
            |arm: fn((f64, f64, usize)) -> f64| corner * self.wheels().map(arm).map(|a| a * a).iter().sum::<f64>();
        // The weight of the body, above its roll and pitch axes, reduces both stiffnesses by m g h.
        let moment = self.body_mass_kg * self.centre_height_m;
        let falling = moment * STANDARD_GRAVITY_M_PER_S2;
        (moment / (stiffness(|wheel| wheel.1) - falling), -moment / (stiffness(|wheel| wheel.0) - falling))
    }

    /// Whether the springs support the body against the weight.
    pub(super) fn is_stable(&self) -> bool {
        let (roll, pitch) = self.lean();
        roll > 0.0 && pitch < 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn car() -> SuspensionSpec {
        SuspensionSpec {
            body_mass_kg: 1000.0,
            roll_inertia_kg_m2: 400.0,
            pitch_inertia_kg_m2: 1500.0,
            centre_height_m: 0.6,
            front_m: 1.25,
            rear_m: 1.25,
            track_m: 1.5,
            wheel_mass_kg: 40.0,
            spring_n_per_m: 20_000.0,
            damper_n_s_per_m: 1_500.0,
            tyre_n_per_m: 200_000.0,
        }
    }

    #[test]
    fn the_body_follows_long_waves() {
        // Uniform height lifts the body; a slope that rises forward pitches it nose up (negative); a higher left track
        // rolls it to the right.
        let car = car();
        let one = |x: f64| Complex::new(x, 0.0);
        let lifted = car.body_at(1e-6, |_, _| one(0.01));
        let climbing = car.body_at(1e-6, |x, _| one(0.01 * x));
        let tilted = car.body_at(1e-6, |_, track| one(if track == 0 { 0.0075 } else { -0.0075 }));
        assert_relative_eq!((lifted - Vector3::new(0.01, 0.0, 0.0).map(one)).norm(), 0.0, epsilon = 1e-9);
        assert_relative_eq!((climbing - Vector3::new(0.0, 0.0, -0.01).map(one)).norm(), 0.0, epsilon = 1e-9);
        assert_relative_eq!((tilted - Vector3::new(0.0, 0.01, 0.0).map(one)).norm(), 0.0, epsilon = 1e-9);
    }

    #[test]
    fn a_corner_heaves_as_the_quarter_car_does() {
        // With equal wheels it is a quarter car of 250 kg. Transmissibility of the two-mass model: z_b / z_r = k_t s /
        // ((k_t + s - w^2 m_w)(s - w^2 m_b) - s^2).
        let car = car();
        for freq_hz in [0.5, 1.3, 4.0, 11.0, 30.0] {
            let w = TAU * freq_hz;
            let s = Complex::new(20_000.0, w * 1_500.0);
            let wheel = s + 200_000.0 - 40.0 * w * w;
            let exact = s * 200_000.0 / (wheel * (s - 250.0 * w * w) - s * s);
            let heave = car.body_at(w, |_, _| Complex::new(1.0, 0.0))[0];
            assert_relative_eq!((heave - exact).norm(), 0.0, epsilon = 1e-12);
        }
    }

    #[test]
    fn the_body_squats_when_it_speeds_up_and_leans_out_of_a_turn() {
        let (roll, pitch) = car().lean();
        // 4 * 18.18 kN/m * 0.75^2 = 40.9 kN m / rad, less 5.9 of weight; 1000 kg * 0.6 m over that.
        assert_relative_eq!(roll, 600.0 / (4.0 * 18_181.8 * 0.5625 - 5_884.0), epsilon = 1e-6);
        assert!(pitch < 0.0 && car().is_stable());
        assert!(!SuspensionSpec { centre_height_m: 6.0, ..car() }.is_stable());
    }
}
