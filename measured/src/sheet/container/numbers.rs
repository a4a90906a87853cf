//! Numbers out of bytes: a cursor that refuses to read past the end, and the number types that all formats share.

use super::Reason;

/// Bytes that are read one after another.
#[derive(Clone)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    big_endian: bool,
}

macro_rules! number {
    ($name:ident, $type:ty) => {
        pub fn $name(&mut self) -> Result<$type, Reason> {
            let bytes = self.array()?;
            Ok(if self.big_endian {
                <$type>::from_be_bytes(bytes)
            } else {
                <$type>::from_le_bytes(bytes)
            })
        }
    };
}

impl<'a> Cursor<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Cursor {
            bytes,
            at: 0,
            big_endian: false,
        }
    }

    pub fn big_endian(self, big_endian: bool) -> Self {
        Cursor { big_endian, ..self }
    }

    pub fn is_big_endian(&self) -> bool {
        self.big_endian
    }

    /// The same bytes from another place.
    pub fn from(&self, at: u64) -> Result<Self, Reason> {
        let at = usize::try_from(at).ok().filter(|at| *at <= self.bytes.len());
        let at = at.ok_or_else(|| self.past_end())?;
        Ok(Cursor { at, ..self.clone() })
    }

    pub fn at(&self) -> usize {
        self.at
    }

    pub fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    pub fn take(&mut self, count: u64) -> Result<&'a [u8], Reason> {
        let count = usize::try_from(count).ok().filter(|count| *count <= self.left());
        let count = count.ok_or_else(|| self.past_end())?;
        let taken = &self.bytes[self.at..self.at + count];
        self.at += count;
        Ok(taken)
    }

    pub fn text(&mut self, count: u64) -> Result<String, Reason> {
        let text = String::from_utf8_lossy(self.take(count)?);
        Ok(text.trim_end_matches('\0').to_owned())
    }

    number!(u8, u8);
    number!(u16, u16);
    number!(u32, u32);
    number!(u64, u64);
    number!(f64, f64);

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Reason> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N as u64)?);
        Ok(array)
    }

    fn past_end(&self) -> Reason {
        format!(
            "it ends at byte {}, where more is announced: it is torn or was not written to the end",
            self.bytes.len()
        )
    }
}

/// How a number is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Number {
    Bool,
    I8,
    I16,
    I32,
    I64,
    U8,
    U16,
    U32,
    U64,
    F32,
    F64,
}

impl Number {
    pub fn bytes(self) -> usize {
        match self {
            Number::Bool | Number::I8 | Number::U8 => 1,
            Number::I16 | Number::U16 => 2,
            Number::I32 | Number::U32 | Number::F32 => 4,
            Number::I64 | Number::U64 | Number::F64 => 8,
        }
    }

    /// A signed or unsigned integer, or a floating-point number, of so many bytes.
    pub fn of(kind: char, bytes: u64) -> Option<Self> {
        Some(match (kind, bytes) {
            ('b', 1) => Number::Bool,
            ('i', 1) => Number::I8,
            ('i', 2) => Number::I16,
            ('i', 4) => Number::I32,
            ('i', 8) => Number::I64,
            ('u', 1) => Number::U8,
            ('u', 2) => Number::U16,
            ('u', 4) => Number::U32,
            ('u', 8) => Number::U64,
            ('f', 4) => Number::F32,
            ('f', 8) => Number::F64,
            _ => return None,
        })
    }

    /// Every `stride` bytes one number, as many as there are.
    pub fn series(self, bytes: &[u8], stride: usize, big_endian: bool) -> Vec<f64> {
        let own = self.bytes();
        let records = bytes.chunks(stride.max(1)).filter(|record| record.len() >= own);
        records.map(|record| self.one(&record[..own], big_endian)).collect()
    }

    /// One number; its bytes are as many as [`Number::bytes`] says.
    fn one(self, bytes: &[u8], big_endian: bool) -> f64 {
        let mut little = [0; 8];
        little[..bytes.len()].copy_from_slice(bytes);
        if big_endian {
            little[..bytes.len()].reverse();
        }
        let whole = u64::from_le_bytes(little);
        match self {
            Number::Bool => f64::from(u8::from(whole != 0)),
            Number::I8 => f64::from(whole as u8 as i8),
            Number::I16 => f64::from(whole as u16 as i16),
            Number::I32 => f64::from(whole as u32 as i32),
            Number::I64 => whole as i64 as f64,
            Number::U8 | Number::U16 | Number::U32 | Number::U64 => whole as f64,
            Number::F32 => f64::from(f32::from_bits(whole as u32)),
            Number::F64 => f64::from_bits(whole),
        }
    }
}

/// What deflate (with zlib's frame) made smaller; at most `most` bytes of it.
pub(super) fn inflated(bytes: &[u8], most: u64) -> Result<Vec<u8>, Reason> {
    use std::io::Read;
    let mut inflated = Vec::new();
    let read = flate2::read::ZlibDecoder::new(bytes)
        .take(most.saturating_add(1))
        .read_to_end(&mut inflated);
    read.map_err(|_| "a compressed part of it is broken".to_owned())?;
    if inflated.len() as u64 > most {
        return Err("a compressed part of it is larger than it says".into());
    }
    Ok(inflated)
}

#[cfg(test)]
mod tests {
    //! Guards signs and byte order: one wrong cast turns a small negative number into a huge one.
    use super::*;

    #[test]
    fn numbers_of_every_kind_keep_their_value() {
        let both = |number: Number, little: &[u8], value: f64| {
            let big: Vec<u8> = little.iter().rev().copied().collect();
            assert_eq!(number.series(little, little.len(), false), [value], "{number:?}");
            assert_eq!(number.series(&big, big.len(), true), [value], "{number:?} big-endian");
        };
        both(Number::I8, &(-3_i8).to_le_bytes(), -3.0);
        both(Number::I16, &(-300_i16).to_le_bytes(), -300.0);
        both(Number::I32, &(-70_000_i32).to_le_bytes(), -70_000.0);
        both(Number::I64, &(-1_i64 << 40).to_le_bytes(), -(2_f64.powi(40)));
        both(Number::U16, &65_535_u16.to_le_bytes(), 65_535.0);
        both(Number::U64, &(1_u64 << 50).to_le_bytes(), 2_f64.powi(50));
        both(Number::F32, &(-1.5_f32).to_le_bytes(), -1.5);
        both(Number::F64, &(-1e-9_f64).to_le_bytes(), -1e-9);
        both(Number::Bool, &[2], 1.0);
    }

    #[test]
    fn nothing_is_read_past_the_end() {
        let mut cursor = Cursor::new(&[1, 0, 2]);
        assert_eq!(cursor.u16(), Ok(1));
        assert!(cursor.u16().unwrap_err().contains("ends at byte 3"));
        assert!(cursor.take(u64::MAX).is_err() && cursor.from(4).is_err());
    }
}
