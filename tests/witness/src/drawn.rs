//! A run drawn from a seed: what is hidden in which disturbances behind which drive, and the truth about it.
//!
//! The gap that each effect makes is drawn uniformly in the logarithm from 3 to 100 times the noise (lines and drift apart); its strength is
//! then sought. Contribution c of an effect: the record minus that of the same rig with the same noise without it. Share of the gap
//! that it makes: ⟨c, d⟩/⟨d, d⟩, d the measured displacement minus that of the nominal rig under the recorded command; gap of an effect: rms of
//! c. Both without the means of c and d, which the sensor's zero takes.
//! Where a drive cannot make an effect show by the wanted gap, everything is drawn again.

use crate::draw::Draw;
use crate::drive::Drive;
use crate::effect::{Effect, Peaks, Shape, Value};
use crate::nuisance::Nuisance;
use crate::rig::{Record, Rig};
use std::fmt;

/// 10 kHz.
const TICK_S: f64 = 1e-4;
/// Gap over noise.
const GAPS: [f64; 2] = [3.0, 100.0];
/// So close to the wanted gap, as a ratio: drawn, and told.
const CLOSE: f64 = 1.3;
const CLOSE_TO_TOLD: f64 = 1.03;
/// Of the largest gap, from one draw to the next.
const SHRINKING: f64 = 0.9;
const MAX_STEPS: usize = 12;
/// After 30 the largest gap is the smallest.
const MAX_ATTEMPTS: u64 = 400;
const SUBSTEPS: usize = 8;
/// Streams of a seed; an effect's own come behind its attempt's.
const ATTEMPT_STREAM: u64 = 1000;

/// What a run shall be.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// None, one or several.
    pub effects: Vec<Effect>,
    pub nuisance: Nuisance,
    /// Drawn if not told, every other one broadband.
    pub drive: Option<Drive>,
    /// Of each effect; drawn if not told.
    pub gap_over_noise: Option<f64>,
    pub rows: usize,
}

/// One hidden effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    pub effect: Effect,
    /// What a diagnosis would call its numbers.
    pub values: Vec<Value>,
    pub contribution_m: Vec<f64>,
    pub contribution_a_per_m: Vec<f64>,
    /// Rms of the contribution to the displacement without its mean, m.
    pub gap_m: f64,
    /// Of the gap's energy.
    pub share: f64,
}

/// What is true of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    pub parts: Vec<Part>,
    pub nuisance: Nuisance,
    pub drive: Drive,
    /// Rms of the displacement's noise, lines and drift apart, m.
    pub noise_m: f64,
    /// Rms of measured minus nominal displacement, m; and of the same without noise.
    pub gap_m: f64,
    pub gap_to_the_nominal_model_m: f64,
    /// The same with nothing hidden: what the disturbances make, m.
    pub gap_of_the_nuisance_m: f64,
    /// Draws until one could be made.
    pub attempts: u64,
}

/// A run and its truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Made {
    pub time_s: Vec<f64>,
    pub record: Record,
    pub truth: Truth,
    /// With everything in it.
    pub rig: Rig,
}

/// No drive of this seed could make what was wanted.
#[derive(Clone, Debug, PartialEq)]
pub struct NotMade {
    pub seed: u64,
    pub wanted: Wanted,
}

impl fmt::Display for NotMade {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = self.wanted.effects.iter().map(|effect| effect.name()).collect();
        write!(
            f,
            "seed {}: none of {MAX_ATTEMPTS} draws lets {} show by a gap of 3 to 100 noises",
            self.seed,
            names.join(" + ")
        )
    }
}

impl std::error::Error for NotMade {}

impl Truth {
    /// Names of what is hidden; "none" for nothing.
    pub fn name(&self) -> String {
        let names: Vec<&str> = self.parts.iter().map(|part| part.effect.name()).collect();
        if names.is_empty() {
            "none".to_owned()
        } else {
            names.join(" + ")
        }
    }
}

/// An effect with its draws and the strength found.
struct Grown {
    effect: Effect,
    shape: Shape,
    strength: f64,
}

