//! Response and coherence beside the bare transforms of the same segments, which are the limit.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use ndof_signal::Welch;
use ndof_sysid::{Direct, Labels, Ports, ResponseKind, derived, direct};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use realfft::RealFftPlanner;
use std::hint::black_box;

const SAMPLES: usize = 25_000;

fn channels(count: usize) -> Vec<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    (0..count).map(|_| (0..SAMPLES).map(|_| rng.random_range(-1.0..1.0)).collect()).collect()
}

/// Every segment of every channel transformed, and nothing else.
fn bare(welch: &Welch, channels: &[&[f64]]) -> f64 {
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(welch.nfft);
    let (mut input, mut output, mut scratch) = (fft.make_input_vec(), fft.make_output_vec(), fft.make_scratch_vec());
    let mut sum = 0.0;
    for channel in channels {
        for start in (0..=SAMPLES - welch.nperseg).step_by(welch.nperseg - welch.noverlap) {
            input[..welch.nperseg].copy_from_slice(&channel[start..start + welch.nperseg]);
            input[welch.nperseg..].fill(0.0);
            if fft.process_with_scratch(&mut input, &mut output, &mut scratch).is_ok() {
                sum += output[7].re;
            }
        }
    }
    sum
}

fn response(criterion: &mut Criterion) {
    for (setting, welch) in [("45 segments", Welch::smooth()), ("5 segments", Welch::fine())] {
        let mut group = criterion.benchmark_group(setting);
        group.sample_size(20);
        for q in [1, 2, 3] {
            let samples = channels(3 * q);
            let all: Vec<&[f64]> = samples.iter().map(Vec::as_slice).collect();
            let two = &all[..2 * q];
            let open = Ports { references: vec![], inputs: (0..q).collect(), outputs: (q..2 * q).collect() };
            let held = Ports { references: (2 * q..3 * q).collect(), ..open.clone() };
            let label = |ports: &Ports| Labels::numbered(ports, ResponseKind::Compliance);
            let (open_labels, held_labels) = (label(&open), label(&held));
            let size = format!("{q}x{q}");
            group.bench_function(BenchmarkId::new("bare transforms", &size), |b| b.iter(|| bare(&welch, black_box(two))));
            group.bench_function(BenchmarkId::new("spectra, response, coherence", &size), |b| {
                b.iter(|| welch.spectra(500.0, black_box(two)).map(|s| direct(&s, &open, &open_labels, Direct::H1)));
            });
            let Ok(spectra) = welch.spectra(500.0, &all) else { continue };
            group.bench_function(BenchmarkId::new("response, coherence", &size), |b| b.iter(|| direct(black_box(&spectra), &open, &open_labels, Direct::H1)));
            group.bench_function(BenchmarkId::new("derived", &size), |b| b.iter(|| derived(black_box(&spectra), &held, &held_labels)));
        }
        group.finish();
    }
}

criterion_group!(benches, response);
criterion_main!(benches);
