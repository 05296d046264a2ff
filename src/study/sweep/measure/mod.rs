//! Measures: the figures of a run's results that a study reports; `table` is their only list.

mod table;

use super::{BaseSpec, JourneySpec};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{DeserializeSeed, Deserializer, EnumAccess, Error, VariantAccess, Visitor};
use serde::{Deserialize, Serialize, Serializer};
use std::borrow::Cow;
use std::fmt;
use table::{Entry, KEYS, TABLE, Unit};
use zsim_head::spring::DesignMetrics;
use zsim_run::{Needs, Results};

/// A measure of a run: a figure of its results, by its position in the table of measures.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Measure(usize);

impl Measure {
    /// Status of the estimate.
    pub const STATUS: Self = Self::named("status");
    /// Computing time of the run.
    pub const WALL_S: Self = Self::named("wall_s");
    /// Time in which coils of the spring touch.
    pub const COIL_CONTACT_S: Self = Self::named("coil_contact_s");
    /// Error of the clock offset 30 s after the first estimate.
    pub(crate) const CLOCK_ERROR_30S_S: Self = Self::named("clock_error_30s_s");
    /// Position error of the open loop.
    pub(crate) const POSITION_RMSE_M: Self = Self::named("position_rmse_m");
    /// Peak gain.
    pub(crate) const PEAK_GAIN: Self = Self::named("peak_gain");
    /// Maximum stress over the yield strength.
    pub(crate) const STRESS_SHARE: Self = Self::named("stress_share");

    /// The measure with this key.
    ///
    /// # Panics
    /// If there is none; of a constant, when it is compiled.
    #[expect(clippy::panic, reason = "keys in code are constants: a wrong one does not compile")]
    pub const fn named(key: &str) -> Self {
        let mut index = 0;
        while index < KEYS.len() {
            if is_same(KEYS[index].as_bytes(), key.as_bytes()) {
                return Self(index);
            }
            index += 1;
        }
        panic!("no measure has this key")
    }

    /// All measures, in the order of the table.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..TABLE.len()).map(Self)
    }

    fn entry(self) -> &'static Entry {
        &TABLE[self.0]
    }

    /// The figure of a run's results; `None` if it is not known or not finite.
    pub(crate) fn of(self, results: &Results) -> Option<f64> {
        (self.entry().of)(results).filter(|figure| figure.is_finite())
    }

    /// The figure in the closed form of a head; `None` if it is not known, or has no closed form.
    pub fn of_head(self, head: &DesignMetrics) -> Option<f64> {
        self.of(&Results { head: Some(*head), ..Results::default() })
    }

    /// The figure of the closed form for goals and limits: infinite if it is not known.
    pub(crate) fn cost_of_head(self, head: &DesignMetrics) -> f64 {
        self.of_head(head).unwrap_or(f64::INFINITY)
    }

    /// Key in files.
    pub fn key(self) -> &'static str {
        self.entry().key
    }

    /// Short name for tables.
    pub fn short(self) -> &'static str {
        self.entry().short
    }

    /// Label of a plot axis, with the display unit.
    pub(crate) fn label(self) -> String {
        let Entry { quantity, unit: Unit { on_axis, .. }, .. } = self.entry();
        if on_axis.is_empty() { (*quantity).to_owned() } else { format!("{quantity} ({on_axis})") }
    }

    /// The label without the unit.
    pub(super) fn quantity(self) -> &'static str {
        self.entry().quantity.split(" (").next().unwrap_or_default()
    }

    /// Display unit, and the factor from the unit in files to it.
    pub fn unit(self) -> (&'static str, f64) {
        let Unit { text, factor, .. } = self.entry().unit;
        (text, factor)
    }

    /// What must be computed for the measure.
    pub(super) fn needs(self) -> Needs {
        self.entry().needs
    }

    /// Whether it is a computing time, which differs from run to run.
    pub(super) fn is_time(self) -> bool {
        self.needs().is_time()
    }

    /// Whether a head on its spring has this measure in closed form.
    pub(crate) fn has_closed_form(self) -> bool {
        self.needs().has_closed_form()
    }

    /// Whether it is a figure of an estimate from a recording.
    pub(crate) fn is_of_estimate(self) -> bool {
        self.needs().is_of_estimate()
    }

    /// Whether it is a figure of a journey alone: it has no closed form, and needs no second system or timing errors.
    pub(crate) fn needs_journey(self) -> bool {
        !(self.has_closed_form() || self.is_time() || matches!(self.needs(), Needs::Reference | Needs::Timing))
    }

    /// Whether runs of this base have this measure.
    pub(super) fn is_available_for(self, base: &BaseSpec) -> bool {
        match (base, self.needs()) {
            (_, Needs::WallClock) => true,
            (BaseSpec::Gains { .. }, _) => self == Self::PEAK_GAIN,
            (BaseSpec::Spring { .. }, _) => self.has_closed_form(),
            (BaseSpec::Journey(_), Needs::Head) => false,
            (BaseSpec::Journey(_), Needs::Swing | Needs::SwingOrHead) => true,
            (BaseSpec::Journey(JourneySpec { reference, .. }), Needs::Reference) => reference.is_some(),
            (BaseSpec::Journey(JourneySpec { timing: None, .. }), needs) => needs != Needs::Timing,
            (BaseSpec::Journey(JourneySpec { timing: Some(_), .. }), _) => WITH_TIMING.contains(&self),
        }
    }
}

