//! Whole results of estimation, number by number, as they were when they were last looked at.
//!
//! `reference/numbers/` holds them at some frequencies for every method, with and without references, for one and several inputs and outputs,
//! and for what judges estimates. Whether they are right the other files ask. A change is to be looked at; `NDOF_WRITE_NUMBERS=1 cargo test
//! --release -p ndof-sysid --test numbers` writes it anew.

#[path = "../../../tests/support/stored.rs"]
mod stored;

use ndof_signal::{Channel, CrossSpectra, Multitaper, Periodic, Quantity, Recording, Unit, Welch};
use ndof_sysid::{
    Confidence, Direct, Estimates, FrequencyResponse, Labels, LocalPolynomial, LocalRational, Ports, ResponseKind, SpectralMethod, StoppingRule,
    anderson_rubin, averages_for_interval, bootstrap_std, choose_method, conditioned, derived, direct, estimate, estimate_from_spectra, hausman,
    ordered_coherence, paper_random_error, robust_spectra, sliding, spread, unresolved,
};
use num_complex::Complex64;
use serde_json::{Value, json};
use std::f64::consts::TAU;
use stored::{held, nudge};

/// Six digits are stored.
const RELATIVE: f64 = 2e-5;

const RATE_HZ: f64 = 64.0;

/// Numbers between −1 and 1 that look like noise.
fn noise(number: usize, seed: f64) -> f64 {
    let x = (12.9898 * number as f64 + 78.233 * seed).sin() * 43758.5453;
    (2.0 * (x - x.floor()) - 1.0) * nudge(number)
}

fn recording(channels: Vec<(&str, Vec<f64>)>) -> Recording {
    let quantity = |name: &str| if name.starts_with("pos") { Quantity::Displacement } else { Quantity::Effort };
    let channels = channels.into_iter().map(|(name, samples)| Channel::new(name, Unit::si(quantity(name), false), samples));
    Recording::new(RATE_HZ, channels.collect()).expect("equal lengths")
}

/// A limb of two axes that pull on each other, with resonances at 6 and 6.9 Hz, held by a robot that pulls back.
fn arm_with(command: [&[f64]; 2], damping: f64, spring: impl Fn(f64) -> f64, own: impl Fn(usize, usize) -> f64) -> Recording {
    let modes = [6.0, 6.9].map(|hz| {
        let w = TAU * hz / RATE_HZ;
        let (decay, turn) = ((-damping * w).exp(), w * (1.0 - damping * damping).sqrt());
        (2.0 * decay * turn.cos(), decay * decay)
    });
    let (mut now, mut before) = ([0.0; 2], [0.0; 2]);
    let mut out = [const { Vec::new() }; 4];
    for (k, (x, y)) in command[0].iter().zip(command[1]).enumerate() {
        let force = [0, 1].map(|i| [x, y][i] - 0.1 * now[i] - 0.5 * (now[i] - before[i]) - 0.03 * before[1 - i] + 0.3 * spring(before[i]));
        let next = [0, 1].map(|i| {
            let (a, b) = modes[i];
            a * now[i] - b * before[i] + (1.0 - a + b) * (force[i] + 0.3 * force[1 - i] + own(k, i) + spring(now[i]))
        });
        (before, now) = (now, next);
        (0..2).for_each(|i| out[i].push(force[i] + 0.03 * own(k, 2 + i)));
        (0..2).for_each(|i| out[2 + i].push(next[i] + 0.03 * own(k, 4 + i)));
    }
    let [fx, fy, x, y] = out;
    recording(vec![("cmd_x", command[0].to_vec()), ("cmd_y", command[1].to_vec()), ("force_x", fx), ("force_y", fy), ("pos_x", x), ("pos_y", y)])
}

fn arm(trial: usize, n: usize, damping: f64, disturbance: f64) -> Recording {
    let command = [0, 1].map(|i| (0..n).map(|k| noise(k, (10 * trial + i) as f64)).collect::<Vec<f64>>());
    arm_with([&command[0], &command[1]], damping, |_| 0.0, |k, i| disturbance * noise(k, (10 * trial + 3 + i) as f64))
}

