//! The generalised-α method with adaptive steps.

use bristle::equations::StepWeights;
use bristle::integrate::Tolerances;

use crate::newton::{Failure, MAX_ITERATIONS, Newton, NewtonSettings, Pairs, axpy, norm, zeros};
use crate::pass::{Method, pi_factor};
use crate::system::{Point, System};

/// Generalised-α (Chung and Hulbert, Journal of Applied Mechanics 60, 1993) in the form of Arnold and Brüls (Multibody
/// System Dynamics 18, 2007), whose residual is that of the end of the step: `(1 − α_m) ā' + α_m ā = (1 − α_f) a' + α_f a`,
/// `v' = v + h ((1 − γ) ā + γ ā')`, `q' = q + h v + h² ((½ − β) ā + β ā')`.
///
/// The error is the leading term of the truncation: `(β + Δ/2 − 1/6) h³ ȧ` in `q` and
/// `(γ(1 − γ)/2 + (α_f(1 − α_f) − α_m(1 − α_m))/2 − 1/24) h³ ä` in `v` with `Δ = α_m − α_f`, by divided differences of `a`.
/// `ā` belongs to the time `t + Δ h`, and moves with the step.
pub struct GeneralizedAlpha {
    tolerances: Tolerances,
    pub newton: Newton,
    alpha_m: f64,
    alpha_f: f64,
    gamma: f64,
    beta: f64,
    /// `ā − a`, of a step of the length `step`.
    offset: Pairs,
    tried_offset: Pairs,
    step: f64,
    tried_step: f64,
    /// Accelerations before the start.
    before: Option<Pairs>,
    previous_error: f64,
    q_base: Pairs,
    v_base: Pairs,
}

impl GeneralizedAlpha {
    /// The method with the spectral radius `radius` at infinite frequency.
    pub fn new(radius: f64, newton: NewtonSettings, tolerances: Tolerances, pairs: usize) -> Self {
        let alpha_m = (2.0 * radius - 1.0) / (radius + 1.0);
        let alpha_f = radius / (radius + 1.0);
        Self {
            tolerances,
            newton: Newton::new(newton, tolerances, pairs),
            alpha_m,
            alpha_f,
            gamma: 0.5 - alpha_m + alpha_f,
            beta: 0.25 * (1.0 - alpha_m + alpha_f).powi(2),
            offset: zeros(pairs),
            tried_offset: zeros(pairs),
            step: 0.0,
            tried_step: 0.0,
            before: None,
            previous_error: 1.0,
            q_base: zeros(pairs),
            v_base: zeros(pairs),
        }
    }
}

impl Method for GeneralizedAlpha {
    fn restart(&mut self, _: &Point) {
        self.newton.forget();
        self.before = None;
        self.step = 0.0;
        self.offset.as_flattened_mut().fill(0.0);
    }

    fn attempt(&mut self, system: &mut System, start: &Point, step: f64, end: &mut Point) -> Result<f64, Failure> {
        let Self { alpha_m, alpha_f, gamma, beta, .. } = *self;
        self.tried_step = step;
        let a = &start.accelerations;
        let mut bar = a.clone();
        if self.step > 0.0 {
            axpy(&mut bar, step / self.step, &self.offset);
        }
        // ā' = known + slope a'
        let slope = (1.0 - alpha_f) / (1.0 - alpha_m);
        let mut known = zeros(a.len());
        axpy(&mut known, alpha_f / (1.0 - alpha_m), a);
        axpy(&mut known, -alpha_m / (1.0 - alpha_m), &bar);
        self.v_base.copy_from_slice(&start.v);
        axpy(&mut self.v_base, step * (1.0 - gamma), &bar);
        axpy(&mut self.v_base, step * gamma, &known);
        self.q_base.copy_from_slice(&start.q);
        axpy(&mut self.q_base, step, &start.v);
        axpy(&mut self.q_base, step * step * (0.5 - beta), &bar);
        axpy(&mut self.q_base, step * step * beta, &known);
        let weights = StepWeights { coordinates: step * step * beta * slope, rates: step * gamma * slope };
        // The straight line through the last two.
        end.accelerations.copy_from_slice(a);
        if let Some(before) = &self.before {
            axpy(&mut end.accelerations, step / self.step, a);
            axpy(&mut end.accelerations, -step / self.step, before);
        }
        self.newton.begin(weights.rates);
        end.time = start.time + step;
        let base = (&self.q_base[..], &self.v_base[..]);
        self.newton.solve(system, end.time, &mut end.q, &mut end.v, &mut end.accelerations, base, weights)?;
        end.rates = system.rates(end.time, &end.q, &end.v, &end.accelerations);
        end.integrals[0] = start.integrals[0] + step * (start.rates[0] + end.rates[0]) / 2.0;
        self.tried_offset.copy_from_slice(&known);
        axpy(&mut self.tried_offset, slope - 1.0, &end.accelerations);

        let in_q = beta + (alpha_m - alpha_f) / 2.0 - 1.0 / 6.0;
        let shift = (alpha_f * (1.0 - alpha_f) - alpha_m * (1.0 - alpha_m)) / 2.0;
        let in_v = gamma * (1.0 - gamma) / 2.0 + shift - 1.0 / 24.0;
        let (mut angle, mut rate) = (zeros(a.len()), zeros(a.len()));
        axpy(&mut angle, in_q * step * step, &end.accelerations);
        axpy(&mut angle, -in_q * step * step, a);
        match &self.before {
            Some(before) => {
                // h³ ä = h³ 2 [a', a, a_before]
                let factor = in_v * step * step * step * 2.0 / (step + self.step);
                axpy(&mut rate, factor / step, &end.accelerations);
                axpy(&mut rate, -factor * (1.0 / step + 1.0 / self.step), a);
                axpy(&mut rate, factor / self.step, before);
            }
            None => {
                // Without earlier steps: as if all of the change were curvature.
                axpy(&mut rate, in_v * step, &end.accelerations);
                axpy(&mut rate, -in_v * step, a);
            }
        }
        Ok(norm(self.tolerances, &angle, &rate, &start.v, &end.v))
    }

    fn accept(&mut self, start: &Point, _: &Point, step: f64, error: f64, _: bool) -> f64 {
        self.offset.copy_from_slice(&self.tried_offset);
        self.step = self.tried_step;
        self.before = Some(start.accelerations.clone());
        let factor = pi_factor(error, self.previous_error, 3.0);
        self.previous_error = error.max(1e-4);
        step * factor
    }

    fn reject(&mut self, step: f64, error: f64) -> f64 {
        step * pi_factor(error, self.previous_error, 3.0).min(1.0)
    }

    fn distribution(&self) -> [usize; MAX_ITERATIONS] {
        self.newton.distribution
    }
}
