use super::FaultSpec;
use zsim_base::time::Span;

/// When a fault is active, in true time since the start of the run; end times are exclusive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Interval {
    from: Span,
    to: Option<Span>,
    /// Period and duration of a recurring fault.
    repeated: Option<(Span, Span)>,
}

impl Interval {
    /// The interval of a fault with checked times.
    pub fn from_spec(spec: &FaultSpec) -> Self {
        Self {
            from: Span::from_seconds(spec.from_s.unwrap_or(0.0)),
            to: spec.to_s.map(Span::from_seconds),
            repeated: spec.every_s.zip(spec.lasts_s).map(|(s, t)| (Span::from_seconds(s), Span::from_seconds(t))),
        }
    }

    /// Whether the fault is active at `since_start`.
    pub fn contains(&self, since_start: Span) -> bool {
        let within = since_start >= self.from && self.to.is_none_or(|to| since_start < to);
        let phase = |period: Span| (since_start - self.from).nanos().rem_euclid(period.nanos().max(1));
        within && self.repeated.is_none_or(|(period, lasts)| phase(period) < lasts.nanos())
    }

    /// Start of the interval.
    pub fn from(&self) -> Span {
        self.from
    }

    /// Start and end in a run of `duration_s`, s.
    pub fn limits_s(&self, duration_s: f64) -> (f64, f64) {
        let from_s = self.from.seconds();
        (from_s, self.to.map_or(duration_s, |to| to.seconds().min(duration_s)).max(from_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recurring_fault_is_active_at_the_start_of_each_period() {
        let ms = |ms: i64| Span::from_nanos(ms * 1_000_000);
        let interval = Interval { from: ms(1_000), to: Some(ms(5_050)), repeated: Some((ms(2_000), ms(100))) };
        let acting: Vec<i64> = (0..700).map(|k| 10 * k).filter(|t| interval.contains(ms(*t))).collect();
        let expected = (1_000..1_100).chain(3_000..3_100).chain(5_000..5_050).step_by(10);
        assert_eq!(acting, expected.collect::<Vec<_>>());
    }
}
