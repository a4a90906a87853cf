//! Numbers that follow from a wish and its actuator; a wish that cannot be had is refused with the limit.

use super::amount::{nice_down, nice_up, round};
use super::{Actuator, Wish};
use anhyst_controller::StrainLaw;
use anhyst_model::{AmplifierConstants, MagneticState, ModelError};
use anhyst_report::number::Si;
use miette::miette;

/// Of what the actuator gives: the rest is for feedback and for a model that errs.
const OF_RANGE: f64 = 0.9;
/// Of the resonance: what the motion still has there.
const OF_RESONANCE: f64 = 0.5;
/// Samples in a period of the busiest part of a motion.
const SAMPLES: f64 = 20.0;
/// From here on a resonance does not ring.
const WELL_DAMPED: f64 = 0.7;
/// Samples in a period of a resonance that rings, and that does not: what is taken, and the least that may be asked for.
const RINGING: [f64; 2] = [15.0, 8.0];
const QUIET: [f64; 2] = [10.0, 5.0];
/// A run of more takes minutes.
const MOST_TICKS: f64 = 2e7;
/// Of the largest input that a law was fitted to: how far beyond a loop may go, and how far below 0 where the data do not go. Makers
/// of piezo stacks permit −20 to 120 of 100 V.
const BEYOND_DATA: f64 = 0.2;
/// More makes nothing but noise.
const NOISIEST: f64 = 0.05;

/// In the units of the actuator.
pub struct Plan {
    pub stroke: f64,
    pub mean: f64,
    pub frequency_hz: f64,
    pub tick_s: f64,
    pub start_s: f64,
    pub settling_s: f64,
    pub duration_s: f64,
    pub noise: f64,
    /// Of the amplifier: a model's own, or what a law's data told.
    pub delay_ticks: u32,
    pub bandwidth_hz: Option<f64>,
    pub limit: f64,
    /// The lowest input, of a law whose data do not go below 0.
    pub lowest: Option<f64>,
    /// The limit was asked for.
    pub limit_given: bool,
    pub adaptation: Option<Adaptation>,
    /// Of a material with another law: harmonics that are learned.
    pub harmonics: Option<u32>,
}

/// How `a` is estimated.
pub struct Adaptation {
    pub range_a_per_m: (f64, f64),
    pub start_a_per_m: f64,
    pub window_a_per_m: f64,
    pub dead_zone_m: f64,
    pub sensitivity_m_per_a_per_m: f64,
    pub worst_deviation_a_per_m: f64,
}

