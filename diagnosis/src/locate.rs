//! Where the gap is that names are sought for, calibration and nuisance taken off: its energy over time, frequency, size of
//! the field, rate, direction, temperature, cycle and kind of loop.
//!
//! Energy of a cell is Σ (r² − σ²) over its rows: residual r less the noise σ that is always there. A cell that holds a
//! larger share of the energy than of the time is where to look. The amplifier is judged apart, by command against measured field.

use anhyst_identify::order::descending;
use anhyst_model::Material;
use anhyst_report::number::Digits;
use serde::{Deserialize, Serialize};

use crate::channel::{Channel, ChannelKind};
use crate::likelihood::{Bench, Point};
use crate::signals::Signals;
use crate::spectrum::Spectrum;
use crate::statistics::{quantile, sorted};

/// Cells of a quantity that is cut by its quantiles.
const CELLS: usize = 5;
/// Shares of the energy that are called concentrated.
const CONCENTRATED: f64 = 1.5;
/// A gap stands out of the noise from this multiple of it on.
const LOUD: f64 = 1.05;

/// Energy of the gap over one quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GapOver {
    /// Run, from 1.
    pub run: usize,
    /// `field` or `output`.
    pub channel: String,
    pub over: String,
    pub cells: Vec<GapCell>,
}

/// One cell of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GapCell {
    pub label: String,
    /// None over frequency: there no row is in a cell.
    pub share_of_rows: Option<f64>,
    /// Of all places: of the rows, or of the band.
    #[serde(skip)]
    pub share: f64,
    pub share_of_energy: f64,
    /// Rms of the gap within, noise taken off, in the channel's unit.
    pub rms: f64,
}

/// Gap in a channel as a whole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChannelGap {
    pub run: usize,
    pub channel: String,
    pub unit: String,
    /// Of what calibration and nuisance leave, names not taken off, noise included.
    pub rms: f64,
    pub noise_rms: f64,
}

impl GapOver {
    /// The tables of a part of an output's gap that is known apart from its noise, in the cells that a diagnosis has over that field.
    pub fn of(part: &[f64], field_a_per_m: &[f64], tick_s: Option<f64>, material: &Material) -> Vec<GapOver> {
        let signals = Signals {
            field: field_a_per_m.to_vec(),
            tick_s,
            ..Signals::default()
        };
        tables(1, ChannelKind::Output, part, 0.0, &signals, material)
    }
}

impl GapCell {
    /// Whether it holds clearly more of the energy than of the places.
    pub fn is_concentrated(&self) -> bool {
        self.share > 0.0 && self.share_of_energy > CONCENTRATED * self.share
    }
}

impl ChannelGap {
    /// Whether there is a gap beside the noise.
    pub fn is_loud(&self) -> bool {
        self.rms > LOUD * self.noise_rms
    }
}

/// Tables of the gap's energy, for every channel in which there is one.
pub(crate) fn locate(bench: &Bench, point: &Point, gaps: &[ChannelGap], signals: &[Signals]) -> Vec<GapOver> {
    let loud = bench.plant.channels.iter().zip(gaps).filter(|(_, own)| own.is_loud());
    let of = |(channel, own): (&Channel, &ChannelGap)| {
        let signals = &signals[channel.run].part(channel.rows.clone());
        tables(
            own.run,
            channel.kind,
            &bench.left(point, channel),
            own.noise_rms,
            signals,
            &bench.plant.model.material,
        )
    };
    loud.flat_map(of).collect()
}

fn tables(
    run: usize,
    kind: ChannelKind,
    gap: &[f64],
    noise_rms: f64,
    signals: &Signals,
    material: &Material,
) -> Vec<GapOver> {
    let mut tables = Vec::new();
    let table = |over: &str, cells: Vec<GapCell>| GapOver {
        run,
        channel: kind_name(kind).to_owned(),
        over: over.to_owned(),
        cells,
    };
    for (over, unit, values) in quantities(signals, material) {
        tables.push(table(over, cut(noise_rms, gap, &values, &unit)));
    }
    for (over, cells) in named(signals) {
        tables.push(table(over, by_name(noise_rms, gap, &cells)));
    }
    if let Some(tick_s) = signals.tick_s {
        tables.push(table("frequency", spectrum(noise_rms, gap, tick_s)));
    }
    tables.retain(|table| !table.cells.is_empty());
    tables
}

