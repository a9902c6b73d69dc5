//! Experiments and studies as TOML files; what else people write is in [`ndof_analysis::file`].

mod excitation;
mod experiment;
mod study;

pub use excitation::Excitation;
pub use experiment::{ExperimentFile, HiddenEffect};
pub use ndof_analysis::file::*;
pub use study::{CaseSection, ReportSection, SensitivitySection, StepsSection, StudyDocument, StudyFile};

#[cfg(test)]
mod tests {
    use super::*;

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
        for (from, to, named) in [
            ("mean_force_n", "meanforce_n", "meanforce_n"),
            ("force_quantum", "force_quanta", "force_quanta"),
            ("noise = { rms_n = 0.5, cutoff_hz", "noise = { rms_n = 0.5, cutoff", "cutoff"),
            ("name = \"endpoint-linear\"", "name = \"endpoint\"", "endpoint"),
            ("duration_s", "duration", "duration"),
        ] {
            let error = parse::<ExperimentFile>(&EXPERIMENT.replace(from, to), "e.toml").expect_err(named).to_string();
            assert!(error.contains(named), "{error}");
        }
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
