//! The balance of the energies of a pass: what its dynamics do, against what its states and the
//! geometry of its contacts say.
//!
//! In the frame of the body, which turns at the constant rate `ω` about `z`, the energy of a
//! filament is `H = E_kin + E_spring + E_grav − ω L` with its angular momentum `L` about the axis.
//! The clamp does no work there, and over a pass
//!
//! `ΔH + E_contact + ∫ 2D dt + W_contact = ∫ F·v_w dt − ω ∫ (M_contact + M_grav) dt`
//!
//! with the losses `W_contact` to friction and contact damping, the velocity `v_w` of the
//! workpiece, and moments `M` about the axis: the work of the clamp has been replaced by `ω` times
//! its angular impulse, which is the change of `L` less the other angular impulses. So the balance
//! holds only if the impulses are those of the motion, too. Energies are those of the final state,
//! and `E_contact` is that of all points inside the workpiece there. The contact force does no
//! other work than the change of that energy if, and only if, no opening or closing was missed: a
//! contact that closes when it is already `δ` inside, gives `½ k_c δ²` to the filament.
//!
//! Where the clamp moves otherwise, its work is integrated instead, at the cost of another residual
//! per stage.

use super::form::Equations;
use super::observers::ContactObserver;
use super::step::at_knots;
use super::system::{Filament, integral};
use super::trajectory::Trajectory;
use crate::contact::Approach;
use crate::equations::linear::{add, dot, scale, sub};
use crate::equations::{ChainDynamics, Clamp, PolarAxis};
use crate::tool::{ClampMotion, Tool, Turning};
use crate::workpiece::Workpiece;

/// The largest relative residual of a pass whose tolerance is no looser than a tenth of it.
pub(super) const LARGEST_RESIDUAL: f64 = 1e-3;
/// The part of the kinetic energy at the start, per relative tolerance, below which energies are
/// not resolved.
const RESOLUTION: f64 = 1e3;
/// Angles of a turn at which a clamp is looked at.
const LOOKS: usize = 16;

/// Whether the clamp turns rigidly about `z`.
pub(super) fn turns_rigidly<T: Tool, W>(filament: &Filament<Turning<T>, W>) -> bool {
    /// Deviations of the velocities, as parts of themselves, that are rounding.
    const ROUNDING: f64 = 1e-9;
    let Turning {
        tool,
        rate,
        initial_angle,
    } = &filament.motion;
    let turned = |[x, y, _]: [f64; 3], [u, v, w]: [f64; 3]| {
        let deviation = [u + rate * y, v - rate * x, w];
        dot(deviation, deviation) <= (ROUNDING * rate).powi(2) * (x * x + y * y)
    };
    // Not evenly, so that a motion that repeats within a turn is seen.
    let rigid = |look: usize| {
        let angle = initial_angle + 0.618 * look as f64;
        let Clamp {
            position,
            velocity,
            direction,
            direction_rate,
            ..
        } = tool.clamp(angle, *rate);
        turned(position, velocity) && turned(direction, direction_rate)
    };
    (0..LOOKS).all(rigid)
}

