//! The load at which a coil spring buckles.

use super::Coil;
use std::f64::consts::PI;

/// The buckling load of a coil with clamped base and guided top, N.
///
/// Guided: free to translate sideways, not to rotate. The condition is `q L = pi` with `q^2 = P (1 + P/S) / B` and the
/// length L under the load. `None` if the coil reaches the solid length without buckling.
pub fn buckling_load_n(coil: &Coil) -> Option<f64> {
    let excess = |load_n: f64| {
        let column = coil.under_load(load_n).ok()?;
        let q = (load_n * (1.0 + load_n / column.shear_n) / column.bending_nm2).sqrt();
        Some(q * column.length_m - PI)
    };
    let (mut low, mut high) = (0.0, (coil.free_length_m() - coil.solid_length_m()) * coil.axial_n_per_m());
    // q L first increases with the load and then decreases as L shrinks: search for the first crossing in steps, then
    // bisect.
    let step = high / 1000.0;
    high = (1..1000).map(|k| k as f64 * step).find(|load| excess(*load).is_some_and(|e| e >= 0.0))?;
    low = f64::max(low, high - step);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if excess(middle)? < 0.0 { low = middle } else { high = middle }
    }
    Some(0.5 * (low + high))
}
