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
    SEGMENTS, WALL, crossing, error_figure, extrapolated, extrapolated_twice, paper_case,
    unit_chain, untouched, without_stiffness, worse,
};
use super::exact::beam::{cantilever_root, hanging_rope};
use super::group::{Extent, Failure, Group};
use super::small_motion::{Direction, modes};
use super::trial::{Axis, Curve, Figure, Look, Trial, logarithmic_slope};
use super::{sources, tolerances};

/// The group.
pub const GROUP: Group = Group {
    title: "Vibration",
    purpose: "Between its contacts a filament vibrates. Frequencies come from the solver's linearised equations: `M` is the \
        derivative of the residual with respect to the accelerations, `K` that with respect to the coordinates. The damping ratio \
        is measured in the time domain.",
    trials: &[cantilever, damping, hanging_chain],
};

/// Number of modes compared.
const MODES: usize = 5;

/// The first frequencies of a chain at rest, clamped along `x`.
fn frequencies<const N: usize>(chain: Chain<f64>, direction: Direction) -> [f64; N] {
    let modes = modes(chain, &WALL.at(0.0), 0.0, direction);
    std::array::from_fn(|i| modes.get(i).map_or(f64::NAN, |mode| mode.frequency))
}

fn cantilever(_: Extent) -> Result<Trial, Failure> {
    const COMPARED: [usize; 5] = [5, 10, 25, 50, 100];
    let exact: [f64; MODES] = std::array::from_fn(|i| cantilever_root(i + 1).powi(2));
    let at = |segments: usize, direction| frequencies::<MODES>(unit_chain(segments), direction);
    let in_plane =
        BTreeMap::from(SEGMENTS.map(|segments| (segments, at(segments, Direction::InPlane))));
    let mut trial = Trial::new(
        "First five frequencies of a cantilever",
        "`ω_k = (β_k L)² √(E I/(ρ A L⁴))` with the roots of `cos βL cosh βL = −1`. In the plane of rotation (θ) and out \
            of it (φ) the chain behaves the same. The ends of its segments lie on the beam, so frequencies converge from below, and \
            their errors fall as n⁻². Orders are those between successive n from 10 on; the extrapolation is from n = 25, 50 and 100.",
    );
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
    let labels = (1..=MODES).map(|mode| format!("mode {mode}"));
    let title = "Frequencies of the clamped chain against the beam";
    trial.figures.push(error_figure(
        "validation_cantilever",
        title,
        labels,
        |mode, segments| Ok(in_plane[&segments][mode] / exact[mode] - 1.0),
    )?);
    Ok(trial)
}

/// Size of the motion, in rad.
const SIZE: f64 = 1e-3;

/// The result of a filament that swings to rest.
struct Swing {
    /// Damping ratio, and frequency over that of the beam.
    result: [f64; 2],
    /// Extremes of the tip, over the first deflection, over the time in periods of the beam.
    extremes: Vec<(f64, f64)>,
}

/// Lets the paper's filament swing to rest in its first mode, with this number of segments and
/// damping ratio.
fn swing(segments: usize, damping_ratio: f64, direction: Direction) -> Result<Swing, Failure> {
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
    let (mut extremes, mut first_deflection) = (Vec::new(), f64::NAN);
    integrate(&mut system, start, end, &ESDIRK54, tolerances, |step| {
        if step.start.time == 0.0 {
            first_deflection = step.node(segments - 1, 0.0).0[across].abs();
        }
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
        return Err(Failure::Reference(format!(
            "the tip has only swung {} times",
            extremes.len()
        )));
    };
    let count = HALF_PERIODS as f64;
    let decrement = (first.1 / last.1).ln() / count;
    let result = [
        decrement / decrement.hypot(PI),
        count * PI / (last.0 - first.0) / frequency,
    ];
    let extremes = extremes
        .into_iter()
        .map(|(time, size)| (time * frequency / (2.0 * PI), size / first_deflection));
    Ok(Swing {
        result,
        extremes: extremes.collect(),
    })
}

fn damping(_: Extent) -> Result<Trial, Failure> {
    let mut trial = Trial::new(
        "Damping ratio of the first mode",
        "The paper's filament is released from its first mode, of 1 mrad, and swings to rest. The extremes of its tip and \
            their times give the logarithmic decrement, and thus ζ, and the frequency `ω_d = Ω_1 √(1 − ζ²)`. As the dampers are \
            proportional to the springs, the chain's damping ratio is off by as much as its frequency: 0.073 % at n = 25.",
    );
    let mut curves = Vec::new();
    for (damping_ratio, direction, name) in [
        (0.01, Direction::InPlane, "in the plane"),
        (0.05, Direction::InPlane, "in the plane"),
        (0.05, Direction::OutOfPlane, "out of plane"),
        (0.2, Direction::InPlane, "in the plane"),
    ] {
        let (paper, fine) = (
            swing(25, damping_ratio, direction)?,
            swing(50, damping_ratio, direction)?,
        );
        let (coarse, fine) = (paper.result, fine.result);
        if direction == Direction::InPlane {
            let periods = (0..=50).map(|i| 0.1 * f64::from(i));
            let envelope =
                periods.map(|periods| (periods, (-damping_ratio * 2.0 * PI * periods).exp()));
            curves.push(Curve::new(
                format!("exp(−{damping_ratio} Ω_1 t)"),
                Look::Reference,
                envelope,
            ));
            curves.push(Curve::new(
                format!("ζ = {damping_ratio}, n = 25"),
                Look::Markers,
                paper.extremes,
            ));
        }
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
    trial.figures.push(Figure {
        name: "validation_damping",
        title: "Extremes of the tip of a filament that swings to rest".to_owned(),
        description: "Extremes over time, falling on straight lines of three slopes, one for each damping ratio.",
        axes: [
            Axis::linear("time in periods of the undamped beam"),
            Axis::logarithmic("deflection of the tip over the first"),
        ],
        curves,
    });
    Ok(trial)
}

fn hanging_chain(_: Extent) -> Result<Trial, Failure> {
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
    let mut trial = Trial::new(
        "Hanging chain without stiffness",
        "For `E I → 0` weight alone restores the filament: a rope with the frequencies `ω_k = ½ j_{0,k} √(g/L)`, half the \
            zeros of the Bessel function J₀. Rigid segments under tension approach it with an error of order n⁻².",
    );
    let in_plane =
        BTreeMap::from(SEGMENTS.map(|segments| (segments, at(segments, Direction::InPlane))));
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
    let labels = (1..=HANGING_MODES).map(|mode| format!("mode {mode}"));
    let title = "Frequencies of the hanging chain against the rope";
    trial.figures.push(error_figure(
        "validation_hanging_chain",
        title,
        labels,
        |mode, segments| Ok(in_plane[&segments][mode] / hanging_rope(mode + 1) - 1.0),
    )?);
    Ok(trial)
}
