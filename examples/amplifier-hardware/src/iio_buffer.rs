//! Triggered buffers of Linux' Industrial I/O: a sample is so many bytes in the character device, and no file is opened in a tick.
//!
//! volts = (raw + offset)·scale/1000, raw out of the sample's bytes by `scan_elements/…_type`, `[be|le]:[s|u]BITS/STORAGE[>>SHIFT]`. Only our
//! channel is enabled, so a sample is its storage. A tick takes the newest sample that is there and puts out one; it never waits.
//!
//! Watchdog: a buffer that gives no sample for `stale_ticks` ticks, and one that takes none, refuse; the drive then takes the output to zero.
//! Assumptions: the trigger runs at the tick's rate or faster; an output that is queued is at most `length` samples late. What is written
//! while the trigger of the output stands is put out when it runs again: its board's own watchdog has to take care of that.
//! Source: kernel documentation, ABI/testing/sysfs-bus-iio, driver-api/iio/buffers.

use crate::converter::{Converter, ConverterError};
use crate::iio::{Scale, refused};
use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

/// Samples that are read at once: what lies there beyond them is read in the same tick.
const AT_ONCE: usize = 64;
/// More of them in a tick are a device that gives without end.
const READS: usize = 64;
/// The widest storage, bytes.
const WIDEST: usize = 8;

/// Where a channel is.
#[derive(Debug, Clone)]
pub struct Place {
    /// Folder of the device in sysfs.
    pub folder: PathBuf,
    /// Its character device.
    pub device: PathBuf,
    /// `in_voltage0`, `out_voltage0`.
    pub channel: String,
    /// What makes it sample; none: what is set already.
    pub trigger: Option<String>,
    /// Samples that it keeps.
    pub length: u32,
}

/// How a sample lies in its bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Format {
    big_endian: bool,
    signed: bool,
    bits: u32,
    bytes: usize,
    shift: u32,
}

/// A buffer that is switched on, and off again at the end.
#[derive(Debug)]
struct Buffer {
    file: File,
    path: PathBuf,
    enable: PathBuf,
    format: Format,
    scale: Scale,
}

/// An output and an input with buffers.
#[derive(Debug)]
pub struct IioBuffers {
    output: Buffer,
    input: Buffer,
    volts: f64,
    stale: u32,
    stale_ticks: u32,
}

impl Format {
    /// Of a text as `le:s12/16>>4`.
    fn parse(text: &str) -> Option<Self> {
        let (endian, rest) = text.trim().split_once(':')?;
        let (sign, rest) = rest.split_at_checked(1)?;
        let (bits, rest) = rest.split_once('/')?;
        let (storage, shift) = rest.split_once(">>").unwrap_or((rest, "0"));
        let storage = storage.parse::<usize>().ok().filter(|bits| bits % 8 == 0)?;
        let own = Self {
            big_endian: endian == "be",
            signed: sign == "s",
            bits: bits.parse().ok()?,
            bytes: storage / 8,
            shift: shift.parse().ok()?,
        };
        let usable = [1, 2, 4, 8].contains(&own.bytes)
            && own.bits >= 1
            && own.bits.checked_add(own.shift)? <= 8 * own.bytes as u32
            && ["be", "le"].contains(&endian)
            && ["s", "u"].contains(&sign);
        usable.then_some(own)
    }

    fn mask(self) -> u64 {
        u64::MAX >> (64 - self.bits)
    }

    fn decode(self, bytes: &[u8]) -> i64 {
        let join = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
        let whole = match self.big_endian {
            true => bytes.iter().fold(0, join),
            false => bytes.iter().rev().fold(0, join),
        };
        let raw = whole >> self.shift & self.mask();
        // The highest bit is the sign.
        let left = 64 - self.bits;
        match self.signed {
            true => ((raw << left) as i64) >> left,
            false => raw as i64,
        }
    }

    /// The nearest that there is.
    fn encode(self, raw: f64) -> [u8; WIDEST] {
        let (low, high) = match self.signed {
            true => (
                -(2_f64.powi(self.bits as i32 - 1)),
                2_f64.powi(self.bits as i32 - 1) - 1.0,
            ),
            false => (0.0, 2_f64.powi(self.bits as i32) - 1.0),
        };
        let whole = ((raw.round().clamp(low, high) as i64 as u64) & self.mask()) << self.shift;
        let mut bytes = whole.to_le_bytes();
        if self.big_endian {
            bytes[..self.bytes].reverse();
        }
        bytes
    }
}

fn set(path: &Path, text: &str) -> Result<(), ConverterError> {
    std::fs::write(path, text).map_err(|cause| refused(path, cause))
}

