//! The command line as functions: what the executable does, and what another program does that has it within.

use crate::cli::{self, Command};
use crate::commands::failed::complain;
use crate::commands::{self, Ending};
use crate::spelling;
use anhyst_identify::parallel;
use anhyst_ipc::stop_requested;
use anhyst_launch::error::RunError;
use anhyst_launch::signals;
use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::time::Duration;

/// Bad input; clap uses the same for bad arguments.
pub const BAD_INPUT: u8 = 2;

/// Between two looks whether work is to be given up.
const LOOK: Duration = Duration::from_millis(20);

/// Why a command was not done.
#[derive(Debug)]
pub enum Unread {
    /// A word that is spelled otherwise now, or not built in.
    Sentence(String),
    /// What clap says of the words, help and version among it.
    Clap(clap::Error),
}

impl Unread {
    /// Not help nor version.
    fn is_refusal(&self) -> bool {
        !matches!(self, Self::Clap(error) if error.exit_code() == 0)
    }

    /// In words, without colours.
    pub fn sentence(&self) -> String {
        match self {
            Self::Sentence(sentence) => sentence.clone(),
            Self::Clap(error) => error.to_string().trim_end().to_owned(),
        }
    }
}

/// Reads a command; the first word is the program's name.
///
/// # Errors
/// Words that are none.
pub fn read(words: &[OsString]) -> Result<Command, Unread> {
    cli::parse(words.iter().cloned())
        .map(|cli| cli.command)
        .map_err(|error| {
            let words = words.iter().skip(1).map(|word| word.to_string_lossy().into_owned());
            let sentence = spelling::refusal(&words.collect::<Vec<_>>(), &error);
            sentence.map_or(Unread::Clap(error), Unread::Sentence)
        })
}

/// Does what the words say and prints what there is to say; the exit status.
pub fn main(words: &[OsString]) -> u8 {
    // Long lines stay whole: a path that is broken in two cannot be copied. A hook can be set once, and this is the once.
    let _ = miette::set_hook(Box::new(|_| {
        Box::new(miette::MietteHandlerOpts::new().wrap_lines(false).build())
    }));
    let json = words.iter().any(|word| word == "--json");
    let command = match read(words) {
        Ok(command) => command,
        Err(unread) if json && unread.is_refusal() => {
            complain(&miette::miette!("{}", unread.sentence()), true);
            return BAD_INPUT;
        }
        Err(Unread::Clap(error)) => {
            let _ = error.print();
            return u8::try_from(error.exit_code()).unwrap_or(BAD_INPUT);
        }
        Err(Unread::Sentence(sentence)) => {
            crate::complain!("error: {sentence}");
            return BAD_INPUT;
        }
    };
    match stoppable(&command) {
        Ok(ending) => ending.status(),
        Err(report) => {
            complain(&report, json);
            status(&report)
        }
    }
}

/// Does a command; of one that only computes, gives the work up when the program is asked to stop.
fn stoppable(command: &Command) -> miette::Result<Ending> {
    let computes = matches!(
        command,
        Command::Fit(_) | Command::Estimate(_) | Command::Diagnose(_) | Command::Study(_) | Command::Benchmark(_)
    );
    if !computes {
        return perform(command);
    }
    signals::install_once();
    std::thread::spawn(|| {
        while !stop_requested() {
            std::thread::sleep(LOOK);
        }
        parallel::give_up();
    });
    match catch_unwind(AssertUnwindSafe(|| perform(command))) {
        Err(payload) if !payload.is::<parallel::GivenUp>() => resume_unwind(payload),
        Ok(done) if done.is_ok() || !stop_requested() => done,
        _ => Err(RunError::Stopped.into()),
    }
}

/// The exit status of an error: a full disk is nobody's bad input, nor is an end that was asked for.
pub fn status(report: &miette::Report) -> u8 {
    match report.downcast_ref::<RunError>() {
        Some(error) if error.is_no_bad_input() => Ending::ProcessFailed.status(),
        _ => BAD_INPUT,
    }
}

/// Does a command.
///
/// # Errors
/// Bad input, or no room.
pub fn perform(command: &Command) -> miette::Result<Ending> {
    match command {
        Command::New(arguments) => commands::new::run(arguments),
        Command::Run(arguments) => commands::run::run(arguments),
        Command::Sweep(arguments) => commands::sweep::run(arguments),
        Command::Gather(arguments) => commands::sweep::run_gather(arguments),
        #[cfg(feature = "recorder")]
        Command::Commission(arguments) => commands::commission::run(arguments),
        Command::Check(arguments) => commands::check::run(arguments),
        Command::Tune(arguments) => commands::tune::run(arguments),
        Command::Live(arguments) => commands::live::run(arguments),
        Command::Graph(arguments) => commands::graph::run(arguments),
        Command::Replay(arguments) => commands::replay::run(arguments),
        #[cfg(feature = "recorder")]
        Command::View(arguments) => commands::view::run(arguments),
        #[cfg(feature = "recorder")]
        Command::Export(arguments) => commands::export::run(arguments),
        Command::Data(arguments) => commands::data::run(arguments),
        Command::Fit(arguments) => commands::fit::run(arguments),
        Command::Benchmark(arguments) => commands::benchmark::run(arguments),
        Command::Predict(arguments) => commands::predict::run(arguments),
        Command::Estimate(arguments) => commands::estimate::run(arguments),
        Command::Diagnose(arguments) => commands::diagnose::run(arguments),
        Command::Study(study) => commands::study::run(study),
        Command::Node(arguments) => commands::node::run(arguments),
        #[cfg(feature = "bridge")]
        Command::Bridge(arguments) => commands::bridge::run(arguments),
        Command::Interface(arguments) => commands::interface::run(arguments),
        Command::VerifyAmplifier(arguments) => commands::verify_amplifier::run(arguments),
        Command::Bench(arguments) => commands::bench::run(arguments),
        Command::Doctor(arguments) => commands::doctor::run(arguments),
        Command::Explain(arguments) => commands::explain::run(arguments, &cli::command()),
        Command::Man(arguments) => commands::man::run(arguments, cli::command()),
        Command::Completions { shell } => {
            // Into a text first: clap's own writing panics where nobody reads on.
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut cli::command(), "anhyst", &mut script);
            crate::say!("{}", String::from_utf8_lossy(&script).trim_end());
            Ok(Ending::Held)
        }
    }
}
