use crate::spec::{Source, SpecError, checked};
use crate::time::{Span, Stamp};
use serde::{Deserialize, Serialize};

/// The clocks of the sensors, one each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClocksSpec {
    /// The lidar's. Its time is the one in which trajectories are written.
    pub lidar: ClockSpec,
    /// The IMU's.
    pub imu: ClockSpec,
}

/// A sensor's clock against true time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClockSpec {
    /// How far it is ahead at the start, ms.
    #[serde(with = "checked::Finite")]
    pub offset_ms: f64,
    /// How much faster it runs, parts per million (1 ms a minute is 16.67 ppm).
    #[serde(with = "checked::Finite")]
    pub rate_ppm: f64,
    /// Standard deviation of the white noise on a stamp, ms.
    #[serde(with = "checked::NonNegative")]
    pub jitter_ms: f64,
    /// What stamps are rounded down to a multiple of, ms; 0 for none.
    #[serde(with = "checked::NonNegative")]
    pub resolution_ms: f64,
}

/// The clocks of the sensors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clocks {
    /// The lidar's.
    pub lidar: Clock,
    /// The IMU's.
    pub imu: Clock,
}

/// A sensor's clock: what it says at a true time, jitter aside.
///
/// True time `t` is counted in seconds from the start of the run, `epoch`. The crystal says `epoch + offset + (1 +
/// rate) t`, and the sensor takes its samples by its own crystal. Stamps are the crystal's reading rounded down to the
/// resolution, so on average they lag by half of that: [`Clock::stamp_of`] is this mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    epoch: Stamp,
    offset_s: f64,
    /// Crystal seconds a true second.
    pace: f64,
    jitter_s: f64,
    resolution: Span,
}

impl Clocks {
    /// The clocks that `spec`, from `source`, describes, in a run that starts at `epoch`.
    ///
    /// # Errors
    /// When a clock is off by more than a tenth of its rate, or by more than a day.
    pub fn new(spec: &ClocksSpec, source: &Source, epoch: Stamp) -> Result<Self, SpecError> {
        Ok(Self { lidar: Clock::new(&spec.lidar, source, epoch)?, imu: Clock::new(&spec.imu, source, epoch)? })
    }
}

impl Clock {
    /// The clock that `spec`, from `source`, describes, in a run that starts at `epoch`.
    ///
    /// # Errors
    /// When it is off by more than a tenth of its rate, by more than a day, or jitters or rounds by more than a second.
    pub fn new(spec: &ClockSpec, source: &Source, epoch: Stamp) -> Result<Self, SpecError> {
        let limits = [
            ("rate_ppm", spec.rate_ppm, 1e5, "ppm"),
            ("offset_ms", spec.offset_ms, 86_400e3, "ms"),
            ("jitter_ms", spec.jitter_ms, 1e3, "ms"),
            ("resolution_ms", spec.resolution_ms, 1e3, "ms"),
        ];
        for (key, value, limit, unit) in limits {
            if value.abs() > limit {
                let message = format!("{key} is {value} {unit}; a clock is within {limit} {unit}");
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

    /// A clock that tells true time.
    pub fn exact(epoch: Stamp) -> Self {
        Self { epoch, offset_s: 0.0, pace: 1.0, jitter_s: 0.0, resolution: Span::ZERO }
    }

    /// Crystal seconds a true second.
    pub fn pace(&self) -> f64 {
        self.pace
    }

    /// Standard deviation of the noise on a stamp, s.
    pub fn jitter_s(&self) -> f64 {
        self.jitter_s
    }

    /// What stamps are rounded down to a multiple of.
    pub fn resolution(&self) -> Span {
        self.resolution
    }

    /// What the crystal says `t_s` true seconds after the start.
    pub fn crystal(&self, t_s: f64) -> Stamp {
        self.epoch + Span::from_seconds(self.offset_s + self.pace * t_s)
    }

    /// When the crystal says `stamp`, true seconds after the start.
    pub fn true_s_of_crystal(&self, stamp: Stamp) -> f64 {
        ((stamp - self.epoch).seconds() - self.offset_s) / self.pace
    }

    /// The first instant of the crystal from `stamp` on that lies half-way between two ticks of the resolution.
    ///
    /// A sensor that starts there, and whose period is a whole number of ticks, loses exactly half a tick by rounding:
    /// the mean that [`Clock::ahead`] counts with. Started on a tick it would lose nothing, and the mean would be
    /// wrong.
    pub fn half_tick_from(&self, stamp: Stamp) -> Stamp {
        let half = self.half_tick();
        let tick = (stamp - half).floor_to(self.resolution);
        if tick + half == stamp { stamp } else { tick + self.resolution + half }
    }

    fn half_tick(&self) -> Span {
        Span::from_nanos(self.resolution.nanos() / 2)
    }

    /// How far stamps are ahead of true time at `t_s`: jitter aside, the mean of the rounding included.
    pub fn ahead(&self, t_s: f64) -> Span {
        Span::from_seconds(self.offset_s + (self.pace - 1.0) * t_s) - self.half_tick()
    }

    /// The mean stamp of the instant `t_s` true seconds after the start.
    pub fn stamp_of(&self, t_s: f64) -> Stamp {
        self.crystal(t_s) - self.half_tick()
    }

    /// The true time, s after the start, of which `stamp` is the mean stamp.
    pub fn true_s(&self, stamp: Stamp) -> f64 {
        self.true_s_of_crystal(stamp + self.half_tick())
    }

    /// The first multiple of `step` that is the mean stamp of an instant of the run.
    pub fn first_multiple(&self, step: Span) -> Stamp {
        let start = self.stamp_of(0.0);
        let floor = start.floor_to(step);
        if floor == start { floor } else { floor + step }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::{Kind, find, parse};

    fn clock(offset_ms: f64, rate_ppm: f64, resolution_ms: f64) -> Clock {
        let spec = ClockSpec { offset_ms, rate_ppm, jitter_ms: 0.0, resolution_ms };
        Clock::new(&spec, &Source::in_memory("clock", ""), Stamp::from_nanos(1_000_000_000_000)).unwrap()
    }

    #[test]
    fn a_clock_that_gains_a_millisecond_a_minute_is_16_67_ppm_fast() {
        let clock = clock(3.0, 1e6 * 1e-3 / 60.0, 0.0);
        assert_eq!(clock.ahead(0.0).nanos(), 3_000_000);
        assert_eq!(clock.ahead(120.0).nanos(), 5_000_000);
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
        assert!((mean - clock.ahead(0.0).seconds()).abs() < 1e-6, "{mean}");
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
    fn every_shipped_clock_loads() {
        let names = crate::spec::names(Kind::Clock);
        assert!(names.contains(&"drifting".to_owned()), "{names:?}");
        for name in names {
            let source = find(Kind::Clock, &name).unwrap();
            let clocks = Clocks::new(&parse(&source).unwrap(), &source, Stamp::default()).unwrap();
            assert_eq!(
                clocks.lidar.ahead(0.0).nanos(),
                -clocks.lidar.resolution().nanos() / 2,
                "the reference: {name}"
            );
        }
    }

    #[test]
    fn a_clock_that_runs_twice_as_fast_is_refused() {
        let spec = ClockSpec { offset_ms: 0.0, rate_ppm: 1e6, jitter_ms: 0.0, resolution_ms: 0.0 };
        let error = Clock::new(&spec, &Source::in_memory("c.ron", "(\nrate_ppm: 1e6)"), Stamp::default()).unwrap_err();
        assert_eq!(error.line_and_column(), Some((2, 1)));
    }
}
