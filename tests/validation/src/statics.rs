//! Equilibria compared with the elastica.

use std::f64::consts::{FRAC_PI_2, PI};

use bristle::equations::Chain;
use bristle::model::filament::bending_stiffness;

use super::chains::{extrapolated, force_at, paper_case, unit_chain};
use super::equilibrium::{Load, RestingChain, equilibrium};
use super::exact::elastica::{TipLoad, arc, buckled_force, hanging_tip};
use super::trial::{Failure, Trial, TrialResult};
use super::{sources, tolerances};

/// Numbers of segments of the two extrapolated solutions.
const COARSE: usize = 100;
const FINE: usize = 200;
/// Number of increments in which a load is applied.
const PARTS: usize = 16;

/// Deflection `w`, displacement towards the clamp and angle of the tip under a transverse dead load
/// `P`, for `α = P L²/(E I)`, extrapolated to n → ∞.
///
/// A load that is inclined to the plane of rotation moves both φ and θ. It must bend the beam as
/// far.
pub fn tip_load(trial: &mut Trial) -> TrialResult {
    const ALPHAS: [f64; 8] = [0.25, 0.5, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0];
    const QUANTITIES: [&str; 3] = ["w/L", "Δ/L", "tip angle in rad"];
    // Deflection, shortening and angle of the tip under a load along y, or inclined to the plane of
    // rotation.
    let bent = |segments: usize, alpha: f64, across: [f64; 3]| -> Result<[f64; 3], Failure> {
        let load = Load {
            force: across.map(|component| alpha * component),
            moment: 0.0,
        };
        let RestingChain {
            tip: [x, y, z],
            last: [polar, azimuth],
            ..
        } = equilibrium(unit_chain(segments), load, PARTS)?;
        Ok([y.hypot(z), 1.0 - x, (polar.sin() * azimuth.cos()).acos()])
    };
    let exact = |alpha: f64| {
        let TipLoad {
            deflection,
            shortening,
            angle,
        } = TipLoad::new(alpha);
        [deflection, shortening, angle]
    };
    let (in_plane, inclined) = ([0.0, 1.0, 0.0], [0.0, 0.6, 0.8]);
    for alpha in ALPHAS {
        let (coarse, fine, exact) = (
            bent(COARSE, alpha, in_plane)?,
            bent(FINE, alpha, in_plane)?,
            exact(alpha),
        );
        for i in 0..3 {
            let subject = format!("α = {alpha}, n → ∞");
            let computed = extrapolated(coarse[i], fine[i]);
            trial.check(
                subject,
                QUANTITIES[i],
                exact[i],
                sources::BISSHOPP,
                computed,
                tolerances::STATICS,
            );
        }
        trial.check_order(
            format!("α = {alpha}, n = {COARSE}, {FINE}"),
            "order of w",
            [coarse[0], fine[0]],
            exact[0],
        );
        let subject = format!("α = {alpha}, n → ∞, load inclined");
        let computed = extrapolated(
            bent(COARSE, alpha, inclined)?[0],
            bent(FINE, alpha, inclined)?[0],
        );
        trial.check(
            subject,
            "w/L",
            exact[0],
            sources::BISSHOPP,
            computed,
            tolerances::STATICS,
        );
    }
    Ok(())
}

/// Arc of the angle `ϕ = M L/(E I)` under an end moment, with `w/L = (1 − cos ϕ)/ϕ`.
///
/// At `M = 2π E I/L` the chain is a closed regular polygon for every n. The joint at the clamp has
/// the stiffness `2 E I/h`. It shows in the angle π/n of the first segment, and in the order of
/// `w/L`.
pub fn end_moment(trial: &mut Trial) -> TrialResult {
    const TURNS: [(f64, &str); 3] = [(FRAC_PI_2, "π/2"), (PI, "π"), (1.5 * PI, "3π/2")];
    let bend = |segments: usize, turn: f64| {
        equilibrium(
            unit_chain(segments),
            Load {
                force: [0.0; 3],
                moment: turn,
            },
            4 * PARTS,
        )
    };
    let tip =
        |segments: usize, turn: f64| -> Result<[f64; 3], Failure> { Ok(bend(segments, turn)?.tip) };
    for segments in [5, 25, 100] {
        let nodes = bend(segments, 2.0 * PI)?.nodes;
        let ([x, y, _], [first_x, first_y, _]) = (nodes[segments - 1], nodes[0]);
        for (quantity, exact, computed) in [
            ("gap/L", 0.0, x.hypot(y)),
            (
                "angle of the first segment in rad",
                PI / segments as f64,
                first_y.atan2(first_x),
            ),
        ] {
            let subject = format!("M = 2π E I/L, n = {segments}");
            trial.check(
                subject,
                quantity,
                exact,
                sources::EXACT,
                computed,
                tolerances::ROUNDING,
            );
        }
    }
    for (turn, name) in TURNS {
        let exact = arc(turn)[1];
        let (coarse, fine) = (tip(COARSE, turn)?[1], tip(FINE, turn)?[1]);
        let computed = extrapolated(coarse, fine);
        trial.check(
            format!("M = {name} E I/L, n → ∞"),
            "w/L",
            exact,
            sources::EXACT,
            computed,
            tolerances::STATICS,
        );
        trial.check_order(
            format!("M = {name} E I/L, n = {COARSE}, {FINE}"),
            "order of w",
            [coarse, fine],
            exact,
        );
    }
    Ok(())
}

