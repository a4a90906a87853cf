//! What shares of runs must reach.

use serde::{Deserialize, Serialize};

use super::class::Class;
use super::share::Share;

/// One figure and its limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bar {
    pub name: String,
    pub share: Share,
    pub at_least: f64,
    pub at_most: f64,
    /// By the share itself, not by its interval; none where nothing counted.
    pub held: Option<bool>,
}

impl Bar {
    fn new(name: &str, share: Share, [at_least, at_most]: [f64; 2]) -> Self {
        let value = share.value();
        Bar {
            name: name.to_owned(),
            share,
            at_least,
            at_most,
            held: (share.of > 0).then_some(value >= at_least && value <= at_most),
        }
    }
}

/// Every bar of the study; runs of the sweep for detection limits do not count.
pub(super) fn bars(classes: &[Class]) -> Vec<Bar> {
    let all = |of: fn(&Class) -> Share| classes.iter().map(of).sum::<Share>();
    let mut bars = vec![
        Bar::new("named, one effect", all(|own| own.named), [0.95, 1.0]),
        Bar::new("both named, two effects", all(|own| own.pairs), [0.9, 1.0]),
        Bar::new("wrong name without a flag", all(|own| own.wrong), [0.0, 0.02]),
        Bar::new(
            "an effect named where nothing is hidden",
            all(|own| own.false_alarms),
            [0.0, 0.02],
        ),
        Bar::new(
            "unlisted effects reported as unknown",
            all(|own| own.unlisted),
            [0.9, 1.0],
        ),
        Bar::new(
            "share within 5 points of the truth, of the named",
            all(|own| own.shares),
            [0.9, 1.0],
        ),
        Bar::new(
            "95 % intervals that hold the true value",
            all(|own| own.intervals),
            [0.9, 0.98],
        ),
    ];
    bars.extend(classes.iter().map(|own| {
        let least = if own.nuisance == "clean" { 0.99 } else { 0.9 };
        Bar::new(&format!("named, one effect, {}", own.nuisance), own.named, [least, 1.0])
    }));
    bars
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards against passing by having measured nothing.
    #[test]
    fn nothing_counted_is_nothing_held() {
        assert!(bars(&[]).iter().all(|bar| bar.held.is_none()));
    }
}
