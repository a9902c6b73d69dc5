//! Fits that are promised in a second on two cores: free-run, 3 × 50 s of a planar limb at 500 Hz with thirteen parameters and each trial's initial
//! state; and in frequency, six axes with 63 parameters from three trials of 50 s, intervals by leaving out each trial.

#[path = "../examples/support/planar.rs"]
mod planar;
#[path = "../examples/support/six_axes.rs"]
mod six_axes;

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;

fn free_run(criterion: &mut Criterion) {
    let trials = planar::trials();
    let mut group = criterion.benchmark_group("free-run fit");
    group.sample_size(10);
    group.bench_function("planar, 3 x 50 s at 500 Hz, 13 parameters", |b| b.iter(|| planar::fit(black_box(&trials))));
    group.finish();
}

fn frequency(criterion: &mut Criterion) {
    let responses = six_axes::responses().expect("a response");
    let mut group = criterion.benchmark_group("fit in frequency");
    group.sample_size(10);
    group.bench_function("six axes, 3 x 50 s, 63 parameters", |b| b.iter(|| six_axes::fit(black_box(&responses)).expect("a fit")));
    group.finish();
}

criterion_group!(benches, free_run, frequency);
criterion_main!(benches);
