//! One error-controlled ESDIRK step at a time.

use super::tableau::Tableau;
use super::{IntegrationError, RejectionCause, SecondOrderSystem, Statistics, Tolerances};
use crate::equations::{PolarAxis, StepWeights, near_pole};

/// A point of a trajectory.
#[derive(Clone, Debug, PartialEq)]
pub struct State<const Q: usize> {
    /// Time in s.
    pub time: f64,
    /// The charts that the coordinates are in; none if the system has one chart only.
    pub charts: Vec<PolarAxis>,
    /// Coordinates in rad.
    pub q: Vec<[f64; 2]>,
    /// Rates in rad/s.
    pub v: Vec<[f64; 2]>,
    /// Accelerations in rad/s².
    pub accelerations: Vec<[f64; 2]>,
    /// Quantities integrated beside the motion.
    pub integrals: [f64; Q],
    /// Their rates.
    pub rates: [f64; Q],
}

impl<const Q: usize> State<Q> {
    /// The state `(q, v)` at `time`, in the charts of `system`, with the accelerations and rates that it gives there.
    pub fn new(system: &mut impl SecondOrderSystem<Q>, time: f64, q: Vec<[f64; 2]>, v: Vec<[f64; 2]>) -> Self {
        let mut accelerations = vec![[0.0; 2]; q.len()];
        system.accelerations(time, &q, &v, &mut accelerations);
        let rates = system.rates(time, &q, &v, &accelerations);
        let charts = system.charts().to_vec();
        Self { time, charts, q, v, accelerations, integrals: [0.0; Q], rates }
    }

    /// Converts coordinates, rates and accelerations of `segment` (by index) to those about `axis`.
    ///
    /// The same motion to rounding, which grows as `1/sin² φ` where `axis` is near the segment's direction.
    ///
    /// # Panics
    /// If there is no such segment, or the system has one chart only.
    pub fn change_chart(&mut self, segment: usize, axis: PolarAxis) {
        if self.charts[segment] == axis {
            return;
        }
        let motion = [self.q[segment], self.v[segment], self.accelerations[segment]];
        [self.q[segment], self.v[segment], self.accelerations[segment]] =
            axis.coordinates(self.charts[segment].direction(motion));
        self.charts[segment] = axis;
    }

    /// Turns the segments that are near a pole of their coordinates over to their other chart; how many.
    ///
    /// For between steps. A segment that has just changed is far from the poles of its new chart.
    pub fn leave_poles(&mut self) -> usize {
        let mut changes = 0;
        for segment in 0..self.charts.len() {
            if near_pole(self.q[segment][0]) {
                self.change_chart(segment, self.charts[segment].other());
                changes += 1;
            }
        }
        changes
    }
}

/// Newton's method stops when its error is this fraction of what a step may err.
const NEWTON_TOLERANCE: f64 = 0.02;
const MAX_NEWTON_ITERATIONS: usize = 8;
/// Above this ratio of successive corrections the matrix is made anew, or the step given up.
const MAX_CONTRACTION: f64 = 0.5;
/// The estimate of the contraction falls by no more than this at a time, as in CVODE: with a new matrix one ratio of
/// corrections can be near zero, and the stages that share the matrix converge by far not as fast.
const SLOWEST_DECLINE: f64 = 0.3;
/// Bounds on the change of the step, and the margin below the step that would just be accepted.
const MIN_FACTOR: f64 = 0.2;
const MAX_FACTOR: f64 = 5.0;
const SAFETY: f64 = 0.9;
/// After a failure of Newton's method.
const NEWTON_FACTOR: f64 = 0.3;
/// A step below this many roundings of the time cannot advance it.
const MIN_STEP_ROUNDINGS: f64 = 8.0;
/// Near time zero, where roundings vanish, the time is taken for this share of what remains.
const MIN_STEP_SHARE: f64 = 1e-3;

/// Advances a system by steps of a [`Tableau`].
///
/// The error of a step is the largest component of the difference to the embedded solution, each measured against
/// `relative × max(scale, |value|)` for a rate and `relative × scale` for an angle, whose origin is arbitrary.
#[derive(Clone, Debug)]
pub struct Integrator<const Q: usize> {
    tableau: &'static Tableau,
    tolerances: Tolerances,
    statistics: Statistics,
    /// The step to try next in s.
    step: f64,
    previous_error: f64,
    /// Weights of the step less those of the embedded method.
    error_weights: Vec<f64>,
    stage_v: Vec<Vec<[f64; 2]>>,
    stage_a: Vec<Vec<[f64; 2]>>,
    stage_rates: Vec<[f64; Q]>,
    q: Vec<[f64; 2]>,
    q_base: Vec<[f64; 2]>,
    v_base: Vec<[f64; 2]>,
    correction: Vec<[f64; 2]>,
    /// Contraction of the last Newton iterations, the estimate for the next stage.
    contraction: f64,
}

