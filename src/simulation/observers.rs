//! What is kept of the steps of a pass: the figures of its contact, and a time history.

use serde::Serialize;

use super::search::maximum_in_step;
use super::system::{Filament, integral};
use super::trajectory::Step;
use crate::equations::linear::{add, dot};
use crate::equations::{Chain, Dynamics};
use crate::integrate::hermite::Knot;
use crate::metrics::{ContactRecord, tip_deflection};
use crate::tool::{ClampMotion, RoundTool};
use crate::workpiece::Workpiece;

/// Reduces the steps of a pass to what the metrics need.
pub(super) struct ContactObserver<M, W> {
    pub filament: Filament<M, W>,
    pub filament_length: f64,
    pub nominal_entry: f64,
    pub nominal_exit: f64,
    pub record: ContactRecord,
    pub was_closed: bool,
    /// The end of the last step, and the tip deflection there.
    pub seen_until: f64,
    pub deflection_there: f64,
}

impl<M: ClampMotion, W: Workpiece> ContactObserver<M, W> {
    pub fn observe(&mut self, step: &Step<'_>) {
        let closed = step.closed.contains(&true);
        if closed {
            self.record.time += step.length();
            let nominal = step.end.time.min(self.nominal_exit) - step.start.time.max(self.nominal_entry);
            self.record.nominal_time += nominal.max(0.0);
            self.record.count += usize::from(!self.was_closed);
            self.record.peak_force = maximum_in_step(|s| self.normal_force(step, s), self.record.peak_force);
        }
        self.was_closed = closed;
        // A touch whose force underflows can leave less than zero.
        self.record.impulse = step.end.integrals[integral::NORMAL_IMPULSE].max(0.0);
        let start = if step.start.time == self.seen_until { self.deflection_there } else { self.deflection(step, 0.0) };
        let end = self.deflection(step, 1.0);
        (self.seen_until, self.deflection_there) = (step.end.time, end);
        if start.max(end) + self.reach(step) > self.record.max_deflection {
            self.record.max_deflection = maximum_in_step(|s| self.deflection(step, s), self.record.max_deflection);
        }
    }

    fn normal_force(&self, step: &Step<'_>, s: f64) -> f64 {
        self.forces(step, s).0
    }

    /// Sums over the nodes of the normal and of the tangential force, in N.
    fn forces(&self, step: &Step<'_>, s: f64) -> (f64, f64) {
        let mut normal = 0.0;
        let mut tangential = [0.0; 3];
        for node in (0..step.closed.len()).filter(|&node| step.closed[node]) {
            let (position, velocity) = step.node(node, s);
            let approach = self.filament.approach(position, velocity, step.time(s));
            let force = self.filament.law.pressing_force(&approach);
            normal += force.normal;
            tangential = add(tangential, force.tangential);
        }
        (normal, dot(tangential, tangential).sqrt())
    }

    /// How far the tip and the undeformed filament move towards or from each other in a step at most, in m, by their
    /// speeds at its ends.
    fn reach(&self, step: &Step<'_>) -> f64 {
        let size = |vector: [f64; 3]| dot(vector, vector).sqrt();
        let speed = |knots: &[Knot<3>], time| {
            let clamp = self.filament.motion.at(time);
            let undeformed = size(clamp.velocity) + self.filament_length * size(clamp.direction_rate);
            size(knots[knots.len() - 1].rate) + undeformed
        };
        step.length() * (speed(step.start_nodes, step.start.time) + speed(step.end_nodes, step.end.time))
    }

    fn deflection(&self, step: &Step<'_>, s: f64) -> f64 {
        let clamp = self.filament.motion.at(step.time(s));
        let (tip, _) = step.node(step.closed.len() - 1, s);
        tip_deflection(tip, clamp.position, clamp.direction, self.filament_length)
    }
}

/// One row of a time history.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sample {
    /// Time in s; zero at the start of the pass.
    pub time_s: f64,
    /// Angle `β` of the brush body in rad.
    pub base_angle_rad: f64,
    /// `F_n`, the sum over the nodes, in N.
    pub contact_normal_force_n: f64,
    /// Friction, the magnitude of the sum over the nodes, in N.
    pub contact_tangential_force_n: f64,
    /// Tip deflection `s_n` in m.
    pub tip_deflection_m: f64,
    /// Tip position in m.
    pub tip_x_m: f64,
    /// Tip position in m.
    pub tip_y_m: f64,
    /// Tip position in m.
    pub tip_z_m: f64,
    /// `E_kin` in J.
    pub kinetic_energy_j: f64,
    /// `E_spring + E_grav` in J.
    pub potential_energy_j: f64,
    /// Energy taken so far by joint dampers, contact damping and friction, in J.
    pub dissipated_energy_j: f64,
}

impl Sample {
    /// True if every value is a finite number.
    pub(super) fn is_finite(&self) -> bool {
        let energies = [self.kinetic_energy_j, self.potential_energy_j, self.dissipated_energy_j];
        let tip = [self.tip_x_m, self.tip_y_m, self.tip_z_m, self.tip_deflection_m];
        let forces = [self.contact_normal_force_n, self.contact_tangential_force_n];
        energies.iter().chain(&tip).chain(&forces).all(|value| value.is_finite())
    }
}

/// Collects equally spaced samples from the steps of a pass.
pub(super) struct Sampler {
    dynamics: Dynamics<f64>,
    samples: usize,
    end_time: f64,
    pub history: Vec<Sample>,
    q: Vec<[f64; 2]>,
    v: Vec<[f64; 2]>,
}

impl Sampler {
    pub fn new(chain: Chain<f64>, samples: usize, end_time: f64) -> Self {
        let zeros = vec![[0.0; 2]; chain.segments];
        let history = Vec::with_capacity(samples);
        Self { dynamics: Dynamics::new(chain), samples, end_time, history, q: zeros.clone(), v: zeros }
    }

    pub fn observe<W: Workpiece>(&mut self, step: &Step<'_>, observer: &ContactObserver<RoundTool, W>) {
        while self.history.len() < self.samples {
            let intervals = self.samples.saturating_sub(1).max(1);
            // The fraction is exactly one at the last sample, which must not fall behind the end.
            let time = self.end_time * (self.history.len() as f64 / intervals as f64);
            if time > step.end.time {
                return;
            }
            let s = (time - step.start.time) / step.length();
            let clamp = observer.filament.motion.at(time);
            step.coordinates(s, &mut self.q, &mut self.v);
            self.dynamics.set_charts(step.charts());
            self.dynamics.place(&clamp, &self.q, &self.v);
            let energies = self.dynamics.energies(&clamp, &self.v);
            let integrals = step.integrals(s);
            let ([tip_x_m, tip_y_m, tip_z_m], _) = step.node(step.closed.len() - 1, s);
            let (normal, tangential) = observer.forces(step, s);
            self.history.push(Sample {
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
                dissipated_energy_j: integrals[integral::JOINT_DISSIPATION] + integrals[integral::CONTACT_DISSIPATION],
            });
        }
    }
}