/// Sentences on the tables in which the energy is concentrated most.
pub(crate) fn sentences(tables: &[GapOver], channels: &[ChannelGap], most: usize) -> Vec<String> {
    let mut found: Vec<(f64, String)> = Vec::new();
    for table in tables {
        let highest = table
            .cells
            .iter()
            .max_by(|one, other| one.share_of_energy.total_cmp(&other.share_of_energy));
        if let Some(cell) = highest.filter(|cell| cell.is_concentrated()) {
            let factor = cell.share_of_energy / cell.share;
            let run = if table.run > 1 || channels.iter().any(|gap| gap.run > 1) {
                format!("run {}: ", table.run)
            } else {
                String::new()
            };
            let sentence = format!(
                "{run}{:.0} % of the energy of the {} gap lies at {} {} ({:.0} % of the {})",
                100.0 * cell.share_of_energy.min(1.0),
                table.channel,
                table.over,
                cell.label,
                100.0 * cell.share,
                if cell.share_of_rows.is_some() { "rows" } else { "band" }
            );
            found.push((factor.min(20.0) * cell.share_of_energy, sentence));
        }
    }
    descending(&mut found, |own| own.0);
    found.into_iter().take(most).map(|(_, sentence)| sentence).collect()
}

fn change(series: &[f64]) -> Vec<f64> {
    (0..series.len())
        .map(|k| series[k] - series[k.saturating_sub(1)])
        .collect()
}

/// Quantities that are cut into cells of equal numbers of rows.
fn quantities(signals: &Signals, material: &Material) -> Vec<(&'static str, String, Vec<f64>)> {
    let per_row = signals.tick_s.unwrap_or(1.0);
    let rate: Vec<f64> = change(&signals.field)
        .iter()
        .map(|change| change.abs() / per_row)
        .collect();
    let time: Vec<f64> = (0..signals.field.len()).map(|k| k as f64 * per_row).collect();
    let field_unit = material.unit_of("A/m");
    let (time_name, time_unit, rate_unit) = match signals.tick_s {
        Some(_) => ("time", "s", material.unit_of("A/(m s)")),
        None => ("row", "", format!("{field_unit} a row")),
    };
    let size = signals.field.iter().map(|field| field.abs()).collect();
    let mut all = vec![
        (time_name, time_unit.to_owned(), time),
        ("size of field", field_unit, size),
        ("size of rate", rate_unit, rate),
    ];
    if let Some(temperature) = &signals.temperature {
        all.push(("temperature", "K".to_owned(), temperature.clone()));
    }
    all
}

/// Cells with names: direction, cycle, kind of loop.
fn named(signals: &Signals) -> Vec<(&'static str, Vec<&'static str>)> {
    let rate = change(&signals.field);
    let direction = rate.iter().map(|rate| match rate {
        rate if *rate > 0.0 => "rising field",
        rate if *rate < 0.0 => "falling field",
        _ => "field at rest",
    });
    let (cycles, loops) = cycles_and_loops(&signals.field);
    vec![
        ("direction", direction.collect()),
        ("cycle", cycles),
        ("kind of loop", loops),
    ]
}

/// Early or late cycle, and whether the present branch lies within earlier extremes.
fn cycles_and_loops(field: &[f64]) -> (Vec<&'static str>, Vec<&'static str>) {
    let largest = field.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let threshold = 0.02 * largest;
    let mut numbers = Vec::with_capacity(field.len());
    let (mut cycle, mut extreme, mut rising) = (0_usize, field.first().copied().unwrap_or(0.0), true);
    let (mut low, mut high) = (0.0_f64, 0.0_f64);
    let mut loops = Vec::with_capacity(field.len());
    for value in field {
        if rising == (*value > extreme) {
            extreme = *value;
        } else if (value - extreme).abs() > threshold {
            cycle += 1;
            rising = !rising;
            extreme = *value;
        }
        numbers.push(cycle / 2);
        (low, high) = (low.min(*value), high.max(*value));
        // Within nine tenths of what has been reached before.
        let within = extreme.abs() < 0.9 * high.max(-low);
        loops.push(if within { "minor loop" } else { "major loop" });
    }
    let last = numbers.last().copied().unwrap_or(0).max(1);
    let names = [
        "first third of the cycles",
        "second third of the cycles",
        "last third of the cycles",
    ];
    let cycles = numbers
        .into_iter()
        .map(|number| names[(3 * number / (last + 1)).min(2)])
        .collect();
    (cycles, loops)
}

