//! From the command to what the sensor looks at, one system of ordinary differential equations:
//!
//! τ_A Ḣ_c = H_d − H_c,   τ_E Ḣ = H_c − H,   τ_i ż_i = M − z_i,
//! M from `material.rs` or `operator.rs` at H + H_b, M' = (M + (f/3) Σ z_i)(1 + r sin(M/M_r)),   Θ̇ = (H_c/H₀)² − Θ/τ,   a = a₀(1 + r_d Θ/T₀),   k = k₀(1 ± r_a)(1 + g(|Ḣ|/R₀)^p),
//! A = w(M' + q M'²/M_s) + ĉ l r_e Θ,   (1 + μ)ü + k̂ u̇ + D u̇|u̇| + (1 + e(M/M_s)²)(ĉ(1 + κ)u − A) + ĉ(β u³ + B(u) + d n) = 0,
//! n = tanh(u̇/v₀),   y ← min(max(y, u − g/2), u + g/2).
//!
//! H_d the amplifier's field (`amplifier.rs`), a straight line within a substep, H_c field in the coil, H in the material, H_b bias (A/m),
//! z_i creep (A/m), Θ rise of the rod at 1 K/s (s), T₀ = 293 K, l = 1.3 μm/K, u tip, y the sensor's end (m), B(u) = b u e^(−((u − u_b)/σ_b)²), w, k̂, ĉ
//! of the rod; sizes of what is hidden: [`Hidden`].
//! The other laws: Ḧ_c of a current loop of second order; H the mean over a cylinder's section, Σ (4/β_n²) z_n with τ_n = 8τ_E/β_n², J₀(β_n) = 0;
//! eight creeps from 5 ms to 50 s; a part of the rod that warms twenty times as fast; ln instead of the power in k; q M'²(1 − M'²/2M_s²);
//! Dahl's friction ṅ = (u̇ − |u̇| n)/z₀ with z₀ = v₀ · 0.5 ms; the mean of plays of half, whole and one and a half times the width.
//! Runge and Kutta, fourth order. The mean error of that against four times as many steps is in `tests/witness.rs`.

use crate::amplifier::{Amplifier, HEATING_FIELD_A_PER_M};
use crate::hidden::{Hidden, Laws};
use crate::material::Material;
use crate::operator::{Law, Memory};

/// Steps of integration a tick.
const SUBSTEPS: usize = 16;
/// A corner cut by steps of h seconds is a lag of up to h²/8 s² of second order, which at 8 a tick shows beside 10 nm of noise.
const SUBSTEPS_OF_CORNERS: usize = 40;
/// Steps of integration within a lag, at least.
const STEPS_A_LAG: f64 = 2.0;
/// Beside it a lag of less than this part of a step is none.
const LEAST_LAG: f64 = 0.4;
/// T₀, K.
const AMBIENT_K: f64 = 293.0;
/// l: 12 ppm/K of the rod, m/K.
const EXPANSION_M_PER_K: f64 = 12e-6 * 1.3724e-2 / 6.4251e7 * 7.65e5 / (1.5 * 1.005e-3);
/// R₀, A/(m s), and where the other law begins.
const LOSS_RATE: f64 = 1e6;
const OTHER_LOSS_RATE: f64 = 1e5;
/// β_n² of the other law's diffusion.
const SKIN: [f64; 4] = [5.783_186, 30.471_262, 74.887_007, 139.040_284];
/// Damping ratio of the other current loop.
const LOOP_DAMPING: f64 = 0.7;
/// Fastest motion that the steps must follow, m/s.
const FASTEST: f64 = 0.05;
/// The part of the rod that warms fast, and how much faster.
const FAST_PART: f64 = 0.4;
const FAST_RATIO: f64 = 20.0;
/// z₀/v₀, s.
const DAHL_S: f64 = 5e-4;

/// The two poles of the rod.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rod {
    /// w, m/s² per A/m.
    pub gain: f64,
    /// k̂, 1/s.
    pub damping_per_s: f64,
    /// ĉ, 1/s².
    pub stiffness_per_s2: f64,
    /// No rod: u = wA/ĉ at once, whatever would act on it.
    pub follows_at_once: bool,
}

