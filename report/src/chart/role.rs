//! Colours by what a series is, so that a role looks the same in every picture, page and recording.

/// Red, green, blue.
pub(crate) type Colour = (u8, u8, u8);

/// Text.
pub(crate) const INK: Colour = (34, 34, 34);
/// Axes and ticks.
pub(crate) const AXIS: Colour = (110, 110, 110);
/// Grid.
pub(crate) const GRID: Colour = (230, 230, 230);
pub(crate) const PAPER: Colour = (255, 255, 255);

// Okabe and Ito (2008): told apart by people who do not see red and green alike.
const ORANGE: Colour = (230, 159, 0);
const SKY_BLUE: Colour = (86, 180, 233);
const GREEN: Colour = (0, 158, 115);
const BLUE: Colour = (0, 114, 178);
const VERMILLION: Colour = (213, 94, 0);
const PURPLE: Colour = (204, 121, 167);
const BLACK: Colour = (0, 0, 0);

const SERIES: [Colour; 7] = [BLUE, ORANGE, GREEN, PURPLE, SKY_BLUE, VERMILLION, BLACK];
/// What was found is blue, what is a nuisance orange; several of a kind differ in lightness, dark and light in turn.
const EFFECTS: [Colour; 5] = [BLUE, SKY_BLUE, (0, 74, 122), (38, 147, 209), (150, 205, 240)];
const NUISANCES: [Colour; 5] = [ORANGE, (247, 204, 107), (168, 114, 0), (240, 180, 50), (250, 221, 160)];

/// What a series is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// What the instrument said.
    Measured,
    /// What the model says as it was given.
    Nominal,
    /// What the model says after it was mended or fitted.
    Amended,
    /// What one of the effects found adds, counted from 0: shades of the amended model's colour.
    Effect(usize),
    /// What belongs to the measurement, not to the physics (drift, hum, gains, filters), counted from 0.
    Nuisance(usize),
    /// What is left.
    Remainder,
    /// What is known to be right: a simulation's own value, a printed figure.
    Truth,
    /// Limits, floors, events.
    Limit,
    /// One of several alike, counted from 0.
    Series(usize),
}

impl Role {
    pub(crate) fn colour(self) -> Colour {
        match self {
            Role::Measured => (60, 60, 60),
            Role::Nominal => VERMILLION,
            Role::Amended => BLUE,
            Role::Effect(index) => EFFECTS[index % EFFECTS.len()],
            Role::Nuisance(index) => NUISANCES[index % NUISANCES.len()],
            Role::Remainder => PURPLE,
            Role::Truth => GREEN,
            Role::Limit => (120, 120, 120),
            Role::Series(index) => SERIES[index % SERIES.len()],
        }
    }

    /// The same on a dark ground, where what is black or dark blue would not be seen: red, green, blue, opacity.
    pub fn on_dark(self) -> u32 {
        let (red, green, blue) = match self.colour() {
            (60, 60, 60) | BLACK => (225, 229, 233),
            (120, 120, 120) => (156, 163, 175),
            BLUE => (61, 155, 219),
            (0, 74, 122) => (28, 110, 168),
            other => other,
        };
        u32::from_be_bytes([red, green, blue, 255])
    }

    /// Whether white letters are read on it.
    pub(crate) fn is_dark(self) -> bool {
        let (red, green, blue) = self.colour();
        0.3 * f64::from(red) + 0.59 * f64::from(green) + 0.11 * f64::from(blue) < 115.0
    }

    /// As a page writes it: on light ground, on dark.
    pub(crate) fn css(self) -> [String; 2] {
        let (red, green, blue) = self.colour();
        [
            format!("#{red:02x}{green:02x}{blue:02x}"),
            format!("#{:06x}", self.on_dark() >> 8),
        ]
    }
}
