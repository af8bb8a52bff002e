//! One attempt at a step, of one system or of several side by side in the lanes of `T`.

use super::tableau::Tableau;
use super::{
    LARGEST_CONTROLLED_VARIATION, Point, SecondOrderSystem, State, Tolerances, VARIATION_TOLERANCE,
};
use crate::equations::dispatch::{Loop, dispatch};
use crate::equations::linear::{add, in_lane, scale, sub, unrolled, zero};
use crate::equations::{LaneSet, Lanewise, StepWeights};

/// Stages of the longest method.
const MAX_STAGES: usize = 8;

/// Error at which Newton's method stops, over the error allowed for a step.
const NEWTON_TOLERANCE: f64 = 0.02;
/// Largest error at which Newton's method stops where a step may miss the tolerance, relative to
/// the scales of the tolerances.
const LOOSEST_NEWTON_TOLERANCE: f64 = 1e-5;
/// Size of a first correction, in tolerances, below which Newton's method stops, unless stages are
/// [`StageSolution::Converged`].
///
/// Measured on contacts (docs/methods.md): a smaller limit costs work and gains no accuracy,
/// because the error estimate includes the unsolved part of a stage.
const TRUSTED_CORRECTION: f64 = 1000.0;
/// Relative tolerance below which the trusted correction falls with the tolerance; otherwise the
/// unsolved part would be the largest error. With [`StageSolution::Cautious`] it also falls above,
/// with the square: in such long steps a point may stick in one stage and slide in the next, which
/// one iteration misses.
const TRUSTED_TOLERANCE: f64 = 1e-6;
/// Share of the corrected value above which a first correction that is not trusted fails a step of
/// [`StageSolution::Predicted`]: it is too long for the prediction and would be rejected later.
/// Between the two, at tight tolerances, Newton's method continues.
const HOPEFUL_CORRECTION: f64 = 0.1;
const MAX_NEWTON_ITERATIONS: usize = 8;
/// Ratio of successive corrections above which the matrix is computed again, or the step fails.
const MAX_CONTRACTION: f64 = 0.5;
/// Smallest factor by which the estimated contraction falls at a time, as in CVODE. With a new
/// matrix one ratio of corrections can be near zero, although the stages that share the matrix
/// converge much more slowly.
const SLOWEST_DECLINE: f64 = 0.3;

/// Use of Newton's method for the equations of a stage (docs/methods.md).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum StageSolution {
    /// One iteration from an extrapolation of earlier stages. For smooth systems, where more
    /// iterations gain nothing.
    Predicted,
    /// One iteration from an extrapolation if its correction is small; otherwise more follow, to a
    /// small part of the tolerance. For equations as sharp as those of dry friction, in systems
    /// with damping.
    Cautious,
    /// Iterations from `q̈` of the previous stage, to a small part of the tolerance. For systems
    /// that must not gain energy.
    Converged,
}

impl StageSolution {
    /// Returns the size of a first correction, in tolerances, below which no other follows.
    fn trusted_correction(self, relative: f64) -> f64 {
        let tolerance = relative / TRUSTED_TOLERANCE;
        match self {
            Self::Predicted => TRUSTED_CORRECTION * tolerance.min(1.0),
            Self::Cautious => TRUSTED_CORRECTION * tolerance.min(1.0 / (tolerance * tolerance)),
            Self::Converged => 0.0,
        }
    }
}

/// Reason why an attempt produced no state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AttemptError {
    /// Newton's method does not converge.
    Newton,
    /// A value is infinite or not a number.
    NotFinite,
}

/// Memory and arithmetic of a step. Each stage is predicted from earlier ones and corrected by
/// Newton's method with a matrix from the first stage. The result of a lane does not depend on
/// other lanes.
#[derive(Clone, Debug)]
pub struct Stepper<T, const D: usize, const Q: usize> {
    tableau: &'static Tableau,
    solution: StageSolution,
    /// Weights of earlier stages in the prediction of each stage's `q̈`.
    predictors: Vec<Vec<f64>>,
    /// Weights of the step minus those of the embedded method.
    error_weights: Vec<f64>,
    tolerances: LaneTolerances<T>,
    /// Start of the step.
    time: T,
    start_q: Vec<[T; D]>,
    start_integrals: [T; Q],
    /// Values by stage, then by block.
    stage_v: Vec<[T; D]>,
    stage_a: Vec<[T; D]>,
    stage_rates: Vec<[T; Q]>,
    q: Vec<[T; D]>,
    q_base: Vec<[T; D]>,
    v_base: Vec<[T; D]>,
    correction: Vec<[T; D]>,
    integrals: [T; Q],
    /// Error estimate of the last attempt, in tolerances.
    error: T,
    newton: Vec<Newton>,
}

