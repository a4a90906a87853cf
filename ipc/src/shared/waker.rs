//! Waiting for tokens and waking who waits, without a system call where nobody sleeps.
//!
//! Dekker's scheme. Reader: flag up; fence; look; sleep unless something is there; flag down. Sender: send; fence; notify if
//! the flag is up. The two fences have an order: either the sender sees the flag or the reader the token, so none waits for
//! a sleeper.

use super::iceoryx::{event, refused, retry};
use super::names::END;
use super::status::{OwnStatus, PeerStatus};
use super::wake_word::WakeWord;
use crate::clock::monotonic_ns;
use crate::error::LinkError;
use crate::message::Channel;
use crate::stop::stop_requested;
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::*;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::cell::{Cell, RefCell};
use std::os::fd::BorrowedFd;
use std::rc::Rc;
use std::sync::atomic::{Ordering, fence};
use std::time::Duration;

/// A sleeper looks up at least this often: for a request to stop, and should a notification be lost, which is counted.
const MAX_SLEEP: Duration = Duration::from_millis(20);

/// Polls before a waiting process sleeps, where processes share cores.
pub const YIELDS_SHARED: u32 = 20;

/// A yield that took longer has given the core to a program outside the run, which takes the whole of its turn.
const CROWDED_NS: u64 = 200_000;
/// So long after that a process sleeps at once: who is woken gets the core soon, who yields gets it last.
const CROWDED_FOR_NS: u64 = 50_000_000;

/// What ends a sleep.
#[derive(Clone, Copy)]
enum Alarm {
    Event,
    /// The process's word, rung more often than so.
    Word(u32),
}

/// What the others find of a process and wake it by.
pub struct Waker {
    pub status: OwnStatus,
    listener: Listener<ipc::Service>,
    word: Option<WakeWord>,
    /// A sleep found this token at its end, and nobody had notified of it; its sender may be just about to.
    unannounced: RefCell<Option<(Origin, Alarm)>>,
    lost_notifications: Cell<u64>,
    /// Until when yielding is not worth while.
    crowded_until_ns: Cell<u64>,
}

impl Waker {
    /// The one of `process`; `again` if it takes the place of a process of this name that died.
    pub fn create(node: &Node<ipc::Service>, process: &str, agreement: u64, again: bool) -> Result<Self, LinkError> {
        // Word and listener before the status: who has found the one finds the others.
        let word = WakeWord::create(node, process);
        let listener = retry(again, || {
            let created = event(node, process)?.listener_builder().create();
            created.map_err(refused("create a listener"))
        })?;
        let status = if again {
            OwnStatus::create_again(node, process, agreement)?
        } else {
            OwnStatus::create(node, process, agreement)?
        };
        Ok(Self {
            status,
            listener,
            word,
            unannounced: RefCell::new(None),
            lost_notifications: Cell::new(0),
            crowded_until_ns: Cell::new(0),
        })
    }

    /// Sleeps until notified, at most `left` and [`MAX_SLEEP`]; not at all if `look` finds something once the flag is up.
    fn sleep<T>(
        &self,
        left: Duration,
        awaited: Option<&Awaited>,
        look: &mut impl FnMut() -> Result<Option<T>, LinkError>,
    ) -> Result<Option<T>, LinkError> {
        if !self.settled(left.min(MAX_SLEEP)) {
            return Ok(None);
        }
        let alarm = self.fall_asleep(awaited);
        // Pairs with the fence in `notify_sleepers`.
        fence(Ordering::SeqCst);
        let mut found = look();
        let counts = left > MAX_SLEEP || awaited.is_some_and(|awaited| awaited.late_is_lost);
        if matches!(found, Ok(None)) && !self.notified_within(alarm, left.min(MAX_SLEEP)) && counts {
            found = look();
            if matches!(found, Ok(Some(_))) {
                let origin = awaited.and_then(Awaited::origin);
                self.unannounced.replace(origin.map(|origin| (origin, alarm)));
            }
        }
        // Whoever is just about to notify of it shall find the flag up still.
        if self.settled(Duration::ZERO) {
            self.wake_up(alarm);
        }
        found
    }

