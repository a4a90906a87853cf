//! The part of a run that is on this host, when the other part is on another one.

use super::Ending;
use super::run_arguments::RunArguments;
use anhyst_ipc::{NodeId, NodeReport};
use anhyst_launch::error::RunError;
use anhyst_launch::folder::RunFolder;
use anhyst_launch::report::ProcessReport;
use anhyst_scenario::{Placement, Scenario};

/// Checks the arguments of a run in parts.
///
/// # Errors
/// A sentence.
pub fn validate(arguments: &RunArguments, scenario: &Scenario) -> miette::Result<()> {
    let across = &arguments.alone.across;
    if !across.is_part() {
        return Ok(());
    }
    across.validate().map_err(|sentence| miette::miette!("{sentence}"))?;
    if arguments.embedded || scenario.placement == Placement::Embedded {
        return Err(miette::miette!(
            "an embedded run has all nodes in one process: --here cannot name a part of it"
        ));
    }
    if arguments.plot.is_some() {
        return Err(miette::miette!("--plot is for a whole run: --here names a part of it"));
    }
    validate_clock(scenario)
}

/// Refuses a clock that a link between hosts cannot keep: the bridge checks that every tick of every channel crosses, and
/// in real time ticks are left out.
///
/// # Errors
/// A sentence.
pub fn validate_clock(scenario: &Scenario) -> miette::Result<()> {
    if scenario.clock.realtime().is_some() {
        return Err(miette::miette!(
            "clock: Realtime cannot be bridged, only Lockstep: two hosts have two clocks, and the bridge takes no gap in the ticks"
        ));
    }
    Ok(())
}

/// Prints what this host's processes came to, writes `digest.txt` with their nodes, and judges if the recorder is among them.
///
/// # Errors
/// If the digests cannot be written.
pub fn finish(
    scenario: &Scenario,
    folder: &RunFolder,
    reports: &[ProcessReport],
    json: bool,
) -> miette::Result<Ending> {
    let mut nodes: Vec<&NodeReport> = reports.iter().flat_map(|report| &report.nodes).collect();
    nodes.sort_by_key(|report| report.node);
    let lines: String = nodes
        .iter()
        .filter(|report| report.node != NodeId::Recorder)
        .map(|report| format!("{:016x}  {}\n", report.digest, report.node))
        .collect();
    let path = folder.digest();
    std::fs::write(&path, &lines).map_err(|cause| RunError::Write { path, cause })?;
    let loop_s = reports.iter().map(|report| report.loop_s).fold(0.0, f64::max);
    let lost: u64 = nodes
        .iter()
        .flat_map(|report| &report.links)
        .map(|link| link.lost)
        .sum();
    let verdict = reports.iter().find_map(|report| report.verdict.as_ref());
    let failures = verdict.map(|verdict| verdict.failures(&scenario.expect));
    if json {
        let digests = nodes
            .iter()
            .map(|report| (report.node.name(), format!("{:016x}", report.digest)));
        let part = serde_json::json!({
            "scenario": scenario.name,
            "ticks": scenario.ticks(),
            "loop_s": loop_s,
            "lost_tokens": lost,
            "node_digests": digests.collect::<Vec<_>>(),
            // The verdict is where the recorder runs.
            "held": failures.as_ref().map(Vec::is_empty),
            "failures": failures,
        });
        crate::say!("{part:#}");
    } else {
        say(scenario, folder, (&lines, loop_s, lost), failures.as_deref());
    }
    Ok(match failures {
        Some(failures) if !failures.is_empty() => Ending::NotHeld,
        _ => Ending::Held,
    })
}

fn say(scenario: &Scenario, folder: &RunFolder, (lines, loop_s, lost): (&str, f64, u64), failures: Option<&[String]>) {
    crate::say!(
        "{} ticks in {loop_s:.2} s, {lost} tokens lost; digests of the nodes here:",
        scenario.ticks()
    );
    crate::say!("{}", lines.trim_end());
    crate::say!(
        "{}",
        std::fs::read_to_string(folder.link()).unwrap_or_default().trim_end()
    );
    crate::say!("results: {}", folder.path().display());
    match failures {
        None => crate::say!("the verdict is where the recorder runs"),
        Some([]) => crate::say!("all that is expected held after {} s", scenario.expect.settling_s),
        Some(failures) => crate::say!("NOT held: {}", failures.join("; ")),
    }
}
