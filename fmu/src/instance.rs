//! One instance of an FMU: FMI's order of calls, its variables, its steps. Without C and without a pointer.

use crate::kind::{KIND_FILE, Kind, SCENARIO_FILE, instantiation_token};
use crate::parameters::PARAMETERS;
use crate::refusal::Refusal;
use crate::state::{Mode, State};
use crate::tokens::Tokens;
use crate::unit::{Unit, refuse_unsteppable};
use crate::variables::{Causality, Place, Variable, variables};
use anhyst_ipc::{Change, Demand, FieldKind, Truth};
use anhyst_scenario::{Scenario, load};
use std::collections::HashMap;
use std::path::Path;

/// Share of a tick by which a step may differ from whole ticks: what sums of decimal times round to.
const STEP_WITHIN: f64 = 1e-6;
/// Share of a tick by which the time of a step may differ from where this instance is: roundings of many steps add up.
const TIME_WITHIN: f64 = 1e-3;
/// Longer than any run.
const MAX_TICKS: f64 = 1e12;

/// An instance.
#[derive(Debug)]
pub struct Instance {
    kind: Kind,
    /// As in the resources.
    scenario: Scenario,
    variables: HashMap<u32, Variable>,
    /// What it remembers.
    pub state: State,
}

impl Instance {
    /// From an FMU's folder of resources; `token` is what the description says.
    ///
    /// # Errors
    /// Resources that cannot be read or are others than those described.
    pub fn open(resources: &Path, token: &str) -> Result<Self, Refusal> {
        let of_kind = resources.join(KIND_FILE);
        let of_scenario = resources.join(SCENARIO_FILE);
        let read = |path: &Path| {
            std::fs::read_to_string(path)
                .map_err(|cause| Refusal::new(format!("{} cannot be read: {cause}", path.display())))
        };
        let kind: Kind = read(&of_kind)?.trim().parse().map_err(Refusal::new)?;
        let expected = instantiation_token(kind, &read(&of_scenario)?);
        if token != expected {
            return Err(Refusal::new(format!(
                "the instantiation token {token} is not {expected}, that of these resources and of this library (anhyst {}): \
                 write the FMU again with `anhyst export --fmu`",
                env!("CARGO_PKG_VERSION")
            )));
        }
        let scenario = load(&of_scenario, &[]).map_err(|error| Refusal::new(error.to_string()))?;
        refuse_unsteppable(&scenario)?;
        let known = variables(kind, &scenario);
        let variables = known.into_iter().map(|own| (own.reference, own)).collect();
        let state = State {
            mode: Mode::Instantiated,
            start_time_s: 0.0,
            tick: 0,
            at_start: Vec::new(),
            now: Vec::new(),
            changes: Vec::new(),
            tokens: Tokens::default(),
            unit: None,
        };
        let mut instance = Self {
            kind,
            scenario,
            variables,
            state,
        };
        instance.reset();
        Ok(instance)
    }

    /// As it was instantiated.
    pub fn reset(&mut self) {
        let starts = PARAMETERS.iter().map(|own| own.start(self.kind, &self.scenario));
        let starts: Vec<Option<u64>> = starts.collect();
        let mut tokens = Tokens::default();
        for variable in self.variables.values() {
            if let (Place::Token(channel, field), Some(word)) = (variable.place, variable.start) {
                tokens.set_word(channel, field, word);
            }
        }
        self.state = State {
            mode: Mode::Instantiated,
            start_time_s: 0.0,
            tick: 0,
            at_start: starts.clone(),
            now: starts,
            changes: Vec::new(),
            tokens,
            unit: None,
        };
    }

    /// Goes on from `before` to `after`.
    fn enter(&mut self, before: Mode, after: Mode) -> Result<(), Refusal> {
        let now = self.state.mode;
        if now != before {
            return Err(Refusal::new(format!(
                "the {} begins after the {}, and this instance is in the {}",
                after.name(),
                before.name(),
                now.name()
            )));
        }
        self.state.mode = after;
        Ok(())
    }

    /// # Errors
    /// A time that is none, another mode.
    pub fn enter_initialization(&mut self, start_time_s: f64) -> Result<(), Refusal> {
        if !start_time_s.is_finite() {
            return Err(Refusal::new(format!(
                "the start time, {start_time_s} s, must be finite"
            )));
        }
        self.enter(Mode::Instantiated, Mode::Initialization)?;
        self.state.start_time_s = start_time_s;
        Ok(())
    }

