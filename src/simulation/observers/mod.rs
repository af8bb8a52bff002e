//! Observers of the steps of a pass, for the record of its contact and a time history.

mod sampler;
mod samples;

use super::filament::{Filament, Touch};
use super::form::Form;
use super::profile::{EdgeWork, sliding_in};
use super::search::maximum_in_step;
use super::step::Step;
use super::system::{FilamentState, integral};
use super::turns::{CompletedTurns, start_of_turn};
use crate::contact::Approach;
use crate::equations::Clamp;
use crate::equations::linear::{add, dot, scale, sub};
use crate::integrate::LARGEST_CONTROLLED_VARIATION;
use crate::integrate::hermite::{Knot, Weights};
use crate::model::metrics::{ContactRecord, nearest_on_filament, tip_deflection};
use crate::tool::ClampMotion;
use crate::workpiece::Workpiece;
pub(super) use sampler::Sampler;
pub use samples::{NodeForce, Sample, Sampling, Shape};

/// Observer that reduces the steps of a pass to the data for the metrics.
#[derive(Clone, Debug)]
pub struct ContactObserver<M, W> {
    filament: Filament<M, W>,
    form: Form,
    filament_length: f64,
    /// Times between which the undeformed filament touches the workpiece in the first turn.
    touches: Vec<[f64; 2]>,
    turn_time: f64,
    /// Turns that do not count, before the first.
    before: usize,
    /// Duration of the turns before this one.
    turned: f64,
    /// Integrals when the turn began.
    earlier: [f64; integral::COUNT],
    record: ContactRecord,
    completed: CompletedTurns,
    edge_work: EdgeWork,
    was_closed: bool,
    /// `true` if `z` of the clamp's direction is a small tilt out of the plane of the motion.
    has_lateral_tilt: bool,
    /// Angular impulse of gravity about the tool axis in N m s, over all turns.
    gravity_impulse: f64,
    /// Tip at the end of the last step.
    last: TipInstant,
}

/// Tip at one time.
#[derive(Clone, Copy, Debug)]
struct TipInstant {
    time: f64,
    deflection: f64,
    /// Speed relative to the nearest point of the undeformed filament, in m/s.
    speed: f64,
}

impl<M: ClampMotion, W: Workpiece> ContactObserver<M, W> {
    /// Creates an observer of `filament` with the free length `filament_length` (m), whose states
    /// have the given form. The undeformed filament touches the workpiece between the times in
    /// `touches` (s). The record is of a single turn.
    pub fn new(
        filament: Filament<M, W>,
        form: Form,
        filament_length: f64,
        touches: Vec<[f64; 2]>,
    ) -> Self {
        let edge_work = EdgeWork::new(filament.workpiece.edges().len());
        Self {
            filament,
            form,
            filament_length,
            touches,
            turn_time: f64::INFINITY,
            before: 0,
            turned: 0.0,
            earlier: [0.0; integral::COUNT],
            edge_work,
            record: ContactRecord::of_turn(1),
            completed: CompletedTurns::default(),
            was_closed: false,
            has_lateral_tilt: true,
            gravity_impulse: 0.0,
            last: TipInstant {
                time: f64::NAN,
                deflection: 0.0,
                speed: 0.0,
            },
        }
    }

    /// Begins a new record with each turn of `turn_time` (s), with a number of turns `before` the
    /// first that counts.
    #[must_use]
    pub fn by_turns(self, before: usize, turn_time: f64) -> Self {
        Self {
            record: ContactRecord::of_turn(1 - before),
            before,
            turn_time,
            ..self
        }
    }

    /// Sets whether `z` of the clamp's direction is a lateral tilt.
    #[must_use]
    pub(super) fn with_lateral_tilt(self, has_lateral_tilt: bool) -> Self {
        Self {
            has_lateral_tilt,
            ..self
        }
    }

    /// Returns the record of the last turn so far.
    pub fn record(&self) -> &ContactRecord {
        &self.record
    }

    /// Returns the records of the last turns, once the last one has ended.
    pub(super) fn completed_turns(&self) -> CompletedTurns {
        let mut completed = self.completed.clone();
        completed.push(self.record);
        completed
    }

    /// Returns the angular impulse of gravity about the tool axis over all turns so far, in N m s.
    pub(super) fn gravity_impulse(&self) -> f64 {
        self.gravity_impulse
    }

