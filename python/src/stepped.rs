//! The loop stepped by whoever holds it, whole or in its two halves.

use crate::refusal::refused;
use crate::scenario::Scenario;
use crate::tokens::{Columns, one};
use anhyst_ipc::{Digest, MAX_FIELDS, Measurement, Message, NodeId, SafeField, combine};
use anhyst_scenario::{Control, Rig, SteppedLoop};
use pyo3::prelude::*;
use pyo3::types::PyDict;

type Told<'py> = PyResult<Bound<'py, PyDict>>;

/// The whole loop of a scenario, tick by tick: amplifier, plant, estimator, controller, inverse, guard. Its tokens have the bits of
/// the scenario's run.
#[pyclass(module = "anhyst")]
pub struct Loop {
    all: SteppedLoop,
    tick: u64,
    ticks: u64,
    tick_s: f64,
    digests: [Digest; NodeId::SENDERS.len()],
}

impl Loop {
    fn next(&mut self) {
        self.all.step(self.tick);
        self.tick += 1;
        for (node, digest) in NodeId::SENDERS.iter().zip(&mut self.digests) {
            let (rig, control) = (&self.all.rig, &self.all.control);
            match node {
                NodeId::Plant => {
                    hear(digest, &rig.measurement);
                    hear(digest, &rig.truth);
                }
                NodeId::Amplifier => hear(digest, &rig.coil_field),
                NodeId::Estimator => hear(digest, &control.estimate),
                NodeId::Controller => hear(digest, &control.demand),
                NodeId::Inverse => hear(digest, &control.field_command),
                NodeId::Guard => hear(digest, &control.safe_field),
                NodeId::Recorder => {}
            }
        }
    }
}

fn hear<M: Message>(digest: &mut Digest, token: &M) {
    let mut words = [0; MAX_FIELDS];
    token.write_words(&mut words);
    digest.add(token.tick(), &words[..M::FIELDS.len()]);
}

/// Calls for each channel of the loop, with its last token.
macro_rules! each_channel {
    ($loop:expr, $do:ident) => {
        $do!(measurement, $loop.rig.measurement);
        $do!(truth, $loop.rig.truth);
        $do!(estimate, $loop.control.estimate);
        $do!(demand, $loop.control.demand);
        $do!(field_command, $loop.control.field_command);
        $do!(safe_field, $loop.control.safe_field);
        $do!(coil_field, $loop.rig.coil_field);
    };
}

#[pymethods]
impl Loop {
    #[new]
    fn new(scenario: &Scenario) -> PyResult<Self> {
        Ok(Self {
            all: scenario.block(SteppedLoop::new)?,
            tick: 0,
            ticks: scenario.scenario.ticks(),
            tick_s: scenario.scenario.tick_s,
            digests: Default::default(),
        })
    }

    /// Does one tick; its tokens by channel and field.
    fn step<'py>(&mut self, py: Python<'py>) -> Told<'py> {
        self.next();
        self.tokens(py)
    }

    /// Does so many ticks, or all that are left of the scenario: by channel and field arrays of shape (ticks,). There are no more than
    /// that; `step` goes on beyond the end.
    #[pyo3(signature = (ticks = None))]
    fn run<'py>(&mut self, py: Python<'py>, ticks: Option<u64>) -> Told<'py> {
        let left = self.ticks.saturating_sub(self.tick);
        let ticks = ticks.unwrap_or(left);
        if ticks > left {
            return Err(refused(format!(
                "{ticks} ticks were asked for, and {left} of the scenario's {} are left",
                self.ticks
            )));
        }
        let of = usize::try_from(ticks).unwrap_or_default();
        let told = PyDict::new(py);
        let mut all: Vec<(&'static str, Columns)> = Vec::new();
        macro_rules! begin {
            ($channel:ident, $token:expr) => {
                all.push((stringify!($channel), columns_of(&$token, of)))
            };
        }
        each_channel!(self.all, begin);
        let mut done = 0;
        while done < ticks {
            let some = (ticks - done).min(20_000);
            py.detach(|| {
                for _ in 0..some {
                    self.next();
                    let mut columns = all.iter_mut();
                    macro_rules! keep {
                        ($channel:ident, $token:expr) => {
                            if let Some((_, own)) = columns.next() {
                                own.push(&$token);
                            }
                        };
                    }
                    each_channel!(self.all, keep);
                }
            });
            done += some;
            py.check_signals()?;
        }
        for (channel, columns) in all {
            told.set_item(channel, columns.told(py)?)?;
        }
        Ok(told)
    }

    /// The tokens of the last tick by channel and field.
    fn tokens<'py>(&self, py: Python<'py>) -> Told<'py> {
        let told = PyDict::new(py);
        macro_rules! tell {
            ($channel:ident, $token:expr) => {
                told.set_item(stringify!($channel), one(py, &$token)?)?
            };
        }
        each_channel!(self.all, tell);
        Ok(told)
    }

    /// The tick that comes next.
    #[getter]
    fn tick(&self) -> u64 {
        self.tick
    }

    /// Length of a tick, s.
    #[getter]
    fn tick_s(&self) -> f64 {
        self.tick_s
    }

    /// Digest of all tokens so far; at the end that of the scenario's run.
    #[getter]
    fn digest(&self) -> String {
        let nodes = NodeId::SENDERS.iter().zip(&self.digests);
        combine(nodes.map(|(node, digest)| (node.name(), digest.0)))
    }

    fn __repr__(&self) -> String {
        format!("<anhyst.Loop before tick {}, {} s a tick>", self.tick, self.tick_s)
    }

    /// A loop that goes on as this one would.
    fn copy(&self) -> Self {
        Self {
            all: self.all.clone(),
            ..*self
        }
    }
}