impl<const Q: usize> Integrator<Q> {
    /// An integrator for systems of `pairs` pairs of coordinates that starts with `step` (s).
    pub fn new(tableau: &'static Tableau, tolerances: Tolerances, pairs: usize, step: f64) -> Self {
        let zeros = || vec![[0.0; 2]; pairs];
        let stages = tableau.stages();
        Self {
            tableau,
            tolerances,
            statistics: Statistics::default(),
            step,
            previous_error: 1.0,
            error_weights: (0..stages).map(|stage| tableau.weight(stage) - tableau.embedded[stage]).collect(),
            stage_v: vec![zeros(); stages],
            stage_a: vec![zeros(); stages],
            stage_rates: vec![[0.0; Q]; stages],
            q: zeros(),
            q_base: zeros(),
            v_base: zeros(),
            correction: zeros(),
            contraction: 1.0,
        }
    }

    /// Work so far.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// The step that will be tried next in s.
    pub fn step(&self) -> f64 {
        self.step
    }

    /// Counts a located event, after which the system is another one.
    pub fn count_event(&mut self) {
        self.statistics.contact_events += 1;
    }

    /// Counts segments turned over to their other chart.
    pub fn count_chart_changes(&mut self, changes: usize) {
        self.statistics.chart_changes += changes;
    }

    /// Advances from `start` to `end`, by the step that the error control chooses but not past `last_time`.
    ///
    /// # Errors
    /// If no step is accepted.
    pub fn advance(
        &mut self,
        system: &mut impl SecondOrderSystem<Q>,
        start: &State<Q>,
        end: &mut State<Q>,
        last_time: f64,
    ) -> Result<(), IntegrationError> {
        if let Some(pair) = system.pole(&start.q) {
            return Err(IntegrationError::Pole { segment: pair + 1, time: start.time });
        }
        if !finite(&start.accelerations) {
            return Err(IntegrationError::NotFinite { time: start.time });
        }
        loop {
            let remaining = last_time - start.time;
            let limited = self.step >= remaining;
            // Two equal steps rather than a whole one and a crumb.
            let step = match () {
                () if limited => remaining,
                () if 2.0 * self.step > remaining => remaining / 2.0,
                () => self.step,
            };
            let outcome = self.attempt(system, start, end, step);
            if limited {
                end.time = last_time;
            }
            let cause = match outcome {
                Ok(error) if error <= 1.0 => {
                    self.accept(step, error, limited);
                    return Ok(());
                }
                Ok(error) => {
                    self.step = step * self.factor(error).min(1.0);
                    RejectionCause::Error
                }
                Err(cause) => {
                    self.step = step * NEWTON_FACTOR;
                    cause
                }
            };
            self.count_failure(cause);
            self.check_step(start.time, remaining, cause)?;
        }
    }

    /// Refuses a next step that cannot advance the time.
    fn check_step(&self, time: f64, remaining: f64, cause: RejectionCause) -> Result<(), IntegrationError> {
        let resolution = f64::EPSILON * time.abs().max(MIN_STEP_SHARE * remaining);
        if self.step < MIN_STEP_ROUNDINGS * resolution {
            return Err(IntegrationError::StepTooSmall { time, step: self.step, cause });
        }
        Ok(())
    }

    /// Repeats the last step with the length `step` (s), to land on an event inside it.
    ///
    /// # Errors
    /// If the shorter step fails; [`Integrator::retreat`] then leads on.
    pub fn repeat(
        &mut self,
        system: &mut impl SecondOrderSystem<Q>,
        start: &State<Q>,
        end: &mut State<Q>,
        step: f64,
    ) -> Result<(), RejectionCause> {
        self.attempt(system, start, end, step).map(|_| ())
    }

