//! The TOML files that people write: unknown keys are errors, and an error names file, line and remedy.

mod baseline;
mod channels;
mod estimate;
mod excitation;
mod experiment;
mod kinematics;
mod study;

pub use baseline::{BaselineFile, BaselineParameter, Status, Value};
pub use channels::{ChannelSource, ChannelTable, ChannelsFile, Transform, Transforms};
pub use estimate::EstimateSection;
pub use excitation::Excitation;
pub use experiment::{ExperimentFile, HiddenEffect};
pub use kinematics::{KinematicsFile, KinematicsSd, MeanForce};
pub use study::{CaseSection, DiagnoseSection, FitSection, ReportSection, SensitivitySection, StepsSection, StudyDocument, StudyFile};

use crate::error::{StudyError, did_you_mean};
use crate::suggest::nearest;
use serde::de::DeserializeOwned;
use std::path::Path;

/// Reads a TOML file of type `T`.
///
/// # Errors
/// [`StudyError::Read`] if there is no such file, [`StudyError::File`] with the line if it is not what `T` wants.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<T, StudyError> {
    let file = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|source| StudyError::Read { file: file.clone(), source })?;
    parse(&text, &file)
}

/// Reads TOML text of type `T`; `file` is the name that errors give.
///
/// # Errors
/// [`StudyError::File`] with the line and, for an unknown key, the nearest known one.
pub fn parse<T: DeserializeOwned>(text: &str, file: &str) -> Result<T, StudyError> {
    toml::from_str(text).map_err(|error| {
        let line = error.span().map_or(1, |span| 1 + text[..span.start.min(text.len())].matches('\n').count());
        let message = error.message().trim().to_owned();
        let what = match unknown_key(&message) {
            Some((key, known)) => {
                format!("unknown key \"{key}\"{}; known here: {}", did_you_mean(nearest(key, known.iter().copied()).as_deref()), known.join(", "))
            }
            None if message.starts_with("missing field") => format!("{message}; add this key"),
            None => format!("{message}; correct this line"),
        };
        StudyError::File { file: file.to_owned(), line, what }
    })
}

/// serde's "unknown field `a`, expected one of `b`, `c`" as (a, [b, c]).
fn unknown_key(message: &str) -> Option<(&str, Vec<&str>)> {
    let rest = message.strip_prefix("unknown field ")?;
    let mut names = rest.split('`').skip(1).step_by(2);
    Some((names.next()?, names.collect()))
}

/// Checks the `schema` line of a file.
pub(crate) fn check_schema(found: Option<&str>, expected: &str, file: &str) -> Result<(), StudyError> {
    match found {
        Some(found) if found != expected => {
            Err(StudyError::Meaning { file: file.to_owned(), what: format!("schema = \"{found}\"; this place takes \"{expected}\"") })
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_key_is_named_with_its_line_and_the_nearest_known_one() {
        let text = "kind = \"planar-two-link\"\nlink_lenghts_m = [0.3, 0.3]\nposture_rad = [0.7, 1.5]\n";
        let error = parse::<KinematicsFile>(text, "arm.toml").unwrap_err().to_string();
        assert!(error.starts_with("arm.toml:2: unknown key \"link_lenghts_m\" (did you mean \"link_lengths_m\"?)"), "{error}");
    }

    #[test]
    fn a_wrong_type_is_named_with_its_line() {
        let error = parse::<KinematicsFile>("kind = \"planar-two-link\"\nlink_lengths_m = \"long\"\n", "arm.toml").unwrap_err().to_string();
        assert!(error.starts_with("arm.toml:2: "), "{error}");
    }

    const EXPERIMENT: &str = r#"
        schema = "ndof/experiment/1"
        seed = 1
        trials = 6
        duration_s = 50.0
        sample_rate_hz = 500.0
        discard_s = 2.0
        [device]
        name = "mit-manus"
        parameters = { link_1_m = 0.4064 }
        [limb]
        name = "endpoint-linear"
        M = [[2.1, -0.55], [-0.55, 1.9]]
        B = [[11.0, -2.0], [-2.0, 15.0]]
        K = [[300.0, -60.0], [-60.0, 520.0]]
        mean_force_n = [0.0, 0.0]
        noise = { rms_n = 0.5, cutoff_hz = 2.0 }
        [posture]
        hand_m = [0.0, 0.0]
        [excitation]
        kind = "filtered-noise"
        rms = 4.0
        cutoff_hz = 15.0
        order = 8
        [controller]
        kp = 100.0
        kd = 5.0
        [sensors]
        force_noise_rms = 0.03
        force_quantum = 0.025
        encoder_bits = 16
        averaging = "interval"
        [[effects]]
        name = "hysteresis"
        side = "limb"
        axis = "x"
        parameters = { stiffness_n_per_m = 300.0, yield_m = 0.003 }
    "#;

    #[test]
    fn an_experiment_as_the_contract_writes_it_is_understood() {
        let experiment: ExperimentFile = parse(EXPERIMENT, "e.toml").expect("understood");
        experiment.check("e.toml").expect("makes sense");
        assert_eq!((experiment.trials, experiment.effects.len(), experiment.excitation.order), (6, 1, 8));
        let wrong = EXPERIMENT.replace("filtered-noise", "filtered-nose");
        let error = parse::<ExperimentFile>(&wrong, "e.toml").expect("understood").check("e.toml").unwrap_err().to_string();
        assert!(error.contains("did you mean \"filtered-noise\"?"), "{error}");
    }

    #[test]
    fn a_baseline_as_the_contract_writes_it_is_understood() {
        let text =
            "model = \"inertia-damping-stiffness\"\n[parameters.M]\nvalue = [[2.1, -0.55], [-0.55, 1.9]]\nstatus = \"fixed\"\n[parameters.K]\nvalue = 300.0\n";
        let baseline: BaselineFile = parse(text, "b.toml").expect("understood");
        baseline.check("b.toml").expect("makes sense");
        assert_eq!((baseline.parameters["M"].status, baseline.parameters["K"].status), (Status::Fixed, Status::Free));
        assert_eq!(baseline.parameters["K"].value.rows(), [[300.0]]);
        let error = |text: &str| parse::<BaselineFile>(text, "b.toml").and_then(|baseline| baseline.check("b.toml")).unwrap_err().to_string();
        assert!(error("[parameters.Q]\nvalue = 1.0\n").contains("M, B and K"));
        assert!(error("[parameters.K]\nvalue = [[1.0, 2.0]]\n").contains("not a square matrix"));
    }

    #[test]
    fn an_experiment_may_stand_in_a_file_of_its_own() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("e.toml"), EXPERIMENT).expect("written");
        std::fs::write(folder.path().join("s.toml"), "[experiment]\nfile = \"e.toml\"\n[fit]\nband_hz = [0.5, 8.0]\n").expect("written");
        let study = StudyFile::read(&folder.path().join("s.toml")).expect("understood");
        assert_eq!((study.experiment.trials, study.fit.band_hz), (6, Some([0.5, 8.0])));
    }
}
