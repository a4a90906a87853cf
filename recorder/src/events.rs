//! Changes of status bits and events of the guard, as sentences. A bit that chatters is reported ever more rarely, with
//! the number of changes in between, so that the table stays readable.

use crate::flags::{FLAGS, LANES, detail, status};
use crate::row::{Presence, Row};
use crate::run::{Level, RunInfo};

/// Simulated time between two reports of the same bit, doubled up to 64 times while it chatters.
const QUIET_S: f64 = 0.1;

/// Source of the one event that stands before all others.
pub(crate) const VERDICT: &str = "verdict";

/// One line of the event table.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Event {
    pub tick: u64,
    /// Whose event: the name of a node, `run`, or [`VERDICT`].
    pub source: &'static str,
    pub level: Level,
    pub text: String,
}

/// A change of a state lane.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StateChange {
    pub tick: u64,
    /// Index into [`LANES`].
    pub lane: usize,
    pub state: &'static str,
}

/// One status bit, as last reported.
#[derive(Debug, Clone, Copy, Default)]
struct Lamp {
    now: bool,
    shown: bool,
    quiet_until: u64,
    backoff: u32,
    changes: u32,
}

impl Lamp {
    /// Returns the number of changes since the last report if one is due.
    fn update(&mut self, on: bool, tick: u64, quiet_ticks: u64) -> Option<u32> {
        self.changes += u32::from(on != self.now);
        self.now = on;
        if on == self.shown || tick < self.quiet_until {
            return None;
        }
        let changes = std::mem::take(&mut self.changes);
        self.shown = on;
        self.backoff = if changes > 1 { (self.backoff + 1).min(6) } else { 0 };
        self.quiet_until = tick + (quiet_ticks << self.backoff);
        Some(changes)
    }
}

/// Watches the loop's status words.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    lamps: [Lamp; FLAGS.len()],
    /// The status words that the lamps show, and the tick from which on one of them may be reported, whatever the words say.
    words: [u64; 5],
    due: u64,
    /// The field in the coil is no finite number.
    broken_coil: Lamp,
    /// The error is beyond the tolerance.
    beyond: Lamp,
    states: [Option<&'static str>; LANES.len()],
    guard_event: u64,
    guard_quiet_until: u64,
    /// Lines for the event table.
    pub events: Vec<Event>,
    /// Changes of the state lanes.
    pub changes: Vec<StateChange>,
}

impl Watch {
    /// Looks at ticks.
    pub fn rows(&mut self, rows: &[Row], has: Presence, run: &RunInfo) {
        let quiet_ticks = ((QUIET_S / run.tick_s) as u64).max(1);
        for row in rows {
            let words = [
                row.estimate.status,
                row.demand.status,
                row.field_command.status,
                row.safe_field.status,
                row.coil_field.status,
            ];
            // All of them looked at, without a call.
            let changes = words
                .iter()
                .zip(&self.words)
                .fold(0, |all, (word, last)| all | (word ^ last));
            if changes != 0 || row.tick >= self.due {
                self.words = words;
                self.flags(row, run, quiet_ticks);
                self.lanes(row.tick);
            }
            self.coil(row, quiet_ticks);
            self.error(row, has, run, quiet_ticks);
            self.guard(row, run, quiet_ticks);
        }
    }

    fn flags(&mut self, row: &Row, run: &RunInfo, quiet_ticks: u64) {
        let tick = row.tick;
        for (flag, lamp) in FLAGS.iter().zip(&mut self.lamps) {
            let on = status(flag.channel, row) & flag.bit != 0;
            let Some(changes) = lamp.update(on, tick, quiet_ticks) else {
                continue;
            };
            let (what, level) = if on {
                (flag.set, flag.level)
            } else {
                (flag.cleared, Level::Info)
            };
            let often = if changes > 1 {
                format!(", {changes} changes")
            } else {
                String::new()
            };
            let text = format!("{what} ({}{often})", detail(flag.channel, row, &run.scales));
            self.events.push(Event {
                tick,
                source: flag.channel.producer().name(),
                level,
                text,
            });
        }
        let waiting = self.lamps.iter().filter(|lamp| lamp.now != lamp.shown);
        self.due = waiting.map(|lamp| lamp.quiet_until).min().unwrap_or(u64::MAX);
    }

    /// What an amplifier says of the coil may be no number; no status bit tells.
    fn coil(&mut self, row: &Row, quiet_ticks: u64) {
        let broken = !row.coil_field.field_a_per_m.is_finite();
        if self.broken_coil.update(broken, row.tick, quiet_ticks).is_some() {
            let (level, text) = if broken {
                (Level::Error, "coil field not finite")
            } else {
                (Level::Info, "coil field finite again")
            };
            self.events.push(Event {
                tick: row.tick,
                source: "amplifier",
                level,
                text: text.into(),
            });
        }
    }

    /// After settling.
    fn error(&mut self, row: &Row, has: Presence, run: &RunInfo, quiet_ticks: u64) {
        if (row.tick as f64) * run.tick_s < run.settling_time_s {
            return;
        }
        let error_m = row.judged_error_m(has);
        let beyond = error_m.abs() > run.tolerance_m;
        if self.beyond.update(beyond, row.tick, quiet_ticks).is_some() {
            let scale = &run.scales.error;
            let (level, text) = if beyond {
                (
                    Level::Error,
                    format!(
                        "error {:.1} {}: beyond the tolerance",
                        error_m * scale.factor,
                        scale.unit
                    ),
                )
            } else {
                (Level::Info, "error within the tolerance again".into())
            };
            self.events.push(Event {
                tick: row.tick,
                source: "run",
                level,
                text,
            });
        }
    }

