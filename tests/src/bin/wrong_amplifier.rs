//! Amplifiers that are wrong in one way each, named by what they do: `wrong_amplifier MISTAKE`, met by
//! `anhyst verify-amplifier`. Apart from its mistake each is the amplifier of scenarios/amplifier.ron.

use anhyst_ipc::{
    Channel, CoilField, Connections, LinkError, NodeId, SafeField, SharedContext, SharedSettings, Wait, Wire,
    status_word,
};
use anhyst_model::{Amplifier, AmplifierConstants};
use iceoryx2::prelude::*;
use std::error::Error;
use std::path::PathBuf;
use std::rc::Rc;
use std::time::Duration;

/// The amplifier of scenarios/amplifier.ron.
const RIGHT: AmplifierConstants = AmplifierConstants {
    bandwidth_hz: Some(3000.0),
    field_limit_a_per_m: Some(30e3),
    slew_limit_a_per_m_s: Some(40e6),
    delay_ticks: 0,
};
const A_PER_M_PER_OERSTED: f64 = 79.577_471_545_947_67;
const NOISE_RMS_A_PER_M: f64 = 60.0;
/// The way to the safe field, 0 A/m, and the wait for the lag.
const RAMP_TICKS: u64 = 400;
const SETTLING_TICKS: u64 = 100;

/// Another layout of the same size: what a driver has whose author did not read the field list.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("CoilField")]
#[repr(C)]
struct PermutedCoilField {
    status: u64,
    field_a_per_m: f64,
    sent_ns: u64,
    tick: u64,
}

struct Wrong {
    mistake: String,
    amplifier: Amplifier,
    noise: u64,
    latched: bool,
    last: CoilField,
}

fn main() {
    let mistake = std::env::args().nth(1).unwrap_or_default();
    if let Err(error) = run(mistake) {
        eprintln!("{error}");
        std::process::exit(4);
    }
}

fn constants(mistake: &str) -> AmplifierConstants {
    match mistake {
        "late_by_three_ticks" => AmplifierConstants {
            delay_ticks: 3,
            ..RIGHT
        },
        "slow_bandwidth" => AmplifierConstants {
            bandwidth_hz: Some(600.0),
            ..RIGHT
        },
        "without_limit" => AmplifierConstants {
            field_limit_a_per_m: None,
            ..RIGHT
        },
        "without_slew_limit" => AmplifierConstants {
            slew_limit_a_per_m_s: None,
            ..RIGHT
        },
        _ => RIGHT,
    }
}

fn run(mistake: String) -> Result<(), Box<dyn Error>> {
    let settings = settings()?;
    // Kept until the end: the channel lives as long as somebody has it open.
    let _permuted = if mistake == "permuted_layout" {
        Some(permuted_channel(&settings)?)
    } else {
        None
    };
    let context = Rc::new(SharedContext::open(settings)?);
    if mistake == "permuted_layout" {
        std::thread::sleep(Duration::from_secs(20));
        return Ok(());
    }
    let wire = |channel, reader, delay| Wire { channel, reader, delay };
    let wires = vec![
        wire(Channel::SafeField, NodeId::Amplifier, 0),
        wire(Channel::CoilField, NodeId::Plant, 1),
        wire(Channel::CoilField, NodeId::Recorder, 0),
    ];
    let mut connections = Connections::new([NodeId::Amplifier], wires, Some(context));
    let mut commands = connections.receiver::<SafeField>(NodeId::Amplifier, 0)?;
    let mut answers = connections.sender::<CoilField>()?;
    connections.start_barriers(&mut || answers.connect())?;
    let mut wrong = Wrong {
        amplifier: Amplifier::new(constants(&mistake), 5e-5)?,
        mistake,
        noise: 1,
        latched: false,
        last: CoilField::default(),
    };
    let mut last_command_a_per_m = 0.0;
    for tick in 0.. {
        match commands.receive(tick) {
            Ok(command) => {
                last_command_a_per_m = command.field_a_per_m;
                if let Some(answer) = wrong.answer(tick, command.field_a_per_m) {
                    answers.send(answer)?;
                }
            }
            Err(LinkError::Silent { .. }) if wrong.mistake == "ignores_dead_controller" => return Ok(()),
            Err(LinkError::Silent { .. }) => {
                for after in 0..RAMP_TICKS + SETTLING_TICKS {
                    let left = 1.0 - after.min(RAMP_TICKS) as f64 / RAMP_TICKS as f64;
                    if let Some(answer) = wrong.answer(tick + after, left * last_command_a_per_m) {
                        answers.send(answer)?;
                    }
                }
                return Ok(());
            }
            Err(error) => return Err(error.into()),
        }
    }
    Ok(())
}

