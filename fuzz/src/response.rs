//! The algebra of a response: conversions, intervals, products.

use crate::numbers::Given;
use ndarray::Array3;
use ndof_signal::Kernel;
use ndof_sysid::{FrequencyResponse, ResponseKind, StoppingRule, Uncertainty, averages_for_interval, ordered_coherence, spread, unresolved};
use num_complex::Complex64;

pub const KINDS: [ResponseKind; 5] =
    [ResponseKind::Compliance, ResponseKind::DynamicStiffness, ResponseKind::Impedance, ResponseKind::Admittance, ResponseKind::Transfer];

/// A response of any numbers, with a covariance of any numbers: what a file of results may hold.
pub fn arbitrary(given: &Given, (outputs, inputs): (usize, usize), bins: usize) -> FrequencyResponse {
    let names = |what: &str, count: usize| (0..count).map(|k| format!("{what}_{k}")).collect::<Vec<String>>();
    let size = outputs * inputs;
    let at = |from: usize, (rows, columns): (usize, usize)| {
        Array3::from_shape_fn((bins, rows, columns), |(f, i, j)| given.complex(from + (f * rows + i) * columns + j))
    };
    // Hermitian and positive definite, as that of an estimate is.
    let square = |from: usize, n: usize| {
        let root = at(from, (n, n));
        Array3::from_shape_fn((bins, n, n), |(f, i, j)| (0..n).map(|k| root[[f, i, k]] * root[[f, j, k]].conj()).sum::<Complex64>())
    };
    let (noise, input_inverse) = if given.bit(2, 7) {
        (at(bins * size, (outputs, outputs)), at(3 + bins * size, (inputs, inputs)))
    } else {
        (square(bins * size, outputs), square(3 + bins * size, inputs))
    };
    let step = if given.bit(2, 6) && given.value(1).is_finite() { given.value(1) } else { 0.5 };
    FrequencyResponse {
        frequency_hz: (0..bins).map(|f| f as f64 * step).collect(),
        inputs: names("in", inputs),
        outputs: names("out", outputs),
        kind: given.one_of(3, &KINDS),
        value: at(0, (outputs, inputs)),
        uncertainty: given.bit(2, 5).then(|| Uncertainty {
            unexplained: given.bit(2, 2).then(|| square(7 + bins * size, outputs + inputs)),
            noise,
            input_inverse,
            degrees_of_freedom: if given.bit(2, 4) { given.value(2) } else { 20.0 },
            independent_spacing_hz: if given.bit(2, 4) { given.value(3) } else { 0.5 },
            kernel: Kernel { offset_hz: vec![-0.5, 0.0, 0.5], weight: vec![0.25, 0.5, 0.25] },
            inverted: given.bit(2, 3),
        }),
    }
}

/// One thing that is done with a response of arbitrary numbers.
pub fn algebra(given: &Given) {
    let (outputs, inputs) = (1 + given.choose(1, 3), 1 + usize::from(given.bit(1, 7)));
    let response = arbitrary(given, (outputs, inputs), given.choose(5, 8));
    match given.choose(4, 5) {
        0 => intervals(&response),
        1 => kinds(&response),
        2 => {
            let rule = StoppingRule {
                relative_half_width: given.value(0),
                level: given.value(1),
                low_hz: given.value(2),
                high_hz: given.value(3),
                share: given.value(4),
                diagonal_only: given.bit(6, 7),
            };
            if let Some(progress) = rule.judge(&response) {
                assert!((0.0..=1.0).contains(&progress.share), "{progress:?}");
            }
            let _ = averages_for_interval(given.value(5), given.choose(6, 16), given.value(6), given.value(7));
        }
        3 => {
            let _ = unresolved(&response, given.value(0), given.value(1), given.value(2));
            let _ = spread(&[response.clone(), response.clone()], given.value(1), given.value(2));
        }
        _ => {
            if let Some(own) = &response.uncertainty {
                let multiple = ndarray::Array2::from_shape_fn((response.len(), outputs), |(f, i)| given.value(f + i));
                let _ = ordered_coherence(&response, &own.input_inverse, &multiple);
            }
        }
    }
}

/// Intervals hold the value that they belong to.
pub fn intervals(response: &FrequencyResponse) {
    let (outputs, inputs) = response.shape();
    for (i, j) in (0..outputs).flat_map(|i| (0..inputs).map(move |j| (i, j))) {
        for entry in response.gain_phase(i, j, 0.95) {
            let [low, high] = entry.gain_interval;
            assert!(!(low < 0.0) && !(low > entry.gain * (1.0 + 1e-12)) && !(high < entry.gain * (1.0 - 1e-12)), "{entry:?}");
        }
    }
}

/// Conversions and inverses, of which there are those of square responses only.
pub fn kinds(response: &FrequencyResponse) {
    let (outputs, inputs) = response.shape();
    for kind in KINDS {
        if let Ok(other) = response.to_kind(kind) {
            assert!(other.kind == kind && other.len() == response.len());
        }
    }
    match response.inverse() {
        Ok(inverse) => assert!(outputs == inputs && inverse.inverse().is_ok()),
        Err(_) => assert_ne!(outputs, inputs),
    }
    assert_eq!(response.invertibility().len(), response.len());
}
