//! Amplitude and slew: kept, and said.

use super::super::findings::Findings;
use super::super::program::{Part, Segment};
use super::evidence::{Evidence, Levels, STUCK, largest};
use anhyst_ipc::CoilField;

/// So much of the time at the limit the answer must say so.
const REPORTED: f64 = 0.9;
/// What noise may add to the largest of many values, in standard deviations.
const NOISES: f64 = 5.0;

pub fn judge(evidence: &Evidence, levels: Option<Levels>, findings: &mut Findings) {
    let noise_a_per_m = levels.map_or(0.0, |levels| NOISES * levels.noise_a_per_m);
    amplitude(evidence, noise_a_per_m, findings);
    slew(evidence, noise_a_per_m, findings);
}

fn amplitude(evidence: &Evidence, noise_a_per_m: f64, findings: &mut Findings) {
    let names = ["limit", "limit_reported"];
    let Some(limit_a_per_m) = evidence.expected.amplifier.field_limit_a_per_m else {
        findings.skip(&names, "no field limit of the amplifier is stated");
        return;
    };
    let Some((segments, fields)) = judgeable(evidence, Part::Limit, &names, findings) else {
        return;
    };
    let most = largest(fields.iter().map(|field| field.abs()));
    let allowed = limit_a_per_m * (1.0 + evidence.expected.tolerances.limit_tolerance) + noise_a_per_m;
    findings.at_most(
        "limit",
        most,
        allowed,
        "A/m",
        format!("commanded beyond the limit of {limit_a_per_m:.0} A/m, the field reaches {most:.1} A/m"),
    );
    let judged: Vec<u64> = segments
        .iter()
        .filter_map(|segment| evidence.transcript.answers.get(segment.judged.clone()))
        .flatten()
        .map(|answer| answer.status)
        .collect();
    let said = judged
        .iter()
        .filter(|status| **status & CoilField::AMPLITUDE_LIMITED != 0)
        .count();
    findings.at_least(
        "limit_reported",
        said as f64 / judged.len().max(1) as f64,
        REPORTED,
        "1",
        format!(
            "{said} of {} answers at the limit say so in their status (bit 1)",
            judged.len()
        ),
    );
}

fn slew(evidence: &Evidence, noise_a_per_m: f64, findings: &mut Findings) {
    let names = ["slew", "slew_reported"];
    let expected = evidence.expected;
    let Some(limit_a_per_m_s) = expected.amplifier.slew_limit_a_per_m_s else {
        findings.skip(&names, "no slew limit of the amplifier is stated");
        return;
    };
    let Some((segments, fields)) = judgeable(evidence, Part::Slew, &names, findings) else {
        return;
    };
    let fastest = largest(
        fields
            .windows(2)
            .map(|pair| (pair[1] - pair[0]).abs() / expected.tick_s),
    );
    let noise_a_per_m_s = core::f64::consts::SQRT_2 * noise_a_per_m / expected.tick_s;
    let allowed = limit_a_per_m_s * (1.0 + expected.tolerances.limit_tolerance) + noise_a_per_m_s;
    findings.at_most(
        "slew",
        fastest,
        allowed,
        "A/(m s)",
        format!("across its range the field changes by at most {fastest:.4e} A/(m s)"),
    );
    let ticks = segments.iter().flat_map(|segment| segment.ticks.clone());
    let due = ticks.clone().filter(|tick| evidence.model[*tick].slew_limited).count();
    if due == 0 {
        findings.skip(&names[1..], "the range is crossed without reaching the slew limit");
        return;
    }
    let said = ticks
        .filter(|tick| evidence.transcript.answers[*tick].status & CoilField::SLEW_LIMITED != 0)
        .count();
    findings.at_least(
        "slew_reported",
        said as f64 / due as f64,
        0.5,
        "1",
        format!("{said} answers say in their status (bit 2) that the slew is limited; {due} are due"),
    );
}

/// The stretches of a part and their fields; where they cannot be judged `names` are skipped, with the reason.
fn judgeable<'a>(
    evidence: &Evidence<'a>,
    part: Part,
    names: &[&'static str],
    findings: &mut Findings,
) -> Option<(Vec<&'a Segment>, Vec<f64>)> {
    let segments: Vec<&Segment> = evidence.program.of(part).collect();
    let of = |segment: &&Segment| evidence.transcript.fields(&segment.ticks);
    let pieces: Option<Vec<Vec<f64>>> = segments.iter().map(of).collect();
    match pieces {
        None => findings.skip(names, &evidence.unreached()),
        Some(_) if findings.fails("stuck") => findings.skip(names, STUCK),
        Some(pieces) => return Some((segments, pieces.concat())),
    }
    None
}
