//! Impacts and sliding of a single rod.

use std::f64::consts::{FRAC_PI_2, PI};

use bristle::contact::ContactLaw;
use bristle::equations::Chain;
use bristle::integrate::Tolerances;
use bristle::integrate::tableau::ESDIRK54;
use bristle::simulation::{FilamentState, FilamentSystem, integral, integrate};
use bristle::workpiece::Plane;

use super::chains::{WALL, crossing, rods};
use super::exact::impact::{Elastic, restitution, sliding_distance};
use super::group::{Extent, Failure, Group};
use super::trial::{Axis, Curve, Figure, Look, Trial};
use super::{sources, tolerances};

/// The group.
pub const GROUP: Group = Group {
    title: "Impact",
    purpose: "The contact law and the location of its events, on a single rod that turns about a fixed point at x = 0 and whose \
        tip, at x = 1 m, meets a plane. Penetrations are so small that the tip moves along a straight line. It acts as a point \
        mass, the moment of inertia divided by the square of the length.",
    trials: &[restitutions, elastic, sliding],
};

/// A law without friction.
fn law(stiffness: f64, exponent: f64, damping: f64) -> ContactLaw {
    ContactLaw {
        stiffness,
        exponent,
        damping,
        radius: 0.0,
        friction: 0.0,
        regularisation: 1e-3,
    }
}

/// Relative tolerance of the impacts.
const RELATIVE: f64 = 1e-10;

/// The observed impact of a rod's tip.
struct Impact {
    /// Speed of the tip after the impact, over its speed before.
    restitution: f64,
    /// Time in contact in s.
    duration: f64,
    /// Force in N at the instant at which the tip turns back.
    peak: f64,
    /// `∫ F_n dt` in N s.
    impulse: f64,
    /// Energy taken by the contact, over the kinetic energy before.
    dissipated: f64,
    /// Force in N over the time in s since the contact began.
    force: Vec<(f64, f64)>,
}

/// The tip of the mass `mass` (kg) hits a plane at `speed` (m/s), at the relative tolerance
/// `relative`.
fn hit(law: ContactLaw, mass: f64, speed: f64, relative: f64) -> Result<Impact, Failure> {
    let plane = Plane::new([0.0; 3], [0.0, 1.0, 0.0], [0.0; 3]);
    let mut system = FilamentSystem::new(point_mass(mass), WALL, law, plane, true);
    let elastic = Elastic {
        mass,
        speed,
        stiffness: law.stiffness,
        exponent: law.exponent,
    };
    // Starts a tenth of the duration before the contact. Damping makes the contact at most twice as
    // long.
    let before = 0.1 * elastic.duration();
    let start = system.state(0.0, vec![[FRAC_PI_2, speed * before]], vec![[0.0, -speed]]);
    let tolerances = Tolerances::of_motion(relative, elastic.depth(), speed);
    let (mut peak, mut closed_at, mut opened_at, mut force) =
        (f64::NAN, f64::NAN, f64::NAN, Vec::new());
    let (end, _) = integrate(
        &mut system,
        start,
        4.0 * elastic.duration(),
        &ESDIRK54,
        tolerances,
        |step| {
            if step.closed[0] {
                if closed_at.is_nan() {
                    closed_at = step.start.time;
                }
                opened_at = step.end.time;
                let at = |s: f64| {
                    let (position, velocity) = step.node(0, s);
                    law.normal_force(&law.approach(&plane, position, velocity, step.time(s)))
                };
                // Without damping, the force is largest when the tip turns back.
                if let Some(s) = crossing(|s| step.node(0, s).1[1]) {
                    peak = at(s);
                }
                force.push((step.end.time - closed_at, at(1.0)));
            }
        },
    )?;
    Ok(Impact {
        restitution: end.v[0][1] / speed,
        duration: opened_at - closed_at,
        peak,
        impulse: end.integrals[integral::NORMAL_IMPULSE],
        dissipated: end.integrals[integral::CONTACT_DISSIPATION] / (0.5 * mass * speed * speed),
        force,
    })
}

/// A rod whose tip has the inertia of the mass `mass` (kg) for motion across the rod.
fn point_mass(mass: f64) -> Chain<f64> {
    // m L²/3 about the end of a slender rod.
    rods(1, 3.0 * mass, 3.0 * mass / 12.0, [0.0; 3])
}

