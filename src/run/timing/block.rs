//! Error sums over blocks of time, for the confidence intervals of a study.

use serde::{Deserialize, Serialize};

/// Error sums over one block of time; sums of several blocks are added.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Block {
    /// Number of cloud points within reach of a surface.
    pub points: f64,
    /// Sum of the signed distances of the points to the surfaces, m.
    pub distance_m: f64,
    /// Sum of the squared distances, m^2.
    pub distance2_m2: f64,
    /// Number of poses.
    pub poses: f64,
    /// Sum of the squared position errors of the poses, m^2.
    pub position2_m2: f64,
}

impl Block {
    /// Adds another block as often as it is counted.
    pub fn add(&mut self, other: &Block, times: f64) {
        self.points += times * other.points;
        self.distance_m += times * other.distance_m;
        self.distance2_m2 += times * other.distance2_m2;
        self.poses += times * other.poses;
        self.position2_m2 += times * other.position2_m2;
    }

    /// Variance of the signed distances, m^2.
    pub fn cloud_variance_m2(&self) -> f64 {
        let mean = self.distance_m / self.points;
        (self.distance2_m2 / self.points - mean * mean).max(0.0)
    }

    /// Mean of the squared position error, m^2.
    pub fn position_variance_m2(&self) -> f64 {
        self.position2_m2 / self.poses
    }

    /// Mean signed distance, m.
    pub fn cloud_bias_m(&self) -> f64 {
        self.distance_m / self.points
    }
}

/// Returns the sum of all blocks.
pub fn pooled(blocks: &[Block]) -> Block {
    blocks.iter().fold(Block::default(), |mut sum, block| {
        sum.add(block, 1.0);
        sum
    })
}
