//! Tools: mounting of a filament, and motion of its clamp.
//!
//! A [`Tool`] is geometry: the clamp with the tool body at a given angle. [`Turning`] sets it in
//! motion. [`RotaryTool`] is the tool of the settings, and a [`SampledTool`] has any motion;
//! implement [`Tool`] for another mounting, and pass it to
//! [`Pass::with`](crate::simulation::Pass::with).

mod sampled;

pub use sampled::{SampledTool, SamplesError};

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::equations::dispatch::{Loop, dispatch};
use crate::equations::linear::{add, scale};
use crate::equations::{Clamp, Lanewise, PolarAxis, find_pole, sin_cos};
use crate::model::passage::part_left;
pub use crate::model::pose::Pose;
use crate::model::settings::Settings;
pub use crate::model::trim::{Place, Trim, places};

/// Motion of a clamp. A filament system needs no more than this.
pub trait ClampMotion {
    /// Returns position, direction and their derivatives at `time` in s.
    fn at(&self, time: f64) -> Clamp<f64>;

    /// Computes [`ClampMotion::at`] for several clamps, one per lane of `times`. In each lane the
    /// result must have the same bits.
    fn in_lanes<'a, T: Lanewise>(clamp: impl Fn(usize) -> &'a Self, times: T) -> Clamp<T>
    where
        Self: Sized + 'a,
    {
        Clamp::from_lanes(|lane| clamp(lane).at(times.lane(lane)))
    }
}

/// A tool that turns about `z`, and the clamp of one of its filaments.
///
/// ```
/// use bristle::equations::Clamp;
/// use bristle::tool::{RotaryTool, Tool};
///
/// /// A round tool whose filaments trail: each leans back from the radius by a trim angle.
/// #[derive(Clone, Debug)]
/// struct Trimmed {
///     body: RotaryTool,
///     trim_angle: f64,
/// }
///
/// impl Tool for Trimmed {
///     fn clamp(&self, angle: f64, rate: f64) -> Clamp<f64> {
///         let (clamp, trimmed) = (self.body.clamp(angle, rate), self.body.clamp(angle - self.trim_angle, rate));
///         Clamp { direction: trimmed.direction, direction_rate: trimmed.direction_rate, ..clamp }
///     }
///
///     fn radius(&self, filament_length: f64) -> f64 {
///         let (r, l) = (self.body.root_radius, filament_length);
///         (r * r + l * l + 2.0 * r * l * self.trim_angle.cos()).sqrt()
///     }
/// }
/// ```
pub trait Tool {
    /// Returns the clamp with the body at `angle` (`β` in rad), turning at the constant `rate` (`ω`
    /// in rad/s).
    fn clamp(&self, angle: f64, rate: f64) -> Clamp<f64>;

    /// Computes [`Tool::clamp`] for several tools, one per lane. In each lane the result must have
    /// the same bits.
    fn in_lanes<'a, T: Lanewise>(tool: impl Fn(usize) -> &'a Self, angles: T, rates: T) -> Clamp<T>
    where
        Self: Sized + 'a,
    {
        Clamp::from_lanes(|lane| tool(lane).clamp(angles.lane(lane), rates.lane(lane)))
    }

    /// Returns the undeformed radius `R` in m with filaments of the free length `filament_length`
    /// (m): the distance of the tips from the axis. The brushing velocity is `v_b = ω R`.
    fn radius(&self, filament_length: f64) -> f64;

    /// Returns `true` if the clamp stays in the plane `z = 0` at every angle: `z` of its position
    /// and of its direction is zero. On a [planar
    /// workpiece](crate::workpiece::Workpiece::is_planar) its filament is then simulated in that
    /// plane.
    ///
    /// The default is `false`, which is always right.
    fn is_planar(&self) -> bool {
        false
    }

    /// Returns the undeformed filament with the body at `angle` (rad), turning at `rate` (rad/s):
    /// `[φ, θ]` about `z` in rad of all its segments, and their rates in rad/s.
    ///
    /// The default reads them off [`Tool::clamp`]. A tool that knows them can state them exactly.
    fn undeformed(&self, angle: f64, rate: f64) -> [[f64; 2]; 2] {
        let Clamp {
            direction,
            direction_rate,
            ..
        } = self.clamp(angle, rate);
        let [q, v, _] = PolarAxis::Z.coordinates([direction, direction_rate, [0.0; 3]]);
        if find_pole(&[q]).is_none() {
            return [q, v];
        }
        // At the pole the azimuth is that of the motion, and has no rate.
        let [x, y, _] = direction_rate;
        [[q[0], y.atan2(x)], [x.hypot(y) * q[0].cos(), 0.0]]
    }
}

