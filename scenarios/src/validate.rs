//! Checks a scenario as a whole: each setting, and what only shows when settings meet.

use super::{Placement, Scenario, gives_m};
use anhyst_controller::{Controller, LoopShape, PidSettings, TrajectorySettings};
use anhyst_estimator::{Estimator, EstimatorError, LawSettings};
use anhyst_ipc::{Invalid, NodeId};
use anhyst_model::{Hysteresis, Material, MaterialLaw, ModelError};
use anhyst_plant_sim::{PlantError, PlantNode, ShapeCourse};
use std::path::Path;

/// The longest run that a lockstep digest history is kept for: 8 bytes a tick and node.
const MAX_TICKS: f64 = 1e9;
/// No system wakes a process more often.
const MIN_REAL_TICK_S: f64 = 1e-5;
/// More elements than this change nothing and cost a step quadratically.
const MAX_ELEMENTS: usize = 64;
/// Of the reach of a law: a motion that goes no farther beyond it rounds.
const BEYOND_LAW: f64 = 0.02;

fn physical(path: &'static str) -> impl Fn(ModelError) -> Invalid {
    move |error| Invalid::new(path, error.to_string())
}

impl Scenario {
    /// Checks everything.
    ///
    /// # Errors
    /// The first setting that cannot be used, with its path, value, limit and reason.
    pub fn validate(&self) -> Result<(), Invalid> {
        self.validate_run()?;
        let material = self.material()?;
        material
            .hysteresis
            .validate()
            .map_err(physical("material.hysteresis"))?;
        material
            .magnetostriction
            .validate()
            .map_err(physical("material.magnetostriction"))?;
        self.rod.constants.validate().map_err(physical("rod.constants"))?;
        if !(1..=MAX_ELEMENTS).contains(&self.rod.elements) {
            let sentence = format!("{} elements are outside [1, {MAX_ELEMENTS}]", self.rod.elements);
            return Err(Invalid::new("rod.elements", sentence));
        }
        self.validate_law(material)?;
        self.validate_effects()?;
        anhyst_plant_sim::validate_amplifier(&self.amplifier).map_err(|invalid| invalid.within("amplifier"))?;
        self.plant.validate().map_err(|invalid| invalid.within("plant"))?;
        self.estimator
            .validate()
            .map_err(|invalid| invalid.within("estimator"))?;
        self.validate_plant(material)?;
        self.validate_estimator()?;
        self.validate_shapes(&material.hysteresis)?;
        self.inverse.validate().map_err(|invalid| invalid.within("inverse"))?;
        let guard_limit = self.guard.field_limit_a_per_m;
        if let Some(limit) = self.inverse.field_limit_a_per_m.filter(|limit| *limit > guard_limit) {
            return Err(Invalid::new(
                "inverse.field_limit_a_per_m",
                format!("{limit} A/m is above the guard's limit, guard.field_limit_a_per_m = {guard_limit} A/m"),
            ));
        }
        self.guard
            .validate(self.tick_s)
            .map_err(|invalid| invalid.within("guard"))?;
        self.watchdog.validate().map_err(|invalid| invalid.within("watchdog"))?;
        self.validate_faults()?;
        self.controller
            .validate(self.tick_s, self.duration_s)
            .map_err(|invalid| invalid.within("controller"))?;
        self.validate_monitors()?;
        self.validate_stability()?;
        self.validate_course()?;
        self.validate_changes()?;
        self.validate_tolerance()?;
        self.validate_reach(material)
    }

    /// Another hysteresis law gives what the actuator does at rest: a rod of its own gain would give it once more.
    fn validate_law(&self, material: &Material) -> Result<(), Invalid> {
        let is_of_weights = self.estimator.law.is_of_weights();
        if material.law.is_none() {
            if is_of_weights && !self.inverse.is_open_loop() {
                let sentence = "Weights and FixedWeights are for a material with another law than the domain wall's";
                return Err(Invalid::new("estimator.law", sentence));
            }
            return Ok(());
        }
        if !is_of_weights {
            let sentence = "this estimates a of the domain wall law, and the material has another law: take Weights() or FixedWeights";
            return Err(Invalid::new("estimator.law", sentence));
        }
        if self.rod.two_pole.is_none() {
            let sentence = "a material with another law than the domain wall's follows rod.resonance: give (frequency_hz, damping_ratio)";
            return Err(Invalid::new("rod", sentence));
        }
        Ok(())
    }

