//! The energy balance of a pass: its dynamics against its states and the geometry of its contacts.
//!
//! In the frame of the body, which turns at the constant rate `ω` about `z`, the energy of a
//! filament is `H = E_kin + E_spring + E_grav − ω L` with its angular momentum `L` about the axis.
//! The clamp does no work there, and over a pass
//!
//! `ΔH + E_contact + ∫ 2D dt + W_contact = ∫ F·v_w dt − ω ∫ (M_contact + M_grav) dt`
//!
//! with the losses `W_contact` to friction and contact damping, the velocity `v_w` of the
//! workpiece, and moments `M` about the axis. `ω` times the clamp's angular impulse replaces the
//! work of the clamp. That impulse is the change of `L` less the other angular impulses, so the
//! balance also checks the impulses. Energies are those of the final state, and `E_contact` is that
//! of all points inside the workpiece there. The work of the contact force equals the change of
//! `E_contact` if, and only if, no opening or closing was missed. A contact that closes at a
//! penetration `δ` gives `½ k_c δ²` to the filament.
//!
//! For other motions of the clamp its work is integrated, at the cost of another residual per
//! stage.

use super::filament::Filament;
use super::form::FilamentEquations;
use super::observers::ContactObserver;
use super::step::at_knots;
use super::system::integral;
use super::trajectory::Trajectory;
use crate::contact::Approach;
use crate::equations::linear::{add, dot, scale, sub};
use crate::equations::{ChainDynamics, Clamp, PolarAxis};
use crate::tool::{ClampMotion, Tool, Turning};
use crate::workpiece::Workpiece;

/// Largest relative residual of a pass whose tolerance is no looser than a tenth of it.
pub(super) const MAX_ENERGY_RESIDUAL: f64 = 1e-3;
/// Share of the kinetic energy at the start, per relative tolerance, below which energies are not
/// resolved.
const MIN_RESOLVED_SHARE: f64 = 1e3;
/// Number of angles at which the motion of a clamp is checked.
const CHECKED_ANGLES: usize = 16;

/// Returns `true` if the clamp turns rigidly about `z`.
pub(super) fn turns_rigidly<T: Tool, W>(filament: &Filament<Turning<T>, W>) -> bool {
    /// Largest relative deviation of velocities that is rounding.
    const MAX_VELOCITY_DEVIATION: f64 = 1e-9;
    let Turning {
        tool,
        rate,
        initial_angle,
    } = &filament.motion;
    let turned = |[x, y, _]: [f64; 3], [u, v, w]: [f64; 3]| {
        let deviation = [u + rate * y, v - rate * x, w];
        dot(deviation, deviation) <= (MAX_VELOCITY_DEVIATION * rate).powi(2) * (x * x + y * y)
    };
    // Uneven spacing reveals a motion that repeats within a turn.
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
    (0..CHECKED_ANGLES).all(rigid)
}

/// Returns the residual of the energy balance of a `filament`, relative to the sum of the sizes of
/// its terms. `trajectory` began at the coordinates and rates `start` about `z`; `relative` is its
/// tolerance. With `tracks_energy` the work of the clamp has been integrated.
pub(super) fn energy_residual<T: Tool, W: Workpiece>(
    filament: &Filament<Turning<T>, W>,
    equations: &mut FilamentEquations<f64>,
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
    // Contacts that took over from others have brought their energy with them.
    let stored = contact_energy(filament, trajectory) - trajectory.taken_over();
    let losses = integrals[integral::JOINT_DISSIPATION] + integrals[integral::CONTACT_DISSIPATION];
    let rate = filament.motion.rate;
    let resolved = start_energy[0] * (MIN_RESOLVED_SHARE * relative).min(1.0);
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

/// Returns `[E_kin, E_spring + E_grav]` in J and the angular momentum about `z` in N m s of a
/// filament at a state.
fn energy<M: ClampMotion, W>(
    filament: &Filament<M, W>,
    equations: &mut FilamentEquations<f64>,
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

/// Returns the energy in J that all points inside the workpiece store at the present state.
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
