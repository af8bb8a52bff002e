//! Checks that each method converges with its order, by fixed steps on a small smooth problem.

use std::convert::Infallible;

use bristle::equations::{LaneSet, StepWeights};
use bristle::integrate::tableau::{ESDIRK43, ESDIRK54};
use bristle::integrate::{SecondOrderSystem, State, Tolerances};

use crate::bdf::Bdf;
use crate::esdirk::{Esdirk, EsdirkSettings, Predictor};
use crate::generalized_alpha::GeneralizedAlpha;
use crate::newton::NewtonSettings;
use crate::pass::Method;
use crate::rosenbrock::{RosenbrockMethod, rodas3, rodas4, rodas4p, ros34pw2};
use crate::system::Point;
use crate::tableaux::{ESDIRK32, TR_BDF2};

/// Two coupled, forced coordinates with a mass matrix that depends on them.
#[derive(Default)]
struct Smooth {
    q: [f64; 2],
    matrix: [[f64; 2]; 2],
}

fn residual(time: f64, q: [f64; 2], v: [f64; 2], a: [f64; 2]) -> [f64; 2] {
    let [[m, c], [_, n]] = mass(q);
    let forces =
        [0.2 * v[0] + q[0].sin() + 0.3 * v[1] * v[1] - (1.3 * time).cos(), 0.1 * v[1] + q[1] + q[0] * v[0] * v[0]];
    [m * a[0] + c * a[1] + forces[0], c * a[0] + n * a[1] + forces[1]]
}

fn mass(q: [f64; 2]) -> [[f64; 2]; 2] {
    [[2.0 + q[1].cos(), 0.3], [0.3, 1.5 + q[0].sin().powi(2)]]
}

fn solve_two([[a, b], [c, d]]: [[f64; 2]; 2], [x, y]: [f64; 2]) -> [f64; 2] {
    let determinant = a * d - b * c;
    [(d * x - b * y) / determinant, (a * y - c * x) / determinant]
}

impl SecondOrderSystem<f64, 2, 1> for Smooth {
    type Charts = ();
    type Refusal = Infallible;

    fn blocks(&self) -> usize {
        1
    }

    fn accelerations(&mut self, time: f64, q: &[[f64; 2]], v: &[[f64; 2]], accelerations: &mut [[f64; 2]]) {
        accelerations[0] = solve_two(mass(q[0]), residual(time, q[0], v[0], [0.0; 2]).map(|x| -x));
    }

    fn residual(&mut self, time: f64, q: &[[f64; 2]], v: &[[f64; 2]], a: &[[f64; 2]], result: &mut [[f64; 2]]) {
        self.q = q[0];
        result[0] = residual(time, q[0], v[0], a[0]);
    }

    fn factorise(
        &mut self,
        time: f64,
        q: &[[f64; 2]],
        v: &[[f64; 2]],
        a: &[[f64; 2]],
        weights: StepWeights<f64>,
        _: LaneSet,
    ) {
        for j in 0..2 {
            let at = |distance: f64| {
                let (mut q, mut v, mut a) = (q[0], v[0], a[0]);
                q[j] += distance * weights.coordinates;
                v[j] += distance * weights.rates;
                a[j] += distance;
                residual(time, q, v, a)
            };
            let (high, low) = (at(1e-5), at(-1e-5));
            for i in 0..2 {
                self.matrix[i][j] = (high[i] - low[i]) / 2e-5;
            }
        }
    }

    fn solve(&mut self, right_side: &mut [[f64; 2]]) {
        right_side[0] = solve_two(self.matrix, right_side[0]);
    }

    fn rates(&mut self, time: f64, q: &[[f64; 2]], _: &[[f64; 2]], _: &[[f64; 2]]) -> [f64; 1] {
        [q[0][0] * q[0][0] + time.sin()]
    }
}

const END: f64 = 2.0;
const TOLERANCES: Tolerances = Tolerances { relative: 1e-12, coordinate_scale: 1.0, rate_scale: 1.0 };

fn start() -> Point {
    State::new(&mut Smooth::default(), 0.0, vec![[0.4, -0.3]], vec![[0.5, 0.2]])
}

