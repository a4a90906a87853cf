//! Injected faults of links: what a node sends is changed on its way out, the same bits embedded and in processes.
//!
//! A fault acts on one channel from `from_tick` on for `for_ticks` ticks, on one number of the token or on all. The digest is
//! that of what was sent. One token a tick is sent whatever the fault: a token that is dropped, late, or of a clock that has
//! jumped is the one that the reader would have in its place, stamped with its own tick, so the reader sees its age.

use crate::digest::Digest;
use crate::invalid::Invalid;
use crate::message::{Channel, Field, FieldKind, MAX_FIELDS, Message};
use serde::{Deserialize, Serialize};

/// Longest injected delay.
pub const MAX_DELAY_TICKS: u64 = 64;

/// A fault of what is sent on one channel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TokenFault {
    /// First tick.
    pub from_tick: u64,
    /// How many ticks.
    #[serde(default = "one")]
    pub for_ticks: u64,
    /// Whose tokens.
    pub channel: Channel,
    /// Which number of the token, by its name; none: all of them (counts and flags are left alone).
    #[serde(default)]
    pub field: Option<String>,
    /// What happens to it.
    pub kind: TokenKind,
}

fn one() -> u64 {
    1
}

/// What happens to a token or to a number x in it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum TokenKind {
    /// Nothing comes: the reader has the last token before the fault, with its tick.
    Drop,
    /// The token of so many ticks before, with its tick; before the first one the default token.
    Delay(u64),
    /// The sender's clock jumps by so many ticks: the stamp is wrong, the numbers are right.
    ClockJump(i64),
    /// x stays what it was before the fault, under a fresh tick.
    Freeze,
    /// Not a number.
    Nan,
    /// Infinite, with the sign of x.
    Infinite,
    /// x times this.
    GainStep(f64),
    /// x plus this.
    Offset(f64),
    /// x plus and minus this by turns.
    Spike(f64),
    /// x plus white noise of this rms, nearly normal (twelve uniform numbers), from the run's seed.
    Noise(f64),
    /// x clipped to plus and minus this.
    Saturate(f64),
    /// One bit of x is the other one: 63 the sign, 52 to 62 the exponent.
    BitFlip(u32),
    /// Two neighbours in the token change places: x and the number after it (the last one: the first).
    Swap,
}

impl TokenFault {
    fn acts_at(&self, tick: u64) -> bool {
        tick >= self.from_tick && tick - self.from_tick < self.for_ticks
    }

    /// True if the token's stamp may be another than the tick it is sent in.
    pub fn shifts_ticks(&self) -> bool {
        matches!(
            self.kind,
            TokenKind::Drop | TokenKind::Delay(_) | TokenKind::ClockJump(_)
        )
    }

    /// The tick that the token of tick `tick` is stamped with, if this is its channel's only fault of time.
    pub fn stamp(&self, tick: u64) -> u64 {
        match self.kind {
            _ if !self.acts_at(tick) => tick,
            TokenKind::Drop => self.from_tick.saturating_sub(1),
            TokenKind::Delay(ticks) => tick.saturating_sub(ticks),
            TokenKind::ClockJump(ticks) => tick.saturating_add_signed(ticks),
            _ => tick,
        }
    }

