//! A token for each tick, in order, and how long it takes.

use super::super::findings::Findings;
use super::evidence::Evidence;

/// p50, p99 and the longest of some latencies, s; none without any.
pub fn quantiles(latencies_s: &[f64]) -> Option<[f64; 3]> {
    let mut sorted = latencies_s.to_vec();
    sorted.sort_by(f64::total_cmp);
    let longest = *sorted.last()?;
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share).round() as usize];
    Some([at(0.5), at(0.99), longest])
}

pub fn judge(evidence: &Evidence, findings: &mut Findings) {
    let transcript = evidence.transcript;
    let faulty = transcript.missing + transcript.wrong + transcript.repeated;
    findings.at_most(
        "rate",
        faulty as f64,
        0.0,
        "tokens",
        format!(
            "of {} commands {} had no answer in time; {} answers bore a wrong tick, {} came late or twice",
            transcript.answers.len(),
            transcript.missing,
            transcript.wrong,
            transcript.repeated
        ),
    );
    let names = ["latency_median", "latency_p99", "latency_longest"];
    let Some(found) = quantiles(&transcript.latencies_s) else {
        findings.skip(&names, "there was no answer");
        return;
    };
    let expected = evidence.expected;
    let limits = [
        expected.latency_median_limit_s(),
        expected.latency_p99_limit_s(),
        expected.answer_limit_s(),
    ];
    let words = [
        "half of all answers came",
        "99 of 100 answers came",
        "every answer came",
    ];
    for (((name, value), limit), words) in names.into_iter().zip(found).zip(limits).zip(words) {
        let sentence = format!("{words} within {:.1} µs of the command", value * 1e6);
        findings.at_most(name, value, limit, "s", sentence);
    }
    if !expected.judges_latency() {
        names[..2].iter().for_each(|name| findings.only_warn(name));
    }
}
