//! The least value of a function of one number.

/// Where a cost is least in a bracket, by golden section until the bracket is narrower than `close` or so many evaluations are done. A start, with its
/// cost, is kept where nothing is better.
pub fn golden((mut a, mut b): (f64, f64), start: (f64, f64), close: f64, evaluations: usize, cost: impl Fn(f64) -> f64) -> f64 {
    const RATIO: f64 = 0.618_033_988_749_894_9;
    let mut best = start;
    let (mut c, mut d) = (b - RATIO * (b - a), a + RATIO * (b - a));
    let (mut fc, mut fd) = (cost(c), cost(d));
    for _ in 2..evaluations {
        for (u, f) in [(c, fc), (d, fd)] {
            if f < best.1 {
                best = (u, f);
            }
        }
        if b - a < close {
            break;
        }
        if fc < fd {
            b = d;
            (d, fd) = (c, fc);
            c = b - RATIO * (b - a);
            fc = cost(c);
        } else {
            a = c;
            (c, fc) = (d, fd);
            d = a + RATIO * (b - a);
            fd = cost(d);
        }
    }
    best.0
}
