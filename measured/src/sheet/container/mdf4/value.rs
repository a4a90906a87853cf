//! Where in a record a number lies.

use super::super::numbers::Number;
use super::data::Records;

/// All values of the channel are invalid.
const ALL_INVALID: u32 = 1;
/// A bit of each record says whether the value is.
const INVALID_BY_BIT: u32 = 2;

/// A channel's place in its records.
pub(super) struct Place {
    /// Unsigned, signed or floating-point, each little- and big-endian; more is no number.
    pub stored: u8,
    pub bit_offset: u8,
    pub byte_offset: u32,
    pub bits: u32,
    pub flags: u32,
    pub invalidation_bit: u32,
}

impl Place {
    /// The raw numbers; what is invalid is none. Nothing where the place holds no number.
    pub fn values(&self, records: &[u8], layout: &Records) -> Option<Vec<f64>> {
        let big_endian = self.stored % 2 == 1;
        let kind = match self.stored {
            0 | 1 => 'u',
            2 | 3 => 'i',
            4 | 5 => 'f',
            _ => return None,
        };
        let stride = layout.stride();
        let begin = self.byte_offset as usize;
        let bytes = (u32::from(self.bit_offset) + self.bits).div_ceil(8) as usize;
        if self.bits == 0 || bytes > 8 || begin + bytes > layout.bytes as usize {
            return None;
        }
        let records = records.get(..usize::try_from(layout.cycles).ok()?.checked_mul(stride)?)?;
        let whole = self.bit_offset == 0 && self.bits.is_multiple_of(8);
        let number = Number::of(kind, u64::from(self.bits / 8)).filter(|_| whole);
        let mut values = match number {
            Some(number) => number.series(records.get(begin..).unwrap_or_default(), stride, big_endian),
            None if kind == 'f' => return None,
            None => records
                .chunks_exact(stride)
                .map(|record| self.some_bits(&record[begin..begin + bytes], big_endian, kind == 'i'))
                .collect(),
        };
        values.truncate(layout.cycles as usize);
        if self.flags & ALL_INVALID != 0 {
            values.fill(f64::NAN);
        } else if self.flags & INVALID_BY_BIT != 0 && layout.invalidation_bytes > 0 {
            let byte = layout.bytes as usize + self.invalidation_bit as usize / 8;
            for (record, value) in records.chunks_exact(stride).zip(&mut values) {
                if record
                    .get(byte)
                    .is_some_and(|byte| byte >> (self.invalidation_bit % 8) & 1 != 0)
                {
                    *value = f64::NAN;
                }
            }
        }
        Some(values)
    }

    /// An integer of any number of bits.
    fn some_bits(&self, bytes: &[u8], big_endian: bool, signed: bool) -> f64 {
        let join = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
        let joined = if big_endian {
            bytes.iter().fold(0, join)
        } else {
            bytes.iter().rev().fold(0, join)
        };
        let above = 64 - self.bits.min(64);
        let shifted = joined >> self.bit_offset.min(63) << above;
        if signed {
            (shifted as i64 >> above) as f64
        } else {
            (shifted >> above) as f64
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards signs and places of packed integers, and bits that say that a value is none.
    #[test]
    fn packed_integers_and_invalid_values_are_read() {
        let layout = Records {
            id: 0,
            cycles: 2,
            bytes: 2,
            invalidation_bytes: 1,
            of_variable_length: false,
        };
        let place = |stored, bit_offset, bits| Place {
            stored,
            bit_offset,
            byte_offset: 0,
            bits,
            flags: INVALID_BY_BIT,
            invalidation_bit: 1,
        };
        // 12 bits above 4: 0xfff is -1, then 5; the second record is invalid.
        let records = [0xf0, 0xff, 0, 0x50, 0, 2];
        let signed = place(2, 4, 12).values(&records, &layout).unwrap();
        assert!(signed[0] == -1.0 && signed[1].is_nan(), "{signed:?}");
        let unsigned = place(0, 4, 12).values(&records, &layout).unwrap();
        assert_eq!(unsigned[0], 4095.0);
        assert!(place(6, 0, 16).values(&records, &layout).is_none());
        assert!(place(0, 0, 32).values(&records, &layout).is_none());
    }
}
