//! The last solutions for the nodes of a chain, from which the next one is predicted.

use nalgebra::Unit;
use zsim_base::geometry::{Pose, Rotation};

/// Largest error of the predicted position and quaternion of the top, as a fraction of the change since the last solution.
const MAX_ERROR: f64 = 0.3;

/// The nodes of the last three solutions, newest first.
#[derive(Debug, Clone, Default)]
pub(super) struct Solutions {
    newest: Vec<Vec<Pose>>,
}

impl Solutions {
    /// Removes all solutions.
    pub(super) fn forget(&mut self) {
        self.newest.clear();
    }

    /// Adds a solution; its nodes include both ends.
    pub(super) fn add(&mut self, nodes: &[Pose]) {
        if self.newest.len() < 3 {
            self.newest.insert(0, nodes.to_vec());
        } else {
            self.newest.rotate_right(1);
            self.newest[0].copy_from_slice(nodes);
        }
    }

    /// Places the inner nodes close to the solution for the top, which is the last of `nodes`; false without a solution.
    ///
    /// In a simulation the solutions are at equal intervals of time, and a parabola through three of them leads to the next
    /// one. If it does not lead to the given top, the last solution is used.
    pub(super) fn predict(&self, nodes: &mut [Pose]) -> bool {
        let Some(last) = self.newest.first() else { return false };
        let top = nodes.len() - 1;
        let follows = self.extrapolated(top).is_some_and(|predicted| {
            let (error, change) = (differences(&predicted, &nodes[top]), differences(&last[top], &nodes[top]));
            error.0 <= MAX_ERROR * change.0 && error.1 <= MAX_ERROR * change.1
        });
        for k in 1..top {
            nodes[k] = if follows { self.extrapolated(k).unwrap_or(last[k]) } else { last[k] };
        }
        true
    }

    /// The node `k` one interval after the newest of three solutions; `None` with fewer.
    fn extrapolated(&self, k: usize) -> Option<Pose> {
        let [a, b, c] = self.newest.as_slice() else { return None };
        let (a, b, c) = (&a[k], &b[k], &c[k]);
        let position = (a.translation.vector - b.translation.vector) * 3.0 + c.translation.vector;
        let turned = (a.rotation.into_inner() - b.rotation.into_inner()) * 3.0 + c.rotation.into_inner();
        Some(Pose::from_parts(position.into(), Rotation::from(Unit::new_normalize(turned))))
    }
}

/// Distance of the positions, m, and of the quaternions.
fn differences(a: &Pose, b: &Pose) -> (f64, f64) {
    let of_rotations = (a.rotation.into_inner() - b.rotation.into_inner()).norm();
    ((a.translation.vector - b.translation.vector).norm(), of_rotations)
}