/// Newton's method in one lane.
#[derive(Clone, Copy, Debug)]
struct Newton {
    /// Estimated error, in tolerances, at which the method ends.
    tolerance: f64,
    /// Contraction of the last iterations, the estimate for the next stage.
    contraction: f64,
    previous_norm: Option<f64>,
    /// Work of the last attempt.
    iterations: usize,
    factorisations: usize,
    failed: bool,
}

/// Verdict of [`Newton::judge`].
enum NewtonVerdict {
    Converged,
    Continues,
    /// Continue with a matrix from the present point.
    NeedsMatrix,
    Failed,
}

impl Newton {
    fn new() -> Self {
        Self {
            tolerance: NEWTON_TOLERANCE,
            contraction: 1.0,
            previous_norm: None,
            iterations: 0,
            factorisations: 0,
            failed: false,
        }
    }

    /// Judges an `iteration` by the size of its correction, in tolerances; `fresh` if it made the
    /// matrix.
    fn judge(
        &mut self,
        solution: StageSolution,
        iteration: usize,
        norm: f64,
        fresh: bool,
        relative: f64,
    ) -> NewtonVerdict {
        if !norm.is_finite() {
            return NewtonVerdict::Failed;
        }
        if iteration == 0 {
            if norm < solution.trusted_correction(relative) {
                return NewtonVerdict::Converged;
            }
            if solution == StageSolution::Predicted && norm * relative > HOPEFUL_CORRECTION {
                return NewtonVerdict::Failed;
            }
        }
        if let Some(previous) = self.previous_norm {
            let contraction = norm / previous;
            if contraction > MAX_CONTRACTION && norm > self.tolerance {
                self.previous_norm = None;
                return if fresh {
                    NewtonVerdict::Failed
                } else {
                    NewtonVerdict::NeedsMatrix
                };
            }
            self.contraction = contraction.max(SLOWEST_DECLINE * self.contraction);
        } else if iteration == 0 {
            // Hairer and Wanner II, section IV.8: trust the last contraction, but not entirely.
            self.contraction = self.contraction.max(f64::EPSILON).powf(0.8);
        }
        self.previous_norm = Some(norm);
        let remaining = if self.contraction < 1.0 {
            self.contraction / (1.0 - self.contraction) * norm
        } else {
            norm
        };
        // Corrections of a few roundings are noise, and their contraction means nothing.
        if remaining <= self.tolerance || norm * relative <= 8.0 * f64::EPSILON {
            NewtonVerdict::Converged
        } else {
            NewtonVerdict::Continues
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct LaneTolerances<T> {
    relative: T,
    coordinate_scale: T,
    rate_scale: T,
    integral_scales: [T; 2],
}

impl<T: Lanewise, const D: usize, const Q: usize> Stepper<T, D, Q> {
    /// Creates a stepper for systems of `blocks` blocks of coordinates.
    pub fn new(tableau: &'static Tableau, solution: StageSolution, blocks: usize) -> Self {
        let none = T::ZERO;
        let one = T::from_f64(1.0);
        let zeros = || vec![[none; D]; blocks];
        let stages = tableau.stages();
        assert!(
            stages <= MAX_STAGES,
            "a method has at most {MAX_STAGES} stages"
        );
        Self {
            tableau,
            solution,
            predictors: (0..stages)
                .map(|stage| predictor(tableau, solution, stage))
                .collect(),
            error_weights: (0..stages)
                .map(|stage| -tableau.error_weight(stage))
                .collect(),
            tolerances: LaneTolerances {
                relative: one,
                coordinate_scale: one,
                rate_scale: one,
                integral_scales: [one; 2],
            },
            time: none,
            start_q: zeros(),
            start_integrals: [none; Q],
            stage_v: vec![[none; D]; stages * blocks],
            stage_a: vec![[none; D]; stages * blocks],
            stage_rates: vec![[none; Q]; stages],
            q: zeros(),
            q_base: zeros(),
            v_base: zeros(),
            correction: zeros(),
            integrals: [none; Q],
            error: none,
            newton: vec![Newton::new(); T::LANES],
        }
    }

    /// Sets the scales against which errors in `lane` are measured.
    ///
    /// A new integration begins in that lane.
    pub fn set_tolerances(&mut self, lane: usize, tolerances: Tolerances) {
        self.newton[lane] = Newton::new();
        let Tolerances {
            relative,
            coordinate_scale,
            rate_scale,
            integral_scales,
        } = tolerances;
        self.tolerances.relative.set_lane(lane, relative);
        self.tolerances
            .coordinate_scale
            .set_lane(lane, coordinate_scale);
        self.tolerances.rate_scale.set_lane(lane, rate_scale);
        for (scale, own) in self
            .tolerances
            .integral_scales
            .iter_mut()
            .zip(integral_scales)
        {
            scale.set_lane(lane, own);
        }
    }

    /// Sets the error, in tolerances, with which the next steps of `lane` will be accepted: stages
    /// need not be more accurate.
    pub fn set_allowed_error(&mut self, lane: usize, error: f64) {
        let loosest = LOOSEST_NEWTON_TOLERANCE / self.tolerances.relative.lane(lane);
        self.newton[lane].tolerance = (NEWTON_TOLERANCE * error)
            .min(loosest)
            .max(NEWTON_TOLERANCE);
    }

    /// Sets the state from which the steps of `lane` start.
    ///
    /// # Panics
    /// If the state has a different number of coordinates.
    pub fn set_start(&mut self, lane: usize, start: &State<impl Clone, D, Q>) {
        self.time.set_lane(lane, start.time);
        scatter(lane, &start.q, &mut self.start_q);
        let n = self.start_q.len();
        scatter(lane, &start.v, &mut self.stage_v[..n]);
        scatter(lane, &start.accelerations, &mut self.stage_a[..n]);
        for i in 0..Q {
            self.start_integrals[i].set_lane(lane, start.integrals[i]);
            self.stage_rates[0][i].set_lane(lane, start.rates[i]);
        }
    }

    /// Attempts a step of the length `step` (s) in all lanes; [`Stepper::outcome`] gives the result
    /// of each.
    pub fn attempt(&mut self, system: &mut impl SecondOrderSystem<T, D, Q>, step: T) {
        let (tableau, n) = (self.tableau, self.start_q.len());
        let last = tableau.stages() - 1;
        let diagonal = T::from_f64(tableau.gamma) * step;
        let weights = StepWeights {
            coordinates: diagonal * diagonal,
            rates: diagonal,
        };
        for newton in &mut self.newton {
            *newton = Newton {
                iterations: 0,
                factorisations: 0,
                failed: false,
                ..*newton
            };
        }
        for stage in 1..=last {
            let time = self.time + T::from_f64(tableau.node(stage)) * step;
            self.predict(stage, step, diagonal);
            self.solve_stage(system, stage, time, weights);
        }
        let (v, accelerations) = (&self.stage_v[last * n..], &self.stage_a[last * n..]);
        self.stage_rates[last] = system.rates(&Point {
            time: self.time + step,
            q: &self.q,
            v,
            accelerations,
        });
        for i in 0..Q {
            let mut integral = self.start_integrals[i];
            for stage in 0..=last {
                integral = integral
                    + T::from_f64(tableau.weight(stage)) * step * self.stage_rates[stage][i];
            }
            self.integrals[i] = integral;
        }
        self.error = self.estimate(step, system.carries_variation());
        let LaneTolerances {
            relative,
            integral_scales,
            ..
        } = self.tolerances;
        for &[i, scale] in system.controlled_integrals() {
            let rates = self.stage_rates.iter().zip(&self.error_weights);
            let error = rates.fold(T::ZERO, |sum, (rates, weight)| {
                sum + T::from_f64(*weight) * rates[i]
            });
            self.error = self
                .error
                .max((error * step).abs() / (integral_scales[scale] * relative));
        }
    }

    /// Returns the error of the last attempt in `lane`, in tolerances. Writes the resulting state
    /// to `end`.
    ///
    /// # Errors
    /// If the attempt produced no state.
    pub fn outcome(
        &self,
        lane: usize,
        end: &mut State<impl Clone, D, Q>,
    ) -> Result<f64, AttemptError> {
        let last = self.tableau.stages() - 1;
        gather(lane, &self.q, &mut end.q);
        let n = self.start_q.len();
        gather(lane, &self.stage_v[last * n..], &mut end.v);
        gather(lane, &self.stage_a[last * n..], &mut end.accelerations);
        for i in 0..Q {
            end.integrals[i] = self.integrals[i].lane(lane);
            end.rates[i] = self.stage_rates[last][i].lane(lane);
        }
        let error = self.error.lane(lane);
        // The estimate sums all stages: if one is not finite, neither is the estimate.
        if !error.is_finite() {
            return Err(AttemptError::NotFinite);
        }
        if self.newton[lane].failed {
            Err(AttemptError::Newton)
        } else {
            Ok(error)
        }
    }

    /// Solves a predicted stage by Newton's method.
    fn solve_stage(
        &mut self,
        system: &mut impl SecondOrderSystem<T, D, Q>,
        stage: usize,
        time: T,
        weights: StepWeights<T>,
    ) {
        let n = self.start_q.len();
        let (all, variation) = (LaneSet::first(T::LANES), system.carries_variation());
        let (mut open, mut matrix) = (all, if stage == 1 { all } else { LaneSet::default() });
        for newton in &mut self.newton {
            newton.previous_norm = None;
        }
        for iteration in 0..MAX_NEWTON_ITERATIONS {
            let (v, accelerations) = (
                &self.stage_v[stage * n..][..n],
                &self.stage_a[stage * n..][..n],
            );
            let at = Point {
                time,
                q: &self.q,
                v,
                accelerations,
            };
            if matrix.is_empty() {
                system.correction(&at, &mut self.correction);
            } else {
                system.residual(&at, &mut self.correction);
                system.factorise(&at, weights, matrix);
                system.solve(&mut self.correction);
            }
            if variation {
                system.solve_variation(&at, weights, &mut self.correction);
            }
            if open != all {
                keep(&mut self.correction, open);
            }
            let norms = self.correct(stage, weights, variation);
            let (mut next_matrix, mut solved) = (LaneSet::default(), LaneSet::default());
            for lane in open.iter() {
                let newton = &mut self.newton[lane];
                let fresh = matrix.contains(lane);
                newton.iterations += 1;
                newton.factorisations += usize::from(fresh);
                let relative = self.tolerances.relative.lane(lane);
                match newton.judge(self.solution, iteration, norms.lane(lane), fresh, relative) {
                    NewtonVerdict::Converged => solved.insert(lane),
                    NewtonVerdict::Continues => {}
                    NewtonVerdict::NeedsMatrix => next_matrix.insert(lane),
                    NewtonVerdict::Failed => {
                        newton.failed = true;
                        open.remove(lane);
                    }
                }
            }
            if !solved.is_empty() {
                let (v, accelerations) = (
                    &self.stage_v[stage * n..][..n],
                    &self.stage_a[stage * n..][..n],
                );
                let at = Point {
                    time,
                    q: &self.q,
                    v,
                    accelerations,
                };
                let rates = system.stage_rates(&at, &self.correction, weights);
                for (kept, rate) in self.stage_rates[stage].iter_mut().zip(rates) {
                    *kept = rate.select(solved, *kept);
                }
                for lane in solved.iter() {
                    open.remove(lane);
                }
            }
            if open.is_empty() {
                return;
            }
            matrix = next_matrix;
        }
        for lane in open.iter() {
            self.newton[lane].failed = true;
        }
    }

    /// Returns iterations and factorisations of the last attempt in `lane`.
    pub fn work(&self, lane: usize) -> (usize, usize) {
        (
            self.newton[lane].iterations,
            self.newton[lane].factorisations,
        )
    }

    /// Sets a stage to its extrapolation from earlier stages.
    fn predict(&mut self, stage: usize, step: T, diagonal: T) {
        let split = stage * self.start_q.len();
        let (earlier_v, v) = self.stage_v.split_at_mut(split);
        let (earlier_a, a) = self.stage_a.split_at_mut(split);
        let (mut weights, mut predictor) = (zero::<T, MAX_STAGES>(), zero::<T, MAX_STAGES>());
        for j in 0..stage {
            weights[j] = T::from_f64(self.tableau.coefficient(stage, j)) * step;
            predictor[j] = T::from_f64(self.predictors[stage][j]);
        }
        let place = StagePoint {
            q: &mut self.q,
            v,
            a,
            q_base: &mut self.q_base,
            v_base: &mut self.v_base,
        };
        let earlier = Earlier {
            start_q: &self.start_q,
            v: earlier_v,
            a: earlier_a,
        };
        dispatch(Predict {
            place,
            earlier,
            weights: &weights[..stage],
            predictor: &predictor[..stage],
            diagonal,
        });
    }

    /// Applies the solved correction and returns its size in tolerances.
    fn correct(&mut self, stage: usize, weights: StepWeights<T>, variation: bool) -> T {
        let start = stage * self.start_q.len();
        let place = StagePoint {
            q: &mut self.q,
            v: &mut self.stage_v[start..],
            a: &mut self.stage_a[start..],
            q_base: &mut self.q_base,
            v_base: &mut self.v_base,
        };
        dispatch(Correct {
            place,
            correction: &self.correction,
            weights,
            tolerances: self.tolerances,
            variation,
        })
    }

    /// Returns the embedded error estimate: its largest component, in tolerances.
    fn estimate(&self, step: T, variation: bool) -> T {
        let mut weights = zero::<T, MAX_STAGES>();
        for (weight, &difference) in weights.iter_mut().zip(&self.error_weights) {
            *weight = T::from_f64(difference) * step;
        }
        dispatch(LargestError {
            stage_v: &self.stage_v,
            stage_a: &self.stage_a,
            n: self.start_q.len(),
            weights: &weights[..self.error_weights.len()],
            q: &self.q,
            tolerances: self.tolerances,
            variation,
        })
    }
}

/// Points of the polynomial that predicts a stage.
const PREDICTOR_POINTS: usize = 2;

/// Returns the weights of earlier stages in the prediction of a stage: those of the Lagrange
/// polynomial through the nearest stages that are not too close together, or the previous stage
/// alone.
fn predictor(tableau: &Tableau, solution: StageSolution, stage: usize) -> Vec<f64> {
    const MIN_NODE_DISTANCE: f64 = 0.05;
    if stage > 0 && solution == StageSolution::Converged {
        return (0..stage)
            .map(|i| f64::from(u8::from(i + 1 == stage)))
            .collect();
    }
    let node = |i: usize| tableau.node(i);
    let mut earlier: Vec<usize> = (0..stage).collect();
    earlier.sort_by(|&i, &j| {
        (node(i) - node(stage))
            .abs()
            .total_cmp(&(node(j) - node(stage)).abs())
    });
    let mut chosen: Vec<usize> = Vec::new();
    for candidate in earlier {
        let apart = chosen
            .iter()
            .all(|&other| (node(other) - node(candidate)).abs() >= MIN_NODE_DISTANCE);
        if chosen.len() < PREDICTOR_POINTS && apart {
            chosen.push(candidate);
        }
    }
    let mut weights = vec![0.0; stage];
    for &i in &chosen {
        let others = chosen.iter().filter(|&&j| j != i);
        weights[i] = others
            .map(|&j| (node(stage) - node(j)) / (node(i) - node(j)))
            .product();
    }
    weights
}

fn scatter<T: Lanewise, const D: usize>(lane: usize, values: &[[f64; D]], lanes: &mut [[T; D]]) {
    assert_eq!(
        values.len(),
        lanes.len(),
        "the stepper has the number of coordinates of its systems"
    );
    for (lanes, values) in lanes.iter_mut().zip(values) {
        for i in 0..D {
            lanes[i].set_lane(lane, values[i]);
        }
    }
}

fn gather<T: Lanewise, const D: usize>(lane: usize, lanes: &[[T; D]], values: &mut [[f64; D]]) {
    for (lanes, values) in lanes.iter().zip(values) {
        *values = in_lane(lanes, lane);
    }
}

/// Sets the values in all lanes except `lanes` to zero.
fn keep<T: Lanewise, const D: usize>(values: &mut [[T; D]], lanes: LaneSet) {
    let none = T::ZERO;
    for value in values {
        unrolled!(i < D, {
            value[i] = value[i].select(lanes, none);
        });
    }
}

/// Point of a stage, as [`Predict`] and [`Correct`] write it.
struct StagePoint<'a, T, const D: usize> {
    q: &'a mut [[T; D]],
    v: &'a mut [[T; D]],
    a: &'a mut [[T; D]],
    q_base: &'a mut [[T; D]],
    v_base: &'a mut [[T; D]],
}

/// Start and earlier stages, by stage and then by block.
struct Earlier<'a, T, const D: usize> {
    start_q: &'a [[T; D]],
    v: &'a [[T; D]],
    a: &'a [[T; D]],
}

// In the loops below the stages are innermost: the compiler keeps the order of such sums, and
// vectorises over the lanes.

/// Prediction of a stage: `q̂ = q_0 + Σ Δ A_ij v_j`, `v̂ = v_0 + Σ Δ A_ij a_j`, `a = Σ l_j a_j`;
/// then `v = v̂ + γΔ a`, `q = q̂ + γΔ v`.
struct Predict<'a, T, const D: usize> {
    place: StagePoint<'a, T, D>,
    earlier: Earlier<'a, T, D>,
    weights: &'a [T],
    predictor: &'a [T],
    diagonal: T,
}