impl Buffer {
    /// Enables the channel alone, sets length and trigger, switches on and opens, to read or to write.
    fn open(place: &Place, output: bool) -> Result<Self, ConverterError> {
        let scan = place.folder.join("scan_elements");
        let own = format!("{}_en", place.channel);
        let enable = place.folder.join("buffer/enable");
        set(&enable, "0")?;
        for entry in std::fs::read_dir(&scan).map_err(|cause| refused(&scan, cause))? {
            let name = entry.map_err(|cause| refused(&scan, cause))?.file_name();
            if name.to_string_lossy().ends_with("_en") && name.to_string_lossy() != own {
                set(&scan.join(name), "0")?;
            }
        }
        let kind = scan.join(format!("{}_type", place.channel));
        let text = std::fs::read_to_string(&kind).map_err(|cause| refused(&kind, cause))?;
        let format = Format::parse(&text).ok_or_else(|| ConverterError::Format {
            path: kind,
            text: text.trim().to_owned(),
        })?;
        set(&scan.join(own), "1")?;
        if let Some(trigger) = &place.trigger {
            set(&place.folder.join("trigger/current_trigger"), trigger)?;
        }
        set(&place.folder.join("buffer/length"), &place.length.to_string())?;
        let scale = Scale::open(&place.folder, &place.channel)?;
        let path = place.device.clone();
        let mut options = OpenOptions::new();
        let options = options.read(!output).write(output).custom_flags(libc::O_NONBLOCK);
        let file = options.open(&path).map_err(|cause| refused(&path, cause))?;
        set(&enable, "1")?;
        Ok(Self {
            file,
            path,
            enable,
            format,
            scale,
        })
    }

    /// The newest sample; none where none has come.
    fn newest(&mut self) -> Result<Option<i64>, ConverterError> {
        let mut bytes = [0; AT_ONCE * WIDEST];
        let width = self.format.bytes;
        let mut newest = None;
        for _ in 0..READS {
            let count = match self.file.read(&mut bytes[..AT_ONCE * width]) {
                Ok(count) => count,
                Err(cause) if cause.kind() == ErrorKind::WouldBlock => 0,
                Err(cause) if cause.kind() == ErrorKind::Interrupted => continue,
                Err(cause) => return Err(refused(&self.path, cause)),
            };
            if count % width != 0 {
                return Err(ConverterError::Torn {
                    path: self.path.clone(),
                    bytes: count,
                    width,
                });
            }
            if let Some(last) = count.checked_sub(width) {
                newest = Some(self.format.decode(&bytes[last..count]));
            }
            if count < AT_ONCE * width {
                break;
            }
        }
        Ok(newest)
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // There is nobody left to tell.
        let _ = set(&self.enable, "0");
    }
}

impl IioBuffers {
    /// Switches both buffers on.
    ///
    /// # Errors
    /// A file that is missing, cannot be set, or holds no format.
    pub fn open(output: &Place, input: &Place, stale_ticks: u32) -> Result<Self, ConverterError> {
        Ok(Self {
            output: Buffer::open(output, true)?,
            input: Buffer::open(input, false)?,
            volts: 0.0,
            stale: 0,
            stale_ticks,
        })
    }
}

impl Converter for IioBuffers {
    fn write_volts(&mut self, volts: f64) -> Result<(), ConverterError> {
        let own = &mut self.output;
        let sample = own.format.encode(own.scale.raw(volts));
        // A buffer takes whole samples, or none.
        own.file
            .write_all(&sample[..own.format.bytes])
            .map_err(|cause| refused(&own.path, cause))
    }

