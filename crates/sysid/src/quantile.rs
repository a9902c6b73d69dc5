//! Quantiles that end, whatever the degrees of freedom: the usual iteration on the incomplete beta function does not for some 10⁸ of them,
//! nor for 10⁻³²².

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// Degrees of freedom from which Student's t is taken from its expansion about the normal distribution: good to eleven digits there, and
/// beyond, where the iteration is good to five.
const NEARLY_NORMAL: f64 = 3000.0;
/// Degrees of freedom below which t and F are infinite: there (1 − level)^(−1/n) is beyond all numbers for every level above 0.001.
const HARDLY_ANY: f64 = 1e-6;
/// Halvings of an interval: more than a number has digits.
const HALVINGS: usize = 100;

/// The t of Student's distribution that |t| stays below with probability `level`; NaN outside of 0 < level < 1 or of positive degrees of
/// freedom. Infinite below 10⁻⁶ of them.
///
/// From 3000 degrees of freedom n on, t = z + (z³ + z)/(4n) + (5z⁵ + 16z³ + 3z)/(96n²) + (3z⁷ + 19z⁵ + 17z³ − 15z)/(384n³), z the normal
/// quantile (Fisher & Cornish 1960).
///
/// ```
/// use ndof_sysid::two_sided_t;
/// assert!((two_sided_t(0.95, 40.0) - 2.021_075_390_306).abs() < 1e-9);
/// assert!((two_sided_t(0.95, 1e12) - 1.959_963_984_540).abs() < 1e-9);
/// ```
pub fn two_sided_t(level: f64, degrees_of_freedom: f64) -> f64 {
    let n = degrees_of_freedom;
    if !(level > 0.0 && level < 1.0 && n > 0.0) {
        return f64::NAN;
    }
    if n < HARDLY_ANY {
        return f64::INFINITY;
    }
    if n < NEARLY_NORMAL {
        return StudentsT::new(0.0, 1.0, n).map_or(f64::NAN, |t| t.inverse_cdf(0.5 + level / 2.0));
    }
    let z = -Normal::standard().inverse_cdf((1.0 - level) / 2.0);
    let s = z * z;
    z * (1.0 + (s + 1.0) / (4.0 * n) + ((5.0 * s + 16.0) * s + 3.0) / (96.0 * n * n) + (((3.0 * s + 19.0) * s + 17.0) * s - 15.0) / (384.0 * n * n * n))
}

/// The quantile of Fisher's F with 2q and 2ν degrees of freedom; NaN and infinite as [`two_sided_t`].
pub(crate) fn fisher(level: f64, q: usize, freedom: f64) -> f64 {
    let depth = depth(level, q, freedom);
    if 2.0 * freedom < HARDLY_ANY && !depth.is_nan() {
        return f64::INFINITY;
    }
    freedom / q as f64 * (depth / freedom).exp_m1()
}

/// The quantile of the beta distribution with parameters q and ν.
pub(crate) fn beta(level: f64, q: usize, freedom: f64) -> f64 {
    -(-depth(level, q, freedom) / freedom).exp_m1()
}

/// w = −ν ln(1 − z), z the beta quantile: 1 − I_z(q, ν) = e^(−w) Σ_{k<q} z^k Π_{j<k} (ν + j)/(j + 1) for whole q, which falls with w.
fn depth(level: f64, q: usize, freedom: f64) -> f64 {
    if !(level > 0.0 && level < 1.0 && freedom > 0.0 && freedom.is_finite() && q > 0) {
        return f64::NAN;
    }
    let alone = -(-level).ln_1p();
    let beyond = |w: f64| {
        let z = -(-w / freedom).exp_m1();
        let (mut term, mut sum) = (1.0, 1.0);
        for k in 1..q {
            term *= z * (freedom + (k - 1) as f64) / k as f64;
            sum += term;
        }
        sum.ln() - w > -alone
    };
    if q == 1 {
        return alone;
    }
    let (mut low, mut high) = (alone, 2.0 * alone + 1.0);
    while beyond(high) && high < f64::MAX / 4.0 {
        high *= 2.0;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if beyond(middle) { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{Beta, FisherSnedecor};

    const FREEDOMS: [f64; 5] = [1.0, 4.5, 30.0, 1234.5, 5e4];
    const LEVELS: [f64; 5] = [0.01, 0.5, 0.95, 0.99, 0.999_999];

    #[test]
    fn quantiles_are_those_of_the_distributions() {
        for (level, freedom, q) in LEVELS.iter().flat_map(|l| FREEDOMS.iter().flat_map(move |f| (1..=6).map(move |q| (*l, *f, q)))) {
            let (a, b) = (2.0 * q as f64, 2.0 * freedom);
            let by_f = FisherSnedecor::new(a, b).expect("positive").cdf(fisher(level, q, freedom));
            let by_beta = Beta::new(q as f64, freedom).expect("positive").cdf(beta(level, q, freedom));
            assert!((by_f - level).abs() < 1e-9 && (by_beta - level).abs() < 1e-9, "{level} {freedom} {q}: {by_f} {by_beta}");
        }
    }

    #[test]
    fn t_of_many_degrees_of_freedom_is_that_of_scipy() {
        // scipy.stats.t.isf((1 - level) / 2, n), SciPy 1.17
        for (level, n, expected) in [
            (0.5, 3000.0, 0.67457153733684),
            (0.95, 3000.0, 1.96075505532246),
            (0.99, 3000.0, 2.57746913483861),
            (0.5, 30000.0, 0.67449792811528),
            (0.95, 30000.0, 1.96004306338393),
            (0.99, 30000.0, 2.57599319828571),
            (0.5, 10000000.0, 0.67448977472957),
            (0.95, 10000000.0, 1.95996422176721),
            (0.99, 10000000.0, 2.57582979520375),
        ] {
            assert!((two_sided_t(level, n) / expected - 1.0).abs() < 1e-11, "{level} {n}: {}", two_sided_t(level, n));
        }
    }

    #[test]
    fn no_level_and_no_freedom_keeps_a_quantile_from_ending() {
        for level in [1e-300, 1e-12, 0.5, 0.95, 1.0 - 1e-12, 1.0 - f64::EPSILON / 2.0] {
            for freedom in [f64::from_bits(1), 1e-320, 1e-300, 1e-12, 6e-7, 1e-3, 1.0, 1e4, 1e8, 1e12, 1e300] {
                assert!(!two_sided_t(level, 2.0 * freedom).is_nan(), "t {level} {freedom}");
                assert!(
                    [1, 2, 12].iter().all(|q| !fisher(level, *q, freedom).is_nan() && (0.0..=1.0).contains(&beta(level, *q, freedom))),
                    "F {level} {freedom}"
                );
            }
        }
        assert!([f64::NAN, -1.0, 0.0, 1.0, 2.0].iter().all(|level| two_sided_t(*level, 3.0).is_nan() && fisher(*level, 2, 3.0).is_nan()));
        assert!([f64::NAN, -1.0, 0.0].iter().all(|freedom| two_sided_t(0.95, *freedom).is_nan() && fisher(0.95, 2, *freedom).is_nan()));
    }
}
