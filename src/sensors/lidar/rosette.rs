use super::beam::{Beam, MAX_BEAMS};
use std::f64::consts::TAU;
use zsim_base::spec::{Source, SpecError};

/// A non-repetitive pattern: beams evenly spaced in time on a curve that rotates about z while the elevation
/// oscillates.
///
/// This is an approximation: manufacturers publish the field of view and the rate, not the curve. Azimuth increases at
/// a constant rate, `turns` circles per scan; elevation is a triangle wave with `waves` periods per scan. `waves` is an
/// integer, so each scan is the previous one rotated about z by the fractional part of `turns`. If that part is the
/// golden ratio, 0.618..., each scan fills the largest gaps of the previous ones, and coverage increases with every
/// scan.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rosette {
    pub beams: u32,
    pub lowest_deg: f64,
    pub highest_deg: f64,
    pub turns: f64,
    pub waves: u32,
}

impl Rosette {
    /// The beams of scan 0 for a lidar with `rate_hz` scans per second.
    pub fn beams(&self, rate_hz: f64, source: &Source) -> Result<Vec<Beam>, SpecError> {
        let &Self { beams, lowest_deg, highest_deg, turns, waves } = self;
        let refuse = |key: &str, message: String| Err(SpecError::about(source, key, message));
        if beams == 0 || beams as usize > MAX_BEAMS {
            return refuse("beams", format!("{beams} beams a scan; give 1 to {MAX_BEAMS}"));
        }
        if !(-90.0..highest_deg).contains(&lowest_deg) || highest_deg > 90.0 {
            let message =
                format!("from {lowest_deg} to {highest_deg} degrees: the limits must increase, within -90 to 90");
            return refuse("lowest_deg", message);
        }
        if waves == 0 || waves > beams / 2 {
            return refuse(
                "waves_per_scan",
                format!("{waves} waves of {beams} beams: each wave needs at least 2 beams"),
            );
        }
        let beam = |k: u32| {
            let fraction = f64::from(k) / f64::from(beams);
            let phase = (fraction * f64::from(waves)).fract();
            let height = 1.0 - (2.0 * phase - 1.0).abs();
            let elevation_deg = lowest_deg + (highest_deg - lowest_deg) * height;
            Beam::new(TAU * (fraction * turns).fract(), elevation_deg.to_radians(), fraction / rate_hz)
        };
        Ok((0..beams).map(beam).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn source() -> Source {
        Source::in_memory("lidar.ron", "(\n lowest_deg: 52,\n)")
    }

    #[test]
    fn the_elevation_oscillates_between_its_limits_while_the_azimuth_increases() {
        // 8 beams, 1 wave, half a turn, 10 Hz: beam k at 12.5 k ms and 22.5 k degrees, rising by 10 degrees up to beam
        // 4, then falling.
        let rosette = Rosette { beams: 8, lowest_deg: -20.0, highest_deg: 20.0, turns: 0.5, waves: 1 };
        let beams = rosette.beams(10.0, &source()).unwrap();
        for (k, elevation_deg) in [-20.0, -10.0, 0.0, 10.0, 20.0, 10.0, 0.0, -10.0_f64].into_iter().enumerate() {
            let expected = Beam::new((22.5 * k as f64).to_radians(), elevation_deg.to_radians(), 0.0125 * k as f64);
            assert_relative_eq!(beams[k].direction_in_laser, expected.direction_in_laser, epsilon = 1e-12);
            assert_relative_eq!(beams[k].offset_s, expected.offset_s, epsilon = 1e-15);
        }
    }

    #[test]
    fn an_inverted_field_of_view_is_rejected_with_its_position() {
        let rosette = Rosette { beams: 8, lowest_deg: 52.0, highest_deg: -7.0, turns: 0.5, waves: 1 };
        assert_eq!(rosette.beams(10.0, &source()).unwrap_err().line_and_column(), Some((2, 2)));
    }
}
