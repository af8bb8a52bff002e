//! The motion that a tool prescribes to the clamp of a filament.

use crate::equations::linear::{add, scale};
use crate::equations::{Clamp, sin_cos};

/// How the clamp moves. Another mounting changes this, and nothing else.
pub trait ClampMotion {
    /// Position, direction and their derivatives at `time` in s.
    fn at(&self, time: f64) -> Clamp<f64>;
}

/// A clamp at rest at the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixedClamp {
    /// Unit vector `e_0` along which it holds the filament.
    pub direction: [f64; 3],
}

impl ClampMotion for FixedClamp {
    fn at(&self, _: f64) -> Clamp<f64> {
        Clamp {
            position: [0.0; 3],
            velocity: [0.0; 3],
            acceleration: [0.0; 3],
            direction: self.direction,
            direction_rate: [0.0; 3],
        }
    }
}

/// A round tool that turns about `z` at a constant rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundTool {
    /// Radius `r_g` of the brush body in m.
    pub body_radius: f64,
    /// Rate `ω` in rad/s.
    pub rate: f64,
    /// Angle `β` at time zero in rad.
    pub initial_angle: f64,
}

impl RoundTool {
    /// `β` at `time`.
    pub fn angle(&self, time: f64) -> f64 {
        self.initial_angle + self.rate * time
    }
}

impl ClampMotion for RoundTool {
    fn at(&self, time: f64) -> Clamp<f64> {
        radial_clamp(self.body_radius, self.angle(time), self.rate, 0.0)
    }
}

/// The clamp of a radial filament: `r_0 = r_g e_0`, `e_0 = (cos β, sin β, 0)`, at the angle `β` (rad), rate `β̇` and
/// acceleration `β̈` of the body.
pub fn radial_clamp(body_radius: f64, angle: f64, rate: f64, acceleration: f64) -> Clamp<f64> {
    let (sin, cos) = sin_cos(angle);
    let (radial, tangential) = ([cos, sin, 0.0], [-sin, cos, 0.0]);
    let direction_rate = scale(rate, tangential);
    let direction_acceleration = add(scale(acceleration, tangential), scale(-rate * rate, radial));
    Clamp {
        position: scale(body_radius, radial),
        velocity: scale(body_radius, direction_rate),
        acceleration: scale(body_radius, direction_acceleration),
        direction: radial,
        direction_rate,
    }
}
