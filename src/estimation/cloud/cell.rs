//! Cells of the map as numbers that sort along a Z curve (Morton 1966), so that a coarser cell is a run of finer ones.

use crate::geometry::Vector;

/// Edge of the finest cells, m.
pub(super) const EDGE_M: f64 = 0.1;

/// Bits of a coordinate: cells reach 100 km to each side of the origin, and go round there.
const BITS: u32 = 21;

/// Coordinates of the cell, of edges `EDGE_M * 2^level`, in which a point is.
pub(super) fn coordinates(point: &Vector, level: u32) -> [i64; 3] {
    let per_edge = 1.0 / (EDGE_M * f64::from(1_u32 << level));
    [point.x, point.y, point.z].map(|x| (x * per_edge).floor() as i64)
}

/// The number of a cell of `level`: that of its cells of a level below, shifted right by three bits.
pub(super) fn number([x, y, z]: [i64; 3], level: u32) -> u64 {
    let half = 1_i64 << (BITS - 1 - level);
    let mask = (1_u64 << (BITS - level)) - 1;
    let part = |x: i64| spread((x.wrapping_add(half) as u64) & mask);
    part(x) << 2 | part(y) << 1 | part(z)
}

/// The coordinates of the cell of `level` that `number` is.
pub(super) fn coordinates_of(number: u64, level: u32) -> [i64; 3] {
    let half = 1_i64 << (BITS - 1 - level);
    [number >> 2, number >> 1, number].map(|bits| gather(bits) as i64 - half)
}

/// Two zeros between any two of the low 21 bits.
fn spread(x: u64) -> u64 {
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

/// Every third bit, from the lowest.
fn gather(x: u64) -> u64 {
    let x = x & 0x1249_2492_4924_9249;
    let x = (x | x >> 2) & 0x10c3_0c30_c30c_30c3;
    let x = (x | x >> 4) & 0x100f_00f0_0f00_f00f;
    let x = (x | x >> 8) & 0x001f_0000_ff00_00ff;
    let x = (x | x >> 16) & 0x001f_0000_0000_ffff;
    (x | x >> 32) & 0x001f_ffff
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cells_number_tells_its_coordinates_and_the_cell_that_it_is_in() {
        for k in 0..2000_i64 {
            let at = Vector::new((k as f64 * 0.7).sin() * 90e3, (k as f64 * 1.3).cos() * 30.0, k as f64 * 0.03 - 20.0);
            for level in 0..4 {
                let cell = coordinates(&at, level);
                assert_eq!(coordinates_of(number(cell, level), level), cell, "{at}");
                let coarser = coordinates(&at, level + 1);
                assert_eq!(number(cell, level) >> 3, number(coarser, level + 1), "{at}");
            }
        }
    }
}
