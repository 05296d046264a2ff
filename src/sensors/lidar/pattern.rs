pub use super::beam::Beam;
use super::beam::MAX_BEAMS;
use super::interlaced::Interlaced;
use super::rosette::Rosette;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use zsim_base::spec::{Source, SpecError, checked};

/// Directions and times of the beams of a scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum PatternSpec {
    /// A mirror that sweeps the plane z = 0 counter-clockwise, one turn per scan.
    Planar {
        /// Number of beams.
        beams: u32,
        /// Azimuth of the first beam, degrees from x.
        #[serde(with = "checked::Finite")]
        first_deg: f64,
        /// Azimuth step between beams, degrees.
        #[serde(with = "checked::Positive")]
        step_deg: f64,
        /// Number of beams that would fill a full turn, blind sector included. It determines the time between beams. By
        /// default 360 degrees over `step_deg`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        slots_per_turn: Option<u32>,
    },
    /// Channels at fixed elevations that rotate clockwise (seen from above) from azimuth 0, one turn per scan.
    Spinning {
        /// Elevation of each channel in firing order, degrees above the plane z = 0.
        elevations_deg: Vec<f64>,
        /// Time between the shots of two channels, us.
        #[serde(with = "checked::NonNegative")]
        channel_period_us: f64,
        /// Time between two firing cycles of all channels, us.
        #[serde(with = "checked::Positive")]
        round_period_us: f64,
    },
    /// A mirror that sweeps the plane z = 0 counter-clockwise in several turns per scan, each offset by one step. Beam
    /// time is not linear in azimuth, so the scan has no planar form.
    Interlaced {
        /// Number of beams per scan.
        beams: u32,
        /// Azimuth of the first beam, degrees from x.
        #[serde(with = "checked::Finite")]
        first_deg: f64,
        /// Azimuth step between neighbouring beams of the scan, degrees. Beams of one mirror turn are `mirror_turns`
        /// steps from each other.
        #[serde(with = "checked::Positive")]
        step_deg: f64,
        /// Number of beams of one mirror turn that would fill a full turn, blind sector included. By default 360 degrees over
        /// the step between beams of one mirror turn.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        slots_per_turn: Option<u32>,
        /// Mirror turns per scan.
        mirror_turns: u32,
    },
    /// A curve that rotates counter-clockwise about z while the elevation oscillates, different in each scan: an
    /// approximation of lidars with a non-repetitive pattern.
    Rosette {
        /// Number of beams per scan, evenly spaced in time over the scan period.
        beams: u32,
        /// Minimum elevation of the curve, degrees above the plane z = 0.
        #[serde(with = "checked::Finite")]
        lowest_deg: f64,
        /// Maximum elevation of the curve, degrees.
        #[serde(with = "checked::Finite")]
        highest_deg: f64,
        /// Turns about z per scan. The fractional part rotates each scan relative to the previous one.
        #[serde(with = "checked::Positive")]
        turns_per_scan: f64,
        /// Periods of the elevation per scan.
        waves_per_scan: u32,
    },
}

/// Beams of a lidar over its scans.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Pattern {
    /// Beams of scan 0 in firing order.
    pub beams: Vec<Beam>,
    /// Angles and timing of the planar form; `None` if the pattern has none.
    pub plane: Option<Plane>,
    /// Rotation of the pattern about z from one scan to the next, turns.
    pub turns_per_scan: f64,
}

/// Angles and timing of a planar scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Plane {
    pub angle_min_rad: f64,
    pub angle_increment_rad: f64,
    pub time_increment_s: f64,
}

impl PatternSpec {
    /// The pattern for a lidar with `rate_hz` scans per second.
    pub(super) fn build(&self, rate_hz: f64, source: &Source) -> Result<Pattern, SpecError> {
        let unrotated = |beams| Pattern { beams, plane: None, turns_per_scan: 0.0 };
        match self {
            &Self::Planar { beams, first_deg, step_deg, slots_per_turn } => {
                let slots_per_turn = slots_per_turn.unwrap_or_else(|| steps_per_turn(step_deg));
                if beams == 0 || beams > slots_per_turn || beams as usize > MAX_BEAMS {
                    let message = format!("{beams} beams in {slots_per_turn} slots a turn: give 1 to {slots_per_turn}");
                    return Err(SpecError::about(source, "beams", message));
                }
                let plane = Plane {
                    angle_min_rad: first_deg.to_radians(),
                    angle_increment_rad: step_deg.to_radians(),
                    time_increment_s: 1.0 / (rate_hz * f64::from(slots_per_turn)),
                };
                let beams = (0..beams).map(|k| plane.beam(k)).collect();
                Ok(Pattern { plane: Some(plane), ..unrotated(beams) })
            }
            Self::Spinning { elevations_deg, channel_period_us, round_period_us } => {
                let (channel_s, round_s) = (channel_period_us * 1e-6, round_period_us * 1e-6);
                Ok(unrotated(spinning(elevations_deg, channel_s, round_s, rate_hz, source)?))
            }
            &Self::Interlaced { beams, first_deg, step_deg, slots_per_turn, mirror_turns } => {
                let slots_per_turn =
                    slots_per_turn.unwrap_or_else(|| steps_per_turn(step_deg * f64::from(mirror_turns)));
                let (first_rad, step_rad) = (first_deg.to_radians(), step_deg.to_radians());
                let interlaced = Interlaced { beams, first_rad, step_rad, slots_per_turn, mirror_turns };
                Ok(unrotated(interlaced.beams(rate_hz, source)?))
            }
            &Self::Rosette { beams, lowest_deg, highest_deg, turns_per_scan, waves_per_scan } => {
                let rosette = Rosette { beams, lowest_deg, highest_deg, turns: turns_per_scan, waves: waves_per_scan };
                Ok(Pattern { turns_per_scan, ..unrotated(rosette.beams(rate_hz, source)?) })
            }
        }
    }
}

