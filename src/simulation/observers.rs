//! Observers of the steps of a pass, for the record of its contact and a time history.

use super::filament::{Filament, Touch};
use super::form::{FilamentEquations, Form};
use super::profile::{EdgeWork, Ledger, sliding_in};
use super::search::maximum_in_step;
use super::step::Step;
use super::system::{FilamentState, integral};
use super::turns::{CompletedTurns, start_of_turn};
use crate::contact::Approach;
use crate::equations::linear::{add, dot, scale, sub};
use crate::equations::{Chain, ChainDynamics, Clamp, Energies};
use crate::integrate::LARGEST_CONTROLLED_VARIATION;
use crate::integrate::hermite::{Knot, Weights};
use crate::model::metrics::{ContactRecord, nearest_on_filament, tip_deflection};
use crate::tool::{ClampMotion, Pose, Tool, Turning};
use crate::workpiece::{ProfileCells, Workpiece};

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

crate::record! {
    /// Row of a time history.
    #[derive(Clone, Debug, Default, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Sample {
        time_s: f64 = ["t", "s", "time", "zero at the start of the pass"],
        base_angle_rad: f64 = ["β", "rad", "angle of the brush body", ""],
        contact_normal_force_n: f64 = ["F_n", "N", "contact normal force", "sum over the nodes"],
        contact_tangential_force_n: f64 = ["F_t", "N", "friction", "magnitude of the sum over the nodes"],
        tip_deflection_m: f64 = ["s_n", "m", "tip deflection", "distance of the tip from the undeformed filament"],
        tip_x_m: f64 = ["x", "m", "tip position along x", ""],
        tip_y_m: f64 = ["y", "m", "tip position along y", ""],
        tip_z_m: f64 = ["z", "m", "tip position along z", ""],
        kinetic_energy_j: f64 = ["E_kin", "J", "kinetic energy", ""],
        potential_energy_j: f64 = ["E_pot", "J", "potential energy", "of springs and gravity"],
        dissipated_energy_j: f64 =
            ["", "J", "dissipated energy", "taken so far by joint dampers, contact damping and friction"],
        contact_normal_impulse_n_s: f64 = [
            "", "N s", "contact normal impulse so far",
            "∫ F_n dt over all turns; its rise over the time between two samples is the mean of F_n there"
        ],
        peak_contact_normal_force_n: f64 = [
            "", "N", "largest contact normal force since the sample before",
            "impacts are shorter than the time between samples"
        ],
    }
}

/// Samples taken of a pass in addition to its metrics. The default is none, which costs nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sampling {
    /// Number of samples at equally spaced times, including the first and the last instant.
    pub samples: usize,
    /// Number of shapes of the filament at equally spaced times, including the first and the last
    /// instant.
    pub shapes: usize,
    /// `true` if the shapes have velocities and contact forces, too.
    pub loads: bool,
    /// `true` if the work along the profile of the workpiece is requested.
    pub profile: bool,
    /// `true` if metrics and statistics must equal those without samples to the bit. The impulse
    /// and the dissipated energies of the samples are then integrated less exactly, with an error
    /// far below the tolerance. If the metrics are finite but a sample is not, all samples are left
    /// out.
    pub alongside: bool,
}

impl Sampling {
    /// Returns `true` if the energies of the samples have to be integrated.
    pub(super) fn tracks_energy(self) -> bool {
        self.samples > 0 && !self.alongside
    }
}

/// Filament at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Time in s; zero at the start of the pass.
    pub time_s: f64,
    /// Positions of the root and of all nodes, to the tip, in m.
    pub nodes_m: Vec<[f64; 3]>,
    /// Velocities of the same points in m/s; empty without [`Sampling::loads`].
    pub velocities_m_s: Vec<[f64; 3]>,
    /// Contact forces on the same points; empty without [`Sampling::loads`].
    pub forces: Vec<NodeForce>,
}

/// Contact force on a node. A force at a point of a segment acts on both its ends.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodeForce {
    /// Share of the node in `F_n` in N.
    pub normal: f64,
    /// Share of the node in the whole force, with friction, in N.
    pub force: [f64; 3],
}

impl Sample {
    /// Turns its vectors from the frame of a tool to that of the workpiece.
    pub(super) fn turn(&mut self, pose: &Pose) {
        [self.tip_x_m, self.tip_y_m, self.tip_z_m] =
            pose.from_tool([self.tip_x_m, self.tip_y_m, self.tip_z_m]);
    }
}

impl Shape {
    /// Turns its vectors from the frame of a tool to that of the workpiece.
    pub(super) fn turn(&mut self, pose: &Pose) {
        let vectors = self.nodes_m.iter_mut().chain(&mut self.velocities_m_s);
        for vector in vectors.chain(self.forces.iter_mut().map(|node| &mut node.force)) {
            *vector = pose.from_tool(*vector);
        }
    }

    /// Returns `true` if every value is a finite number.
    pub(super) fn is_finite(&self) -> bool {
        let vectors = self.nodes_m.iter().chain(&self.velocities_m_s);
        let forces = self.forces.iter();
        vectors
            .chain(forces.clone().map(|node| &node.force))
            .flatten()
            .all(|value| value.is_finite())
            && forces.map(|node| node.normal).all(f64::is_finite)
    }
}

