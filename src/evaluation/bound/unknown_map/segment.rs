//! The information of a segment of the run on its kept epochs, the constants and the joint planes.

use super::super::motion::Step;
use super::chain::{CONSTANTS, OWN, POSITION, STEP, step_information};
use super::dense::Information;
use super::division::Segment;
use super::problem::Problem;
use super::sightings::{Sighting, of_plane};
use nalgebra::{Matrix3, Matrix3xX, SMatrix};
use std::collections::BTreeMap;
use zsim_base::geometry::Vector;

/// Variables of a segment: other epochs, then kept epochs, constants, joint planes.
struct Layout<'a> {
    /// Epochs that are kept, in order.
    kept: &'a [usize],
    /// Positions of the joint planes that the segment sees.
    planes: Vec<usize>,
}

impl Layout<'_> {
    fn first(&self) -> usize {
        self.kept[0]
    }

    fn last(&self) -> usize {
        self.kept[self.kept.len() - 1]
    }

    /// Number of variables that are not kept.
    fn interior(&self) -> usize {
        OWN * (self.last() + 1 - self.first() - self.kept.len())
    }

    fn state(&self, epoch: usize) -> usize {
        match self.kept.binary_search(&epoch) {
            Ok(at) => self.interior() + OWN * at,
            Err(before) => OWN * (epoch - self.first() - before),
        }
    }

    fn constants(&self) -> usize {
        self.interior() + OWN * self.kept.len()
    }

    fn plane(&self, rank: usize) -> Option<usize> {
        let at = self.planes.binary_search(&rank).ok()?;
        Some(self.constants() + CONSTANTS + 3 * at)
    }

    /// Number of variables that are kept.
    fn kept_size(&self) -> usize {
        OWN * self.kept.len() + CONSTANTS + 3 * self.planes.len()
    }

    /// Attitude and position at an epoch, clock offset, clock rate and range offset.
    fn measured(&self, epoch: usize) -> [usize; 9] {
        let (state, constants) = (self.state(epoch), self.constants());
        std::array::from_fn(|k| match k {
            0..3 => state + k,
            3..6 => state + POSITION + k - 3,
            _ => constants + k - 6,
        })
    }
}

/// Information of a segment on the variables that are kept.
pub(super) struct Kept {
    /// Positions of the joint planes that the segment sees.
    pub planes: Vec<usize>,
    /// Kept epochs, constants, planes.
    pub information: Information,
}

/// The information of a segment, with the other epochs and the planes that are not joint marginalised. `None` if it
/// is singular.
pub(super) fn keep(problem: &Problem<'_>, segment: &Segment) -> Option<Kept> {
    let sightings = || segment.measured.clone().flat_map(|epoch| problem.sightings.of(epoch));
    let mut planes: Vec<usize> = sightings().filter_map(|seen| problem.joint.rank(seen.plane)).collect();
    planes.sort_unstable();
    planes.dedup();
    let layout = Layout { kept: &segment.kept, planes };
    let mut information = Information::zeros(layout.interior(), layout.kept_size());
    for epoch in layout.first()..layout.last() {
        add_step(problem, &layout, epoch, &mut information)?;
    }
    let mut local = BTreeMap::new();
    for epoch in segment.measured.clone() {
        for sighting in problem.sightings.of(epoch) {
            add_sighting(problem, &layout, (epoch, sighting), &mut information, &mut local);
        }
    }
    for plane in local.into_values() {
        plane.marginalise(&mut information)?;
    }
    let information = information.marginalised()?;
    Some(Kept { planes: layout.planes, information })
}

/// Adds the IMU between an epoch and the next.
fn add_step(problem: &Problem<'_>, layout: &Layout<'_>, epoch: usize, information: &mut Information) -> Option<()> {
    let (from, to) = (&problem.epochs[epoch], &problem.epochs[epoch + 1]);
    let step = Step::between(&problem.model, from, to, &Vector::zeros(), problem.since_start_s(epoch));
    let at: [usize; STEP] = std::array::from_fn(|k| match k {
        0..OWN => layout.state(epoch) + k,
        _ if k < 2 * OWN => layout.state(epoch + 1) + k - OWN,
        _ => layout.constants() + k - 2 * OWN,
    });
    information.add(&at, &step_information(&step)?);
    Some(())
}

/// Adds the beams of an epoch on a plane.
fn add_sighting(
    problem: &Problem<'_>,
    layout: &Layout<'_>,
    (epoch, sighting): (usize, &Sighting),
    information: &mut Information,
    local: &mut BTreeMap<u32, LocalPlane>,
) {
    let imu = &problem.epochs[epoch].position_in_world;
    let jacobian = problem.sightings.jacobian(sighting, imu, problem.since_start_s(epoch));
    let (weight, at) = (sighting.information(), layout.measured(epoch));
    let Some(plane) = problem.joint.rank(sighting.plane).and_then(|rank| layout.plane(rank)) else {
        information.add(&at, &(jacobian.transpose() * weight * jacobian));
        let across = weight.fixed_rows::<3>(0) * jacobian;
        let prior = problem.prior.plane_information();
        let plane = local.entry(sighting.plane).or_insert_with(|| LocalPlane::new(prior));
        plane.add(&at, &of_plane(&weight), &across);
        return;
    };
    let mut all = SMatrix::<f64, 5, 12>::zeros();
    all.fixed_columns_mut::<9>(0).copy_from(&jacobian);
    (0..3).for_each(|k| all[(k, 9 + k)] = 1.0);
    let at: [usize; 12] = std::array::from_fn(|k| if k < 9 { at[k] } else { plane + k - 9 });
    information.add(&at, &(all.transpose() * weight * all));
}

/// A plane that is an unknown of this segment only.
struct LocalPlane {
    own: Matrix3<f64>,
    /// Information across the plane and each variable.
    across: BTreeMap<usize, nalgebra::Vector3<f64>>,
}

impl LocalPlane {
    fn new(prior: Matrix3<f64>) -> Self {
        Self { own: prior, across: BTreeMap::new() }
    }

    fn add(&mut self, at: &[usize; 9], own: &Matrix3<f64>, across: &SMatrix<f64, 3, 9>) {
        self.own += own;
        for (variable, column) in at.iter().zip(across.column_iter()) {
            *self.across.entry(*variable).or_default() += column;
        }
    }

    /// Subtracts the information that determines the plane. `None` if it is singular.
    fn marginalise(self, information: &mut Information) -> Option<()> {
        let factor = self.own.cholesky()?.l();
        let (at, columns): (Vec<usize>, Vec<_>) = self.across.into_iter().unzip();
        let mut white = Matrix3xX::from_columns(&columns);
        factor.solve_lower_triangular_mut(&mut white).then(|| information.subtract_square(&at, &white))
    }
}
