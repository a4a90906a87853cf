//! From the command to what the sensor looks at, one system of ordinary differential equations:
//!
//! τ_A Ḣ_c = H_u − H_c,   τ_E Ḣ = H_c − H,   M from `material.rs`,   τ_i ż_i = M − z_i,   M' = (M + (f/3) Σ z_i)(1 + r sin(M/M_r)),
//! ü + k̂ u̇ + ĉ u = w M' − ĉ d tanh(u̇/v₀),   y ← min(max(y, u − g/2), u + g/2).
//!
//! H_u command, a straight line within a tick, H_c field in the coil, H in the material (A/m), z_i creep (A/m), u tip, y the
//! sensor's end (m), w, k̂, ĉ of the rod; the rest is what can be hidden, see [`Hidden`]. Runge and Kutta, fourth order,
//! `SUBSTEPS` a tick. The mean error of that against four times as many is in `tests/witness.rs`.

use crate::material::Material;

/// Steps of integration a tick.
const SUBSTEPS: usize = 16;
/// τ_i, s.
const CREEP_S: [f64; 3] = [0.03, 0.3, 3.0];
/// v₀, m/s.
const FRICTION_SPEED: f64 = 1e-3;
/// M_r, A/m.
const RIPPLE_A_PER_M: f64 = 3e4;

/// The two poles of the rod.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rod {
    /// w, m/s² per A/m.
    pub gain: f64,
    /// k̂, 1/s.
    pub damping_per_s: f64,
    /// ĉ, 1/s².
    pub stiffness_per_s2: f64,
}

impl Rod {
    /// As printed below the paper's (13).
    pub const PRINTED: Rod = Rod {
        gain: 1.3724e-2,
        damping_per_s: 7889.9,
        stiffness_per_s2: 6.4251e7,
    };
}

/// What can be hidden in the actuator; 0 is absent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hidden {
    /// τ_A, s.
    pub amplifier_lag_s: f64,
    /// τ_E, s.
    pub eddy_current_s: f64,
    /// f: creep's share of the magnetization.
    pub creep: f64,
    /// d: displacement that the dry friction would hold, m.
    pub friction_m: f64,
    /// g: play between the rod and the sensor's end, m.
    pub backlash_m: f64,
    /// r: a ripple of the magnetization, which no library should hold.
    pub ripple: f64,
}

const COIL: usize = 0;
const FIELD: usize = 1;
const IRREVERSIBLE: usize = 2;
const CREEP: usize = 3;
const TIP: usize = 6;
const SPEED: usize = 7;
type State = [f64; 8];

/// An actuator in motion: at rest and demagnetised at first.
#[derive(Clone, Debug)]
pub struct Plant {
    material: Material,
    rod: Rod,
    hidden: Hidden,
    tick_s: f64,
    substeps: usize,
    state: State,
    command: f64,
    sensed_m: f64,
}

impl Plant {
    pub fn new(material: Material, rod: Rod, hidden: Hidden, tick_s: f64) -> Self {
        Plant {
            material,
            rod,
            hidden,
            tick_s,
            substeps: SUBSTEPS,
            state: State::default(),
            command: 0.0,
            sensed_m: 0.0,
        }
    }

    /// With so many steps of integration a tick.
    pub fn with_substeps(self, substeps: usize) -> Self {
        Plant { substeps, ..self }
    }

    /// Seconds between the points that [`Plant::advance`] shows.
    pub fn substep_s(&self) -> f64 {
        self.tick_s / self.substeps as f64
    }

    /// Goes on by a tick, at whose end command (A/m) and `a` (A/m) are these; each is a straight line until then. `seen` hears
    /// the sensor's end (m) after every substep.
    pub fn advance(&mut self, command: f64, shape: f64, seen: &mut dyn FnMut(f64)) {
        let (from, shape_from) = (self.command, self.material.shape_a_per_m);
        let (rate, h) = ((command - from) / self.tick_s, self.substep_s());
        for substep in 0..self.substeps {
            let at = |part: f64| {
                let share = (substep as f64 + part) / self.substeps as f64;
                (
                    from + (command - from) * share,
                    shape_from + (shape - shape_from) * share,
                )
            };
            let x = self.state;
            let k1 = self.rates(&x, at(0.0), rate);
            let k2 = self.rates(&moved(&x, &k1, 0.5 * h), at(0.5), rate);
            let k3 = self.rates(&moved(&x, &k2, 0.5 * h), at(0.5), rate);
            let k4 = self.rates(&moved(&x, &k3, h), at(1.0), rate);
            self.state = std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
            let half = 0.5 * self.hidden.backlash_m;
            self.sensed_m = self.sensed_m.max(self.state[TIP] - half).min(self.state[TIP] + half);
            seen(self.sensed_m);
        }
        (self.command, self.material.shape_a_per_m) = (command, shape);
    }

    fn rates(&self, x: &State, (command, shape): (f64, f64), command_rate: f64) -> State {
        let hidden = &self.hidden;
        let material = Material {
            shape_a_per_m: shape,
            ..self.material
        };
        let (coil, coil_rate) = lagged(x[COIL], command, command_rate, hidden.amplifier_lag_s);
        let (field, field_rate) = lagged(x[FIELD], coil, coil_rate, hidden.eddy_current_s);
        let (m, anhysteretic) = material.magnetization(field, x[IRREVERSIBLE]);
        let creep = &x[CREEP..TIP];
        let seen = m + hidden.creep / 3.0 * creep.iter().sum::<f64>();
        let driving = seen * (1.0 + hidden.ripple * (m / RIPPLE_A_PER_M).sin());
        let held = x[TIP] + hidden.friction_m * (x[SPEED] / FRICTION_SPEED).tanh();
        let rod = &self.rod;
        [
            coil_rate,
            field_rate,
            material.irreversible_rate(anhysteretic, x[IRREVERSIBLE], field_rate),
            (m - creep[0]) / CREEP_S[0],
            (m - creep[1]) / CREEP_S[1],
            (m - creep[2]) / CREEP_S[2],
            x[SPEED],
            rod.gain * driving - rod.damping_per_s * x[SPEED] - rod.stiffness_per_s2 * held,
        ]
    }

    /// Field in the coil, A/m.
    pub fn coil_field_a_per_m(&self) -> f64 {
        self.state[COIL]
    }

    /// M, A/m.
    pub fn magnetization_a_per_m(&self) -> f64 {
        self.material
            .magnetization(self.state[FIELD], self.state[IRREVERSIBLE])
            .0
    }

    /// u, m.
    pub fn tip_m(&self) -> f64 {
        self.state[TIP]
    }

    /// y, m.
    pub fn sensed_m(&self) -> f64 {
        self.sensed_m
    }
}

/// A first-order lag behind an input, and its rate; the input itself where there is no lag.
fn lagged(own: f64, input: f64, input_rate: f64, lag_s: f64) -> (f64, f64) {
    if lag_s > 0.0 {
        (own, (input - own) / lag_s)
    } else {
        (input, input_rate)
    }
}

fn moved(x: &State, rates: &State, h: f64) -> State {
    std::array::from_fn(|i| x[i] + h * rates[i])
}
