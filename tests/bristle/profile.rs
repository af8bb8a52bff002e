//! Distribution of the work of a pass along the profile of the workpiece.

use bristle::model::settings::{
    ChamferSettings, ProfileSettings, Settings, Side, Turns, WorkpieceKind,
};
use bristle::simulation::{Pass, ProfileCell, Sampling, Simulation};
use bristle::workpiece::Workpiece;

use crate::common;

const PROFILE: Sampling = Sampling {
    samples: 0,
    shapes: 0,
    loads: false,
    profile: true,
    alongside: false,
};

fn settings(kind: WorkpieceKind, friction: f64) -> Settings {
    let mut settings = Settings::paper(10.0, 1e-3);
    settings.filament.segments = 10;
    settings.solver.relative_tolerance = 1e-5;
    settings.contact.friction_coefficient = friction;
    settings.workpiece.kind = kind;
    settings
}

fn edge(side: Side, offset_m: f64) -> WorkpieceKind {
    common::edge(side, offset_m, 0.5e-3)
}

pub fn all() -> impl Iterator<Item = Settings> {
    let chamfer = ChamferSettings {
        edge_radius_m: 0.2e-3,
        chamfer_width_m: 1e-3,
        ..ChamferSettings::default()
    };
    // A corner, rounded by a spline.
    let control_points_m = vec![
        [-0.06, 0.0],
        [-0.003, 0.0],
        [0.0, 0.0],
        [0.0, -0.003],
        [0.0, -0.06],
    ];
    let kinds = [
        WorkpieceKind::default(),
        edge(Side::Leaving, 0.0),
        WorkpieceKind::Chamfer(chamfer),
        WorkpieceKind::cylinder(0.1),
        WorkpieceKind::bore(0.4),
        WorkpieceKind::Profile(ProfileSettings {
            degree: 2,
            control_points_m,
            ..ProfileSettings::default()
        }),
    ];
    let mut all: Vec<Settings> = kinds
        .iter()
        .flat_map(|kind| [0.0, 0.3].map(|friction| settings(kind.clone(), friction)))
        .collect();
    let entering = settings(edge(Side::Entering, -0.01), 0.3);
    let mut moving = settings(edge(Side::Leaving, 0.005), 0.3);
    moving.workpiece.feed_velocity_m_s = 0.3;
    // The edge is so thin that it is a whole circle, which the filament sweeps over.
    let wire = settings(WorkpieceKind::cylinder(0.002), 0.3);
    // The work is that of the last turn.
    let mut turning = settings(edge(Side::Leaving, 0.0), 0.3);
    (turning.process.turns, turning.process.brushing_velocity_m_s) = (Some(Turns::Count(2)), 20.0);
    all.extend([entering, moving, wire, turning]);
    all.into_iter()
}

fn simulate(settings: &Settings, sampling: Sampling) -> Simulation {
    Pass::new(settings)
        .simulate(sampling)
        .expect("the pass ends")
}

fn sum(profile: &[ProfileCell], value: impl Fn(&ProfileCell) -> f64) -> f64 {
    profile.iter().map(|cell| cell.length_m * value(cell)).sum()
}

#[test]
fn sums_over_the_profile_are_the_metrics() {
    for settings in all() {
        for sampling in [
            PROFILE,
            Sampling {
                samples: 37,
                shapes: 3,
                ..PROFILE
            },
        ] {
            let Simulation {
                metrics, profile, ..
            } = simulate(&settings, sampling);
            let near = |found: f64, expected: f64| (found - expected).abs() <= 1e-12 * expected;
            let (impulse, work) = (
                sum(&profile, |c| c.normal_impulse_n_s_m),
                sum(&profile, |c| c.friction_work_j_m),
            );
            assert!(
                metrics.contact_normal_impulse_n_s > 0.0,
                "{:?}",
                settings.workpiece
            );
            assert!(
                near(impulse, metrics.contact_normal_impulse_n_s),
                "{impulse} {metrics:?}"
            );
            assert!(near(work, metrics.friction_work_j), "{work} {metrics:?}");
            assert!(
                profile
                    .iter()
                    .all(|cell| cell.normal_impulse_n_s_m >= 0.0 && cell.friction_work_j_m >= 0.0)
            );
            let on_edges = sum(&profile, |cell| {
                if cell.on_edge {
                    cell.normal_impulse_n_s_m
                } else {
                    0.0
                }
            });
            // A contact that leaves an edge or enters it within a step is spread over both.
            assert!(
                (on_edges - metrics.edge_contact_normal_impulse_n_s).abs() <= 0.02 * impulse,
                "{on_edges} {metrics:?}"
            );
        }
    }
}

