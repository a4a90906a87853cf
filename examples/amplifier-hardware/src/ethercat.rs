//! volts = count·V/32767: analogue terminals on an EtherCAT line, count a signed 16-bit number in the process data (V full scale, as of ±10 V terminals).
//!
//! One exchange carries all outputs out and all inputs in. A tick makes two: the command goes out in the first, the monitor comes in the second, so
//! it is of after the command as far as the terminal's own conversion allows. A terminal is named by its place on the line, a value by
//! its byte in the terminal's image: 0 for an output, 2 for an input behind two bytes of status.
//!
//! Watchdog: an exchange that does not come back, or not from all (its working counter is 2 for each terminal with outputs and 1 for each with inputs), is lost,
//! and the last values hold; more of them in a row than `lost_exchanges` refuse. The terminals' own watchdog (100 ms unless set otherwise) takes outputs to
//! their safe values where no exchange comes any more. No distributed clocks: terminals sample when the frame passes.
//! Source: ETG.1000.4, logical addressing; the master is the crate ethercrab.

use crate::converter::{Converter, ConverterError};
use ethercrab::error::Error;
use ethercrab::std::{ethercat_now, tx_rx_task};
use ethercrab::subdevice_group::Op;
use ethercrab::{DefaultLock, MainDevice, MainDeviceConfig, PduRx, PduStorage, PduTx, SubDeviceGroup, Timeouts};
use futures_lite::future::block_on;
use std::time::{Duration, Instant};

/// Terminals on a line; a power of two.
const MOST_TERMINALS: usize = 32;
/// Bytes of all process data, and of a frame.
const MOST_BYTES: usize = 256;
const FRAMES: usize = 16;
/// Full scale in counts.
const FULL_SCALE: f64 = 32_767.0;
/// For terminals to come into operation.
const OPERATION_LIMIT: Duration = Duration::from_secs(5);

type Storage = PduStorage<FRAMES, { PduStorage::element_size(MOST_BYTES) }>;
type Group = SubDeviceGroup<MOST_TERMINALS, MOST_BYTES, DefaultLock, Op>;

/// A value on the line.
#[derive(Debug, Clone, Copy)]
pub struct Slot {
    /// Which terminal, counted from the master, the coupler being 0.
    pub terminal: usize,
    /// Where in its outputs, or inputs.
    pub byte: usize,
}

/// An output and an input on a line.
pub struct Ethercat {
    line: String,
    main: MainDevice<'static>,
    group: Group,
    output: Slot,
    input: Slot,
    full_scale_v: f64,
    /// Of an exchange with all.
    working_counter: u16,
    lost: u32,
    lost_exchanges: u32,
    volts: f64,
}

/// What a line needs beside its frames.
#[derive(Debug, Clone, Copy)]
pub struct Terminals {
    pub output: Slot,
    pub input: Slot,
    /// Of both.
    pub full_scale_v: f64,
    /// So many exchanges in a row may be lost.
    pub lost_exchanges: u32,
    /// An exchange that has not come back by then is lost.
    pub exchange_limit: Duration,
}

impl Ethercat {
    /// The line behind a network interface, brought into operation.
    ///
    /// # Errors
    /// An interface that cannot be had (it needs the right to raw sockets), a line that does not come into operation, terminals without such values.
    pub fn open(interface: &str, terminals: Terminals) -> Result<Self, ConverterError> {
        let interface = interface.to_owned();
        let line = interface.clone();
        Self::behind(&line, terminals, move |tx, rx| {
            let task = tx_rx_task(&interface, tx, rx).map_err(|cause| refused(&interface, &cause))?;
            std::thread::spawn(move || {
                // Where it ends exchanges do not come back, which is what is told.
                let _ = block_on(task);
            });
            Ok(())
        })
    }

    /// The same with whoever carries the frames.
    pub(crate) fn behind(
        line: &str,
        terminals: Terminals,
        carry: impl FnOnce(PduTx<'static>, PduRx<'static>) -> Result<(), ConverterError>,
    ) -> Result<Self, ConverterError> {
        // One a process, which lives as long.
        let storage: &'static Storage = Box::leak(Box::new(Storage::new()));
        let (tx, rx, pdu_loop) = storage.try_split().map_err(|()| told(line, "its frames are in use"))?;
        carry(tx, rx)?;
        let timeouts = Timeouts {
            pdu: terminals.exchange_limit,
            ..Timeouts::default()
        };
        let main = MainDevice::new(pdu_loop, timeouts, MainDeviceConfig::default());
        let group = block_on(operating(&main)).map_err(|cause| refused(line, &cause))?;
        let mut working_counter = 0;
        for terminal in group.iter(&main) {
            working_counter += 2 * u16::from(!terminal.outputs_raw().is_empty());
            working_counter += u16::from(!terminal.inputs_raw().is_empty());
        }
        let own = Self {
            line: line.to_owned(),
            main,
            group,
            output: terminals.output,
            input: terminals.input,
            full_scale_v: terminals.full_scale_v,
            working_counter,
            lost: 0,
            lost_exchanges: terminals.lost_exchanges,
            volts: 0.0,
        };
        own.has(own.output, "output", true)?;
        own.has(own.input, "input", false)?;
        Ok(own)
    }