/// Collector of equally spaced samples and shapes from the steps of a pass.
pub(super) struct Sampler {
    /// Equations for the energies; made only if samples are requested.
    equations: Option<FilamentEquations<f64>>,
    pub sampling: Sampling,
    end_time: f64,
    /// `true` if samples are requested whose end is not known.
    is_blind: bool,
    pub history: Vec<Sample>,
    pub shapes: Vec<Shape>,
    /// Work along the profile; `None` if it is not requested, or no profile is within reach.
    pub ledger: Option<Ledger>,
    /// Turn of the ledger.
    turn: usize,
    q: Vec<[f64; 2]>,
    v: Vec<[f64; 2]>,
    /// Largest contact normal force since the last sample, in N.
    peak_force: f64,
    dissipated: Dissipated,
}

/// Account of the dissipated energy.
#[derive(Clone, Copy, Default)]
struct Dissipated {
    /// Dissipated energy at the end of the last step, in J.
    total: f64,
    /// Contact's share of the integrals there, in J.
    contact: f64,
    /// Largest value reported, in J. The energy cannot fall, but its account can, by less than the
    /// tolerance.
    reported: f64,
}

impl Sampler {
    /// Creates a sampler of a pass over a workpiece with this `profile`, which ends at `end_time`
    /// (s). If the end is not known, it takes no samples.
    pub fn new(
        form: Form,
        chain: Chain<f64>,
        sampling: Sampling,
        end_time: Option<f64>,
        profile: Option<ProfileCells>,
    ) -> Self {
        let is_blind = end_time.is_none() && (sampling.samples > 0 || sampling.shapes > 0);
        let sampling = if is_blind {
            Sampling {
                samples: 0,
                shapes: 0,
                ..sampling
            }
        } else {
            sampling
        };
        let zeros = vec![
            [0.0; 2];
            if sampling.samples > 0 {
                chain.segments()
            } else {
                0
            }
        ];
        Self {
            equations: (sampling.samples > 0).then(|| FilamentEquations::new(form, chain)),
            sampling,
            end_time: end_time.unwrap_or(f64::INFINITY),
            is_blind,
            history: Vec::with_capacity(sampling.samples),
            shapes: Vec::with_capacity(sampling.shapes),
            ledger: profile.and_then(Ledger::new),
            turn: 1,
            q: zeros.clone(),
            v: zeros,
            peak_force: 0.0,
            dissipated: Dissipated::default(),
        }
    }

    /// Returns `true` if the samples fit a pass that has ended at `end_time` (s), or none are
    /// requested.
    pub fn covers(&self, end_time: f64) -> bool {
        let takes_none = self.sampling.samples == 0 && self.sampling.shapes == 0;
        !self.is_blind && (takes_none || self.end_time == end_time)
    }

    pub fn observe<T: Tool, W: Workpiece>(
        &mut self,
        step: &Step<'_>,
        observer: &ContactObserver<Turning<T>, W>,
    ) {
        self.observe_shapes(step, observer);
        if let Some(ledger) = &mut self.ledger {
            let turn = observer.record.turn;
            if turn != self.turn {
                ledger.clear();
            }
            self.turn = turn;
            ledger.observe(step, &observer.filament);
        }
        if self.sampling.samples == 0 {
            return;
        }
        let dissipated = self.dissipated_in(step, observer);
        let mut start = 0.0;
        while let Some(time) = due(self.history.len(), self.sampling.samples, self.end_time) {
            let later = time > step.end.time;
            let s = if later {
                1.0
            } else {
                (time - step.start.time) / step.length()
            };
            self.peak_force = observer.peak_force(step, start, s, self.peak_force);
            if later {
                return;
            }
            let energies = self.energies(step, observer, s);
            self.dissipated.reported = self.dissipated.reported.max(dissipated.at(step, s));
            let dissipated = self.dissipated.reported;
            self.history.push(sample(
                step,
                observer,
                (s, time),
                &energies,
                dissipated,
                self.peak_force,
            ));
            (start, self.peak_force) = (s, 0.0);
        }
    }

    /// Enters the next step into the account of the dissipated energy.
    ///
    /// The integrals of the dissipated powers are as accurate as the motion, except after damped
    /// contacts: where a node comes off while it is pressed in, its fast modes end in a step that
    /// is too long to resolve their dissipation. With contact damping the dissipated energy is
    /// therefore the rest of the energy balance.
    fn dissipated_in<M: ClampMotion, W: Workpiece>(
        &mut self,
        step: &Step<'_>,
        observer: &ContactObserver<M, W>,
    ) -> DissipatedInStep {
        let [start_integrals, end_integrals] = [&step.start.integrals, &step.end.integrals];
        // Loss of the contact when it opened, at the start of the step.
        let lost = start_integrals[integral::CONTACT_DISSIPATION] - self.dissipated.contact;
        let start = self.dissipated.total + lost;
        let rise = if observer.filament.law.damping > 0.0 && self.sampling.tracks_energy() {
            let mut conserved = |s: f64| {
                let Energies {
                    kinetic,
                    spring,
                    gravity,
                    ..
                } = self.energies(step, observer, s);
                kinetic + spring + gravity + observer.stored_energy(step, s)
            };
            end_integrals[integral::WORK]
                - start_integrals[integral::WORK]
                - (conserved(1.0) - conserved(0.0))
        } else {
            dissipated_power_integral(end_integrals) - dissipated_power_integral(start_integrals)
        };
        self.dissipated.total = start + rise;
        self.dissipated.contact = end_integrals[integral::CONTACT_DISSIPATION];
        DissipatedInStep { start, rise }
    }

