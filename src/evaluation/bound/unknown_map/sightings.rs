//! The beams on planes that are unknown.

use super::super::epoch::BeamObservation;
use nalgebra::{Matrix3, Matrix5, SMatrix, Vector5};
use std::collections::BTreeMap;
use zsim_base::geometry::{Rotation, Vector};

/// A plane, about a point of it. Its errors are the offset along the normal, m, and the slopes along both axes, rad.
#[derive(Debug, Clone, Copy)]
struct PlaneFrame {
    centre_in_world: Vector,
    normal: Vector,
    axes: [Vector; 2],
}

/// The beams of one epoch on one plane.
#[derive(Debug, Clone)]
pub(super) struct Sighting {
    pub plane: u32,
    pub beams: u32,
    /// Fisher information of the three errors of the plane relative to the head, the current clock offset and the range
    /// offset: the lower triangle, row by row.
    triangle: [f64; 15],
}

/// Jacobian of the five quantities of a [`Sighting`] with respect to attitude and position of the IMU (6), clock offset
/// at the start, clock rate and range offset.
pub(super) type PoseJacobian = SMatrix<f64, 5, 9>;

impl Sighting {
    /// Fisher information of the five quantities.
    pub(super) fn information(&self) -> Matrix5<f64> {
        Matrix5::from_fn(|i, j| {
            let (row, column) = (i.max(j), i.min(j));
            self.triangle[row * (row + 1) / 2 + column]
        })
    }
}

/// The beams of all epochs, by plane.
#[derive(Debug, Clone, Default)]
pub(in super::super) struct Sightings {
    frames: BTreeMap<u32, PlaneFrame>,
    /// By epoch, in the order of the planes.
    by_epoch: Vec<Vec<Sighting>>,
}

impl Sightings {
    /// Adds a beam of an epoch that does not graze its plane.
    pub(in super::super) fn add(&mut self, epoch: usize, beam: &BeamObservation, by_clock: f64) {
        let frame = *self.frames.entry(beam.plane).or_insert_with(|| PlaneFrame::of(beam));
        if self.by_epoch.len() <= epoch {
            self.by_epoch.resize(epoch + 1, Vec::new());
        }
        let seen = &mut self.by_epoch[epoch];
        let at = seen.binary_search_by_key(&beam.plane, |sighting| sighting.plane).unwrap_or_else(|at| {
            seen.insert(at, Sighting { plane: beam.plane, beams: 0, triangle: [0.0; 15] });
            at
        });
        let row = frame.row(beam, by_clock);
        let products = (0..5).flat_map(|i| (0..=i).map(move |j| row[i] * row[j]));
        seen[at].triangle.iter_mut().zip(products).for_each(|(sum, product)| *sum += product);
        seen[at].beams += 1;
    }

    /// The planes that an epoch sees.
    pub(super) fn of(&self, epoch: usize) -> &[Sighting] {
        self.by_epoch.get(epoch).map_or(&[], Vec::as_slice)
    }

    /// Jacobian of a sighting for an IMU at `imu_in_world`, `since_start_s` after the start.
    pub(super) fn jacobian(&self, sighting: &Sighting, imu_in_world: &Vector, since_start_s: f64) -> PoseJacobian {
        let mut jacobian = PoseJacobian::zeros();
        let Some(frame) = self.frames.get(&sighting.plane) else { return jacobian };
        // A motion of the IMU changes the range as the opposite motion of the plane: offset n (dp + dtheta x (c - p)),
        // slopes n (dtheta x e) along its axes e.
        let lever = (frame.centre_in_world - imu_in_world).cross(&frame.normal);
        let by_attitude = [lever, frame.axes[0].cross(&frame.normal), frame.axes[1].cross(&frame.normal)];
        for (row, by_attitude) in by_attitude.iter().enumerate() {
            jacobian.fixed_view_mut::<1, 3>(row, 0).copy_from(&-by_attitude.transpose());
        }
        jacobian.fixed_view_mut::<1, 3>(0, 3).copy_from(&-frame.normal.transpose());
        (jacobian[(3, 6)], jacobian[(3, 7)], jacobian[(4, 8)]) = (1.0, since_start_s, 1.0);
        jacobian
    }
}

impl PlaneFrame {
    fn of(beam: &BeamObservation) -> Self {
        let normal = beam.normal_in_world;
        // Opposite normals have no unique rotation between them, but any axes in the plane will do.
        let rotation = Rotation::rotation_between(&Vector::z(), &normal)
            .unwrap_or_else(|| Rotation::from_axis_angle(&Vector::x_axis(), std::f64::consts::PI));
        let axes = [rotation * Vector::x(), rotation * Vector::y()];
        Self { centre_in_world: beam.hit_in_world, normal, axes }
    }

    /// Derivative of the range with respect to the five quantities, over the standard deviation.
    fn row(&self, beam: &BeamObservation, by_clock: f64) -> Vector5<f64> {
        let along = self.normal.dot(&beam.direction_in_world);
        let from_centre = beam.hit_in_world - self.centre_in_world;
        let [u, v] = self.axes.map(|axis| axis.dot(&from_centre));
        Vector5::new(1.0 / along, u / along, v / along, by_clock, 1.0) / beam.range_sigma_m
    }
}

/// The information of a plane itself.
pub(super) fn of_plane(information: &Matrix5<f64>) -> Matrix3<f64> {
    information.fixed_view::<3, 3>(0, 0).into_owned()
}
