//! Which combinations of an axis's places are run.

use super::Sampling;
use crate::random::Seed;
use rand::RngExt;
use sobol::Sobol;
use sobol::params::JoeKuoD6;

/// How long an axis is: so many levels, or any place from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Extent {
    Levels(usize),
    /// So many levels, of which the first has this share of the samples and the others have equal ones.
    Weighted(usize, f64),
    Range,
}

/// Where a sample is on an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Place {
    Level(usize),
    /// From 0 to 1.
    Along(f64),
}

/// The samples of a sweep, by number.
#[derive(Debug, Clone)]
pub(super) struct Design {
    extents: Vec<Extent>,
    count: u64,
    /// Of what is no grid: the samples' places, from 0 to 1, one sample after another.
    places: Vec<f64>,
}

/// Most dimensions that the sequence of Sobol is tabled for here.
pub(super) const MOST_SOBOL_AXES: usize = 100;

impl Design {
    /// The samples of axes with these extents. A grid has levels only; `None` when there are more than can be counted.
    pub fn new(sampling: Sampling, extents: Vec<Extent>) -> Option<Self> {
        let axes = extents.len();
        let (count, places) = match sampling {
            Sampling::Grid => {
                let count = extents.iter().try_fold(1_u64, |count, extent| match extent {
                    Extent::Levels(levels) => count.checked_mul(*levels as u64),
                    Extent::Weighted(..) | Extent::Range => None,
                })?;
                (count, Vec::new())
            }
            Sampling::LatinHypercube { count, seed } => (count as u64, latin_hypercube(axes, count, Seed(seed))),
            Sampling::Sobol { count } => {
                // The first point is the corner of all zeros, in every dimension: it is part of the sequence.
                let sequence = Sobol::<f64>::new(axes, &JoeKuoD6::minimal());
                (count as u64, sequence.take(count).flatten().collect())
            }
        };
        Some(Self { extents, count, places })
    }

    /// How many samples there are.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Where sample `index` is on each axis.
    pub fn sample(&self, index: u64) -> Vec<Place> {
        let axes = self.extents.len();
        if self.places.is_empty() {
            return self.in_grid(index);
        }
        let start = index as usize * axes;
        let at = |(extent, u): (&Extent, &f64)| match extent {
            Extent::Levels(levels) => Place::Level(((u * *levels as f64) as usize).min(levels - 1)),
            Extent::Weighted(_, first_share) if u < first_share => Place::Level(0),
            Extent::Weighted(levels, first_share) => {
                let others = levels - 1;
                let behind = (u - first_share) / (1.0 - first_share);
                Place::Level(1 + ((behind * others as f64) as usize).min(others - 1))
            }
            Extent::Range => Place::Along(*u),
        };
        self.extents.iter().zip(&self.places[start..start + axes]).map(at).collect()
    }

    fn in_grid(&self, index: u64) -> Vec<Place> {
        let mut rest = index;
        let mut places: Vec<Place> = Vec::with_capacity(self.extents.len());
        for extent in self.extents.iter().rev() {
            let levels = if let Extent::Levels(levels) = extent { *levels as u64 } else { 1 };
            places.push(Place::Level((rest % levels) as usize));
            rest /= levels;
        }
        places.reverse();
        places
    }
}

