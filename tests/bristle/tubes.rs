//! Bores narrower than the brush, against a static chain of its own: written for forces and moments
//! instead of energies.

use std::f64::consts::{PI, TAU};

use bristle::model::settings::{BrushSettings, Settings, WorkpieceKind};
use bristle::simulation::{Form, Pass, Sampling, Simulation, simulate};

/// Relative difference from a static chain. The last turn differs from the one before by less than
/// 1e-3, and vibrations decay by more than a tenth in a turn.
const STATIC: f64 = 1e-4;
/// The undeformed radius of the paper's brush in m, and its number of filaments.
const RADIUS: f64 = 0.18;
const COUNT: f64 = 10_500.0;

/// The paper's brush in a bore of the radius `radius` (m), whose axis is above the tool's by
/// `eccentricity` (m).
fn tube(
    velocity: f64,
    [radius, eccentricity]: [f64; 2],
    segments: usize,
    friction: f64,
) -> Settings {
    let mut settings = Settings::paper(velocity, RADIUS - radius + eccentricity);
    settings.workpiece.kind = WorkpieceKind::bore(radius);
    settings.filament.segments = segments;
    settings.contact.friction_coefficient = friction;
    settings
}

fn simulated(settings: &Settings) -> Simulation {
    assert_eq!(settings.check(), Ok(()));
    simulate(settings).expect("a pass")
}

/// Action of a wall on a filament: its force in N, the normal part, and the moment about the tool's
/// axis in N m.
#[derive(Clone, Copy, Debug, Default)]
struct Wall {
    force: [f64; 2],
    normal: f64,
    moment: f64,
}

/// A chain of rigid segments at rest in the frame that turns with its clamp, which points along `x`.
/// The resultant of the centrifugal forces of a uniform rod acts at its centre.
struct StaticChain {
    root: f64,
    length: f64,
    mass: f64,
    /// Moment per angle of all joints but the first, which has twice as much.
    joint: f64,
    segments: usize,
    rate: f64,
    friction: f64,
    stiffness: f64,
    exponent: f64,
    regularisation: f64,
}

impl StaticChain {
    fn of(settings: &Settings) -> Self {
        let (filament, contact) = (&settings.filament, &settings.contact);
        let length = filament.length_m / filament.segments as f64;
        let diameter = filament.diameter_m;
        let bending = filament.youngs_modulus_pa * PI * diameter.powi(4) / 64.0;
        let radius = settings.tool.body_radius_m + filament.length_m;
        Self {
            root: settings.tool.body_radius_m,
            length,
            mass: filament.density_kg_m3 * PI / 4.0 * diameter * diameter * length,
            joint: bending / length,
            segments: filament.segments,
            rate: settings.process.brushing_velocity_m_s / radius,
            friction: contact.friction_coefficient,
            stiffness: contact.stiffness_n_m,
            exponent: contact.exponent,
            regularisation: contact.friction_regularisation_m_s,
        }
    }

    /// Pressure of a wall of the radius `wall` (m) about `centre` on a node at `[x, y]`.
    fn pressed(&self, node: usize, [x, y]: [f64; 2], wall: f64, centre: [f64; 2]) -> Wall {
        let (u, v) = (x - centre[0], y - centre[1]);
        let distance = u.hypot(v);
        let depth = distance - wall;
        if depth <= 0.0 {
            return Wall::default();
        }
        let share = match node == self.segments {
            true => 1.0,
            false => (25.0 / self.segments as f64).min(1.0),
        };
        let normal = share * self.stiffness * depth.powf(self.exponent);
        let (cos, sin) = (u / distance, v / distance);
        // The node goes round the tool's axis, along the wall with this speed.
        let speed = self.rate * (x * cos + y * sin);
        let drag = self.friction * normal * speed / speed.hypot(self.regularisation);
        let force = [-normal * cos + drag * sin, -normal * sin - drag * cos];
        Wall {
            force,
            normal,
            moment: x * force[1] - y * force[0],
        }
    }

    fn nodes(&self, angles: &[f64]) -> Vec<[f64; 2]> {
        let mut nodes = vec![[self.root, 0.0]];
        for (k, angle) in angles.iter().enumerate() {
            let [x, y] = nodes[k];
            nodes.push([x + self.length * angle.cos(), y + self.length * angle.sin()]);
        }
        nodes
    }

