//! Where the diagnosis says that the gap is, against where the hidden effects are; scored like names.
//!
//! Claimed: channels whose gap stands out of the noise, stages of the named effects, and the bands and regions in which the energy of the
//! output's gap is concentrated (more than one and a half times their share of the places). True: the same of the hidden effects' own
//! contributions. Claims that are not true are false discoveries; where nothing is hidden, every claim is one.

use anhyst_diagnosis::{ChannelGap, Diagnosed, GapOver, Term};
use anhyst_witness::{Effect, Made, Part};
use serde::{Deserialize, Serialize};

/// What a place is one of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    Channel,
    Stage,
    Frequency,
    Field,
    Rate,
}

impl Axis {
    pub const ALL: [Axis; 5] = [Axis::Channel, Axis::Stage, Axis::Frequency, Axis::Field, Axis::Rate];

    /// As a table says it.
    pub fn heading(self) -> &'static str {
        match self {
            Axis::Channel => "channel",
            Axis::Stage => "stage of the chain",
            Axis::Frequency => "band of frequency",
            Axis::Field => "region of the field",
            Axis::Rate => "region of its rate",
        }
    }

    /// Its table in a diagnosis.
    fn over(self) -> Option<&'static str> {
        match self {
            Axis::Channel | Axis::Stage => None,
            Axis::Frequency => Some("frequency"),
            Axis::Field => Some("size of field"),
            Axis::Rate => Some("size of rate"),
        }
    }
}

/// Places of one kind: how many are claimed, how many there are, and how many are both.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Places {
    pub axis: Axis,
    pub claimed: u64,
    pub there: u64,
    pub right: u64,
}

/// Of a run, axis by axis.
pub(super) fn places(made: &Made, found: &Diagnosed) -> Vec<Places> {
    let diagnosis = &found.diagnosis;
    let parts = contributions(made, found);
    let sum: Vec<f64> = (0..parts.first().map_or(0, Vec::len))
        .map(|row| parts.iter().map(|part| part[row]).sum())
        .collect();
    // Of nothing no place is true.
    let runs = found.runs.iter().filter(|_| !sum.is_empty());
    let own: Vec<GapOver> = runs
        .flat_map(|run| GapOver::of(&sum, &run.field_a_per_m, run.tick_s, &found.amended.material))
        .collect();
    Axis::ALL
        .into_iter()
        .map(|axis| match axis.over() {
            Some(over) => compared(
                axis,
                &concentrated(&diagnosis.gap_over, over),
                &concentrated(&own, over),
            ),
            None if axis == Axis::Channel => {
                let claimed = diagnosis.channels.iter().filter(|own| own.is_loud());
                let claimed: Vec<&str> = claimed.map(|own| own.channel.as_str()).collect();
                compared(axis, &claimed, &channels(made))
            }
            None => {
                let claimed = diagnosis.effects.iter().filter_map(|own| stage(&own.name));
                let there = made.truth.parts.iter().filter_map(|own| stage(own.effect.name()));
                compared(axis, &distinct(claimed), &distinct(there))
            }
        })
        .collect()
}

fn compared(axis: Axis, claimed: &[&str], there: &[&str]) -> Places {
    Places {
        axis,
        claimed: claimed.len() as u64,
        there: there.len() as u64,
        right: claimed.iter().filter(|own| there.contains(own)).count() as u64,
    }
}

fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut names: Vec<&str> = names.collect();
    names.sort_unstable();
    names.dedup();
    names
}

fn concentrated<'a>(tables: &'a [GapOver], over: &str) -> Vec<&'a str> {
    let own = tables.iter().filter(|own| own.channel == "output" && own.over == over);
    let cells = own.flat_map(|own| &own.cells).filter(|cell| cell.is_concentrated());
    cells.map(|cell| cell.label.as_str()).collect()
}

/// What each hidden effect adds to the displacement, on the rows that are compared and without its mean, m.
pub(super) fn contributions(made: &Made, found: &Diagnosed) -> Vec<Vec<f64>> {
    let compared = found.runs.first().map_or(0, |run| run.measured.len());
    let skipped = made.time_s.len() - compared;
    let centred = |part: &Part| {
        let own = &part.contribution_m[skipped..];
        let mean = own.iter().sum::<f64>() / compared as f64;
        own.iter().map(|own| own - mean).collect()
    };
    made.truth.parts.iter().map(centred).collect()
}

/// Channels in which what is hidden stands out of the noise.
fn channels(made: &Made) -> Vec<&'static str> {
    let loud = |noise: f64, rms: f64| {
        let gap = ChannelGap {
            run: 1,
            channel: String::new(),
            unit: String::new(),
            rms: noise.hypot(rms),
            noise_rms: noise,
        };
        gap.is_loud()
    };
    let parts = &made.truth.parts;
    let of_field = |noise: f64| {
        let mut parts = parts.iter();
        parts.any(|part| loud(noise, anhyst_diagnosis::rms(part.contribution_a_per_m.iter().copied())))
    };
    let mut channels = Vec::new();
    if of_field(
        made.rig
            .field_noise_a_per_m
            .max(made.rig.field_resolution_a_per_m / 12_f64.sqrt()),
    ) {
        channels.push("field");
    }
    if parts.iter().any(|part| loud(made.truth.noise_m, part.gap_m)) {
        channels.push("output");
    }
    channels
}

/// Where in the chain an effect acts; what no library holds is where its equation stands (`tests/witness`).
fn stage(name: &str) -> Option<&'static str> {
    if let Some(Term::Effect(kind)) = Term::from_name(name) {
        return Some(kind.stage().name());
    }
    let unlisted = Effect::UNLISTED.into_iter().find(|own| own.name() == name)?;
    Some(match unlisted {
        Effect::XAsymmetry => "hysteresis",
        Effect::XRipple => "magnetization",
        Effect::XBump | Effect::XDrag => "rod",
        _ => "sensor",
    })
}
