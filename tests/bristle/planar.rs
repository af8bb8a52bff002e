//! Is it physics? A pass that is planar by symmetry stays planar, and its mirror image has the same
//! metrics. `tests/agreement` turns set-ups about `z` and changes the tolerance.

use crate::common::{AnyTool, AnyWorkpiece, pass_with, side_by_side};
use bristle::equations::Clamp;
use bristle::model::metrics::Metrics;
use bristle::model::record::Record;
use bristle::model::settings::{Settings, WorkpieceKind};
use bristle::simulation::{Form, Pass, Sampling, Simulation, simulate_with_history};
use bristle::tool::{RotaryTool, Tool};
use bristle::workpiece::{Plane, Workpiece};
use fastrand::Rng;
use std::sync::LazyLock;

/// Number of random settings.
const SETTINGS: usize = 200;

/// Settings of a planar pass, slow ones among them: 0.2 m/s at the paper's stiffness is slow enough
/// to buckle sideways.
fn draw(rng: &mut Rng) -> Settings {
    let between = |rng: &mut Rng, low: f64, high: f64| low * (high / low).powf(rng.f64());
    let mut settings = Settings::paper(between(rng, 0.2, 40.0), between(rng, 0.3e-3, 6e-3));
    settings.filament.segments = rng.usize(3..8);
    settings.filament.damping_ratio = between(rng, 0.02, 0.2);
    settings.contact.stiffness_n_m = between(rng, 1e4, 1e7);
    let mut sometimes = || rng.u32(..4) == 0;
    let chosen: [bool; 6] = std::array::from_fn(|_| sometimes());
    let [exponent, damping, friction, radius, feed, gravity] = chosen;
    if exponent {
        settings.contact.exponent = 1.0 + 1.5 * rng.f64();
    }
    if damping {
        settings.contact.damping_s_m = rng.f64();
    }
    if friction {
        settings.contact.friction_coefficient = 0.6 * rng.f64();
    }
    if radius {
        // Less than the gap at the start.
        settings.contact.radius_m = 3e-5 * rng.f64();
    }
    if feed {
        settings.workpiece.feed_velocity_m_s = rng.f64() - 0.5;
    }
    if gravity {
        settings.process.gravity_m_s2 = [20.0 * rng.f64() - 10.0, -9.81, 0.0];
    }
    settings
}

/// Random settings, and the metrics of their passes.
static DRAWN: LazyLock<(Vec<Settings>, Vec<Metrics>)> = LazyLock::new(|| {
    let mut rng = Rng::with_seed(14);
    let settings: Vec<Settings> = (0..SETTINGS).map(|_| draw(&mut rng)).collect();
    let metrics = metrics(settings.iter().map(Pass::new).collect());
    (settings, metrics)
});

/// The metrics of passes, computed in lanes.
fn metrics<T: Tool + Clone, W: Workpiece + Clone>(passes: Vec<Pass<T, W>>) -> Vec<Metrics> {
    let results = side_by_side(Sampling::default(), passes);
    results
        .into_iter()
        .map(|result| result.expect("the pass ends").metrics)
        .collect()
}

/// The largest relative difference of any metric except the lateral amplification, and that of the
/// amplification.
fn deviation(a: &Metrics, b: &Metrics) -> [f64; 2] {
    let mut largest = [0.0_f64; 2];
    // The residual is an error by itself.
    for column in Metrics::COLUMNS
        .iter()
        .filter(|column| column.key != "energy_residual")
    {
        let scale = scale(column.key, a);
        let (a, b) = (column.get(a), column.get(b));
        let kind = usize::from(column.key == "lateral_amplification");
        if a != b {
            largest[kind] = largest[kind].max((a - b).abs() / scale.max(a.abs()).max(b.abs()));
        }
    }
    largest
}

/// What a component or a moment of the contact force is measured against: it can be the small
/// difference of large numbers.
fn scale(key: &str, metrics: &Metrics) -> f64 {
    const LEVER: f64 = 0.1;
    let force = metrics.tool_contact_normal_force_n;
    match key {
        "contact_impulse_x_n_s" | "contact_impulse_y_n_s" | "contact_impulse_z_n_s" => {
            metrics.contact_normal_impulse_n_s
        }
        "tool_tangential_force_n" | "tool_lateral_force_n" => force,
        "contact_angular_impulse_n_m_s" => LEVER * metrics.contact_normal_impulse_n_s,
        "tool_torque_n_m" => LEVER * force,
        "tool_power_w" => force * metrics.nominal_contact_length_m / metrics.nominal_contact_time_s,
        _ => 0.0,
    }
}

/// The metrics of the same contact where directions in the plane become `image` of them, and the
/// sense of rotation that times `sense`.
fn image(metrics: &Metrics, image: impl Fn([f64; 3]) -> [f64; 3], sense: f64) -> Metrics {
    let Metrics {
        contact_impulse_x_n_s: x,
        contact_impulse_y_n_s: y,
        contact_impulse_z_n_s: z,
        ..
    } = *metrics;
    let [x_image, y_image, z_image] = image([x, y, z]);
    let per_impulse = metrics.tool_contact_normal_force_n / metrics.contact_normal_impulse_n_s;
    Metrics {
        contact_impulse_x_n_s: x_image,
        contact_impulse_y_n_s: y_image,
        contact_impulse_z_n_s: z_image,
        contact_angular_impulse_n_m_s: sense * metrics.contact_angular_impulse_n_m_s,
        tool_tangential_force_n: -x_image * per_impulse,
        tool_lateral_force_n: -z_image * per_impulse,
        tool_torque_n_m: sense * metrics.tool_torque_n_m,
        tool_power_w: sense * metrics.tool_power_w,
        ..metrics.clone()
    }
}

