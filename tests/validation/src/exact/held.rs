//! Inextensible beams that an edge or a curved surface keeps bent, without weight.
//!
//! The beam has `E I = 1` and is clamped at the origin along `x`. A force `F` presses on one of its
//! points, and the beam beyond that point is straight. The force is inclined by `η` from the beam's
//! normal at the point towards the root. With the angle θ of the beam, θ_c at the point, and `φ =
//! θ_c − θ`,
//!
//! ```text
//! θ″ = −F cos(φ + η),   ½ θ′² = F [sin(φ + η) − sin η]
//! ```
//!
//! because the moment vanishes at the point. A frictionless edge presses along the beam's normal,
//! so `η = 0`. A surface presses on the tip along its own normal (the elastica under a curved
//! constraint, Heinrich, Stango and Shia 1991). With `ψ = θ + ψ_0`, `ψ_0 = π/2 − η − θ_c`, `m = (1
//! − sin η)/2` and `sin(ψ_0/2) = √m sin ϑ`:
//!
//! ```text
//! √F s = K(m) − F(ϑ, m)
//! √F ∫ cos ψ ds = 2 [E(m) − E(ϑ, m)] − √F s
//! √F ∫ sin ψ ds = 2 √m cos ϑ
//! ```

use std::f64::consts::{FRAC_PI_2, PI};

use spec_math::Ellip;

use super::zero;

/// Bounds of θ_c in which solutions are sought.
const MIN_ANGLE: f64 = 1e-6;
const MAX_ANGLE: f64 = 2.5;

/// Arc length and end of the beam up to the loaded point, for `F = 1`.
#[derive(Clone, Copy, Debug)]
struct Bent {
    length: f64,
    end: [f64; 2],
}

impl Bent {
    /// The beam for the angle `θ_c` at the point and the inclination `η` of the force.
    fn new(angle: f64, inclination: f64) -> Self {
        let at_root = FRAC_PI_2 - inclination - angle;
        // √m = sin((π/2 − η)/2), without cancellation where the force points along the beam.
        let modulus = ((at_root + angle) / 2.0).sin();
        let m = modulus * modulus;
        let amplitude = ((at_root / 2.0).sin() / modulus).clamp(-1.0, 1.0).asin();
        let length = m.ellip_k() - m.ellip_k_inc(amplitude);
        let across_force = 2.0 * (m.ellip_e() - m.ellip_e_inc(amplitude)) - length;
        let along_force = 2.0 * modulus * amplitude.cos();
        let (sine, cosine) = at_root.sin_cos();
        let end = [
            cosine * across_force + sine * along_force,
            cosine * along_force - sine * across_force,
        ];
        Self { length, end }
    }
}

/// A vector's components along and across the direction `angle`.
fn along([x, y]: [f64; 2], angle: f64) -> [f64; 2] {
    let (sine, cosine) = angle.sin_cos();
    [cosine * x + sine * y, cosine * y - sine * x]
}

/// A circle that presses on the beam from below.
#[derive(Clone, Copy, Debug)]
pub struct Circle {
    /// Its centre.
    pub centre: [f64; 2],
    /// Its radius; negative if the beam is inside.
    pub radius: f64,
    /// The normal force over the indentation of the surface.
    pub stiffness: f64,
}

impl Circle {
    /// Its centre along the direction `angle`, and the height of its surface across that direction.
    fn seen_along(&self, angle: f64) -> [f64; 2] {
        let [place, height] = along(self.centre, angle);
        [place, height + self.radius]
    }
}

/// A bent beam.
#[derive(Clone, Copy, Debug)]
pub struct Held {
    /// Angle θ_c of the beam at the contact.
    pub angle: f64,
    /// Angle of the surface at the contact; its normal is turned from this by a right angle.
    pub slope: f64,
    /// Arc length from the root to the contact.
    pub length: f64,
    /// Force, including friction.
    pub force: f64,
}

impl Held {
    /// A beam that lies across an edge, rounded as `circle`. `friction` is friction over normal
    /// force: positive if it pulls the beam towards the root, because the beam slides outwards.
    ///
    /// The angle is that for which the beam's end lies on the surface. All numbers are NaN if the
    /// circle does not reach the beam.
    pub fn over_edge(circle: Circle, friction: f64) -> Self {
        let inclination = friction.atan();
        let state = |angle: f64| {
            let bent = Bent::new(angle, inclination);
            let ([end, across], [place, height]) =
                (along(bent.end, angle), circle.seen_along(angle));
            let root = end / place;
            let force = root * root;
            let held = Self {
                angle,
                slope: angle,
                length: bent.length / root,
                force,
            };
            (
                held,
                across / root - height + force * inclination.cos() / circle.stiffness,
            )
        };
        let angle = zero(
            |angle| state(angle).1,
            MIN_ANGLE,
            MAX_ANGLE.min(PI - 2.0 * inclination),
        );
        state(angle).0
    }

