//! Metrics of the registered cloud against the true surfaces.

use super::beams::ProjectedBeam;
use super::manifest::{Manifest, RecordedSensors};
use super::register::{RegisteredCloud, SampledBeam};
use super::truth_cursor::TrueState;
use rayon::prelude::*;
use zsim_base::geometry::{Pose, Surface, Vector};
use zsim_estimation::ReturnClass;
use zsim_evaluation::{CloudErrors, CloudSummary};
use zsim_report::{CloudMetrics, FilterMetrics};
use zsim_sensors::Cylinder;
use zsim_simulation::SimulationSummary;
use zsim_world::World;

/// Maximum distance from a point to the nearest surface, m.
const MAX_DISTANCE_M: f64 = 1.0;

/// The returns that the distance metrics include.
const EVALUATED_RETURNS: &str = "all returns from static surfaces, before filtering";

/// The surroundings of a lidar: scene and carrier.
#[derive(Clone, Copy)]
pub(super) struct Surroundings<'a> {
    /// The scene with static surfaces and moving objects.
    pub world: &'a World,
    /// Parts of the carrier that the lidar can see, fixed to the base.
    pub carrier: &'a [Cylinder],
}

/// Origin of a recording; only the evaluation uses it, not the estimator.
pub(super) struct Origin<'a> {
    /// Manifest of the recording, with the settings of the estimator.
    pub manifest: &'a Manifest,
    /// The sensors of the simulation, as far as they are known.
    pub sensors: RecordedSensors,
    /// Scene and carrier, if they are known.
    pub surroundings: Option<Surroundings<'a>>,
    /// Summary of the simulation, if it ran in this process.
    pub simulation: Option<&'a SimulationSummary>,
}

/// The kind of object that a beam hit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Target {
    /// A static surface: the map of it has a true position.
    Static,
    /// The carrier of the lidar.
    Carrier,
    /// A moving object of the scene.
    Mover,
}

impl Surroundings<'_> {
    /// Whether a beam hit a static surface; `end_in_world` is the end of the beam, projected by the true pose.
    pub(super) fn hits_static_surface(&self, end_in_world: &Vector, instant: &TrueState) -> bool {
        self.target(end_in_world, instant) == Target::Static
    }

    /// The object nearest to `end_in_world`, the end of a beam projected by the true pose.
    ///
    /// Range noise moves the end by centimetres. A beam is therefore assigned to another object only if both objects
    /// are within centimetres of the end, which has no effect on the metrics of the map.
    fn target(&self, end_in_world: &Vector, instant: &TrueState) -> Target {
        let on_carrier_m = instant.world_from_base.and_then(|world_from_base| {
            let in_base = world_from_base.inverse_transform_point(&(*end_in_world).into()).coords;
            self.carrier.iter().map(|part| part.distance_m(&in_base)).min_by(f64::total_cmp)
        });
        let on_movers_m = self.world.distance_to_movers_m(end_in_world, MAX_DISTANCE_M, instant.t_s);
        let carrier = (on_carrier_m.unwrap_or(f64::INFINITY), Target::Carrier);
        let mover = (on_movers_m.unwrap_or(f64::INFINITY), Target::Mover);
        let (distance_m, moving) = if carrier.0 <= mover.0 { carrier } else { mover };
        let is_static = distance_m > MAX_DISTANCE_M || self.world.nearest(end_in_world, distance_m).is_some();
        if is_static { Target::Static } else { moving }
    }
}

/// Computes the metrics of the cloud.
///
/// The distances to the true surfaces include all sampled beams on static surfaces, before filtering. They need the
/// scene and the alignment. The other beams of the sample, on the carrier and on moving objects, are counted.
pub(super) fn cloud_metrics(
    registered: &RegisteredCloud,
    world_from_map: Option<&Pose>,
    surroundings: Option<Surroundings>,
) -> CloudMetrics {
    let filter = filter_metrics(registered);
    let points = Some(registered.class_counts.iter().sum());
    let counted = CloudMetrics { points, filter, ..CloudMetrics::default() };
    let (Some(world_from_map), Some(surroundings)) = (world_from_map, surroundings) else {
        return counted;
    };
    let target =
        |beam: &SampledBeam| beam.by_truth.map_or(Target::Static, |(by, at)| surroundings.target(&by.point, &at));
    let targets: Vec<Target> = registered.sample.par_iter().map(target).collect();
    let share = |of: Target| {
        let count = targets.iter().filter(|target| **target == of).count();
        (!targets.is_empty()).then(|| count as f64 / targets.len() as f64)
    };
    let static_beams = || registered.sample.iter().zip(&targets).filter(|(_, target)| **target == Target::Static);
    let errors = |in_world: Vec<_>| CloudErrors::to_surface(surroundings.world, &in_world, MAX_DISTANCE_M).summary();
    let estimated = errors(static_beams().map(|(beam, _)| in_world(&beam.in_map, world_from_map)).collect());
    let by_truth = static_beams().filter_map(|(beam, _)| beam.by_truth.map(|(by, _)| in_world(&by, &Pose::identity())));
    let by_truth = errors(by_truth.collect());
    let filter = match registered.filtered {
        true => evaluated_filter(registered, &targets, |kept| {
            errors(kept.map(|k| in_world(&k.in_map, world_from_map)).collect())
        }),
        false => FilterMetrics::default(),
    };
    CloudMetrics {
        judged: estimated.map(|_| EVALUATED_RETURNS.to_owned()),
        bias_m: estimated.map(|cloud| cloud.bias_m),
        sigma_m: estimated.map(|cloud| cloud.sigma_m),
        p95_m: estimated.map(|cloud| cloud.p95_m),
        far_fraction: estimated.map(|cloud| cloud.beyond_reach),
        on_carrier_fraction: share(Target::Carrier),
        on_movers_fraction: share(Target::Mover),
        sigma_by_truth_m: by_truth.map(|cloud| cloud.sigma_m),
        filter,
        ..counted
    }
}

