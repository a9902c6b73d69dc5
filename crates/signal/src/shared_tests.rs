//! What unit tests share.

use rand::{RngExt, SeedableRng};

/// `n` numbers between −1 and 1, of that seed and stream.
pub(crate) fn noise(seed: u64, stream: u64, n: usize) -> Vec<f64> {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    (0..n).map(|_| rng.random_range(-1.0..1.0)).collect()
}
