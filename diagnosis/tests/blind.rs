//! Blind runs: right names, no false alarms, honest intervals.
//!
//! A few runs are always tested. The whole study is asked for:
//! `ANHYST_BLIND_SEEDS=3 cargo test --release -p anhyst-diagnosis --test blind -- --ignored --nocapture`.

mod blind_runs;

use anhyst_diagnosis::diagnose::{DiagnoseOptions, Diagnosis, NominalParameter, Term, Verdict, diagnose};
use anhyst_model::{ActuatorModel, EffectKind};
use blind_runs::{Draw, Hidden, Made, Unlisted, make};

/// How a diagnosis compares with the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    Right,
    /// A flagged tie that holds the truth.
    RightTie,
    /// Flagged as unknown, none or a tie without the truth.
    FlaggedWrong,
    /// Another name without a flag.
    Wrong,
}

fn diagnosed(made: &Made) -> Diagnosis {
    diagnose(
        &ActuatorModel::terfenol_d(),
        std::slice::from_ref(&made.run),
        &DiagnoseOptions::default(),
        &mut |_, _| (),
    )
    .expect("a diagnosis")
    .diagnosis
}

fn set(names: &str) -> Vec<String> {
    let mut names: Vec<String> = names.split(" + ").map(str::to_owned).collect();
    names.sort();
    names
}

fn outcome(hidden: Hidden, found: &Diagnosis) -> Outcome {
    let effects: Vec<&str> = found.effects.iter().map(|effect| effect.name.as_str()).collect();
    let named = set(&effects.join(" + "));
    match hidden {
        Hidden::Nothing if found.verdict == Verdict::None => Outcome::Right,
        Hidden::Unlisted(_) if found.verdict == Verdict::Unknown => Outcome::Right,
        Hidden::Listed(_) | Hidden::Pair(..) if !effects.is_empty() => {
            let truth = set(&hidden.to_string());
            if named == truth && found.ambiguous_with.is_empty() {
                Outcome::Right
            } else if named == truth || found.ambiguous_with.iter().any(|names| set(names) == truth) {
                Outcome::RightTie
            } else if found.verdict == Verdict::Ambiguous {
                Outcome::FlaggedWrong
            } else {
                Outcome::Wrong
            }
        }
        Hidden::Listed(_) | Hidden::Pair(..) => Outcome::FlaggedWrong,
        _ if found.verdict == Verdict::Ambiguous => Outcome::FlaggedWrong,
        _ => Outcome::Wrong,
    }
}

fn listed() -> Vec<Term> {
    let effects = EffectKind::ALL.into_iter().map(Term::Effect);
    effects
        .chain(NominalParameter::ALL.into_iter().map(Term::Parameter))
        .collect()
}

fn line(made: &Made, found: &Diagnosis, outcome: Outcome, seconds: f64) -> String {
    let effects: Vec<&str> = found.effects.iter().map(|effect| effect.name.as_str()).collect();
    format!(
        "{outcome:?}: {} (gap {:.1} noises, {:?}) -> {} {} ties {:?}, {:.1} -> {:.2} nm, {seconds:.1} s",
        made.hidden,
        made.gap,
        made.truth,
        found.verdict.name(),
        effects.join(" + "),
        found.ambiguous_with,
        1e9 * found.gap_before,
        1e9 * found.gap_after
    )
}

/// Guards the chain from columns to verdict with short runs: an effect of the field, one of the rod, one of the sensor, a
/// parameter and nothing.
#[test]
fn short_runs_are_named_rightly() {
    for (name, seed) in [
        ("eddy_current", 3),
        ("backlash", 4),
        ("sensor_delay", 5),
        ("parameter_a", 6),
    ] {
        let term = Term::from_name(name).expect("a term");
        let made = make(Hidden::Listed(term), 4000, 20.0, seed).expect("a run");
        let found = diagnosed(&made);
        let outcome = outcome(made.hidden, &found);
        assert!(
            matches!(outcome, Outcome::Right | Outcome::RightTie),
            "{}",
            line(&made, &found, outcome, 0.0)
        );
    }
    let made = make(Hidden::Nothing, 4000, 0.0, 8).expect("a run");
    let found = diagnosed(&made);
    assert_eq!(found.verdict, Verdict::None, "{}", found.sentence);
}

