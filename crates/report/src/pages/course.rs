//! A response that changes with time or over a cycle.

use super::convert::{quantity, unit};
use crate::Section;
use crate::figures::{self, Course, FigureError};
use ndarray::Array3;
use ndof_analysis::estimate::result::EstimateResult;
use ndof_analysis::log_spaced;

/// Frequencies at which slices are shown.
const SLICES: usize = 4;

/// The surface from above, slices and coherence; nothing where no course was asked for.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn course_section(result: &EstimateResult) -> Result<Option<Section>, FigureError> {
    let Some(course) = &result.course else { return Ok(None) };
    let rotational = result.units.are_rotational();
    let axis = if course.cycle_s.is_some() { "Time in the cycle" } else { "Time" };
    let gain = course.response.iter().map(|response| {
        let end = |end: usize| Array3::from_shape_fn(response.re.dim(), |(i, j, f)| response.gain_ci95[[i, j, f, end]]);
        [response.gain(), end(0), end(1)]
    });
    let data = Course {
        quantity: quantity(result.response),
        unit: unit(result.response, rotational).to_owned(),
        axis: (axis.to_owned(), "s".to_owned()),
        at: course.time_s.clone(),
        frequency_hz: course.frequency_hz.clone(),
        inputs: result.inputs.clone(),
        outputs: result.outputs.clone(),
        gain: gain.collect(),
    };
    let at = log_spaced(&course.known(), &course.frequency_hz, SLICES);
    let (places, outputs) = (course.multiple_coherence.len(), course.multiple_coherence.first().map_or(0, |c| c.dim().0));
    let coherence = Array3::from_shape_fn((places, outputs, course.frequency_hz.len()), |(place, i, f)| course.multiple_coherence[place][[i, f]]);
    let lead = match course.cycles {
        Some(cycles) => format!(
            "The {} estimate in windows of {} s about the same phase of {cycles} cycles, the mean movement taken out.",
            course.estimate, course.window_s
        ),
        None => format!("The {} estimate in windows of {} s.", course.estimate, course.window_s),
    };
    let mut section = Section::new("What changes", lead);
    if !at.is_empty() {
        section = section.figure(figures::course_surface(&data)?).figure(figures::course_slices(&data, &at)?);
        section = section.figure(figures::course_coherence(&data, &coherence, &at)?);
    }
    Ok(Some(section))
}
