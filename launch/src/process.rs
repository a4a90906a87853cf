//! One process of a run: its nodes, opened, run to the end, and what they report.

use crate::assemble;
use crate::disk::Disk;
use crate::error::RunError;
use crate::fault_injector::FaultInjector;
use crate::folder::RunFolder;
use crate::realtime::{self, Timed};
use crate::report::{Ending, Failure, ProcessReport};
use crate::safe_ending;
use crate::scribe::Scribe;
use anhyst_ipc::{
    Change, ChangeServer, Connections, Discipline, LinkError, MAX_CHANGES, MAX_PIECE, Node, NodeId, RecordLayout,
    SharedContext, SharedSettings, Stage, TokenLog, Tunable, Wait, stop_requested,
};
use anhyst_scenario::{Scenario, wires};
use std::path::PathBuf;
use std::rc::Rc;
use std::time::{Duration, Instant};

/// Where the other processes of the run are found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Meeting {
    /// Prefix of the run's iceoryx2 resources.
    pub prefix: String,
    /// Directory of iceoryx2's files.
    pub root: PathBuf,
    /// Fingerprint of the scenario: all processes must have the same.
    pub agreement: u64,
    /// Polls before a waiting process sleeps.
    pub yields: u32,
    /// How long to wait for the others to appear.
    pub start_limit: Duration,
    /// Take the place of a process that died, in a real-time run that goes on.
    pub rejoin: bool,
    /// A launcher has started this process and hears what it fails of.
    pub supervised: bool,
}

/// The reader must never be this far behind: its buffer is twice as deep.
const CREDIT_TICKS: u64 = 4096;
/// So many left-out ticks are followed: more than the buffers hold. Whoever was held up for longer begins with what is newest.
const MAX_FOLLOWED_TICKS: u64 = 1024;
/// How often a process says where it is and looks whether it should stop.
const HOUSEKEEPING_TICKS: u64 = 64;

pub(crate) struct Loop {
    connections: Connections,
    stages: Vec<Box<dyn Stage>>,
    scribe: Option<Node<Scribe>>,
    shared: Option<Rc<SharedContext>>,
    recorder_process: Option<String>,
    plant_process: Option<String>,
    disk: Option<Disk>,
    /// See [`Loop::last_tick_to_hear`].
    stop_at: Option<u64>,
    receive_limit: Duration,
    timed: Option<Timed>,
    ticks: u64,
    injector: FaultInjector,
    /// Where changes come in for those nodes here that take some, and those taken.
    tuning: Vec<(NodeId, ChangeServer)>,
    changes: Vec<Change>,
    /// The tick that is being worked on.
    reached: u64,
    ending: Option<Ending>,
}

/// Runs the `nodes` of `scenario` in this process; `meeting` is none if all nodes are here, `folder` if nothing is to be kept but the
/// report. `progress` hears finished ticks.
///
/// # Errors
/// Only what prevents a report; what goes wrong in the loop is in the report.
pub fn run(
    process: &str,
    nodes: &[NodeId],
    scenario: &Scenario,
    folder: Option<&RunFolder>,
    meeting: Option<&Meeting>,
    progress: &mut dyn FnMut(u64),
) -> Result<ProcessReport, RunError> {
    let mut looping = open(process, nodes, scenario, folder, meeting)?;
    let start = Instant::now();
    let outcome = match looping.timed.take() {
        None => looping.run(scenario.ticks(), progress),
        Some(timed) => looping.run_timed(timed, scenario.ticks(), progress),
    };
    let loop_s = start.elapsed().as_secs_f64();
    let failed_at_tick = looping.reached;
    let failure_of = |error: LinkError| {
        let failure = Failure::new(failed_at_tick, &error.into());
        if let Some(meeting) = meeting {
            failure.tell(meeting.supervised);
        }
        failure
    };
    // Said at once: bringing the field to safety takes time in which nobody must wonder who is silent.
    let mut failure = outcome.err().map(failure_of);
    if failure.is_some() {
        looping.ending = Some(safe_ending::bring_to_safety(
            &mut looping.stages,
            looping.shared.as_deref(),
            looping.reached,
        ));
    } else {
        failure = looping.connections.end_barrier().err().map(failure_of);
    }
    looping.report(process, folder, loop_s, failure)
}

