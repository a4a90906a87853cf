//! A server of Foxglove's WebSocket protocol: channels in JSON with their schemas, sent to whoever subscribes.
//!
//! One thread a client, each with a queue of its own: a client that cannot follow loses messages, and nobody waits for it. Protocol:
//! <https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>; the subprotocol that the SDK speaks differs in nothing that is used.

use super::websocket::{BINARY, TEXT, WebSocket};
use super::{Heard, schema, schema_name};
use anhyst_ipc::Channel;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{ErrorKind, Result};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

const PROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
/// Opcode of a message with data.
const MESSAGE_DATA: u8 = 1;
/// Messages that wait for a client.
const QUEUE: usize = 1 << 14;

/// A client's queue, and the thread that empties it.
struct Client {
    queue: SyncSender<Arc<Heard>>,
    thread: JoinHandle<()>,
}

/// An open port and the clients that have come.
pub struct Server {
    clients: Arc<Mutex<Vec<Client>>>,
    pub address: SocketAddr,
}

impl Server {
    /// Listens there; `name` is what clients are told.
    pub fn open(address: SocketAddr, name: &str) -> Result<Self> {
        let listener = TcpListener::bind(address)?;
        let server = Server {
            clients: Arc::default(),
            address: listener.local_addr()?,
        };
        let (clients, name) = (server.clients.clone(), name.to_owned());
        // It waits for clients as long as the process lives.
        thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let (queue, heard) = sync_channel(QUEUE);
                let name = name.clone();
                let thread = thread::spawn(move || {
                    // A client that leaves, or speaks another language, is nobody's error.
                    let _ = serve(stream, &name, &heard);
                });
                let mut clients = clients.lock().unwrap_or_else(PoisonError::into_inner);
                clients.push(Client { queue, thread });
            }
        });
        Ok(server)
    }

    /// Hands a message to every client that has room for it.
    pub fn send(&self, heard: &Arc<Heard>) {
        let mut clients = self.clients.lock().unwrap_or_else(PoisonError::into_inner);
        clients.retain(|client| !matches!(client.queue.try_send(heard.clone()), Err(TrySendError::Disconnected(_))));
    }

    /// Lets every client have what waits for it, and says good-bye.
    pub fn close(&self) {
        let clients = std::mem::take(&mut *self.clients.lock().unwrap_or_else(PoisonError::into_inner));
        for Client { queue, thread } in clients {
            drop(queue);
            let _ = thread.join();
        }
    }
}

fn serve(stream: TcpStream, name: &str, heard: &Receiver<Arc<Heard>>) -> Result<()> {
    let mut socket = WebSocket::accept(stream, &PROTOCOLS)?;
    let told =
        json!({ "op": "serverInfo", "name": name, "capabilities": [], "supportedEncodings": [], "metadata": {} });
    socket.send(TEXT, told.to_string().as_bytes())?;
    let channels: Vec<Value> = Channel::ALL
        .into_iter()
        .map(|channel| {
            json!({
                "id": id(channel), "topic": format!("/{channel}"), "encoding": "json",
                "schemaName": schema_name(channel), "schema": schema(channel), "schemaEncoding": "jsonschema",
            })
        })
        .collect();
    let offered = json!({ "op": "advertise", "channels": channels });
    socket.send(TEXT, offered.to_string().as_bytes())?;
    let mut wanted: BTreeMap<u64, u32> = BTreeMap::new();
    loop {
        while let Some(text) = socket.poll()? {
            follow(&text, &mut wanted).ok_or(ErrorKind::InvalidData)?;
        }
        loop {
            match heard.try_recv() {
                Ok(message) => {
                    if let Some(subscription) = wanted.get(&id(message.channel)) {
                        socket.send(BINARY, &data(*subscription, &message))?;
                    }
                }
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => {
                    socket.close();
                    return Ok(());
                }
            }
        }
    }
}

/// Channels count from 1.
fn id(channel: Channel) -> u64 {
    channel.number() as u64 + 1
}

/// What a client asks for, by channel the number of its subscription. None: it cannot be read.
fn follow(text: &str, wanted: &mut BTreeMap<u64, u32>) -> Option<()> {
    let asked: Value = serde_json::from_str(text).ok()?;
    match asked["op"].as_str()? {
        "subscribe" => {
            for own in asked["subscriptions"].as_array()? {
                wanted.insert(own["channelId"].as_u64()?, u32::try_from(own["id"].as_u64()?).ok()?);
            }
        }
        "unsubscribe" => {
            let gone: Vec<u64> = asked["subscriptionIds"]
                .as_array()?
                .iter()
                .filter_map(Value::as_u64)
                .collect();
            wanted.retain(|_, subscription| !gone.contains(&u64::from(*subscription)));
        }
        // It may ask for what was not offered.
        _ => {}
    }
    Some(())
}

fn data(subscription: u32, message: &Heard) -> Vec<u8> {
    let mut bytes = vec![MESSAGE_DATA];
    bytes.extend(subscription.to_le_bytes());
    bytes.extend(message.time_ns.to_le_bytes());
    bytes.extend(message.json.as_bytes());
    bytes
}
