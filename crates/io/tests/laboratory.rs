//! Files as laboratories have them, which no library writes: logs without a header, names with indices.

use ndof_io::{ColumnsFile, IoError, ReadOptions, read_bytes};
use std::fmt::Write;
use std::path::Path;

fn inmotion() -> ColumnsFile {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/channels/inmotion.toml");
    ColumnsFile::parse(&std::fs::read_to_string(path).expect("the example"), "inmotion.toml").expect("the example is right")
}

/// Row k of the robot's log: column c holds 100 k + c.
fn log(rows: std::ops::Range<usize>) -> String {
    rows.fold(String::new(), |mut text, k| {
        (1..=38).for_each(|c| write!(text, " {}", 100 * k + c).expect("text"));
        text + "\n"
    })
}

#[test]
fn the_log_of_an_ankle_robot_is_read_by_its_columns() {
    let options = ReadOptions { columns: Some(inmotion()), ..Default::default() };
    let cut = log(0..1);
    let text = format!("{}{}", &cut[cut.len() / 2..], log(1..401));
    let read = read_bytes(text.as_bytes(), "stoch.1.asc", &options).unwrap();
    assert_eq!((read.recording.sample_rate_hz(), read.recording.len()), (200.0, 400));
    for (name, column, unit) in [("angle_ie", 2, "rad"), ("angle_dp", 3, "rad"), ("torque_ie", 8, "N m"), ("torque_dp", 9, "N m"), ("right_voltage", 29, "V")] {
        let channel = read.recording.channel(name).unwrap();
        assert_eq!((channel.samples[0], channel.samples[399], channel.unit.symbol()), ((100 + column) as f64, (40_000 + column) as f64, unit), "{name}");
    }
    assert!(read.notes.iter().any(|n| n.code == "partial-lines" && n.message.contains("line 2") && n.message.contains("(line 1)")), "{:?}", read.notes);
    let error = read_bytes(format!("{text}1 2\n{}", log(0..1)).as_bytes(), "stoch.1.asc", &options).unwrap_err().to_string();
    assert!(error.contains("line 402"), "{error}");
    assert!(["", "words only\n"].iter().all(|text| read_bytes(text.as_bytes(), "stoch.1.asc", &options).is_err()));
    let error = read_bytes(text.as_bytes(), "stoch.1.asc", &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, IoError::NoHeader { .. }) && error.to_string().contains("--columns"), "{error}");
}

#[test]
fn columns_by_number_are_for_text_without_names() {
    let options = ReadOptions { columns: Some(inmotion()), ..Default::default() };
    let error = read_bytes(b"PK\x03\x04", "trial.npz", &options).unwrap_err().to_string();
    assert!(error.contains("leave --columns out"), "{error}");
    // The line of names is not as wide as a log's, and is left out as any other.
    let error = read_bytes(b"a,b\n1,2\n3,4\n", "trial.csv", &options).unwrap_err().to_string();
    assert!(error.contains("a line has 2"), "{error}");
}

#[test]
fn an_index_in_brackets_is_no_unit() {
    // As libfranka's examples write their log.
    let header = "time [s],q[0],q[1],tau_J[0],tau_J[1],O_T_EE[12],dq[0] [rad/s]\n";
    let text = format!("{header}0,1,2,3,4,5,6\n0.001,2,3,4,5,6,7\n0.002,2,3,4,5,6,7\n");
    let read = read_bytes(text.as_bytes(), "franka.csv", &ReadOptions::default()).unwrap();
    assert_eq!(read.recording.names(), ["q_0", "q_1", "tau_J_0", "tau_J_1", "O_T_EE_12", "dq_0"]);
    assert_eq!((read.recording.channel("dq_0").unwrap().unit.symbol(), read.recording.sample_rate_hz()), ("rad/s", 1000.0));
    let options = ReadOptions { units: [("tau_J_0".to_owned(), "N m".to_owned())].into(), ..Default::default() };
    assert_eq!(read_bytes(text.as_bytes(), "franka.csv", &options).unwrap().recording.channel("tau_J_0").unwrap().unit.symbol(), "N m");
}

#[test]
fn the_book_has_a_row_for_each_format() {
    let page = include_str!("../../../book/src/reference/formats.md");
    for format in ndof_io::formats() {
        let row = page.lines().find(|line| line.starts_with(&format!("| {} |", format.name))).unwrap_or_else(|| panic!("{}", format.name));
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        assert!(format.suffixes.iter().all(|suffix| cells[2].contains(&format!(".{suffix}"))), "{row}");
        assert_eq!(cells[4] == "yes", format.writes, "{row}");
        assert!(cells[5] == "yes" || cells[5] == format!("`--features {}`", format.feature), "{row}");
    }
}
