//! MATLAB's files of level 5, as versions 5 to 7.2 write them (MathWorks, *MAT-File Format*): a header of 128 bytes, then elements,
//! each a type, a size and data filled up to 8 bytes; version 7 deflates each variable.
//!
//! Read are matrices of real numbers, alone or in structs. Text, cells, sparse matrices, objects (timeseries and tables among them)
//! and complex numbers are passed over.

use super::numbers::{Cursor, Number, inflated};
use super::{Budget, Channel, MOST_EXPANSION, Reason, channels_of};

const HEADER_BYTES: u64 = 128;
const MATRIX: u32 = 14;
const DEFLATED: u32 = 15;
/// Structs in structs.
const MOST_DEPTH: usize = 16;
const STRUCT: u32 = 2;
/// Classes of plain numbers: double to uint64.
const NUMBERS: std::ops::RangeInclusive<u32> = 6..=15;
const COMPLEX: u32 = 0x0800;

/// The channels of one file.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Channel>, Reason> {
    let mut cursor = Cursor::new(bytes);
    let header = cursor.take(HEADER_BYTES)?;
    let mut cursor = match &header[126..] {
        b"IM" => cursor,
        b"MI" => cursor.big_endian(true),
        _ => return Err("its header does not say its byte order".into()),
    };
    let mut reader = Reader::default();
    // What fills up the end of a file is no element.
    while cursor.left() >= 8 {
        let (kind, data) = element(&mut cursor)?;
        let big_endian = header[126..] == *b"MI";
        match kind {
            MATRIX => reader.matrix(Cursor::new(data).big_endian(big_endian), "", None, 0)?,
            DEFLATED => {
                let inflated = inflated(data, (data.len() as u64).saturating_mul(MOST_EXPANSION))?;
                let (kind, data) = element(&mut Cursor::new(&inflated).big_endian(big_endian))?;
                if kind == MATRIX {
                    reader.matrix(Cursor::new(data).big_endian(big_endian), "", None, 0)?;
                }
            }
            _ => (),
        }
    }
    Ok(reader.channels)
}

/// The next element: its type and its data.
fn element<'a>(cursor: &mut Cursor<'a>) -> Result<(u32, &'a [u8]), Reason> {
    let first = cursor.u32()?;
    // A small one has its size in the upper half of its type, and its data where the size would be.
    if first >> 16 != 0 {
        let size = u64::from(first >> 16);
        if size > 4 {
            return Err(format!("an element at byte {} contradicts itself", cursor.at()));
        }
        return Ok((first & 0xffff, &cursor.take(4)?[..size as usize]));
    }
    let size = u64::from(cursor.u32()?);
    let data = cursor.take(size)?;
    if first != DEFLATED {
        let filling = (size.next_multiple_of(8) - size).min(cursor.left() as u64);
        cursor.take(filling)?;
    }
    Ok((first, data))
}

#[derive(Default)]
struct Reader {
    channels: Vec<Channel>,
    budget: Budget,
}

impl Reader {
    /// A variable, or the field of a struct, whose matrix has no name of its own.
    fn matrix(&mut self, mut cursor: Cursor, group: &str, field: Option<&str>, depth: usize) -> Result<(), Reason> {
        if cursor.left() == 0 {
            return Ok(());
        }
        let (_, flags) = element(&mut cursor)?;
        let big_endian = cursor.is_big_endian();
        let flags = Cursor::new(flags).big_endian(big_endian).u32()?;
        let class = flags & 0xff;
        if class != STRUCT && !NUMBERS.contains(&class) {
            return Ok(());
        }
        let (_, sizes) = element(&mut cursor)?;
        let sizes = Number::I32.series(sizes, 4, big_endian);
        let shape: Vec<u64> = sizes.iter().map(|size| *size as u64).collect();
        let (_, own_name) = element(&mut cursor)?;
        let own_name = String::from_utf8_lossy(own_name).into_owned();
        let name = field.map_or(own_name, str::to_owned);
        if class == STRUCT {
            return self.fields(cursor, &shape, &within(group, &name), depth);
        }
        if flags & COMPLEX != 0 {
            return Ok(());
        }
        let (kind, data) = element(&mut cursor)?;
        let number =
            stored(kind).ok_or_else(|| format!("\"{name}\" is stored as numbers of an unknown type {kind}"))?;
        let values = number.series(data, number.bytes(), big_endian);
        let announced = shape
            .iter()
            .try_fold(1, |product: u64, side| product.checked_mul(*side));
        if announced != Some(values.len() as u64) {
            return Err(format!(
                "\"{name}\" has {} numbers, but its size is {shape:?}",
                values.len()
            ));
        }
        self.budget.take(&name, values.len() as u64)?;
        let channel = Channel::stored(group, &name, None, values);
        self.channels.extend(channels_of(channel, &shape, true));
        Ok(())
    }

    fn fields(&mut self, mut cursor: Cursor, shape: &[u64], group: &str, depth: usize) -> Result<(), Reason> {
        if depth == MOST_DEPTH {
            return Err(format!("structs stand in one another more than {MOST_DEPTH} deep"));
        }
        let big_endian = cursor.is_big_endian();
        let (_, length) = element(&mut cursor)?;
        let length = Cursor::new(length).big_endian(big_endian).u32()? as usize;
        let (_, names) = element(&mut cursor)?;
        if length == 0 {
            return Err(format!("struct \"{group}\" has fields without names"));
        }
        let names: Vec<String> = names.chunks(length).map(until_zero).collect();
        let alone = shape.iter().all(|side| *side == 1);
        let mut index = 0;
        // A struct array has one matrix a field for each of its elements.
        while cursor.left() >= 8 && !names.is_empty() {
            let group = if alone {
                group.to_owned()
            } else {
                format!("{group}_{index}")
            };
            for name in &names {
                let (kind, data) = element(&mut cursor)?;
                if kind == MATRIX {
                    let inner = Cursor::new(data).big_endian(big_endian);
                    self.matrix(inner, &group, Some(name), depth + 1)?;
                }
            }
            index += 1;
        }
        Ok(())
    }
}

fn within(group: &str, name: &str) -> String {
    if group.is_empty() {
        name.to_owned()
    } else {
        format!("{group}/{name}")
    }
}

fn until_zero(name: &[u8]) -> String {
    let end = name.iter().position(|byte| *byte == 0).unwrap_or(name.len());
    String::from_utf8_lossy(&name[..end]).into_owned()
}

fn stored(kind: u32) -> Option<Number> {
    Some(match kind {
        1 => Number::I8,
        2 => Number::U8,
        3 => Number::I16,
        4 => Number::U16,
        5 => Number::I32,
        6 => Number::U32,
        7 => Number::F32,
        9 => Number::F64,
        12 => Number::I64,
        13 => Number::U64,
        _ => return None,
    })
}
