//! Evaluation of a design in closed form: metrics, costs and violated limits.

use super::limits::Violation;
use super::spec::{CoilDesign, DesignSpec};
use crate::sweep::{GoalSpec, Measure};
use serde::Serialize;
use zsim_base::spec::Source;
use zsim_dynamics::{HeadSpec, LinkageSpec, stands_with_mass};
use zsim_elasticity::ElasticityError;
use zsim_head::spring::{DesignMetrics, StressCycle, Wire, closed_form};

/// A feasible design.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// The coil.
    pub coil: CoilDesign,
    /// Metrics in closed form.
    pub figures: DesignMetrics,
    /// Cost for each goal, until a journey for each goal with a closed form; lower is better.
    pub costs: Vec<f64>,
}

/// Evaluation of a design.
pub(super) enum Evaluation {
    /// Within all limits.
    Feasible(Box<Candidate>),
    /// Outside these limits.
    Infeasible(Vec<Violation>),
    /// There are no metrics, for this reason.
    Invalid(&'static str),
}

impl Evaluation {
    /// The limit with the largest violation, or the reason why there are no metrics; `None` for a feasible design.
    pub fn rejected_by(&self) -> Option<&'static str> {
        match self {
            Evaluation::Feasible(_) => None,
            Evaluation::Infeasible(violations) => Violation::worst(violations).map(|violation| violation.limit),
            Evaluation::Invalid(reason) => Some(reason),
        }
    }
}

/// A head, a shake, goals and limits, with which designs are evaluated.
pub(super) struct Evaluator {
    pub spec: DesignSpec,
    pub head: HeadSpec,
    pub source: Source,
}

impl Evaluator {
    /// Evaluates a coil in closed form.
    pub fn evaluate(&self, coil: &CoilDesign) -> Evaluation {
        match coil.spring().design() {
            Ok(_) => {}
            Err(ElasticityError::OutsideRange { .. }) => return Evaluation::Invalid("range of the force law"),
            Err(_) => return Evaluation::Invalid("geometry"),
        }
        let head = self.head_on(coil);
        let Ok(figures) = closed_form(&head, &self.source, &self.spec.shake, self.spec.build.mission_hours) else {
            return Evaluation::Invalid("stable rest pose");
        };
        let mut violations = self.violations(coil, &figures);
        let unknown = self.goals().filter(|goal| goal.measure.of_head(&figures).is_none());
        violations.extend(unknown.map(|goal| Violation { limit: goal.measure.key(), value: None, excess: 1.0 }));
        // The tipping margin takes as long as all others, so it is the last.
        if violations.is_empty() && !self.keeps_tipping_margin(&head) {
            violations.push(Violation { limit: "tipping_margin", value: None, excess: 0.05 });
        }
        if !violations.is_empty() {
            return Evaluation::Infeasible(violations);
        }
        let costs = self.goals().map(|goal| goal.cost(goal.measure.cost_of_head(&figures))).collect();
        Evaluation::Feasible(Box::new(Candidate { coil: coil.clone(), figures, costs }))
    }

    /// The goals with a closed form.
    pub fn goals(&self) -> impl Iterator<Item = &GoalSpec> {
        self.spec.goals.iter().filter(|goal| goal.measure.has_closed_form())
    }

    fn keeps_tipping_margin(&self, head: &HeadSpec) -> bool {
        stands_with_mass(head, &self.source, self.spec.build.tipping_margin).unwrap_or(false)
    }

    /// The violated limits, except the tipping margin.
    ///
    /// A measure that is not known is no violation.
    pub fn violations(&self, coil: &CoilDesign, metrics: &DesignMetrics) -> Vec<Violation> {
        let of_measures = self.spec.limits.iter().filter_map(|limit| {
            let value = limit.measure.of_head(metrics)?;
            let excess = limit.excess(value);
            (excess > 0.0).then(|| Violation { limit: limit.measure.key(), value: Some(value), excess })
        });
        of_measures.chain(self.spec.build.violations(&coil.spring(), metrics)).collect()
    }

    /// The limits that cannot be checked for a spring of this wire.
    ///
    /// Without strengths there are no limits of stress. With a cable the load on the spring does not follow from the motion
    /// of the head.
    pub fn unchecked(&self, wire: &Wire) -> Vec<&'static str> {
        let unit = StressCycle { amplitude_pa: 1.0, mean_pa: 1.0 };
        let has_cable = matches!(&self.head.linkage, LinkageSpec::Spring { cable: Some(_), .. });
        let has_stress_limit = self.spec.limits.iter().any(|limit| limit.measure == Measure::STRESS_SHARE);
        let mut unchecked = Vec::new();
        if has_cable {
            unchecked.extend(["clash_margin", "gap_over_standard", "solid_margin", "buckling_margin"]);
        }
        if has_cable || wire.yield_pa().is_none() {
            unchecked.push("yield_margin");
            unchecked.extend(has_stress_limit.then_some("stress_share"));
        }
        if has_cable || wire.fatigue_margin(&unit, f64::INFINITY).is_none() {
            unchecked.push("fatigue_margin");
        }
        unchecked
    }

    /// The head on the spring.
    pub fn head_on(&self, coil: &CoilDesign) -> HeadSpec {
        let mut head = self.head.clone();
        if let LinkageSpec::Spring { spring, .. } = &mut head.linkage {
            *spring = coil.spring();
        }
        head
    }
}