/// The nodes, built and connected.
pub(crate) fn open(
    process: &str,
    nodes: &[NodeId],
    scenario: &Scenario,
    folder: Option<&RunFolder>,
    meeting: Option<&Meeting>,
) -> Result<Loop, RunError> {
    let receive_limit = Duration::from_secs_f64(scenario.clock.receive_limit_s());
    let processes = scenario.placement.processes();
    let process_of = |node: NodeId| {
        let found = processes.iter().find(|(_, nodes)| nodes.contains(&node));
        found.map(|(name, _)| name.clone())
    };
    let recorder_process = process_of(NodeId::Recorder);
    let leader = process_of(NodeId::Plant).unwrap_or_default();
    let index = processes
        .iter()
        .position(|(name, _)| name == process)
        .unwrap_or_default();
    let realtime = scenario.clock.realtime();
    let rejoins = meeting.is_some_and(|meeting| meeting.rejoin);
    if meeting.is_some() {
        realtime::take_short_turns();
    }
    let shared = meeting
        .map(|meeting| {
            let recorder_alone = nodes == [NodeId::Recorder];
            let enter = if rejoins {
                SharedContext::rejoin
            } else {
                SharedContext::open
            };
            enter(SharedSettings {
                prefix: meeting.prefix.clone(),
                root: meeting.root.clone(),
                process: process.into(),
                processes,
                agreement: meeting.agreement,
                wait: if recorder_alone {
                    Wait::Poll {
                        period: Duration::from_millis(1),
                    }
                } else {
                    let busy = realtime.is_some_and(|realtime| realtime.busy_wait);
                    let yields = if busy { u32::MAX } else { meeting.yields };
                    Wait::Notified { yields }
                },
                receive_limit,
                start_limit: meeting.start_limit,
            })
        })
        .transpose()?
        .map(Rc::new);
    let pace = realtime.map(|realtime| realtime::pace(realtime, nodes, scenario.tick_s));
    let discipline = pace.clone().map_or(Discipline::Lockstep, Discipline::Newest);
    let mut connections = Connections::new(nodes.iter().copied(), wires(), shared.clone()).with_discipline(discipline);
    connections.accept_any_tick(assemble::late_channels(scenario)?);
    let comes_back = |node: &NodeId| realtime.is_some_and(|realtime| realtime.restart.contains(node));
    // Whoever is started again cannot end the run: the others do.
    if !nodes.iter().all(comes_back) {
        let limit_ticks = scenario.clock.receive_limit_s() / scenario.tick_s;
        connections.end_if_silent(scenario.external_nodes(), limit_ticks.ceil() as u64);
    }
    let mut stages = Vec::new();
    let mut scribe = None;
    for node in nodes {
        if *node == NodeId::Recorder {
            let block = assemble::scribe(scenario, folder, rejoins)?;
            scribe = Some(Node::open(block, &mut connections, scenario.ticks())?);
        } else {
            stages.push(assemble::stage(*node, scenario, &mut connections)?);
        }
    }
    if let Some(folder) = folder.filter(|_| realtime.is_some_and(|realtime| realtime.log_tokens)) {
        log_tokens(&mut stages, scenario, folder, rejoins)?;
    }
    let tuning = tuning(nodes, shared.as_deref())?;
    connections.start_barriers(&mut || stages.iter_mut().try_for_each(|stage| stage.connect()))?;
    let timed = match (realtime, pace) {
        (Some(realtime), Some(pace)) => {
            let asked = realtime::ask(realtime, nodes, index);
            let others = shared.as_deref().map(|context| (context, leader.as_str()));
            Some(Timed::begin(pace, nodes, others, rejoins, asked)?)
        }
        _ => None,
    };
    let elsewhere = |name: &String| name != process;
    Ok(Loop {
        connections,
        stages,
        scribe,
        shared,
        recorder_process: recorder_process.filter(elsewhere),
        plant_process: Some(leader).filter(elsewhere),
        // One process looks after the disk, for all: the one that writes most.
        disk: folder
            .filter(|_| nodes.contains(&NodeId::Recorder))
            .map(|folder| Disk::of_run(folder.path(), scenario.ticks())),
        stop_at: None,
        receive_limit,
        timed,
        ticks: scenario.ticks(),
        injector: FaultInjector::new(scenario, nodes, meeting.is_some())?,
        tuning,
        changes: Vec::with_capacity(MAX_CHANGES),
        reached: 0,
        ending: None,
    })
}

