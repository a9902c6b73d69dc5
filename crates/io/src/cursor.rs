//! Numbers out of bytes, one after the other, in either byte order: what is not there is [`None`].

/// Bytes that are still to be read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cursor<'a> {
    pub rest: &'a [u8],
    pub big: bool,
}

macro_rules! numbers {
    ($($name:ident: $type:ty),*) => {
        $(
            pub fn $name(&mut self) -> Option<$type> {
                let (bytes, rest) = self.rest.split_first_chunk()?;
                self.rest = rest;
                Some(if self.big { <$type>::from_be_bytes(*bytes) } else { <$type>::from_le_bytes(*bytes) })
            }
        )*
    };
}

impl<'a> Cursor<'a> {
    pub fn little(bytes: &'a [u8]) -> Self {
        Cursor { rest: bytes, big: false }
    }

    numbers!(u8: u8, i8: i8, u16: u16, i16: i16, u32: u32, i32: i32, u64: u64, i64: i64, f32: f32, f64: f64);

    /// The next `count` bytes.
    pub fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(count)?;
        self.rest = rest;
        Some(taken)
    }

    /// A length of 32 bits, then so many bytes.
    pub fn block(&mut self) -> Option<&'a [u8]> {
        let len = self.u32()?;
        self.take(usize::try_from(len).ok()?)
    }

    /// A length of 32 bits, then so many bytes of text; what is not UTF-8 of it is replaced.
    pub fn text(&mut self) -> Option<String> {
        Some(String::from_utf8_lossy(self.block()?).into_owned())
    }
}
