//! The contract between the processes, rendered from the message types, the services' settings and the blocks' wiring.
//! `docs/interface.md`, `driver/include/anhyst.h` and the Python example's module are outputs of it; a test compares them.

mod c_header;
mod markdown;
mod python;
mod wiring;

pub use c_header::c_header;
pub use markdown::markdown;
pub use python::python;

use anhyst_ipc::{Interface, Wire};
use serde::Serialize;

#[derive(Serialize)]
struct Everything {
    #[serde(flatten)]
    interface: Interface,
    wires: Vec<Arrow>,
    variables: Vec<(&'static str, &'static str)>,
}

#[derive(Serialize)]
struct Arrow {
    channel: &'static str,
    reader: &'static str,
    ticks_late: u64,
}

/// The whole interface as JSON.
///
/// # Errors
/// If serde refuses, which it does not.
pub fn json() -> Result<String, serde_json::Error> {
    let arrow = |wire: Wire| Arrow {
        channel: wire.channel.name(),
        reader: wire.reader.name(),
        ticks_late: wire.delay,
    };
    serde_json::to_string_pretty(&Everything {
        interface: anhyst_ipc::interface(),
        wires: anhyst_scenario::wires().into_iter().map(arrow).collect(),
        variables: anhyst_launch::external::VARIABLES.into(),
    })
}
