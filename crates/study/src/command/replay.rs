//! A designed perturbation from its file.

use crate::error::{StudyError, meaning};
use crate::file::Excitation;
use ndof_analysis::AnalysisError;
use ndof_io::ReadOptions;
use std::path::PathBuf;

/// The file of trial `trial`: the one that is named, or NAME-1.EXT for the first where that does not exist.
fn file_of(excitation: &Excitation, name: &str, trial: usize) -> PathBuf {
    let whole = excitation.folder.join(name);
    if whole.exists() {
        return whole;
    }
    let stem = whole.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let extension = whole.extension().map_or_else(String::new, |extension| format!(".{}", extension.to_string_lossy()));
    let numbered = whole.with_file_name(format!("{stem}-{}{extension}", trial + 1));
    if numbered.exists() { numbered } else { whole }
}

/// `samples` samples of channel `cmd_AXIS` (or `AXIS`) for each axis. A file that is shorter by no more than `lead` samples
/// begins that much later, silence before it; what is longer is not played to its end.
pub(crate) fn replay(
    excitation: &Excitation,
    name: &str,
    axes: &[String],
    samples: usize,
    lead: usize,
    sample_rate_hz: f64,
    trial: usize,
) -> Result<Vec<Vec<f64>>, StudyError> {
    let path = file_of(excitation, name, trial);
    let read = ndof_io::read(&path, &ReadOptions::default()).map_err(AnalysisError::from)?;
    let (file, recording) = (read.file, read.recording);
    let wrong = |what: String| Err(meaning(&file, what));
    // A file's times are decimal fractions, so its rate is exact to some digits only.
    if (recording.sample_rate_hz() / sample_rate_hz - 1.0).abs() > 1e-6 {
        return wrong(format!("{} Hz, the experiment has {sample_rate_hz} Hz; design it with `sample_rate={sample_rate_hz}`", recording.sample_rate_hz()));
    }
    let found = recording.len();
    if found + lead < samples {
        let seconds = |count: usize| count as f64 / sample_rate_hz;
        return wrong(format!("{} s, the experiment records {} s; lower duration_s or design a longer one", seconds(found), seconds(samples - lead)));
    }
    axes.iter()
        .map(|axis| {
            let channel = recording.channels().iter().find(|c| c.name == format!("cmd_{axis}") || c.name == *axis);
            let channel = channel.ok_or_else(|| AnalysisError::no_channel(&file, &format!("cmd_{axis}"), recording.names()))?;
            let mut signal = vec![0.0; samples.saturating_sub(found)];
            signal.extend(channel.samples.iter().take(samples));
            Ok(signal)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn excitation(folder: &std::path::Path) -> Excitation {
        Excitation { file: Some("cmd.csv".to_owned()), folder: folder.to_owned(), ..Excitation::default() }
    }

    #[test]
    fn trials_find_their_files_and_a_short_one_begins_later() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, value: f64| {
            std::fs::write(folder.path().join(name), format!("# sample_rate_hz: 100\ncmd_x [N],cmd_y [N]\n{value},0\n{value},1\n{value},2\n"))
        };
        write("cmd-1.csv", 1.0).expect("written");
        write("cmd-2.csv", 2.0).expect("written");
        let axes = ["y".to_owned(), "x".to_owned()];
        let of = |samples, lead, rate, trial| replay(&excitation(folder.path()), "cmd.csv", &axes, samples, lead, rate, trial);
        assert_eq!(of(3, 0, 100.0, 1).expect("played"), [vec![0.0, 1.0, 2.0], vec![2.0; 3]]);
        assert_eq!(of(5, 2, 100.0, 0).expect("played")[0], [0.0, 0.0, 0.0, 1.0, 2.0]);
        assert_eq!(of(2, 0, 100.0, 0).expect("played")[0], [0.0, 1.0]);
        assert!(of(5, 1, 100.0, 0).unwrap_err().to_string().contains("lower duration_s"));
        assert!(of(3, 0, 500.0, 0).unwrap_err().to_string().contains("`sample_rate=500`"));
        assert!(of(3, 0, 100.0, 2).unwrap_err().to_string().contains("cmd.csv"));
        write("cmd.csv", 7.0).expect("written");
        assert_eq!(of(3, 0, 100.0, 1).expect("played")[1], vec![7.0; 3]);
        let missing = replay(&excitation(folder.path()), "cmd.csv", &["z".to_owned()], 3, 0, 100.0, 0).unwrap_err().to_string();
        assert!(missing.contains("cmd_z") && missing.contains("cmd_x, cmd_y"), "{missing}");
    }
}