fn arms(trials: usize, n: usize, damping: f64, disturbance: f64) -> Vec<Recording> {
    (0..trials).map(|trial| arm(trial, n, damping, disturbance)).collect()
}

/// Channels of the arm by role: both axes with commands, without, one command and input, two commands for one, two outputs.
fn all_ports() -> [Ports; 5] {
    let ports = |references: &[usize], inputs: &[usize], outputs: &[usize]| Ports {
        references: references.to_vec(),
        inputs: inputs.to_vec(),
        outputs: outputs.to_vec(),
    };
    [ports(&[0, 1], &[2, 3], &[4, 5]), ports(&[], &[2, 3], &[5, 4]), ports(&[0], &[2], &[4]), ports(&[1, 0], &[3], &[5]), ports(&[0], &[2, 3], &[5])]
}

/// Of everything that is one a frequency only what is at `at`; windows are not looked at.
fn picked(value: Value, bins: usize, at: &[usize]) -> Value {
    let some = |values: &[Value]| -> Value {
        let each = values.len() / bins;
        at.iter().flat_map(|&f| values[f * each..(f + 1) * each].iter().cloned()).collect()
    };
    match value {
        Value::Object(entries) if entries.contains_key("dim") => some(entries["data"].as_array().expect("data")),
        Value::Object(entries) => entries.into_iter().filter(|(key, _)| key != "kernel").map(|(key, value)| (key, picked(value, bins, at))).collect(),
        Value::Array(values) if values.len() == bins => some(&values),
        Value::Array(values) => values.into_iter().map(|value| picked(value, bins, at)).collect(),
        other => other,
    }
}

fn parts(found: &Estimates, at: &[usize]) -> Value {
    let all = json!({
        "direct": found.direct, "derived": found.derived, "distortion": found.distortion, "method": found.method, "averages": found.effective_averages,
        "warnings": found.warnings,
    });
    picked(all, found.direct.response.len(), at)
}

fn run(trials: &[Recording], ports: &Ports, method: &SpectralMethod, estimator: Direct, at: &[usize]) -> Value {
    let trials: Vec<&Recording> = trials.iter().collect();
    match estimate(&trials, ports, &Labels::of(trials[0], ports), method, estimator) {
        Ok(found) => {
            let last = found.direct.response.len() - 1;
            parts(&found, &at.iter().map(|&f| f.min(last)).collect::<Vec<_>>())
        }
        Err(error) => json!(error.to_string()),
    }
}

/// The ends, and the middle of batches.
const SOME: [usize; 5] = [0, 1, 12, 22, usize::MAX];

fn welch() -> Value {
    let trials = arms(2, 300, 0.1, 0.5);
    let method = SpectralMethod::Welch(Welch::new(64));
    let [both, _, _, two_commands, _] = all_ports();
    let turned = Ports { references: vec![1, 5, 0], inputs: vec![3, 2], outputs: vec![4] };
    let three = Ports { references: vec![1], inputs: vec![2], outputs: vec![3, 5, 4] };
    json!([
        run(&trials, &both, &method, Direct::H1, &SOME),
        run(&trials, &both, &method, Direct::H2, &[0, 12, 22]),
        run(&trials, &both, &method, Direct::Hv, &[0, 12, 22]),
        run(&trials, &two_commands, &method, Direct::H1, &[0, 12, 22]),
        run(&trials, &turned, &method, Direct::H1, &[12]),
        run(&trials, &three, &method, Direct::H1, &[12]),
    ])
}

