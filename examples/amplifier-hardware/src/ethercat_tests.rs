//! A line of three that is none: coupler, output and input terminal as memories behind frames, the input tied to the output. It knows what a master
//! needs of ETG.1000.4: addressing, station addresses, the states, the identity's memory, FMMUs and the working counter.

use super::*;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

/// Ethernet's header, EtherCAT's, a datagram's, and the working counter behind its data.
const ETHERNET: usize = 14;
const HEADER: usize = 2;
const DATAGRAM: usize = 10;
const OUTPUTS: usize = 0x1100;
const INPUTS: usize = 0x1180;

/// One terminal: its registers and memory, and its identity.
struct Terminal {
    memory: Vec<u8>,
    identity: Vec<u16>,
}

impl Terminal {
    /// Bytes of outputs and inputs, and whether another terminal follows.
    fn new(outputs: u16, inputs: u16, follows: bool) -> Self {
        let mut memory = vec![0; 0x2000];
        // Links: to the one before, to the one behind.
        memory[0x110] = if follows { 0x30 } else { 0x10 };
        let mut identity = vec![0; 0x40];
        identity[8] = 2;
        let mut category = |kind: u16, words: &[u16]| {
            identity.extend([kind, words.len() as u16]);
            identity.extend(words);
        };
        let general = [0; 16];
        category(30, &general);
        // What the memory managers are for: outputs, inputs.
        category(40, &[0x0201]);
        // Start, length, control and status, enable and use.
        category(
            41,
            &[
                OUTPUTS as u16,
                outputs,
                0x0024,
                0x0301,
                INPUTS as u16,
                inputs,
                0x0020,
                0x0401,
            ],
        );
        // Index, entries and memory, -, flags; of each entry index, -, kind and bits, flags.
        let object =
            |index: u16, memory: u16, bytes: u16| [index, memory << 8 | 1, 0, 0, 0x6000, 1, (8 * bytes) << 8 | 6, 0];
        if inputs > 0 {
            category(50, &object(0x1a00, 1, inputs));
        }
        if outputs > 0 {
            category(51, &object(0x1600, 0, outputs));
        }
        identity.push(0xffff);
        identity.extend([0xffff; 8]);
        Self { memory, identity }
    }

    fn word(&self, at: usize) -> u16 {
        u16::from_le_bytes([self.memory[at], self.memory[at + 1]])
    }

    fn write(&mut self, at: usize, data: &[u8]) {
        self.memory[at..at + data.len()].copy_from_slice(data);
        let touches = |register: usize| (at..at + data.len()).contains(&register);
        if touches(0x120) {
            // It becomes what is asked for at once, and acknowledges errors.
            self.memory[0x130] = self.memory[0x120] & 0x0f;
        }
        if touches(0x502) && self.word(0x502) & 0x0100 != 0 {
            let address = usize::from(self.word(0x504));
            let words = (address..address + 2).map(|at| self.identity.get(at).copied().unwrap_or(0xffff));
            let bytes: Vec<u8> = words.flat_map(u16::to_le_bytes).collect();
            self.memory[0x508..0x50c].copy_from_slice(&bytes);
            self.memory[0x502..0x504].copy_from_slice(&[0, 0]);
        }
    }

    /// Logical data in and out; what the working counter gains.
    fn exchange(&mut self, start: usize, sent: &[u8], data: &mut [u8]) -> u16 {
        let (mut read, mut written) = (0, 0);
        for manager in 0..4 {
            let at = 0x600 + 16 * manager;
            if self.memory[at + 12] & 1 == 0 {
                continue;
            }
            let logical = usize::from(self.word(at)) + (usize::from(self.word(at + 2)) << 16);
            let (length, physical) = (usize::from(self.word(at + 4)), usize::from(self.word(at + 8)));
            let Some(from) = logical
                .checked_sub(start)
                .filter(|from| length > 0 && from + length <= data.len())
            else {
                continue;
            };
            if self.memory[at + 11] & 1 != 0 {
                data[from..from + length].copy_from_slice(&self.memory[physical..physical + length]);
                read = 1;
            }
            if self.memory[at + 11] & 2 != 0 && self.memory[0x130] == 8 {
                self.memory[physical..physical + length].copy_from_slice(&sent[from..from + length]);
                written = 2;
            }
        }
        read + written
    }
}

