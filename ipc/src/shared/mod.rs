//! Links between processes: one overflowing iceoryx2 publish-subscribe service a channel, one event service a process to
//! wake it, one blackboard a process with its status.
//!
//! From the ground up: [`names`] and sizes; `iceoryx`; a process's `status`; its `waker` and how it waits; the `context` of a
//! process, with the barriers of start and end; the `ports`. Beside them what looks from outside: `layout`, `observer`, `onlooker`; what takes changes, `tuning`; and
//! `remote`, which stands for processes of another host.

mod context;
mod iceoryx;
mod layout;
pub(crate) mod names;
mod observer;
mod onlooker;
mod ports;
mod remote;
mod status;
mod tuning;
mod wake_word;
mod waker;

pub use context::{SharedContext, SharedSettings, Wait};
pub use layout::Layout;
pub use names::{ANY_AGREEMENT, CONNECTED, END, PORTS};
pub use observer::Observer;
pub use onlooker::Onlooker;
pub use ports::MAX_PIECE;
pub(crate) use ports::{RawReceiver, RawSender};
pub use remote::{Egress, Ingress, Progress, crossing};
pub use status::{Standing, TokenWait};
pub use tuning::{ChangeServer, request_changes};
pub use waker::YIELDS_SHARED;