fn others() -> Value {
    let trials = arms(2, 200, 0.1, 0.5);
    let [both, without, one, _, few] = all_ports();
    let tapers = SpectralMethod::Multitaper(Multitaper::default());
    let long = [arm(7, 2000, 0.004, 0.0)];
    json!([
        run(&trials, &both, &tapers, Direct::H1, &[20]),
        run(&trials, &few, &tapers, Direct::Hv, &[20]),
        run(&[arm(1, 20_000, 0.02, 0.0)], &both, &SpectralMethod::Welch(Welch::new(128)), Direct::H1, &[12]),
        run(&long, &one, &SpectralMethod::Welch(Welch::new(128)), Direct::H1, &[12]),
        run(&trials, &without, &SpectralMethod::Welch(Welch::new(32)), Direct::H2, &[7]),
    ])
}

fn polynomial() -> Value {
    let [both, without, one, two_commands, few] = all_ports();
    let trials = arms(2, 240, 0.1, 0.5);
    let set = |settings: LocalPolynomial| SpectralMethod::LocalPolynomial(settings);
    let plain = LocalPolynomial::default();
    let turned = Ports { references: vec![], inputs: vec![4], outputs: vec![2] };
    let uneven = [arm(1, 161, 0.2, 0.5), arm(2, 155, 0.2, 0.5)];
    json!([
        run(&trials, &both, &set(plain), Direct::H1, &[0, 1, 22, 26, usize::MAX - 1, usize::MAX]),
        run(&trials[..1], &one, &set(plain), Direct::H1, &[1, 22, 119]),
        run(&trials[..1], &without, &set(LocalPolynomial { order: 4, ..plain }), Direct::H1, &[3, 22, 119]),
        run(&uneven, &two_commands, &set(LocalPolynomial { order: 1, half_width: Some(7), ..plain }), Direct::H1, &[0, 15, 76, 77]),
        run(&uneven, &two_commands, &set(LocalPolynomial { leave_one_out: true, ..plain }), Direct::H1, &[15]),
        run(&arms(1, 700, 0.02, 0.2), &one, &set(LocalPolynomial { leave_one_out: true, ..plain }), Direct::H1, &[65]),
        run(&arms(1, 300, 0.7, 2.0), &without, &set(LocalPolynomial { leave_one_out: true, ..plain }), Direct::H1, &[30]),
        run(&trials, &few, &set(plain), Direct::H1, &[30]),
        run(&arms(1, 60, 0.5, 1.0), &one, &set(LocalPolynomial { leave_one_out: true, ..plain }), Direct::H1, &[9]),
        run(&arms(1, 400, 0.1, 0.1), &turned, &set(LocalPolynomial { leave_one_out: true, ..plain }), Direct::H1, &[9, 90]),
    ])
}

fn rational() -> Value {
    let [both, without, one, two_commands, _] = all_ports();
    let sharp = arms(3, 256, 0.01, 0.1);
    let set = |settings: LocalRational| SpectralMethod::LocalRational(settings);
    let plain = LocalRational::default();
    json!([
        run(&sharp, &both, &set(plain), Direct::H1, &[0, 1, 22, 24, 26, usize::MAX]),
        run(&sharp[..1], &one, &set(plain), Direct::H1, &[2, 21, 22, 23, 24, 25, 26, 27, 28, 29, 127]),
        run(&sharp[..1], &one, &set(LocalRational { denominator: 2, ..plain }), Direct::H1, &[22, 23, 24, 25, 26, 27, 28]),
        run(&sharp[1..], &without, &set(LocalRational { denominator: 2, ..plain }), Direct::H1, &[22, 24, 25, 27]),
        run(&sharp[..2], &two_commands, &set(LocalRational { order: 1, half_width: Some(8), ..plain }), Direct::H1, &[22, 25, 28, 127]),
        run(&sharp[..1], &without, &set(LocalRational { order: 3, ..plain }), Direct::H1, &[24]),
    ])
}

/// Lines up to just below the highest, every fourth odd one left out, and one even one driven. Both axes have the same at 15.
fn lines() -> Vec<usize> {
    (1..32).filter(|line| (line % 2 == 1 && line % 8 != 5) || *line == 12).collect()
}