    /// Refuses a value that the line does not have.
    fn has(&self, slot: Slot, what: &str, is_output: bool) -> Result<(), ConverterError> {
        let count = self.group.len();
        let terminal = self.group.subdevice(&self.main, slot.terminal);
        let Ok(terminal) = terminal else {
            let sentence = format!(
                "has {count} terminals, and the {what} is on number {}, counted from 0",
                slot.terminal
            );
            return Err(told(&self.line, &sentence));
        };
        let bytes = match is_output {
            true => terminal.outputs_raw().len(),
            false => terminal.inputs_raw().len(),
        };
        if slot.byte + 2 <= bytes {
            return Ok(());
        }
        let sentence = format!(
            "terminal {} ({}) has {bytes} bytes of {what}s, and the {what}'s two begin at byte {}",
            slot.terminal,
            terminal.name(),
            slot.byte
        );
        Err(told(&self.line, &sentence))
    }

    /// Everything out and in; true if it was for all.
    fn exchange(&mut self) -> Result<bool, ConverterError> {
        let came = match block_on(self.group.tx_rx(&self.main)) {
            Ok(response) if response.working_counter == self.working_counter => {
                self.lost = 0;
                return Ok(true);
            }
            Ok(response) => format!(
                "an exchange came back with a working counter of {}, {} would be all",
                response.working_counter, self.working_counter
            ),
            Err(cause) => cause.to_string(),
        };
        self.lost += 1;
        if self.lost <= self.lost_exchanges {
            return Ok(false);
        }
        Err(told(
            &self.line,
            &format!("lost {} exchanges in a row: {came}", self.lost),
        ))
    }
}

/// From nothing to operation: the state in which outputs are put out.
async fn operating(main: &MainDevice<'static>) -> Result<Group, Error> {
    let group = main
        .init_single_group::<MOST_TERMINALS, MOST_BYTES>(ethercat_now)
        .await?;
    let group = group.into_safe_op(main).await?.request_into_op(main).await?;
    let begin = Instant::now();
    // Terminals with a watchdog come into operation while they are exchanged with.
    while !group.tx_rx(main).await?.all_op() {
        if begin.elapsed() > OPERATION_LIMIT {
            return Err(Error::StateTransition);
        }
    }
    Ok(group)
}

fn told(line: &str, sentence: &str) -> ConverterError {
    ConverterError::Line {
        line: line.to_owned(),
        sentence: sentence.to_owned(),
    }
}

fn refused(line: &str, cause: &dyn std::fmt::Display) -> ConverterError {
    told(line, &cause.to_string())
}

impl Converter for Ethercat {
    fn write_volts(&mut self, volts: f64) -> Result<(), ConverterError> {
        let count = (volts / self.full_scale_v * FULL_SCALE)
            .round()
            .clamp(-FULL_SCALE, FULL_SCALE) as i16;
        let terminal = self.group.subdevice(&self.main, self.output.terminal);
        let terminal = terminal.map_err(|cause| refused(&self.line, &cause))?;
        terminal.outputs_raw_mut()[self.output.byte..self.output.byte + 2].copy_from_slice(&count.to_le_bytes());
        self.exchange().map(|_| ())
    }

    fn read_volts(&mut self) -> Result<f64, ConverterError> {
        if self.exchange()? {
            let terminal = self.group.subdevice(&self.main, self.input.terminal);
            let terminal = terminal.map_err(|cause| refused(&self.line, &cause))?;
            let inputs = terminal.inputs_raw();
            let count = i16::from_le_bytes([inputs[self.input.byte], inputs[self.input.byte + 1]]);
            self.volts = f64::from(count) * self.full_scale_v / FULL_SCALE;
        }
        Ok(self.volts)
    }
}

#[cfg(test)]
#[path = "ethercat_tests.rs"]
mod tests;
