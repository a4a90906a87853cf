//! A process that brings its own nodes: a driver, a rig, another language. It opens channels by number, needs neither
//! blocks nor the loop's wiring nor the scenario, and keeps the same rules as everybody else: the barriers of the start, then
//! in lockstep one token a tick and channel, gaps being errors, and in real time the newest token, older ones being dropped.

use crate::clock::monotonic_ns;
use crate::error::LinkError;
use crate::external_clock::ExternalClock;
use crate::message::{Channel, NodeId};
use crate::newest::Newest;
use crate::pace::Pace;
use crate::raw::RawToken;
use crate::shared::{ANY_AGREEMENT, CONNECTED, RawReceiver, RawSender, SharedContext, SharedSettings, Wait};
use crate::stop::stop_requested;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::rc::Rc;
use std::time::{Duration, Instant};

/// Whoever waits looks this often whether the run is over.
const LOOK: Duration = Duration::from_millis(20);
/// A plant waits for the recorder when it is so many ticks ahead: half of the recorder's buffer.
const CREDIT_TICKS: u64 = 4096;
/// From the moment at which a plant says when tick 0 begins to that tick: the others need to hear of it.
const RUN_UP_NS: u64 = 20_000_000;

/// Who an external node is and where it meets the others.
#[derive(Debug, Clone, PartialEq)]
pub struct ExternalSettings {
    /// Name of its process, as in `processes`: `amplifier`, or `plant-sim+amplifier` for a whole rig.
    pub process: String,
    /// Prefix of the run's iceoryx2 resources.
    pub prefix: String,
    /// Directory of iceoryx2's files.
    pub root: PathBuf,
    /// All processes of the run, by name, with commas between; nodes that share a process have a `+` between. None: one
    /// process each.
    pub processes: Option<String>,
    /// The channels that it reads.
    pub reads: Vec<Channel>,
    /// Polls before it sleeps.
    pub yields: u32,
    /// How long the others may take to appear, and at the end to finish.
    pub start_limit: Duration,
}

/// What waiting for a token came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Received {
    /// A token of this tick.
    Token(u64),
    /// Nothing within the limit.
    Silence,
    /// The sender has come to the end of the run: there will be no more.
    End,
}

/// A channel that is read.
struct Input {
    receiver: RawReceiver,
    /// The next tick.
    due: u64,
    /// In real time.
    newest: Option<Newest>,
}

impl Input {
    /// The next token; in real time the newest that is newer than the one taken last.
    fn receive(&mut self, limit: Duration) -> Result<Option<RawToken>, LinkError> {
        let Self { receiver, due, newest } = self;
        receiver.wait(limit, || {
            let Some(newest) = newest else { return receiver.poll() };
            newest.catch_up(monotonic_ns(), || receiver.poll())?;
            Ok(newest.token().filter(|token| token.tick() >= *due).copied())
        })
    }
}

/// A foreign process's place in the loop. It sends on every channel that its nodes produce.
pub struct ExternalNode {
    inputs: BTreeMap<Channel, Input>,
    outputs: BTreeMap<Channel, RawSender>,
    reader: NodeId,
    recorder: Option<String>,
    start_limit: Duration,
    ended: bool,
    /// In real time.
    pace: Option<Rc<Pace>>,
    /// In real time, once it is known: when tick 0 begins.
    epoch_ns: Option<u64>,
    // Last: the node goes after its ports.
    context: Rc<SharedContext>,
}

/// Reads `plant-sim,estimator,controller+inverse,…`; none: one process a node.
///
/// # Errors
/// [`LinkError::UnknownProcess`] for a name that is no node's.
pub fn processes(text: Option<&str>) -> Result<Vec<(String, Vec<NodeId>)>, LinkError> {
    let Some(text) = text else {
        return Ok(NodeId::LOOP_ORDER
            .map(|node| (node.name().to_owned(), vec![node]))
            .into());
    };
    let process = |name: &str| {
        let nodes: Option<Vec<NodeId>> = name.split('+').map(NodeId::named).collect();
        nodes
            .map(|nodes| (name.to_owned(), nodes))
            .ok_or_else(|| unknown(name, &NodeId::LOOP_ORDER.map(NodeId::name).join(", ")))
    };
    text.split(',').map(str::trim).map(process).collect()
}

