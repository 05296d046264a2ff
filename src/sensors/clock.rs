use serde::{Deserialize, Serialize};
use zsim_base::spec::{Kind, NamedSpec, Source, SpecError, checked, parse_named};
use zsim_base::time::{Span, Stamp};

/// Clocks of the sensors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClocksSpec {
    /// Clock of the lidar. Trajectories are written in lidar time.
    #[serde(default)]
    pub lidar: ClockSpec,
    /// Clock of the IMU.
    #[serde(default)]
    pub imu: ClockSpec,
}

/// Error model of a sensor clock relative to true time; without keys an exact clock.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClockSpec {
    /// Offset at the start of the run, ms; positive is ahead of true time.
    #[serde(default, with = "checked::Finite")]
    pub offset_ms: f64,
    /// Rate error, ppm; positive runs fast (1 ms per minute is 16.67 ppm).
    #[serde(default, with = "checked::Finite")]
    pub rate_ppm: f64,
    /// Jitter: standard deviation of the white noise on a stamp, ms.
    #[serde(default, with = "checked::NonNegative")]
    pub jitter_ms: f64,
    /// Resolution, ms: stamps are rounded down to a multiple of it; 0 disables the rounding.
    #[serde(default, with = "checked::NonNegative")]
    pub resolution_ms: f64,
}

/// Clocks of the sensors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clocks {
    /// Clock of the lidar.
    pub lidar: Clock,
    /// Clock of the IMU.
    pub imu: Clock,
}

/// A sensor clock without jitter.
///
/// True time `t` is in seconds from the start of the run, `epoch`. The crystal reads `epoch + offset + (1 + rate) t`
/// and triggers the samples of the sensor. Stamps are the reading rounded down to the resolution, so they lag by half
/// of it on average: [`Clock::stamp_of`] is this mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    epoch: Stamp,
    offset_s: f64,
    /// Crystal seconds per true second.
    pace: f64,
    jitter_s: f64,
    resolution: Span,
}

impl Clocks {
    /// The clocks that `spec`, from `source`, describes, in a run that starts at `epoch`.
    ///
    /// # Errors
    /// If the rate of a clock is off by more than 10 %, its offset exceeds a day, or its jitter or resolution exceeds 1
    /// s.
    pub fn new(spec: &ClocksSpec, source: &Source, epoch: Stamp) -> Result<Self, SpecError> {
        Ok(Self { lidar: Clock::new(&spec.lidar, source, epoch)?, imu: Clock::new(&spec.imu, source, epoch)? })
    }
}

impl Clock {
    /// The clock that `spec`, from `source`, describes, in a run that starts at `epoch`.
    ///
    /// # Errors
    /// If its rate is off by more than 10 %, its offset exceeds a day, or its jitter or resolution exceeds 1 s.
    pub fn new(spec: &ClockSpec, source: &Source, epoch: Stamp) -> Result<Self, SpecError> {
        let limits = [
            ("rate_ppm", spec.rate_ppm, 1e5, "ppm"),
            ("offset_ms", spec.offset_ms, 86_400e3, "ms"),
            ("jitter_ms", spec.jitter_ms, 1e3, "ms"),
            ("resolution_ms", spec.resolution_ms, 1e3, "ms"),
        ];
        for (key, value, limit, unit) in limits {
            if value.abs() > limit {
                let message = format!("{key} is {value} {unit}; it must be within {limit} {unit}");
                return Err(SpecError::about(source, key, message));
            }
        }
        Ok(Self {
            epoch,
            offset_s: spec.offset_ms * 1e-3,
            pace: 1.0 + spec.rate_ppm * 1e-6,
            jitter_s: spec.jitter_ms * 1e-3,
            resolution: Span::from_seconds(spec.resolution_ms * 1e-3),
        })
    }

    /// A clock that shows true time.
    pub fn exact(epoch: Stamp) -> Self {
        Self { epoch, offset_s: 0.0, pace: 1.0, jitter_s: 0.0, resolution: Span::ZERO }
    }

    /// Crystal seconds per true second.
    pub fn pace(&self) -> f64 {
        self.pace
    }

    /// Standard deviation of the jitter of a stamp, s.
    pub fn jitter_s(&self) -> f64 {
        self.jitter_s
    }

    /// Resolution to which stamps are rounded down.
    pub fn resolution(&self) -> Span {
        self.resolution
    }

    /// Reading of the crystal at `t_s` true seconds after the start.
    pub fn crystal(&self, t_s: f64) -> Stamp {
        self.epoch + Span::from_seconds(self.offset_s + self.pace * t_s)
    }

    /// True seconds after the start at which the crystal reads `stamp`.
    pub fn true_s_of_crystal(&self, stamp: Stamp) -> f64 {
        ((stamp - self.epoch).seconds() - self.offset_s) / self.pace
    }

    /// The first reading of the crystal from `stamp` on that is half-way between two ticks of the resolution.
    ///
    /// A sensor that starts at such a reading, with a period of whole ticks, loses exactly half a tick by rounding: the
    /// mean that [`Clock::offset_at`] assumes. A sensor that starts on a tick would lose nothing, and that mean would
    /// not apply.
    pub fn half_tick_from(&self, stamp: Stamp) -> Stamp {
        let half = self.half_tick();
        let tick = (stamp - half).floor_to(self.resolution);
        if tick + half == stamp { stamp } else { tick + self.resolution + half }
    }

