//! The server's half of a WebSocket (RFC 6455), as much of it as viewers need: the handshake, and frames that are whole messages.

use std::io::{Error, ErrorKind, Read as _, Result, Write as _};
use std::net::TcpStream;
use std::time::Duration;

/// What a request or a message of a client may take at most, bytes.
const MOST_BYTES: usize = 1 << 20;
/// How long a client may take to ask for a socket, and to take what it is sent.
const PATIENCE: Duration = Duration::from_secs(5);
/// How long one look for a message waits.
const LOOK: Duration = Duration::from_millis(2);
/// What RFC 6455 puts behind the key.
const KEY_END: &str = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";

/// Kinds of messages.
pub const TEXT: u8 = 1;
pub const BINARY: u8 = 2;
const CLOSE: u8 = 8;
const PING: u8 = 9;
const PONG: u8 = 10;

/// A socket to one client.
pub struct WebSocket {
    stream: TcpStream,
    read: Vec<u8>,
}

fn broken(why: &str) -> Error {
    Error::new(ErrorKind::InvalidData, why)
}

impl WebSocket {
    /// Answers a client's request; of the subprotocols that it knows the first that is `spoken` is taken.
    pub fn accept(mut stream: TcpStream, spoken: &[&str]) -> Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_write_timeout(Some(PATIENCE))?;
        let mut read = Vec::new();
        let end = loop {
            if let Some(at) = read.windows(4).position(|four| four == b"\r\n\r\n") {
                break at + 4;
            }
            if receive(&mut stream, &mut read)? == 0 || read.len() > MOST_BYTES {
                return Err(broken("no request for a WebSocket"));
            }
        };
        let request = String::from_utf8_lossy(&read[..end]).into_owned();
        let of = |name: &str| {
            let headers = request.lines().filter_map(|line| line.split_once(':'));
            let mut named = headers.filter(|(own, _)| own.trim().eq_ignore_ascii_case(name));
            named.next().map(|(_, value)| value.trim())
        };
        let Some(key) = of("Sec-WebSocket-Key") else {
            let _ =
                stream.write_all(b"HTTP/1.1 426 Upgrade Required\r\nUpgrade: websocket\r\nContent-Length: 0\r\n\r\n");
            return Err(broken("no request for a WebSocket"));
        };
        let offered = of("Sec-WebSocket-Protocol").unwrap_or_default();
        let protocol = offered.split(',').map(str::trim).find(|own| spoken.contains(own));
        let protocol = protocol.map_or_else(String::new, |own| format!("Sec-WebSocket-Protocol: {own}\r\n"));
        let answer = base64(&sha1(format!("{key}{KEY_END}").as_bytes()));
        let head = "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n";
        stream.write_all(format!("{head}Sec-WebSocket-Accept: {answer}\r\n{protocol}\r\n").as_bytes())?;
        stream.set_read_timeout(Some(LOOK))?;
        Ok(Self {
            stream,
            read: read.split_off(end),
        })
    }

    /// A message in text, if one has come: waits for it a moment. Pings are answered.
    pub fn poll(&mut self) -> Result<Option<String>> {
        loop {
            while let Some((kind, message)) = self.frame()? {
                match kind {
                    TEXT => return Ok(Some(String::from_utf8_lossy(&message).into_owned())),
                    PING => self.send(PONG, &message)?,
                    CLOSE => {
                        let _ = self.send(CLOSE, &message);
                        return Err(ErrorKind::ConnectionAborted.into());
                    }
                    _ => {}
                }
            }
            match receive(&mut self.stream, &mut self.read) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(_) => {}
                Err(error) if [ErrorKind::WouldBlock, ErrorKind::TimedOut].contains(&error.kind()) => return Ok(None),
                Err(error) => return Err(error),
            }
        }
    }

    /// A whole frame of what was read.
    fn frame(&mut self) -> Result<Option<(u8, Vec<u8>)>> {
        let [first, second, rest @ ..] = &self.read[..] else {
            return Ok(None);
        };
        if first & 0x80 == 0 || second & 0x80 == 0 {
            return Err(broken("a message in pieces, or without a mask"));
        }
        let (wide, length) = match second & 0x7f {
            126 => (2, rest.first_chunk().map(|bytes| u64::from(u16::from_be_bytes(*bytes)))),
            127 => (8, rest.first_chunk().map(|bytes| u64::from_be_bytes(*bytes))),
            short => (0, Some(u64::from(short))),
        };
        let Some(length) = length else { return Ok(None) };
        if length > MOST_BYTES as u64 {
            return Err(broken("a message that is too long"));
        }
        let (begin, length) = (2 + wide + 4, length as usize);
        let Some(masked) = self.read.get(begin..begin + length) else {
            return Ok(None);
        };
        let mask = &self.read[begin - 4..begin];
        let message = masked
            .iter()
            .zip(mask.iter().cycle())
            .map(|(byte, mask)| byte ^ mask)
            .collect();
        let kind = first & 0x0f;
        self.read.drain(..begin + length);
        Ok(Some((kind, message)))
    }

    /// Sends a message.
    pub fn send(&mut self, kind: u8, message: &[u8]) -> Result<()> {
        let mut frame = vec![0x80 | kind];
        match message.len() {
            short @ ..126 => frame.push(short as u8),
            middle @ ..0x1_0000 => {
                frame.push(126);
                frame.extend((middle as u16).to_be_bytes());
            }
            long => {
                frame.push(127);
                frame.extend((long as u64).to_be_bytes());
            }
        }
        frame.extend(message);
        self.stream.write_all(&frame)
    }

    /// Says good-bye.
    pub fn close(mut self) {
        let _ = self.send(CLOSE, &1000_u16.to_be_bytes());
    }
}