impl Plan {
    /// # Errors
    /// A wish that cannot be had.
    pub fn of(wish: &Wish, actuator: &Actuator) -> miette::Result<Self> {
        let [input, output] = actuator.units();
        let limit = wish.number("--limit", &wish.limit, input)?;
        let stroke = wish
            .number("--stroke", &wish.stroke, output)?
            .unwrap_or_else(|| actuator.usual_stroke());
        let [low, high] = actuator.gives(limit);
        let most = OF_RANGE * (high - low);
        if stroke > most {
            let longer = actuator.length_for(1.02 * stroke / most).filter(|_| limit.is_none());
            let remedy = match longer {
                Some(length_m) => format!(", or a longer rod: --length {}mm", round(1e3 * length_m, 3)),
                None if actuator.of_law() => ", or fit the law of a larger one: anhyst fit".to_owned(),
                None => String::new(),
            };
            // Beyond what a law was fitted to no limit brings more.
            let data_ends = actuator.data_end().filter(|end| limit.is_none_or(|limit| limit > *end));
            let within = match (data_ends, limit) {
                (Some(end), _) => format!(
                    "within the inputs that its law was fitted to, up to {},",
                    Si(end, input)
                ),
                (None, Some(limit)) => format!("with {}", Si(limit, input)),
                (None, None) => "at 90 % of saturation".into(),
            };
            return Err(miette!(
                "--stroke {}: {within} the actuator goes from {} to {}; ask for at most {}{remedy}",
                Si(stroke, output),
                Si(low, output),
                Si(high, output),
                Si(round(0.999 * most, 3), output)
            ));
        }
        let centred = low <= -0.55 * stroke && high >= 0.55 * stroke;
        let mean = if centred { 0.0 } else { round(0.5 * (low + high), 4) };
        let bandwidth_hz = wish.number("--bandwidth", &wish.bandwidth, "Hz")?;
        let usual_bandwidth = actuator.preset.and_then(|preset| preset.bandwidth_hz);
        let bandwidth_hz = bandwidth_hz
            .or(actuator.model.amplifier.bandwidth_hz)
            .or(usual_bandwidth)
            .or(actuator.lag_bandwidth_hz());
        let frequency_hz = frequency(wish, actuator, bandwidth_hz)?;
        let tick_s = 1.0 / rate(wish, actuator, frequency_hz)?;
        let noise = wish
            .number("--noise", &wish.noise, output)?
            .or(actuator.noise_rms.map(|rms| round(rms, 3)))
            .unwrap_or_else(|| nice_down(stroke / 8000.0));
        if noise > NOISIEST * stroke {
            return Err(miette!(
                "--noise {}: of a stroke of {} nothing would be left; at most {} can be had",
                Si(noise, output),
                Si(stroke, output),
                Si(NOISIEST * stroke, output)
            ));
        }
        let period_s = 1.0 / frequency_hz;
        let (start_s, settles_s, judged_s) = if actuator.of_law() {
            (5.0 * period_s, 60.0 * period_s, 10.0 * period_s)
        } else {
            (
                (5.0 * period_s).max(0.1),
                (10.0 * period_s).max(0.4),
                (10.0 * period_s).max(0.6),
            )
        };
        let duration_s = start_s + settles_s + judged_s;
        if duration_s > MOST_TICKS * tick_s {
            let least_hz = frequency_hz * duration_s / (MOST_TICKS * tick_s);
            return Err(miette!(
                "--frequency {}: a run would take {:.1e} ticks, {MOST_TICKS:.0e} at most; ask for at least {} or for a lower --rate",
                Si(frequency_hz, "Hz"),
                duration_s / tick_s,
                Si(least_hz, "Hz")
            ));
        }
        let law = actuator.model.material.law.as_ref();
        let lowest = law.filter(|law| law.input_extent[0] >= 0.0);
        let farthest = mean + (0.5 * stroke).copysign(mean);
        let most_input = limit.unwrap_or_else(|| usual_limit(actuator, farthest));
        let natural_hz = actuator.rod.natural_frequency_hz();
        Ok(Self {
            stroke,
            mean,
            frequency_hz,
            tick_s,
            start_s: round(start_s, 4),
            settling_s: round(start_s + settles_s, 4),
            duration_s: round(duration_s, 4),
            noise,
            delay_ticks: actuator
                .model
                .amplifier
                .delay_ticks
                .max(ticks_of(actuator.reaction.delay_s, tick_s).unwrap_or(0)),
            bandwidth_hz,
            limit: most_input,
            lowest: lowest.map(|law| -round(BEYOND_DATA * law.input_extent[1], 3).min(most_input)),
            limit_given: limit.is_some(),
            adaptation: (!actuator.of_law()).then(|| adaptation(actuator, farthest, noise, stroke)),
            harmonics: actuator
                .of_law()
                .then(|| (1.4 * natural_hz / frequency_hz).ceil().clamp(10.0, 200.0) as u32),
        })
    }
}

/// The ticks nearest to a delay.
///
/// # Errors
/// More than an amplifier can have.
pub fn ticks_of(delay_s: f64, tick_s: f64) -> Result<u32, ModelError> {
    let delay_ticks = (delay_s / tick_s).round() as u32;
    let amplifier = AmplifierConstants {
        delay_ticks,
        ..AmplifierConstants::default()
    };
    amplifier.validate().map(|()| delay_ticks)
}