    /// Refuses fields that the token does not have and amounts that are none.
    ///
    /// # Errors
    /// The refusal, with value and limit.
    pub fn validate(&self) -> Result<(), Invalid> {
        if self.for_ticks == 0 {
            return Err(Invalid::new("for_ticks", "0 ticks are no fault; give at least 1"));
        }
        if let Some(name) = &self.field {
            let known = self
                .channel
                .fields()
                .iter()
                .filter(|field| field.kind == FieldKind::F64);
            if !known.clone().any(|field| field.name == name) {
                let names: Vec<&str> = known.map(|field| field.name).collect();
                let sentence = format!("{} has no number \"{name}\"; it has {}", self.channel, names.join(", "));
                return Err(Invalid::new("field", sentence));
            }
        }
        let finite = |value: f64| {
            let refused = || Invalid::new("kind", format!("{value} is no finite number"));
            value.is_finite().then_some(()).ok_or_else(refused)
        };
        match self.kind {
            TokenKind::Delay(ticks) => {
                Invalid::unless_between("kind", ticks as f64, 1.0, MAX_DELAY_TICKS as f64, "ticks")
            }
            TokenKind::ClockJump(0) => Err(Invalid::new("kind", "a jump by 0 ticks does nothing")),
            TokenKind::GainStep(1.0) => Err(Invalid::new("kind", "a gain of 1 does nothing")),
            TokenKind::GainStep(value) | TokenKind::Offset(value) | TokenKind::Spike(value) => finite(value),
            TokenKind::Noise(value) | TokenKind::Saturate(value) => {
                finite(value)?;
                let refused = || Invalid::new("kind", format!("{value} must be at least 0"));
                (value >= 0.0).then_some(()).ok_or_else(refused)
            }
            TokenKind::BitFlip(bit) => Invalid::unless_between("kind", f64::from(bit), 0.0, 63.0, "(bit)"),
            _ => Ok(()),
        }
    }

    /// Which words of the token it acts on.
    fn words(&self) -> impl Iterator<Item = usize> {
        let fields = self.channel.fields();
        fields
            .iter()
            .enumerate()
            .filter(|(_, field)| field.kind == FieldKind::F64)
            .filter(|(_, field)| self.field.as_ref().is_none_or(|name| name == field.name))
            .map(|(index, _)| index)
    }

    fn change(&self, tick: u64, seed: u64, before: &Sent, words: &mut [u64]) {
        for index in self.words() {
            let x = f64::from_bits(words[index]);
            let number = |x: f64| x.to_bits();
            words[index] = match self.kind {
                TokenKind::Freeze => before.words[index],
                TokenKind::Nan => number(f64::NAN),
                TokenKind::Infinite => number(f64::INFINITY.copysign(x)),
                TokenKind::GainStep(factor) => number(x * factor),
                TokenKind::Offset(offset) => number(x + offset),
                TokenKind::Spike(size) if (tick - self.from_tick).is_multiple_of(2) => number(x + size),
                TokenKind::Spike(size) => number(x - size),
                TokenKind::Noise(rms) => number(x + rms * nearly_normal(seed, tick, index as u64)),
                TokenKind::Saturate(limit) => number(if x.is_nan() { x } else { x.clamp(-limit, limit) }),
                TokenKind::BitFlip(bit) => words[index] ^ 1_u64.wrapping_shl(bit),
                TokenKind::Swap | TokenKind::Drop | TokenKind::Delay(_) | TokenKind::ClockJump(_) => words[index],
            };
        }
        if self.kind == TokenKind::Swap {
            let numbers = |field: &&Field| field.kind == FieldKind::F64;
            let first = self.words().next().unwrap_or_default();
            let after = self
                .channel
                .fields()
                .iter()
                .skip(first + 1)
                .position(|field| numbers(&field));
            words.swap(first, after.map_or(0, |distance| first + 1 + distance));
        }
    }
}

