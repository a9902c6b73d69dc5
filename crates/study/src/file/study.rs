//! `ndof/study/1`: an experiment with its analysis.

use super::experiment::ExperimentFile;
use crate::error::{StudyError, meaning};
use ndof_analysis::file::{KinematicsFile, check_schema, read_text};
use ndof_analysis::{Diagnose, Estimate, Fit};
use serde::de::{DeserializeOwned, IgnoredAny};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A whole study.
pub type StudyFile = StudyDocument<ExperimentFile>;

/// A study as it is written: `E` is the experiment itself, the path of its file, or recordings of one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyDocument<E> {
    /// `ndof/study/1`.
    pub schema: Option<String>,
    /// Title of the report.
    pub title: Option<String>,
    /// What is simulated, or was recorded.
    #[serde(alias = "recordings")]
    pub experiment: E,
    /// How the response is estimated.
    #[serde(default)]
    pub estimate: Estimate,
    /// Other settings, fitted beside it.
    #[serde(default)]
    pub also: Vec<Estimate>,
    /// What is fitted.
    #[serde(default)]
    pub fit: Fit,
    /// Where the joints are.
    pub kinematics: Option<KinematicsFile>,
    /// What the diagnosis is asked; without this table there is none.
    pub diagnose: Option<Diagnose>,
    /// Variants of the experiment, each simulated and analysed as a whole; without any there is the experiment itself.
    #[serde(default)]
    pub cases: Vec<CaseSection>,
    /// What is drawn where cases are compared.
    #[serde(default)]
    pub report: ReportSection,
    /// How far the limb may be from what a pre-compensation believes; without this table that is not asked.
    pub sensitivity: Option<SensitivitySection>,
}

/// One variant of a study's experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaseSection {
    /// What tables and folders call it.
    pub name: String,
    /// The keys of the experiment that differ; a table that names another device, limb or kind of excitation takes the whole place.
    #[serde(default)]
    pub experiment: toml::Table,
    /// Where files that it names are looked for: beside the study.
    #[serde(skip)]
    pub folder: PathBuf,
}

/// Which cases the pictures of a comparison show, by name, and in which bands agreement is measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReportSection {
    /// Bands of VAF and R².
    pub bands_hz: Vec<[f64; 2]>,
    /// Where coherence between inputs and the error at low frequencies are measured.
    pub low_band_hz: [f64; 2],
    /// Cases whose way from the posture is drawn over time.
    pub displacement: Vec<String>,
    /// Cases whose coherence between the inputs is drawn.
    pub input_coherence: Vec<String>,
    /// Cases whose errors at low frequencies are drawn.
    pub errors: Vec<String>,
    /// Parameters whose steps along a row of cases are tabled.
    pub steps: Vec<StepsSection>,
}

/// A parameter followed from case to case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StepsSection {
    /// `M_x_x`.
    pub parameter: String,
    /// In order.
    pub cases: Vec<String>,
}

impl Default for ReportSection {
    fn default() -> Self {
        ReportSection {
            bands_hz: vec![[0.25, 5.0], [0.25, 10.0]],
            low_band_hz: [0.25, 2.0],
            displacement: Vec::new(),
            input_coherence: Vec::new(),
            errors: Vec::new(),
            steps: Vec::new(),
        }
    }
}

/// The path of an experiment's file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct ExperimentPath {
    /// Relative to the study's file.
    file: String,
}

/// Just enough of a study to tell which of its forms it has.
#[derive(Default, Deserialize)]
struct Glance {
    experiment: Option<toml::Table>,
    recordings: Option<IgnoredAny>,
    cases: Option<IgnoredAny>,
    sensitivity: Option<IgnoredAny>,
}

/// The sensitivity of pre-compensation to the model of the limb.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensitivitySection {
    /// By how much parameters are wrong, as a share.
    pub spread: f64,
    /// The band in which coherence counts.
    pub band_hz: [f64; 2],
    /// Whether the study's trials are simulated behind each wrong compensation, too.
    pub simulate: bool,
}

impl Default for SensitivitySection {
    /// ± 30 % (Palazzolo et al. 2007 ask for the analysis), 0.25 to 15 Hz, with simulations.
    fn default() -> Self {
        SensitivitySection { spread: 0.3, band_hz: [0.25, 15.0], simulate: true }
    }
}

