//! The least that a scenario takes, where less was asked for.

use anhyst_scenario::Scenario;

/// The least number above `little` that is taken, if `enough` is; whatever is more than it is taken, too.
pub fn least(little: u64, enough: u64, takes: impl Fn(u64) -> bool) -> Option<u64> {
    if enough <= little || !takes(enough) {
        return None;
    }
    let (mut little, mut least) = (little, enough);
    while least - little > 1 {
        let middle = u64::midpoint(little, least);
        *(if takes(middle) { &mut least } else { &mut little }) = middle;
    }
    Some(least)
}

/// Refuses a `--duration-s` that is too short for the scenario, with the least that it takes, if `enough_s` is enough.
pub fn refuse_short(
    duration_s: f64,
    enough_s: f64,
    scenario: impl Fn(f64) -> miette::Result<Scenario>,
) -> miette::Result<()> {
    let Err(refused) = scenario(duration_s) else {
        return Ok(());
    };
    let milliseconds = |time_s: f64| (1e3 * time_s) as u64;
    let seconds = |time_ms: u64| time_ms as f64 / 1e3;
    let takes = |time_ms| scenario(seconds(time_ms)).is_ok();
    let least = least(milliseconds(duration_s), milliseconds(enough_s.ceil()), takes);
    Err(least.map_or(refused, |least| {
        let least_s = seconds(least);
        miette::miette!("--duration-s: {duration_s} s is too short for this scenario, it takes at least {least_s} s")
    }))
}
