//! From a wish to a scenario that holds: `anhyst new`.
//!
//! Numbers follow from the actuator ([`plan`]), gains from the loop's margins, and what must hold from a run of the very scenario:
//! 1.5 times its largest error.

mod actuator;
pub mod amount;
mod motion;
mod plan;
mod presets;
mod text;
mod wish;

pub use actuator::Actuator;
pub use motion::Profile;
pub use presets::PRESETS;
pub use wish::Wish;

use amount::{round, round_up};
use anhyst_controller::PidSettings;
use anhyst_launch::embedded::judged;
use anhyst_launch::error::RunError;
use anhyst_launch::summary::Summary;
use anhyst_model::RodConstants;
use anhyst_report::number::Si;
use anhyst_scenario::{Placement, Scenario, ScenarioText};
use miette::miette;
use plan::{Plan, ticks_of};
use std::path::Path;

/// The house's distance of a tolerance from what is reached.
const TOLERANCE: f64 = 1.5;
/// Of the stroke: a tolerance beyond says that the motion is not followed.
const LARGEST_TOLERANCE: f64 = 0.25;
/// A limit that nobody asked for is doubled so often, until the guard does not act.
const DOUBLINGS: u32 = 3;

/// A scenario and what it came to.
pub struct Design {
    /// As it is written.
    pub text: String,
    pub scenario: Scenario,
    pub error_rms: f64,
    pub error_max: f64,
    pub ticks_per_s: f64,
    /// What neither the wish says nor the actuator is known by, with the options that say it.
    pub assumed: Vec<String>,
}

/// See [`Design::assumed`].
fn assumed(wish: &Wish, actuator: &Actuator, plan: &Plan) -> Vec<String> {
    let [input, output] = actuator.units();
    let unknown = actuator.preset.is_none() && actuator.of_law();
    let resonance = Si(actuator.rod.natural_frequency_hz(), "Hz");
    let noise = Si(plan.noise, output);
    let of_rod = !actuator.of_law() && actuator.model.rod.is_none();
    let paper = RodConstants::paper();
    let data_end = actuator.data_end().filter(|end| plan.limit > *end);
    let data_end = data_end.map_or_else(String::new, |end| {
        format!("; its law was fitted to inputs up to {}", Si(end, input))
    });
    let of_data = actuator.noise_rms.map_or("", |_| ", that of the law's data");
    let all = [
        (
            unknown && wish.plant.is_none(),
            "a plant that is this very law (--plant names another)".into(),
        ),
        (
            wish.stroke.is_none(),
            format!("a stroke of {} (--stroke)", Si(plan.stroke, output)),
        ),
        (
            wish.frequency.is_none(),
            format!("a motion that repeats at {} (--frequency)", Si(plan.frequency_hz, "Hz")),
        ),
        (
            wish.profile.is_none(),
            format!("{} (--profile)", wish.profile().words()),
        ),
        (
            wish.rate.is_none(),
            format!("a loop at {} (--rate)", Si(round(1.0 / plan.tick_s, 6), "Hz")),
        ),
        (
            wish.noise.is_none(),
            format!("a sensor's noise of {noise} rms{of_data} (--noise)"),
        ),
        (
            wish.limit.is_none(),
            format!("no more than {} (--limit){data_end}", Si(plan.limit, input)),
        ),
        (
            plan.lowest.is_some(),
            format!(
                "no less than {} (guard.lowest_field_a_per_m)",
                Si(plan.lowest.unwrap_or_default(), input)
            ),
        ),
        (
            of_rod && wish.length.is_none(),
            format!("a rod of {} (--length)", Si(paper.length_m, "m")),
        ),
        (
            of_rod && wish.diameter.is_none(),
            format!("its diameter, {} (--diameter)", Si(paper.diameter_m, "m")),
        ),
        (
            of_rod && wish.mass.is_none(),
            format!("what it moves, {} kg (--mass)", paper.end_mass_kg),
        ),
        (
            actuator.of_law() && wish.resonance.is_none(),
            format!("a resonance at {resonance} (--resonance)"),
        ),
        (
            actuator.of_law() && wish.damping.is_none(),
            format!(
                "its damping ratio, {} (--damping)",
                round(actuator.rod.damping_ratio(), 3)
            ),
        ),
        (
            unknown && plan.bandwidth_hz.is_none(),
            "an amplifier without a lag (--bandwidth)".into(),
        ),
        (
            wish.bandwidth.is_none() && plan.bandwidth_hz == actuator.lag_bandwidth_hz() && plan.bandwidth_hz.is_some(),
            format!(
                "the lag of {} that the law's data told, as the amplifier's: it ends at {} (--bandwidth)",
                Si(actuator.reaction.lag_s, "s"),
                Si(plan.bandwidth_hz.unwrap_or_default(), "Hz")
            ),
        ),
        (actuator.reaction.delay_s > 0.0, delay(actuator, plan)),
    ];
    all.into_iter().filter_map(|(is, words)| is.then_some(words)).collect()
}

