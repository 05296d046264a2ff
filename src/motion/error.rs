use zsim_base::spec::SpecError;

/// Longest run, s: 7 days. A recording of that length exceeds 600 GB.
pub const MAX_DURATION_S: f64 = 604_800.0;

/// Why a motion cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum MotionError {
    /// The spec of the motion is invalid.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The motion follows a route, but the scene has none.
    #[error(
        "the motion {motion} follows a route, but the scene has no default route; add `routes` to the scene, with several also `default_route`, or name one with \
         --route, or choose a motion without one, such as `stand`"
    )]
    NoRoute {
        /// Name of the motion.
        motion: String,
    },
    /// The route has too few points.
    #[error("the route has {points} point(s); an open route needs at least 2, a closed one 3")]
    RouteTooFew {
        /// Number of points.
        points: usize,
    },
    /// The route is too short.
    #[error("the route is {length_m:.2} m long; this motion needs at least {needed_m:.2} m to follow")]
    RouteTooShort {
        /// Length of the route, m.
        length_m: f64,
        /// Shortest length that the motion can follow, m.
        needed_m: f64,
    },
    /// Two successive points of the route coincide.
    #[error(
        "points {first} and {second} of the route (counted from 0) coincide (distance {gap_m:.4} m); remove one of them (a closed route returns to the first point by itself)"
    )]
    RouteRepeats {
        /// Index of the first point.
        first: usize,
        /// Index of the second point.
        second: usize,
        /// Distance between them, m.
        gap_m: f64,
    },
    /// A point of the route contains NaN or infinity.
    #[error("point {index} of the route (counted from 0) is not finite")]
    RouteNotFinite {
        /// Index of the point.
        index: usize,
    },
    /// The duration is not positive, or too long.
    #[error("a run of {duration_s} s is not possible: give more than 0 s and at most {MAX_DURATION_S} s (7 days)")]
    Duration {
        /// Requested duration, s.
        duration_s: f64,
    },
    /// The motion would need too many path segments.
    #[error(
        "{duration_s} s of this motion need more than {max} path segments; shorten the run, lower the speed, or lengthen the route"
    )]
    TooLong {
        /// Requested duration, s.
        duration_s: f64,
        /// Maximum number of path segments.
        max: usize,
    },
}
