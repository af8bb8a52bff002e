//! Is it physics? A pass that is planar by symmetry stays planar. `tests/agreement` compares planar
//! and spatial passes, turned and mirrored ones.

use bristle::model::settings::{Settings, WorkpieceKind};
use bristle::simulation::{Form, Pass, Simulation, simulate_with_history};

#[test]
fn a_pass_is_planar_where_tool_workpiece_and_gravity_are() {
    let form = |change: fn(&mut Settings)| {
        let mut settings = Settings::paper(10.0, 1e-3);
        change(&mut settings);
        Pass::new(&settings).form()
    };
    let planar: [fn(&mut Settings); 4] = [
        |_| (),
        |settings| settings.workpiece.kind = WorkpieceKind::plane([-3.0, 0.4, 0.0]),
        |settings| settings.process.gravity_m_s2 = [1.0, -9.81, 0.0],
        |settings| settings.contact.friction_coefficient = 0.3,
    ];
    assert_eq!(planar.map(form), [Form::Planar; 4]);
    let spatial: [fn(&mut Settings); 3] = [
        |settings| settings.workpiece.kind = WorkpieceKind::plane([0.0, 1.0, 1e-12]),
        |settings| settings.process.gravity_m_s2[2] = 1e-9,
        |settings| settings.filament.lateral_tilt_rad = 1e-9,
    ];
    assert_eq!(spatial.map(form), [Form::Spatial; 3]);
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
