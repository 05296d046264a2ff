//! Detects rest or motion with the lidar; the IMU cannot distinguish constant velocity from rest.
//!
//! A translation `d` of the head changes the range along a ray `u`, which meets a surface with normal `n`, by `-n.d / n.u`.
//! Least squares over many directions gives the translation, in the directions that the surfaces constrain: along two
//! parallel walls it is unknown.

use super::surfel::TimedReturn;
use nalgebra::SymmetricEigen;
use std::collections::BTreeMap;
use zsim_base::geometry::{Matrix, Vector};

/// Cell size in azimuth and elevation, rad.
const CELL_RAD: f64 = 0.05;
/// Two ranges in a cell are different if they differ by more than this, m, plus this fraction.
const RANGE_TOLERANCE: (f64, f64) = (0.1, 0.03);
/// The head may move if more than this fraction of the cells have different ranges, out of at least this number.
const MOTION_THRESHOLD: (f64, usize) = (0.12, 20);
/// The head then rests if in each direction the surfaces that stay have at least this multiple of the weight of those that
/// change: a motion of the head changes every surface that faces it, a passing vehicle only its own.
const MIN_STAYING: f64 = 0.3;
/// Part of the weight of the changes that errors of the normals cause in a direction without surfaces.
const NEGLIGIBLE: f64 = 0.01;
/// The head moves if its translation exceeds this, m.
const SHIFTED_M: f64 = 0.03;
/// Cauchy threshold of the residuals in successive solutions, m. Outliers are edges and moving objects.
const CAUCHY_SCALES_M: [f64; 6] = [1.0, 0.3, 0.1, 0.03, 0.03, 0.03];
/// A cell is used if its points are within this fraction of their extent from a line.
const LINE_TOLERANCE: f64 = 0.1;
/// A cell is used if the cosine of the incidence angle exceeds this.
const MIN_COSINE: f64 = 0.1;
/// The translation is observable along eigenvectors of the mean `n n^T` with an eigenvalue above this.
const MIN_EIGENVALUE: f64 = 0.03;

/// Evidence of the lidar on motion or rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Standstill {
    /// The head moves.
    Moves,
    /// The head rests: a motion in the scan plane would be visible.
    Rests {
        /// Projects onto the directions in which a motion would not be visible, IMU frame.
        unobserved: Matrix,
    },
    /// No motion is visible, but the surfaces do not constrain it.
    Unknown,
}

/// The points in one cell of directions.
#[derive(Debug, Clone, Copy, Default)]
struct Cell {
    count: f64,
    sum: Vector,
    squares: Matrix,
    range_m: f64,
}

impl Cell {
    fn mean_range_m(&self) -> f64 {
        self.range_m / self.count
    }

    /// The direction of the cell, and the surface normal in the scan plane, on the side away from the lidar; none if the
    /// points are not on one surface.
    fn facing(&self) -> Option<(Vector, Vector)> {
        let mean = self.sum / self.count;
        let scatter = SymmetricEigen::new(self.squares / self.count - mean * mean.transpose());
        let longest = scatter.eigenvalues.imax();
        let across = scatter.eigenvalues.iter().enumerate().filter(|(k, _)| *k != longest);
        let across = across.map(|(_, square)| *square).fold(0.0, f64::max);
        if across > LINE_TOLERANCE.powi(2) * scatter.eigenvalues[longest] {
            return None;
        }
        let tangent: Vector = scatter.eigenvectors.column(longest).into();
        let direction = mean.try_normalize(0.0)?;
        let normal = (direction - tangent * direction.dot(&tangent)).try_normalize(MIN_COSINE)?;
        Some((direction, normal))
    }
}

/// Compares the first with the last quarter of the returns, in order of time, during an assumed rest of up to `rest_s`.
pub(super) fn standstill(returns: &[TimedReturn], rest_s: f64) -> Standstill {
    let (Some(first), Some(last)) = (returns.first(), returns.last()) else { return Standstill::Unknown };
    let quarter_s = 0.25 * (last.tau_s.min(first.tau_s + rest_s) - first.tau_s);
    let until_s = first.tau_s + 4.0 * quarter_s;
    let early = returns.partition_point(|one| one.tau_s < first.tau_s + quarter_s);
    let late = returns.partition_point(|one| one.tau_s < until_s - quarter_s);
    let end = returns.partition_point(|one| one.tau_s <= until_s);
    compare(&returns[..early], &returns[late..end])
}

