//! Filaments on edges and on curved faces.

use std::f64::consts::FRAC_PI_2;

use bristle::contact::ContactLaw;
use bristle::equations::Clamp;
use bristle::integrate::Tolerances;
use bristle::integrate::tableau::ESDIRK54;
use bristle::model::filament::bending_stiffness;
use bristle::model::settings::{Settings, WorkpieceKind};
use bristle::simulation::{FilamentSystem, integrate};
use bristle::tool::ClampMotion;
use bristle::workpiece::{Edge, Surface, Workpiece};

use super::chains::{crossing, extrapolated, force_at, paper_case, unit_chain, worse};
use super::exact::held::{Circle, Held};
use super::trial::{Failure, Trial, TrialResult};
use super::{sources, tolerances};

/// Radius of the edges of the unit beam, their stiffness, and the distance from the clamp at which
/// they touch it.
const RADIUS: f64 = 0.01;
const STIFFNESS: f64 = 1e5;
const REACH: f64 = 0.5;
/// Joint damping over joint stiffness, in s: the beam creeps to its rest.
const DAMPING_TIME: f64 = 0.2;
/// Time in s after which the beam rests.
const REST: f64 = 30.0;

/// A single edge without faces.
#[derive(Clone, Debug)]
struct Lone([Edge; 1]);

impl Workpiece for Lone {
    fn surface(&self, _: [f64; 3], _: f64) -> Surface {
        Surface::flat(f64::INFINITY, [0.0, 1.0, 0.0], [0.0; 3])
    }

    fn edges(&self) -> &[Edge] {
        &self.0
    }
}

/// A clamp along `x` that moves along `x` at a constant speed (m/s) and is at the origin at
/// `origin` (s).
#[derive(Clone, Copy, Debug)]
struct DrawnClamp {
    speed: f64,
    origin: f64,
}

impl ClampMotion for DrawnClamp {
    fn at(&self, time: f64) -> Clamp<f64> {
        Clamp {
            position: [self.speed * (time - self.origin), 0.0, 0.0],
            velocity: [self.speed, 0.0, 0.0],
            acceleration: [0.0; 3],
            direction: [1.0, 0.0, 0.0],
            direction_rate: [0.0; 3],
            angular_velocity: [0.0; 3],
        }
    }
}

/// The circle that touches a beam at `point` like a sharp, rigid edge, and the resulting shape of
/// the beam. `friction` is friction over normal force, positive towards the root.
fn touching(point: [f64; 2], friction: f64) -> (Circle, Held) {
    let held = Held::over_edge(
        Circle {
            centre: point,
            radius: 0.0,
            stiffness: f64::INFINITY,
        },
        friction,
    );
    let depth = RADIUS - held.force / (1.0 + friction * friction).sqrt() / STIFFNESS;
    let (sine, cosine) = held.angle.sin_cos();
    let centre = [point[0] + depth * sine, point[1] - depth * cosine];
    (
        Circle {
            centre,
            radius: RADIUS,
            stiffness: STIFFNESS,
        },
        held,
    )
}

/// The unit beam of `segments` segments over an edge, clamped to `motion`, and its state at time
/// zero: straight from the clamp, above the edge.
fn system(
    segments: usize,
    circle: Circle,
    motion: DrawnClamp,
    friction: f64,
) -> FilamentSystem<DrawnClamp, Lone> {
    let mut chain = unit_chain(segments);
    for link in &mut chain.links {
        link.damping = DAMPING_TIME * link.stiffness;
    }
    let law = ContactLaw {
        stiffness: STIFFNESS,
        exponent: 1.0,
        damping: 0.0,
        radius: 0.0,
        friction,
        regularisation: 1e-3 * motion.speed.abs().max(1e-3),
    };
    let edge = Edge::arc(circle.centre, circle.radius, None, [0.0; 3]);
    FilamentSystem::new(chain, motion, law, Lone([edge]), false)
}

/// The contact of a beam with its edge.
#[derive(Clone, Copy, Debug)]
struct BeamEdgeContact {
    /// Angle of the segment in contact.
    angle: f64,
    /// Arc length from the root.
    length: f64,
    /// Normal force.
    force: f64,
    /// Times at which the contact reached the tip, and at which it last opened.
    at_tip: f64,
    opened: f64,
}

