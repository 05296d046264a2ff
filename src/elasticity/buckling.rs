//! The load at which a coil spring buckles.

use super::{Coil, ElasticityError};
use std::f64::consts::PI;

/// Buckling load over the load, down to which the force law was compared with an exact rod.
pub const VALID_BUCKLING_MARGIN: f64 = 1.25;

/// The buckling load of a coil with clamped base and guided top, N.
///
/// Guided: free to translate sideways, not to rotate. The condition is `q L = pi` with `q^2 = P (1 + P/S) / B` and the
/// length L under the load. `None` if the coil reaches the solid length without buckling.
pub fn buckling_load_n(coil: &Coil) -> Option<f64> {
    let excess = |load_n| angle_excess(coil, load_n);
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

/// Checks that a load along the axis (compression positive) is at most 80 % of the buckling load.
///
/// # Errors
/// [`ElasticityError::NearBuckling`] above it.
pub fn check_buckling(coil: &Coil, load_n: f64) -> Result<(), ElasticityError> {
    let buckles = load_n > 0.0 && angle_excess(coil, VALID_BUCKLING_MARGIN * load_n).is_some_and(|excess| excess > 0.0);
    if buckles { Err(ElasticityError::NearBuckling { load_n }) } else { Ok(()) }
}

/// `q L - pi` under a load; `None` if the coils touch.
fn angle_excess(coil: &Coil, load_n: f64) -> Option<f64> {
    let column = coil.under_load(load_n).ok()?;
    let q = (load_n * (1.0 + load_n / column.shear_n) / column.bending_nm2).sqrt();
    Some(q * column.length_m - PI)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Moduli;

    #[test]
    fn loads_above_80_percent_of_the_buckling_load_are_refused() {
        let moduli = Moduli { youngs_pa: 206e9, shear_pa: 79.3e9 };
        let coil = |length_m| Coil::new(25e-3, 3e-3, 12.0, length_m, moduli).unwrap();
        let slender = coil(0.18);
        let buckling_n = buckling_load_n(&slender).unwrap();
        assert!(check_buckling(&slender, 0.799 * buckling_n).is_ok());
        let error = check_buckling(&slender, 0.801 * buckling_n).unwrap_err();
        assert!(error.to_string().contains("above 80 % of its buckling load"), "{error}");
        assert!(check_buckling(&slender, -1e3).is_ok(), "a pull");
        // A spring that closes before it buckles bears any load up to there.
        let stubby = coil(0.06);
        assert_eq!(buckling_load_n(&stubby), None);
        assert!(
            (1..100).all(|k| check_buckling(&stubby, 0.01 * f64::from(k) * 0.024 * stubby.axial_n_per_m()).is_ok())
        );
    }
}