impl<T: Lanewise, const D: usize> Loop for Predict<'_, T, D> {
    type Output = ();

    const LANES: usize = T::LANES;

    #[inline(always)]
    fn run(self) {
        let Self {
            place,
            earlier,
            weights,
            predictor,
            diagonal,
        } = self;
        let n = earlier.start_q.len();
        for k in 0..n {
            let (mut q, mut v, mut a) = (earlier.start_q[k], earlier.v[k], zero());
            for (j, (&weight, &prediction)) in weights.iter().zip(predictor).enumerate() {
                let (stage_v, stage_a) = (earlier.v[j * n + k], earlier.a[j * n + k]);
                q = add(q, scale(weight, stage_v));
                v = add(v, scale(weight, stage_a));
                a = add(a, scale(prediction, stage_a));
            }
            (place.q_base[k], place.v_base[k]) = (q, v);
            v = add(v, scale(diagonal, a));
            (place.q[k], place.v[k], place.a[k]) = (add(q, scale(diagonal, v)), v, a);
        }
    }
}

/// Subtraction of `correction` from `a`. Returns the correction's largest component in tolerances,
/// NaN if it is not finite.
struct Correct<'a, T, const D: usize> {
    place: StagePoint<'a, T, D>,
    correction: &'a [[T; D]],
    weights: StepWeights<T>,
    tolerances: LaneTolerances<T>,
    variation: bool,
}

