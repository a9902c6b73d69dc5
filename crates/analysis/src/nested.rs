//! Arrays that JSON shows as nested lists, with `null` where a number does not exist.

use ndarray::{Array, ArrayViewD, Axis, Dimension, Ix2, Ix3, Ix4};
use serde::de::{DeserializeSeed, Deserializer, Error, SeqAccess, Visitor};
use serde::ser::{Serialize, SerializeSeq, Serializer};
use std::fmt;
use std::ops::Deref;

/// An array of numbers, NaN where there is none; in JSON lists of lists, with `null` there.
///
/// Of four axes the last holds the two ends of an interval, which is `null` as a whole where it does not exist.
///
/// ```
/// use ndof_analysis::result::Matrix;
///
/// let matrix = Matrix::from(ndarray::array![[1.0, f64::NAN], [f64::INFINITY, 4.0]]);
/// let text = serde_json::to_string(&matrix)?;
/// assert_eq!(text, "[[1.0,null],[null,4.0]]");
/// assert_eq!(serde_json::from_str::<Matrix>(&text)?, matrix);
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Nested<D: Dimension>(Array<f64, D>);

/// `[row][column]`.
pub type Matrix = Nested<Ix2>;
/// `[output][input][frequency]`.
pub type Spectrum = Nested<Ix3>;
/// Intervals `[output][input][frequency][end]`; `null` where there is none (of a phase: the full circle).
pub type IntervalSpectrum = Nested<Ix4>;

/// Axes of an array whose last is the two ends of an interval.
const OF_INTERVALS: usize = 4;

impl<D: Dimension> From<Array<f64, D>> for Nested<D> {
    fn from(mut array: Array<f64, D>) -> Self {
        array.mapv_inplace(|value| if value.is_finite() { value } else { f64::NAN });
        Nested(array)
    }
}

impl<D: Dimension> Deref for Nested<D> {
    type Target = Array<f64, D>;

    fn deref(&self) -> &Array<f64, D> {
        &self.0
    }
}

impl<D: Dimension> PartialEq for Nested<D> {
    fn eq(&self, other: &Self) -> bool {
        self.shape() == other.shape() && self.iter().zip(other.iter()).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()))
    }
}

impl<D: Dimension> Serialize for Nested<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        View(self.view().into_dyn(), self.ndim() == OF_INTERVALS).serialize(serializer)
    }
}

/// Part of an array, and whether it holds intervals.
struct View<'a>(ArrayViewD<'a, f64>, bool);

impl Serialize for View<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let View(values, intervals) = self;
        let mut list = serializer.serialize_seq(Some(values.shape()[0]))?;
        match (values.ndim(), intervals) {
            (1, _) => values.iter().try_for_each(|value| list.serialize_element(&value.is_finite().then_some(value)))?,
            (2, true) => {
                for ends in values.outer_iter() {
                    let pair = [ends[0], ends[1]];
                    list.serialize_element(&pair.iter().all(|end| end.is_finite()).then_some(pair))?;
                }
            }
            _ => values.axis_iter(Axis(0)).try_for_each(|part| list.serialize_element(&View(part, *intervals)))?,
        }
        list.end()
    }
}

/// Reads lists below `depth` of an array of this shape.
struct Part<'a> {
    depth: usize,
    shape: &'a mut [usize],
    values: &'a mut Vec<f64>,
}

impl<'de> DeserializeSeed<'de> for Part<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        let left = self.shape.len() - self.depth;
        match (left, self.shape.len()) {
            (0, _) => self.values.push(serde::Deserialize::deserialize(deserializer).map(|value: Option<f64>| value.unwrap_or(f64::NAN))?),
            (1, OF_INTERVALS) => {
                self.shape[self.depth] = 2;
                let ends: Option<[f64; 2]> = serde::Deserialize::deserialize(deserializer)?;
                self.values.extend(ends.unwrap_or([f64::NAN; 2]));
            }
            _ => deserializer.deserialize_seq(self)?,
        }
        Ok(())
    }
}

impl<'de> Visitor<'de> for Part<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        let (first, mut count) = (self.values.is_empty(), 0);
        while list.next_element_seed(Part { depth: self.depth + 1, shape: &mut *self.shape, values: &mut *self.values })?.is_some() {
            count += 1;
        }
        let known = self.shape[self.depth];
        if !first && known != count {
            return Err(A::Error::custom(format!("lists of {known} and of {count} beside each other; all must be of one length")));
        }
        self.shape[self.depth] = count;
        Ok(())
    }
}

impl<'de, D: Dimension> serde::Deserialize<'de> for Nested<D> {
    fn deserialize<S: Deserializer<'de>>(deserializer: S) -> Result<Self, S::Error> {
        let mut shape = D::zeros(D::NDIM.unwrap_or(0));
        let mut values = Vec::new();
        Part { depth: 0, shape: shape.slice_mut(), values: &mut values }.deserialize(deserializer)?;
        Array::from_shape_vec(shape, values).map(Nested).map_err(S::Error::custom)
    }
}

#[cfg(feature = "schema")]
impl<D: Dimension> schemars::JsonSchema for Nested<D> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Nested".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        match D::NDIM {
            Some(OF_INTERVALS) => <Vec<Vec<Vec<Option<[f64; 2]>>>>>::json_schema(generator),
            Some(3) => <Vec<Vec<Vec<Option<f64>>>>>::json_schema(generator),
            _ => <Vec<Vec<Option<f64>>>>::json_schema(generator),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_are_nested_lists_and_come_back() {
        let mut ends = ndarray::Array4::from_shape_fn((1, 2, 3, 2), |(_, j, f, end)| (10 * j + 2 * f + end) as f64);
        ends[[0, 1, 2, 0]] = f64::NAN;
        let intervals = IntervalSpectrum::from(ends);
        let text = serde_json::to_string(&intervals).expect("JSON");
        assert_eq!(text, "[[[[0.0,1.0],[2.0,3.0],[4.0,5.0]],[[10.0,11.0],[12.0,13.0],null]]]");
        let back: IntervalSpectrum = serde_json::from_str(&text).expect("an array");
        assert!(back[[0, 1, 2, 1]].is_nan() && back.dim() == (1, 2, 3, 2));
        assert_eq!(serde_json::to_string(&back).expect("JSON"), text);
        let spectrum: Spectrum = serde_json::from_str("[[[1.0,null]],[[2.0,3.0]]]").expect("an array");
        assert_eq!(spectrum.dim(), (2, 1, 2));
    }

    #[test]
    fn lists_of_different_lengths_are_refused_and_empty_ones_are_empty() {
        assert!(serde_json::from_str::<Matrix>("[[1.0,2.0],[3.0]]").unwrap_err().to_string().contains("one length"));
        assert!(serde_json::from_str::<Matrix>("[[],[3.0]]").is_err());
        assert_eq!(serde_json::from_str::<Matrix>("[]").expect("empty").dim(), (0, 0));
        assert_eq!(serde_json::from_str::<Spectrum>("[[[],[]]]").expect("empty").dim(), (1, 2, 0));
    }
}
