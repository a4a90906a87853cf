//! NumPy's `.npy`: magic, version, the length of a Python dictionary, the dictionary, the numbers (NEP 1).
//!
//! A table of records gives a channel a field, a matrix one a column (`column_0`, …), a vector one.

use super::numbers::{Cursor, Number};
use super::{Budget, Channel, Reason, channels_of};

/// The channels of one file.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Channel>, Reason> {
    let channels = channels(bytes, "", &mut Budget::default())?;
    channels.ok_or_else(|| {
        "it holds no plain numbers or records of them, but objects, text, dates or complex numbers".into()
    })
}

/// The channels of an array, none where it holds no numbers; `name` is its own in an archive, and empty for a file of its own.
pub(super) fn channels(bytes: &[u8], name: &str, budget: &mut Budget) -> Result<Option<Vec<Channel>>, Reason> {
    let mut cursor = Cursor::new(bytes);
    if cursor.take(6)? != b"\x93NUMPY" {
        return Err("an array does not begin as one".into());
    }
    let (major, _minor) = (cursor.u8()?, cursor.u8()?);
    let length = match major {
        1 => u64::from(cursor.u16()?),
        2 | 3 => u64::from(cursor.u32()?),
        other => return Err(format!("its version is {other}, but 1 to 3 are read")),
    };
    let Some(array) = Array::parse(&cursor.text(length)?) else {
        return Ok(None);
    };
    let data = cursor.take(array.bytes().ok_or("its size is beyond any file")?)?;
    array.channels(data, name, budget).map(Some)
}

/// A field of a record: its name, how it is stored, and where in the record.
struct Field {
    name: String,
    number: Number,
    big_endian: bool,
    at: usize,
}

/// What the dictionary says.
struct Array {
    fields: Vec<Field>,
    record: usize,
    fortran: bool,
    shape: Vec<u64>,
}

impl Array {
    fn parse(header: &str) -> Option<Self> {
        let after = |key: &str| Some(header.split_once(key)?.1.trim_start().strip_prefix(':')?.trim_start());
        let shape = after("'shape'")?.strip_prefix('(')?.split_once(')')?.0;
        let sizes = shape.split(',').map(str::trim).filter(|size| !size.is_empty());
        let (fields, record) = described(after("'descr'")?)?;
        Some(Array {
            fields,
            record,
            fortran: after("'fortran_order'")?.starts_with("True"),
            shape: sizes.map(|size| size.parse().ok()).collect::<Option<_>>()?,
        })
    }

    fn bytes(&self) -> Option<u64> {
        let elements = self
            .shape
            .iter()
            .try_fold(1, |product: u64, size| product.checked_mul(*size))?;
        elements.checked_mul(self.record as u64)
    }

    fn channels(&self, data: &[u8], name: &str, budget: &mut Budget) -> Result<Vec<Channel>, Reason> {
        let mut channels = Vec::new();
        for field in &self.fields {
            let parts = [name, &field.name].into_iter().filter(|part| !part.is_empty());
            let name = parts.collect::<Vec<_>>().join("/");
            budget.take(&name, (data.len() / self.record) as u64)?;
            let from = data.get(field.at..).unwrap_or_default();
            let values = field.number.series(from, self.record, field.big_endian);
            let mut channel = Channel::stored("", &name, None, values);
            if channel.name.is_empty() && self.shape.len() == 1 {
                channel.name = "column_0".into();
            }
            channels.extend(channels_of(channel, &self.shape, self.fortran));
        }
        Ok(channels)
    }
}

/// Fields and bytes of a record: `'<f8'`, or `[('time', '<f8'), ('x', '<f4')]`.
fn described(descr: &str) -> Option<(Vec<Field>, usize)> {
    let Some(list) = descr.strip_prefix('[') else {
        let (number, big_endian) = stored(quoted_words(descr).next()?)?;
        let field = Field {
            name: String::new(),
            number,
            big_endian,
            at: 0,
        };
        return Some((vec![field], number.bytes()));
    };
    let list = list.split_once(']')?.0;
    let (mut fields, mut record) = (Vec::new(), 0);
    for part in list.split('(').skip(1) {
        let mut words = quoted_words(part);
        let (name, kind) = (words.next()?, words.next()?);
        // A field that is an array has its shape as a third part.
        if part.matches(',').count() > 2 || words.next().is_some() {
            return None;
        }
        let (number, big_endian) = stored(kind)?;
        fields.push(Field {
            name: name.to_owned(),
            number,
            big_endian,
            at: record,
        });
        record += number.bytes();
    }
    (!fields.is_empty()).then_some((fields, record))
}

/// What stands between quotes.
fn quoted_words(text: &str) -> impl Iterator<Item = &str> {
    text.split('\'').skip(1).step_by(2)
}

/// `<f8`, `>i2`, `|b1`
fn stored(kind: &str) -> Option<(Number, bool)> {
    let order = kind.chars().next()?;
    let rest = kind.strip_prefix(['<', '>', '|', '='])?;
    let size = rest.get(1..)?.parse().ok()?;
    Some((Number::of(rest.chars().next()?, size)?, order == '>'))
}

#[cfg(test)]
mod tests {
    //! Guards the dictionary, which is Python text.
    use super::*;

    #[test]
    fn what_is_no_table_of_numbers_is_refused() {
        let fields = |descr: &str| described(descr).map(|(fields, record)| (fields.len(), record));
        assert_eq!(fields("'<f8', 'fortran_order': False"), Some((1, 8)));
        assert_eq!(fields("[('a', '<f8'), ('b', '>i2')], 'shape'"), Some((2, 10)));
        for other in ["'|O'", "'<c16'", "[('a', '<f8', (3,))]", "[('t', '<M8[ns]')]", "[]", ""] {
            assert_eq!(fields(other), None, "{other}");
        }
    }
}
