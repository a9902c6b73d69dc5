//! CSV as people and programs write it: a right answer, or an error that says what, where and what to do.

use ndof_io::{CsvStream, IoError, Place, ReadOptions, ReadRecording, Resample, encode, read, read_bytes};
use ndof_signal::{Channel, Quantity, Recording, Unit};
use std::path::Path;

fn csv(text: &str) -> Result<ReadRecording, IoError> {
    read_bytes(text.as_bytes(), "trial.csv", &ReadOptions::default())
}

fn error(text: &str) -> IoError {
    csv(text).expect_err(text)
}

fn samples(read: &ReadRecording, name: &str) -> Vec<f64> {
    read.recording.channel(name).expect(name).samples.clone()
}

#[test]
fn the_plain_file_is_read_with_its_units_and_metadata() {
    let read = csv("# sample_rate_hz: 500\n# subject: 7\nforce_x [kN],angle_e [deg],emg_1 [mV],note\n1,180,3,4\n-2.5e-1,0,5,6\n").unwrap();
    assert_eq!(read.recording.sample_rate_hz(), 500.0);
    assert_eq!(samples(&read, "force_x"), [1000.0, -250.0]);
    assert_eq!(samples(&read, "angle_e"), [180.0 * (std::f64::consts::PI / 180.0), 0.0]);
    assert_eq!(read.recording.channel("emg_1").unwrap().unit, Unit::other("mV"));
    assert_eq!(read.recording.metadata().get("subject").map(String::as_str), Some("7"));
    assert!(!read.recording.metadata().contains_key("sample_rate_hz"));
    let codes: Vec<_> = read.notes.iter().map(|n| n.code.as_str()).collect();
    assert_eq!(codes, ["unit-converted", "unit-converted", "unit-unknown"]);
}

/// A table saved with the numbers of its rows, as pandas does, and a log whose messages carry a name and a date.
#[test]
fn columns_without_a_name_and_columns_of_words_are_no_obstacle() {
    let indexed = csv(",time,force_x [N]\n0,0.0,1\n1,0.5,2\n2,1.0,4\n").unwrap();
    assert_eq!((samples(&indexed, "force_x"), indexed.recording.sample_rate_hz()), (vec![1.0, 2.0, 4.0], 2.0));
    assert_eq!(samples(&indexed, "column_1"), [0.0, 1.0, 2.0]);
    let words = csv("time,name,force_x [N],stamp\n0.0,\"['j1', 'j2']\",1,2026-11-28T12:00:00\n0.5,,2,2026-11-28T12:00:01\n1.0,arm,4,2026-11-28T12:00:02\n");
    let words = words.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((samples(&words, "force_x"), words.recording.channels().len()), (vec![1.0, 2.0, 4.0], 1));
    let note = words.notes.iter().find(|note| note.code == "words").expect("a note");
    assert!(note.message.contains("name, stamp"), "{}", note.message);
    // The same as it comes, be it shorter than what is looked at or longer.
    for count in [10, 300] {
        let text: String = (0..count).map(|k| format!("{},{:.1},arm,{}\n", k, 0.5 * f64::from(k), k * k % 7)).collect();
        let text = format!(",time,name,force_x [N]\n{text}");
        let mut stream = CsvStream::new("arm", ReadOptions::default());
        let mut pieces = Vec::new();
        for part in text.as_bytes().chunks(50) {
            pieces.extend(stream.push(part).unwrap_or_else(|error| panic!("{error}")));
        }
        pieces.extend(stream.finish().unwrap_or_else(|error| panic!("{error}")));
        let streamed: Vec<f64> = pieces.iter().flat_map(|piece| piece.recording.channel("force_x").expect("a force").samples.clone()).collect();
        assert_eq!(streamed, samples(&csv(&text).unwrap(), "force_x"), "{count}");
    }
    // A column of numbers with a word in it is damaged.
    assert!(matches!(error("time,force_x [N]\n0.0,1\n0.5,off\n1.0,4\n"), IoError::NotANumber { .. }));
}

