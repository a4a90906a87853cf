use anhyst::cli::{Cli, Command};
use anhyst::commands::{self, Ending};
use anhyst_launch::error::RunError;
use clap::{CommandFactory, Parser};
use std::process::ExitCode;

/// Bad input; clap uses the same for bad arguments.
const BAD_INPUT: u8 = 2;

fn main() -> ExitCode {
    // Long lines stay whole: a path that is broken in two cannot be copied. A hook can be set once, and this is the once.
    let _ = miette::set_hook(Box::new(|_| {
        Box::new(miette::MietteHandlerOpts::new().wrap_lines(false).build())
    }));
    match run(&Cli::parse().command) {
        Ok(ending) => ending.into(),
        Err(report) => {
            anhyst::complain!("{report:?}");
            match report.downcast_ref::<RunError>() {
                Some(error) if error.is_full_disk() => Ending::ProcessFailed.into(),
                _ => ExitCode::from(BAD_INPUT),
            }
        }
    }
}

fn run(command: &Command) -> miette::Result<Ending> {
    if let Some((node, arguments)) = command.node() {
        return commands::node::run(node, arguments);
    }
    match command {
        Command::Run(arguments) => commands::run::run(arguments),
        Command::Check(arguments) => commands::check::run(arguments),
        Command::Graph(arguments) => commands::graph::run(arguments),
        Command::Compare(arguments) => commands::compare::run(arguments),
        Command::Fit(arguments) => commands::fit::run(arguments),
        Command::Estimate(arguments) => commands::estimate::run(arguments),
        Command::Paper(arguments) => commands::paper::run(arguments),
        Command::Diagnose(arguments) => commands::diagnose::run(arguments),
        Command::Study(arguments) => commands::study::run(arguments),
        Command::Laws(arguments) => commands::laws::run(arguments),
        Command::Interface(arguments) => commands::interface::run(arguments),
        Command::VerifyAmplifier(arguments) => commands::verify_amplifier::run(arguments),
        Command::Doctor(arguments) => commands::doctor::run(arguments),
        #[cfg(feature = "bridge")]
        Command::Bridge(arguments) => commands::bridge::run(arguments),
        #[cfg(not(feature = "bridge"))]
        Command::Bridge(_) => Err(miette::miette!("this build has no bridge (cargo feature `bridge`)")),
        Command::Replay(arguments) => commands::replay::run(arguments),
        #[cfg(feature = "recorder")]
        Command::Export(arguments) => commands::export::run(arguments),
        #[cfg(feature = "recorder")]
        Command::View(arguments) => commands::view::run(arguments),
        #[cfg(not(feature = "recorder"))]
        Command::View(_) => Err(miette::miette!("this build has no recorder (cargo feature `recorder`)")),
        Command::Completions { shell } => {
            clap_complete::generate(*shell, &mut Cli::command(), "anhyst", &mut std::io::stdout());
            Ok(Ending::Held)
        }
        _ => unreachable!("process subcommands were handled above"),
    }
}
