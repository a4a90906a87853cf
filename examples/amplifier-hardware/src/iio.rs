//! millivolts = (raw + offset)·scale: converters of Linux' Industrial I/O, through their files in sysfs.
//!
//! raw integer of the converter, offset in the same counts (0 without a file), scale in mV per count. The folder is
//! `/sys/bus/iio/devices/iio:deviceN`; any folder with the same files will do. Two files are opened a tick: a faster
//! loop wants the buffers of `iio_buffer.rs`, or Comedi behind the same trait.
//! Source: kernel documentation, ABI/testing/sysfs-bus-iio.

use crate::converter::{Converter, ConverterError};
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// One channel's files and constants.
#[derive(Debug)]
struct Channel {
    raw: PathBuf,
    scale: Scale,
}

/// A channel's constants.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scale {
    scale_mv: f64,
    offset: f64,
}

/// An output and an input of a device.
#[derive(Debug)]
pub struct Iio {
    output: Channel,
    input: Channel,
}

impl Iio {
    /// Opens `out_OUTPUT_raw` in the folder of the output's device and `in_INPUT_raw` in that of the input's, with their scales and offsets.
    ///
    /// # Errors
    /// A file that is missing or holds no number.
    pub fn open(output: (&Path, &str), input: (&Path, &str)) -> Result<Self, ConverterError> {
        Ok(Self {
            output: Channel::open(output.0, &format!("out_{}", output.1))?,
            input: Channel::open(input.0, &format!("in_{}", input.1))?,
        })
    }
}

impl Scale {
    pub fn open(folder: &Path, name: &str) -> Result<Self, ConverterError> {
        let file = |ending: &str| folder.join(format!("{name}_{ending}"));
        let scale = file("scale");
        let scale_mv = read_number(&scale)?;
        if !(scale_mv.is_finite() && scale_mv != 0.0) {
            return Err(ConverterError::Scale {
                path: scale,
                scale: scale_mv,
            });
        }
        let offset = file("offset");
        let offset = if offset.exists() { read_number(&offset)? } else { 0.0 };
        Ok(Self { scale_mv, offset })
    }

    /// Counts, not rounded.
    pub fn raw(self, volts: f64) -> f64 {
        volts * 1e3 / self.scale_mv - self.offset
    }

    pub fn volts(self, raw: f64) -> f64 {
        (raw + self.offset) * self.scale_mv * 1e-3
    }
}

impl Channel {
    fn open(folder: &Path, name: &str) -> Result<Self, ConverterError> {
        let scale = Scale::open(folder, name)?;
        let raw = folder.join(format!("{name}_raw"));
        File::open(&raw).map_err(|cause| refused(&raw, cause))?;
        Ok(Self { raw, scale })
    }
}

impl Converter for Iio {
    fn write_volts(&mut self, volts: f64) -> Result<(), ConverterError> {
        let channel = &self.output;
        let raw = channel.scale.raw(volts).round() as i64;
        // On the stack: a step does not allocate.
        let mut text = [0_u8; 24];
        let mut free = &mut text[..];
        let written = write!(free, "{raw}").map(|()| free.len());
        let used = 24 - written.map_err(|cause| refused(&channel.raw, cause))?;
        let mut file = File::create(&channel.raw).map_err(|cause| refused(&channel.raw, cause))?;
        // One write: sysfs takes each as a whole value.
        file.write_all(&text[..used])
            .map_err(|cause| refused(&channel.raw, cause))
    }

    fn read_volts(&mut self) -> Result<f64, ConverterError> {
        let channel = &self.input;
        Ok(channel.scale.volts(read_number(&channel.raw)?))
    }
}

fn read_number(path: &Path) -> Result<f64, ConverterError> {
    let mut text = [0_u8; 64];
    let mut file = File::open(path).map_err(|cause| refused(path, cause))?;
    let length = file.read(&mut text).map_err(|cause| refused(path, cause))?;
    std::str::from_utf8(&text[..length])
        .ok()
        .and_then(|text| text.trim().parse().ok())
        .ok_or_else(|| ConverterError::NotANumber { path: path.to_owned() })
}

pub(crate) fn refused(path: &Path, cause: std::io::Error) -> ConverterError {
    ConverterError::File {
        path: path.to_owned(),
        cause,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder like a device's: a 16-bit converter of ±10 V with its middle at 32768, its input tied to its output.
    fn device() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for direction in ["out", "in"] {
            std::fs::write(
                folder.path().join(format!("{direction}_voltage0_scale")),
                "0.305175781\n",
            )
            .unwrap();
            std::fs::write(folder.path().join(format!("{direction}_voltage0_offset")), "-32768\n").unwrap();
        }
        std::fs::write(folder.path().join("out_voltage0_raw"), "32768\n").unwrap();
        std::os::unix::fs::symlink("out_voltage0_raw", folder.path().join("in_voltage0_raw")).unwrap();
        folder
    }

    /// Guards the conversion: counts by the kernel's formula, and the same voltage back to half a count.
    #[test]
    fn volts_become_counts_and_come_back() {
        let folder = device();
        let mut iio = Iio::open((folder.path(), "voltage0"), (folder.path(), "voltage0")).unwrap();
        assert_eq!(iio.read_volts().unwrap(), 0.0);
        for (volts, raw) in [(5.0, "49152"), (-5.0, "16384"), (0.0, "32768"), (-9.9, "328")] {
            iio.write_volts(volts).unwrap();
            assert_eq!(
                std::fs::read_to_string(folder.path().join("out_voltage0_raw")).unwrap(),
                raw
            );
            assert!((iio.read_volts().unwrap() - volts).abs() < 0.16e-3);
        }
    }

    /// Guards the refusals: a missing device and a missing scale are named before any voltage is put out.
    #[test]
    fn a_device_that_is_not_there_is_named() {
        let folder = device();
        let missing = Iio::open((folder.path(), "voltage1"), (folder.path(), "voltage0"))
            .unwrap_err()
            .to_string();
        assert!(missing.contains("out_voltage1_scale cannot be used"), "{missing}");
        std::fs::write(folder.path().join("out_voltage0_scale"), "0\n").unwrap();
        let zero = Iio::open((folder.path(), "voltage0"), (folder.path(), "voltage0"))
            .unwrap_err()
            .to_string();
        assert!(zero.contains("scale of 0 mV"), "{zero}");
    }
}