#[test]
fn separators_line_ends_bom_quotes_and_blank_lines_change_nothing() {
    let plain = csv("# sample_rate_hz: 10\nforce_x [N],pos_x [m]\n1.5,2\n-3,4.25\n").unwrap().recording;
    for text in [
        "\u{feff}# sample_rate_hz: 10\r\nforce_x [N],pos_x [m]\r\n1.5,2\r\n-3,4.25\r\n",
        "# sample_rate_hz: 10\nforce_x [N]\tpos_x [m]\n1.5\t2\n-3\t4.25\n",
        "# sample_rate_hz: 10;;\nforce_x [N];pos_x [m]\n1,5;2\n-3;4,25\n",
        "# sample_rate_hz: 10\nforce_x [N]\tpos_x [m]\n1,5\t2\n-3\t4,25\n",
        "# sample_rate_hz: 10\n  force_x [N]   pos_x [m]\n 1.5  2\n -3   4.25\n",
        "# sample_rate_hz: 10\n\n\"force_x [N]\", \"pos_x [m]\",\n\n1.5,2,\n# in between\n\"-3\",4.25,\n\n,,\n",
        "# sample_rate_hz: 10\rforce_x [N],pos_x [m]\r1.5,2\r-3,4.25\r",
    ] {
        assert_eq!(csv(text).expect(text).recording, plain, "{text:?}");
    }
}

#[test]
fn a_time_column_gives_rate_and_start() {
    let read = csv("t [ms],force_x [N]\n100,1\n102,2\n104,3\n").unwrap();
    assert_eq!((read.recording.sample_rate_hz(), read.recording.start_s()), (500.0, 0.1));
    for name in ["time", "Time_s", "t_s"] {
        let read = csv(&format!("{name},force_x [N]\n0,1\n0.004,2\n0.008,3\n")).unwrap();
        assert_eq!((read.recording.sample_rate_hz(), read.recording.channels().len()), (250.0, 1), "{name}");
    }
    assert!(matches!(error("t [N],force_x [N]\n0,1\n1,2\n"), IoError::TimeUnit { .. }));
}

/// In whatever language: its unit says what it is. A time that does not grow is a channel, and where two are of time neither is chosen.
#[test]
fn the_only_column_of_time_that_grows_is_the_time() {
    let read = csv("Zeit [ms],force_x [N]\n0,1\n4,2\n8,3\n").unwrap();
    assert_eq!((read.recording.sample_rate_hz(), read.recording.names()), (250.0, vec!["force_x".to_owned()]));
    for wrong in ["delay [ms],force_x [N]\n4,1\n4,2\n3,3\n", "Zeit [ms],age [s],force_x [N]\n0,1,1\n4,2,2\n8,3,3\n"] {
        assert!(matches!(error(wrong), IoError::NoSampleRate { .. }), "{wrong}");
    }
    assert!(error("Zeit [ms]\n0\n4\n8\n").to_string().contains("no channel in it besides the time"));
    // Where two are, or none has a unit, the caller says which.
    let given =
        |name: &str, unit: &str| ReadOptions { time: Some(name.to_owned()), units: [(name.to_owned(), unit.to_owned())].into(), ..ReadOptions::default() };
    let read = |text: &str, options: &ReadOptions| read_bytes(text.as_bytes(), "a.csv", options);
    let two = read("Zeit [ms],age [s],force_x [N]\n0,1,1\n4,2,2\n8,3,3\n", &given("Zeit", "ms")).unwrap().recording;
    assert_eq!((two.sample_rate_hz(), two.names().len()), (250.0, 2));
    assert_eq!(read("stamp,force_x [N]\n0,1\n4,2\n8,3\n", &given("stamp", "ms")).unwrap().recording.sample_rate_hz(), 250.0);
    assert!(matches!(read("stamp,force_x [N]\n0,1\n4,2\n8,3\n", &given("steps", "ms")), Err(IoError::NoChannel { .. })));
    assert!(matches!(read("t,stamp,force_x [N]\n0,0,1\n1,4,2\n", &given("stamp", "ms")), Err(IoError::DuplicateName { .. })));
}

#[test]
fn a_rate_that_is_no_number_is_not_taken_for_one() {
    let text = "# sample_rate_hz: unknown, 1 nominal\nforce_x,pos_x\n1,2\n3,4\n";
    let message = error(text).to_string();
    assert!(message.contains("--sample-rate") && message.contains("unknown, 1 nominal"), "{message}");
    let options = ReadOptions { sample_rate_hz: Some(1.0), ..Default::default() };
    let read = read_bytes(text.as_bytes(), "a.csv", &options).unwrap();
    assert_eq!(read.recording.sample_rate_hz(), 1.0);
    assert_eq!(read.recording.channel("force_x").unwrap().unit, Unit::si(Quantity::Effort, false));
    assert_eq!(read.notes[0].code, "unit-inferred");
}