impl<T: Lanewise, const D: usize> Loop for Correct<'_, T, D> {
    type Output = T;

    const LANES: usize = T::LANES;

    #[inline(always)]
    fn run(self) -> T {
        let Self {
            place,
            correction,
            weights,
            tolerances,
            variation,
        } = self;
        let LaneTolerances {
            relative,
            coordinate_scale,
            rate_scale,
            ..
        } = tolerances;
        let (by_coordinate, by_rate) = (
            weights.coordinates / (coordinate_scale * relative),
            weights.rates / relative,
        );
        // The maximum drops a NaN; the sum does not.
        let (mut largest, mut sum) = (T::ZERO, T::ZERO);
        let mut of_variation = VariationSizes::none();
        for k in 0..correction.len() {
            let a = sub(place.a[k], correction[k]);
            let v = add(place.v_base[k], scale(weights.rates, a));
            let q = add(place.q_base[k], scale(weights.rates, v));
            (place.q[k], place.v[k], place.a[k]) = (q, v, a);
            unrolled!(i < D, {
                let size = correction[k][i].abs();
                sum = sum + size;
                if variation && i == 0 {
                    of_variation.add([size, size], [q[0], v[0]]);
                } else {
                    largest = largest
                        .max(by_coordinate * size)
                        .max(by_rate * size / rate_scale.max(v[i].abs()));
                }
            });
        }
        if variation {
            let weights = [weights.coordinates, weights.rates];
            largest = largest.max(of_variation.in_tolerances(tolerances, weights));
        }
        largest + unless_finite(sum)
    }
}

