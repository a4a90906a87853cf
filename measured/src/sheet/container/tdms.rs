//! TDMS, as LabVIEW and DAQ software write it (National Instruments, *TDMS File Format Internal Structure*): segments, each with a
//! lead-in, what changed of the objects and their properties, and raw data, channel after channel or interleaved.
//!
//! A channel's unit is its property `unit_string`; its clock is made from `wf_increment` and `wf_start_offset`. Text and time stamps are
//! passed over. DAQmx raw data and channels that are still to be scaled are refused: their numbers are counts, not values.

use std::collections::BTreeMap;

use super::numbers::{Cursor, Number};
use super::{Budget, Channel, Reason};

const LEAD_IN: u64 = 28;
/// What a segment's table of contents says.
const HAS_METADATA: u32 = 1 << 1;
const NEW_LIST: u32 = 1 << 2;
const HAS_DATA: u32 = 1 << 3;
const INTERLEAVED: u32 = 1 << 5;
const BIG_ENDIAN: u32 = 1 << 6;
const DAQMX: u32 = 1 << 7;
const MOST_OBJECTS: usize = 100_000;

/// How the raw data of an object lie in a segment.
#[derive(Clone, Copy)]
struct Layout {
    /// None for text and other values that are passed over.
    number: Option<Number>,
    values: u64,
    bytes: u64,
}

#[derive(Default)]
struct Object {
    layout: Option<Layout>,
    unit: Option<String>,
    increment_s: Option<f64>,
    offset_s: f64,
    scaled: bool,
    values: Vec<f64>,
}

#[derive(Default)]
struct Reader {
    paths: Vec<String>,
    by_path: BTreeMap<String, usize>,
    objects: Vec<Object>,
    /// Objects with data in the segment, in their order.
    active: Vec<usize>,
    budget: Budget,
}

/// The channels of one file.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Channel>, Reason> {
    let mut reader = Reader::default();
    let mut at = 0;
    while at < bytes.len() as u64 {
        at = reader.segment(&Cursor::new(bytes).from(at)?)?;
    }
    reader.channels()
}

impl Reader {
    /// Reads one segment and says where the next one begins.
    fn segment(&mut self, whole: &Cursor) -> Result<u64, Reason> {
        let begin = whole.at() as u64;
        let mut lead = whole.clone();
        if lead.take(4)? != b"TDSm" {
            return Err(format!("no segment begins at byte {begin}, where one is announced"));
        }
        let contents = lead.u32()?;
        let mut lead = lead.big_endian(contents & BIG_ENDIAN != 0);
        let _version = lead.u32()?;
        let (next, data_at) = (lead.u64()?, lead.u64()?);
        if next == u64::MAX {
            return Err("its last segment was not closed: the program that wrote it ended too early. Open and save it with what wrote it".into());
        }
        if contents & DAQMX != 0 {
            return Err("it holds raw data of DAQmx: save it with scaled values".into());
        }
        let mut data = lead.clone();
        let length = next.checked_sub(data_at).ok_or("a segment contradicts itself")?;
        data.take(data_at)?;
        if contents & HAS_METADATA != 0 {
            self.metadata(lead, contents & NEW_LIST != 0)?;
        }
        if contents & HAS_DATA != 0 {
            let raw = data.take(length)?;
            self.raw(raw, contents & INTERLEAVED != 0, contents & BIG_ENDIAN != 0)?;
        }
        let end = begin.checked_add(LEAD_IN).and_then(|end| end.checked_add(next));
        end.ok_or_else(|| "a segment is larger than any file".to_owned())
    }

    fn metadata(&mut self, mut cursor: Cursor, new_list: bool) -> Result<(), Reason> {
        if new_list {
            self.active.clear();
        }
        for _ in 0..cursor.u32()? {
            let path = string(&mut cursor)?;
            let index = self.object(path)?;
            match cursor.u32()? {
                // No raw data in this segment.
                u32::MAX => self.active.retain(|active| *active != index),
                // As in the segment before.
                0 => self.activate(index),
                0x6912_0000 | 0x6913_0000 | 0x1269 | 0x1369 => {
                    return Err("it holds raw data of DAQmx: save it with scaled values".into());
                }
                _ => {
                    self.objects[index].layout = Some(layout(&mut cursor)?);
                    self.activate(index);
                }
            }
            for _ in 0..cursor.u32()? {
                let name = string(&mut cursor)?;
                self.objects[index].property(&name, &mut cursor)?;
            }
        }
        Ok(())
    }

    fn object(&mut self, path: String) -> Result<usize, Reason> {
        if let Some(known) = self.by_path.get(&path) {
            return Ok(*known);
        }
        if self.objects.len() == MOST_OBJECTS {
            return Err(format!("it holds more than {MOST_OBJECTS} objects"));
        }
        self.objects.push(Object::default());
        self.paths.push(path.clone());
        self.by_path.insert(path, self.objects.len() - 1);
        Ok(self.objects.len() - 1)
    }

    fn activate(&mut self, index: usize) {
        if !self.active.contains(&index) {
            self.active.push(index);
        }
    }

