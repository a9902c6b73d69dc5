//! A frequency response that was measured elsewhere, and one that goes to another program.

use crate::error::AnalysisError;
use crate::estimate::{Estimated, to_displacement};
use crate::result::Warning;
use crate::trials::{RoleNames, Roles, Trial, Trials};
use ndarray::{Array3, Axis};
use ndof_io::ResponseTable;
use ndof_signal::{Channel, Kernel, Quantity, Recording, Unit};
use ndof_sysid::{FrequencyResponse, ResponseKind, Uncertainty};
use num_complex::Complex64;
use std::collections::BTreeMap;

/// Degrees of freedom of standard errors that come without them: so many that they count as known.
const KNOWN: f64 = 1e6;

/// Standard errors are the product of one of the output and one of the input, as those of every estimate here, to this share.
const PRODUCT: f64 = 0.01;

/// A frequency response that was measured elsewhere, in SI units.
#[derive(Clone, Debug)]
pub struct MeasuredResponse {
    /// What messages call it.
    pub file: String,
    /// The response, brought to displacement; with the relative sizes of its errors where the file does not tell them.
    pub response: FrequencyResponse,
    /// The kind that the channels make it.
    pub kind: ResponseKind,
    /// Coherence γ² by `[frequency][output][input]`; 1 where the file has none.
    pub coherence: Array3<f64>,
    /// Whether the sizes of the errors are known; else they follow from what a model leaves.
    pub errors_known: bool,
    /// What the reader should know.
    pub warnings: Vec<Warning>,
    /// The channels with their roles, without samples.
    pub(crate) channels: Trials,
}