/// A tool that turns at a constant rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turning<T> {
    /// Tool.
    pub tool: T,
    /// Rate `ω` in rad/s.
    pub rate: f64,
    /// Angle `β` at time zero in rad.
    pub initial_angle: f64,
}

impl<T> Turning<T> {
    /// Returns `β` at `time` (s), in rad.
    pub fn angle(&self, time: f64) -> f64 {
        self.initial_angle + self.rate * time
    }
}

impl<T: Tool> ClampMotion for Turning<T> {
    fn at(&self, time: f64) -> Clamp<f64> {
        self.tool.clamp(self.angle(time), self.rate)
    }

    fn in_lanes<'a, L: Lanewise>(clamp: impl Fn(usize) -> &'a Self, times: L) -> Clamp<L>
    where
        T: 'a,
    {
        let angles = L::from_lanes(|lane| clamp(lane).angle(times.lane(lane)));
        T::in_lanes(
            |lane| &clamp(lane).tool,
            angles,
            L::from_lanes(|lane| clamp(lane).rate),
        )
    }
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
            angular_velocity: [0.0; 3],
        }
    }
}

/// Tool of the settings, in its own frame: one filament of a trim that turns about `z` (MODEL,
/// "Rotary tools of any kind and pose").
///
/// Its root is at `r_0 = r ρ̂ + z ẑ`, and the clamp holds it along `e_0 = cos ε ρ̂ + sin ε ẑ`,
/// where `ε` is the sum of elevation and lateral tilt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotaryTool {
    /// Distance `r` of the root from the axis in m.
    pub root_radius: f64,
    /// `z` of the root in m.
    pub height: f64,
    /// Angle of the undeformed filament out of the plane of rotation, towards `+z`, in rad: `π/2 −
    /// γ`.
    pub elevation: f64,
    /// Additional tilt `τ` of the clamp in the same sense, in rad: an imperfection.
    pub lateral_tilt: f64,
    /// Angle of the tool in rad at which the clamp of a radial filament leans by [`LEAN`] against
    /// the rotation; over the turn from there on it comes upright. `None` if it is so always.
    pub leans_from: Option<f64>,
}

/// Lean in rad of a straight filament that would buckle to either side (MODEL, "A bore narrower than
/// the brush").
pub const LEAN: f64 = 1e-3;

impl RotaryTool {
    /// Creates a radial filament in the plane of rotation, on a body of `body_radius` (m).
    pub const fn radial(body_radius: f64) -> Self {
        Self {
            root_radius: body_radius,
            height: 0.0,
            elevation: 0.0,
            lateral_tilt: 0.0,
            leans_from: None,
        }
    }

    /// Creates the filament in the middle of the trim that `settings` state.
    pub fn of(settings: &Settings) -> Self {
        Self::at(settings, 0.0)
    }

    /// Creates the filament at the place `s` (m) of the trim.
    pub fn at(settings: &Settings, s: f64) -> Self {
        let trim = Trim::of(settings);
        let [root_radius, height] = trim.root(s);
        let lateral_tilt = settings.filament.lateral_tilt_rad;
        Self {
            root_radius,
            height,
            elevation: trim.elevation,
            lateral_tilt,
            leans_from: None,
        }
    }

    /// Returns the angle in rad by which the clamp is ahead of the root at the `angle` of the tool (rad), and
    /// its derivative.
    fn ahead(&self, angle: f64) -> [f64; 2] {
        self.leans_from.map_or([0.0; 2], |from| {
            let [left, slope] = part_left((angle - from) / TAU);
            [-LEAN * left, -LEAN * slope / TAU]
        })
    }

    /// Returns the angle `ε` of the clamp out of the plane of rotation in rad.
    fn inclination(&self) -> f64 {
        self.elevation + self.lateral_tilt
    }
}

impl Tool for RotaryTool {
    fn clamp(&self, angle: f64, rate: f64) -> Clamp<f64> {
        let mut clamp = radial_clamp(self.root_radius, angle, rate, 0.0);
        if self.leans_from.is_some() {
            let [ahead, slope] = self.ahead(angle);
            let Clamp {
                direction,
                direction_rate,
                angular_velocity,
                ..
            } = radial_clamp(self.root_radius, angle + ahead, rate * (1.0 + slope), 0.0);
            clamp = Clamp {
                direction,
                direction_rate,
                angular_velocity,
                ..clamp
            };
        }
        if self.is_planar() {
            return clamp;
        }
        let (sin, cos) = sin_cos(self.inclination());
        let ([x, y, _], [root_x, root_y, _]) = (clamp.direction, clamp.position);
        Clamp {
            position: [root_x, root_y, self.height],
            direction: [cos * x, cos * y, sin],
            direction_rate: scale(cos, clamp.direction_rate),
            ..clamp
        }
    }

