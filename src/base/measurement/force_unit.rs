//! Check of the unit of specific forces that arrive one by one.

use super::ImuSample;

/// Number of samples from which the unit is judged.
const SAMPLES: usize = 100;

/// Median norms of specific forces that are in multiples of gravity.
pub const ONE_G_RANGE: std::ops::RangeInclusive<f64> = 0.5..=2.0;

/// Judges by the first samples whether specific forces are in m/s^2.
#[derive(Debug, Clone, Default)]
pub struct ForceUnitCheck {
    norms: Vec<f64>,
}

impl ForceUnitCheck {
    /// Adds a sample.
    ///
    /// # Errors
    /// A message if the median norm of the first 100 samples is that of gravity in multiples of gravity.
    pub fn add(&mut self, sample: &ImuSample) -> Result<(), String> {
        if self.norms.len() >= SAMPLES {
            return Ok(());
        }
        self.norms.push(sample.specific_force_m_per_s2.norm());
        if self.norms.len() < SAMPLES {
            return Ok(());
        }
        self.norms.sort_unstable_by(f64::total_cmp);
        let median = self.norms[SAMPLES / 2];
        if ONE_G_RANGE.contains(&median) {
            return Err(format!(
                "specific_force_m_per_s2: the median norm of the first {SAMPLES} samples is {median:.2}; gravity alone is \
                 9.81 m/s^2: multiply accelerations in g by 9.80665"
            ));
        }
        Ok(())
    }
}