impl CaseSection {
    /// Whether the robot or the perturbation is in a file of the case's own.
    fn names_a_file(&self, table: &str) -> bool {
        self.experiment.get(table).and_then(toml::Value::as_table).is_some_and(|table| table.contains_key("file"))
    }
}

impl StudyFile {
    /// The schema's name.
    pub const SCHEMA: &str = "ndof/study/1";

    /// Reads a study; an experiment in a file of its own is read too.
    ///
    /// # Errors
    /// [`StudyError`] with file and line.
    pub fn read(path: &Path) -> Result<Self, StudyError> {
        let (file, text) = read_text(path)?;
        Self::parse(&text, &file)
    }

    /// A study from text; `file` is its name in errors, and an experiment's file is looked for beside it.
    ///
    /// # Errors
    /// [`StudyError`] with line.
    pub fn parse(text: &str, file: &str) -> Result<Self, StudyError> {
        let glance = toml::from_str::<Glance>(text).unwrap_or_default();
        if glance.recordings.is_some() {
            return Err(meaning(file, "a study of [recordings], and only an [experiment] can be simulated; give it to `ndof study`"));
        }
        let apart = glance.experiment.is_some_and(|table| table.contains_key("file"));
        let folder = Path::new(file).parent().unwrap_or_else(|| Path::new(""));
        let mut study = if apart {
            let study: StudyDocument<ExperimentPath> = ndof_analysis::file::parse(text, file)?;
            let path = folder.join(&study.experiment.file);
            study.with_experiment(ExperimentFile::read(&path)?)
        } else {
            let mut study: StudyFile = ndof_analysis::file::parse(text, file)?;
            study.experiment.check(file)?;
            study.experiment = study.experiment.beside(folder);
            study
        };
        study.cases.iter_mut().for_each(|case| folder.clone_into(&mut case.folder));
        check_schema(study.schema.as_deref(), Self::SCHEMA, file)?;
        study.check_cases(file)?;
        Ok(study)
    }

    /// The study of each case on its own, with its name; one without a name where there are no cases.
    ///
    /// # Errors
    /// [`StudyError`] if a case changes what an experiment does not have.
    pub fn each_case(&self) -> Result<Vec<(String, StudyFile)>, StudyError> {
        if self.cases.is_empty() {
            return Ok(vec![(String::new(), self.clone())]);
        }
        let wrong = |what: String| meaning("the study", what);
        let base = toml::Table::try_from(&self.experiment).map_err(|error| wrong(error.to_string()))?;
        let of = |case: &CaseSection| {
            let mut table = base.clone();
            overlay(&mut table, &case.experiment);
            // As text, so that a case is read by the same code as a file.
            let mut experiment: ExperimentFile =
                toml::from_str(&table.to_string()).map_err(|error| wrong(format!("case \"{}\": {}", case.name, error.message())))?;
            experiment.check(&format!("case \"{}\"", case.name))?;
            experiment.excitation.folder.clone_from(if case.names_a_file("excitation") { &case.folder } else { &self.experiment.excitation.folder });
            if let Some(file) = experiment.device.file.as_mut().filter(|_| case.names_a_file("device")) {
                *file = case.folder.join(file.as_str()).display().to_string();
            }
            Ok((case.name.clone(), StudyFile { experiment, cases: Vec::new(), ..self.clone() }))
        };
        self.cases.iter().map(of).collect()
    }

    fn check_cases(&self, file: &str) -> Result<(), StudyError> {
        let wrong = |what: String| Err(meaning(file, what));
        for (k, case) in self.cases.iter().enumerate() {
            if case.name.is_empty() || case.name.contains(['/', '\\']) || case.name.starts_with('.') {
                return wrong(format!("case \"{}\" cannot name a folder; use letters, digits, spaces and hyphens", case.name));
            }
            if self.cases[..k].iter().any(|before| before.name == case.name) {
                return wrong(format!("two cases are called \"{}\"", case.name));
            }
        }
        let named = [&self.report.displacement, &self.report.input_coherence, &self.report.errors]
            .into_iter()
            .chain(self.report.steps.iter().map(|steps| &steps.cases))
            .flatten();
        for name in named {
            if !self.cases.iter().any(|case| case.name == *name) {
                let known: Vec<&str> = self.cases.iter().map(|case| case.name.as_str()).collect();
                return wrong(format!("[report] asks for a case \"{name}\"; there are: {}", known.join(", ")));
            }
        }
        self.each_case().map(|_| ())
    }

