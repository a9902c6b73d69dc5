//! A MATLAB variable into named arrays: numbers, texts, and structs of them.

use super::element::{Element, Elements, MATRIX, numbers, text};
use crate::arrays::{Entry, Value, in_c_order};
use crate::error::IoError;
use crate::limits::{Budget, MAX_ENTRIES};
use crate::names::MAX_NAME;
use crate::table::Rounding;

/// Structs within structs; files nest two or three deep.
const MAX_DEPTH: usize = 16;

/// MATLAB's numbers for its classes.
const STRUCT: u8 = 2;
const CHAR: u8 = 4;
const DOUBLE: u8 = 6;
const SINGLE: u8 = 7;
const LAST_INTEGER: u8 = 15;
const OPAQUE: u8 = 17;

/// The flag of complex numbers.
const COMPLEX: u8 = 0x08;

/// Why a variable is not read.
#[derive(Debug)]
pub(super) enum Problem {
    /// It is damaged.
    Damaged(String),
    /// It is larger than is allowed.
    Limit(IoError),
}

impl From<String> for Problem {
    fn from(what: String) -> Self {
        Problem::Damaged(what)
    }
}

/// Where the arrays of a file are gathered.
pub(super) struct Matrices<'a> {
    pub file: &'a str,
    pub big: bool,
    pub budget: &'a mut Budget,
    pub entries: &'a mut Vec<Entry>,
}

impl Matrices<'_> {
    /// Reads a variable.
    pub fn read(&mut self, data: &[u8]) -> Result<(), Problem> {
        self.matrix(data, None, &mut Vec::new())
    }

    /// Reads a matrix under `name`, or under its own.
    fn matrix(&mut self, data: &[u8], name: Option<&str>, path: &mut Vec<String>) -> Result<(), Problem> {
        if data.is_empty() {
            return Ok(());
        }
        let mut parts = Elements::new(data, self.big);
        let flags = parts.required("array flags")?;
        let (class, complex) = self.flags(flags)?;
        if class == OPAQUE {
            let own = text(parts.required("name")?, self.big).unwrap_or_default();
            self.add(path, name.unwrap_or(&own), Value::Other("a MATLAB object"));
            return Ok(());
        }
        let shape = self.shape(parts.required("size")?)?;
        let own = text(parts.required("name")?, self.big).ok_or_else(|| "its name is no text".to_owned())?;
        let name = name.unwrap_or(&own);
        if name.is_empty() {
            return Ok(());
        }
        if name.len() > MAX_NAME {
            return Err(format!("its name has {} bytes", name.len()).into());
        }
        let count = shape.iter().try_fold(1usize, |n, &size| n.checked_mul(size)).ok_or_else(|| format!("{name}: its size is larger than any memory"))?;
        let value = match class {
            STRUCT if (1..=MAX_ENTRIES).contains(&count) => return self.fields(parts, name, count, path),
            STRUCT => Value::Other("an empty array of structs"),
            DOUBLE..=LAST_INTEGER if complex => Value::Other("complex numbers"),
            DOUBLE..=LAST_INTEGER => {
                self.budget.claim(self.file, 8 * (count as u64).min(u64::MAX / 8)).map_err(Problem::Limit)?;
                let values = numbers(parts.required("real part")?, self.big).ok_or_else(|| format!("{name}: its numbers have an unknown type"))?;
                if values.len() != count {
                    return Err(format!("{name}: {count} numbers by its size, {} are there", values.len()).into());
                }
                let rounding = match class {
                    DOUBLE => Rounding::default(),
                    SINGLE => Rounding::SINGLE,
                    _ => Rounding::INTEGER,
                };
                let values = if shape.iter().filter(|n| **n > 1).count() > 1 { in_c_order(&shape, &values) } else { values };
                Value::Numbers { shape, values, rounding }
            }
            CHAR if shape.first() == Some(&1) || count == 0 => match parts.next()?.map(|part| text(part, self.big)) {
                Some(Some(text)) => Value::Text(text),
                _ => Value::Other("text in an unknown encoding"),
            },
            CHAR => Value::Other("several lines of text"),
            _ => Value::Other("a cell, a sparse matrix or an object"),
        };
        self.add(path, name, value);
        Ok(())
    }

    /// Reads the fields of a struct, or of `count` of them as `name_1`, `name_2` …
    fn fields(&mut self, mut parts: Elements<'_>, name: &str, count: usize, path: &mut Vec<String>) -> Result<(), Problem> {
        if path.len() >= MAX_DEPTH {
            return Err(format!("structs are nested more than {MAX_DEPTH} deep").into());
        }
        let width = numbers(parts.required("length of field names")?, self.big).and_then(|n| n.first().copied()).unwrap_or(0.0);
        if !(1.0..=MAX_NAME as f64).contains(&width) {
            return Err(format!("{name}: field names of {width} bytes").into());
        }
        let names = parts.required("field names")?;
        for k in 1..=count {
            path.push(if count == 1 { name.to_owned() } else { format!("{name}_{k}") });
            for field in names.data.chunks(width as usize) {
                let end = field.iter().position(|&b| b == 0).unwrap_or(field.len());
                let field = String::from_utf8_lossy(&field[..end]).into_owned();
                let element = parts.required("field")?;
                if element.kind != MATRIX {
                    return Err(format!("{name}.{field} is no matrix").into());
                }
                self.matrix(element.data, Some(&field), path)?;
            }
            path.pop();
        }
        Ok(())
    }

    fn flags(&self, element: Element<'_>) -> Result<(u8, bool), String> {
        let &[a, b, c, d, ..] = element.data else { return Err("its array flags are incomplete".to_owned()) };
        Ok(if self.big { (d, c & COMPLEX != 0) } else { (a, b & COMPLEX != 0) })
    }

    fn shape(&self, element: Element<'_>) -> Result<Vec<usize>, String> {
        let sizes = numbers(element, self.big).ok_or("its size is no list of numbers")?;
        if sizes.len() > 32 {
            return Err(format!("it has {} dimensions", sizes.len()));
        }
        sizes.iter().map(|&n| if n >= 0.0 { Ok(n as usize) } else { Err(format!("a dimension of {n}")) }).collect()
    }

    fn add(&mut self, path: &[String], name: &str, value: Value) {
        let mut path = path.to_vec();
        path.push(name.to_owned());
        self.entries.push(Entry::new(path, value));
    }
}
