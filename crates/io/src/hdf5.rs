//! HDF5 and MAT v7.3: one vector of numbers a channel, in any group.
//!
//! A channel's unit is its attribute `unit` or `units`; `sample_rate_hz` or `fs` is a single number or an attribute of
//! a group, or there is a vector `t`. Other texts and numbers that stand alone are facts.

use crate::arrays::{Entry, Value};
use crate::error::IoError;
use crate::limits::{Budget, MAX_ENTRIES};
use crate::table::{Rounding, Table};
use crate::trials;
use hdf5_pure::{AttrValue, DType, Dataset, Error, File, Group, Layout, Object};
use std::collections::BTreeMap;

/// The format's name in messages.
const HDF5: &str = "HDF5";

/// Groups within groups; a link may lead back to where it came from.
const MAX_DEPTH: usize = 16;

/// What MATLAB writes beside each variable.
const MATLAB_CLASS: &str = "MATLAB_class";

/// Reads an HDF5 file.
pub(crate) fn read(bytes: &[u8], file: &str) -> Result<Vec<Table>, IoError> {
    let damaged = |e: Error| IoError::Damaged { file: file.to_owned(), format: HDF5, what: e.to_string() };
    let opened = File::from_bytes(bytes.to_vec()).map_err(damaged)?;
    let mut walk = Walk { file, budget: Budget::of(bytes.len()), groups: 0, entries: Vec::new() };
    walk.group(&opened.root(), &mut Vec::new())?;
    trials::tables(file, walk.entries)
}

struct Walk<'a> {
    file: &'a str,
    budget: Budget,
    /// Groups visited; links that lead back would make them endless.
    groups: usize,
    entries: Vec<Entry>,
}