/// Mean 0, variance 1: twelve uniform numbers, less six. No transcendental function, so the same bits on every machine.
fn nearly_normal(seed: u64, tick: u64, index: u64) -> f64 {
    let mut digest = Digest(seed);
    let uniform = (0..12).map(|draw| {
        digest.add(tick, &[index, draw]);
        (digest.0 >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    });
    uniform.sum::<f64>() - 6.0
}

/// A token as it was sent.
#[derive(Debug, Clone, Copy)]
struct Sent {
    tick: u64,
    words: [u64; MAX_FIELDS],
}

impl Default for Sent {
    fn default() -> Self {
        Self {
            tick: 0,
            words: [0; MAX_FIELDS],
        }
    }
}

/// One fault and what it remembers.
#[derive(Debug, Clone)]
struct Armed {
    fault: TokenFault,
    /// The last token before the fault.
    before: Sent,
    /// The last tokens, for a delay; empty for the others.
    past: Vec<Sent>,
}

impl Armed {
    fn see(&mut self, seed: u64, tick: u64, stamp: u64, words: &mut [u64]) -> u64 {
        let mut now = Sent {
            tick: stamp,
            ..Sent::default()
        };
        now.words[..words.len()].copy_from_slice(words);
        let late = match self.fault.kind {
            TokenKind::Delay(ticks) => {
                let due = tick
                    .checked_sub(ticks)
                    .map(|due| self.past[due as usize % self.past.len()]);
                let at = tick as usize % self.past.len();
                self.past[at] = now;
                due
            }
            _ => None,
        };
        if !self.fault.acts_at(tick) {
            self.before = now;
            return stamp;
        }
        let replaced = match self.fault.kind {
            TokenKind::Drop => self.before,
            TokenKind::Delay(_) => late.unwrap_or_default(),
            TokenKind::ClockJump(ticks) => return stamp.saturating_add_signed(ticks),
            _ => {
                self.fault.change(tick, seed, &self.before, words);
                return stamp;
            }
        };
        words.copy_from_slice(&replaced.words[..words.len()]);
        replaced.tick
    }
}

/// The faults of one node, in the order in which they stand in the scenario.
#[derive(Debug, Clone, Default)]
pub(crate) struct Injector {
    armed: Vec<Armed>,
    seed: u64,
}

impl Injector {
    /// Room for everything is taken now, so that no step allocates.
    pub fn new<'a>(faults: impl Iterator<Item = &'a TokenFault>, seed: u64) -> Self {
        let armed = faults
            .map(|fault| Armed {
                fault: fault.clone(),
                before: Sent::default(),
                past: match fault.kind {
                    TokenKind::Delay(ticks) => vec![Sent::default(); ticks.clamp(1, MAX_DELAY_TICKS) as usize],
                    _ => Vec::new(),
                },
            })
            .collect();
        Self { armed, seed }
    }

    /// False where nothing ever happens.
    pub fn is_armed(&self) -> bool {
        !self.armed.is_empty()
    }

    /// Lets every fault happen to a token of this tick.
    #[cold]
    pub fn see<M: Message>(&mut self, token: &mut M) {
        let (seed, tick) = (self.seed, token.tick());
        let mut words = [0; MAX_FIELDS];
        token.write_words(&mut words);
        let own = &mut words[..M::FIELDS.len()];
        let mine = self.armed.iter_mut().filter(|armed| armed.fault.channel == M::CHANNEL);
        let stamp = mine.fold(tick, |stamp, armed| armed.see(seed, tick, stamp, own));
        *token = M::from_words(stamp, &words);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::Measurement;

    fn fault(kind: TokenKind, field: Option<&str>) -> TokenFault {
        TokenFault {
            from_tick: 5,
            for_ticks: 3,
            channel: Channel::Measurement,
            field: field.map(str::to_owned),
            kind,
        }
    }

    /// What is sent in ticks 0 to 9 if displacement is the tick, the field 10 times that and the temperature 300 K.
    fn sent(kind: TokenKind, field: Option<&str>) -> Vec<Measurement> {
        let fault = fault(kind, field);
        fault.validate().unwrap();
        let mut injector = Injector::new(std::iter::once(&fault), 7);
        (0..10)
            .map(|tick| {
                let mut token = Measurement {
                    tick,
                    displacement_m: tick as f64,
                    coil_field_a_per_m: 10.0 * tick as f64,
                    temperature_k: 300.0,
                    ..Measurement::default()
                };
                injector.see(&mut token);
                token
            })
            .collect()
    }

    fn displacements(kind: TokenKind) -> Vec<f64> {
        let tokens = sent(kind, Some("displacement_m"));
        // Nothing else is touched.
        assert!(tokens.iter().all(|token| token.temperature_k == 300.0));
        tokens[4..9].iter().map(|token| token.displacement_m).collect()
    }

    /// Guards each kind's meaning, its first and its last tick.
    #[test]
    fn each_kind_does_what_it_says_from_its_first_to_its_last_tick() {
        assert_eq!(displacements(TokenKind::Freeze), [4.0, 4.0, 4.0, 4.0, 8.0]);
        assert_eq!(displacements(TokenKind::GainStep(2.0)), [4.0, 10.0, 12.0, 14.0, 8.0]);
        assert_eq!(displacements(TokenKind::Offset(0.5)), [4.0, 5.5, 6.5, 7.5, 8.0]);
        assert_eq!(displacements(TokenKind::Spike(100.0)), [4.0, 105.0, -94.0, 107.0, 8.0]);
        assert_eq!(displacements(TokenKind::Saturate(6.0)), [4.0, 5.0, 6.0, 6.0, 8.0]);
        assert_eq!(displacements(TokenKind::BitFlip(63)), [4.0, -5.0, -6.0, -7.0, 8.0]);
        assert_eq!(displacements(TokenKind::Infinite)[1], f64::INFINITY);
        let nan = displacements(TokenKind::Nan);
        assert_eq!(nan.iter().filter(|value| value.is_nan()).count(), 3);
        let noisy = displacements(TokenKind::Noise(0.1));
        assert!(noisy[1] != 5.0 && (noisy[1] - 5.0).abs() < 0.6 && noisy == displacements(TokenKind::Noise(0.1)));
        let swapped = sent(TokenKind::Swap, Some("displacement_m"));
        assert_eq!((swapped[5].displacement_m, swapped[5].coil_field_a_per_m), (50.0, 5.0));
    }

    /// Guards the ages that readers see.
    #[test]
    fn late_tokens_carry_their_own_tick() {
        let of = |kind| -> Vec<(u64, f64)> {
            let tokens = sent(kind, None);
            tokens[4..9]
                .iter()
                .map(|token| (token.tick, token.displacement_m))
                .collect()
        };
        assert_eq!(of(TokenKind::Drop), [(4, 4.0), (4, 4.0), (4, 4.0), (4, 4.0), (8, 8.0)]);
        assert_eq!(
            of(TokenKind::Delay(2)),
            [(4, 4.0), (3, 3.0), (4, 4.0), (5, 5.0), (8, 8.0)]
        );
        assert_eq!(
            of(TokenKind::ClockJump(-3)),
            [(4, 4.0), (2, 5.0), (3, 6.0), (4, 7.0), (8, 8.0)]
        );
    }

    /// Guards the sentences of a scenario's check.
    #[test]
    fn faults_that_make_no_sense_are_refused() {
        let unknown = fault(TokenKind::Nan, Some("speed")).validate().unwrap_err();
        assert!(unknown.sentence.contains("displacement_m"), "{unknown}");
        assert!(fault(TokenKind::Nan, Some("tick")).validate().is_err());
        assert!(fault(TokenKind::Delay(65), None).validate().is_err());
        assert!(fault(TokenKind::Offset(f64::NAN), None).validate().is_err());
        let said = |kind| fault(kind, None).validate().unwrap_err().sentence;
        assert_eq!(said(TokenKind::GainStep(f64::INFINITY)), "inf is no finite number");
        assert_eq!(said(TokenKind::Saturate(-1.0)), "-1 must be at least 0");
        assert_eq!(said(TokenKind::Noise(f64::NAN)), "NaN is no finite number");
        assert!(fault(TokenKind::BitFlip(64), None).validate().is_err());
    }

    /// Guards the noise's size: mean 0, rms 1.
    #[test]
    fn noise_has_its_rms() {
        let n = 20_000;
        let draws: Vec<f64> = (0..n).map(|tick| nearly_normal(1, tick, 0)).collect();
        let mean = draws.iter().sum::<f64>() / n as f64;
        let rms = (draws.iter().map(|x| x * x).sum::<f64>() / n as f64).sqrt();
        assert!(mean.abs() < 0.03 && (rms - 1.0).abs() < 0.03, "mean {mean}, rms {rms}");
    }
}