fn unknown(name: &str, processes: &str) -> LinkError {
    LinkError::UnknownProcess {
        name: name.into(),
        processes: processes.into(),
    }
}

impl ExternalNode {
    /// Opens its channels and meets the other processes; when it returns, tick 0 may begin.
    ///
    /// # Errors
    /// A name that does not belong to the run, a process that does not come, or what iceoryx2 refuses.
    pub fn open(settings: ExternalSettings, clock: ExternalClock) -> Result<Self, LinkError> {
        let processes = processes(settings.processes.as_deref())?;
        let Some((_, nodes)) = processes.iter().find(|(name, _)| *name == settings.process) else {
            let names: Vec<&str> = processes.iter().map(|(name, _)| name.as_str()).collect();
            return Err(unknown(&settings.process, &names.join(", ")));
        };
        let nodes = nodes.clone();
        let reader = nodes.first().copied().unwrap_or(NodeId::Amplifier);
        let context = Rc::new(SharedContext::open(SharedSettings {
            prefix: settings.prefix,
            root: settings.root,
            process: settings.process,
            processes,
            agreement: ANY_AGREEMENT,
            wait: Wait::Notified {
                yields: settings.yields,
            },
            receive_limit: settings.start_limit,
            start_limit: settings.start_limit,
        })?);
        let mut external = Self {
            inputs: BTreeMap::new(),
            outputs: BTreeMap::new(),
            reader,
            recorder: context.process_of(NodeId::Recorder).map(str::to_owned),
            start_limit: settings.start_limit,
            ended: false,
            pace: match clock {
                ExternalClock::Lockstep => None,
                ExternalClock::Realtime { tick } => Some(Rc::new(Pace::new(&nodes, tick, false))),
            },
            epoch_ns: None,
            context,
        };
        external.open_channels(&nodes, &settings.reads)?;
        let (context, outputs) = (&external.context, &mut external.outputs);
        context.start_barriers(&mut || {
            outputs
                .values_mut()
                .try_for_each(|output| output.connect_to_all(context))
        })?;
        // Nobody has begun yet: by this the first token of each channel is judged.
        let now_ns = monotonic_ns();
        for newest in external.inputs.values_mut().filter_map(|input| input.newest.as_mut()) {
            newest.anchor((0, now_ns));
        }
        Ok(external)
    }

    fn open_channels(&mut self, nodes: &[NodeId], reads: &[Channel]) -> Result<(), LinkError> {
        for channel in reads {
            let input = Input {
                receiver: RawReceiver::open(&self.context, *channel, self.reader)?,
                due: 0,
                newest: self.pace.as_ref().map(|pace| Newest::new(pace.period_ns())),
            };
            self.inputs.insert(*channel, input);
        }
        for channel in Channel::ALL {
            if nodes.contains(&channel.producer()) {
                let output = RawSender::open(&self.context, channel, &[], self.pace.clone())?;
                self.outputs.insert(channel, output);
            }
        }
        Ok(())
    }

    /// Waits at most `limit` for the next token and writes it to `words`, [`RawToken::words_of`] long. In real time: for one that is
    /// newer than the token taken last, and takes the newest; those between are dropped, and the tick tells how many.
    ///
    /// # Errors
    /// In lockstep [`LinkError::Gap`] if a token of another tick came (it is in `words`, and the count goes on from it),
    /// [`LinkError::NotOpened`], [`LinkError::Stopped`], or what iceoryx2 refuses.
    pub fn receive(&mut self, channel: Channel, limit: Duration, words: &mut [u64]) -> Result<Received, LinkError> {
        let start = Instant::now();
        let not_opened = || LinkError::NotOpened {
            process: self.reader.name().into(),
            channel,
            sending: false,
        };
        let input = self.inputs.get_mut(&channel).ok_or_else(not_opened)?;
        loop {
            // Looked at before the channel: what was sent before the end is then found.
            let ended = self.context.finished(channel.producer(), self.pace.is_some());
            let left = limit.saturating_sub(start.elapsed());
            if let Some(token) = input.receive(left.min(LOOK))? {
                token.write_words(words);
                let tick = token.tick();
                // A foreign sender's tick may be any number.
                let expected = std::mem::replace(&mut input.due, tick.saturating_add(1));
                if tick == expected || self.pace.is_some() {
                    return Ok(Received::Token(tick));
                }
                return Err(LinkError::Gap {
                    reader: self.reader,
                    channel,
                    expected,
                    got: tick,
                });
            }
            if ended {
                self.ended = true;
                return Ok(Received::End);
            }
            if stop_requested() {
                return Err(LinkError::Stopped { tick: input.due });
            }
            if start.elapsed() >= limit {
                return Ok(Received::Silence);
            }
        }
    }