    /// # Errors
    /// Parameters that make no scenario, another mode.
    pub fn exit_initialization(&mut self) -> Result<(), Refusal> {
        if self.state.mode == Mode::Initialization {
            self.begin()?;
        }
        self.enter(Mode::Initialization, Mode::Step)
    }

    /// # Errors
    /// Another mode.
    pub fn terminate(&mut self) -> Result<(), Refusal> {
        self.enter(Mode::Step, Mode::Terminated)
    }

    /// The scenario with its parameters as they were at the start, and what was changed since.
    fn scenario_now(&self) -> Scenario {
        let mut scenario = self.scenario.clone();
        for (index, parameter) in PARAMETERS.iter().enumerate() {
            let stated = parameter.start(self.kind, &self.scenario);
            // What nobody set stays as it is in the file, to the bit and without a change of its own.
            if let Some(word) = self.state.at_start[index].filter(|word| Some(*word) != stated) {
                parameter.set(&mut scenario, word);
            }
        }
        scenario.add_changes(&self.state.changes);
        scenario
    }

    /// Builds the blocks, unless they are there.
    fn begin(&mut self) -> Result<(), Refusal> {
        if self.state.unit.is_none() {
            let scenario = self.scenario_now();
            let refused = |invalid: anhyst_ipc::Invalid| Refusal::new(invalid.to_string());
            scenario.validate().map_err(refused)?;
            self.state.unit = Some(Unit::begin(self.kind, &scenario, &mut self.state.tokens).map_err(refused)?);
        }
        Ok(())
    }

    fn find(&self, reference: u32, kind: FieldKind) -> Result<&Variable, Refusal> {
        let Some(variable) = self.variables.get(&reference) else {
            return Err(Refusal::new(format!(
                "there is no variable with the value reference {reference}"
            )));
        };
        if variable.kind != kind {
            let (own, asked) = (type_name(variable.kind), type_name(kind));
            return Err(Refusal::new(format!(
                "{} (value reference {reference}) is a {own} and no {asked}",
                variable.name
            )));
        }
        Ok(variable)
    }

    /// Bits of variables, into `words`.
    ///
    /// # Errors
    /// An unknown reference, another type, a mode in which it is not known.
    pub fn get(&mut self, references: &[u32], kind: FieldKind, words: &mut [u64]) -> Result<(), Refusal> {
        for (reference, word) in references.iter().zip(words) {
            let variable = self.find(*reference, kind)?;
            let place = variable.place;
            if variable.causality == Causality::Output && self.state.mode == Mode::Instantiated {
                return Err(Refusal::new(format!(
                    "{} is not known before the initialization mode",
                    variable.name
                )));
            }
            if variable.causality == Causality::Output {
                self.begin()?;
            }
            *word = self.value(place);
        }
        Ok(())
    }

    fn value(&self, place: Place) -> u64 {
        let state = &self.state;
        match place {
            Place::Time => self.time_s().to_bits(),
            Place::Parameter(index) => state.now[index].unwrap_or_default(),
            Place::Token(channel, field) => state.tokens.word(channel, field),
            Place::TrackingError => {
                let demand: Demand = state.tokens.get(state.tick);
                let truth: Truth = state.tokens.get(state.tick);
                (demand.reference_m - truth.displacement_m).to_bits()
            }
        }
    }

    /// Where it is, in the simulation's time.
    pub fn time_s(&self) -> f64 {
        self.state.start_time_s + self.state.tick as f64 * self.scenario.tick_s
    }

    /// Sets variables: all, or none if one is refused.
    ///
    /// # Errors
    /// An unknown reference, another type, a value that is no number, a mode in which it cannot be set.
    pub fn set(&mut self, references: &[u32], kind: FieldKind, words: &[u64]) -> Result<(), Refusal> {
        let mut places = Vec::with_capacity(references.len());
        for (reference, word) in references.iter().zip(words) {
            let variable = self.find(*reference, kind)?;
            self.refuse_setting(variable, *word)?;
            places.push((variable.place, *word));
        }
        let before = (self.state.mode == Mode::Step && places.iter().any(|(place, _)| is_parameter(*place)))
            .then(|| self.state.clone());
        for (place, word) in places {
            match place {
                Place::Token(channel, field) => self.state.tokens.set_word(channel, field, word),
                Place::Parameter(index) => {
                    if let Err(refusal) = self.set_parameter(index, word) {
                        self.state = before.unwrap_or_else(|| self.state.clone());
                        return Err(refusal);
                    }
                }
                Place::Time | Place::TrackingError => (),
            }
        }
        Ok(())
    }

