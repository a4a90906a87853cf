//! Dead time and overshoot from the mean of small steps; bandwidth from a stepped sine.
//!
//! Response at a frequency: G = Σ y e^(−iωt) / Σ u e^(−iωt) over whole periods. The −3 dB frequency is where |G| has fallen to
//! 1/√2 of what it is at the lowest frequency, found between two frequencies on logarithmic axes. The model goes through the
//! same sums, so sampling and hold are on both sides.

use super::super::findings::Findings;
use super::super::program::{Part, STEPS, Segment};
use super::evidence::{Evidence, Levels, STUCK, mean};
use core::f64::consts::{FRAC_1_SQRT_2, PI};
use num_complex::Complex64;

/// The field has begun to move when it has left its rest by this share of the step, or by this many times the noise.
const BEGINS: f64 = 0.02;
const NOISES: f64 = 5.0;
/// Ticks at either end of a step whose mean is its level.
const END_TICKS: usize = 16;

/// The mean of the small steps, as shares of the step; one value a tick from the command on.
#[derive(Debug, Clone, PartialEq)]
pub struct StepResponse {
    /// Of the process.
    pub measured: Vec<f64>,
    /// Of the model.
    pub expected: Vec<f64>,
}

/// One frequency of the sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// Hz.
    pub frequency_hz: f64,
    /// Field over command, of the process.
    pub measured: Complex64,
    /// The same of the model.
    pub expected: Complex64,
}

pub fn step(evidence: &Evidence, levels: Option<Levels>, findings: &mut Findings) -> Option<StepResponse> {
    let names = ["delay", "overshoot"];
    let Some(levels) = levels else {
        skip(evidence, findings, &names);
        return None;
    };
    let fields: Vec<f64> = evidence
        .transcript
        .answers
        .iter()
        .map(|answer| answer.field_a_per_m)
        .collect();
    let model: Vec<f64> = evidence.model.iter().map(|output| output.field_a_per_m).collect();
    let (Some((measured, height_a_per_m)), Some((expected, _))) =
        (mean_step(evidence, &fields), mean_step(evidence, &model))
    else {
        skip(evidence, findings, &names);
        return None;
    };
    let noise = NOISES * levels.noise_a_per_m / (STEPS as f64).sqrt() / height_a_per_m.abs();
    let threshold = BEGINS.max(noise);
    let begins = |response: &[f64]| response.iter().position(|value| value.abs() > threshold);
    match (begins(&measured), begins(&expected)) {
        (Some(found), Some(due)) => delay(evidence, found, due, findings),
        _ => findings.skip(&names[..1], "the field does not answer a small step"),
    }
    let overshoot = measured.iter().copied().fold(0.0, f64::max) - 1.0 - noise;
    findings.at_most(
        "overshoot",
        overshoot.max(0.0),
        evidence.expected.tolerances.overshoot_tolerance,
        "1",
        format!("a small step overshoots by {:.2} %", 100.0 * overshoot.max(0.0)),
    );
    Some(StepResponse { measured, expected })
}

fn delay(evidence: &Evidence, found: usize, due: usize, findings: &mut Findings) {
    let late = found as i64 - due as i64;
    let words = match late {
        0 => "as stated".to_owned(),
        late if late > 0 => format!("{late} ticks later than stated"),
        early => format!(
            "{} ticks earlier than stated: it uses commands before they can act",
            -early
        ),
    };
    findings.at_most(
        "delay",
        late.abs() as f64,
        f64::from(evidence.expected.tolerances.delay_tolerance_ticks),
        "ticks",
        format!("the field answers a step {found} ticks after its token, {words}"),
    );
}

