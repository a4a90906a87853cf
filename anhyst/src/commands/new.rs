//! `anhyst new`: a commented scenario for one's own actuator, that passes `check` and holds when run.

use super::Ending;
use crate::arguments::JsonArgument;
use crate::design::{Actuator, PRESETS, Profile, Wish, design, possible};
use anhyst_launch::error::RunError;
use anhyst_launch::say::quoted;
use anhyst_report::number::Si;
use clap::{Args, ValueEnum};
use miette::miette;
use std::io::{BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};

/// `new`
#[derive(Debug, Args)]
pub struct NewArguments {
    /// What is wished.
    #[command(flatten)]
    pub wish: Wish,
    /// Folder in which NAME.ron is written.
    #[arg(long, default_value = ".", value_name = "FOLDER")]
    pub out: PathBuf,
    /// Ask nothing: what is not said is chosen.
    #[arg(long)]
    pub no_questions: bool,
    /// How what was found is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// Runs the command.
///
/// # Errors
/// A wish that cannot be had, a file that is there already.
pub fn run(arguments: &NewArguments) -> miette::Result<Ending> {
    let mut wish = arguments.wish.clone();
    let plain = |letter: char| letter.is_ascii_alphanumeric() || "-_".contains(letter);
    if wish.name.is_empty() || !wish.name.chars().all(plain) {
        return Err(miette!(
            "\"{}\" names a file and a folder: letters, digits, '-' and '_' can be had",
            wish.name
        ));
    }
    let file = arguments.out.join(format!("{}.ron", wish.name));
    let file = file.strip_prefix(".").map(Path::to_owned).unwrap_or(file);
    if file.exists() {
        possible(&wish, &file)?;
        return Err(miette!("{} is there already: give another name", file.display()));
    }
    if std::io::stdin().is_terminal() && !arguments.no_questions && !arguments.json.json {
        ask(&mut wish, &arguments.out)?;
    }
    let found = design(&wish, &file)?;
    let refused = |cause| RunError::Write {
        path: file.clone(),
        cause,
    };
    std::fs::create_dir_all(&arguments.out).map_err(refused)?;
    std::fs::write(&file, &found.text).map_err(refused)?;
    let scenario = &found.scenario;
    let tolerance_m = scenario.expect.tolerance_m.unwrap_or_default();
    if arguments.json.json {
        let told = serde_json::json!({
            "scenario": file,
            "error_rms_m": found.error_rms,
            "error_max_m": found.error_max,
            "tolerance_m": tolerance_m,
            "assumed": found.assumed,
            "ticks": scenario.ticks(),
            "units": scenario.units(),
            "foresight": scenario.foresight().map_err(RunError::from)?,
        });
        crate::say!("{told:#}");
        return Ok(Ending::Held);
    }
    let output = scenario.units().output;
    crate::say!(
        "{}: every error within ±{} after {} s",
        file.display(),
        Si(tolerance_m, &output),
        scenario.expect.settling_s
    );
    crate::say!(
        "tried for {} ticks in this process: error rms {}, max {}",
        scenario.ticks(),
        Si(found.error_rms, &output),
        Si(found.error_max, &output)
    );
    if !found.assumed.is_empty() {
        crate::say!("assumed, because it was not said:");
        for own in &found.assumed {
            crate::say!("  {own}");
        }
    }
    crate::say!("see what it needs: anhyst check {}", quoted(&file));
    crate::say!("run it:            anhyst run {}", quoted(&file));
    Ok(Ending::Held)
}

/// Asks for what the command line does not say; an empty answer takes what is offered.
fn ask(wish: &mut Wish, folder: &Path) -> miette::Result<()> {
    let names: Vec<_> = PRESETS.iter().map(|preset| preset.name).collect();
    let question = format!("material: {}, or a file", names.join(", "));
    if let Some(material) = answer(&question, &wish.material)? {
        wish.material = material;
    }
    let actuator = Actuator::of(wish, folder)?;
    let [input, output] = actuator.units();
    let [low, high] = actuator.gives(None);
    crate::complain!("{}: from {} to {}", actuator.words, Si(low, output), Si(high, output));
    let offer = |own: &Option<String>, usual: String| own.clone().unwrap_or(usual);
    let usual = |value: f64, unit: &str| Si(value, unit).to_string();
    let stroke = offer(&wish.stroke, usual(actuator.usual_stroke(), output));
    wish.stroke = answer("stroke, from end to end", &stroke)?.or(wish.stroke.take());
    let frequency = offer(&wish.frequency, usual(actuator.usual_frequency_hz(), "Hz"));
    wish.frequency = answer("the motion repeats at", &frequency)?.or(wish.frequency.take());
    let profiles: Vec<_> = Profile::value_variants()
        .iter()
        .filter_map(ValueEnum::to_possible_value)
        .collect();
    let profiles: Vec<_> = profiles.iter().map(|value| value.get_name()).collect();
    let own = wish.profile().to_possible_value();
    let own = own.as_ref().map_or("sine", |value| value.get_name());
    if let Some(text) = answer(&format!("motion: {}", profiles.join(", ")), own)? {
        let own = Profile::from_str(&text, true).map_err(|_| miette!("{text} is none of {}", profiles.join(", ")))?;
        wish.profile = Some(own);
    }
    for (question, own) in [
        ("samples a second, as 20kHz", &mut wish.rate),
        (&*format!("noise of the sensor, rms, in {output}"), &mut wish.noise),
        ("bandwidth of the amplifier, in Hz", &mut wish.bandwidth),
        (&*format!("most that the amplifier gives, in {input}"), &mut wish.limit),
    ] {
        let offered = own.clone().unwrap_or_else(|| "chosen".into());
        *own = answer(question, &offered)?.or(own.take());
    }
    Ok(())
}

/// None where nothing is answered.
fn answer(question: &str, offered: &str) -> miette::Result<Option<String>> {
    let mut screen = std::io::stderr();
    let mut line = String::new();
    let asked = write!(screen, "{question} [{offered}]: ").and_then(|()| screen.flush());
    asked
        .and_then(|()| std::io::stdin().lock().read_line(&mut line))
        .map_err(|cause| miette!("no answer could be read: {cause}"))?;
    let line = line.trim();
    Ok((!line.is_empty()).then(|| line.to_owned()))
}
