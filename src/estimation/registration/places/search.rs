//! The search for places that were seen twice.

use super::album::Album;
use super::context::{self, Context};
use super::fit::{ALIGNED_LEVELS, Alignment, Fit, Seen, agreement, lay};
use super::{LoopReport, PlacesSpec, Tie, WITHIN_REACH, shifts};
use crate::estimation::matching::Matcher;
use rayon::prelude::*;

/// Two views of one place are taken from no farther apart, m: the descriptors stay alike.
const BESIDE_M: f64 = 3.0;
/// Alignments from which a pair is tried.
const STARTS: usize = 3;
/// Alignments that differ by less, m and rad, are one.
const SAME: (f64, f64) = (0.5, 0.1);
/// The best alignment is ambiguous when another has more than this share of its agreement.
const AMBIGUOUS: f64 = 0.8;
/// Fewest matches by which neighbouring places hang together.
const LINKED: usize = 30;

/// Which loops to look for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wanted {
    /// All, those as well that the course already goes through.
    All,
    /// Those of places none of whose like is where the course has it.
    OutOfReach,
}

/// A place with another that looks like it.
#[derive(Debug, Clone, Copy)]
struct Proposal {
    /// The later place, and the earlier one.
    places: (usize, usize),
    yaw: f64,
    distance: f64,
}

/// What became of a place's proposals.
#[derive(Debug, Clone, Copy, Default)]
struct Outcome {
    laid: usize,
    found: Option<Tie>,
}

/// The album with all that it takes to look through it.
pub(super) struct Search<'a> {
    pub(super) album: Album<'a>,
    pub(super) matcher: &'a Matcher,
    pub(super) spec: &'a PlacesSpec,
}

