//! Design of experiment: which combinations of axis values are run.

use super::Sampling;
use rand::RngExt;
use sobol::Sobol;
use sobol::params::JoeKuoD6;
use zsim_base::random::Seed;

/// Size of an axis: a number of levels, or a continuous range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum AxisSize {
    /// Number of levels, all with the same fraction of the samples.
    Levels(usize),
    /// Number of levels, and the first one's fraction of the samples; the others share the rest equally.
    Weighted(usize, f64),
    /// A continuous range.
    Range,
}

/// Position of a sample on an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum AxisPosition {
    /// Index of a level.
    Level(usize),
    /// Position in a range, from 0 to 1.
    Along(f64),
}

/// The samples of a sweep by index.
#[derive(Debug, Clone)]
pub(super) struct Design {
    sizes: Vec<AxisSize>,
    count: u64,
    /// Coordinates of the samples from 0 to 1, row-major (sample, axis); empty for a grid.
    coordinates: Vec<f64>,
}

/// Maximum number of axes of a Sobol design: the dimensions of the direction table in use.
pub(super) const MAX_SOBOL_AXES: usize = 100;

impl Design {
    /// Samples axes of these sizes. `None` if a grid has a range, or more combinations than a `u64` can count.
    pub fn new(sampling: Sampling, sizes: Vec<AxisSize>) -> Option<Self> {
        let axes = sizes.len();
        let (count, coordinates) = match sampling {
            Sampling::Grid => {
                let count = sizes.iter().try_fold(1_u64, |count, size| match size {
                    AxisSize::Levels(levels) => count.checked_mul(*levels as u64),
                    AxisSize::Weighted(..) | AxisSize::Range => None,
                })?;
                (count, Vec::new())
            }
            Sampling::LatinHypercube { count, seed } => (count as u64, latin_hypercube(axes, count, Seed(seed))),
            Sampling::Sobol { count } => {
                // The first point is all zeros; it is not skipped.
                let sequence = Sobol::<f64>::new(axes, &JoeKuoD6::minimal());
                (count as u64, sequence.take(count).flatten().collect())
            }
        };
        Some(Self { sizes, count, coordinates })
    }

    /// Number of samples.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Position of sample `index` on each axis.
    pub fn sample(&self, index: u64) -> Vec<AxisPosition> {
        let axes = self.sizes.len();
        if self.coordinates.is_empty() {
            return self.grid_sample(index);
        }
        let start = index as usize * axes;
        let at = |(size, u): (&AxisSize, &f64)| match size {
            AxisSize::Levels(levels) => AxisPosition::Level(((u * *levels as f64) as usize).min(levels - 1)),
            AxisSize::Weighted(_, first_share) if u < first_share => AxisPosition::Level(0),
            AxisSize::Weighted(levels, first_share) => {
                let others = levels - 1;
                let rest = (u - first_share) / (1.0 - first_share);
                AxisPosition::Level(1 + ((rest * others as f64) as usize).min(others - 1))
            }
            AxisSize::Range => AxisPosition::Along(*u),
        };
        self.sizes.iter().zip(&self.coordinates[start..start + axes]).map(at).collect()
    }

    /// Decodes a grid index; the last axis varies fastest.
    fn grid_sample(&self, index: u64) -> Vec<AxisPosition> {
        let mut rest = index;
        let mut positions: Vec<AxisPosition> = Vec::with_capacity(self.sizes.len());
        for size in self.sizes.iter().rev() {
            let levels = if let AxisSize::Levels(levels) = size { *levels as u64 } else { 1 };
            positions.push(AxisPosition::Level((rest % levels) as usize));
            rest /= levels;
        }
        positions.reverse();
        positions
    }
}

