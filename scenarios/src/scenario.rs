//! The scenario as its file says it.

use super::{Clock, Fault};
use anhyst_controller::ControllerSettings;
use anhyst_estimator::EstimatorSettings;
use anhyst_guard::GuardSettings;
use anhyst_inverse::InverseSettings;
use anhyst_ipc::{Change, Invalid, NodeId};
use anhyst_model::{AmplifierConstants, Effect, Material, RodConstants, TwoPole};
use anhyst_plant_sim::{PlantSettings, WatchdogSettings};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Everything that decides a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Name of the run's folder and recording: letters, digits, `-` and `_`.
    pub name: String,
    /// Seed of all noise.
    pub seed: u64,
    /// Time between two ticks.
    pub tick_s: f64,
    /// Length of the run.
    pub duration_s: f64,
    /// How time passes.
    pub clock: Clock,
    /// Which nodes share a process.
    #[serde(default)]
    pub placement: Placement,
    /// Nodes that somebody else's programs run: the launcher waits for them instead of starting them.
    #[serde(default)]
    pub external: Vec<NodeId>,
    /// What the actuator is made of: what the controller's side believes, and the plant's unless it says otherwise.
    pub material: MaterialSource,
    /// The rod and its load.
    pub rod: Rod,
    /// Physical effects that the controller's side knows of, and the plant's unless it says otherwise.
    #[serde(default)]
    pub effects: Vec<Effect>,
    /// The current amplifier.
    #[serde(default)]
    pub amplifier: AmplifierConstants,
    /// The amplifier's own watchdog.
    #[serde(default)]
    pub watchdog: WatchdogSettings,
    /// The simulated plant: what is really so.
    pub plant: PlantSettings,
    /// The estimator of `a`.
    pub estimator: EstimatorSettings,
    /// The inverse compensator.
    pub inverse: InverseSettings,
    /// Trajectory, feedforward, feedback.
    pub controller: ControllerSettings,
    /// Limits and watchdog.
    pub guard: GuardSettings,
    /// What is recorded.
    #[serde(default)]
    pub recording: Recording,
    /// Stood beside `faults` until a flipped bit became one of them: `None` in old files.
    #[serde(default, skip_serializing, deserialize_with = "super::faults::refuse_flip")]
    pub fault: (),
    /// Injected faults of links and processes.
    #[serde(default)]
    pub faults: Vec<Fault>,
    /// What must hold.
    pub expect: Expect,
    /// Settings that change while the run goes on, in the order of their ticks; `anhyst tune` adds to them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub changes: Vec<Change>,
}

/// Which nodes share a process.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub enum Placement {
    /// One process each.
    #[default]
    Separate,
    /// One process a group; nodes that are not named get their own.
    Groups(Vec<Vec<NodeId>>),
    /// All in the launching process, without iceoryx2.
    Embedded,
}

impl Placement {
    /// The processes by name, with their nodes in loop order.
    pub fn processes(&self) -> Vec<(String, Vec<NodeId>)> {
        let groups: Vec<Vec<NodeId>> = match self {
            Placement::Separate => NodeId::LOOP_ORDER.iter().map(|node| vec![*node]).collect(),
            Placement::Embedded => vec![NodeId::LOOP_ORDER.to_vec()],
            Placement::Groups(groups) => {
                let alone = NodeId::LOOP_ORDER
                    .iter()
                    .filter(|node| !groups.iter().flatten().any(|named| named == *node));
                groups.iter().cloned().chain(alone.map(|node| vec![*node])).collect()
            }
        };
        groups
            .into_iter()
            .filter(|group| !group.is_empty())
            .map(|mut group| {
                group.sort();
                (
                    group.iter().map(|node| node.name()).collect::<Vec<_>>().join("+"),
                    group,
                )
            })
            .collect()
    }
}

/// A material, or where its file is (relative to the scenario).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum MaterialSource {
    /// A RON file of a material.
    File(PathBuf),
    /// The material itself; the effective scenario always holds this.
    Inline(Box<Material>),
}

/// The rod as the controller's side knows it: finite elements, reduced to two poles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rod {
    /// Material and load of the rod; the paper's unless told.
    #[serde(default = "RodConstants::paper")]
    pub constants: RodConstants,
    /// Number of elements that the two poles are computed from.
    #[serde(default = "usual_elements")]
    pub elements: usize,
    /// The two poles of a fitted model, gain per magnetization, in place of those computed.
    #[serde(default)]
    pub two_pole: Option<TwoPole>,
    /// The one resonance of a stage that follows its material's output, in place of rod and two poles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resonance: Option<Resonance>,
}

