//! Rosenbrock and W-methods in the form for differential-algebraic equations of index 1.
//!
//! With `y = (q, v, a)`: `q' = v`, `v' = a`, `0 = R(q, v, a, t)`. A stage in the transformed unknowns `u` (Hairer and
//! Wanner, *Solving Ordinary Differential Equations II*, sections IV.7 and VI.4),
//! `(1/(hγ) M − J) u_i = f(t + α_i h, y + Σ a_ij u_j) + M Σ (c_ij/h) u_j + γ_i h f_t`, comes down to one solve with the
//! step matrix `K = R_a + hγ R_v + (hγ)² R_q`, because `u_v = hγ (u_a + r_v)` and `u_q = hγ (u_v + r_q)`:
//! `K u_a = −R(stage) − R_q δq − R_v δv − γ_i h R_t` with `δv = hγ r_v`, `δq = hγ (δv + r_q)`. The derivative along
//! `(δq, δv, γ_i h)` is a difference of two residuals, one of them at the start.

use bristle::equations::{LaneSet, StepWeights};
use bristle::integrate::Tolerances;

use crate::newton::{Failure, Pairs, axpy, norm, zeros};
use crate::pass::Method;
use crate::system::{Point, System};

/// Coefficients in transformed form.
#[derive(Clone, Debug)]
pub struct Rosenbrock {
    pub name: &'static str,
    pub order: f64,
    pub gamma: f64,
    /// Nodes `α_i` and sums `γ_i`.
    pub alpha: Vec<f64>,
    pub gammas: Vec<f64>,
    pub a: Vec<Vec<f64>>,
    pub c: Vec<Vec<f64>>,
    pub weights: Vec<f64>,
    /// Weights of the step minus those of the embedded method.
    pub error: Vec<f64>,
}

/// RODAS3, order 3 (Sandu, Verwer, Blom, Spee, Carmichael and Potra, Atmospheric Environment 31, 1997).
pub fn rodas3() -> Rosenbrock {
    Rosenbrock {
        name: "RODAS3",
        order: 3.0,
        gamma: 0.5,
        alpha: vec![0.0, 0.0, 1.0, 1.0],
        gammas: vec![0.5, 1.5, 0.0, 0.0],
        a: vec![vec![], vec![0.0], vec![2.0, 0.0], vec![2.0, 0.0, 1.0]],
        c: vec![vec![], vec![4.0], vec![1.0, -1.0], vec![1.0, -1.0, -8.0 / 3.0]],
        weights: vec![2.0, 0.0, 1.0, 1.0],
        error: vec![0.0, 0.0, 0.0, 1.0],
    }
}