#[test]
fn a_decimal_comma_between_commas_is_refused_with_the_remedy() {
    let message = error("# sample_rate_hz: 10\nforce_x,pos_x\n1,5,2,25\n2,5,3,25\n").to_string();
    assert!(message.contains("line 3") && message.contains("decimal sign"), "{message}");
    let message = error("# sample_rate_hz: 10\nforce_x\n1,5\n2,5\n").to_string();
    assert!(message.contains("decimal point"), "{message}");
    let message = error("# sample_rate_hz: 10\na;b\n1,5;2\n2,5;3.5\n").to_string();
    assert!(message.contains("line 4") && message.contains("line 3"), "{message}");
    let message = error("# sample_rate_hz: 10\na;b\n1.234,5;2\n").to_string();
    assert!(message.contains("thousands"), "{message}");
}

#[test]
fn what_is_wrong_is_named_with_its_place() {
    let rate = "# sample_rate_hz: 10\n";
    for (text, words) in [
        (String::new(), vec!["empty"]),
        ("\n\n# only: comments\n".to_owned(), vec!["empty"]),
        (format!("{rate}a,b\n"), vec!["line 2", "no samples"]),
        (format!("{rate}1,2\n3,4\n"), vec!["line 2", "channel names"]),
        (format!("{rate}a,b\n1,2\n3,x\n"), vec!["line 4", "\"b\"", "\"x\""]),
        (format!("{rate}a,b\n1,2\n3\n"), vec!["line 4", "1 cells", "2 columns"]),
        (format!("{rate}a,b\n1,2\n3,\n"), vec!["line 4", "\"b\"", "missing"]),
        (format!("{rate}a,b,c\n1,2,3\n3,4"), vec!["line 4", "middle of a line"]),
        (format!("{rate}a,b\n1,2\n,4\n"), vec!["line 4", "\"a\"", "missing"]),
        (format!("{rate}a,b\n1,2\n3,NaN\n5,nan\n"), vec!["line 4", "\"b\"", "2 of 3"]),
        (format!("{rate}a,b\n1,2\n,\n5,6\n"), vec!["line 4"]),
        (format!("{rate}a,a\n1,2\n"), vec!["two channels", "\"a\""]),
        (format!("{rate}a,\"b\n1,2\n"), vec!["line 2", "quotation mark"]),
        (format!("{rate}t,b\n1,2\n1,3\n"), vec!["line 4", "increase"]),
        ("t\n1\n2\n".to_owned(), vec!["no channel"]),
        ("a,b\n1,2\n3,4\n".to_owned(), vec!["--sample-rate"]),
        ("t,b\n1,2\n".to_owned(), vec!["1 sample"]),
        (format!("{rate}# samples: 3\na,b\n1,2\n3,4\n"), vec!["3 samples", "2 are there"]),
        ("# sample_rate_hz: -5\na\n1\n".to_owned(), vec!["-5", "positive"]),
    ] {
        let message = error(&text).to_string();
        assert!(message.contains("trial.csv"), "{text:?}: {message}");
        for word in words {
            assert!(message.contains(word), "{text:?}: {message}");
        }
        assert!(!error(&text).is_machine_failure());
    }
    let latin1 = read_bytes(b"# sample_rate_hz: 10\nangle [\xb0]\n1\n", "trial.csv", &ReadOptions::default()).unwrap_err();
    assert!(latin1.to_string().contains("line 2"), "{latin1}");
}

#[test]
fn irregular_time_names_line_and_step_and_can_be_repaired() {
    let mut text = String::from("t [s],force_x [N]\n");
    for k in (0..200).filter(|k| k % 10 != 7) {
        let t = 0.01 * k as f64;
        text.push_str(&format!("{t:.3},{}\n", 3.0 + 2.0 * t - t * t));
    }
    let found = error(&text);
    assert!(matches!(found, IoError::IrregularTime { place: Place::Line(9), count: 20, .. }), "{found}");
    let message = found.to_string();
    assert!(message.contains("0.02 s") && message.contains("0.01 s") && message.contains("--resample"), "{message}");
    let options = ReadOptions { resample: Some(Resample::Auto), ..Default::default() };
    let read = read_bytes(text.as_bytes(), "trial.csv", &options).unwrap();
    assert_eq!((read.recording.sample_rate_hz(), read.recording.len()), (100.0, 200));
    assert_eq!(read.notes[0].code, "resampled");
    for (k, f) in samples(&read, "force_x").iter().enumerate() {
        let t = 0.01 * k as f64;
        assert!((f - (3.0 + 2.0 * t - t * t)).abs() < 1e-12, "{k}: {f}");
    }
}