impl Plane {
    fn beam(&self, k: u32) -> Beam {
        let azimuth = self.angle_min_rad + f64::from(k) * self.angle_increment_rad;
        Beam::new(azimuth, 0.0, f64::from(k) * self.time_increment_s)
    }
}

/// Number of steps of `step_deg` that fill a turn.
fn steps_per_turn(step_deg: f64) -> u32 {
    (360.0 / step_deg).round() as u32
}

fn spinning(
    elevations_deg: &[f64],
    channel_s: f64,
    round_s: f64,
    rate_hz: f64,
    source: &Source,
) -> Result<Vec<Beam>, SpecError> {
    let refuse = |key: &str, message: String| Err(SpecError::about(source, key, message));
    if elevations_deg.is_empty() || elevations_deg.iter().any(|e| !(-90.0..=90.0).contains(e)) {
        return refuse(
            "elevations_deg",
            "give at least one channel, each with an elevation from -90 to 90 degrees".into(),
        );
    }
    if channel_s * (elevations_deg.len() - 1) as f64 > round_s {
        return refuse("channel_period_us", "the channels of a firing cycle take longer than the cycle".into());
    }
    let rounds = (1.0 / (rate_hz * round_s)).floor() as usize;
    if rounds == 0 || rounds.saturating_mul(elevations_deg.len()) > MAX_BEAMS {
        return refuse(
            "round_period_us",
            format!("{rounds} firing cycles a turn; give at least 1, and at most {MAX_BEAMS} beams"),
        );
    }
    let beam = |round: usize, channel: usize| {
        let offset_s = round as f64 * round_s + channel as f64 * channel_s;
        Beam::new(-TAU * rate_hz * offset_s, elevations_deg[channel].to_radians(), offset_s)
    };
    Ok((0..rounds).flat_map(|round| (0..elevations_deg.len()).map(move |channel| beam(round, channel))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::Vector;

    fn source() -> Source {
        Source::in_memory("lidar.ron", "(\n pattern: planar(\n beams: 1441,\n))")
    }

    #[test]
    fn the_beams_of_a_utm30lx_run_from_minus_135_to_135_degrees_in_18_75_ms() {
        let pattern =
            PatternSpec::Planar { beams: 1081, first_deg: -135.0, step_deg: 0.25, slots_per_turn: Some(1440) };
        let Pattern { beams, plane, .. } = pattern.build(40.0, &source()).unwrap();
        let (first, last) = (beams[0], beams[1080]);
        assert_relative_eq!(
            first.direction_in_laser,
            Vector::new(-0.5_f64.sqrt(), -0.5_f64.sqrt(), 0.0),
            epsilon = 1e-12
        );
        assert_relative_eq!(
            last.direction_in_laser,
            Vector::new(-0.5_f64.sqrt(), 0.5_f64.sqrt(), 0.0),
            epsilon = 1e-12
        );
        assert_relative_eq!(beams[540].direction_in_laser, Vector::x(), epsilon = 1e-12);
        assert_eq!((beams[1].offset.nanos(), last.offset.nanos()), (17_361, 18_750_000));
        assert_relative_eq!(plane.unwrap().time_increment_s, 17.361_111e-6, epsilon = 1e-12);
    }

    #[test]
    fn more_beams_than_slots_are_rejected_with_their_position() {
        let pattern = PatternSpec::Planar { beams: 1441, first_deg: 0.0, step_deg: 0.25, slots_per_turn: Some(1440) };
        assert_eq!(pattern.build(40.0, &source()).unwrap_err().line_and_column(), Some((3, 2)));
    }

    #[test]
    fn a_spinning_lidar_turns_clockwise_while_its_channels_fire() {
        // Two channels 1 ms apart, cycles of 25 ms, 10 Hz: 36 degrees take 10 ms, so a cycle rotates by 90 and a
        // channel by 3.6.
        let (channel_period_us, round_period_us) = (1e3, 25e3);
        let pattern = PatternSpec::Spinning { elevations_deg: vec![-30.0, 30.0], channel_period_us, round_period_us };
        let Pattern { beams, plane, .. } = pattern.build(10.0, &source()).unwrap();
        assert!(plane.is_none());
        assert_eq!(beams.len(), 8);
        assert_relative_eq!(beams[2].direction_in_laser, Vector::new(0.0, -0.75_f64.sqrt(), -0.5), epsilon = 1e-12);
        assert_eq!(beams[3].offset.nanos(), 26_000_000);
        let expected = Beam::new((-93.6_f64).to_radians(), 30_f64.to_radians(), 0.026);
        assert_relative_eq!(beams[3].direction_in_laser, expected.direction_in_laser, epsilon = 1e-12);
    }
}
