//! P̂(f) = Σ y·e^{−jωt} / Σ d·e^{−jωt} over whole periods of a multisine: what the sensor shows (y) of what is demanded (d), both of one tick.
//!
//! It stands where the loop believes in rod, hold, delays and an inverted hysteresis; L̂ = K·P̂ has the loop's margins, and T̂ tells what the tip does
//! of the sensor's noise. In open loop: the feedback that it judges does not act. A line is left out where both halves of the run differ by more
//! than a fifth. Above the lines the loop is as believed, times what was measured at the last.

use super::rest::Rest;
use super::{SMALL, Step, open_loop};
use anhyst_conformance::amplifier::Findings;
use anhyst_controller::{Lines, LoopShape, MeasuredResponse, MultisineSettings, StrainLaw, TrajectorySettings};
use anhyst_ipc::{Demand, Invalid, Measurement};
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role};
use anhyst_report::number::{Digits, Si};
use anhyst_scenario::Scenario;
use std::f64::consts::TAU;

/// After which the lines repeat: so long, so many ticks at least.
const PERIOD_S: f64 = 0.125;
const MIN_PERIOD_TICKS: f64 = 256.0;
/// Periods until it swings evenly, and those that are judged, in two halves.
const SWINGING: usize = 2;
const JUDGED: usize = 8;
const START_S: f64 = 0.1;
/// So much more than what moves a slow amplifier is asked for at the highest line, and so much of the profile by all of them.
const MAX_LEAD: f64 = 20.0;
const LED: f64 = 0.4;
/// The lowest line in lines per period, and the way to the next: as much, or a part of the line.
const LOWEST: usize = 3;
const APART: f64 = 0.03;
/// Highest: of the resonance, and of the rate.
const OF_RESONANCE: f64 = 3.0;
const OF_RATE: f64 = 0.2;
/// Halves that differ by more are no response.
const UNLIKE: f64 = 0.2;
/// Of all lines so many must be one.
const REPEATS: f64 = 0.5;
/// The lowest lines, which tell sign and gain.
const LOW: usize = 5;
/// Of what is demanded: less is nothing, and a factor beyond this a unit.
const NOTHING: f64 = 0.02;
const UNIT: f64 = 3.0;
/// Gains that must be made smaller than this part are none.
const LEAST_GAINS: f64 = 0.1;
/// What noise reaches of its rms over a cut.
const PEAK: f64 = 3.0;

/// The run, and what it is judged by.
pub struct Excitation {
    pub probe: Scenario,
    lines_hz: Vec<f64>,
    period_ticks: usize,
    begin_tick: usize,
}

/// What came of it.
pub struct Response {
    lines: Vec<MeasuredResponse>,
    left_out: usize,
}

impl Excitation {
    /// None where the profile does not move.
    ///
    /// # Errors
    /// A loop that cannot be told.
    pub fn new(of: &Scenario) -> Result<Option<Self>, Invalid> {
        let controller = of.controller()?;
        let Some(size_m) = controller.size_m(of.duration_s) else {
            return Ok(None);
        };
        let shape = of.loop_shape()?;
        let period_ticks = (PERIOD_S / of.tick_s).round().max(MIN_PERIOD_TICKS);
        let base_hz = 1.0 / (period_ticks * of.tick_s);
        let lag_s = of.believed_coil().lag_s;
        let highest_hz = (OF_RESONANCE * of.foresight()?.resonance_hz).min(OF_RATE / of.tick_s);
        let highest_hz = highest_hz.min(MAX_LEAD / (TAU * lag_s));
        let apart = |line: &usize| line + LOWEST.max((APART * *line as f64).ceil() as usize);
        let lines = std::iter::successors(Some(LOWEST), |line| Some(apart(line)));
        let lines_hz: Vec<f64> = lines
            .map(|line| line as f64 * base_hz)
            .take_while(|hz| *hz <= highest_hz)
            .collect();
        if lines_hz.len() < LOW {
            return Ok(None);
        }
        let backwards = |hz: &f64| shape.believed_response(*hz).0.powi(-2);
        let power: f64 = lines_hz.iter().map(backwards).sum();
        // What a slow amplifier is led by is larger than what moves.
        let led = |hz: &f64| backwards(hz) * (1.0 + (TAU * hz * lag_s).powi(2));
        let lead = (lines_hz.iter().map(led).sum::<f64>() / power).sqrt();
        // Twice the rms is about its peak.
        let amplitude_m = SMALL.min(LED / lead) * size_m / (2.0 * (0.5 * power).sqrt());
        let places = (0..=1000).map(|place| controller.trajectory().at(f64::from(place) * 1e-3 * of.duration_s));
        let (low, high) = places.fold((0.0, 0.0), |(low, high): (f64, f64), own| {
            (low.min(own.position_m), high.max(own.position_m))
        });
        let begin_tick = ((START_S / (period_ticks * of.tick_s)).ceil() as usize + SWINGING) * period_ticks as usize;
        let ticks = begin_tick + JUDGED * period_ticks as usize;
        let mut probe = open_loop(of, ticks as f64 * of.tick_s);
        probe.controller.trajectory = TrajectorySettings::Multisine(MultisineSettings {
            mean_m: 0.5 * (low + high),
            amplitude_m,
            lines: Lines::List(lines_hz.clone()),
        });
        probe.controller.start_s = START_S.min(0.5 * probe.duration_s);
        probe.controller.feedforward = true;
        Ok(Some(Self {
            probe,
            lines_hz,
            period_ticks: period_ticks as usize,
            begin_tick,
        }))
    }

