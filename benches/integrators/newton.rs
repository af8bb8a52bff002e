//! Shared by all methods: the norm, and Newton's method for one implicit relation `v = v̂ + w_v q̈`, `q = q̂ + …`.

use bristle::equations::{LaneSet, StepWeights};
use bristle::integrate::Tolerances;

use crate::system::System;

/// Why a step failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Failure;

pub type Pairs = Vec<[f64; 2]>;

pub fn zeros(pairs: usize) -> Pairs {
    vec![[0.0; 2]; pairs]
}

/// `target += factor × values`
pub fn axpy(target: &mut [[f64; 2]], factor: f64, values: &[[f64; 2]]) {
    for (target, value) in target.as_flattened_mut().iter_mut().zip(values.as_flattened()) {
        *target += factor * value;
    }
}

/// The number of iterations per stage.
#[derive(Clone, Copy, Debug)]
pub struct NewtonSettings {
    /// Newton's error as a fraction of the allowed error of a step.
    pub tolerance: f64,
    /// A fixed number of iterations, without a test of convergence; with zero, Newton's method runs until it converges.
    pub fixed: usize,
    /// With `fixed`: a correction of more tolerances than this fails.
    pub reject: f64,
    /// Keep the matrix across steps while `w_v` is within this ratio of the value that it was computed for.
    pub keep: f64,
}

pub const MAX_ITERATIONS: usize = 8;

impl Default for NewtonSettings {
    fn default() -> Self {
        Self { tolerance: 0.02, fixed: 0, reject: 1e3, keep: 1.0 }
    }
}

impl NewtonSettings {
    /// One iteration per stage.
    pub fn once() -> Self {
        Self { fixed: 1, ..Self::default() }
    }
}

/// Newton's method for `R(q, v, a, t) = 0` with `v = v̂ + w_v a`, `q = q̂ + w_q a`.
///
/// The unknown is `a`; the matrix is kept while it contracts fast enough.
#[derive(Clone, Debug)]
pub struct Newton {
    pub settings: NewtonSettings,
    tolerances: Tolerances,
    contraction: f64,
    factorised: Option<f64>,
    correction: Pairs,
    /// The numbers of stages that took one, two, … iterations.
    pub distribution: [usize; MAX_ITERATIONS],
}

impl Newton {
    pub fn new(settings: NewtonSettings, tolerances: Tolerances, pairs: usize) -> Self {
        Self {
            settings,
            tolerances,
            contraction: 1.0,
            factorised: None,
            correction: zeros(pairs),
            distribution: [0; MAX_ITERATIONS],
        }
    }

    /// Decides, at the start of a step with weights from `rate_weight`, whether to keep the matrix.
    pub fn begin(&mut self, rate_weight: f64) {
        if let Some(made_for) = self.factorised {
            let ratio = rate_weight / made_for;
            if self.settings.keep == 1.0 || !(1.0 / self.settings.keep..=self.settings.keep).contains(&ratio) {
                self.factorised = None;
            }
        }
    }

    /// Notes that the system has changed.
    pub fn forget(&mut self) {
        self.factorised = None;
    }

    /// Solves for `a`, starting from its present value; leaves `(q, v)` at the solution.
    #[allow(clippy::too_many_arguments, reason = "a point, its start, and how it moves")]
    pub fn solve(
        &mut self,
        system: &mut System,
        time: f64,
        q: &mut [[f64; 2]],
        v: &mut [[f64; 2]],
        a: &mut [[f64; 2]],
        base: (&[[f64; 2]], &[[f64; 2]]),
        weights: StepWeights<f64>,
    ) -> Result<(), Failure> {
        place(q, v, a, base, weights);
        let mut previous_norm: Option<f64> = None;
        for iteration in 0..MAX_ITERATIONS {
            system.residual(time, q, v, a, &mut self.correction);
            let fresh = self.factorised.is_none();
            if fresh {
                system.factorise(time, q, v, a, weights, LaneSet::first(1));
                self.factorised = Some(weights.rates);
            }
            system.solve(&mut self.correction);
            if !self.correction.as_flattened().iter().all(|x| x.is_finite()) {
                self.factorised = None;
                return Err(Failure);
            }
            let mut norm = 0.0_f64;
            for ((a, v), correction) in
                a.as_flattened_mut().iter_mut().zip(v.as_flattened()).zip(self.correction.as_flattened())
            {
                *a -= correction;
                let rate = weights.rates * correction / v.abs().max(self.tolerances.rate_scale);
                let angle = weights.coordinates * correction / self.tolerances.coordinate_scale;
                norm = norm.max(rate.abs().max(angle.abs()) / self.tolerances.relative);
            }
            place(q, v, a, base, weights);
            if self.settings.fixed > 0 {
                if iteration + 1 < self.settings.fixed {
                    continue;
                }
                self.distribution[iteration] += 1;
                // Far from the solution, the step must be shorter.
                return if norm > self.settings.reject { Err(Failure) } else { Ok(()) };
            }
            if let Some(previous) = previous_norm {
                let contraction = norm / previous;
                if contraction > 0.5 && norm > self.settings.tolerance {
                    self.factorised = None;
                    if fresh {
                        return Err(Failure);
                    }
                    previous_norm = None;
                    continue;
                }
                self.contraction = contraction.max(0.3 * self.contraction);
            } else if iteration == 0 {
                self.contraction = self.contraction.max(f64::EPSILON).powf(0.8);
            }
            previous_norm = Some(norm);
            let remaining =
                if self.contraction < 1.0 { self.contraction / (1.0 - self.contraction) * norm } else { norm };
            if remaining <= self.settings.tolerance || norm * self.tolerances.relative <= 8.0 * f64::EPSILON {
                self.distribution[iteration] += 1;
                return Ok(());
            }
        }
        self.factorised = None;
        Err(Failure)
    }
}

fn place(
    q: &mut [[f64; 2]],
    v: &mut [[f64; 2]],
    a: &[[f64; 2]],
    (q_base, v_base): (&[[f64; 2]], &[[f64; 2]]),
    weights: StepWeights<f64>,
) {
    q.copy_from_slice(q_base);
    v.copy_from_slice(v_base);
    axpy(q, weights.coordinates, a);
    axpy(v, weights.rates, a);
}

/// Largest component of an error `(δq, δv)` relative to the tolerances, for a step from `start` to `end` rates.
pub fn norm(
    tolerances: Tolerances,
    angle: &[[f64; 2]],
    rate: &[[f64; 2]],
    start: &[[f64; 2]],
    end: &[[f64; 2]],
) -> f64 {
    let mut largest = 0.0_f64;
    let sizes = start.as_flattened().iter().zip(end.as_flattened());
    for ((angle, rate), (start, end)) in angle.as_flattened().iter().zip(rate.as_flattened()).zip(sizes) {
        let size = start.abs().max(end.abs()).max(tolerances.rate_scale);
        let error = (angle / tolerances.coordinate_scale).abs().max((rate / size).abs()) / tolerances.relative;
        if error.is_nan() {
            return f64::INFINITY;
        }
        largest = largest.max(error);
    }
    largest
}
