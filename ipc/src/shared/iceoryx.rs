//! What every use of iceoryx2 here shares: the settings of a run, its nodes and services, and refusals as errors.

use super::names::{MAX_LISTENERS, MAX_NODES, MAX_NOTIFIERS, bell_service, channel_service};
use crate::error::LinkError;
use crate::message::Channel;
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::event::PortFactory;
use std::path::Path;
use std::time::{Duration, Instant};

/// Tries again for a moment if `again`: iceoryx2 needs one to create a service, or to remove what a dead process has left.
pub fn retry<T>(again: bool, mut attempt: impl FnMut() -> Result<T, LinkError>) -> Result<T, LinkError> {
    let start = Instant::now();
    loop {
        match attempt() {
            Err(_) if again && start.elapsed() < Duration::from_secs(2) => {
                std::thread::sleep(Duration::from_millis(2));
            }
            outcome => return outcome,
        }
    }
}

/// How long one process waits until another has made its half of something: a busy disk holds up whoever makes files for seconds.
const CREATION_LIMIT: Duration = Duration::from_secs(10);

/// Names the operation that iceoryx2 refused.
pub fn refused<E: std::fmt::Debug>(operation: impl Into<String>) -> impl FnOnce(E) -> LinkError {
    let operation = operation.into();
    move |error| LinkError::Transport {
        operation,
        cause: format!("{error:?}"),
    }
}

/// iceoryx2's settings of a run. A config file that happens to lie in the working directory must not change where a run lives:
/// both are set here.
pub fn configuration(prefix: &str, root: &Path) -> Result<Config, LinkError> {
    let mut config = Config::default();
    config.global.prefix = FileName::new(prefix.as_bytes()).map_err(refused("use the run's prefix"))?;
    config.global.creation_timeout = CREATION_LIMIT;
    let root = root.to_string_lossy();
    let path = iceoryx2::prelude::Path::new(root.as_bytes());
    config
        .global
        .set_root_path(&path.map_err(refused(format!("use {root} as its root")))?);
    Ok(config)
}

/// A process's node.
pub fn create_node(prefix: &str, root: &Path, name: &str) -> Result<Node<ipc::Service>, LinkError> {
    set_log_level(LogLevel::Error);
    let config = configuration(prefix, root)?;
    let name = NodeName::new(name).map_err(refused("name the process's node"))?;
    retry(true, || {
        NodeBuilder::new()
            .name(&name)
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(refused(format!("create a node under {}", root.display())))
    })
}

/// The name of a channel's service.
pub fn channel_name(channel: Channel) -> Result<ServiceName, LinkError> {
    ServiceName::new(&channel_service(channel)).map_err(refused("name a channel"))
}

/// The event service that wakes a process.
pub fn event(node: &Node<ipc::Service>, process: &str) -> Result<PortFactory<ipc::Service>, LinkError> {
    let name = ServiceName::new(&bell_service(process)).map_err(refused("name an event service"))?;
    retry(true, || {
        node.service_builder(&name)
            .event()
            .max_notifiers(MAX_NOTIFIERS)
            .max_listeners(MAX_LISTENERS)
            .max_nodes(MAX_NODES)
            .open_or_create()
            .map_err(refused(format!("open the event service of {process}")))
    })
}