    /// Gives a step of the length `step` (s) up after a failed [`Integrator::repeat`]: the next one is shorter.
    ///
    /// # Errors
    /// If it would be too short to advance the time.
    pub fn retreat(&mut self, time: f64, step: f64, cause: RejectionCause) -> Result<(), IntegrationError> {
        self.count_failure(cause);
        self.step = NEWTON_FACTOR * step;
        self.check_step(time, step, cause)
    }

    fn count_failure(&mut self, cause: RejectionCause) {
        match cause {
            RejectionCause::Error | RejectionCause::Pole { .. } => self.statistics.rejected_steps += 1,
            RejectionCause::Newton | RejectionCause::NotFinite => self.statistics.newton_failures += 1,
        }
    }

    fn accept(&mut self, step: f64, error: f64, limited: bool) {
        self.statistics.steps += 1;
        let proposed = step * self.factor(error);
        // A step cut short by the end says nothing against the longer one.
        self.step = if limited { self.step.max(proposed) } else { proposed };
        self.previous_error = error.max(1e-4);
    }

    /// Step factor of a PI controller (Hairer and Wanner II, section IV.2).
    fn factor(&self, error: f64) -> f64 {
        let order = f64::from(self.tableau.order);
        let factor = SAFETY * error.max(1e-10).powf(-0.7 / order) * self.previous_error.powf(0.3 / order);
        factor.clamp(MIN_FACTOR, MAX_FACTOR)
    }

    /// One step of the length `step`; the error estimate relative to the tolerance.
    fn attempt(
        &mut self,
        system: &mut impl SecondOrderSystem<Q>,
        start: &State<Q>,
        end: &mut State<Q>,
        step: f64,
    ) -> Result<f64, RejectionCause> {
        let tableau = self.tableau;
        let last = tableau.stages() - 1;
        system.set_charts(&start.charts);
        self.stage_v[0].copy_from_slice(&start.v);
        self.stage_a[0].copy_from_slice(&start.accelerations);
        self.stage_rates[0] = start.rates;
        let mut factorised = false;
        for stage in 1..=last {
            self.solve_stage(system, start, stage, step, &mut factorised).map_err(|cause| match cause {
                RejectionCause::NotFinite => self.pole(system).unwrap_or(cause),
                _ => cause,
            })?;
        }
        if let Some(cause) = self.pole(system) {
            return Err(cause);
        }
        end.time = start.time + step;
        end.charts.clone_from(&start.charts);
        end.q.copy_from_slice(&self.q);
        end.v.copy_from_slice(&self.stage_v[last]);
        end.accelerations.copy_from_slice(&self.stage_a[last]);
        end.rates = self.stage_rates[last];
        end.integrals = start.integrals;
        for stage in 0..=last {
            for (integral, rate) in end.integrals.iter_mut().zip(self.stage_rates[stage]) {
                *integral += step * tableau.weight(stage) * rate;
            }
        }
        let error = self.error(start, end, step);
        if error.is_finite() { Ok(error) } else { Err(RejectionCause::NotFinite) }
    }

    /// The pole that the point of the last stage stands at.
    fn pole(&self, system: &impl SecondOrderSystem<Q>) -> Option<RejectionCause> {
        system.pole(&self.q).map(|pair| RejectionCause::Pole { segment: pair + 1 })
    }