    /// Returns the moment of gravity about the tool axis at one end of a step in N m, and its rate.
    fn gravity_moment(&self, knots: &[Knot<3>], time: f64) -> [f64; 2] {
        let chain = &self.filament.chain;
        let Clamp {
            position, velocity, ..
        } = self.filament.motion.at(time);
        let mut inner = [position, velocity];
        let mut moments = [[0.0; 3]; 2];
        for (link, knot) in chain.links.iter().zip(knots) {
            let outer = [knot.value, knot.rate];
            for i in 0..2 {
                moments[i] = add(moments[i], scale(0.5 * link.mass, add(inner[i], outer[i])));
            }
            inner = outer;
        }
        let [along, across, _] = chain.gravity;
        moments.map(|[x, y, _]| x * across - y * along)
    }

    /// Takes the next step of the pass.
    pub fn observe(&mut self, step: &Step<'_>) {
        if step.start.time >= start_of_turn(self.before + self.record.turn, self.turn_time) {
            if self.record.turn > 0 {
                self.completed.push(self.record);
            }
            self.record = ContactRecord::of_turn(self.record.turn + 1);
            self.turned = step.start.time;
            self.earlier = step.start.integrals;
            self.was_closed = false;
            self.edge_work.clear();
        }
        if self.filament.chain.gravity != [0.0; 3] {
            let length = step.length();
            let [start, start_rate] = self.gravity_moment(step.start_nodes, step.start.time);
            let [end, end_rate] = self.gravity_moment(step.end_nodes, step.end.time);
            self.gravity_impulse +=
                length * ((start + end) / 2.0 + length * (start_rate - end_rate) / 12.0);
        }
        let closed = step.closed.contains(&true);
        if closed {
            let times = [step.start.time, step.end.time];
            self.record
                .add_time(step.length(), times, &self.touches, self.turned);
            self.record.count += usize::from(!self.was_closed);
            self.record.peak_force =
                maximum_in_step(|s| self.normal_force(step, s), self.record.peak_force);
            self.record.penetration =
                maximum_in_step(|s| self.penetration(step, s), self.record.penetration);
            let nodes = step.start_nodes.len();
            if let Some(inner) = step.closed[..nodes].iter().position(|&closed| closed) {
                self.record.contact_nodes = self.record.contact_nodes.max(nodes - inner);
            }
        }
        self.was_closed = closed;
        let integrals: [f64; integral::COUNT] =
            std::array::from_fn(|i| step.end.integrals[i] - self.earlier[i]);
        // The sum of a contact whose force underflows can be less than zero.
        self.record.impulse = integrals[integral::NORMAL_IMPULSE].max(0.0);
        self.record.vector_impulse = std::array::from_fn(|i| integrals[integral::IMPULSE + i]);
        self.record.angular_impulse = integrals[integral::ANGULAR_IMPULSE];
        self.record.edge_impulse = integrals[integral::EDGE_IMPULSE];
        self.record.friction_work = integrals[integral::FRICTION_WORK];
        let [sliding, edge @ ..] = sliding_in(step, &self.filament);
        self.record.sliding_work += sliding;
        self.record.edge_work = add(self.record.edge_work, edge);
        let nodes = step.start_nodes.len();
        if step.closed[nodes..].contains(&true) {
            self.edge_work.observe(step, &self.filament);
            self.record.edge_evenness = self.edge_work.evenness(self.filament.workpiece.edges());
        }
        for contact in (nodes..step.closed.len()).filter(|&contact| step.closed[contact]) {
            let penetration = |s| self.approach(step, contact, s).penetration;
            self.record.edge_penetration =
                maximum_in_step(penetration, self.record.edge_penetration);
        }
        let last = if step.start.time == self.last.time {
            self.last
        } else {
            self.tip(step.start_nodes, step.start.time)
        };
        self.last = self.tip(step.end_nodes, step.end.time);
        // An upper bound on the deflection within the step, from the speeds at its ends.
        let bound = last.deflection.max(self.last.deflection)
            + step.length() * (last.speed + self.last.speed);
        if bound > self.record.max_deflection {
            self.record.max_deflection =
                maximum_in_step(|s| self.deflection(step, s), self.record.max_deflection);
        }
        self.record.lateral_amplification = match self.form {
            Form::Planar => largest_variation(step, self.record.lateral_amplification),
            Form::Spatial => self.largest_excursion(step, self.record.lateral_amplification),
        };
    }

    /// Returns the largest `|z_tip|/(l_f sin τ)` in a step of a filament whose clamp is tilted by
    /// `τ`, or `least` if that is larger.
    fn largest_excursion(&self, step: &Step<'_>, least: f64) -> f64 {
        let [.., tilt] = self.filament.motion.at(step.start.time).direction;
        if tilt == 0.0 || !self.has_lateral_tilt {
            return least;
        }
        let tip = step.start_nodes.len() - 1;
        maximum_in_step(
            |s| (step.node(tip, s).0[2] / (self.filament_length * tilt)).abs(),
            least,
        )
    }

