//! Whether the lidar shows a head at rest: a head that moves evenly feels like one at rest to its IMU.
//!
//! The ranges of one direction, early and late, differ by what the head moved: along a ray `u` that meets a surface of
//! normal `n`, a shift `d` changes the range `r` by `-n.d / n.u`. Of many directions least squares gives the shift,
//! where the surfaces constrain it: between two parallel walls it is unknown along them.

use super::surfel::Beam;
use crate::geometry::Vector;
use nalgebra::{Matrix3, SymmetricEigen};
use std::collections::BTreeMap;

/// Directions are compared in cells of this size, rad.
const CELL_RAD: f64 = 0.05;
/// Ranges of one direction differ when they do by more than this, m, and this share.
const DIFFER: (f64, f64) = (0.1, 0.03);
/// A head moves when more than this share of the directions differ, of at least so many.
const MOVED: (f64, usize) = (0.12, 20);
/// Or when it shifted by more than this, m.
const SHIFTED_M: f64 = 0.03;
/// Directions whose shift is off by more than this, m, hardly count: something moves there, or an edge. Narrower from
/// one solution to the next.
const OUTLIERS_M: [f64; 6] = [1.0, 0.3, 0.1, 0.03, 0.03, 0.03];
/// A cell is of one surface when its points leave a line by less than this share of their extent, and it is met at a
/// cosine of more than this.
const STRAIGHT: f64 = 0.1;
const MIN_COSINE: f64 = 0.1;
/// A shift is known along a direction that so large a share of the surfaces face (an eigenvalue of their mean `n n^T`).
const FACED: f64 = 0.03;

/// What the lidar shows of a head whose IMU feels rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Standstill {
    /// What it sees moves.
    Moves,
    /// What it sees stands still, and would not if the head moved within the plane of its scan.
    Rests,
    /// What it sees stands still, and might do so in motion.
    Unknown,
}

/// The points that were seen in one direction.
#[derive(Debug, Clone, Copy, Default)]
struct Cell {
    count: f64,
    sum: Vector,
    squares: Matrix3<f64>,
    range_m: f64,
}

impl Cell {
    fn mean_range_m(&self) -> f64 {
        self.range_m / self.count
    }

    /// Its direction, and the normal of its surface within the scan, towards which the ray goes.
    fn facing(&self) -> Option<(Vector, Vector)> {
        let mean = self.sum / self.count;
        let scatter = SymmetricEigen::new(self.squares / self.count - mean * mean.transpose());
        let longest = scatter.eigenvalues.imax();
        let across = scatter.eigenvalues.iter().enumerate().filter(|(k, _)| *k != longest);
        let across = across.map(|(_, square)| *square).fold(0.0, f64::max);
        if across > STRAIGHT.powi(2) * scatter.eigenvalues[longest] {
            return None;
        }
        let tangent: Vector = scatter.eigenvectors.column(longest).into();
        let direction = mean.try_normalize(0.0)?;
        let normal = (direction - tangent * direction.dot(&tangent)).try_normalize(MIN_COSINE)?;
        Some((direction, normal))
    }
}

/// What `early` and `late` beams of the head's beginning show; with no beams, nothing.
pub(super) fn standstill(early: &[Beam], late: &[Beam]) -> Standstill {
    let (early, late) = (by_direction(early), by_direction(late));
    let both: Vec<(&Cell, f64)> =
        early.iter().filter_map(|(key, cell)| Some((cell, late.get(key)?.mean_range_m()))).collect();
    let is_other = |a: f64, b: f64| (a - b).abs() > DIFFER.0 + DIFFER.1 * a.min(b);
    let differ = both.iter().filter(|(a, b)| is_other(a.mean_range_m(), *b)).count();
    if both.len() >= MOVED.1 && differ as f64 > MOVED.0 * both.len() as f64 {
        return Standstill::Moves;
    }
    let facing = both.iter().filter_map(|(cell, late_m)| {
        let (direction, normal) = cell.facing()?;
        Some((normal, (cell.mean_range_m() - late_m) * normal.dot(&direction)))
    });
    shift(&facing.collect::<Vec<_>>())
}