fn periodic_arm(trial: usize, periods: usize, cubic: f64, square: f64) -> Recording {
    let command = [0, 1].map(|i| {
        let one = |k: usize| {
            lines().iter().map(|&l| (TAU * (l * k % 64) as f64 / 64.0 + 9.0 * noise(l, (trial + if l == 15 { 0 } else { 50 * i }) as f64)).cos()).sum::<f64>()
        };
        (0..64 * (periods + 1)).map(|k| one(k % 64)).collect::<Vec<f64>>()
    });
    arm_with([&command[0], &command[1]], 0.3, |x| -cubic * x.powi(3) - square * x * x, |k, i| 0.3 * noise(k, (100 + 10 * trial + i) as f64))
}

/// The lines that count as driven of equal ones near what noise alone may give, or, of no size, of ever smaller ones up to Nyquist.
fn driven(trials: usize, periods: usize, size: f64) -> Value {
    let amplitude = |line: usize| if size > 0.0 { size } else { 10.0 / 1.2_f64.powi(line as i32) + if line == 32 { 9.0 } else { 0.0 } };
    let trial = |trial: usize| {
        let of = |k: usize| (1..33).map(|l| amplitude(l) * (TAU * (l * k % 64) as f64 / 64.0 + 9.0 * noise(l, trial as f64)).cos()).sum::<f64>();
        let force: Vec<f64> = (0..64 * (periods + 1)).map(|k| of(k % 64) + if size > 0.0 { 6.0 } else { 1e-3 } * noise(k, 200.0 + trial as f64)).collect();
        let pos = force.iter().enumerate().map(|(k, f)| 0.5 * f + 0.1 * noise(k, 300.0 + trial as f64)).collect();
        recording(vec![("force", force), ("pos", pos)])
    };
    let trials: Vec<Recording> = (0..trials).map(trial).collect();
    let (trials, ports) = (trials.iter().collect::<Vec<_>>(), Ports { references: vec![], inputs: vec![0], outputs: vec![1] });
    let method = SpectralMethod::Periodic(Periodic { period: 64, discard: 1 });
    match estimate(&trials, &ports, &Labels::of(trials[0], &ports), &method, Direct::H1) {
        Ok(found) => json!(found.direct.response.frequency_hz),
        Err(error) => json!(error.to_string()),
    }
}

fn periods() -> Value {
    let [both, without, one, two_commands, few] = all_ports();
    let trials: Vec<Recording> = (0..5).map(|trial| periodic_arm(trial, 4, 1e-2, 3e-2)).collect();
    let clean: Vec<Recording> = (0..4).map(|trial| periodic_arm(trial, 2 + trial, 0.0, 0.0)).collect();
    let method = SpectralMethod::Periodic(Periodic { period: 64, discard: 1 });
    let at = [0, 2, 6, 7, usize::MAX];
    let thresholds = [(1, 3, 3.5), (3, 2, 3.0), (3, 4, 1.2), (1, 4, 0.0)].map(|(trials, periods, size)| driven(trials, periods, size));
    json!([
        run(&trials, &both, &method, Direct::H1, &at),
        run(&trials, &without, &method, Direct::H1, &at),
        run(&clean, &one, &method, Direct::H1, &at),
        run(&clean[..2], &both, &method, Direct::H1, &[3]),
        run(&clean[..1], &one, &method, Direct::H1, &[3]),
        run(&clean[..2], &one, &method, Direct::H1, &[3]),
        run(&clean[1..], &two_commands, &method, Direct::H1, &[3]),
        run(&trials, &few, &method, Direct::H1, &[3]),
        run(&trials[..1], &without, &method, Direct::H1, &[3]),
        run(&arms(2, 320, 0.3, 0.0), &one, &method, Direct::H1, &[3]),
        thresholds,
    ])
}

