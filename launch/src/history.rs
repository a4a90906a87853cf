//! What a run's page tells beside the error: where tip and reference were, how `a` was estimated, the guard's events, and how long
//! which state lasted.

use crate::last_turns::{LastTurns, Turns};
use crate::windows::{Gathered, Windows};
use anhyst_guard::Event;
use anhyst_ipc::{Demand, Estimate, Measurement, SafeField};
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role, TIME};
use anhyst_report::page::Section;
use anhyst_report::table::Table;
use anhyst_scenario::Units;
use serde::{Deserialize, Serialize};

/// Events that are listed; a guard that raises more says nothing new.
const MAX_EVENTS: usize = 64;

/// From so many windows in a period on, their ends draw it.
const DRAWN: f64 = 16.0;

/// States by name: bits of the words of controller, estimator and guard that mean them.
const STATES: [(&str, u64, u64, u64); 9] = [
    ("learning", Demand::LEARNING, 0, 0),
    ("what was learned is taken back", Demand::TAKEN_BACK, 0, 0),
    ("integration stopped", Demand::INTEGRATION_STOPPED, 0, 0),
    ("estimate held", 0, Estimate::HELD, 0),
    ("estimate at an edge of its range", 0, Estimate::AT_EDGE, 0),
    (
        "field limited",
        0,
        0,
        SafeField::AMPLITUDE_LIMITED | SafeField::SLEW_LIMITED,
    ),
    ("field held", 0, 0, SafeField::HOLDING),
    (
        "on the way to the safe field, or there",
        0,
        0,
        SafeField::RAMPING | SafeField::SAFE,
    ),
    ("estimate left alone", 0, 0, SafeField::FALL_BACK),
];

/// A state's ticks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Lasted {
    ticks: u64,
    first_tick: u64,
    last_tick: u64,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Window {
    samples: u64,
    /// Lowest and highest, m.
    reference_m: [f64; 2],
    displacement_m: [f64; 2],
    /// Sums, A/m.
    estimated_a_per_m: f64,
    deviation_a_per_m: f64,
    true_a_per_m: f64,
}

impl Window {
    /// The same with means in the place of sums.
    fn with_means(self) -> Self {
        let mean = |sum: f64| sum / self.samples as f64;
        Self {
            estimated_a_per_m: mean(self.estimated_a_per_m),
            deviation_a_per_m: mean(self.deviation_a_per_m),
            true_a_per_m: mean(self.true_a_per_m),
            ..self
        }
    }
}

impl Gathered for Window {
    fn with(self, later: Self) -> Self {
        if self.samples == 0 || later.samples == 0 {
            return if self.samples == 0 { later } else { self };
        }
        let hull = |one: [f64; 2], other: [f64; 2]| [one[0].min(other[0]), one[1].max(other[1])];
        Self {
            samples: self.samples + later.samples,
            reference_m: hull(self.reference_m, later.reference_m),
            displacement_m: hull(self.displacement_m, later.displacement_m),
            estimated_a_per_m: self.estimated_a_per_m + later.estimated_a_per_m,
            deviation_a_per_m: self.deviation_a_per_m + later.deviation_a_per_m,
            true_a_per_m: self.true_a_per_m + later.true_a_per_m,
        }
    }
}

/// A run's history.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct History {
    windows: Windows<Window>,
    events: Vec<(u64, u64)>,
    states: [Lasted; STATES.len()],
    ticks: u64,
}

/// What is told of it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Told {
    /// For the page alone: middles, s, with means in the place of sums.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    windows: Vec<(f64, Window)>,
    /// For the page alone.
    #[serde(default, skip_serializing_if = "Turns::is_empty")]
    turns: Turns,
    /// Ticks and numbers of the guard's events, the first 64.
    pub events: Vec<(u64, u64)>,
    /// Names, ticks, first and last tick of the states that there were.
    pub states: Vec<(String, u64, u64, u64)>,
    ticks: u64,
}

impl History {
    /// Looks at one tick; `true_a_per_m` is 0 where nobody knows it.
    pub fn observe(
        &mut self,
        tick: u64,
        (measured, true_a_per_m): (&Measurement, f64),
        (demand, estimate, field): (&Demand, &Estimate, &SafeField),
    ) {
        self.ticks += 1;
        if field.event != 0 && self.events.len() < MAX_EVENTS {
            self.events.push((tick, field.event));
        }
        // A fixed estimate is neither held nor at an edge.
        let is_fixed = estimate.status & Estimate::FIXED != 0;
        let of_estimate = if is_fixed { 0 } else { estimate.status };
        for (own, (_, of_demand, of_estimates, of_field)) in self.states.iter_mut().zip(STATES) {
            let said = (demand.status & of_demand) | (of_estimate & of_estimates) | (field.status & of_field);
            if said != 0 {
                if own.ticks == 0 {
                    own.first_tick = tick;
                }
                (own.ticks, own.last_tick) = (own.ticks + 1, tick);
            }
        }
        let own = Window {
            samples: 1,
            reference_m: [demand.reference_m; 2],
            displacement_m: [measured.displacement_m; 2],
            estimated_a_per_m: estimate.shape_a_per_m,
            deviation_a_per_m: estimate.standard_deviation_a_per_m,
            true_a_per_m,
        };
        let numbers = [
            own.reference_m[0],
            own.displacement_m[0],
            own.estimated_a_per_m,
            own.deviation_a_per_m,
        ];
        // What is no finite number has no place in a picture.
        if numbers.iter().chain([&true_a_per_m]).all(|own| own.is_finite()) {
            self.windows.add(tick, own);
        }
    }

