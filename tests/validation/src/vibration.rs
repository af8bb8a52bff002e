//! Small vibrations compared with beams and ropes.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};

use bristle::equations::Chain;
use bristle::integrate::Tolerances;
use bristle::integrate::tableau::ESDIRK54;
use bristle::model::filament::{chain, first_natural_frequency};
use bristle::simulation::integrate;
use bristle::tool::ClampMotion;

use super::chains::{
    WALL, crossing, extrapolated, extrapolated_twice, paper_case, unit_chain, untouched,
    without_stiffness, worse,
};
use super::exact::beam::{cantilever_root, hanging_rope};
use super::small_motion::{Direction, modes};
use super::trial::{Failure, Trial, TrialResult, logarithmic_slope};
use super::{sources, tolerances};

/// Number of modes compared.
const MODES: usize = 5;

/// The first frequencies of a chain at rest, clamped along `x`.
fn frequencies<const N: usize>(chain: Chain<f64>, direction: Direction) -> [f64; N] {
    let modes = modes(chain, &WALL.at(0.0), 0.0, direction);
    std::array::from_fn(|i| modes.get(i).map_or(f64::NAN, |mode| mode.frequency))
}

/// First five frequencies of a cantilever, `(β_k L)²` with the roots of `cos βL cosh βL = −1`.
///
/// Chain and beam agree in and out of the plane of rotation. Orders are those between successive n.
pub fn cantilever(trial: &mut Trial) -> TrialResult {
    const COMPARED: [usize; 5] = [5, 10, 25, 50, 100];
    let exact: [f64; MODES] = std::array::from_fn(|i| cantilever_root(i + 1).powi(2));
    let at = |segments: usize, direction| frequencies::<MODES>(unit_chain(segments), direction);
    let in_plane =
        BTreeMap::from(COMPARED.map(|segments| (segments, at(segments, Direction::InPlane))));
    for (i, exact) in exact.into_iter().enumerate() {
        let computed =
            extrapolated_twice([25, 50, 100].map(|segments| in_plane[&segments][i])) / exact;
        trial.check(
            format!("mode {}, n → ∞", i + 1),
            "ω/ω_beam",
            1.0,
            sources::BEAM,
            computed,
            tolerances::FREQUENCY,
        );
        for pair in COMPARED[1..].windows(2) {
            let error = |segments: usize| (in_plane[&segments][i] / exact - 1.0).abs();
            let order = -logarithmic_slope(
                &[pair[0], pair[1]].map(|segments| (segments as f64, error(segments))),
            );
            let subject = format!("mode {}, n = {}, {}", i + 1, pair[0], pair[1]);
            trial.check(
                subject,
                "order of ω",
                2.0,
                sources::CHAIN,
                order,
                tolerances::ORDER,
            );
        }
    }
    for segments in COMPARED {
        let (lag, flap) = (in_plane[&segments], at(segments, Direction::OutOfPlane));
        let difference = (0..MODES)
            .map(|i| (flap[i] / lag[i] - 1.0).abs())
            .fold(0.0, worse);
        let subject = format!("modes 1 to 5, n = {segments}");
        let quantity = "ω out of plane over in plane − 1";
        trial.check(
            subject,
            quantity,
            0.0,
            sources::SYMMETRY,
            difference,
            tolerances::DIFFERENCES,
        );
    }
    let error = in_plane[&25][0] / exact[0] - 1.0;
    trial.check(
        "mode 1, n = 25",
        "ω/ω_beam − 1",
        -0.73e-3,
        sources::MODEL,
        error,
        tolerances::QUOTED,
    );
    Ok(())
}

/// Size of the motion, in rad.
const SIZE: f64 = 1e-3;

