//! The scenario as text, with a comment where a number may be wanted otherwise.

use super::amount::{ron, round};
use super::plan::{Adaptation, Plan};
use super::{Actuator, Wish};
use anhyst_controller::PidSettings;
use anhyst_report::number::Si;

/// Of its limit: noise of the monitor of a coil's field.
const FIELD_NOISE: f64 = 1.0 / 30_000.0;

pub(super) fn scenario(
    wish: &Wish,
    actuator: &Actuator,
    plan: &Plan,
    feedback: Option<&PidSettings>,
    tolerance: Option<f64>,
) -> String {
    let [input, output] = actuator.units();
    let law = actuator.of_law();
    let holds = tolerance.map_or(String::new(), |tolerance| {
        format!(
            "// Must hold: every error within {} after {} s, 1.5 times what is reached.\n",
            Si(tolerance, output),
            ron(plan.settling_s)
        )
    });
    let of_input = if input.is_empty() {
        "the unit that its input was measured in"
    } else {
        input
    };
    let units = if law {
        format!(
            "// A material with a hysteresis law has its units: what is called a field is in {of_input}, what is called a displacement in {output}.\n"
        )
    } else {
        String::new()
    };
    let resonance_hz = actuator.rod.natural_frequency_hz();
    let amplifier = amplifier(actuator, plan);
    let field_noise = if law { 0.0 } else { round(FIELD_NOISE * plan.limit, 2) };
    let plant = match &actuator.plant_ron {
        Some(file) => {
            format!("// What is really there; on a rig of yours nobody knows it.\n        material_file: {file},")
        }
        None if law => {
            "// As believed; material_file: \"FILE\", a law.ron of `anhyst fit`, puts another law there.".into()
        }
        None => format!(
            "// What is really there: as believed, but for `a`, from which the estimator begins a few percent away.\n        shape: Constant(a_per_m: {}),",
            ron(actuator.model.material.hysteresis.shape_a_per_m)
        ),
    };
    let estimator = match &plan.adaptation {
        None => "// The law's weights are adapted while it runs; FixedWeights leaves them as they were fitted.\n    estimator: (law: Weights()),".into(),
        Some(own) => estimator(own, plan.noise),
    };
    let feedback = feedback.map_or(String::new(), |pid| {
        format!(
            "        // From the margins: the largest sensitivity Ms is at most 2; `anhyst check` shows them.\n        feedback: (kp: {}, ki_per_s: {}),\n",
            ron(pid.kp),
            ron(pid.ki_per_s)
        )
    });
    let learning = match plan.harmonics {
        Some(harmonics) => format!(
            "        // Takes what repeats and no model has, up to beyond the resonance.\n        learning: (harmonics: {harmonics}),\n"
        ),
        None => "        // On a rig that the model errs about: learning: (), and estimator.law.adaptation_rate_per_s: 50.0\n".into(),
    };
    let lowest = plan
        .lowest
        .map_or(String::new(), |own| format!(", lowest_field_a_per_m: {}", ron(own)));
    let expect = tolerance.map_or(String::new(), |tolerance| format!("tolerance_m: {}, ", ron(tolerance)));
    format!(
        "// {}: {} of {} at {}.\n{units}{holds}(
    name: \"{}\",
    seed: 1,
    // {} samples in a period of the resonance at {}.
    tick_s: {},
    duration_s: {},
    clock: Lockstep(receive_limit_s: 2.0),
    placement: Separate,
    // What the controller's side believes; `anhyst fit` writes such files from measured loops.
    material: {},
    rod: {},
    amplifier: {amplifier},
    plant: (
        {plant}
        sensors: (displacement_noise_m: {}, field_noise_a_per_m: {}),
    ),
    {estimator}
    inverse: (structure: FromEstimate),
    controller: (
        trajectory: {},
        // A smooth way from rest into it.
        start_s: {},
{feedback}{learning}    ),
    // No more than this leaves the guard, whatever is asked for.
    guard: (field_limit_a_per_m: {}{lowest}),
    expect: ({expect}settling_s: {}),
)
",
        actuator.words,
        wish.profile().words(),
        Si(plan.stroke, output),
        Si(plan.frequency_hz, "Hz"),
        wish.name,
        round(1.0 / (resonance_hz * plan.tick_s), 3),
        Si(resonance_hz, "Hz"),
        ron(round(plan.tick_s, 12)),
        ron(plan.duration_s),
        actuator.material_ron,
        actuator.rod_ron,
        ron(plan.noise),
        ron(field_noise),
        wish.profile().trajectory(plan.stroke, plan.mean, plan.frequency_hz),
        ron(plan.start_s),
        ron(plan.limit),
        ron(plan.settling_s),
    )
}

/// That of a model is the scenario's, too.
fn amplifier(actuator: &Actuator, plan: &Plan) -> String {
    let own = &actuator.model.amplifier;
    let parts = [
        plan.bandwidth_hz.map(|value| format!("bandwidth_hz: {}", ron(value))),
        own.field_limit_a_per_m
            .map(|value| format!("field_limit_a_per_m: {}", ron(value))),
        own.slew_limit_a_per_m_s
            .map(|value| format!("slew_limit_a_per_m_s: {}", ron(value))),
        (plan.delay_ticks > 0).then(|| format!("delay_ticks: {}", plan.delay_ticks)),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    format!("({})", parts.join(", "))
}

fn estimator(own: &Adaptation, noise: f64) -> String {
    format!(
        "// `a` is adapted within this range; the other numbers follow the material, the stroke and the noise.
    estimator: (
        law: Folded(
            range_a_per_m: ({}, {}),
            start_a_per_m: {},
            window_a_per_m: {},
            dead_zone_m: {},
            sensitivity_m_per_a_per_m: {},
        ),
        excitation: (noise_m: {}, worst_deviation_a_per_m: {}),
    ),",
        ron(own.range_a_per_m.0),
        ron(own.range_a_per_m.1),
        ron(own.start_a_per_m),
        ron(own.window_a_per_m),
        ron(own.dead_zone_m),
        ron(own.sensitivity_m_per_a_per_m),
        ron(noise),
        ron(own.worst_deviation_a_per_m),
    )
}