    fn in_lanes<'a, T: Lanewise>(
        tool: impl Fn(usize) -> &'a Self,
        angles: T,
        rates: T,
    ) -> Clamp<T> {
        let is_radial = |lane| tool(lane).inclination() == 0.0 && tool(lane).leans_from.is_none();
        if !(0..T::LANES).all(is_radial) {
            return Clamp::from_lanes(|lane| tool(lane).clamp(angles.lane(lane), rates.lane(lane)));
        }
        let clamp = dispatch(RadialClamp {
            body_radius: T::from_lanes(|lane| tool(lane).root_radius),
            angle: angles,
            rate: rates,
            acceleration: T::ZERO,
        });
        let [x, y, _] = clamp.position;
        Clamp {
            position: [x, y, T::from_lanes(|lane| tool(lane).height)],
            ..clamp
        }
    }

    fn radius(&self, filament_length: f64) -> f64 {
        self.root_radius + filament_length * sin_cos(self.elevation).1
    }

    fn is_planar(&self) -> bool {
        self.inclination() == 0.0 && self.height == 0.0
    }

    fn undeformed(&self, angle: f64, rate: f64) -> [[f64; 2]; 2] {
        let [ahead, slope] = self.ahead(angle);
        [
            [FRAC_PI_2 - self.inclination(), angle + ahead],
            [0.0, rate * (1.0 + slope)],
        ]
    }
}

/// Returns the clamp of a radial filament: `r_0 = r_g e_0`, `e_0 = (cos β, sin β, 0)`, at the angle
/// `β` (rad), rate `β̇` and acceleration `β̈` of the body.
pub fn radial_clamp(body_radius: f64, angle: f64, rate: f64, acceleration: f64) -> Clamp<f64> {
    RadialClamp {
        body_radius,
        angle,
        rate,
        acceleration,
    }
    .run()
}

/// Arguments of [`radial_clamp`], for one tool or for one per lane.
struct RadialClamp<T> {
    body_radius: T,
    angle: T,
    rate: T,
    acceleration: T,
}

impl<T: Lanewise> Loop for RadialClamp<T> {
    type Output = Clamp<T>;

    const LANES: usize = T::LANES;

    #[inline(always)]
    fn run(self) -> Clamp<T> {
        let Self {
            body_radius,
            angle,
            rate,
            acceleration,
        } = self;
        let ((sin, cos), none) = (angle.sin_cos(), T::ZERO);
        let (radial, tangential) = ([cos, sin, none], [-sin, cos, none]);
        let direction_rate = scale(rate, tangential);
        let direction_acceleration =
            add(scale(acceleration, tangential), scale(-rate * rate, radial));
        Clamp {
            position: scale(body_radius, radial),
            velocity: scale(body_radius, direction_rate),
            acceleration: scale(body_radius, direction_acceleration),
            direction: radial,
            direction_rate,
            angular_velocity: [none, none, rate],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Axial filaments, as those of a cup brush.
    struct Cup;

    impl Tool for Cup {
        fn clamp(&self, angle: f64, rate: f64) -> Clamp<f64> {
            let axial = [0.0, 0.0, -1.0];
            Clamp {
                direction: axial,
                direction_rate: [0.0; 3],
                ..RotaryTool::radial(0.1).clamp(angle, rate)
            }
        }

        fn radius(&self, _: f64) -> f64 {
            0.1
        }
    }

    const TILTED: RotaryTool = RotaryTool {
        root_radius: 0.14,
        height: 0.0,
        elevation: 0.0,
        lateral_tilt: 0.2,
        leans_from: None,
    };

    /// A round tool that leaves its coordinates to the default.
    struct Plain;

    impl Tool for Plain {
        fn clamp(&self, angle: f64, rate: f64) -> Clamp<f64> {
            TILTED.clamp(angle, rate)
        }

        fn radius(&self, filament_length: f64) -> f64 {
            0.14 + filament_length
        }
    }

    #[test]
    fn the_default_reads_coordinates_off_the_clamp() {
        for angle in [-1.6, 0.3, 3.0] {
            let (own, default) = (
                TILTED.undeformed(angle, 50.0),
                Plain.undeformed(angle, 50.0),
            );
            for (own, default) in own.as_flattened().iter().zip(default.as_flattened()) {
                assert!((own - default).abs() < 1e-13, "{own} {default}");
            }
        }
        assert_eq!(
            Cup.undeformed(0.4, 50.0),
            [[std::f64::consts::PI, 0.0], [0.0, 0.0]]
        );
    }
}
