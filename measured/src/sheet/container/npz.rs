//! NumPy's `.npz`: a zip archive with one `.npy` an array.

use std::io::{Cursor, Read};

use super::{Budget, Channel, MOST_EXPANSION, Reason, npy};

/// Arrays of one archive.
const MOST_ARRAYS: usize = 10_000;

/// The channels of all arrays.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Channel>, Reason> {
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|cause| cause.to_string())?;
    if archive.len() > MOST_ARRAYS {
        return Err(format!(
            "it holds {} arrays, at most {MOST_ARRAYS} are read",
            archive.len()
        ));
    }
    let (mut channels, mut budget) = (Vec::new(), Budget::default());
    for index in 0..archive.len() {
        let entry = archive.by_index(index).map_err(|cause| cause.to_string())?;
        let name = entry.name().map_err(|cause| cause.to_string())?.into_owned();
        let Some(name) = name.strip_suffix(".npy") else {
            continue;
        };
        let most = entry
            .compressed_size()
            .min(bytes.len() as u64)
            .saturating_mul(MOST_EXPANSION);
        let mut array = Vec::new();
        let read = entry.take(most).read_to_end(&mut array);
        read.map_err(|cause| format!("array \"{name}\" is broken: {cause}"))?;
        // Text, dates and objects beside the channels are nobody's error.
        channels.extend(npy::channels(&array, name, &mut budget)?.unwrap_or_default());
    }
    Ok(channels)
}