impl Wrong {
    fn answer(&mut self, tick: u64, command_a_per_m: f64) -> Option<CoilField> {
        let is_number = command_a_per_m.is_finite();
        self.latched |= !is_number;
        let mistake = self.mistake.clone();
        let mistake = mistake.as_str();
        let taken = match mistake {
            "wrong_sign" => -command_a_per_m,
            "gain_of_ten_percent_more" => 1.1 * command_a_per_m,
            "latches_after_nonsense" if self.latched => 0.0,
            _ => command_a_per_m,
        };
        let output = self.amplifier.step(taken);
        let right = output.field_a_per_m;
        let field_a_per_m = match mistake {
            "answers_in_oersted" => right / A_PER_M_PER_OERSTED,
            "with_offset" => right + 200.0,
            "noisy" => right + self.noise_a_per_m(),
            "early_by_a_tick" => self.amplifier.next_field_a_per_m(),
            "stuck_after_300_ticks" if tick >= 300 => self.last.field_a_per_m,
            "answers_nan" if !is_number => f64::NAN,
            _ => right,
        };
        let limits = status_word([
            (output.amplitude_limited, CoilField::AMPLITUDE_LIMITED),
            (output.slew_limited, CoilField::SLEW_LIMITED),
        ]);
        self.last = CoilField {
            tick,
            field_a_per_m,
            status: if mistake == "hides_its_limits" { 0 } else { limits },
            ..CoilField::default()
        };
        match mistake {
            "silent_after_100_ticks" if tick >= 100 => None,
            "skips_a_tick" if tick == 500 => None,
            "dies_after_100_ticks" if tick >= 100 => std::process::exit(7),
            "numbers_ticks_from_one" => Some(CoilField {
                tick: tick + 1,
                ..self.last
            }),
            _ => Some(self.last),
        }
    }

    /// Uniform, from a xorshift generator: the same in every run.
    fn noise_a_per_m(&mut self) -> f64 {
        self.noise ^= self.noise << 13;
        self.noise ^= self.noise >> 7;
        self.noise ^= self.noise << 17;
        let share = (self.noise >> 11) as f64 / (1_u64 << 53) as f64;
        NOISE_RMS_A_PER_M * 12_f64.sqrt() * (share - 0.5)
    }
}

fn settings() -> Result<SharedSettings, Box<dyn Error>> {
    let get = |name: &str| std::env::var(name).map_err(|_| format!("{name} is not set"));
    let nodes = |process: &str| -> Vec<NodeId> {
        let has = |node: &NodeId| process.split('+').any(|name| name == node.name());
        NodeId::LOOP_ORDER.into_iter().filter(has).collect()
    };
    let processes = get("ANHYST_PROCESSES")?;
    Ok(SharedSettings {
        prefix: get("ANHYST_SERVICE_PREFIX")?,
        root: PathBuf::from(get("ANHYST_ROOT")?),
        process: get("ANHYST_PROCESS")?,
        processes: processes
            .split(',')
            .map(|name| (name.to_owned(), nodes(name)))
            .collect(),
        agreement: get("ANHYST_AGREEMENT")?.parse()?,
        wait: Wait::Notified { yields: 20 },
        receive_limit: Duration::from_secs_f64(get("ANHYST_RECEIVE_LIMIT_S")?.parse()?),
        start_limit: Duration::from_secs(20),
    })
}

type PermutedChannel = (
    Node<ipc::Service>,
    iceoryx2::service::port_factory::publish_subscribe::PortFactory<ipc::Service, PermutedCoilField, ()>,
);

fn permuted_channel(settings: &SharedSettings) -> Result<PermutedChannel, Box<dyn Error>> {
    let mut config = Config::default();
    config.global.prefix = FileName::new(settings.prefix.as_bytes()).map_err(|error| format!("{error:?}"))?;
    let root = Path::new(settings.root.to_string_lossy().as_bytes()).map_err(|error| format!("{error:?}"))?;
    config.global.set_root_path(&root);
    let node = NodeBuilder::new().config(&config).create::<ipc::Service>()?;
    let service = node
        .service_builder(&ServiceName::new("loop/coil_field")?)
        .publish_subscribe::<PermutedCoilField>()
        .create()?;
    Ok((node, service))
}
