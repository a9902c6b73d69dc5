//! Files and settings that claim what no machine holds: refused with a message, in bounded time and memory.

use crate::support::{ndof, trial};
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

/// Address space of a run (kB): a refusal needs little of it, what is claimed would need far more.
const MEMORY_KB: usize = 2_000_000;
/// Time of a refusal, on a machine that does other things beside.
const LONGEST: Duration = Duration::from_secs(60);

/// Runs `ndof` with little memory; it must refuse with code 2 and one message, which is returned.
fn refused_in_little_memory(folder: &Path, arguments: &[&str]) -> String {
    let from = Instant::now();
    let program = env!("CARGO_BIN_EXE_ndof");
    let output: Output = Command::new("sh")
        .args(["-c", &format!("ulimit -v {MEMORY_KB}; exec \"$0\" \"$@\""), program])
        .args(arguments)
        .env("RAYON_NUM_THREADS", "2")
        .current_dir(folder)
        .output()
        .expect("a shell");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "ndof {}\n{message}", arguments.join(" "));
    assert!(message.contains("error: ") && !message.contains("panicked"), "{message}");
    assert!(from.elapsed() < LONGEST, "ndof {} took {:?}", arguments.join(" "), from.elapsed());
    message
}

/// An experiment with these lines before its tables and after them.
fn experiment(folder: &Path, before: &str, after: &str) {
    let text = format!(
        "{before}\n[device]\nname = \"mit-manus\"\n[limb]\nname = \"endpoint-linear\"\nM = [[2.1, 0.0], [0.0, 1.9]]\nB = [[11.0, 0.0], [0.0, 15.0]]\nK = [[300.0, 0.0], [0.0, 520.0]]\n{after}\n"
    );
    std::fs::write(folder.join("e.toml"), text).expect("written");
}

#[test]
#[cfg(target_os = "linux")]
fn headers_without_end_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let names: String = (0..1_000_000).fold(String::new(), |mut all, k| {
        let _ = write!(all, "c{k},");
        all
    });
    for (name, text) in [
        ("wide.csv", format!("{names}\n1\n")),
        ("long.csv", format!("{}\n1\n", "a".repeat(20_000_000))),
        ("comments.csv", format!("# {}\nforce_x,pos_x\n1,2\n", "k: v ".repeat(4_000_000))),
        ("units.csv", format!("force_x [{}],pos_x [m]\n1,2\n", "N".repeat(5_000_000))),
    ] {
        std::fs::write(folder.path().join(name), text).expect("written");
        let message = refused_in_little_memory(folder.path(), &["estimate", name]);
        assert!(message.contains(name) && message.len() < 20_000, "{name}: {} bytes of message", message.len());
    }
}

/// A `.npy` whose header claims this shape, with `bytes` bytes behind it.
fn npy(shape: &str, bytes: usize) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
    let header = format!("{header:<117}\n");
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend_from_slice(&(header.len() as u16).to_le_bytes());
    out.extend_from_slice(header.as_bytes());
    out.resize(out.len() + bytes, 0);
    out
}

/// A zip archive of one stored member, by hand.
fn stored(name: &str, data: &[u8]) -> Vec<u8> {
    let crc = crc32(data);
    let sizes = [crc.to_le_bytes(), (data.len() as u32).to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
    let length = (name.len() as u16).to_le_bytes();
    let mut out = [b"PK\x03\x04\x14\0\0\0\0\0\0\0\0\0".as_slice(), &sizes, &length, &[0, 0], name.as_bytes(), data].concat();
    let at = out.len() as u32;
    out.extend([b"PK\x01\x02\x14\0\x14\0\0\0\0\0\0\0\0\0".as_slice(), &sizes, &length, &[0; 16], name.as_bytes()].concat());
    let directory = (out.len() as u32 - at).to_le_bytes();
    out.extend([b"PK\x05\x06\0\0\0\0\x01\0\x01\0".as_slice(), &directory, &at.to_le_bytes(), &[0, 0]].concat());
    out
}

fn crc32(data: &[u8]) -> u32 {
    !data.iter().fold(!0_u32, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0xEDB8_8320 } else { crc >> 1 }))
}

#[test]
#[cfg(target_os = "linux")]
fn a_billion_rows_that_a_header_claims_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("good.npz"), stored("force_x.npy", &npy("(4,)", 32))).expect("written");
    let good = String::from_utf8(ndof(folder.path(), &["check", "good.npz"]).stderr).expect("UTF-8");
    assert!(!good.contains("damaged"), "the archive of this test is one: {good}");
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/io/tests/fixtures");
    let mut files = vec![
        ("rows.npz", stored("force_x.npy", &npy("(1000000000,)", 64))),
        ("columns.npz", stored("force_x.npy", &npy("(2, 1000000000000)", 64))),
        ("product.npz", stored("force_x.npy", &npy("(4294967296, 4294967296, 4)", 64))),
        ("billion.h5", std::fs::read(fixtures.join("billion.h5")).expect("a fixture of h5py")),
    ];
    // The MAT file of SciPy, its first array's dimensions enlarged.
    let mut mat = std::fs::read(fixtures.join("plain.mat")).expect("a fixture of SciPy");
    let dimensions = mat.windows(8).position(|w| w == [5, 0, 0, 0, 8, 0, 0, 0]).expect("dimensions");
    mat[dimensions + 8..dimensions + 12].copy_from_slice(&1_000_000_000_i32.to_le_bytes());
    files.push(("rows.mat", mat));
    // The Parquet file of pandas, cut so that its footer claims what is not there.
    let parquet = std::fs::read(fixtures.join("pandas.parquet")).expect("a fixture of pandas");
    files.push(("cut.parquet", [&parquet[..200], &parquet[parquet.len() - 2000..]].concat()));
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).expect("written");
        assert!(refused_in_little_memory(folder.path(), &["estimate", name, "--sample-rate", "500"]).contains(name));
    }
}