fn skip(evidence: &Evidence, findings: &mut Findings, names: &[&'static str]) {
    if findings.fails("stuck") {
        findings.skip(names, STUCK);
    } else {
        findings.skip(names, &evidence.unreached());
    }
}

/// The mean of the small steps as shares of their height, and that height, A/m.
fn mean_step(evidence: &Evidence, fields: &[f64]) -> Option<(Vec<f64>, f64)> {
    let before: Vec<&Segment> = evidence.program.of(Part::BeforeStep).collect();
    let steps: Vec<&Segment> = evidence.program.of(Part::Step).collect();
    let length = steps.iter().map(|step| step.ticks.len()).min()?;
    let rests: Option<Vec<f64>> = before
        .iter()
        .map(|segment| fields.get(segment.judged.clone()).map(mean))
        .collect();
    let rest = mean(&rests?);
    let mut sum = vec![0.0; length];
    for step in &steps {
        let fields = fields.get(step.ticks.start..step.ticks.start + length)?;
        for (sum, field) in sum.iter_mut().zip(fields) {
            *sum += (field - rest) / steps.len() as f64;
        }
    }
    let height_a_per_m = mean(&sum[length.saturating_sub(END_TICKS)..]);
    let shares = sum.iter().map(|value| value / height_a_per_m).collect();
    Some((shares, height_a_per_m))
}

pub fn bandwidth(evidence: &Evidence, findings: &mut Findings) -> Vec<Response> {
    let names = ["bandwidth", "bandwidth_not_above"];
    if findings.fails("stuck") {
        findings.skip(&names, STUCK);
        return Vec::new();
    }
    let Some(responses) = responses(evidence) else {
        findings.skip(&names, &evidence.unreached());
        return Vec::new();
    };
    let highest_hz = responses.last().map_or(0.0, |response| response.frequency_hz);
    let found = falls_at(&responses, |response| response.measured);
    let due = falls_at(&responses, |response| response.expected);
    let tolerance = evidence.expected.tolerances.bandwidth_tolerance;
    let words = match found {
        Some(hz) => format!("the field has fallen by 3 dB at {hz:.0} Hz"),
        None => format!("the field has not fallen by 3 dB up to {highest_hz:.0} Hz"),
    };
    let stated = match (evidence.expected.amplifier.bandwidth_hz, due) {
        (Some(stated), Some(due)) => format!("; with the stated {stated:.0} Hz these samples show it at {due:.0} Hz"),
        (Some(stated), None) => format!("; {stated:.0} Hz are stated"),
        (None, _) => "; no lag is stated".into(),
    };
    let value = found.unwrap_or(highest_hz);
    let least = due.map_or(highest_hz, |due| due * (1.0 - tolerance));
    findings.at_least("bandwidth", value, least, "Hz", format!("{words}{stated}"));
    match due.map(|due| due * (1.0 + tolerance)) {
        Some(most) => findings.at_most(
            "bandwidth_not_above",
            value,
            most,
            "Hz",
            "an amplifier that is faster than stated is overdriven by the lead that makes up for its lag".into(),
        ),
        None => findings.skip(&names[1..], "no lag shows within the sweep"),
    }
    responses
}

fn responses(evidence: &Evidence) -> Option<Vec<Response>> {
    let sines = evidence
        .program
        .segments
        .iter()
        .filter_map(|segment| match segment.part {
            Part::Sine { periods } => Some((periods, segment)),
            _ => None,
        });
    sines
        .map(|(periods, segment)| {
            let ticks = segment.judged.clone();
            let commands = component(evidence.program.commands.get(ticks.clone())?, periods);
            let fields = component(&evidence.transcript.fields(&ticks)?, periods);
            let model: Vec<f64> = evidence
                .model
                .get(ticks.clone())?
                .iter()
                .map(|output| output.field_a_per_m)
                .collect();
            Some(Response {
                frequency_hz: periods as f64 / (ticks.len() as f64 * evidence.expected.tick_s),
                measured: fields / commands,
                expected: component(&model, periods) / commands,
            })
        })
        .collect()
}

/// The component with so many periods in the series.
fn component(series: &[f64], periods: usize) -> Complex64 {
    let angle = 2.0 * PI * periods as f64 / series.len() as f64;
    series
        .iter()
        .enumerate()
        .map(|(tick, value)| {
            let at = angle * tick as f64;
            Complex64::new(value * at.cos(), -value * at.sin())
        })
        .sum()
}

/// Where a response has fallen to 1/√2 of its value at the lowest frequency, Hz.
fn falls_at(responses: &[Response], of: impl Fn(&Response) -> Complex64) -> Option<f64> {
    let first = of(responses.first()?).norm();
    let ratio = |response: &Response| of(response).norm() / first;
    let after = responses.iter().position(|response| ratio(response) < FRAC_1_SQRT_2)?;
    let (from, to) = (responses.get(after.checked_sub(1)?)?, &responses[after]);
    let share = (FRAC_1_SQRT_2.ln() - ratio(from).ln()) / (ratio(to).ln() - ratio(from).ln());
    Some(from.frequency_hz * (to.frequency_hz / from.frequency_hz).powf(share))
}