#[test]
fn a_blank_line_between_single_numbers_may_be_a_lost_sample() {
    assert!(error("# sample_rate_hz: 10\na\n1\n\n2\n").to_string().contains("line 4"));
    assert_eq!(samples(&csv("# sample_rate_hz: 10\n\na\n\n1\n2\n\n").unwrap(), "a"), [1.0, 2.0]);
}

#[test]
fn facts_are_read_as_people_write_them() {
    let read = csv("sep=;\n#sample_rate_hz:500 Hz;\n# see http://example.org\na;b\n1;2\n").unwrap();
    assert_eq!(read.recording.sample_rate_hz(), 500.0);
    assert!(read.recording.metadata().is_empty(), "{:?}", read.recording.metadata());
}

#[test]
fn rates_that_contradict_each_other_are_told() {
    let given = ReadOptions { sample_rate_hz: Some(1000.0), ..Default::default() };
    for text in ["# sample_rate_hz: 500\na [N]\n1\n2\n", "t,a [N]\n0,1\n0.002,2\n"] {
        let read = read_bytes(text.as_bytes(), "trial.csv", &given).unwrap();
        assert_eq!(read.recording.sample_rate_hz(), 500.0);
        assert_eq!(read.notes.iter().map(|n| n.code.as_str()).collect::<Vec<_>>(), ["sample-rate-conflict"], "{text:?}");
    }
    let read = csv("# sample_rate_hz: 400\nt,a [N]\n0,1\n0.002,2\n").unwrap();
    assert_eq!((read.recording.sample_rate_hz(), read.notes[0].code.as_str()), (500.0, "sample-rate-conflict"));
    // The stamps are rounded; the line has all digits.
    let read = csv("# sample_rate_hz: 333.3333\nt,a [N]\n0,1\n0.003000,2\n0.006000,3\n").unwrap();
    assert_eq!((read.recording.sample_rate_hz(), read.notes.len()), (333.3333, 0));
}

#[test]
fn a_regular_file_is_brought_to_the_rate_asked_for() {
    let options = ReadOptions { resample: Some(Resample::Hz(1000.0)), ..Default::default() };
    for text in ["# sample_rate_hz: 500\na\n0\n2\n4\n6\n", "t [ms],a\n0,0\n2,2\n4,4\n6,6\n"] {
        let read = read_bytes(text.as_bytes(), "trial.csv", &options).unwrap();
        assert_eq!(read.recording.sample_rate_hz(), 1000.0);
        assert_eq!(samples(&read, "a"), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "{text:?}");
        assert_eq!(read.notes[0].code, "resampled");
    }
}

#[test]
fn what_may_be_the_time_is_pointed_at() {
    assert!(error("timestamp,a\n0,1\n1,2\n").to_string().contains("if \"timestamp\" is the time, call it `t`"));
    assert!(error("t,a\n12:00:01,1\n12:00:02,2\n").to_string().contains("seconds since the beginning"));
    let options = ReadOptions { units: [("t".to_owned(), "ms".to_owned())].into(), ..Default::default() };
    let read = read_bytes(b"t,a\n0,1\n2,2\n", "trial.csv", &options).unwrap();
    assert_eq!(read.recording.sample_rate_hz(), 500.0);
}

#[test]
fn missing_samples_are_kept_only_where_allowed() {
    let options = ReadOptions { allow_nan: true, ..Default::default() };
    let read = read_bytes(b"# sample_rate_hz: 10\na,b\n1,2\n,n/a\n3,4\n", "trial.csv", &options).unwrap();
    assert!(samples(&read, "b")[1].is_nan());
    assert_eq!(read.missing.len(), 2);
    assert_eq!(read.missing[1].place, Place::Line(4));
    assert!(read.require_complete(Some(&["b"])).is_err());
    assert!(read.require_complete(Some(&[])).is_ok());
}

#[test]
fn a_last_line_without_an_end_is_left_out_and_told() {
    let read = csv("# sample_rate_hz: 10\na\n1\n2\n3").unwrap();
    assert_eq!(samples(&read, "a"), [1.0, 2.0]);
    assert_eq!(read.notes[0].code, "unterminated-line");
}