    /// As many chunks as fit, each with the values of all active objects.
    fn raw(&mut self, raw: &[u8], interleaved: bool, big_endian: bool) -> Result<(), Reason> {
        let layouts: Vec<(usize, Layout)> = self
            .active
            .iter()
            .filter_map(|index| Some((*index, self.objects[*index].layout?)))
            .filter(|(_, layout)| layout.bytes > 0)
            .collect();
        let chunk = layouts
            .iter()
            .try_fold(0, |sum: u64, (_, layout)| sum.checked_add(layout.bytes));
        let chunk = chunk.ok_or("a chunk is larger than any file")?;
        if chunk == 0 {
            return Ok(());
        }
        if !(raw.len() as u64).is_multiple_of(chunk) {
            return Err("a segment does not hold whole chunks: it is torn or was not written to the end".into());
        }
        let width = |layout: &Layout| layout.bytes / layout.values.max(1);
        let stride: u64 = layouts.iter().map(|(_, layout)| width(layout)).sum();
        for chunk in raw.chunks(chunk as usize) {
            let mut at = 0;
            for (index, layout) in &layouts {
                let from = chunk.get(at..).unwrap_or_default();
                at += if interleaved { width(layout) } else { layout.bytes } as usize;
                let Some(number) = layout.number else {
                    continue;
                };
                let name = &self.paths[*index];
                self.budget.take(name, layout.values)?;
                let values = if interleaved {
                    number.series(from, stride as usize, big_endian)
                } else {
                    let own = from.get(..layout.bytes as usize).unwrap_or_default();
                    number.series(own, number.bytes(), big_endian)
                };
                if values.len() as u64 != layout.values {
                    return Err(format!(
                        "{name} has {} values in a chunk that should hold {}",
                        values.len(),
                        layout.values
                    ));
                }
                self.objects[*index].values.extend(values);
            }
        }
        Ok(())
    }

    fn channels(self) -> Result<Vec<Channel>, Reason> {
        let mut channels: Vec<Channel> = Vec::new();
        // Of each group and length: the clock, if all agree.
        let mut clocks: BTreeMap<(String, usize), Option<(f64, f64)>> = BTreeMap::new();
        for (path, object) in self.paths.iter().zip(self.objects) {
            let (Some((group, name)), false) = (names(path), object.values.is_empty()) else {
                continue;
            };
            if object.scaled {
                return Err(format!(
                    "channel \"{name}\" holds counts that are still to be scaled: save it with scaled values"
                ));
            }
            let clock = object.increment_s.map(|increment_s| (object.offset_s, increment_s));
            let seen = clocks.entry((group.clone(), object.values.len())).or_insert(clock);
            if *seen != clock {
                *seen = None;
            }
            channels.push(Channel::stored(&group, &name, object.unit, object.values));
        }
        for ((group, samples), clock) in clocks {
            if let Some((offset_s, increment_s)) = clock {
                channels.push(Channel::clock(&group, offset_s, increment_s, samples));
            }
        }
        Ok(channels)
    }
}

impl Object {
    fn property(&mut self, name: &str, cursor: &mut Cursor) -> Result<(), Reason> {
        let kind = cursor.u32()?;
        if kind == 0x20 {
            let text = string(cursor)?;
            if name == "unit_string" && !text.is_empty() {
                self.unit = Some(text);
            }
            return Ok(());
        }
        let (number, bytes) =
            of_type(kind).ok_or_else(|| format!("property \"{name}\" is of an unknown type {kind:#x}"))?;
        let raw = cursor.take(bytes)?;
        let value = number.and_then(|number| number.series(raw, raw.len(), cursor.is_big_endian()).first().copied());
        match (name, value) {
            ("wf_increment", Some(value)) => {
                self.increment_s = Some(value).filter(|value| *value > 0.0 && value.is_finite())
            }
            ("wf_start_offset", Some(value)) if value.is_finite() => self.offset_s = value,
            ("NI_Number_Of_Scales", Some(value)) => self.scaled = value > 0.0,
            _ => (),
        }
        Ok(())
    }
}

fn layout(cursor: &mut Cursor) -> Result<Layout, Reason> {
    let (kind, dimension, values) = (cursor.u32()?, cursor.u32()?, cursor.u64()?);
    if dimension != 1 {
        return Err(format!("raw data have {dimension} dimensions, but 1 is read"));
    }
    // Text says its own size.
    if kind == 0x20 {
        return Ok(Layout {
            number: None,
            values,
            bytes: cursor.u64()?,
        });
    }
    let (number, bytes) = of_type(kind).ok_or_else(|| format!("raw data are of an unknown type {kind:#x}"))?;
    let bytes = values.checked_mul(bytes).ok_or("a channel is larger than any file")?;
    Ok(Layout { number, values, bytes })
}

/// How a type is stored, if it is a number, and its bytes.
fn of_type(kind: u32) -> Option<(Option<Number>, u64)> {
    let number = match kind {
        1 => Number::I8,
        2 => Number::I16,
        3 => Number::I32,
        4 => Number::I64,
        5 => Number::U8,
        6 => Number::U16,
        7 => Number::U32,
        8 => Number::U64,
        9 | 0x19 => Number::F32,
        10 | 0x1a => Number::F64,
        0x21 => Number::Bool,
        // A time stamp, complex numbers.
        0x44 | 0x10_000d => return Some((None, 16)),
        0x08_000c => return Some((None, 8)),
        _ => return None,
    };
    Some((Some(number), number.bytes() as u64))
}

fn string(cursor: &mut Cursor) -> Result<String, Reason> {
    let length = u64::from(cursor.u32()?);
    cursor.text(length)
}

/// Group and channel of a path: `/'fast'/'it''s'`; the root and groups have none.
fn names(path: &str) -> Option<(String, String)> {
    let inner = path.strip_prefix("/'")?.strip_suffix('\'')?;
    let (group, channel) = inner.split_once("'/'")?;
    Some((group.replace("''", "'"), channel.replace("''", "'")))
}

#[cfg(test)]
mod tests {
    /// Guards quotes in names, which are doubled in paths.
    #[test]
    fn a_path_is_a_group_and_a_channel() {
        let names = |path| super::names(path).map(|(group, name)| format!("{group}|{name}"));
        assert_eq!(names("/'rig'/'it''s'").as_deref(), Some("rig|it's"));
        assert_eq!(names("/'rig'"), None);
        assert_eq!(names("/"), None);
    }
}
