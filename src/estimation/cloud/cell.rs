//! Morton codes of grid cells: sorted along a Z curve (Morton 1966), the children of a coarse cell are contiguous.

use zsim_base::geometry::Vector;

/// Edge of the finest cells, m: large against the beam spacing at short range, small against moving objects.
pub(super) const EDGE_M: f64 = 0.1;

/// Bits per coordinate: the grid extends 100 km to each side of the origin and wraps around there.
const BITS: u32 = 21;

/// Coordinates of the cell of `level` (edge `EDGE_M * 2^level`) that contains a point.
pub(super) fn coordinates(point: &Vector, level: u32) -> [i64; 3] {
    let per_edge = 1.0 / (EDGE_M * f64::from(1_u32 << level));
    [point.x, point.y, point.z].map(|x| (x * per_edge).floor() as i64)
}

/// Morton code of a cell of `level`: the code of any of its finer cells, shifted right by three bits per level.
pub(super) fn morton_code([x, y, z]: [i64; 3], level: u32) -> u64 {
    let half = 1_i64 << (BITS - 1 - level);
    let mask = (1_u64 << (BITS - level)) - 1;
    let part = |x: i64| spread((x.wrapping_add(half) as u64) & mask);
    part(x) << 2 | part(y) << 1 | part(z)
}

/// Coordinates of the cell of `level` with the given Morton code.
pub(super) fn coordinates_of(code: u64, level: u32) -> [i64; 3] {
    let half = 1_i64 << (BITS - 1 - level);
    [code >> 2, code >> 1, code].map(|bits| gather(bits) as i64 - half)
}

/// Inserts two zero bits between adjacent ones of the low 21 bits.
fn spread(x: u64) -> u64 {
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

/// Collects every third bit, starting with the lowest.
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
    fn morton_code_is_invertible_and_shifts_to_the_parent_cell() {
        for k in 0..2000_i64 {
            let at = Vector::new((k as f64 * 0.7).sin() * 90e3, (k as f64 * 1.3).cos() * 30.0, k as f64 * 0.03 - 20.0);
            for level in 0..4 {
                let cell = coordinates(&at, level);
                assert_eq!(coordinates_of(morton_code(cell, level), level), cell, "{at}");
                let coarser = coordinates(&at, level + 1);
                assert_eq!(morton_code(cell, level) >> 3, morton_code(coarser, level + 1), "{at}");
            }
        }
    }
}
