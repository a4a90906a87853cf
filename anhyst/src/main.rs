use anhyst::cli::{self, Command};
use anhyst::commands::{self, Ending};
use anhyst::spelling;
use anhyst_launch::error::RunError;
use std::process::ExitCode;

/// Bad input; clap uses the same for bad arguments.
const BAD_INPUT: u8 = 2;

fn main() -> ExitCode {
    // Long lines stay whole: a path that is broken in two cannot be copied. A hook can be set once, and this is the once.
    let _ = miette::set_hook(Box::new(|_| {
        Box::new(miette::MietteHandlerOpts::new().wrap_lines(false).build())
    }));
    let words: Vec<_> = std::env::args_os().collect();
    let cli = match cli::parse(words.iter().cloned()) {
        Ok(cli) => cli,
        Err(error) => {
            let words: Vec<String> = words
                .iter()
                .skip(1)
                .map(|word| word.to_string_lossy().into_owned())
                .collect();
            let Some(sentence) = spelling::refusal(&words, &error) else {
                error.exit()
            };
            anhyst::complain!("error: {sentence}");
            return ExitCode::from(BAD_INPUT);
        }
    };
    match run(&cli.command) {
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
    match command {
        Command::Run(arguments) => commands::run::run(arguments),
        Command::Sweep(arguments) => commands::sweep::run(arguments),
        Command::Gather(arguments) => commands::sweep::run_gather(arguments),
        #[cfg(feature = "recorder")]
        Command::Commission(arguments) => commands::commission::run(arguments),
        Command::Check(arguments) => commands::check::run(arguments),
        Command::Tune(arguments) => commands::tune::run(arguments),
        Command::Graph(arguments) => commands::graph::run(arguments),
        Command::Replay(arguments) => commands::replay::run(arguments),
        #[cfg(feature = "recorder")]
        Command::View(arguments) => commands::view::run(arguments),
        #[cfg(feature = "recorder")]
        Command::Export(arguments) => commands::export::run(arguments),
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
        Command::Doctor(arguments) => commands::doctor::run(arguments),
        Command::Completions { shell } => {
            clap_complete::generate(*shell, &mut cli::command(), "anhyst", &mut std::io::stdout());
            Ok(Ending::Held)
        }
    }
}
