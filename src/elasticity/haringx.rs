//! A column under an axial load (Haringx, Philips Research Reports 3 and 4, 1948-49).

use super::{ElasticityError, Matrix6};
use nalgebra::{Matrix2, Matrix4};

/// A straight elastic column; length and rigidities are those under the axial load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// Length under the load, m.
    pub length_m: f64,
    /// Bending rigidity B, N m^2.
    pub bending_nm2: f64,
    /// Shear rigidity S, N.
    pub shear_n: f64,
    /// Axial stiffness, N/m.
    pub axial_n_per_m: f64,
    /// Torsional stiffness, N m/rad.
    pub torsion_nm_per_rad: f64,
    /// Axial load P, compression positive, N.
    pub load_n: f64,
}

impl Column {
    /// One of `segments` equal segments of the column in series.
    pub fn segment(&self, segments: usize) -> Self {
        let count = segments as f64;
        Self {
            length_m: self.length_m / count,
            axial_n_per_m: self.axial_n_per_m * count,
            torsion_nm_per_rad: self.torsion_nm_per_rad * count,
            ..*self
        }
    }

    /// Lateral stiffness of the top in one plane, with the base clamped.
    ///
    /// Rows (force, moment), columns (displacement, rotation that tilts the same way). `None` if the column has buckled
    /// with the top clamped too.
    ///
    /// With the state (y, theta, M, V) along the column: `y' = theta + (V + P theta)/S`, `theta' = M/B`, `M' = -(V + P
    /// y')`, `V' = 0`. The state at the top is `exp(A L)` times that at the base, for either sign of P.
    pub fn lateral_stiffness(&self) -> Option<Matrix2<f64>> {
        let (p, b, s) = (self.load_n, self.bending_nm2, self.shear_n);
        let soften = 1.0 + p / s;
        #[rustfmt::skip]
        let along = Matrix4::new(
            0.0, soften, 0.0, 1.0 / s,
            0.0, 0.0, 1.0 / b, 0.0,
            0.0, -p * soften, 0.0, -soften,
            0.0, 0.0, 0.0, 0.0,
        );
        let transfer = (along * self.length_m).exp();
        // At the base y = theta = 0, so (y, theta) and (M, V) of the top follow from (M, V) of the base.
        let displaced = transfer.fixed_view::<2, 2>(0, 2).into_owned();
        let loaded = transfer.fixed_view::<2, 2>(2, 2).into_owned();
        let moment_and_force = loaded * displaced.try_inverse()?;
        let stiffness = Matrix2::new(
            moment_and_force[(1, 0)],
            moment_and_force[(1, 1)],
            moment_and_force[(0, 0)],
            moment_and_force[(0, 1)],
        );
        Some((stiffness + stiffness.transpose()) * 0.5)
    }
}

