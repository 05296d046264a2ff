//! Run time of the estimator on ten seconds of a closed-form walk through a furnished hall.

#![allow(clippy::unwrap_used, missing_docs, reason = "a bench fails by panicking")]

#[allow(dead_code, unused_imports, reason = "the bench uses a part of it")]
#[path = "../tests/estimation/fixture/mod.rs"]
mod fixture;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use fixture::{Room, Run, Walk, calibration};
use zsim::estimation::{estimate_all, load};

const SECONDS: f64 = 10.0;

fn estimation(c: &mut Criterion) {
    let walk = Walk { start_s: 1.5, ..Walk::new((1.8, 1.2), 25.0) };
    let measurements = Run::new(Room::furnished(), walk, 1, SECONDS).measurements();
    let mut group = c.benchmark_group("estimation");
    group.sample_size(10);
    for views in [0, 5] {
        let mut spec = load("default").unwrap();
        spec.fixed_views = views;
        group.bench_function(format!("ten seconds, {views} fixed views"), |b| {
            b.iter_batched(
                || measurements.clone(),
                |measurements| estimate_all(&spec, &calibration(), measurements.into_iter()).unwrap(),
                BatchSize::PerIteration,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, estimation);
criterion_main!(benches);
