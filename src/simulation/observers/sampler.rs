//! Collection of equally spaced samples and shapes from the steps of a pass.

use super::super::form::{FilamentEquations, Form};
use super::super::profile::Ledger;
use super::super::step::Step;
use super::super::system::integral;
use super::ContactObserver;
use super::samples::{NodeForce, Sample, Sampling, Shape};
use crate::equations::{Chain, ChainDynamics, Energies};
use crate::tool::{ClampMotion, Tool, Turning};
use crate::workpiece::{ProfileCells, Workpiece};

/// Collector of equally spaced samples and shapes from the steps of a pass.
pub struct Sampler {
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
