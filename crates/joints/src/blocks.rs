//! Blocks of time, whose scatter says how sure a sum over all of them is.

use crate::table::Series;

/// Blocks of time from which intervals are drawn.
pub(crate) const BLOCKS: usize = 24;

/// Products of series with another, block of time by block of time, all joints together.
pub(crate) fn block_products(series: &[&Series], with: &Series) -> Vec<Vec<f64>> {
    let samples: usize = with.0.iter().map(|p| p.iter().flatten().map(Vec::len).max().unwrap_or(0)).sum();
    let length = samples.div_ceil(BLOCKS).max(1);
    let mut blocks = Vec::new();
    for (p, joints) in with.0.iter().enumerate() {
        let n = joints.iter().flatten().map(Vec::len).max().unwrap_or(0);
        let count = (n as f64 / length as f64).round().max(1.0) as usize;
        for b in 0..count {
            let own = |x: &Series, j: usize| -> f64 {
                let (Some(x), Some(y)) = (&x.0[p][j], &joints[j]) else { return 0.0 };
                let range = b * x.len() / count..(b + 1) * x.len() / count;
                x[range.clone()].iter().zip(&y[range]).map(|(a, b)| a * b).sum()
            };
            blocks.push(series.iter().map(|s| (0..joints.len()).map(|j| own(s, j)).sum()).collect());
        }
    }
    blocks
}
