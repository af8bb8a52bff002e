//! Friction and edges as users see them: what documents say of friction, the scatter of its
//! coefficient, and warnings.

use bristle::model::settings::Settings;
use bristle::simulation::simulate;
use bristle_grid::{CaseSummary, run_study};

use crate::program::{Workspace, brush, sparse, study, words};

const HEAD: &str = concat!(
    brush!(8, "filament_count_uncertainty = 600\n"),
    "
[solver]
relative_tolerance = 1e-4

[process]
brushing_velocity_m_s = 10.0
penetration_depth_m = 1.0e-3
"
);

#[test]
fn documents_and_advice_say_what_friction_does() {
    let force = |friction: f64| {
        let mut settings = Settings::paper(10.0, 1e-3);
        settings.contact.friction_coefficient = friction;
        simulate(&settings)
            .expect("a pass")
            .metrics
            .tool_contact_normal_force_n
    };
    let [none, little, usual, much] =
        [0.0, 0.1, 0.3, 0.5].map(|friction| format!("{:.0}", force(friction)));
    let told = format!("{none}, {little}, {usual} and {much} N");
    for page in [
        include_str!("../../../../README.md"),
        include_str!("../../../../docs/input.md"),
    ] {
        assert!(page.contains(&told), "{told}");
    }
    let directory = Workspace::with(&format!(
        "{HEAD}[study]\nbrushing_velocity_m_s = [5.0, 10.0]\n"
    ));
    directory.run("study case.toml --out results");
    let text = directory.printed("advise results");
    assert!(words(&text).contains(&told), "{text}");
}

/// Much of the scatter of the force comes from friction that is known to a third.
#[test]
fn friction_scatters() {
    let text = format!(
        "{HEAD}[contact]\nfriction_coefficient = 0.3\n[uncertainty]\nfriction_coefficient_std = 0.1\ndiameter_std_m = 1e-5\n\
         samples = 64\n[study]\nbrushing_velocity_m_s = [5.0]\n"
    );
    let results = run_study(&study(&text), None, || {}).expect("threads");
    let CaseSummary {
        metrics, scatter, ..
    } = results[0].as_ref().expect("a pass");
    let scatter = scatter.as_ref().expect("friction scatters");
    assert!(scatter.sobol_friction_coefficient > 0.5, "{scatter:?}");
    let force = metrics.tool_contact_normal_force_n;
    assert!(
        scatter.tool_force_lower_95_n < force && force < scatter.tool_force_upper_95_n,
        "{scatter:?}"
    );
    // It slides all the time, but for moments: the tangential force is µ times the normal force,
    // and its work is done in sliding.
    assert!(
        (metrics.tool_tangential_force_n / (0.3 * force) - 1.0).abs() < 0.2,
        "{metrics:?}"
    );
    let positive = [
        metrics.friction_work_j,
        metrics.tool_torque_n_m,
        metrics.tool_power_w,
    ];
    assert!(positive.iter().all(|value| *value > 0.0), "{metrics:?}");
}

#[test]
fn deep_edges_and_missed_workpieces_have_warnings() {
    let warnings = |command: &str, workpiece: &str| {
        let text = format!(
            "{HEAD}[workpiece]\nkind = \"edge\"\n{workpiece}\n[study]\nbrushing_velocity_m_s = [5.0, 10.0]\n"
        );
        let text =
            Workspace::with(&sparse(&text)).said(&format!("{command} case.toml --out {command}"));
        let start = text.find("warning: ").unwrap_or(text.len());
        assert!(
            text[start..].lines().all(|line| line.chars().count() <= 80),
            "{text}"
        );
        text[start..].to_owned()
    };
    let met = "side = \"entering\"\noffset_m = 5e-3\n";
    for command in ["simulate", "study"] {
        let soft = warnings(
            command,
            &format!("{met}edge_radius_m = 0.05e-3\n[contact]\nstiffness_n_m = 1e3"),
        );
        assert!(soft.contains("penetrates an edge by"), "{command}: {soft}");
        assert_eq!(
            warnings(command, &format!("{met}edge_radius_m = 0.5e-3")),
            "",
            "{command}"
        );
        let missed = warnings(command, "edge_radius_m = 0.5e-3\noffset_m = -0.1");
        let missed = missed.replace("\n         ", " ");
        assert!(
            missed.contains("never touch the workpiece"),
            "{command}: {missed}"
        );
    }
}