fn robust() -> Value {
    let [both, without, one, _, _] = all_ports();
    let knocked = |at: &[(usize, usize, &str, f64)]| -> Vec<Recording> {
        let mut trials = arms(3, 330, 0.1, 0.5);
        for &(trial, sample, name, size) in at {
            let mut k = 0;
            let knock = |v: f64| {
                k += 1;
                if (sample..sample + 6).contains(&k) { v + size } else { v }
            };
            trials[trial].map_channel(name, knock).expect("channel");
        }
        trials.into_iter().map(|trial| trial.starting_at(2.5)).collect()
    };
    let cases = [
        (&both, knocked(&[(0, 100, "pos_x", 9.0), (2, 200, "force_y", 20.0)]), Welch::new(32)),
        (&without, knocked(&[(1, 60, "force_x", 60.0), (1, 290, "pos_x", 9.0)]), Welch { noverlap: 24, ..Welch::new(48) }),
        (&one, knocked(&[(2, 10, "cmd_x", 40.0)]), Welch::new(32)),
        (&one, knocked(&[]), Welch::new(64)),
        (&both, knocked(&[(0, 100, "pos_x", 9.0)]), Welch::new(200)),
    ];
    let found = cases.iter().map(|(ports, trials, welch)| {
        let trials: Vec<&Recording> = trials.iter().collect();
        let (spectra, rejected) = robust_spectra(&trials, ports, welch).expect("spectra");
        let averages = (spectra.segments(), spectra.effective_averages());
        let powers: Vec<f64> = (0..6).map(|channel| spectra.power(3, channel)).collect();
        json!({ "rejected": rejected, "averages": averages, "powers": powers })
    });
    found.collect()
}

fn choices() -> Value {
    const NAMES: [&str; 4] = ["cmd_x", "cmd_y", "pos_x", "force_x"];
    let random = |n: usize| recording((0..4).map(|c| (NAMES[c], (0..n).map(|k| noise(k, c as f64)).collect())).collect());
    let ports = |references: usize| Ports { references: (0..references).collect(), inputs: vec![3], outputs: vec![2] };
    let periodic = |n: usize, size: f64| {
        let channel = |c: usize| (0..n).map(|k| noise(k % 50, c as f64) + size * noise(k, 30.0)).collect();
        recording((0..4).map(|c| (NAMES[c], channel(c))).collect())
    };
    let said = |recording: &Recording, count: usize, references: usize| {
        let found = choose_method(&vec![recording; count], &ports(references));
        json!([found.method, found.reason])
    };
    let mut found: Vec<Value> =
        [(16, 2, 1), (17, 2, 1), (24, 1, 1), (25, 1, 1), (100, 2, 4), (100, 1, 4), (100, 2, 3), (100, 3, 1), (100, 2, 6), (3, 1, 0), (1, 1, 1), (0, 1, 1)]
            .iter()
            .map(|&(n, count, references)| said(&random(n), count, references))
            .collect();
    found.extend(
        [(149, 0.0, 1, 1), (150, 0.0, 1, 1), (260, 0.0, 1, 2), (260, 0.0, 2, 2), (260, 0.1, 1, 1), (260, 1e-3, 1, 0)]
            .iter()
            .map(|&(n, size, count, references)| said(&periodic(n, size), count, references)),
    );
    let long = |n: usize| recording((0..4).map(|c| (NAMES[c], if c == 3 { (0..n).map(|k| k as f64).collect() } else { vec![0.0; n] })).collect());
    found.extend([(1 << 19, 1), ((1 << 19) + 1, 1), (600_000, 3)].map(|(n, count)| said(&long(n), count, 0)));
    found.push(json!(choose_method(&[], &ports(1)).reason));
    json!(found)
}

fn numbered(spectra: &CrossSpectra, ports: &Ports) -> (ndof_sysid::DirectEstimate, ndof_sysid::DerivedEstimate) {
    let labels = Labels::numbered(ports, ResponseKind::Compliance);
    (direct(spectra, ports, &labels, Direct::H1).expect("direct"), derived(spectra, ports, &labels).expect("derived"))
}

