use super::Vector;

/// A way through a world: a polyline on its floor that a carrier follows, rounding the corners as it can.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// Corners on the floor, m, in the world; at least two.
    pub points_in_world: Vec<Vector>,
    /// Whether the way goes round, from the last point to the first and on.
    pub closed: bool,
}
