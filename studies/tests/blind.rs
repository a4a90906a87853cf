//! A handful of runs of the blind study, always tested; `anhyst study` is the whole of it.

use anhyst_model::ActuatorModel;
use anhyst_studies::blind::{Family, Outcome, Plan, StudyRun, study};

/// Short runs under seeds of their own; of the single effects every seventh.
fn runs(wanted: fn(Family) -> bool) -> Vec<StudyRun> {
    let plan = Plan {
        singles: 34,
        none: 3,
        unlisted: 0,
        pairs: 0,
        limits: 0,
        first_seed: 2_000_000,
        rows: 4000,
    };
    let nominal = ActuatorModel::terfenol_d();
    let cases = plan.cases().into_iter();
    cases
        .filter(|case| wanted(case.family) && (case.family != Family::Single || case.index % 7 == 0))
        .map(|case| study(&case, &nominal, plan.rows))
        .collect()
}

/// Guards trust in a name: whatever an effect's size, another is never named without a flag.
#[test]
fn no_wrong_name_goes_unflagged() {
    let runs = runs(|family| family == Family::Single);
    assert_eq!(runs.len(), 5);
    for run in &runs {
        assert!(!matches!(run.outcome, Outcome::WrongName | Outcome::Failed), "{run:#?}");
    }
}

/// Guards against false alarms.
#[test]
fn nothing_is_found_where_nothing_is_hidden() {
    for run in runs(|family| family == Family::None) {
        assert_eq!(run.outcome, Outcome::Right, "{run:#?}");
    }
}
