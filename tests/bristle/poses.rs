//! Rotary tools of any kind and pose.

use std::f64::consts::FRAC_PI_2;

use crate::common::{case, edge, metric, metrics};
use bristle::model::metrics::Metrics;
use bristle::model::settings::{ProfileSettings, Settings, Side, ToolKind, Turns, WorkpieceKind};
use bristle::simulation::simulate;
use bristle::tool::Pose;

fn posed(segments: usize, [tilt, skew]: [f64; 2]) -> Settings {
    let mut settings = case(segments, 10.0, 1e-3);
    (
        settings.tool.tilt_rad,
        settings.tool.skew_rad,
        settings.tool.positions,
    ) = (Some(tilt), skew, Some(1));
    settings
}

pub fn cup(segments: usize) -> Settings {
    let mut settings = case(segments, 10.0, 1e-3);
    (settings.tool.kind, settings.tool.positions) = (ToolKind::Cup, Some(1));
    settings
}

fn near(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance * expected.abs().max(1e-12),
        "{found}, not {expected}"
    );
}

/// A tool and the normal of its workpiece, turned together, have the same contact.
#[test]
fn a_pose_and_its_workpiece_may_be_turned_together() {
    let mut cases = vec![
        posed(5, [0.3, 0.2]),
        posed(5, [0.1, 0.0]),
        cup(5),
        cup(5),
        cup(5),
    ];
    cases[3].tool.tilt_rad = Some(FRAC_PI_2 - 0.12);
    (cases[4].tool.kind, cases[4].tool.filament_angle_rad) = (ToolKind::Cone, Some(0.9));
    for mut settings in cases {
        settings.contact.friction_coefficient = 0.2;
        let here = metrics(&settings);
        let pose = Pose::of(&settings.tool);
        for [tilt, skew] in [[0.0, 0.0], [0.7, -0.4]] {
            let mut turned = settings.clone();
            (turned.tool.tilt_rad, turned.tool.skew_rad) = (Some(tilt), skew);
            let other = Pose::of(&turned.tool);
            turned.workpiece.kind =
                WorkpieceKind::plane(other.from_tool(pose.to_tool([0.0, 1.0, 0.0])));
            let there = metrics(&turned);
            near(
                there.contact_normal_impulse_n_s,
                here.contact_normal_impulse_n_s,
                1e-6,
            );
            near(
                there.contact_angular_impulse_n_m_s,
                here.contact_angular_impulse_n_m_s,
                1e-6,
            );
            near(
                there.nominal_contact_time_s,
                here.nominal_contact_time_s,
                1e-9,
            );
            let impulse = |metrics: &Metrics, pose: &Pose| {
                let keys = [
                    "contact_impulse_x_n_s",
                    "contact_impulse_y_n_s",
                    "contact_impulse_z_n_s",
                ];
                pose.to_tool(keys.map(|key| metric(metrics, key)))
            };
            for (there, here) in impulse(&there, &other)[2..]
                .iter()
                .zip(&impulse(&here, &pose)[2..])
            {
                assert!(
                    (there - here).abs() < 1e-6 * here.abs() + 1e-12,
                    "{there} {here}"
                );
            }
        }
    }
}

/// A tilt close to zero uses the frame of a tilted tool, and gives the results of an upright one on
/// any workpiece.
#[test]
fn a_tilt_that_is_too_small_to_matter_changes_nothing() {
    let control_points_m = [-0.2, -0.05, -0.02, 0.0, 0.02, 0.05, 0.2]
        .map(|x: f64| [x, if x.abs() < 0.01 { 1e-3 } else { 0.0 }])
        .to_vec();
    let bump = ProfileSettings {
        control_points_m,
        ..ProfileSettings::default()
    };
    let edge = edge(Side::Entering, -5e-3, 0.5e-3);
    for (kind, feed) in [
        (edge, 0.0),
        (WorkpieceKind::cylinder(0.05), 0.5),
        (WorkpieceKind::Profile(bump), 0.0),
    ] {
        let mut settings = case(8, 10.0, 2e-3);
        (
            settings.workpiece.kind,
            settings.workpiece.feed_velocity_m_s,
        ) = (kind, feed);
        settings.contact.friction_coefficient = 0.2;
        settings.tool.positions = Some(1);
        let upright = metrics(&settings);
        settings.tool.skew_rad = 1e-13;
        let posed = metrics(&settings);
        near(
            posed.contact_normal_impulse_n_s,
            upright.contact_normal_impulse_n_s,
            1e-5,
        );
        near(
            posed.edge_contact_normal_impulse_n_s,
            upright.edge_contact_normal_impulse_n_s,
            1e-5,
        );
        near(
            posed.nominal_contact_time_s,
            upright.nominal_contact_time_s,
            1e-6,
        );
        near(posed.friction_work_j, upright.friction_work_j, 1e-5);
    }
}

/// A cup that is pressed flat touches all round; the filament neither strikes nor leaves.
#[test]
fn a_flat_cup_touches_all_round() {
    let mut settings = cup(8);
    settings.process.brushing_velocity_m_s = 5.0;
    let result = simulate(&settings).expect("it turns");
    let found = &result.metrics;
    assert!(found.contact_time_ratio > 0.999_999, "{found:?}");
    near(
        found.nominal_contact_time_s,
        std::f64::consts::TAU / settings.angular_velocity_rad_s(),
        1e-12,
    );
    assert!(
        found.turns >= 2
            && !found.unsteady_turns
            && found.turns == result.turn_contact_normal_impulses_n_s.len()
    );
    assert!(
        found.equilibrium_residual < 1e-5 && found.energy_residual < 1e-4,
        "{found:?}"
    );
    // The force of the cup is the mean of all filaments.
    let force = found.contact_normal_impulse_n_s / found.nominal_contact_time_s;
    near(
        found.tool_contact_normal_force_n,
        force * settings.tool.filament_count,
        1e-12,
    );
    // A stated number of turns counts.
    settings.process.turns = Some(Turns::Count(2));
    assert_eq!(metrics(&settings).turns, 2);
    // A faster cup lifts off.
    settings.process.brushing_velocity_m_s = 30.0;
    settings.process.penetration_depth_m = 0.2e-3;
    assert_eq!(metrics(&settings).contact_normal_impulse_n_s, 0.0);
}
