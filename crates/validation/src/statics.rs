//! Equilibria compared with the elastica.

use std::f64::consts::{FRAC_PI_2, PI};

use bristle::equations::Chain;
use bristle::model::filament::bending_stiffness;

use super::chains::{error_figure, extrapolated, force_at, paper_case, unit_chain};
use super::equilibrium::{Load, Shape, equilibrium};
use super::exact::elastica::{TipLoad, arc, buckled_force, hanging_tip};
use super::group::{Extent, Failure, Group};
use super::trial::{Axis, Curve, Figure, Look, Trial};
use super::{sources, tolerances};

/// The group.
pub const GROUP: Group = Group {
    title: "Statics",
    purpose: "A filament gets its force from large bending. Newton's method finds equilibria with the solver's own residual and step \
        matrix, so these cases check both without the integrator. The last case checks whole passes.",
    trials: &[tip_load, end_moment, hanging, buckled],
};

/// Numbers of segments of the two extrapolated solutions.
const COARSE: usize = 100;
const FINE: usize = 200;
/// Number of increments in which a load is applied.
const PARTS: usize = 16;

fn tip_load(_: Extent) -> Result<Trial, Failure> {
    const ALPHAS: [f64; 8] = [0.25, 0.5, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0];
    const QUANTITIES: [&str; 3] = ["w/L", "Δ/L", "tip angle in rad"];
    // Deflection, shortening and angle of the tip under a load along y, or inclined to the plane of
    // rotation.
    let bent = |segments: usize, alpha: f64, across: [f64; 3]| -> Result<[f64; 3], Failure> {
        let load = Load {
            force: across.map(|component| alpha * component),
            moment: 0.0,
        };
        let Shape {
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
    let mut trial = Trial::new(
        "Elastica under a dead load at its tip",
        "A clamped beam under a transverse dead load `P` at its tip, `α = P L²/(E I)`. With the angle φ of the tip, \
            `m = (1 + sin φ)/2` and `sin ϑ = 1/√(2m)`:\n\n\
            ```text\n√α = K(m) − F(ϑ, m)\nw/L = 1 − 2/√α · (E(m) − E(ϑ, m))\nΔ/L = 1 − √(2 sin φ/α)\n```\n\n\
            w is the deflection of the tip, Δ its displacement towards the clamp. The chain's equilibria for n = 100 and 200 \
            are extrapolated to n → ∞. A load inclined to the plane of rotation moves both φ and θ; it must bend the beam as far as \
            a load in the plane.",
    );
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
    let labels = ALPHAS.iter().step_by(2).map(|alpha| format!("α = {alpha}"));
    let title = "Deflection of the tip under a dead load";
    trial.figures.push(error_figure(
        "validation_elastica",
        title,
        labels,
        |curve, segments| {
            let alpha = ALPHAS[2 * curve];
            Ok(bent(segments, alpha, in_plane)?[0] / exact(alpha)[0] - 1.0)
        },
    )?);
    Ok(trial)
}

fn end_moment(_: Extent) -> Result<Trial, Failure> {
    const TURNS: [(f64, &str); 4] = [
        (FRAC_PI_2, "π/2"),
        (PI, "π"),
        (1.5 * PI, "3π/2"),
        (2.0 * PI, "2π"),
    ];
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
    let mut trial = Trial::new(
        "Circle under a pure end moment",
        "A moment `M` at the tip bends a beam to an arc of the angle `ϕ = M L/(E I)`, with `w/L = (1 − cos ϕ)/ϕ`; \
            `M = 2π E I/L` closes the circle. The chain is then a regular polygon that closes for every n. The joint at the clamp \
            has the stiffness 2 E I/h, half the compliance of a segment. This shows in the angle π/n of the first segment, and in \
            the order of w/L, which would otherwise be 1.",
    );
    let mut curves = Vec::new();
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
        let along = (0..=60).map(|i| f64::from(i) / 60.0);
        let exact = along
            .map(|share| arc(share * turn).map(|component| share * component))
            .map(|[x, y]| (x, y));
        curves.push(Curve::new(
            format!("arc of {name}"),
            Look::Reference,
            exact.skip(1),
        ));
        let nodes = bend(25, turn)?.nodes.into_iter().map(|[x, y, _]| (x, y));
        curves.push(Curve::new(
            format!("M = {name} E I/L, n = 25"),
            Look::Markers,
            nodes,
        ));
    }
    trial.figures.push(Figure {
        name: "validation_circle",
        title: "Filament under a pure end moment".to_owned(),
        description: "Shapes under four end moments: a quarter, a half, three quarters and a whole circle; the nodes of 25 segments \
            lie on the arcs.",
        axes: [Axis::linear("x/L"), Axis::linear("y/L")],
        curves,
    });
    for (turn, name) in &TURNS[..3] {
        let turn = *turn;
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
    Ok(trial)
}

fn hanging(_: Extent) -> Result<Trial, Failure> {
    const QUANTITIES: [&str; 2] = ["x_tip/L", "w/L"];
    let hang = |segments: usize, kappa: f64| -> Result<[f64; 2], Failure> {
        let chain = Chain {
            gravity: [0.0, -kappa, 0.0],
            ..unit_chain(segments)
        };
        let [x, y, _] = equilibrium(chain, Load::default(), PARTS)?.tip;
        Ok([x, -y])
    };
    let mut trial = Trial::new(
        "Filament hanging under gravity",
        "A beam clamped horizontally bends under its own weight, `κ = ρ A g L³/(E I)`: from κ = 0.1, where `w/L ≈ κ/8`, \
            to κ = 50, where most of it hangs straight down. The slope ψ over the arc length σ from the tip (in L) obeys\n\n\
            ```text\nψ″ = −κ σ cos ψ,   ψ′(0) = 0,   ψ(1) = 0\n```\n\n\
            This is solved to rounding, by consecutive Taylor series of 24 terms along the beam and a search for ψ(0).",
    );
    let mut courses = [Vec::new(), Vec::new()];
    for kappa in [0.1, 1.0, 5.0, 20.0, 50.0] {
        let (coarse, fine, exact) = (hang(COARSE, kappa)?, hang(FINE, kappa)?, hanging_tip(kappa));
        for (course, value) in courses.iter_mut().zip(hang(25, kappa)?) {
            course.push((kappa, value));
        }
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
    let exact = (0..=60)
        .map(|i| 0.1 * 500_f64.powf(f64::from(i) / 60.0))
        .map(|kappa| (kappa, hanging_tip(kappa)));
    let exact: Vec<(f64, [f64; 2])> = exact.collect();
    let mut curves = Vec::new();
    for (i, course) in courses.into_iter().enumerate() {
        let line = exact.iter().map(|(kappa, tip)| (*kappa, tip[i]));
        curves.push(Curve::new(
            format!("{}, heavy elastica", QUANTITIES[i]),
            Look::Reference,
            line,
        ));
        curves.push(Curve::new(
            format!("{}, n = 25", QUANTITIES[i]),
            Look::Markers,
            course,
        ));
    }
    trial.figures.push(Figure {
        name: "validation_hanging",
        title: "Tip of a filament under its own weight".to_owned(),
        description: "Position of the tip over the weight: with more weight it comes closer to the clamp and hangs lower; the chains of \
            25 segments lie on the curves.",
        axes: [Axis::logarithmic("κ = ρ A g L³/(E I)"), Axis::linear("x_tip/L, w/L")],
        curves,
    });
    Ok(trial)
}

fn buckled(extent: Extent) -> Result<Trial, Failure> {
    // Number of segments and brushing velocity in m/s of the coarse solution. The fine one has
    // twice the number and half the velocity.
    let (segments, velocity, tolerance) = extent.choose((25, 0.05, 1e-7), (50, 0.02, 1e-8));
    let mut trial = Trial::new(
        "Buckled elastica in the middle of a slow pass",
        "The paper's filament passes the workpiece so slowly that it is always in equilibrium. When its clamp points at the \
            workpiece, it is a clamped-free column that has buckled by a_e:\n\n\
            ```text\nF_n/P_cr = (2K/π)²,   (a_e − F_n/k_c)/L = 2 − 2E/K,   P_cr = π² E I/(4 L²)\n```\n\n\
            K and E are the complete elliptic integrals of the same parameter; F_n/k_c is the tip's penetration of the workpiece. \
            These are passes from start to end. By the middle, vibrations from impacts at the entry have died away. The results are \
            extrapolated from two velocities and two n.",
    );
    let (mut exact_curve, mut computed_curve) = (Vec::new(), Vec::new());
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
        exact_curve.push((f64::from(depth_mm), exact));
        computed_curve.push((f64::from(depth_mm), computed));
    }
    trial.figures.push(Figure {
        name: "validation_buckled",
        title: "Contact force where the clamp points at the workpiece".to_owned(),
        description: "Force over the buckling force, over the penetration depth from 1 to 5 mm: it rises from 1.01 to 1.07; the \
            passes lie on the curve of the elastica.",
        axes: [Axis::linear("penetration depth a_e in mm"), Axis::linear("F_n / P_cr")],
        curves: vec![
            Curve::new("buckled elastica", Look::Reference, exact_curve),
            Curve::new("passes", Look::Markers, computed_curve),
        ],
    });
    Ok(trial)
}
