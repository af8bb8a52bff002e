//! Impacts and sliding of a single rod.

use std::f64::consts::FRAC_PI_2;

use bristle::contact::ContactLaw;
use bristle::equations::Chain;
use bristle::integrate::Tolerances;
use bristle::integrate::tableau::ESDIRK54;
use bristle::simulation::{FilamentState, FilamentSystem, integral, integrate};
use bristle::workpiece::Plane;

use super::chains::{WALL, crossing, rods};
use super::exact::impact::{Elastic, restitution, sliding_distance};
use super::trial::{Failure, Trial, TrialResult};
use super::{sources, tolerances};

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
}

/// Lets the tip of the mass `mass` (kg) hit a plane at `speed` (m/s), at the relative tolerance
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
    // The motion starts a tenth of the duration before the contact. Damping makes the contact at
    // most twice as long.
    let before = 0.1 * elastic.duration();
    let start = system.state(0.0, vec![[FRAC_PI_2, speed * before]], vec![[0.0, -speed]]);
    let tolerances = Tolerances::of_motion(relative, elastic.depth(), speed);
    let (mut peak, mut closed_at, mut opened_at) = (f64::NAN, f64::NAN, f64::NAN);
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
                // Without damping, the force is largest when the tip turns back.
                if let Some(s) = crossing(|s| step.node(0, s).1[1]) {
                    let (position, velocity) = step.node(0, s);
                    let approach = law.approach(&plane, position, velocity, step.time(s));
                    peak = law.normal_force(&approach);
                }
            }
        },
    )?;
    Ok(Impact {
        restitution: end.v[0][1] / speed,
        duration: opened_at - closed_at,
        peak,
        impulse: end.integrals[integral::NORMAL_IMPULSE],
        dissipated: end.integrals[integral::CONTACT_DISSIPATION] / (0.5 * mass * speed * speed),
    })
}

/// A rod whose tip has the inertia of the mass `mass` (kg) for motion across the rod.
fn point_mass(mass: f64) -> Chain<f64> {
    // m L²/3 about the end of a slender rod.
    rods(1, 3.0 * mass, 3.0 * mass / 12.0, [0.0; 3])
}

/// Restitution `e` of a point mass under the law of Hunt and Crossley: `(1 + e) χv = ln[(1 + χv)/(1
/// − e χv)]` for any stiffness, exponent and mass. The contact takes the share `1 − e²` of the
/// energy.
pub fn restitutions(trial: &mut Trial) -> TrialResult {
    const SPEED: f64 = 2.0;
    for exponent in [1.0, 1.5] {
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
        }
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
    trial.check_slopes(courses, 0.0);
    Ok(())
}

/// Duration, peak force and impulse of an impact without damping, on `F_n = k_c δ^p`.
pub fn elastic(trial: &mut Trial) -> TrialResult {
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
    }
    Ok(())
}

/// Distance and energy of a tip that friction stops, with the regularisation `v/√(v² + v_reg²)`.
///
/// The tip of a level rod bears half of its weight: `a = µ F_n L²/I`.
pub fn sliding(trial: &mut Trial) -> TrialResult {
    const GRAVITY: f64 = 9.81;
    const MASS: f64 = 2.0;
    const STIFFNESS: f64 = 1e6;
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
        let (end, _) = integrate(&mut system, start, end_time, &ESDIRK54, tolerances, |_| ())?;
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
    Ok(())
}