/// Tests between estimates, sets and resampling.
fn tests() -> Value {
    let [both, _, one, two_commands, _] = all_ports();
    let method = Welch::new(32);
    let trials: Vec<CrossSpectra> =
        arms(5, 200, 0.2, 0.06).iter().map(|trial| method.spectra(RATE_HZ, &trial.columns(&[0, 1, 2, 3, 4, 5])).expect("spectra")).collect();
    let pooled = CrossSpectra::pool(&trials).expect("alike");
    let of = |ports: &Ports| {
        let (one, other) = numbered(&pooled, ports);
        let bands = [(0.0, 40.0), (4.0, 12.0), (6.0, 6.0), (6.1, 6.2)].map(|(low, high)| hausman(&one, &other, low, high));
        let row: Vec<Complex64> = (0..ports.inputs.len()).map(|j| other.response.value[[3, 0, j]]).collect();
        let sets: Vec<Vec<f64>> = [0.5, 0.95]
            .iter()
            .map(|&level| {
                // The step, in thousandths of the gain, at which the row leaves the set.
                let leaves = |f: usize| {
                    let row = |step: f64| -> Vec<Complex64> { (0..row.len()).map(|j| other.response.value[[f, 0, j]] * (1.0 + 0.001 * step)).collect() };
                    (0..200).map(f64::from).find(|&step| anderson_rubin(&pooled, ports, f, 0, &row(step), level) == Some(false)).unwrap_or(-1.0)
                };
                [2, 5, 9].map(leaves).to_vec()
            })
            .collect();
        json!({ "hausman": bands, "anderson and rubin": sets, "of another size": anderson_rubin(&pooled, ports, 3, 0, &[], 0.9) })
    };
    let estimate = |ports: Ports| move |s: &CrossSpectra| derived(s, &ports, &Labels::numbered(&ports, ResponseKind::Compliance)).ok().map(|d| d.response);
    let resampled = [(5, 7), (2, 3), (5, 1), (1, 5), (0, 3)].map(|(blocks, draws)| {
        bootstrap_std(&trials[..blocks], draws, 5, estimate(both.clone())).map(|std| (1..17).step_by(5).map(|f| std[[f, 1, 0]]).collect::<Vec<f64>>())
    });
    let singles: Vec<FrequencyResponse> = trials.iter().map(|s| numbered(s, &one).0.response).collect();
    let spreads = [(0.0, 40.0), (3.0, 12.0), (50.0, 60.0)]
        .map(|(low, high)| spread(&singles, low, high).map(|s| json!([s.ratio, s.ratio_std_error, s.between[[4, 0, 0]], s.within[[4, 0, 0]]])));
    let narrower: Vec<FrequencyResponse> = vec![singles[0].clone(), singles[1].band(0.0, 20.0)];
    let judged = [&both, &one, &two_commands].map(of);
    json!([judged, resampled, spreads, spread(&narrower, 0.0, 40.0), spread(&singles[..2], 0.0, 40.0).map(|s| s.ratio_std_error)])
}