/// What is missing in the balance of the energies of a `filament` that has gone along `trajectory`
/// from the coordinates and rates `start` about `z`, relative to the sum of the sizes of its terms.
/// `relative` is its tolerance. With `tracks_energy` the work of the clamp has been integrated.
pub(super) fn energy_residual<T: Tool, W: Workpiece>(
    filament: &Filament<Turning<T>, W>,
    equations: &mut Equations<f64>,
    start: &[Vec<[f64; 2]>; 2],
    relative: f64,
    observer: &ContactObserver<Turning<T>, W>,
    trajectory: &Trajectory,
    tracks_energy: bool,
) -> f64 {
    let end = trajectory.start();
    let integrals = &end.integrals;
    let [q, v] = start;
    let (start_energy, start_momentum) = energy(filament, equations, 0.0, PolarAxis::Z, q, v);
    let (end_energy, end_momentum) =
        energy(filament, equations, end.time, end.chart, &end.q, &end.v);
    // That of the contacts which took over from others is theirs.
    let stored = contact_energy(filament, trajectory) - trajectory.taken_over();
    let losses = integrals[integral::JOINT_DISSIPATION] + integrals[integral::CONTACT_DISSIPATION];
    let rate = filament.motion.rate;
    let resolved = start_energy[0] * (RESOLUTION * relative).min(1.0);
    let change = |energy: [f64; 2], momentum: f64| energy[0] + energy[1] - momentum;
    let (terms, size) = if tracks_energy {
        let rise = change(end_energy, 0.0) - change(start_energy, 0.0);
        let work = integrals[integral::WORK];
        (
            [rise, stored, losses, -work, 0.0],
            rise.abs() + stored.abs() + losses.abs() + work.abs(),
        )
    } else {
        let rise =
            change(end_energy, rate * end_momentum) - change(start_energy, rate * start_momentum);
        let tip = trajectory.nodes()[filament.chain.segments() - 1].value;
        let velocity = filament.workpiece.surface(tip, end.time).velocity;
        let impulse = std::array::from_fn(|i| integrals[integral::IMPULSE + i]);
        let translates = filament.workpiece.translates();
        let work = if translates {
            dot(velocity, impulse)
        } else {
            integrals[integral::WORK]
        };
        let turning = rate * (integrals[integral::ANGULAR_IMPULSE] + observer.gravity_impulse());
        (
            [rise, stored, losses, -work, turning],
            rise.abs() + stored.abs() + losses.abs() + work.abs() + turning.abs(),
        )
    };
    let residual: f64 = terms.iter().sum();
    if residual == 0.0 {
        0.0
    } else {
        residual.abs() / (size + resolved)
    }
}

/// `[E_kin, E_spring + E_grav]` in J and the angular momentum about `z` in N m s of a filament at a
/// state.
fn energy<M: ClampMotion, W>(
    filament: &Filament<M, W>,
    equations: &mut Equations<f64>,
    time: f64,
    chart: PolarAxis,
    q: &[[f64; 2]],
    v: &[[f64; 2]],
) -> ([f64; 2], f64) {
    let clamp = filament.motion.at(time);
    equations.set_chart(chart);
    let at = clamp.holding(q, v);
    equations.place(at);
    let energies = equations.energies(at);
    let across = |[x, y, _]: [f64; 3], [u, v, _]: [f64; 3]| x * v - y * u;
    let mut inner = [clamp.position, clamp.velocity];
    let mut momentum = 0.0;
    for (k, link) in filament.chain.links.iter().enumerate() {
        let outer = equations.node(k, 0);
        let [centre, rate] = [0, 1].map(|i| scale(0.5, add(inner[i], outer[i])));
        let [direction, turn] =
            [0, 1].map(|i| scale(1.0 / filament.chain.length, sub(outer[i], inner[i])));
        momentum += link.mass * across(centre, rate) + link.inertia * across(direction, turn);
        inner = outer;
    }
    (
        [energies.kinetic, energies.spring + energies.gravity],
        momentum,
    )
}

/// The energy in J that all points inside the workpiece store where a trajectory is.
fn contact_energy<M: ClampMotion, W: Workpiece>(
    filament: &Filament<M, W>,
    trajectory: &Trajectory,
) -> f64 {
    let time = trajectory.start().time;
    let nodes = at_knots(filament, trajectory.nodes(), time, 0.0);
    let approaches = (0..filament.contacts())
        .map(|contact| filament.touch(contact, &nodes, None, time).approach);
    let inside = approaches.filter(
        |Approach {
             penetration,
             margin,
             ..
         }| penetration.min(*margin) > 0.0,
    );
    inside
        .map(|approach| filament.law.stored_energy(&approach))
        .sum()
}
