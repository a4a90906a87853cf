//! Open loop and the small profile: what is measured before a rig is moved far, and what follows from it.

use super::Work;
use super::belief::{tokens, told};
use crate::fitness::{SMALL, Step, amplifier, response, rest};
use anhyst_controller::TrajectorySettings;
use anhyst_guard::{CoilWatching, Event};
use anhyst_ipc::{Demand, Measurement, NodeId, SafeField};
use anhyst_launch::summary::Summary;
use anhyst_report::number::Si;
use anhyst_scenario::{Late, Scenario};

/// Beyond the start, s: long enough for the slowest monitor of the coil at 20 kHz, many times.
const SMALL_S: f64 = 0.3;
/// Fastest adaptation of `a` beside a model that is not true: faster, it explains within a turn by `a` what is not `a`.
const ADAPTATION_PER_S: f64 = 50.0;

impl Work<'_> {
    /// Gains that keep their margins with what is believed now.
    fn soften(&mut self, scenario: &mut Scenario) -> miette::Result<Option<f64>> {
        let factor = scenario.soften_feedback(&self.response).map_err(told)?;
        if let Some(factor) = factor {
            let whose = if self.response.is_empty() {
                "this model"
            } else {
                "what was measured"
            };
            self.find(&format!(
                "the feedback's gains are taken {factor:.2} times: with {whose} its largest sensitivity would be above 2"
            ));
        }
        Ok(factor)
    }

    /// Sensor at rest, amplifier, response; false if the rig is not fit.
    pub(super) fn is_fit(&mut self, scenario: &mut Scenario) -> miette::Result<bool> {
        scenario.estimator.law = scenario.estimator.law.slowed(ADAPTATION_PER_S);
        if scenario.external_nodes().contains(&NodeId::Inverse) {
            self.find("the inverse is somebody else's: sensor, amplifier and response are not measured on their own");
            return Ok(true);
        }
        let size = scenario.controller().map_err(told)?.size_m(scenario.duration_s);
        let probe = rest::probe(scenario);
        let (summary, folder) = self.step("0-rest", &probe)?;
        if self.is_refused(&summary) {
            return Ok(false);
        }
        let (rest, step) = rest::judge(&probe, &tokens::<Measurement>(&folder)?, size);
        self.rest = rest;
        if !self.took(step) {
            return Ok(false);
        }
        for (name, share) in [("0-amplifier-small", amplifier::FIRST), ("0-amplifier", amplifier::ALL)] {
            if !self.amplifier(name, share, scenario)? {
                return Ok(false);
            }
        }
        self.respond("1-response", scenario)
    }

    /// The amplifier up to a part of what is needed; false if it is not fit.
    fn amplifier(&mut self, name: &str, share: f64, scenario: &mut Scenario) -> miette::Result<bool> {
        for attempt in ["", "-2", "-3"] {
            let own = amplifier::Excitation::new(scenario, share).map_err(told)?;
            let probe = own.probe(scenario);
            let (summary, folder) = self.step(&format!("{name}{attempt}"), &probe)?;
            if self.believe_late(&summary, scenario)? {
                continue;
            }
            // On the way to safety nothing follows what was to be commanded.
            if self.is_refused(&summary) {
                return Ok(false);
            }
            let tokens = (&*tokens::<Measurement>(&folder)?, &*tokens::<SafeField>(&folder)?);
            let step = own.judge(&probe, tokens, share < 1.0).map_err(told)?;
            return Ok(self.took(step));
        }
        Ok(true)
    }

    /// Measures the response, and brings the gains within its margins; false if the rig is not fit.
    pub(super) fn respond(&mut self, name: &str, scenario: &mut Scenario) -> miette::Result<bool> {
        self.response.clear();
        self.response_run = None;
        let excitation = response::Excitation::new(scenario).map_err(told)?;
        let refused = excitation.as_ref().map(|own| own.probe.validate());
        let Some((own, Ok(()))) = excitation.zip(refused) else {
            self.find("the response is not measured: this profile leaves no room for it");
            self.soften(scenario)?;
            return Ok(true);
        };
        let (summary, folder) = self.step(name, &own.probe)?;
        if self.is_refused(&summary) {
            return Ok(false);
        }
        let found = own.measure(&tokens::<Measurement>(&folder)?, &tokens::<Demand>(&folder)?);
        let found = found.map_err(told)?;
        if !self.took(found.sensor(scenario).map_err(told)?) {
            return Ok(false);
        }
        found.lines().clone_into(&mut self.response);
        self.response_run = Some(folder);
        let factor = self.soften(scenario)?;
        let step = found.margins(scenario, factor, &self.rest).map_err(told)?;
        Ok(self.took(step))
    }

    /// Notes a step; false if the rig is not fit.
    fn took(&mut self, step: Step) -> bool {
        step.findings.iter().for_each(|finding| self.find(finding));
        let refusal = step.refusal.clone();
        self.result.steps.push(step);
        refusal.is_none_or(|sentence| {
            self.refuse(&sentence);
            false
        })
    }

    fn refuse(&mut self, sentence: &str) {
        self.result.sentence = format!("not fit: {sentence}");
    }

    /// What the guard saw ends it.
    fn is_refused(&mut self, summary: &Summary) -> bool {
        let sentence = refusal(summary);
        if let Some(sentence) = &sentence {
            self.refuse(sentence);
        }
        sentence.is_some()
    }

    /// Believes a coil that is late; true if that ended the run.
    fn believe_late(&mut self, summary: &Summary, scenario: &mut Scenario) -> miette::Result<bool> {
        let Some(late) = summary.verdict.coil_late else {
            return Ok(false);
        };
        for noticed in &summary.verdict.noticed {
            self.find(noticed);
        }
        self.find(&match late {
            Late::Lag(lag_s) => format!("the amplifier is believed to lag by {} from here on", Si(lag_s, "s")),
            Late::Ticks(ticks) => format!("the amplifier is believed to be {ticks} ticks later from here on"),
        });
        scenario.believe_late(late).map_err(told)?;
        Ok(summary.verdict.first_event == Event::CoilLate.number())
    }

    /// A fifth of the profile; false if the rig is not fit.
    pub(super) fn small(&mut self, scenario: &mut Scenario) -> miette::Result<bool> {
        if matches!(scenario.controller.trajectory, TrajectorySettings::Table { .. }) {
            self.find("a table says its own size: the first step goes as far as the cut");
        }
        for attempt in ["1-small", "1-small-2", "1-small-3"] {
            let mut small = scenario.clone();
            small.controller.learning = None;
            (
                small.expect.tolerance_m,
                small.expect.error_rms_m,
                small.expect.a_final_error_a_per_m,
            ) = (None, None, None);
            small.controller.trajectory = small.controller.trajectory.scaled(SMALL);
            small.duration_s = small.duration_s.min(small.controller.start_s + SMALL_S);
            small.controller.trajectory = small.controller.trajectory.within(small.duration_s);
            small.expect.settling_s = small.controller.start_s.min(0.5 * small.duration_s);
            small.guard.monitors.coil = CoilWatching::On;
            let (summary, _) = self.step(attempt, &small)?;
            if summary.verdict.coil_late.is_none() {
                for noticed in &summary.verdict.noticed {
                    self.find(&format!("small: {noticed}"));
                }
            }
            if self.believe_late(&summary, scenario)? {
                continue;
            }
            return Ok(!self.is_refused(&summary));
        }
        Ok(true)
    }
}

/// Why a rig is not fit.
pub(super) fn refusal(summary: &Summary) -> Option<String> {
    let verdict = &summary.verdict;
    if let Some(event) = Event::from_number(verdict.first_event).filter(|event| event.is_fault()) {
        let meaning = verdict
            .noticed
            .first()
            .map_or_else(String::new, |meaning| format!(": {meaning}"));
        return Some(format!(
            "the guard saw {event} in tick {}{meaning}",
            verdict.first_event_tick
        ));
    }
    let failures = summary.failures.join("; ");
    // A tolerance is judged at the end.
    let broken = verdict.broken_field_ticks + verdict.beyond_limit_ticks > 0;
    broken.then_some(failures)
}