fn restitutions(_: Extent) -> Result<Trial, Failure> {
    let mut trial = Trial::new(
        "Restitution under the law of Hunt and Crossley",
        "A point mass that hits `F_n = k_c δ^p (1 + χ δ̇)` at the speed v leaves at e v with\n\n\
            ```text\n(1 + e) χv = ln[(1 + χv)/(1 − e χv)]\n```\n\n\
            for any stiffness, exponent and mass. The contact takes the share `1 − e²` of the energy, which the solver \
            integrates together with the motion.",
    );
    let mut curves = Vec::new();
    const SPEED: f64 = 2.0;
    for exponent in [1.0, 1.5] {
        let mut points = Vec::new();
        for chi_v in [0.05, 0.1, 0.2, 0.5, 1.0, 1.5, 2.0] {
            let impact = hit(law(1e7, exponent, chi_v / SPEED), 0.01, SPEED, RELATIVE)?;
            let exact = restitution(chi_v);
            let subject = format!("χv = {chi_v}, p = {exponent}");
            let (source, tolerance) = (sources::HUNT_CROSSLEY, tolerances::IMPACT);
            trial.check(&subject, "e", exact, source, impact.restitution, tolerance);
            trial.check(
                subject,
                "energy taken",
                1.0 - exact * exact,
                source,
                impact.dissipated,
                tolerance,
            );
            points.push((chi_v, impact.restitution));
        }
        curves.push(Curve::new(
            format!("rod, p = {exponent}"),
            Look::Markers,
            points,
        ));
    }
    for (stiffness, exponent, mass) in [
        (1e5, 1.0, 0.01),
        (1e9, 1.0, 0.01),
        (1e7, 1.0, 1.0),
        (1e9, 1.5, 1e-4),
    ] {
        let impact = hit(law(stiffness, exponent, 0.5 / SPEED), mass, SPEED, RELATIVE)?;
        let subject = format!("χv = 0.5, k_c = {stiffness:e}, p = {exponent}, m = {mass} kg");
        trial.check(
            subject,
            "e",
            restitution(0.5),
            sources::HUNT_CROSSLEY,
            impact.restitution,
            tolerances::IMPACT,
        );
    }
    let exact = (1..=100)
        .map(|i| 0.02 * f64::from(i))
        .map(|chi_v| (chi_v, restitution(chi_v)));
    curves.push(Curve::new("Hunt and Crossley", Look::Reference, exact));
    trial.figures.push(Figure {
        name: "validation_restitution",
        title: "Restitution of an impact".to_owned(),
        description: "Restitution over χ times the speed: it falls from 1 to 0.41, and impacts with p = 1 and p = 1.5 lie on one \
            curve.",
        axes: [Axis::linear("χ v"), Axis::linear("restitution e")],
        curves,
    });
    let mut courses = Vec::new();
    for exponent in [1.0, 1.5] {
        let mut course = Vec::new();
        for relative in [1e-4, 1e-5, 1e-6, 1e-7, 1e-8] {
            let impact = hit(law(1e9, exponent, 0.5 / SPEED), 0.01, SPEED, relative)?;
            course.push((
                relative,
                (impact.restitution / restitution(0.5) - 1.0).abs(),
            ));
        }
        courses.push((format!("e at χv = 0.5, p = {exponent}"), course));
    }
    let title = "Relative error of the restitution";
    trial.study_tolerance("validation_restitution_tolerance", title, courses, 0.0);
    Ok(trial)
}

fn elastic(_: Extent) -> Result<Trial, Failure> {
    let mut trial = Trial::new(
        "Duration and peak force without damping",
        "On `F_n = k_c δ^p` the mass m turns back at `δ_max = ((p+1) m v²/(2 k_c))^(1/(p+1))`, when all its energy is in the \
            contact, after\n\n\
            ```text\nT/2 = δ_max/v ∫ dx/√(1 − x^(p+1)) = δ_max/v · √π Γ(1 + 1/(p+1))/Γ(½ + 1/(p+1))\n```\n\n\
            This gives `T = π √(m/k_c)` for p = 1 and `T = 2.94 δ_max/v` for Hertz's p = 1.5. The impulse is 2 m v.",
    );
    let mut curves = Vec::new();
    for (exponent, stiffness, mass, speed) in [
        (1.0, 1e7, 0.1, 0.01),
        (1.0, 1e9, 1e-3, 1.0),
        (1.5, 1e10, 0.01, 1.0),
        (1.5, 1e9, 0.1, 0.1),
        (2.0, 1e12, 0.01, 1.0),
    ] {
        let exact = Elastic {
            mass,
            speed,
            stiffness,
            exponent,
        };
        let impact = hit(law(stiffness, exponent, 0.0), mass, speed, RELATIVE)?;
        let subject =
            format!("p = {exponent}, k_c = {stiffness:e}, m = {mass} kg, v = {speed} m/s");
        for (quantity, exact, computed) in [
            ("duration in s", exact.duration(), impact.duration),
            ("max F_n in N", exact.peak(), impact.peak),
            ("∫ F_n dt in N s", 2.0 * mass * speed, impact.impulse),
            ("e", 1.0, impact.restitution),
        ] {
            trial.check(
                &subject,
                quantity,
                exact,
                sources::JOHNSON,
                computed,
                tolerances::IMPACT,
            );
        }
        if speed == 1.0 {
            let scaled = impact
                .force
                .iter()
                .map(|(time, force)| (time / exact.duration(), force / exact.peak()));
            curves.push(Curve::new(format!("p = {exponent}"), Look::Line, scaled));
        }
    }
    let sine = (0..=100)
        .map(|i| f64::from(i) / 100.0)
        .map(|time| (time, (PI * time).sin()));
    curves.push(Curve::new("sin(π t/T)", Look::Reference, sine));
    trial.figures.push(Figure {
        name: "validation_impact",
        title: "Force in an impact without damping".to_owned(),
        description: "Force over its peak, over the time in contact: half a sine wave for p = 1, and steeper bell curves with flatter \
            ends for larger p.",
        axes: [Axis::linear("t/T"), Axis::linear("F_n over its peak")],
        curves,
    });
    Ok(trial)
}

