//! v = H / (c g),  |v| ≤ limit,  |Δv| ≤ slew limit·T;  H' = c m v_monitor
//!
//! H wanted field (A/m), c field per current (1/m), g amplifier's gain (A/V), v command voltage (V), T tick (s); H' field by
//! the current monitor, m its gain (A/V). Token k comes at t_k and is put out at t_k+1, because computing takes its tick: the
//! answer to it, the field at t_k+1, is made of token k−1. A field that is not finite is replaced by the last good one.
//! Faults, latched: too many fields in a row that are not finite, a converter that refuses, a monitor that is further than a
//! limit from the command for longer than a time, a silent guard. In a fault v goes to zero at the slew limit and stays there.
//! Assumption: amplifier and monitor are settled within the tick; a lag shows in `anhyst verify-amplifier --paced`.

use crate::converter::{Converter, ConverterError};
use anhyst_ipc::CoilField;

/// The guard's field was no number; latched, too many were. A driver's own bits are 16 to 31.
pub const NOT_A_NUMBER: u64 = 1 << 16;
/// Fault: the converter refused.
pub const CONVERTER: u64 = 1 << 17;
/// Fault: the current does not follow its command.
pub const NOT_FOLLOWING: u64 = 1 << 18;
/// Fault: the guard was silent.
pub const SILENT: u64 = 1 << 19;

/// What an amplifier and its coil are.
#[derive(Debug, Clone, Copy, PartialEq, clap::Args)]
pub struct Constants {
    /// Field per current of the coil, 1/m: turns over length.
    #[arg(long, default_value_t = 9000.0)]
    pub field_per_current_per_m: f64,
    /// Gain of the amplifier, A/V.
    #[arg(long, default_value_t = 1.0)]
    pub gain_a_per_v: f64,
    /// Gain of the current monitor, A/V.
    #[arg(long, default_value_t = 1.0)]
    pub monitor_a_per_v: f64,
    /// Largest command, V.
    #[arg(long, default_value_t = 5.0)]
    pub limit_v: f64,
    /// Fastest change of the command, V/s.
    #[arg(long, default_value_t = 20e3)]
    pub slew_limit_v_per_s: f64,
    /// Largest difference of monitor and command, V.
    #[arg(long, default_value_t = 0.5)]
    pub following_limit_v: f64,
    /// How long it may be larger, s.
    #[arg(long, default_value_t = 2e-3)]
    pub following_time_s: f64,
    /// So many fields in a row may be no numbers: the last good one is held meanwhile.
    #[arg(long, default_value_t = 20)]
    pub broken_ticks: u32,
}

impl Constants {
    /// Checks that all are positive.
    ///
    /// # Errors
    /// A sentence with the first that is not.
    pub fn validate(&self) -> Result<(), String> {
        let all = [
            ("field per current", self.field_per_current_per_m, "1/m"),
            ("gain", self.gain_a_per_v, "A/V"),
            ("monitor's gain", self.monitor_a_per_v, "A/V"),
            ("voltage limit", self.limit_v, "V"),
            ("slew limit", self.slew_limit_v_per_s, "V/s"),
            ("following limit", self.following_limit_v, "V"),
            ("following time", self.following_time_s, "s"),
        ];
        match all.iter().find(|(_, value, _)| !(value.is_finite() && *value > 0.0)) {
            Some((name, value, unit)) => Err(format!("the {name} is {value} {unit}; it must be positive")),
            None => Ok(()),
        }
    }
}

/// The amplifier behind a converter.
pub struct Drive<C> {
    converter: C,
    constants: Constants,
    tick_s: f64,
    due_a_per_m: f64,
    broken_ticks: u32,
    command_v: f64,
    apart_s: f64,
    faults: u64,
}

impl<C: Converter> Drive<C> {
    /// Puts out zero.
    ///
    /// # Errors
    /// If the converter refuses.
    pub fn start(mut converter: C, constants: Constants, tick_s: f64) -> Result<Self, ConverterError> {
        converter.write_volts(0.0)?;
        Ok(Self {
            converter,
            constants,
            tick_s,
            due_a_per_m: 0.0,
            broken_ticks: 0,
            command_v: 0.0,
            apart_s: 0.0,
            faults: 0,
        })
    }

    /// Takes the field that is wanted after this tick, and puts out the one before it: the field by the monitor, and a status.
    pub fn step(&mut self, wanted_a_per_m: f64) -> (f64, u64) {
        let due_a_per_m = self.due_a_per_m;
        let broken = self.accept(wanted_a_per_m);
        let constants = self.constants;
        let field_per_volt = constants.field_per_current_per_m * constants.gain_a_per_v;
        let wanted_v = if self.faults == 0 {
            due_a_per_m / field_per_volt
        } else {
            0.0
        };
        let limited_v = wanted_v.clamp(-constants.limit_v, constants.limit_v);
        let most_v = constants.slew_limit_v_per_s * self.tick_s;
        let next_v = limited_v.clamp(self.command_v - most_v, self.command_v + most_v);
        let mut status = broken
            | if limited_v == wanted_v {
                0
            } else {
                CoilField::AMPLITUDE_LIMITED
            };
        status |= if next_v == limited_v {
            0
        } else {
            CoilField::SLEW_LIMITED
        };
        if self.converter.write_volts(next_v).is_err() {
            self.faults |= CONVERTER;
        }
        self.command_v = next_v;
        let monitor_a_per_m = match self.converter.read_volts() {
            Ok(volts) => {
                self.watch(volts * constants.monitor_a_per_v / constants.gain_a_per_v);
                volts * constants.monitor_a_per_v * constants.field_per_current_per_m
            }
            Err(_) => {
                self.faults |= CONVERTER;
                next_v * field_per_volt
            }
        };
        (monitor_a_per_m, status | self.faults)
    }

