//! A free-run fit of 3 × 50 s of a planar limb at 500 Hz, thirteen parameters and each trial's initial state; the promise is
//! one second on two cores.

#[path = "../crates/models/examples/support/planar.rs"]
mod planar;

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;

fn free_run(criterion: &mut Criterion) {
    let trials = planar::trials();
    let mut group = criterion.benchmark_group("free-run fit");
    group.sample_size(10);
    group.bench_function("planar, 3 x 50 s at 500 Hz, 13 parameters", |b| b.iter(|| planar::fit(black_box(&trials))));
    group.finish();
}

criterion_group!(benches, free_run);
criterion_main!(benches);
