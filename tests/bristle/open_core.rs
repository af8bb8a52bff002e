//! Is the core open? A tool and a workpiece from outside the crate get the same results as the
//! built-in ones, to the bit.

use crate::common::{AnyTool, AnyWorkpiece, case, pass_with, side_by_side};
use bristle::equations::{Clamp, PolarAxis};
use bristle::model::metrics::Metrics;
use bristle::model::record::Record;
use bristle::model::settings::{Settings, WorkpieceKind};
use bristle::simulation::{NoContactArc, Pass, Sampling, Simulation, simulate_with};
use bristle::tool::{RotaryTool, Tool, radial_clamp};
use bristle::workpiece::{ContactArc, Plane, Surface, Workpiece};

const SAMPLING: Sampling = Sampling {
    samples: 20,
    shapes: 5,
    loads: true,
    profile: false,
    alongside: false,
};

/// The plane of MODEL, implemented again.
#[derive(Clone, Debug)]
struct FlatTable {
    height: f64,
    arc: Option<ContactArc>,
}

impl FlatTable {
    fn new(settings: &Settings) -> Self {
        let (radius, depth) = (
            Wheel.radius(settings.filament.length_m),
            settings.process.penetration_depth_m,
        );
        let arc = ContactArc::on_plane([0.0, 1.0, 0.0], radius, depth);
        Self {
            height: -(radius - depth),
            arc: Some(arc),
        }
    }
}

impl Workpiece for FlatTable {
    fn surface(&self, [_, y, _]: [f64; 3], _: f64) -> Surface {
        Surface::flat(y - self.height, [0.0, 1.0, 0.0], [0.0; 3])
    }

    fn contact_arc(&self, tip: &dyn Fn(f64) -> [f64; 3]) -> Option<ContactArc> {
        self.arc
            .or_else(|| ContactArc::find(|angle| self.surface(tip(angle), 0.0).gap))
    }

    fn is_planar(&self) -> bool {
        true
    }
}

/// The round tool, implemented again.
#[derive(Clone, Debug)]
struct Wheel;

impl Tool for Wheel {
    fn clamp(&self, angle: f64, rate: f64) -> Clamp<f64> {
        radial_clamp(0.140, angle, rate, 0.0)
    }

    fn radius(&self, filament_length: f64) -> f64 {
        0.140 + filament_length
    }

    fn is_planar(&self) -> bool {
        true
    }

    fn undeformed(&self, angle: f64, rate: f64) -> [[f64; 2]; 2] {
        [[std::f64::consts::FRAC_PI_2, angle], [0.0, rate]]
    }
}

fn cases() -> Vec<Settings> {
    let mut cases: Vec<Settings> = [30.0, 7.5, 20.0, 12.5, 25.0]
        .into_iter()
        .flat_map(|velocity| [5e-3, 0.5e-3].map(|depth| case(7, velocity, depth)))
        .collect();
    for settings in &mut cases {
        settings.solver.relative_tolerance = 1e-5;
    }
    // This filament leaves the plane and the charts of its lane, and continues alone.
    cases[4].process.gravity_m_s2 = [0.0, 0.0, 3e5];
    cases
}

fn outside(settings: &Settings) -> Pass<AnyTool, AnyWorkpiece> {
    pass_with(settings, Wheel, FlatTable::new(settings)).expect("the tips touch the table")
}

#[test]
fn outside_tools_and_workpieces_have_the_bits_of_the_built_in_ones() {
    let cases = cases();
    let built_in: Vec<Simulation> = cases
        .iter()
        .map(|settings| simulate_with(settings, SAMPLING).expect("the pass ends"))
        .collect();
    for (settings, expected) in cases.iter().zip(&built_in) {
        let simulation = outside(settings).simulate(SAMPLING).expect("the pass ends");
        assert!(
            simulation == *expected,
            "{:?} {:?}",
            simulation.metrics,
            expected.metrics
        );
    }
    for (result, expected) in side_by_side(SAMPLING, cases.iter().map(outside))
        .into_iter()
        .zip(&built_in)
    {
        let simulation = result.expect("the pass ends");
        assert!(
            simulation == *expected,
            "{:?} {:?}",
            simulation.metrics,
            expected.metrics
        );
    }
}