/// Lets a beam go above the edge, and observes it until `end`.
fn settle(
    segments: usize,
    circle: Circle,
    motion: DrawnClamp,
    friction: f64,
    end: f64,
) -> Result<BeamEdgeContact, Failure> {
    let mut system = system(segments, circle, motion, friction);
    let filament = system.filament(0).clone();
    let [x, y] = circle.centre;
    let [root, ..] = motion.at(0.0).position;
    let above = (y + 3.0 * circle.radius).atan2(x - root);
    let start = system.state(
        0.0,
        vec![[FRAC_PI_2, above]; segments],
        vec![[0.0; 2]; segments],
    );
    let tolerances = Tolerances::of_motion(1e-9, 1.0, 1.0);
    let h = filament.chain.length;
    let mut seen = BeamEdgeContact {
        angle: f64::NAN,
        length: f64::NAN,
        force: f64::NAN,
        at_tip: f64::NAN,
        opened: f64::NAN,
    };
    integrate(&mut system, start, end, &ESDIRK54, tolerances, |step| {
        if !step.closed[segments] {
            return;
        }
        let place = |s: f64| {
            let station = step.touch(&filament, segments, s).station;
            station.segment as f64 + station.fraction
        };
        let touch = step.touch(&filament, segments, 1.0);
        seen.length = place(1.0) * h;
        seen.angle = step.end.q[touch.station.segment][1];
        seen.force = filament.law.normal_force(&touch.approach);
        seen.opened = step.end.time;
        let at_tip = |s: f64| {
            if place(s) < segments as f64 {
                -1.0
            } else {
                1.0
            }
        };
        if seen.at_tip.is_nan() && at_tip(1.0) > 0.0 {
            seen.at_tip = step.time(crossing(at_tip).unwrap_or(1.0));
        }
    })?;
    Ok(seen)
}

/// Mean relative errors of contact angle, arc length and force over four edges, and the range of the
/// force's errors. Each edge touches a quarter of a segment farther out than the one before. The
/// beam rests without friction.
fn errors(segments: usize, ratio: f64) -> Result<([f64; 3], f64), Failure> {
    const SHIFTS: usize = 4;
    let still = DrawnClamp {
        speed: 0.0,
        origin: 0.0,
    };
    let (mut means, mut least, mut largest) = ([0.0; 3], f64::INFINITY, f64::NEG_INFINITY);
    let length_over_reach = touching([1.0, ratio], 0.0).1.length;
    for shift in 0..SHIFTS {
        let x = REACH + shift as f64 / (SHIFTS * segments) as f64 / length_over_reach;
        let (circle, held) = touching([x, ratio * x], 0.0);
        let seen = settle(segments, circle, still, 0.0, REST)?;
        let errors = [
            seen.angle / held.angle,
            seen.length / held.length,
            seen.force / held.force,
        ]
        .map(|of| of - 1.0);
        for (mean, error) in means.iter_mut().zip(errors) {
            *mean += error / SHIFTS as f64;
        }
        (least, largest) = (least.min(errors[2]), worse(errors[2], largest));
    }
    Ok((means, largest - least))
}

