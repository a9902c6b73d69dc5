//! H1 and coherences against NumPy's algebra on SciPy's spectra (tests/reference, made by make_reference.py).

use ndof_signal::{Channel, Quantity, Recording, Unit, Welch};
use ndof_sysid::{Direct, Labels, Ports, SpectralMethod, estimate};
use serde_json::Value;
use std::path::Path;

/// Against another implementation (SciPy 1.17.1, NumPy 2.4.6).
const OTHER_IMPLEMENTATION: f64 = 1e-10;

fn read(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn number(value: &Value, path: &[usize]) -> f64 {
    path.iter().fold(value, |v, &i| &v[i]).as_f64().expect("a number")
}

#[test]
fn response_and_coherence_equal_those_of_scipy() {
    let csv = read("signals.csv");
    let rows: Vec<Vec<f64>> =
        csv.lines().filter(|l| !l.starts_with('#')).skip(1).map(|l| l.split(',').map(|v| v.parse().expect("a number")).collect()).collect();
    let channel = |c: usize, name: &str, quantity| Channel::new(name, Unit::si(quantity, false), rows.iter().map(|r| r[c]).collect());
    let names = [("force_x", Quantity::Effort), ("force_y", Quantity::Effort), ("pos_x", Quantity::Displacement), ("pos_y", Quantity::Displacement)];
    let recording = Recording::new(100.0, names.iter().enumerate().map(|(c, (n, q))| channel(c, n, *q)).collect()).expect("equal lengths");
    let ports = Ports { references: vec![], inputs: vec![0, 1], outputs: vec![2, 3] };
    let found = estimate(&[&recording], &ports, &Labels::of(&recording, &ports), &SpectralMethod::Welch(Welch::new(64)), Direct::H1).expect("estimate");
    let reference: Value = serde_json::from_str(&read("response.json")).expect("JSON");
    let direct = &found.direct;
    assert_eq!(direct.response.len(), 33);
    let agree = |what: &str, ours: f64, theirs: f64, f: usize| {
        assert!((ours - theirs).abs() <= OTHER_IMPLEMENTATION * theirs.abs().max(1.0), "{what} at bin {f}: {ours}, SciPy {theirs}");
    };
    for f in 1..33 {
        agree("input coherence", direct.input_coherence[[f, 0, 1]], number(&reference["coherence"]["between_inputs"], &[f]), f);
        for i in 0..2 {
            agree("multiple", direct.coherence.multiple[[f, i]], number(&reference["coherence"]["multiple"], &[i, f]), f);
            for j in 0..2 {
                let h = direct.response.value[[f, i, j]];
                agree("H1 re", h.re, number(&reference["h1"]["re"], &[i, j, f]), f);
                agree("H1 im", h.im, number(&reference["h1"]["im"], &[i, j, f]), f);
                agree("ordinary", direct.coherence.ordinary[[f, i, j]], number(&reference["coherence"]["ordinary"], &[i, j, f]), f);
                agree("partial", direct.coherence.partial[[f, i, j]], number(&reference["coherence"]["partial"], &[i, j, f]), f);
            }
        }
    }
    assert!(direct.response.value[[0, 0, 0]].re.is_nan(), "0 Hz says nothing after mean removal");
}