    /// Moments in N m about each joint of all that acts beyond it, less that of its spring.
    fn moments(&self, angles: &[f64], wall: f64, centre: [f64; 2]) -> Vec<f64> {
        let nodes = self.nodes(angles);
        let spin = self.mass * self.rate * self.rate;
        let (mut force, mut moments) = ([0.0; 2], vec![0.0; self.segments]);
        // Moment about the joint of the force beyond, from the tip inwards.
        let mut carried = 0.0;
        for k in (0..self.segments).rev() {
            let ([x, y], [u, v]) = (nodes[k], nodes[k + 1]);
            let Wall { force: [f, g], .. } = self.pressed(k + 1, [u, v], wall, centre);
            let beyond = [force[0] + f, force[1] + g];
            let middle = [spin * (x + u) / 2.0, spin * (y + v) / 2.0];
            let about = |[f, g]: [f64; 2]| (u - x) * g - (v - y) * f;
            carried += about(beyond) + about(middle) / 2.0;
            force = [beyond[0] + middle[0], beyond[1] + middle[1]];
            let (stiffness, before) = match k {
                0 => (2.0 * self.joint, 0.0),
                _ => (self.joint, angles[k - 1]),
            };
            moments[k] = carried - stiffness * (angles[k] - before);
        }
        moments
    }

    /// Newton's method with differences as derivatives, for a wall of some stiffness.
    fn settle(&self, angles: &mut [f64], wall: f64, centre: [f64; 2]) {
        const STEP: f64 = 1e-7;
        for _ in 0..50 {
            let rest = self.moments(angles, wall, centre);
            let mut rows: Vec<Vec<f64>> = rest.iter().map(|_| Vec::new()).collect();
            for k in 0..self.segments {
                let [above, below] = [STEP, -STEP].map(|step| {
                    let mut moved = angles.to_vec();
                    moved[k] += step;
                    self.moments(&moved, wall, centre)
                });
                for (j, row) in rows.iter_mut().enumerate() {
                    row.push((above[j] - below[j]) / (2.0 * STEP));
                }
            }
            for (row, rest) in rows.iter_mut().zip(&rest) {
                row.push(-rest);
            }
            let change = solve(rows);
            let largest = change
                .iter()
                .fold(0.0_f64, |most, each| most.max(each.abs()));
            for (angle, change) in angles.iter_mut().zip(&change) {
                *angle += (0.1 / largest).min(1.0) * change;
            }
            if largest < 1e-10 {
                return;
            }
        }
        panic!("no equilibrium at {wall} m with {} N/m", self.stiffness);
    }

    /// Angles at rest in a bore, whose wall has become as stiff as it is, and then as smooth: at
    /// first it hardly bends the filament, and friction decides to which side.
    fn at_rest(&self, wall: f64, centre: [f64; 2]) -> Vec<f64> {
        const STEPS: i32 = 80;
        let mut angles = vec![-1e-3; self.segments];
        for step in 1..=STEPS {
            let left = f64::from(STEPS - step) / f64::from(STEPS);
            let soft = Self {
                stiffness: self.stiffness * 1e-5_f64.powf(left),
                friction: self.friction.max(0.2),
                ..*self
            };
            soft.settle(&mut angles, wall, centre);
        }
        for step in 1..=STEPS {
            let left = f64::from(STEPS - step) / f64::from(STEPS);
            let rough = Self {
                friction: self.friction + left * (0.2 - self.friction).max(0.0),
                ..*self
            };
            rough.settle(&mut angles, wall, centre);
        }
        angles
    }

    /// Sum over all nodes.
    fn load(&self, angles: &[f64], wall: f64, centre: [f64; 2]) -> Wall {
        let nodes = self.nodes(angles);
        let of_node = |k: usize| self.pressed(k, nodes[k], wall, centre);
        (1..=self.segments)
            .map(of_node)
            .fold(Wall::default(), |sum, each| Wall {
                force: [sum.force[0] + each.force[0], sum.force[1] + each.force[1]],
                normal: sum.normal + each.normal,
                moment: sum.moment + each.moment,
            })
    }
}