    /// A thermometer that is not fitted says 0 K: a limit would watch nothing.
    fn validate_monitors(&self) -> Result<(), Invalid> {
        let limit = self.guard.monitors.temperature_limit_k;
        if let (Some(limit_k), None) = (limit, self.plant.sensors.temperature) {
            let sentence =
                format!("{limit_k} K cannot be watched: no thermometer is fitted, give plant.sensors.temperature");
            return Err(Invalid::new("guard.monitors.temperature_limit_k", sentence));
        }
        Ok(())
    }

    /// What is expected of a trajectory must be something that it has.
    fn validate_course(&self) -> Result<(), Invalid> {
        use TrajectorySettings::{Raster, Sawtooth, Steps, Sweep, Triangle};
        let expect = &self.expect;
        let trajectory = &self.controller.trajectory;
        let steps = matches!(trajectory, Steps(_));
        let lines = matches!(trajectory, Triangle(_) | Sawtooth(_) | Raster(_));
        let sweep = matches!(trajectory, Sweep(_));
        for (path, limit, unit, has, whose) in [
            ("expect.step_settling_s", expect.step_settling_s, "s", steps, "Steps"),
            ("expect.overshoot", expect.overshoot, "", steps, "Steps"),
            (
                "expect.nonlinearity",
                expect.nonlinearity,
                "",
                lines,
                "Triangle, Sawtooth and Raster",
            ),
            ("expect.bandwidth_hz", expect.bandwidth_hz, "Hz", sweep, "Sweep"),
        ] {
            let Some(limit) = limit else { continue };
            Invalid::unless_positive(path, limit, unit)?;
            if !has {
                let sentence = format!("this is for the trajectories {whose}; the scenario has another one");
                return Err(Invalid::new(path, sentence));
            }
        }
        Ok(())
    }

    /// A loop that stands still must miss its tolerance, wherever it stands.
    pub(super) fn validate_tolerance(&self) -> Result<(), Invalid> {
        let (Some(tolerance_m), false) = (self.expect.tolerance_m, self.inverse.is_open_loop()) else {
            return Ok(());
        };
        let stroke_m = self.controller()?.stroke_m(self.expect.settling_s, self.duration_s);
        let Some(stroke_m) = stroke_m.filter(|stroke_m| tolerance_m > *stroke_m) else {
            return Ok(());
        };
        let sentence = format!(
            "{tolerance_m} m is more than the profile's own stroke, ±{stroke_m:.3e} m: a loop that stands still would hold it; leave it out where nothing is to be judged"
        );
        Err(Invalid::new("expect.tolerance_m", sentence))
    }

    /// The linear loop that the PID closes, with all delay that is known: also the amplifier's, of which the controller alone
    /// does not know.
    ///
    /// # Errors
    /// If the rod's constants cannot be used.
    pub fn loop_shape(&self) -> Result<LoopShape, Invalid> {
        self.loop_shape_of(self.controller.feedback.as_ref())
    }

    /// The same with other gains.
    pub(super) fn loop_shape_of(&self, gains: Option<&PidSettings>) -> Result<LoopShape, Invalid> {
        let (_, rod) = self.believed()?;
        let shape = LoopShape::new(&rod, gains, self.tick_s);
        Ok(shape
            .with_effects(&self.effects)
            .with_amplifier_delay(self.amplifier.delay_ticks))
    }

    fn validate_stability(&self) -> Result<(), Invalid> {
        self.loop_shape()?
            .validate()
            .map_err(|invalid| invalid.within("controller"))
    }

