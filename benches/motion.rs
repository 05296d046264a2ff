//! Time to evaluate a base motion at one time. The simulator evaluates it at 1 kHz of simulated time.

#![allow(clippy::unwrap_used, missing_docs, reason = "a bench fails by panicking; its items are criterion's")]

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use zsim::geometry::{Route, Vector};
use zsim::motion::load;
use zsim::random::Seed;
use zsim::spec::{Kind, names};

fn at(criterion: &mut Criterion) {
    let points = [[1.0, 1.0, 0.0], [9.0, 1.0, 0.0], [9.0, 6.0, 0.0], [1.0, 6.0, 0.0]];
    let route = Route { points_in_world: points.map(Vector::from).to_vec(), closed: true };
    for name in names(Kind::Motion) {
        let (spec, source) = load(&name).unwrap();
        let motion = spec.build(&source, Some(&route), 600.0, Seed(1)).unwrap();
        let mut step = 0_u32;
        criterion.bench_function(&format!("motion/{name}"), |bench| {
            bench.iter(|| {
                step = (step + 1) % 600_000;
                motion.at(black_box(1e-3 * f64::from(step)))
            });
        });
    }
}

criterion_group!(benches, at);
criterion_main!(benches);
