//! What can be hidden in the actuator, up to the tip and the play behind it; each equation stands in the file that computes it.
//!
//! Sizes are zero where nothing is hidden. Beside them stand the constants inside the effects and the choice between two laws
//! of the same physics; both do nothing while the size is zero.

/// Which law an effect obeys where physics knows more than one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Laws {
    /// One lag, three creeps, tanh of the speed, one play, a limit with an edge.
    #[default]
    Usual,
    /// Diffusion through the section, creep like log t, Dahl's friction, three plays, a round limit.
    Other,
}

/// Numbers inside effects that say how, not how much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constants {
    /// Factor on every time of the creep.
    pub creep_stretch: f64,
    /// v₀, m/s.
    pub friction_speed_m_per_s: f64,
    /// Of the rod, s.
    pub loss_time_s: f64,
    /// Of the coil, s.
    pub coil_loss_time_s: f64,
    /// p of the pinning's growth with the rate.
    pub loss_exponent: f64,
    /// Where the sensor's end begins in its play, −1 to 1.
    pub play_start: f64,
    /// M_r of the ripple, A/m.
    pub ripple_a_per_m: f64,
    /// Middle and width of the bump in the stiffness, m.
    pub bump_m: [f64; 2],
}

impl Constants {
    pub const USUAL: Constants = Constants {
        creep_stretch: 1.0,
        friction_speed_m_per_s: 1e-3,
        loss_time_s: 20.0,
        coil_loss_time_s: 100.0,
        loss_exponent: 0.5,
        play_start: 0.0,
        ripple_a_per_m: 3e4,
        bump_m: [1e-5, 5e-6],
    };
}

/// What is hidden; 0 is absent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hidden {
    /// Pure delay of the command, s.
    pub loop_delay_s: f64,
    /// Largest coil field, A/m.
    pub field_limit_a_per_m: f64,
    /// Largest rate of the coil field, A/(m s).
    pub slew_a_per_m_s: f64,
    /// Warming of the coil at 10 kA/m, K/s.
    pub coil_heating_k_per_s: f64,
    /// τ_A, s.
    pub amplifier_lag_s: f64,
    /// τ_E, s.
    pub eddy_current_s: f64,
    /// H_b, A/m.
    pub bias_a_per_m: f64,
    /// g: growth of the pinning at 1e6 A/(m s).
    pub pinning_growth: f64,
    /// Warming of the rod at 10 kA/m, K/s: it flattens the anhysteretic curve.
    pub rod_heating_k_per_s: f64,
    /// The same where it lengthens the rod.
    pub expanding_heating_k_per_s: f64,
    /// b₃, m²/A².
    pub cubic_coupling: f64,
    /// ρ: share of the walls that move against the field.
    pub relaxing_share: f64,
    /// r: the pinning is this share more on the way up, and less on the way down.
    pub asymmetry: f64,
    /// f: creep's share of the magnetization.
    pub creep: f64,
    /// q: quadratic part of the strain.
    pub quadratic: f64,
    /// r: a ripple of the magnetization, which no library should hold.
    pub ripple: f64,
    /// κ and μ: more stiffness and mass of the load.
    pub more_stiffness: f64,
    pub more_mass: f64,
    /// e: growth of the stiffness with the square of the magnetization.
    pub delta_e: f64,
    /// β, 1/m².
    pub cubic_stiffness_per_m2: f64,
    /// A bump in the stiffness at one place.
    pub bump: f64,
    /// Drag of the square of the speed, 1/m.
    pub drag_per_m: f64,
    /// d: displacement that the dry friction would hold, m.
    pub friction_m: f64,
    /// g: play between the rod and the sensor's end, m.
    pub backlash_m: f64,
    pub constants: Constants,
    pub laws: Laws,
}

impl Hidden {
    pub const NOTHING: Hidden = Hidden {
        loop_delay_s: 0.0,
        field_limit_a_per_m: 0.0,
        slew_a_per_m_s: 0.0,
        coil_heating_k_per_s: 0.0,
        amplifier_lag_s: 0.0,
        eddy_current_s: 0.0,
        bias_a_per_m: 0.0,
        pinning_growth: 0.0,
        rod_heating_k_per_s: 0.0,
        expanding_heating_k_per_s: 0.0,
        cubic_coupling: 0.0,
        relaxing_share: 0.0,
        asymmetry: 0.0,
        creep: 0.0,
        quadratic: 0.0,
        ripple: 0.0,
        more_stiffness: 0.0,
        more_mass: 0.0,
        delta_e: 0.0,
        cubic_stiffness_per_m2: 0.0,
        bump: 0.0,
        drag_per_m: 0.0,
        friction_m: 0.0,
        backlash_m: 0.0,
        constants: Constants::USUAL,
        laws: Laws::Usual,
    };
}

impl Default for Hidden {
    fn default() -> Self {
        Hidden::NOTHING
    }
}
