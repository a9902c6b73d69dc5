//! The types of numbers that binary formats hold.

use crate::cursor::Cursor;
use crate::table::Rounding;

/// A type of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Number {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
}

impl Number {
    /// The bytes of one.
    pub fn size(self) -> usize {
        match self {
            Number::U8 | Number::I8 => 1,
            Number::U16 | Number::I16 => 2,
            Number::U32 | Number::I32 | Number::F32 => 4,
            Number::U64 | Number::I64 | Number::F64 => 8,
        }
    }

    /// How coarse its values are.
    pub fn rounding(self) -> Rounding {
        match self {
            Number::F64 => Rounding::default(),
            Number::F32 => Rounding::SINGLE,
            _ => Rounding::INTEGER,
        }
    }

    /// The next one.
    pub fn next(self, cursor: &mut Cursor<'_>) -> Option<f64> {
        Some(match self {
            Number::U8 => cursor.u8()?.into(),
            Number::I8 => cursor.i8()?.into(),
            Number::U16 => cursor.u16()?.into(),
            Number::I16 => cursor.i16()?.into(),
            Number::U32 => cursor.u32()?.into(),
            Number::I32 => cursor.i32()?.into(),
            Number::U64 => cursor.u64()? as f64,
            Number::I64 => cursor.i64()? as f64,
            Number::F32 => cursor.f32()?.into(),
            Number::F64 => cursor.f64()?,
        })
    }

    /// All that these bytes hold; [`None`] if the last is not complete.
    pub fn all(self, bytes: &[u8], big: bool) -> Option<Vec<f64>> {
        macro_rules! convert {
            ($type:ty) => {{
                let (chunks, rest) = bytes.as_chunks::<{ size_of::<$type>() }>();
                let number = |b: &[u8; size_of::<$type>()]| (if big { <$type>::from_be_bytes(*b) } else { <$type>::from_le_bytes(*b) }) as f64;
                rest.is_empty().then(|| chunks.iter().map(number).collect())
            }};
        }
        match self {
            Number::U8 => convert!(u8),
            Number::I8 => convert!(i8),
            Number::U16 => convert!(u16),
            Number::I16 => convert!(i16),
            Number::U32 => convert!(u32),
            Number::I32 => convert!(i32),
            Number::U64 => convert!(u64),
            Number::I64 => convert!(i64),
            Number::F32 => convert!(f32),
            Number::F64 => convert!(f64),
        }
    }
}
