//! One attempt at a step, of one system or of several side by side in the lanes of `T`.

use super::newton::{
    LOOSEST_NEWTON_TOLERANCE, MAX_NEWTON_ITERATIONS, NEWTON_TOLERANCE, Newton, NewtonVerdict,
    StageSolution,
};
use super::stage_loops::{Correct, Earlier, LaneTolerances, LargestError, Predict, StagePoint};
use super::tableau::Tableau;
use super::{Point, SecondOrderSystem, State, Tolerances};
use crate::equations::dispatch::dispatch;
use crate::equations::linear::{in_lane, unrolled, zero};
use crate::equations::{LaneSet, Lanewise, StepWeights};

/// Stages of the longest method.
const MAX_STAGES: usize = 8;

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