    fn read_volts(&mut self) -> Result<f64, ConverterError> {
        match self.input.newest()? {
            Some(raw) => {
                self.stale = 0;
                self.volts = self.input.scale.volts(raw as f64);
            }
            None => self.stale += 1,
        }
        if self.stale > self.stale_ticks {
            return Err(ConverterError::Stale {
                path: self.input.path.clone(),
                ticks: self.stale,
            });
        }
        Ok(self.volts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    /// A device's folder with a pipe in the place of its character device.
    fn device(root: &Path, name: &str, channel: &str, kind: &str) -> Place {
        let folder = root.join(name);
        for part in ["scan_elements", "buffer", "trigger"] {
            std::fs::create_dir_all(folder.join(part)).unwrap();
        }
        let files = [
            (format!("{channel}_scale"), "0.305175781"),
            (format!("{channel}_offset"), "0"),
            (format!("scan_elements/{channel}_en"), "0"),
            (format!("scan_elements/{channel}_type"), kind),
            ("scan_elements/in_timestamp_en".to_owned(), "1"),
            ("buffer/enable".to_owned(), "1"),
            ("buffer/length".to_owned(), "128"),
            ("trigger/current_trigger".to_owned(), ""),
        ];
        for (file, text) in files {
            std::fs::write(folder.join(file), text).unwrap();
        }
        let device = root.join(format!("{name}.pipe"));
        assert!(Command::new("mkfifo").arg(&device).status().unwrap().success());
        Place {
            folder,
            device,
            channel: channel.to_owned(),
            trigger: Some("tick".to_owned()),
            length: 2,
        }
    }

    fn said(place: &Place, file: &str) -> String {
        std::fs::read_to_string(place.folder.join(file)).unwrap()
    }

    /// The board's ends of both pipes; open to read and to write, so that no open waits.
    fn ends(output: &Place, input: &Place) -> [File; 2] {
        [output, input].map(|place| {
            let mut options = OpenOptions::new();
            let options = options.read(true).write(true).custom_flags(libc::O_NONBLOCK);
            options.open(&place.device).unwrap()
        })
    }

    /// Guards the bytes against the kernel's own examples: order, sign, shift, ends.
    #[test]
    fn samples_are_in_their_bytes_as_the_kernel_says() {
        let cases: [(&str, i64, &[u8]); 6] = [
            ("le:s12/16>>4", -2048, &[0x00, 0x80]),
            ("le:s12/16>>4", 2047, &[0xf0, 0x7f]),
            ("be:u16/16>>0", 0x1234, &[0x12, 0x34]),
            ("le:u24/32>>8", 1, &[0x00, 0x01, 0x00, 0x00]),
            ("be:s14/16>>2", -1, &[0xff, 0xfc]),
            ("le:s64/64", -5, &[0xfb, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff]),
        ];
        for (text, raw, bytes) in cases {
            let format = Format::parse(text).unwrap();
            assert_eq!(format.decode(bytes), raw, "{text}");
            assert_eq!(&format.encode(raw as f64)[..format.bytes], bytes, "{text}");
        }
        // Beyond the ends is the end.
        let format = Format::parse("be:u16/16>>0").unwrap();
        assert_eq!(format.decode(&format.encode(1e9)[..2]), 65_535);
        assert_eq!(format.decode(&format.encode(-3.0)[..2]), 0);
        for wrong in [
            "",
            "le:s12",
            "xe:s12/16>>4",
            "le:f32/32",
            "le:s16/16>>4",
            "le:s0/16",
            "le:s12/17",
            "le:s12/16X2>>4",
        ] {
            assert_eq!(Format::parse(wrong), None, "{wrong}");
        }
    }

    /// Guards what is switched on: our channel alone, the trigger, the length; and off at the end.
    #[test]
    fn buffers_are_switched_on_and_off() {
        let root = tempfile::tempdir().unwrap();
        let output = device(root.path(), "dac", "out_voltage0", "be:u16/16>>0");
        let input = device(root.path(), "adc", "in_voltage1", "le:s16/16>>0");
        let _board = ends(&output, &input);
        let own = IioBuffers::open(&output, &input, 3).unwrap();
        for (place, channel) in [(&output, "out_voltage0"), (&input, "in_voltage1")] {
            assert_eq!(said(place, &format!("scan_elements/{channel}_en")), "1");
            assert_eq!(said(place, "scan_elements/in_timestamp_en"), "0");
            assert_eq!(said(place, "trigger/current_trigger"), "tick");
            assert_eq!(
                (said(place, "buffer/length"), said(place, "buffer/enable")),
                ("2".into(), "1".into())
            );
        }
        drop(own);
        assert_eq!(
            (said(&output, "buffer/enable"), said(&input, "buffer/enable")),
            ("0".into(), "0".into())
        );
        std::fs::write(input.folder.join("scan_elements/in_voltage1_type"), "le:f32/32").unwrap();
        let refused = IioBuffers::open(&output, &input, 3).unwrap_err().to_string();
        assert!(
            refused.contains("in_voltage1_type") && refused.contains("le:f32/32"),
            "{refused}"
        );
    }

    /// Guards the newest against the oldest, a sample that has not come against one that never comes, and a torn one.
    #[test]
    fn the_newest_sample_counts_and_silence_is_a_fault() {
        let root = tempfile::tempdir().unwrap();
        let output = device(root.path(), "dac", "out_voltage0", "be:u16/16>>0");
        let input = device(root.path(), "adc", "in_voltage0", "le:s16/16>>0");
        let [mut from_dac, mut to_adc] = ends(&output, &input);
        let mut own = IioBuffers::open(&output, &input, 3).unwrap();
        own.write_volts(5.0).unwrap();
        let mut bytes = [0; 2];
        from_dac.read_exact(&mut bytes).unwrap();
        assert_eq!(u16::from_be_bytes(bytes), 16_384);
        // More than are read at once: the last of them counts.
        for raw in 0..500_i16 {
            to_adc.write_all(&raw.to_le_bytes()).unwrap();
        }
        let volts = own.read_volts().unwrap();
        assert!((volts - 499.0 * 0.305_175_781e-3).abs() < 1e-12, "{volts}");
        for _ in 0..3 {
            assert_eq!(own.read_volts().unwrap(), volts);
        }
        let stale = own.read_volts().unwrap_err().to_string();
        assert!(stale.contains("no sample for 4 ticks"), "{stale}");
        to_adc.write_all(&[1, 0, 2]).unwrap();
        let torn = own.read_volts().unwrap_err().to_string();
        assert!(torn.contains("3 bytes") && torn.contains("adc.pipe"), "{torn}");
        // A converter that takes nothing any more: its buffer is full.
        let full = (0..100_000)
            .find_map(|_| own.write_volts(1.0).err())
            .unwrap()
            .to_string();
        assert!(full.contains("dac.pipe"), "{full}");
    }
}