fn sliding(_: Extent) -> Result<Trial, Failure> {
    const GRAVITY: f64 = 9.81;
    const MASS: f64 = 2.0;
    const STIFFNESS: f64 = 1e6;
    let mut trial = Trial::new(
        "Sliding to rest under Coulomb friction",
        "The tip of a level rod bears half the weight of the rod, and slides on a plane until friction stops it. With the \
            deceleration `a = µ F_n L²/I` and the regularisation `v/√(v² + v_reg²)` the distance is\n\n\
            ```text\n∫ √(v² + v_reg²) dv/a = [v √(v² + v_reg²) + v_reg² arsinh(v/v_reg)]/(2a)  →  v²/(2a)\n```\n\n\
            Friction takes all of the energy.",
    );
    let mut curves = Vec::new();
    for (friction, speed, regularisation) in [
        (0.1, 1.0, 1e-3),
        (0.4, 2.0, 1e-3),
        (0.4, 2.0, 1e-4),
        (0.3, 0.5, 0.05),
    ] {
        // The tip bears half the weight. The plane is so high that the rod is level at the
        // penetration that this takes.
        let normal = MASS * GRAVITY / 2.0;
        let plane = Plane::new([0.0, 0.0, normal / STIFFNESS], [0.0, 0.0, 1.0], [0.0; 3]);
        let law = ContactLaw {
            friction,
            regularisation,
            ..law(STIFFNESS, 1.0, 0.0)
        };
        let chain = rods(1, MASS, MASS / 12.0, [0.0, 0.0, -GRAVITY]);
        let inertia = MASS / 3.0;
        let deceleration = friction * normal / inertia;
        let mut system = FilamentSystem::new(chain, WALL, law, plane, true);
        let start: FilamentState = system.state(0.0, vec![[FRAC_PI_2, 0.0]], vec![[0.0, speed]]);
        let tolerances = Tolerances::of_motion(1e-9, 1.0, speed);
        // In the end the speed decays with the time constant v_reg/a.
        let end_time = (speed + 40.0 * regularisation) / deceleration;
        let mut course = vec![(0.0, speed)];
        let (end, _) = integrate(
            &mut system,
            start,
            end_time,
            &ESDIRK54,
            tolerances,
            |step| {
                course.push((step.end.time, step.end.v[0][1]));
            },
        )?;
        if regularisation != 1e-4 {
            let stop = speed / deceleration;
            let coulomb = vec![(0.0, speed), (stop, 0.0), (end_time, 0.0)];
            curves.push(Curve::new(
                format!("µ = {friction}, v − a t"),
                Look::Reference,
                coulomb,
            ));
            let name = format!("µ = {friction}, v_reg = {regularisation} m/s");
            curves.push(Curve::new(
                name,
                Look::Markers,
                course.into_iter().step_by(5),
            ));
        }
        let subject = format!("µ = {friction}, v = {speed} m/s, v_reg = {regularisation} m/s");
        let exact = sliding_distance(speed, deceleration, regularisation);
        let coulomb = speed * speed / (2.0 * deceleration);
        let energy = 0.5 * inertia * speed * speed;
        let taken = end.integrals[integral::CONTACT_DISSIPATION];
        let (source, tolerance) = (sources::COULOMB, tolerances::SLIDING);
        trial.check(
            &subject,
            "distance in m",
            exact,
            source,
            end.q[0][1],
            tolerance,
        );
        trial.check(
            &subject,
            "energy taken in J",
            energy,
            source,
            taken,
            tolerance,
        );
        if regularisation < 1e-3 * speed {
            trial.check(
                subject,
                "distance in m, v_reg → 0",
                coulomb,
                source,
                end.q[0][1],
                tolerances::REGULARISATION,
            );
        }
    }
    trial.figures.push(Figure {
        name: "validation_sliding",
        title: "Speed of a tip that friction stops".to_owned(),
        description: "Speed over time: straight lines to zero if the regularisation is small, and a rounded end if it is a tenth of \
            the speed.",
        axes: [Axis::linear("time t in s"), Axis::linear("speed of the tip in m/s")],
        curves,
    });
    Ok(trial)
}