impl MeasuredResponse {
    /// Finds out what the channels of a response are, by units, then by prefixes; without either it is displacement over effort.
    ///
    /// Errors are the standard errors that the file gives; else they follow from coherence, E|δH|² = |H|² (1 − γ²) / (n γ²) (Bendat &
    /// Piersol 2010, section 9.2), where `averages` in the metadata is n; else only their relative sizes are known, those of coherence or
    /// of the magnitude.
    ///
    /// # Errors
    /// [`AnalysisError`] if units are not those of effort and motion or arrays do not fit.
    ///
    /// ```
    /// let csv = b"# unit/pos_x: mm\nfrequency_hz,re_pos_x_force_x,im_pos_x_force_x\n1.0,5.0,0.0\n2.0,5.5,0.0\n";
    /// let table = ndof_io::read_response_bytes(csv, "frf.csv")?;
    /// let measured = ndof_analysis::MeasuredResponse::of(&table, "frf.csv")?;
    /// assert!((measured.response.value[[0, 0, 0]].re - 0.005).abs() < 1e-15); // m/N
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn of(table: &ResponseTable, file: &str) -> Result<Self, AnalysisError> {
        let wrong = |what: String| AnalysisError::Meaning { file: file.to_owned(), what };
        table.check().map_err(wrong)?;
        let (channels, factors) = channels(table, file)?;
        let ports = &channels.roles.ports;
        let place = |names: &[String], channel: usize| names.iter().position(|name| *name == channels.names(&[channel])[0]).unwrap_or(0);
        let rows: Vec<usize> = ports.outputs.iter().map(|&channel| place(&table.outputs, channel)).collect();
        let columns: Vec<usize> = ports.inputs.iter().map(|&channel| place(&table.inputs, channel)).collect();
        let scale = |i: usize, j: usize| factors[table.inputs.len() + rows[i]] / factors[columns[j]];
        let shape = (table.frequency_hz.len(), rows.len(), columns.len());
        let real = |part: &[Vec<Vec<f64>>]| Array3::from_shape_fn(shape, |(f, i, j)| part[rows[i]][columns[j]][f]);
        let value = Array3::from_shape_fn(shape, |(f, i, j)| table.values[rows[i]][columns[j]][f] * scale(i, j));
        let coherence = table.coherence.as_deref().map(real);
        let std = table.std.as_deref().map(|part| real(part) * Array3::from_shape_fn(shape, |(_, i, j)| scale(i, j).abs()));
        let number = |key: &str| table.metadata.get(key).and_then(|text| text.parse::<f64>().ok()).filter(|value| value.is_finite() && *value > 0.0);
        let averages = number("averages");
        let mut warnings = channels.warnings.clone();
        let variance = match (&std, &coherence) {
            (Some(std), _) => std.mapv(|std| 2.0 * std * std.max(0.0)),
            (None, Some(coherence)) => {
                // What n averages show of two signals that have nothing in common; a file may have rounded it to none.
                let least = averages.map_or(f64::EPSILON, |n| 1.0 / n).min(1.0);
                let relative = coherence.mapv(|c| {
                    let c = if c < least { least } else { c };
                    (1.0 - c).max(f64::EPSILON) / c / averages.unwrap_or(1.0)
                });
                relative * value.mapv(|h: Complex64| h.norm_sqr())
            }
            (None, None) => value.mapv(|h| h.norm_sqr()),
        };
        let errors_known = std.is_some() || (coherence.is_some() && averages.is_some());
        if !errors_known {
            warnings.push(Warning::new(
                "errors-unknown",
                format!("{file} says nothing of the size of its errors: intervals follow from what the model leaves, and nothing tells whether that is noise"),
                "add columns std_OUT_IN, or coherence_OUT_IN with a line `# averages: N`",
            ));
        }
        let spacing = number("independent_spacing_hz");
        if errors_known && spacing.is_none() {
            warnings.push(Warning::new(
                "frequencies-taken-as-independent",
                format!("{file} does not say how far apart its frequencies are independent: each counts as news, and if segments overlapped or were padded, intervals are too narrow"),
                "add a line `# independent_spacing_hz: HZ`, or take the CSV that `ndof estimate --out` writes",
            ));
        }
        let uncertainty = Uncertainty {
            degrees_of_freedom: number("degrees_of_freedom").unwrap_or(KNOWN),
            independent_spacing_hz: spacing.unwrap_or(0.0),
            kernel: Kernel::default(),
            unexplained: None,
            inverted: false,
            ..product_form(&variance, &mut warnings, std.is_some(), file)
        };
        let kind = channels.roles.natural_kind();
        if kind == ResponseKind::Transfer {
            return Err(wrong(format!(
                "outputs {} over inputs {} are not motion over force or the other way round; say so by names (pos_x, force_x) or by lines `# unit/NAME: UNIT`",
                table.outputs.join(", "),
                table.inputs.join(", ")
            )));
        }
        let mut response = FrequencyResponse {
            frequency_hz: table.frequency_hz.clone(),
            inputs: channels.names(&ports.inputs),
            outputs: channels.names(&ports.outputs),
            kind,
            value,
            uncertainty: Some(uncertainty),
        };
        to_displacement(&mut response, &channels);
        let coherence = coherence.unwrap_or_else(|| Array3::ones(shape));
        Ok(MeasuredResponse { file: file.to_owned(), response, kind: channels.roles.default_kind(), coherence, errors_known, warnings, channels })
    }
}

impl MeasuredResponse {
    /// Whether its motion is a rotation.
    pub fn is_rotational(&self) -> bool {
        let ports = &self.channels.roles.ports;
        self.channels.channels(&ports.inputs).iter().chain(&self.channels.channels(&ports.outputs)).any(|channel| channel.unit.is_rotational())
    }
}

/// The channels of a response, inputs first, with their roles, and the factors from the file's units to SI.
fn channels(table: &ResponseTable, file: &str) -> Result<(Trials, Vec<f64>), AnalysisError> {
    let mut factors = Vec::new();
    let names = table.inputs.iter().zip(&table.input_units).chain(table.outputs.iter().zip(&table.output_units));
    let mut all = Vec::new();
    for (name, symbol) in names {
        let (unit, factor) = match symbol.trim() {
            "" => (ndof_io::infer_unit(name).unwrap_or_else(|| Unit::other("")), 1.0),
            symbol => Unit::parse(symbol).map_err(|error| AnalysisError::Meaning { file: file.to_owned(), what: format!("channel \"{name}\": {error}") })?,
        };
        factors.push(factor);
        all.push(Channel::new(name, unit, Vec::new()));
    }
    let wrap = |source| AnalysisError::Recording { file: file.to_owned(), source };
    let recording = Recording::new(1.0, all).map_err(wrap)?;
    let names = RoleNames { references: Some(Vec::new()), inputs: Some(table.inputs.clone()), outputs: Some(table.outputs.clone()), ..RoleNames::default() };
    let roles = Roles::find(&recording, file, &names)?;
    let mut warnings = roles.warnings.clone();
    let silent: Vec<&str> =
        recording.channels().iter().filter(|channel| channel.unit.quantity() == Quantity::Other).map(|channel| channel.name.as_str()).collect();
    if !silent.is_empty() {
        warnings.push(Warning::new(
            "unit-inferred",
            format!("{file} says nothing of the unit of {}: inputs are taken as forces in N, outputs as displacements in m", silent.join(", ")),
            "write lines `# unit/NAME: UNIT` above the names, or names with the prefixes force_, torque_, pos_, angle_",
        ));
    }
    Ok((Trials { trials: vec![Trial::of(file, recording)].into(), roles, warnings }, factors))
}