fn columns_of<M: Message>(_token: &M, tokens: usize) -> Columns {
    Columns::of::<M>(tokens)
}

/// What is in the machine: amplifier and plant of a scenario, for a controller of one's own. There is no guard in it: the scenario's
/// limits hold nothing here.
#[pyclass(module = "anhyst")]
pub struct Plant {
    rig: Rig,
    tick: u64,
    tick_s: f64,
}

#[pymethods]
impl Plant {
    /// At rest at tick 0, measured.
    #[new]
    fn new(scenario: &Scenario) -> PyResult<Self> {
        let mut rig = scenario.block(Rig::new)?;
        rig.measure(0);
        Ok(Self {
            rig,
            tick: 0,
            tick_s: scenario.scenario.tick_s,
        })
    }

    /// Gives the amplifier the field (A/m, or the unit of the scenario's input) of this tick and goes to the next: what is measured
    /// there, as the scenario's output (m). What is commanded here is in the coil at the end of the tick after the next.
    fn step(&mut self, field_a_per_m: f64) -> PyResult<f64> {
        if !field_a_per_m.is_finite() {
            return Err(refused(format!("the field, {field_a_per_m}, must be finite")));
        }
        let mut safe = SafeField {
            field_a_per_m,
            ..SafeField::default()
        };
        safe.stamp(self.tick, 0);
        self.rig.act(self.tick, safe);
        self.tick += 1;
        self.rig.measure(self.tick);
        Ok(self.rig.measurement.displacement_m)
    }

    /// What the sensors say now, by field.
    #[getter]
    fn measurement<'py>(&self, py: Python<'py>) -> Told<'py> {
        one(py, &self.rig.measurement)
    }

    /// What is really so now, by field.
    #[getter]
    fn truth<'py>(&self, py: Python<'py>) -> Told<'py> {
        one(py, &self.rig.truth)
    }

    /// What the amplifier said last, by field.
    #[getter]
    fn coil_field<'py>(&self, py: Python<'py>) -> Told<'py> {
        one(py, &self.rig.coil_field)
    }

    /// The present tick.
    #[getter]
    fn tick(&self) -> u64 {
        self.tick
    }

    /// Length of a tick, s.
    #[getter]
    fn tick_s(&self) -> f64 {
        self.tick_s
    }

    fn __repr__(&self) -> String {
        format!("<anhyst.Plant before tick {}, {} s a tick>", self.tick, self.tick_s)
    }

    /// A plant that goes on as this one would.
    fn copy(&self) -> Self {
        Self {
            rig: self.rig.clone(),
            ..*self
        }
    }
}

/// What commands: estimator, controller, inverse and guard of a scenario, for a plant of one's own.
#[pyclass(module = "anhyst")]
pub struct Controller {
    control: Control,
    tick: u64,
    tick_s: f64,
}

#[pymethods]
impl Controller {
    #[new]
    fn new(scenario: &Scenario) -> PyResult<Self> {
        Ok(Self {
            control: scenario.block(Control::new)?,
            tick: 0,
            tick_s: scenario.scenario.tick_s,
        })
    }

    /// Answers what was measured at this tick (displacement in m, coil's field in A/m, temperature in K; 0 where there is no sensor)
    /// with the field (A/m) for the amplifier, and goes to the next tick. What is not finite is the guard's to answer, with the safe
    /// field: `safe_field` says so.
    #[pyo3(signature = (displacement_m, coil_field_a_per_m = 0.0, temperature_k = 0.0))]
    fn step(&mut self, displacement_m: f64, coil_field_a_per_m: f64, temperature_k: f64) -> f64 {
        let mut measurement = Measurement {
            displacement_m,
            coil_field_a_per_m,
            temperature_k,
            ..Measurement::default()
        };
        measurement.stamp(self.tick, 0);
        self.control.step(self.tick, measurement);
        self.tick += 1;
        self.control.safe_field.field_a_per_m
    }

    /// What the estimator said last, by field.
    #[getter]
    fn estimate<'py>(&self, py: Python<'py>) -> Told<'py> {
        one(py, &self.control.estimate)
    }

    /// What the controller said last, by field.
    #[getter]
    fn demand<'py>(&self, py: Python<'py>) -> Told<'py> {
        one(py, &self.control.demand)
    }

    /// What the inverse said last, by field.
    #[getter]
    fn field_command<'py>(&self, py: Python<'py>) -> Told<'py> {
        one(py, &self.control.field_command)
    }

    /// What the guard said last, by field.
    #[getter]
    fn safe_field<'py>(&self, py: Python<'py>) -> Told<'py> {
        one(py, &self.control.safe_field)
    }

    /// The tick that comes next.
    #[getter]
    fn tick(&self) -> u64 {
        self.tick
    }

    /// Length of a tick, s.
    #[getter]
    fn tick_s(&self) -> f64 {
        self.tick_s
    }

    fn __repr__(&self) -> String {
        format!(
            "<anhyst.Controller before tick {}, {} s a tick>",
            self.tick, self.tick_s
        )
    }

    /// A controller that goes on as this one would.
    fn copy(&self) -> Self {
        Self {
            control: self.control.clone(),
            ..*self
        }
    }
}