    /// So far; `period_s` of what repeats.
    pub fn told(&self, tick_s: f64, period_s: Option<f64>) -> Told {
        let windows = whole(&self.windows.all(tick_s).collect::<Vec<_>>(), period_s).into_iter();
        let lasted = self.states.iter().zip(STATES).filter(|(own, _)| own.ticks > 0);
        Told {
            windows: windows.map(|(time_s, own)| (time_s, own.with_means())).collect(),
            turns: Turns::default(),
            events: self.events.clone(),
            states: lasted
                .map(|(own, (name, ..))| (name.to_owned(), own.ticks, own.first_tick, own.last_tick))
                .collect(),
            ticks: self.ticks,
        }
    }
}

/// Windows that hold a period each, unless they are so many in one that they draw it: else their ends beat with it.
fn whole(windows: &[(f64, &Window)], period_s: Option<f64>) -> Vec<(f64, Window)> {
    let window_s = windows.get(1).map_or(f64::INFINITY, |second| second.0 - windows[0].0);
    let in_a_period = period_s.unwrap_or(0.0) / window_s;
    let together = if in_a_period < DRAWN { in_a_period.ceil() } else { 1.0 };
    let together = (together as usize).min(windows.len()).max(1);
    let one = |own: &[(f64, &Window)]| {
        let all = own.iter().fold(Window::default(), |all, (_, own)| all.with(**own));
        (0.5 * (own[0].0 + own[own.len() - 1].0), all)
    };
    // The last ones may hold less.
    windows
        .chunks_exact(together)
        .map(one)
        .filter(|(_, own)| own.samples > 0)
        .collect()
}

impl Told {
    pub(crate) fn with_turns(self, turns: Option<&LastTurns>) -> Self {
        Self {
            turns: turns.map(LastTurns::told).unwrap_or_default(),
            ..self
        }
    }

    /// As a program is told: without what is for pictures.
    pub fn without_pictures(self) -> Self {
        Self {
            windows: Vec::new(),
            turns: Turns::default(),
            ..self
        }
    }

    /// The motion and its hysteresis, where it repeats.
    pub(crate) fn last_turns(&self, units: &Units) -> Option<Section> {
        (!self.turns.is_empty()).then(|| self.turns.section(units))
    }

    /// Its other sections of a page.
    pub fn sections(&self, tick_s: f64, units: &Units) -> Vec<Section> {
        let mut sections = Vec::new();
        if !self.windows.is_empty() {
            let (title, charts, caption) = if units.shape {
                let caption = "In each of at most 256 windows of the run, or of as many as hold a period: lowest and highest reference and measured displacement. Mean of the \
                               estimate of a, with two of the law's standard deviations either way where it gives them, and of the true a where it is known.";
                let charts = vec![self.tracking(units), self.estimate()];
                ("Tracking and estimate", charts, caption)
            } else {
                let caption = "In each of at most 256 windows of the run, or of as many as hold a period: lowest and highest reference and measured output.";
                ("Tracking", vec![self.tracking(units)], caption)
            };
            let figure = Figure::new("", charts).columns(1);
            sections.push(Section::new(title).figure(figure, caption));
        }
        sections.push(self.events_and_states(tick_s));
        sections
    }

    fn curve(&self, of: impl Fn(&Window) -> f64, role: Role) -> Curve {
        Curve::new(self.windows.iter().map(|(time_s, own)| [*time_s, of(own)]), role)
    }

    fn tracking(&self, units: &Units) -> Chart {
        let reach = self
            .windows
            .iter()
            .map(|(time_s, own)| (*time_s, own.reference_m[0], own.reference_m[1]));
        Chart::new("tracking", TIME, Axis::new(units.output_name(), &units.output))
            .band(reach.collect(), Role::Nominal, Some("reference"))
            .curve(
                self.curve(|own| own.displacement_m[0], Role::Measured)
                    .named("measured, lowest and highest"),
            )
            .curve(self.curve(|own| own.displacement_m[1], Role::Measured))
    }

    fn estimate(&self) -> Chart {
        let mut chart = Chart::new("estimate of a", TIME, Axis::new("a", "A/m"));
        if self.windows.iter().any(|(_, own)| own.deviation_a_per_m > 0.0) {
            let ends = |(time_s, own): &(f64, Window)| {
                let reach = 2.0 * own.deviation_a_per_m;
                (*time_s, own.estimated_a_per_m - reach, own.estimated_a_per_m + reach)
            };
            chart = chart.band(self.windows.iter().map(ends).collect(), Role::Amended, Some("± 2 σ"));
        }
        if self.windows.iter().any(|(_, own)| own.true_a_per_m != 0.0) {
            chart = chart.curve(self.curve(|own| own.true_a_per_m, Role::Truth).named("true"));
        }
        chart.curve(
            self.curve(|own| own.estimated_a_per_m, Role::Amended)
                .named("estimated"),
        )
    }

