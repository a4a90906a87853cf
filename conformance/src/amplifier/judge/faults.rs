//! Answers that are no numbers, answers that do not move, commands that are no numbers, and a controller that dies.

use super::super::findings::Findings;
use super::super::program::{LEVEL_SHARE, Part, Segment};
use super::evidence::{Evidence, Levels, NOT_REACHED, STUCK, largest};

/// So many equal answers in a row are a stuck answer, unless the sine is so slow that they are its crest.
const MAX_EQUAL: usize = 50;
/// Share of a period that may look constant.
const CREST: f64 = 0.1;

pub fn finite(evidence: &Evidence, findings: &mut Findings) {
    let answers = &evidence.transcript.answers;
    let broken = answers
        .iter()
        .filter(|answer| !answer.field_a_per_m.is_finite())
        .count();
    findings.at_most(
        "finite",
        broken as f64,
        0.0,
        "answers",
        format!("{broken} of {} answers are not a finite number", answers.len()),
    );
}

pub fn stuck(evidence: &Evidence, findings: &mut Findings) {
    let mut longest = 0;
    let mut allowed = MAX_EQUAL;
    let mut judged = 0;
    for segment in &evidence.program.segments {
        let Part::Sine { periods } = segment.part else { continue };
        // A program that ended early is judged as far as it got.
        let end = segment.ticks.end.min(evidence.transcript.answers.len());
        let Some(fields) = evidence.transcript.fields(&(segment.judged.start.min(end)..end)) else {
            continue;
        };
        judged += fields.len();
        longest = longest.max(longest_equal(&fields));
        allowed = allowed.max((CREST * segment.judged.len() as f64 / periods as f64) as usize);
    }
    if judged <= allowed {
        findings.skip(&["stuck"], &evidence.unreached());
        return;
    }
    findings.at_most(
        "stuck",
        longest as f64,
        allowed as f64,
        "ticks",
        format!("while the command moves, the answer stays the same bit for bit for at most {longest} ticks"),
    );
}

fn longest_equal(fields: &[f64]) -> usize {
    let mut longest = 0;
    let mut run = 0;
    for pair in fields.windows(2) {
        run = if pair[0].to_bits() == pair[1].to_bits() {
            run + 1
        } else {
            0
        };
        longest = longest.max(run);
    }
    longest
}

pub fn recovery(evidence: &Evidence, levels: Option<Levels>, findings: &mut Findings) {
    let names = ["nonsense_bounded", "recovery"];
    let backs: Vec<&Segment> = evidence.program.of(Part::Back).collect();
    let last = backs.last().map_or(0, |segment| segment.ticks.end);
    let Some(levels) = levels.filter(|_| evidence.transcript.answers.len() >= last) else {
        let words = if findings.fails("stuck") {
            STUCK.to_owned()
        } else {
            evidence.unreached()
        };
        findings.skip(&names, &words);
        return;
    };
    bounded(evidence, levels, last, findings);
    let expected = evidence.expected;
    // Measured gain and offset: a wrong gain has its own check.
    let due = levels.gain * LEVEL_SHARE * expected.range_a_per_m + levels.offset_a_per_m;
    let near = expected.share_a_per_m(expected.tolerances.return_tolerance) + 5.0 * levels.noise_a_per_m;
    let is_near = |field: f64| (field - due).abs() <= near;
    let return_ticks = |segment: &Segment| {
        let fields = evidence.transcript.fields(&segment.ticks).unwrap_or_default();
        // A comparison with what is no number is false: such an answer is never near.
        fields
            .iter()
            .rposition(|field| !is_near(*field))
            .map_or(0, |last_away| last_away + 1)
    };
    let longest = backs.iter().map(|segment| return_ticks(segment)).max().unwrap_or(0);
    let allowed = expected.return_ticks();
    let words = if longest >= allowed {
        "after commands that are no numbers the field does not come back to the command".to_owned()
    } else {
        format!("after commands that are no numbers the field is back at the command within {longest} ticks")
    };
    findings.at_most("recovery", longest as f64, (allowed - 1) as f64, "ticks", words);
}

fn bounded(evidence: &Evidence, levels: Levels, last: usize, findings: &mut Findings) {
    let Some(limit_a_per_m) = evidence.expected.amplifier.field_limit_a_per_m else {
        findings.skip(&["nonsense_bounded"], "no field limit of the amplifier is stated");
        return;
    };
    let first = evidence
        .program
        .of(Part::Nonsense)
        .next()
        .map_or(last, |segment| segment.ticks.start);
    let fields = evidence.transcript.fields(&(first..last)).unwrap_or_default();
    // What is no number counts in `finite`.
    let most = largest(fields.iter().map(|field| field.abs()).filter(|field| field.is_finite()));
    let allowed = limit_a_per_m * (1.0 + evidence.expected.tolerances.limit_tolerance) + 5.0 * levels.noise_a_per_m;
    findings.at_most(
        "nonsense_bounded",
        most,
        allowed,
        "A/m",
        format!("commands of NaN, ±infinity and 1e300 A/m bring the field to at most {most:.1} A/m"),
    );
}

pub fn dead_controller(evidence: &Evidence, findings: &mut Findings) {
    let name = "safe_when_controller_dies";
    let expected = evidence.expected;
    if findings.fails("stuck") {
        findings.skip(&[name], STUCK);
        return;
    }
    let Some(aftermath) = evidence.aftermath else {
        findings.skip(&[name], &evidence.unreached());
        return;
    };
    let before = evidence.transcript.answers.last().map(|answer| answer.field_a_per_m);
    let Some(last) = aftermath.answers.last().map(|(_, field)| *field).or(before) else {
        findings.skip(&[name], NOT_REACHED);
        return;
    };
    let near = expected.share_a_per_m(expected.tolerances.return_tolerance);
    let is_near = |field: f64| (field - expected.safe_field_a_per_m).abs() <= near;
    let words = match aftermath.answers.iter().find(|(_, field)| is_near(*field)) {
        Some((after_s, _)) => format!("it says that the field is safe {after_s:.2} s after the last command"),
        None if aftermath.answers.is_empty() => {
            format!(
                "within {:.2} s after the last command it says nothing",
                aftermath.listened_s
            )
        }
        None => format!(
            "within {:.2} s after the last command it does not go to the safe field",
            aftermath.listened_s
        ),
    };
    findings.at_most(
        name,
        (last - expected.safe_field_a_per_m).abs(),
        near,
        "A/m",
        format!(
            "{words}; its last field is {last:.1} A/m, safe are {:.1} A/m",
            expected.safe_field_a_per_m
        ),
    );
}