#[test]
fn a_pass_of_its_own_plane_is_that_of_the_settings() {
    let mut settings = case(5, 20.0, 2e-3);
    settings.workpiece.kind = WorkpieceKind::plane([1.0, 3.0, -0.5]);
    let tool = RotaryTool::of(&settings);
    let plane = Plane::of(&settings.workpiece, settings.reach_m() - 2e-3);
    let pass = pass_with(&settings, tool, plane).expect("the tips touch the plane");
    let [found, stated] = [pass.simulate(SAMPLING), simulate_with(&settings, SAMPLING)]
        .map(|result| result.expect("the pass ends"));
    // A plane does not know the tool: its arc is found to 1e-11 rad, while that of the settings is
    // computed.
    assert_eq!(found.statistics, stated.statistics);
    let (found, stated) = (found.metrics, stated.metrics);
    for column in Metrics::COLUMNS {
        let [found, stated] = [&found, &stated].map(|metrics| column.get(metrics));
        // The residual is that of rounding.
        let slack = if column.key == "energy_residual" {
            1e-8
        } else {
            1e-9 * stated.abs()
        };
        assert!(
            (found - stated).abs() <= slack,
            "{}: {found} {stated}",
            column.key
        );
    }
}

#[test]
fn an_arc_that_is_not_stated_is_found() {
    let settings = case(5, 20.0, 2e-3);
    let found = FlatTable {
        arc: None,
        ..FlatTable::new(&settings)
    };
    let found = pass_with(&settings, Wheel, found).expect("the tips touch the table");
    let stated = outside(&settings);
    let times = |pass: &Pass<AnyTool, AnyWorkpiece>| {
        [&pass.nominal_times()[..], &[pass.end_time()]].concat()
    };
    for (found, stated) in times(&found).into_iter().zip(times(&stated)) {
        assert!((found / stated - 1.0).abs() < 1e-9, "{found} {stated}");
    }
    let [found, stated] =
        [&found, &stated].map(|pass| pass.simulate(SAMPLING).expect("the pass ends").metrics);
    let (found, stated) = (
        found.contact_normal_impulse_n_s,
        stated.contact_normal_impulse_n_s,
    );
    assert!((found / stated - 1.0).abs() < 1e-5, "{found} {stated}");
}

#[test]
fn a_workpiece_out_of_reach_is_refused() {
    let settings = case(5, 20.0, 2e-3);
    for height in [-0.2, 0.2] {
        let table = FlatTable { height, arc: None };
        assert_eq!(
            pass_with(&settings, Wheel, table).err(),
            Some(NoContactArc),
            "{height}"
        );
    }
}

/// Axial filaments on a disc, as in a cup brush.
#[derive(Clone, Debug)]
struct CupDisc;

impl Tool for CupDisc {
    fn clamp(&self, angle: f64, rate: f64) -> Clamp<f64> {
        Clamp {
            direction: [0.0, 0.0, -1.0],
            direction_rate: [0.0; 3],
            ..radial_clamp(0.05, angle, rate, 0.0)
        }
    }

    fn radius(&self, _: f64) -> f64 {
        0.05
    }
}

/// A slope below the disc that falls along `y` and is at `z = top` under the axis.
#[derive(Clone, Debug)]
struct Slope {
    top: f64,
}

impl Workpiece for Slope {
    fn surface(&self, [_, y, z]: [f64; 3], _: f64) -> Surface {
        let normal = [0.0, 0.1_f64.sin(), 0.1_f64.cos()];
        Surface::flat(normal[1] * y + normal[2] * (z - self.top), normal, [0.0; 3])
    }
}

#[test]
fn filaments_along_the_axis_start_in_the_chart_about_x() {
    let mut settings = case(4, 5.0, 1e-3);
    settings.solver.relative_tolerance = 1e-4;
    // Filaments of 40 mm that touch the slope while the disc passes its upper side.
    let pass =
        pass_with(&settings, CupDisc, Slope { top: -0.0435 }).expect("the tips touch the ramp");
    let mut system = pass.system(false);
    let start = pass.start(&mut system);
    assert_eq!(start.chart, PolarAxis::X);
    let metrics = pass.simulate(SAMPLING).expect("the pass ends").metrics;
    assert!(
        metrics.contact_normal_impulse_n_s > 0.0 && metrics.contact_count > 0,
        "{metrics:?}"
    );
    assert!((metrics.nominal_contact_length_m - 0.05 * metrics.contact_angle_rad).abs() < 1e-15);
}