fn receive(stream: &mut TcpStream, read: &mut Vec<u8>) -> Result<usize> {
    let mut some = [0; 4096];
    let count = stream.read(&mut some)?;
    read.extend(&some[..count]);
    Ok(count)
}

/// FIPS 180-4; the handshake asks for it, and nothing is kept secret by it.
fn sha1(bytes: &[u8]) -> [u8; 20] {
    let mut state: [u32; 5] = [0x6745_2301, 0xefcd_ab89, 0x98ba_dcfe, 0x1032_5476, 0xc3d2_e1f0];
    let mut padded = bytes.to_vec();
    padded.push(0x80);
    padded.resize(padded.len().next_multiple_of(64), 0);
    if bytes.len() % 64 > 55 {
        padded.resize(padded.len() + 64, 0);
    }
    let at = padded.len() - 8;
    padded[at..].copy_from_slice(&(8 * bytes.len() as u64).to_be_bytes());
    for block in padded.as_chunks::<64>().0 {
        let mut words = [0_u32; 80];
        for (word, chunk) in words.iter_mut().zip(block.as_chunks::<4>().0) {
            *word = u32::from_be_bytes(*chunk);
        }
        for i in 16..80 {
            words[i] = (words[i - 3] ^ words[i - 8] ^ words[i - 14] ^ words[i - 16]).rotate_left(1);
        }
        let [mut a, mut b, mut c, mut d, mut e] = state;
        for (i, word) in words.into_iter().enumerate() {
            let (mixed, constant) = match i {
                ..20 => (b & c | !b & d, 0x5a82_7999),
                20..40 => (b ^ c ^ d, 0x6ed9_eba1),
                40..60 => (b & c | b & d | c & d, 0x8f1b_bcdc),
                _ => (b ^ c ^ d, 0xca62_c1d6_u32),
            };
            let next = a
                .rotate_left(5)
                .wrapping_add(mixed)
                .wrapping_add(e)
                .wrapping_add(constant)
                .wrapping_add(word);
            (e, d, c, b, a) = (d, c, b.rotate_left(30), a, next);
        }
        for (own, added) in state.iter_mut().zip([a, b, c, d, e]) {
            *own = own.wrapping_add(added);
        }
    }
    let mut digest = [0; 20];
    for (chunk, word) in digest.as_chunks_mut::<4>().0.iter_mut().zip(state) {
        *chunk = word.to_be_bytes();
    }
    digest
}

/// RFC 4648.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for three in bytes.chunks(3) {
        let group = (0..3).fold(0, |group, at| {
            group << 8 | u32::from(three.get(at).copied().unwrap_or(0))
        });
        for at in 0..4 {
            let letter = LETTERS[(group >> (18 - 6 * at)) as usize & 63];
            text.push(if at <= three.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the handshake by RFC 6455's own example, and the digest by those of FIPS 180.
    #[test]
    fn the_handshake_answers_as_the_standard_says() {
        let hexadecimal = |bytes: &[u8]| sha1(bytes).map(|byte| format!("{byte:02x}")).concat();
        assert_eq!(hexadecimal(b"abc"), "a9993e364706816aba3e25717850c26c9cd0d89d");
        let two_blocks = b"abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq";
        assert_eq!(hexadecimal(two_blocks), "84983e441c3bd26ebaae4aa1f95129e5e54670f1");
        let key = format!("dGhlIHNhbXBsZSBub25jZQ=={KEY_END}");
        assert_eq!(base64(&sha1(key.as_bytes())), "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
        assert_eq!(
            (base64(b"f"), base64(b"fo"), base64(b"foo")),
            ("Zg==".into(), "Zm8=".into(), "Zm9v".into())
        );
    }
}