    /// A beam of the given length on whose tip a surface of the slope `slope` presses without
    /// friction, and the position of the tip. It ends where `mismatch` of both vanishes.
    fn at_tip(
        length: f64,
        slope: f64,
        mismatch: impl Fn(&Self, [f64; 2]) -> f64,
    ) -> (Self, [f64; 2]) {
        let state = |angle: f64| {
            let bent = Bent::new(angle, slope - angle);
            let root = bent.length / length;
            (
                Self {
                    angle,
                    slope,
                    length,
                    force: root * root,
                },
                bent.end.map(|end| end / root),
            )
        };
        // From no bending, or none at the root, to a force along the beam.
        let low = (2.0 * slope - PI).max(0.0) + MIN_ANGLE;
        let high = MAX_ANGLE.min(slope + FRAC_PI_2 - MIN_ANGLE);
        let off = |angle: f64| {
            let (held, tip) = state(angle);
            mismatch(&held, tip)
        };
        state(zero(off, low, high))
    }

    /// A beam of the given length, with its tip on `circle` and without friction. The slope of the
    /// surface at the tip lies between the two given ones.
    pub fn by_tip(circle: Circle, length: f64, [low, high]: [f64; 2]) -> Self {
        let at = |slope: f64| {
            let [place, height] = circle.seen_along(slope);
            let off =
                |held: &Self, tip| along(tip, slope)[1] - height + held.force / circle.stiffness;
            let (held, tip) = Self::at_tip(length, slope, off);
            (held, along(tip, slope)[0] - place)
        };
        at(zero(|slope| at(slope).1, low, high)).0
    }

    /// Distances by which `circle`, an edge without friction, must move along `x` for a beam of the
    /// given length to leave it: until it touches the tip, and until it slips off the tip.
    pub fn release(circle: Circle, length: f64) -> [f64; 2] {
        let [x, y] = circle.centre;
        let moved = |by: f64| {
            Self::over_edge(
                Circle {
                    centre: [x + by, y],
                    ..circle
                },
                0.0,
            )
        };
        let to_tip = zero(|by| moved(by).length - length, 0.0, length);
        // The edge first moves on along the tip, until there is no equilibrium farther away.
        let at = |slope: f64| {
            let depth = |held: &Self| circle.radius - held.force / circle.stiffness;
            let off = |held: &Self, tip: [f64; 2]| tip[1] - y - depth(held) * slope.cos();
            let (held, tip) = Self::at_tip(length, slope, off);
            tip[0] + depth(&held) * slope.sin() - x
        };
        let (mut low, mut high) = (moved(to_tip).angle, MAX_ANGLE);
        for _ in 0..200 {
            let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            // Beyond the last solution there is none, and its place is NaN.
            if at(a) < at(b) { low = a } else { high = b }
        }
        [to_tip, at(low)]
    }
}

/// Checks of the solution.
pub mod checks {
    use super::*;
    use crate::exact::elastica::buckled_force;

    /// A sharp edge at the height `height` over the distance 1.
    fn point(height: f64) -> Circle {
        Circle {
            centre: [1.0, height],
            radius: 0.0,
            stiffness: f64::INFINITY,
        }
    }

    /// The end of a beam that starts with the curvature due to its force, by the classical
    /// Runge-Kutta method, and its curvature there.
    fn integrated(held: &Held) -> [f64; 3] {
        const STEPS: usize = 2000;
        let h = held.length / STEPS as f64;
        let inclination = held.slope - held.angle;
        let bend =
            (2.0 * held.force * ((held.angle + inclination).sin() - inclination.sin())).sqrt();
        let slope = |[_, _, angle, bend]: [f64; 4]| {
            [
                angle.cos(),
                angle.sin(),
                bend,
                -held.force * (held.slope - angle).cos(),
            ]
        };
        let moved = |y: [f64; 4], by: f64, k: [f64; 4]| std::array::from_fn(|i| y[i] + by * k[i]);
        let mut y = [0.0, 0.0, 0.0, bend];
        for _ in 0..STEPS {
            let first = slope(y);
            let second = slope(moved(y, h / 2.0, first));
            let third = slope(moved(y, h / 2.0, second));
            let fourth = slope(moved(y, h, third));
            y = std::array::from_fn(|i| {
                y[i] + h / 6.0 * (first[i] + 2.0 * (second[i] + third[i]) + fourth[i])
            });
        }
        [y[0], y[1], y[3]]
    }

