//! Which column is what: by the name that the door knows, by what the name says, and, where it says nothing, by what the values do.
//!
//! A time increases from row to row by steps that are alike. Of two series that follow each other the one that comes first drives: the
//! loop of what drives (u) and what answers (y) is run through so that its area ∮ u dy = Σ (u_k + u_{k+1}) (y_{k+1} − y_k) / 2 is above
//! zero, for hysteresis and for delay alike: it is what is lost, and nothing is won.

use super::Channel;
use super::words::Said;
use crate::columns::{ColumnMapping, option};
use crate::quantity::Quantity;
use crate::run::{INPUTS, LAW_INPUTS, LAW_OUTPUTS, MIN_RUN_ROWS, OUTPUTS, correlation};
use crate::units;

/// Two series follow each other from this correlation on.
const FOLLOWS: f64 = 0.5;
/// Steps of a time are alike if none is longer than so many median steps, gaps left out.
const ALIKE: f64 = 1.5;
/// Share of its steps that are.
const MOST_ALIKE: f64 = 0.9;
/// Values that loops are numbered by, at most.
const MOST_LOOPS: usize = 1000;

/// What a column is taken for.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Taken {
    pub channel: usize,
    pub quantity: Quantity,
    /// To SI.
    pub scale: f64,
    pub offset: f64,
    /// None: the door takes it for that by itself.
    pub option: Option<String>,
    pub because: String,
}

/// What all columns are taken for, and what is said beside. `given`: what the user has named.
pub(super) fn proposed(channels: &[Channel], given: &[ColumnMapping]) -> (Vec<Taken>, Vec<String>) {
    let mut proposal = Proposal {
        channels,
        said: channels.iter().map(|channel| Said::by(&channel.header)).collect(),
        left_out: given.iter().map(|mapping| mapping.quantity).collect(),
        taken: Vec::new(),
        remarks: Vec::new(),
    };
    proposal.given(given);
    proposal.known();
    proposal.named();
    proposal.clock();
    proposal.sides();
    (proposal.taken, proposal.remarks)
}

struct Proposal<'a> {
    channels: &'a [Channel],
    said: Vec<Said>,
    /// Quantities that the user has spoken of.
    left_out: Vec<Quantity>,
    taken: Vec<Taken>,
    remarks: Vec<String>,
}

