//! Links within one process: one memory cell a channel. A tick passes the nodes in loop order, so a cell always holds the
//! token that its reader is due: this tick's for a reader after the producer, the last tick's for one before it.

use crate::message::{Channel, Message};
use std::any::Any;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::rc::Rc;

/// A channel's token; none before the first is sent.
pub struct Slot<M> {
    filled: Cell<bool>,
    // Apart from the flag: an `Option` in its place is copied in pieces, from channel to channel and tick by tick.
    token: Cell<M>,
}

impl<M: Message> Slot<M> {
    /// The token, if there is one.
    pub fn get(&self) -> Option<M> {
        self.filled.get().then(|| self.token.get())
    }

    /// The token, or the default one.
    #[inline(always)]
    pub fn token(&self) -> M {
        self.token.get()
    }

    /// The tick of the token, if there is one.
    #[inline(always)]
    pub fn tick(&self) -> Option<u64> {
        self.filled.get().then(|| self.token.get().tick())
    }

    /// Puts a token there.
    #[inline(always)]
    pub fn set(&self, token: M) {
        self.token.set(token);
        self.filled.set(true);
    }

    /// Takes the token out.
    pub fn take(&self) -> Option<M> {
        let token = self.get();
        self.filled.set(false);
        token
    }
}

/// The cells of one process.
#[derive(Default)]
pub struct Cells {
    cells: BTreeMap<Channel, Rc<dyn Any>>,
}

impl Cells {
    /// The cell of `M`'s channel, made at first use. It holds nothing until the first token is sent.
    pub fn cell<M: Message>(&mut self) -> Rc<Slot<M>> {
        let empty = || {
            Rc::new(Slot {
                filled: Cell::new(false),
                token: Cell::new(M::default()),
            })
        };
        let any = self.cells.entry(M::CHANNEL).or_insert_with(|| empty());
        // A channel has one message type, so this always succeeds; a fresh cell would be noticed as a gap.
        any.clone().downcast().unwrap_or_else(|_| empty())
    }
}
