//! Processes that the launcher does not bring: a driver, a rig, another language. Which they are, what they must be told,
//! and the command that starts one if the user gave it.

use crate::resources::Resources;
use crate::say::quoted;
use anhyst_ipc::NodeId;
use anhyst_scenario::Scenario;
use std::str::FromStr;
use std::time::Duration;

/// `--external-command PROCESS=COMMAND`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExternalCommand {
    /// The nodes that the command stands for.
    pub nodes: Vec<NodeId>,
    /// What the shell runs.
    pub command: String,
}

impl FromStr for ExternalCommand {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, command) = text
            .split_once('=')
            .ok_or_else(|| format!("{text} has no '='; write amplifier='COMMAND'"))?;
        let command = command.trim();
        if command.is_empty() {
            return Err(format!("{text} has no command behind '='"));
        }
        Ok(Self {
            nodes: Nodes::from_str(name)?.0,
            command: command.into(),
        })
    }
}

/// The nodes of a process, by its name: `amplifier`, `plant-sim+amplifier`. `plant` is short for `plant-sim`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Nodes(pub Vec<NodeId>);

impl FromStr for Nodes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let node = |name: &str| match name.trim() {
            "plant" => Ok(NodeId::Plant),
            name => NodeId::named(name).ok_or_else(|| {
                let names = NodeId::LOOP_ORDER.map(NodeId::name).join(", ");
                format!("\"{name}\" is no node; there are {names}")
            }),
        };
        text.split('+').map(node).collect::<Result<_, _>>().map(Self)
    }
}

/// The environment variables that a driver is told things by, and their meaning.
pub const VARIABLES: [(&str, &str); 10] = [
    ("ANHYST_PROCESS", "name of the driver's process"),
    ("ANHYST_SERVICE_PREFIX", "prefix of the run's iceoryx2 resources"),
    ("ANHYST_ROOT", "directory of iceoryx2's files"),
    (
        "ANHYST_PROCESSES",
        "names of all processes, commas between; nodes that share a process have a `+` between",
    ),
    ("ANHYST_TICK_S", "time between two ticks, s"),
    (
        "ANHYST_TICKS",
        "length of the run in ticks: a plant stops after so many, to others phase 3 tells the end",
    ),
    (
        "ANHYST_CLOCK",
        "`lockstep`; in real time `free_running` or `paced_by_measurement`; if it is not set: lockstep",
    ),
    (
        "ANHYST_RECEIVE_LIMIT_S",
        "how long a token may take in lockstep, and in real time a foreign process be silent, s",
    ),
    (
        "ANHYST_START_LIMIT_S",
        "how long the processes may take to find each other, s",
    ),
    ("ANHYST_YIELDS", "polls before a process sleeps"),
];

/// What a driver is told: [`VARIABLES`] with their values.
pub fn environment(
    process: &str,
    scenario: &Scenario,
    resources: &Resources,
    receive_limit_s: f64,
    start_limit: Duration,
    yields: u32,
) -> Vec<(&'static str, String)> {
    let processes = scenario.placement.processes();
    let names: Vec<&str> = processes.iter().map(|(name, _)| name.as_str()).collect();
    let values = [
        process.to_owned(),
        resources.prefix.clone(),
        resources.root.display().to_string(),
        names.join(","),
        format!("{:e}", scenario.tick_s),
        scenario.ticks().to_string(),
        scenario.clock.name().to_owned(),
        receive_limit_s.to_string(),
        start_limit.as_secs_f64().to_string(),
        yields.to_string(),
    ];
    VARIABLES.iter().map(|(name, _)| *name).zip(values).collect()
}

/// Tells the user what to start, for a process without a command.
pub fn announce(
    process: &str,
    environment: &[(&'static str, String)],
    folder: &std::path::Path,
    start_limit: Duration,
) {
    let exports: Vec<String> = environment
        .iter()
        .map(|(name, value)| format!("{name}={}", quoted(value.as_ref())))
        .collect();
    let value = |wanted: &str| {
        let found = environment.iter().find(|(name, _)| *name == wanted);
        found.map_or(String::new(), |(_, value)| quoted(value.as_ref()))
    };
    let first = process.split('+').next().unwrap_or(process);
    crate::complain!(
        "{process} is external: start it within {} s, in another terminal, with\n  {} YOUR-DRIVER\nor the simulated one with\n  anhyst node {first} {scenario} --out {folder} --service-prefix {} --root {}",
        start_limit.as_secs_f64(),
        exports.join(" "),
        value("ANHYST_SERVICE_PREFIX"),
        value("ANHYST_ROOT"),
        scenario = quoted(&folder.join("scenario.ron")),
        folder = quoted(folder),
    );
}
