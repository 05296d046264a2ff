//! The registered cloud against what the beams truly met.

use super::register::{Beam, Fates, Judged, Registered};
use super::truth_near::TrueInstant;
use crate::estimation::Fate;
use crate::evaluation::{CloudErrors, CloudSummary};
use crate::geometry::{Pose, Surface, Vector};
use crate::report::{CloudMetrics, FilterMetrics};
use crate::sensors::Cylinder;
use crate::world::World;
use rayon::prelude::*;

/// How far from a point a surface is looked for, m.
const REACH_M: f64 = 1.0;

/// What the figures of distance are of.
const JUDGED: &str = "every echo of what stands, filtered or not";

/// What stands around a lidar, what moves there, and what carries it.
#[derive(Clone, Copy)]
pub(super) struct Surroundings<'a> {
    /// What stands, and what moves.
    pub world: &'a World,
    /// What of its carrier the lidar may see, fixed to the base.
    pub carrier: &'a [Cylinder],
}

/// What a beam ended on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Target {
    /// What stands: a map of it can be right or wrong.
    Still,
    /// What carries the lidar.
    Carrier,
    /// What moves through the scene.
    Mover,
}

impl Surroundings<'_> {
    /// Whether a beam ended on what stands, whose end, projected by the true pose, is at `end_in_world`.
    pub(super) fn ends_on_what_stands(&self, end_in_world: &Vector, instant: &TrueInstant) -> bool {
        self.target(end_in_world, instant) == Target::Still
    }

    /// What a beam ended on whose end, projected by the true pose, is at `end_in_world`: whatever is nearest to that.
    ///
    /// Noise takes the end off what the beam met by centimetres, so one is taken for another only where both are within
    /// centimetres of it, and the map is none the worse for it.
    fn target(&self, end_in_world: &Vector, instant: &TrueInstant) -> Target {
        let on_carrier_m = instant.world_from_base.and_then(|world_from_base| {
            let in_base = world_from_base.inverse_transform_point(&(*end_in_world).into()).coords;
            self.carrier.iter().map(|part| part.distance_m(&in_base)).min_by(f64::total_cmp)
        });
        let on_movers_m = self.world.distance_to_movers_m(end_in_world, REACH_M, instant.t_s);
        let carrier = (on_carrier_m.unwrap_or(f64::INFINITY), Target::Carrier);
        let mover = (on_movers_m.unwrap_or(f64::INFINITY), Target::Mover);
        let (distance_m, moving) = if carrier.0 <= mover.0 { carrier } else { mover };
        let is_still = distance_m > REACH_M || self.world.nearest(end_in_world, distance_m).is_some();
        if is_still { Target::Still } else { moving }
    }
}

