//! What magnetization is wanted: trajectories, rod feedforward, feedback.
//!
//! All of it works in metres of *quasi-static displacement* p, the displacement that the rod would have if its inertia and
//! damping were nothing: there the plant is a known linear rod behind a known strain law, and gains are plain numbers.

mod anti_windup;
mod complex;
mod controller;
mod effects;
mod feedforward;
mod learner;
mod loop_shape;
mod margins;
mod node;
mod pid;
mod settings;
mod strain_law;
mod trajectory;
mod tuning;

pub use anti_windup::{AntiWindup, Applied};
pub use controller::{Controller, Peak};
pub use feedforward::Feedforward;
pub use learner::{Learner, LearningSettings, Turns};
pub use loop_shape::{LoopShape, MeasuredResponse};
pub use margins::{Largest, LoopPoint, Margins};
pub use pid::{DerivativeOn, Pid, PidOutput, PidSettings};
pub use settings::ControllerSettings;
pub use strain_law::StrainLaw;
pub use trajectory::{
    Course, Lines, Motion, Multisine, MultisineSettings, OnLine, RasterSettings, SawtoothSettings, Scan, Spacing,
    SpeedChange, Step, Steps, StepsSettings, Sweep, Trajectory, TrajectorySettings, TriangleSettings,
};
pub use tuning::change_over_s;
