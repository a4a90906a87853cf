//! Records a made-up but plausible run without any other room, and says what recording costs:
//! `cargo run --release -p anhyst-recorder --example demo -- /tmp/demo.rrd [seconds] [live port]`.
//!
//! A sum of two sines drives a Jiles-Atherton loop whose `a` rises while an estimate follows it; at 6 s the field is limited
//! for a while, at 7 s the guard takes the field away and gives it back.

use anhyst_ipc::{
    Block, CoilField, Demand, Estimate, FieldCommand, Measurement, Message as _, Now, SafeField, Truth, status_word,
};
use anhyst_recorder::{EventName, Level, Recorder, RecorderSettings, RunInfo};
use std::f64::consts::TAU;
use std::path::PathBuf;
use std::time::{Duration, Instant};

const TICK_S: f64 = 5e-5;
const SATURATION: f64 = 7.65e5;
const METRES_PER_A_PER_M: f64 = 2.136e-10;
const FIELD_LIMIT: f64 = 14_000.0;

fn langevin(x: f64) -> f64 {
    if x.abs() < 1e-4 {
        x / 3.0
    } else {
        1.0 / x.tanh() - 1.0 / x
    }
}

#[derive(Default)]
struct World {
    field: f64,
    magnetization: f64,
    estimate: f64,
    temperature: f64,
    noise: u64,
}

impl World {
    /// Uniform noise of unit deviation.
    fn noise(&mut self) -> f64 {
        self.noise = self
            .noise
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        ((self.noise >> 11) as f64 / (1u64 << 53) as f64 - 0.5) * 12f64.sqrt()
    }

    fn magnetize(&mut self, field: f64, shape: f64) {
        let (k, alpha, c) = (4000.0, -0.01, 0.18);
        let step = field - self.field;
        let effective = field + alpha * self.magnetization;
        let excess = SATURATION * langevin(effective / shape) - self.magnetization;
        let anhysteretic_slope =
            (SATURATION * langevin((effective + 1.0) / shape) - SATURATION * langevin(effective / shape)).abs();
        let irreversible = if excess * step > 0.0 {
            excess / (k * step.signum() - alpha / (1.0 - c) * excess)
        } else {
            0.0
        };
        self.magnetization += step * (irreversible * (1.0 - c) + c * anhysteretic_slope);
        self.field = field;
    }

    fn tick(&mut self, tick: u64) -> <Recorder as Block>::Inputs {
        let t = tick as f64 * TICK_S;
        let fault = (7.0..7.6).contains(&t);
        let safe = if fault {
            (1.0 - (t - 7.0) / 0.05).max((t - 7.45) / 0.15).max(0.0)
        } else {
            1.0
        };
        let drive = (t / 0.3).min(1.0) * (1.0 + 0.25 * (TAU * 0.2 * t).sin());
        let wish = 9000.0 * drive * ((TAU * 50.0 * t).sin() + 0.3 * (TAU * 150.0 * t).sin());
        let wanted = if (6.0..6.3).contains(&t) { 1.4 * wish } else { wish };
        let field = wanted.clamp(-FIELD_LIMIT, FIELD_LIMIT) * safe;
        let shape = 6400.0 + (200.0 * (t - 1.0)).clamp(0.0, 800.0);
        let before = self.magnetization;
        self.magnetize(field, shape);
        let displacement = METRES_PER_A_PER_M * self.magnetization * (1.0 + 0.2 * self.magnetization / SATURATION);
        let learning = if fault { 0.0 } else { TICK_S / 0.25 };
        if tick == 0 {
            self.estimate = 6800.0;
            self.temperature = 293.0;
        }
        self.estimate += learning * (shape - self.estimate) + 0.05 * self.noise();
        self.temperature += TICK_S * (0.9 - 0.05 * (self.temperature - 293.0));
        let true_error = if safe < 1.0 {
            -(1.0 - safe) * 2e-5 * (TAU * 50.0 * t).sin()
        } else {
            5e-9 * self.noise() + (shape - self.estimate) * 4e-11 * (TAU * 50.0 * t).cos() + (wish - wanted) * 2e-10
        };
        let noisy = displacement + 1e-8 * self.noise();
        let reference = displacement + true_error;
        let starting = t < 0.3;
        let limited = wanted != field && !fault;
        let event = [(7.0, 3), (7.45, 5)]
            .into_iter()
            .find(|(at, _)| (t - at).abs() < 0.4 * TICK_S);
        let output = 0.6 * displacement;
        let estimate = Estimate {
            shape_a_per_m: self.estimate,
            field_a_per_m: field,
            magnetization_a_per_m: self.magnetization * (1.0 + 2e-6 * (self.estimate - shape)),
            next_field_a_per_m: field,
            output_error_m: true_error * 0.6,
            predicted_output_m: output,
            lower_cover_m: output - 2e-7 * (TAU * 50.0 * t).sin().abs(),
            upper_cover_m: output + 3e-7 * (TAU * 50.0 * t).sin().abs(),
            slope_m_per_a_per_m: -3e-9,
            standard_deviation_a_per_m: 2.0 + 60.0 * (-t / 0.5).exp(),
            status: status_word([
                (fault, Estimate::HELD),
                (!fault && (TAU * 100.0 * t).sin() > 0.3, Estimate::ADAPTING),
            ]),
            ..Estimate::default()
        };
        let mut inputs = (
            Now(Measurement {
                displacement_m: noisy,
                coil_field_a_per_m: field + 0.3 * self.noise(),
                temperature_k: self.temperature + 0.05 * self.noise(),
                ..Measurement::default()
            }),
            Now(Truth {
                displacement_m: displacement,
                coil_field_a_per_m: field,
                magnetization_a_per_m: self.magnetization,
                shape_a_per_m: shape,
                temperature_k: self.temperature,
                cutting_force_n: 20.0 * (TAU * 16.7 * t).sin().max(0.0),
                ..Truth::default()
            }),
            Now(estimate),
            Now(Demand {
                magnetization_a_per_m: self.magnetization + 2.0 * (self.magnetization - before),
                feedforward_a_per_m: self.magnetization,
                feedback_a_per_m: 500.0 * true_error / 1e-8,
                reference_m: reference,
                error_m: reference - noisy,
                status: status_word([(starting, Demand::STARTING), (limited, Demand::INTEGRATION_STOPPED)]),
                ..Demand::default()
            }),
            Now(FieldCommand {
                field_a_per_m: wanted,
                coil_field_a_per_m: wanted,
                status: status_word([(limited, FieldCommand::LIMITED)]),
                ..FieldCommand::default()
            }),
            Now(SafeField {
                field_a_per_m: field,
                status: status_word([
                    (limited, SafeField::AMPLITUDE_LIMITED),
                    (fault && safe > 0.0, SafeField::RAMPING),
                    (fault && safe == 0.0, SafeField::SAFE),
                ]),
                event: event.map_or(0, |(_, number)| number),
                ..SafeField::default()
            }),
            Now(CoilField {
                field_a_per_m: field,
                ..CoilField::default()
            }),
        );
        inputs.0.0.stamp(tick, 0);
        inputs
    }
}

