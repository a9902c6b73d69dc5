//! Whatever is written is read back bit for bit, or is not written at all.

use ndof_io::{Format, IoError, ReadOptions, encode, formats, read_bytes};
use ndof_signal::{Channel, Quantity, Recording, Unit};
use proptest::prelude::*;

fn writable() -> impl Iterator<Item = (&'static Format, String)> {
    formats().iter().filter(|f| f.writes && f.built_in).flat_map(|f| f.suffixes.iter().map(move |s| (f, format!("trial.{s}"))))
}

fn unit() -> impl Strategy<Value = Unit> {
    let si = prop::sample::select(vec![Quantity::Displacement, Quantity::Velocity, Quantity::Acceleration, Quantity::Effort, Quantity::Time]);
    prop_oneof![
        4 => (si, any::<bool>()).prop_map(|(quantity, rotational)| Unit::si(quantity, rotational)),
        1 => Just(Unit::other("")),
        1 => "[a-zA-Z%/^\\[\\](),;# ]{0,6}".prop_map(|symbol| Unit::other(&symbol)),
    ]
}

fn name() -> impl Strategy<Value = String> {
    prop_oneof![
        3 => "(pos|angle|vel|acc|force|torque|cmd|emg)_[a-z0-9]{1,4}",
        1 => "[a-zäµ0-9#\"',;:\\[\\]()./\\\\ \t\n_+-]{0,8}",
    ]
}

fn sample() -> impl Strategy<Value = f64> {
    use prop::num::f64::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    prop_oneof![NORMAL | SUBNORMAL | ZERO | POSITIVE | NEGATIVE, -1000.0..1000.0, (-1000i32..1000).prop_map(f64::from)]
}

fn recording() -> impl Strategy<Value = Recording> {
    (1usize..5, 1usize..20).prop_flat_map(|(channels, samples)| {
        let channel = (name(), unit(), prop::collection::vec(sample(), samples));
        let metadata = prop::collection::btree_map("[a-z][a-z0-9_ ]{0,6}", "[ -~\n\r\t\0ä\"\\\\]{0,12}", 0..3);
        (prop::collection::vec(channel, channels), 1e-3..1e5, prop_oneof![Just(0.0), -1e3..1e3], metadata).prop_filter_map(
            "names differ",
            |(channels, rate_hz, start_s, metadata)| {
                let channels = channels.into_iter().map(|(name, unit, samples)| Channel::new(name, unit, samples)).collect();
                Recording::new(rate_hz, channels).ok().map(|r| r.starting_at(start_s).with_metadata(metadata))
            },
        )
    })
}

/// Facts that every format keeps in fields of their own, and that a caller's metadata cannot override.
fn without_reserved(recording: Recording) -> Recording {
    let mut metadata = recording.metadata().clone();
    ["sample_rate_hz", "start_s", "samples"].iter().for_each(|key| {
        metadata.remove(*key);
    });
    recording.with_metadata(metadata)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_recording_comes_back_from_every_format(recording in recording()) {
        let recording = without_reserved(recording);
        for (format, file) in writable() {
            let bytes = match encode(&recording, &file) {
                Ok(bytes) => bytes,
                Err(error) => {
                    prop_assert!(matches!(error, IoError::Unwritable { .. }), "{}: {error}", format.name);
                    continue;
                }
            };
            let back = read_bytes(&bytes, &file, &ReadOptions::default()).map_err(|e| TestCaseError::fail(format!("{}: {e}", format.name)))?.recording;
            prop_assert_eq!(&back, &recording, "{}", format.name);
            for (a, b) in back.channels().iter().zip(recording.channels()) {
                prop_assert!(a.samples.iter().zip(&b.samples).all(|(x, y)| x.to_bits() == y.to_bits()), "{}: {}", format.name, a.name);
            }
        }
    }
}

#[test]
fn ordinary_recordings_are_always_written() {
    let newton = Unit::si(Quantity::Effort, false);
    let recording = Recording::new(500.0, vec![Channel::new("force_x", newton, vec![1.0, 2.0])]).expect("valid");
    for (format, file) in writable() {
        assert!(encode(&recording, &file).is_ok(), "{}", format.name);
    }
}

/// Found by fuzzing: a text of a MAT file may hold a zero byte, which made a CSV of it binary.
#[test]
fn a_zero_byte_in_a_note_is_written_as_text() {
    let metadata = [("posture".to_owned(), "\0left\u{1}\0".to_owned())].into();
    let recording =
        Recording::new(200.0, vec![Channel::new("pos_x", Unit::si(Quantity::Displacement, false), vec![1.0, 2.0])]).unwrap().with_metadata(metadata);
    let bytes = encode(&recording, "a.csv").unwrap();
    assert!(!bytes.contains(&0));
    assert_eq!(read_bytes(&bytes, "a.csv", &ReadOptions::default()).unwrap().recording, recording);
}
