//! Drops: the walker steps down, falls freely, and lands with a shock.

use super::jet::Jet;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use zsim_base::geometry::STANDARD_GRAVITY_M_PER_S2;
use zsim_base::spec::checked::{NonNegative, Positive};

/// A step down: a free fall that ends in a landing shock. The base stays lower by `height_m` afterwards.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DropSpec {
    /// Start of the fall, s.
    #[serde(with = "NonNegative")]
    pub at_s: f64,
    /// Height of the fall, m; the fall lasts `sqrt(2 height / g)`.
    #[serde(with = "Positive")]
    pub height_m: f64,
    /// Duration of the landing shock, s: a shorter landing is harder. The fall sets in over the same time.
    #[serde(with = "Positive")]
    pub landing_s: f64,
}

/// A unit step that starts at 0 and takes `lasts_s`, half a cosine, with derivative and first two integrals.
struct SmoothStep {
    rate: f64,
    level: f64,
    ramp: f64,
    parabola: f64,
}

impl SmoothStep {
    fn at(t_s: f64, lasts_s: f64) -> Self {
        if t_s <= 0.0 {
            return Self { rate: 0.0, level: 0.0, ramp: 0.0, parabola: 0.0 };
        }
        let since_s = t_s - lasts_s;
        if since_s >= 0.0 {
            let (ramp, parabola) = (0.5 * lasts_s, lasts_s * lasts_s * (0.25 - 1.0 / (PI * PI)));
            let parabola = parabola + since_s * (ramp + 0.5 * since_s);
            return Self { rate: 0.0, level: 1.0, ramp: ramp + since_s, parabola };
        }
        let w = PI / lasts_s;
        let (sin, cos) = (w * t_s).sin_cos();
        Self {
            rate: 0.5 * w * sin,
            level: 0.5 * (1.0 - cos),
            ramp: 0.5 * (t_s - sin / w),
            parabola: 0.25 * t_s * t_s + 0.5 * (cos - 1.0) / (w * w),
        }
    }
}

impl DropSpec {
    /// Height of the base relative to the path without the drop, m; negative.
    ///
    /// With the smooth step `s` and the end of the fall `T = sqrt(2 h / g)`,
    /// `z'' = -g (s(t) - s(t - T)) + g T s'(t - T)`: the landing pulse removes the speed `g T` of the fall, and `z`
    /// ends at `-g T^2 / 2 = -h`.
    pub(super) fn at(&self, t_s: f64) -> Jet {
        let g = STANDARD_GRAVITY_M_PER_S2;
        let fall_s = (2.0 * self.height_m / g).sqrt();
        let fall = SmoothStep::at(t_s - self.at_s, self.landing_s);
        let landing = SmoothStep::at(t_s - self.at_s - fall_s, self.landing_s);
        Jet {
            x: g * (fall_s * landing.ramp - fall.parabola + landing.parabola),
            d: g * (fall_s * landing.level - fall.ramp + landing.ramp),
            dd: g * (fall_s * landing.rate - fall.level + landing.level),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drop_falls_freely_and_lands_within_its_time() {
        let drop = DropSpec { at_s: 2.0, height_m: 0.25, landing_s: 0.035 };
        let fall_s = (0.5_f64 / STANDARD_GRAVITY_M_PER_S2).sqrt();
        assert_eq!(drop.at(1.9), Jet::default());
        assert!((drop.at(2.1).dd + STANDARD_GRAVITY_M_PER_S2).abs() < 1e-12, "free fall");
        let end = drop.at(2.0 + fall_s + 0.035);
        assert!((end.x + 0.25).abs() < 1e-12 && end.d.abs() < 1e-12 && end.dd.abs() < 1e-9, "{end:?}");
        let later = drop.at(1000.0);
        assert!((later.x + 0.25).abs() < 1e-8 && later.d.abs() < 1e-9, "{later:?}");
        // The pulse is half a sine of area g T, so its peak is pi / 2 g T / 35 ms; by then half of gravity is
        // compensated.
        let peak = drop.at(2.0 + fall_s + 0.0175).dd;
        let expected = STANDARD_GRAVITY_M_PER_S2 * (fall_s * PI / 2.0 / 0.035 - 0.5);
        assert!((peak - expected).abs() < 1e-9, "{peak}, {expected}");
    }
}
