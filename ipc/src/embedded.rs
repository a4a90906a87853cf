//! Links within one process: one memory cell a channel. A tick passes the nodes in loop order, so a cell always holds the
//! token that its reader is due: this tick's for a reader after the producer, the last tick's for one before it.

use crate::message::{Channel, Message};
use std::any::Any;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::rc::Rc;

/// The cells of one process.
#[derive(Default)]
pub struct Cells {
    cells: BTreeMap<Channel, Rc<dyn Any>>,
}

impl Cells {
    /// The cell of `M`'s channel, made at first use. It holds nothing until the first token is sent.
    pub fn cell<M: Message>(&mut self) -> Rc<Cell<Option<M>>> {
        let any = self
            .cells
            .entry(M::CHANNEL)
            .or_insert_with(|| Rc::new(Cell::<Option<M>>::new(None)));
        // A channel has one message type, so this always succeeds; a fresh cell would be noticed as a gap.
        any.clone().downcast().unwrap_or_default()
    }
}