/// Variances as the product of one of the output and one of the input, by the least squares of their logarithms; correlations between
/// channels, which no file of a response holds, are zero.
fn product_form(variance: &Array3<f64>, warnings: &mut Vec<Warning>, given: bool, file: &str) -> Uncertainty {
    let (frequencies, p, q) = variance.dim();
    let mut noise = Array3::from_elem((frequencies, p, p), Complex64::default());
    let mut input_inverse = Array3::from_elem((frequencies, q, q), Complex64::default());
    let (mut apart, mut unknown): (f64, usize) = (0.0, 0);
    for (f, of) in variance.axis_iter(Axis(0)).enumerate() {
        if !of.iter().all(|v| v.is_normal() && *v > 0.0) {
            // Without a variance it has no weight; an error of zero would have all of it.
            noise.index_axis_mut(Axis(0), f).fill(Complex64::new(f64::NAN, 0.0));
            unknown += 1;
            continue;
        }
        let logarithm = of.mapv(f64::ln);
        let mean = logarithm.mean().unwrap_or(0.0);
        let (rows, columns) = (logarithm.mean_axis(Axis(1)), logarithm.mean_axis(Axis(0)));
        let (Some(rows), Some(columns)) = (rows, columns) else { continue };
        rows.iter().enumerate().for_each(|(i, row)| noise[[f, i, i]] = (*row - mean).exp().into());
        columns.iter().enumerate().for_each(|(j, column)| input_inverse[[f, j, j]] = column.exp().into());
        apart = logarithm.indexed_iter().map(|((i, j), v)| ((v - rows[i] - columns[j] + mean) / 2.0).abs()).fold(apart, f64::max);
    }
    if unknown > 0 {
        warnings.push(Warning::new(
            "errors-missing",
            format!("{file} gives no error above zero at {unknown} of {frequencies} frequencies, which are left out of every fit"),
            "write the standard errors there, or the coherence between 0 and 1",
        ));
    }
    if given && apart > PRODUCT {
        warnings.push(Warning::new(
            "errors-approximated",
            format!(
                "the standard errors of {file} are not the product of one of the output and one of the input; they are taken so, off by up to {:.0} %",
                100.0 * apart.exp_m1()
            ),
            "fit the elements one by one where that matters",
        ));
    }
    Uncertainty { noise, input_inverse, degrees_of_freedom: KNOWN, independent_spacing_hz: 0.0, kernel: Kernel::default(), unexplained: None, inverted: false }
}

impl Estimated {
    /// The response of the kind that is reported, within the band, as a table for a file: gains' standard errors and partial coherences
    /// with it, and how it was estimated among its metadata.
    pub fn response_table(&self) -> ResponseTable {
        let (result, best) = (&self.result, self.best());
        let [low_hz, high_hz] = result.settings.reported_hz();
        let response = best.band(low_hz, high_hz);
        let (shown, coherence) = match &result.derived {
            Some(derived) => (&derived.response, &derived.coherence_paper),
            None => (&result.direct.response, &result.direct.coherence),
        };
        let (p, q) = response.shape();
        let nested = |of: &dyn Fn(usize, usize, usize) -> f64| -> Vec<Vec<Vec<f64>>> {
            (0..p).map(|i| (0..q).map(|j| (0..response.len()).map(|f| of(i, j, f)).collect()).collect()).collect()
        };
        let values = (0..p).map(|i| (0..q).map(|j| (0..response.len()).map(|f| response.value[[f, i, j]]).collect()).collect()).collect();
        let facts = [
            ("response", crate::result::word(&response.kind)),
            ("estimate", if result.derived.is_some() { "derived" } else { "direct" }.to_owned()),
            ("method", result.method.name.clone()),
            ("averages", result.method.effective_averages.to_string()),
            ("degrees_of_freedom", response.uncertainty.as_ref().map_or(f64::NAN, |u| u.degrees_of_freedom).to_string()),
            ("independent_spacing_hz", result.method.independent_spacing_hz.to_string()),
        ];
        let (inputs, outputs) = response_units(response.kind, &result.units.inputs, &result.units.outputs);
        ResponseTable {
            outputs: result.outputs.clone(),
            inputs: result.inputs.clone(),
            output_units: outputs,
            input_units: inputs,
            frequency_hz: response.frequency_hz.clone(),
            values,
            std: response.uncertainty.is_some().then(|| nested(&|i, j, f| shown.gain_std_error[[i, j, f]])),
            coherence: Some(nested(&|i, j, f| coherence.partial[[i, j, f]])),
            metadata: facts.into_iter().map(|(key, value)| (key.to_owned(), value)).collect::<BTreeMap<_, _>>(),
        }
    }
}