impl Proposal<'_> {
    fn has(&self, quantity: Quantity) -> bool {
        self.taken.iter().any(|own| own.quantity == quantity) || self.left_out.contains(&quantity)
    }

    fn is_free(&self, channel: usize) -> bool {
        !self.taken.iter().any(|own| own.channel == channel) && self.channels[channel].is_whole()
    }

    fn given(&mut self, given: &[ColumnMapping]) {
        for mapping in given {
            let quantity = mapping.quantity;
            let Some(channel) = self.channels.iter().position(|own| own.header == mapping.header) else {
                continue;
            };
            let unit = quantity.named_unit(&mapping.header);
            self.taken.push(Taken {
                channel,
                quantity,
                scale: unit.map(|unit| unit.factor).or(mapping.scale).unwrap_or(1.0),
                offset: unit.map(|unit| unit.offset).or(mapping.offset).unwrap_or(0.0),
                // A scale beside a unit that the name has is refused.
                option: Some(match unit {
                    Some(_) => format!("{}={}", quantity.key(), mapping.header),
                    None => mapping.to_string(),
                }),
                because: "you say so".to_owned(),
            });
        }
    }

    /// Headers that the door knows; of several for one quantity the first.
    fn known(&mut self) {
        for (channel, own) in self.channels.iter().enumerate() {
            let known = |quantity: Quantity| Some((quantity, quantity.known_header(&own.header)?));
            let Some((quantity, (factor, offset))) = Quantity::ALL.into_iter().find_map(known) else {
                continue;
            };
            if self.left_out.contains(&quantity) {
                continue;
            }
            if let Some(before) = self.taken.iter_mut().find(|own| own.quantity == quantity) {
                let first = &self.channels[before.channel].header;
                before.option = Some(option(quantity, first, before.scale, before.offset));
                let (name, other) = (quantity.name(), &own.header);
                self.remarks
                    .push(format!("\"{other}\" holds the {name} as well as \"{first}\""));
                continue;
            }
            if own.is_whole() {
                self.take(channel, quantity, (factor, offset), "", false);
            }
        }
    }

    /// Headers that say something.
    fn named(&mut self) {
        let mut guesses: Vec<(u32, usize, Quantity)> = Vec::new();
        for (channel, said) in self.said.iter().enumerate() {
            if !self.is_free(channel) || self.channels[channel].is_steady() && said.word != Some(Quantity::Temperature)
            {
                continue;
            }
            if said.made {
                continue;
            }
            let header = &self.channels[channel].header;
            if let (Some(quantity), []) = (said.word, &said.units[..])
                && let Some(unit) = quantity.strange_unit(header)
            {
                let (name, key, si) = (quantity.name(), quantity.key(), quantity.unit());
                self.remarks.push(format!(
                    "\"{header}\" seems to be the {name} in {unit}, a unit that is not known: with what takes it to {si} it is \
                     --column '{key}={header}*SCALE'"
                ));
                continue;
            }
            // By word and unit, by a unit that only one quantity has, by a word alone.
            match (said.word, &said.units[..]) {
                (Some(quantity), _) if said.unit_of(quantity).is_some() => guesses.push((3, channel, quantity)),
                (Some(quantity), units) if sensed_in_volts(quantity, units) => {
                    let (header, name) = (&self.channels[channel].header, quantity.name());
                    let key = quantity.key();
                    self.remarks.push(format!(
                        "\"{header}\" seems to be the {name} as a sensor gives it, in volts: with what a volt stands for it is \
                         --column '{key}={header}*SCALE'"
                    ));
                }
                (Some(Quantity::Input | Quantity::Output) | None, [first, ..]) => guesses.push((2, channel, first.0)),
                (Some(_), [first, ..]) => guesses.push((2, channel, first.0)),
                (Some(quantity), []) => guesses.push((1, channel, quantity)),
                (None, []) => {}
            }
        }
        // Letters alone say which side they are on only where both sides are named: of x and y the one that comes first drives.
        let taken = self.taken.iter().map(|own| own.quantity);
        let named: Vec<Quantity> = taken.chain(guesses.iter().map(|own| own.2)).collect();
        let both = [&INPUTS[..], &OUTPUTS[..]].map(|side| named.iter().any(|quantity| side.contains(quantity)));
        let is_side = |quantity: &Quantity| INPUTS.contains(quantity) || OUTPUTS.contains(quantity);
        guesses.retain(|(worth, channel, quantity)| {
            both == [true; 2] || *worth > 1 || !self.said[*channel].by_letter || !is_side(quantity)
        });
        guesses.sort_by_key(|(worth, channel, _)| (std::cmp::Reverse(*worth), *channel));
        for (worth, channel, quantity) in guesses {
            let own = &self.channels[channel];
            if self.has(quantity) {
                let (header, name) = (&own.header, quantity.name());
                self.remarks.push(format!("\"{header}\" looks like the {name} too"));
                continue;
            }
            let is_number_of_loop = || own.distinct(MOST_LOOPS).is_some_and(|count| count > 1) && own.is_integer();
            if quantity == Quantity::LoopId && !is_number_of_loop() {
                continue;
            }
            if quantity == Quantity::Time && !own.increases() {
                continue;
            }
            let unit = self.said[channel].unit_of(quantity);
            let to_si = unit.map_or((1.0, 0.0), |unit| (unit.factor, unit.offset));
            let because = match worth {
                3 => "by its name and unit",
                2 => "by its unit",
                _ => "by its name",
            };
            self.take(channel, quantity, to_si, because, true);
        }
    }

    /// A column that runs as a time does.
    fn clock(&mut self) {
        if self.has(Quantity::Time) {
            return;
        }
        let runs = |channel: &usize| self.is_free(*channel) && self.channels[*channel].increases();
        let Some(channel) = (0..self.channels.len()).find(runs) else {
            return;
        };
        let own = &self.channels[channel];
        let counts = own.values.windows(2).all(|pair| pair[1] - pair[0] == 1.0);
        if counts {
            let header = &own.header;
            self.remarks.push(format!(
                "\"{header}\" counts the rows: with the time from one to the next, in seconds, it is --column 'time={header}*TICK'"
            ));
            return;
        }
        let steps: Vec<f64> = own.values.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let median = crate::run::median_step_s(&own.values);
        let alike = steps.iter().filter(|step| **step <= ALIKE * median).count();
        if alike as f64 >= MOST_ALIKE * steps.len() as f64 {
            self.take(channel, Quantity::Time, (1.0, 0.0), "it increases by equal steps", true);
        }
    }

    /// What drives and what answers, where no name says it.
    fn sides(&mut self) {
        // Fewer rows than a run has are a table of something else.
        if self.channels.iter().any(|channel| channel.values.len() < MIN_RUN_ROWS) {
            return;
        }
        let any = |list: &[Quantity]| list.iter().find(|quantity| self.has(**quantity)).copied();
        let (input, output) = (
            any(&INPUTS).or(any(&LAW_INPUTS[..1])),
            any(&OUTPUTS).or(any(&LAW_OUTPUTS[..1])),
        );
        let free: Vec<usize> = (0..self.channels.len())
            .filter(|channel| self.is_free(*channel) && !self.channels[*channel].is_steady())
            .filter(|channel| !self.said[*channel].made && !self.channels[*channel].increases())
            .collect();
        let follows = |one: usize, other: usize| {
            let correlation = correlation(&self.channels[one].values, &self.channels[other].values);
            (correlation.abs() >= FOLLOWS).then_some(correlation)
        };
        let of = |quantity: Quantity| {
            self.taken
                .iter()
                .find(|own| own.quantity == quantity)
                .map(|own| own.channel)
        };
        match (input, output) {
            (Some(_), Some(_)) => {}
            (Some(one), None) | (None, Some(one)) => {
                let Some(known) = of(one) else { return };
                let near = free
                    .iter()
                    .filter_map(|channel| Some((*channel, follows(known, *channel)?.abs())));
                let Some((channel, _)) = near.max_by(|one, other| one.1.total_cmp(&other.1)) else {
                    return;
                };
                let (side, because) = match input {
                    Some(_) => (Quantity::Output, "it follows what drives"),
                    None => (Quantity::Input, "what answers follows it"),
                };
                self.take(channel, side, (1.0, 0.0), because, true);
            }
            (None, None) => {
                let pairs = free.iter().enumerate().flat_map(|(at, one)| {
                    let others = free[at + 1..].iter();
                    others.filter_map(move |other| Some((*one, *other, follows(*one, *other)?)))
                });
                let Some((one, other, correlation)) = pairs.max_by(|one, other| one.2.abs().total_cmp(&other.2.abs()))
                else {
                    return;
                };
                let area = area(&self.channels[one].values, &self.channels[other].values) * correlation.signum();
                let (input, output) = if area >= 0.0 { (one, other) } else { (other, one) };
                self.take(
                    input,
                    Quantity::Input,
                    (1.0, 0.0),
                    "the other one comes behind it",
                    true,
                );
                self.take(
                    output,
                    Quantity::Output,
                    (1.0, 0.0),
                    "it comes behind the other one",
                    true,
                );
            }
        }
    }

    /// `named`: it must be mapped. Where the name says no unit, or one that cannot be, the size does.
    fn take(&mut self, channel: usize, quantity: Quantity, to_si: (f64, f64), because: &str, named: bool) {
        let own = &self.channels[channel];
        let values: Vec<f64> = own.values.iter().map(|value| value * to_si.0 + to_si.1).collect();
        let guess = units::looks_like(quantity, &values).filter(|_| quantity != Quantity::LoopId);
        let says_unit = quantity.named_unit(&own.header).is_some() || to_si != (1.0, 0.0);
        let (scale, offset, because) = match guess {
            Some((symbol, factor, offset)) => {
                let and = if because.is_empty() { "" } else { "; " };
                (
                    to_si.0 * factor,
                    to_si.1 * factor + offset,
                    format!("{because}{and}by its size in {symbol}: look whether it is"),
                )
            }
            None => (to_si.0, to_si.1, because.to_owned()),
        };
        let has_star = own.header.contains('*');
        let option = match (named || guess.is_some(), guess.is_some() || has_star) {
            (false, _) => None,
            (true, true) => Some(option(quantity, &own.header, scale, offset)),
            (true, false) => Some(format!("{}={}", quantity.key(), own.header)),
        };
        if guess.is_some() && says_unit {
            let (header, name) = (&own.header, quantity.name());
            self.remarks.push(format!(
                "the unit that \"{header}\" names makes a {name} that no actuator has"
            ));
        }
        self.taken.push(Taken {
            channel,
            quantity,
            scale,
            offset,
            option,
            because,
        });
    }
}

/// The name speaks of something measured, and the unit is a sensor's.
fn sensed_in_volts(quantity: Quantity, units: &[(Quantity, &'static crate::quantity::Unit)]) -> bool {
    let any = matches!(
        quantity,
        Quantity::Input | Quantity::Output | Quantity::Time | Quantity::Current
    );
    !any && units.iter().all(|(own, _)| *own == Quantity::Voltage) && !units.is_empty()
}

/// ∮ u dy, the path closed by a straight line.
fn area(input: &[f64], output: &[f64]) -> f64 {
    let count = input.len();
    let next = |index: usize| (index + 1) % count;
    (0..count)
        .map(|index| 0.5 * (input[index] + input[next(index)]) * (output[next(index)] - output[index]))
        .sum()
}
