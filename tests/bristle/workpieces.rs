//! Is it right, is it physics: workpieces with edges and curved faces.

use bristle::contact::ContactLaw;
use bristle::equations::linear::{add, dot, scale, sub};
use bristle::equations::{ChainDynamics, Dynamics, NodeLoads, PlanarDynamics};
use bristle::model::metrics::Metrics;
use bristle::model::parameters::{Parameter, Violation};
use bristle::model::settings::{
    ChamferSettings, ProfileSettings, RoundSettings, Settings, Side, WorkpieceKind,
    WorkpieceSettings,
};
use bristle::simulation::{FilamentSystem, Pass, Sampling};
use bristle::tool::RotaryTool;
use bristle::workpiece::{ContactArc, Edge, Part, Plane, Surface, Workpiece};
use fastrand::Rng;

use crate::agreement::{STEPS, check_solve};
use crate::common::{self, RandomState, case, metrics, random_pairs, random_state};

/// A case of the paper on a workpiece.
fn on(kind: WorkpieceKind, velocity: f64, depth: f64) -> Settings {
    let mut settings = case(10, velocity, depth);
    settings.workpiece.kind = kind;
    settings
}

/// A case of the paper on an edge with the radius 0.2 mm.
fn edge(velocity: f64, depth: f64, side: Side, offset_m: f64) -> Settings {
    on(common::edge(side, offset_m, 0.2e-3), velocity, depth)
}

/// A chamfer with the width 1 mm, whose edges have the radius 0.2 mm.
fn chamfer() -> ChamferSettings {
    ChamferSettings {
        edge_radius_m: 0.2e-3,
        chamfer_width_m: 1e-3,
        ..ChamferSettings::default()
    }
}

fn profile(degree: usize, control_points_m: Vec<[f64; 2]>) -> WorkpieceKind {
    WorkpieceKind::Profile(ProfileSettings {
        degree,
        control_points_m,
        ..ProfileSettings::default()
    })
}

/// Passes that meet edges inside segments and at the tip, and curved faces.
pub fn passes() -> Vec<Settings> {
    let waves = (-6..=6)
        .map(|i| [f64::from(i) * 0.01, 3e-4 * f64::from(i % 2)])
        .collect();
    let cases = [
        edge(10.0, 1e-3, Side::Leaving, 0.0),
        edge(5.0, 2e-3, Side::Leaving, 4e-3),
        edge(10.0, 1e-3, Side::Entering, -3e-3),
        edge(20.0, 2e-3, Side::Entering, -1e-3),
        on(WorkpieceKind::cylinder(0.05), 10.0, 1e-3),
        on(WorkpieceKind::bore(0.3), 10.0, 1e-3),
        on(WorkpieceKind::cylinder(2e-3), 10.0, 1e-3),
        on(
            WorkpieceKind::Chamfer(ChamferSettings {
                offset_m: 2e-3,
                ..chamfer()
            }),
            8.0,
            1.5e-3,
        ),
        on(profile(3, waves), 10.0, 1e-3),
    ];
    let frictional = cases.clone().into_iter().map(|mut settings| {
        settings.contact.friction_coefficient = 0.3;
        settings
    });
    cases.clone().into_iter().chain(frictional).collect()
}

fn deviation(a: &Metrics, b: &Metrics) -> f64 {
    let pairs = [
        (a.contact_normal_impulse_n_s, b.contact_normal_impulse_n_s),
        (a.contact_impulse_x_n_s, b.contact_impulse_x_n_s),
        (
            a.edge_contact_normal_impulse_n_s,
            b.edge_contact_normal_impulse_n_s,
        ),
        (
            10.0 * a.contact_angular_impulse_n_m_s,
            10.0 * b.contact_angular_impulse_n_m_s,
        ),
    ];
    pairs
        .into_iter()
        .map(|(x, y)| (x - y).abs() / a.contact_normal_impulse_n_s)
        .fold(0.0, f64::max)
}