    /// # Errors
    /// A loop that cannot be told.
    pub fn measure(&self, measured: &[Measurement], demanded: &[Demand]) -> Result<Response, Invalid> {
        let (material, rod) = self.probe.believed()?;
        let law = StrainLaw::new(&rod, &material);
        let half = JUDGED / 2 * self.period_ticks;
        let of = |hz: f64, from: usize| {
            let (mut sums, turn) = ([[0.0; 2]; 2], TAU * hz * self.probe.tick_s);
            let ticks = measured.iter().zip(demanded).enumerate().skip(from).take(half);
            for (tick, (measured, demanded)) in ticks {
                let (sine, cosine) = (turn * (tick - from) as f64).sin_cos();
                let values = [
                    measured.displacement_m,
                    law.displacement_m(demanded.magnetization_a_per_m),
                ];
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum = [sum[0] + value * cosine, sum[1] - value * sine];
                }
            }
            quotient(sums[0], sums[1])
        };
        let all = self.lines_hz.iter().filter_map(|hz| {
            let [first, second] = [self.begin_tick, self.begin_tick + half].map(|from| of(*hz, from));
            let mean = [0.5 * (first[0] + second[0]), 0.5 * (first[1] + second[1])];
            let apart = (first[0] - second[0]).hypot(first[1] - second[1]);
            (apart <= UNLIKE * mean[0].hypot(mean[1])).then(|| MeasuredResponse {
                frequency_hz: *hz,
                gain: mean[0].hypot(mean[1]),
                phase_rad: mean[1].atan2(mean[0]),
            })
        });
        let lines: Vec<MeasuredResponse> = all.collect();
        Ok(Response {
            left_out: self.lines_hz.len() - lines.len(),
            lines,
        })
    }
}

fn quotient(of: [f64; 2], by: [f64; 2]) -> [f64; 2] {
    let power = by[0] * by[0] + by[1] * by[1];
    [
        (of[0] * by[0] + of[1] * by[1]) / power,
        (of[1] * by[0] - of[0] * by[1]) / power,
    ]
}

impl Response {
    /// What takes the place of belief.
    pub fn lines(&self) -> &[MeasuredResponse] {
        &self.lines
    }

    /// Sign and gain from demand to sensor, over what is believed.
    pub fn sensor(&self, scenario: &Scenario) -> Result<Step, Invalid> {
        let shape = scenario.loop_shape()?;
        let mut found = Findings::default();
        let low = &self.lines[..self.lines.len().min(LOW)];
        let (mut along, mut across) = (0.0, 0.0);
        for line in low {
            let (gain, phase_rad) = shape.believed_response(line.frequency_hz);
            let (sine, cosine) = (line.phase_rad - phase_rad).sin_cos();
            along += cosine * line.gain / gain / LOW as f64;
            across += sine * line.gain / gain / LOW as f64;
        }
        let size = along.hypot(across);
        let words = match size < NOTHING {
            true => ", which is nothing: stuck, or not connected",
            false => "",
        };
        found.at_least(
            "follows",
            size,
            NOTHING,
            "1",
            format!(
                "of what is demanded the sensor shows {} times as much as believed{words}",
                Digits(size, 4)
            ),
        );
        let (told, all) = (self.lines.len(), self.lines.len() + self.left_out);
        found.at_least(
            "repeats",
            told as f64 / all as f64,
            REPEATS,
            "1",
            format!(
                "at {told} of {all} frequencies the response was the same twice, to {} %: where it is not, something is loose, or noise drowns it",
                100.0 * UNLIKE
            ),
        );
        if found.passed() {
            let words = match along < 0.0 {
                true => "the sensor has the opposite sign of the demand",
                false => "the sensor has the sign of the demand",
            };
            found.at_least("sign", along.signum(), 1.0, "1", words.to_owned());
            let factor = size.max(1.0 / size);
            found.at_most(
                "unit",
                factor,
                UNIT,
                "1",
                format!(
                    "the rig moves {} times as far as the scenario believes",
                    Digits(size, 4)
                ),
            );
        }
        Ok(Step::new(
            "sensor in motion",
            found.checks,
            &["follows", "repeats", "sign", "unit"],
        ))
    }