    fn refuse_setting(&self, variable: &Variable, word: u64) -> Result<(), Refusal> {
        let (mode, name) = (self.state.mode, &variable.name);
        let early = matches!(mode, Mode::Instantiated | Mode::Initialization);
        let settable = match variable.causality {
            Causality::Independent | Causality::Output => {
                return Err(Refusal::new(format!("{name} is computed and cannot be set")));
            }
            Causality::Parameter { tunable } => early || tunable && mode == Mode::Step,
            Causality::Input => mode != Mode::Terminated,
        };
        if !settable {
            return Err(Refusal::new(format!("{name} cannot be set in the {}", mode.name())));
        }
        if variable.kind == FieldKind::F64 && !f64::from_bits(word).is_finite() {
            let (value, unit) = (f64::from_bits(word), &variable.unit);
            let said = format!("{value} {unit}");
            return Err(Refusal::new(format!("{name} = {} must be finite", said.trim())));
        }
        Ok(())
    }

    fn set_parameter(&mut self, index: usize, word: u64) -> Result<(), Refusal> {
        let state = &mut self.state;
        if state.mode != Mode::Step {
            state.at_start[index] = Some(word);
            state.now[index] = Some(word);
            // Whatever was built was built with another value.
            state.unit = None;
            return Ok(());
        }
        let parameter = &PARAMETERS[index];
        let (Some(set), Some(unit)) = (parameter.tunable, &state.unit) else {
            return Ok(());
        };
        if state.now[index] == Some(word) {
            return Ok(());
        }
        let change = Change {
            tick: unit.undecided(state.tick),
            set,
            value: f64::from_bits(word),
        };
        state.changes.push(change);
        state.now[index] = Some(word);
        let refused = self.scenario_now().validate();
        refused.map_err(|invalid| Refusal::new(invalid.to_string()))?;
        if !self.state.unit.as_mut().is_some_and(|unit| unit.change(&change)) {
            return Err(Refusal::new(format!(
                "{change}: there is no room for more changes, or nothing takes it"
            )));
        }
        Ok(())
    }

    /// From `point_s` on by `step_s`. The time that is reached.
    ///
    /// # Errors
    /// Another mode, a step that is no whole number of ticks, a time at which this instance is not.
    pub fn step(&mut self, point_s: f64, step_s: f64) -> Result<f64, Refusal> {
        if self.state.mode != Mode::Step {
            let mode = self.state.mode.name();
            return Err(Refusal::new(format!(
                "a step cannot be done in the {mode}: it follows the initialization mode"
            )));
        }
        let tick_s = self.scenario.tick_s;
        let ticks = (step_s / tick_s).round();
        if !((1.0..=MAX_TICKS).contains(&ticks) && (step_s / tick_s - ticks).abs() <= STEP_WITHIN * ticks.max(1.0)) {
            return Err(Refusal::new(format!(
                "a step of {step_s} s is not a whole number of ticks of {tick_s} s, at least one"
            )));
        }
        let now_s = self.time_s();
        let apart_s = (point_s - now_s).abs();
        if apart_s.is_nan() || apart_s > TIME_WITHIN * tick_s {
            return Err(Refusal::new(format!(
                "a step from {point_s} s cannot be done: this instance is at {now_s} s"
            )));
        }
        let State {
            unit: Some(unit),
            tokens,
            tick,
            ..
        } = &mut self.state
        else {
            return Err(Refusal::new("the instance has not begun"));
        };
        for _ in 0..ticks as u64 {
            unit.advance(*tick, tokens);
            *tick += 1;
        }
        Ok(self.time_s())
    }
}

fn is_parameter(place: Place) -> bool {
    matches!(place, Place::Parameter(_))
}

const fn type_name(kind: FieldKind) -> &'static str {
    match kind {
        FieldKind::F64 => "Float64",
        FieldKind::U64 => "UInt64",
    }
}
