//! What disturbs a run and is no effect: each kind alone, or all of them.

use crate::draw::Draw;
use crate::hidden::Laws;
use crate::rig::Rig;
use crate::surroundings::{Filter, Past, Tone};

/// A kind of disturbance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Nuisance {
    Clean,
    /// Noise with a colour beside the white.
    Coloured,
    /// Mains on the displacement, with a third harmonic in every other, on the field in every third.
    Hum,
    /// A line that is no mains.
    Line,
    /// Gain and zero of the measured field.
    Probe,
    /// Gain and zero of the amplifier: the coil gets another field than the record says.
    Readback,
    /// Magnetised before the first row.
    History,
    /// Constants inside effects are others.
    Held,
    /// The effect obeys another law of its kind.
    OtherLaw,
    /// Constants of material and rod are others.
    OffNominal,
    /// A filter before the converter.
    AntiAlias,
    /// Zero and slow drift of the sensor.
    Drift,
    /// All but another law.
    All,
}

impl Nuisance {
    pub const ALL: [Nuisance; 13] = [
        Nuisance::Clean,
        Nuisance::Coloured,
        Nuisance::Hum,
        Nuisance::Line,
        Nuisance::Probe,
        Nuisance::Readback,
        Nuisance::History,
        Nuisance::Held,
        Nuisance::OtherLaw,
        Nuisance::OffNominal,
        Nuisance::AntiAlias,
        Nuisance::Drift,
        Nuisance::All,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Nuisance::Clean => "clean",
            Nuisance::Coloured => "coloured",
            Nuisance::Hum => "hum",
            Nuisance::Line => "line",
            Nuisance::Probe => "probe",
            Nuisance::Readback => "readback",
            Nuisance::History => "history",
            Nuisance::Held => "held",
            Nuisance::OtherLaw => "otherlaw",
            Nuisance::OffNominal => "offnominal",
            Nuisance::AntiAlias => "antialias",
            Nuisance::Drift => "drift",
            Nuisance::All => "all",
        }
    }

    /// Whether `part` is in it.
    fn holds(self, part: Nuisance) -> bool {
        self == part || (self == Nuisance::All && part != Nuisance::OtherLaw)
    }

    /// Whether constants inside effects are drawn.
    pub(crate) fn frees_constants(self) -> bool {
        self.holds(Nuisance::Held)
    }

    /// The rig with it; each part draws as much whether or not it is in it.
    pub(crate) fn disturb(self, rig: &mut Rig, draw: &mut Draw) {
        let white_m = rig.sensor.noise_m;
        let own = &mut rig.surroundings;
        let coloured_m = white_m * draw.between(0.7, 1.6);
        own.colour = draw.between(0.8, 1.3);
        if self.holds(Nuisance::Coloured) {
            own.coloured_m = coloured_m;
        }
        let hum = Tone {
            amplitude: draw.between(8e-9, 30e-9),
            hz: draw.one_of(&[50.0, 50.0, 60.0]) * (1.0 + 1e-3 * draw.between(-1.0, 1.0)),
            phase: draw.phase(),
        };
        let third = Tone {
            amplitude: hum.amplitude * draw.one_of(&[0.0, 1.0]) * draw.between(0.15, 0.6),
            hz: 3.0 * hum.hz,
            phase: draw.phase(),
        };
        let on_field = Tone {
            amplitude: draw.one_of(&[0.0, 0.0, 1.0]) * draw.between(1.0, 5.0),
            hz: hum.hz,
            phase: draw.phase(),
        };
        if self.holds(Nuisance::Hum) {
            (own.tones[0], own.tones[1], own.field_tone) = (hum, third, on_field);
        }
        let line = Tone {
            amplitude: draw.between(8e-9, 30e-9),
            hz: off_mains(draw),
            phase: draw.phase(),
        };
        if self.holds(Nuisance::Line) {
            own.tones[2] = line;
        }
        let probe = [3e-3 * draw.normal(), 4.0 * draw.normal()];
        if self.holds(Nuisance::Probe) {
            own.probe = probe;
        }
        let readback = [2e-3 * draw.normal(), 2.0 * draw.normal()];
        if self.holds(Nuisance::Readback) {
            own.readback = readback;
        }
        let past = Past {
            amplitude_a_per_m: draw.between(3e3, 12e3),
            hz: draw.between(4.0, 20.0),
        };
        if self.holds(Nuisance::History) {
            own.past = Some(past);
        }
        let filter = Filter {
            order: draw.one_of(&[2, 3, 4, 6]),
            corner_hz: draw.log_between(900.0, 3500.0),
            field_too: draw.one_of(&[false, true]),
        };
        if self.holds(Nuisance::AntiAlias) {
            own.filter = Some(filter);
        }
        let (zero_m, drift, settling) = (100e-9 * draw.normal(), draw.between(-1.0, 1.0), draw.between(-1.0, 1.0));
        if self.holds(Nuisance::Drift) {
            own.zero_m = zero_m;
            // Over a run of 4 s up to two noises.
            own.drift_m_per_s = 0.5 * white_m * drift;
            own.settling_m = white_m * settling;
        }
        if self == Nuisance::OtherLaw {
            rig.hidden.laws = Laws::Other;
        }
        let mut off = |share: f64| 1.0 + share * draw.normal().clamp(-2.5, 2.5);
        let (material, rod) = (&mut rig.material, &mut rig.rod);
        let factors = [
            off(0.01),
            off(0.01),
            off(0.03),
            off(0.05),
            off(0.1),
            off(0.03),
            off(0.005),
        ];
        if self.holds(Nuisance::OffNominal) {
            if let Some(law) = &mut rig.law {
                law.magnetization_per_output *= factors[0];
                law.input_per_field /= factors[1];
            } else {
                material.saturation_a_per_m *= factors[0];
            }
            material.shape_a_per_m *= factors[1];
            material.pinning_a_per_m *= factors[2];
            material.reversible_share *= factors[3];
            material.coupling *= factors[4];
            rod.damping_per_s *= factors[5];
            rod.stiffness_per_s2 *= factors[6];
        }
    }
}

/// At least 1.5 Hz from every harmonic of 50 and 60 Hz.
fn off_mains(draw: &mut Draw) -> f64 {
    loop {
        let hz = draw.log_between(8.0, 900.0);
        let away = |mains: f64| (hz - mains * (hz / mains).round()).abs();
        if away(50.0).min(away(60.0)) >= 1.5 {
            return hz;
        }
    }
}