/// `found` deviates from the metrics of [`DRAWN`] by no more than `tolerances`.
fn assert_same(found: &[Metrics], tolerances: [f64; 2]) {
    assert_close(&DRAWN.0, &DRAWN.1, found, tolerances);
}

fn assert_close(
    settings: &[Settings],
    expected: &[Metrics],
    found: &[Metrics],
    tolerances: [f64; 2],
) {
    for ((settings, expected), found) in settings.iter().zip(expected).zip(found) {
        let deviations = deviation(expected, found);
        let within = deviations
            .iter()
            .zip(tolerances)
            .all(|(deviation, tolerance)| *deviation <= tolerance);
        assert!(
            within,
            "{deviations:?}\n{settings:?}\n{expected:?}\n{found:?}"
        );
    }
}

/// The mirror image of a round tool at `x = 0`, which turns the other way.
#[derive(Clone, Copy)]
struct Mirrored {
    tool: RotaryTool,
}

impl Mirrored {
    fn image(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        [-x, y, z]
    }

    /// The mirror image of the pass of `settings`.
    fn pass(settings: &Settings) -> Pass<AnyTool, AnyWorkpiece> {
        let mirrored = Self {
            tool: RotaryTool::of(settings),
        };
        let depth = settings.process.penetration_depth_m;
        let distance = settings.tool_radius_m() - depth;
        let feed = [settings.workpiece.feed_velocity_m_s, 0.0, 0.0];
        let plane = Plane::new([0.0, -distance, 0.0], [0.0, 1.0, 0.0], mirrored.image(feed));
        let mut settings = settings.clone();
        settings.process.gravity_m_s2 = mirrored.image(settings.process.gravity_m_s2);
        pass_with(&settings, mirrored, plane).expect("the tips touch the plane")
    }
}

impl Tool for Mirrored {
    fn clamp(&self, angle: f64, rate: f64) -> Clamp<f64> {
        let Clamp {
            position,
            velocity,
            acceleration,
            direction,
            direction_rate,
            angular_velocity,
        } = self.tool.clamp(angle, rate);
        Clamp {
            position: self.image(position),
            velocity: self.image(velocity),
            acceleration: self.image(acceleration),
            direction: self.image(direction),
            direction_rate: self.image(direction_rate),
            // A mirror turns axial vectors round, too.
            angular_velocity: self.image(angular_velocity).map(|component| -component),
        }
    }

    fn radius(&self, filament_length: f64) -> f64 {
        self.tool.radius(filament_length)
    }

    fn is_planar(&self) -> bool {
        true
    }
}

#[test]
fn a_mirror_image_has_the_same_metrics() {
    let found = metrics(DRAWN.0.iter().map(Mirrored::pass).collect());
    let found: Vec<Metrics> = found
        .iter()
        .map(|metrics| image(metrics, |[x, y, z]| [-x, y, z], -1.0))
        .collect();
    // Rounding shifts the short contacts of grazing nodes, of which hard contacts have hundreds.
    assert_same(&found, [1e-5, 5e-5]);
}

#[test]
fn a_pass_is_planar_where_tool_workpiece_and_gravity_are() {
    let form = |change: fn(&mut Settings)| {
        let mut settings = Settings::paper(10.0, 1e-3);
        change(&mut settings);
        Pass::new(&settings).form()
    };
    assert_eq!(form(|_| ()), Form::Planar);
    assert_eq!(
        form(|settings| settings.workpiece.kind = WorkpieceKind::plane([-3.0, 0.4, 0.0])),
        Form::Planar
    );
    assert_eq!(
        form(|settings| settings.process.gravity_m_s2 = [1.0, -9.81, 0.0]),
        Form::Planar
    );
    assert_eq!(
        form(|settings| settings.contact.friction_coefficient = 0.3),
        Form::Planar
    );
    assert_eq!(
        form(|settings| settings.workpiece.kind = WorkpieceKind::plane([0.0, 1.0, 1e-12])),
        Form::Spatial
    );
    assert_eq!(
        form(|settings| settings.process.gravity_m_s2[2] = 1e-9),
        Form::Spatial
    );
    assert_eq!(
        form(|settings| settings.filament.lateral_tilt_rad = 1e-9),
        Form::Spatial
    );
    let pass = Pass::new(&Settings::paper(10.0, 1e-3));
    assert_eq!(pass.in_space().form(), Form::Spatial);
}

#[test]
fn a_planar_filament_stays_in_the_plane() {
    // The filament of this pass buckles sideways in space, as rounding decides.
    let settings = Settings::paper(0.5, 5e-3);
    let Simulation {
        metrics, history, ..
    } = simulate_with_history(&settings, 500).expect("the pass ends");
    assert!(history.iter().all(|sample| sample.tip_z_m == 0.0));
    assert!(metrics.laterally_unstable, "{metrics:?}");
}

#[test]
fn stable_passes_are_the_same_in_space() {
    for (velocity, depth, friction) in [
        (10.0, 1e-3, 0.0),
        (20.0, 3e-3, 0.0),
        (30.0, 5e-3, 0.0),
        (15.0, 2e-3, 0.3),
    ] {
        let mut settings = Settings::paper(velocity, depth);
        settings.contact.friction_coefficient = friction;
        settings.solver.relative_tolerance = 1e-8;
        let [planar, spatial] =
            [Pass::new(&settings), Pass::new(&settings).in_space()].map(|pass| {
                pass.simulate(Default::default())
                    .expect("the pass ends")
                    .metrics
            });
        let spatial = Metrics {
            lateral_amplification: planar.lateral_amplification,
            ..spatial
        };
        assert_close(&[settings], &[planar], &[spatial], [2e-6, 0.0]);
    }
}