fn cut(noise_rms: f64, gap: &[f64], values: &[f64], unit: &str) -> Vec<GapCell> {
    let all = sorted(values.iter().copied());
    let edges: Vec<f64> = (0..=CELLS)
        .map(|edge| quantile(&all, edge as f64 / CELLS as f64))
        .collect();
    let inner = &edges[1..CELLS];
    let places = values.iter().map(|value| inner.partition_point(|edge| edge <= value));
    cells(noise_rms, gap, places, CELLS, |cell| {
        format!("{} to {} {unit}", Digits(edges[cell], 3), Digits(edges[cell + 1], 3))
            .trim_end()
            .to_owned()
    })
}

fn by_name(noise_rms: f64, gap: &[f64], names: &[&'static str]) -> Vec<GapCell> {
    let mut different: Vec<&'static str> = Vec::new();
    for name in names {
        if !different.contains(name) {
            different.push(name);
        }
    }
    let places = names
        .iter()
        .map(|name| different.iter().position(|own| own == name).unwrap_or(0));
    cells(noise_rms, gap, places, different.len(), |cell| {
        format!("({})", different[cell])
    })
}

fn cells(
    noise_rms: f64,
    gap: &[f64],
    places: impl Iterator<Item = usize>,
    count: usize,
    label: impl Fn(usize) -> String,
) -> Vec<GapCell> {
    let mut sums = vec![(0.0_f64, 0.0_f64); count];
    let variance = noise_rms * noise_rms;
    for (gap, place) in gap.iter().zip(places) {
        sums[place].0 += gap * gap - variance;
        sums[place].1 += 1.0;
    }
    let total: f64 = sums.iter().map(|(energy, _)| energy.max(0.0)).sum();
    sums.iter()
        .enumerate()
        .filter(|(_, (_, rows))| *rows > 0.0)
        .map(|(cell, (energy, rows))| GapCell {
            label: label(cell),
            share_of_rows: Some(rows / gap.len() as f64),
            share: rows / gap.len() as f64,
            share_of_energy: if total > 0.0 { energy.max(0.0) / total } else { 0.0 },
            rms: (energy.max(0.0) / rows).sqrt(),
        })
        .collect()
}

/// Decades of frequency, with the noise taken as white.
fn spectrum(noise_rms: f64, gap: &[f64], tick_s: f64) -> Vec<GapCell> {
    let powers = Spectrum::powers(&Spectrum::new(gap.len()).of(gap));
    let bins = powers.len() as f64;
    let highest = 0.5 / tick_s;
    let floor = noise_rms * noise_rms;
    let mut edges = vec![0.0];
    let mut edge = 1.0;
    while edge < highest {
        if edge * gap.len() as f64 * tick_s > 1.0 {
            edges.push(edge);
        }
        edge *= 10.0_f64.sqrt();
    }
    edges.push(highest);
    let mut found: Vec<(f64, f64)> = vec![(0.0, 0.0); edges.len() - 1];
    for (bin, power) in powers.iter().enumerate() {
        let frequency = highest * bin as f64 / bins;
        let cell = (edges.partition_point(|edge| *edge <= frequency)).clamp(1, found.len()) - 1;
        found[cell].0 += power - floor;
        found[cell].1 += 1.0;
    }
    let total: f64 = found.iter().map(|(energy, _)| energy.max(0.0)).sum();
    // Parseval: two numbers a line.
    let scale = 2.0 / gap.len() as f64;
    found
        .iter()
        .enumerate()
        .map(|(cell, (energy, rows))| GapCell {
            label: format!("{} to {} Hz", Digits(edges[cell], 3), Digits(edges[cell + 1], 3)),
            share_of_rows: None,
            share: rows / bins,
            share_of_energy: if total > 0.0 { energy.max(0.0) / total } else { 0.0 },
            rms: (energy.max(0.0) * scale).sqrt(),
        })
        .collect()
}

/// Gap of each channel against its noise.
pub(crate) fn channel_gaps(bench: &Bench, point: &Point, noise_rms: &[f64], output_unit: &str) -> Vec<ChannelGap> {
    let channels = bench.plant.channels.iter().zip(noise_rms);
    channels
        .map(|(channel, noise_rms)| ChannelGap {
            run: channel.run + 1,
            channel: kind_name(channel.kind).to_owned(),
            unit: match channel.kind {
                ChannelKind::Output => output_unit.to_owned(),
                _ => bench.plant.model.material.units()[0].to_owned(),
            },
            rms: crate::statistics::rms(bench.left(point, channel)),
            noise_rms: *noise_rms,
        })
        .collect()
}

fn kind_name(kind: ChannelKind) -> &'static str {
    match kind {
        ChannelKind::Field => "field",
        ChannelKind::Output => "output",
        ChannelKind::Magnetization => "magnetization",
    }
}