fn run_info(path: PathBuf) -> RunInfo {
    RunInfo {
        path,
        realtime: false,
        run_id: format!("demo-{}", std::process::id()),
        name: "demo: a rises by 800 A/m".into(),
        notes: "A made-up run: at 6 s the field is limited, at 7 s the guard takes it away.".into(),
        tick_s: TICK_S,
        tolerance_m: 1e-6,
        settling_time_s: 0.5,
        period_s: Some(0.02),
        parameter_range: [6300.0, 7300.0],
        material: [7.65e5, 4000.0, 0.18],
        scales: anhyst_recorder::Scales::default(),
        field_limit_a_per_m: FIELD_LIMIT,
        lowest_field_a_per_m: -FIELD_LIMIT,
        events: vec![
            EventName {
                number: 3,
                text: "measurement is silent: field goes to 0".into(),
                level: Level::Error,
            },
            EventName {
                number: 5,
                text: "measurement is back: field returns".into(),
                level: Level::Info,
            },
        ],
    }
}

/// CPU seconds of this process, all threads.
fn cpu_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<_> = stat.rsplit(')').next()?.split_whitespace().collect();
    let ticks = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
    Some(ticks / 100.0)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = PathBuf::from(arguments.next().ok_or("give the path of the recording to write")?);
    let seconds: f64 = arguments.next().map_or(Ok(10.0), |text| text.parse())?;
    let live = arguments.next().map(|text| text.parse()).transpose()?;
    let settings = RecorderSettings {
        live,
        ..RecorderSettings::default()
    };
    let ticks = (seconds / TICK_S) as u64;
    let mut world = World::default();
    let tokens: Vec<_> = (0..ticks).map(|tick| world.tick(tick)).collect();

    let (start, cpu_before) = (Instant::now(), cpu_s().unwrap_or_default());
    let mut recorder = Recorder::create(&settings, run_info(path))?;
    let mut slowest = Duration::ZERO;
    for (tick, inputs) in (0..).zip(tokens) {
        // Live viewers want to watch: real time.
        if live.is_some() {
            let due = Duration::from_secs_f64(tick as f64 * TICK_S);
            std::thread::sleep(due.saturating_sub(start.elapsed()));
        }
        let before = Instant::now();
        recorder.step(tick, inputs);
        slowest = slowest.max(before.elapsed());
    }
    let report = recorder.finish()?;
    let (wall, cpu) = (start.elapsed().as_secs_f64(), cpu_s().unwrap_or_default() - cpu_before);
    println!("{report:?}");
    println!(
        "{:.0} rows/s, {:.2} MB per simulated second, CPU {cpu:.2} s of {wall:.2} s wall, slowest step {slowest:?}",
        report.rows as f64 / wall,
        report.bytes as f64 * 1e-6 / seconds,
    );
    Ok(())
}