/// What a run has with nothing hidden.
struct Ground {
    rig: Rig,
    command: Vec<f64>,
    drive: Drive,
    peaks: Peaks,
    noise_m: f64,
}

impl Rig {
    /// Draws a run of this rig, which is the nominal one.
    ///
    /// # Errors
    /// None of 400 drives can make what is wanted.
    pub fn draw(&self, seed: u64, wanted: &Wanted) -> Result<Made, NotMade> {
        (0..MAX_ATTEMPTS)
            .find_map(|attempt| attempted(self, seed, wanted, attempt))
            .ok_or_else(|| NotMade {
                seed,
                wanted: wanted.clone(),
            })
    }
}

fn attempted(nominal: &Rig, seed: u64, wanted: &Wanted, attempt: u64) -> Option<Made> {
    let stream = ATTEMPT_STREAM * (attempt + 1);
    let ground = Ground::drawn(nominal, seed, wanted, stream);
    let free = wanted.nuisance.frees_constants();
    let mut grown: Vec<Grown> = Vec::new();
    for (place, effect) in wanted.effects.iter().enumerate() {
        let mut draw = Draw::new(seed, stream + 10 + place as u64);
        let shape = Shape::drawn(&mut draw, free);
        let (gap, close) = match wanted.gap_over_noise {
            Some(told) => (told, CLOSE_TO_TOLD),
            None => {
                let low = GAPS[0] * CLOSE;
                let high = GAPS[1] / CLOSE * SHRINKING.powf(attempt as f64);
                (draw.log_between(low, high.max(CLOSE * low)), CLOSE)
            }
        };
        let found = ground.grow(&grown, *effect, shape, gap * ground.noise_m, close)?;
        grown.push(found);
    }
    ground.told(nominal, &grown, wanted, attempt)
}

