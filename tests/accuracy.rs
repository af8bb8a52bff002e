//! How accurate are the metrics? Their errors over the solver's tolerance, against two codes that are stricter.

mod common;

use bristle::simulation::simulate;
use common::accuracy::{ReferenceContact, SYMBOLS, worse};

/// How far the references may be off: CVODES at a tolerance of 1e-11 and Radau at 1e-9, which differ by 1e-9 at most.
const REFERENCE: f64 = 2e-9;

/// From loose to strict; two halves, three decades apart.
const TOLERANCES: [f64; 6] = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8];

/// Bounds of the relative errors over the tolerance, in the order of [`SYMBOLS`].
///
/// A step may be wrong by the tolerance, relative to angles of 1 rad and so to the filament's length. Damping takes
/// such errors away before they add up over many steps, so the motion is wrong by about the tolerance: 3. The peak force
/// is `k_c` times a penetration, a small length: more. Times suffer most: where the tip leaves the workpiece at a speed
/// `u`, an error `e l_f` of its place is one of `e l_f/u` in time, which at 1 m/s is 40 e of the 1 ms that a contact
/// lasts. ESDIRK4(3) is a decade below each bound; another method may have another ratio of true and estimated errors.
const BOUNDS: [f64; 6] = [3.0, 3.0, 3.0, 20.0, 50.0, 50.0];

/// Between the halves of [`TOLERANCES`] errors should fall by 1e3. A method that holds the error of a step, not that of
/// the motion, falls behind a little: 0.8 of the three decades are asked for.
const FALL: f64 = 250.0;

fn reference() -> Vec<ReferenceContact> {
    ReferenceContact::read(include_str!("data/reference_contacts_cvodes.csv"))
}

#[test]
fn references_agree() {
    let radau = ReferenceContact::read(include_str!("data/reference_contacts.csv"));
    let cvodes = reference();
    assert_eq!((radau.len(), cvodes.len()), (6, 6));
    for (radau, cvodes) in radau.iter().zip(&cvodes) {
        assert_eq!(radau.case(), cvodes.case());
        assert_eq!(radau.contact_count, cvodes.contact_count);
        let distances = cvodes.distances(radau);
        assert!(distances.iter().all(|&distance| distance < REFERENCE), "{:?}: {distances:?}", cvodes.case());
    }
}

#[test]
fn errors_fall_with_the_tolerance() {
    let worst = TOLERANCES.map(|tolerance| {
        let mut worst = [0.0; 6];
        for contact in reference() {
            let (velocity, depth) = contact.case();
            let mut settings = common::case(25, velocity, depth);
            settings.solver.relative_tolerance = tolerance;
            let metrics = simulate(&settings).expect("the pass ends").metrics;
            // At 1e-3 the bound on times is 10 %, and so a short contact may come or go.
            if tolerance < 1e-3 {
                assert_eq!(metrics.contact_count, contact.contact_count, "{tolerance:e}, v_b = {velocity}");
            }
            worst = worse(worst, contact.errors(&metrics));
        }
        worst
    });
    for (tolerance, errors) in TOLERANCES.iter().zip(&worst) {
        for (metric, error) in errors.iter().enumerate() {
            let bound = BOUNDS[metric] * tolerance + REFERENCE;
            assert!(*error < bound, "{} at {tolerance:e}: {error:e} is not below {bound:e}", SYMBOLS[metric]);
        }
    }
    let (loose, strict) = worst.split_at(TOLERANCES.len() / 2);
    for (metric, symbol) in SYMBOLS.iter().enumerate() {
        let mean = |half: &[[f64; 6]]| half.iter().map(|errors| errors[metric]).product::<f64>().cbrt();
        let (before, after) = (mean(loose), mean(strict));
        assert!(after < before / FALL + REFERENCE, "{symbol} falls from {before:e} to {after:e} only");
    }
}