/// Metrics of the filter for returns from static surfaces and from moving objects, and of the points that remain.
fn evaluated_filter<'a>(
    registered: &'a RegisteredCloud,
    targets: &'a [Target],
    errors: impl Fn(&mut dyn Iterator<Item = &'a SampledBeam>) -> Option<CloudSummary>,
) -> FilterMetrics {
    let of = |target: Target| {
        let all = registered.sample.iter().zip(targets);
        all.filter(move |(_, on)| **on == target).map(|(beam, _)| beam)
    };
    let kept = |beam: &&SampledBeam| beam.class == ReturnClass::Static;
    let dropped = |target: Target| {
        let (all, remaining) = (of(target).count(), of(target).filter(kept).count());
        (all > 0).then(|| (all - remaining) as f64 / all as f64)
    };
    FilterMetrics {
        kept_static_sigma_m: errors(&mut of(Target::Static).filter(kept)).map(|cloud| cloud.sigma_m),
        kept_all_sigma_m: errors(&mut registered.sample.iter().filter(kept)).map(|cloud| cloud.sigma_m),
        standing_dropped_fraction: dropped(Target::Static),
        movers_dropped_fraction: dropped(Target::Mover),
        ..filter_metrics(registered)
    }
}

/// Counts of the filter, if it was on: returns in the cloud, and removed returns by reason.
fn filter_metrics(registered: &RegisteredCloud) -> FilterMetrics {
    let counts = registered.class_counts.map(|count| registered.filtered.then_some(count));
    let [kept, dropped_mixed, dropped_isolated, dropped_moving] = counts;
    FilterMetrics { kept, dropped_mixed, dropped_isolated, dropped_moving, ..FilterMetrics::default() }
}

