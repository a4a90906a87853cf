//! The whole profile: cut after cut, each with what the diagnosis of the one before has found, as long as it gets better.

use super::Work;
use super::belief::{believing, following, measured_run, tokens, told};
use super::first_steps::refusal;
use super::report::Cut;
use crate::commands::{json, save, share_bar};
use crate::fitness::TRACKS;
use anhyst_controller::LearningSettings;
use anhyst_diagnosis::{DiagnoseOptions, Verdict, amended_text, diagnose, page as diagnosis_page};
use anhyst_ipc::Estimate;
use anhyst_launch::folder::RunFolder;
use anhyst_launch::say::quoted;
use anhyst_launch::summary::Summary;
use anhyst_measured::MeasuredRun;
use anhyst_model::EffectKind;
use anhyst_report::number::Si;
use anhyst_scenario::Scenario;
use std::path::{Path, PathBuf};

/// A further cut's largest error must be below the best one's by this part: it is what a tolerance bounds.
const BETTER: f64 = 0.03;

/// The best cut so far.
struct Best {
    scenario: Scenario,
    summary: Summary,
    learned: PathBuf,
}

impl Work<'_> {
    /// The scenario that cut best; none where the rig is not fit.
    pub(super) fn commission(&mut self, mut scenario: Scenario) -> miette::Result<Option<Scenario>> {
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
