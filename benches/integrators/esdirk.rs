//! ESDIRK methods: TR-BDF2 and the methods of Kennedy and Carpenter.

use bristle::equations::StepWeights;
use bristle::integrate::{Tolerances, tableau::Tableau};

use crate::newton::{Failure, MAX_ITERATIONS, Newton, NewtonSettings, Pairs, axpy, norm, zeros};
use crate::pass::{Method, pi_factor};
use crate::system::{Point, System};

/// First guess of a stage's accelerations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Predictor {
    /// Those of the previous stage.
    Previous,
    /// The polynomial through this number of earlier stages, those with the nearest nodes.
    Stages(usize),
}

const SAFETY: f64 = 0.9;

/// How the error of a step determines the length of the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Controller {
    /// The controller of the library: PI with 0.7 and 0.3.
    Pi,
    /// H211b with b = 4 (Söderlind, ACM Transactions on Mathematical Software 29, 2003).
    H211b,
    /// The predictive controller (Gustafsson, ACM Transactions on Mathematical Software 20, 1994).
    Predictive,
}

/// A method and its settings.
#[derive(Clone, Copy, Debug)]
pub struct EsdirkSettings {
    pub tableau: &'static Tableau,
    pub predictor: Predictor,
    pub newton: NewtonSettings,
    pub controller: Controller,
    /// Filter the error of the rates with the inverse of the step matrix.
    pub filtered: bool,
    /// Order of the local error, for the controller.
    pub error_order: f64,
}

impl EsdirkSettings {
    pub fn new(tableau: &'static Tableau) -> Self {
        Self {
            tableau,
            predictor: Predictor::Previous,
            newton: NewtonSettings::default(),
            controller: Controller::Pi,
            filtered: false,
            // The error of TR-BDF2 is that of the method itself, relative to an embedded method of order 3.
            error_order: f64::from(tableau.order.max(3)),
        }
    }
}

/// Steps of an ESDIRK method.
pub struct Esdirk {
    settings: EsdirkSettings,
    tolerances: Tolerances,
    pub newton: Newton,
    /// Nodes `c_i`.
    nodes: Vec<f64>,
    stage_v: Vec<Pairs>,
    stage_a: Vec<Pairs>,
    q: Pairs,
    q_base: Pairs,
    v_base: Pairs,
    angle_error: Pairs,
    rate_error: Pairs,
    previous_error: f64,
    previous_factor: f64,
}

impl Esdirk {
    pub fn new(settings: EsdirkSettings, tolerances: Tolerances, pairs: usize) -> Self {
        let stages = settings.tableau.stages();
        Self {
            settings,
            tolerances,
            newton: Newton::new(settings.newton, tolerances, pairs),
            nodes: (0..stages).map(|stage| settings.tableau.node(stage)).collect(),
            stage_v: vec![zeros(pairs); stages],
            stage_a: vec![zeros(pairs); stages],
            q: zeros(pairs),
            q_base: zeros(pairs),
            v_base: zeros(pairs),
            angle_error: zeros(pairs),
            rate_error: zeros(pairs),
            previous_error: 1.0,
            previous_factor: 1.0,
        }
    }

    fn predict(&mut self, stage: usize) {
        let (earlier, rest) = self.stage_a.split_at_mut(stage);
        let a = &mut rest[0];
        let target = self.nodes[stage];
        let mut points: Vec<(f64, &Pairs)> = (0..stage).map(|j| (self.nodes[j], &earlier[j])).collect();
        let count = match self.settings.predictor {
            Predictor::Previous => {
                a.copy_from_slice(&earlier[stage - 1]);
                return;
            }
            Predictor::Stages(count) => count,
        };
        points.sort_by(|x, y| (x.0 - target).abs().total_cmp(&(y.0 - target).abs()));
        let mut chosen: Vec<(f64, &Pairs)> = Vec::new();
        for point in points {
            // Coinciding nodes carry the same information.
            if chosen.len() < count && chosen.iter().all(|other| (other.0 - point.0).abs() > 0.05) {
                chosen.push(point);
            }
        }
        a.as_flattened_mut().fill(0.0);
        for (j, (node, values)) in chosen.iter().enumerate() {
            let others = chosen.iter().enumerate().filter(|&(k, _)| k != j);
            let weight: f64 = others.map(|(_, other)| (target - other.0) / (node - other.0)).product();
            axpy(a, weight, values);
        }
    }
}

impl Method for Esdirk {
    fn restart(&mut self, _: &Point) {
        self.newton.forget();
    }