    fn validate_run(&self) -> Result<(), Invalid> {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
        if self.name.is_empty() || self.name.len() > 60 || !self.name.chars().all(plain) {
            let sentence = format!(
                "\"{}\" must be 1 to 60 letters, digits, '-' or '_': it names a folder",
                self.name
            );
            return Err(Invalid::new("name", sentence));
        }
        Invalid::unless_between("tick_s", self.tick_s, 1e-6, 1.0, "s")?;
        Invalid::unless_positive("duration_s", self.duration_s, "s")?;
        let ticks = self.duration_s / self.tick_s;
        if !(1.0..=MAX_TICKS).contains(&ticks.round()) {
            let sentence = format!(
                "{} s are {ticks:.3e} ticks, outside [1, {MAX_TICKS:e}]",
                self.duration_s
            );
            return Err(Invalid::new("duration_s", sentence));
        }
        if self.clock.realtime().is_some() {
            Invalid::unless_between("tick_s", self.tick_s, MIN_REAL_TICK_S, 1.0, "s in real time")?;
        }
        self.clock.validate(ticks)?;
        if let Placement::Groups(groups) = &self.placement {
            let named: Vec<&NodeId> = groups.iter().flatten().collect();
            if let Some(twice) = named
                .iter()
                .enumerate()
                .find(|(i, node)| named[..*i].contains(node))
                .map(|(_, node)| node)
            {
                return Err(Invalid::new(
                    "placement",
                    format!("{twice} is in two groups; a node has one process"),
                ));
            }
        }
        self.validate_external()?;
        self.expect.tolerance_m.map_or(Ok(()), |tolerance_m| {
            Invalid::unless_positive("expect.tolerance_m", tolerance_m, "m")
        })?;
        if let Some(limit) = self.expect.error_rms_m {
            Invalid::unless_positive("expect.error_rms_m", limit, "m")?;
        }
        if let Some(limit) = self.expect.a_final_error_a_per_m {
            Invalid::unless_positive("expect.a_final_error_a_per_m", limit, "A/m")?;
            if !self.units().shape {
                let why =
                    format!("{limit} is for a material that has an a, and this one follows another law: leave it out");
                return Err(Invalid::new("expect.a_final_error_a_per_m", why));
            }
        }
        let last_s = self.duration_s - self.tick_s;
        Invalid::unless_between("expect.settling_s", self.expect.settling_s, 0.0, last_s, "s")?;
        Invalid::unless_between(
            "recording.block_ticks",
            self.recording.block_ticks as f64,
            16.0,
            65536.0,
            "ticks",
        )?;
        let recording = &self.recording;
        Invalid::unless_positive("recording.plot_rate_hz", recording.plot_rate_hz, "Hz")?;
        Invalid::unless_between("recording.part_mb", recording.part_mb, 1.0, 1e6, "MB")?;
        // A part holds whole blocks.
        let block_s = recording.block_ticks as f64 * self.tick_s;
        for (name, value) in [
            ("recording.part_s", recording.part_s),
            ("recording.ring_s", recording.ring_s),
        ] {
            value.map_or(Ok(()), |seconds| {
                Invalid::unless_between(name, seconds, block_s, 1e9, "s")
            })?;
        }
        Ok(())
    }

    /// The plant can be built at this tick, and its `a` can be followed.
    fn validate_plant(&self, material: &Material) -> Result<(), Invalid> {
        PlantNode::new(&self.plant, material, &self.rod.constants, self.tick_s, self.seed).map_err(
            |error| match error {
                PlantError::Invalid(invalid) => invalid.within("plant"),
                PlantError::Model(error) => Invalid::new("plant", error.to_string()),
            },
        )?;
        let (lower, upper) = self.estimator.law.range_a_per_m();
        if lower == upper {
            // A fixed `a` follows nothing; that the plant differs is the point of such a scenario.
            return Ok(());
        }
        let course = match self.plant.shape {
            ShapeCourse::Constant { a_per_m } => vec![a_per_m],
            ShapeCourse::Ramp {
                from_a_per_m,
                to_a_per_m,
                ..
            } => vec![from_a_per_m, to_a_per_m],
            ShapeCourse::Thermal { .. } => Vec::new(),
        };
        if let Some(outside) = course.into_iter().find(|a| !(lower..=upper).contains(a)) {
            let sentence = format!(
                "a = {outside} A/m is outside the estimator's range [{lower}, {upper}] A/m (estimator.law.range_a_per_m), which the estimate may not leave"
            );
            return Err(Invalid::new("plant.shape", sentence));
        }
        Ok(())
    }

    /// The estimator can be built with what is known of the actuator.
    fn validate_estimator(&self) -> Result<(), Invalid> {
        if self.effects.is_empty() {
            return Ok(());
        }
        let (material, rod) = self.believed()?;
        let estimator = Estimator::with_effects(
            &self.estimator,
            &material,
            rod,
            self.amplifier,
            self.tick_s,
            &self.effects,
        );
        estimator.map(|_| ()).map_err(|error| match error {
            EstimatorError::Setting(invalid) => invalid.within("estimator"),
            other => Invalid::new("estimator", other.to_string()),
        })
    }

