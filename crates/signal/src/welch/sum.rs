//! The running sum of all cross-products, and the buffers of the segments in work.

use super::plan::Plan;
use num_complex::Complex64;
use pulp::bytemuck::cast_slice;

/// Segments that are transformed before their products are formed: the sum, larger than the caches when channels are
/// many, is read and written once for all of them.
const BATCH: usize = 8;

/// Bins whose products are formed for all pairs before the next: with [`BATCH`] segments they stay in a cache.
const TILE: usize = 64;

/// Bins in the innermost loop; their products are added up in registers.
const LANE: usize = 4;

/// Σ over segments of the lower triangle, in index order.
///
/// For x = Xᵣ + jXᵢ and y likewise, x y* = (XᵣYᵣ + XᵢYᵢ) + j(XᵢYᵣ − XᵣYᵢ). The four products are summed apart, two by
/// two as they stand in memory (`straight`: XᵣYᵣ, XᵢYᵢ; `crossed`: XᵣYᵢ, XᵢYᵣ), and brought together at the end, so
/// that nothing is shuffled segment by segment.
#[derive(Clone)]
pub(super) struct Sum {
    channels: usize,
    bins: usize,
    padded: usize,
    straight: Vec<f64>,
    crossed: Vec<f64>,
    /// Spectra of the segments not yet in the sum, `[segment][channel][padded bin]`.
    waiting: Vec<Complex64>,
    filled: usize,
    input: Vec<f64>,
    scratch: Vec<Complex64>,
}

pub(super) fn pairs(channels: usize) -> usize {
    channels * (channels + 1) / 2
}

impl Sum {
    pub(super) fn new(plan: &Plan, channels: usize) -> Self {
        let padded = plan.bins.next_multiple_of(LANE);
        Sum {
            channels,
            bins: plan.bins,
            padded,
            straight: vec![0.0; pairs(channels) * 2 * padded],
            crossed: vec![0.0; pairs(channels) * 2 * padded],
            waiting: vec![Complex64::default(); BATCH * channels * padded],
            filled: 0,
            input: plan.fft.make_input_vec(),
            scratch: plan.fft.make_scratch_vec(),
        }
    }

    /// Takes the next segment of every channel.
    pub(super) fn add<'a>(&mut self, plan: &Plan, segment: impl Iterator<Item = &'a [f64]>) {
        let n = plan.window.len();
        let at = self.filled * self.channels;
        for (row, samples) in self.waiting.chunks_exact_mut(self.padded).skip(at).zip(segment) {
            plan.detrend.apply_windowed(samples, &plan.window, &mut self.input[..n]);
            self.input[n..].fill(0.0);
            // Lengths are those of the plan, so the transform cannot refuse.
            let done = plan.fft.process_with_scratch(&mut self.input, &mut row[..plan.bins], &mut self.scratch);
            debug_assert!(done.is_ok());
        }
        self.filled += 1;
        if self.filled == BATCH {
            self.flush();
        }
    }

    /// Adds the products of the waiting segments to the sum.
    fn flush(&mut self) {
        let Sum { channels, padded, straight, crossed, waiting, filled, .. } = self;
        let (channels, padded) = (*channels, *padded);
        let spectra: &[f64] = cast_slice(&waiting[..*filled * channels * padded]);
        pulp::Arch::new().dispatch(|| {
            let mut tile = 0;
            while tile < padded {
                let end = padded.min(tile + TILE);
                let mut pair = 0;
                for a in 0..channels {
                    for b in 0..=a {
                        let at = 2 * (pair * padded + tile)..2 * (pair * padded + end);
                        let rows = (2 * (a * padded + tile), 2 * (b * padded + tile), 2 * channels * padded);
                        if a == b {
                            add_power(&mut straight[at], spectra, rows);
                        } else {
                            add_products(&mut straight[at.clone()], &mut crossed[at], spectra, rows);
                        }
                        pair += 1;
                    }
                }
                tile = end;
            }
        });
        *filled = 0;
    }

    /// Adds the lower triangle so far to `total`, pair by pair, and starts again from zero.
    pub(super) fn drain_into(&mut self, total: &mut [Complex64]) {
        self.flush();
        let rows = self.straight.chunks_exact_mut(2 * self.padded).zip(self.crossed.chunks_exact_mut(2 * self.padded));
        for (total, (straight, crossed)) in total.chunks_exact_mut(self.bins).zip(rows) {
            for ((t, s), c) in total.iter_mut().zip(straight.chunks_exact(2)).zip(crossed.chunks_exact(2)) {
                *t += Complex64::new(s[0] + s[1], c[1] - c[0]);
            }
            straight.fill(0.0);
            crossed.fill(0.0);
        }
    }
}

/// The products of one pair over one tile. `rows`: where x and y begin in the first segment, and the step to the next.
#[inline(always)]
fn add_products(straight: &mut [f64], crossed: &mut [f64], spectra: &[f64], rows: (usize, usize, usize)) {
    const WIDE: usize = 2 * LANE;
    let (x, y, step) = rows;
    for (i, (straight, crossed)) in straight.chunks_exact_mut(WIDE).zip(crossed.chunks_exact_mut(WIDE)).enumerate() {
        let (mut p, mut q) = ([0.0; WIDE], [0.0; WIDE]);
        p.copy_from_slice(straight);
        q.copy_from_slice(crossed);
        let (mut x, mut y) = (x + i * WIDE, y + i * WIDE);
        while x < spectra.len() {
            let (xs, ys) = (&spectra[x..x + WIDE], &spectra[y..y + WIDE]);
            for k in 0..WIDE {
                p[k] += xs[k] * ys[k];
            }
            for k in 0..LANE {
                q[2 * k] += xs[2 * k] * ys[2 * k + 1];
                q[2 * k + 1] += xs[2 * k + 1] * ys[2 * k];
            }
            x += step;
            y += step;
        }
        straight.copy_from_slice(&p);
        crossed.copy_from_slice(&q);
    }
}

/// The power of one channel over one tile.
#[inline(always)]
fn add_power(straight: &mut [f64], spectra: &[f64], rows: (usize, usize, usize)) {
    const WIDE: usize = 2 * LANE;
    let (x, _, step) = rows;
    for (i, straight) in straight.chunks_exact_mut(WIDE).enumerate() {
        let mut p = [0.0; WIDE];
        p.copy_from_slice(straight);
        let mut x = x + i * WIDE;
        while x < spectra.len() {
            let xs = &spectra[x..x + WIDE];
            for k in 0..WIDE {
                p[k] += xs[k] * xs[k];
            }
            x += step;
        }
        straight.copy_from_slice(&p);
    }
}
