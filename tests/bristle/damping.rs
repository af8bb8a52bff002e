//! Is it physics? Dampers see a filament from the turning brush body.

use bristle::equations::linear::{add, cross, dot, scale, sub};
use bristle::equations::{
    Chain, ChainDynamics, Clamp, Dynamics, NoLoads, PolarAxis, PoleError, RelaxedAngle, StepWeights,
};
use bristle::model::filament;
use bristle::tool::{RotaryTool, SampledTool, Tool};
use fastrand::Rng;

use crate::agreement::check_solve;
use crate::common::{RandomState, filament as paper, largest, random_pairs, tolerance};

/// A chain of any shape on a body that turns about any axis.
struct DrawnChain {
    chain: Chain<f64>,
    clamp: Clamp<f64>,
    chart: PolarAxis,
    q: Vec<[f64; 2]>,
    /// Rates of the segments that turn rigidly with the body.
    rigid: Vec<[f64; 2]>,
}

fn random(rng: &mut Rng, size: f64) -> [f64; 3] {
    [(); 3].map(|()| size * (2.0 * rng.f64() - 1.0))
}

impl DrawnChain {
    /// Draws `segments` segments from `start` on, on a body with the angular velocity `turning`.
    fn new(rng: &mut Rng, segments: usize, start: [f64; 3], turning: [f64; 3]) -> Self {
        let mut chain = filament::chain(&paper(segments), random(rng, 20.0));
        for link in &mut chain.links {
            link.damping *= 0.5 + rng.f64();
            link.relaxed_angle = RelaxedAngle::new(0.3 * (2.0 * rng.f64() - 1.0));
        }
        let position = random(rng, 0.2);
        let velocity = cross(turning, position);
        let clamp = Clamp {
            position,
            velocity,
            acceleration: cross(turning, velocity),
            direction: start,
            direction_rate: cross(turning, start),
            angular_velocity: turning,
        };
        // Directions in a cone of about one radian are away from the poles of one chart or of both.
        let is_far = |axis: f64| axis.abs() < 0.9;
        let draw = |rng: &mut Rng| {
            let mut directions = vec![start];
            for k in 0..segments {
                let bent = add(directions[k], random(rng, 1.0 / (segments as f64).sqrt()));
                directions.push(scale(1.0 / dot(bent, bent).sqrt(), bent));
            }
            directions
        };
        let (chart, directions) = loop {
            let directions = draw(rng);
            let is_good = |component: usize| {
                let mut all = directions[1..].iter();
                all.all(|direction| is_far(direction[component]))
            };
            match (is_good(2), is_good(0)) {
                (true, true) if rng.bool() => break (PolarAxis::X, directions),
                (true, _) => break (PolarAxis::Z, directions),
                (false, true) => break (PolarAxis::X, directions),
                (false, false) => {}
            }
        };
        if chart == PolarAxis::X {
            for link in &mut chain.links[1..] {
                link.relaxed_angle = RelaxedAngle::new(0.0);
            }
        }
        let (q, rigid) = directions[1..]
            .iter()
            .map(|direction| {
                let [q, rates, _] =
                    chart.coordinates([*direction, cross(turning, *direction), [0.0; 3]]);
                (q, rates)
            })
            .unzip();
        Self {
            chain,
            clamp,
            chart,
            q,
            rigid,
        }
    }

    /// Starts radially, axially and in any direction in turn, on a body that turns about `z` or
    /// about any axis.
    fn drawn(number: usize, rng: &mut Rng) -> Self {
        let any = random(rng, 1.0);
        let start = [
            [0.6, -0.8, 0.0],
            [0.0, 0.0, -1.0],
            scale(1.0 / dot(any, any).sqrt(), any),
        ][number % 3];
        let turning = if number.is_multiple_of(2) {
            [0.0, 0.0, 150.0]
        } else {
            random(rng, 150.0)
        };
        Self::new(rng, [1, 2, 3, 7, 25][number % 5], start, turning)
    }

