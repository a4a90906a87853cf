//! Writes labelled runs: `cargo run --release -p anhyst-witness --example rigs -- FOLDER [FIRST_SEED [RUNS_OF_EACH_NUISANCE]]`.
//!
//! Under each nuisance every fourth run hides nothing and every twelfth something unlisted; the other effects come round in turn.

use anhyst_witness::{Effect, Made, Nuisance, Rig, Wanted, write_runs};
use std::path::Path;
use std::process::ExitCode;

const ROWS: usize = 40_000;

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let Some(folder) = arguments.next() else {
        eprintln!("FOLDER [FIRST_SEED [RUNS_OF_EACH_NUISANCE]]");
        return ExitCode::from(2);
    };
    let numbers: Result<Vec<u64>, _> = arguments.map(|word| word.parse()).collect();
    let Ok(numbers) = numbers else {
        eprintln!("seed and count are whole numbers");
        return ExitCode::from(2);
    };
    let first = numbers.first().copied().unwrap_or(1);
    let each = numbers.get(1).copied().unwrap_or(6);
    let made = (0..each * Nuisance::ALL.len() as u64).filter_map(|index| run(first, index, each));
    match write_runs(Path::new(&folder), made) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{folder}: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(first: u64, index: u64, each: u64) -> Option<(String, Made)> {
    let nuisance = Nuisance::ALL[(index / each) as usize];
    let nth = |effects: &[Effect], place: u64| effects[((first + place) % effects.len() as u64) as usize];
    let turn = |effects: &[Effect]| nth(effects, 7 * index);
    let effects = match index % 12 {
        0 | 4 | 8 if nuisance != Nuisance::OtherLaw => Vec::new(),
        5 if nuisance != Nuisance::OtherLaw => vec![nth(&Effect::UNLISTED, index / 12)],
        _ if nuisance == Nuisance::OtherLaw => vec![turn(&Effect::OF_TWO_LAWS)],
        _ => vec![turn(&Effect::LISTED)],
    };
    let wanted = Wanted {
        effects,
        nuisance,
        drive: None,
        gap_over_noise: None,
        rows: ROWS,
    };
    match Rig::NOMINAL.draw(first + index, &wanted) {
        Ok(made) => {
            let (truth, own) = (&made.truth, made.truth.parts.first());
            println!(
                "rig{index:04} {} {} {}: {:.0} nm of {:.0} nm, noise {:.0} nm, attempt {}",
                truth.nuisance.name(),
                truth.drive.name(),
                truth.name(),
                1e9 * own.map_or(0.0, |part| part.gap_m),
                1e9 * truth.gap_to_the_nominal_model_m,
                1e9 * truth.noise_m,
                truth.attempts
            );
            Some((format!("rig{index:04}"), made))
        }
        Err(refusal) => {
            eprintln!("{refusal}");
            None
        }
    }
}
