//! Place recognition: where the open loop has drifted farther than matches reach, what was seen twice is known by its
//! looks.
//!
//! 1. The recording is cut into *places* of a few seconds. Gravity levels them: two of them differ by a turn about the
//!    vertical and a shift.
//! 2. *Proposed* are pairs of places, well apart in time, that look alike from above (Scan Context: `context`), where
//!    the open loop would not have to have drifted more than it can. For each place a tree gives a few: their number
//!    grows as the recording's length.
//! 3. A pair that already agrees where the open loop puts it needs no loop. That costs one look, and is all that a run
//!    without drift pays for.
//! 4. Others are laid upon each other, plane on plane, from several starts (`shifts`, `fit`). *Verified* is a loop when
//!    in every direction enough of what one saw lies on what the other saw, and no other alignment comes near: places
//!    that repeat themselves say nothing.
//! 5. The course is bent to the loops (`bend`), as stiff as neighbouring places hang together by what they saw in
//!    common. Loops that this contradicts are dropped. What has drifted is smeared too, so this is repeated until the
//!    course stays. Those left that were out of the open loop's reach are *closed*; where they are too few the open
//!    loop stays as it is.

mod album;
mod bend;
mod context;
mod fit;
mod search;
mod shifts;
mod spec;

pub use spec::PlacesSpec;

use super::course::Course;
use super::{RegistrationSpec, moved};
use crate::estimation::matching::Matcher;
use crate::estimation::survey::Survey;
use crate::geometry::Trajectory;
use crate::time::{Span, Stamp};
use album::Album;
use bend::bend;
use fit::Alignment;
use nalgebra::Matrix4;
use search::{Search, Wanted};

/// How freely the course bends between the loops where nothing else holds it: a random walk of m/sqrt(s),
/// degrees/sqrt(s).
const LOOSE: (f64, f64) = (0.1, 0.3);
/// The course is bent at most so often, and until it moves by less, m.
const PASSES: usize = 8;
const SETTLED_M: f64 = 0.02;

/// The open loop is near enough for matches when a loop differs from it by less, m and rad.
const WITHIN_REACH: (f64, f64) = (0.3, 0.03);

/// How the search for loops went.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LoopReport {
    /// Pairs of places that look alike, and that the open loop does not lay upon each other.
    pub proposed: usize,
    /// Of those, verified by their surfaces.
    pub verified: usize,
    /// Loops that the trajectory was bent to, out of the open loop's reach.
    pub closed: usize,
}

/// What two places say of the trajectory between them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tie {
    /// The instants of the two, s: what is seen at the first is told from the second.
    pub(super) instants_s: (f64, f64),
    pub(super) alignment: Alignment,
    /// About `[yaw, shift]`, 1/rad^2 and 1/m^2.
    pub(super) information: Matrix4<f64>,
}

/// A course within the reach of matches.
pub(super) struct Bent {
    pub(super) trajectory: Trajectory,
    /// What was seen, along it.
    pub(super) survey: Survey,
}

/// Looks for places that were seen twice, and bends the open loop to them where it is too far off for matches.
///
/// What drifts is smeared as well, and seems to have drifted less than it has: the course is bent again until it stays.
pub(super) fn into_reach(
    (map_from_head, survey): (&Trajectory, &Survey),
    course: &Course,
    matcher: &Matcher,
    spec: &RegistrationSpec,
) -> (LoopReport, Option<Bent>) {
    if !spec.places.recognised {
        return (LoopReport::default(), None);
    }
    let of_places = &spec.places;
    let search = Search { album: Album::new(survey, course, of_places), matcher, spec: of_places };
    let (loops, report) = search.loops(Wanted::OutOfReach);
    if loops.len() < of_places.min_loops {
        return (report, None);
    }
    let (mut trajectory, mut survey) = (map_from_head.clone(), survey.clone());
    let mut needed = 0;
    for _ in 0..PASSES {
        let Some(course) = Course::new(&trajectory, &[], survey.origin, &loose(spec)) else { break };
        let mut course = course.levelled_as(map_from_head, &trajectory);
        let search = Search { album: Album::new(&survey, &course, of_places), matcher, spec: of_places };
        let ((loops, _), links) = (search.loops(Wanted::All), search.links());
        let level_sigma_rad = spec.level_sigma_deg.to_radians();
        let mut together = course.clone();
        // Loops that contradict what was seen between may do so because it is smeared: the course is straightened
        // alone.
        let closed = match bend(&mut together, (&loops, &links), level_sigma_rad) {
            Some(closed) => {
                course = together;
                closed
            }
            None => match bend(&mut course, (&[], &links), level_sigma_rad) {
                Some(none) => none,
                None => return (report, None),
            },
        };
        let next = course.into_trajectory(map_from_head.stamps());
        let (shift_m, _) = moved(&trajectory, &next);
        (trajectory, survey) = (next.clone(), survey.along(&trajectory, &next));
        let was_out =
            |instants_s: &&(f64, f64)| is_out_of_reach(map_from_head, &trajectory, survey.origin, **instants_s);
        needed = closed.iter().filter(was_out).count();
        if shift_m < SETTLED_M {
            break;
        }
    }
    if needed < of_places.min_loops {
        return (report, None);
    }
    (LoopReport { closed: needed, ..report }, Some(Bent { trajectory, survey }))
}

/// Whether the open loop puts its poses at two instants, s from `origin`, elsewhere beside each other than `bent` does,
/// farther than matches reach.
fn is_out_of_reach(open_loop: &Trajectory, bent: &Trajectory, origin: Stamp, (late_s, early_s): (f64, f64)) -> bool {
    let between = |trajectory: &Trajectory| {
        let at = |tau_s: f64| trajectory.at(origin + Span::from_seconds(tau_s));
        Some(at(early_s)?.inverse() * at(late_s)?)
    };
    between(open_loop).zip(between(bent)).is_some_and(|(before, now)| {
        let apart = now.translation.vector - before.translation.vector;
        apart.norm() > WITHIN_REACH.0 || before.rotation.angle_to(&now.rotation) > WITHIN_REACH.1
    })
}

/// `spec` for a course that bends freely.
fn loose(spec: &RegistrationSpec) -> RegistrationSpec {
    RegistrationSpec { drift_m_per_sqrt_s: LOOSE.0, turn_deg_per_sqrt_s: LOOSE.1, ..spec.clone() }
}
