use crate::spec::SpecError;

/// Longest run, s: 7 days, whose recording takes 600 GB and more.
pub const LONGEST_S: f64 = 604_800.0;

/// Why a motion cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum MotionError {
    /// The motion's spec is wrong.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// A motion that follows a route, in a scene that has none.
    #[error(
        "the motion {motion} follows a route, but the scene names none; give the scene a route, or choose a motion that needs none, such as `stand`"
    )]
    NoRoute {
        /// The motion's name.
        motion: String,
    },
    /// A route of too few points.
    #[error("the route has {points} point(s); a way to follow needs at least two (three where it is closed)")]
    RouteTooFew {
        /// How many it has.
        points: usize,
    },
    /// A route too short to follow.
    #[error("the route is {length_m:.2} m long; this motion needs at least {needed_m:.2} m to follow")]
    RouteTooShort {
        /// Its length.
        length_m: f64,
        /// The least length.
        needed_m: f64,
    },
    /// Two successive points of a route at one place.
    #[error(
        "points {first} and {second} of the route (counted from 0) are at one place, {gap_m:.4} m apart; leave one of them out (a closed route returns to its first point by itself)"
    )]
    RouteRepeats {
        /// The first of them.
        first: usize,
        /// The other.
        second: usize,
        /// How far they are apart.
        gap_m: f64,
    },
    /// A route with NaN or infinity in it.
    #[error("point {index} of the route (counted from 0) is not finite")]
    RouteNotFinite {
        /// Which point.
        index: usize,
    },
    /// A length of time that is no length of time.
    #[error("a run of {duration_s} s: it lasts more than 0 s, and {LONGEST_S} s (7 days) at most")]
    Duration {
        /// What was asked for.
        duration_s: f64,
    },
    /// A motion that would need too many pieces.
    #[error("{duration_s} s of this motion take more than {most} pieces; make it shorter, slower, or its route longer")]
    TooLong {
        /// What was asked for.
        duration_s: f64,
        /// The most pieces kept.
        most: usize,
    },
}