/// The moment of a normal force follows from its place.
#[test]
fn the_work_is_where_its_moment_says() {
    for settings in all().filter(|settings| settings.contact.friction_coefficient == 0.0) {
        let Simulation {
            metrics, profile, ..
        } = simulate(&settings, PROFILE);
        let pass = Pass::new(&settings);
        let moment = |cell: &ProfileCell| {
            let position = [cell.x_m, cell.y_m, 0.0];
            let edge = pass
                .workpiece()
                .edges()
                .iter()
                .map(|edge| edge.surface(position, 0.0));
            let seen = edge
                .filter(|surface| surface.margin > 0.0)
                .find(|_| cell.on_edge);
            let [x, y, _] = seen
                .unwrap_or_else(|| pass.workpiece().surface(position, 0.0))
                .normal;
            (cell.x_m * y - cell.y_m * x) * cell.normal_impulse_n_s_m
        };
        // The scale is the length of the contact.
        let scale = 0.02 * metrics.contact_normal_impulse_n_s;
        let found = sum(&profile, moment);
        assert!(
            (found - metrics.contact_angular_impulse_n_m_s).abs() < 2e-3 * scale,
            "{found} {metrics:?}"
        );
    }
}

/// The filament leaves its marks on the workpiece, which moves away below it.
#[test]
fn a_moving_workpiece_has_the_work_in_its_own_coordinates() {
    let mut settings = settings(WorkpieceKind::default(), 0.0);
    settings.workpiece.feed_velocity_m_s = 0.4;
    let Simulation {
        metrics,
        profile,
        history,
        ..
    } = simulate(
        &settings,
        Sampling {
            samples: 4001,
            ..PROFILE
        },
    );
    let mean: f64 = sum(&profile, |cell| {
        cell.arc_length_m * cell.normal_impulse_n_s_m
    });
    let later: f64 = history
        .windows(2)
        .map(|pair| {
            let rise = pair[1].contact_normal_impulse_n_s - pair[0].contact_normal_impulse_n_s;
            rise * (pair[0].time_s + pair[1].time_s) / 2.0
        })
        .sum();
    // ∫ F_n (x − v_ft t) dt
    let expected = metrics.contact_angular_impulse_n_m_s - 0.4 * later;
    // The impulse of an impact is mostly in a part of a cell; the feed shifts the mean by much
    // more.
    let tolerance = 0.1 * 0.25e-3 * metrics.contact_normal_impulse_n_s;
    assert!(
        (mean - expected).abs() < tolerance && 0.4 * later > 10.0 * tolerance,
        "{mean} {expected} {later}"
    );
}

/// Arc lengths belong to points, cells follow each other, and edges have enough of them.
#[test]
fn cells_are_an_outline_by_arc_length() {
    for settings in all() {
        let pass = Pass::new(&settings);
        let workpiece = pass.workpiece();
        let profile = pass.outline(0.181).expect("a profile");
        assert!(profile.cells.len() > 24);
        for pair in profile.cells.windows(2) {
            assert!((pair[0].arc_length[1] - pair[1].arc_length[0]).abs() < 1e-15);
            let [end, start] = [pair[0].ends[1], pair[1].ends[0]];
            assert!((end[0] - start[0]).hypot(end[1] - start[1]) < 1e-12);
        }
        for cell in &profile.cells {
            let [start, end] = cell.ends;
            let length = cell.arc_length[1] - cell.arc_length[0];
            let chord = (end[0] - start[0]).hypot(end[1] - start[1]);
            assert!(
                length <= 0.2501e-3 && chord <= length * (1.0 + 1e-9) && chord > 0.99 * length,
                "{cell:?}"
            );
            // The points are a little inside and outside of the moved workpiece.
            let [x, y] = [(start[0] + end[0]) / 2.0, (start[1] + end[1]) / 2.0];
            let [u, v] = [(end[0] - start[0]) / length, (end[1] - start[1]) / length];
            for away in [-1e-5, 1e-5] {
                let shift = 0.01 * settings.workpiece.feed_velocity_m_s;
                let found = workpiece
                    .arc_length([x - away * v + shift, y + away * u, 0.0], 0.01)
                    .expect("a place");
                let middle = (cell.arc_length[0] + cell.arc_length[1]) / 2.0;
                assert!(
                    (found - middle).abs() < 1e-3 * length,
                    "{found} {middle} {cell:?}"
                );
            }
        }
        let on_edges = profile.cells.iter().filter(|cell| cell.on_edge).count();
        assert!(on_edges >= 24 * workpiece.edges().len());
    }
}

#[test]
fn an_edge_has_a_share_of_the_impulse_and_an_evenness() {
    for settings in all() {
        let metrics = simulate(&settings, Sampling::default()).metrics;
        let share = metrics.edge_contact_normal_impulse_n_s / metrics.contact_normal_impulse_n_s;
        assert_eq!(metrics.edge_share, share.clamp(0.0, 1.0));
        assert_eq!(
            metrics.edge_evenness > 0.0,
            metrics.edge_share > 0.0,
            "{metrics:?}"
        );
        assert!(metrics.edge_evenness <= 1.0);
    }
    // The filament meets nothing.
    let never = settings(edge(Side::Leaving, -0.1), 0.3);
    let Simulation {
        metrics, profile, ..
    } = simulate(&never, PROFILE);
    assert_eq!(
        (
            metrics.edge_share,
            metrics.edge_evenness,
            metrics.contact_normal_impulse_n_s
        ),
        (0.0, 0.0, 0.0)
    );
    assert!(profile.iter().all(|cell| cell.normal_impulse_n_s_m == 0.0));
}