    /// Checks that a beam ends on the surface of `circle`, without a moment.
    fn assert_ends_on(held: &Held, circle: Circle, normal_share: f64) {
        let [x, y, bend] = integrated(held);
        let (sine, cosine) = held.slope.sin_cos();
        let height = circle.radius - held.force * normal_share / circle.stiffness;
        let [expected_x, expected_y] = [
            circle.centre[0] - height * sine,
            circle.centre[1] + height * cosine,
        ];
        assert!(
            (x - expected_x).abs() < 1e-11 && (y - expected_y).abs() < 1e-11,
            "{held:?}: {x}, {y}"
        );
        assert!(bend.abs() < 1e-10, "{held:?}: {bend}");
    }

    pub fn sharp_edges_match_quoted_numbers() {
        for (height, angle, length, force) in [
            (0.1, 0.149521, 1.005987, 0.295713),
            (0.25, 0.367733, 1.037012, 0.687009),
            (0.5, 0.697320, 1.142771, 1.085675),
            (1.0, 1.187804, 1.509367, 1.095588),
        ] {
            let held = Held::over_edge(point(height), 0.0);
            for (value, quoted) in [
                (held.angle, angle),
                (held.length, length),
                (held.force, force),
            ] {
                assert!((value - quoted).abs() < 6e-7, "{height}: {value} {quoted}");
            }
            assert_ends_on(&held, point(height), 1.0);
        }
        // A beam that slides outwards is pressed on more than one that slides towards its root.
        for (friction, force) in [(0.3, 0.733742), (-0.3, 0.701937)] {
            assert!((Held::over_edge(point(0.25), friction).force - force).abs() < 6e-7);
        }
    }

    pub fn rounded_soft_edges_satisfy_the_equations() {
        let circle = Circle {
            centre: [1.0, 0.2],
            radius: 0.05,
            stiffness: 80.0,
        };
        for friction in [-0.5, 0.0, 0.3] {
            let held = Held::over_edge(circle, friction);
            let inclined = Held {
                slope: held.angle + friction.atan(),
                ..held
            };
            let [x, y, bend] = integrated(&inclined);
            let height = circle.radius - held.force * friction.atan().cos() / circle.stiffness;
            assert!((x - (circle.centre[0] - height * held.angle.sin())).abs() < 1e-11);
            assert!((y - (circle.centre[1] + height * held.angle.cos())).abs() < 1e-11);
            assert!(bend.abs() < 1e-10);
        }
    }

    pub fn tips_on_curves_satisfy_the_equations() {
        // The paper's tool over a cylinder of 50 mm, in a bore of 300 mm; lengths in units of l_f.
        for (radius, depth, turned, slopes) in [
            (1.25, 0.025, 0.0, [-0.2, 0.0]),
            (1.25, 0.05, 0.05, [-0.2, 0.0]),
            (-7.5, 0.025, -0.05, [0.0, 0.1]),
            (-7.5, 0.05, 0.1, [-0.05, 0.05]),
        ] {
            // The clamp points from the tool's axis at the workpiece, less `turned`. The beam bends
            // away from the turn.
            let below = 4.5 - depth + radius;
            let circle = Circle {
                centre: [below * f64::cos(turned) - 3.5, below * f64::sin(turned)],
                radius,
                stiffness: 1e4,
            };
            let held = Held::by_tip(circle, 1.0, slopes.map(|slope| FRAC_PI_2 + turned + slope));
            assert_ends_on(&held, circle, 1.0);
        }
    }

    pub fn released_beams_are_in_equilibrium_until_then() {
        let circle = Circle {
            centre: [0.9, 0.2],
            radius: 0.01,
            stiffness: 1e5,
        };
        let [to_tip, slipped] = Held::release(circle, 1.0);
        assert!(
            to_tip < slipped && slipped < to_tip + circle.radius,
            "{to_tip} {slipped}"
        );
        let moved = |by: f64| Circle {
            centre: [circle.centre[0] + by, circle.centre[1]],
            ..circle
        };
        let last_across = Held::over_edge(moved(to_tip), 0.0);
        let between = moved((to_tip + slipped) / 2.0);
        let on_tip = Held::by_tip(between, 1.0, [last_across.angle, last_across.angle + 0.7]);
        assert_ends_on(&on_tip, between, 1.0);
        assert!(on_tip.slope > last_across.slope);
    }

    pub fn a_flat_surface_buckles_the_beam() {
        // Large, but not so large that rounding of its centre shows.
        let circle = Circle {
            centre: [0.9 + 1e4, 0.0],
            radius: 1e4,
            stiffness: 50.0,
        };
        let held = Held::by_tip(circle, 1.0, [FRAC_PI_2 - 1e-3, FRAC_PI_2 + 1e-3]);
        let critical = FRAC_PI_2.powi(2);
        assert!(
            (held.force / critical - buckled_force(0.1, 50.0 / critical)).abs() < 1e-3,
            "{held:?}"
        );
    }
}