impl Ground {
    fn drawn(nominal: &Rig, seed: u64, wanted: &Wanted, stream: u64) -> Self {
        let mut draw = Draw::new(seed, stream);
        let mut rig = Rig {
            field_noise_a_per_m: draw.log_between(0.5, 2.0),
            field_resolution_a_per_m: draw.one_of(&[0.01, 0.1, 1.0]),
            substeps: SUBSTEPS,
            seed: seed ^ stream,
            ..nominal.clone()
        };
        rig.sensor.noise_m = draw.log_between(1e-8, 4e-8);
        wanted.nuisance.disturb(&mut rig, &mut Draw::new(seed, stream + 1));
        let mut draw = Draw::new(seed, stream + 2);
        let drawn = [Drive::Broadband, draw.one_of(&Drive::ALL)][usize::from(draw.sign() > 0.0)];
        let drive = wanted.drive.unwrap_or(drawn);
        let command = drive.command(&mut draw, wanted.rows, TICK_S, rig.is_one_sided());
        let answer = rig.answer(TICK_S, command.clone());
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0_f64, |most, value| most.max(value.abs()));
        Ground {
            peaks: Peaks {
                field_a_per_m: largest(&mut answer.field_a_per_m.iter().copied()),
                field_rate: largest(&mut command.windows(2).map(|pair| (pair[1] - pair[0]) / TICK_S)),
                displacement_m: largest(&mut answer.displacement_m.iter().copied()),
            },
            noise_m: rms(&rig.noise_m(TICK_S, wanted.rows)),
            rig,
            command,
            drive,
        }
    }

    /// The rig with these in it.
    fn with<'a>(&self, grown: impl Iterator<Item = &'a Grown>) -> Rig {
        let mut rig = self.rig.clone();
        for own in grown {
            own.hide(&mut rig, &self.peaks);
        }
        rig
    }

    /// The strength whose gap is the wanted one, beside what has grown already; none where the drive cannot show it.
    fn grow(&self, others: &[Grown], effect: Effect, shape: Shape, wanted_m: f64, close: f64) -> Option<Grown> {
        let without = self.read(&self.with(others.iter()));
        let mut grown = Grown {
            effect,
            shape,
            strength: 1.0,
        };
        // Logarithms of strength and gap of the step before.
        let mut before: Option<(f64, f64)> = None;
        for _ in 0..MAX_STEPS {
            let rig = self.with(others.iter().chain(std::iter::once(&grown)));
            if !Effect::is_sane(&rig) || grown.strength > 1e4 {
                return None;
            }
            let gap_m = rms(&centred(&minus(
                &self.read(&rig).displacement_m,
                &without.displacement_m,
            )));
            if !gap_m.is_finite() {
                return None;
            }
            let miss = (wanted_m / gap_m).ln();
            if miss.abs() <= close.ln() {
                return Some(grown);
            }
            let here = (grown.strength.ln(), gap_m.max(1e-12).ln());
            let power = before.map_or(1.0, |(strength, gap)| (here.1 - gap) / (here.0 - strength));
            let step = miss / if power.is_finite() { power.clamp(0.4, 4.0) } else { 1.0 };
            before = Some(here);
            grown.strength *= step.clamp(-3.0, 3.0).exp();
        }
        None
    }

    /// The run and the truth about it; none where effects undo each other.
    fn told(self, nominal: &Rig, grown: &[Grown], wanted: &Wanted, attempt: u64) -> Option<Made> {
        let full = self.with(grown.iter());
        let substeps = full.plant(TICK_S).substeps();
        // Another number of steps would be other noise before a filter.
        let stepped = |rig: Rig| Rig { substeps, ..rig };
        let rig = stepped(full);
        let record = self.read(&rig);
        let bare = self.read(&stepped(self.rig.clone()));
        let nominal_m = stepped(nominal.clone())
            .answer(TICK_S, self.command.clone())
            .displacement_m;
        let gap = minus(&record.displacement_m, &nominal_m);
        let gap_m = rms(&gap);
        let gap = centred(&gap);
        let noise_m = rig.noise_m(TICK_S, wanted.rows);
        let away = |record: &Record| rms(&minus(&minus(&record.displacement_m, &nominal_m), &noise_m));
        let mut parts = Vec::new();
        for (place, hidden) in grown.iter().enumerate() {
            let others = grown.iter().enumerate().filter(|(other, _)| *other != place);
            let without = match grown.len() {
                1 => bare.clone(),
                _ => self.read(&stepped(self.with(others.map(|(_, grown)| grown)))),
            };
            let contribution_m = minus(&record.displacement_m, &without.displacement_m);
            let own = centred(&contribution_m);
            let gap_m = rms(&own);
            let is_drawn = (GAPS[0]..=GAPS[1]).contains(&(gap_m / self.noise_m)) && Effect::is_no_calibration(&rig);
            if wanted.gap_over_noise.is_none() && !is_drawn {
                return None;
            }
            parts.push(Part {
                effect: hidden.effect,
                values: hidden.hide(&mut nominal.clone(), &self.peaks),
                share: dot(&own, &gap) / dot(&gap, &gap),
                contribution_a_per_m: minus(&record.field_a_per_m, &without.field_a_per_m),
                contribution_m,
                gap_m,
            });
        }
        Some(Made {
            time_s: (0..wanted.rows).map(|row| row as f64 * TICK_S).collect(),
            truth: Truth {
                parts,
                nuisance: wanted.nuisance,
                drive: self.drive,
                noise_m: self.noise_m,
                gap_m,
                gap_to_the_nominal_model_m: away(&record),
                gap_of_the_nuisance_m: away(&bare),
                attempts: attempt + 1,
            },
            record,
            rig,
        })
    }

    fn read(&self, rig: &Rig) -> Record {
        rig.read(TICK_S, &rig.answer(TICK_S, self.command.clone()))
    }
}

impl Grown {
    fn hide(&self, rig: &mut Rig, peaks: &Peaks) -> Vec<Value> {
        self.effect.hide(rig, self.strength, &self.shape, peaks)
    }
}

fn minus(one: &[f64], other: &[f64]) -> Vec<f64> {
    one.iter().zip(other).map(|(one, other)| one - other).collect()
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}

fn centred(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|value| value - mean).collect()
}

fn rms(values: &[f64]) -> f64 {
    (dot(values, values) / values.len() as f64).sqrt()
}
