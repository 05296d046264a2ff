//! Builds surfels from lidar returns: voxels at several resolutions on two grids, merged from fine to coarse.

use super::element::FINE;
use super::flatness::{self, SurfelThickness};
use super::moments::Moments;
use super::principal::{eigenvalues, eigenvector};
use super::{Surfel, TimedReturn};
use crate::nominal::{Motion, Nominal};
use crate::spec::SurfelSpec;
use crate::unknowns::Unknowns;
use crate::vectorised::vectorised;
use rayon::prelude::*;
use zsim_base::geometry::{Matrix, Vector};
use zsim_base::measurement::{LidarCorrection, LidarNoise};

/// Spacing of the poses that project returns, s; linear interpolation in between. At 400 degrees/s the error is 1.5 um per
/// metre of range.
const POSE_SPACING_S: f64 = 0.0005;
/// A surface counts as a wall, not ground or ceiling, if the vertical component of the unit normal is below this (within
/// 45 degrees of horizontal).
const MAX_WALL_NORMAL_Z: f64 = 0.7;

/// Builds surfels from lidar returns.
#[derive(Debug, Clone)]
pub(in super::super) struct SurfelBuilder {
    pub(in super::super) spec: SurfelSpec,
    pub(in super::super) noise: LidarNoise,
    /// Unit normal of the scan plane in the IMU frame; `None` for a lidar without a single scan plane.
    pub(in super::super) scan_normal: Option<Vector>,
    /// Calibrated position of the lidar in the IMU frame, m.
    pub(in super::super) laser_in_imu: Vector,
}

/// Resolutions of which surfels are built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum Detail {
    /// Those of the settings.
    Usual,
    /// Also [`FINE`], and of all resolutions also surfels of few points, for weak geometry: in a corridor only narrow faces
    /// (frames of doors, edges of lamps) show the motion along it.
    Fine,
}

/// A grid of cells: fragments of returns, merged by cells of `1 << doublings` of their edges, offset by `shift` edges.
struct Grid<'a> {
    fragments: &'a [Fragment],
    doublings: usize,
    shift: i32,
    /// Resolution of the surfels.
    level: usize,
}

/// Moments of consecutive returns in the same finest cell.
#[derive(Debug, Clone, Copy)]
struct Fragment {
    cell: [i32; 3],
    first_s: f64,
    last_s: f64,
    moments: Moments,
}

impl SurfelBuilder {
    /// Builds the surfels of one time segment, in order of resolution, grid, cell and time.
    pub(in super::super) fn build(
        &self,
        returns: &[TimedReturn],
        nominal: &Nominal,
        unknowns: &Unknowns,
        detail: Detail,
    ) -> Vec<Surfel> {
        let Some(first) = returns.first() else { return Vec::new() };
        let motion_at = |tau_s: f64| nominal.at(unknowns.clock.trajectory_s(tau_s), &unknowns.biases.gyro);
        let origin = motion_at(first.tau_s).position;
        let edge_m = self.spec.finest_voxel_m;
        let edges_m: &[f64] = if detail == Detail::Fine { &[edge_m, 0.5 * edge_m] } else { &[edge_m] };
        let points = self.project(returns, nominal, unknowns);
        let fragments: Vec<Vec<Fragment>> = (0..edges_m.len() * 2)
            .into_par_iter()
            .map(|k| {
                let (edge_m, shift) = (edges_m[k / 2], 0.5 * (k % 2) as f64);
                let grid = (edge_m, shift * edge_m);
                vectorised!(self.fragments(returns, &points, &origin, grid))
            })
            .collect();
        let min_points = if detail == Detail::Fine { self.spec.fine.min_points } else { self.spec.min_points };
        let surfels_of = |grid: &Grid| -> Vec<SurfelThickness> {
            let cells = merge_by_cell(grid, &self.spec, min_points);
            let fit = |cell| self.fit_surfel(cell, grid.level, &origin, &unknowns.lidar, motion_at);
            cells.iter().filter_map(fit).collect()
        };
        let shaped: Vec<Vec<SurfelThickness>> = self.grids(&fragments).par_iter().map(surfels_of).collect();
        flatness::add_roughness_variance(shaped.concat(), &self.spec)
    }

