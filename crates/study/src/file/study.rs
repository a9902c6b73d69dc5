//! `ndof/study/1`: an experiment with its analysis.

use super::{BaselineFile, ExperimentFile, KinematicsFile, check_schema};
use crate::error::StudyError;
use crate::pipeline::{DiagnoseSettings, EstimateSettings, FitCost, FitSettings, HoldOut, MethodName};
use ndof_signal::{Detrend, Window};
use ndof_sysid::{Direct, ResponseKind};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A whole study.
pub type StudyFile = StudyDocument<ExperimentFile>;

/// A study as it is written: `E` is the experiment itself, or the path of its file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyDocument<E> {
    /// `ndof/study/1`.
    #[serde(default)]
    pub schema: Option<String>,
    /// Title of the report.
    #[serde(default)]
    pub title: Option<String>,
    /// What is simulated.
    pub experiment: E,
    /// How the response is estimated.
    #[serde(default)]
    pub estimate: EstimateSection,
    /// Other settings, fitted beside it.
    #[serde(default)]
    pub also: Vec<EstimateSection>,
    /// What is fitted.
    #[serde(default)]
    pub fit: FitSection,
    /// Where the joints are.
    #[serde(default)]
    pub kinematics: Option<KinematicsFile>,
    /// What the diagnosis is asked; without this table there is none.
    #[serde(default)]
    pub diagnose: Option<DiagnoseSection>,
}

/// The path of an experiment's file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct ExperimentPath {
    /// Relative to the study's file.
    file: String,
}

/// Just enough of a study to tell which of the two forms it has.
#[derive(Deserialize)]
struct Glance {
    #[serde(default)]
    experiment: toml::Table,
}

/// Keys are the long options of `ndof estimate`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct EstimateSection {
    /// What tables call it.
    pub name: Option<String>,
    /// The spectral method.
    pub method: MethodName,
    /// Samples in a segment.
    pub nperseg: Option<usize>,
    /// Samples that neighbours share.
    pub noverlap: Option<usize>,
    /// Length of the transform.
    pub nfft: Option<usize>,
    /// Data window.
    pub window: Option<String>,
    /// Symmetric instead of periodic.
    pub window_symmetric: bool,
    /// What is taken off each segment.
    pub detrend: Detrend,
    /// Half-width of the multitaper's spectral window.
    pub time_bandwidth: Option<f64>,
    /// Degree of the local polynomials.
    pub order: Option<usize>,
    /// Period of the excitation.
    pub period: Option<f64>,
    /// Where the noise of the direct estimate is thought to be.
    pub estimator: Direct,
    /// The physical quantity to report.
    pub response: Option<ResponseKind>,
    /// Cuts the arrays, never the computation.
    pub band: Option<[f64; 2]>,
    /// Add the cross-spectra.
    pub spectra: bool,
}

/// What is fitted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FitSection {
    /// The model's name.
    pub model: Option<String>,
    /// The band that is fitted.
    pub band_hz: Option<[f64; 2]>,
    /// Weighted by the covariance, or the paper's.
    pub cost: FitCost,
}

/// Keys are the long options of `ndof diagnose`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct DiagnoseSection {
    /// The band that is analysed.
    pub band: Option<[f64; 2]>,
    /// Size of a discrepancy that does not matter.
    pub tolerance: Option<f64>,
    /// A stretch that no fit may see.
    pub held_out: Option<[f64; 2]>,
    /// Effects that are not tried.
    pub without: Vec<String>,
    /// The simulation that is judged.
    pub baseline: Option<BaselineFile>,
}

impl DiagnoseSection {
    /// What the keys mean.
    pub fn settings(&self) -> DiagnoseSettings {
        let default = DiagnoseSettings::default();
        DiagnoseSettings {
            band_hz: self.band.map(|[low, high]| (low, high)),
            held_out: self.held_out.map_or(HoldOut::Auto, |[from, to]| HoldOut::Time(from, to)),
            tolerance: self.tolerance.unwrap_or(default.tolerance),
            seed: default.seed,
            without: self.without.clone(),
            baseline: self.baseline.clone(),
        }
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
        let file = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|source| StudyError::Read { file: file.clone(), source })?;
        Self::parse(&text, &file)
    }

    /// A study from text; `file` is its name in errors, and an experiment's file is looked for beside it.
    ///
    /// # Errors
    /// [`StudyError`] with line.
    pub fn parse(text: &str, file: &str) -> Result<Self, StudyError> {
        let apart = toml::from_str::<Glance>(text).is_ok_and(|glance| glance.experiment.contains_key("file"));
        let study = if apart {
            let study: StudyDocument<ExperimentPath> = super::parse(text, file)?;
            let path = Path::new(file).parent().unwrap_or_else(|| Path::new("")).join(&study.experiment.file);
            let experiment: ExperimentFile = super::read(&path)?;
            experiment.check(&path.display().to_string())?;
            study.with_experiment(experiment)
        } else {
            let study: StudyFile = super::parse(text, file)?;
            study.experiment.check(file)?;
            study
        };
        check_schema(study.schema.as_deref(), Self::SCHEMA, file)?;
        for section in std::iter::once(&study.estimate).chain(&study.also) {
            section.settings(file)?;
        }
        Ok(study)
    }

    /// What the fit is asked for.
    pub fn fit_settings(&self) -> FitSettings {
        FitSettings {
            model: self.fit.model.clone(),
            band_hz: self.fit.band_hz,
            cost: self.fit.cost,
            estimator: self.estimate.estimator,
            kinematics: self.kinematics.clone(),
            ..FitSettings::default()
        }
    }
}

impl<E> StudyDocument<E> {
    fn with_experiment<F>(self, experiment: F) -> StudyDocument<F> {
        let StudyDocument { schema, title, experiment: _, estimate, also, fit, kinematics, diagnose } = self;
        StudyDocument { schema, title, experiment, estimate, also, fit, kinematics, diagnose }
    }
}

impl EstimateSection {
    /// What the keys mean.
    ///
    /// # Errors
    /// [`StudyError::Meaning`] if there is no such window.
    pub fn settings(&self, file: &str) -> Result<EstimateSettings, StudyError> {
        let window = match &self.window {
            Some(name) => name.parse::<Window>().map_err(|error| StudyError::Meaning { file: file.to_owned(), what: error.to_string() })?,
            None => Window::default(),
        };
        Ok(EstimateSettings {
            method: self.method,
            nperseg: self.nperseg,
            noverlap: self.noverlap,
            nfft: self.nfft,
            window,
            window_symmetric: self.window_symmetric,
            detrend: self.detrend,
            time_bandwidth: self.time_bandwidth,
            order: self.order,
            period_s: self.period,
            estimator: self.estimator,
            response: self.response,
            band_hz: self.band.map(|[low, high]| (low, high)),
            spectra: self.spectra,
        })
    }
}
