//! Actuators that `anhyst new` knows without a file.

/// One of them; numbers in the units of its material.
#[derive(Debug)]
pub struct Preset {
    pub name: &'static str,
    /// What the controller's side believes.
    pub material: &'static str,
    /// What is really there, where that is another law.
    pub plant: Option<&'static str>,
    pub words: &'static str,
    /// Of a stage or a magnet: resonance in Hz, damping ratio.
    pub resonance: Option<(f64, f64)>,
    pub bandwidth_hz: Option<f64>,
    pub stroke: f64,
    pub frequency_hz: f64,
}

pub const PRESETS: [Preset; 4] = [
    Preset {
        name: "terfenol",
        material: "built-in/materials/terfenol_nealis_smith.ron",
        plant: None,
        words: "a rod of Terfenol-D with the paper's constants, strain linearised about a bias",
        resonance: None,
        bandwidth_hz: None,
        stroke: 80e-6,
        frequency_hz: 50.0,
    },
    Preset {
        name: "terfenol-measured",
        material: "built-in/materials/terfenol_d_measured.ron",
        plant: None,
        words: "a rod of Terfenol-D fitted to measured loops, quadratic strain: it only lengthens",
        resonance: None,
        bandwidth_hz: None,
        stroke: 50e-6,
        frequency_hz: 50.0,
    },
    Preset {
        name: "piezo",
        material: "built-in/materials/piezo_stage_plays.ron",
        plant: Some("built-in/materials/piezo_stage_preisach.ron"),
        words: "a piezo stage: believed are plays with creep, really there is a Preisach plane",
        resonance: Some((500.0, 0.03)),
        bandwidth_hz: Some(1600.0),
        stroke: 40e-6,
        frequency_hz: 10.0,
    },
    Preset {
        name: "magnet",
        material: "built-in/materials/magnet_plays.ron",
        plant: Some("built-in/materials/magnet_preisach.ron"),
        words: "an electromagnet with a core of power ferrite: believed are plays behind tanh curves, really there is a Preisach plane",
        resonance: Some((2000.0, 1.0)),
        bandwidth_hz: Some(1000.0),
        stroke: 0.4,
        frequency_hz: 5.0,
    },
];
