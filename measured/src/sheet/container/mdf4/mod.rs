//! MDF 4 (ASAM MDF 4.1): blocks that point to one another. A data group holds records; its channel groups say how long these are, their
//! channels where in a record a number lies, what takes it to its unit, and which of them is the time.
//!
//! Read are numbers, raw or converted (linear, rational, tables); text, arrays and formulas are passed over. Data may stand in lists, deflated
//! and transposed, sorted or not. The column-oriented storage of MDF 4.2 and files that were never finalised are refused.

mod block;
mod conversion;
mod data;
mod value;

use super::{Budget, Channel, Reason};
use block::{Block, Blocks};
use conversion::Conversion;
use value::Place;

/// The identification, before the first block.
const HEADER_AT: u64 = 64;
/// What synchronises by time.
const TIME: u8 = 1;
/// Kinds of channels.
const FIXED: u8 = 0;
const MASTER: u8 = 2;
const VIRTUAL_MASTER: u8 = 3;

/// A file whose writer ended too early.
pub(super) fn unfinished(_: &[u8]) -> Result<Vec<Channel>, Reason> {
    Err("it was never finalised: the program that wrote it ended too early. Open and save it with what wrote it, or with asammdf".into())
}

/// The channels of one file.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Channel>, Reason> {
    if bytes.get(8..10) != Some(b"4.") {
        return Err("it is MDF of a version before 4: convert it, as with asammdf's MDF.convert".into());
    }
    let blocks = Blocks::new(bytes);
    let header = blocks.at(HEADER_AT, b"##HD")?;
    let (mut channels, mut budget) = (Vec::new(), Budget::default());
    for group in blocks.chain(header.link(0), b"##DG")? {
        data_group(&blocks, &group, &mut channels, &mut budget)?;
    }
    Ok(channels)
}

/// Records of one kind in a data group.
struct ChannelGroup<'a> {
    block: Block<'a>,
    layout: data::Records,
    name: String,
}

fn data_group(blocks: &Blocks, group: &Block, channels: &mut Vec<Channel>, budget: &mut Budget) -> Result<(), Reason> {
    let id_bytes = group.data().u8()?;
    let mut kinds = Vec::new();
    for block in blocks.chain(group.link(1), b"##CG")? {
        let mut data = block.data();
        let (id, cycles) = (data.u64()?, data.u64()?);
        let flags = data.u16()?;
        data.take(6)?;
        let (bytes, invalidation_bytes) = (data.u32()?, data.u32()?);
        let layout = data::Records {
            id,
            cycles,
            bytes,
            invalidation_bytes,
            of_variable_length: flags & 1 != 0,
        };
        let name = blocks.text(block.link(2))?.unwrap_or_default();
        kinds.push(ChannelGroup { block, layout, name });
    }
    if kinds.iter().all(|kind| kind.layout.cycles == 0) {
        return Ok(());
    }
    let layouts: Vec<data::Records> = kinds.iter().map(|kind| kind.layout).collect();
    let records = data::records(blocks, group.link(2), id_bytes, &layouts)?;
    for (kind, records) in kinds.iter().zip(&records) {
        if kind.layout.of_variable_length || kind.layout.cycles == 0 {
            continue;
        }
        // Groups are told apart by where they stand if they have no name of their own.
        let name = if kind.name.is_empty() {
            format!("group_{}", blocks.counted())
        } else {
            kind.name.clone()
        };
        for block in blocks.chain(kind.block.link(1), b"##CN")? {
            channels.extend(channel(blocks, &block, kind, &name, records, budget)?);
        }
    }
    Ok(())
}

/// One channel; none where it holds no numbers.
fn channel(
    blocks: &Blocks,
    block: &Block,
    kind: &ChannelGroup,
    group: &str,
    records: &[u8],
    budget: &mut Budget,
) -> Result<Option<Channel>, Reason> {
    let mut data = block.data();
    let (of, synchronises, stored) = (data.u8()?, data.u8()?, data.u8()?);
    let place = Place {
        stored,
        bit_offset: data.u8()?,
        byte_offset: data.u32()?,
        bits: data.u32()?,
        flags: data.u32()?,
        invalidation_bit: data.u32()?,
    };
    let name = blocks.text(block.link(2))?.unwrap_or_default();
    let Some(conversion) = Conversion::of(blocks, block.link(4))? else {
        return Ok(None);
    };
    let raw = match of {
        FIXED | MASTER => place.values(records, &kind.layout),
        VIRTUAL_MASTER => Some((0..kind.layout.cycles).map(|index| index as f64).collect()),
        _ => None,
    };
    let Some(mut values) = raw else {
        return Ok(None);
    };
    budget.take(&name, values.len() as u64)?;
    values.iter_mut().for_each(|value| *value = conversion.of_value(*value));
    if matches!(of, MASTER | VIRTUAL_MASTER) && synchronises == TIME {
        return Ok(Some(Channel {
            implied: true,
            ..Channel::stored(group, "time_s", None, values)
        }));
    }
    let unit = match blocks.text(block.link(6))? {
        Some(unit) => Some(unit),
        None => conversion.unit,
    };
    Ok(Some(Channel::stored(
        group,
        &name,
        unit.filter(|unit| !unit.is_empty()),
        values,
    )))
}
