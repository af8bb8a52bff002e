//! Contact with the workpiece: normal force and friction of a point of the filament.
//!
//! Faces are met by nodes ([`ContactLaw::approach`]). Edges are met by the centreline, at one point
//! of a segment ([`edge`]).

use crate::equations::NodeTangent;
use crate::equations::linear::{add, dot, scale, sub};
use crate::model::settings::ContactSettings;
use crate::workpiece::{Surface, Workpiece};

pub mod edge;

/// A point of the filament relative to the surface below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// Penetration `δ` in m, positive inside; the contact radius is taken off the gap.
    pub penetration: f64,
    /// `δ̇` in m/s.
    pub penetration_rate: f64,
    /// Outward unit normal of the workpiece.
    pub normal: [f64; 3],
    /// Velocity of the point relative to the workpiece, along the surface, in m/s.
    pub sliding: [f64; 3],
    /// See [`Surface::across`].
    pub across: [f64; 3],
    /// Turn of the normal, in the plane of the profile, per path of the point across it, in rad/m.
    pub turn: f64,
    /// Distance of the point from the border of this surface in m; negative beyond. See
    /// [`Surface::margin`].
    pub margin: f64,
    /// Share of the law's stiffness with which the point presses ([`node_stiffness_share`]).
    pub stiffness_share: f64,
}

impl Approach {
    /// Computes the approach to `surface` with `velocity` (m/s).
    #[inline]
    pub fn new(surface: &Surface, velocity: [f64; 3], radius: f64) -> Self {
        let relative = sub(velocity, surface.velocity);
        let normal_speed = dot(surface.normal, relative);
        Self {
            penetration: radius - surface.gap,
            penetration_rate: -normal_speed,
            normal: surface.normal,
            sliding: sub(relative, scale(normal_speed, surface.normal)),
            across: surface.across,
            turn: surface.turn,
            margin: surface.margin,
            stiffness_share: 1.0,
        }
    }

    /// Returns the distance of the point from the surface in m, less the contact radius; negative
    /// inside.
    #[inline]
    pub fn distance(&self) -> f64 {
        -self.penetration
    }
}

/// Number of segments up to which every node presses with the whole stiffness of the law.
const REFERENCE_SEGMENTS: f64 = 25.0;

/// Returns the share of the stiffness with which `node` (from 1) of a chain of `segments` presses.
///
/// The tip is the end of the filament. The others stand for the centreline, whose stiffness per
/// length does not depend on their number (MODEL, "Contact that converges with the number of
/// segments").
pub fn node_stiffness_share(node: usize, segments: usize) -> f64 {
    if node == segments {
        1.0
    } else {
        (REFERENCE_SEGMENTS / segments as f64).min(1.0)
    }
}

/// Normal and frictional force on a point of the filament.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactForce {
    /// `F_n` in N.
    pub normal: f64,
    /// Friction on the node in N, a vector along the surface.
    pub tangential: [f64; 3],
}

impl ContactForce {
    /// No force, for a node without contact.
    pub const NONE: Self = Self {
        normal: 0.0,
        tangential: [0.0; 3],
    };

    /// Returns both parts as one vector in N, for the approach that they belong to.
    pub fn total(&self, approach: &Approach) -> [f64; 3] {
        add(scale(self.normal, approach.normal), self.tangential)
    }
}

/// Contact law of MODEL, "Contact": Hunt and Crossley (1975) with regularised Coulomb friction.
///
/// While a node is *closed* its force is the smooth law `k_c δ^p (1 + χ δ̇)`, continued oddly to `δ
/// < 0`; while it is *open* there is none. The solver locates where the law changes sign and
/// switches there, which gives `F_n = max(0, …)` without a kink inside a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactLaw {
    /// `k_c` in N/m^p.
    pub stiffness: f64,
    /// `p ≥ 1`.
    pub exponent: f64,
    /// `χ` in s/m.
    pub damping: f64,
    /// Contact radius of a node in m.
    pub radius: f64,
    /// Coefficient of friction `µ`.
    pub friction: f64,
    /// Sliding speed `v_reg` over which friction is regularised, in m/s.
    pub regularisation: f64,
}