    fn energies<M: ClampMotion, W: Workpiece>(
        &mut self,
        step: &Step<'_>,
        observer: &ContactObserver<M, W>,
        s: f64,
    ) -> Energies<f64> {
        let equations = self.equations.as_mut().expect("a sample is asked for");
        let clamp = observer.filament.motion.at(step.time(s));
        step.coordinates(s, &mut self.q, &mut self.v);
        equations.set_chart(step.chart());
        let at = clamp.holding(&self.q, &self.v);
        equations.place(at);
        equations.energies(at)
    }

    fn observe_shapes<M: ClampMotion, W: Workpiece>(
        &mut self,
        step: &Step<'_>,
        observer: &ContactObserver<M, W>,
    ) {
        while let Some(time_s) = due(self.shapes.len(), self.sampling.shapes, self.end_time)
            && time_s <= step.end.time
        {
            let s = (time_s - step.start.time) / step.length();
            let root = observer.filament.motion.at(time_s);
            let mut nodes_m = Vec::with_capacity(1 + step.start_nodes.len());
            nodes_m.push(root.position);
            let mut shape = Shape {
                time_s,
                nodes_m,
                velocities_m_s: Vec::new(),
                forces: Vec::new(),
            };
            if self.sampling.loads {
                shape.velocities_m_s.push(root.velocity);
            }
            let weights = step.weights(s);
            for node in 0..step.start_nodes.len() {
                let (position, velocity) = step.node_at(node, &weights);
                shape.nodes_m.push(position);
                if self.sampling.loads {
                    shape.velocities_m_s.push(velocity);
                }
            }
            if self.sampling.loads {
                shape.forces = vec![NodeForce::default(); shape.nodes_m.len()];
                observer.add_forces(step, s, &mut shape.forces);
            }
            self.shapes.push(shape);
        }
    }
}

fn sample<T: Tool, W: Workpiece>(
    step: &Step<'_>,
    observer: &ContactObserver<Turning<T>, W>,
    (s, time): (f64, f64),
    energies: &Energies<f64>,
    dissipated_energy_j: f64,
    peak_force: f64,
) -> Sample {
    let integrals = step.integrals(s);
    let ([tip_x_m, tip_y_m, tip_z_m], _) = step.node(step.start_nodes.len() - 1, s);
    let (normal, tangential) = observer.forces(step, s);
    Sample {
        time_s: time,
        base_angle_rad: observer.filament.motion.angle(time),
        contact_normal_force_n: normal,
        contact_tangential_force_n: tangential,
        tip_deflection_m: observer.deflection(step, s),
        tip_x_m,
        tip_y_m,
        tip_z_m,
        kinetic_energy_j: energies.kinetic,
        potential_energy_j: energies.spring + energies.gravity,
        dissipated_energy_j,
        contact_normal_impulse_n_s: integrals[integral::NORMAL_IMPULSE].max(0.0),
        peak_contact_normal_force_n: peak_force.max(normal),
    }
}

/// Dissipated energy at the start of a step, and its rise within the step, in J.
struct DissipatedInStep {
    start: f64,
    rise: f64,
}

impl DissipatedInStep {
    /// Returns the dissipated energy at the fraction `s` of the step in J. It rises as the
    /// integrals do.
    fn at(&self, step: &Step<'_>, s: f64) -> f64 {
        let [start, here, end] = [
            &step.start.integrals,
            &step.integrals(s),
            &step.end.integrals,
        ]
        .map(dissipated_power_integral);
        // Where much is dissipated in a small part of the step, the interpolated integrals can
        // leave the range of its ends.
        let share = if end > start {
            ((here - start) / (end - start)).clamp(0.0, 1.0)
        } else {
            s
        };
        self.start + share * self.rise
    }
}

/// Returns the integral of the dissipated powers in J.
fn dissipated_power_integral(integrals: &[f64; integral::COUNT]) -> f64 {
    integrals[integral::JOINT_DISSIPATION] + integrals[integral::CONTACT_DISSIPATION]
}

/// Returns the time in s of the next of `count` equally spaced samples, after `taken` of them.
fn due(taken: usize, count: usize, end_time: f64) -> Option<f64> {
    let intervals = count.saturating_sub(1).max(1);
    // The fraction is exactly one at the last sample, because that sample must not lie past the
    // end.
    (taken < count).then(|| end_time * (taken as f64 / intervals as f64))
}
