//! The records of a data group: blocks put together, deflated ones inflated, and records of several kinds told apart.

use super::super::numbers::inflated;
use super::super::{MOST_EXPANSION, MOST_NUMBERS, Reason};
use super::block::{Block, Blocks};

/// How the records of a channel group are laid out.
#[derive(Clone, Copy)]
pub(super) struct Records {
    /// What stands before a record where several kinds are mixed.
    pub id: u64,
    pub cycles: u64,
    pub bytes: u32,
    pub invalidation_bytes: u32,
    /// Text and the like: each says its own length.
    pub of_variable_length: bool,
}

impl Records {
    pub fn stride(&self) -> usize {
        self.bytes as usize + self.invalidation_bytes as usize
    }
}

/// The records of each kind, one behind the other.
pub(super) fn records(blocks: &Blocks, at: u64, id_bytes: u8, kinds: &[Records]) -> Result<Vec<Vec<u8>>, Reason> {
    let mut bytes = Vec::new();
    gather(blocks, at, &mut bytes, 0)?;
    let records = match kinds {
        [_] if id_bytes == 0 => vec![bytes],
        _ => apart(&bytes, id_bytes, kinds)?,
    };
    for (kind, records) in kinds.iter().zip(&records) {
        let announced = kind.cycles.checked_mul(kind.stride() as u64);
        if !kind.of_variable_length && announced.is_none_or(|announced| announced > records.len() as u64) {
            return Err(format!(
                "{} records of {} bytes are announced, but {} bytes are there: it is torn or was not written to the end",
                kind.cycles,
                kind.stride(),
                records.len()
            ));
        }
    }
    Ok(records)
}

/// Lists point to data and to further lists.
fn gather(blocks: &Blocks, mut at: u64, into: &mut Vec<u8>, depth: usize) -> Result<(), Reason> {
    if depth > 2 {
        return Err("lists of data stand in one another".into());
    }
    while at != 0 {
        let block = blocks.any(at)?;
        at = 0;
        match &block.id {
            b"##DT" => append(block.bytes(), into)?,
            b"##DZ" => append(&unzipped(&block)?, into)?,
            b"##HL" => gather(blocks, block.link(0), into, depth + 1)?,
            b"##DL" => {
                for part in block.links().iter().skip(1).filter(|part| **part != 0) {
                    let part = blocks.any(*part)?;
                    match &part.id {
                        b"##DT" => append(part.bytes(), into)?,
                        b"##DZ" => append(&unzipped(&part)?, into)?,
                        _ => return Err(unknown(&part)),
                    }
                }
                at = block.link(0);
            }
            _ => return Err(unknown(&block)),
        }
    }
    Ok(())
}

fn append(part: &[u8], into: &mut Vec<u8>) -> Result<(), Reason> {
    let most = 8 * MOST_NUMBERS as usize;
    if into.len() + part.len() > most {
        return Err(format!(
            "its records take more than {most} bytes. Cut it, or decimate it"
        ));
    }
    into.extend_from_slice(part);
    Ok(())
}

fn unknown(block: &Block) -> Reason {
    match &block.id {
        b"##LD" | b"##DV" => {
            "its data stand column by column (MDF 4.2): save it without column-oriented storage".into()
        }
        other => format!(
            "at byte {} stands a block {} where data are announced",
            block.at,
            String::from_utf8_lossy(other)
        ),
    }
}

/// A deflated block; one that was transposed before has the first bytes of all records first.
fn unzipped(block: &Block) -> Result<Vec<u8>, Reason> {
    let mut data = block.data();
    data.take(2)?;
    let (kind, _) = (data.u8()?, data.u8()?);
    let (columns, original, length) = (u64::from(data.u32()?), data.u64()?, data.u64()?);
    let packed = data.take(length)?;
    if original > (packed.len() as u64).saturating_mul(MOST_EXPANSION) {
        return Err(format!(
            "the block at byte {} announces more than it can hold",
            block.at
        ));
    }
    let flat = inflated(packed, original)?;
    if flat.len() as u64 != original {
        return Err(format!(
            "the block at byte {} announces {original} bytes, but holds {}",
            block.at,
            flat.len()
        ));
    }
    match kind {
        0 => Ok(flat),
        1 if columns > 0 => Ok(transposed(&flat, columns as usize)),
        other => Err(format!(
            "the block at byte {} is packed in an unknown way {other}",
            block.at
        )),
    }
}

fn transposed(flat: &[u8], columns: usize) -> Vec<u8> {
    let rows = flat.len() / columns;
    let (square, rest) = flat.split_at(rows * columns);
    let mut bytes = Vec::with_capacity(flat.len());
    for row in 0..rows {
        bytes.extend((0..columns).map(|column| square[column * rows + row]));
    }
    bytes.extend_from_slice(rest);
    bytes
}

/// Records of several kinds, each behind its number.
fn apart(bytes: &[u8], id_bytes: u8, kinds: &[Records]) -> Result<Vec<Vec<u8>>, Reason> {
    if !matches!(id_bytes, 1 | 2 | 4 | 8) {
        return Err(format!(
            "several channel groups share a data group, told apart by {id_bytes} bytes, but 1, 2, 4 or 8 can be"
        ));
    }
    let mut records = vec![Vec::new(); kinds.len()];
    let mut cursor = super::super::numbers::Cursor::new(bytes);
    while cursor.left() > 0 {
        let id = cursor
            .take(u64::from(id_bytes))?
            .iter()
            .rev()
            .fold(0, |sum: u64, byte| sum << 8 | u64::from(*byte));
        let index = kinds.iter().position(|kind| kind.id == id);
        let index = index.ok_or_else(|| format!("a record is numbered {id}, but no channel group is"))?;
        let kind = &kinds[index];
        if kind.of_variable_length {
            let length = u64::from(cursor.u32()?);
            cursor.take(length)?;
        } else {
            records[index].extend_from_slice(cursor.take(kind.stride() as u64)?);
        }
    }
    Ok(records)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards mixed records: a wrong length would read every later number from the wrong place.
    #[test]
    fn mixed_records_are_told_apart() {
        let kind = |id, bytes, of_variable_length| Records {
            id,
            cycles: 1,
            bytes,
            invalidation_bytes: 0,
            of_variable_length,
        };
        let kinds = [kind(1, 2, false), kind(2, 1, false), kind(3, 0, true)];
        let bytes = [1, 10, 11, 3, 2, 0, 0, 0, 99, 99, 2, 20, 1, 12, 13];
        let records = apart(&bytes, 1, &kinds).unwrap();
        assert_eq!(records, [vec![10, 11, 12, 13], vec![20], vec![]]);
        assert!(apart(&[9, 0], 1, &kinds).unwrap_err().contains("numbered 9"));
    }

    /// Guards the way back from transposed bytes, with some over.
    #[test]
    fn transposed_bytes_are_put_back() {
        assert_eq!(transposed(&[1, 3, 2, 4, 9], 2), [1, 2, 3, 4, 9]);
    }
}