/// Compares `early` and `late` returns of an assumed rest.
fn compare(early: &[TimedReturn], late: &[TimedReturn]) -> Standstill {
    let (early, late) = (by_direction(early), by_direction(late));
    let both: Vec<(&Cell, f64)> =
        early.iter().filter_map(|(key, cell)| Some((cell, late.get(key)?.mean_range_m()))).collect();
    let is_different = |a: f64, b: f64| (a - b).abs() > RANGE_TOLERANCE.0 + RANGE_TOLERANCE.1 * a.min(b);
    let differ = both.iter().filter(|(a, b)| is_different(a.mean_range_m(), *b)).count();
    let may_move = both.len() >= MOTION_THRESHOLD.1 && differ as f64 > MOTION_THRESHOLD.0 * both.len() as f64;
    if may_move && !stays(&both) {
        return Standstill::Moves;
    }
    let facing = both.iter().filter_map(|(cell, late_m)| {
        let (direction, normal) = cell.facing()?;
        Some((normal, (cell.mean_range_m() - late_m) * normal.dot(&direction)))
    });
    let is_passing = |(_, displacement_m): &(Vector, f64)| may_move && displacement_m.abs() > RANGE_TOLERANCE.0;
    from_displacements(&facing.filter(|cell| !is_passing(cell)).collect::<Vec<_>>())
}

/// Whether surfaces stay in all directions in which others change, so that only these move.
fn stays(both: &[(&Cell, f64)]) -> bool {
    let (mut stay, mut change) = (Matrix::zeros(), Matrix::zeros());
    for (cell, late_m) in both {
        let displacement_m = cell.mean_range_m() - late_m;
        match cell.facing() {
            Some((direction, normal)) if (displacement_m * normal.dot(&direction)).abs() < RANGE_TOLERANCE.0 => {
                stay += normal * normal.transpose();
            }
            Some((_, normal)) => change += normal * normal.transpose(),
            // Edges and foliage: along the beam.
            None if displacement_m.abs() > RANGE_TOLERANCE.0 => {
                let along = cell.sum.normalize();
                change += along * along.transpose();
            }
            None => {}
        }
    }
    // No direction in which the changes outweigh the surfaces that stay.
    let excess = SymmetricEigen::new(stay - change * MIN_STAYING).eigenvalues.min();
    excess > -NEGLIGIBLE * change.trace()
}

/// Sorts returns into cells of direction.
fn by_direction(returns: &[TimedReturn]) -> BTreeMap<(i32, i32), Cell> {
    let mut cells: BTreeMap<(i32, i32), Cell> = BTreeMap::new();
    for beam in returns {
        let point = beam.point_in_imu.cast::<f64>();
        let (azimuth, elevation) = (point.y.atan2(point.x), (point.z / point.norm()).asin());
        let cell = cells.entry(((azimuth / CELL_RAD).floor() as i32, (elevation / CELL_RAD).floor() as i32));
        let cell = cell.or_default();
        cell.count += 1.0;
        cell.sum += point;
        cell.squares += point * point.transpose();
        cell.range_m += f64::from(beam.range_m);
    }
    cells
}

