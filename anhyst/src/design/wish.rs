//! What `anhyst new` is told; what is left out follows from the actuator.

use super::Profile;
use super::amount::amount;
use clap::Args;
use std::path::PathBuf;

/// A wish for a scenario. Amounts are numbers with their units.
#[derive(Debug, Clone, Args)]
pub struct Wish {
    /// Name of the scenario and of its file: letters, digits, `-` and `_`.
    #[arg(default_value = "my-actuator")]
    pub name: String,
    /// terfenol, terfenol-measured, piezo, magnet, or a file: material.ron or law.ron of `anhyst fit`, amended.ron of `anhyst diagnose`.
    #[arg(long, default_value = "terfenol", value_name = "PRESET|FILE")]
    pub material: String,
    /// What is really there, where it differs from the material that is believed: another file.
    #[arg(long, value_name = "FILE")]
    pub plant: Option<PathBuf>,
    /// How far it moves, from end to end: 80um, 0.4T.
    #[arg(long, value_name = "AMOUNT")]
    pub stroke: Option<String>,
    /// How often the motion repeats: 50Hz.
    #[arg(long, value_name = "AMOUNT")]
    pub frequency: Option<String>,
    /// The motion (default: sine).
    #[arg(long, value_enum)]
    pub profile: Option<Profile>,
    /// How often the loop samples: 20kHz.
    #[arg(long, value_name = "AMOUNT")]
    pub rate: Option<String>,
    /// Noise of the sensor, rms: 10nm.
    #[arg(long, value_name = "AMOUNT")]
    pub noise: Option<String>,
    /// Bandwidth of the amplifier: 2kHz (default: no lag).
    #[arg(long, value_name = "AMOUNT")]
    pub bandwidth: Option<String>,
    /// Most that the amplifier gives: 30kA/m, 120V.
    #[arg(long, value_name = "AMOUNT")]
    pub limit: Option<String>,
    /// Of a stage or a magnet: its resonance, 500Hz.
    #[arg(long, value_name = "AMOUNT")]
    pub resonance: Option<String>,
    /// Of a stage or a magnet: damping ratio of the resonance; 1 is critical.
    #[arg(long, value_name = "RATIO", allow_negative_numbers = true)]
    pub damping: Option<f64>,
    /// Of a rod: 115mm.
    #[arg(long, value_name = "AMOUNT")]
    pub length: Option<String>,
    /// Of a rod: 12.7mm.
    #[arg(long, value_name = "AMOUNT")]
    pub diameter: Option<String>,
    /// At the rod's end: 0.5kg.
    #[arg(long, value_name = "AMOUNT")]
    pub mass: Option<String>,
    /// Of a rod: 30e9Pa.
    #[arg(long, value_name = "AMOUNT")]
    pub youngs_modulus: Option<String>,
    /// Of a rod: 9250kg/m3.
    #[arg(long, value_name = "AMOUNT")]
    pub density: Option<String>,
}

impl Wish {
    /// The motion.
    pub fn profile(&self) -> Profile {
        self.profile.unwrap_or(Profile::Sine)
    }

    /// The first option of a rod that was given.
    pub(super) fn of_rod(&self) -> Option<&'static str> {
        let given = [
            ("--length", &self.length),
            ("--diameter", &self.diameter),
            ("--mass", &self.mass),
            ("--youngs-modulus", &self.youngs_modulus),
            ("--density", &self.density),
        ];
        given.into_iter().find_map(|(name, own)| own.is_some().then_some(name))
    }

    /// An option's amount.
    pub(super) fn number(&self, option: &str, text: &Option<String>, unit: &str) -> miette::Result<Option<f64>> {
        let text = text.as_deref();
        let number = text.map(|text| amount(option, text, unit)).transpose();
        number.map_err(|sentence| miette::miette!("{sentence}"))
    }
}