/// Damping ratio, and frequency over that of the beam, of the paper's filament that swings to rest
/// in its first mode.
fn swing(segments: usize, damping_ratio: f64, direction: Direction) -> Result<[f64; 2], Failure> {
    const HALF_PERIODS: usize = 8;
    let mut filament = paper_case(segments, 10.0, 1e-3)?.filament;
    filament.damping_ratio = damping_ratio;
    let chain = chain(&filament, [0.0; 3]);
    let mut system = untouched(chain.clone(), WALL);
    let mode = modes(chain, &WALL.at(0.0), 0.0, direction).swap_remove(0);
    let tip = mode.shape[segments - 1];
    let (across, q) = match direction {
        Direction::InPlane => (
            1,
            mode.shape
                .iter()
                .map(|angle| [FRAC_PI_2, SIZE * angle / tip])
                .collect(),
        ),
        Direction::OutOfPlane => (
            2,
            mode.shape
                .iter()
                .map(|angle| [FRAC_PI_2 - SIZE * angle / tip, 0.0])
                .collect(),
        ),
    };
    let start = system.state(0.0, q, vec![[0.0; 2]; segments]);
    let frequency = first_natural_frequency(&filament);
    let tolerances = Tolerances::of_motion(1e-10, SIZE, SIZE * frequency);
    let end = (HALF_PERIODS as f64 + 1.5) * PI / frequency;
    let mut extremes = Vec::new();
    integrate(&mut system, start, end, &ESDIRK54, tolerances, |step| {
        // At the start the tip is at rest, too; that point does not count.
        let turning =
            crossing(|s| step.node(segments - 1, s).1[across]).filter(|_| step.start.time > 0.0);
        if let Some(s) = turning {
            extremes.push((step.time(s), step.node(segments - 1, s).0[across].abs()));
        }
    })?;
    let [first, last] =
        [extremes.first(), extremes.get(HALF_PERIODS)].map(|extreme| extreme.copied());
    let (Some(first), Some(last)) = (first, last) else {
        return Err("the tip swings too few times".into());
    };
    let count = HALF_PERIODS as f64;
    let decrement = (first.1 / last.1).ln() / count;
    Ok([
        decrement / decrement.hypot(PI),
        count * PI / (last.0 - first.0) / frequency,
    ])
}

/// Damping ratio and frequency `ω_d = Ω_1 √(1 − ζ²)` of a filament that is released from its first
/// mode of 1 mrad, from the extremes of its tip and their times.
pub fn damping(trial: &mut Trial) -> TrialResult {
    for (damping_ratio, direction, name) in [
        (0.01, Direction::InPlane, "in the plane"),
        (0.05, Direction::InPlane, "in the plane"),
        (0.05, Direction::OutOfPlane, "out of plane"),
        (0.2, Direction::InPlane, "in the plane"),
    ] {
        let (coarse, fine) = (
            swing(25, damping_ratio, direction)?,
            swing(50, damping_ratio, direction)?,
        );
        let exact = [damping_ratio, (1.0 - damping_ratio * damping_ratio).sqrt()];
        for (i, quantity) in ["damping ratio", "ω_d/Ω_1"].into_iter().enumerate() {
            let subject = format!("ζ = {damping_ratio}, {name}, n → ∞");
            let computed = extrapolated(coarse[i], fine[i]);
            trial.check(
                subject,
                quantity,
                exact[i],
                sources::MODEL,
                computed,
                tolerances::DAMPING,
            );
        }
        let subject = format!("ζ = {damping_ratio}, {name}, n = 25");
        trial.check(
            subject,
            "damping ratio",
            exact[0],
            sources::MODEL,
            coarse[0],
            tolerances::DAMPING_25,
        );
    }
    Ok(())
}

/// Frequencies `½ j_{0,k} √(g/L)` of a hanging chain without stiffness, which is a rope.
pub fn hanging_chain(trial: &mut Trial) -> TrialResult {
    const HANGING_MODES: usize = 3;
    // The tension vanishes at the tip, where the chain is coarsest: more segments than a beam
    // needs.
    const HALF: usize = 50;
    const COARSE: usize = 100;
    const FINE: usize = 200;
    let at = |segments: usize, direction| {
        let chain = Chain {
            gravity: [1.0, 0.0, 0.0],
            ..without_stiffness(unit_chain(segments))
        };
        frequencies::<HANGING_MODES>(chain, direction)
    };
    let in_plane = BTreeMap::from(
        [HALF, COARSE, FINE].map(|segments| (segments, at(segments, Direction::InPlane))),
    );
    let out_of_plane = at(COARSE, Direction::OutOfPlane);
    for i in 0..HANGING_MODES {
        let exact = hanging_rope(i + 1);
        let computed =
            extrapolated_twice([HALF, COARSE, FINE].map(|segments| in_plane[&segments][i]));
        let subject = format!("mode {}, n → ∞", i + 1);
        trial.check(
            subject,
            "ω √(L/g)",
            exact,
            sources::BERNOULLI,
            computed,
            tolerances::FREQUENCY,
        );
        let subject = format!("mode {}, n = {}, {}", i + 1, COARSE, FINE);
        trial.check_order(
            subject,
            "order of ω",
            [in_plane[&COARSE][i], in_plane[&FINE][i]],
            exact,
        );
        let difference = (out_of_plane[i] / in_plane[&COARSE][i] - 1.0).abs();
        let subject = format!("mode {}, n = {}", i + 1, COARSE);
        let quantity = "ω out of plane over in plane − 1";
        trial.check(
            subject,
            quantity,
            0.0,
            sources::SYMMETRY,
            difference,
            tolerances::DIFFERENCES,
        );
    }
    Ok(())
}
