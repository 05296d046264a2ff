//! Summary of the point times of one cloud.

use super::raw_cloud::RawCloud;
use crate::quantile::quantile;
use zsim_base::time::Stamp;

/// Fraction of a cloud's times ignored at each end: a few impossible ones decide nothing.
const IGNORED: f64 = 0.1;

/// Times of the returns of a cloud, as written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudTimes {
    /// Stamp of the cloud.
    pub stamp: Stamp,
    /// Number of the name of the time field.
    pub source: usize,
    /// Whether the values are too short for times since 1970.
    pub is_short: bool,
    /// The 0.1 quantile.
    pub low: f64,
    /// The 0.9 quantile.
    pub high: f64,
    /// Whether the times of several returns are equal; `None` if there is one return.
    pub is_equal: Option<bool>,
}

impl CloudTimes {
    /// Summarises the times of a cloud's returns; `None` if none is finite.
    pub fn of(cloud: &RawCloud) -> Option<Self> {
        let values: Vec<f64> = cloud.times.iter().copied().filter(|time| time.is_finite()).collect();
        let first = *values.first()?;
        let is_equal = (values.len() > 1).then(|| values.iter().all(|time| *time == first));
        let RawCloud { stamp, source, is_short, .. } = *cloud;
        let (low, high) = (quantile(values.clone(), IGNORED), quantile(values, 1.0 - IGNORED));
        Some(Self { stamp, source, is_short, low, high, is_equal })
    }

    /// Difference of the last and the first time, as of times that are spread evenly.
    pub fn spread(&self) -> f64 {
        (self.high - self.low) / (1.0 - 2.0 * IGNORED)
    }
}
