//! `anhyst interface`: the contract between the processes of a run, for people and for other languages.

use super::Ending;
use crate::arguments::JsonArgument;
use anhyst_conformance::interface;
use clap::Args;

/// `interface`
#[derive(Debug, Args)]
pub struct InterfaceArguments {
    /// Print a C header: the structs, their sizes asserted, and the functions of the driver library.
    #[arg(long, conflicts_with = "json")]
    pub c_header: bool,
    /// Print a Python module: the structs for ctypes and iceoryx2.
    #[arg(long, conflicts_with_all = ["c_header", "json"])]
    pub python: bool,
    /// For generators of your own.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// Runs the command.
///
/// # Errors
/// None in practice: the interface always has a JSON form.
pub fn run(arguments: &InterfaceArguments) -> miette::Result<Ending> {
    let text = if arguments.c_header {
        interface::c_header()
    } else if arguments.python {
        interface::python()
    } else if arguments.json.json {
        interface::json().map_err(|error| miette::miette!("{error}"))?
    } else {
        interface::markdown()
    };
    crate::say!("{}", text.trim_end());
    Ok(Ending::Held)
}
