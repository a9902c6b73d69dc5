//! A link that swings on a spring, or falls between two sides: from one sample to the next.

/// M ẍ + c ẋ + k x = u.
pub(crate) struct Swing {
    pub inertia: f64,
    pub damping: f64,
    pub stiffness: f64,
}

impl Swing {
    /// Where it stays, and how fast it moves, behind a force that grows in a line.
    pub fn stays(&self, force: f64, growth: f64) -> [f64; 2] {
        let rate = growth / self.stiffness;
        [(force - self.damping * rate) / self.stiffness, rate]
    }

    /// x and ẋ after a time in which the force goes from one to another in a line.
    pub fn after(&self, [x, v]: [f64; 2], [from, to]: [f64; 2], time: f64) -> [f64; 2] {
        let [before, rate] = self.stays(from, (to - from) / time);
        let [own, swing] = swung([x - before, v - rate], self.damping / (2.0 * self.inertia), self.stiffness / self.inertia, time);
        [before + rate * time + own, rate + swing]
    }
}

/// x and ẋ of ẍ + 2 α ẋ + ω² x = 0 a while later.
fn swung([x, v]: [f64; 2], decay: f64, square: f64, time: f64) -> [f64; 2] {
    let left = square - decay * decay;
    let (w, fall) = (left.abs().sqrt() * time, decay * time);
    let [c, s] = if left >= 0.0 {
        [w.cos(), w.sin()].map(|x| x * (-fall).exp())
    } else {
        // Of cosh and sinh, which alone overflow where it falls fast.
        let [slow, fast] = [w - fall, -w - fall].map(f64::exp);
        [0.5 * (slow + fast), 0.5 * (slow - fast)]
    };
    // e^(−αt) sin(ωt)/ω, which is t e^(−αt) where ω is none.
    let s = if w > 1e-9 { s / w * time } else { time * (-fall).exp() };
    [x * c + (v + decay * x) * s, v * c - (decay * v + square * x) * s]
}

/// A link in its play: where it is and how fast.
pub(crate) struct Fall {
    pub side: f64,
    pub x: f64,
    pub v: f64,
}

impl Fall {
    /// A while under an acceleration that changes in a line.
    pub fn over(&mut self, time: f64, mut acceleration: f64, jerk: f64) {
        let mut left = time;
        // It leaves a side, lands, and may leave once more.
        for _ in 0..3 {
            let lies = self.x.abs() >= self.side && self.v == 0.0;
            if lies && acceleration * self.x >= 0.0 {
                let turns = -acceleration / jerk;
                if !(turns > 0.0 && turns < left) {
                    return;
                }
                (left, acceleration) = (left - turns, 0.0);
            }
            let at = |t: f64| self.x + t * (self.v + t * (acceleration / 2.0 + t * jerk / 6.0));
            // From the side on which it lies it goes inwards, whatever rounding says.
            let lands = |t: f64| if lies { at(t) * self.x <= -self.side * self.side } else { at(t).abs() >= self.side };
            if !lands(left) {
                let speed = self.v + left * (acceleration + left * jerk / 2.0);
                (self.x, self.v) = (at(left).clamp(-self.side, self.side), speed);
                return;
            }
            let (mut before, mut after) = (0.0, left);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (before + after);
                if lands(middle) { after = middle } else { before = middle }
            }
            (self.x, self.v) = (self.side.copysign(at(after)), 0.0);
            (left, acceleration) = (left - after, acceleration + after * jerk);
        }
    }
}

/// By then the moment of a landing is known to the last digits of a step.
const HALVINGS: usize = 50;

#[cfg(test)]
mod tests {
    use super::*;

    /// By their own equations of motion, from slow to fast and from none to much damping: x = e^(−αt) of one that is critically damped and begins with v = −α x.
    #[test]
    fn what_swings_obeys_its_equation_and_what_falls_fast_stays_finite() {
        for (decay, square) in [(0.0, 100.0), (1.0, 100.0), (10.0, 100.0), (30.0, 100.0), (1e6, 100.0), (2.0, -3.0)] {
            let at = |t: f64| swung([1.0, -0.5], decay, square, t);
            let [x, v] = at(0.07);
            let h = 1e-5;
            let [before, after] = [at(0.07 - h), at(0.07 + h)];
            assert!(x.is_finite() && v.is_finite() && ((after[0] - before[0]) / (2.0 * h) - v).abs() < 1e-6, "{decay} {square}");
            let acceleration = (after[1] - before[1]) / (2.0 * h);
            assert!((acceleration + 2.0 * decay * v + square * x).abs() < 1e-4 * (1.0 + 2.0 * decay * v.abs() + square.abs()), "{decay} {square}");
        }
        let [x, v] = swung([1.0, -10.0], 10.0, 100.0, 0.3);
        assert!((x - (-3.0_f64).exp()).abs() < 1e-12 && (v + 10.0 * (-3.0_f64).exp()).abs() < 1e-11);
    }
}