impl Rod {
    /// As printed below the paper's (13).
    pub const PRINTED: Rod = Rod {
        gain: 1.3724e-2,
        damping_per_s: 7889.9,
        stiffness_per_s2: 6.4251e7,
        follows_at_once: false,
    };
}

const COIL: usize = 0;
const COIL_RATE: usize = 1;
const FIELD: usize = 2;
const IRREVERSIBLE: usize = 6;
const CREEP: usize = 7;
const TIP: usize = 15;
const SPEED: usize = 16;
const BRISTLE: usize = 17;
const WARM: usize = 18;
const WARM_FAST: usize = 19;
const STATES: usize = 20;
type State = [f64; STATES];

/// An actuator in motion: at rest and demagnetised at first.
#[derive(Clone, Debug)]
pub struct Plant {
    material: Material,
    rod: Rod,
    hidden: Hidden,
    tick_s: f64,
    substeps: usize,
    state: State,
    amplifier: Amplifier,
    /// Time and share of every creep.
    creeps: Vec<(f64, f64)>,
    bias: f64,
    plays_m: [f64; 3],
    /// In the place of the material.
    law: Option<Memory>,
}

/// A straight line within a substep, and its slope.
#[derive(Clone, Copy)]
struct Line {
    from: f64,
    rate: f64,
}

impl Line {
    fn between(from: f64, to: f64, h: f64) -> Self {
        Line {
            from,
            rate: (to - from) / h,
        }
    }

    fn at(self, time_s: f64) -> f64 {
        self.from + self.rate * time_s
    }
}

/// What acts from outside within a substep of `h` seconds.
#[derive(Clone, Copy)]
struct Inputs {
    drive: Line,
    shape: Line,
    bias: Line,
    h: f64,
    /// M of another law at begin, middle and end.
    law_a_per_m: Option<[f64; 3]>,
}

impl Plant {
    pub fn new(material: Material, rod: Rod, hidden: Hidden, tick_s: f64) -> Self {
        let own = &hidden.constants;
        let creeps = match hidden.laws {
            Laws::Usual => [0.03, 0.3, 3.0].map(|time_s| (time_s, hidden.creep / 3.0)).to_vec(),
            // As much a decade: four decades on eight places.
            Laws::Other => (0..8)
                .map(|i| {
                    (
                        5e-3 * 10_f64.powf(4.0 / 7.0 * f64::from(i)),
                        hidden.creep / 3.0 * 4.0 / 7.0,
                    )
                })
                .collect(),
        };
        Plant {
            material: material.stressed(hidden.cubic_coupling),
            rod,
            hidden,
            tick_s,
            substeps: SUBSTEPS,
            state: [0.0; STATES],
            amplifier: Amplifier::new(&hidden, tick_s),
            creeps: creeps
                .into_iter()
                .filter(|_| hidden.creep > 0.0)
                .map(|(time_s, share)| (time_s * own.creep_stretch, share))
                .collect(),
            bias: 0.0,
            plays_m: play_widths(&hidden).map(|width| 0.5 * width * own.play_start),
            law: None,
        }
        .with_substeps(SUBSTEPS)
    }

    /// With a law in the place of the material, whose curves then count for nothing; its saturation still is what M is measured by.
    pub fn with_law(self, law: Option<Law>) -> Self {
        Plant {
            law: law.map(Memory::new),
            ..self
        }
    }