    fn solve_stage(
        &mut self,
        system: &mut impl SecondOrderSystem<Q>,
        start: &State<Q>,
        stage: usize,
        step: f64,
        factorised: &mut bool,
    ) -> Result<(), RejectionCause> {
        let tableau = self.tableau;
        let time = start.time + tableau.node(stage) * step;
        let diagonal = tableau.gamma * step;
        let weights = StepWeights { coordinates: diagonal * diagonal, rates: diagonal };
        let (earlier_v, rest_v) = self.stage_v.split_at_mut(stage);
        let (earlier_a, rest_a) = self.stage_a.split_at_mut(stage);
        let (v, a) = (&mut rest_v[0], &mut rest_a[0]);
        self.q_base.copy_from_slice(&start.q);
        self.v_base.copy_from_slice(&start.v);
        for j in 0..stage {
            let factor = step * tableau.coefficient(stage, j);
            for (base, earlier) in self.q_base.as_flattened_mut().iter_mut().zip(earlier_v[j].as_flattened()) {
                *base += factor * earlier;
            }
            for (base, earlier) in self.v_base.as_flattened_mut().iter_mut().zip(earlier_a[j].as_flattened()) {
                *base += factor * earlier;
            }
        }
        a.copy_from_slice(&earlier_a[stage - 1]);
        place(&mut self.q, v, a, &self.q_base, &self.v_base, diagonal);

        let mut previous_norm: Option<f64> = None;
        for iteration in 0..MAX_NEWTON_ITERATIONS {
            system.residual(time, &self.q, v, a, &mut self.correction);
            if !finite(&self.correction) {
                return Err(RejectionCause::NotFinite);
            }
            self.statistics.newton_iterations += 1;
            let fresh = !*factorised;
            if fresh {
                system.factorise(time, v, a, weights);
                self.statistics.factorisations += 1;
                *factorised = true;
            }
            system.solve(&mut self.correction);
            // Before the norm, whose maximum would drop a NaN.
            if !finite(&self.correction) {
                return Err(RejectionCause::NotFinite);
            }
            let mut norm = 0.0_f64;
            let corrections = self.correction.as_flattened().iter();
            for ((a, v), correction) in a.as_flattened_mut().iter_mut().zip(v.as_flattened()).zip(corrections) {
                *a -= correction;
                norm = norm.max(weighted(self.tolerances, weights, *correction, v.abs()));
            }
            place(&mut self.q, v, a, &self.q_base, &self.v_base, diagonal);
            if let Some(previous) = previous_norm {
                let contraction = norm / previous;
                if contraction > MAX_CONTRACTION && norm > NEWTON_TOLERANCE {
                    if fresh {
                        return Err(RejectionCause::Newton);
                    }
                    *factorised = false;
                    previous_norm = None;
                    continue;
                }
                self.contraction = contraction.max(SLOWEST_DECLINE * self.contraction);
            } else if iteration == 0 {
                // Hairer and Wanner II, section IV.8: trust the last contraction, but not wholly.
                self.contraction = self.contraction.max(f64::EPSILON).powf(0.8);
            }
            previous_norm = Some(norm);
            let remaining =
                if self.contraction < 1.0 { self.contraction / (1.0 - self.contraction) * norm } else { norm };
            // Corrections of a few roundings are noise, whose contraction says nothing.
            if remaining <= NEWTON_TOLERANCE || norm * self.tolerances.relative <= 8.0 * f64::EPSILON {
                self.stage_rates[stage] = system.rates(time, &self.q, v, a);
                return Ok(());
            }
        }
        Err(RejectionCause::Newton)
    }

    fn error(&self, start: &State<Q>, end: &State<Q>, step: f64) -> f64 {
        let Tolerances { relative, angle_scale, rate_scale } = self.tolerances;
        let mut largest = 0.0_f64;
        for i in 0..2 * start.q.len() {
            let (mut angle, mut rate) = (0.0, 0.0);
            for (stage, weight) in self.error_weights.iter().enumerate() {
                angle += step * weight * self.stage_v[stage].as_flattened()[i];
                rate += step * weight * self.stage_a[stage].as_flattened()[i];
            }
            let size = start.v.as_flattened()[i].abs().max(end.v.as_flattened()[i].abs());
            let error = (angle / angle_scale).abs().max((rate / size.max(rate_scale)).abs()) / relative;
            // `max` would drop a NaN.
            if error.is_nan() {
                return error;
            }
            largest = largest.max(error);
        }
        largest
    }
}

/// The part of the tolerance that a change of an acceleration takes up.
fn weighted(tolerances: Tolerances, weights: StepWeights<f64>, change: f64, rate: f64) -> f64 {
    let angle = weights.coordinates * change / tolerances.angle_scale;
    let rate = weights.rates * change / rate.max(tolerances.rate_scale);
    angle.abs().max(rate.abs()) / tolerances.relative
}

/// `v = v̂ + γΔ a`, `q = q̂ + γΔ v`
fn place(
    q: &mut [[f64; 2]],
    v: &mut [[f64; 2]],
    a: &[[f64; 2]],
    q_base: &[[f64; 2]],
    v_base: &[[f64; 2]],
    diagonal: f64,
) {
    let targets = q.as_flattened_mut().iter_mut().zip(v.as_flattened_mut());
    let bases = q_base.as_flattened().iter().zip(v_base.as_flattened());
    for (((q, v), a), (q_base, v_base)) in targets.zip(a.as_flattened()).zip(bases) {
        *v = v_base + diagonal * a;
        *q = q_base + diagonal * *v;
    }
}

fn finite(values: &[[f64; 2]]) -> bool {
    values.as_flattened().iter().all(|value| value.is_finite())
}