/// Latin hypercube: one random coordinate in each of `count` equal bins of each axis, in random order.
fn latin_hypercube(axes: usize, count: usize, seed: Seed) -> Vec<f64> {
    let mut coordinates = vec![0.0; axes * count];
    for axis in 0..axes {
        let mut stream = seed.part("sweep/latin-hypercube", axis as u64);
        let mut bins: Vec<usize> = (0..count).collect();
        // Fisher-Yates shuffle.
        for k in (1..count).rev() {
            bins.swap(k, stream.random_range(0..=k));
        }
        for (sample, bin) in bins.into_iter().enumerate() {
            coordinates[sample * axes + axis] = (bin as f64 + stream.random::<f64>()) / count as f64;
        }
    }
    coordinates
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn along(design: &Design, axis: usize) -> Vec<f64> {
        let at = |position: &AxisPosition| if let AxisPosition::Along(u) = position { *u } else { f64::NAN };
        (0..design.count()).map(|sample| at(&design.sample(sample)[axis])).collect()
    }

    #[test]
    fn a_grid_contains_each_combination_once_with_the_last_axis_fastest() {
        let design = Design::new(Sampling::Grid, vec![AxisSize::Levels(2), AxisSize::Levels(3)]).unwrap();
        let samples: Vec<Vec<AxisPosition>> = (0..design.count()).map(|sample| design.sample(sample)).collect();
        let expected = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)];
        assert_eq!(samples, expected.map(|(a, b)| vec![AxisPosition::Level(a), AxisPosition::Level(b)]));
        assert!(Design::new(Sampling::Grid, vec![AxisSize::Levels(usize::MAX); 2]).is_none());
    }

    #[test]
    fn a_latin_hypercube_has_one_sample_in_each_bin_of_each_axis() {
        let count = 50;
        let design = Design::new(Sampling::LatinHypercube { count, seed: 3 }, vec![AxisSize::Range; 4]).unwrap();
        for axis in 0..4 {
            let mut parts: Vec<usize> =
                along(&design, axis).iter().map(|u| (u * count as f64).floor() as usize).collect();
            assert_ne!(parts, (0..count).collect::<Vec<_>>(), "in random order");
            parts.sort_unstable();
            assert_eq!(parts, (0..count).collect::<Vec<_>>());
        }
    }

    #[test]
    fn the_sobol_sequence_fills_the_unit_cube_evenly() {
        // The first dimension is the van der Corput sequence in Gray code order (Antonov and Saleev 1979): the reversed
        // bits of k ^ (k >> 1) as a binary fraction.
        let design = Design::new(Sampling::Sobol { count: 32 }, vec![AxisSize::Range; 2]).unwrap();
        let mirrored = |k: u32| f64::from((k ^ (k >> 1)).reverse_bits()) / 2_f64.powi(32);
        assert_eq!(along(&design, 0), (0..32).map(mirrored).collect::<Vec<_>>());
        // The first two are a (0, m, 2)-net: each elementary interval of area 1/32 contains one of 32 points.
        for wide in 0..=5 {
            let (across, up) = (f64::from(1 << wide), f64::from(32 >> wide));
            let cell = |(x, y): (f64, f64)| ((x * across) as usize, (y * up) as usize);
            let boxes: BTreeSet<_> = along(&design, 0).into_iter().zip(along(&design, 1)).map(cell).collect();
            assert_eq!(boxes.len(), 32);
        }
        // In each dimension the first 16 points occupy different sixteenths.
        let design = Design::new(Sampling::Sobol { count: 16 }, vec![AxisSize::Range; 8]).unwrap();
        for axis in 0..8 {
            let mut parts: Vec<usize> = along(&design, axis).iter().map(|u| (u * 16.0) as usize).collect();
            parts.sort_unstable();
            assert_eq!(parts, (0..16).collect::<Vec<_>>());
        }
    }

    #[test]
    fn the_first_level_has_its_fraction_and_the_others_share_the_rest_equally() {
        let sampling = Sampling::LatinHypercube { count: 24, seed: 1 };
        let design = Design::new(sampling, vec![AxisSize::Range, AxisSize::Weighted(4, 0.5)]).unwrap();
        let level = |sample| if let AxisPosition::Level(level) = design.sample(sample)[1] { level } else { 9 };
        let mut counts = [0; 4];
        (0..24).for_each(|sample| counts[level(sample)] += 1);
        assert_eq!(counts, [12, 4, 4, 4]);
    }

    #[test]
    fn levels_are_sampled_equally_often() {
        let sampling = Sampling::LatinHypercube { count: 12, seed: 1 };
        let design = Design::new(sampling, vec![AxisSize::Levels(3), AxisSize::Range]).unwrap();
        let level = |sample| if let AxisPosition::Level(level) = design.sample(sample)[0] { level } else { 9 };
        let mut counts = [0; 3];
        (0..12).for_each(|sample| counts[level(sample)] += 1);
        assert_eq!(counts, [4, 4, 4]);
    }
}