/// One way in for each node here that takes changes.
fn tuning(nodes: &[NodeId], shared: Option<&SharedContext>) -> Result<Vec<(NodeId, ChangeServer)>, LinkError> {
    let taking = nodes
        .iter()
        .filter(|node| Tunable::ALL.iter().any(|own| own.node() == **node));
    let Some(shared) = shared else { return Ok(Vec::new()) };
    taking
        .map(|node| Ok((*node, ChangeServer::open(shared, *node)?)))
        .collect()
}

fn log_tokens(
    stages: &mut [Box<dyn Stage>],
    scenario: &Scenario,
    folder: &RunFolder,
    rejoins: bool,
) -> Result<(), RunError> {
    for stage in stages {
        let path = folder.tokens(stage.node().name());
        if let Some(parent) = path.parent() {
            let refused = |cause| RunError::Write {
                path: path.clone(),
                cause,
            };
            std::fs::create_dir_all(parent).map_err(refused)?;
        }
        let layout = RecordLayout::of(stage.node(), &wires()).with_copies_of(&scenario.external_nodes());
        stage.log_tokens(TokenLog::open(&path, layout, scenario.ticks(), rejoins)?);
    }
    Ok(())
}

impl Loop {
    fn run(&mut self, ticks: u64, progress: &mut dyn FnMut(u64)) -> Result<(), LinkError> {
        let leads = self.stages.first().is_some_and(|stage| stage.node() == NodeId::Plant);
        for tick in 0..ticks {
            self.reached = tick;
            self.injector.inject(tick);
            for stage in &mut self.stages {
                stage.tick(tick)?;
            }
            if let Some(scribe) = &mut self.scribe {
                scribe.tick(tick)?;
            }
            let done = tick + 1;
            if let Some(shared) = &self.shared {
                shared.set_tick(done);
            }
            if done % HOUSEKEEPING_TICKS == 0 || done == ticks {
                self.housekeeping(done, leads)?;
                progress(done);
            }
        }
        Ok(())
    }

    /// As [`Loop::run`], but time decides which tick is next, and nobody is waited for.
    fn run_timed(&mut self, mut timed: Timed, ticks: u64, progress: &mut dyn FnMut(u64)) -> Result<(), LinkError> {
        let mut next = timed.first_tick();
        let mut housekeeping = next;
        let outcome = loop {
            let tick = timed.turn_to(next);
            if tick >= ticks {
                break Ok(());
            }
            self.reached = tick;
            // What comes back has already suffered what the scenario has for it.
            if !timed.rejoined() {
                self.injector.inject(tick);
            }
            let mut left_out = tick.saturating_sub(MAX_FOLLOWED_TICKS).max(next)..tick;
            let stages = &mut self.stages;
            let stages = left_out
                .try_for_each(|past| stages.iter_mut().try_for_each(|stage| stage.follow(past)))
                .and_then(|()| stages.iter_mut().try_for_each(|stage| stage.tick(tick)));
            let all = stages.and_then(|()| self.scribe.as_mut().map_or(Ok(()), |scribe| scribe.tick(tick)));
            if let Err(error) = all {
                break Err(error);
            }
            timed.finish();
            next = tick + 1;
            if let Some(shared) = &self.shared {
                shared.set_tick(next);
            }
            if next >= housekeeping {
                housekeeping = next + HOUSEKEEPING_TICKS;
                // No credit for the recorder: it must never hold up the loop; what it misses is counted.
                if let Err(error) = self.housekeeping(next, false) {
                    break Err(error);
                }
                progress(next);
            }
        };
        if let Some(shared) = &self.shared {
            shared.set_tick(next.min(ticks));
        }
        progress(next.min(ticks));
        self.timed = Some(timed);
        outcome
    }

