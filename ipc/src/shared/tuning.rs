//! Changes of settings from outside: one iceoryx2 request-response service a node that takes them.
//!
//! A request has a few settings with their values; they take effect in one tick, and the answer is that tick. The process is asked
//! between two ticks, so a step sees either all of them or none.

use super::context::SharedContext;
use super::iceoryx::{create_node, refused, retry};
use super::names::{MAX_NODES, tuning_service};
use crate::change::{Change, Tunable};
use crate::error::LinkError;
use crate::message::NodeId;
use iceoryx2::port::server::Server;
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::request_response::PortFactory;
use std::path::Path;
use std::time::{Duration, Instant};

/// Settings in a request.
pub const MAX_SETTINGS: usize = Tunable::ALL.len();
/// Their number, then place in [`Tunable::ALL`] and bits of the value of each.
type Request = [u64; 1 + 2 * MAX_SETTINGS];
/// The answer of one that does not take them.
const REFUSED: u64 = u64::MAX;
/// Also those of processes that died.
const MAX_SERVERS: usize = 16;
const POLL: Duration = Duration::from_millis(2);

type Service = PortFactory<ipc::Service, Request, (), u64, ()>;

fn service(node: &Node<ipc::Service>, of: NodeId) -> Result<Service, LinkError> {
    let name = ServiceName::new(&tuning_service(of)).map_err(refused("name a service for changes"))?;
    node.service_builder(&name)
        .request_response::<Request, u64>()
        .max_servers(MAX_SERVERS)
        .max_clients(MAX_SERVERS)
        .max_nodes(MAX_NODES)
        .open_or_create()
        .map_err(refused(format!("open the service for changes of {of}")))
}

fn to_request(settings: &[(Tunable, f64)]) -> Request {
    let mut request = Request::default();
    request[0] = settings.len() as u64;
    for ((set, value), words) in settings.iter().zip(request[1..].chunks_exact_mut(2)) {
        let place = Tunable::ALL.iter().position(|known| known == set);
        words.copy_from_slice(&[place.unwrap_or(usize::MAX) as u64, value.to_bits()]);
    }
    request
}

/// None where it makes no sense.
fn from_request(request: &Request, tick: u64) -> Option<Vec<Change>> {
    let pairs = request[1..].chunks_exact(2).take(request[0].min(64) as usize);
    let changes = pairs.map(|words| {
        Some(Change {
            tick,
            set: *Tunable::ALL.get(usize::try_from(words[0]).ok()?)?,
            value: Some(f64::from_bits(words[1])).filter(|value| value.is_finite())?,
        })
    });
    changes.collect()
}

/// The end of the process that takes changes.
pub struct ChangeServer(Server<ipc::Service, Request, (), u64, ()>);

impl ChangeServer {
    /// Opens the service of `of`, a node of this process.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn open(context: &SharedContext, of: NodeId) -> Result<Self, LinkError> {
        let server = retry(true, || service(&context.node, of))?.server_builder().create();
        Ok(Self(server.map_err(refused(format!("take changes of {of}")))?))
    }

    /// Answers what was asked meanwhile. `take` is given changes that take effect in `tick`, and says whether it took them all.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn serve(&self, tick: u64, mut take: impl FnMut(&[Change]) -> bool) -> Result<(), LinkError> {
        while let Some(request) = self.0.receive().map_err(refused("receive a change"))? {
            let changes = from_request(&request, tick);
            let taken = changes.is_some_and(|changes| take(&changes));
            // One who has not waited for the answer is gone.
            let _ = request.send_copy(if taken { tick } else { REFUSED });
        }
        Ok(())
    }
}

/// Asks `of` in the run with this prefix and root to change settings, all in one tick; the tick, or none if it does not take them.
///
/// # Errors
/// If iceoryx2 refuses, or there is no answer within `limit`.
pub fn request_changes(
    (prefix, root): (&str, &Path),
    of: NodeId,
    settings: &[(Tunable, f64)],
    limit: Duration,
) -> Result<Option<u64>, LinkError> {
    let begin = Instant::now();
    let node = create_node(prefix, root, "tune")?;
    let client = service(&node, of)?
        .client_builder()
        .create()
        .map_err(refused("ask for a change"))?;
    let mut pending = None;
    while begin.elapsed() < limit {
        // A request that has reached nobody is lost.
        if pending.is_none() {
            let sent = client.send_copy(to_request(settings));
            pending =
                Some(sent.map_err(refused("ask for a change"))?).filter(|sent| sent.number_of_server_connections() > 0);
        }
        if let Some(waiting) = &pending
            && let Some(answer) = waiting.receive().map_err(refused("hear of a change"))?
        {
            return Ok(Some(*answer).filter(|tick| *tick != REFUSED));
        }
        std::thread::sleep(POLL);
    }
    Err(LinkError::Absent {
        process: of.name().into(),
        phase: 2,
        waited_s: begin.elapsed().as_secs_f64(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards the words of a request: what is asked for arrives to the bit, and what makes no sense is no change.
    #[test]
    fn a_request_comes_back_from_its_words() {
        let asked: Vec<(Tunable, f64)> = Tunable::ALL
            .into_iter()
            .zip([0.1, -0.0, 5e-324, 3.0, 4.0, 5.0, 6.0])
            .collect();
        let request = to_request(&asked);
        let heard = from_request(&request, 7).unwrap();
        assert!(heard.iter().all(|change| change.tick == 7));
        let bits = |value: f64| value.to_bits();
        let heard: Vec<(Tunable, u64)> = heard.iter().map(|change| (change.set, bits(change.value))).collect();
        assert_eq!(
            heard,
            asked
                .iter()
                .map(|(set, value)| (*set, bits(*value)))
                .collect::<Vec<_>>()
        );
        let mut unknown = request;
        unknown[1] = 99;
        assert_eq!(from_request(&unknown, 7), None);
        assert_eq!(from_request(&to_request(&[(Tunable::Kp, f64::NAN)]), 7), None);
    }
}
