//! What travels around the loop and how: one token per channel and tick.
//!
//! A *block* is a pure state machine: tokens of tick `k` in, tokens of tick `k` out ([`Block`]). A *node* is a block with
//! its links opened ([`Node`]); a process runs one or several nodes in the order of [`NodeId::LOOP_ORDER`]. A link between
//! two nodes of one process is a memory cell, a link between processes an iceoryx2 service; the block cannot tell.
//!
//! The wiring of the loop is not written down anywhere but in the blocks' `Inputs` and `Outputs` types: see [`wiring`].

mod block;
mod change;
mod clock;
mod digest;
mod embedded;
mod error;
mod everything;
mod external;
mod external_clock;
mod fault;
mod interface;
mod invalid;
mod link;
mod message;
mod messages;
mod newest;
mod node;
mod pace;
mod raw;
mod shared;
mod statistics;
mod stop;
mod token_log;
mod wire;

pub use block::{Block, Edge, Inputs, Note, Now, Outputs, Previous, Seen, wiring};
pub use change::{Change, MAX_CHANGES, Tunable};
pub use clock::{CLOCKS, monotonic_ns};
pub use digest::{Digest, DigestHistory, combine, fingerprint};
pub use embedded::Cells;
pub use error::LinkError;
pub use everything::Everything;
pub use external::{ExternalNode, ExternalSettings, Received, processes};
pub use external_clock::ExternalClock;
pub use fault::{MAX_DELAY_TICKS, TokenFault, TokenKind};
pub use interface::{ChannelDescription, FieldDescription, Interface, ServiceSizes, StatusEntry, interface, layouts};
pub use invalid::{Invalid, number_between};
pub use link::{Connections, Discipline, Receiver, Sender};
pub use message::{Channel, Field, FieldKind, MAX_FIELDS, Message, NodeId};
pub use messages::*;
pub use node::{Node, NodeReport, Stage};
pub use pace::Pace;
pub use raw::{MAX_BYTES, MAX_WORDS, RawToken};
pub use shared::{
    ANY_AGREEMENT, CONNECTED, ChangeServer, END, Egress, Ingress, Layout, MAX_PIECE, Observer, Onlooker, PORTS,
    Progress, SharedContext, SharedSettings, Standing, TokenWait, Wait, YIELDS_SHARED, crossing, request_changes,
};
pub use statistics::{Bin, Latency, LatencySummary, LinkReport};
pub use stop::{forget_stop, request_stop, stop_flag, stop_requested};
pub use token_log::{RecordLayout, TokenLog, TokenLogFile, TokenRecord};
pub use wire::Wire;
