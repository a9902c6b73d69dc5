//! Sums over long signals.

/// Sums over all samples, some side by side: one after the other each would wait for the one before.
pub(crate) fn total<const N: usize>(samples: &[f64], of: impl Fn(f64) -> [f64; N]) -> [f64; N] {
    let (eights, rest) = samples.as_chunks::<8>();
    let mut sums = [[0.0; 8]; N];
    for eight in eights {
        let of_each = eight.map(&of);
        for (k, sums) in sums.iter_mut().enumerate() {
            for (sum, v) in sums.iter_mut().zip(&of_each) {
                *sum += v[k];
            }
        }
    }
    std::array::from_fn(|k| sums[k].iter().sum::<f64>() + rest.iter().map(|x| of(*x)[k]).sum::<f64>())
}
