//! The last turns of a motion that repeats, sample by sample: the picture that an oscilloscope would show.

use anhyst_ipc::{Demand, Measurement};
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role, TIME};
use anhyst_report::page::Section;
use anhyst_scenario::Units;
use serde::{Deserialize, Serialize};

/// Turns that are drawn.
const TURNS: f64 = 2.0;
/// Samples of them; of a longer motion every second, third, … is kept.
const MOST: usize = 800;

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Sample {
    time_s: f64,
    reference_m: f64,
    displacement_m: f64,
    coil_field_a_per_m: f64,
}

/// Hears every tick and keeps the last ones.
#[derive(Debug, Clone)]
pub(crate) struct LastTurns {
    tick_s: f64,
    /// Ticks from sample to sample.
    stride: u64,
    most: usize,
    /// A ring: once it is full, the oldest is at `next`.
    samples: Vec<Sample>,
    next: usize,
}

/// What was kept, the oldest first.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Turns(Vec<Sample>);

impl LastTurns {
    /// None of a turn that is shorter than two ticks.
    pub fn new(tick_s: f64, turn_s: f64) -> Option<Self> {
        let ticks = (TURNS * turn_s / tick_s).round();
        let stride = (ticks / MOST as f64).ceil().max(1.0);
        let most = (ticks / stride) as usize;
        (ticks >= 4.0 && most <= MOST).then(|| Self {
            tick_s,
            stride: stride as u64,
            most,
            samples: Vec::with_capacity(most),
            next: 0,
        })
    }

    pub fn observe(&mut self, tick: u64, measured: &Measurement, demand: &Demand) {
        if !tick.is_multiple_of(self.stride) {
            return;
        }
        let own = Sample {
            time_s: tick as f64 * self.tick_s,
            reference_m: demand.reference_m,
            displacement_m: measured.displacement_m,
            coil_field_a_per_m: measured.coil_field_a_per_m,
        };
        if self.samples.len() < self.most {
            self.samples.push(own);
        } else {
            self.samples[self.next] = own;
            self.next = (self.next + 1) % self.most;
        }
    }

    /// What is no finite number has no place in a picture.
    pub fn told(&self) -> Turns {
        let (later, earlier) = self.samples.split_at(self.next);
        let finite = |own: &&Sample| {
            let numbers = [own.reference_m, own.displacement_m, own.coil_field_a_per_m];
            numbers.iter().all(|number| number.is_finite())
        };
        Turns(earlier.iter().chain(later).filter(finite).copied().collect())
    }
}

impl Turns {
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Wanted and measured, what lies between, and the way of the output over the input.
    pub fn section(&self, units: &Units) -> Section {
        let curve = |of: fn(&Sample) -> [f64; 2], role| Curve::new(self.0.iter().map(of), role);
        let (driving, driven) = (units.input_name(), units.output_name());
        let of_output = |name: &str| Axis::new(name, &units.output);
        let motion = Chart::new("wanted and measured", TIME, of_output(driven))
            .curve(curve(|own| [own.time_s, own.reference_m], Role::Nominal).named("reference"))
            .curve(curve(|own| [own.time_s, own.displacement_m], Role::Measured).named("measured"));
        let error = Chart::new("reference less measured", TIME, of_output("difference")).curve(curve(
            |own| [own.time_s, own.reference_m - own.displacement_m],
            Role::Remainder,
        ));
        let way = Chart::new("hysteresis", Axis::new(driving, &units.input), of_output(driven)).curve(curve(
            |own| [own.coil_field_a_per_m, own.displacement_m],
            Role::Measured,
        ));
        let caption = "As the sensors have them, their noise within: what is wanted and what was measured, the difference, and the loop that the output goes through over the input.";
        Section::new("The last two turns").figure(Figure::new("", vec![motion, error, way]).columns(1), caption)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the picture: two whole turns, the last ones, in the order of time, of a slow motion thinned evenly; what is no number is left out.
    #[test]
    fn the_last_two_turns_are_kept() {
        for (turn_ticks, kept) in [(10, 20), (700, 700), (100_000, 800)] {
            let ticks = 5 * turn_ticks + 3;
            let mut turns = LastTurns::new(1e-3, 1e-3 * f64::from(turn_ticks)).unwrap();
            for tick in 0..u64::try_from(ticks).unwrap() {
                let measured = Measurement {
                    displacement_m: tick as f64,
                    ..Measurement::default()
                };
                turns.observe(tick, &measured, &Demand::default());
            }
            let Turns(samples) = turns.told();
            let steps: Vec<f64> = samples
                .windows(2)
                .map(|pair| pair[1].displacement_m - pair[0].displacement_m)
                .collect();
            let stride = f64::from(2 * turn_ticks) / kept as f64;
            assert_eq!(samples.len(), kept, "{turn_ticks}");
            assert!(steps.iter().all(|step| *step == stride), "{turn_ticks}: {steps:?}");
            assert!(f64::from(ticks) - samples[kept - 1].displacement_m <= stride);
        }
        assert!(LastTurns::new(1e-3, 1e-3).is_none());
        let mut broken = LastTurns::new(1e-3, 1e-2).unwrap();
        let measured = Measurement {
            displacement_m: f64::NAN,
            ..Measurement::default()
        };
        broken.observe(0, &measured, &Demand::default());
        assert!(broken.told().is_empty());
    }
}