impl Walk<'_> {
    fn damaged(&self, path: &[String], error: &Error) -> IoError {
        IoError::Damaged { file: self.file.to_owned(), format: HDF5, what: format!("/{}: {error}", path.join("/")) }
    }

    fn group(&mut self, group: &Group, path: &mut Vec<String>) -> Result<(), IoError> {
        self.groups += 1;
        for (what, found, limit) in
            [("groups within groups", path.len(), MAX_DEPTH), ("groups", self.groups, MAX_ENTRIES), ("arrays and attributes", self.entries.len(), MAX_ENTRIES)]
        {
            if found > limit {
                return Err(IoError::too_large(self.file, what, found, limit, "save the channels in one group"));
            }
        }
        let attributes = group.attrs().map_err(|e| self.damaged(path, &e))?;
        // In the order of their names, so that the same file gives the same result.
        for (name, value) in attributes.iter().collect::<BTreeMap<_, _>>().into_iter().filter(|(name, _)| !name.starts_with("MATLAB_")) {
            if let Some(value) = fact(value) {
                self.entries.push(Entry::new([path.as_slice(), std::slice::from_ref(name)].concat(), value));
            }
        }
        let datasets: Vec<(String, Dataset)> = group.iter_datasets().map_err(|e| self.damaged(path, &e))?.collect();
        if attributes.get(MATLAB_CLASS).and_then(AttrValue::as_str) == Some("struct") && self.elements(&datasets, path)? {
            return Ok(());
        }
        for (name, dataset) in datasets {
            path.push(name);
            let entry = self.dataset(&dataset, path)?;
            self.entries.extend(entry);
            path.pop();
        }
        for name in group.groups().map_err(|e| self.damaged(path, &e))? {
            // MATLAB keeps what its cells refer to here.
            if name.starts_with('#') {
                continue;
            }
            let inner = group.group(&name).map_err(|e| self.damaged(path, &e))?;
            path.push(name);
            self.group(&inner, path)?;
            path.pop();
        }
        Ok(())
    }

    /// Reads an array of MATLAB structs, whose fields are references, as groups `name_1`, `name_2` …; false if it is none.
    fn elements(&mut self, fields: &[(String, Dataset)], path: &mut Vec<String>) -> Result<bool, IoError> {
        let is_list = |dataset: &Dataset| {
            let cell = dataset.attrs().is_ok_and(|a| a.contains_key(MATLAB_CLASS));
            !cell
                && matches!(dataset.dtype(), Ok(DType::ObjectReference))
                && dataset.shape().is_ok_and(|s| s.iter().fold(1, |n: u64, s| n.saturating_mul(*s)) <= MAX_ENTRIES as u64)
        };
        let Some(name) = path.last().cloned().filter(|_| !fields.is_empty() && fields.iter().all(|(_, field)| is_list(field))) else { return Ok(false) };
        for (field, list) in fields {
            let found = list.dereference().map_err(|e| self.damaged(path, &e))?;
            for (k, object) in found.iter().enumerate() {
                path.pop();
                path.push(format!("{name}_{}", k + 1));
                path.push(field.clone());
                match object {
                    Object::Dataset(dataset) => {
                        let entry = self.dataset(dataset, path)?;
                        self.entries.extend(entry);
                    }
                    Object::Group(group) => self.group(group, path)?,
                    _ => {}
                }
                path.pop();
                if self.entries.len() > MAX_ENTRIES {
                    break;
                }
            }
            path.pop();
            path.push(name.clone());
        }
        Ok(true)
    }

    fn dataset(&mut self, dataset: &Dataset, path: &[String]) -> Result<Option<Entry>, IoError> {
        let damaged = |walk: &Self, e: Error| walk.damaged(path, &e);
        let attributes = dataset.attrs().map_err(|e| damaged(self, e))?;
        if attributes.contains_key("MATLAB_empty") {
            return Ok(None);
        }
        let entry = |value| Some(Entry::new(path.to_vec(), value));
        if attributes.contains_key("MATLAB_object_decode") {
            return Ok(entry(Value::Other("a MATLAB object; a timetable is read after `s = timetable2table(tt); s = table2struct(s, ToScalar=true)`")));
        }
        let (Ok(kind), Ok(shape)) = (dataset.dtype(), dataset.shape()) else {
            return Ok(entry(Value::Other("a type that is not known here")));
        };
        let claimed =
            [shape, dataset.chunk_shape().ok().flatten().unwrap_or_default()].map(|sizes| sizes.iter().try_fold(8u64, |n, &size| n.checked_mul(size)));
        for bytes in claimed {
            self.budget.claim(self.file, bytes.unwrap_or(u64::MAX))?;
        }
        let shape: Vec<usize> = dataset.shape().map_err(|e| damaged(self, e))?.into_iter().map(|n| n as usize).collect();
        let is_char = attributes.get(MATLAB_CLASS).and_then(AttrValue::as_str) == Some("char");
        let rounding = match kind {
            DType::F64 => Rounding::default(),
            DType::F32 => Rounding::SINGLE,
            DType::U16 if is_char => {
                let text = String::from_utf16(&dataset.read_u16().map_err(|e| damaged(self, e))?);
                return Ok(entry(text.map_or(Value::Other("text that is not Unicode"), Value::Text)));
            }
            DType::I8 | DType::I16 | DType::I32 | DType::I64 | DType::U8 | DType::U16 | DType::U32 | DType::U64 => Rounding::INTEGER,
            DType::String | DType::VariableLengthString => {
                let texts = dataset.read_string().map_err(|e| damaged(self, e))?;
                return Ok(entry(<[String; 1]>::try_from(texts).map_or(Value::Other("several texts"), |[text]| Value::Text(text))));
            }
            DType::Compound(_) => return Ok(entry(Value::Other("compound or complex values"))),
            _ => return Ok(entry(Value::Other("no plain numbers"))),
        };
        if let Some(what) = unwritten(dataset, &shape) {
            return Err(IoError::Damaged { file: self.file.to_owned(), format: HDF5, what: format!("/{}: {what}", path.join("/")) });
        }
        let values = dataset.read_f64().map_err(|e| damaged(self, e))?;
        let unit = ["unit", "units", "Unit", "Units"].iter().find_map(|key| attributes.get(*key)?.as_str()).map(str::to_owned);
        Ok(Some(Entry { unit, ..Entry::new(path.to_vec(), Value::Numbers { shape, values, rounding }) }))
    }
}

/// What of an array was reserved and never written, as when a recording was broken off: HDF5 gives zeros for it.
fn unwritten(dataset: &Dataset, shape: &[usize]) -> Option<String> {
    match dataset.layout().ok()? {
        Layout::Contiguous { address: None, size } if size > 0 => Some(format!("its {size} bytes were never written")),
        Layout::Chunked { chunk_shape, .. } => {
            let found = dataset.chunks().ok()?.len();
            let expected = shape.iter().zip(&chunk_shape).map(|(&n, &c)| n.div_ceil((c as usize).max(1))).fold(1, usize::saturating_mul);
            (found < expected).then(|| format!("{} of its {expected} chunks were never written", expected - found))
        }
        _ => None,
    }
}

/// An attribute that is a single text or number.
fn fact(value: &AttrValue) -> Option<Value> {
    let number = value.as_f64().or_else(|| value.as_i64().map(|whole| whole as f64));
    let Some(number) = number else { return value.as_str().map(|text| Value::Text(text.to_owned())) };
    Some(Value::Numbers { shape: Vec::new(), values: vec![number], rounding: Rounding::default() })
}