    /// The experiment of a file that holds one, or a study.
    ///
    /// # Errors
    /// [`StudyError`] with file and line.
    pub fn experiment_of(path: &Path) -> Result<ExperimentFile, StudyError> {
        let (_, text) = read_text(path)?;
        let study = toml::from_str::<Glance>(&text).is_ok_and(|glance| glance.experiment.is_some() || glance.recordings.is_some());
        if study { Ok(Self::read(path)?.experiment) } else { ExperimentFile::read(path) }
    }
}

impl<E> StudyDocument<E> {
    /// A study of recordings from text, `E` being its table `[recordings]`; nothing where it has none.
    ///
    /// # Errors
    /// [`StudyError`] with line, or if the study has what only a simulation can have.
    pub fn of_recordings(text: &str, file: &str) -> Result<Option<Self>, StudyError>
    where
        E: DeserializeOwned,
    {
        let Ok(Glance { recordings: Some(_), experiment, cases, sensitivity }) = toml::from_str(text) else { return Ok(None) };
        let simulated = [("experiment", experiment.is_some()), ("cases", cases.is_some()), ("sensitivity", sensitivity.is_some())];
        if let Some((table, _)) = simulated.iter().find(|(_, given)| *given) {
            return Err(meaning(file, format!("[{table}] is for what is simulated, and the study has [recordings]; leave one of the two out")));
        }
        let study: Self = ndof_analysis::file::parse(text, file)?;
        check_schema(study.schema.as_deref(), StudyFile::SCHEMA, file)?;
        Ok(Some(study))
    }

    /// What the fit is asked for.
    pub(crate) fn fit_settings(&self) -> Fit {
        Fit { kinematics: self.kinematics.clone().or_else(|| self.fit.kinematics.clone()), ..self.fit.clone() }
    }

    /// What the diagnosis is asked for: of an arm in a plane with the curve that it moves on.
    pub(crate) fn diagnosis_settings(&self) -> Option<Diagnose> {
        let asked = self.diagnose.clone()?;
        let kinematics = asked.kinematics.clone().or_else(|| self.fit_settings().kinematics.filter(|file| file.kind == "planar-two-link"));
        Some(Diagnose { kinematics, ..asked })
    }

    fn with_experiment<F>(self, experiment: F) -> StudyDocument<F> {
        let StudyDocument { schema, title, experiment: _, estimate, also, fit, kinematics, diagnose, cases, report, sensitivity } = self;
        StudyDocument { schema, title, experiment, estimate, also, fit, kinematics, diagnose, cases, report, sensitivity }
    }
}

/// Puts the keys of `over` into `table`, tables into tables, except where another thing is named.
fn overlay(table: &mut toml::Table, over: &toml::Table) {
    for (key, value) in over {
        match (table.get_mut(key), value) {
            (Some(toml::Value::Table(inner)), toml::Value::Table(over)) if !over.contains_key("name") && !over.contains_key("kind") => overlay(inner, over),
            _ => {
                table.insert(key.clone(), value.clone());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_a_case_names_lie_beside_the_study_and_those_of_the_experiment_beside_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let inner = folder.path().join("inner");
        std::fs::create_dir(&inner).expect("a folder");
        let limb = "[limb]\nname = \"endpoint-linear\"\nM = [[2.0]]\nB = [[10.0]]\nK = [[300.0]]\n";
        std::fs::write(inner.join("e.toml"), format!("[device]\nfile = \"robot.toml\"\n{limb}[excitation]\nfile = \"cmd.csv\"\n")).expect("written");
        let cases = "[[cases]]\nname = \"as it is\"\n[[cases]]\nname = \"other\"\n[cases.experiment.device]\nfile = \"other.toml\"\n\
                     [cases.experiment.excitation]\nfile = \"other.csv\"\n";
        let path = folder.path().join("s.toml");
        std::fs::write(&path, format!("[experiment]\nfile = \"inner/e.toml\"\n{cases}")).expect("written");
        let cases = StudyFile::read(&path).expect("a study").each_case().expect("cases");
        let places = |k: usize| {
            let experiment = &cases[k].1.experiment;
            (experiment.device.file.clone().map(PathBuf::from), experiment.excitation.folder.join(experiment.excitation.file.as_deref().unwrap_or_default()))
        };
        assert_eq!(places(0), (Some(inner.join("robot.toml")), inner.join("cmd.csv")));
        assert_eq!(places(1), (Some(folder.path().join("other.toml")), folder.path().join("other.csv")));
    }
}
