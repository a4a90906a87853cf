//! `anhyst live`: the channels of a run that goes on, in JSON, for viewers of other people.

use super::{Ending, json};
use crate::arguments::JsonArgument;
use crate::live::foxglove::Server;
#[cfg(feature = "bridge")]
use crate::live::schema;
use crate::live::{Heard, Thinned};
#[cfg(feature = "bridge")]
use anhyst_bridge::{End, Outlet};
use anhyst_ipc::{Onlooker, number_between};
use anhyst_launch::error::RunError;
use anhyst_launch::folder::RunFolder;
use anhyst_launch::resources::is_running;
use anhyst_launch::signals;
use anhyst_launch::tuning::{meeting, running};
use anhyst_scenario::load;
use clap::Args;
use serde::Serialize;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Between two looks for tokens: a port keeps 0.4 s of them at 20 kHz.
const LOOK: Duration = Duration::from_millis(2);
/// Between two looks for a run that has not begun.
const WAIT: Duration = Duration::from_millis(20);
/// Between two looks whether it goes on.
const ALIVE: Duration = Duration::from_millis(200);
/// Foxglove's own port.
const FOXGLOVE: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), 8765);

/// `live`
#[derive(Debug, Args)]
pub struct LiveArguments {
    /// The run: its folder, that folder's name under runs/, or the scenario's name if only one of that name goes on there.
    pub run: PathBuf,
    /// Open a port for Foxglove (default, if nothing else is asked for: 127.0.0.1:8765).
    #[arg(long, value_name = "ADDRESS:PORT", num_args = 0..=1, default_missing_value = "127.0.0.1:8765")]
    pub foxglove: Option<SocketAddr>,
    /// Send datagrams there, as PlotJuggler's UDP server takes them.
    #[arg(long, value_name = "ADDRESS:PORT")]
    pub udp: Option<SocketAddr>,
    /// Where Zenoh is met.
    #[cfg(feature = "bridge")]
    #[command(flatten)]
    pub zenoh: ZenohArguments,
    /// Ticks for each second of the run, at most.
    #[arg(long, default_value_t = 1000.0, value_name = "HZ", value_parser = number_between(1e-6..=1e9, "Hz"))]
    pub rate_hz: f64,
    /// Wait so long for the run to begin.
    #[arg(long, default_value_t = 0.0, value_name = "S", value_parser = number_between(0.0..=86_400.0, "s"))]
    pub wait_s: f64,
    /// How the count is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// Where Zenoh is met: one of the two.
#[cfg(feature = "bridge")]
#[derive(Debug, Args)]
#[group(multiple = false)]
pub struct ZenohArguments {
    /// Wait there for Zenoh's peers and clients (tcp/127.0.0.1:7447): keys anhyst/RUN/live/CHANNEL, JSON.
    #[arg(long, value_name = "tcp/HOST:PORT", num_args = 0..=1, default_missing_value = "tcp/127.0.0.1:7447", value_parser = anhyst_launch::across::endpoint)]
    pub zenoh: Option<String>,
    /// Go to this router or peer of Zenoh instead.
    #[arg(long, value_name = "tcp/HOST:PORT", value_parser = anhyst_launch::across::endpoint)]
    pub zenoh_connect: Option<String>,
}

#[cfg(feature = "bridge")]
impl ZenohArguments {
    fn end(&self) -> Option<End> {
        let listen = self.zenoh.clone().map(End::Listen);
        listen.or(self.zenoh_connect.clone().map(End::Connect))
    }
}

/// What was passed on.
#[derive(Debug, Serialize)]
struct Passed {
    /// Tokens passed on, of all channels.
    messages: u64,
    /// Tokens that were overwritten before they were fetched.
    missed: u64,
}

/// Where messages go.
#[derive(Default)]
struct Ways {
    foxglove: Option<Server>,
    udp: Option<(UdpSocket, SocketAddr)>,
    #[cfg(feature = "bridge")]
    zenoh: Option<Outlet>,
}

/// Runs the command.
///
/// # Errors
/// A run that does not go on, a port that is taken.
pub fn run(arguments: &LiveArguments) -> miette::Result<Ending> {
    signals::install();
    // Viewers may join before a run that is waited for; of one that does not go on nothing is announced.
    let found = (arguments.wait_s == 0.0).then(|| awaited(arguments)).transpose()?;
    let mut ways = ways(arguments)?;
    let folder = found.map_or_else(|| awaited(arguments), Ok)?;
    let resources = meeting(&folder).ok_or_else(|| miette::miette!("the run does not say where its processes meet"))?;
    let scenario = load(&folder.scenario(), &[])?;
    let refused = |error: anhyst_ipc::LinkError| miette::miette!("{error}");
    let onlooker = Onlooker::open(&resources.prefix, &resources.root).map_err(refused)?;
    let mut thinned = Thinned::new(arguments.rate_hz, scenario.tick_s);
    let mut looked = Instant::now();
    let mut goes_on = true;
    loop {
        let heard = onlooker.hear(|token| {
            if thinned.passes(&token) {
                ways.pass(Heard::of(&token, scenario.tick_s));
            }
        });
        let heard = heard.map_err(refused)?;
        if heard == 0 && !goes_on || anhyst_ipc::stop_requested() {
            break;
        }
        if looked.elapsed() > ALIVE {
            // What its processes have sent before is fetched once more.
            (goes_on, looked) = (is_running(&resources.prefix), Instant::now());
        }
        sleep(LOOK);
    }
    ways.close();
    let passed = Passed {
        messages: thinned.passed,
        missed: thinned.missed,
    };
    if arguments.json.json {
        crate::say!("{}", json(&passed)?);
    } else {
        crate::say!("{} messages passed on, {} missed", passed.messages, passed.missed);
    }
    Ok(Ending::Held)
}

fn ways(arguments: &LiveArguments) -> miette::Result<Ways> {
    #[cfg(feature = "bridge")]
    let zenoh = arguments.zenoh.end();
    #[cfg(not(feature = "bridge"))]
    let zenoh: Option<()> = None;
    let only_foxglove = arguments.udp.is_none() && zenoh.is_none();
    let foxglove = arguments.foxglove.or(only_foxglove.then_some(FOXGLOVE));
    let name = arguments
        .run
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let taken = |address: SocketAddr| move |error: std::io::Error| miette::miette!("{address} cannot be used: {error}");
    let mut ways = Ways::default();
    if let Some(address) = foxglove {
        let server = Server::open(address, &name).map_err(taken(address))?;
        crate::complain!("Foxglove: ws://{}", server.address);
        ways.foxglove = Some(server);
    }
    if let Some(address) = arguments.udp {
        let any = if address.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" };
        let socket = UdpSocket::bind(any).map_err(taken(address))?;
        ways.udp = Some((socket, address));
    }
    #[cfg(feature = "bridge")]
    if let Some(end) = zenoh {
        let outlet = Outlet::open(&end, &name, schema).map_err(|error| miette::miette!("{error}"))?;
        crate::complain!("Zenoh: {}, keys anhyst/{name}/live/*", end.endpoint());
        ways.zenoh = Some(outlet);
    }
    Ok(ways)
}

/// The run's folder, as soon as it goes on.
fn awaited(arguments: &LiveArguments) -> Result<RunFolder, RunError> {
    let start = Instant::now();
    loop {
        match running(&arguments.run) {
            Err(_) if start.elapsed().as_secs_f64() < arguments.wait_s && !anhyst_ipc::stop_requested() => sleep(WAIT),
            found => return found,
        }
    }
}

impl Ways {
    fn pass(&mut self, heard: Heard) {
        // Nobody has to listen: what cannot be sent is lost, as datagrams are.
        if let Some((socket, address)) = &self.udp {
            let _ = socket.send_to(heard.datagram().as_bytes(), address);
        }
        #[cfg(feature = "bridge")]
        if let Some(outlet) = &self.zenoh {
            let _ = outlet.send(heard.channel, &heard.json);
        }
        if let Some(server) = &self.foxglove {
            server.send(&Arc::new(heard));
        }
    }

    fn close(&mut self) {
        if let Some(server) = self.foxglove.take() {
            server.close();
        }
    }
}
