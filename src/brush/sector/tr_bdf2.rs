//! Steps of TR-BDF2: their stages, integrals along them, and interpolation.

use super::super::bundle::{BrushState, Bundle, Effort, Kinematics, NoConvergence};
use super::super::gmres::Vector;
use super::super::team;
use crate::equations::{Lanes, Real};
use crate::integrate::hermite::{Knot, Weights};
use crate::integrate::tableau::TR_BDF2;
use crate::tool::ClampMotion;

/// Steps of TR-BDF2.
pub struct TrBdf2Stepper {
    tolerance: f64,
    pub(super) middle: BrushState,
    pub(super) end: BrushState,
    base: [Vector; 2],
}

impl TrBdf2Stepper {
    /// Allocates memory for steps from `motion`. Stages are solved once velocities change by less
    /// than `tolerance` (m/s).
    pub fn new(motion: &BrushState, tolerance: f64) -> Self {
        let base = [motion.q.clone(), motion.v.clone()];
        Self {
            tolerance,
            middle: motion.clone(),
            end: motion.clone(),
            base,
        }
    }

    /// Solves the middle stage of a step of `h` (s) from `start`.
    pub fn middle_stage<M: ClampMotion + Sync>(
        &mut self,
        bundle: &mut Bundle<M>,
        start: &BrushState,
        h: f64,
    ) -> Result<Effort, NoConvergence> {
        let (own, blocks, first) = (
            TR_BDF2.gamma * h,
            bundle.segments(),
            bundle.first_coordinate(),
        );
        let Self {
            tolerance,
            middle,
            base: [base_q, base_v],
            ..
        } = self;
        set_sum(
            [blocks, first],
            base_v,
            &start.v,
            &[(own, &start.accelerations)],
        );
        set_sum(
            [blocks, first],
            base_q,
            &start.q,
            &[(own, &start.v), (own, base_v)],
        );
        set_sum(
            [blocks, 0],
            &mut middle.accelerations,
            &start.accelerations,
            &[],
        );
        middle.time = start.time + TR_BDF2.node(1) * h;
        bundle.solve_stage(
            middle,
            Kinematics {
                base: [base_q, base_v],
                weights: [own * own, own],
                first,
            },
            *tolerance,
        )
    }

    /// Solves the stage at the end of the step.
    pub fn end_stage<M: ClampMotion + Sync>(
        &mut self,
        bundle: &mut Bundle<M>,
        start: &BrushState,
        h: f64,
    ) -> Result<Effort, NoConvergence> {
        let (own, others) = (TR_BDF2.gamma * h, TR_BDF2.weight(0) * h);
        let (blocks, first) = (bundle.segments(), bundle.first_coordinate());
        let Self {
            tolerance,
            middle,
            end,
            base: [base_q, base_v],
        } = self;
        let by_accelerations = [
            (others, &start.accelerations),
            (others, &middle.accelerations),
        ];
        set_sum([blocks, first], base_v, &start.v, &by_accelerations);
        let by_velocities = [(others, &start.v), (others, &middle.v), (own, &*base_v)];
        set_sum([blocks, first], base_q, &start.q, &by_velocities);
        set_sum(
            [blocks, 0],
            &mut end.accelerations,
            &middle.accelerations,
            &[],
        );
        end.time = start.time + h;
        bundle.solve_stage(
            end,
            Kinematics {
                base: [base_q, base_v],
                weights: [own * own, own],
                first,
            },
            *tolerance,
        )
    }

    /// Moves the end of the step into `motion`, and keeps its start.
    pub fn finish(&mut self, motion: &mut BrushState) {
        std::mem::swap(motion, &mut self.end);
    }

    /// Returns coordinates and rates at `time` (s) in the last step, which has ended at `motion`,
    /// by Hermite interpolation.
    pub(super) fn interpolated(&self, motion: &BrushState, time: f64) -> BrushState {
        let (start, h) = (&self.end, motion.time - self.end.time);
        let weights = Weights::new(h, (time - start.time) / h);
        let knot = |state: &BrushState, at: usize, i: usize| Knot {
            value: state.q[at][i].0,
            rate: state.v[at][i].0,
            acceleration: state.accelerations[at][i].0,
        };
        let mut state = motion.clone();
        state.time = time;
        for (at, (q, v)) in state.q.iter_mut().zip(&mut state.v).enumerate() {
            for (i, (q, v)) in q.iter_mut().zip(v).enumerate() {
                let (value, rate) = weights.interpolate(&knot(start, at, i), &knot(motion, at, i));
                (*q, *v) = (Lanes(value), Lanes(rate));
            }
        }
        state
    }
}

