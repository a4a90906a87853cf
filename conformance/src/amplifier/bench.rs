//! The other end of the process that is tested: one process that stands for all others of the loop, sends safe fields and
//! takes coil fields.

use super::program::Program;
use super::transcript::{Aftermath, Answer, End, Transcript};
use anhyst_ipc::{
    CoilField, Connections, Layout, LinkError, Message, NodeId, Receiver, SafeField, Sender, SharedContext,
    SharedSettings, Wire, stop_requested,
};
use std::rc::Rc;
use std::time::{Duration, Instant};

/// So long the process may take to make its channels before ours are made: a foreign layout is then seen, not refused.
const CHANNELS_FIRST: Duration = Duration::from_secs(2);
const LOOK: Duration = Duration::from_millis(2);
/// So many answers may be missing, and so many in a row, before the process counts as silent.
const MAX_MISSING: usize = 5;
const MAX_MISSING_IN_A_ROW: usize = 3;
/// A process that repeats itself more often than this within a tick counts as silent.
const MAX_REPEATED: usize = 1000;
const HOUSEKEEPING_TICKS: usize = 64;

/// A channel whose tokens are not ours.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Foreign {
    /// Which.
    pub channel: &'static str,
    /// What the process offers.
    pub found: Layout,
    /// What the loop speaks.
    pub expected: Layout,
}

/// What meeting the process came to.
pub enum Met {
    /// Tick 0 may begin.
    Ready(Box<Bench>),
    /// It speaks another language.
    Foreign(Vec<Foreign>),
}

/// The links to the process that is tested.
pub struct Bench {
    sender: Sender<SafeField>,
    answers: Receiver<CoilField>,
    /// The amplifier counts its readers; these are the others that it knows of.
    _others: Vec<Receiver<CoilField>>,
    shared: Rc<SharedContext>,
    _connections: Connections,
}

fn foreign<M: Message>(prefix: &str, root: &std::path::Path) -> Result<(bool, Option<Foreign>), LinkError> {
    let expected = Layout::of::<M>();
    let Some(found) = Layout::offered::<M>(prefix, root)? else {
        return Ok((false, None));
    };
    let differs = found != expected;
    Ok((
        true,
        differs.then_some(Foreign {
            channel: M::CHANNEL.name(),
            found,
            expected,
        }),
    ))
}

impl Bench {
    /// Waits for the process named `driver`, looks at what it offers, and meets it.
    ///
    /// # Errors
    /// If it does not come within the start limit, disagrees, or a channel cannot be opened.
    pub fn meet(settings: SharedSettings, driver: &str, wires: &[Wire]) -> Result<Met, LinkError> {
        let (prefix, root) = (settings.prefix.clone(), settings.root.clone());
        let local: Vec<NodeId> = settings
            .processes
            .iter()
            .filter(|(name, _)| *name == settings.process)
            .flat_map(|(_, nodes)| nodes.clone())
            .collect();
        let shared = Rc::new(SharedContext::open(settings)?);
        let start = Instant::now();
        loop {
            let (answers_made, answers) = foreign::<CoilField>(&prefix, &root)?;
            let (commands_made, commands) = foreign::<SafeField>(&prefix, &root)?;
            let found: Vec<Foreign> = [answers, commands].into_iter().flatten().collect();
            if !found.is_empty() {
                return Ok(Met::Foreign(found));
            }
            let has_ports = answers_made && commands_made && shared.phase_of(driver).is_some_and(|phase| phase > 0);
            if has_ports || start.elapsed() > CHANNELS_FIRST {
                break;
            }
            std::thread::sleep(LOOK);
        }
        let mut connections = Connections::new(local, wires.to_vec(), Some(shared.clone()));
        let mut sender = connections.sender::<SafeField>()?;
        // The recorder's end is the deepest: an amplifier that goes to the safe field all at once is still heard.
        let answers = connections.receiver::<CoilField>(NodeId::Recorder, 0)?;
        let others = wires
            .iter()
            .filter(|wire| wire.channel == CoilField::CHANNEL && wire.reader != NodeId::Recorder)
            .map(|wire| connections.receiver::<CoilField>(wire.reader, 0))
            .collect::<Result<_, _>>()?;
        connections.start_barriers(&mut || sender.connect())?;
        Ok(Met::Ready(Box::new(Bench {
            sender,
            answers,
            _others: others,
            shared,
            _connections: connections,
        })))
    }

