//! Several channels made of several others by a matrix.

use super::PrepareError;
use ndof_signal::{Channel, Recording, Unit};

/// Replaces the channels `inputs` by `outputs`, of which the *i*-th is Σⱼ `matrix[i][j]` · `inputs[j]`: six strain
/// gauges into three forces and three torques, or a sensor's axes turned into the robot's.
///
/// The new channels stand where the first of the old ones stood.
///
/// # Errors
/// [`PrepareError::MatrixShape`] unless there is a row for each output with a column for each input,
/// [`PrepareError::NotFinite`] for an entry, [`PrepareError::Recording`] for an unknown channel or a name that repeats.
///
/// ```
/// use ndof_signal::{Channel, Quantity, Recording, Unit};
/// let gauges = ["g1", "g2"].map(|name| Channel::new(name, Unit::other("V"), vec![1.0, 2.0]));
/// let recording = Recording::new(10.0, gauges.into())?;
/// let newton = Unit::si(Quantity::Effort, false);
/// let forces = ndof_io::calibrate(&recording, &["g1", "g2"], &[vec![10.0, -4.0]], &[("force_x", newton)])?;
/// assert_eq!(forces.channel("force_x")?.samples, [6.0, 12.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn calibrate(recording: &Recording, inputs: &[&str], matrix: &[Vec<f64>], outputs: &[(&str, Unit)]) -> Result<Recording, PrepareError> {
    let shortest = matrix.iter().map(Vec::len).min().unwrap_or(0);
    if matrix.len() != outputs.len() || matrix.is_empty() || matrix.iter().any(|row| row.len() != inputs.len()) {
        return Err(PrepareError::MatrixShape { rows: matrix.len(), columns: shortest, outputs: outputs.len(), inputs: inputs.len() });
    }
    for (i, row) in matrix.iter().enumerate() {
        if let Some(j) = row.iter().position(|x| !x.is_finite()) {
            return Err(PrepareError::NotFinite { what: format!("entry [{i}][{j}] of the matrix"), value: row[j] });
        }
    }
    let indices = inputs.iter().map(|name| recording.index_of(name)).collect::<Result<Vec<_>, _>>()?;
    let columns = recording.columns(&indices);
    let mut made = Vec::with_capacity(outputs.len());
    for (row, (name, unit)) in matrix.iter().zip(outputs) {
        let samples = (0..recording.len()).map(|k| row.iter().zip(&columns).map(|(c, column)| c * column[k]).sum()).collect();
        made.push(Channel::new(*name, unit.clone(), samples));
    }
    let place = indices.iter().copied().min().unwrap_or(0);
    let mut channels = Vec::with_capacity(recording.channels().len() + made.len());
    for (i, channel) in recording.channels().iter().enumerate() {
        if i == place {
            channels.append(&mut made);
        }
        if !indices.contains(&i) {
            channels.push(channel.clone());
        }
    }
    Ok(recording.with_channels(channels)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::Quantity;

    fn recording() -> Recording {
        let newton = Unit::si(Quantity::Effort, false);
        let channel = |name: &str, samples: &[f64]| Channel::new(name, newton.clone(), samples.to_vec());
        let channels = vec![channel("emg", &[7.0; 3]), channel("force_x", &[1.0, 0.0, 2.0]), channel("force_y", &[0.0, 1.0, 3.0])];
        Recording::new(10.0, channels).unwrap().starting_at(2.0)
    }

    #[test]
    fn a_quarter_turn_swaps_the_axes_and_keeps_the_rest() {
        let newton = Unit::si(Quantity::Effort, false);
        let outputs = [("force_x", newton.clone()), ("force_y", newton)];
        let turned = calibrate(&recording(), &["force_x", "force_y"], &[vec![0.0, -1.0], vec![1.0, 0.0]], &outputs).unwrap();
        assert_eq!(turned.names(), ["emg", "force_x", "force_y"]);
        assert_eq!(turned.channels()[1].samples, [0.0, -1.0, -3.0]);
        assert_eq!(turned.channels()[2].samples, [1.0, 0.0, 2.0]);
        assert_eq!(turned.start_s(), 2.0);
    }

    #[test]
    fn a_matrix_that_does_not_fit_is_refused() {
        let outputs = [("f", Unit::other(""))];
        let error = calibrate(&recording(), &["force_x", "force_y"], &[vec![1.0]], &outputs).unwrap_err();
        assert!(matches!(error, PrepareError::MatrixShape { columns: 1, inputs: 2, .. }));
        assert!(calibrate(&recording(), &["force_x", "force_y"], &[vec![1.0, f64::NAN]], &outputs).is_err());
        assert!(calibrate(&recording(), &["force_x", "force_z"], &[vec![1.0, 1.0]], &outputs).is_err());
        assert!(calibrate(&recording(), &["force_x", "force_y"], &[vec![1.0, 1.0]], &[("emg", Unit::other(""))]).is_err());
    }
}
