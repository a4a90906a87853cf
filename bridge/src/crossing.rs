//! The running bridge: one thread for what leaves, one for what comes, one for the heartbeat, and one that watches them.
//!
//! The watching thread never touches the network, so that a link that hangs cannot hold it.

use crate::error::BridgeError;
use crate::handshake::Handshake;
use crate::heartbeat::PERIOD;
use crate::meeting::{greet, measure};
use crate::partition::Partition;
use crate::round_trip::RoundTrips;
use crate::round_trip::echo;
use crate::session::{Incoming, Session, next};
use crate::settings::{BridgeSettings, End};
use crate::state::{State, lock};
use anhyst_ipc::{CONNECTED, END, Egress, Ingress, PORTS, Progress, RawToken, monotonic_ns, stop_requested};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How often the waiting threads look around.
const LOOK: Duration = Duration::from_millis(20);
/// How often the watching thread does.
const WATCH: Duration = Duration::from_millis(5);
/// After so long without a token it is looked whether all processes of this side live.
const SUSPICIOUS: Duration = Duration::from_millis(200);
/// What the other bridge gets to say that it is done, too, and a hanging thread to end.
const GRACE: Duration = Duration::from_secs(1);

/// What a bridge has done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossed {
    /// The link before the loop started.
    pub round_trips: RoundTrips,
    /// Tokens that left this side.
    pub sent: u64,
    /// Tokens that came to it.
    pub received: u64,
    /// Ticks of the run.
    pub ticks: u64,
}

/// Runs a bridge from the meeting of the two sides to the end of the run. `announce` hears what the link measured.
///
/// A failure also asks the loops of this process to stop ([`anhyst_ipc::request_stop`]): a bridge is a process of its own.
///
/// # Errors
/// If the sides do not fit, the link is too slow, a process or the other bridge is silent, or a token is lost.
pub fn run(settings: BridgeSettings, announce: &mut dyn FnMut(&RoundTrips)) -> Result<Crossed, BridgeError> {
    let partition = Partition::new(&settings)?;
    let Some(host) = settings.end.host() else {
        let endpoint = settings.end.endpoint();
        return Err(BridgeError::Setting(format!(
            "{endpoint} is no endpoint: write tcp/HOST:PORT"
        )));
    };
    let echo_port = match settings.end {
        End::Listen(_) => echo(host)?,
        End::Connect(_) => 0,
    };
    let (session, incoming) = Session::open(&settings, &partition)?;
    let own = Handshake::new(&settings, &partition, echo_port);
    let budget_us = own.budget_us;
    let other = greet(&settings, &session, &incoming, own)?;
    let round_trips = measure(&settings, &session, &incoming, &other)?;
    announce(&round_trips);
    round_trips.check(budget_us.min(other.budget_us))?;
    let state = Arc::new(State::new(settings, partition));
    cross(&state, Arc::new(session), incoming, other.instance)?;
    state.crossing.complete()?;
    Ok(Crossed {
        round_trips,
        sent: state.crossing.total_of(&state.partition.leaving),
        received: state.crossing.total_of(&state.partition.coming),
        ticks: state.settings.ticks,
    })
}

/// What a thread of the bridge does.
type Work = Box<dyn FnOnce(&State, &Session) -> Result<(), BridgeError> + Send>;

fn cross(
    state: &Arc<State>,
    session: Arc<Session>,
    incoming: Receiver<Incoming>,
    instance: u64,
) -> Result<(), BridgeError> {
    let spawn = |work: Work| {
        let (state, session) = (state.clone(), session.clone());
        std::thread::spawn(move || {
            if let Err(error) = work(&state, &session) {
                state.fail(error);
            }
        })
    };
    let beating = spawn(Box::new(heartbeat));
    let leaving = spawn(Box::new(leave));
    let coming = spawn(Box::new(move |state: &State, session: &Session| {
        come(state, session, &incoming, instance)
    }));
    watch(state, &[&leaving, &coming]);
    wait_until(GRACE, &|| leaving.is_finished() && coming.is_finished());
    state.over.set();
    wait_until(GRACE, &|| beating.is_finished());
    let panicked = [leaving, coming, beating]
        .into_iter()
        .filter(JoinHandle::is_finished)
        .any(|thread| thread.join().is_err());
    match state.failure() {
        Some(failure) => Err(failure),
        None if panicked || !state.done.is_set() => Err(BridgeError::Thread),
        None => Ok(()),
    }
}

