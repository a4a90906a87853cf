//! The amplifier's own watchdog: H_cmd = H_safe + w(H_0 − H_safe), w from 1 to 0 in a straight line when nobody commands.
//!
//! H_0 the command given last (A/m), H_safe the amplifier's own safe field (A/m), w no unit. It needs nobody: a controller
//! that is dead, hung, or sends no numbers ends at the safe field. Back again: fresh commands for the ramp's time in a row,
//! then w goes from 0 to 1 along a straight line towards what is commanded, so nothing steps.
//! Silent is a token older than `silent_ticks`, or as many ticks in a row without a number in it.

use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// Settings of the watchdog.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WatchdogSettings {
    /// How old a command may be; until then it is used as it is.
    pub silent_ticks: u64,
    /// Where the amplifier goes by itself, A/m.
    pub safe_field_a_per_m: f64,
    /// How long it takes to go there from wherever it is, s.
    pub ramp_time_s: f64,
}

impl Default for WatchdogSettings {
    fn default() -> Self {
        Self {
            silent_ticks: 3,
            safe_field_a_per_m: 0.0,
            ramp_time_s: 0.02,
        }
    }
}

impl WatchdogSettings {
    /// Refuses what no watchdog can be told.
    ///
    /// # Errors
    /// The first refusal, with value and limit.
    pub fn validate(&self) -> Result<(), Invalid> {
        Invalid::unless_between("silent_ticks", self.silent_ticks as f64, 0.0, 1e6, "ticks")?;
        Invalid::unless_between("safe_field_a_per_m", self.safe_field_a_per_m, -1e9, 1e9, "A/m")?;
        Invalid::unless_between("ramp_time_s", self.ramp_time_s, 0.0, 60.0, "s")
    }

    /// Ticks of the ramp.
    pub fn ramp_ticks(&self, tick_s: f64) -> u64 {
        // The quotient's own rounding is no tick.
        ((self.ramp_time_s / tick_s - 1e-6).ceil() as u64).max(1)
    }

    /// Ticks from the last usable command until the command inside the amplifier is the safe field: the stated bound. The
    /// coil follows after the amplifier's delay and lag.
    pub fn most_ticks_to_safe(&self, tick_s: f64) -> u64 {
        self.silent_ticks
            .saturating_add(1)
            .saturating_add(self.ramp_ticks(tick_s))
    }
}

/// Who commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Mode {
    Following,
    Ramping,
    Safe,
    Returning,
}

/// The watchdog in motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Watchdog {
    settings: WatchdogSettings,
    ramp_ticks: u64,
    mode: Mode,
    /// The command given last, and the one at which the ramp began.
    last_a_per_m: f64,
    from_a_per_m: f64,
    /// Ticks into the ramp, of either direction.
    ramped: u64,
    unusable_ticks: u64,
    heard_ticks: u64,
}

impl Watchdog {
    pub fn new(settings: &WatchdogSettings, tick_s: f64) -> Result<Self, Invalid> {
        settings.validate()?;
        Ok(Self {
            settings: *settings,
            ramp_ticks: settings.ramp_ticks(tick_s),
            mode: Mode::Following,
            last_a_per_m: 0.0,
            from_a_per_m: 0.0,
            ramped: 0,
            unusable_ticks: 0,
            heard_ticks: 0,
        })
    }

    pub fn mode(&self) -> Mode {
        self.mode
    }

    pub fn safe_field_a_per_m(&self) -> f64 {
        self.settings.safe_field_a_per_m
    }

    /// The command that the amplifier acts on; always finite.
    pub fn command(&mut self, wanted_a_per_m: f64, age_ticks: u64) -> f64 {
        let usable = wanted_a_per_m.is_finite();
        self.unusable_ticks = if usable {
            0
        } else {
            self.unusable_ticks.saturating_add(1)
        };
        let most = self.settings.silent_ticks;
        let heard = age_ticks <= most && self.unusable_ticks <= most;
        let wanted = if usable { wanted_a_per_m } else { self.last_a_per_m };
        self.advance(wanted, heard)
    }

    /// A tick in which the link itself is gone.
    pub fn command_alone(&mut self) -> f64 {
        self.advance(self.last_a_per_m, false)
    }

    fn advance(&mut self, wanted_a_per_m: f64, heard: bool) -> f64 {
        self.heard_ticks = if heard { self.heard_ticks.saturating_add(1) } else { 0 };
        match self.mode {
            Mode::Following | Mode::Returning if !heard => {
                (self.mode, self.from_a_per_m, self.ramped) = (Mode::Ramping, self.last_a_per_m, 0);
            }
            Mode::Safe if self.heard_ticks >= self.ramp_ticks => {
                (self.mode, self.ramped) = (Mode::Returning, 0);
            }
            _ => {}
        }
        let safe = self.settings.safe_field_a_per_m;
        self.ramped = self.ramped.saturating_add(1).min(self.ramp_ticks);
        let part = self.ramped as f64 / self.ramp_ticks as f64;
        self.last_a_per_m = match self.mode {
            Mode::Following => wanted_a_per_m,
            Mode::Safe => safe,
            Mode::Ramping => safe + (1.0 - part) * (self.from_a_per_m - safe),
            Mode::Returning if part == 1.0 => wanted_a_per_m,
            Mode::Returning => safe + part * (wanted_a_per_m - safe),
        };
        if self.ramped == self.ramp_ticks {
            self.mode = match self.mode {
                Mode::Ramping => Mode::Safe,
                Mode::Returning => Mode::Following,
                same => same,
            };
        }
        self.last_a_per_m
    }
}