    fn attempt(&mut self, system: &mut System, start: &Point, step: f64, end: &mut Point) -> Result<f64, Failure> {
        let tableau = self.settings.tableau;
        let last = tableau.stages() - 1;
        let diagonal = tableau.gamma * step;
        let weights = StepWeights { coordinates: diagonal * diagonal, rates: diagonal };
        self.stage_v[0].copy_from_slice(&start.v);
        self.stage_a[0].copy_from_slice(&start.accelerations);
        end.integrals = start.integrals;
        end.integrals[0] += step * tableau.weight(0) * start.rates[0];
        self.newton.begin(weights.rates);
        for stage in 1..=last {
            let time = start.time + self.nodes[stage] * step;
            self.predict(stage);
            self.q_base.copy_from_slice(&start.q);
            self.v_base.copy_from_slice(&start.v);
            for j in 0..stage {
                let factor = step * tableau.coefficient(stage, j);
                axpy(&mut self.q_base, factor, &self.stage_v[j]);
                axpy(&mut self.v_base, factor, &self.stage_a[j]);
            }
            axpy(&mut self.q_base, diagonal, &self.v_base);
            let (v, a) = (&mut self.stage_v[stage], &mut self.stage_a[stage]);
            let base = (&self.q_base[..], &self.v_base[..]);
            self.newton.solve(system, time, &mut self.q, v, a, base, weights)?;
            let rate = system.rates(time, &self.q, v, a)[0];
            end.integrals[0] += step * tableau.weight(stage) * rate;
            end.rates = [rate];
        }
        end.time = start.time + step;
        end.q.copy_from_slice(&self.q);
        end.v.copy_from_slice(&self.stage_v[last]);
        end.accelerations.copy_from_slice(&self.stage_a[last]);
        self.angle_error.as_flattened_mut().fill(0.0);
        self.rate_error.as_flattened_mut().fill(0.0);
        for stage in 0..=last {
            let weight = step * (tableau.weight(stage) - tableau.embedded[stage]);
            axpy(&mut self.angle_error, weight, &self.stage_v[stage]);
            axpy(&mut self.rate_error, weight, &self.stage_a[stage]);
        }
        let plain = norm(self.tolerances, &self.angle_error, &self.rate_error, &start.v, &end.v);
        if self.settings.filtered && plain > 0.0 {
            self.filter(system, end, weights);
            return Ok(norm(self.tolerances, &self.angle_error, &self.rate_error, &start.v, &end.v));
        }
        Ok(plain)
    }

    fn accept(&mut self, _: &Point, _: &Point, step: f64, error: f64, _: bool) -> f64 {
        let factor = self.factor(error, true);
        self.previous_error = error.max(1e-4);
        step * factor
    }

    fn reject(&mut self, step: f64, error: f64) -> f64 {
        step * self.factor(error, false).min(1.0)
    }

    fn distribution(&self) -> [usize; MAX_ITERATIONS] {
        self.newton.distribution
    }
}

impl Esdirk {
    fn factor(&mut self, error: f64, accepted: bool) -> f64 {
        let order = self.settings.error_order;
        let error = error.max(1e-10);
        let factor = match self.settings.controller {
            Controller::Pi => pi_factor(error, self.previous_error, order),
            Controller::H211b => {
                let factor = (SAFETY.powf(order) / error).powf(0.25 / order)
                    * (SAFETY.powf(order) / self.previous_error).powf(0.25 / order)
                    * self.previous_factor.powf(-0.25);
                if accepted { factor } else { SAFETY * error.powf(-1.0 / order) }
            }
            Controller::Predictive => {
                let plain = SAFETY * error.powf(-1.0 / order);
                let predicted = plain * self.previous_factor * (self.previous_error / error).powf(1.0 / order);
                if accepted { plain.min(predicted) } else { plain }
            }
        };
        let factor = factor.clamp(0.2, 5.0);
        if accepted {
            self.previous_factor = factor;
        }
        factor
    }

    /// Applies `(I − hγJ)⁻¹` to the error: the stage equations, linearised about the end, with the error as the base.
    ///
    /// `δv = e_v + hγ δa`, `δq = e_q + hγ δv`, `R_a δa + R_v δv + R_q δq = 0`, so that
    /// `K δa = −(R_v e_v + R_q (e_q + hγ e_v))`, whose right side is a difference of two residuals.
    fn filter(&mut self, system: &mut System, end: &Point, weights: StepWeights<f64>) {
        let pairs = end.q.len();
        let (mut moved, mut here) = (zeros(pairs), zeros(pairs));
        let (mut q, mut v) = (end.q.clone(), end.v.clone());
        axpy(&mut q, 1.0, &self.angle_error);
        axpy(&mut q, weights.rates, &self.rate_error);
        axpy(&mut v, 1.0, &self.rate_error);
        system.residual(end.time, &q, &v, &end.accelerations, &mut moved);
        system.residual(end.time, &end.q, &end.v, &end.accelerations, &mut here);
        axpy(&mut moved, -1.0, &here);
        system.solve(&mut moved);
        axpy(&mut self.angle_error, weights.rates, &self.rate_error);
        axpy(&mut self.angle_error, -weights.coordinates, &moved);
        axpy(&mut self.rate_error, -weights.rates, &moved);
    }
}
