//! Does the process that is plugged in as amplifier keep what the loop builds on?
//!
//! One process stands for all others of the loop. It meets the driver, commands a program of safe fields tick by tick, then
//! falls silent; what came back is compared with the model that has the scenario's constants. See docs/verify-amplifier.md.

mod bench;
mod driver;
mod expectation;
mod findings;
mod gentle;
mod judge;
mod pictures;
mod program;
mod report;
mod transcript;

pub use driver::Driver;
pub use expectation::{Expectation, Tolerances};
pub use findings::{Bound, Check, Findings, NotJudged};
pub use gentle::Gentle;
pub use pictures::Picture;
pub use report::{Outcome, Report, checks_table};

use anhyst_ipc::{LinkError, NodeId, SharedSettings};
use anhyst_launch::error::RunError;
use anhyst_launch::say::quoted;
use anhyst_scenario::wires;
use bench::{Bench, Foreign, Met};
use judge::{Curves, Evidence, judge};
use pictures::pictures;
use program::Program;
use std::time::Duration;
use transcript::{Aftermath, End, Transcript};

/// The name of the process that is tested.
pub const DRIVER: &str = NodeId::Amplifier.name();
/// Beyond silence and ramp, so long a process may take to be safe: it may have to be woken.
const SAFE_MARGIN: Duration = Duration::from_secs(2);

/// The nodes that the tester stands for: all but the amplifier.
pub fn tester_nodes() -> Vec<NodeId> {
    NodeId::LOOP_ORDER
        .into_iter()
        .filter(|node| *node != NodeId::Amplifier)
        .collect()
}

/// Ticks of the test.
///
/// # Errors
/// If it would take too long.
pub fn ticks(expected: &Expectation) -> Result<usize, RunError> {
    Ok(Program::new(expected)?.commands.len())
}

/// A test to be run.
pub struct Test<'a> {
    /// What is expected.
    pub expected: &'a Expectation,
    /// Where tester and driver meet.
    pub meeting: SharedSettings,
    /// The driver, if this command started it.
    pub driver: Option<&'a Driver>,
    /// Least time from one command to the next.
    pub pace: Option<Duration>,
}

/// What a test gave.
pub struct Tested {
    /// The checks.
    pub findings: Findings,
    /// How the process did not come or went away; none if it stayed.
    pub gone: Option<String>,
    /// For the report.
    pub pictures: Vec<Picture>,
    /// Ticks that were commanded.
    pub ticks: usize,
}

/// Meets the process and tests it.
///
/// # Errors
/// What no process can be blamed for: constants that cannot be used, a transport that refuses.
pub fn test(test: Test, progress: &mut dyn FnMut(u64)) -> Result<Tested, RunError> {
    let program = Program::new(test.expected)?;
    let model = program
        .expected(test.expected)
        .map_err(|error| RunError::Setup(error.to_string()))?;
    let mut bench = match Bench::meet(test.meeting.clone(), DRIVER, &wires()) {
        Ok(Met::Ready(bench)) => bench,
        Ok(Met::Foreign(foreign)) => return Ok(Tested::foreign(&foreign)),
        Err(error) => return absent(&test, error),
    };
    let mut transcript = bench.run(&program, test.pace, progress);
    if transcript.end == End::Stopped
        && let Some(how) = test.driver.and_then(Driver::ended)
    {
        transcript.end = End::Gone(format!("{DRIVER} {how}"));
    }
    let aftermath = (transcript.end == End::Complete).then(|| listen(&test, &mut bench, transcript.answers.len()));
    drop(bench);
    let evidence = Evidence {
        expected: test.expected,
        program: &program,
        model: &model,
        transcript: &transcript,
        aftermath: aftermath.as_ref(),
    };
    Ok(Tested::new(&evidence))
}

fn listen(test: &Test, bench: &mut Bench, tick: usize) -> Aftermath {
    if let Some(driver) = test.driver {
        driver.may_leave();
    }
    let expected = test.expected;
    let limit = Duration::from_secs_f64(expected.silence_s + expected.ramp_time_s) + SAFE_MARGIN;
    let near = expected.share_a_per_m(expected.tolerances.return_tolerance);
    let is_safe = |field: f64| (field - expected.safe_field_a_per_m).abs() <= near;
    bench.listen(tick as u64, limit, &is_safe)
}

/// The process did not come to the meeting, or not as it should.
fn absent(test: &Test, error: LinkError) -> Result<Tested, RunError> {
    let words = match (test.driver.and_then(Driver::ended), error) {
        (Some(how), _) => format!("{DRIVER} {how}, before the first tick"),
        (None, LinkError::Stopped { .. }) => format!("stopped on request while waiting for {DRIVER}"),
        (None, error @ LinkError::Absent { .. }) => {
            let (prefix, root) = (&test.meeting.prefix, quoted(&test.meeting.root));
            format!(
                "{error}: start its driver with ANHYST_SERVICE_PREFIX={prefix} ANHYST_ROOT={root}, or give --command or a \
                 longer --start-limit-s"
            )
        }
        (None, error @ LinkError::Disagreement { .. }) => error.to_string(),
        (None, error) => return Err(error.into()),
    };
    Ok(Tested {
        findings: Findings::default(),
        gone: Some(words),
        pictures: Vec::new(),
        ticks: 0,
    })
}

impl Tested {
    fn new(evidence: &Evidence) -> Self {
        let (mut findings, curves): (Findings, Curves) = judge(evidence);
        same_layout(&mut findings, &[]);
        let transcript: &Transcript = evidence.transcript;
        Tested {
            pictures: pictures(evidence, &curves),
            gone: match &transcript.end {
                End::Gone(words) => Some(format!(
                    "at tick {} of {}: {words}",
                    transcript.answers.len(),
                    evidence.program.commands.len()
                )),
                End::Stopped => Some(format!("stopped on request at tick {}", transcript.answers.len())),
                End::Complete | End::Silent(_) => None,
            },
            ticks: transcript.answers.len(),
            findings,
        }
    }

    fn foreign(foreign: &[Foreign]) -> Self {
        let mut findings = Findings::default();
        same_layout(&mut findings, foreign);
        Tested {
            findings,
            gone: None,
            pictures: Vec::new(),
            ticks: 0,
        }
    }
}

/// Notes, as the first check, whether both sides mean the same by their tokens.
fn same_layout(findings: &mut Findings, foreign: &[Foreign]) {
    let words: Vec<String> = foreign
        .iter()
        .map(
            |Foreign {
                 channel,
                 found,
                 expected,
             }| {
                format!(
                    "on {channel} it speaks {} of {} bytes, the loop {} of {} bytes",
                    found.type_name, found.size_bytes, expected.type_name, expected.size_bytes
                )
            },
        )
        .collect();
    let sentence = if words.is_empty() {
        "both channels have the loop's types, sizes and field lists".to_owned()
    } else {
        words.join("; ")
    };
    findings.at_most("layout", foreign.len() as f64, 0.0, "channels", sentence);
    findings.checks.rotate_right(1);
}