fn frequency(wish: &Wish, actuator: &Actuator, bandwidth_hz: Option<f64>) -> miette::Result<f64> {
    let busiest = wish.profile().busiest();
    let natural_hz = actuator.rod.natural_frequency_hz();
    let most_hz = OF_RESONANCE * natural_hz / busiest;
    let can_hz = bandwidth_hz.map_or(most_hz, |bandwidth_hz| most_hz.min(bandwidth_hz / busiest));
    let usual_hz = actuator.usual_frequency_hz();
    let usual_hz = if usual_hz > can_hz { nice_down(can_hz) } else { usual_hz };
    let frequency_hz = wish.number("--frequency", &wish.frequency, "Hz")?.unwrap_or(usual_hz);
    let refuse = |whose: String, most_hz: f64| {
        let motion = wish.profile().words();
        Err(miette!(
            "--frequency {}: {motion} moves up to {} times as fast, and {whose}; ask for at most {}",
            Si(frequency_hz, "Hz"),
            busiest,
            Si(round(0.999 * most_hz, 3), "Hz")
        ))
    };
    if frequency_hz > most_hz {
        return refuse(
            format!("half of the resonance is at {}", Si(OF_RESONANCE * natural_hz, "Hz")),
            most_hz,
        );
    }
    match bandwidth_hz.map(|bandwidth_hz| (bandwidth_hz, bandwidth_hz / busiest)) {
        Some((bandwidth_hz, most_hz)) if frequency_hz > most_hz => {
            refuse(format!("the amplifier ends at {}", Si(bandwidth_hz, "Hz")), most_hz)
        }
        _ => Ok(frequency_hz),
    }
}

fn rate(wish: &Wish, actuator: &Actuator, frequency_hz: f64) -> miette::Result<f64> {
    let natural_hz = actuator.rod.natural_frequency_hz();
    let [usual, least] = if actuator.rod.damping_ratio() < WELL_DAMPED {
        RINGING
    } else {
        QUIET
    };
    let of_motion_hz = SAMPLES * wish.profile().busiest() * frequency_hz;
    let usual_hz = nice_up((usual * natural_hz).max(of_motion_hz));
    let rate_hz = wish.number("--rate", &wish.rate, "Hz")?.unwrap_or(usual_hz);
    let least_hz = (least * natural_hz).max(of_motion_hz);
    if (least_hz..=1e6).contains(&rate_hz) {
        return Ok(rate_hz);
    }
    Err(miette!(
        "--rate {} is outside [{}, 1 MHz]: {least} samples in a period of the resonance at {}, {SAMPLES} in one of the motion's fastest part",
        Si(rate_hz, "Hz"),
        Si(least_hz, "Hz"),
        Si(natural_hz, "Hz")
    ))
}

/// The input from rest that brings a displacement, A/m.
fn field_for(actuator: &Actuator, displacement: f64) -> f64 {
    let material = &actuator.model.material;
    let asked = StrainLaw::new(&actuator.rod, material).magnetization_a_per_m(displacement);
    let way = material.hysteresis.advance_to_magnetization(
        MagneticState::default(),
        asked,
        1e3 * material.hysteresis.shape_a_per_m,
    );
    way.state.field_a_per_m
}

fn usual_limit(actuator: &Actuator, farthest: f64) -> f64 {
    match actuator.data_end() {
        Some(end) => round((1.0 + BEYOND_DATA) * end, 3),
        None => nice_up(2.5 * field_for(actuator, farthest).abs()),
    }
}

/// As it is for the paper's rod and cut, in proportion.
fn adaptation(actuator: &Actuator, farthest: f64, noise: f64, stroke: f64) -> Adaptation {
    let material = &actuator.model.material;
    let hysteresis = &material.hysteresis;
    let shape = hysteresis.shape_a_per_m;
    // Where the edge would be no material the range is smaller.
    let valid = |share: &f64| hysteresis.with_shape((1.0 - share) * shape).validate().is_ok();
    let below = [0.1, 0.05, 0.02].into_iter().find(valid).unwrap_or(0.005);
    let field = field_for(actuator, farthest).abs();
    let strain = StrainLaw::new(&actuator.rod, material);
    let reached = |factor: f64| {
        let way = hysteresis.with_shape(factor * shape);
        let way = way.advance_to_magnetization(MagneticState::default(), strain.saturation_a_per_m(), field);
        strain.displacement_m(way.state.magnetization_a_per_m)
    };
    let slope = (reached(1.01) - reached(0.99)).abs() / (0.02 * shape);
    Adaptation {
        range_a_per_m: (round((1.0 - below) * shape, 4), round((1.0 + 0.4 * below) * shape, 4)),
        start_a_per_m: round((1.0 - 0.3 * below) * shape, 4),
        window_a_per_m: round(30.0 / 7012.0 * shape, 3),
        dead_zone_m: round((0.2 * noise).max(1e-5 * stroke), 2),
        sensitivity_m_per_a_per_m: round(slope, 3),
        worst_deviation_a_per_m: round(10.0 / 7012.0 * shape, 3),
    }
}
