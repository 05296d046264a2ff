use std::ops::{Add, Mul, Sub};

/// A number with its first two time derivatives.
#[derive(Debug, Clone, Copy)]
pub struct Jet {
    pub value: f64,
    pub rate: f64,
    pub acceleration: f64,
}

impl Jet {
    /// Time itself.
    pub fn time(t_s: f64) -> Self {
        Self { value: t_s, rate: 1.0, acceleration: 0.0 }
    }

    pub fn constant(value: f64) -> Self {
        Self { value, rate: 0.0, acceleration: 0.0 }
    }

    /// Chain rule for a function with the value `f` and derivatives `f1`, `f2`.
    fn chain(self, f: f64, f1: f64, f2: f64) -> Self {
        Self { value: f, rate: f1 * self.rate, acceleration: f2 * self.rate * self.rate + f1 * self.acceleration }
    }

    pub fn sin(self) -> Self {
        self.chain(self.value.sin(), self.value.cos(), -self.value.sin())
    }

    pub fn cos(self) -> Self {
        self.chain(self.value.cos(), -self.value.sin(), -self.value.cos())
    }

    pub fn scale(self, by: f64) -> Self {
        self * Self::constant(by)
    }

    /// 0 below 0, 1 above 1, three continuous derivatives: 35 x^4 - 84 x^5 + 70 x^6 - 20 x^7.
    pub fn smoothstep(self) -> Self {
        let x = self.value;
        if x <= 0.0 {
            return Self::constant(0.0);
        }
        if x >= 1.0 {
            return Self::constant(1.0);
        }
        let f = x.powi(4) * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x)));
        let f1 = 140.0 * x.powi(3) * (1.0 - x).powi(3);
        let f2 = 420.0 * x.powi(2) * (1.0 - x).powi(2) * (1.0 - 2.0 * x);
        self.chain(f, f1, f2)
    }

    /// Time integral of `((t - start) / duration).smoothstep()` up to `self`, which must be time plus a constant.
    pub fn ramped_time(self, duration_s: f64) -> Self {
        let x = (self.value / duration_s).clamp(0.0, 1.0);
        let below = x.powi(5) * (7.0 + x * (-14.0 + x * (10.0 - 2.5 * x))) * duration_s;
        let value = below + (self.value - duration_s).max(0.0);
        let rate = Self { value: self.value / duration_s, rate: 1.0 / duration_s, acceleration: 0.0 }.smoothstep();
        Self { value, rate: rate.value, acceleration: rate.rate }
    }
}

impl Add for Jet {
    type Output = Jet;
    fn add(self, o: Jet) -> Jet {
        Jet { value: self.value + o.value, rate: self.rate + o.rate, acceleration: self.acceleration + o.acceleration }
    }
}

impl Sub for Jet {
    type Output = Jet;
    fn sub(self, o: Jet) -> Jet {
        self + o.scale(-1.0)
    }
}

impl Mul for Jet {
    type Output = Jet;
    fn mul(self, o: Jet) -> Jet {
        Jet {
            value: self.value * o.value,
            rate: self.rate * o.value + self.value * o.rate,
            acceleration: self.acceleration * o.value + 2.0 * self.rate * o.rate + self.value * o.acceleration,
        }
    }
}