#[test]
#[cfg(target_os = "linux")]
fn text_that_is_nested_without_end_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let here = |name: &str, text: String| std::fs::write(folder.path().join(name), text).expect("written");
    let deep = 200_000;
    here("lists.toml", format!("a = {}", "[".repeat(deep)));
    here("keys.toml", format!("a{} = 1", ".a".repeat(deep)));
    here("tables.toml", format!("a = {}", "{ a = ".repeat(deep)));
    for name in ["lists.toml", "keys.toml", "tables.toml"] {
        for command in [
            vec!["study", name],
            vec!["simulate", name, "--out", "o.csv"],
            vec!["fit", "trial.csv", "--kinematics", name],
            vec!["fit", "trial.csv", "--channels", name],
            vec!["diagnose", "trial.csv", "--baseline", name],
        ] {
            assert!(refused_in_little_memory(folder.path(), &command).contains(name), "{command:?}");
        }
    }
    here("deep.json", "{\"a\":".repeat(deep));
    here("list.json", "[".repeat(deep));
    for name in ["deep.json", "list.json"] {
        assert!(refused_in_little_memory(folder.path(), &["compare", name, name]).contains(name));
    }
    here("deep.urdf", format!("<robot>{}", "<link>".repeat(deep)));
    experiment(folder.path(), "", "");
    let text = std::fs::read_to_string(folder.path().join("e.toml")).expect("written").replace("name = \"mit-manus\"", "file = \"deep.urdf\"");
    here("u.toml", text);
    assert!(refused_in_little_memory(folder.path(), &["simulate", "u.toml", "--out", "o.csv"]).contains("deep.urdf"));
}

#[test]
#[cfg(target_os = "linux")]
fn settings_that_ask_for_more_than_a_machine_holds_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    for (before, after, named) in [
        ("duration_s = 1e9", "", "samples"),
        ("trials = 1000000000", "", "trial"),
        ("sample_rate_hz = 1e12", "", "samples"),
        ("discard_s = 1e12", "", "samples"),
        ("duration_s = inf", "", "duration_s"),
        ("", "[excitation]\ncandidates = 1000000000", "candidates"),
        ("", "[excitation]\norder = 1000000", "order"),
    ] {
        experiment(folder.path(), before, after);
        assert!(refused_in_little_memory(folder.path(), &["simulate", "e.toml", "--out", "o.csv"]).contains(named), "{before}{after}");
    }
    let axes: Vec<String> = (0..2000).map(|k| format!("a{k}")).collect();
    for options in
        [&["--duration", "1e12"][..], &["--trials", "1000000000"], &["--sample-rate", "1e300"], &["--axes", &axes.join(",")], &["--candidates", "1000000000"]]
    {
        refused_in_little_memory(folder.path(), &[&["design", "--out", "cmd.csv"], options].concat());
    }
    for options in [
        &["--nfft", "100000000000"][..],
        &["--nperseg", "256", "--nfft", "1000000000"],
        &["--nperseg", "18446744073709551615"],
        &["--method", "multitaper", "--time-bandwidth", "4900", "--tapers", "9800"],
        &["--method", "multitaper", "--time-bandwidth", "1e300"],
        &["--method", "multitaper", "--nfft", "1000000000000"],
        &["--method", "local-polynomial", "--half-width", "18446744073709551615"],
        &["--method", "periodic", "--period", "1e300"],
        &["--sliding", "2", "--sliding-step", "1e-9"],
    ] {
        refused_in_little_memory(folder.path(), &[&["estimate", "trial.csv"], options].concat());
    }
    let left: Vec<_> = std::fs::read_dir(folder.path()).expect("a folder").map(|entry| entry.expect("an entry").file_name()).collect();
    assert_eq!(left.len(), 2, "nothing but the trial and the experiment: {left:?}");
}

#[test]
#[cfg(target_os = "linux")]
fn a_bomb_in_an_archive_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let python = "import zipfile\n\
                  with zipfile.ZipFile('bomb.npz', 'w', zipfile.ZIP_DEFLATED) as archive:\n\
                  \x20   with archive.open('force_x.npy', 'w', force_zip64=True) as member:\n\
                  \x20       for _ in range(500): member.write(bytes(1 << 20))\n";
    let made = Command::new("python3").args(["-c", python]).current_dir(folder.path()).status();
    if !made.is_ok_and(|status| status.success()) {
        println!("skipped: there is no python3 to pack the bomb; crates/io/tests/robustness.rs packs another");
        return;
    }
    assert!(refused_in_little_memory(folder.path(), &["estimate", "bomb.npz"]).contains("bomb.npz"));
}
