//! Is it physics? A pass that is planar by symmetry stays in its plane, and its mirror image has the same result. That it depends neither
//! on how the set-up is turned about `z` nor, beyond the tolerance, on the tolerance: `tests/agreement/`.

use bristle::equations::Clamp;
use bristle::model::metrics::Metrics;
use bristle::model::record::Record;
use bristle::model::settings::Settings;
use bristle::simulation::{Form, Job, Kind, Pass, Simulation, simulate_side_by_side, simulate_with_history};
use bristle::tool::{RoundTool, Tool};
use bristle::workpiece::{Plane, Workpiece};
use fastrand::Rng;

/// Number of random settings.
const SETTINGS: usize = 500;

/// Settings of a planar pass, slow ones among them: 0.2 m/s at the paper's stiffness is slow enough to buckle sideways.
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

/// The metrics of passes, computed in lanes.
fn metrics<T: Tool + Clone, W: Workpiece + Clone>(passes: Vec<Pass<T, W>>) -> Vec<Metrics> {
    let mut results = vec![None; passes.len()];
    let mut jobs: Vec<Job<T, W>> = passes.into_iter().enumerate().map(|(number, pass)| Job { number, pass }).collect();
    let take = |kind: Option<Kind>| {
        let fits = |job: &Job<T, W>| kind.is_none_or(|kind| job.pass.kind() == kind);
        let position = jobs.iter().rposition(fits)?;
        Some(jobs.swap_remove(position))
    };
    simulate_side_by_side(take, |number, result| results[number] = Some(result.expect("the pass ends").metrics));
    results.into_iter().map(|metrics| metrics.expect("each pass is reported")).collect()
}

/// The largest relative difference of any metric except the lateral amplification, and that of the amplification.
fn deviation(a: &Metrics, b: &Metrics) -> [f64; 2] {
    let mut largest = [0.0_f64; 2];
    // The residual is an error by itself.
    for column in Metrics::COLUMNS.iter().filter(|column| column.key != "energy_residual") {
        let scale = scale(column.key, a);
        let (a, b) = (column.get(a), column.get(b));
        let kind = usize::from(column.key == "lateral_amplification");
        if a != b {
            largest[kind] = largest[kind].max((a - b).abs() / scale.max(a.abs()).max(b.abs()));
        }
    }
    largest
}

/// What a component or a moment of the contact force is measured against: it can be the small difference of large numbers.
fn scale(key: &str, metrics: &Metrics) -> f64 {
    const LEVER: f64 = 0.1;
    let force = metrics.tool_contact_normal_force_n;
    match key {
        "contact_impulse_x_n_s" | "contact_impulse_y_n_s" | "contact_impulse_z_n_s" => {
            metrics.contact_normal_impulse_n_s
        }
        "tool_tangential_force_n" => force,
        "contact_angular_impulse_n_m_s" => LEVER * metrics.contact_normal_impulse_n_s,
        "tool_torque_n_m" => LEVER * force,
        "tool_power_w" => force * metrics.nominal_contact_length_m / metrics.nominal_contact_time_s,
        _ => 0.0,
    }
}

/// The metrics of the mirror image of a contact.
fn mirrored(metrics: &Metrics) -> Metrics {
    Metrics {
        contact_impulse_x_n_s: -metrics.contact_impulse_x_n_s,
        contact_angular_impulse_n_m_s: -metrics.contact_angular_impulse_n_m_s,
        tool_tangential_force_n: -metrics.tool_tangential_force_n,
        tool_torque_n_m: -metrics.tool_torque_n_m,
        tool_power_w: -metrics.tool_power_w,
        ..metrics.clone()
    }
}

/// The mirror image of a round tool at `x = 0`, which turns the other way.
#[derive(Clone, Copy)]
struct Mirrored {
    tool: RoundTool,
}

impl Mirrored {
    fn image(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        [-x, y, z]
    }

    /// The mirror image of the pass of `settings`.
    fn pass(settings: &Settings) -> Pass<Self, Plane> {
        let mirrored = Self { tool: RoundTool::of(settings) };
        let depth = settings.process.penetration_depth_m;
        let distance = settings.tool_radius_m() - depth;
        let feed = [settings.workpiece.feed_velocity_m_s, 0.0, 0.0];
        let plane = Plane::new([0.0, -distance, 0.0], [0.0, 1.0, 0.0], mirrored.image(feed));
        let mut settings = settings.clone();
        settings.process.gravity_m_s2 = mirrored.image(settings.process.gravity_m_s2);
        Pass::with(&settings, mirrored, plane).expect("the tips touch the plane")
    }
}

impl Tool for Mirrored {
    fn clamp(&self, angle: f64, rate: f64) -> Clamp<f64> {
        let Clamp { position, velocity, acceleration, direction, direction_rate, angular_velocity } =
            self.tool.clamp(angle, rate);
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
    // Rounding shifts the short contacts of grazing nodes, of which hard contacts have hundreds.
    let tolerances = [1e-5, 5e-5];
    let mut rng = Rng::with_seed(14);
    let drawn: Vec<Settings> = (0..SETTINGS).map(|_| draw(&mut rng)).collect();
    let expected = metrics(drawn.iter().map(Pass::new).collect());
    let found = metrics(drawn.iter().map(Mirrored::pass).collect());
    for ((settings, expected), found) in drawn.iter().zip(&expected).zip(&found) {
        let deviations = deviation(expected, &mirrored(found));
        let within = deviations.iter().zip(tolerances).all(|(deviation, tolerance)| *deviation <= tolerance);
        assert!(within, "{deviations:?}\n{settings:?}\n{expected:?}\n{found:?}");
    }
}

#[test]
fn a_pass_is_planar_where_tool_workpiece_and_gravity_are() {
    let form = |change: fn(&mut Settings)| {
        let mut settings = Settings::paper(10.0, 1e-3);
        change(&mut settings);
        Pass::new(&settings).form()
    };
    assert_eq!(form(|_| ()), Form::Planar);
    assert_eq!(form(|settings| settings.workpiece.normal = [-3.0, 0.4, 0.0]), Form::Planar);
    assert_eq!(form(|settings| settings.process.gravity_m_s2 = [1.0, -9.81, 0.0]), Form::Planar);
    assert_eq!(form(|settings| settings.contact.friction_coefficient = 0.3), Form::Planar);
    assert_eq!(form(|settings| settings.workpiece.normal = [0.0, 1.0, 1e-12]), Form::Spatial);
    assert_eq!(form(|settings| settings.process.gravity_m_s2[2] = 1e-9), Form::Spatial);
    assert_eq!(form(|settings| settings.filament.lateral_tilt_rad = 1e-9), Form::Spatial);
    let pass = Pass::new(&Settings::paper(10.0, 1e-3));
    assert_eq!(pass.in_space().form(), Form::Spatial);
}

#[test]
fn a_planar_filament_stays_in_the_plane() {
    // The filament of this pass buckles sideways in space, as rounding decides.
    let settings = Settings::paper(0.5, 5e-3);
    let Simulation { metrics, history, .. } = simulate_with_history(&settings, 500).expect("the pass ends");
    assert!(history.iter().all(|sample| sample.tip_z_m == 0.0));
    assert!(metrics.laterally_unstable, "{metrics:?}");
}
