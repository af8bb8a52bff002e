//! Backward differentiation formulas of variable order with quasi-constant steps.

use bristle::equations::StepWeights;
use bristle::integrate::Tolerances;

use crate::newton::{Failure, MAX_ITERATIONS, Newton, NewtonSettings, Pairs, axpy, norm, zeros};
use crate::pass::Method;
use crate::system::{Point, System};

const MAX_ORDER: usize = 5;

/// BDF of orders 1 to 5 in backward differences (Shampine and Reichelt, *The MATLAB ODE Suite*, SIAM J. Sci. Comput. 18,
/// 1997, with κ = 0; as SciPy's `BDF`): a change of the step rescales the differences. The impulse is integrated by the
/// same formula. It starts with order 1, and again after each event.
pub struct Bdf {
    tolerances: Tolerances,
    pub newton: Newton,
    /// Backward differences of `q`, `v` and the impulse at the last point, for steps of `step`; and of those tried.
    differences: Vec<Difference>,
    scaled: Vec<Difference>,
    step: f64,
    order: usize,
    equal_steps: usize,
    tried_step: f64,
    correction: Difference,
    pairs: usize,
    fresh: bool,
    error: f64,
    /// Error estimates of the next lower and the next higher order.
    neighbours: [f64; 2],
}

#[derive(Clone, Debug)]
struct Difference {
    q: Pairs,
    v: Pairs,
    impulse: f64,
}

impl Difference {
    fn none(pairs: usize) -> Self {
        Self { q: zeros(pairs), v: zeros(pairs), impulse: 0.0 }
    }

    fn add(&mut self, factor: f64, other: &Self) {
        axpy(&mut self.q, factor, &other.q);
        axpy(&mut self.v, factor, &other.v);
        self.impulse += factor * other.impulse;
    }

    fn clear(&mut self) {
        self.q.as_flattened_mut().fill(0.0);
        self.v.as_flattened_mut().fill(0.0);
        self.impulse = 0.0;
    }
}

/// `γ_k = Σ_{j ≤ k} 1/j`
fn gamma(order: usize) -> f64 {
    (1..=order).map(|j| 1.0 / j as f64).sum()
}

impl Bdf {
    pub fn new(newton: NewtonSettings, tolerances: Tolerances, pairs: usize) -> Self {
        let none = Difference::none(pairs);
        Self {
            tolerances,
            newton: Newton::new(newton, tolerances, pairs),
            differences: vec![none.clone(); MAX_ORDER + 3],
            scaled: vec![none.clone(); MAX_ORDER + 3],
            step: 0.0,
            order: 1,
            equal_steps: 0,
            tried_step: 0.0,
            correction: none,
            pairs,
            fresh: true,
            error: 1.0,
            neighbours: [f64::INFINITY; 2],
        }
    }

    /// Starts at the last of the points `past`, which are `step` apart, with the order of their number less one.
    pub fn start_with(&mut self, past: &[Point], step: f64) {
        self.order = past.len() - 1;
        let mut values: Vec<Difference> = past
            .iter()
            .map(|point| Difference { q: point.q.clone(), v: point.v.clone(), impulse: point.integrals[0] })
            .collect();
        for k in 0..past.len() {
            self.differences[k] = values[values.len() - 1].clone();
            for i in 1..values.len() {
                let earlier = values[i].clone();
                let difference = &mut values[i - 1];
                let mut rise = earlier;
                rise.add(-1.0, difference);
                *difference = rise;
            }
            values.pop();
        }
        (self.step, self.fresh) = (step, false);
    }

    /// Differences for steps that are `factor` times as long: `D' = (R U)ᵀ D`.
    fn rescale(&mut self, factor: f64) {
        let order = self.order;
        let entry = |factor: f64| {
            let mut matrix = vec![vec![0.0; order + 1]; order + 1];
            matrix[0].fill(1.0);
            for i in 1..=order {
                for j in 1..=order {
                    let (row, column) = (i as f64, j as f64);
                    matrix[i][j] = matrix[i - 1][j] * (row - 1.0 - factor * column) / row;
                }
            }
            matrix
        };
        let (r, u) = (entry(factor), entry(1.0));
        for column in 0..=order {
            self.scaled[column].clear();
            for row in 0..=order {
                let weight: f64 = (0..=order).map(|k| r[row][k] * u[k][column]).sum();
                let (scaled, difference) = (&mut self.scaled[column], &self.differences[row]);
                scaled.add(weight, difference);
            }
        }
        for higher in order + 1..MAX_ORDER + 3 {
            self.scaled[higher] = self.differences[higher].clone();
        }
    }

    fn norm_of(&self, factor: f64, difference: &Difference, start: &Point, end: &Point) -> f64 {
        let mut scaled = Difference::none(self.pairs);
        scaled.add(factor, difference);
        norm(self.tolerances, &scaled.q, &scaled.v, &start.v, &end.v)
    }
}

