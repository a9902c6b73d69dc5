//! Cross-spectra against the bare transforms of the same segments, which no method can do without.
//!
//! `cargo bench --bench spectra`; a ratio is `welch/…` over `bare transforms/…` of the same run.

use criterion::{Criterion, criterion_group, criterion_main};
use ndof_signal::{FilteredNoise, Multitaper, Welch};
use realfft::RealFftPlanner;
use std::hint::black_box;

const SAMPLE_RATE_HZ: f64 = 500.0;

/// Every segment of every channel copied into the transform's buffer and transformed, with plan and buffers at hand.
fn bare_transforms(criterion: &mut Criterion, name: &str, welch: &Welch, channels: &[&[f64]]) {
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(welch.nfft);
    let (mut input, mut output, mut scratch) = (fft.make_input_vec(), fft.make_output_vec(), fft.make_scratch_vec());
    let hop = welch.nperseg - welch.noverlap;
    criterion.bench_function(&format!("bare transforms/{name}"), |b| {
        b.iter(|| {
            for channel in channels {
                for segment in channel.windows(welch.nperseg).step_by(hop) {
                    input[..welch.nperseg].copy_from_slice(segment);
                    input[welch.nperseg..].fill(0.0);
                    fft.process_with_scratch(&mut input, &mut output, &mut scratch).expect("lengths of the plan");
                    black_box(&output);
                }
            }
        });
    });
}

fn spectra(criterion: &mut Criterion) {
    let one_core = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool of one thread");
    // Four channels of 50 s in the paper's two settings, and twelve of 30 minutes.
    for (name, welch, axes, samples) in [
        ("4 channels, 5 segments of 8192", Welch::fine(), 4, 25_000),
        ("4 channels, 45 segments of 2048 in 8192", Welch::smooth(), 4, 25_000),
        ("12 channels, 219 segments of 8192", Welch::fine(), 12, 900_000),
    ] {
        let noise = FilteredNoise { axes, samples, ..FilteredNoise::default() }.generate(1).expect("valid settings");
        let channels: Vec<&[f64]> = noise.iter().map(Vec::as_slice).collect();
        bare_transforms(criterion, name, &welch, &channels);
        criterion.bench_function(&format!("welch/{name}"), |b| {
            b.iter(|| one_core.install(|| welch.spectra(SAMPLE_RATE_HZ, black_box(&channels)).expect("long enough")));
        });
    }
    let noise = FilteredNoise { axes: 4, ..FilteredNoise::default() }.generate(1).expect("valid settings");
    let channels: Vec<&[f64]> = noise.iter().map(Vec::as_slice).collect();
    criterion.bench_function("multitaper/4 channels, 7 tapers of 25 000", |b| {
        b.iter(|| one_core.install(|| Multitaper::default().spectra(SAMPLE_RATE_HZ, black_box(&channels)).expect("long enough")));
    });
}

criterion_group!(benches, spectra);
criterion_main!(benches);