/// Units of inputs and outputs of a response of this kind: motion is displacement, or velocity where the kind says so.
fn response_units(kind: ResponseKind, inputs: &[String], outputs: &[String]) -> (Vec<String>, Vec<String>) {
    let motion = match kind {
        ResponseKind::Transfer => return (inputs.to_vec(), outputs.to_vec()),
        ResponseKind::Impedance | ResponseKind::Admittance => Quantity::Velocity,
        ResponseKind::Compliance | ResponseKind::DynamicStiffness => Quantity::Displacement,
    };
    let of = |symbols: &[String]| {
        let unit = |symbol: &String| match Unit::parse(symbol) {
            Ok((unit, _)) if matches!(unit.quantity(), Quantity::Displacement | Quantity::Velocity | Quantity::Acceleration) => {
                Unit::si(motion, unit.is_rotational()).symbol().to_owned()
            }
            _ => symbol.clone(),
        };
        symbols.iter().map(unit).collect()
    };
    (of(inputs), of(outputs))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(csv: &str) -> MeasuredResponse {
        let table = ndof_io::read_response_bytes(csv.as_bytes(), "frf.csv").expect("a table");
        MeasuredResponse::of(&table, "frf.csv").expect("a response")
    }

    fn noise(measured: &MeasuredResponse, f: usize, i: usize) -> f64 {
        measured.response.uncertainty.as_ref().expect("errors").noise[[f, i, i]].re
    }

    /// An error of zero is no error that anybody has measured: with it, one frequency would decide the fit.
    #[test]
    fn a_frequency_without_an_error_has_no_weight_and_that_is_said() {
        let rows = ["1,0.01,0,0.001", "2,0.02,0,0", "3,0.01,0,-1", "4,0.01,0,0.002"].join("\n");
        let found = measured(&format!("# unit/x: m\n# unit/f: N\nfrequency_hz,re_x_f,im_x_f,std_x_f\n{rows}\n"));
        assert_eq!([0, 1, 2, 3].map(|f| noise(&found, f, 0).is_finite()), [true, false, false, true]);
        let said = found.warnings.iter().find(|warning| warning.code == "errors-missing").expect("a warning");
        assert!(said.message.contains("at 2 of 4 frequencies"), "{}", said.message);
    }

    /// Of two signals that have nothing in common, 25 averages show a coherence of 1/25; a file may round less than that to nothing.
    #[test]
    fn a_coherence_of_zero_does_not_take_the_rest_of_its_frequency_along() {
        let head = "# averages: 25\n# unit/x: m\n# unit/y: m\n# unit/f: N\n# unit/g: N\n";
        let of = |name: &str| format!("re_{name},im_{name},coherence_{name}");
        let names = ["x_f", "x_g", "y_f", "y_g"].map(of).join(",");
        let with = |cross: f64| measured(&format!("{head}frequency_hz,{names}\n1,0.01,0,0.9,0.001,0,{cross},0.001,0,0.5,0.01,0,0.9\n"));
        let (none, least) = (with(0.0), with(0.04));
        assert!(noise(&none, 0, 0).is_normal() && noise(&none, 0, 1).is_normal());
        assert_eq!([0, 1].map(|i| noise(&none, 0, i)), [0, 1].map(|i| noise(&least, 0, i)));
    }
}