impl Search<'_> {
    /// The loops that are wanted, in the order of time, and how many were proposed and verified.
    pub(super) fn loops(&self, wanted: Wanted) -> (Vec<Tie>, LoopReport) {
        let outcomes: Vec<Outcome> =
            self.proposals().into_par_iter().map(|of_place| self.examine(&of_place, wanted)).collect();
        let loops: Vec<Tie> = outcomes.iter().filter_map(|outcome| outcome.found).collect();
        let proposed = outcomes.iter().map(|outcome| outcome.laid).sum();
        let report = LoopReport { proposed, verified: loops.len(), closed: 0 };
        (loops, report)
    }

    /// Of each place, the earlier ones that look most like it, most alike first.
    fn proposals(&self) -> Vec<Vec<Proposal>> {
        let places = &self.album.places;
        let context = |place: usize| Context::of(self.album.patches(place, 0), places[place].ground_m);
        let contexts: Vec<Context> = (0..places.len()).into_par_iter().map(context).collect();
        // Neighbours in time are alike too.
        let in_time = 2 * (self.spec.min_apart_s / self.spec.length_s).ceil() as usize;
        let near = context::nearest(&contexts, self.spec.candidates + in_time);
        let of_place = |late: usize| {
            let propose = |early: &usize| {
                let likeness = contexts[late].likeness(&contexts[*early])?;
                let proposal = Proposal { places: (late, *early), yaw: likeness.yaw, distance: likeness.distance };
                Some(proposal).filter(|proposal| self.is_possible(proposal))
            };
            let earlier = near[late].iter().filter(|early| **early < late);
            let mut proposals: Vec<Proposal> = earlier.filter_map(propose).collect();
            proposals.sort_by(|a, b| a.distance.total_cmp(&b.distance));
            proposals.truncate(self.spec.tries);
            proposals
        };
        (0..places.len()).into_par_iter().map(of_place).collect()
    }

    /// Whether two places are alike enough and apart in time, and the open loop can have drifted so far.
    fn is_possible(&self, proposal: &Proposal) -> bool {
        let (late, early) = (&self.album.places[proposal.places.0], &self.album.places[proposal.places.1]);
        let (may_drift_m, may_turn) = self.may_drift(proposal.places);
        late.tau_s - early.tau_s >= self.spec.min_apart_s
            && proposal.distance < self.spec.max_distance
            && (late.head - early.head).norm() < BESIDE_M + may_drift_m
            && proposal.yaw.abs() < may_turn
    }

    /// How far the open loop may have drifted between two places, m and rad.
    fn may_drift(&self, (late, early): (usize, usize)) -> (f64, f64) {
        let minutes = (self.album.places[late].tau_s - self.album.places[early].tau_s) / 60.0;
        let spec = self.spec;
        let turn_deg = spec.max_turn_deg + spec.max_turn_deg_per_min * minutes;
        (spec.max_drift_m + spec.max_drift_m_per_min * minutes, turn_deg.to_radians())
    }

    /// A loop among a place's proposals.
    fn examine(&self, proposals: &[Proposal], wanted: Wanted) -> Outcome {
        let mut outcome = Outcome::default();
        let Some(first) = proposals.first() else { return outcome };
        let late = self.seen(first.places.0);
        for Proposal { places, yaw, .. } in proposals {
            let early = self.seen(places.1);
            let now = self.by_course(*places);
            let is_there = self.agreement(&late, &early, &now).is_some_and(|share| share >= self.spec.min_agreement);
            if is_there && wanted == Wanted::OutOfReach {
                return Outcome { found: None, ..outcome };
            }
            outcome.laid += 1;
            let Some(fit) = self.verify((&late, &early), *places, *yaw) else { continue };
            let (shift_m, turn) = fit.alignment.apart(&now);
            if shift_m < WITHIN_REACH.0 && turn < WITHIN_REACH.1 && wanted == Wanted::OutOfReach {
                return Outcome { found: None, ..outcome };
            }
            let (may_drift_m, may_turn) = self.may_drift(*places);
            if shift_m < may_drift_m && turn < may_turn {
                outcome.found = outcome.found.or(Some(self.tie(*places, &fit)));
            }
        }
        outcome
    }

    /// The alignment of two places by their surfaces, where there is one and no other.
    fn verify(&self, (late, early): (&Seen, &Seen), places: (usize, usize), yaw: f64) -> Option<Fit> {
        let grounds = |place: usize| self.album.places[place].ground_m;
        let up_m = grounds(places.1) - grounds(places.0);
        let mut starts = shifts::starts(late.finest(), early.finest(), (yaw, up_m), STARTS);
        starts.push(self.by_course(places));
        let laid = |start: &Alignment| {
            let fit = lay(late, early, start, self.matcher)?;
            Some((self.agreement(late, early, &fit.alignment)?, fit))
        };
        let fits: Vec<(f64, Fit)> = starts.iter().filter_map(laid).collect();
        let (best, fit) = *fits.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let is_other = |other: &Fit| {
            let (shift_m, turn) = other.alignment.apart(&fit.alignment);
            shift_m > SAME.0 || turn > SAME.1
        };
        let next = fits.iter().filter(|(_, other)| is_other(other)).map(|(share, _)| *share).fold(0.0, f64::max);
        (best >= self.spec.min_agreement && next < AMBIGUOUS * best).then_some(fit)
    }

    /// How neighbouring places lie beside each other, where what they saw tells it.
    pub(super) fn links(&self) -> Vec<Tie> {
        let link = |early: usize| {
            let places = (early + 1, early);
            let fit = lay(&self.seen(places.0), &self.seen(places.1), &self.by_course(places), self.matcher)?;
            (fit.matches >= LINKED).then(|| self.tie(places, &fit))
        };
        (0..self.album.places.len().saturating_sub(1)).into_par_iter().filter_map(link).collect()
    }

    fn tie(&self, (late, early): (usize, usize), fit: &Fit) -> Tie {
        let instant_s = |place: usize| self.album.places[place].tau_s;
        let instants_s = (instant_s(late), instant_s(early));
        Tie { instants_s, alignment: fit.alignment, information: fit.information }
    }

    fn seen(&self, place: usize) -> Seen {
        let levels = 0..ALIGNED_LEVELS.min(self.matcher.levels);
        Seen::new(levels.map(|level| self.album.patches(place, level).collect()).collect(), self.matcher)
    }

    fn by_course(&self, (late, early): (usize, usize)) -> Alignment {
        let head = |place: usize| self.album.places[place].head;
        Alignment { yaw: 0.0, shift: head(late) - head(early) }
    }

    fn agreement(&self, late: &Seen, early: &Seen, alignment: &Alignment) -> Option<f64> {
        agreement(late, early, alignment, (self.matcher, self.spec.max_plane_distance_m))
    }
}