/// Largest component of `Σ w_j v_j` and `Σ w_j a_j`, in tolerances; NaN if one is not finite.
struct LargestError<'a, T, const D: usize> {
    stage_v: &'a [[T; D]],
    stage_a: &'a [[T; D]],
    n: usize,
    weights: &'a [T],
    /// Coordinates at the end of the step.
    q: &'a [[T; D]],
    tolerances: LaneTolerances<T>,
    variation: bool,
}

impl<T: Lanewise, const D: usize> Loop for LargestError<'_, T, D> {
    type Output = T;

    const LANES: usize = T::LANES;

    #[inline(always)]
    fn run(self) -> T {
        let Self {
            stage_v,
            stage_a,
            n,
            weights,
            q,
            tolerances,
            variation,
        } = self;
        let LaneTolerances {
            relative,
            coordinate_scale,
            rate_scale,
            ..
        } = tolerances;
        let last = (weights.len() - 1) * n;
        let none = T::ZERO;
        // The maximum drops a NaN; the sum does not.
        let (mut largest, mut sum) = (none, none);
        let mut of_variation = VariationSizes::none();
        for k in 0..n {
            let (mut coordinate, mut rate) = ([none; D], [none; D]);
            for (j, &weight) in weights.iter().enumerate() {
                coordinate = add(coordinate, scale(weight, stage_v[j * n + k]));
                rate = add(rate, scale(weight, stage_a[j * n + k]));
            }
            unrolled!(i < D, {
                if variation && i == 0 {
                    let errors = [coordinate[0].abs(), rate[0].abs()];
                    of_variation.add(errors, [q[k][0], stage_v[last + k][0]]);
                    sum = sum + (errors[0] + errors[1]);
                } else {
                    let size = rate_scale
                        .max(stage_v[k][i].abs())
                        .max(stage_v[last + k][i].abs());
                    let (by_coordinate, by_rate) =
                        (coordinate[i].abs() / coordinate_scale, rate[i].abs() / size);
                    largest = largest.max(by_coordinate).max(by_rate);
                    sum = sum + (by_coordinate + by_rate);
                }
            });
        }
        largest = largest / relative;
        if variation {
            largest = largest.max(of_variation.in_tolerances(tolerances, [T::from_f64(1.0); 2]));
        }
        largest + unless_finite(sum)
    }
}