/// Returns what must be computed for some measures.
pub(crate) fn needs(measures: &[Measure]) -> Vec<Needs> {
    measures.iter().map(|measure| measure.needs()).collect()
}

/// Returns the figures of some measures in the results of a run; `None` for each that is not known.
pub(crate) fn figures(results: &Results, measures: &[Measure]) -> Vec<Option<f64>> {
    measures.iter().map(|measure| measure.of(results)).collect()
}

/// The measures of an estimate that a run with timing errors has, too.
const WITH_TIMING: [Measure; 4] = [
    Measure::POSITION_RMSE_M,
    Measure::named("cloud_sigma_m"),
    Measure::named("cloud_bias_m"),
    Measure::named("clock_error_s"),
];

const fn is_same(a: &[u8], b: &[u8]) -> bool {
    let mut index = 0;
    while index < a.len() && index < b.len() && a[index] == b[index] {
        index += 1;
    }
    index == a.len() && index == b.len()
}

impl fmt::Debug for Measure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.key())
    }
}

impl Serialize for Measure {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_unit_variant("Measure", self.0 as u32, self.key())
    }
}

impl<'de> Deserialize<'de> for Measure {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_enum("Measure", KEYS, KeyVisitor)
    }
}

/// Reads the key of a measure, a word without quotes.
struct KeyVisitor;

impl<'de> Visitor<'de> for KeyVisitor {
    type Value = Measure;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a measure")
    }

    fn visit_enum<A: EnumAccess<'de>>(self, access: A) -> Result<Measure, A::Error> {
        let (measure, variant) = access.variant_seed(self)?;
        variant.unit_variant()?;
        Ok(measure)
    }

    fn visit_str<E: Error>(self, key: &str) -> Result<Measure, E> {
        let index = KEYS.iter().position(|known| *known == key);
        index.map(Measure).ok_or_else(|| E::unknown_variant(key, KEYS))
    }
}

impl<'de> DeserializeSeed<'de> for KeyVisitor {
    type Value = Measure;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Measure, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}

impl JsonSchema for Measure {
    fn schema_name() -> Cow<'static, str> {
        "Measure".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let choice = |entry: &Entry| json_schema!({ "description": entry.description.trim(), "type": "string", "const": entry.key });
        json_schema!({ "description": "A measure of a run.", "oneOf": TABLE.iter().map(choice).collect::<Vec<_>>() })
    }
}
