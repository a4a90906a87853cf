//! Who is to blame when a process has failed: what all processes said last is followed to the one that has nothing to say.

use super::{Running, look};
use crate::folder::RunFolder;
use std::process::ExitStatus;
use std::time::{Duration, Instant};

/// What the others get to complain, too, when a process gives up waiting.
const SETTLING: Duration = Duration::from_millis(300);
/// What a process that neither ends nor complains gets to do so before it counts as hung: on a busy machine it may be late.
const SUSPICION: Duration = Duration::from_millis(1200);

/// Whoever waits for the same culprit gives up within moments: then the chain of complaints is whole.
pub(super) fn settle(children: &mut [Running], folder: &RunFolder) {
    let begin = Instant::now();
    loop {
        std::thread::sleep(SETTLING);
        look(children);
        let hangs = |running: &Running| running.ended.is_none() && last_words(folder, &running.name).is_empty();
        if begin.elapsed() > SUSPICION || !culprit(children, folder).is_some_and(hangs) {
            return;
        }
    }
}

/// Of the processes that failed, the one to blame: one that a signal ended comes before those that complain about it; else the
/// complaints "… but X is silent" are followed to the process that has none, be it dead or hung. Other complaints may only be
/// consequences: a last token on the way to the safe field does not reach a reader that has given up.
pub(super) fn culprit<'a>(children: &'a [Running], folder: &RunFolder) -> Option<&'a Running> {
    if let Some(killed) = children.iter().find(|running| running.killed()) {
        return Some(killed);
    }
    let accused_by = |running: &Running| {
        let words = last_words(folder, &running.name);
        let node = match words.strip_suffix(" is silent") {
            Some(rest) => rest.rsplit(' ').next()?.to_owned(),
            None => words
                .strip_prefix(": ")?
                .split_once(" did not come within")?
                .0
                .to_owned(),
        };
        let mut all = children.iter();
        all.find(|running| running.name == node || running.name.split('+').any(|name| name == node))
    };
    let mut blamed = None;
    // Also of those that have not ended yet: who brings the field to safety has complained before.
    for complainer in children {
        let Some(mut last) = accused_by(complainer) else {
            continue;
        };
        for _ in children {
            last = accused_by(last).unwrap_or(last);
        }
        if last_words(folder, &last.name).is_empty() {
            return Some(last);
        }
        blamed = blamed.or(Some(last));
    }
    blamed.or_else(|| children.iter().find(|running| running.failed()))
}

pub(super) fn describe(status: Option<ExitStatus>) -> String {
    use std::os::unix::process::ExitStatusExt;
    match status.map(|status| (status.code(), status.signal())) {
        Some((Some(code), _)) => format!("ended with exit status {code}"),
        Some((None, Some(signal))) => format!("was killed by signal {signal}"),
        _ => "does not answer".into(),
    }
}

pub(super) fn last_words(folder: &RunFolder, process: &str) -> String {
    let log = std::fs::read_to_string(folder.log(process)).unwrap_or_default();
    // A refusal's sentence is marked; the picture below it is for the log.
    let sentence = log
        .lines()
        .find_map(|line| line.trim().strip_prefix('×'))
        .or_else(|| log.lines().rfind(|line| !line.trim().is_empty()));
    sentence.map(|line| format!(": {}", line.trim())).unwrap_or_default()
}