    fn dynamics(&self, damping: f64) -> Dynamics<f64> {
        let mut chain = self.chain.clone();
        chain
            .links
            .iter_mut()
            .for_each(|link| link.damping *= damping);
        let mut dynamics = Dynamics::new(chain);
        dynamics.set_chart(self.chart);
        dynamics
    }

    /// `M q̈ − f`.
    fn residual(&self, damping: f64, v: &[[f64; 2]], accelerations: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let mut residual = vec![[0.0; 2]; self.q.len()];
        self.dynamics(damping).residual(
            self.clamp.holding(&self.q, v),
            accelerations,
            &NoLoads,
            &mut residual,
        );
        residual
    }

    /// `∂D/∂q̇`
    fn damper_torques(&self, v: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let at_rest = vec![[0.0; 2]; self.q.len()];
        // The residual is linear in springs, inertia, gravity and dampers, so the difference leaves
        // the dampers.
        let (with, without) = (
            self.residual(1.0, v, &at_rest),
            self.residual(0.0, v, &at_rest),
        );
        with.iter()
            .zip(&without)
            .map(|(with, without)| sub(*with, *without))
            .collect()
    }

    /// Computes `D` by its formula, from directions alone.
    fn dissipation(&self, v: &[[f64; 2]]) -> f64 {
        let (mut sum, mut inner) = (0.0, [0.0; 3]);
        for (k, link) in self.chain.links.iter().enumerate() {
            let [direction, rate, _] = self.chart.direction([self.q[k], v[k], [0.0; 2]]);
            let outer = cross(
                direction,
                sub(rate, cross(self.clamp.angular_velocity, direction)),
            );
            let relative = sub(outer, inner);
            sum += 0.5 * link.damping * dot(relative, relative);
            inner = outer;
        }
        sum
    }

    fn energies(&self, damping: f64, v: &[[f64; 2]]) -> bristle::equations::Energies<f64> {
        let mut dynamics = self.dynamics(damping);
        let at = self.clamp.holding(&self.q, v);
        dynamics.place(at);
        dynamics.energies(at)
    }
}

#[test]
fn a_filament_that_turns_rigidly_with_the_body_dissipates_nothing() {
    let mut rng = Rng::with_seed(31);
    for number in 0..300 {
        let state = DrawnChain::drawn(number, &mut rng);
        // Rates of 150 rad/s, near a pole some 350 rad/s, cancel to their roundings. The scale is
        // the dissipation of a filament at rest.
        let at_rest = vec![[0.0; 2]; state.q.len()];
        let [lost, alone] = [&state.rigid, &at_rest].map(|v| state.energies(1.0, v).dissipation);
        assert!(
            lost.abs() <= 1e-13 * alone,
            "{number}: {lost:e} of {alone:e}"
        );
        let [torques, alone] =
            [&state.rigid, &at_rest].map(|v| largest(state.damper_torques(v).as_flattened()));
        // The difference of residuals also has the roundings of springs and inertia.
        let rest = state.residual(0.0, &state.rigid, &at_rest);
        let rest = largest(rest.as_flattened());
        assert!(
            torques <= 1e-13 * (alone + rest),
            "{number}: {torques:e} of {alone:e}"
        );
    }
}

#[test]
fn the_dissipation_is_that_of_the_formula() {
    let mut rng = Rng::with_seed(32);
    for number in 0..300 {
        let state = DrawnChain::drawn(number, &mut rng);
        let v = random_pairs(&mut rng, state.q.len(), 200.0);
        let (expected, mut dynamics) = (state.dissipation(&v), state.dynamics(1.0));
        let at = state.clamp.holding(&state.q, &v);
        dynamics.place(at);
        for found in [dynamics.energies(at).dissipation, dynamics.dissipation(at)] {
            assert!(
                (found - expected).abs() <= tolerance::AGREEMENT * expected,
                "{number}: {found:e} {expected:e}"
            );
        }
    }
}

