//! Settings of the scenario that an FMU has as parameters. Those that a run can be tuned by can be changed between two steps, too, and go
//! to their new value as there: see `docs/running.md`.

use crate::kind::Kind;
use anhyst_ipc::{Change, FieldKind, Tunable};
use anhyst_scenario::Scenario;

/// One of them.
pub struct Parameter {
    /// Its path in the scenario.
    pub name: &'static str,
    /// One sentence.
    pub doc: &'static str,
    /// As in messages.
    pub unit: &'static str,
    pub kind: FieldKind,
    /// It can be changed while the simulation goes on.
    pub tunable: Option<Tunable>,
    of: fn(Kind) -> bool,
    /// Its bits in a scenario; none where there is no such setting.
    get: fn(&Scenario) -> Option<u64>,
    set: fn(&mut Scenario, u64),
}

/// All of them. Their place here is their value reference: new ones go to the end.
pub const PARAMETERS: [Parameter; 9] = [
    Parameter {
        name: "seed",
        doc: "Seed of all noise.",
        unit: "",
        kind: FieldKind::U64,
        tunable: None,
        of: Kind::has_plant,
        get: |scenario| Some(scenario.seed),
        set: |scenario, word| scenario.seed = word,
    },
    Parameter {
        name: "plant.sensors.displacement_noise_m",
        doc: "Standard deviation of the displacement sensor's noise.",
        unit: "m",
        kind: FieldKind::F64,
        tunable: None,
        of: Kind::has_plant,
        get: |scenario| Some(scenario.plant.sensors.displacement_noise_m.to_bits()),
        set: |scenario, word| scenario.plant.sensors.displacement_noise_m = f64::from_bits(word),
    },
    Parameter {
        name: "plant.sensors.field_noise_a_per_m",
        doc: "Standard deviation of the field sensor's noise.",
        unit: "A/m",
        kind: FieldKind::F64,
        tunable: None,
        of: Kind::has_plant,
        get: |scenario| Some(scenario.plant.sensors.field_noise_a_per_m.to_bits()),
        set: |scenario, word| scenario.plant.sensors.field_noise_a_per_m = f64::from_bits(word),
    },
    Parameter {
        name: "controller.feedback.kp",
        doc: "Proportional gain of the feedback, metres of demand per metre of error.",
        unit: "",
        kind: FieldKind::F64,
        tunable: Some(Tunable::Kp),
        of: Kind::has_controller,
        get: |scenario| scenario.controller.feedback.as_ref().map(|pid| pid.kp.to_bits()),
        set: |scenario, word| {
            if let Some(pid) = &mut scenario.controller.feedback {
                pid.kp = f64::from_bits(word);
            }
        },
    },
    Parameter {
        name: "controller.feedback.ki_per_s",
        doc: "Integral gain of the feedback.",
        unit: "1/s",
        kind: FieldKind::F64,
        tunable: Some(Tunable::KiPerS),
        of: Kind::has_controller,
        get: |scenario| scenario.controller.feedback.as_ref().map(|pid| pid.ki_per_s.to_bits()),
        set: |scenario, word| {
            if let Some(pid) = &mut scenario.controller.feedback {
                pid.ki_per_s = f64::from_bits(word);
            }
        },
    },
    Parameter {
        name: "controller.feedback.kd_s",
        doc: "Derivative gain of the feedback.",
        unit: "s",
        kind: FieldKind::F64,
        tunable: Some(Tunable::KdS),
        of: Kind::has_controller,
        get: |scenario| scenario.controller.feedback.as_ref().map(|pid| pid.kd_s.to_bits()),
        set: |scenario, word| {
            if let Some(pid) = &mut scenario.controller.feedback {
                pid.kd_s = f64::from_bits(word);
            }
        },
    },
    Parameter {
        name: "controller.trajectory.amplitude",
        doc: "How many times the stated trajectory; reached 0.1 s after it was set.",
        unit: "",
        kind: FieldKind::F64,
        tunable: Some(Tunable::Amplitude),
        of: Kind::has_controller,
        get: |scenario| Some(changed(scenario, Tunable::Amplitude, 1.0)),
        set: |scenario, word| change_at_start(scenario, Tunable::Amplitude, word),
    },
    Parameter {
        name: "controller.learning.on",
        doc: "What repeats is learned and heard (1), or faded out and held (0).",
        unit: "",
        kind: FieldKind::F64,
        tunable: Some(Tunable::Learning),
        of: Kind::has_controller,
        get: |scenario| {
            let own = scenario.controller.learning.as_ref();
            own.map(|_| changed(scenario, Tunable::Learning, 1.0))
        },
        set: |scenario, word| change_at_start(scenario, Tunable::Learning, word),
    },
    Parameter {
        name: "controller.learning.gain",
        doc: "The part of the error that a step of the learner takes away.",
        unit: "",
        kind: FieldKind::F64,
        tunable: Some(Tunable::LearningGain),
        of: Kind::has_controller,
        get: |scenario| scenario.controller.learning.as_ref().map(|own| own.gain.to_bits()),
        set: |scenario, word| {
            if let Some(own) = &mut scenario.controller.learning {
                own.gain = f64::from_bits(word);
            }
        },
    },
];

impl Parameter {
    /// Its bits in a scenario; none if a part of this kind, or this scenario, has none.
    pub fn start(&self, kind: Kind, scenario: &Scenario) -> Option<u64> {
        (self.of)(kind).then(|| (self.get)(scenario)).flatten()
    }

    /// Sets it before the start.
    pub fn set(&self, scenario: &mut Scenario, word: u64) {
        (self.set)(scenario, word);
    }
}

/// What the scenario changes at its start, or `stated`.
fn changed(scenario: &Scenario, set: Tunable, stated: f64) -> u64 {
    let mut own = scenario.changes.iter().filter(|own| own.set == set && own.tick == 0);
    own.next_back().map_or(stated, |own| own.value).to_bits()
}

/// What has no place in a scenario is changed at tick 0.
fn change_at_start(scenario: &mut Scenario, set: Tunable, word: u64) {
    scenario.changes.retain(|own| own.set != set || own.tick != 0);
    let value = f64::from_bits(word);
    scenario.changes.insert(0, Change { tick: 0, set, value });
}