/// What became of the delay that a law's data told.
fn delay(actuator: &Actuator, plan: &Plan) -> String {
    let delay_s = actuator.reaction.delay_s;
    let told = format!("the delay of {} that the law's data told", Si(delay_s, "s"));
    match ticks_of(delay_s, plan.tick_s) {
        Ok(0) => format!("{told} is less than half a tick: the loop has nothing of it"),
        Ok(ticks) => format!("{told}, as the amplifier's: {ticks} ticks (amplifier.delay_ticks)"),
        Err(error) => format!("nothing of {told}, for {error}: the rig will answer later than this loop"),
    }
}

/// Gains in front of the margins: an integrator alone where the resonance rings.
fn gains(actuator: &Actuator) -> PidSettings {
    let rate_per_s = std::f64::consts::TAU * actuator.rod.natural_frequency_hz();
    let damping = actuator.rod.damping_ratio();
    let (kp, ki_per_s) = if damping < 0.3 {
        (0.0, 0.64 * damping * rate_per_s)
    } else {
        (0.3, 0.25 * rate_per_s)
    };
    PidSettings {
        kp,
        ki_per_s,
        ..PidSettings::default()
    }
}

/// Whether a wish can be had, as far as it shows without a run.
///
/// # Errors
/// The first option that cannot, with its limit.
pub fn possible(wish: &Wish, file: &Path) -> miette::Result<()> {
    planned(wish, file).map(drop)
}

fn planned(wish: &Wish, file: &Path) -> miette::Result<(Actuator, Plan)> {
    let actuator = Actuator::of(wish, file.parent().unwrap_or(Path::new("")))?;
    let plan = Plan::of(wish, &actuator)?;
    Ok((actuator, plan))
}

/// Designs the scenario that will stand in `file`.
///
/// # Errors
/// A wish that cannot be had, with the limit.
pub fn design(wish: &Wish, file: &Path) -> miette::Result<Design> {
    let (actuator, mut plan) = planned(wish, file)?;
    let read = |text: String| {
        let embed = |scenario: &mut Scenario| {
            scenario.placement = Placement::Embedded;
            scenario.recording.on = false;
        };
        ScenarioText::of(file, text).checked(embed)
    };
    let mut open = read(text::scenario(wish, &actuator, &plan, None, None))?;
    open.controller.feedback = Some(gains(&actuator));
    open.soften_feedback(&[]).map_err(RunError::from)?;
    let feedback = open.controller.feedback.map(|pid| PidSettings {
        kp: round(pid.kp, 2),
        // Down, not up: the margin was just met.
        ki_per_s: round(0.98 * pid.ki_per_s, 2),
        ..pid
    });
    for doubling in 0..=DOUBLINGS {
        let trial = read(text::scenario(wish, &actuator, &plan, feedback.as_ref(), None))?;
        let summary = Summary::new(&trial, &judged(&trial)?);
        let verdict = &summary.verdict;
        let [input, output] = actuator.units();
        if verdict.guarded_ticks > 0 && !plan.limit_given && doubling < DOUBLINGS {
            plan.limit *= 2.0;
            plan.lowest = plan.lowest.map(|lowest| 2.0 * lowest);
            continue;
        }
        let between = verdict.between.map_or(0.0, |between| between.max_m);
        let error_max = verdict.error_max_m.max(between);
        let tolerance = round_up(TOLERANCE * error_max, 2);
        if verdict.guarded_ticks > 0 {
            let event = summary
                .first_event_name
                .clone()
                .unwrap_or_else(|| "the limit was met".into());
            return Err(miette!(
                "the guard had to act in {} ticks ({event}) with a limit of {}: ask for a smaller --stroke, a lower --frequency or a higher --limit",
                verdict.guarded_ticks,
                Si(plan.limit, input)
            ));
        }
        // No number is no tolerance, either.
        if tolerance.is_nan() || tolerance > LARGEST_TOLERANCE * plan.stroke {
            return Err(miette!(
                "the best loop found is off by up to {} of a stroke of {}: ask for a lower --frequency, less --noise or another --profile",
                Si(error_max, output),
                Si(plan.stroke, output)
            ));
        }
        let text = text::scenario(wish, &actuator, &plan, feedback.as_ref(), Some(tolerance));
        return Ok(Design {
            scenario: read(text.clone())?,
            text,
            error_rms: verdict.error_rms_m,
            error_max,
            ticks_per_s: summary.ticks_per_s,
            assumed: assumed(wish, &actuator, &plan),
        });
    }
    unreachable!("the last doubling returns")
}