/// Intervals, plans and other views of a response.
fn views() -> Value {
    let [both, ..] = all_ports();
    let spectra = Welch::new(64).spectra(RATE_HZ, &arm(1, 900, 0.05, 0.6).columns(&[0, 1, 2, 3, 4, 5])).expect("spectra");
    let (direct, derived) = numbered(&spectra, &both);
    let inverse = derived.response.inverse().expect("square");
    let at = [3, 11, 13, 25];
    let intervals = |response: &FrequencyResponse, i: usize, j: usize, level: f64| {
        let all = response.gain_phase(i, j, level);
        at.map(|f| all[f])
    };
    let kinds = [ResponseKind::Admittance, ResponseKind::Impedance, ResponseKind::DynamicStiffness].map(|kind| {
        let to = derived.response.to_kind(kind).expect("a meaning");
        let back = to.to_kind(ResponseKind::Compliance).expect("a meaning");
        json!([to.kind, to.value[[7, 1, 0]].re, to.value[[7, 1, 0]].im, to.variance(7, 1, 0), back.value[[7, 0, 1]].re, back.variance(7, 0, 1)])
    });
    let steps = Confidence::new(0.9, 6.0);
    let bends: Vec<Value> = (0..36)
        .map(|k| {
            let bend = Complex64::from_polar(0.3 * (k / 12) as f64, 0.55 * (k % 12) as f64);
            json!(steps.gain_phase_of_inverse(Complex64::new(0.8, -0.5), 0.9 * nudge(k), bend))
        })
        .collect();
    let plans: Vec<f64> = [(0.9, 2, 0.1, 0.95), (0.3, 1, 0.5, 0.5), (0.999, 6, 0.9, 0.99)]
        .iter()
        .map(|&(c, q, width, level)| averages_for_interval(c, q, width, level))
        .collect();
    let judged: Vec<Value> = [(0.3, 1.0, true, 20.0), (0.3, 0.5, true, 20.0), (0.6, 0.9, false, 12.0), (0.2, 0.0, false, 6.0)]
        .iter()
        .map(|&(relative_half_width, share, diagonal_only, high_hz)| {
            json!(StoppingRule { relative_half_width, level: 0.9, low_hz: 3.0, high_hz, share, diagonal_only }.judge(&direct.response))
        })
        .collect();
    let step = conditioned(&spectra, 9, &[3, 2], &[4, 5]).expect("regular");
    let ordered = ordered_coherence(&direct.response, &direct.response.uncertainty.as_ref().expect("noise").input_inverse, &direct.coherence.multiple);
    let corrected = (
        direct.coherence.multiple_corrected(direct.effective_averages, 2)[[9, 0]],
        direct.coherence.partial_corrected(direct.effective_averages, 2)[[9, 0, 1]],
        direct.coherence.multiple_corrected(3.0, 2)[[9, 0]],
    );
    let row: Vec<Complex64> = (0..2).map(|j| direct.response.value[[9, 1, j]]).collect();
    let reach = |level: f64| (0..400).find(|&k| direct.response.row_is_inside(9, 1, &[row[0] * (1.0 + 0.01 * f64::from(k)), row[1]], level) == Some(false));
    let long = Welch::new(64).spectra(RATE_HZ, &arm(1, 20_000, 0.04, 0.0).columns(&[0, 1, 2, 3, 4, 5])).expect("spectra");
    let (sharp, _) = numbered(&long, &both);
    let band = direct.response.band(5.0, 9.5);
    let cut = [unresolved(&sharp.response.band(3.0, 30.0), 0.02, 5.0, 20.0), unresolved(&sharp.response.band(9.0, 9.0), 0.02, 0.0, 40.0)];
    let missed =
        [(0.05, 0.0, 40.0), (0.02, 0.0, 40.0), (0.02, 9.5, 40.0), (0.02, 0.0, 8.9)].map(|(share, low, high)| unresolved(&sharp.response, share, low, high));
    json!({
        "intervals": [intervals(&direct.response, 0, 1, 0.95), intervals(&derived.response, 1, 1, 0.5), intervals(&inverse, 0, 0, 0.9), intervals(&inverse, 1, 0, 0.6)],
        "kinds": kinds,
        "bends": bends,
        "plans": plans,
        "judged": judged,
        "invertibility": at.map(|f| direct.response.invertibility()[f]),
        "conditioned": json!([step.partial_coherence, step.l_systems, step.residual, step.response(), step.multiple_coherence()]),
        "ordered": at.map(|f| [ordered[[f, 0, 0]], ordered[[f, 1, 1]]]),
        "corrected": corrected,
        "reach": [reach(0.5), reach(0.95)],
        "unresolved": missed,
        "unresolved, of a part": cut,
        "band": (band.frequency_hz.clone(), band.variance(1, 1, 0)),
        "of the paper": paper_random_error(0.3, 12),
    })
}

