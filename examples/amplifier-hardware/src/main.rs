//! A real amplifier in the loop: safe fields in, volts out, the current monitor back. Copy it, and put your board behind
//! [`converter::Converter`]; `iio.rs`, `iio_buffer.rs` and `ethercat.rs` (cargo feature) are some that exist.
//!
//!     anhyst run SCENARIO --external-command \
//!         amplifier='target/release/anhyst-amplifier-hardware --device /sys/bus/iio/devices/iio:device0'

mod board;
mod converter;
mod drive;
#[cfg(feature = "ethercat")]
mod ethercat;
mod iio;
mod iio_buffer;

use anhyst_ipc::{
    Channel, CoilField, ExternalClock, ExternalNode, ExternalSettings, LinkError, MAX_WORDS, Message, Received,
    SafeField,
};
use clap::Parser;
use converter::Converter;
use drive::{Constants, Drive, SILENT};
use std::process::ExitCode;
use std::time::Duration;

/// Drives a current amplifier through a converter.
#[derive(Debug, Parser)]
struct Arguments {
    /// What it is reached by.
    #[command(flatten)]
    board: board::BoardArguments,
    /// After so long without a safe field the output goes to zero (default: the run's receive limit, because in lockstep time
    /// waits for the slowest process; on a rig give a few ticks).
    #[arg(long)]
    silence_limit_s: Option<f64>,
    /// The amplifier.
    #[command(flatten)]
    constants: Constants,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(sentence) => {
            eprintln!("amplifier: {sentence}");
            ExitCode::from(3)
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    arguments.constants.validate()?;
    for signal in [signal_hook::consts::SIGTERM, signal_hook::consts::SIGINT] {
        // Told to end, the wait for a token ends, and the output is made safe below.
        signal_hook::flag::register(signal, anhyst_ipc::stop_flag()).map_err(|error| error.to_string())?;
    }
    let tick_s = number("ANHYST_TICK_S", None)?;
    let silence_limit_s = match arguments.silence_limit_s {
        Some(limit_s) => limit_s,
        None => number("ANHYST_RECEIVE_LIMIT_S", Some(2.0))?,
    };
    let start_limit_s = number("ANHYST_START_LIMIT_S", Some(60.0))?;
    let times = [tick_s, silence_limit_s, start_limit_s];
    if let Some(wrong) = times.iter().find(|time_s| !(1e-6..=86_400.0).contains(*time_s)) {
        return Err(format!("a time of {wrong} s is outside [1e-6, 86400] s"));
    }
    let say = |error: LinkError| error.to_string();
    let board = arguments.board.open()?;
    let drive = Drive::start(board, arguments.constants, tick_s);
    let mut drive = drive.map_err(|error| error.to_string())?;
    let clock = std::env::var("ANHYST_CLOCK").unwrap_or_else(|_| "lockstep".into());
    let clock = ExternalClock::told(&clock, tick_s).map_err(say)?;
    let settings = ExternalSettings {
        process: variable("ANHYST_PROCESS")?,
        prefix: variable("ANHYST_SERVICE_PREFIX")?,
        root: variable("ANHYST_ROOT")?.into(),
        processes: variable("ANHYST_PROCESSES").ok(),
        reads: vec![Channel::SafeField],
        yields: 20,
        start_limit: Duration::from_secs_f64(start_limit_s),
    };
    let mut node = ExternalNode::open(settings, clock).map_err(say)?;
    let mut tick = 0;
    let outcome = serve(
        &mut node,
        &mut drive,
        Duration::from_secs_f64(silence_limit_s),
        &mut tick,
    );
    // Whatever ended the loop, the coil comes first.
    match outcome {
        Ok(()) => drive.make_safe(0, &mut |_, _| {}),
        // Readers that are gone need no field.
        Err(_) => drive.make_safe(SILENT, &mut |field_a_per_m, status| {
            let _ = answer(&mut node, &mut tick, field_a_per_m, status);
        }),
    }
    outcome?;
    node.close().map_err(say)?;
    match drive.faults() {
        0 => Ok(()),
        faults => Err(format!("the run ended with faults {faults:#x} latched")),
    }
}

/// What the launcher tells by an environment variable.
fn variable(name: &str) -> Result<String, String> {
    std::env::var(name).map_err(|_| format!("{name} is not set: see docs/interface.md"))
}

fn number(name: &str, default: Option<f64>) -> Result<f64, String> {
    match (std::env::var(name), default) {
        (Ok(text), _) => text.parse().map_err(|_| format!("{name}={text} is no number")),
        (Err(_), Some(default)) => Ok(default),
        (Err(_), None) => Err(format!("{name} is not set: see docs/interface.md")),
    }
}

/// Answers every safe field until the run is over; `next` is the tick of the next answer.
fn serve<C: Converter>(
    node: &mut ExternalNode,
    drive: &mut Drive<C>,
    silence_limit: Duration,
    next: &mut u64,
) -> Result<(), String> {
    let mut words = [0; MAX_WORDS];
    loop {
        let heard = node.receive(Channel::SafeField, silence_limit, &mut words);
        *next = match heard.map_err(|error| error.to_string())? {
            Received::Token(tick) => tick,
            Received::Silence => return Err(format!("the guard has been silent for {silence_limit:?}")),
            Received::End => return Ok(()),
        };
        let safe = SafeField::from_words(*next, &words[2..]);
        let (field_a_per_m, status) = drive.step(safe.field_a_per_m);
        answer(node, next, field_a_per_m, status).map_err(|error| error.to_string())?;
    }
}

/// Says what is in the coil, and counts.
fn answer(node: &mut ExternalNode, tick: &mut u64, field_a_per_m: f64, status: u64) -> Result<(), LinkError> {
    let coil = CoilField {
        tick: *tick,
        field_a_per_m,
        status,
        ..CoilField::default()
    };
    let mut words = [0; MAX_WORDS];
    words[0] = *tick;
    coil.write_words(&mut words[2..]);
    *tick += 1;
    node.send(Channel::CoilField, &words)
}