impl From<&ContactSettings> for ContactLaw {
    fn from(settings: &ContactSettings) -> Self {
        Self {
            stiffness: settings.stiffness_n_m,
            exponent: settings.exponent,
            damping: settings.damping_s_m,
            radius: settings.radius_m,
            friction: settings.friction_coefficient,
            regularisation: settings.friction_regularisation_m_s,
        }
    }
}

impl ContactLaw {
    /// Computes the approach of the tip at `position` with `velocity` to `workpiece` at `time`.
    #[inline]
    pub fn approach(
        &self,
        workpiece: &impl Workpiece,
        position: [f64; 3],
        velocity: [f64; 3],
        time: f64,
    ) -> Approach {
        Approach::new(&workpiece.surface(position, time), velocity, self.radius)
    }

    /// Returns `k_c |δ|^p sign δ`.
    #[inline]
    fn elastic(&self, approach: &Approach) -> f64 {
        let (penetration, stiffness) = (
            approach.penetration,
            approach.stiffness_share * self.stiffness,
        );
        if self.exponent == 1.0 {
            return stiffness * penetration;
        }
        stiffness * penetration.abs().powf(self.exponent).copysign(penetration)
    }

    /// Returns the normal force in N of a node of the full stiffness at rest at the depth `δ` (m): `k_c δ^p`.
    pub fn force_at_rest(&self, depth: f64) -> f64 {
        self.stiffness * depth.powf(self.exponent)
    }

    /// Returns `1 + χ δ̇`.
    #[inline]
    fn rate_factor(&self, penetration_rate: f64) -> f64 {
        1.0 + self.damping * penetration_rate
    }

    /// Returns a continuous length in m, positive where the law presses (`δ > 0`, `1 + χ δ̇ > 0`
    /// and the point is on its surface), negative elsewhere.
    ///
    /// A contact closes where the length rises through zero and opens where it falls.
    #[inline]
    pub fn pressing(&self, approach: &Approach) -> f64 {
        let pressing = approach.penetration.min(approach.margin);
        if self.damping == 0.0 {
            return pressing;
        }
        // The second condition is measured as a length, on the scale of the penetration itself.
        let scale = approach.penetration.abs();
        pressing.min(scale * self.rate_factor(approach.penetration_rate))
    }

    /// Returns [`ContactLaw::pressing`] of a node, and its [`Approach::distance`]. Computes no more
    /// of the approach than these need.
    #[inline]
    pub fn node_pressing(
        &self,
        workpiece: &impl Workpiece,
        position: [f64; 3],
        velocity: [f64; 3],
        time: f64,
    ) -> [f64; 2] {
        if self.damping == 0.0 {
            let Surface { gap, margin, .. } = workpiece.surface(position, time);
            return [(self.radius - gap).min(margin), gap - self.radius];
        }
        let approach = self.approach(workpiece, position, velocity, time);
        [self.pressing(&approach), approach.distance()]
    }

    /// Returns the normal force of a closed node in N.
    #[inline]
    pub fn normal_force(&self, approach: &Approach) -> f64 {
        self.elastic(approach) * self.rate_factor(approach.penetration_rate)
    }

    /// Returns normal force and friction of a closed node.
    ///
    /// Friction is `−µ F_n v_t/√(|v_t|² + v_reg²)`: Coulomb's law for `|v_t| ≫ v_reg`, viscous
    /// below.
    #[inline]
    pub fn force(&self, approach: &Approach) -> ContactForce {
        let normal = self.normal_force(approach);
        if self.friction == 0.0 {
            return ContactForce {
                normal,
                tangential: [0.0; 3],
            };
        }
        let speed = self.regularised_speed(approach);
        ContactForce {
            normal,
            tangential: scale(-self.friction * normal / speed, approach.sliding),
        }
    }