/// Estimates the translation from normals and the displacement along each of them, m.
fn from_displacements(facing: &[(Vector, f64)]) -> Standstill {
    if facing.len() < MOTION_THRESHOLD.1 {
        return Standstill::Unknown;
    }
    let mean = facing.iter().map(|(normal, _)| normal * normal.transpose()).sum::<Matrix>() / facing.len() as f64;
    let parts = SymmetricEigen::new(mean);
    let observable: Vec<Vector> = (0..3)
        .filter(|k| parts.eigenvalues[*k] > MIN_EIGENVALUE)
        .map(|k| parts.eigenvectors.column(k).into())
        .collect();
    // The translation along the other directions stays zero.
    let within = observable.iter().map(|along| along * along.transpose()).sum::<Matrix>();
    let mut shift = Vector::zeros();
    for outlier_m in CAUCHY_SCALES_M {
        let (mut information, mut right) = (Matrix::identity() - within, Vector::zeros());
        for (normal, displacement_m) in facing {
            let weight = 1.0 / (1.0 + ((displacement_m - normal.dot(&shift)) / outlier_m).powi(2));
            let normal = within * normal;
            information += weight * normal * normal.transpose();
            right += weight * displacement_m * normal;
        }
        shift = information.try_inverse().unwrap_or_default() * right;
    }
    match observable.len() {
        _ if shift.norm() > SHIFTED_M => Standstill::Moves,
        0 | 1 => Standstill::Unknown,
        _ => Standstill::Rests { unobserved: Matrix::identity() - within },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Beams in a hall 6 m wide with ends at 12 and 8 m, or in a corridor without ends, after a motion of `moved_m` along
    /// it. The range noise is a fixed pattern; the maximum range is 30 m.
    fn returns(moved_m: f64, has_ends: bool) -> Vec<TimedReturn> {
        let beam = |k: i32| {
            let azimuth = f64::from(k) * 0.004_363;
            let (sin, cos) = azimuth.sin_cos();
            let along = if cos > 0.0 { (12.0 - moved_m) / cos } else { (8.0 + moved_m) / -cos };
            let along = if has_ends { along } else { f64::INFINITY };
            let range = along.min(3.0 / sin.abs()) + 0.01 * (f64::from(k) * 7.3).sin();
            let point = nalgebra::Vector3::new(range * cos, range * sin, 0.0).cast();
            TimedReturn { tau_s: 0.0, point_in_imu: point, range_m: range as f32, weakness: 0.0 }
        };
        (0..1440).map(beam).filter(|beam| beam.range_m < 30.0).collect()
    }

    #[test]
    fn constant_velocity_is_detected_as_motion() {
        let seen = |moved_m: f64| compare(&returns(0.0, true), &returns(moved_m, true));
        assert!(matches!(seen(0.0), Standstill::Rests { .. }));
        assert!(matches!(seen(0.01), Standstill::Rests { .. }));
        for moved_m in [0.06, 0.3, 1.0, 4.0] {
            assert_eq!(seen(moved_m), Standstill::Moves, "{moved_m}");
            assert_eq!(seen(-moved_m), Standstill::Moves, "{moved_m}");
        }
    }

    #[test]
    fn rest_is_unknown_in_a_corridor_without_ends() {
        assert_eq!(compare(&returns(0.0, false), &returns(5.0, false)), Standstill::Unknown);
        assert_eq!(compare(&returns(0.0, true), &[]), Standstill::Unknown);
    }

    #[test]
    fn a_forklift_that_drives_off_in_front_is_not_a_motion_of_the_head() {
        // It fills 40 degrees in front and drives from 2 m to 2.6 m; the hall's end is behind it, the other one is in view.
        let with_forklift = |moved_m: f64, at_m: f64| {
            let mut beams = returns(moved_m, true);
            for beam in &mut beams {
                let [x, y] = [beam.point_in_imu.x, beam.point_in_imu.y].map(f64::from);
                if x > 0.0 && y.abs() < 0.36 * x {
                    let scale = (at_m / x) as f32;
                    beam.range_m *= scale;
                    beam.point_in_imu *= scale;
                }
            }
            beams
        };
        let rests = compare(&with_forklift(0.0, 2.0), &with_forklift(0.0, 2.6));
        assert!(matches!(rests, Standstill::Rests { .. }), "{rests:?}");
        // The same change of the view ahead, by a motion of the head.
        assert_eq!(compare(&with_forklift(0.0, 2.6), &with_forklift(0.6, 2.0)), Standstill::Moves);
    }

    #[test]
    fn a_passing_person_is_not_a_motion_of_the_head() {
        let mut late = returns(0.0, true);
        for beam in &mut late[100..200] {
            beam.range_m *= 0.8;
        }
        // The scan plane is level: a vertical motion would not be visible.
        let Standstill::Rests { unobserved } = compare(&returns(0.0, true), &late) else { panic!("no rest") };
        approx::assert_relative_eq!(unobserved, Matrix::from_diagonal(&Vector::z()), epsilon = 1e-9);
    }
}