    /// Puts the flag up that whoever sends what is awaited looks at.
    fn fall_asleep(&self, awaited: Option<&Awaited>) -> Alarm {
        if let (Some(word), Some(awaited)) = (&self.word, awaited)
            && awaited.sender.as_ref().is_some_and(|sender| sender.word.is_some())
        {
            let before = word.rung();
            word.fall_asleep(awaited.channel);
            return Alarm::Word(before);
        }
        self.status.fall_asleep(awaited.map(|awaited| awaited.channel));
        Alarm::Event
    }

    fn wake_up(&self, alarm: Alarm) {
        match (&self.word, alarm) {
            (Some(word), Alarm::Word(_)) => word.wake_up(),
            _ => self.status.wake_up(),
        }
    }

    /// Whether what the last sleep found has been notified of meanwhile, or its notification is lost; waits so long for it. Its sender may
    /// have been kept from the core between sending and notifying, for any time: it has lost it only once its heartbeat is past that tick.
    fn settled(&self, limit: Duration) -> bool {
        let Some((origin, alarm)) = self.unannounced.take() else {
            return true;
        };
        // In this order: who notifies does so before its heartbeat.
        let past = origin.is_past();
        let heard = self.notified_within(alarm, if past { Duration::ZERO } else { limit });
        if !heard && past {
            self.lost_notifications.set(self.lost_notifications.get() + 1);
        }
        if heard || past {
            self.wake_up(alarm);
            return true;
        }
        self.unannounced.replace(Some((origin, alarm)));
        false
    }

    /// How often a sleeper was not notified of a token, and found it when it looked up by itself.
    pub fn lost_notifications(&self) -> u64 {
        self.settled(Duration::ZERO);
        self.lost_notifications.get()
    }

    /// The waits of iceoryx2 count in jiffies, which are longer than a tick; `ppoll` counts in nanoseconds. True if somebody has
    /// notified, or if a signal has ended the wait.
    fn notified_within(&self, alarm: Alarm, limit: Duration) -> bool {
        if let (Some(word), Alarm::Word(before)) = (&self.word, alarm) {
            return word.wait(before, limit);
        }
        // SAFETY: the descriptor is the listener's, which lives as long as `self`.
        let descriptor = unsafe { BorrowedFd::borrow_raw(self.listener.file_descriptor().native_handle()) };
        let limit = Timespec {
            tv_sec: limit.as_secs() as _,
            tv_nsec: limit.subsec_nanos().into(),
        };
        let ready = poll(&mut [PollFd::new(&descriptor, PollFlags::IN)], Some(&limit));
        // Who notified is of no interest; what for is looked at next. Also if nobody has: iceoryx2 sends nothing to a listener that
        // it believes notified, and were that ever wrong, only this would end it.
        let heard = self.listener.try_wait(|_| {});
        !matches!((ready, heard), (Ok(0), Ok(0)))
    }
}

/// What a process sleeps for.
pub struct Awaited {
    pub channel: Channel,
    /// Who sends it, if that is another process.
    pub sender: Option<Rc<Peer>>,
    /// None where any will do: then none counts as not notified of.
    pub tick: Option<u64>,
    /// What a sleep finds at its end counts also where the end of a wait cuts it short, as no token is due just then.
    pub late_is_lost: bool,
}

/// Which process sends a token, and of which tick it is.
struct Origin {
    sender: Rc<Peer>,
    tick: u64,
}

impl Awaited {
    fn origin(&self) -> Option<Origin> {
        let (sender, tick) = (self.sender.clone()?, self.tick?);
        Some(Origin { sender, tick })
    }
}

impl Origin {
    /// The sender has finished this tick, and notified of its token before.
    fn is_past(&self) -> bool {
        self.sender.status.tick() > self.tick || self.sender.status.phase() >= END
    }
}