    /// Keeps a field for the next tick, or the one before it in place of no number; what the status says about it.
    fn accept(&mut self, wanted_a_per_m: f64) -> u64 {
        if wanted_a_per_m.is_finite() {
            self.broken_ticks = 0;
            self.due_a_per_m = wanted_a_per_m;
            return 0;
        }
        self.broken_ticks += 1;
        if self.broken_ticks > self.constants.broken_ticks {
            self.faults |= NOT_A_NUMBER;
        }
        NOT_A_NUMBER
    }

    /// `followed_v` is the command that the monitored current belongs to.
    fn watch(&mut self, followed_v: f64) {
        let apart = (followed_v - self.command_v).abs() > self.constants.following_limit_v;
        self.apart_s = if apart { self.apart_s + self.tick_s } else { 0.0 };
        if self.apart_s > self.constants.following_time_s {
            self.faults |= NOT_FOLLOWING;
        }
    }

    /// Takes the output to zero on our own clock, and `tell`s each tick's field and status; latches `fault` (0: a regular end).
    pub fn make_safe(&mut self, fault: u64, tell: &mut dyn FnMut(f64, u64)) {
        self.faults |= fault;
        let field_per_volt = self.constants.field_per_current_per_m * self.constants.gain_a_per_v;
        let most_v = self.constants.slew_limit_v_per_s * self.tick_s;
        loop {
            self.command_v -= self.command_v.clamp(-most_v, most_v);
            // A converter that refuses is asked again in the next tick: there is nothing better to do.
            let written = self.converter.write_volts(self.command_v);
            let zero = self.command_v == 0.0;
            // Nobody knows what is put out by a converter that refuses.
            let said = if zero && written.is_ok() {
                CoilField::SAFE
            } else {
                CoilField::RAMPING
            };
            tell(self.command_v * field_per_volt, self.faults | said);
            if zero {
                return;
            }
            std::thread::sleep(std::time::Duration::from_secs_f64(self.tick_s));
        }
    }
}

impl<C> Drive<C> {
    /// Faults so far.
    pub fn faults(&self) -> u64 {
        self.faults
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A board in memory: its monitor follows until it is `stuck`.
    #[derive(Default)]
    struct Board {
        volts: f64,
        stuck: bool,
        monitor: f64,
    }

    impl Converter for Board {
        fn write_volts(&mut self, volts: f64) -> Result<(), ConverterError> {
            self.volts = volts;
            if !self.stuck {
                self.monitor = volts;
            }
            Ok(())
        }
        fn read_volts(&mut self) -> Result<f64, ConverterError> {
            Ok(self.monitor)
        }
    }

    fn drive() -> Drive<Board> {
        let constants = Constants {
            field_per_current_per_m: 1000.0,
            gain_a_per_v: 2.0,
            monitor_a_per_v: 2.0,
            limit_v: 5.0,
            slew_limit_v_per_s: 10e3,
            following_limit_v: 0.5,
            following_time_s: 1e-3,
            broken_ticks: 5,
        };
        constants.validate().unwrap();
        Drive::start(Board::default(), constants, 1e-4).unwrap()
    }

    /// Guards the loop's timing, units and both limits: the field of the tick before; 2000 A/m are 1 V; 1 V a tick; 5 V at most.
    #[test]
    fn fields_become_volts_within_limits() {
        let mut drive = drive();
        assert_eq!(drive.step(2000.0), (0.0, 0));
        assert_eq!(drive.step(6000.0), (2000.0, 0));
        assert_eq!(drive.step(6000.0), (4000.0, CoilField::SLEW_LIMITED));
        for _ in 0..10 {
            drive.step(1e6);
        }
        assert_eq!(drive.step(1e6), (10_000.0, CoilField::AMPLITUDE_LIMITED));
    }

    /// Guards the coil: each fault takes the output to zero, and it stays there.
    #[test]
    fn faults_end_at_zero_and_stay() {
        let mut drive = drive();
        drive.step(2000.0);
        for _ in 0..6 {
            drive.step(f64::NAN);
        }
        assert_eq!(drive.converter.volts, 0.0);
        assert_eq!(drive.step(2000.0), (0.0, NOT_A_NUMBER));
        assert_eq!(drive.step(2000.0), (0.0, NOT_A_NUMBER));

        let mut drive = self::drive();
        drive.converter.stuck = true;
        for _ in 0..14 {
            drive.step(4000.0);
        }
        assert_eq!(drive.faults(), NOT_FOLLOWING);
        for _ in 0..3 {
            drive.step(4000.0);
        }
        assert_eq!(drive.converter.volts, 0.0);

        let mut drive = self::drive();
        drive.step(6000.0);
        drive.step(6000.0);
        drive.step(6000.0);
        let mut told = Vec::new();
        drive.make_safe(SILENT, &mut |field_a_per_m, status| told.push((field_a_per_m, status)));
        assert_eq!((drive.converter.volts, drive.faults()), (0.0, SILENT));
        assert_eq!(
            told,
            [(2000.0, SILENT | CoilField::RAMPING), (0.0, SILENT | CoilField::SAFE)]
        );
    }

    /// Guards the coil against a few broken tokens: no step, and no latched fault that ends the run.
    #[test]
    fn a_few_fields_that_are_no_numbers_are_bridged() {
        let mut drive = drive();
        drive.step(1000.0);
        for broken in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, f64::NAN] {
            assert_eq!(drive.step(broken), (1000.0, NOT_A_NUMBER));
        }
        assert_eq!(drive.step(1500.0), (1000.0, 0));
        assert_eq!((drive.step(1500.0), drive.faults()), ((1500.0, 0), 0));
    }
}