fn usual_elements() -> usize {
    anhyst_plant_sim::TWO_POLE_ELEMENTS
}

/// A resonance of gain 1 at rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Resonance {
    /// Undamped, Hz.
    pub frequency_hz: f64,
    /// 1 is critical, as of a well damped sensor or of eddy currents.
    pub damping_ratio: f64,
}

impl Resonance {
    pub(crate) fn validate(self) -> Result<(), Invalid> {
        Invalid::unless_positive("frequency_hz", self.frequency_hz, "Hz")?;
        Invalid::unless_between("damping_ratio", self.damping_ratio, 0.0, 10.0, "")
    }

    /// Its two poles.
    pub fn two_pole(self) -> TwoPole {
        let rate_per_s = std::f64::consts::TAU * self.frequency_hz;
        TwoPole {
            gain: rate_per_s * rate_per_s,
            damping_per_s: 2.0 * self.damping_ratio * rate_per_s,
            stiffness_per_s2: rate_per_s * rate_per_s,
            force_gain_per_kg: 0.0,
        }
    }
}

/// What is recorded.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Recording {
    /// Write a Rerun recording.
    pub on: bool,
    /// Ticks handed to the recording at once.
    pub block_ticks: usize,
    /// Rows per second of the plots made for people; the tokens themselves are always recorded at full rate.
    pub plot_rate_hz: f64,
    /// Size from which on the recording goes on in another file, MB.
    pub part_mb: f64,
    /// The same for the time that is in a file, s; none: only the size counts.
    pub part_s: Option<f64>,
    /// Only what surrounds events is kept, s: at least so long before each and after it. Takes the place of `part_s`.
    pub ring_s: Option<f64>,
    /// Half the height of the error plot; none: chosen from the run.
    pub error_axis_nm: Option<f64>,
    /// TCP port on 127.0.0.1 where viewers may join the running recording.
    pub live_port: Option<u16>,
}

impl Default for Recording {
    fn default() -> Self {
        Self {
            on: true,
            block_ticks: 4000,
            plot_rate_hz: 4000.0,
            part_mb: 250.0,
            part_s: None,
            ring_s: None,
            error_axis_nm: None,
            live_port: None,
        }
    }
}

/// What must hold. Errors are reference minus true displacement, after the settling time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expect {
    /// The workpiece's tolerance: the largest error that is allowed. None: nothing is said to hold.
    #[serde(default)]
    pub tolerance_m: Option<f64>,
    /// The run is judged from here on.
    pub settling_s: f64,
    /// Largest root mean square error.
    #[serde(default)]
    pub error_rms_m: Option<f64>,
    /// Largest final error of the estimated shape parameter.
    #[serde(default)]
    pub a_final_error_a_per_m: Option<f64>,
    /// Of steps: so long after its beginning a step has settled; before, its error does not count. None: it counts all the time.
    #[serde(default)]
    pub step_settling_s: Option<f64>,
    /// Of steps: largest overshoot, as a share of the step.
    #[serde(default)]
    pub overshoot: Option<f64>,
    /// Of lines: largest distance from a straight line, as a share of the line.
    #[serde(default)]
    pub nonlinearity: Option<f64>,
    /// Of a sweep: up to here the gain is at least -3 dB.
    #[serde(default)]
    pub bandwidth_hz: Option<f64>,
}

impl Expect {
    /// Nothing, from the first tick on.
    pub const NONE: Self = Self {
        tolerance_m: None,
        settling_s: 0.0,
        error_rms_m: None,
        a_final_error_a_per_m: None,
        step_settling_s: None,
        overshoot: None,
        nonlinearity: None,
        bandwidth_hz: None,
    };
}

impl Scenario {
    /// Number of ticks.
    pub fn ticks(&self) -> u64 {
        (self.duration_s / self.tick_s).round() as u64
    }

    /// The material; loading has put it inline.
    pub fn material(&self) -> Result<&Material, Invalid> {
        match &self.material {
            MaterialSource::Inline(material) => Ok(material.as_ref()),
            MaterialSource::File(path) => Err(Invalid::new("material", format!("{} was not loaded", path.display()))),
        }
    }
}
