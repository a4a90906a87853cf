//! Colours by what a series is, so that a role looks the same in every picture.

/// Red, green, blue.
pub(super) type Colour = (u8, u8, u8);

/// Text.
pub(super) const INK: Colour = (34, 34, 34);
/// Axes and ticks.
pub(super) const AXIS: Colour = (110, 110, 110);
/// Grid.
pub(super) const GRID: Colour = (230, 230, 230);
pub(super) const PAPER: Colour = (255, 255, 255);

const BLACK: Colour = (0, 0, 0);
const ORANGE: Colour = (230, 159, 0);
const SKY_BLUE: Colour = (86, 180, 233);
const GREEN: Colour = (0, 158, 115);
const BLUE: Colour = (0, 114, 178);
const VERMILLION: Colour = (213, 94, 0);
const PURPLE: Colour = (204, 121, 167);

const SERIES: [Colour; 7] = [BLUE, ORANGE, GREEN, PURPLE, SKY_BLUE, VERMILLION, BLACK];

/// What a series is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// What the instrument said.
    Measured,
    /// What the model says as it was given.
    Model,
    /// What the model says after it was mended or fitted.
    Amended,
    /// What is known to be right: a simulation's own value, a printed figure.
    Truth,
    /// What is left.
    Residual,
    /// Limits, floors, events.
    Limit,
    /// One of several alike, counted from 0.
    Series(usize),
}

impl Role {
    pub(super) fn colour(self) -> Colour {
        match self {
            Role::Measured => (60, 60, 60),
            Role::Model => VERMILLION,
            Role::Amended => BLUE,
            Role::Truth => GREEN,
            Role::Residual => PURPLE,
            Role::Limit => (120, 120, 120),
            Role::Series(index) => SERIES[index % SERIES.len()],
        }
    }
}