/// RODAS and RODASP have six stages; the last two start from `y + Σ a_5j u_j` and add one `u` each.
fn rodas(name: &'static str, alpha: [f64; 3], gammas: [f64; 3], a: [&[f64]; 4], c: [&[f64]; 5]) -> Rosenbrock {
    let fifth = a[3].to_vec();
    let sixth = [&fifth[..], &[1.0]].concat();
    let weights = [&sixth[..], &[1.0]].concat();
    let rows = a[..3].iter().map(|row| row.to_vec());
    Rosenbrock {
        name,
        order: 4.0,
        gamma: 0.25,
        alpha: vec![0.0, alpha[0], alpha[1], alpha[2], 1.0, 1.0],
        gammas: vec![0.25, gammas[0], gammas[1], gammas[2], 0.0, 0.0],
        a: std::iter::once(vec![]).chain(rows).chain([fifth, sixth]).collect(),
        c: std::iter::once(vec![]).chain(c.iter().map(|row| row.to_vec())).collect(),
        weights,
        error: vec![0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
    }
}

/// RODAS, order 4 (Hairer and Wanner II, section VI.4).
pub fn rodas4() -> Rosenbrock {
    rodas(
        "RODAS4",
        [0.386, 0.21, 0.63],
        [-0.1043, 0.1035, -0.0362],
        [
            &[1.544],
            &[0.9466785280815826, 0.2557011698983284],
            &[3.314825187068521, 2.896124015972201, 0.9986419139977817],
            &[1.221224509226641, 6.019134481288629, 12.53708332932087, -0.687886036105895],
        ],
        [
            &[-5.6688],
            &[-2.430093356833875, -0.2063599157091915],
            &[-0.1073529058151375, -9.594562251023355, -20.47028614809616],
            &[7.496443313967647, -10.24680431464352, -33.99990352819905, 11.7089089320616],
            &[8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054],
        ],
    )
}

/// RODASP, order 4, without order reduction for some stiff problems (Steinebach, Technische Hochschule Darmstadt, preprint
/// 1741, 1995).
pub fn rodas4p() -> Rosenbrock {
    rodas(
        "RODASP",
        [0.75, 0.21, 0.63],
        [-0.5, -0.023504, -0.0362],
        [
            &[3.0],
            &[1.831036793486759, 0.4955183967433795],
            &[2.304376582692669, -0.05249275245743001, -1.176798761832782],
            &[-7.170454962423024, -4.741636671481785, -16.31002631330971, -1.062004044111401],
        ],
        [
            &[-12.0],
            &[-8.791795173947035, -2.207865586973518],
            &[10.81793056857153, 6.780270611428266, 19.5348594464241],
            &[34.19095006749676, 15.49671153725963, 54.7476087596413, 14.16005392148534],
            &[34.62605830930532, 15.30084976114473, 56.99955578662667, 18.40807009793095, -5.714285714285717],
        ],
    )
}

/// ROS34PW2, a W-method of order 3 (Rang and Angermann, BIT 45, 2005).
pub fn ros34pw2() -> Rosenbrock {
    let gamma = 0.435866521508459;
    let alpha = [vec![], vec![0.871733043016918], vec![0.8445706001536942, -0.11299064236484185], vec![0.0, 0.0, 1.0]];
    let lower = [
        vec![gamma],
        vec![-0.871733043016918, gamma],
        vec![-0.9033805701304408, 0.054180672388095326, gamma],
        vec![0.24212380706095346, -1.2232505839045147, 0.5452602553351021, gamma],
    ];
    let step = [0.24212380706095346, -1.2232505839045147, 1.545260255335102, gamma];
    let embedded = [0.3781090314581937, -0.09604229221242318, 0.5, 0.2179332607542295];
    // u = Γ k: rows multiplied by Γ⁻¹, by substitution from the right.
    let transformed = |row: &[f64]| -> Vec<f64> {
        let mut result = vec![0.0; row.len()];
        for j in (0..row.len()).rev() {
            let later: f64 = (j + 1..row.len()).map(|k| result[k] * lower[k][j]).sum();
            result[j] = (row[j] - later) / gamma;
        }
        result
    };
    let inverse = |i: usize| {
        let mut unit = vec![0.0; i + 1];
        unit[i] = 1.0;
        transformed(&unit)
    };
    Rosenbrock {
        name: "ROS34PW2",
        order: 3.0,
        gamma,
        alpha: alpha.iter().map(|row| row.iter().sum()).collect(),
        gammas: lower.iter().map(|row| row.iter().sum()).collect(),
        a: alpha.iter().map(|row| transformed(row)).collect(),
        c: (0..4).map(|i| inverse(i)[..i].iter().map(|x| -x).collect()).collect(),
        weights: transformed(&step),
        error: transformed(&[0, 1, 2, 3].map(|i| step[i] - embedded[i])),
    }
}

#[derive(Clone, Debug)]
struct Stage {
    q: Pairs,
    v: Pairs,
    a: Pairs,
    impulse: f64,
}

impl Stage {
    fn none(pairs: usize) -> Self {
        Self { q: zeros(pairs), v: zeros(pairs), a: zeros(pairs), impulse: 0.0 }
    }

    fn clear(&mut self) {
        for values in [&mut self.q, &mut self.v, &mut self.a] {
            values.as_flattened_mut().fill(0.0);
        }
        self.impulse = 0.0;
    }

    fn add(&mut self, factor: f64, other: &Self) {
        if factor == 0.0 {
            return;
        }
        axpy(&mut self.q, factor, &other.q);
        axpy(&mut self.v, factor, &other.v);
        axpy(&mut self.a, factor, &other.a);
        self.impulse += factor * other.impulse;
    }
}

/// Small enough for the second derivative to be negligible, large enough for the rounding of a residual.
const DIFFERENCE: f64 = 1e-5;

pub struct RosenbrockMethod {
    method: Rosenbrock,
    tolerances: Tolerances,
    stages: Vec<Stage>,
    previous_error: f64,
}

impl RosenbrockMethod {
    pub fn new(method: Rosenbrock, tolerances: Tolerances, pairs: usize) -> Self {
        let stages = vec![Stage::none(pairs); method.alpha.len()];
        Self { method, tolerances, stages, previous_error: 1.0 }
    }
}

impl Method for RosenbrockMethod {
    fn restart(&mut self, _: &Point) {}

    fn attempt(&mut self, system: &mut System, start: &Point, step: f64, end: &mut Point) -> Result<f64, Failure> {
        let method = &self.method;
        let pairs = start.q.len();
        let diagonal = method.gamma * step;
        let weights = StepWeights { coordinates: diagonal * diagonal, rates: diagonal };
        let mut here = zeros(pairs);
        system.residual(start.time, &start.q, &start.v, &start.accelerations, &mut here);
        system.factorise(start.time, &start.q, &start.v, &start.accelerations, weights, LaneSet::first(1));
        // Not taken from the record of the start, which precedes an event.
        let start_rate = system.rates(start.time, &start.q, &start.v, &start.accelerations)[0];
        let (mut moved, mut point, mut carried) = (zeros(pairs), Stage::none(pairs), Stage::none(pairs));
        let (mut delta_q, mut delta_v) = (zeros(pairs), zeros(pairs));
        for i in 0..method.alpha.len() {
            let (earlier, rest) = self.stages.split_at_mut(i);
            let stage = &mut rest[0];
            point.clear();
            carried.clear();
            for (j, earlier) in earlier.iter().enumerate() {
                point.add(method.a[i][j], earlier);
                carried.add(method.c[i][j] / step, earlier);
            }
            let at_start = method.alpha[i] == 0.0 && method.a[i].iter().all(|&a| a == 0.0);
            axpy(&mut point.q, 1.0, &start.q);
            axpy(&mut point.v, 1.0, &start.v);
            axpy(&mut point.a, 1.0, &start.accelerations);
            let time = start.time + method.alpha[i] * step;
            let mut rate = start_rate;
            if at_start {
                stage.a.copy_from_slice(&here);
            } else {
                system.residual(time, &point.q, &point.v, &point.a, &mut stage.a);
                rate = system.rates(time, &point.q, &point.v, &point.a)[0];
            }
            // r_v and r_q, then the direction (δq, δv).
            axpy(&mut carried.v, 1.0, &point.a);
            axpy(&mut carried.q, 1.0, &point.v);
            delta_v.as_flattened_mut().fill(0.0);
            axpy(&mut delta_v, diagonal, &carried.v);
            delta_q.as_flattened_mut().fill(0.0);
            axpy(&mut delta_q, diagonal, &delta_v);
            axpy(&mut delta_q, diagonal, &carried.q);
            let mut aside = start.q.clone();
            axpy(&mut aside, DIFFERENCE, &delta_q);
            let mut aside_v = start.v.clone();
            axpy(&mut aside_v, DIFFERENCE, &delta_v);
            let late = start.time + DIFFERENCE * method.gammas[i] * step;
            system.residual(late, &aside, &aside_v, &start.accelerations, &mut moved);
            axpy(&mut moved, -1.0, &here);
            axpy(&mut stage.a, 1.0 / DIFFERENCE, &moved);
            stage.a.as_flattened_mut().iter_mut().for_each(|x| *x = -*x);
            // (The library's solve uses the kinematics of the last residual, which are nearly those of the start.)
            system.solve(&mut stage.a);
            stage.v.copy_from_slice(&delta_v);
            axpy(&mut stage.v, diagonal, &stage.a);
            stage.q.as_flattened_mut().fill(0.0);
            axpy(&mut stage.q, diagonal, &stage.v);
            axpy(&mut stage.q, diagonal, &carried.q);
            // The impulse: p' = g(q, v, t), with the derivative of g along (u_q, u_v, γ_i hγ_i …).
            let (mut q, mut v) = (start.q.clone(), start.v.clone());
            axpy(&mut q, DIFFERENCE, &stage.q);
            axpy(&mut v, DIFFERENCE, &stage.v);
            let along = (system.rates(late, &q, &v, &start.accelerations)[0] - start_rate) / DIFFERENCE;
            stage.impulse = diagonal * (rate + along + carried.impulse);
        }
        let mut change = Stage::none(pairs);
        let mut error = Stage::none(pairs);
        for (i, stage) in self.stages.iter().enumerate() {
            change.add(self.method.weights[i], stage);
            error.add(self.method.error[i], stage);
        }
        for (target, (from, by)) in [
            (&mut end.q, (&start.q, &change.q)),
            (&mut end.v, (&start.v, &change.v)),
            (&mut end.accelerations, (&start.accelerations, &change.a)),
        ] {
            target.copy_from_slice(from);
            axpy(target, 1.0, by);
        }
        end.time = start.time + step;
        end.integrals[0] = start.integrals[0] + change.impulse;
        end.rates = system.rates(end.time, &end.q, &end.v, &end.accelerations);
        let finite = |values: &[[f64; 2]]| values.as_flattened().iter().all(|x| x.is_finite());
        if !(finite(&end.q) && finite(&end.v) && finite(&end.accelerations)) {
            return Err(Failure);
        }
        Ok(norm(self.tolerances, &error.q, &error.v, &start.v, &end.v))
    }

    fn accept(&mut self, _: &Point, _: &Point, step: f64, error: f64, _: bool) -> f64 {
        let factor = crate::pass::pi_factor(error, self.previous_error, self.method.order);
        self.previous_error = error.max(1e-4);
        step * factor
    }

    fn reject(&mut self, step: f64, error: f64) -> f64 {
        step * crate::pass::pi_factor(error, self.previous_error, self.method.order).min(1.0)
    }
}
