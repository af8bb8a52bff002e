//! Loops over the blocks of a step: prediction, correction and error estimate of its stages.
//!
//! The stages are innermost: the compiler keeps the order of such sums, and vectorises over the
//! lanes.

use super::{LARGEST_CONTROLLED_VARIATION, VARIATION_TOLERANCE};
use crate::equations::dispatch::Loop;
use crate::equations::linear::{add, scale, sub, unrolled, zero};
use crate::equations::{Lanewise, StepWeights};

/// Tolerances of the steps in each lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneTolerances<T> {
    pub(super) relative: T,
    pub(super) coordinate_scale: T,
    pub(super) rate_scale: T,
    pub(super) integral_scales: [T; 2],
}

/// Point of a stage, as [`Predict`] and [`Correct`] write it.
pub(super) struct StagePoint<'a, T, const D: usize> {
    pub(super) q: &'a mut [[T; D]],
    pub(super) v: &'a mut [[T; D]],
    pub(super) a: &'a mut [[T; D]],
    pub(super) q_base: &'a mut [[T; D]],
    pub(super) v_base: &'a mut [[T; D]],
}

/// Start and earlier stages, by stage and then by block.
pub(super) struct Earlier<'a, T, const D: usize> {
    pub(super) start_q: &'a [[T; D]],
    pub(super) v: &'a [[T; D]],
    pub(super) a: &'a [[T; D]],
}

/// Prediction of a stage: `q̂ = q_0 + Σ Δ A_ij v_j`, `v̂ = v_0 + Σ Δ A_ij a_j`, `a = Σ l_j a_j`;
/// then `v = v̂ + γΔ a`, `q = q̂ + γΔ v`.
pub(super) struct Predict<'a, T, const D: usize> {
    pub(super) place: StagePoint<'a, T, D>,
    pub(super) earlier: Earlier<'a, T, D>,
    pub(super) weights: &'a [T],
    pub(super) predictor: &'a [T],
    pub(super) diagonal: T,
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
pub(super) struct Correct<'a, T, const D: usize> {
    pub(super) place: StagePoint<'a, T, D>,
    pub(super) correction: &'a [[T; D]],
    pub(super) weights: StepWeights<T>,
    pub(super) tolerances: LaneTolerances<T>,
    pub(super) variation: bool,
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
        let (by_coordinate, by_rate) = (
            weights.coordinates / (tolerances.coordinate_scale * tolerances.relative),
            weights.rates / tolerances.relative,
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
                        .max(by_rate * size / tolerances.rate_scale.max(v[i].abs()));
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
pub(super) struct LargestError<'a, T, const D: usize> {
    pub(super) stage_v: &'a [[T; D]],
    pub(super) stage_a: &'a [[T; D]],
    pub(super) n: usize,
    pub(super) weights: &'a [T],
    /// Coordinates at the end of the step.
    pub(super) q: &'a [[T; D]],
    pub(super) tolerances: LaneTolerances<T>,
    pub(super) variation: bool,
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