/// One place in each of `count` equal parts of each axis, at random within it, in random order.
fn latin_hypercube(axes: usize, count: usize, seed: Seed) -> Vec<f64> {
    let mut places = vec![0.0; axes * count];
    for axis in 0..axes {
        let mut stream = seed.part("sweep/latin-hypercube", axis as u64);
        let mut parts: Vec<usize> = (0..count).collect();
        // Fisher and Yates: every order is as likely.
        for k in (1..count).rev() {
            parts.swap(k, stream.random_range(0..=k));
        }
        for (sample, part) in parts.into_iter().enumerate() {
            places[sample * axes + axis] = (part as f64 + stream.random::<f64>()) / count as f64;
        }
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn along(design: &Design, axis: usize) -> Vec<f64> {
        let at = |place: &Place| if let Place::Along(u) = place { *u } else { f64::NAN };
        (0..design.count()).map(|sample| at(&design.sample(sample)[axis])).collect()
    }

    #[test]
    fn a_grid_has_each_combination_once_the_last_axis_fastest() {
        let design = Design::new(Sampling::Grid, vec![Extent::Levels(2), Extent::Levels(3)]).unwrap();
        let samples: Vec<Vec<Place>> = (0..design.count()).map(|sample| design.sample(sample)).collect();
        let expected = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)];
        assert_eq!(samples, expected.map(|(a, b)| vec![Place::Level(a), Place::Level(b)]));
        assert!(Design::new(Sampling::Grid, vec![Extent::Levels(usize::MAX); 2]).is_none());
    }

    #[test]
    fn a_latin_hypercube_has_one_sample_in_each_part_of_each_axis() {
        let count = 50;
        let design = Design::new(Sampling::LatinHypercube { count, seed: 3 }, vec![Extent::Range; 4]).unwrap();
        for axis in 0..4 {
            let mut parts: Vec<usize> =
                along(&design, axis).iter().map(|u| (u * count as f64).floor() as usize).collect();
            assert_ne!(parts, (0..count).collect::<Vec<_>>(), "in random order");
            parts.sort_unstable();
            assert_eq!(parts, (0..count).collect::<Vec<_>>());
        }
    }

    #[test]
    fn sobols_sequence_fills_evenly() {
        // The first dimension is van der Corput's sequence in the order of Gray's code (Antonov and Saleev 1979): the
        // bits of k ^ (k >> 1) behind the point, in reverse.
        let design = Design::new(Sampling::Sobol { count: 32 }, vec![Extent::Range; 2]).unwrap();
        let mirrored = |k: u32| f64::from((k ^ (k >> 1)).reverse_bits()) / 2_f64.powi(32);
        assert_eq!(along(&design, 0), (0..32).map(mirrored).collect::<Vec<_>>());
        // The first two are a (0, m, 2)-net: every box of 1/32 in size, whatever its shape, has one of 32 points.
        for wide in 0..=5 {
            let (across, up) = (f64::from(1 << wide), f64::from(32 >> wide));
            let place = |(x, y): (f64, f64)| ((x * across) as usize, (y * up) as usize);
            let boxes: BTreeSet<_> = along(&design, 0).into_iter().zip(along(&design, 1)).map(place).collect();
            assert_eq!(boxes.len(), 32);
        }
        // In any dimension each sixteenth has one of the first 16 points.
        let design = Design::new(Sampling::Sobol { count: 16 }, vec![Extent::Range; 8]).unwrap();
        for axis in 0..8 {
            let mut parts: Vec<usize> = along(&design, axis).iter().map(|u| (u * 16.0) as usize).collect();
            parts.sort_unstable();
            assert_eq!(parts, (0..16).collect::<Vec<_>>());
        }
    }

    #[test]
    fn the_first_level_has_its_share_and_the_others_have_equal_ones() {
        let sampling = Sampling::LatinHypercube { count: 24, seed: 1 };
        let design = Design::new(sampling, vec![Extent::Range, Extent::Weighted(4, 0.5)]).unwrap();
        let level = |sample| if let Place::Level(level) = design.sample(sample)[1] { level } else { 9 };
        let mut counts = [0; 4];
        (0..24).for_each(|sample| counts[level(sample)] += 1);
        assert_eq!(counts, [12, 4, 4, 4]);
    }

    #[test]
    fn levels_are_drawn_alike() {
        let sampling = Sampling::LatinHypercube { count: 12, seed: 1 };
        let design = Design::new(sampling, vec![Extent::Levels(3), Extent::Range]).unwrap();
        let level = |sample| if let Place::Level(level) = design.sample(sample)[0] { level } else { 9 };
        let mut counts = [0; 3];
        (0..12).for_each(|sample| counts[level(sample)] += 1);
        assert_eq!(counts, [4, 4, 4]);
    }
}