/// A bent chain in the plane above an edge, which touches the last segment at its share `at`.
fn touching(rng: &mut Rng, segments: usize, at: f64) -> (RandomState, Edge) {
    let mut state = random_state(rng, segments);
    for q in &mut state.q {
        q[0] = std::f64::consts::FRAC_PI_2;
    }
    // The matrix neglects terms with the rates.
    state.v.fill([0.0; 2]);
    state.clamp.velocity = [0.3, -0.2, 0.0];
    state.clamp.direction_rate = [0.0; 3];
    let mut dynamics = Dynamics::new(state.chain.clone());
    dynamics.place(state.clamp.holding(&state.q, &state.v));
    let nodes = dynamics.positions();
    let (inner, outer) = (nodes[segments - 2], nodes[segments - 1]);
    let along = sub(outer, inner);
    let normal = scale(1.0 / dot(along, along).sqrt(), [-along[1], along[0], 0.0]);
    let [x, y, _] = add(add(inner, scale(at, along)), scale(-0.9e-3, normal));
    (state, Edge::arc([x, y], 1e-3, None, [0.1, 0.05, 0.0]))
}

/// A workpiece of one edge.
#[derive(Clone)]
struct Wire(Edge);

impl Workpiece for Wire {
    fn surface(&self, _: [f64; 3], _: f64) -> Surface {
        Surface::flat(f64::INFINITY, [0.0, 1.0, 0.0], [0.0; 3])
    }

    fn edges(&self) -> &[Edge] {
        std::slice::from_ref(&self.0)
    }

    fn is_planar(&self) -> bool {
        true
    }
}

#[test]
fn the_step_matrix_of_an_edge_contact_matches_differences() {
    let law = ContactLaw {
        stiffness: 3e6,
        exponent: 1.5,
        damping: 0.3,
        radius: 1e-4,
        friction: 0.4,
        regularisation: 0.05,
    };
    let mut rng = Rng::with_seed(21);
    for (segments, at) in [(2, 0.3), (5, 0.7), (9, 0.5)] {
        let (state, edge) = touching(&mut rng, segments, at);
        let motion = bristle::tool::FixedClamp {
            direction: [1.0, 0.0, 0.0],
        };
        let mut system = FilamentSystem::new(state.chain.clone(), motion, law, Wire(edge), false);
        system.set_closed(0, segments, true);
        system.set_start(0, segments, segments - 1);
        // It also neglects terms with the accelerations.
        let at_rest = vec![[0.0; 2]; segments];
        let loads = system.loads(0.0);
        assert!(loads.loads_points());
        let mut draw = || random_pairs(&mut rng, segments, 1.0);
        let mut in_space = Dynamics::new(state.chain.clone());
        check_solve(&mut in_space, &state, &at_rest, &loads, &STEPS, &mut draw);
        let mut planar = PlanarDynamics::new(state.chain.clone());
        let in_plane = |blocks: Vec<[f64; 2]>| {
            let azimuths = blocks.into_iter().map(|[_, azimuth]| [0.0, azimuth]);
            azimuths.collect::<Vec<_>>()
        };
        let state = RandomState {
            q: in_plane(state.q),
            ..state
        };
        let direction = || in_plane(draw());
        check_solve(&mut planar, &state, &at_rest, &loads, &STEPS, direction);
    }
}

/// The control points of a circle of a closed cubic spline, whose radius is `radius` (m) where its
/// points are `count`.
fn circle(count: usize, radius: f64) -> Vec<[f64; 2]> {
    // The mean of three neighbours, with the weights 1, 4, 1.
    let control = radius * 6.0 / (4.0 + 2.0 * (std::f64::consts::TAU / count as f64).cos());
    (0..count)
        .map(|i| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / count as f64).sin_cos();
            [control * sin, control * cos - radius]
        })
        .collect()
}

#[test]
fn a_round_profile_is_a_cylinder() {
    // The profile is a face, and an edge that goes all the way round.
    for radius in [0.05, 2e-3] {
        for friction in [0.0, 0.3] {
            let control_points_m = circle(120, radius);
            let closed = ProfileSettings {
                control_points_m,
                closed: true,
                ..ProfileSettings::default()
            };
            let kinds = [
                WorkpieceKind::cylinder(radius),
                WorkpieceKind::Profile(closed),
            ];
            let [cylinder, profile] = kinds.map(|kind| {
                let mut settings = on(kind, 10.0, 1e-3);
                settings.contact.friction_coefficient = friction;
                metrics(&settings)
            });
            assert!(
                deviation(&cylinder, &profile) < 2e-5,
                "{radius} {friction}:\n{cylinder:?}\n{profile:?}"
            );
        }
    }
}