/// Beam at rest over a fixed edge at (x, y): `½ E I θ′² = R sin(θ_c − θ)`, straight beyond the
/// edge.
///
/// The mean of four places of the edge within a segment is extrapolated from three n. Friction
/// inclines the force by arctan µ; it needs a motion, which is extrapolated to rest.
pub fn over_edge(trial: &mut Trial) -> TrialResult {
    const QUANTITIES: [&str; 3] = ["θ_c in rad", "s_c/x", "R x²/(E I)"];
    let (coarse, fine) = (100, 200);
    for ratio in [0.1, 0.25, 0.5, 1.0] {
        let (_, held) = touching([1.0, ratio], 0.0);
        let exact = [held.angle, held.length, held.force];
        let (of_half, _) = errors(coarse / 2, ratio)?;
        let ((of_coarse, _), (of_fine, range)) = (errors(coarse, ratio)?, errors(fine, ratio)?);
        for i in 0..3 {
            // The next term of the error is of order n⁻³.
            let (first, second) = (
                extrapolated(of_half[i], of_coarse[i]),
                extrapolated(of_coarse[i], of_fine[i]),
            );
            let computed = exact[i] * (1.0 + second + (second - first) / 7.0);
            let tolerance = if i == 0 {
                tolerances::EDGE_ANGLE
            } else {
                tolerances::EDGE
            };
            let subject = format!("y/x = {ratio}, n → ∞");
            trial.check(
                subject,
                QUANTITIES[i],
                exact[i],
                sources::EDGE_ELASTICA,
                computed,
                tolerance,
            );
        }
        let subject = format!("y/x = {ratio}, n = {coarse}, {fine}");
        trial.check_order(subject, "order of R", [of_coarse[2], of_fine[2]], 0.0);
        let subject = format!("y/x = {ratio}, n = {fine}, edge shifted by quarters of a segment");
        trial.check(
            subject,
            "range of R/R",
            0.0,
            sources::EXACT,
            range,
            tolerances::EDGE_SHIFT,
        );
    }
    for (name, friction) in [("outwards", 0.3), ("inwards", -0.3)] {
        let point = [REACH, 0.25 * REACH];
        let (circle, held) = touching(point, friction);
        let at = |segments: usize, speed: f64| -> Result<f64, Failure> {
            let motion = DrawnClamp {
                speed: speed.copysign(friction),
                origin: REST,
            };
            Ok(settle(segments, circle, motion, friction.abs(), REST)?.force)
        };
        // The dampers' share is proportional to the speed.
        let slow = |segments: usize| -> Result<f64, Failure> {
            Ok(2.0 * at(segments, 1e-4)? - at(segments, 2e-4)?)
        };
        let normal = extrapolated(slow(coarse)?, slow(fine)?) * REACH * REACH;
        let computed = normal * (1.0 + friction * friction).sqrt();
        let tolerance = tolerances::EDGE_FRICTION;
        let subject = format!("y/x = 0.25, µ = 0.3, sliding {name}, n → ∞");
        trial.check(
            subject,
            QUANTITIES[2],
            held.force * REACH * REACH,
            sources::EDGE_ELASTICA,
            computed,
            tolerance,
        );
    }
    Ok(())
}

/// Beam that is drawn back until it slips off an edge: when the contact reaches the tip, and when
/// it opens, at most a twentieth of the radius later than the last equilibrium.
pub fn release(trial: &mut Trial) -> TrialResult {
    const SPEED: f64 = 2e-3;
    let coarse = 50;
    for height in [0.1, 0.225] {
        let (circle, _) = touching([0.9, height], 0.0);
        let [to_tip, slipped] = Held::release(circle, 1.0);
        // Ways of the clamp until the contact reaches the tip, and until it opens.
        let at = |segments: usize, speed: f64| -> Result<[f64; 2], Failure> {
            let end = REST + (slipped + RADIUS) / speed;
            let seen = settle(
                segments,
                circle,
                DrawnClamp {
                    speed: -speed,
                    origin: REST,
                },
                0.0,
                end,
            )?;
            Ok([seen.at_tip, seen.opened].map(|time| speed * (time - REST)))
        };
        // The dampers' share is proportional to the speed.
        let slow = |segments: usize| -> Result<[f64; 2], Failure> {
            let ([slow, opened], [fast, _]) = (at(segments, SPEED / 2.0)?, at(segments, SPEED)?);
            Ok([2.0 * slow - fast, opened])
        };
        let ([coarse, _], [fine, opened]) = (slow(coarse)?, slow(2 * coarse)?);
        let subject = format!("y = {height} l_f, n → ∞, at rest");
        let computed = extrapolated(coarse, fine);
        trial.check(
            subject,
            "Δx/l_f, s_c = l_f",
            to_tip,
            sources::EDGE_ELASTICA,
            computed,
            tolerances::RELEASE,
        );
        let subject = format!("y = {height} l_f, slowly");
        let bounds = [slipped, slipped + RADIUS / 20.0];
        let quantity = "Δx/l_f, last contact";
        trial.check(
            subject,
            quantity,
            bounds,
            sources::EDGE_ELASTICA,
            opened,
            tolerances::SLIPPED,
        );
    }
    Ok(())
}

