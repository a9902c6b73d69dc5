//! The corrected robot's file: what `diagnose --write` writes, tells and refuses.

use crate::support::{ndof, refuse, succeed};
use std::fmt::Write;
use std::path::Path;

const ARM: &str = "schema = \"ndof/robot/1\"\nname = \"arm\" # mine\n[[joints]]\nname = \"shoulder\"\naxis = [0.0, 1.0, 0.0]\nmass_kg = 2.0\ncentre_m = [0.2, 0.0, 0.0]\ninertia_kg_m2 = [0.01, 0.01, 0.01, 0.0, 0.0, 0.0]\nviscous_nm_s_per_rad = 0.2\n";

/// A log of that arm with 0.5 N m s/rad in place of the 0.2 of its file.
fn log(folder: &Path) {
    let mut text = "t [s],torque_shoulder [N m],angle_shoulder [rad]\n".to_owned();
    for k in 0..8000 {
        let t = f64::from(k) / 200.0;
        let [mut q, mut v, mut a] = [0.2, 0.0, 0.0];
        for (hz, size) in [(0.11, 0.8), (0.29, 0.35), (0.53, 0.2)] {
            let w = std::f64::consts::TAU * hz;
            let (s, c) = (w * t).sin_cos();
            (q, v, a) = (q + size * s, v + size * w * c, a - size * w * w * s);
        }
        // About y: τ = (J + m c²) q̈ − m g c cos q, and noise that repeats in no short time.
        let noise = 0.03 * (f64::from(k) * f64::from(k) * 0.618).sin();
        let torque = 0.09 * a - 2.0 * 9.81 * 0.2 * q.cos() + 0.5 * v + noise;
        let _ = writeln!(text, "{t:.3},{torque:.6},{:.6}", (q * 1e5).round() / 1e5);
    }
    std::fs::write(folder.join("log.csv"), text).expect("written");
    std::fs::write(folder.join("arm.toml"), ARM).expect("written");
}

#[test]
fn a_corrected_robot_is_written_with_its_patch_and_lacks_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    log(folder.path());
    let text = succeed(folder.path(), &["diagnose", "log.csv", "--robot", "arm.toml", "--write", "corrected.toml"]);
    let written = std::fs::read_to_string(folder.path().join("corrected.toml")).expect("written");
    assert!(written.contains("name = \"arm\" # mine\n") && written.contains("# viscous-friction at shoulder, viscous_nm_s_per_rad = 0.5"), "{written}");
    assert!(text.contains("\nwritten: corrected.toml\n") && text.contains("\n-viscous_nm_s_per_rad = 0.2\n+# viscous-friction"), "{text}");
    let again = succeed(folder.path(), &["diagnose", "log.csv", "--robot", "corrected.toml", "--write", "again.toml"]);
    assert!(again.contains("verdict: adequate") && again.contains("nothing in the file was corrected"), "{again}");
    assert_eq!(std::fs::read_to_string(folder.path().join("again.toml")).expect("written"), written);
}

#[test]
fn a_robot_is_written_in_its_own_format_and_never_over_itself() {
    let folder = tempfile::tempdir().expect("a folder");
    log(folder.path());
    let other = refuse(folder.path(), &["diagnose", "log.csv", "--robot", "arm.toml", "--write", "arm.urdf"]);
    assert!(other.contains("--write arm.urdf") && other.contains("\".toml\""), "{other}");
    assert!(ndof(folder.path(), &["diagnose", "log.csv", "--write", "out.toml"]).status.code() == Some(2), "there is no robot to write");
    let itself = ndof(folder.path(), &["diagnose", "log.csv", "--robot", "arm.toml", "--write", "arm.toml", "--quiet"]);
    assert!(itself.status.code() == Some(2) && String::from_utf8_lossy(&itself.stderr).contains("arm.toml"), "{itself:?}");
    assert_eq!(std::fs::read_to_string(folder.path().join("arm.toml")).expect("there"), ARM);
}