#[test]
fn a_moving_edge_is_a_moved_one_seen_from_another_frame() {
    // The edge approaches the filament by 0.2 mm until they meet.
    let mut settings = edge(10.0, 1e-3, Side::Entering, -3e-3);
    let fixed = metrics(&settings);
    settings.workpiece.feed_velocity_m_s = 1e-3;
    let slow = metrics(&settings);
    assert!(deviation(&fixed, &slow) < 0.01 && deviation(&fixed, &slow) > 1e-6);
}

#[test]
fn nominal_contact_is_that_of_the_undeformed_filament() {
    // An edge below the axis: the filament touches during the first half of the pass over the
    // plane, or during the second.
    let plane = Pass::new(&case(10, 10.0, 1e-3)).nominal().contact_angle;
    for side in [Side::Leaving, Side::Entering] {
        let mut settings = edge(10.0, 1e-3, side, 0.0);
        settings.workpiece.kind.set_edge_radius_m(1e-6);
        let pass = Pass::new(&settings);
        assert!(
            (pass.nominal().contact_angle / plane - 0.5).abs() < 1e-4,
            "{side:?}"
        );
        assert!((pass.nominal().window.angle - plane).abs() < 1e-12);
    }
    // Two circles: that of the tips and the cylinder.
    let cylinder = |offset_m| {
        on(
            WorkpieceKind::Cylinder(RoundSettings {
                offset_m,
                radius_m: 0.05,
            }),
            10.0,
            1e-3,
        )
    };
    let (tips, radius, distance) = (0.18_f64, 0.05_f64, 0.18 - 1e-3 + 0.05_f64);
    let half =
        ((tips * tips + distance * distance - radius * radius) / (2.0 * tips * distance)).acos();
    let found = Pass::new(&cylinder(0.0)).nominal().contact_angle;
    assert!((found / (2.0 * half) - 1.0).abs() < 1e-9, "{found} {half}");
    // This one is out of reach.
    let missed = metrics(&cylinder(0.2));
    assert_eq!(
        (
            missed.nominal_contact_time_s,
            missed.contact_time_ratio,
            missed.contact_count
        ),
        (0.0, 0.0, 0)
    );
}

#[test]
fn numbers_that_do_not_fit_together_are_refused() {
    let refused = |kind| {
        on(kind, 10.0, 1e-3)
            .check()
            .expect_err("it does not fit")
            .path
    };
    assert_eq!(refused(WorkpieceKind::edge(0.0)), "workpiece.edge_radius_m");
    assert_eq!(refused(WorkpieceKind::cylinder(0.0)), "workpiece.radius_m");
    assert_eq!(
        refused(profile(3, Vec::new())),
        "workpiece.control_points_m"
    );
    for radius in [0.1, 0.1404, 0.15] {
        assert_eq!(
            refused(WorkpieceKind::bore(radius)),
            "workpiece.radius_m",
            "{radius}"
        );
    }
    let chamfered = |chamfer_width_m, chamfer_angle_rad| {
        WorkpieceKind::Chamfer(ChamferSettings {
            chamfer_width_m,
            chamfer_angle_rad,
            ..chamfer()
        })
    };
    assert_eq!(refused(chamfered(1e-4, 0.7)), "workpiece.edge_radius_m");
    assert_eq!(refused(chamfered(1e-3, 1.6)), "workpiece.chamfer_angle_rad");
    for points in [
        vec![[0.0, 0.0]],
        vec![[0.1, 0.0], [-0.1, 0.0]],
        vec![[-0.1, -0.1], [0.0, 0.0], [0.1, -0.1]],
        vec![[-0.1, 0.0], [0.1, 0.0], [0.0, 0.1], [0.0, -0.1]],
        vec![[f64::NAN, 0.0], [0.1, 0.0]],
    ] {
        assert_eq!(refused(profile(1, points)), "workpiece.control_points_m");
    }
}