    /// With at least so many steps of integration a tick; more where friction, a short lag, or a delay needs them, behind which the command's
    /// corners come within a step, which cuts them.
    pub fn with_substeps(self, substeps: usize) -> Self {
        let hidden = &self.hidden;
        let speed = hidden.constants.friction_speed_m_per_s;
        let lags = [hidden.eddy_current_s, hidden.amplifier_lag_s];
        let lag_per_s = lags
            .into_iter()
            .filter(|lag_s| *lag_s > 0.0)
            .map(|lag_s| STEPS_A_LAG / lag_s);
        let friction_per_s = match (hidden.friction_m > 0.0, hidden.laws) {
            (false, _) => 0.0,
            (true, Laws::Usual) => self.rod.stiffness_per_s2 * hidden.friction_m / speed,
            (true, Laws::Other) => FASTEST / (speed * DAHL_S),
        };
        let fastest_per_s = lag_per_s.fold(friction_per_s, f64::max);
        let corners = if hidden.loop_delay_s > 0.0 {
            SUBSTEPS_OF_CORNERS
        } else {
            0
        };
        Plant {
            substeps: substeps.max((self.tick_s * fastest_per_s).ceil() as usize).max(corners),
            ..self
        }
    }

    pub fn substeps(&self) -> usize {
        self.substeps
    }

    /// Seconds between the points that [`Plant::advance`] shows.
    pub fn substep_s(&self) -> f64 {
        self.tick_s / self.substeps as f64
    }

    /// Goes on by a tick, at whose end command (A/m) and `a` (A/m) are these; each is a straight line until then. `look` is taken after
    /// every substep. The bias comes up over the first tick.
    pub fn advance(&mut self, command: f64, shape: f64, look: &mut dyn FnMut(&Self)) {
        let (h, shape_from, bias_from) = (self.substep_s(), self.material.shape_a_per_m, self.bias);
        self.amplifier.hear(command);
        let substeps = self.substeps;
        let part = |from: f64, to: f64, substep: usize| {
            let at = |steps: usize| from + (to - from) * steps as f64 / substeps as f64;
            Line::between(at(substep), at(substep + 1), h)
        };
        for substep in 0..self.substeps {
            let left = (self.substeps - substep - 1) as f64 / self.substeps as f64;
            let (from, to) = self.amplifier.line(&self.hidden, left, h);
            let mut inputs = Inputs {
                drive: Line::between(from, to, h),
                shape: part(shape_from, shape, substep),
                bias: part(bias_from, self.hidden.bias_a_per_m, substep),
                h,
                law_a_per_m: None,
            };
            self.magnetize(&mut inputs);
            self.state = self.ahead(&inputs);
            let tip = self.state[TIP];
            for (end, width) in self.plays_m.iter_mut().zip(play_widths(&self.hidden)) {
                *end = end.max(tip - 0.5 * width).min(tip + 0.5 * width);
            }
            look(self);
        }
        self.material.shape_a_per_m = shape;
        self.bias = self.hidden.bias_a_per_m;
    }

    /// What another law makes of the way of the field, which nothing behind it acts back on.
    fn magnetize(&mut self, inputs: &mut Inputs) {
        let Some(mut law) = self.law.take() else { return };
        let (h, mut ignored) = (inputs.h, [0.0; STATES]);
        inputs.law_a_per_m = Some([law.magnetization_a_per_m(); 3]);
        let (_, from, from_rate) = self.field(&self.state, inputs, 0.0, &mut ignored);
        let (_, to, to_rate) = self.field(&self.ahead(inputs), inputs, h, &mut ignored);
        // The cubic through both ends.
        let middle = 0.5 * (from + to) + 0.125 * h * (from_rate - to_rate);
        let begin = law.magnetization_a_per_m();
        inputs.law_a_per_m = Some([begin, law.go(middle, 0.5 * h), law.go(to, 0.5 * h)]);
        self.law = Some(law);
    }

    /// The state a substep on.
    fn ahead(&self, inputs: &Inputs) -> State {
        let (x, h) = (self.state, inputs.h);
        let (k1, _) = self.rates(&x, inputs, 0.0);
        let (k2, _) = self.rates(&moved(&x, &k1, 0.5 * h), inputs, 0.5 * h);
        let (k3, _) = self.rates(&moved(&x, &k2, 0.5 * h), inputs, 0.5 * h);
        let (k4, _) = self.rates(&moved(&x, &k3, h), inputs, h);
        let mut ahead: State = std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        // Where there is no lag the state follows exactly.
        if self.hidden.amplifier_lag_s == 0.0 {
            ahead[COIL] = inputs.drive.at(h);
        }
        if self.rod.follows_at_once {
            (ahead[TIP], ahead[SPEED]) = (self.rates(&ahead, inputs, h).1, 0.0);
        }
        ahead
    }

