use super::beam::{Beam, MAX_BEAMS};
use zsim_base::spec::{Source, SpecError};

/// A scan that takes several mirror turns, each offset by one step from the previous turn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Interlaced {
    /// Beams per scan.
    pub beams: u32,
    pub first_rad: f64,
    /// Angle between neighbouring beams of the scan, rad.
    pub step_rad: f64,
    /// Beams of one mirror turn that would fill a full circle.
    pub slots_per_turn: u32,
    pub mirror_turns: u32,
}

impl Interlaced {
    /// The beams in firing order, for a lidar that completes `rate_hz` scans per second.
    ///
    /// With `m` mirror turns per scan and `s` slots per turn, the beam with index `i` by azimuth is fired in turn
    /// `i mod m`, at the phase `i / (m s)` of that turn: at time `(i mod m + i / (m s)) / (m rate)`.
    pub fn beams(&self, rate_hz: f64, source: &Source) -> Result<Vec<Beam>, SpecError> {
        let &Self { beams, slots_per_turn, mirror_turns, .. } = self;
        let slots = slots_per_turn.saturating_mul(mirror_turns);
        if beams == 0 || beams > slots || beams as usize > MAX_BEAMS {
            let message = format!(
                "{beams} beams in {mirror_turns} mirror turns of {slots_per_turn} slots each: give 1 to {}",
                (slots as usize).min(MAX_BEAMS)
            );
            return Err(SpecError::about(source, "beams", message));
        }
        let mirror_hz = f64::from(mirror_turns) * rate_hz;
        let beam = |turn: u32, i: u32| {
            let turns = f64::from(turn) + f64::from(i) / f64::from(slots);
            Beam::new(self.first_rad + f64::from(i) * self.step_rad, 0.0, turns / mirror_hz)
        };
        let beams_of_turn = |turn: u32| (turn..beams).step_by(mirror_turns as usize).map(move |i| beam(turn, i));
        Ok((0..mirror_turns).flat_map(beams_of_turn).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn of_lms291(beams: u32, mirror_turns: u32) -> Interlaced {
        let step_rad = (1.0 / f64::from(mirror_turns)).to_radians();
        Interlaced { beams, first_rad: (-90_f64).to_radians(), step_rad, slots_per_turn: 360, mirror_turns }
    }

    fn source() -> Source {
        Source::in_memory("lidar.ron", "(\n beams: 721,\n)")
    }

    fn azimuth_deg(beam: &Beam) -> f64 {
        beam.direction_in_laser.y.atan2(beam.direction_in_laser.x).to_degrees()
    }

    #[test]
    fn a_scan_at_a_quarter_degree_takes_four_mirror_turns_of_one_degree() {
        let beams = of_lms291(721, 4).beams(18.75, &source()).unwrap();
        assert_eq!(beams.len(), 721);
        // Turn 0 has -90, -89, ... 90: 181 beams; the others start at -89.75, -89.5, -89.25 and end below 90: 180 each.
        for (k, azimuth) in
            [(0, -90.0), (1, -89.0), (180, 90.0), (181, -89.75), (361, -89.5), (541, -89.25), (720, 89.75)]
        {
            assert_relative_eq!(azimuth_deg(&beams[k]), azimuth, epsilon = 1e-9);
        }
        // The mirror rotates at 75 Hz: 1 degree takes 1 / 27,000 s = 37.037 us, 0.25 degrees a quarter of that.
        assert_eq!(beams[1].offset.nanos(), 37_037);
        assert_eq!(beams[180].offset.nanos(), 6_666_667);
        assert_eq!(beams[181].offset.nanos(), 13_342_593);
        assert_eq!(beams[361].offset.nanos(), 26_685_185);
        // 3 turns and 179.75 degrees: (3 + 179.75 / 360) / 75 s.
        assert_relative_eq!(beams[720].offset_s, (3.0 + 179.75 / 360.0) / 75.0, epsilon = 1e-15);
        assert!(beams.windows(2).all(|pair| pair[0].offset_s < pair[1].offset_s), "in firing order");
    }

    #[test]
    fn neighbours_at_half_a_degree_are_a_mirror_turn_apart_in_time() {
        let mut beams = of_lms291(361, 2).beams(37.5, &source()).unwrap();
        beams.sort_by(|a, b| azimuth_deg(a).total_cmp(&azimuth_deg(b)));
        for (i, pair) in beams.windows(2).enumerate() {
            assert_relative_eq!(azimuth_deg(&pair[1]) - azimuth_deg(&pair[0]), 0.5, epsilon = 1e-9);
            // Half a degree, 1 / 54,000 s, plus or minus a turn of 1 / 75 s.
            let turn_s = if i % 2 == 0 { 1.0 / 75.0 } else { -1.0 / 75.0 };
            assert_relative_eq!(pair[1].offset_s - pair[0].offset_s, turn_s + 1.0 / 54_000.0, epsilon = 1e-12);
        }
    }

    #[test]
    fn more_beams_than_the_mirror_turns_hold_are_rejected_with_their_position() {
        let error = of_lms291(721, 1).beams(75.0, &source()).unwrap_err();
        assert!(error.message().contains("721 beams in 1 mirror turns of 360 slots"), "{error}");
        assert_eq!(error.line_and_column(), Some((2, 2)));
    }
}
