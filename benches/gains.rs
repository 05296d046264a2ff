//! Speed of the closed form for spring designs, and of simulated gain curves.

#![allow(clippy::unwrap_used, missing_docs, reason = "a benchmark fails by panicking")]

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use zsim::dynamics::{HeadModel, LinkageSpec, load};
use zsim::elasticity::SpringSpec;
use zsim::head::gains::{GainPlan, GainWatch, gain_curves};
use zsim::head::spring::{MISSION_HOURS, Shake, closed_form};
use zsim::spec::{Kind, find, parse};
use zsim::study::design::{DesignSearch, DesignSpec};

fn design_points(c: &mut Criterion) {
    let (spec, source) = load("handheld").unwrap();
    let shake = Shake::default();
    c.bench_function("closed form of a stable design", |b| {
        b.iter(|| closed_form(black_box(&spec), &source, &shake, MISSION_HOURS).unwrap());
    });
    let mut unstable = spec.clone();
    if let LinkageSpec::Spring { spring: SpringSpec::Coil { wire_diameter_mm, .. }, .. } = &mut unstable.linkage {
        *wire_diameter_mm = 2.0;
    }
    c.bench_function("closed form of an unstable design", |b| {
        b.iter(|| closed_form(black_box(&unstable), &source, &shake, MISSION_HOURS).unwrap_err());
    });
}

fn studies(c: &mut Criterion) {
    let mut group = c.benchmark_group("studies");
    group.sample_size(10);
    let source = find(Kind::Study, "spring_design").unwrap();
    let spec: DesignSpec = parse(&source).unwrap();
    group.bench_function("10,000 designs and their Pareto set", |b| {
        let search = DesignSearch::new(&spec, &source).unwrap();
        b.iter(|| {
            let found = search.explore(&|_| ()).feasible;
            let costs: Vec<Vec<f64>> = found.iter().map(|c| c.costs.clone()).collect();
            zsim::study::sweep::pareto_set(&costs)
        });
    });
    let (spec, source) = load("handheld").unwrap();
    let head = HeadModel::new(&spec, &source).unwrap();
    group.bench_function("gain curves of the handheld head, six axes", |b| {
        b.iter(|| gain_curves(&head, &GainPlan::default(), GainWatch::silent()).unwrap());
    });
    group.finish();
}

criterion_group!(benches, design_points, studies);
criterion_main!(benches);