/// Largest errors of a linear variation and its largest entries, each as `[coordinate, rate]`.
struct VariationSizes<T> {
    errors: [T; 2],
    values: [T; 2],
}

impl<T: Lanewise> VariationSizes<T> {
    #[inline(always)]
    fn none() -> Self {
        Self {
            errors: zero(),
            values: zero(),
        }
    }

    #[inline(always)]
    fn add(&mut self, errors: [T; 2], values: [T; 2]) {
        unrolled!(i < 2, {
            self.errors[i] = self.errors[i].max(errors[i]);
            self.values[i] = self.values[i].max(values[i].abs());
        });
    }

    /// Returns the larger of the two errors, each times its weight, in tolerances.
    #[inline(always)]
    fn in_tolerances(&self, tolerances: LaneTolerances<T>, weights: [T; 2]) -> T {
        let relative = tolerances.relative.max(T::from_f64(VARIATION_TOLERANCE));
        let [coordinate, rate] = [
            tolerances.coordinate_scale.max(self.values[0]),
            tolerances.rate_scale.max(self.values[1]),
        ];
        let by_coordinate = weights[0] * self.errors[0] / coordinate;
        let controlled = self.values[0].less_than(T::from_f64(LARGEST_CONTROLLED_VARIATION));
        controlled * (by_coordinate.max(weights[1] * self.errors[1] / rate) / relative)
    }
}

/// Returns zero, or NaN where `sum` is not finite.
#[inline(always)]
fn unless_finite<T: Lanewise>(sum: T) -> T {
    sum * T::ZERO
}

#[cfg(test)]
mod tests {
    use super::super::tableau::ESDIRK54;
    use super::*;

    #[test]
    fn predictors_are_exact_for_the_polynomials_of_their_points() {
        for stage in 1..ESDIRK54.stages() {
            let weights = predictor(&ESDIRK54, StageSolution::Predicted, stage);
            let points = weights.iter().filter(|weight| **weight != 0.0).count();
            assert_eq!(points, stage.min(PREDICTOR_POINTS), "stage {stage}");
            for power in 0..points as i32 {
                let values = weights
                    .iter()
                    .enumerate()
                    .map(|(i, weight)| weight * ESDIRK54.node(i).powi(power));
                let expected = ESDIRK54.node(stage).powi(power);
                assert!((values.sum::<f64>() - expected).abs() < 1e-13);
            }
        }
    }
}
