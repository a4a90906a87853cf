//! Two hosts for a test: two network namespaces joined by a virtual cable where the machine allows it, else this host twice.

use crate::command::{anhyst, spawn};
use std::process::{Child, Command};
use std::sync::atomic::{AtomicU64, Ordering};

static NEXT: AtomicU64 = AtomicU64::new(0);

/// Two hosts and the endpoint at which the first listens.
#[derive(Debug)]
pub struct Hosts {
    namespaces: Option<[String; 2]>,
    /// Where the first host's bridge listens.
    pub endpoint: String,
}

fn ip(words: &str) -> Result<(), String> {
    let output = Command::new("ip").args(words.split_whitespace()).output();
    match output {
        Ok(output) if output.status.success() => Ok(()),
        Ok(output) => Err(format!(
            "ip {words}: {}",
            String::from_utf8_lossy(&output.stderr).trim()
        )),
        Err(error) => Err(format!("ip {words}: {error}")),
    }
}

impl Hosts {
    /// Two namespaces, or with the reason printed, the loopback of this one.
    pub fn new() -> Self {
        let id = format!("{}x{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        let namespaces = [format!("anha{id}"), format!("anhb{id}")];
        match Self::join(&namespaces, &id) {
            Ok(()) => Self {
                namespaces: Some(namespaces),
                endpoint: "tcp/10.77.0.1:7447".into(),
            },
            Err(reason) => {
                println!("both sides on the loopback, because no network namespaces can be made: {reason}");
                // Half-made namespaces go again.
                drop(Self {
                    namespaces: Some(namespaces),
                    endpoint: String::new(),
                });
                let free = std::net::TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr());
                let port = free.map_or(7447, |address| address.port());
                Self {
                    namespaces: None,
                    endpoint: format!("tcp/127.0.0.1:{port}"),
                }
            }
        }
    }

    fn join([one, other]: &[String; 2], id: &str) -> Result<(), String> {
        // Names of network cards have at most 15 characters.
        let (left, right) = (format!("va{id}"), format!("vb{id}"));
        for words in [
            format!("netns add {one}"),
            format!("netns add {other}"),
            format!("link add {left} netns {one} type veth peer name {right} netns {other}"),
            format!("-n {one} addr add 10.77.0.1/24 dev {left}"),
            format!("-n {other} addr add 10.77.0.2/24 dev {right}"),
            format!("-n {one} link set lo up"),
            format!("-n {other} link set lo up"),
            format!("-n {one} link set {left} up"),
            format!("-n {other} link set {right} up"),
        ] {
            ip(&words)?;
        }
        Ok(())
    }

    /// True if a network lies between the two.
    pub fn are_apart(&self) -> bool {
        self.namespaces.is_some()
    }

    /// Starts the executable on the first (0) or second (1) host, in the repository's root.
    pub fn start(&self, host: usize, arguments: &[&str]) -> Child {
        // `ip netns exec` becomes the program: the child's number is the program's.
        let mut command = match &self.namespaces {
            Some(namespaces) => {
                let mut command = Command::new("ip");
                command.args(["netns", "exec", &namespaces[host]]).arg(anhyst());
                command
            }
            None => Command::new(anhyst()),
        };
        spawn(command.args(arguments))
    }
}

impl Default for Hosts {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for Hosts {
    fn drop(&mut self) {
        for namespace in self.namespaces.iter().flatten() {
            // One that was never made cannot be removed; its cable goes with it.
            let _ = ip(&format!("netns del {namespace}"));
        }
    }
}