    /// Returns the reported force: [`ContactLaw::force`] where it presses, else none. A closed node
    /// may be past its opening by less than the tolerance of the event's location.
    pub fn pressing_force(&self, approach: &Approach) -> ContactForce {
        let force = self.force(approach);
        if force.normal > 0.0 {
            force
        } else {
            ContactForce::NONE
        }
    }

    fn regularised_speed(&self, approach: &Approach) -> f64 {
        (dot(approach.sliding, approach.sliding) + self.regularisation.powi(2)).sqrt()
    }

    /// Returns `∂F_z/∂ż` of a closed node that slides in a plane across `z`, in N s/m: friction
    /// resists a motion along `z` too.
    pub fn lateral_damping(&self, approach: &Approach) -> f64 {
        -self.friction * self.normal_force(approach) / self.regularised_speed(approach)
    }

    /// Returns the energy stored in the contact in J, the elastic work: `k_c δ^(p+1)/(p+1)`.
    pub fn stored_energy(&self, approach: &Approach) -> f64 {
        self.elastic(approach) * approach.penetration / (self.exponent + 1.0)
    }

    /// Returns the power dissipated by contact damping in W.
    pub fn damped_power(&self, approach: &Approach) -> f64 {
        self.elastic(approach) * self.damping * approach.penetration_rate.powi(2)
    }

    /// Returns `∂F/∂x` and `∂F/∂ẋ` of a closed node.
    pub fn tangent(&self, approach: &Approach) -> NodeTangent<f64> {
        let mut tangent = self.tangent_without_turn(approach);
        if approach.turn != 0.0 {
            let turned = scale(approach.turn, self.turned(approach));
            let across = approach.across;
            for (row, turned) in tangent.position.iter_mut().zip(turned) {
                *row = add(*row, scale(turned, across));
            }
        }
        tangent
    }

    /// Returns the derivative of the whole force of a closed contact by the angle of its normal in
    /// N/rad.
    pub fn turned(&self, approach: &Approach) -> [f64; 3] {
        let Approach {
            penetration_rate,
            normal,
            sliding,
            across,
            ..
        } = *approach;
        let along = dot(across, sliding);
        let force = self.normal_force(approach);
        let by_rate = self.elastic(approach) * self.damping;
        let speed = self.regularised_speed(approach);
        let friction = self.friction / speed;
        // The velocity along the surface changes by this; its component along `sliding` does not
        // change the force.
        let shift = sub(scale(-along, normal), scale(-penetration_rate, across));
        let shift = sub(shift, scale(dot(sliding, shift) / (speed * speed), sliding));
        let direction = sub(normal, scale(friction, sliding));
        add(
            scale(-by_rate * along, direction),
            scale(force, sub(across, scale(friction, shift))),
        )
    }

    /// Returns `∂F/∂x` and `∂F/∂ẋ` of a closed contact whose normal does not turn.
    pub fn tangent_without_turn(&self, approach: &Approach) -> NodeTangent<f64> {
        let Approach {
            penetration,
            penetration_rate,
            normal,
            sliding,
            ..
        } = *approach;
        let stiffness = approach.stiffness_share * self.stiffness;
        let slope = if self.exponent == 1.0 {
            stiffness
        } else {
            self.exponent * stiffness * penetration.abs().powf(self.exponent - 1.0)
        };
        // Total force per unit of normal force; δ falls along the normal.
        let speed = self.regularised_speed(approach);
        let direction = sub(normal, scale(self.friction / speed, sliding));
        let by_penetration = slope * self.rate_factor(penetration_rate);
        let by_rate = self.elastic(approach) * self.damping;
        let viscous = self.friction * self.normal_force(approach) / speed;
        let position = std::array::from_fn(|row| scale(-by_penetration * direction[row], normal));
        let velocity = std::array::from_fn(|row| {
            std::array::from_fn(|column| {
                let identity = f64::from(u8::from(row == column));
                let along_surface = identity - normal[row] * normal[column];
                let turning = sliding[row] * sliding[column] / (speed * speed);
                -by_rate * direction[row] * normal[column] - viscous * (along_surface - turning)
            })
        });
        NodeTangent { position, velocity }
    }
}
