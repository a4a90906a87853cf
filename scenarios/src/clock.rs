//! How time passes in a run: three named ways.

use anhyst_ipc::{CLOCKS, Invalid, NodeId};
use serde::{Deserialize, Serialize};

/// How time passes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Clock {
    /// As fast as the slowest node; every token is waited for, at most this long.
    Lockstep {
        /// A token that takes longer ends the run.
        #[serde(default = "default_receive_limit_s")]
        receive_limit_s: f64,
        /// As [`Realtime::empty_blocks`].
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        empty_blocks: bool,
    },
    /// With the clock on the wall: a token that is late is not waited for.
    Realtime(Realtime),
}

fn default_receive_limit_s() -> f64 {
    2.0
}

/// Who says when a tick begins.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Pacing {
    /// Every process counts periods from one start on the monotonic clock.
    #[default]
    FreeRunning,
    /// Tick k begins when the measurement of tick k arrives; the hardware (or the plant in its place) has the only timer.
    PacedByMeasurement,
}

/// A real-time run. What asks something of the system is tried and its outcome reported, never required.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Realtime {
    /// Who says when a tick begins.
    pub pace: Pacing,
    /// Priority of the SCHED_FIFO class that is asked for, 1 to 99; none: the ordinary class.
    pub priority: Option<u8>,
    /// CPUs that the processes are bound to, in turn; empty: the system chooses.
    pub cpus: Vec<usize>,
    /// Ask that no page of a process is ever swapped out.
    pub lock_memory: bool,
    /// Longest time, µs, that a core may take to wake up: 0 keeps it from sleeping.
    pub cpu_latency_us: Option<u32>,
    /// Poll for what is waited for instead of sleeping: shorter by a waking, at the price of a core for each process. Not the recorder.
    pub busy_wait: bool,
    /// Nodes whose process is started again if it dies: estimator, inverse, recorder.
    pub restart: Vec<NodeId>,
    /// How often, all processes together.
    pub most_restarts: u32,
    /// Write what every node consumes and sends, so that the run can be replayed bit for bit.
    pub log_tokens: bool,
    /// Put blocks that answer with zeros in place of all blocks: what remains is the transport.
    pub empty_blocks: bool,
}

impl Default for Realtime {
    fn default() -> Self {
        Self {
            pace: Pacing::FreeRunning,
            priority: None,
            cpus: Vec::new(),
            lock_memory: false,
            cpu_latency_us: None,
            busy_wait: false,
            restart: RESTARTABLE.to_vec(),
            most_restarts: 3,
            log_tokens: true,
            empty_blocks: false,
        }
    }
}

/// What the loop can do without for a while.
const RESTARTABLE: [NodeId; 3] = [NodeId::Estimator, NodeId::Inverse, NodeId::Recorder];
/// Bytes of a node's token log, at most: the file is mapped as a whole.
const MAX_LOG_BYTES: f64 = 8.0 * (1 << 30) as f64;
/// The estimator's record, the largest.
const LOG_BYTES_PER_TICK: f64 = 128.0;

impl Clock {
    /// The real-time settings, if time is real.
    pub fn realtime(&self) -> Option<&Realtime> {
        match self {
            Clock::Lockstep { .. } => None,
            Clock::Realtime(realtime) => Some(realtime),
        }
    }

    /// All blocks answer with zeros.
    pub fn has_empty_blocks(&self) -> bool {
        match self {
            Clock::Lockstep { empty_blocks, .. } => *empty_blocks,
            Clock::Realtime(realtime) => realtime.empty_blocks,
        }
    }

    /// Its name, as foreign processes are told it.
    pub fn name(&self) -> &'static str {
        let [lockstep, free_running, paced_by_measurement] = CLOCKS;
        match self.realtime().map(|realtime| realtime.pace) {
            None => lockstep,
            Some(Pacing::FreeRunning) => free_running,
            Some(Pacing::PacedByMeasurement) => paced_by_measurement,
        }
    }

    /// How long a process waits for another one that does not answer; in real time only where it does not live in our hands.
    pub fn receive_limit_s(&self) -> f64 {
        match self {
            Clock::Lockstep { receive_limit_s, .. } => *receive_limit_s,
            Clock::Realtime(_) => default_receive_limit_s(),
        }
    }

    /// Checks the settings for a run of so many ticks.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn validate(&self, ticks: f64) -> Result<(), Invalid> {
        match self {
            Clock::Lockstep { receive_limit_s, .. } => {
                Invalid::unless_between("clock.receive_limit_s", *receive_limit_s, 0.01, 3600.0, "s")
            }
            Clock::Realtime(realtime) => realtime.validate(ticks).map_err(|invalid| invalid.within("clock")),
        }
    }
}

impl Realtime {
    fn validate(&self, ticks: f64) -> Result<(), Invalid> {
        if let Some(priority) = self.priority.filter(|priority| !(1..=99).contains(priority)) {
            return Err(Invalid::new("priority", format!("{priority} is outside [1, 99]")));
        }
        if let Some(cpu) = self.cpus.iter().find(|cpu| **cpu >= rustix::thread::CpuSet::MAX_CPU) {
            let most = rustix::thread::CpuSet::MAX_CPU - 1;
            return Err(Invalid::new("cpus", format!("CPU {cpu} is outside [0, {most}]")));
        }
        if let Some(node) = self.restart.iter().find(|node| !RESTARTABLE.contains(node)) {
            let sentence = format!("{node} cannot be restarted in a running loop; estimator, inverse and recorder can");
            return Err(Invalid::new("restart", sentence));
        }
        let bytes = ticks * LOG_BYTES_PER_TICK;
        if self.log_tokens && bytes > MAX_LOG_BYTES {
            let gib = |bytes: f64| bytes / (1 << 30) as f64;
            let sentence = format!(
                "a log of {ticks:.0} ticks takes {:.1} GiB, more than {:.0} GiB; make the run shorter or set log_tokens to false",
                gib(bytes),
                gib(MAX_LOG_BYTES)
            );
            return Err(Invalid::new("log_tokens", sentence));
        }
        Ok(())
    }
}
