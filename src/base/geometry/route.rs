use super::Vector;

/// A route through a world: a polyline on the floor that a carrier follows.
///
/// The carrier rounds the corners within the limits of its motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// Corners on the floor, in the world, m; at least two.
    pub points_in_world: Vec<Vector>,
    /// Whether the route is a closed loop: from the last point back to the first.
    pub closed: bool,
}