    /// Fields in the coil and in the material, and the rate of the latter; with the rates of what they follow from.
    fn field(&self, x: &State, inputs: &Inputs, time_s: f64, rates: &mut State) -> (f64, f64, f64) {
        let drive = inputs.drive.at(time_s);
        let coil = match (self.hidden.amplifier_lag_s > 0.0, self.hidden.laws) {
            (false, _) => {
                rates[COIL] = inputs.drive.rate;
                drive
            }
            (true, Laws::Usual) => {
                rates[COIL] = (drive - x[COIL]) / self.hidden.amplifier_lag_s;
                x[COIL]
            }
            (true, Laws::Other) => {
                let angular = 2.0 * LOOP_DAMPING / self.hidden.amplifier_lag_s;
                rates[COIL] = x[COIL_RATE];
                rates[COIL_RATE] = angular * (angular * (drive - x[COIL]) - 2.0 * LOOP_DAMPING * x[COIL_RATE]);
                x[COIL]
            }
        };
        let (inside, inside_rate) = self.inside(x, (coil, rates[COIL]), inputs.h, rates);
        (coil, inside + inputs.bias.at(time_s), inside_rate + inputs.bias.rate)
    }

    /// Of the state; and where the tip would rest that nothing but A acts on, m.
    fn rates(&self, x: &State, inputs: &Inputs, time_s: f64) -> (State, f64) {
        let (hidden, own, rod) = (&self.hidden, &self.hidden.constants, &self.rod);
        let usual = hidden.laws == Laws::Usual;
        let mut rates = [0.0; STATES];

        let (coil, field, field_rate) = self.field(x, inputs, time_s, &mut rates);
        rates[WARM] = (coil / HEATING_FIELD_A_PER_M).powi(2) - x[WARM] / own.loss_time_s;
        rates[WARM_FAST] = (coil / HEATING_FIELD_A_PER_M).powi(2) - x[WARM_FAST] * FAST_RATIO / own.loss_time_s;
        let warm = if usual {
            x[WARM]
        } else {
            (1.0 - FAST_PART) * x[WARM] + FAST_PART * x[WARM_FAST]
        };

        let material = Material {
            shape_a_per_m: inputs.shape.at(time_s) * (1.0 + hidden.rod_heating_k_per_s * warm / AMBIENT_K),
            pinning_a_per_m: self.material.pinning_a_per_m * self.pinning_factor(field_rate),
            ..self.material
        };
        let m = if let Some(law) = inputs.law_a_per_m {
            law[(2.0 * time_s / inputs.h).round() as usize]
        } else {
            let (m, anhysteretic) = material.magnetization(field, x[IRREVERSIBLE]);
            rates[IRREVERSIBLE] =
                material.irreversible_rate((m, anhysteretic), x[IRREVERSIBLE], field_rate, hidden.relaxing_share);
            m
        };
        let mut driving = m;
        for (place, (time_s, share)) in (CREEP..).zip(&self.creeps) {
            rates[place] = (m - x[place]) / time_s;
            driving += share * x[place];
        }
        if hidden.ripple != 0.0 {
            driving *= 1.0 + hidden.ripple * (m / own.ripple_a_per_m).sin();
        }

        let relative = driving / material.saturation_a_per_m;
        let rounded = if usual { 1.0 } else { 1.0 - 0.5 * relative * relative };
        let strained = driving * (1.0 + hidden.quadratic * relative * rounded);
        let (u, speed) = (x[TIP], x[SPEED]);
        let lengthened = EXPANSION_M_PER_K * hidden.expanding_heating_k_per_s * warm;
        let pulling = rod.gain * strained + rod.stiffness_per_s2 * lengthened;
        let stiffer = 1.0 + hidden.delta_e * relative * relative;
        let held = if usual {
            (speed / own.friction_speed_m_per_s).tanh()
        } else {
            rates[BRISTLE] = (speed - speed.abs() * x[BRISTLE]) / (own.friction_speed_m_per_s * DAHL_S);
            x[BRISTLE]
        };
        let bump = if hidden.bump == 0.0 {
            0.0
        } else {
            hidden.bump * u * (-((u - own.bump_m[0]) / own.bump_m[1]).powi(2)).exp()
        };
        let force = rod.damping_per_s * speed
            + hidden.drag_per_m * speed * speed.abs()
            + stiffer * (rod.stiffness_per_s2 * (1.0 + hidden.more_stiffness) * u - pulling)
            + rod.stiffness_per_s2 * (hidden.cubic_stiffness_per_m2 * u * u * u + bump + hidden.friction_m * held);
        rates[TIP] = speed;
        rates[SPEED] = -force / (1.0 + hidden.more_mass);
        (rates, pulling / rod.stiffness_per_s2)
    }

