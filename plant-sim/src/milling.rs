//! F = K·Σⱼ sin²φⱼ·max(f + x(t) − s(t − T), 0),  K = K_c·b,  T = 1/(n·teeth),  s(t) = max(x(t), s(t − T) − f)
//!
//! F cutting force against the rod (N), x displacement of the tip towards the workpiece (m), f feed per tooth (m),
//! s face that the tooth before left, relative to the feed (m), K_c cutting coefficient (N/m²), b axial depth (m),
//! n spindle speed (1/s), T tooth period (s), φⱼ angle of tooth j; the sum is over teeth between entry and exit angle.
//! The chip's thickness is sin φ times advance, and sin φ of the normal force acts along the rod. A tooth that does not
//! reach the face leaves it as it was: so the force ends at zero and the next tooth finds the thicker chip.
//! Assumptions: motion along the feed only, no tangential force, no ploughing, rigid workpiece, flat face at x = 0 first.
//!
//! Stability. On a rod of static stiffness k and damping ratio ζ the regeneration can grow only above
//! K·Σsin² = 2kζ(1 + ζ), whatever the spindle speed: 5.1e7 N/m for the paper's rod (k = 3.5e7 N/m, ζ = 0.49). In a
//! loop the rod's compliance is multiplied by the sensitivity S; since |1 − e^(−iωT)| ≤ 2 and |G| ≤ 1.17/k, no loop
//! with |S| ≤ 4 can chatter below K = k/(2·1.17·4) = 3.7e6 N/m (small gain). `Heavy` is 4.2e5 N/m.
//! Source: single-degree-of-freedom regenerative milling (Altintas, Manufacturing Automation; Tlusty's limit).

use core::f64::consts::PI;

use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

const MAX_TEETH: u32 = 32;

/// Which cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Cut {
    /// The tip is free.
    #[default]
    Off,
    /// [`Milling::light`].
    Light,
    /// [`Milling::heavy`].
    Heavy,
    /// Numbers of one's own.
    Custom(Milling),
}

impl Cut {
    /// Its numbers; none without a cut.
    pub fn milling(&self) -> Option<Milling> {
        match *self {
            Cut::Off => None,
            Cut::Light => Some(Milling::light()),
            Cut::Heavy => Some(Milling::heavy()),
            Cut::Custom(milling) => Some(milling),
        }
    }
}

/// When the tool touches the workpiece; from the first tick to the last unless told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Contact {
    /// Start, s.
    pub from_s: f64,
    /// End, s; none: to the end of the run.
    pub to_s: Option<f64>,
}

impl Contact {
    /// True while the tool is in the workpiece.
    pub fn holds_at(&self, time_s: f64) -> bool {
        time_s >= self.from_s && self.to_s.is_none_or(|to_s| time_s < to_s)
    }

    /// # Errors
    /// A start before the run, or an end before the start.
    pub fn validate(&self) -> Result<(), Invalid> {
        Invalid::unless_between("from_s", self.from_s, 0.0, 1e9, "s")?;
        self.to_s.map_or(Ok(()), |to_s| {
            Invalid::unless_between("to_s", to_s, self.from_s, 1e9, "s")
        })
    }
}

/// One cut.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Milling {
    /// Revolutions per minute.
    pub spindle_rpm: f64,
    /// Teeth of the cutter.
    pub teeth: u32,
    /// Angle at which a tooth meets the workpiece, degrees from the feed's normal.
    pub entry_angle_deg: f64,
    /// Angle at which it leaves; a full slot is 0 to 180.
    pub exit_angle_deg: f64,
    /// K_c, N/m²: force per area of chip, 7e8 for aluminium alloys.
    pub cutting_coefficient_n_per_m2: f64,
    /// b, m.
    pub axial_depth_m: f64,
    /// f, m.
    pub feed_per_tooth_m: f64,
    /// Heat that reaches the rod while the tool is in contact, W; it needs a thermal circuit.
    pub heat_w: f64,
}

impl Milling {
    /// A slot 0.05 mm deep in aluminium, 0.05 mm per tooth: pulses of 1.8 N at 400 Hz, 3.6 N where the tip swings ±40 µm at
    /// 50 Hz and ±12 µm at 150 Hz. Heat: 5 % of the 7 W that a 10 mm cutter turns into chips.
    pub fn light() -> Self {
        Milling {
            axial_depth_m: 0.05e-3,
            feed_per_tooth_m: 0.05e-3,
            heat_w: 0.35,
            ..Self::heavy()
        }
    }

    /// A slot 0.6 mm deep in aluminium, 0.1 mm per tooth, 12 000 rpm, two teeth: pulses of 42 N at 400 Hz, 64 N where the
    /// tip swings as above. They deflect the paper's rod by up to 1.9 µm, too fast for feedback; an integrator takes the
    /// mean, and about ±1 µm is left (`tests/in_the_loop.rs`). Heat: 5 % of 168 W.
    pub fn heavy() -> Self {
        Milling {
            spindle_rpm: 12_000.0,
            teeth: 2,
            entry_angle_deg: 0.0,
            exit_angle_deg: 180.0,
            cutting_coefficient_n_per_m2: 7e8,
            axial_depth_m: 0.6e-3,
            feed_per_tooth_m: 0.1e-3,
            heat_w: 8.4,
        }
    }

    /// K, N/m: force per depth of advance with one tooth at 90 degrees.
    pub fn cutting_stiffness_n_per_m(&self) -> f64 {
        self.cutting_coefficient_n_per_m2 * self.axial_depth_m
    }

    /// T, s.
    pub fn tooth_period_s(&self) -> f64 {
        60.0 / (self.spindle_rpm * f64::from(self.teeth))
    }

    /// Σ sin²φⱼ over the teeth in the workpiece, no unit. The angle of tooth 0 is zero at t = 0.
    pub fn engagement(&self, time_s: f64) -> f64 {
        let turns = time_s * self.spindle_rpm / 60.0;
        let spacing = 1.0 / f64::from(self.teeth);
        (0..self.teeth).fold(0.0, |sum, tooth| {
            let turned = turns + f64::from(tooth) * spacing;
            let part = turned - turned.floor();
            let in_cut = (self.entry_angle_deg..=self.exit_angle_deg).contains(&(360.0 * part));
            let sine = libm::sin(2.0 * PI * part);
            if in_cut { sum + sine * sine } else { sum }
        })
    }

    /// # Errors
    /// The first number that no cut can have.
    pub fn validate(&self) -> Result<(), Invalid> {
        Invalid::unless_positive("spindle_rpm", self.spindle_rpm, "1/min")?;
        if self.teeth == 0 || self.teeth > MAX_TEETH {
            return Err(Invalid::new(
                "teeth",
                format!("{} teeth are outside [1, {MAX_TEETH}]", self.teeth),
            ));
        }
        Invalid::unless_between("entry_angle_deg", self.entry_angle_deg, 0.0, 180.0, "degrees")?;
        Invalid::unless_between(
            "exit_angle_deg",
            self.exit_angle_deg,
            self.entry_angle_deg,
            180.0,
            "degrees",
        )?;
        Invalid::unless_positive(
            "cutting_coefficient_n_per_m2",
            self.cutting_coefficient_n_per_m2,
            "N/m^2",
        )?;
        Invalid::unless_positive("axial_depth_m", self.axial_depth_m, "m")?;
        Invalid::unless_positive("feed_per_tooth_m", self.feed_per_tooth_m, "m")?;
        Invalid::unless_between("heat_w", self.heat_w, 0.0, 1e4, "W")
    }
}
