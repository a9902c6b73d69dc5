//! Frequency responses come back from every format, and those of other programs are read.

use ndof_io::{IoError, ReadOptions, ResponseTable, encode_response, is_response, read_response, read_response_bytes};
use num_complex::Complex;
use proptest::prelude::*;
use std::path::PathBuf;

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/foreign").join(name)
}

fn response() -> impl Strategy<Value = ResponseTable> {
    (1usize..4, 1usize..4, 1usize..9, any::<bool>(), any::<bool>()).prop_flat_map(|(outputs, inputs, frequencies, std, coherence)| {
        let count = outputs * inputs * frequencies;
        let number = prop_oneof![-1e3f64..1e3, prop::num::f64::NORMAL];
        (prop::collection::vec((number.clone(), number), count), prop::collection::vec(0.0f64..1.0, count), prop::collection::vec(1e-3f64..10.0, frequencies))
            .prop_map(move |(values, shares, steps)| {
                let grid = |k: usize| (0..frequencies).map(move |f| k * frequencies + f);
                let split = |of: &dyn Fn(usize) -> f64| (0..outputs).map(|p| (0..inputs).map(|q| grid(p * inputs + q).map(of).collect()).collect()).collect();
                let frequency_hz = steps
                    .iter()
                    .scan(0.0, |f, step| {
                        *f += step;
                        Some(*f)
                    })
                    .collect();
                ResponseTable {
                    outputs: ["pos_x", "pos_y", "angle_elbow"][..outputs].iter().map(|&n| n.to_owned()).collect(),
                    inputs: ["force_x", "force_y", "torque_elbow"][..inputs].iter().map(|&n| n.to_owned()).collect(),
                    output_units: ["m", "m", "rad"][..outputs].iter().map(|&n| n.to_owned()).collect(),
                    input_units: ["N", "", "N m"][..inputs].iter().map(|&n| n.to_owned()).collect(),
                    frequency_hz,
                    values: (0..outputs)
                        .map(|p| (0..inputs).map(|q| grid(p * inputs + q).map(|k| Complex::new(values[k].0, values[k].1)).collect()).collect())
                        .collect(),
                    std: std.then(|| split(&|k| shares[k] * 0.1)),
                    coherence: coherence.then(|| split(&|k| shares[k])),
                    metadata: [("subject".to_owned(), "S 07".to_owned())].into(),
                }
            })
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_response_comes_back_bit_for_bit(response in response()) {
        for file in ["frf.csv", "frf.tsv", "frf.npz", "frf.uff"] {
            let (bytes, notes) = encode_response(&response, file).unwrap();
            prop_assert!(is_response(&bytes), "{}", file);
            let mut expected = response.clone();
            if file == "frf.uff" {
                prop_assert_eq!(!notes.is_empty(), response.std.is_some());
                expected.std = None;
            }
            if !file.ends_with("sv") {
                expected.metadata.clear();
            }
            let read = read_response_bytes(&bytes, file).unwrap();
            // One frequency is on an even grid, whose ASCII keeps 13 digits.
            if file == "frf.uff" && response.frequency_hz.len() == 1 && bytes.starts_with(b"    -1\n    58\n") {
                continue;
            }
            prop_assert_eq!(read, expected, "{}", file);
        }
        let n = response.outputs.len();
        let file = format!("frf.s{n}p");
        match encode_response(&response, &file) {
            Ok((bytes, _)) => {
                prop_assert_eq!(n, response.inputs.len());
                let read = read_response_bytes(&bytes, &file).unwrap();
                prop_assert_eq!((read.values, read.outputs, read.inputs), (response.values, response.outputs, response.inputs));
            }
            Err(IoError::Unwritable { .. }) => prop_assert_ne!(n, response.inputs.len()),
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        }
    }
}

/// Digits that ASCII has in Universal File 58: 12 behind the point.
const ASCII: f64 = 0.5e-12;

#[test]
fn universal_files_of_pyuff_are_read() {
    let expected = read_response(&path("frf_expected.csv")).unwrap();
    let (f, values) = (&expected.frequency_hz, &expected.values[0][0]);
    for (name, tolerance) in [("frf.uff", ASCII), ("frf_binary.uff", 0.0)] {
        let read = read_response(&path(name)).unwrap();
        assert_eq!((read.outputs[0].as_str(), read.inputs[0].as_str(), read.output_units[0].as_str(), read.input_units[0].as_str()), ("7_z", "2_-x", "m", "N"));
        assert_eq!(&read.frequency_hz, f, "{name}");
        for (k, value) in read.values[0][0].iter().enumerate() {
            let off = *value - values[k];
            assert!(off.re.abs() <= tolerance * 10.0 * values[k].re.abs() && off.im.abs() <= tolerance * 10.0 * values[k].im.abs(), "{name} {k}: {value}");
        }
        let coherence = &read.coherence.as_ref().unwrap()[0][0];
        assert!((coherence[0] - 0.5).abs() < 1e-6 && (coherence[39] - 1.0).abs() < 1e-6, "{name}: {coherence:?}");
    }
}

#[test]
fn an_even_grid_is_written_in_ascii() {
    let mut response = read_response(&path("frf.uff")).unwrap();
    response.output_units[0].clear();
    let (bytes, notes) = encode_response(&response, "again.uff").unwrap();
    assert!(bytes.starts_with(b"    -1\n    58\n") && bytes.is_ascii() && notes.is_empty());
    assert_eq!(read_response_bytes(&bytes, "again.uff").unwrap(), response, "as many digits as it has");
}

#[test]
fn gain_and_phase_and_other_frequencies_are_understood() {
    let of = |csv: &str| read_response_bytes(csv.as_bytes(), "frf.csv").unwrap();
    let parts = of("frequency_hz,re_x_f,im_x_f\n0.5,0,2\n1,-1,0\n");
    for csv in [
        "frequency_hz,gain_x_f,phase_deg_x_f\n0.5,2,90\n1,1,180\n",
        "frequency [Hz];gain_db_x_f;phase_rad_x_f\n0,5;6,020599913279624;1,5707963267948966\n1;0;-3,141592653589793\n",
        "omega_rad_s\tgain_x_f\tphase_x_f [deg]\n3.141592653589793\t2\t90\n6.283185307179586\t1\t-180\n",
    ] {
        let read = of(csv);
        assert_eq!(read.frequency_hz, parts.frequency_hz, "{csv}");
        for (a, b) in read.values[0][0].iter().zip(&parts.values[0][0]) {
            // A cosine of a right angle is an epsilon, not zero.
            assert!((a - b).norm() < 1e-14, "{csv}: {a} {b}");
        }
    }
    let alone = of("frequency_hz,re,im,coherence\n1,2,3,0.5\n");
    assert_eq!((alone.outputs[0].as_str(), alone.inputs[0].as_str(), alone.coherence.unwrap()[0][0][0]), ("y", "u", 0.5));
}

#[test]
fn touchstone_of_two_ports_goes_column_by_column() {
    let text = "! a network\n# MHz S MA R 50\n1 0.5 0 2 90 3 180 0.1 -90\n2 0.5 0 2 90 3 180 0.1 -90 ! end\n";
    let read = read_response_bytes(text.as_bytes(), "net.s2p").unwrap();
    assert_eq!(read.frequency_hz, [1e6, 2e6]);
    let close = |a: Complex<f64>, re: f64, im: f64| (a - Complex::new(re, im)).norm() < 1e-14;
    assert!(close(read.values[1][0][0], 0.0, 2.0) && close(read.values[0][1][0], -3.0, 0.0) && close(read.values[1][1][1], 0.0, -0.1));
}

#[test]
fn what_is_no_response_is_told() {
    let error = |csv: &str| read_response_bytes(csv.as_bytes(), "frf.csv").unwrap_err().to_string();
    assert!(error("frequency_hz,re_x_f\n1,2\n").contains("im_x_f"));
    assert!(error("frequency_hz,re_a_b_c,im_a_b_c\n1,2,3\n").contains("# outputs:"));
    assert!(error("frequency_hz,re_x_f,im_x_f\n2,2,3\n1,2,3\n").contains("increase"));
    assert!(error("t,force_x\n0,1\n1,2\n").contains("frequency_hz"));
    assert!(!is_response(b"t,force_x\n0,1\n") && is_response(b"frequency_hz,gain_x_f,phase_deg_x_f\n1,2,3\n"));
    let recording = ndof_io::read_bytes(b"frequency_hz,re_x_f,im_x_f\n1,2,3\n2,2,3\n", "frf.csv", &ReadOptions::default()).unwrap_err().to_string();
    assert!(recording.contains("frequency response"), "{recording}");
}