    /// Field in the material and its rate behind the eddy currents.
    fn inside(&self, x: &State, (coil, coil_rate): (f64, f64), h: f64, rates: &mut State) -> (f64, f64) {
        let lag_s = self.hidden.eddy_current_s;
        if lag_s == 0.0 {
            rates[FIELD] = coil_rate;
            return (coil, coil_rate);
        }
        if self.hidden.laws == Laws::Usual {
            rates[FIELD] = (coil - x[FIELD]) / lag_s;
            return (x[FIELD], rates[FIELD]);
        }
        // What the first shells do not carry is thin and follows at once.
        let (mut field, mut rate) = (coil, coil_rate);
        for (place, square) in (FIELD..).zip(SKIN) {
            let (weight, own_s) = (4.0 / square, 8.0 * lag_s / square);
            if own_s > LEAST_LAG * h {
                rates[place] = (coil - x[place]) / own_s;
                field += weight * (x[place] - coil);
                rate += weight * (rates[place] - coil_rate);
            }
        }
        (field, rate)
    }

    fn pinning_factor(&self, field_rate: f64) -> f64 {
        let hidden = &self.hidden;
        let mut factor = 1.0 + hidden.asymmetry * field_rate.signum();
        if hidden.pinning_growth > 0.0 {
            let rate = field_rate.abs();
            factor *= 1.0
                + hidden.pinning_growth
                    * match hidden.laws {
                        Laws::Usual => (rate / LOSS_RATE).powf(hidden.constants.loss_exponent),
                        Laws::Other => (rate / OTHER_LOSS_RATE).ln_1p() / (LOSS_RATE / OTHER_LOSS_RATE).ln_1p(),
                    };
        }
        factor
    }

    /// Field in the coil, A/m.
    pub fn coil_field_a_per_m(&self) -> f64 {
        self.state[COIL]
    }

    /// M without creep, A/m.
    pub fn magnetization_a_per_m(&self) -> f64 {
        if let Some(law) = &self.law {
            return law.magnetization_a_per_m();
        }
        let mut ignored = [0.0; STATES];
        let (field, _) = self.inside(&self.state, (self.state[COIL], 0.0), self.substep_s(), &mut ignored);
        self.material
            .magnetization(field + self.bias, self.state[IRREVERSIBLE])
            .0
    }

    /// u, m.
    pub fn tip_m(&self) -> f64 {
        self.state[TIP]
    }

    /// y, m.
    pub fn sensed_m(&self) -> f64 {
        match self.hidden.laws {
            Laws::Usual => self.plays_m[1],
            Laws::Other => self.plays_m.iter().sum::<f64>() / 3.0,
        }
    }
}

/// The middle one is the usual law's.
fn play_widths(hidden: &Hidden) -> [f64; 3] {
    [0.5, 1.0, 1.5].map(|share| share * hidden.backlash_m)
}

fn moved(x: &State, rates: &State, h: f64) -> State {
    std::array::from_fn(|i| x[i] + h * rates[i])
}