    /// Every shape parameter that may occur must give a valid material, not only the nominal one.
    fn validate_shapes(&self, nominal: &Hysteresis) -> Result<(), Invalid> {
        if self.estimator.law.is_of_weights() {
            return Ok(());
        }
        let check = |path: &'static str, shape| nominal.with_shape(shape).validate().map_err(physical(path));
        match &self.estimator.law {
            LawSettings::FixedShape { shape_a_per_m } => check("estimator.law.shape_a_per_m", *shape_a_per_m),
            adaptive => {
                let (lower, upper) = adaptive.range_a_per_m();
                check("estimator.law.range_a_per_m", lower)?;
                check("estimator.law.range_a_per_m", upper)
            }
        }
    }

    /// The profile must be reachable: its magnetization within the strain law and its field within the limit.
    pub(super) fn validate_reach(&self, material: &Material) -> Result<(), Invalid> {
        let inside = |invalid: Invalid| invalid.within("controller");
        let controller = self.controller()?;
        if let Some(law) = &material.law {
            return self.validate_reach_of(law, material, &controller);
        }
        controller.validate_reach(self.duration_s).map_err(inside)?;
        let peak = controller.peak_magnetization(self.duration_s);
        let limit = self.guard.field_limit_a_per_m;
        let (asked, at_s) = (peak.magnetization_a_per_m, peak.time_s);
        let way = self.way_to(material, asked, limit);
        let sentence = format!(
            "the profile asks for a magnetization of {asked:.0} A/m at {at_s:.4} s, but the field limit of {limit} A/m reaches only {:.0} A/m",
            way.reached
        );
        if way.reaches {
            Ok(())
        } else {
            Err(Invalid::new("controller.trajectory", sentence))
        }
    }

    /// Beyond the inputs that it was fitted to a law is not known, and a stack that only pushes is not pulled.
    fn validate_reach_of(
        &self,
        law: &MaterialLaw,
        material: &Material,
        controller: &Controller,
    ) -> Result<(), Invalid> {
        let limit = self.guard.field_limit_a_per_m;
        let (_, rod) = self.believed()?;
        let [low, high] = gives_m(material, &rod, limit);
        let (least, most) = controller.asks_m(self.duration_s);
        let beyond = (low - least).max(most - high);
        if beyond <= BEYOND_LAW * (high - low) {
            return Ok(());
        }
        let [from, to] = law.input_extent;
        let [input, output] = material.units();
        let sentence = format!(
            "the motion asks for {least:.4e} to {most:.4e} {output}, but within the limit of {limit} {input} and the inputs that its law was \
             fitted to, {from} to {to} {input}, the actuator gives {low:.4e} to {high:.4e} {output}"
        );
        Err(Invalid::new("controller.trajectory", sentence))
    }

    /// The controller's block.
    ///
    /// # Errors
    /// A refused setting, relative to the controller's settings.
    pub fn controller(&self) -> Result<Controller, Invalid> {
        // Loading has made paths absolute: the folder does not matter any more.
        let (material, rod) = self.believed()?;
        let controller = Controller::with_effects(
            &self.controller,
            rod,
            &material,
            self.tick_s,
            Path::new("."),
            &self.effects,
        );
        let mut controller = controller.map_err(|own| {
            let elsewhere = ["rod", "material", "effects"]
                .iter()
                .any(|part| own.path.starts_with(part));
            if elsewhere { own } else { own.within("controller") }
        })?;
        // The judge has the others.
        for change in &self.changes {
            controller.change(change);
        }
        Ok(controller)
    }

    /// Makes the scenario independent of where it lies: paths in it become absolute.
    pub fn anchor(&mut self, folder: &Path) {
        let anchored = |file: &Path| std::path::absolute(folder.join(file)).unwrap_or_else(|_| folder.join(file));
        if let TrajectorySettings::Table { file, .. } = &mut self.controller.trajectory {
            *file = anchored(file);
        }
        if let Some(file) = self.controller.learning.as_mut().and_then(|own| own.from.as_mut()) {
            *file = anchored(file);
        }
    }
}