#[test]
fn the_body_puts_in_what_the_dampers_take_and_do() {
    let mut rng = Rng::with_seed(33);
    for number in 0..300 {
        let state = DrawnChain::drawn(number, &mut rng);
        let v = random_pairs(&mut rng, state.q.len(), 200.0);
        let [damped, undamped] = [1.0, 0.0].map(|damping| state.energies(damping, &v));
        // D is homogeneous in q̇ and Ω together: 2 D = q̇·∂D/∂q̇ + Ω·∂D/∂Ω.
        let torques = state.damper_torques(&v);
        let on_segments: f64 = v
            .iter()
            .zip(&torques)
            .map(|(v, torque)| dot(*v, *torque))
            .sum();
        let from_body = damped.clamp_torque_power - undamped.clamp_torque_power;
        let (taken, size) = (
            2.0 * damped.dissipation,
            2.0 * damped.dissipation + on_segments.abs(),
        );
        // The torques are differences of larger numbers.
        assert!(
            (on_segments + from_body - taken).abs() <= 1e-9 * size,
            "{number}: {on_segments} + {from_body} {taken}"
        );
    }
}

/// The step matrix has the Jacobian of the rigid rates, for bodies that turn about any axis.
#[test]
fn factorised_step_matrix_on_a_turning_body_matches_differences() -> Result<(), PoleError> {
    let mut rng = Rng::with_seed(34);
    // These weights make the dampers visible in a step of the coordinates alone.
    let weights = StepWeights {
        coordinates: 1e-4,
        rates: 0.0,
    };
    for number in 0..30 {
        let state = DrawnChain::drawn(number, &mut rng);
        let segments = state.q.len();
        let mut dynamics = state.dynamics(1.0);
        dynamics.check_poles(&state.q)?;
        let moving = RandomState {
            v: random_pairs(&mut rng, segments, 200.0),
            q: state.q,
            chain: state.chain,
            clamp: state.clamp,
        };
        let at_rest = vec![[0.0; 2]; segments];
        let direction = || random_pairs(&mut rng, segments, 1.0);
        check_solve(
            &mut dynamics,
            &moving,
            &at_rest,
            &NoLoads,
            &[weights],
            direction,
        );
    }
    Ok(())
}

#[test]
fn a_sampled_tool_turns_with_its_body_where_its_samples_do() {
    let axial = |angle: f64| {
        (
            [0.1 * angle.cos(), 0.1 * angle.sin(), 0.02],
            [0.0, 0.0, -1.0],
        )
    };
    let rocking = |angle: f64| {
        (
            [0.1, 0.0, 0.0],
            [(0.2 * angle.sin()).cos(), (0.2 * angle.sin()).sin(), 0.0],
        )
    };
    let sampled = |clamp: &dyn Fn(f64) -> ([f64; 3], [f64; 3])| {
        let (positions, directions): (Vec<_>, Vec<_>) = (0..64)
            .map(|k| clamp(std::f64::consts::TAU * f64::from(k) / 64.0))
            .unzip();
        SampledTool::new(&positions, &directions)
            .expect("a tool")
            .clamp(0.3, 50.0)
    };
    assert_eq!(sampled(&axial).angular_velocity, [0.0, 0.0, 50.0]);
    let clamp = sampled(&rocking);
    assert_eq!(
        clamp.angular_velocity,
        cross(clamp.direction, clamp.direction_rate)
    );
    assert!((clamp.angular_velocity[2] - 50.0 * 0.2 * 0.3_f64.cos()).abs() < 1e-9);
    let tilted = RotaryTool {
        lateral_tilt: 0.3,
        leans_from: None,
        ..RotaryTool::radial(0.14)
    }
    .clamp(0.3, 50.0);
    assert_eq!(tilted.angular_velocity, [0.0, 0.0, 50.0]);
}
