use super::divisions::{MAX_DIVISIONS, check_count};
use crate::triangle::Triangle;
use rand::RngExt;
use serde::{Deserialize, Serialize};
use zsim_base::geometry::Vector;
use zsim_base::random::{Seed, Stream};
use zsim_base::spec::checked;

/// Heights of a height field.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum HeightsSpec {
    /// Given heights, m: rows along x, in order of y; at least 2 x 2.
    Grid(Vec<Vec<f64>>),
    /// Random rolling terrain: smooth noise in three octaves, each with half the wavelength and half the height of the
    /// previous one.
    Rolling {
        /// Random seed. It belongs to the scene, so all runs have the same terrain.
        #[serde(default = "crate::usual::seed")]
        seed: u64,
        /// Number of cells along x and y.
        cells: [usize; 2],
        /// Maximum height of the first octave above and below zero, m.
        #[serde(with = "checked::NonNegative")]
        amplitude_m: f64,
        /// Wavelength of the first octave, m.
        #[serde(with = "checked::Positive")]
        wavelength_m: f64,
    },
}

const OCTAVES: u32 = 3;

/// Maximum number of cells of a random field: bounds time and memory.
const MAX_CELLS: usize = 4_000_000;

/// Two triangles per cell, facing up.
pub(super) fn triangles(size_m: [f64; 2], heights: &HeightsSpec) -> Result<Vec<Triangle>, (&'static str, String)> {
    let rows = match heights {
        HeightsSpec::Grid(rows) => {
            check_grid(rows)?;
            rows.clone()
        }
        HeightsSpec::Rolling { seed, cells: [columns, rows], amplitude_m, wavelength_m } => {
            check_count("cells", *columns, 1)?;
            check_count("cells", *rows, 1)?;
            if columns * rows > MAX_CELLS {
                return Err(("cells", format!("{columns} x {rows} cells are more than {MAX_CELLS}")));
            }
            let noise = Noise { seed: Seed(*seed), amplitude: *amplitude_m, wavelength: *wavelength_m };
            noise.rows(size_m, [*columns, *rows])?
        }
    };
    let (last_column, last_row) = (rows[0].len() - 1, rows.len() - 1);
    let node = |i: usize, j: usize| {
        let x = size_m[0] * (i as f64 / last_column as f64 - 0.5);
        Vector::new(x, size_m[1] * (j as f64 / last_row as f64 - 0.5), rows[j][i])
    };
    let cell = |i: usize, j: usize| {
        let (a, b, c, d) = (node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1));
        [[a, b, c], [a, c, d]]
    };
    let cells = (0..last_row).flat_map(|j| (0..last_column).map(move |i| (i, j)));
    Ok(cells.flat_map(|(i, j)| cell(i, j)).collect())
}

fn check_grid(rows: &[Vec<f64>]) -> Result<(), (&'static str, String)> {
    let columns = rows.first().map_or(0, Vec::len);
    if rows.len() < 2 || columns < 2 {
        return Err(("Grid", format!("the grid has {} rows of {columns}; it needs at least 2 x 2", rows.len())));
    }
    check_count("Grid", rows.len(), 2)?;
    check_count("Grid", columns, 2)?;
    if let Some((index, row)) = rows.iter().enumerate().find(|(_, row)| row.len() != columns) {
        let message = format!("row {} of the grid has {} heights, the first has {columns}", index + 1, row.len());
        return Err(("Grid", message));
    }
    match rows.iter().flatten().find(|height| !height.is_finite()) {
        Some(bad) => Err(("Grid", format!("expected finite heights, found {bad} among them"))),
        None => Ok(()),
    }
}

/// Value noise: random heights at the nodes of a lattice, interpolated by smoothstep.
struct Noise {
    seed: Seed,
    amplitude: f64,
    wavelength: f64,
}

impl Noise {
    fn rows(&self, size: [f64; 2], cells: [usize; 2]) -> Result<Vec<Vec<f64>>, (&'static str, String)> {
        let mut rows = vec![vec![0.0; cells[0] + 1]; cells[1] + 1];
        for octave in 0..OCTAVES {
            let shrink = 0.5_f64.powi(octave as i32);
            let stream = self.seed.part("world/height_field", octave.into());
            let lattice = Lattice::draw(stream, size, self.wavelength * shrink)?;
            for (j, row) in rows.iter_mut().enumerate() {
                for (i, height) in row.iter_mut().enumerate() {
                    let x = size[0] * i as f64 / cells[0] as f64;
                    let y = size[1] * j as f64 / cells[1] as f64;
                    *height += self.amplitude * shrink * lattice.at(x, y);
                }
            }
        }
        Ok(rows)
    }
}

struct Lattice {
    spacing: f64,
    columns: usize,
    values: Vec<f64>,
}

impl Lattice {
    fn draw(mut stream: Stream, size: [f64; 2], spacing: f64) -> Result<Self, (&'static str, String)> {
        let nodes = size.map(|extent| (extent / spacing).ceil() + 2.0);
        if nodes.iter().any(|n| *n > MAX_DIVISIONS as f64) {
            let message = format!("`wavelength_m` is too short for terrain of {} x {} m", size[0], size[1]);
            return Err(("wavelength_m", message));
        }
        let [columns, rows] = nodes.map(|n| n as usize);
        let values = (0..columns * rows).map(|_| stream.random_range(-1.0..1.0)).collect();
        Ok(Self { spacing, columns, values })
    }

    /// Value between -1 and 1 at `x` and `y`, m from the first node: smooth between the four nodes around.
    fn at(&self, x: f64, y: f64) -> f64 {
        let (u, v) = (x / self.spacing, y / self.spacing);
        let (i, j) = (u.floor(), v.floor());
        let smooth = |t: f64| t * t * (3.0 - 2.0 * t);
        let (s, t) = (smooth(u - i), smooth(v - j));
        let first = j as usize * self.columns + i as usize;
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let row = |at: usize| mix(self.values[at], self.values[at + 1], s);
        mix(row(first), row(first + self.columns), t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_gives_its_heights_back_at_its_nodes() {
        let faces = triangles([2.0, 4.0], &HeightsSpec::Grid(vec![vec![0.0, 1.0], vec![2.0, 3.0]])).unwrap();
        let corners = [[-1.0, -2.0, 0.0], [1.0, -2.0, 1.0], [1.0, 2.0, 3.0], [-1.0, 2.0, 2.0]].map(Vector::from);
        assert_eq!(faces, vec![[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]]);
    }

    #[test]
    fn rolling_ground_depends_on_its_seed_alone_and_stays_within_its_amplitude() {
        let ground = |seed| {
            let heights = HeightsSpec::Rolling { seed, cells: [40, 30], amplitude_m: 0.4, wavelength_m: 5.0 };
            triangles([40.0, 30.0], &heights).unwrap()
        };
        assert_eq!(ground(1), ground(1));
        assert_ne!(ground(1), ground(2));
        // Octaves of 1, 1/2 and 1/4 of the amplitude add to at most 7/4 of it.
        let highest = ground(1).iter().flatten().map(|corner| corner.z.abs()).fold(0.0, f64::max);
        assert!(highest < 0.7 && highest > 0.1, "{highest}");
    }

    #[test]
    fn a_ragged_or_tiny_grid_is_rejected() {
        for rows in [vec![], vec![vec![1.0, 2.0]], vec![vec![1.0, 2.0], vec![1.0]], vec![vec![1.0, f64::NAN]; 2]] {
            assert_eq!(triangles([1.0, 1.0], &HeightsSpec::Grid(rows)).unwrap_err().0, "Grid");
        }
    }
}