/// Solves a linear system, whose rows have their right-hand side last, by Gauss's elimination.
fn solve(mut rows: Vec<Vec<f64>>) -> Vec<f64> {
    let n = rows.len();
    for k in 0..n {
        let pivot = (k..n)
            .max_by(|&i, &j| rows[i][k].abs().total_cmp(&rows[j][k].abs()))
            .unwrap_or(k);
        rows.swap(k, pivot);
        let (above, below) = rows.split_at_mut(k + 1);
        for row in below {
            let factor = row[k] / above[k][k];
            for (entry, pivot) in row.iter_mut().zip(&above[k]) {
                *entry -= factor * pivot;
            }
        }
    }
    let mut solution = vec![0.0; n];
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| rows[k][j] * solution[j]).sum();
        solution[k] = (rows[k][n] - known) / rows[k][k];
    }
    solution
}

fn assert_close(found: f64, expected: f64, tolerance: f64, what: &str) {
    let error = (found - expected).abs();
    assert!(
        error <= tolerance * expected.abs(),
        "{what}: {found} instead of {expected}"
    );
}

/// A filament in a concentric bore is at rest in the frame of the tool.
#[test]
fn a_concentric_tube_is_a_static_chain() {
    for (velocity, radius, segments, friction) in [
        (5.0, 0.176, 25, 0.2),
        (10.0, 0.176, 10, 0.3),
        (20.0, 0.170, 25, 0.4),
        (20.0, 0.179, 10, 0.2),
        (60.0, 0.175, 10, 0.3),
        (10.0, 0.176, 10, 0.0),
    ] {
        let settings = tube(velocity, [radius, 0.0], segments, friction);
        let chain = StaticChain::of(&settings);
        let Wall { normal, moment, .. } =
            chain.load(&chain.at_rest(radius, [0.0; 2]), radius, [0.0; 2]);
        let Simulation { metrics, .. } = simulated(&settings);
        let what = format!("{velocity} m/s, {radius} m, n = {segments}, µ = {friction}");
        let turn = TAU * RADIUS / velocity;
        assert_close(
            metrics.tool_contact_normal_force_n,
            COUNT * normal,
            STATIC,
            &what,
        );
        assert_close(
            metrics.contact_normal_impulse_n_s,
            turn * normal,
            STATIC,
            &what,
        );
        let torque = metrics.tool_torque_n_m + COUNT * moment;
        assert!(
            torque.abs() <= STATIC * COUNT * normal * radius * friction.max(1e-3),
            "{what}: {torque}"
        );
        assert_close(metrics.contact_time_ratio, 1.0, 1e-12, &what);
        assert_close(metrics.nominal_contact_time_s, turn, 1e-12, &what);
        // Over a turn, the force has gone all round.
        let [x, y] = [metrics.contact_impulse_x_n_s, metrics.contact_impulse_y_n_s];
        assert!(
            x.hypot(y) < STATIC * metrics.contact_normal_impulse_n_s,
            "{what}: {x} {y}"
        );
        assert!(!metrics.unsteady_turns, "{what}");
    }
}

/// A filament that turns slowly in an eccentric bore is nearly at rest at each angle: inertia and
/// damping change it by ω/Ω_1 = 0.3 % of the variation over a turn.
#[test]
fn a_slow_eccentric_tube_is_static_at_each_angle() {
    const POINTS: usize = 48;
    let (radius, eccentricity) = (0.176, 1.5e-3);
    let settings = tube(0.5, [radius, eccentricity], 10, 0.3);
    let chain = StaticChain::of(&settings);
    let mut sum = Wall::default();
    for point in 0..POINTS {
        let (sin, cos) = (TAU * point as f64 / POINTS as f64).sin_cos();
        let centre = [eccentricity * sin, eccentricity * cos];
        let angles = chain.at_rest(radius, centre);
        let Wall {
            force: [f, g],
            normal,
            moment,
        } = chain.load(&angles, radius, centre);
        sum.force[0] += (cos * f - sin * g) / POINTS as f64;
        sum.force[1] += (sin * f + cos * g) / POINTS as f64;
        sum.normal += normal / POINTS as f64;
        sum.moment += moment / POINTS as f64;
    }
    let Simulation { metrics, .. } = simulated(&settings);
    let turn = TAU * RADIUS / 0.5;
    const SLOW: f64 = 1e-3;
    assert_close(
        metrics.tool_contact_normal_force_n,
        COUNT * sum.normal,
        SLOW,
        "force",
    );
    assert_close(metrics.tool_torque_n_m, -COUNT * sum.moment, SLOW, "torque");
    assert_close(
        metrics.contact_impulse_x_n_s,
        turn * sum.force[0],
        1e-2,
        "x",
    );
    assert_close(
        metrics.contact_impulse_y_n_s,
        turn * sum.force[1],
        1e-2,
        "y",
    );
}

