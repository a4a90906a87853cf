//! The variables of an FMU: one table for its description and for its library.

use crate::kind::Kind;
use crate::parameters::PARAMETERS;
use anhyst_ipc::{Channel, FieldKind};
use anhyst_scenario::{Scenario, Units};

/// What a variable is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Causality {
    /// Time.
    Independent,
    /// Settable before the start; those that are tunable later, too.
    Parameter { tunable: bool },
    /// Settable at any time but after the end.
    Input,
    /// Said.
    Output,
}

/// Where its value is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Time of the simulation.
    Time,
    /// A parameter, by its place among them.
    Parameter(usize),
    /// A field of a channel's token, by its place there.
    Token(Channel, usize),
    /// Reference minus true displacement of the same tick.
    TrackingError,
}

/// One variable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Variable {
    /// FMI's value reference.
    pub reference: u32,
    /// `channel.field`, or the path of a setting.
    pub name: String,
    /// One sentence.
    pub doc: String,
    /// Empty for counts, flags and ratios.
    pub unit: String,
    /// Number or count.
    pub kind: FieldKind,
    /// What it is for.
    pub causality: Causality,
    /// Where its value is.
    pub place: Place,
    /// Its bits before anybody sets them; none for what is computed.
    pub start: Option<u64>,
}

const PARAMETERS_FROM: u32 = 100;
const TOKENS_FROM: u32 = 1000;
const PER_CHANNEL: u32 = 100;
const TRACKING_ERROR: u32 = 1;

/// All variables of a part of the loop, in the order of their references.
pub fn variables(kind: Kind, scenario: &Scenario) -> Vec<Variable> {
    let units = scenario.units();
    let mut all = vec![Variable {
        reference: 0,
        name: "time".into(),
        doc: "Time since the start.".into(),
        unit: "s".into(),
        kind: FieldKind::F64,
        causality: Causality::Independent,
        place: Place::Time,
        start: None,
    }];
    if kind == Kind::Loop {
        all.push(Variable {
            reference: TRACKING_ERROR,
            name: "tracking_error_m".into(),
            doc: "Reference minus true displacement.".into(),
            unit: units.output.clone(),
            kind: FieldKind::F64,
            causality: Causality::Output,
            place: Place::TrackingError,
            start: None,
        });
    }
    for (index, parameter) in PARAMETERS.iter().enumerate() {
        let Some(start) = parameter.start(kind, scenario) else {
            continue;
        };
        all.push(Variable {
            reference: PARAMETERS_FROM + index as u32,
            name: parameter.name.into(),
            doc: parameter.doc.into(),
            unit: units.of_message(parameter.name, parameter.unit),
            kind: parameter.kind,
            causality: Causality::Parameter {
                tunable: parameter.tunable.is_some(),
            },
            place: Place::Parameter(index),
            start: Some(start),
        });
    }
    for channel in Channel::ALL {
        all.extend(of_channel(kind, channel, scenario, &units));
    }
    all
}

fn of_channel(kind: Kind, channel: Channel, scenario: &Scenario, units: &Units) -> impl Iterator<Item = Variable> {
    let heard = kind.inputs().iter().find(|(own, _)| *own == channel);
    let said = kind.outputs().contains(&channel);
    let believed_a_per_m = scenario.material().map(|own| own.hysteresis.shape_a_per_m);
    let fields = channel.fields().iter().enumerate();
    let fields = fields.filter(move |(_, field)| said || heard.is_some_and(|(_, names)| names.contains(&field.name)));
    fields.map(move |(index, field)| {
        // Nothing is known at a field of shape 0: an inverse that is told no other has the material's own.
        let start = match (channel, field.name) {
            (Channel::Estimate, "shape_a_per_m") => believed_a_per_m.as_ref().map_or(0, |own| own.to_bits()),
            _ => 0,
        };
        Variable {
            reference: TOKENS_FROM + PER_CHANNEL * channel.number() as u32 + index as u32,
            name: format!("{channel}.{}", field.name),
            doc: of_law(units, field.doc.trim()),
            unit: units.of_message(field.name, field.unit),
            kind: field.kind,
            causality: if said { Causality::Output } else { Causality::Input },
            place: Place::Token(channel, index),
            start: (!said).then_some(start),
        }
    })
}

/// What a message says of a rod, of an actuator with another law.
fn of_law(units: &Units, doc: &str) -> String {
    if units.shape {
        return doc.to_owned();
    }
    [
        ("Magnetization", "Output of the law"),
        ("magnetization", "output of the law"),
        ("field", "input"),
        ("displacement", units.output_name()),
    ]
    .iter()
    .fold(doc.to_owned(), |doc, (rod, own)| doc.replace(rod, own))
}