    /// Tells the states again in the next tick: in a part of a recording they stand from its beginning.
    pub fn tell_states_again(&mut self) {
        self.states = Default::default();
        self.due = 0;
    }

    /// True if an event since the last sending is worth keeping what surrounds it.
    pub fn matters(&self) -> bool {
        self.events.iter().any(|event| event.level != Level::Info)
    }

    /// What was, tick by tick: the lanes are no list to be read.
    fn lanes(&mut self, tick: u64) {
        for (lane, (channel, idle)) in LANES.iter().enumerate() {
            let mut shown = FLAGS
                .iter()
                .zip(&self.lamps)
                .filter(|(flag, lamp)| flag.channel == *channel && lamp.now);
            let state = shown.next_back().map_or(*idle, |(flag, _)| flag.state);
            if self.states[lane] != Some(state) {
                self.states[lane] = Some(state);
                self.changes.push(StateChange { tick, lane, state });
            }
        }
    }

    fn guard(&mut self, row: &Row, run: &RunInfo, quiet_ticks: u64) {
        let number = row.safe_field.event;
        if number == 0 || (number == self.guard_event && row.tick < self.guard_quiet_until) {
            return;
        }
        self.guard_event = number;
        self.guard_quiet_until = row.tick + quiet_ticks;
        let known = run.event(number);
        let text = known.map_or_else(|| format!("event {number}"), |event| event.text.clone());
        let level = known.map_or(Level::Warning, |event| event.level);
        self.events.push(Event {
            tick: row.tick,
            source: "guard",
            level,
            text,
        });
    }

    /// Adds what the run came to.
    pub fn judge(&mut self, level: Level, text: String) {
        self.events.push(Event {
            tick: 0,
            source: VERDICT,
            level,
            text,
        });
    }

    /// Adds a line about the run itself.
    pub fn about_run(&mut self, tick: u64, level: Level, text: String) {
        self.events.push(Event {
            tick,
            source: "run",
            level,
            text,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lamp_reports(bits: impl Iterator<Item = bool>) -> Vec<(u64, u32)> {
        let mut lamp = Lamp::default();
        (0..)
            .zip(bits)
            .filter_map(|(tick, on)| lamp.update(on, tick, 10).map(|changes| (tick, changes)))
            .collect()
    }

    /// Guards the lanes against thinning: each state is there in its tick, however the bit chatters.
    #[test]
    fn the_lanes_show_what_was() {
        use anhyst_ipc::{Demand, status_word};
        let mut watch = Watch::default();
        let run = crate::run::tests::run();
        for tick in 0..1000 {
            let mut row = Row { tick, ..Row::default() };
            row.demand.status = status_word([(tick % 3 == 1, Demand::INTEGRATION_STOPPED)]);
            watch.rows(&[row], Presence::default(), &run);
        }
        let controller = |change: &&StateChange| change.state == "anti-windup";
        let seen: Vec<u64> = watch
            .changes
            .iter()
            .filter(controller)
            .map(|change| change.tick)
            .collect();
        assert_eq!(seen, (0..1000).filter(|tick| tick % 3 == 1).collect::<Vec<_>>());
        assert!(watch.events.len() < 40, "{} events", watch.events.len());
    }

    /// Guards a part of a recording that begins while nothing changes.
    #[test]
    fn states_are_told_again_where_nothing_changes() {
        let mut watch = Watch::default();
        let run = crate::run::tests::run();
        for tick in 0..3 {
            if tick == 2 {
                watch.tell_states_again();
            }
            watch.rows(&[Row { tick, ..Row::default() }], Presence::default(), &run);
        }
        let ticks: Vec<u64> = watch.changes.iter().map(|change| change.tick).collect();
        assert_eq!(ticks, [[0; LANES.len()], [2; LANES.len()]].concat());
    }

    /// Guards the name of what no status bit tells.
    #[test]
    fn a_coil_field_that_is_no_number_has_an_event() {
        let mut watch = Watch::default();
        let run = crate::run::tests::run();
        for (tick, field_a_per_m) in (0..).zip([0.0, f64::NAN, f64::NAN, 1.0]) {
            let mut row = Row { tick, ..Row::default() };
            row.coil_field.field_a_per_m = field_a_per_m;
            watch.rows(&[row], Presence::default(), &run);
        }
        let told = watch.events.iter().find(|event| event.source == "amplifier").unwrap();
        assert_eq!((told.tick, told.text.as_str()), (1, "coil field not finite"));
    }

    /// Guards: slow changes are all reported, at their tick.
    #[test]
    fn every_slow_change_is_reported() {
        let bits = (0..100).map(|tick| (20..60).contains(&tick));
        assert_eq!(lamp_reports(bits), [(20, 1), (60, 1)]);
    }

    /// Guards: chatter does not flood the table, and no report hides how often the bit changed.
    #[test]
    fn chatter_is_reported_ever_more_rarely() {
        let reports = lamp_reports((0..10_000).map(|tick| tick % 2 == 1));
        assert!(reports.len() < 40, "{} reports", reports.len());
        assert_eq!(reports[0], (1, 1));
        assert!(reports[1..].iter().all(|(_, changes)| *changes > 1));
    }
}