fn advance(method: &mut dyn Method, point: &mut Point, steps: usize, step: f64) {
    let (mut system, mut end) = (Smooth::default(), point.clone());
    for _ in 0..steps {
        method.attempt(&mut system, point, step, &mut end).unwrap_or_else(|_| panic!("a smooth step fails"));
        // Treated as landed, so that the order does not change.
        method.accept(point, &end, step, 1.0, true);
        std::mem::swap(point, &mut end);
    }
}

fn exact(end: f64) -> Point {
    let mut point = start();
    let mut method = Esdirk::new(EsdirkSettings::new(&ESDIRK54), TOLERANCES, 1);
    advance(&mut method, &mut point, 400, end / 400.0);
    point
}

/// Checks the observed order between `steps` and twice as many steps: the lowest of those of `q`, `v` and the integral.
fn check(name: &str, order: f64, steps: usize, solve: impl Fn(usize) -> Point) {
    let expected = exact(END);
    let errors = [steps, 2 * steps].map(|steps| {
        let point = solve(steps);
        [
            (point.q[0][0] - expected.q[0][0]).abs(),
            (point.v[0][1] - expected.v[0][1]).abs(),
            (point.integrals[0] - expected.integrals[0]).abs(),
        ]
    });
    let orders: [f64; 3] = std::array::from_fn(|i| (errors[0][i] / errors[1][i]).log2());
    let lowest = orders.into_iter().fold(f64::INFINITY, f64::min);
    println!("{name:40} order {order}, observed {:.2} {:.2} {:.2}", orders[0], orders[1], orders[2]);
    assert!(lowest > order - 0.35, "{name}: {orders:?}");
}

fn check_one_step(name: &str, order: f64, make: impl Fn() -> Box<dyn Method>) {
    // With 80 steps, the method of order 5 reaches rounding errors.
    check(name, order, if order > 4.0 { 20 } else { 40 }, |steps| {
        let (mut method, mut point) = (make(), start());
        method.restart(&point);
        advance(method.as_mut(), &mut point, steps, END / steps as f64);
        point
    });
}

/// Checks all methods.
///
/// # Panics
/// If a method does not have its order.
pub fn check_all() {
    let once = NewtonSettings { reject: f64::INFINITY, ..NewtonSettings::once() };
    for tableau in [&TR_BDF2, &ESDIRK32, &ESDIRK43, &ESDIRK54] {
        let settings = EsdirkSettings::new(tableau);
        let order = f64::from(tableau.order);
        check_one_step(tableau.name, order, || Box::new(Esdirk::new(settings, TOLERANCES, 1)));
        // One iteration with the matrix of the start of the step leaves an error of O(h³).
        let settings = EsdirkSettings { newton: once, predictor: Predictor::Stages(3), ..settings };
        let name = format!("{}, one iteration", tableau.name);
        check_one_step(&name, order.min(3.0), || Box::new(Esdirk::new(settings, TOLERANCES, 1)));
    }
    for method in [rodas3, rodas4, rodas4p, ros34pw2] {
        let (name, order) = (method().name, method().order);
        check_one_step(name, order, || Box::new(RosenbrockMethod::new(method(), TOLERANCES, 1)));
    }
    for radius in [0.0, 0.8] {
        let newton = NewtonSettings::default();
        let make = || Box::new(GeneralizedAlpha::new(radius, newton, TOLERANCES, 1)) as Box<dyn Method>;
        check_one_step(&format!("generalised-α, ρ = {radius}"), 2.0, make);
    }
    for order in 1..=5 {
        check(&format!("BDF {order}"), order as f64, 40, |steps| {
            let step = END / steps as f64;
            let past: Vec<Point> = (0..=order).map(|i| if i == 0 { start() } else { exact(step * i as f64) }).collect();
            let mut method = Bdf::new(NewtonSettings::default(), TOLERANCES, 1);
            method.start_with(&past, step);
            let mut point = past[order].clone();
            advance(&mut method, &mut point, steps - order, step);
            point
        });
    }
}