    fn half_tick(&self) -> Span {
        Span::from_nanos(self.resolution.nanos() / 2)
    }

    /// Mean difference of stamps from true time at `t_s`, rounding included; positive is ahead.
    pub fn offset_at(&self, t_s: f64) -> Span {
        Span::from_seconds(self.offset_s + (self.pace - 1.0) * t_s) - self.half_tick()
    }

    /// Mean stamp at `t_s` true seconds after the start.
    pub fn stamp_of(&self, t_s: f64) -> Stamp {
        self.crystal(t_s) - self.half_tick()
    }

    /// True time, s after the start, at which the mean stamp is `stamp`.
    pub fn true_s(&self, stamp: Stamp) -> f64 {
        self.true_s_of_crystal(stamp + self.half_tick())
    }

    /// The first multiple of `step` that is a mean stamp within the run.
    pub fn first_multiple(&self, step: Span) -> Stamp {
        let start = self.stamp_of(0.0);
        let floor = start.floor_to(step);
        if floor == start { floor } else { floor + step }
    }
}

impl NamedSpec for ClocksSpec {
    const KIND: Kind = Kind::Clock;
    type Error = SpecError;

    fn parse(source: &Source) -> Result<Self, SpecError> {
        parse_named(source)
    }

    fn check_model(&self, source: &Source) -> Result<Vec<String>, SpecError> {
        Clocks::new(self, source, Stamp::from_nanos(0)).map(|_| Vec::new())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::spec::{Kind, find};

    fn clock(offset_ms: f64, rate_ppm: f64, resolution_ms: f64) -> Clock {
        let spec = ClockSpec { offset_ms, rate_ppm, jitter_ms: 0.0, resolution_ms };
        Clock::new(&spec, &Source::in_memory("clock", ""), Stamp::from_nanos(1_000_000_000_000)).unwrap()
    }

    #[test]
    fn a_clock_that_gains_a_millisecond_a_minute_is_16_67_ppm_fast() {
        let clock = clock(3.0, 1e6 * 1e-3 / 60.0, 0.0);
        assert_eq!(clock.offset_at(0.0).nanos(), 3_000_000);
        assert_eq!(clock.offset_at(120.0).nanos(), 5_000_000);
        assert_eq!(clock.stamp_of(60.0).nanos(), 1_060_004_000_000);
        assert!((clock.true_s(clock.stamp_of(47.123)) - 47.123).abs() < 1e-9);
    }

    #[test]
    fn rounding_down_lags_by_half_the_resolution_on_average() {
        let clock = clock(0.0, 0.0, 1.0);
        let errors = (0..1000).map(|k| {
            let t = f64::from(k) * 1.001e-3;
            (clock.crystal(t).floor_to(clock.resolution()) - clock.crystal(t)).seconds()
        });
        let mean = errors.sum::<f64>() / 1000.0;
        assert!((mean - clock.offset_at(0.0).seconds()).abs() < 1e-6, "{mean}");
    }

    #[test]
    fn the_first_whole_millisecond_is_not_before_the_start() {
        let ms = Span::from_nanos(1_000_000);
        assert_eq!(clock(0.0, 0.0, 0.0).first_multiple(ms).nanos(), 1_000_000_000_000);
        assert_eq!(clock(0.3, 0.0, 0.0).first_multiple(ms).nanos(), 1_000_001_000_000);
        assert_eq!(clock(-0.3, 0.0, 0.0).first_multiple(ms).nanos(), 1_000_000_000_000);
    }

    #[test]
    fn half_way_between_ticks_is_half_a_millisecond_past_one() {
        let ns = Stamp::from_nanos;
        assert_eq!(clock(0.0, 0.0, 1.0).half_tick_from(ns(2_000_000)), ns(2_500_000));
        assert_eq!(clock(0.0, 0.0, 1.0).half_tick_from(ns(2_500_000)), ns(2_500_000));
        assert_eq!(clock(0.0, 0.0, 1.0).half_tick_from(ns(2_500_001)), ns(3_500_000));
        assert_eq!(clock(0.0, 0.0, 0.0).half_tick_from(ns(2_000_001)), ns(2_000_001));
    }

    #[test]
    fn every_built_in_clock_loads() {
        let names = zsim_base::spec::names(Kind::Clock);
        assert!(names.contains(&"drifting".to_owned()), "{names:?}");
        for name in names {
            let source = find(Kind::Clock, &name).unwrap();
            let clocks = Clocks::new(&ClocksSpec::parse(&source).unwrap(), &source, Stamp::default()).unwrap();
            assert_eq!(
                clocks.lidar.offset_at(0.0).nanos(),
                -clocks.lidar.resolution().nanos() / 2,
                "offset of the reference clock: {name}"
            );
        }
    }

    #[test]
    fn a_clock_that_runs_twice_as_fast_is_rejected() {
        let spec = ClockSpec { offset_ms: 0.0, rate_ppm: 1e6, jitter_ms: 0.0, resolution_ms: 0.0 };
        let error = Clock::new(&spec, &Source::in_memory("c.ron", "(\nrate_ppm: 1e6)"), Stamp::default()).unwrap_err();
        assert_eq!(error.line_and_column(), Some((2, 1)));
    }
}
