//! Links between processes: one overflowing iceoryx2 publish-subscribe service a channel, one event service a process to
//! wake it, one blackboard a process with its status.
//!
//! **Waiting.** A reader polls and yields a few times, then says on its blackboard that it sleeps and waits for its event; a
//! sender notifies only a process that says so. The fences make this Dekker's scheme: either the sender sees the flag or
//! the reader sees the token. **Start.** All create their ports (phase 1), connect (phase 2), then tick 0 begins.

mod away;
mod context;
mod layout;
pub(crate) mod names;
mod ports;
mod status;

pub use away::{Arrivals, Departures, Progress, crossing};
pub use context::{Observer, SharedContext, SharedSettings, Wait};
pub use layout::Layout;
pub use names::ANY_AGREEMENT;
pub(crate) use ports::{SharedReceiver, SharedSender};
pub use status::{Standing, TokenWait};

use crate::{Channel, LinkError};
use iceoryx2::prelude::ServiceName;
use std::time::{Duration, Instant};

/// Tries again for a moment if this process takes the place of one that died: iceoryx2 removes what that one has left.
fn patiently<T>(rejoins: bool, mut attempt: impl FnMut() -> Result<T, LinkError>) -> Result<T, LinkError> {
    let start = Instant::now();
    loop {
        match attempt() {
            Err(_) if rejoins && start.elapsed() < Duration::from_secs(2) => {
                std::thread::sleep(Duration::from_millis(2));
            }
            outcome => return outcome,
        }
    }
}

/// Names the operation that iceoryx2 refused.
fn refused<E: std::fmt::Debug>(operation: impl Into<String>) -> impl FnOnce(E) -> LinkError {
    let operation = operation.into();
    move |error| LinkError::Transport {
        operation,
        cause: format!("{error:?}"),
    }
}

/// The name of a channel's service.
fn channel_name(channel: Channel) -> Result<ServiceName, LinkError> {
    ServiceName::new(&names::channel_service(channel)).map_err(refused("name a channel"))
}
