//! Force that the limb makes by itself.

use super::channel_filter::low_pass;
use super::outside_force::played;
use super::vocabulary::*;

const RMS: ParameterCard = mechanical("rms_n", ("N", "N m"), 0.0, 1e6, None);
const CUTOFF: ParameterCard = plain("cutoff_hz", "Hz", 1e-6, 1e6, Some(2.0));
const CARD: Card = Card {
    name: "limb-noise",
    what: "force that the limb makes by itself, broad-band, not caused by the perturbation",
    sides: &[Side::Limb],
    parameters: &[RMS, CUTOFF],
    signature: "coherence low below the cut-off and lower with a weaker perturbation, while the stiffness stays",
    look_alikes: &["hysteresis", "coulomb-friction", "dead-zone"],
    next_experiment: "one perturbation twice, exactly alike: what repeats is a nonlinearity, what does not is noise",
    equation: "f = -w(t), w low-pass noise of second order",
    source: "Palazzolo et al. 2007, Stochastic estimation of arm mechanical impedance during robotic stroke rehabilitation",
    trace: Trace::Noise,
};

/// Low-pass noise force.
pub(super) const EFFECT: Effect = Effect::new(&CARD, injection);

/// Numbers between 0 and 1 from a seed (SplitMix64, Steele, Lea & Flood 2014).
struct SplitMix(u64);

impl SplitMix {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let (rms, cutoff) = (parameters.number(CARD.name, &RMS)?, parameters.number(CARD.name, &CUTOFF)?);
    let rate_hz = (50.0 * cutoff).min(setting.sample_rate_hz);
    let run_in = (20.0 * rate_hz / cutoff) as usize;
    let length = (setting.duration_s * rate_hz) as usize + 2;
    let filter = low_pass(CARD.name, cutoff, 2, rate_hz)?;
    let tracks = setting
        .sites()
        .into_iter()
        .map(|axis| {
            let mut random = SplitMix(setting.seed ^ (axis as u64).wrapping_mul(0xa076_1d64_78bd_642f));
            let mut filter = filter.clone();
            let mut track: Vec<f64> = (0..run_in + length).map(|_| filter.step(2.0 * random.uniform() - 1.0)).skip(run_in).collect();
            let size = ndof_signal::rms(&track).max(f64::MIN_POSITIVE);
            track.iter_mut().for_each(|x| *x *= rms / size);
            (axis, track)
        })
        .collect();
    Ok(Injection::Force(Box::new(played(rate_hz, tracks))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_chance_are_those_of_splitmix64() {
        // The first outputs of the reference implementation (S. Vigna, splitmix64.c) from the seed 1234567.
        let mut random = SplitMix(1_234_567);
        for whole in [6_457_827_717_110_365_317u64, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423] {
            assert_eq!(random.uniform(), (whole >> 11) as f64 / 2f64.powi(53));
        }
    }
}
