//! Gain, sign, unit, offset and noise, from constant commands.
//!
//! gain = (mean of H at +r/2 − mean of H at −r/2) / r, r the range (A/m); the offset is the mean of H at zero.

use super::super::findings::Findings;
use super::super::program::{Part, Segment};
use super::evidence::{Evidence, Levels, STUCK, largest, mean, rms};

/// A gain outside of this is a unit, not an error of adjustment.
const UNIT_FACTOR: f64 = 5.0;
/// Factors that are known: what one gets for taking A/m for something else, and its name.
const KNOWN: [(f64, &str); 4] = [
    (79.577_471_545_947_67, "Oe or Gauss (1 Oe is 79.58 A/m)"),
    (1000.0, "kA/m"),
    (100.0, "A/cm"),
    (795_774.715_459_476_7, "T (1 T is 795.8 kA/m in air)"),
];
/// So near a known factor is that factor.
const KNOWN_WITHIN: f64 = 0.05;

pub fn judge(evidence: &Evidence, findings: &mut Findings) -> Option<Levels> {
    let names = ["sign", "unit", "gain", "offset", "noise"];
    let levels = levels(evidence);
    let Some(levels) = levels else {
        findings.skip(&names, &evidence.unreached());
        return None;
    };
    if findings.fails("stuck") {
        findings.skip(&names, STUCK);
        return None;
    }
    let expected = evidence.expected;
    let words = if levels.gain < 0.0 {
        "the field has the opposite sign"
    } else {
        "the field has the sign"
    };
    findings.at_least(
        "sign",
        levels.gain.signum(),
        1.0,
        "1",
        format!("{words} of the command"),
    );
    gain(evidence, levels.gain.abs(), findings);
    findings.at_most(
        "offset",
        levels.offset_a_per_m.abs(),
        expected.share_a_per_m(expected.tolerances.offset_tolerance),
        "A/m",
        format!(
            "at a command of zero the mean field is {:.3} A/m",
            levels.offset_a_per_m
        ),
    );
    findings.at_most(
        "noise",
        levels.noise_a_per_m,
        expected.share_a_per_m(expected.tolerances.noise_tolerance),
        "A/m",
        format!(
            "at a constant command the field's rms about its mean is {:.3} A/m",
            levels.noise_a_per_m
        ),
    );
    Some(levels)
}

/// Of a level that is commanded so much must come, in standard deviations of a mean and as a part: else nothing follows at all.
const TOLD: f64 = 10.0;
const NOTHING: f64 = 1e-5;

/// `stuck` of a coil whose probe has noise, which is never the same twice.
pub fn follows(evidence: &Evidence, findings: &mut Findings) {
    let one = |part| evidence.judged(part)?.into_iter().next();
    let (Some(positive), Some(negative)) = (one(Part::Positive), one(Part::Negative)) else {
        findings.skip(&["stuck"], &evidence.unreached());
        return;
    };
    let range = evidence.expected.range_a_per_m;
    let moved = (mean(&positive) - mean(&negative)).abs();
    let deviation = ((rms(&positive).powi(2) + rms(&negative).powi(2)) / positive.len() as f64).sqrt();
    findings.at_least(
        "stuck",
        moved,
        (TOLD * deviation).max(NOTHING * range),
        "A/m",
        match moved < (TOLD * deviation).max(NOTHING * range) {
            true => format!(
                "of {range:.1} A/m from level to level {moved:.3} A/m come, which is nothing: amplifier off, coil open, probe dead, or a far larger unit"
            ),
            false => format!("of {range:.1} A/m from level to level {moved:.3} A/m come"),
        },
    );
}

/// What the rig needs must come: no limit, no other gain than at half of it.
pub fn reach(evidence: &Evidence, levels: Option<Levels>, findings: &mut Findings) {
    let expected = evidence.expected;
    let Some(levels) = levels.filter(|_| !findings.fails("unit")) else {
        findings.skip(&["reach"], "follows from what was found before");
        return;
    };
    let of = |segment: &Segment| {
        let came = mean(&evidence.transcript.fields(&segment.judged)?);
        let due: Vec<f64> = evidence
            .model
            .get(segment.judged.clone())?
            .iter()
            .map(|own| own.field_a_per_m)
            .collect();
        Some((came - levels.offset_a_per_m - levels.gain * mean(&due)).abs())
    };
    let missed: Option<Vec<f64>> = evidence.program.of(Part::Reach).map(of).collect();
    let Some(missed) = missed else {
        findings.skip(&["reach"], &evidence.unreached());
        return;
    };
    let most = largest(missed);
    findings.at_most(
        "reach",
        most,
        expected.share_a_per_m(expected.tolerances.gain_tolerance),
        "A/m",
        format!(
            "at {:.0} and {:.0} A/m, all that is needed, the field is {most:.1} A/m from where the gain at half of it puts it",
            expected.centre_a_per_m - expected.range_a_per_m,
            expected.centre_a_per_m + expected.range_a_per_m
        ),
    );
}

fn levels(evidence: &Evidence) -> Option<Levels> {
    let one = |part| evidence.judged(part)?.into_iter().next();
    let (positive, negative) = (one(Part::Positive)?, one(Part::Negative)?);
    let gain = (mean(&positive) - mean(&negative)) / evidence.expected.range_a_per_m;
    Some(Levels {
        gain,
        offset_a_per_m: mean(&one(Part::Rest)?) - gain * evidence.expected.centre_a_per_m,
        noise_a_per_m: rms(&one(Part::Noise)?),
    })
}

fn gain(evidence: &Evidence, gain: f64, findings: &mut Findings) {
    let factor = gain.max(1.0 / gain);
    let known = KNOWN
        .iter()
        .find(|(known, _)| (factor / known - 1.0).abs() <= KNOWN_WITHIN)
        .map_or_else(String::new, |(_, name)| {
            format!(": are commands or answers taken in {name}?")
        });
    findings.at_most(
        "unit",
        factor,
        UNIT_FACTOR,
        "1",
        match factor > UNIT_FACTOR {
            true => format!("the field is {gain:.4e} times the command{known}"),
            false => "command and field are in one unit".into(),
        },
    );
    if factor > UNIT_FACTOR {
        findings.skip(&["gain"], "the unit is wrong, so the gain says nothing more");
        return;
    }
    let tolerance = evidence.expected.tolerances.gain_tolerance;
    let sentence = format!("the gain from command to field is {gain:.5}");
    findings.at_most("gain", (gain - 1.0).abs(), tolerance, "1", sentence);
}
