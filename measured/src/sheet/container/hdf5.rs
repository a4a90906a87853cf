//! HDF5 and MATLAB 7.3 (which is HDF5 after 512 bytes): datasets of numbers, in groups; tables of records, a channel a field.
//!
//! The unit is the attribute `units` (or `unit`). What MATLAB stores as text, and what its references point to, is no channel.

use hdf5_pure::{AttrValue, Dataset, Datatype, DatatypeByteOrder, File, FloatingPointLayout, Group};

use super::numbers::Number;
use super::{Budget, Channel, MOST_EXPANSION, Reason, channels_of};

/// Groups in groups.
const MOST_DEPTH: usize = 16;
/// Datasets and groups of one file.
const MOST_OBJECTS: usize = 20_000;
/// MATLAB's own groups: what references point to, and the data of objects.
const INTERNAL: [&str; 2] = ["#refs#", "#subsystem#"];

/// The channels of one file.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Channel>, Reason> {
    let file = File::from_bytes(bytes.to_vec()).map_err(|cause| cause.to_string())?;
    let mut reader = Reader {
        most_bytes: (bytes.len() as u64).saturating_mul(MOST_EXPANSION),
        ..Reader::default()
    };
    reader.group(&file.root(), "", 0)?;
    Ok(reader.channels)
}

#[derive(Default)]
struct Reader {
    channels: Vec<Channel>,
    budget: Budget,
    objects: usize,
    /// What the file's bytes can be at most once they are inflated.
    most_bytes: u64,
}

impl Reader {
    fn group(&mut self, group: &Group, path: &str, depth: usize) -> Result<(), Reason> {
        if depth == MOST_DEPTH {
            return Err(format!("groups stand in one another more than {MOST_DEPTH} deep"));
        }
        for name in group.datasets().map_err(|cause| cause.to_string())? {
            self.count()?;
            let dataset = group.dataset(&name).map_err(|cause| cause.to_string())?;
            let read = self.dataset(&dataset, path, &name);
            read.map_err(|cause| format!("dataset \"{name}\": {cause}"))?;
        }
        for name in group.groups().map_err(|cause| cause.to_string())? {
            self.count()?;
            if INTERNAL.contains(&name.as_str()) {
                continue;
            }
            let inner = group.group(&name).map_err(|cause| cause.to_string())?;
            let path = if path.is_empty() {
                name
            } else {
                format!("{path}/{name}")
            };
            self.group(&inner, &path, depth + 1)?;
        }
        Ok(())
    }

    /// A group that holds itself would never end.
    fn count(&mut self) -> Result<(), Reason> {
        self.objects += 1;
        if self.objects > MOST_OBJECTS {
            return Err(format!("it holds more than {MOST_OBJECTS} datasets and groups"));
        }
        Ok(())
    }

    fn dataset(&mut self, dataset: &Dataset, group: &str, name: &str) -> Result<(), Reason> {
        let shape = dataset.shape().map_err(|cause| cause.to_string())?;
        let datatype = dataset.datatype().map_err(|cause| cause.to_string())?;
        let fields = fields(&datatype);
        if fields.is_empty() || shape.iter().all(|side| *side == 1) {
            return Ok(());
        }
        let attributes = dataset.attrs().map_err(|cause| cause.to_string())?;
        let text = |key: &str| {
            attributes
                .get(key)
                .and_then(AttrValue::as_str)
                .map(|text| text.trim_end_matches('\0').to_owned())
        };
        if text("MATLAB_class").is_some_and(|class| ["char", "cell", "table", "string"].contains(&class.as_str())) {
            return Ok(());
        }
        let unit = text("units").or_else(|| text("unit")).or_else(|| text("Units"));
        let record = dataset.element_size().map_err(|cause| cause.to_string())?;
        let elements = shape
            .iter()
            .try_fold(1, |product: u64, side| product.checked_mul(*side));
        let announced = elements.and_then(|elements| elements.checked_mul(record));
        if announced.is_none_or(|announced| announced > self.most_bytes) {
            return Err(format!("its size of {shape:?} is more than the file can hold"));
        }
        let elements = elements.unwrap_or(0);
        self.budget.take(name, elements.saturating_mul(fields.len() as u64))?;
        let raw = dataset.read_raw().map_err(|cause| cause.to_string())?;
        for field in fields {
            let own = field.name.unwrap_or(name);
            let group = match field.name {
                Some(_) if !group.is_empty() => format!("{group}/{name}"),
                Some(_) => name.to_owned(),
                None => group.to_owned(),
            };
            let from = raw.get(field.at..).unwrap_or_default();
            let values = field.number.series(from, record as usize, field.big_endian);
            if values.len() as u64 != elements {
                return Err(format!("it holds {} numbers, but its size is {shape:?}", values.len()));
            }
            let channel = Channel::stored(&group, own, unit.clone(), values);
            self.channels.extend(channels_of(channel, &shape, false));
        }
        Ok(())
    }
}

/// Numbers in an element: one, or those of a record that are numbers.
struct Field<'a> {
    name: Option<&'a str>,
    number: Number,
    big_endian: bool,
    at: usize,
}

fn fields(datatype: &Datatype) -> Vec<Field<'_>> {
    if let Datatype::Compound { members, .. } = datatype {
        let numbers = members.iter().filter_map(|member| {
            let (number, big_endian) = stored(&member.datatype)?;
            Some(Field {
                name: Some(&member.name),
                number,
                big_endian,
                at: member.byte_offset as usize,
            })
        });
        return numbers.collect();
    }
    let number = stored(datatype).map(|(number, big_endian)| Field {
        name: None,
        number,
        big_endian,
        at: 0,
    });
    number.into_iter().collect()
}

/// How a number is stored, and whether its bytes are big-endian.
fn stored(datatype: &Datatype) -> Option<(Number, bool)> {
    let (kind, size, order) = match datatype {
        Datatype::FixedPoint {
            size,
            byte_order,
            layout,
        } => {
            let whole = layout.bit_offset == 0 && u32::from(layout.bit_precision) == 8 * size;
            let kind = if layout.signed { 'i' } else { 'u' };
            (kind, size, whole.then_some(byte_order)?)
        }
        Datatype::FloatingPoint {
            size,
            byte_order,
            layout,
        } => {
            let usual = [
                FloatingPointLayout::IEEE754_BINARY32,
                FloatingPointLayout::IEEE754_BINARY64,
            ];
            ('f', size, usual.contains(layout).then_some(byte_order)?)
        }
        // h5py's truth values are such.
        Datatype::Enumeration { base_type, .. } => return stored(base_type),
        _ => return None,
    };
    let big_endian = match order {
        DatatypeByteOrder::LittleEndian => false,
        DatatypeByteOrder::BigEndian => true,
        DatatypeByteOrder::Vax => return None,
    };
    Some((Number::of(kind, u64::from(*size))?, big_endian))
}
