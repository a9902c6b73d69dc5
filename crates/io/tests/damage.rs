//! Each format damaged at 2000 places: a right answer or an error, never a panic, an abort, or more than 64 MB beyond the file's size.
//!
//! Each file is damaged in a process of its own, whose peak of memory the system counts and whose abort is seen.
#![cfg(target_os = "linux")]

use ndof_io::{ColumnsFile, ReadOptions, Resample, encode, read_response_bytes, read_trials_bytes};
use ndof_signal::{Channel, Recording, Unit};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use std::process::Command;

/// Damaged copies of each file; `NDOF_DAMAGE_ROUNDS=100000` makes more.
fn rounds() -> usize {
    std::env::var("NDOF_DAMAGE_ROUNDS").ok().and_then(|text| text.parse().ok()).unwrap_or(2000)
}

/// What reading may take beyond the file's size.
const ALLOWED_KB: u64 = 64 << 10;

/// Which file the process of its own damages.
const FILE: &str = "NDOF_DAMAGE_FILE";

const MOTION: &str = "Coordinates\nversion=1\nnRows=4\nnColumns=3\ninDegrees=yes\nDataType=double\nendheader\n\
    time\tknee_angle_r\tpelvis_tx\n0.00\t90\t0.5\n0.01\t45\t0.25\n0.02\t-90\t0.125\n0.03\t-80\t0.25\n";

const TOUCHSTONE: &str = "! ports\n# MHz S RI R 50\n1 0.5 0 2 90 3 180 0.1 -90\n2 0.5 0 2 90 3 180 0.1 -90\n";

/// Every file by its name; those of formats that are not built in are left out.
fn files() -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
    let mut names =
        vec!["foreign/plain.c3d", "foreign/two_rates.c3d", "foreign/kinarm.zip", "foreign/streams.xdf", "foreign/plain.tdms", "foreign/trials.tdms"];
    names.extend([
        "foreign/rates.tdms",
        "foreign/frf.uff",
        "foreign/frf_binary.uff",
        "foreign/frf_expected.csv",
        "plain.npz",
        "types.npz",
        "time_deflated.npz",
    ]);
    names.extend(["plain.mat", "struct_compressed.mat", "types.mat"]);
    if cfg!(feature = "mcap") {
        names.extend(["foreign/plain.mcap", "foreign/lz4.mcap", "foreign/zstd.mcap"]);
    }
    if cfg!(feature = "parquet") {
        names.extend(["foreign/lerobot.parquet", "pandas.parquet", "types.parquet"]);
    }
    if cfg!(feature = "hdf5") {
        names.extend(["foreign/struct_array.mat", "v73.mat", "group.h5"]);
    }
    let mut files: Vec<(String, Vec<u8>)> = names.into_iter().map(|name| (name.to_owned(), std::fs::read(folder.join(name)).expect(name))).collect();
    files.push(("own.mot".to_owned(), MOTION.as_bytes().to_vec()));
    files.push(("own.s2p".to_owned(), TOUCHSTONE.as_bytes().to_vec()));
    files.push(("own.asc".to_owned(), (0..50).map(|k| format!("{k} {} 3.5\n", 2 * k)).collect::<String>().into_bytes()));
    let channel = Channel::new("force_x", Unit::parse("N").expect("newton").0, (0..50).map(f64::from).collect());
    let recording = Recording::new(100.0, vec![channel]).expect("recording").with_metadata([("subject".to_owned(), "S 07".to_owned())].into());
    files.push(("own.mat".to_owned(), encode(&recording, "own.mat").expect("written")));
    files
}

fn damaged(bytes: &[u8], rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut copy = bytes.to_vec();
    for _ in 0..rng.random_range(1..4) {
        let at = rng.random_range(0..copy.len());
        match rng.random_range(0..6) {
            0 => copy[at] = rng.random_range(0..=255),
            1 => copy[at] ^= 1 << rng.random_range(0..8),
            2 => {
                copy.remove(at);
            }
            3 => copy.insert(at, rng.random_range(0..=255)),
            4 => copy.truncate(at.max(1)),
            _ => {
                // A length or a count that lies.
                let end = copy.len().min(at + [2, 4, 8][rng.random_range(0..3)]);
                copy[at..end].fill([0, 0x7f, 0xff][rng.random_range(0..3)]);
            }
        }
        if copy.is_empty() {
            return vec![0];
        }
    }
    copy
}

/// The most memory that this process has had, in kB: what it used, and what it asked for.
fn peaks_kb() -> [u64; 2] {
    let status = std::fs::read_to_string("/proc/self/status").expect("status");
    ["VmHWM:", "VmPeak:"].map(|key| {
        let line = status.lines().find(|line| line.starts_with(key)).expect(key);
        line.split_whitespace().nth(1).and_then(|kb| kb.parse().ok()).expect("number")
    })
}

/// Runs in a process of its own; alone it does nothing.
#[test]
fn one_file_is_damaged() {
    let Ok(wanted) = std::env::var(FILE) else { return };
    let (name, bytes) = files().into_iter().find(|(name, _)| *name == wanted).expect("file");
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let columns = ColumnsFile::parse("sample_rate_hz = 100\n[columns]\na = { number = 1 }\nb = { number = 3 }\n", "c.toml").expect("columns");
    let columns = name.ends_with(".asc").then_some(columns);
    let strict = ReadOptions { columns, ..ReadOptions::default() };
    let lenient = ReadOptions { sample_rate_hz: Some(200.0), allow_nan: true, any_timing: true, resample: Some(Resample::Auto), ..strict.clone() };
    // What is whole is read once, so that only the damaged ones count.
    let _ = (read_trials_bytes(&bytes, &name, &lenient), read_response_bytes(&bytes, &name));
    // The threads and the address space that an allocator keeps for each are of no file.
    rayon::broadcast(|_| drop(vec![0u8; 1 << 16]));
    let before = peaks_kb();
    let mut answers = 0;
    for round in 0..rounds() {
        let copy = damaged(&bytes, &mut rng);
        answers += usize::from(read_trials_bytes(&copy, &name, if round % 2 == 0 { &strict } else { &lenient }).is_ok());
        answers += usize::from(read_response_bytes(&copy, &name).is_ok());
    }
    let [used, asked] = std::array::from_fn(|k| peaks_kb()[k] - before[k]);
    println!("{name}: {answers} answers of {}, {used} kB used and {asked} kB asked for at the most", rounds());
    assert!(used.max(asked) <= ALLOWED_KB + bytes.len() as u64 / 1024, "{name}: {used} kB used, {asked} kB asked for beyond {before:?}");
}

#[test]
fn no_damage_ends_the_process_or_fills_the_memory() {
    let mut failed = Vec::new();
    for (name, _) in files() {
        let child = Command::new(std::env::current_exe().expect("this test"))
            .args(["--exact", "one_file_is_damaged", "--nocapture"])
            .env(FILE, &name)
            // A panic that is caught is no find, and its trace takes time.
            .env("RUST_BACKTRACE", "0")
            .output()
            .expect("started");
        let told = String::from_utf8_lossy(&child.stdout);
        println!("{}", told.lines().find(|line| line.contains("at the most")).unwrap_or("no word"));
        if !child.status.success() {
            let wrong = String::from_utf8_lossy(&child.stderr);
            failed.push(format!("{name}: {}\n{}", child.status, wrong.lines().rev().take(6).collect::<Vec<_>>().join("\n")));
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n\n"));
}