impl Method for Bdf {
    fn restart(&mut self, start: &Point) {
        self.newton.forget();
        self.fresh = true;
        self.order = 1;
        self.differences[0].q.copy_from_slice(&start.q);
        self.differences[0].v.copy_from_slice(&start.v);
        self.differences[0].impulse = start.integrals[0];
        for difference in &mut self.differences[1..] {
            difference.clear();
        }
    }

    fn attempt(&mut self, system: &mut System, start: &Point, step: f64, end: &mut Point) -> Result<f64, Failure> {
        if self.fresh {
            self.differences[1].q.copy_from_slice(&start.v);
            self.differences[1].v.copy_from_slice(&start.accelerations);
            self.differences[1].impulse = start.rates[0];
            self.differences[1].q.as_flattened_mut().iter_mut().for_each(|x| *x *= step);
            self.differences[1].v.as_flattened_mut().iter_mut().for_each(|x| *x *= step);
            self.differences[1].impulse *= step;
            self.step = step;
        }
        self.tried_step = step;
        let factor = step / self.step;
        if (factor - 1.0).abs() > 1e-12 {
            self.rescale(factor);
        } else {
            self.scaled.clone_from(&self.differences);
        }
        let order = self.order;
        let leading = gamma(order);
        let (mut predicted, mut known) = (Difference::none(self.pairs), Difference::none(self.pairs));
        for (k, difference) in self.scaled[..=order].iter().enumerate() {
            predicted.add(1.0, difference);
            if k > 0 {
                known.add(gamma(k) / leading, difference);
            }
        }
        // y = y_p − ψ + w y', w = h/γ_k
        let w = step / leading;
        let weights = StepWeights { coordinates: w * w, rates: w };
        end.accelerations.as_flattened_mut().fill(0.0);
        axpy(&mut end.accelerations, 1.0 / w, &known.v);
        let mut base = predicted.clone();
        base.add(-1.0, &known);
        let v_base = base.v.clone();
        axpy(&mut base.q, w, &v_base);
        self.newton.begin(weights.rates);
        end.time = start.time + step;
        let bases = (&base.q[..], &base.v[..]);
        self.newton.solve(system, end.time, &mut end.q, &mut end.v, &mut end.accelerations, bases, weights)?;
        end.rates = system.rates(end.time, &end.q, &end.v, &end.accelerations);
        end.integrals[0] = base.impulse + w * end.rates[0];
        self.correction.clear();
        axpy(&mut self.correction.q, 1.0, &end.q);
        axpy(&mut self.correction.v, 1.0, &end.v);
        self.correction.impulse = end.integrals[0];
        self.correction.add(-1.0, &predicted);
        Ok(self.norm_of(1.0 / (order as f64 + 1.0), &self.correction, start, end))
    }

    fn accept(&mut self, start: &Point, end: &Point, step: f64, error: f64, landed: bool) -> f64 {
        let changed = (self.tried_step / self.step - 1.0).abs() > 1e-12;
        if changed {
            self.equal_steps = 0;
        }
        self.differences.clone_from(&self.scaled);
        self.step = self.tried_step;
        self.fresh = false;
        self.equal_steps += 1;
        let order = self.order;
        let mut highest = self.correction.clone();
        highest.add(-1.0, &self.differences[order + 1]);
        self.differences[order + 2] = highest;
        self.differences[order + 1] = self.correction.clone();
        for k in (0..=order).rev() {
            let above = self.differences[k + 1].clone();
            self.differences[k].add(1.0, &above);
        }
        self.error = error;
        let lower = if order > 1 {
            self.norm_of(1.0 / order as f64, &self.differences[order], start, end)
        } else {
            f64::INFINITY
        };
        let higher = if order < MAX_ORDER {
            self.norm_of(1.0 / (order as f64 + 2.0), &self.differences[order + 2], start, end)
        } else {
            f64::INFINITY
        };
        self.neighbours = [lower, higher];
        if landed { step } else { step * self.next_factor() }
    }

    fn reject(&mut self, step: f64, error: f64) -> f64 {
        self.equal_steps = 0;
        step * (0.9 * error.powf(-1.0 / (self.order as f64 + 1.0))).max(0.2)
    }

    fn distribution(&self) -> [usize; MAX_ITERATIONS] {
        self.newton.distribution
    }
}

impl Bdf {
    fn next_factor(&mut self) -> f64 {
        // The differences give the errors of other orders only after order + 1 steps of the same length.
        if self.equal_steps < self.order + 1 {
            return 1.0;
        }
        let by = |error: f64, order: usize| error.max(1e-10).powf(-1.0 / (order as f64 + 1.0));
        let order = self.order;
        let [lower, higher] = self.neighbours;
        let choices =
            [(order - 1, by(lower, order - 1)), (order, by(self.error, order)), (order + 1, by(higher, order + 1))];
        let (best, factor) = choices.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).expect("three");
        self.order = best.clamp(1, MAX_ORDER);
        self.equal_steps = 0;
        (0.9 * factor).min(10.0)
    }
}
