//! `anhyst commission`: brings a rig that nobody knows into the loop, small to large and under the guard.
//!
//! 1. *Rest*, *amplifier*, *response*: what is measured in open loop, one after the other ([`crate::fitness`]). A rig that is not fit ends here, with a sentence;
//!    a lag that the coil shows goes into the scenario, the gains follow the measured margins.
//! 2. *Small*: a fifth of the profile in closed loop, nothing learned, the coil watched.
//! 3. *Cut*: the whole profile with learning and a slow estimator.
//! 4. *Diagnosis* of that cut, and the cut again with the amended model, as long as it gets better.

use super::commission_belief::{believing, following, measured_run, tokens, told};
use super::commission_report::{Commission, Cut, page, table};
use super::run::{changed, perform};
use super::run_arguments::AloneArguments;
use super::{Ending, json, save, share_bar};
use crate::arguments::{JsonArgument, OutArgument, ScenarioArguments, ThreadsArgument};
use crate::fitness::{SMALL, Step, TRACKS, amplifier, response, rest};
use anhyst_controller::{LearningSettings, MeasuredResponse, TrajectorySettings};
use anhyst_diagnosis::{DiagnoseOptions, Verdict, amended_text, diagnose, page as diagnosis_page};
use anhyst_guard::{CoilWatching, Event};
use anhyst_ipc::{Demand, Estimate, Measurement, NodeId, SafeField};
use anhyst_launch::embedded::as_saved;
use anhyst_launch::error::RunError;
use anhyst_launch::folder::RunFolder;
use anhyst_launch::say::quoted;
use anhyst_launch::signals;
use anhyst_launch::summary::Summary;
use anhyst_measured::MeasuredRun;
use anhyst_model::{ActuatorModel, EffectKind};
use anhyst_plant_sim::PlantRod;
use anhyst_report::number::Si;
use anhyst_scenario::{Late, Scenario, to_ron};
use clap::Args;
use std::path::{Path, PathBuf};

/// Beyond the start, s: long enough for the slowest monitor of the coil at 20 kHz, many times.
const SMALL_S: f64 = 0.3;
/// Fastest adaptation of `a` beside a model that is not true: faster, it explains within a turn by `a` what is not `a`.
const ADAPTATION_PER_S: f64 = 50.0;
/// Which programs the steps were made with.
const PROGRAMS: &str = "programs.txt";
/// A further cut's largest error must be below the best one's by this part: it is what a tolerance bounds.
const BETTER: f64 = 0.03;

/// `commission`
#[derive(Debug, Args)]
pub struct CommissionArguments {
    /// Which scenario.
    #[command(flatten)]
    pub scenario: ScenarioArguments,
    /// Run all nodes in this process, without iceoryx2.
    #[arg(long)]
    pub embedded: bool,
    /// Cuts at most, the small one not counted.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=20))]
    pub cuts: u32,
    /// How the processes meet, and who takes whose place.
    #[command(flatten)]
    pub alone: AloneArguments,
    /// Where the results go.
    #[command(flatten)]
    pub out: OutArgument,
    /// For the diagnosis.
    #[command(flatten)]
    pub threads: ThreadsArgument,
    /// How the result is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// Runs the command.
///
/// # Errors
/// Bad input, or results that cannot be written.
pub fn run(arguments: &CommissionArguments) -> miette::Result<Ending> {
    signals::install();
    let own = &arguments.scenario;
    let mut scenario = changed(&own.scenario, &own.set, arguments.embedded, &arguments.alone)?;
    if arguments.alone.across.is_part() {
        return Err(miette::miette!("--here: a rig is commissioned from one host"));
    }
    scenario.recording.on = true;
    // What is really so stays so, whatever is believed from here on.
    let believed = scenario.believed_model().map_err(told)?;
    let plant = &mut scenario.plant;
    plant.material.get_or_insert(believed.material);
    if plant.rod == PlantRod::TwoPole {
        plant.two_pole = plant.two_pole.or(believed.rod);
    }
    let claimed = arguments.out.claim(&format!("commission-{}", scenario.name))?;
    let mut work = Work {
        arguments,
        goes_on: goes_on(&claimed.path, &arguments.alone)?,
        out: &claimed.path,
        failed: false,
        rest: rest::Rest::default(),
        response: Vec::new(),
        response_run: None,
        believed: None,
        result: Commission::default(),
    };
    let commissioned = match work.commission(scenario) {
        Err(error) if work.failed => {
            crate::complain!("{error}");
            crate::complain!("the same call goes on from there");
            return Ok(Ending::ProcessFailed);
        }
        commissioned => commissioned?,
    };
    let Work { result, out, .. } = work;
    if let Some(scenario) = &commissioned {
        let text = to_ron(scenario).map_err(|error| RunError::Setup(error.to_string()))?;
        save(out, "commissioned.ron", &format!("// {}\n{text}\n", result.sentence))?;
    }
    save(out, "commission.json", &json(&result)?)?;
    save(out, "commission.html", &page(&result).html())?;
    if arguments.json.json {
        crate::say!("{}", json(&result)?);
    } else {
        crate::say!("\n{}\n", result.sentence);
        if !result.cuts.is_empty() {
            crate::say!("{}", table(&result).terminal());
        }
        crate::say!("results: {}", out.display());
        if commissioned.is_some() {
            crate::say!("run it: anhyst run {}", quoted(&out.join("commissioned.ron")));
        }
    }
    Ok(if result.fit { Ending::Held } else { Ending::NotHeld })
}

/// True where an earlier call was killed before it came to its end, with the same programs in the processes' places; makes a note for the next one.
fn goes_on(out: &Path, alone: &AloneArguments) -> miette::Result<bool> {
    let programs = format!("{:?}\n", alone.external_commands);
    let note = out.join(PROGRAMS);
    let same = std::fs::read_to_string(&note).is_ok_and(|before| before == programs);
    let goes_on = same && !out.join("commission.json").exists();
    remove(out, &["commission.json", "commission.html", "commissioned.ron"])?;
    save(out, PROGRAMS, &programs)?;
    Ok(goes_on)
}

/// What an earlier call found would be taken for this one's.
fn remove(out: &Path, stale: &[&str]) -> Result<(), RunError> {
    let stale = stale.iter().map(|file| out.join(file));
    for path in stale.filter(|path| path.exists()) {
        std::fs::remove_file(&path).map_err(|cause| RunError::Write { path, cause })?;
    }
    Ok(())
}

/// The best cut so far.
struct Best {
    scenario: Scenario,
    summary: Summary,
    learned: PathBuf,
}

struct Work<'a> {
    arguments: &'a CommissionArguments,
    goes_on: bool,
    /// A process failed, or the call was ended.
    failed: bool,
    out: &'a Path,
    result: Commission,
    /// The sensor's noise.
    rest: rest::Rest,
    /// From demand to sensor, with what is believed now; nothing: as believed.
    response: Vec<MeasuredResponse>,
    /// Where that was measured.
    response_run: Option<PathBuf>,
    /// Before the first diagnosis.
    believed: Option<ActuatorModel>,
}