/// Computes `start + Σ factor · vector`, in groups of `blocks` blocks, from the coordinate `from`
/// of each block on.
fn set_sum(
    [blocks, from]: [usize; 2],
    result: &mut Vector,
    start: &Vector,
    terms: &[(f64, &Vector)],
) {
    let groups = result
        .chunks_mut(blocks)
        .zip(start.chunks(blocks))
        .enumerate();
    team::for_each(
        groups.map(|(group, parts)| (group * blocks, parts)),
        |(first, (result, start))| {
            for (k, (block, start)) in result.iter_mut().zip(start).enumerate() {
                for i in from..2 {
                    let mut value = start[i];
                    for (factor, vector) in terms {
                        value = value + Lanes::from_f64(*factor) * vector[first + k][i];
                    }
                    block[i] = value;
                }
            }
        },
    );
}

/// Part of a step, over which values at its three stages are integrated.
pub(super) struct StepPart {
    /// Beginning and end, as shares of the step.
    pub(super) shares: [f64; 2],
    pub(super) weights: [f64; 3],
}

impl StepPart {
    /// Returns the whole step, with the weights `b_j` of the method.
    pub(super) fn whole() -> Self {
        Self {
            shares: [0.0, 1.0],
            weights: std::array::from_fn(|j| TR_BDF2.weight(j)),
        }
    }

    /// Returns the parts before and after a `share` of the step. Their weights add up to `b_j`.
    pub(super) fn split(share: f64) -> [Self; 2] {
        let until = weights_until(share);
        [
            Self {
                shares: [0.0, share],
                weights: until,
            },
            Self {
                shares: [share, 1.0],
                weights: std::array::from_fn(|j| TR_BDF2.weight(j) - until[j]),
            },
        ]
    }

    /// Returns the integral of `values` over the part, relative to the length of the step.
    pub(super) fn integral(&self, values: [f64; 3]) -> f64 {
        (0..3).map(|j| self.weights[j] * values[j]).sum()
    }
}

/// Returns the weights `b_j(θ)` of integrals from the start of a step to the share `θ` of it: those
/// of the parabola through the three stages, less `θ (b̂_j − b_j)`. They are exact for linear
/// values, as the method is, and end at `b_j`.
fn weights_until(share: f64) -> [f64; 3] {
    let (c, square, cube) = (TR_BDF2.node(1), share.powi(2) / 2.0, share.powi(3) / 3.0);
    let parabola = [
        share + (cube - (1.0 + c) * square) / c,
        (square - cube) / (c * (1.0 - c)),
        (cube - c * square) / (1.0 - c),
    ];
    std::array::from_fn(|j| parabola[j] - share * TR_BDF2.error_weight(j))
}

/// Returns `Σ (b̂_j − b_j) x_j`, the embedded error estimate of an integral over the step.
pub(super) fn integral_error(values: [f64; 3]) -> f64 {
    (0..3).map(|j| TR_BDF2.error_weight(j) * values[j]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_a_step_integrate_linear_values_exactly() {
        let nodes = [0.0, TR_BDF2.node(1), 1.0];
        for share in [0.1, 0.5, 0.9] {
            let parts = StepPart::split(share);
            let lengths = parts.each_ref().map(|part| part.integral([1.0; 3]));
            let moments = parts.each_ref().map(|part| part.integral(nodes));
            let expected = [[share, 1.0 - share], [share.powi(2), 1.0 - share.powi(2)]];
            for part in 0..2 {
                assert!((lengths[part] - expected[0][part]).abs() < 1e-15);
                assert!((moments[part] - expected[1][part] / 2.0).abs() < 1e-15);
            }
        }
        let [whole, _] = StepPart::split(1.0);
        for j in 0..3 {
            assert!((whole.weights[j] - TR_BDF2.weight(j)).abs() < 1e-15);
        }
    }
}
