use super::pattern::{Beam, MAX_BEAMS};
use crate::spec::{Source, SpecError};
use std::f64::consts::TAU;

/// A pattern that does not repeat from scan to scan: beams spaced evenly in time along a curve that turns about z while
/// it swings up and down.
///
/// An approximation: makers of such lidars tell the field of view and the rate, not the curve. Here the azimuth grows
/// steadily, by `turns` circles a scan, and the elevation is a triangle wave of `waves` periods a scan. As `waves` is
/// whole, each scan is the one before turned about z by what `turns` has beyond whole circles. Where that is the golden
/// ratio's 0.618..., scans fall into each other's largest gaps (as the golden angle spaces leaves), and coverage grows
/// for as long as one looks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rosette {
    pub beams: u32,
    pub lowest_deg: f64,
    pub highest_deg: f64,
    pub turns: f64,
    pub waves: u32,
}

impl Rosette {
    /// The beams of scan 0 of a lidar that scans `rate_hz` times a second.
    pub fn beams(&self, rate_hz: f64, source: &Source) -> Result<Vec<Beam>, SpecError> {
        let &Self { beams, lowest_deg, highest_deg, turns, waves } = self;
        let refuse = |key: &str, message: String| Err(SpecError::about(source, key, message));
        if beams == 0 || beams as usize > MAX_BEAMS {
            return refuse("beams", format!("{beams} beams a scan; 1..={MAX_BEAMS} are right"));
        }
        if !(-90.0..highest_deg).contains(&lowest_deg) || highest_deg > 90.0 {
            let message =
                format!("from {lowest_deg} to {highest_deg} degrees: a field of view rises, within -90 to 90");
            return refuse("lowest_deg", message);
        }
        if waves == 0 || waves > beams / 2 {
            return refuse("waves_per_scan", format!("{waves} waves of {beams} beams: each has two beams or more"));
        }
        let beam = |k: u32| {
            let gone = f64::from(k) / f64::from(beams);
            let phase = (gone * f64::from(waves)).fract();
            let height = 1.0 - (2.0 * phase - 1.0).abs();
            let elevation_deg = lowest_deg + (highest_deg - lowest_deg) * height;
            Beam::new(TAU * (gone * turns).fract(), elevation_deg.to_radians(), gone / rate_hz)
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
    fn the_curve_swings_between_its_elevations_while_it_turns() {
        // 8 beams, 1 wave, half a turn, 10 Hz: beam k at 12.5 k ms and 22.5 k degrees, up by 10 degrees to beam 4 and
        // down.
        let rosette = Rosette { beams: 8, lowest_deg: -20.0, highest_deg: 20.0, turns: 0.5, waves: 1 };
        let beams = rosette.beams(10.0, &source()).unwrap();
        for (k, elevation_deg) in [-20.0, -10.0, 0.0, 10.0, 20.0, 10.0, 0.0, -10.0_f64].into_iter().enumerate() {
            let expected = Beam::new((22.5 * k as f64).to_radians(), elevation_deg.to_radians(), 0.0125 * k as f64);
            assert_relative_eq!(beams[k].direction_in_laser, expected.direction_in_laser, epsilon = 1e-12);
            assert_relative_eq!(beams[k].offset_s, expected.offset_s, epsilon = 1e-15);
        }
    }

    #[test]
    fn a_field_of_view_upside_down_is_refused_where_it_stands() {
        let rosette = Rosette { beams: 8, lowest_deg: 52.0, highest_deg: -7.0, turns: 0.5, waves: 1 };
        assert_eq!(rosette.beams(10.0, &source()).unwrap_err().line_and_column(), Some((2, 2)));
    }
}