    fn events_and_states(&self, tick_s: f64) -> Section {
        let mut section = Section::new("Events and states");
        let at = |tick: u64| format!("{:.4} s", tick as f64 * tick_s);
        if self.events.is_empty() {
            section = section.paragraph("The guard raised no event.");
        } else {
            let mut events = Table::new(["event", "in tick", "at"]);
            for (tick, number) in &self.events {
                let name = Event::from_number(*number).map_or("unknown", Event::name);
                events.push([name.replace('_', " "), tick.to_string(), at(*tick)]);
            }
            section = section.table(events);
        }
        if self.states.is_empty() {
            return section;
        }
        let mut states = Table::new(["state", "ticks", "of all", "first", "last"]);
        for (name, ticks, first, last) in &self.states {
            let share = 100.0 * *ticks as f64 / self.ticks.max(1) as f64;
            states.push([
                name.clone(),
                ticks.to_string(),
                format!("{share:.2} %"),
                at(*first),
                at(*last),
            ]);
        }
        section.table(states)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards what a page tells of a run: where the tip was, how long states lasted, which events there were, and only so many.
    #[test]
    fn states_events_and_reach_are_those_of_the_ticks() {
        let mut history = History::default();
        for tick in 0..1000_u64 {
            let swing_m = if tick % 2 == 0 { 1e-6 } else { -2e-6 };
            let measured = Measurement {
                displacement_m: if tick == 500 { f64::NAN } else { swing_m },
                ..Measurement::default()
            };
            let demand = Demand {
                reference_m: 0.5 * swing_m,
                status: if tick >= 100 { Demand::LEARNING } else { 0 },
                ..Demand::default()
            };
            let estimate = Estimate {
                shape_a_per_m: 7000.0,
                standard_deviation_a_per_m: 5.0,
                status: Estimate::HELD | if tick < 10 { 0 } else { Estimate::FIXED },
                ..Estimate::default()
            };
            let field = SafeField {
                event: if tick % 3 == 0 {
                    Event::ErrorDiverging.number()
                } else {
                    0
                },
                ..SafeField::default()
            };
            history.observe(tick, (&measured, 7001.0), (&demand, &estimate, &field));
        }
        let told = history.told(1e-3, None);
        assert_eq!(told.events.len(), MAX_EVENTS);
        assert_eq!(told.events[1], (3, Event::ErrorDiverging.number()));
        let expected = [("learning", 900, 100, 999), ("estimate held", 10, 0, 9)];
        let expected = expected.map(|(name, ticks, first, last)| (name.to_owned(), ticks, first, last));
        assert_eq!(told.states, expected);
        for (_, own) in &told.windows {
            assert_eq!((own.displacement_m, own.reference_m), ([-2e-6, 1e-6], [-1e-6, 5e-7]));
            let means = [own.estimated_a_per_m, own.deviation_a_per_m, own.true_a_per_m];
            assert_eq!(means, [7000.0, 5.0, 7001.0]);
        }
        let page = told
            .sections(1e-3, &Units::default())
            .into_iter()
            .fold(
                anhyst_report::page::Page::new("t", "s"),
                anhyst_report::page::Page::section,
            )
            .html();
        for word in ["error diverging", "learning", "90.00 %", "estimate of a"] {
            assert!(page.contains(word), "{word}");
        }
        assert!(told.without_pictures().windows.is_empty());
    }

    /// Guards the picture of the tracking: windows shorter than a period would show now this part of it and now that, a beat that the run
    /// has not; where they are short enough they draw the motion itself.
    #[test]
    fn windows_do_not_beat_with_the_motion() {
        let told = |period_ticks: f64| {
            let mut history = History::default();
            for tick in 0..2560_u64 {
                let angle = std::f64::consts::TAU * tick as f64 / period_ticks;
                let measured = Measurement {
                    displacement_m: angle.sin(),
                    ..Measurement::default()
                };
                let others = (&Demand::default(), &Estimate::default(), &SafeField::default());
                history.observe(tick, (&measured, 0.0), others);
            }
            history.told(1e-3, Some(1e-3 * period_ticks)).windows
        };
        for period_ticks in [17.0, 27.3, 61.0, 250.0] {
            for (time_s, own) in told(period_ticks) {
                let [low, high] = own.displacement_m;
                assert!(
                    low < -0.97 && high > 0.97,
                    "{period_ticks}, {time_s} s: {low} to {high}"
                );
            }
        }
        let drawn = told(1280.0);
        assert!(
            drawn.len() > 64
                && drawn
                    .iter()
                    .all(|(_, own)| own.displacement_m[1] - own.displacement_m[0] < 0.2)
        );
    }
}
