//! The springs of a head as six joints in series.

use zsim_base::geometry::{Matrix, STANDARD_GRAVITY_M_PER_S2, Vector, skew};
use zsim_dynamics::{Body, LinearModel};
use zsim_elasticity::{Matrix6, Vector6, blocks, split, stack};

/// An elastic joint; forces and stiffness in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ElasticJoint {
    pub name: &'static str,
    /// Whether it turns about its axis; otherwise it slides along it.
    pub turns: bool,
    /// Unit vector in the base.
    pub axis: Vector,
    /// A point on the axis in the base, m.
    pub point: Vector,
    pub stiffness: f64,
    pub damping: f64,
    /// Coordinate without force; 0 is the rest.
    pub reference: f64,
}

/// Linear model of a rigid body at rest: displacement of its centre of mass, and rotation, in the axes of the base.
pub(super) struct RestModel {
    pub body: Body,
    /// Centre of mass in the base, m.
    centre: Vector,
    /// Gravity included.
    stiffness: Matrix6,
    damping: Matrix6,
}

impl RestModel {
    /// The rigid body that is closest to a head and to the wire and fluid that move with it.
    ///
    /// `head`, whose centre is at `centre`, has the axes `rotation` in the base.
    pub fn new(head: &Body, linear: &LinearModel, centre: &Vector, rotation: &Matrix) -> Self {
        let part = |row, column| linear.mass.fixed_view::<3, 3>(row, column).into_owned();
        let mass_kg = part(0, 0).trace() / 3.0;
        // The momentum of a rotation w is -m c x w, with the centre c of the moving mass.
        let cross = (part(3, 0) - part(0, 3)) / (4.0 * mass_kg);
        let shift = Vector::new(cross.m32 - cross.m23, cross.m13 - cross.m31, cross.m21 - cross.m12);
        let inertia = part(3, 3) + skew(&shift) * skew(&shift) * mass_kg;
        let to_centre = blocks(&Matrix::identity(), &skew(&shift), &Matrix::zeros(), &Matrix::identity());
        let about_centre = |matrix: &Matrix6| to_centre.tr_mul(&(matrix * to_centre));
        Self {
            body: Body {
                mass_kg,
                centre_of_mass_in_head: head.centre_of_mass_in_head + rotation.tr_mul(&shift),
                inertia_in_head: rotation.tr_mul(&(inertia * rotation)),
            },
            centre: centre + shift,
            stiffness: about_centre(&linear.stiffness),
            damping: about_centre(&linear.damping),
        }
    }

    /// The joints from base to head: three that slide, then three that turn.
    ///
    /// The energy of a displacement d and a rotation phi is `(d - H phi) . A (d - H phi) / 2 + phi . D phi / 2`. The sliding joints
    /// lie along the eigenvectors of A. A joint that turns about `a` moves the centre by `H a`, less its part along `a`, for
    /// which a screw would be needed. Joints that turn also lift or lower the weight, by terms of second order in the angles; their axes
    /// are the eigenvectors of D without these terms.
    ///
    /// `None` if A is singular.
    pub fn joints(&self) -> Option<[ElasticJoint; 6]> {
        let part = |row, column| self.stiffness.fixed_view::<3, 3>(row, column).into_owned();
        let (shifts, slopes) = (part(0, 0), part(0, 3));
        let follow = -(shifts.try_inverse()? * slopes);
        let lifted = lift(&follow) * self.weight_n();
        let [x, y, z] = axes_of(&shifts);
        let [roll, pitch, yaw] = axes_of(&(part(3, 3) + slopes.tr_mul(&follow) - (lifted + lifted.transpose()) * 0.5));
        let slide = |name, axis: (Vector, f64)| self.joint(name, axis, None);
        let turn = |name, axis: (Vector, f64)| self.joint(name, axis, Some(follow * axis.0));
        Some([
            slide("spring_x", x),
            slide("spring_y", y),
            slide("spring_z", z),
            turn("spring_pitch", pitch),
            turn("spring_roll", roll),
            turn("spring_yaw", yaw),
        ])
    }

    /// A joint that slides, or that turns and moves the centre by `moved`.
    fn joint(&self, name: &'static str, (axis, stiffness): (Vector, f64), moved: Option<Vector>) -> ElasticJoint {
        let lever = moved.map_or(Vector::zeros(), |moved| moved.cross(&axis));
        let (turns, point) = (moved.is_some(), self.centre - lever);
        let joint = ElasticJoint { name, turns, axis, point, stiffness, damping: 0.0, reference: 0.0 };
        let twist = self.twist_of(&joint);
        let reference = self.weight_n() * twist.z / stiffness;
        ElasticJoint { damping: twist.dot(&(self.damping * twist)).max(0.0), reference, ..joint }
    }

    /// Displacement of the centre and rotation of the body by the unit of a joint.
    fn twist_of(&self, joint: &ElasticJoint) -> Vector6 {
        if joint.turns {
            stack(&joint.axis.cross(&(self.centre - joint.point)), &joint.axis)
        } else {
            stack(&joint.axis, &Vector::zeros())
        }
    }

    fn weight_n(&self) -> f64 {
        self.body.mass_kg * STANDARD_GRAVITY_M_PER_S2
    }

    /// Mass matrix and stiffness of the body on `joints` under gravity, in their coordinates.
    pub fn in_joints(&self, joints: &[ElasticJoint; 6], rotation: &Matrix) -> (Matrix6, Matrix6) {
        let twists = joints.map(|joint| self.twist_of(&joint));
        let all = Matrix6::from_columns(&twists);
        let mass = all.tr_mul(&(self.body.mass_matrix(rotation) * all));
        let stiffness = Matrix6::from_fn(|row, column| {
            let (parent, child) = (row.min(column), row.max(column));
            // The parent turns the displacement by the child.
            let raised = split(&twists[parent]).1.cross(&split(&twists[child]).0).z;
            let elastic = if row == column { joints[row].stiffness } else { 0.0 };
            elastic + self.weight_n() * raised
        });
        (mass, stiffness)
    }
}

/// The matrix N of the height `a . N b` that a rotation a gains after a rotation b, which moves the centre by `follow b`.
fn lift(follow: &Matrix) -> Matrix {
    -skew(&Vector::z()) * follow
}

/// Eigenvectors and eigenvalues of a symmetric matrix, in the order of the axes to which they are closest.
fn axes_of(matrix: &Matrix) -> [(Vector, f64); 3] {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let eigen = ((matrix + matrix.transpose()) * 0.5).symmetric_eigen();
    let closeness = |order: &[usize; 3]| (0..3).map(|axis| eigen.eigenvectors[(axis, order[axis])].abs()).sum::<f64>();
    let order = ORDERS.into_iter().max_by(|a, b| closeness(a).total_cmp(&closeness(b))).unwrap_or(ORDERS[0]);
    std::array::from_fn(|axis| {
        let vector = eigen.eigenvectors.column(order[axis]).into_owned();
        (vector * vector[axis].signum(), eigen.eigenvalues[order[axis]])
    })
}