/// What is refused, and what of it is only warned of.
fn refusals() -> Value {
    let [both, _, one, _, _] = all_ports();
    let trial = arm(1, 200, 0.2, 0.3);
    let edited = |name: &str, f: &dyn Fn(usize, f64) -> f64| {
        let (mut other, mut k) = (trial.clone(), 0);
        let each = |v: f64| {
            k += 1;
            f(k - 1, v)
        };
        other.map_channel(name, each).expect("channel");
        other
    };
    let methods = [
        SpectralMethod::Welch(Welch::new(32)),
        SpectralMethod::LocalPolynomial(LocalPolynomial::default()),
        SpectralMethod::LocalRational(LocalRational { denominator: 2, ..LocalRational::default() }),
        SpectralMethod::Periodic(Periodic { period: 40, discard: 1 }),
    ];
    let mut found = Vec::new();
    for (name, size) in
        [("cmd_x", 1e-70), ("force_x", 1e-70), ("pos_x", 1e-70), ("force_x", 1e-59), ("force_x", 1e59), ("pos_x", 1e70), ("pos_x", 0.0), ("force_x", 0.0)]
    {
        found.push(run(&[edited(name, &|_, v| v * size)], &one, &methods[0], Direct::H1, &[]));
    }
    for shift in [1e3, 1e16, 1e80] {
        found.push(run(&[edited("force_x", &|_, v| v + shift)], &one, &methods[1], Direct::H1, &[]));
    }
    let copied = |share: f64| {
        let x = trial.channels()[2].samples.clone();
        edited("force_y", &|k, v| 0.7 * x[k] + share * v)
    };
    for share in [0.0, 1e-7, 1e-3] {
        found.push(run(&[copied(share)], &both, &methods[0], Direct::H1, &[]));
        found.push(run(&[copied(share)], &both, &methods[1], Direct::H1, &[]));
    }
    for method in &methods {
        found.push(run(&[edited("pos_x", &|k, v| if k == 17 { f64::NAN } else { v })], &one, method, Direct::H1, &[]));
        found.push(run(&[trial.slice(0..5).expect("five")], &one, method, Direct::H1, &[]));
        found.push(run(&[trial.slice(0..23).expect("some")], &one, method, Direct::H1, &[]));
        found.push(run(&[trial.clone(), recording(vec![("cmd_x", vec![1.0, 2.0, 4.0])])], &one, method, Direct::H1, &[]));
        found.push(run(&[trial.clone(), Recording::new(50.0, trial.channels().to_vec()).expect("equal lengths")], &one, method, Direct::H1, &[]));
    }
    let spectra = Welch::new(32).spectra(RATE_HZ, &trial.columns(&[0, 2, 4])).expect("spectra");
    for references in [vec![], vec![0, 1], vec![7]] {
        let ports = Ports { references, inputs: vec![1], outputs: vec![2] };
        let labels = Labels::numbered(&one, ResponseKind::Transfer);
        found.push(json!(estimate_from_spectra(spectra.clone(), &ports, &labels, &methods[0], Direct::H1).err().map(|error| error.to_string())));
    }
    let labels = Labels::of(&trial, &one);
    let windows = [(1.0, 0.5), (0.9, 0.0), (3.125, 1.0), (3.2, 1.0)].map(|(window_s, step_s)| {
        let course = sliding(&[&trial, &trial], &one, &labels, (&methods[0], Direct::H1), window_s, step_s);
        course
            .map(|all| json!([all.len(), all[all.len() - 1].0, all[0].1.direct.response.value[[4, 0, 0]].re]))
            .unwrap_or_else(|error| json!(error.to_string()))
    });
    json!([found, windows])
}

macro_rules! numbers {
    ($($name:ident: $found:expr;)*) => { $(
        #[test]
        fn $name() {
            held(&$found, concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/numbers/", stringify!($name), ".json"), RELATIVE, "NDOF_WRITE_NUMBERS");
        }
    )* };
}

numbers! {
    of_welch: welch();
    of_other_spectra: others();
    of_polynomials: polynomial();
    of_rationals: rational();
    of_periods: periods();
    of_robust_spectra: robust();
    of_choices: choices();
    of_tests: tests();
    of_views: views();
    of_refusals: refusals();
}