    /// The loop's margins with the scenario's gains, which keep them by now, made so many times smaller for it; what is left of the sensor's noise.
    pub fn margins(&self, scenario: &Scenario, factor: Option<f64>, rest: &Rest) -> Result<Step, Invalid> {
        let believed = scenario.loop_shape()?;
        let shape = believed.clone().with_measured(&self.lines);
        let mut found = Findings::default();
        if scenario.controller.feedback.is_some() {
            let (own, by_belief) = (shape.margins(), believed.margins());
            let of = |own: &anhyst_controller::Margins| {
                let gain = own.gain.map_or("any".to_owned(), |gain| Digits(gain, 3).to_string());
                let phase = own
                    .phase_rad
                    .map_or("any".to_owned(), |own| format!("{:.0}°", own.to_degrees()));
                format!(
                    "Ms {} at {}, gain margin {gain}, phase margin {phase}",
                    Digits(own.sensitivity.value, 3),
                    Si(own.sensitivity.frequency_hz, "Hz")
                )
            };
            found.at_least(
                "gains",
                factor.unwrap_or(1.0),
                LEAST_GAINS,
                "1",
                format!(
                    "with the response as it was measured the feedback's gains keep their margins {} times as large as stated: margins too small \
                     below {LEAST_GAINS}",
                    Digits(factor.unwrap_or(1.0), 3)
                ),
            );
            found.at_most(
                "sensitivity",
                own.sensitivity.value,
                2.01,
                "1",
                format!("measured: {}; believed: {}", of(&own), of(&by_belief)),
            );
        }
        let floor_m = noise_m(&shape, rest);
        let unit = scenario.units().output;
        let floor = format!(
            "the sensor's noise alone moves the tip by {} rms through this loop, {} now and then",
            Si(floor_m, &unit),
            Si(PEAK * floor_m, &unit)
        );
        if let Some(tolerance_m) = scenario.expect.tolerance_m {
            let sentence = format!("{floor}, and {} are allowed", Si(tolerance_m, &unit));
            found.at_most("noise_floor", PEAK * floor_m, tolerance_m, "m", sentence);
        }
        let told = found.checks.iter().filter(|check| check.name == "sensitivity");
        let told: Vec<String> = told.map(|check| check.sentence.clone()).chain([floor]).collect();
        let mut step = Step::new("response and margins", found.checks, &["gains", "noise_floor"]);
        if step.refusal.is_none() {
            step.findings = told;
        }
        step.section = step.section.figure(
            figure(&shape, &believed, &self.lines),
            "From the demand to the sensor, with the delays of computing and hold. Lines at which both halves of the run differ by more than a fifth are left out.",
        );
        Ok(step)
    }
}

/// What the tip does of the noise that the sensor had at rest, rms.
fn noise_m(shape: &LoopShape, rest: &Rest) -> f64 {
    let [Some(first), Some(second)] = [0, 1].map(|place| rest.densities.get(place)) else {
        return 0.0;
    };
    let power = rest.densities.iter().map(|[hz, density]| {
        let point = shape.points(*hz, 1);
        point.first().map_or(0.0, |own| own.complementary.powi(2)) * density
    });
    (power.sum::<f64>() * (second[0] - first[0])).sqrt()
}

fn figure(shape: &LoopShape, believed: &LoopShape, lines: &[MeasuredResponse]) -> Figure {
    let frequency = || Axis::new("frequency", "Hz").logarithmic();
    let belief = |of: fn((f64, f64)) -> f64| {
        let points = lines
            .iter()
            .map(move |own| [own.frequency_hz, of(believed.believed_response(own.frequency_hz))]);
        Curve::new(points, Role::Nominal).named("believed").dashed()
    };
    let truth = |of: fn(&MeasuredResponse) -> f64| {
        Curve::new(lines.iter().map(|own| [own.frequency_hz, of(own)]), Role::Measured).named("measured")
    };
    let gain = Chart::new("gain", frequency(), Axis::new("gain", "").logarithmic())
        .series([truth(|own| own.gain), belief(|own| own.0)]);
    let phase = Chart::new("phase", frequency(), Axis::new("phase", "°")).series([
        truth(|own| wrapped(own.phase_rad).to_degrees()),
        belief(|own| wrapped(own.1).to_degrees()),
    ]);
    let from_hz = lines.first().map_or(1.0, |own| own.frequency_hz);
    let sensitivity = |shape: &LoopShape, role: Role, name: &str| {
        let points: Vec<[f64; 2]> = shape
            .points(from_hz, 400)
            .iter()
            .map(|own| [own.frequency_hz, own.sensitivity])
            .collect();
        Curve::new(points, role).named(name)
    };
    let margins = Chart::new("sensitivity |S|", frequency(), Axis::new("|S|", "").logarithmic())
        .series([
            sensitivity(shape, Role::Measured, "measured"),
            sensitivity(believed, Role::Nominal, "believed").dashed(),
        ])
        .horizontal(2.0, Role::Limit, "Ms = 2");
    Figure::new("Response", vec![gain, phase, margins]).columns(3)
}

/// Between −2π and 0: a response is late.
fn wrapped(phase_rad: f64) -> f64 {
    phase_rad - TAU * (phase_rad / TAU).ceil()
}