/// End and origin of a beam in the world.
pub(super) fn in_world(beam: &ProjectedBeam, world_from: &Pose) -> (Vector, Option<Vector>) {
    let moved = |at: &Vector| world_from.rotation * at + world_from.translation.vector;
    (moved(&beam.point), Some(moved(&beam.origin)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::spec::{Source, parse};

    /// A floor of 20 m, and a box of 0.4 m by 0.4 m by 2 m that moves along y = 3 with x = t.
    fn world() -> World {
        let text = r#"(
            name: "floor and box",
            materials: { "grey": (reflectance: 0.5) },
            templates: { "box": [Solid(shape: Box(size_m: (0.4, 0.4, 2)), material: "grey")] },
            items: [Solid(shape: Box(size_m: (20, 20, 0.1)), material: "grey", at_m_deg: [(0, 0, -0.1)])],
            movers: [(template: "box", repeats: false, waypoints: [(time_s: 0, at_m_deg: (0, 3)), (time_s: 8, at_m_deg: (8, 3))])],
        )"#;
        let source = Source::in_memory("floor.ron", text);
        World::build(&parse(&source).unwrap(), &source).unwrap()
    }

    /// An operator around (-0.5, 0) of the base, from 1.2 m below it to 0.5 m above.
    const OPERATOR: Cylinder =
        Cylinder { foot_in_base: Vector::new(-0.5, 0.0, -1.2), radius_m: 0.2, height_m: 1.7, reflectance: 0.3 };

    /// The base 1.2 m above the floor, walking along x at 1 m/s.
    fn at(t_s: f64) -> TrueState {
        let pose = Pose::translation(t_s, 0.0, 1.2);
        TrueState { world_from_head: pose, world_from_base: Some(pose), t_s }
    }

    #[test]
    fn the_target_is_the_object_nearest_to_the_end_of_the_beam_at_that_time() {
        let world = world();
        let surroundings = Surroundings { world: &world, carrier: &[OPERATOR] };
        let target = |x: f64, y: f64, z: f64, t_s: f64| surroundings.target(&Vector::new(x, y, z), &at(t_s));
        // At 4 s the side of the operator is at x = 3.7 and the side of the box at y = 2.8.
        assert_eq!(target(3.72, 0.0, 1.0, 4.0), Target::Carrier);
        assert_eq!(target(3.72, 0.0, 1.0, 8.0), Target::Static, "the operator has moved on");
        assert_eq!(target(4.0, 2.79, 1.0, 4.0), Target::Mover);
        assert_eq!(target(4.0, 2.79, 1.0, 2.0), Target::Static, "the box has not arrived");
        // On the floor below operator or box: the nearest object counts.
        assert_eq!(target(3.72, 0.0, 0.01, 4.0), Target::Static);
        assert_eq!(target(3.71, 0.0, 0.02, 4.0), Target::Carrier);
        assert_eq!(target(4.0, 2.79, 0.005, 4.0), Target::Static);
        let without_base = TrueState { world_from_base: None, ..at(4.0) };
        assert_eq!(surroundings.target(&Vector::new(3.72, 0.0, 1.0), &without_base), Target::Static);
    }

    #[test]
    fn beams_on_carrier_and_moving_objects_are_counted_but_not_in_the_distances() {
        let world = world();
        let surroundings = Surroundings { world: &world, carrier: &[OPERATOR] };
        // At 4 s: 16 beams that end alternately 3 cm above and below the floor; 3 on the operator, 1 on the box. The
        // map is 1 cm too high.
        let mut ends: Vec<_> = (0..16).map(|k| Vector::new(6.0, k as f64 * 0.1, [0.03, -0.03][k % 2])).collect();
        ends.extend([0.5, 0.7, 0.9].map(|z| Vector::new(3.7, 0.0, z)));
        ends.push(Vector::new(4.0, 2.8, 1.0));
        let beam = |point: Vector| ProjectedBeam { point, origin: Vector::new(4.0, 0.0, 1.4) };
        let judged = |end: &Vector| SampledBeam {
            in_map: beam(end + Vector::z() * 0.01),
            by_truth: Some((beam(*end), at(4.0))),
            class: if end.x == 6.0 { ReturnClass::Static } else { ReturnClass::Dynamic },
        };
        let registered = RegisteredCloud {
            class_counts: [16, 0, 0, 4],
            page_points: Vec::new(),
            filtered: true,
            sample: ends.iter().map(judged).collect(),
        };
        let metrics = cloud_metrics(&registered, Some(&Pose::identity()), Some(surroundings));
        assert_eq!((metrics.on_carrier_fraction, metrics.on_movers_fraction), (Some(0.15), Some(0.05)));
        assert_eq!((metrics.points, metrics.far_fraction), (Some(20), Some(0.0)));
        assert_relative_eq!(metrics.bias_m.unwrap(), 0.01, epsilon = 1e-6);
        assert_relative_eq!(metrics.sigma_m.unwrap(), 0.03, epsilon = 1e-6);
        assert_relative_eq!(metrics.sigma_by_truth_m.unwrap(), 0.03, epsilon = 1e-6);
        // Without a carrier all beams count as static; the beams on the operator then dominate the standard deviation.
        let empty = Surroundings { carrier: &[], ..surroundings };
        let all_evaluated = cloud_metrics(&registered, Some(&Pose::identity()), Some(empty));
        assert!(all_evaluated.sigma_m.unwrap() > 0.2, "{all_evaluated:?}");
        // Filtered returns are counted, and are in the distance metrics.
        assert_eq!((metrics.filter.kept, metrics.filter.dropped_moving), (Some(16), Some(4)));
        assert_eq!(metrics.filter.standing_dropped_fraction, Some(0.0));
        assert_eq!(metrics.filter.movers_dropped_fraction, Some(1.0));
        assert_relative_eq!(metrics.filter.kept_static_sigma_m.unwrap(), 0.03, epsilon = 1e-6);
        assert_relative_eq!(metrics.filter.kept_all_sigma_m.unwrap(), 0.03, epsilon = 1e-6);
        // A beam on the operator that remains, 0.5 m above the floor, is an error of the cloud: 16 points with a mean of
        // 0.01 m and a standard deviation of 0.03 m, and one at 0.51 m.
        let mut registered = registered;
        registered.sample[16].class = ReturnClass::Static;
        let metrics = cloud_metrics(&registered, Some(&Pose::identity()), Some(surroundings));
        let mean = (16.0 * 0.01 + 0.51) / 17.0;
        let square = (16.0 * (0.01_f64.powi(2) + 0.03_f64.powi(2)) + 0.51_f64.powi(2)) / 17.0;
        assert_relative_eq!(metrics.filter.kept_static_sigma_m.unwrap(), 0.03, epsilon = 1e-6);
        assert_relative_eq!(metrics.filter.kept_all_sigma_m.unwrap(), (square - mean * mean).sqrt(), epsilon = 1e-6);
        let unfiltered = cloud_metrics(&RegisteredCloud { filtered: false, ..registered }, None, None);
        assert_eq!((unfiltered.points, unfiltered.filter), (Some(20), FilterMetrics::default()));
    }
}