    /// Commands a program and takes the answers; `pace` is the least time from one command to the next.
    pub fn run(&mut self, program: &Program, pace: Option<Duration>, progress: &mut dyn FnMut(u64)) -> Transcript {
        let mut transcript = Transcript::with_capacity(program.commands.len());
        let mut missing_in_a_row = 0;
        let begin = Instant::now();
        for (tick, command) in program.commands.iter().enumerate() {
            if let Some(pace) = pace {
                wait_until(begin, pace, tick);
            }
            let before = transcript.missing;
            if let Err(end) = self.tick(tick as u64, *command, &mut transcript) {
                transcript.end = end;
                break;
            }
            missing_in_a_row = if transcript.missing > before {
                missing_in_a_row + 1
            } else {
                0
            };
            if missing_in_a_row >= MAX_MISSING_IN_A_ROW || transcript.missing >= MAX_MISSING {
                transcript.end = End::Silent(format!(
                    "{} answers are missing, the last of them that to tick {tick}",
                    transcript.missing
                ));
                break;
            }
            if tick % HOUSEKEEPING_TICKS == 0 {
                self.shared.set_tick(tick as u64);
                progress(tick as u64);
            }
        }
        transcript
    }

    fn tick(&mut self, tick: u64, command: f64, transcript: &mut Transcript) -> Result<(), End> {
        let token = SafeField {
            tick,
            field_a_per_m: command,
            ..SafeField::default()
        };
        let begin = Instant::now();
        self.sender.send(token).map_err(end)?;
        let answer = self.answer(tick, transcript)?;
        match answer {
            Some(answer) => {
                transcript.latencies_s.push(begin.elapsed().as_secs_f64());
                transcript.answers.push(answer);
            }
            None => {
                transcript.missing += 1;
                let last = transcript.answers.last().copied();
                transcript.answers.push(last.unwrap_or(Answer {
                    field_a_per_m: 0.0,
                    status: 0,
                }));
            }
        }
        Ok(())
    }

    /// The answer to a tick; none if it does not come in time.
    fn answer(&mut self, tick: u64, transcript: &mut Transcript) -> Result<Option<Answer>, End> {
        for _ in 0..MAX_REPEATED {
            match self.answers.receive_next(tick) {
                Ok(token) if token.tick < tick => {
                    // One that was given up comes late, or one comes again.
                    transcript.repeated += 1;
                }
                Ok(token) => {
                    transcript.wrong += usize::from(token.tick > tick);
                    return Ok(Some(Answer {
                        field_a_per_m: token.field_a_per_m,
                        status: token.status,
                    }));
                }
                Err(LinkError::Silent { .. }) => return Ok(None),
                Err(error) => return Err(end(error)),
            }
        }
        Err(End::Silent(format!("it repeats itself in tick {tick} without end")))
    }

    /// Commands nothing more and listens until the field is at `safe_field_a_per_m` and nothing more comes, at most `limit`.
    pub fn listen(&mut self, tick: u64, limit: Duration, is_safe: &dyn Fn(f64) -> bool) -> Aftermath {
        let mut aftermath = Aftermath::default();
        let begin = Instant::now();
        let mut safe = false;
        while begin.elapsed() < limit {
            match self.answers.receive_next(tick) {
                Ok(token) => {
                    aftermath
                        .answers
                        .push((begin.elapsed().as_secs_f64(), token.field_a_per_m));
                    safe = is_safe(token.field_a_per_m);
                }
                Err(LinkError::Silent { .. }) if !safe => {}
                Err(_) => break,
            }
        }
        aftermath.listened_s = begin.elapsed().as_secs_f64();
        aftermath
    }
}

fn end(error: LinkError) -> End {
    match error {
        LinkError::Stopped { .. } => End::Stopped,
        other => End::Gone(other.to_string()),
    }
}

/// Waits for the moment of a tick: by sleeping while it is far, by looking when it is near.
fn wait_until(begin: Instant, pace: Duration, tick: usize) {
    let due = pace.mul_f64(tick as f64);
    while let Some(left) = due.checked_sub(begin.elapsed()).filter(|left| !left.is_zero()) {
        if stop_requested() {
            return;
        }
        if left > Duration::from_micros(200) {
            std::thread::sleep(left - Duration::from_micros(100));
        } else {
            std::thread::yield_now();
        }
    }
}
