//! An estimate that is made to be fitted knows what the whole one knows.

use ndof_analysis::{Estimate, Fit, MethodName, Trial, Trials, estimate, estimate_to_fit};
use ndof_sysid::ResponseKind;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A limb of 2 kg, 12 N s/m and such a stiffness in much noise, pushed by a force that is hardly more its command than its own noise.
fn trial(stiffness: f64, seed: u64) -> Trial {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = |size: f64| -> Vec<f64> { (0..6000).map(|_| size * Distribution::<f64>::sample(&StandardNormal, &mut rng)).collect() };
    let (command, own, seen) = (noise(1.0), noise(1.0), noise(2e-3));
    let force: Vec<f64> = command.iter().zip(&own).map(|(command, own)| 1.3 * command + own).collect();
    let (mut x, mut v) = (0.0, 0.0);
    let mut moved = |(force, seen): (&f64, &f64)| {
        v += (force - 12.0 * v - stiffness * x) / 2.0 * 5e-3;
        x += v * 5e-3;
        x + seen
    };
    let motion: Vec<f64> = force.iter().zip(&seen).map(&mut moved).collect();
    Trial::new(200.0).command("x", command).effort("x", force).displacement("x", motion).expect("a trial")
}

#[test]
fn it_warns_of_the_same_and_fits_the_same_at_no_frequency() {
    let [one, other] = [(150.0, 1), (900.0, 2)].map(|(stiffness, seed)| trial(stiffness, seed));
    let trials = Trials::of([&one, &other]).expect("trials alike");
    for method in [MethodName::Welch, MethodName::LocalPolynomial] {
        let settings = Estimate { method, band_hz: Some([1.0, 30.0]), response: Some(ResponseKind::Impedance), ..Estimate::default() };
        let [whole, bare] = [estimate(&trials, &settings), estimate_to_fit(&trials, &settings, &Fit::default())].map(|made| made.expect("an estimate"));
        let codes: Vec<&str> = bare.result.head.warnings.iter().map(|warning| warning.code.as_str()).collect();
        assert!(["weak-instrument", "inverse-not-trusted", "trials-differ"].iter().all(|code| codes.contains(code)), "{codes:?}");
        assert_eq!(bare.result.head.warnings, whole.result.head.warnings);
        let untrusted = bare.result.head.warnings.iter().find(|warning| warning.code == "inverse-not-trusted").expect("it is there");
        assert!(untrusted.message.contains(&format!("of {} frequencies", whole.result.frequency_hz.len())), "{}", untrusted.message);
        let [all, none] = [&whole, &bare].map(|estimated| estimated.result.trial_spread.as_ref().expect("two trials"));
        assert_eq!((all.ratio, all.ratio_std_error), (none.ratio, none.ratio_std_error));
        assert!(bare.result.frequency_hz.is_empty() && none.between.is_empty() && !all.between.is_empty());
        assert_eq!(Fit::default().run(&bare).expect("a fit").result, Fit::default().run(&whole).expect("a fit").result);
    }
}

/// Beyond the band that is fitted the derived response is not made, and the fit is the same: of the band that the data tell, and of one that is asked for.
#[test]
fn its_derived_response_ends_with_the_band() {
    let [one, other] = [(150.0, 1), (150.0, 2)].map(|(stiffness, seed)| trial(stiffness, seed));
    let trials = Trials::of([&one, &other]).expect("trials alike");
    let settings = Estimate { method: MethodName::LocalPolynomial, ..Estimate::default() };
    let whole = estimate(&trials, &settings).expect("an estimate");
    for band_hz in [None, Some([1.0, 12.0]), Some([2.0, 60.0])] {
        let fit = Fit { band_hz, ..Fit::default() };
        let bare = estimate_to_fit(&trials, &settings, &fit).expect("an estimate");
        let [expected, found] = [&whole, &bare].map(|estimated| fit.run(estimated).expect("a fit").result);
        assert_eq!(found, expected);
        let last_hz = bare.best().frequency_hz.last().copied().expect("lines");
        assert!(last_hz < 99.0 && last_hz >= found.band_hz[1], "{last_hz} Hz of {:?}", found.band_hz);
    }
}