/// Without friction a filament would buckle to either side.
#[test]
fn a_filament_without_friction_trails() {
    for (velocity, radius) in [(3.0, 0.176), (10.0, 0.176), (25.0, 0.178), (60.0, 0.17)] {
        let settings = tube(velocity, [radius, 0.0], 10, 0.0);
        assert!(settings.starts_leaning());
        let sampling = Sampling {
            shapes: 2,
            ..Sampling::default()
        };
        let pass = Pass::new(&settings);
        let simulation = pass.simulate(sampling).expect("a pass");
        let shape = simulation.shapes.last().expect("the last shape");
        let ([x, y, _], [u, v, _]) = (shape.nodes_m[0], shape.nodes_m[10]);
        assert!(
            x * v - y * u < -0.1 * x.hypot(y) * 0.04,
            "{velocity} m/s: {u} {v}"
        );
    }
}

/// The motion stays in the plane of rotation, as on any bore.
#[test]
fn a_tube_is_planar_and_takes_a_turn_before_the_first() {
    let settings = tube(10.0, [0.176, 1e-3], 5, 0.3);
    let pass = Pass::new(&settings);
    assert_eq!(pass.form(), Form::Planar);
    assert!((pass.nominal_times()[0] - pass.turn_time()).abs() < 1e-12);
    let Simulation {
        metrics,
        turn_contact_normal_impulses_n_s: turns,
        end_time_s,
        ..
    } = simulated(&settings);
    assert!((end_time_s / pass.turn_time() - 1.0 - turns.len() as f64).abs() < 1e-9);
    assert!(metrics.lateral_amplification.is_finite());
}

/// A narrow bore that the undeformed filament leaves on one side is an ordinary pass.
#[test]
fn a_narrow_bore_that_filaments_leave_is_an_ordinary_pass() {
    let settings = tube(10.0, [0.179, 1.5e-3], 10, 0.3);
    assert_eq!(settings.tube(), None);
    let pass = Pass::new(&settings);
    let [entry, exit] = pass.nominal_times();
    assert!(exit - entry < 0.9 * pass.turn_time());
    let Simulation {
        metrics,
        turn_contact_normal_impulses_n_s: turns,
        ..
    } = simulated(&settings);
    assert_eq!(turns.len(), 1);
    assert!(metrics.contact_normal_impulse_n_s > 0.0 && metrics.contact_time_ratio < 1.0);
}

#[test]
fn tubes_that_make_no_sense_are_refused() {
    let refused = |change: fn(&mut Settings)| {
        let mut settings = tube(10.0, [0.176, 0.0], 10, 0.3);
        change(&mut settings);
        settings.check().expect_err("refused").to_string()
    };
    let said = [
        refused(|settings| settings.workpiece.kind = WorkpieceKind::bore(0.1405)),
        refused(|settings| settings.workpiece.feed_velocity_m_s = 0.01),
        refused(|settings| settings.set_tool_force_n(100.0)),
        refused(|settings| settings.brush = Some(BrushSettings::default())),
        refused(|settings| settings.tool.filament_count = 16_000.0),
        refused(|settings| settings.tool.tilt_rad = Some(0.1)),
    ];
    for (said, part) in said.iter().zip([
        "every root must lie inside",
        "fed against the tool",
        "its radius decides the force",
        "with [brush]",
        "it squeezes the trim",
        "only on tools that are round and not tilted",
    ]) {
        assert!(said.contains(part), "{said}");
    }
}

/// The default depth is that of a concentric bore, where it is narrower than the brush.
#[test]
fn the_default_depth_is_concentric() {
    let depth = |radius: f64| {
        let mut settings = tube(10.0, [radius, 0.0], 10, 0.3);
        settings.process.penetration_depth_m = 0.0;
        settings.with_default_depth().process.penetration_depth_m
    };
    assert!((depth(0.175) - 5e-3).abs() < 1e-15);
    assert_eq!(depth(0.2), 0.0);
}