/// The line, and what has gone over it.
struct Line {
    terminals: Vec<Terminal>,
    /// Nothing comes back from here on; from the last terminal nothing does.
    cut: bool,
    torn: bool,
    frames: Vec<(Vec<u8>, Vec<u8>)>,
}

impl Line {
    fn new() -> Self {
        Self {
            terminals: vec![
                Terminal::new(0, 0, true),
                Terminal::new(2, 0, true),
                Terminal::new(0, 4, false),
            ],
            cut: false,
            torn: false,
            frames: Vec::new(),
        }
    }

    /// The frame as it comes back.
    fn pass(&mut self, frame: &[u8]) -> Option<Vec<u8>> {
        if self.cut {
            return None;
        }
        let mut back = frame.to_vec();
        // The first terminal marks what has been through it.
        back[6] |= 2;
        let mut at = ETHERNET + HEADER;
        loop {
            let flags = u16::from_le_bytes([back[at + 6], back[at + 7]]);
            let end = at + DATAGRAM + usize::from(flags & 0x7ff);
            self.datagram(&mut back[at..end + 2]);
            if flags & 0x8000 == 0 {
                break;
            }
            at = end + 2;
        }
        // The wire from the output to the input; two bytes of status before it.
        let volts = [self.terminals[1].memory[OUTPUTS], self.terminals[1].memory[OUTPUTS + 1]];
        self.terminals[2].memory[INPUTS + 2..INPUTS + 4].copy_from_slice(&volts);
        self.frames.push((frame.to_vec(), back.clone()));
        Some(back)
    }

    fn datagram(&mut self, datagram: &mut [u8]) {
        let (header, rest) = datagram.split_at_mut(DATAGRAM);
        let (data, counter) = rest.split_at_mut(rest.len() - 2);
        let command = header[0];
        let register = usize::from(u16::from_le_bytes([header[4], header[5]]));
        let sent = data.to_vec();
        let mut counted = u16::from_le_bytes([counter[0], counter[1]]);
        let last = self.terminals.len() - usize::from(self.torn);
        for terminal in &mut self.terminals[..last] {
            let address = u16::from_le_bytes([header[2], header[3]]);
            let own = match command {
                1 | 2 | 7 | 8 => {
                    header[2..4].copy_from_slice(&address.wrapping_add(1).to_le_bytes());
                    address == 0 || command > 2
                }
                4 | 5 => address == terminal.word(0x10),
                12 => {
                    let start = usize::from(address) + (register << 16);
                    counted += terminal.exchange(start, &sent, data);
                    false
                }
                other => panic!("no terminal knows command {other}"),
            };
            if !own {
                continue;
            }
            counted += 1;
            match command {
                2 | 5 | 8 => terminal.write(register, &sent),
                7 => data
                    .iter_mut()
                    .zip(&terminal.memory[register..])
                    .for_each(|(data, own)| *data |= own),
                _ => data.copy_from_slice(&terminal.memory[register..register + data.len()]),
            }
        }
        counter.copy_from_slice(&counted.to_le_bytes());
    }
}

const TERMINALS: Terminals = Terminals {
    output: Slot { terminal: 1, byte: 0 },
    input: Slot { terminal: 2, byte: 2 },
    full_scale_v: 10.0,
    lost_exchanges: 3,
    exchange_limit: Duration::from_millis(200),
};

/// A master whose frames are answered by this.
fn master(
    terminals: Terminals,
    mut answer: impl FnMut(&[u8]) -> Option<Vec<u8>> + Send + 'static,
) -> Result<Ethercat, ConverterError> {
    Ethercat::behind("a line", terminals, move |mut tx, mut rx| {
        // It ends with the test's process.
        std::thread::spawn(move || {
            loop {
                let Some(frame) = tx.next_sendable_frame() else {
                    std::thread::sleep(Duration::from_micros(20));
                    continue;
                };
                let mut back = None;
                let sent = frame.send_blocking(|bytes| {
                    back = answer(bytes);
                    Ok(bytes.len())
                });
                sent.expect("a frame goes out");
                if let Some(back) = back {
                    // One that was given up is not known any more.
                    let _ = rx.receive_frame(&back);
                }
            }
        });
        Ok(())
    })
}

fn behind(line: &Arc<Mutex<Line>>, terminals: Terminals) -> Result<Ethercat, ConverterError> {
    let line = line.clone();
    master(terminals, move |frame| line.lock().unwrap().pass(frame))
}