/// The paper's filament of `segments` segments that passes a cylinder or, with a negative radius, a
/// bore of `radius` (m).
fn curved(segments: usize, velocity: f64, depth: f64, radius: f64) -> Result<Settings, Failure> {
    let mut settings = paper_case(segments, velocity, depth)?;
    settings.workpiece.kind = if radius > 0.0 {
        WorkpieceKind::cylinder(radius)
    } else {
        WorkpieceKind::bore(radius.abs())
    };
    Ok(settings)
}

/// The elastica of a filament with its tip on a curved workpiece, when the tool has turned by
/// `turned` (rad) past straight downwards, in units of l_f and E I. `slopes` bounds the slope of
/// the workpiece at the tip, relative to the plane `y = 0`.
fn on_curve(settings: &Settings, radius: f64, turned: f64, slopes: [f64; 2]) -> Held {
    let (length, body) = (settings.filament.length_m, settings.tool.body_radius_m);
    let below = (body + length - settings.process.penetration_depth_m + radius) / length;
    // The frame is that of the clamp; the filament trails, and is bent to the other side.
    let centre = [below * turned.cos() - body / length, below * turned.sin()];
    let bending = bending_stiffness(&settings.filament, settings.filament.diameter_m);
    let stiffness = settings.contact.stiffness_n_m * length.powi(3) / bending;
    let circle = Circle {
        centre,
        radius: radius / length,
        stiffness,
    };
    Held::by_tip(circle, 1.0, slopes.map(|slope| FRAC_PI_2 + turned + slope))
}

/// Force of a cylinder and of a bore on the tip in slow passes: `½ E I θ′² = F_n [sin(φ + η) − sin
/// η]` with the angle η between the force and the filament's normal at the tip.
pub fn curves(trial: &mut Trial) -> TrialResult {
    // Number of segments, velocity in m/s and tolerance of the coarse solution, as for the buckled
    // elastica on a plane.
    let (segments, velocity, tolerance) = (50, 0.02, 1e-8);
    for (name, radius, depth, turned, slopes) in [
        ("cylinder of 50 mm", 0.05, 1e-3, 0.0, [-0.2, 0.0]),
        ("cylinder of 50 mm", 0.05, 2e-3, 0.0, [-0.2, 0.0]),
        ("cylinder of 50 mm", 0.05, 2e-3, 0.05, [-0.2, 0.0]),
        ("bore of 300 mm", -0.3, 1e-3, -0.05, [0.0, 0.1]),
        ("bore of 300 mm", -0.3, 2e-3, 0.0, [0.0, 0.1]),
        ("bore of 300 mm", -0.3, 2e-3, 0.1, [-0.05, 0.05]),
    ] {
        let critical = FRAC_PI_2 * FRAC_PI_2;
        let settings = curved(segments, velocity, depth, radius)?;
        let held = on_curve(&settings, radius, turned, slopes);
        let (exact, leaning) = (held.force / critical, held.slope - FRAC_PI_2 - turned);
        let bending = bending_stiffness(&settings.filament, settings.filament.diameter_m);
        let unit = critical * bending / settings.filament.length_m.powi(2);
        let at = |segments: usize, velocity: f64| {
            let mut settings = curved(segments, velocity, depth, radius)?;
            settings.solver.relative_tolerance = tolerance;
            Ok::<_, Failure>(force_at(&settings, turned - FRAC_PI_2)? / unit)
        };
        // The dampers' share is proportional to the velocity.
        let slow = |segments: usize| {
            Ok::<_, Failure>(2.0 * at(segments, velocity / 2.0)? - at(segments, velocity)?)
        };
        let computed = extrapolated(slow(segments)?, slow(2 * segments)?);
        let place = format!("tip where the surface leans by {leaning:.3} rad");
        let subject = format!(
            "{name}, a_e = {} mm, β = −π/2 + {turned}, {place}, n → ∞, v_b → 0",
            1e3 * depth
        );
        trial.check(
            subject,
            "F_n/P_cr",
            exact,
            sources::HEINRICH,
            computed,
            tolerances::CURVES,
        );
    }
    Ok(())
}