impl Work<'_> {
    /// The scenario that cut best; none where the rig is not fit.
    fn commission(&mut self, mut scenario: Scenario) -> miette::Result<Option<Scenario>> {
        if !self.is_fit(&mut scenario)? || !self.small(&mut scenario)? {
            return Ok(None);
        }
        if scenario.controller().map_err(told)?.trajectory().turns(0.0).is_some() {
            scenario
                .controller
                .learning
                .get_or_insert_with(LearningSettings::default);
        } else {
            self.find("the trajectory does not repeat, so nothing is learned from turn to turn");
        }
        let mut best: Option<Best> = None;
        let later = self
            .result
            .findings
            .iter()
            .any(|finding| finding.contains("is believed to"));
        let mut believes = if later {
            "the scenario's model, a later amplifier"
        } else {
            "the scenario's model"
        }
        .to_owned();
        for cut in 1..=self.arguments.cuts {
            if cut > 1 && !self.respond(&format!("{}-response", cut + 1), &mut scenario)? {
                break;
            }
            let (summary, folder) = self.step(&format!("{}-cut", cut + 1), &scenario)?;
            for noticed in &summary.verdict.noticed {
                self.find(&format!("cut {cut}: {noticed}"));
            }
            if let Some(sentence) = refusal(&summary) {
                self.find(&format!("cut {cut}: {sentence}"));
                break;
            }
            let (error_m, max_m) = (summary.verdict.error_rms_m, summary.verdict.error_max_m);
            self.result.cuts.push(Cut {
                believes: believes.clone(),
                error_rms_m: error_m,
                error_max_m: max_m,
                seconds: summary.ticks as f64 / summary.ticks_per_s,
                folder: folder.clone(),
                course: summary
                    .verdict
                    .error_course
                    .iter()
                    .map(|own| [own.time_s, own.max_m])
                    .collect(),
            });
            let before_m = best.as_ref().map(|best| best.summary.verdict.error_max_m);
            if before_m.is_none_or(|before_m| max_m < before_m) {
                best = Some(Best {
                    scenario: scenario.clone(),
                    summary,
                    learned: RunFolder::open(&folder).learned(),
                });
            }
            let is_last = before_m.is_some_and(|before_m| max_m > (1.0 - BETTER) * before_m);
            if is_last || cut == self.arguments.cuts {
                break;
            }
            let Some((next, named)) = self.amended(&scenario, &folder)? else {
                break;
            };
            (scenario, believes) = (next, named);
        }
        let Some(Best {
            mut scenario,
            summary,
            learned,
        }) = best
        else {
            "not fit: the rig followed the small profile, but not the whole one, see the findings"
                .clone_into(&mut self.result.sentence);
            return Ok(None);
        };
        let error_m = summary.verdict.error_rms_m;
        let size_m = scenario.controller().map_err(told)?.size_m(scenario.duration_s);
        if let Some(size_m) = size_m.filter(|size_m| error_m > TRACKS * size_m || error_m.is_nan()) {
            self.result.sentence = format!(
                "not fit: an error of {} rms on a profile of {} is no tracking, see the findings",
                Si(error_m, "m"),
                Si(size_m, "m")
            );
            return Ok(None);
        }
        self.result.fit = true;
        self.result.sentence = format!(
            "fit: {} rms, {} at most in the best cut; {}",
            Si(error_m, "m"),
            Si(summary.verdict.error_max_m, "m"),
            summary.sentence(scenario.expect.settling_s)
        );
        if let Some(learning) = scenario.controller.learning.as_mut().filter(|_| learned.exists()) {
            // From where `commissioned.ron` stands.
            learning.from = learned.strip_prefix(self.out).ok().map(Path::to_path_buf);
        }
        Ok(Some(scenario))
    }

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
    fn is_fit(&mut self, scenario: &mut Scenario) -> miette::Result<bool> {
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
    fn respond(&mut self, name: &str, scenario: &mut Scenario) -> miette::Result<bool> {
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
    fn small(&mut self, scenario: &mut Scenario) -> miette::Result<bool> {
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

    fn find(&mut self, finding: &str) {
        if !self.arguments.json.json {
            crate::say!("{finding}");
        }
        self.result.findings.push(finding.to_owned());
    }

    /// Runs a step, unless it was made before a kill.
    fn step(&mut self, name: &str, scenario: &Scenario) -> miette::Result<(Summary, PathBuf)> {
        let path = self.out.join(name);
        let folder = RunFolder::open(&path);
        let text = to_ron(&as_saved(scenario, &folder)?).map_err(told)?;
        let same = self.goes_on && std::fs::read_to_string(folder.scenario()).is_ok_and(|before| before == text);
        let before = std::fs::read(folder.summary()).ok().filter(|_| same);
        if let Some(summary) = before.and_then(|before| serde_json::from_slice(&before).ok()) {
            return Ok((summary, path));
        }
        scenario.validate().map_err(told)?;
        remove(&path, &["diagnosis.json", "diagnosis.html", "amended.ron"])?;
        let (folder, outcome) = perform(scenario, &self.arguments.alone, Some(&path))?;
        let reports = outcome.inspect_err(|_| self.failed = true)?;
        Ok((Summary::written(scenario, &reports, &folder)?, path))
    }

    /// The scenario with what a diagnosis of a cut found, and its name; none where it found nothing to amend.
    fn amended(&mut self, scenario: &Scenario, cut: &Path) -> miette::Result<Option<(Scenario, String)>> {
        // What the response's run shakes, a cut does not: modes, and small loops.
        let folders = std::iter::once(cut).chain(self.response_run.as_deref());
        let runs = folders.map(|folder| measured_run(scenario, folder));
        let runs: Vec<MeasuredRun> = runs.collect::<Result<_, _>>()?;
        // Anew from what was believed at first: an amended model holds what it lacks in other numbers.
        let model = match &self.believed {
            Some(model) => model.clone(),
            None => self.believed.insert(scenario.believed_model().map_err(told)?).clone(),
        };
        let (model, shape_drift_a_per_m) = following(model, scenario, &tokens::<Estimate>(cut)?);
        let options = DiagnoseOptions {
            threads: self.arguments.threads.count(),
            shape_drift_a_per_m,
            ..DiagnoseOptions::default()
        };
        let bar = share_bar("diagnose");
        let found = diagnose(&model, &runs, &options, &mut |stage, share| {
            bar.set_prefix(stage.to_owned());
            bar.set_position((100.0 * share) as u64);
        });
        bar.finish_and_clear();
        let found = match found {
            Ok(found) => found,
            Err(error) => {
                self.find(&format!("no diagnosis: {error}"));
                return Ok(None);
            }
        };
        self.find(&format!("diagnosis: {}", found.diagnosis.sentence));
        save(cut, "diagnosis.json", &format!("{}\n", json(&found.diagnosis)?))?;
        let (own, out) = (quoted(&self.arguments.scenario.scenario), quoted(self.out));
        let command = format!("anhyst commission {own} --out {out}");
        save(cut, "diagnosis.html", &diagnosis_page(&found, &command).html())?;
        if found.diagnosis.verdict == Verdict::Columns || found.amended == model {
            return Ok(None);
        }
        if found.amended.effect(EffectKind::SensorGain) != model.effect(EffectKind::SensorGain) {
            self.find("the sensor is the ruler here: another gain of it is not believed");
            return Ok(None);
        }
        save(
            cut,
            "amended.ron",
            &amended_text(&found.diagnosis, &found.amended).map_err(told)?,
        )?;
        let next = believing(scenario, &found.amended);
        if let Err(error) = next.validate() {
            self.find(&format!("the amended model makes no loop: {error}"));
            return Ok(None);
        }
        let names: Vec<&str> = found
            .diagnosis
            .effects
            .iter()
            .map(|effect| effect.name.as_str())
            .collect();
        let named = if names.is_empty() {
            "calibrated".to_owned()
        } else {
            names.join(" + ")
        };
        Ok(Some((next, named)))
    }
}

/// Why a rig is not fit.
fn refusal(summary: &Summary) -> Option<String> {
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