    /// The grids of all resolutions, each regular and offset by half a cell; `fragments` has the regular and the offset ones of the
    /// usual and, if there are any, the fine voxels.
    fn grids<'a>(&self, fragments: &'a [Vec<Fragment>]) -> Vec<Grid<'a>> {
        let usual = (0..self.spec.levels).map(|level| (0, level, level));
        let fine = (1..fragments.len() / 2).map(|edge| (edge, 0, FINE));
        let of_resolution = |(edge, doublings, level): (usize, usize, usize)| {
            let (regular, offset) = (&fragments[2 * edge], &fragments[2 * edge + 1]);
            // Half a coarse cell is an integer number of finest cells: the regular fragments serve both grids.
            let (shifted, shift) = if doublings == 0 { (offset, 0) } else { (regular, 1 << (doublings - 1)) };
            [(regular, 0), (shifted, shift)].map(|(fragments, shift)| Grid { fragments, doublings, shift, level })
        };
        usual.chain(fine).flat_map(of_resolution).collect()
    }

    /// The point of each return in the map, m.
    fn project(
        &self,
        returns: &[TimedReturn],
        nominal: &Nominal,
        Unknowns { biases, clock, lidar, .. }: &Unknowns,
    ) -> Vec<Vector> {
        let mut cursor = 0;
        let mut pose = |tau_s: f64| nominal.at_cursor(&mut cursor, clock.trajectory_s(tau_s), &biases.gyro);
        let mut points = vec![Vector::zeros(); returns.len()];
        let mut runs: Vec<(&[TimedReturn], [Motion; 2], &mut [Vector])> = Vec::new();
        let (mut rest, mut rest_of_points) = (returns, &mut points[..]);
        while let Some(first) = rest.first() {
            let end_s = first.tau_s + POSE_SPACING_S;
            let count = rest.iter().position(|beam| beam.tau_s >= end_s).unwrap_or(rest.len()).max(1);
            let (run, later) = rest.split_at(count);
            let (points_of_run, later_points) = rest_of_points.split_at_mut(count);
            runs.push((run, [pose(first.tau_s), pose(end_s)], points_of_run));
            (rest, rest_of_points) = (later, later_points);
        }
        let lidar_rotation = lidar.rotation.to_rotation_matrix();
        let laser_in_imu = self.laser_in_imu + lidar.translation;
        runs.par_chunks_mut(128).for_each(|runs| {
            vectorised!({
                for (run, [a, b], points) in runs.iter_mut() {
                    for (beam, point) in run.iter().zip(points.iter_mut()) {
                        let x = (beam.tau_s - run[0].tau_s) / POSE_SPACING_S;
                        let rotation: Matrix = a.rotation + (b.rotation - a.rotation) * x;
                        let position = a.position.lerp(&b.position, x);
                        let ray = beam.point_in_imu.cast::<f64>() - self.laser_in_imu;
                        let ray = lidar_rotation * (ray * (1.0 + lidar.range_m / f64::from(beam.range_m)));
                        *point = rotation * (laser_in_imu + ray) + position;
                    }
                }
            });
        });
        points
    }

    /// The fragments of the returns at `points` in a grid of cells of `edge_m`, offset by `shift_m`, in order of time.
    #[inline(always)]
    fn fragments(
        &self,
        returns: &[TimedReturn],
        points: &[Vector],
        origin: &Vector,
        (edge_m, shift_m): (f64, f64),
    ) -> Vec<Fragment> {
        let per_edge = 1.0 / edge_m;
        // Room for the most there can be: growing would copy them several times.
        let mut fragments: Vec<Fragment> = Vec::with_capacity(returns.len());
        for (beam, point) in returns.iter().zip(points) {
            let noise2 = self.noise.sigma_m(f64::from(beam.range_m)).powi(2);
            let cell = [point.x, point.y, point.z].map(|x| ((x + shift_m) * per_edge).floor() as i32);
            if fragments.last().is_none_or(|last| last.cell != cell) {
                let moments = Moments::default();
                fragments.push(Fragment { cell, first_s: beam.tau_s, last_s: beam.tau_s, moments });
            }
            if let Some(current) = fragments.last_mut() {
                current.moments.add(&(point - origin), beam, noise2);
                current.last_s = beam.tau_s;
            }
        }
        fragments
    }

    /// Fits a surfel to a cell's points; `None` if they are not planar, too thick, or badly observed.
    ///
    /// The scan plane must sweep across the surface fast enough, and the angle of incidence must be small enough.
    /// `motion_at` is the motion of the IMU at a lidar time, s.
    fn fit_surfel(
        &self,
        moments: &Moments,
        level: usize,
        origin: &Vector,
        lidar: &LidarCorrection,
        motion_at: impl Fn(f64) -> Motion,
    ) -> Option<SurfelThickness> {
        let covariance = moments.covariance();
        let [l1, l2, l3] = eigenvalues(&covariance).map(|variance| variance.max(0.0));
        let planarity = 2.0 * (l2 - l1) / (l1 + l2 + l3).max(f64::MIN_POSITIVE);
        let thick2 = self.spec.max_thickness_sigmas.powi(2) * moments.mean_noise2();
        if planarity < self.spec.min_planarity || l1 > thick2 {
            return None;
        }
        let normal_in_map = eigenvector(&covariance, l1)?;
        let tau_s = moments.mean_time_s();
        let motion = motion_at(tau_s);
        let imu_from_map = motion.rotation.transpose();
        let centre_in_imu = imu_from_map * (moments.mean() + origin - motion.position);
        let corrected = centre_in_imu - self.laser_in_imu - lidar.translation;
        let range_m = corrected.norm();
        let calibrated_from_map = lidar.rotation.inverse().to_rotation_matrix() * imu_from_map;
        let beam = lidar.rotation.inverse() * corrected / range_m;
        let rate = calibrated_from_map * motion.angular_velocity;
        let sweeps = self.scan_normal.is_none_or(|scan_normal| {
            rate.cross(&beam).dot(&scan_normal).abs() >= self.spec.min_sweep_deg_per_s.to_radians()
        });
        if !sweeps {
            return None;
        }
        let normal = calibrated_from_map * normal_in_map;
        if normal.dot(&beam).abs() < self.spec.max_incidence_deg.to_radians().cos() {
            return None;
        }
        let surfel = Surfel {
            tau_s,
            ray_in_imu: beam * (range_m - lidar.range_m),
            normal_in_imu: if normal.dot(&beam) > 0.0 { -normal } else { normal },
            covariance_in_imu: calibrated_from_map * covariance * calibrated_from_map.transpose(),
            points: moments.count(),
            weakness: moments.mean_weakness(),
            roughness_variance: 0.0,
            level,
        };
        Some(SurfelThickness {
            surfel,
            is_upright: normal_in_map.z.abs() < MAX_WALL_NORMAL_Z,
            variance: l1,
            noise_variance: flatness::noise_across(moments.mean_noise2(), normal.dot(&beam)),
        })
    }
}

