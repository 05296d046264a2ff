//! The output of `zsim spring`.

use super::coverage_text;
use std::collections::{BTreeMap, BTreeSet};
use zsim_head::spring::{DesignMetrics, ShakeResponse, SpringReport, mode_table, properties, stiffness_table};
use zsim_report::{digits, table, wrapped};
use zsim_study::design::{DesignStudy, VerifiedDesign};
use zsim_study::sweep::Measure;

/// The report on a spring.
pub(super) fn report(report: &SpringReport) -> String {
    let rows: Vec<_> = properties(report).into_iter().map(|row| vec![row.name.to_owned(), row.value]).collect();
    let mut words = table(&[], &rows, false);
    words += &report.falls_because.as_ref().map(|why| format!("\n{why}\n")).unwrap_or_default();
    if !report.modes.is_empty() {
        words += &format!("\n{}", mode_table(report, |mode| mode.kind.name()).body());
    }
    if let Some(stiffness) = &report.stiffness {
        words += &format!("\n{}", stiffness_table("", stiffness).body());
    }
    words + &report.shaken.as_ref().map(under_shake).unwrap_or_default()
}

fn under_shake(shaken: &ShakeResponse) -> String {
    let at = shaken.shake.frequency_hz.map_or("the slowest mode".to_owned(), |hz| format!("{hz:.2} Hz"));
    let title = format!("response to a nod by {}\u{b0} at {at}", shaken.shake.pitch_deg);
    let header = [title.as_str(), "closed form", "simulated"];
    let simulated = shaken.simulated.as_ref();
    let line = |name: &str, of: fn(&DesignMetrics) -> Option<f64>, decimals: usize| {
        let number = |figures: Option<&DesignMetrics>| {
            figures.and_then(of).map_or("-".to_owned(), |x| format!("{x:.decimals$}"))
        };
        vec![name.to_owned(), number(Some(&shaken.closed_form)), number(simulated)]
    };
    let mut rows = vec![
        line("elevation range of the forward beam, deg", |f| Some(f.field_of_view_deg), 1),
        line("maximum rate, deg/s", |f| Some(f.rate_deg_per_s), 0),
        line("stress / yield stress", |f| f.stress_share, 3),
        line("smallest gap between coils, mm", |f| f.margins.gap_mm, 2),
        line("clash margin", |f| f.margins.clash, 2),
    ];
    // Linear by definition: the simulation has none.
    let gain = format!("{:.2}", shaken.closed_form.peak_gain);
    rows.push(vec!["peak gain of the pitch rate".to_owned(), gain, "-".to_owned()]);
    if let Some(seen) = &shaken.coverage {
        let of_lidar = coverage_text::rows(seen).into_iter();
        rows.extend(of_lidar.map(|(name, value)| vec![name.to_owned(), "-".to_owned(), value]));
    }
    let failed = shaken.failed.as_ref().map(|why| format!("no simulation: {why}\n")).unwrap_or_default();
    format!("\n{}{failed}", table(&header, &rows, true))
}

/// The result of a search.
pub(super) fn design(study: &DesignStudy) -> String {
    let mut text = format!(
        "{} designs evaluated, {} within all limits in closed form, {} of them in the Pareto set\n",
        study.evaluated, study.feasible, study.pareto
    );
    text += &listed("rejected by", study.rejected.iter().map(|(limit, count)| (limit.as_str(), *count)));
    let mut simulated: BTreeMap<&str, usize> = BTreeMap::new();
    for rejection in study.rejections.iter().filter(|rejection| rejection.simulated) {
        *simulated.entry(&rejection.limit).or_default() += 1;
    }
    text += &listed("rejected by simulation", simulated.into_iter());
    let unchecked: BTreeSet<&str> = study.candidates.iter().flat_map(|design| &design.unchecked).copied().collect();
    if !unchecked.is_empty() {
        let names = unchecked.into_iter().collect::<Vec<_>>().join(", ");
        text += &wrapped(
            &format!("not checked (no strength of the wire is known, or a cable bears a part of the load): {names}"),
            "  ",
        );
    }
    if study.candidates.is_empty() {
        let advice = match study.feasible {
            0 => "no design is within all limits: widen the bounds, or relax the limit that rejects most designs",
            _ => "no design is within all limits when it is simulated: relax the limit that rejects most designs there",
        };
        return text + &wrapped(advice, "");
    }
    let header = ["spring", "Hz", "view", "rate", "g", "clash", "gap", "yield", "fatigue"];
    let rows: Vec<_> = study.candidates.iter().map(candidate_row).collect();
    let legend = "spring: name, or mean diameter x wire diameter x active coils x free length, mm. Hz: rocking frequency. g: \
                  mass of the wire. Simulated: view (field of view, deg), rate (maximum, deg/s), gap (smallest gap between \
                  coils, mm), and the margins of clash, yield and fatigue; - where a margin is unknown or does not apply. \
                  pareto.csv has all figures; rejected.csv has the rejected springs of a catalogue, and the designs that the \
                  simulation rejected.";
    format!("{text}\n{}\n{}{}", table(&header, &rows, true), wrapped(legend, ""), journeys(study))
}

/// The table of the journeys; empty without any.
fn journeys(study: &DesignStudy) -> String {
    let measures: Vec<Measure> =
        study.journey_measures().into_iter().filter(|measure| *measure != Measure::COIL_CONTACT_S).collect();
    if measures.is_empty() {
        return String::new();
    }
    let with_unit = |measure: &Measure| match measure.unit().0 {
        "1" => measure.short().to_owned(),
        unit => format!("{}, {unit}", measure.short()),
    };
    let header: Vec<String> = ["in a journey".to_owned()].into_iter().chain(measures.iter().map(with_unit)).collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let row = |design: &VerifiedDesign| {
        let figure =
            |measure: &Measure| design.journey.get(measure).map_or("-".to_owned(), |x| digits(x * measure.unit().1));
        [design.candidate.coil.label()].into_iter().chain(measures.iter().map(figure)).collect()
    };
    let rows: Vec<Vec<String>> = study.candidates.iter().map(row).collect();
    format!("\n{}", table(&header, &rows, true))
}

fn candidate_row(design: &VerifiedDesign) -> Vec<String> {
    let number = |x: Option<f64>, decimals: usize| x.map_or("-".to_owned(), |x| format!("{x:.decimals$}"));
    let (figures, simulated) = (&design.candidate.figures, &design.simulated);
    let margins = &simulated.margins;
    vec![
        design.candidate.coil.label(),
        format!("{:.3}", figures.rocking_hz),
        format!("{:.1}", simulated.field_of_view_deg),
        format!("{:.0}", simulated.rate_deg_per_s),
        number(figures.spring_mass_g, 0),
        number(margins.clash, 2),
        number(margins.gap_mm, 2),
        number(margins.yielding, 2),
        number(design.simulated.fatigue_margin, 2),
    ]
}

/// A line with counts, most frequent first; empty without any.
fn listed<'a>(title: &str, counts: impl Iterator<Item = (&'a str, usize)>) -> String {
    let mut counts: Vec<_> = counts.collect();
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    if counts.is_empty() {
        return String::new();
    }
    let items: Vec<String> = counts.iter().map(|(limit, count)| format!("{limit} {count}")).collect();
    wrapped(&format!("{title}: {}", items.join(", ")), "  ")
}
