//! Speed of the head simulation: physics steps per second.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use zsim::dynamics::{HeadModel, HeadSimulation, LinkageSpec, load};
use zsim::geometry::{Kinematics, Pose};
use zsim::motion::BaseMotion;

struct Still;

impl BaseMotion for Still {
    fn at(&self, _t_s: f64) -> Kinematics {
        Kinematics::at_rest(Pose::identity())
    }
}

/// A base that oscillates along x at 1.2 Hz, so that the head swings.
struct Shaken;

impl BaseMotion for Shaken {
    fn at(&self, t_s: f64) -> Kinematics {
        let (amount, rate) = (0.02, 1.2 * std::f64::consts::TAU);
        let (sin, cos) = (rate * t_s).sin_cos();
        let mut now = Kinematics::at_rest(Pose::translation(amount * (1.0 - cos), 0.0, 0.0));
        now.velocity_in_world.x = amount * rate * sin;
        now.acceleration_in_world.x = amount * rate * rate * cos;
        now
    }
}

fn handheld(pieces: usize) -> HeadModel {
    let (mut spec, source) = load("handheld").expect("the head is built in");
    if let LinkageSpec::Spring { segments, .. } = &mut spec.linkage {
        *segments = pieces;
    }
    HeadModel::new(&spec, &source).expect("the head has a stable rest pose")
}

fn steps(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("head");
    let count = 10_000;
    group.throughput(Throughput::Elements(count)).sample_size(20);
    for (name, pieces, motion) in [
        ("still, 1 segment", 1, &Still as &dyn BaseMotion),
        ("swinging, 1 segment", 1, &Shaken),
        ("swinging, 4 segments", 4, &Shaken),
        ("swinging, 8 segments", 8, &Shaken),
    ] {
        let model = handheld(pieces);
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let simulation = HeadSimulation::new(&model, motion, 1e-3).expect("a step of 1 ms is valid");
                simulation.take(count as usize).map(|state| state.map_or(0.0, |s| black_box(s).t_s)).sum::<f64>()
            });
        });
    }
    group.finish();
    let (spec, source) = load("handheld").expect("the head is built in");
    criterion.bench_function("model of the handheld head", |bencher| {
        bencher.iter(|| HeadModel::new(black_box(&spec), &source).map(|model| model.body().mass_kg));
    });
}

criterion_group!(benches, steps);
criterion_main!(benches);