/// The cloud's figures: of its sample the beams that ended on what stands, whatever the filter made of them, against
/// the true surfaces, where both they and the alignment are known; and how many beams ended on something else.
pub(super) fn cloud_metrics(
    registered: &Registered,
    world_from_map: Option<&Pose>,
    surroundings: Option<Surroundings>,
) -> CloudMetrics {
    let filter = match registered.filtered {
        true => filter_metrics(&registered.fates),
        false => FilterMetrics::default(),
    };
    let counted = CloudMetrics { points: Some(registered.fates.all()), filter, ..CloudMetrics::default() };
    let (Some(world_from_map), Some(surroundings)) = (world_from_map, surroundings) else {
        return counted;
    };
    let target = |beam: &Judged| beam.by_truth.map_or(Target::Still, |(by, at)| surroundings.target(&by.point, &at));
    let targets: Vec<Target> = registered.sample.par_iter().map(target).collect();
    let share = |of: Target| {
        let count = targets.iter().filter(|target| **target == of).count();
        (!targets.is_empty()).then(|| count as f64 / targets.len() as f64)
    };
    let still = || registered.sample.iter().zip(&targets).filter(|(_, target)| **target == Target::Still);
    let errors = |seen: Vec<_>| CloudErrors::to_surface(surroundings.world, &seen, REACH_M).summary();
    let estimated = errors(still().map(|(beam, _)| seen(&beam.in_map, world_from_map)).collect());
    let by_truth = still().filter_map(|(beam, _)| beam.by_truth.map(|(by, _)| seen(&by, &Pose::identity())));
    let by_truth = errors(by_truth.collect());
    let filter = match registered.filtered {
        true => {
            judged_filter(registered, &targets, |kept| errors(kept.map(|k| seen(&k.in_map, world_from_map)).collect()))
        }
        false => FilterMetrics::default(),
    };
    CloudMetrics {
        judged: estimated.map(|_| JUDGED.to_owned()),
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

/// What the filter did to echoes of what stands, and of what moves.
fn judged_filter<'a>(
    registered: &'a Registered,
    targets: &'a [Target],
    errors: impl Fn(&mut dyn Iterator<Item = &'a Judged>) -> Option<CloudSummary>,
) -> FilterMetrics {
    let of = |target: Target| {
        let all = registered.sample.iter().zip(targets);
        all.filter(move |(_, on)| **on == target).map(|(beam, _)| beam)
    };
    let kept = |beam: &&Judged| beam.fate == Fate::Kept;
    let dropped = |target: Target| {
        let (all, left) = (of(target).count(), of(target).filter(kept).count());
        (all > 0).then(|| (all - left) as f64 / all as f64)
    };
    FilterMetrics {
        kept_sigma_m: errors(&mut of(Target::Still).filter(kept)).map(|cloud| cloud.sigma_m),
        standing_dropped_fraction: dropped(Target::Still),
        movers_dropped_fraction: dropped(Target::Mover),
        ..filter_metrics(&registered.fates)
    }
}

/// How many echoes the filter kept, and how many it dropped and why.
fn filter_metrics(fates: &Fates) -> FilterMetrics {
    FilterMetrics {
        kept: Some(fates.kept),
        dropped_mixed: Some(fates.mixed),
        dropped_isolated: Some(fates.isolated),
        dropped_moving: Some(fates.moving),
        ..FilterMetrics::default()
    }
}

/// A beam's end in the world, and where it was seen from.
fn seen(beam: &Beam, world_from: &Pose) -> (Vector, Option<Vector>) {
    let moved = |at: &Vector| world_from.rotation * at + world_from.translation.vector;
    (moved(&beam.point), Some(moved(&beam.origin)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::EvaluationError;
    use crate::spec::{Source, parse};
    use approx::assert_relative_eq;

    /// A floor of 20 m, and a box of 0.4 m and 2 m high that goes over it along y = 3, at x = t.
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
    fn at(t_s: f64) -> TrueInstant {
        let pose = Pose::translation(t_s, 0.0, 1.2);
        TrueInstant { world_from_head: pose, world_from_base: Some(pose), t_s }
    }

    #[test]
    fn a_beam_ended_on_what_is_nearest_to_its_end_at_its_time() {
        let world = world();
        let surroundings = Surroundings { world: &world, carrier: &[OPERATOR] };
        let target = |x: f64, y: f64, z: f64, t_s: f64| surroundings.target(&Vector::new(x, y, z), &at(t_s));
        // The side of the operator at 4 s is at x = 3.7, that of the box at y = 2.8.
        assert_eq!(target(3.72, 0.0, 1.0, 4.0), Target::Carrier);
        assert_eq!(target(3.72, 0.0, 1.0, 8.0), Target::Still, "the operator has gone on");
        assert_eq!(target(4.0, 2.79, 1.0, 4.0), Target::Mover);
        assert_eq!(target(4.0, 2.79, 1.0, 2.0), Target::Still, "the box is not there yet");
        // On the floor under either: the nearest counts.
        assert_eq!(target(3.72, 0.0, 0.01, 4.0), Target::Still);
        assert_eq!(target(3.71, 0.0, 0.02, 4.0), Target::Carrier);
        assert_eq!(target(4.0, 2.79, 0.005, 4.0), Target::Still);
        let untold = TrueInstant { world_from_base: None, ..at(4.0) };
        assert_eq!(surroundings.target(&Vector::new(3.72, 0.0, 1.0), &untold), Target::Still);
    }

    #[test]
    fn what_did_not_stand_is_counted_and_not_judged() {
        let world = world();
        let surroundings = Surroundings { world: &world, carrier: &[OPERATOR] };
        // At 4 s: 16 beams to 3 cm above the floor, then under it, by turns; 3 to the operator, 1 to the box. The map
        // is 1 cm too high.
        let mut ends: Vec<_> = (0..16).map(|k| Vector::new(6.0, k as f64 * 0.1, [0.03, -0.03][k % 2])).collect();
        ends.extend([0.5, 0.7, 0.9].map(|z| Vector::new(3.7, 0.0, z)));
        ends.push(Vector::new(4.0, 2.8, 1.0));
        let beam = |point: Vector| Beam { point, origin: Vector::new(4.0, 0.0, 1.4) };
        let judged = |end: &Vector| Judged {
            in_map: beam(end + Vector::z() * 0.01),
            by_truth: Some((beam(*end), at(4.0))),
            fate: if end.x == 6.0 { Fate::Kept } else { Fate::Moving },
        };
        let registered = Registered {
            fates: Fates { kept: 16, moving: 4, ..Fates::default() },
            filtered: true,
            sample: ends.iter().map(judged).collect(),
            dead_reckoning: Err(EvaluationError::OnALine),
        };
        let metrics = cloud_metrics(&registered, Some(&Pose::identity()), Some(surroundings));
        assert_eq!((metrics.on_carrier_fraction, metrics.on_movers_fraction), (Some(0.15), Some(0.05)));
        assert_eq!((metrics.points, metrics.far_fraction), (Some(20), Some(0.0)));
        assert_relative_eq!(metrics.bias_m.unwrap(), 0.01, epsilon = 1e-6);
        assert_relative_eq!(metrics.sigma_m.unwrap(), 0.03, epsilon = 1e-6);
        assert_relative_eq!(metrics.sigma_by_truth_m.unwrap(), 0.03, epsilon = 1e-6);
        // Were they judged, as beams that are said to have met nothing but what stands are, they would outdo all else.
        let empty = Surroundings { carrier: &[], ..surroundings };
        let judged_all = cloud_metrics(&registered, Some(&Pose::identity()), Some(empty));
        assert!(judged_all.sigma_m.unwrap() > 0.2, "{judged_all:?}");
        // What the filter dropped is counted, and judged all the same.
        assert_eq!((metrics.filter.kept, metrics.filter.dropped_moving), (Some(16), Some(4)));
        assert_eq!(metrics.filter.standing_dropped_fraction, Some(0.0));
        assert_eq!(metrics.filter.movers_dropped_fraction, Some(1.0));
        assert_relative_eq!(judged_all.filter.kept_sigma_m.unwrap(), 0.03, epsilon = 1e-6);
        let unfiltered = cloud_metrics(&Registered { filtered: false, ..registered }, None, None);
        assert_eq!((unfiltered.points, unfiltered.filter), (Some(20), FilterMetrics::default()));
    }
}