/// Sortable key of the cell of a grid that contains a finest cell.
fn cell_key(cell: &[i32; 3], grid: &Grid) -> u64 {
    let part = |x: i32| ((x.wrapping_add(grid.shift) >> grid.doublings).wrapping_add(1 << 20)) as u64 & 0x1f_ffff;
    part(cell[0]) << 42 | part(cell[1]) << 21 | part(cell[2])
}

/// Merges the fragments of each cell, split at time gaps and at the maximum duration.
///
/// Returns only groups with at least `min_points` points.
fn merge_by_cell(grid: &Grid, spec: &SurfelSpec, min_points: usize) -> Vec<Moments> {
    let keyed = grid.fragments.iter().enumerate().map(|(k, f)| (cell_key(&f.cell, grid), k as u32));
    let mut keyed: Vec<(u64, u32)> = keyed.collect();
    keyed.sort_unstable();
    let mut groups: Vec<Moments> = Vec::with_capacity(keyed.len());
    let mut open: Option<(u64, f64, f64, Moments)> = None;
    for (cell, k) in keyed {
        let fragment = &grid.fragments[k as usize];
        let joins = |(at, first_s, last_s, _): &(u64, f64, f64, Moments)| {
            *at == cell
                && fragment.first_s - last_s <= spec.split_gap_s
                && fragment.last_s - first_s <= spec.max_duration_s
        };
        match open.as_mut().filter(|group| joins(group)) {
            Some((_, _, last_s, moments)) => {
                *last_s = fragment.last_s;
                moments.merge(&fragment.moments);
            }
            None => {
                groups.extend(open.take().map(|(.., moments)| moments));
                open = Some((cell, fragment.first_s, fragment.last_s, fragment.moments));
            }
        }
    }
    groups.extend(open.map(|(.., moments)| moments));
    groups.retain(|moments| moments.count() >= min_points as f64);
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::Clock;
    use crate::spec;
    use crate::strapdown::{Biases, Interval, State};
    use zsim_base::geometry::Rotation;

    /// Planar scans by a lidar that turns at `nodding`, rad/s; `range_m` is the range along a direction in the map.
    fn scans(nodding: Vector, scans: usize, range_m: impl Fn(&Vector) -> f64) -> (Nominal, Vec<TimedReturn>) {
        let none = Vector::zeros();
        let start = State { rotation: Rotation::identity(), position: none, velocity: none };
        let mut nominal = Nominal::starting(0.0, start);
        let interval = Interval {
            h: 0.01,
            gyro: nodding,
            gyro_slope: none,
            accel: none,
            accel_slope: none,
            uncompensated: 1.0,
            gyro_sigma: 1e-3,
            accel_sigma: 1e-2,
            bridged: false,
        };
        (0..25).for_each(|_| nominal.extend(interval, &Biases { gyro: none, accel: none }, &none));
        let beam = |k: usize| {
            let tau_s = (k / 181) as f64 * 0.025 + (k % 181) as f64 * 5e-5;
            let angle = ((k % 181) as f64 * 0.5).to_radians();
            let beam = Vector::new(angle.cos(), angle.sin(), 0.0);
            let range = range_m(&(Rotation::from_scaled_axis(nodding * tau_s) * beam));
            TimedReturn { tau_s, point_in_imu: (beam * range).cast(), range_m: range as f32, weakness: 0.0 }
        };
        (nominal, (0..scans * 181).map(beam).collect())
    }

    /// Scans of a vertical corner with walls 2.1 m away, by a lidar that nods towards it at `rate`, rad/s.
    fn scans_of_a_corner(rate: f64, count: usize) -> (Nominal, Vec<TimedReturn>) {
        scans(Vector::new(-1.0, 1.0, 0.0).normalize() * rate, count, |to| 2.1 / to.x.max(to.y))
    }

    /// Builder with the shipped settings and this maximum incidence, degrees.
    fn builder(max_incidence_deg: f64) -> SurfelBuilder {
        let shipped = spec::load("default").unwrap().surfels;
        SurfelBuilder {
            spec: SurfelSpec { max_incidence_deg, ..shipped },
            noise: LidarNoise { near_sigma_m: 0.01, near_m: 10.0, far_sigma_m: 0.03, far_m: 30.0 },
            scan_normal: Some(Vector::z()),
            laser_in_imu: Vector::zeros(),
        }
    }

    fn surfels(builder: &SurfelBuilder, nominal: &Nominal, returns: &[TimedReturn], detail: Detail) -> Vec<Surfel> {
        let clock = Clock { offset_s: 0.0, rate: 0.0, at_s: 0.0 };
        let still = Biases { gyro: Vector::zeros(), accel: Vector::zeros() };
        builder.build(returns, nominal, &Unknowns::initial(still, clock), detail)
    }

    /// Absolute vertical components of the surfels' normals.
    fn normal_heights(nominal: &Nominal, returns: &[TimedReturn], max_incidence_deg: f64) -> Vec<f64> {
        let surfels = surfels(&builder(max_incidence_deg), nominal, returns, Detail::Usual);
        surfels.iter().map(|surfel| surfel.normal_in_imu.z.abs()).collect()
    }

    #[test]
    fn a_narrow_face_has_surfels_in_fine_detail_only() {
        // The end of a wall 0.26 m thick, as the jamb of a door: its face at y = 1.05 m looks along the wall.
        let range_m = |to: &Vector| match [2.02 / to.x, 1.05 / to.y, 5.0 / to.x] {
            [front, ..] if front * to.y >= 1.05 => front,
            [_, face, _] if (2.02..2.28).contains(&(face * to.x)) => face,
            [.., behind] => behind,
        };
        let (nominal, returns) = scans(Vector::new(0.0, -0.6, 0.0), 8, range_m);
        let shipped = spec::load("default").unwrap().surfels.max_incidence_deg;
        let along = |detail| {
            let surfels = surfels(&builder(shipped), &nominal, &returns, detail);
            assert!(surfels.iter().any(|surfel| surfel.normal_in_imu.x.abs() > 0.9), "the wall itself must be seen");
            let along = surfels.into_iter().filter(|surfel| surfel.normal_in_imu.y.abs() > 0.9);
            along.map(|surfel| surfel.level).collect::<Vec<_>>()
        };
        assert!(along(Detail::Usual).is_empty());
        let fine = along(Detail::Fine);
        assert!(fine.contains(&FINE), "{fine:?}");
    }

    #[test]
    fn slice_of_a_corner_is_rejected_and_its_walls_are_accepted() {
        let shipped_deg = spec::load("default").unwrap().surfels.max_incidence_deg;
        let (nominal, slow) = scans_of_a_corner(0.3, 4);
        let slices = normal_heights(&nominal, &slow, 90.0);
        assert!(
            slices.iter().any(|z| *z > 0.9),
            "without the incidence gate a slice must be accepted, or this test is void"
        );
        assert_eq!(normal_heights(&nominal, &slow, shipped_deg), [0.0; 0]);
        let (nominal, fast) = scans_of_a_corner(0.8, 8);
        let walls = normal_heights(&nominal, &fast, shipped_deg);
        assert!(walls.len() > 10 && walls.iter().all(|z| *z < 0.3), "{walls:?}");
    }
}