/// Another process: what it says of itself, and what wakes it.
pub struct Peer {
    pub status: PeerStatus,
    word: Option<WakeWord>,
    notifier: Notifier<ipc::Service>,
}

impl Peer {
    /// The process with this status. A notifier that could not connect to its listener when it was made never tries again: one is
    /// made until it can, or the process has gone.
    pub fn new(node: &Node<ipc::Service>, process: &str, status: PeerStatus) -> Result<Self, LinkError> {
        let service = event(node, process)?;
        let create = || {
            let created = service.notifier_builder().create();
            created.map_err(refused("create a notifier"))
        };
        let connected = retry(true, || {
            let notifier = create()?;
            match notifier.notify().map_err(refused("notify a process"))? {
                0 => Err(refused("notify a process")("nobody listens")),
                _ => Ok(notifier),
            }
        });
        let notifier = connected.or_else(|_| create())?;
        let word = WakeWord::of(node, process);
        Ok(Self { status, word, notifier })
    }
}

/// Wakes those who sleep for what was just sent to them on this channel: who waits for another token would only look and sleep again.
/// All are notified even if one cannot be.
pub fn notify_sleepers(readers: &[Rc<Peer>], channel: Channel) -> Result<(), LinkError> {
    // Pairs with the fence in `Waker::sleep`.
    fence(Ordering::SeqCst);
    let mut outcome = Ok(());
    for reader in readers {
        if let Some(word) = &reader.word {
            outcome = outcome.and(word.ring(channel).map_err(refused("wake a process")));
        }
        if reader.status.sleeps_for(channel) {
            let notified = reader.notifier.notify().map_err(refused("notify a process"));
            outcome = outcome.and(notified.map(|_| ()));
        }
    }
    outcome
}

/// How a process rests between two looks.
pub enum Rest<'a> {
    /// Until notified of this token, or of any.
    Notified(&'a Waker, Option<&'a Awaited>),
    /// For so long.
    For(Duration),
}

impl Rest<'_> {
    /// Yielding has been found to take long.
    fn is_crowded(&self, now_ns: u64) -> bool {
        matches!(self, Rest::Notified(waker, _) if now_ns < waker.crowded_until_ns.get())
    }

    /// Gives the core away for a moment, and notes if that takes long; the moment after it.
    fn give_way(&self, now_ns: u64) -> u64 {
        std::thread::yield_now();
        let back_ns = monotonic_ns();
        if let Rest::Notified(waker, _) = self
            && back_ns > now_ns + CROWDED_NS
        {
            waker.crowded_until_ns.set(back_ns + CROWDED_FOR_NS);
        }
        back_ns
    }
}

/// Looks again and again, for who has just looked and found nothing: yields so often between two looks, unless others want the core, then
/// rests. None once it is `until_ns` of the monotonic clock, now `now_ns`, or, if `stoppable`, the run is told to stop.
pub fn wait<T>(
    yields: u32,
    rest: &Rest,
    (mut now_ns, until_ns): (u64, u64),
    stoppable: bool,
    mut look: impl FnMut() -> Result<Option<T>, LinkError>,
) -> Result<Option<T>, LinkError> {
    let mut polls = 0;
    while now_ns < until_ns && !(stoppable && stop_requested()) {
        let left = Duration::from_nanos(until_ns - now_ns);
        let mut found = None;
        match rest {
            _ if polls < yields && !rest.is_crowded(now_ns) => {
                polls += 1;
                now_ns = rest.give_way(now_ns);
            }
            Rest::Notified(waker, awaited) => {
                found = waker.sleep(left, *awaited, &mut look)?;
                now_ns = monotonic_ns();
            }
            Rest::For(period) => {
                std::thread::sleep(left.min(*period));
                now_ns = monotonic_ns();
            }
        }
        if found.is_none() {
            found = look()?;
        }
        if found.is_some() {
            return Ok(found);
        }
    }
    Ok(None)
}