/// Guards counts, their byte and their sign, and the order: what is read is of after the command.
#[test]
fn volts_go_round_the_line() {
    let line = Arc::new(Mutex::new(Line::new()));
    let mut own = behind(&line, TERMINALS).unwrap();
    assert_eq!(own.working_counter, 3);
    for (volts, count) in [
        (5.0, 16_384_i16),
        (-5.0, -16_384),
        (10.0, 32_767),
        (-99.0, -32_767),
        (0.0, 0),
    ] {
        own.write_volts(volts).unwrap();
        let bytes = line.lock().unwrap().terminals[1].memory[OUTPUTS..OUTPUTS + 2].to_vec();
        assert_eq!(i16::from_le_bytes([bytes[0], bytes[1]]), count);
        let read = own.read_volts().unwrap();
        assert!(
            (read - f64::from(count) * 10.0 / FULL_SCALE).abs() < 1e-12,
            "{read} V of {volts} V"
        );
    }
}

/// Guards the watchdog: a few exchanges may be lost, and the last value holds; more are a fault, whether nothing comes or not all answer.
#[test]
fn a_line_that_is_cut_or_torn_is_a_fault() {
    for torn in [true, false] {
        let line = Arc::new(Mutex::new(Line::new()));
        let mut own = behind(&line, TERMINALS).unwrap();
        own.write_volts(2.0).unwrap();
        let before = own.read_volts().unwrap();
        let set = |wrong: bool| {
            let mut line = line.lock().unwrap();
            *(if torn { &mut line.torn } else { &mut line.cut }) = wrong;
        };
        set(true);
        for _ in 0..3 {
            assert_eq!(own.read_volts().unwrap(), before);
        }
        set(false);
        own.read_volts().unwrap();
        set(true);
        let error = (0..4).find_map(|_| own.write_volts(1.0).err()).unwrap().to_string();
        assert!(error.contains("a line lost 4 exchanges in a row"), "{error}");
        assert!(
            !torn || error.contains("working counter of 2, 3 would be all"),
            "{error}"
        );
    }
}

/// Guards the refusals: a terminal that is not there, and one without such a value, are named before anything is put out.
#[test]
fn a_value_that_the_line_has_not_is_named() {
    let slots = [
        (
            Slot { terminal: 7, byte: 0 },
            "has 3 terminals, and the output is on number 7",
        ),
        (Slot { terminal: 2, byte: 0 }, "has 0 bytes of outputs"),
        (
            Slot { terminal: 1, byte: 1 },
            "has 2 bytes of outputs, and the output's two begin at byte 1",
        ),
    ];
    for (output, words) in slots {
        let line = Arc::new(Mutex::new(Line::new()));
        let error = behind(&line, Terminals { output, ..TERMINALS })
            .err()
            .unwrap()
            .to_string();
        assert!(error.contains(words), "{error}");
        assert_eq!(line.lock().unwrap().terminals[1].memory[OUTPUTS..OUTPUTS + 2], [0, 0]);
    }
    let silent = master(TERMINALS, |_| None).err().unwrap().to_string();
    assert!(silent.starts_with("a line "), "{silent}");
}

/// Guards the frames themselves: answered from a recording, which knows nothing but what went over the line before, the master sends the same bytes
/// and reads the same volts.
#[test]
fn recorded_frames_are_replayed() {
    let course = |own: &mut Ethercat| -> Vec<f64> {
        let volts = (0..20).map(|tick| 4.0 * (0.3 * f64::from(tick)).sin());
        volts
            .map(|volts| {
                own.write_volts(volts).unwrap();
                own.read_volts().unwrap()
            })
            .collect()
    };
    let line = Arc::new(Mutex::new(Line::new()));
    let live = course(&mut behind(&line, TERMINALS).unwrap());
    let mut frames: VecDeque<(Vec<u8>, Vec<u8>)> = std::mem::take(&mut line.lock().unwrap().frames).into();
    assert!(frames.len() > 100, "{}", frames.len());
    let replayed = master(TERMINALS, move |frame| {
        let (sent, back) = frames.pop_front()?;
        assert_eq!(frame, sent, "{} frames are left", frames.len());
        Some(back)
    });
    assert_eq!(course(&mut replayed.unwrap()), live);
}