fn by_direction(beams: &[Beam]) -> BTreeMap<(i32, i32), Cell> {
    let mut cells: BTreeMap<(i32, i32), Cell> = BTreeMap::new();
    for beam in beams {
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

/// What normals, and how far the head came along each of them, m, say.
fn shift(facing: &[(Vector, f64)]) -> Standstill {
    if facing.len() < MOVED.1 {
        return Standstill::Unknown;
    }
    let mean = facing.iter().map(|(normal, _)| normal * normal.transpose()).sum::<Matrix3<f64>>() / facing.len() as f64;
    let parts = SymmetricEigen::new(mean);
    let known: Vec<Vector> =
        (0..3).filter(|k| parts.eigenvalues[*k] > FACED).map(|k| parts.eigenvectors.column(k).into()).collect();
    // Along the other directions the shift stays zero.
    let within = known.iter().map(|along| along * along.transpose()).sum::<Matrix3<f64>>();
    let mut shift = Vector::zeros();
    for outlier_m in OUTLIERS_M {
        let (mut information, mut right) = (Matrix3::identity() - within, Vector::zeros());
        for (normal, came_m) in facing {
            let weight = 1.0 / (1.0 + ((came_m - normal.dot(&shift)) / outlier_m).powi(2));
            let normal = within * normal;
            information += weight * normal * normal.transpose();
            right += weight * came_m * normal;
        }
        shift = information.try_inverse().unwrap_or_default() * right;
    }
    match known.len() {
        _ if shift.norm() > SHIFTED_M => Standstill::Moves,
        0 | 1 => Standstill::Unknown,
        _ => Standstill::Rests,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Beams of a sensor in a hall of 6 m width whose ends are 12 and 8 m away, or of a corridor without ends; it has
    /// gone `moved_m` along it; range noise by a fixed pattern, beams end at 30 m.
    fn beams(moved_m: f64, has_ends: bool) -> Vec<Beam> {
        let beam = |k: i32| {
            let azimuth = f64::from(k) * 0.004_363;
            let (sin, cos) = azimuth.sin_cos();
            let along = if cos > 0.0 { (12.0 - moved_m) / cos } else { (8.0 + moved_m) / -cos };
            let along = if has_ends { along } else { f64::INFINITY };
            let range = along.min(3.0 / sin.abs()) + 0.01 * (f64::from(k) * 7.3).sin();
            let point = nalgebra::Vector3::new(range * cos, range * sin, 0.0).cast();
            Beam { tau_s: 0.0, point_in_imu: point, range_m: range as f32 }
        };
        (0..1440).map(beam).filter(|beam| beam.range_m < 30.0).collect()
    }

    #[test]
    fn a_head_that_moves_evenly_is_seen_to_move() {
        let seen = |moved_m: f64| standstill(&beams(0.0, true), &beams(moved_m, true));
        assert_eq!(seen(0.0), Standstill::Rests);
        assert_eq!(seen(0.01), Standstill::Rests);
        for moved_m in [0.06, 0.3, 1.0, 4.0] {
            assert_eq!(seen(moved_m), Standstill::Moves, "{moved_m}");
            assert_eq!(seen(-moved_m), Standstill::Moves, "{moved_m}");
        }
    }

    #[test]
    fn along_a_corridor_without_ends_rest_is_unknown() {
        assert_eq!(standstill(&beams(0.0, false), &beams(5.0, false)), Standstill::Unknown);
        assert_eq!(standstill(&beams(0.0, true), &[]), Standstill::Unknown);
    }

    #[test]
    fn somebody_who_walks_by_is_not_the_head() {
        let mut late = beams(0.0, true);
        for beam in &mut late[100..200] {
            beam.range_m *= 0.8;
        }
        assert_eq!(standstill(&beams(0.0, true), &late), Standstill::Rests);
    }
}
