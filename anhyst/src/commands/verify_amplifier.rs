//! `anhyst verify-amplifier`: a conformance run against whatever process is plugged in as amplifier.

use super::{Ending, json, progress_bar, save};
use crate::arguments::{JsonArgument, MeetingArguments, OutArgument, SetArguments};
use anhyst_conformance::amplifier::{
    DRIVER, Driver, Expectation, Outcome, Report, Test, Tested, Tolerances, test, tester_nodes, ticks,
};
use anhyst_ipc::{Invalid, SharedSettings, Wait};
use anhyst_launch::claim::Claimed;
use anhyst_launch::error::RunError;
use anhyst_launch::external;
use anhyst_launch::resources::Resources;
use anhyst_launch::say::quoted;
use anhyst_launch::{resources, signals};
use anhyst_scenario::{BUILT_IN_AMPLIFIER, Clock, Placement, Scenario, load};
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// `verify-amplifier`
#[derive(Debug, Args)]
pub struct VerifyAmplifierArguments {
    /// Scenario whose amplifier the process must be like; the one that is built in is scenarios/amplifier.ron: 3 kHz, 30 kA/m,
    /// 40 MA/(m s), ticks of 50 µs.
    #[arg(default_value = BUILT_IN_AMPLIFIER)]
    pub scenario: PathBuf,
    /// What is changed in it.
    #[command(flatten)]
    pub set: SetArguments,
    /// Where the results go.
    #[command(flatten)]
    pub out: OutArgument,
    /// Where the process listens, and how long it may take to appear.
    #[command(flatten)]
    pub meeting: MeetingArguments,
    /// Start the process with this shell command; where to meet is in its environment, see docs/verify-amplifier.md.
    #[arg(long, value_name = "COMMAND")]
    pub command: Option<String>,
    /// Bandwidth that the amplifier must have, instead of the scenario's.
    #[arg(long, value_name = "HZ")]
    pub bandwidth_hz: Option<f64>,
    /// Field limit that it must keep, instead of the scenario's.
    #[arg(long, value_name = "A_PER_M")]
    pub limit_a_per_m: Option<f64>,
    /// Slew limit that it must keep, instead of the scenario's.
    #[arg(long, value_name = "A_PER_M_S")]
    pub slew_a_per_m_s: Option<f64>,
    /// Delay in ticks beyond the loop's own, instead of the scenario's.
    #[arg(long, value_name = "TICKS")]
    pub delay_ticks: Option<u32>,
    /// Silence after which the process must take the field to the safe field (default: the scenario's receive limit).
    #[arg(long, value_name = "S")]
    pub silence_s: Option<f64>,
    /// How exact.
    #[command(flatten)]
    pub tolerances: Tolerances,
    /// Command a tick a tick's time, by the wall clock: for hardware.
    #[arg(long)]
    pub paced: bool,
    /// Polls before the waiting tester sleeps.
    #[arg(long, default_value_t = anhyst_ipc::YIELDS_SHARED, value_name = "POLLS")]
    pub yields: u32,
    /// How the report is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// A run of the scenario must be longer than the test, so that no process comes to the end by itself.
const SPARE_TICKS: usize = 100_000;

/// Runs the command.
///
/// # Errors
/// Bad input, or results that cannot be written.
pub fn run(arguments: &VerifyAmplifierArguments) -> miette::Result<Ending> {
    signals::install();
    let resources = meeting_place(arguments)?;
    // Before the scenario is there: a driver by hand, which waits for that, must not come first.
    let _names = resources.claim().map_err(|sentence| miette::miette!("{sentence}"))?;
    let (scenario, agreement, path, results) = effective(arguments)?;
    let expected = expectation(&scenario, arguments);
    // Under names that a user chose a driver may be there already.
    if arguments.meeting.service_prefix.is_none() && arguments.meeting.root.is_none() {
        resources::sweep();
    }
    let environment = environment(&scenario, agreement, &path, &resources, arguments);
    announce(&environment, &path, &resources, arguments);
    let driver = start(&environment, &results.path, arguments)?;
    let meeting = SharedSettings {
        prefix: resources.prefix.clone(),
        root: resources.root.clone(),
        process: tester_name(),
        processes: scenario.placement.processes(),
        agreement,
        wait: Wait::Notified {
            yields: arguments.yields,
        },
        receive_limit: Duration::from_secs_f64(expected.answer_limit_s()),
        start_limit: Duration::from_secs_f64(arguments.meeting.start_limit_s),
    };
    let bar = progress_bar(ticks(&expected)? as u64, DRIVER);
    let tested = test(
        Test {
            expected: &expected,
            meeting,
            driver: driver.as_ref(),
            pace: arguments.paced.then(|| Duration::from_secs_f64(expected.tick_s)),
        },
        &mut |tick| bar.set_position(tick),
    );
    bar.finish_and_clear();
    drop(driver);
    // As after a run: a process that is gone, or that leaves together with us, may leave what it opened.
    resources
        .remove()
        .map_err(|cause| RunError::Setup(format!("shared memory cannot be removed: {cause}")))?;
    finish(tested?, &expected, &results.path, arguments)
}

fn tester_name() -> String {
    let names: Vec<&str> = tester_nodes().into_iter().map(|node| node.name()).collect();
    names.join("+")
}

/// The scenario as both sides must have it, where it stands, and the folder that is kept from others: one process stands for all others,
/// and the options are in it.
fn effective(arguments: &VerifyAmplifierArguments) -> miette::Result<(Scenario, u64, PathBuf, Claimed)> {
    let mut scenario = load(&arguments.scenario, &arguments.set.settings)?;
    let amplifier = &mut scenario.amplifier;
    amplifier.bandwidth_hz = arguments.bandwidth_hz.or(amplifier.bandwidth_hz);
    amplifier.field_limit_a_per_m = arguments.limit_a_per_m.or(amplifier.field_limit_a_per_m);
    amplifier.slew_limit_a_per_m_s = arguments.slew_a_per_m_s.or(amplifier.slew_limit_a_per_m_s);
    amplifier.delay_ticks = arguments.delay_ticks.unwrap_or(amplifier.delay_ticks);
    scenario.placement = Placement::Groups(vec![tester_nodes()]);
    scenario.recording.on = false;
    scenario.faults.clear();
    scenario.external.clear();
    // The bench waits for every answer; --paced paces the commands.
    scenario.clock = Clock::Lockstep {
        receive_limit_s: scenario.clock.receive_limit_s(),
        empty_blocks: false,
    };
    if let Some(receive_limit_s) = arguments.silence_s {
        Invalid::unless_between("--silence-s", receive_limit_s, 0.02, 600.0, "s").map_err(RunError::from)?;
        scenario.clock = Clock::Lockstep {
            receive_limit_s,
            empty_blocks: false,
        };
    }
    scenario.validate().map_err(RunError::from)?;
    let expected = expectation(&scenario, arguments);
    let test_s = (ticks(&expected)? + SPARE_TICKS) as f64 * scenario.tick_s;
    scenario.duration_s = scenario.duration_s.max(test_s);
    let claimed = arguments
        .out
        .claim_beside("amplifier", "scenario.ron", &arguments.scenario)?;
    let path = std::path::absolute(claimed.path.join("scenario.ron")).map_err(refused(&claimed.path))?;
    let written = scenario.to_ron().map_err(|error| RunError::Setup(error.to_string()))?;
    std::fs::write(&path, written).map_err(refused(&path))?;
    // What a process of ours makes of the file is what must agree.
    let scenario = load(&path, &[])?;
    let agreement = scenario
        .agreement()
        .map_err(|error| RunError::Setup(error.to_string()))?;
    Ok((scenario, agreement, path, claimed))
}

fn refused(path: &Path) -> impl FnOnce(std::io::Error) -> RunError {
    let path = path.to_owned();
    move |cause| RunError::Write { path, cause }
}

/// Silence after which nobody is alive.
fn receive_limit_s(scenario: &Scenario) -> f64 {
    scenario.clock.receive_limit_s()
}

fn expectation(scenario: &Scenario, arguments: &VerifyAmplifierArguments) -> Expectation {
    Expectation {
        tick_s: scenario.tick_s,
        amplifier: scenario.amplifier,
        range_a_per_m: scenario
            .amplifier
            .field_limit_a_per_m
            .unwrap_or(scenario.guard.field_limit_a_per_m),
        centre_a_per_m: 0.0,
        // The process is on its own then: its own watchdog counts, not the guard.
        safe_field_a_per_m: scenario.watchdog.safe_field_a_per_m,
        ramp_time_s: scenario.watchdog.ramp_time_s,
        silence_s: receive_limit_s(scenario),
        paced: arguments.paced,
        tolerances: arguments.tolerances,
    }
}

fn meeting_place(arguments: &VerifyAmplifierArguments) -> miette::Result<Resources> {
    Resources::chosen(
        arguments.meeting.service_prefix.as_deref(),
        arguments.meeting.root.as_deref(),
    )
    .map_err(|sentence| miette::miette!("{sentence}"))
}

/// What a driver is told, as environment variables: those of a run, and what a process of ours wants besides.
fn environment(
    scenario: &Scenario,
    agreement: u64,
    path: &Path,
    resources: &Resources,
    arguments: &VerifyAmplifierArguments,
) -> Vec<(&'static str, String)> {
    let start_limit = Duration::from_secs_f64(arguments.meeting.start_limit_s);
    let limit_s = receive_limit_s(scenario);
    let mut told = external::environment(DRIVER, scenario, resources, limit_s, start_limit, arguments.yields);
    told.push(("ANHYST_AGREEMENT", agreement.to_string()));
    told.push(("ANHYST_SCENARIO", path.display().to_string()));
    told
}

/// Tells the user where the process must listen and how to start one.
fn announce(
    environment: &[(&'static str, String)],
    scenario: &Path,
    resources: &Resources,
    arguments: &VerifyAmplifierArguments,
) {
    if arguments.command.is_some() {
        return;
    }
    let exports: Vec<String> = environment
        .iter()
        .map(|(name, value)| format!("{name}={}", quoted(value.as_ref())))
        .collect();
    let (prefix, root) = (&resources.prefix, quoted(&resources.root));
    crate::complain!("service prefix: {prefix}\nroot: {root}");
    crate::complain!(
        "start the amplifier within {} s, in another terminal: your own driver with\n  {} YOUR-DRIVER\nor the simulated one with\n  \
         anhyst node amplifier {} --out {} --service-prefix {prefix} --root {root}",
        arguments.meeting.start_limit_s,
        exports.join(" "),
        quoted(scenario),
        quoted(&scenario.with_file_name("amplifier")),
    );
}

fn start(
    environment: &[(&'static str, String)],
    out: &Path,
    arguments: &VerifyAmplifierArguments,
) -> miette::Result<Option<Driver>> {
    let Some(command) = &arguments.command else {
        return Ok(None);
    };
    let log = out.join("driver.log");
    let driver = Driver::start(command, environment, &log)
        .map_err(|cause| RunError::Setup(format!("\"{command}\" could not be started: {cause}")))?;
    Ok(Some(driver))
}

fn finish(
    tested: Tested,
    expected: &Expectation,
    out: &Path,
    arguments: &VerifyAmplifierArguments,
) -> miette::Result<Ending> {
    let report = Report::new(
        tested.findings,
        tested.gone,
        expected,
        tested.ticks,
        arguments.command.as_deref(),
    );
    let text = json(&report)?;
    save(out, "amplifier.json", &text)?;
    let mut line = format!("anhyst verify-amplifier {}", quoted(&arguments.scenario));
    if let Some(command) = &arguments.command {
        line += &format!(" --command {}", quoted(command.as_ref()));
    }
    save(out, "report.html", &report.html(tested.pictures, &line))?;
    if arguments.json.json {
        crate::say!("{text}");
    } else {
        print_table(&report);
        crate::say!("results: {}", out.display());
    }
    Ok(match report.outcome {
        Outcome::Passed => Ending::Held,
        Outcome::Failed => Ending::NotHeld,
        Outcome::NotThere => Ending::ProcessFailed,
    })
}

fn print_table(report: &Report) {
    if !report.checks.is_empty() {
        crate::say!("{}", report.table().terminal());
    }
    for check in report.checks.iter().filter(|check| !check.passed) {
        crate::say!("FAIL {}: {}", check.name, check.sentence);
    }
    for check in &report.warnings {
        crate::say!("{}", check.warning());
    }
    for check in &report.not_judged {
        crate::say!("not judged {}: {}", check.name, check.sentence);
    }
    let verdict = if report.passed { "passed" } else { "NOT passed" };
    crate::say!("{verdict}: {}", report.sentence);
}