fn wait_until(limit: Duration, condition: &dyn Fn() -> bool) {
    let start = Instant::now();
    while !condition() && start.elapsed() < limit {
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Until the threads have ended, or one has failed, or the loop stands still.
fn watch(state: &State, threads: &[&JoinHandle<()>]) {
    let mut total = 0;
    let mut since = Instant::now();
    while !state.failed() && threads.iter().any(|thread| !thread.is_finished()) {
        std::thread::sleep(WATCH);
        let now = state.crossing.total();
        if now != total || !state.all_at(CONNECTED) {
            total = now;
            since = Instant::now();
        }
        let waited = since.elapsed();
        if waited > state.settings.receive_limit
            && let Some((channel, tick)) = state.crossing.first_missing()
        {
            state.fail(BridgeError::Stalled {
                channel,
                tick,
                waited_s: waited.as_secs_f64(),
            });
        }
        // A thread that has panicked has said nothing; the other would wait for ever.
        if !state.done.is_set() && threads.iter().any(|thread| thread.is_finished()) {
            state.fail(BridgeError::Thread);
        }
    }
}

/// Tells the other bridge where this side stands, until the end.
fn heartbeat(state: &State, session: &Session) -> Result<(), BridgeError> {
    loop {
        let last = state.over.is_set();
        session.heartbeat(&state.heartbeat())?;
        if last {
            // The farewell must be on its way before the session closes.
            std::thread::sleep(LOOK);
            return Ok(());
        }
        std::thread::sleep(PERIOD);
    }
}

/// What leaves: from the channels of this side to Zenoh.
fn leave(state: &State, session: &Session) -> Result<(), BridgeError> {
    let settings = state.shared_settings("bridge-out");
    let egress = Egress::open(settings, &state.partition.remote, &state.settings.wires)?;
    let mut relayed = Instant::now();
    let mut lively = Instant::now();
    while !state.failed() {
        if stop_requested() {
            // A launcher ends the others when one has crashed: then that is the reason.
            return Err(died(&egress, false).unwrap_or(BridgeError::Stopped));
        }
        if let Some(token) = egress.next(PERIOD)? {
            forward(state, session, &token)?;
            lively = Instant::now();
        }
        if relayed.elapsed() >= PERIOD {
            relay(state, session, &egress)?;
            relayed = Instant::now();
            if state.done.is_set() {
                return Ok(());
            }
        }
        if lively.elapsed() > SUSPICIOUS {
            if let Some(died) = died(&egress, true) {
                return Err(died);
            }
            lively = Instant::now();
        }
    }
    Ok(())
}

fn died(egress: &Egress, vanished: bool) -> Option<BridgeError> {
    egress.dead(vanished).map(|process| BridgeError::Died { process })
}

fn forward(state: &State, session: &Session, token: &RawToken) -> Result<(), BridgeError> {
    state.crossing.count(token.channel(), token.tick())?;
    session.token(token)
}

/// Relays the rendezvous: this side's processes to the other side, the other side's to this one.
fn relay(state: &State, session: &Session, egress: &Egress) -> Result<(), BridgeError> {
    let here = egress.here();
    // What these processes have sent goes before the news of where they stand: nobody may leave before its last token came.
    while let Some(token) = egress.poll()? {
        forward(state, session, &token)?;
    }
    *lock(&state.here) = here;
    // The other side's processes are only as far here as the ports that stand for them.
    let farthest = match (state.ports.is_set(), state.connected.is_set()) {
        (false, _) => 0,
        (true, false) => PORTS,
        (true, true) => END,
    };
    for progress in lock(&state.remote).iter() {
        egress.set(&Progress {
            phase: progress.phase.min(farthest),
            ..progress.clone()
        });
    }
    if farthest == END && state.all_at(END) {
        state.done.set();
    }
    Ok(())
}

/// What comes: from Zenoh to the channels of this side.
fn come(state: &State, session: &Session, incoming: &Receiver<Incoming>, instance: u64) -> Result<(), BridgeError> {
    let settings = state.shared_settings("bridge-in");
    let ingress = Ingress::open(settings, &state.partition.remote, &state.settings.wires)?;
    state.ports.set();
    while ingress.lowest_phase() < PORTS && !state.failed() {
        listen(state, session)?;
        std::thread::sleep(Duration::from_millis(2));
    }
    ingress.connect()?;
    state.connected.set();
    let mut done_at: Option<Instant> = None;
    while !state.failed() {
        match next(incoming, state.settings.yields, LOOK) {
            Ok(message) => hear(state, &ingress, message, instance)?,
            Err(_) => listen(state, session)?,
        }
        if state.done.is_set() {
            let since = done_at.get_or_insert_with(Instant::now).elapsed();
            if state.other_done.is_set() || since > GRACE {
                return Ok(());
            }
        }
    }
    Ok(())
}

fn hear(state: &State, ingress: &Ingress, message: Incoming, instance: u64) -> Result<(), BridgeError> {
    match message {
        Incoming::Token(token) => {
            state.crossing.count(token.channel(), token.tick())?;
            ingress.deliver(&token)?;
        }
        Incoming::Heartbeat(heartbeat) => {
            if let Some(words) = heartbeat.farewell {
                let processes = state.partition.remote_names();
                return Err(BridgeError::Left { processes, words });
            }
            *lock(&state.remote) = heartbeat.here;
            if heartbeat.done {
                state.other_done.set();
            }
        }
        Incoming::Handshake(handshake) if handshake.instance != instance => {
            let processes = state.partition.remote_names();
            return Err(BridgeError::Restarted { processes });
        }
        Incoming::Malformed { key, bytes } => return Err(BridgeError::Malformed { key, bytes }),
        Incoming::Handshake(_) | Incoming::Measured(_) | Incoming::Echo => {}
    }
    Ok(())
}

/// Checks that the other bridge still says something.
fn listen(state: &State, session: &Session) -> Result<(), BridgeError> {
    let silent = Duration::from_nanos(monotonic_ns().saturating_sub(session.heard_ns()));
    let limit = state.settings.receive_limit;
    if silent > limit && !state.other_done.is_set() && !state.done.is_set() {
        return Err(BridgeError::Silent {
            processes: state.partition.remote_names(),
            waited_s: silent.as_secs_f64(),
            limit_s: limit.as_secs_f64(),
        });
    }
    Ok(())
}
