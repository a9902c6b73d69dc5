//! Arrays of a response by pair of output and input, as files give them.

use super::table::ResponseTable;
use num_complex::Complex;

/// Frequencies of one file, and numbers of a response: bounds before memory is taken.
pub(super) const MAX_VALUES: usize = 1 << 26;

/// One pair's values as they are read.
#[derive(Clone, Debug, Default)]
pub(super) struct Pair {
    pub output: String,
    pub input: String,
    pub output_unit: String,
    pub input_unit: String,
    pub values: Vec<Complex<f64>>,
    pub std: Option<Vec<f64>>,
    pub coherence: Option<Vec<f64>>,
}

/// The response of all pairs, outputs and inputs in their order; what is missing, in words.
pub(super) fn response(frequency_hz: Vec<f64>, pairs: Vec<Pair>) -> Result<ResponseTable, String> {
    let mut table = ResponseTable::default();
    for pair in &pairs {
        if !table.outputs.contains(&pair.output) {
            table.outputs.push(pair.output.clone());
            table.output_units.push(pair.output_unit.clone());
        }
        if !table.inputs.contains(&pair.input) {
            table.inputs.push(pair.input.clone());
            table.input_units.push(pair.input_unit.clone());
        }
    }
    let count = table.outputs.len().saturating_mul(table.inputs.len());
    if count.saturating_mul(frequency_hz.len()) > MAX_VALUES {
        return Err(format!("a response of {count} pairs and {} frequencies is larger than is read here", frequency_hz.len()));
    }
    let find = |o: &String, i: &String| pairs.iter().find(|p| p.output == *o && p.input == *i);
    let grid: Option<Vec<Vec<&Pair>>> = table.outputs.iter().map(|o| table.inputs.iter().map(|i| find(o, i)).collect()).collect();
    let Some(grid) = grid else {
        let missing = table.outputs.iter().flat_map(|o| table.inputs.iter().map(move |i| (o, i))).find(|(o, i)| find(o, i).is_none());
        return Err(missing.map_or_else(String::new, |(o, i)| format!("there is no response of \"{o}\" to \"{i}\", and every output goes with every input")));
    };
    if pairs.len() != count {
        return Err("a pair of output and input is there twice".to_owned());
    }
    let real = |of: fn(&Pair) -> &Option<Vec<f64>>| {
        let nothing = || vec![f64::NAN; frequency_hz.len()];
        let any = pairs.iter().any(|p| of(p).is_some());
        any.then(|| grid.iter().map(|row| row.iter().map(|p| of(p).clone().unwrap_or_else(nothing)).collect()).collect())
    };
    (table.std, table.coherence) = (real(|p| &p.std), real(|p| &p.coherence));
    table.values = grid.iter().map(|row| row.iter().map(|p| p.values.clone()).collect()).collect();
    table.frequency_hz = frequency_hz;
    Ok(table)
}