    /// Looks whether the run should end; the leading process also waits for a recorder that has fallen behind.
    fn housekeeping(&mut self, done: u64, leads: bool) -> Result<(), LinkError> {
        if stop_requested() && done >= self.last_tick_to_hear() {
            return Err(LinkError::Stopped { tick: done });
        }
        if let Some(disk) = &mut self.disk {
            disk.check()?;
        }
        self.take_changes(done);
        let Some(shared) = &self.shared else { return Ok(()) };
        let Some(recorder) = self.recorder_process.as_deref().filter(|_| leads) else {
            return Ok(());
        };
        // Of time in which the machine stood still, too, little counts.
        let (mut looked, mut waited) = (Instant::now(), Duration::ZERO);
        while let Some(recorded) = shared.tick_of(recorder).filter(|tick| tick + CREDIT_TICKS < done) {
            if stop_requested() {
                return Err(LinkError::Stopped { tick: done });
            }
            waited += std::mem::replace(&mut looked, Instant::now()).elapsed().min(MAX_PIECE);
            if waited > self.receive_limit {
                return Err(LinkError::Behind {
                    process: recorder.into(),
                    ticks: done - recorded,
                    waited_s: waited.as_secs_f64(),
                });
            }
            std::thread::sleep(Duration::from_micros(200));
        }
        Ok(())
    }

    /// Takes what is to change from tick `tick` on.
    fn take_changes(&mut self, tick: u64) {
        let Self {
            tuning,
            stages,
            scribe,
            changes,
            ticks,
            ..
        } = self;
        for (node, server) in tuning {
            let served = server.serve(tick, |asked| {
                if tick >= *ticks || asked.iter().any(|change| change.set.node() != *node) {
                    return false;
                }
                let mut stages = stages.iter_mut().map(|stage| &mut **stage as &mut dyn Stage);
                let stage = match scribe {
                    Some(scribe) if *node == NodeId::Recorder => Some(scribe as &mut dyn Stage),
                    _ => stages.find(|stage| stage.node() == *node),
                };
                let Some(stage) = stage else { return false };
                let before = changes.len();
                changes.extend(asked.iter().filter(|change| stage.change(change)));
                changes.len() == before + asked.len()
            });
            // Who cannot be heard changes nothing, and the cut goes on.
            let _ = served;
        }
    }

    /// Where the plant was when the request to stop was noticed: a recorder hears that far, because what was sent is worth
    /// recording; it finds nothing more to hear if the others have ended before.
    fn last_tick_to_hear(&mut self) -> u64 {
        let plant = || self.shared.as_ref()?.tick_of(self.plant_process.as_deref()?);
        let sent = plant().filter(|_| self.scribe.is_some()).unwrap_or_default();
        *self.stop_at.get_or_insert(sent)
    }

    fn report(
        mut self,
        process: &str,
        folder: Option<&RunFolder>,
        loop_s: f64,
        failure: Option<Failure>,
    ) -> Result<ProcessReport, RunError> {
        let mut report = ProcessReport {
            process: process.into(),
            nodes: self.stages.iter().map(|stage| stage.report()).collect(),
            loop_s,
            failure,
            ending: self.ending,
            changes: self.changes,
            lost_notifications: self.shared.as_ref().map_or(0, |shared| shared.lost_notifications()),
            ..ProcessReport::default()
        };
        if let Some(folder) = folder {
            for stage in &self.stages {
                let path = folder.digest_history(stage.node().name());
                let written = stage.digest_history().write(&path);
                written.map_err(|cause| RunError::Write { path, cause })?;
            }
        }
        let round = self.scribe.as_ref().map(|scribe| scribe.block().round());
        report.realtime = self.timed.take().map(|timed| timed.report(round));
        if let Some(scribe) = self.scribe {
            report.nodes.push(scribe.report());
            let mut scribe = scribe.into_block();
            for overheard in scribe.overheard() {
                report.nodes.push(overheard.report());
                let Some(folder) = folder else { continue };
                let path = || folder.digest_history(overheard.report().node.name());
                overheard
                    .write(folder)
                    .map_err(|cause| RunError::Write { path: path(), cause })?;
            }
            report.verdict = Some(scribe.verdict());
            assemble::finish_recording(&mut scribe, &mut report)?;
        }
        Ok(report)
    }
}