#[test]
fn what_a_kind_does_not_have_is_refused() {
    let (plane, path) = (case(10, 10.0, 1e-3), "workpiece.radius_m");
    let parameter = Parameter::find(path).expect("a parameter");
    assert_eq!(parameter.read(&plane), None);
    let allowed = "left out: a workpiece of kind `plane` has none".to_owned();
    assert_eq!(
        parameter.check_presence(&plane, 0.1),
        Err(Violation {
            path,
            value: "0.1".to_owned(),
            allowed
        })
    );
    // A vector is no parameter.
    let edge =
        serde_json::json!({ "kind": "edge", "edge_radius_m": 0.2e-3, "normal": [0.1, 1.0, 0.0] });
    let error =
        serde_json::from_value::<WorkpieceSettings>(edge).expect_err("an edge has no normal");
    assert!(
        error.to_string().starts_with("unknown field `normal`"),
        "{error}"
    );
}

#[test]
fn parts_have_the_edges_of_their_kind() {
    let count = |settings: &Settings| {
        Part::of(settings)
            .expect("the settings fit")
            .0
            .edges()
            .len()
    };
    assert_eq!(count(&case(10, 10.0, 1e-3)), 0);
    let mut settings = edge(10.0, 1e-3, Side::Leaving, 0.0);
    assert_eq!(count(&settings), 1);
    // More than five segments of 4 mm.
    settings.workpiece.kind.set_edge_radius_m(21e-3);
    assert_eq!(count(&settings), 0);
    assert_eq!(count(&on(WorkpieceKind::Chamfer(chamfer()), 10.0, 1e-3)), 2);
}

/// A plane whose normal is twice as long as a unit vector.
#[derive(Clone, Debug)]
struct LongNormal(Plane);

impl Workpiece for LongNormal {
    fn surface(&self, position: [f64; 3], time: f64) -> Surface {
        let surface = self.0.surface(position, time);
        Surface {
            normal: scale(2.0, surface.normal),
            ..surface
        }
    }

    fn contact_arc(&self, tip: &dyn Fn(f64) -> [f64; 3]) -> Option<ContactArc> {
        self.0.contact_arc(tip)
    }
}

#[test]
fn a_normal_that_is_no_unit_vector_is_refused() {
    let settings = case(6, 10.0, 1e-3);
    let plane = Plane::of(&settings.workpiece, settings.tool_radius_m() - 1e-3);
    let tool = RotaryTool::of(&settings);
    let pass = common::pass_with(&settings, tool, LongNormal(plane)).expect("the tips touch");
    let error = pass
        .simulate(Sampling::default())
        .expect_err("at the first touch");
    assert!(error.to_string().contains("length 2.000000"), "{error}");
}

/// Wherever a bend with a radius of some 50 µm lies on a long profile, it is an edge.
#[test]
fn a_tight_bend_of_a_long_profile_is_an_edge() {
    for shift in 0..20 {
        let x = 7.3e-6 * f64::from(shift);
        let near = 1.5e-4 / 2.0_f64.sqrt();
        let control_points_m = vec![
            [-0.2, 0.0],
            [x - 1.5e-4, 0.0],
            [x, 0.0],
            [x + near, -near],
            [x + 0.14, -0.14],
        ];
        let mut settings = on(profile(2, control_points_m), 10.0, 1e-3);
        settings.filament.segments = 6;
        let edges = Pass::new(&settings).workpiece().edges().len();
        assert_eq!(edges, 1, "the bend at {x}");
    }
}

/// Cells are a share of the filament, not of the paper's.
#[test]
fn short_filaments_have_short_cells() {
    let mut settings = case(6, 10.0, 1e-3);
    settings.filament.length_m = 0.01;
    let cells = Pass::new(&settings).profile().expect("a profile").cells;
    let longest = cells
        .iter()
        .map(|cell| cell.arc_length[1] - cell.arc_length[0])
        .fold(0.0, f64::max);
    assert!(longest < 0.01 / 159.0, "{longest}");
}