#[test]
fn a_unit_in_round_brackets_counts_and_one_from_the_caller_wins() {
    let read = csv("# sample_rate_hz: 10\npos_x (mm),emg (left)\n1000,1\n").unwrap();
    assert_eq!(samples(&read, "pos_x"), [1.0]);
    let options = ReadOptions { units: [("pos_x".to_owned(), "cm".to_owned())].into(), ..Default::default() };
    let read = read_bytes(b"# sample_rate_hz: 10\npos_x [mm]\n100\n", "a.csv", &options).unwrap();
    assert_eq!(samples(&read, "pos_x"), [1.0]);
    let options = ReadOptions { units: [("pos_y".to_owned(), "cm".to_owned())].into(), ..Default::default() };
    assert!(matches!(read_bytes(b"# sample_rate_hz: 10\npos_x [mm]\n100\n", "a.csv", &options), Err(IoError::NoChannel { .. })));
}

#[test]
fn what_is_written_is_read_back_bit_for_bit() {
    let values = vec![0.0, -0.0, 0.1, 1.0 / 3.0, 1e300, -5e-324, f64::MAX, f64::MIN_POSITIVE, 123456789.123, 1e-5, 9.999e-6, 1e16];
    let channel = |name: &str, unit: Unit| Channel::new(name, unit, values.clone());
    let newton = Unit::si(Quantity::Effort, false);
    let channels = vec![
        channel("force_x", newton.clone()),
        channel("pos_y", Unit::other("")),
        channel("emg, left", Unit::other("mV")),
        channel("a \"b\"", Unit::other("")),
        channel("#5", newton.clone()),
        channel("7", Unit::other("")),
        channel("x [mm]", Unit::other("")),
        channel("a(b", newton.clone()),
        channel("größe", Unit::si(Quantity::Velocity, true)),
    ];
    let metadata = [("arm".to_owned(), "left".to_owned()), ("remark".to_owned(), " two\nlines ".to_owned())].into();
    let recording = Recording::new(1000.0 / 3.0, channels).unwrap().starting_at(0.1).with_metadata(metadata);
    for file in ["a.csv", "a.tsv"] {
        let bytes = encode(&recording, file).unwrap();
        let back = read_bytes(&bytes, file, &ReadOptions::default()).unwrap().recording;
        assert_eq!(back, recording);
        for (a, b) in back.channels().iter().zip(recording.channels()) {
            assert!(a.samples.iter().zip(&b.samples).all(|(x, y)| x.to_bits() == y.to_bits()), "{}", a.name);
        }
    }
}

#[test]
fn what_would_not_come_back_is_not_written() {
    let one = |name: &str, unit: Unit| Recording::new(1.0, vec![Channel::new(name, unit, vec![1.0])]).unwrap();
    for recording in
        [one("t", Unit::other("")), one(" a", Unit::other("")), one("a", Unit::other("mm")), one("a\nb", Unit::other("")), one("a", Unit::other("["))]
    {
        assert!(matches!(encode(&recording, "a.csv"), Err(IoError::Unwritable { .. })), "{recording}");
    }
    assert!(matches!(encode(&Recording::new(1.0, vec![]).unwrap(), "a.csv"), Err(IoError::Unwritable { .. })));
    assert!(matches!(encode(&one("a", Unit::other("")), "a.xyz"), Err(IoError::UnknownSuffix { .. })));
}

#[test]
fn files_that_are_no_recordings_are_named_for_what_they_are() {
    for (bytes, word) in [(&b"\x1f\x8b\x08rest"[..], "gunzip"), (b"\xff\xfea\0", "UTF-8"), (b"\x93NUMPY\x01\0", "savez"), (b"ab\0\0cd", "binary")] {
        let message = read_bytes(bytes, "a.csv", &ReadOptions::default()).unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
    let message = read(Path::new("no-such-file.csv"), &ReadOptions::default()).unwrap_err();
    assert!(message.to_string().contains("no-such-file.csv") && !message.is_machine_failure(), "{message}");
}

#[test]
fn measured_recordings_of_others_are_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    if !folder.is_dir() {
        println!("skipped: no folder {}", folder.display());
        return;
    }
    for (file, given, rate, len) in
        [("emps/DATA_EMPS.csv", None, 1000.0, 24841), ("ankle/z_pf.csv", None, 1000.0, 60000), ("cd_player_arm/cd_player_arm.csv", Some(1.0), 1.0, 2048)]
    {
        let options = ReadOptions { sample_rate_hz: given, ..Default::default() };
        let recording = read(&folder.join(file), &options).expect(file).recording;
        assert_eq!(recording.sample_rate_hz(), rate, "{file}");
        assert_eq!(recording.len(), len, "{file}");
    }
}
