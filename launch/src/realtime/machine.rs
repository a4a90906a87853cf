//! What a real-time process asks of the system: priority, locked memory, a CPU of its own, one that is awake, exact timers.
//! Nothing is required: each attempt is reported with what the system said.

use anhyst_ipc::NodeId;
use anhyst_scenario::Realtime;
use rustix::thread::{CpuSet, sched_setaffinity, set_current_timer_slack};
use serde::{Deserialize, Serialize};
use std::io::Write as _;
use std::num::NonZeroU64;

/// One thing that was asked for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Attempt {
    /// What.
    pub what: String,
    /// True if the system gave it.
    pub granted: bool,
    /// Why not.
    pub refused_because: Option<String>,
}

impl Attempt {
    fn of(what: String, outcome: std::io::Result<()>) -> Self {
        Self {
            what,
            granted: outcome.is_ok(),
            refused_because: outcome.err().map(|error| error.to_string()),
        }
    }
}

/// Asks for what the scenario wants, for the `index`th process of the run, which has these `nodes`. The recorder, alone in
/// its process, gets no priority and no CPU: it must not be in anybody's way.
pub fn ask(realtime: &Realtime, nodes: &[NodeId], index: usize) -> Vec<Attempt> {
    let records = nodes == [NodeId::Recorder];
    // The ordinary class rounds sleeps up by 50 µs unless told otherwise.
    let slack = set_current_timer_slack(NonZeroU64::new(1));
    let mut attempts = vec![Attempt::of("timers exact to 1 ns".into(), slack.map_err(Into::into))];
    if let Some(priority) = realtime.priority.filter(|_| !records) {
        attempts.push(Attempt::of(
            format!("SCHED_FIFO, priority {priority}"),
            become_fifo(priority),
        ));
    }
    if realtime.lock_memory {
        attempts.push(Attempt::of("locked memory".into(), lock_memory()));
    }
    if let Some(latency_us) = realtime.cpu_latency_us.filter(|_| !records) {
        let what = format!("cores awake within {latency_us} µs");
        attempts.push(Attempt::of(what, bound_wake_up(latency_us)));
    }
    let cpu = realtime.cpus.get(index % realtime.cpus.len().max(1));
    if let Some(cpu) = cpu.filter(|_| !records) {
        let mut set = CpuSet::new();
        set.set(*cpu);
        let bound = sched_setaffinity(None, &set).map_err(Into::into);
        attempts.push(Attempt::of(format!("CPU {cpu}"), bound));
    }
    attempts
}

/// How long a turn on a core is to be, ns. The kernel takes 0.1 to 100 ms.
const TURN_NS: u64 = 100_000;

/// Asks for short turns on a core that others want, too: who asks for little is served soon. From Linux 6.12 on whoever wakes up with a
/// shorter turn interrupts one with a longer; without it a loop of processes waits at every hop for the end of a busy program's turn.
/// Older kernels take no notice.
pub fn take_short_turns() {
    /// As the kernel lays it out; not in `libc` for every target.
    #[repr(C)]
    #[derive(Default)]
    struct Attributes {
        size: u32,
        policy: u32,
        flags: u64,
        nice: i32,
        priority: u32,
        turn_ns: u64,
        deadline_ns: u64,
        period_ns: u64,
    }
    let size = size_of::<Attributes>() as u32;
    let mut own = Attributes::default();
    // SAFETY: process 0 is the caller, and the kernel writes at most `size` bytes.
    let known = unsafe { libc::syscall(libc::SYS_sched_getattr, 0, &raw mut own, size, 0) } == 0;
    if known && own.policy == libc::SCHED_OTHER as u32 {
        own.turn_ns = TURN_NS;
        // SAFETY: as above; the kernel reads what it has written but for one number.
        unsafe { libc::syscall(libc::SYS_sched_setattr, 0, &raw const own, 0) };
    }
}

fn last_error(status: libc::c_int) -> std::io::Result<()> {
    if status == 0 {
        Ok(())
    } else {
        Err(std::io::Error::last_os_error())
    }
}

fn become_fifo(priority: u8) -> std::io::Result<()> {
    // SAFETY: all zero is a valid sched_param.
    let mut parameter: libc::sched_param = unsafe { std::mem::zeroed() };
    parameter.sched_priority = priority.into();
    // SAFETY: process 0 is the caller, the parameter is valid for the call.
    last_error(unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameter) })
}

/// The kernel keeps to the smallest of what the open files of this device ask for, as long as they are open.
fn bound_wake_up(latency_us: u32) -> std::io::Result<()> {
    let mut device = std::fs::OpenOptions::new().write(true).open("/dev/cpu_dma_latency")?;
    device.write_all(&latency_us.to_ne_bytes())?;
    // Until the process ends.
    std::mem::forget(device);
    Ok(())
}

fn lock_memory() -> std::io::Result<()> {
    // On fault: what is mapped but never touched (deep buffers of the recorder) must not take memory.
    // SAFETY: flags only.
    last_error(unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE | libc::MCL_ONFAULT) })
}
