//! Which board, and how it is reached: arguments, and the converter that they mean.

use crate::converter::Converter;
#[cfg(feature = "ethercat")]
use crate::ethercat::{Ethercat, Slot, Terminals};
use crate::iio::Iio;
use crate::iio_buffer::{IioBuffers, Place};
use std::path::{Path, PathBuf};

/// Samples that a buffer keeps: one is on its way, one comes.
const BUFFER_LENGTH: u32 = 2;

/// A device of Linux' Industrial I/O, or a line of EtherCAT.
#[derive(Debug, clap::Args)]
pub struct BoardArguments {
    /// Folder of the converter's files.
    #[arg(long)]
    device: Option<PathBuf>,
    /// Folder of the input's files, where it is another device's.
    #[arg(long)]
    input_device: Option<PathBuf>,
    /// The output's name in them.
    #[arg(long, default_value = "voltage0")]
    output: String,
    /// The input's name in them.
    #[arg(long, default_value = "voltage0")]
    input: String,
    /// Take samples from the devices' triggered buffers, /dev/iio:deviceN of each folder, instead of opening files in each tick.
    #[arg(long)]
    buffered: bool,
    /// The buffers' character devices are here.
    #[arg(long, default_value = "/dev")]
    streams: PathBuf,
    /// What makes the buffered devices sample (default: what is set already).
    #[arg(long)]
    trigger: Option<String>,
    /// So many ticks a buffer may give no sample.
    #[arg(long, default_value_t = 20)]
    stale_ticks: u32,
    /// A line.
    #[cfg(feature = "ethercat")]
    #[command(flatten)]
    line: LineArguments,
}

/// A line of EtherCAT.
#[cfg(feature = "ethercat")]
#[derive(Debug, clap::Args)]
pub struct LineArguments {
    /// Take analogue terminals on EtherCAT behind this network interface, instead of a device.
    #[arg(long, value_name = "INTERFACE", conflicts_with = "device")]
    ethercat: Option<String>,
    /// The output's terminal, counted from 0, which is the coupler.
    #[arg(long, default_value_t = 1)]
    output_terminal: usize,
    /// Where its value begins in the terminal's outputs.
    #[arg(long, default_value_t = 0)]
    output_byte: usize,
    /// The input's terminal.
    #[arg(long, default_value_t = 2)]
    input_terminal: usize,
    /// Where its value begins in the terminal's inputs: behind two bytes of status.
    #[arg(long, default_value_t = 2)]
    input_byte: usize,
    /// Full scale of both, V.
    #[arg(long, default_value_t = 10.0)]
    full_scale_v: f64,
    /// So many exchanges in a row may be lost.
    #[arg(long, default_value_t = 5)]
    lost_exchanges: u32,
    /// An exchange that takes longer is lost, s.
    #[arg(long, default_value_t = 2e-3)]
    exchange_limit_s: f64,
}

impl BoardArguments {
    /// The board, ready.
    ///
    /// # Errors
    /// A sentence.
    pub fn open(&self) -> Result<Box<dyn Converter>, String> {
        #[cfg(feature = "ethercat")]
        if let Some(interface) = &self.line.ethercat {
            let line = Ethercat::open(interface, self.line.terminals()?);
            return Ok(Box::new(line.map_err(|error| error.to_string())?));
        }
        let device = self.device.as_ref().ok_or("which board? give --device FOLDER")?;
        let input_device = self.input_device.as_ref().unwrap_or(device);
        if self.buffered {
            return self.buffers(device, input_device);
        }
        let files = Iio::open((device, &self.output), (input_device, &self.input));
        Ok(Box::new(files.map_err(|error| error.to_string())?))
    }

    fn buffers(&self, device: &Path, input_device: &Path) -> Result<Box<dyn Converter>, String> {
        if input_device == device {
            return Err("a device has one buffer: with --buffered give that of the input with --input-device".into());
        }
        let place = |folder: &Path, channel: String| Place {
            device: self.streams.join(folder.file_name().unwrap_or_default()),
            folder: folder.to_owned(),
            channel,
            trigger: self.trigger.clone(),
            length: BUFFER_LENGTH,
        };
        let output = place(device, format!("out_{}", self.output));
        let input = place(input_device, format!("in_{}", self.input));
        let buffers = IioBuffers::open(&output, &input, self.stale_ticks);
        Ok(Box::new(buffers.map_err(|error| error.to_string())?))
    }
}

#[cfg(feature = "ethercat")]
impl LineArguments {
    fn terminals(&self) -> Result<Terminals, String> {
        let positive = [
            ("full scale", self.full_scale_v, "V"),
            ("exchange's limit", self.exchange_limit_s, "s"),
        ];
        if let Some((name, value, unit)) = positive.iter().find(|own| !(1e-6..=1e3).contains(&own.1)) {
            return Err(format!(
                "the {name} is {value} {unit}; it must be within [1e-6, 1000] {unit}"
            ));
        }
        Ok(Terminals {
            output: Slot {
                terminal: self.output_terminal,
                byte: self.output_byte,
            },
            input: Slot {
                terminal: self.input_terminal,
                byte: self.input_byte,
            },
            full_scale_v: self.full_scale_v,
            lost_exchanges: self.lost_exchanges,
            exchange_limit: std::time::Duration::from_secs_f64(self.exchange_limit_s),
        })
    }
}