/// Tip of a beam that is clamped horizontally and bends under its own weight, from `κ = 0.1`, where
/// `w/L ≈ κ/8`, to `κ = 50`, with `κ = ρ A g L³/(E I)`.
pub fn hanging(trial: &mut Trial) -> TrialResult {
    const QUANTITIES: [&str; 2] = ["x_tip/L", "w/L"];
    let hang = |segments: usize, kappa: f64| -> Result<[f64; 2], Failure> {
        let chain = Chain {
            gravity: [0.0, -kappa, 0.0],
            ..unit_chain(segments)
        };
        let [x, y, _] = equilibrium(chain, Load::default(), PARTS)?.tip;
        Ok([x, -y])
    };
    for kappa in [0.1, 1.0, 5.0, 20.0, 50.0] {
        let (coarse, fine, exact) = (hang(COARSE, kappa)?, hang(FINE, kappa)?, hanging_tip(kappa));
        for i in 0..2 {
            let subject = format!("κ = {kappa}, n → ∞");
            let computed = extrapolated(coarse[i], fine[i]);
            trial.check(
                subject,
                QUANTITIES[i],
                exact[i],
                sources::HEAVY_ELASTICA,
                computed,
                tolerances::STATICS,
            );
        }
        trial.check_order(
            format!("κ = {kappa}, n = {COARSE}, {FINE}"),
            "order of w",
            [coarse[1], fine[1]],
            exact[1],
        );
    }
    Ok(())
}

/// Force where the clamp points at the workpiece, in passes so slow that they are quasi-static.
///
/// The filament is a clamped-free column that has buckled by `a_e − F_n/k_c`. Vibrations of the
/// entry have decayed. Results are extrapolated from two velocities and two n.
pub fn buckled(trial: &mut Trial) -> TrialResult {
    // Number of segments and brushing velocity in m/s of the coarse solution. The fine one has
    // twice the number and half the velocity.
    let (segments, velocity, tolerance) = (50, 0.02, 1e-8);
    for depth_mm in 1..=5 {
        let depth = f64::from(depth_mm) * 1e-3;
        let settings = paper_case(segments, velocity, depth)?;
        let (filament, length) = (&settings.filament, settings.filament.length_m);
        let critical =
            (FRAC_PI_2 / length).powi(2) * bending_stiffness(filament, filament.diameter_m);
        let exact = buckled_force(
            depth / length,
            settings.contact.stiffness_n_m * length / critical,
        );
        let at = |segments: usize, velocity: f64| {
            let mut settings = paper_case(segments, velocity, depth)?;
            settings.solver.relative_tolerance = tolerance;
            force_at(&settings, -FRAC_PI_2)
        };
        let slow = |segments: usize| -> Result<f64, Failure> {
            // The dampers' share is proportional to the velocity.
            Ok(2.0 * at(segments, velocity / 2.0)? - at(segments, velocity)?)
        };
        let computed = extrapolated(slow(segments)?, slow(2 * segments)?) / critical;
        let subject = format!("a_e = {depth_mm} mm, n → ∞, v_b → 0");
        trial.check(
            subject,
            "F_n/P_cr",
            exact,
            sources::TIMOSHENKO,
            computed,
            tolerances::QUASI_STATICS,
        );
    }
    Ok(())
}