/// Stiffness of the column's top with the base clamped, axial load included.
///
/// Order x, y, z, rx, ry, rz. A rotation about +y tilts the top towards +x, one about +x towards -y: hence the opposite
/// signs of the two couplings.
///
/// Above the buckling load for a free top, the matrix is not positive definite; whether a body on the spring is stable
/// depends on the constraints of the top.
///
/// # Errors
/// When the load buckles the column even with the top guided (free to translate sideways, not to rotate), or pulls it
/// beyond the range in which the transfer matrix can be inverted.
pub fn loaded_stiffness(column: &Column) -> Result<Matrix6, ElasticityError> {
    let lateral =
        column.lateral_stiffness().filter(|k| k.iter().all(|x| x.is_finite()) && k[(0, 0)] > 0.0).ok_or_else(|| {
            let length_mm = column.length_m * 1e3;
            match column.load_n {
                load_n if load_n < 0.0 => ElasticityError::PullTooStrong { pull_n: -load_n, length_mm },
                load_n => ElasticityError::Buckles { load_n, length_mm },
            }
        })?;
    let mut stiffness = Matrix6::zeros();
    for (shift, turn, sign) in [(0, 4, 1.0), (1, 3, -1.0)] {
        stiffness[(shift, shift)] = lateral[(0, 0)];
        stiffness[(turn, turn)] = lateral[(1, 1)];
        stiffness[(shift, turn)] = sign * lateral[(0, 1)];
        stiffness[(turn, shift)] = sign * lateral[(0, 1)];
    }
    stiffness[(2, 2)] = column.axial_n_per_m;
    stiffness[(5, 5)] = column.torsion_nm_per_rad;
    Ok(stiffness)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Coil, Moduli, buckling_load_n};
    use approx::assert_relative_eq;

    fn steel(coil_mm: f64, wire_mm: f64, coils: f64, length_mm: f64) -> Coil {
        let moduli = Moduli { youngs_pa: 206e9, shear_pa: 79.3e9 };
        Coil::new(coil_mm * 1e-3, wire_mm * 1e-3, coils, length_mm * 1e-3, moduli).unwrap()
    }

    #[test]
    fn without_load_the_column_is_a_timoshenko_beam() {
        // K_xx = 12 B / (L^3 (1 + Phi)), K_ry = (4 + Phi) B / (L (1 + Phi)), K_x,ry = -6 B / (L^2 (1 + Phi)).
        let column = steel(25.0, 3.0, 12.0, 120.0).under_load(0.0).unwrap();
        let (b, l) = (column.bending_nm2, column.length_m);
        let phi = 12.0 * b / (column.shear_n * l * l);
        let k = loaded_stiffness(&column).unwrap();
        assert_relative_eq!(k[(0, 0)], 12.0 * b / (l.powi(3) * (1.0 + phi)), max_relative = 1e-11);
        assert_relative_eq!(k[(4, 4)], (4.0 + phi) * b / (l * (1.0 + phi)), max_relative = 1e-11);
        assert_relative_eq!(k[(0, 4)], -6.0 * b / (l * l * (1.0 + phi)), max_relative = 1e-11);
        assert_relative_eq!(k[(1, 3)], 6.0 * b / (l * l * (1.0 + phi)), max_relative = 1e-11);
        assert_relative_eq!(k[(2, 2)], 79.3e9 * 3e-3_f64.powi(4) / (8.0 * 0.025_f64.powi(3) * 12.0), epsilon = 1e-8);
    }

    #[test]
    fn guided_lateral_stiffness_agrees_with_haringx_and_an_exact_rod() {
        // D, d, n, L0 in mm; load in N; guided lateral stiffness in N/m of a geometrically exact rod along the helix,
        // and of the column.
        let table = [
            ([50.0, 4.0, 10.0, 120.0], 0.0, 979.5, 974.1),
            ([50.0, 4.0, 10.0, 120.0], 60.9, 810.4, 801.0),
            ([40.0, 2.5, 15.0, 120.0], 0.0, 133.4, 132.7),
            ([40.0, 2.5, 15.0, 120.0], 12.1, 64.9, 63.6),
            ([30.0, 2.0, 8.0, 60.0], 11.0, 465.9, 460.3),
        ];
        for ([coil, wire, coils, length], load, rod, expected) in table {
            let column = steel(coil, wire, coils, length).under_load(load).unwrap();
            let guided = loaded_stiffness(&column).unwrap()[(0, 0)];
            // The loads are rounded to 0.05 N, which is up to 0.5 % of the stiffness of the softest spring.
            assert_relative_eq!(guided, expected, max_relative = 5e-3);
            assert_relative_eq!(guided, rod, max_relative = 0.025);
            if load > 0.0 {
                // P^2 / (2 q B tan(q L / 2) - P L), q^2 = P (1 + P/S) / B.
                let (p, b, l) = (load, column.bending_nm2, column.length_m);
                let q = (p * (1.0 + p / column.shear_n) / b).sqrt();
                let closed = p * p / (2.0 * q * b * (q * l / 2.0).tan() - p * l);
                assert_relative_eq!(guided, closed, max_relative = 1e-9);
            }
        }
    }

    #[test]
    fn tension_stiffens_and_lateral_stiffness_vanishes_at_the_buckling_load() {
        let coil = steel(40.0, 2.5, 15.0, 120.0);
        let guided = |load: f64| coil.under_load(load).unwrap().lateral_stiffness().unwrap()[(0, 0)];
        assert!(guided(-10.0) > guided(0.0) && guided(0.0) > guided(10.0));
        let critical = buckling_load_n(&coil).unwrap();
        assert!(guided(critical).abs() < 1e-6 * guided(0.0), "{critical} N leaves {}", guided(critical));
        assert!(matches!(
            loaded_stiffness(&coil.under_load(critical * 1.01).unwrap()),
            Err(ElasticityError::Buckles { .. })
        ));
        // With clamped ends, a free length below 2.6 diameters never buckles.
        assert_eq!(buckling_load_n(&steel(50.0, 4.0, 10.0, 120.0)), None);
    }
}