/// The study; see the head of the file.
#[test]
#[ignore = "minutes"]
fn blind_study() {
    let number = |name: &str, usual: u64| {
        std::env::var(name)
            .ok()
            .and_then(|text| text.parse().ok())
            .unwrap_or(usual)
    };
    let (seeds, rows, first) = (
        number("ANHYST_BLIND_SEEDS", 1),
        number("ANHYST_BLIND_ROWS", 16_000),
        number("ANHYST_BLIND_FIRST", 1000),
    );
    let only = std::env::var("ANHYST_BLIND_ONLY").unwrap_or_default();
    let mut hidden: Vec<Hidden> = Vec::new();
    for seed in 0..seeds {
        hidden.extend(listed().into_iter().map(Hidden::Listed));
        hidden.extend([Hidden::Nothing; 8]);
        hidden.extend(Unlisted::ALL.map(Hidden::Unlisted));
        let mut draw = Draw::new(first + seed);
        for _ in 0..4 {
            let all = listed();
            let (one, other) = (draw.one_of(&all), draw.one_of(&all));
            if one != other {
                hidden.push(Hidden::Pair(one, other));
            }
        }
    }
    let mut counts = std::collections::BTreeMap::new();
    let (mut covered, mut intervals) = (0, 0);
    for (index, hidden) in hidden.into_iter().enumerate() {
        let seed = first + 17 * index as u64;
        if !only.is_empty() && !only.split(',').any(|own| hidden.to_string() == own) {
            continue;
        }
        let gap = if hidden == Hidden::Nothing {
            0.0
        } else {
            Draw::new(seed).log_between(1.0, 60.0)
        };
        let Some(made) = make(hidden, rows as usize, gap, seed) else {
            println!("cannot be made here: {hidden}");
            continue;
        };
        let begin = std::time::Instant::now();
        let found = diagnosed(&made);
        let outcome = outcome(hidden, &found);
        println!("{}", line(&made, &found, outcome, begin.elapsed().as_secs_f64()));
        if std::env::var("ANHYST_VERBOSE").is_ok() && !matches!(outcome, Outcome::Right | Outcome::RightTie) {
            for candidate in found.candidates.iter().take(10) {
                println!(
                    "       {} {:.1} {:.3e}",
                    candidate.name, candidate.delta_bic, candidate.gap_after
                );
            }
            for (when, test) in [("before", &found.test_before), ("after", &found.test_after)] {
                for group in test.groups.iter().take(5) {
                    println!(
                        "       {when}: {} S {:.1} df {} tail {:.1e}",
                        group.name, group.statistic, group.degrees, group.tail
                    );
                }
            }
        }
        let kind = match hidden {
            Hidden::Nothing => "none",
            Hidden::Listed(_) => "listed",
            Hidden::Pair(..) => "pair",
            Hidden::Unlisted(_) => "unlisted",
        };
        *counts.entry((kind, format!("{outcome:?}"))).or_insert(0) += 1;
        if let (Hidden::Listed(term), Outcome::Right) = (hidden, outcome) {
            let held = found.effects[0].values.iter();
            let known: Vec<(f64, f64)> = held
                .filter_map(|own| Some((own.value, own.standard_deviation?)))
                .collect();
            // Values stand in the order of the parameters; held ones come last in every effect.
            for ((value, deviation), truth) in known.iter().zip(&made.truth[0]) {
                intervals += 1;
                covered += u32::from((value - truth).abs() <= 1.96 * deviation);
                if (value - truth).abs() > 3.0 * deviation {
                    println!("    outside: {term} {value:e} ± {deviation:e}, truth {truth:e}");
                }
            }
        }
    }
    for ((kind, outcome), count) in &counts {
        println!("{kind:10} {outcome:14} {count}");
    }
    println!("95 % intervals that cover: {covered} of {intervals}");
}