    /// Sends a token: tick in the first word, the second is set here, then the fields.
    ///
    /// # Errors
    /// In lockstep [`LinkError::Undelivered`] if a reader is gone (in real time it may come back), [`LinkError::Absent`] if the
    /// recorder has fallen behind for too long, [`LinkError::NotOpened`], or what iceoryx2 refuses.
    pub fn send(&mut self, channel: Channel, words: &[u64]) -> Result<(), LinkError> {
        let output = self.outputs.get(&channel).ok_or_else(|| LinkError::NotOpened {
            process: self.reader.name().into(),
            channel,
            sending: true,
        })?;
        if channel == Channel::Measurement && self.pace.is_some() && self.epoch_ns.is_none() {
            // A plant with a timer of its own, which has just begun: tick 0 began with it.
            let now_ns = monotonic_ns();
            self.epoch_ns = Some(now_ns);
            self.context.set_epoch(now_ns);
        }
        let token = RawToken::from_words(channel, words).sent_at(monotonic_ns());
        output.send(&token)?;
        let done = token.tick().saturating_add(1);
        self.context.set_tick(done);
        if channel == Channel::Measurement && self.pace.is_none() {
            self.wait_for_credit(done)?;
        }
        Ok(())
    }

    /// In real time: when tick 0 begins, in ns of the monotonic clock; 0 in lockstep. The process that has the plant says so,
    /// at the latest with its first measurement: here it becomes 20 ms from now. The others hear it.
    ///
    /// # Errors
    /// [`LinkError::Absent`] if the plant does not say so within the start limit.
    pub fn epoch_ns(&mut self) -> Result<u64, LinkError> {
        let Some(pace) = &self.pace else { return Ok(0) };
        if let Some(epoch_ns) = self.epoch_ns {
            return Ok(epoch_ns);
        }
        let epoch_ns = if self.outputs.contains_key(&Channel::Measurement) {
            let epoch_ns = monotonic_ns() + RUN_UP_NS;
            self.context.set_epoch(epoch_ns);
            epoch_ns
        } else {
            let plant = self.context.process_of(NodeId::Plant).unwrap_or_default().to_owned();
            self.context.epoch_of(&plant)?
        };
        pace.anchor(0, epoch_ns);
        self.epoch_ns = Some(epoch_ns);
        Ok(epoch_ns)
    }

    /// In real time: sleeps until `tick` begins, at once if it has; in lockstep it does nothing. For a plant without a timer.
    ///
    /// # Errors
    /// As [`ExternalNode::epoch_ns`].
    pub fn wait_for_tick(&mut self, tick: u64) -> Result<(), LinkError> {
        self.epoch_ns()?;
        if let Some(pace) = &self.pace {
            pace.sleep_until_start(tick);
        }
        Ok(())
    }

    /// The plant sets the pace: it waits for a recorder that has fallen behind.
    fn wait_for_credit(&self, done: u64) -> Result<(), LinkError> {
        let Some(recorder) = &self.recorder else { return Ok(()) };
        let start = Instant::now();
        while self
            .context
            .tick_of(recorder)
            .is_some_and(|tick| tick.saturating_add(CREDIT_TICKS) < done)
        {
            if start.elapsed() > self.start_limit {
                return Err(LinkError::Absent {
                    process: recorder.clone(),
                    phase: CONNECTED,
                    waited_s: start.elapsed().as_secs_f64(),
                });
            }
            std::thread::sleep(Duration::from_micros(200));
        }
        Ok(())
    }

    /// Leaves the loop. After [`Received::End`] it waits for the others: they may still have to send to it.
    ///
    /// # Errors
    /// The process that does not come to the end.
    pub fn close(self) -> Result<(), LinkError> {
        if self.ended { self.context.end_barrier() } else { Ok(()) }
    }
}