    fn normal_force(&self, step: &Step<'_>, s: f64) -> f64 {
        step.contacts()
            .map(|contact| {
                self.filament
                    .law
                    .normal_force(&self.approach(step, contact, s))
                    .max(0.0)
            })
            .sum()
    }

    /// Returns the largest penetration of a closed contact in m.
    fn penetration(&self, step: &Step<'_>, s: f64) -> f64 {
        step.contacts()
            .map(|contact| self.approach(step, contact, s).penetration)
            .fold(0.0, f64::max)
    }

    /// Returns the largest normal force between the fractions `start` and `end` of a step, or
    /// `least` if that is larger, in N.
    fn peak_force(&self, step: &Step<'_>, start: f64, end: f64, least: f64) -> f64 {
        if !step.closed.contains(&true) {
            return least;
        }
        maximum_in_step(
            |part| self.normal_force(step, start + part * (end - start)),
            least,
        )
    }

    /// Returns the sum of the normal forces over the contacts, and the magnitude of that of the
    /// tangential ones, in N.
    fn forces(&self, step: &Step<'_>, s: f64) -> (f64, f64) {
        let mut normal = 0.0;
        let mut tangential = [0.0; 3];
        for contact in step.contacts() {
            let force = self
                .filament
                .law
                .pressing_force(&self.approach(step, contact, s));
            normal += force.normal;
            tangential = add(tangential, force.tangential);
        }
        (normal, dot(tangential, tangential).sqrt())
    }

    /// Returns the energy stored in the closed contacts, in J.
    fn stored_energy(&self, step: &Step<'_>, s: f64) -> f64 {
        step.contacts()
            .map(|contact| {
                self.filament
                    .law
                    .stored_energy(&self.approach(step, contact, s))
            })
            .sum()
    }

    /// Adds the contact forces of a step to `forces` on the nodes `0 … n`.
    fn add_forces(&self, step: &Step<'_>, s: f64, forces: &mut [NodeForce]) {
        for contact in step.contacts() {
            let Touch {
                station, approach, ..
            } = step.touch(&self.filament, contact, s);
            let force = self.filament.law.pressing_force(&approach);
            for (end, share) in forces[station.segment..].iter_mut().zip(station.shares()) {
                end.normal += share * force.normal;
                end.force = add(end.force, scale(share, force.total(&approach)));
            }
        }
    }

    fn approach(&self, step: &Step<'_>, contact: usize, s: f64) -> Approach {
        step.touch(&self.filament, contact, s).approach
    }

    /// Returns the tip of the nodes in `knots`, at `time`.
    fn tip(&self, knots: &[Knot<3>], time: f64) -> TipInstant {
        let Knot { value, rate, .. } = knots[knots.len() - 1];
        let Clamp {
            position: root,
            velocity,
            direction,
            direction_rate,
            ..
        } = self.filament.motion.at(time);
        let along = nearest_on_filament(value, root, direction, self.filament_length);
        let relative = sub(rate, add(velocity, scale(along, direction_rate)));
        TipInstant {
            time,
            deflection: tip_deflection(value, root, direction, self.filament_length),
            speed: dot(relative, relative).sqrt(),
        }
    }

    fn deflection(&self, step: &Step<'_>, s: f64) -> f64 {
        let clamp = self.filament.motion.at(step.time(s));
        let (tip, _) = step.node(step.start_nodes.len() - 1, s);
        tip_deflection(tip, clamp.position, clamp.direction, self.filament_length)
    }
}

/// Returns the largest `|∂z_tip/∂τ|/l_f` in a step of a planar motion, or `least` if that is
/// larger. The bound replaces a variation that is no longer controlled.
fn largest_variation(step: &Step<'_>, least: f64) -> f64 {
    let scale = step.start.integrals[integral::VARIATION_SCALE].exp();
    let largest = step
        .end
        .q
        .iter()
        .fold(0.0_f64, |largest, block| largest.max(block[0].abs()));
    if scale * largest >= LARGEST_CONTROLLED_VARIATION {
        return LARGEST_CONTROLLED_VARIATION;
    }
    // z_tip = Σ h cos φ, and ∂φ/∂τ = η
    let mean = |blocks: &[[f64; 2]]| {
        [blocks.iter().map(|block| block[0]).sum::<f64>() / blocks.len() as f64]
    };
    let knot = |state: &FilamentState| Knot {
        value: mean(&state.q),
        rate: mean(&state.v),
        acceleration: mean(&state.accelerations),
    };
    let (start, end, length) = (knot(step.start), knot(step.end), step.length());
    let size = |s| {
        (scale * Weights::new(length, s).interpolate(&start, &end).0[0].abs())
            .min(LARGEST_CONTROLLED_VARIATION)
    };
    maximum_in_step(size, least)
}
