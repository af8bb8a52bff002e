//! Is every contact resolved? Passes whose contacts are short, thick, or off the path of the
//! undeformed filament.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::common::{case, pass_with};
use bristle::equations::linear::{add, dot, scale};
use bristle::model::settings::{ChamferSettings, ProfileSettings, Settings, Side, WorkpieceKind};
use bristle::simulation::{
    IntegrationError, Pass, Sampling, SimulationError, simulate, simulate_with,
};
use bristle::tool::{RotaryTool, Tool};
use bristle::workpiece::{ContactArc, Plane, Surface, Workpiece};

/// A filament whose tip crosses the face of a chamfer within 87 µs, an eighth of a step, before it
/// meets the edge behind.
fn short_face(tolerance: f64) -> Settings {
    let mut settings = Settings::paper(21.19, 2.428e-3);
    settings.tool.body_radius_m = 0.19309;
    settings.filament.length_m = 0.046416;
    settings.filament.diameter_m = 1.506e-3;
    settings.filament.density_kg_m3 = 6244.0;
    settings.filament.youngs_modulus_pa = 1.8347e9;
    settings.filament.damping_ratio = 0.01;
    settings.process.gravity_m_s2 = [0.0, -9.81, 0.0];
    settings.contact.stiffness_n_m = 5336.0;
    settings.workpiece.kind = WorkpieceKind::Chamfer(ChamferSettings {
        offset_m: 8.775e-3,
        included_angle_rad: 1.7127,
        edge_radius_m: 3.791e-3,
        side: Side::Entering,
        chamfer_width_m: 13.099e-3,
        chamfer_angle_rad: 0.7376,
    });
    settings.solver.relative_tolerance = tolerance;
    settings
}

#[test]
fn a_face_that_is_crossed_within_a_step_is_met() {
    let impulse = |tolerance| {
        let metrics = simulate(&short_face(tolerance))
            .expect("the pass ends")
            .metrics;
        assert!(
            metrics.energy_residual < 1e-4,
            "{tolerance}: {}",
            metrics.energy_residual
        );
        metrics.contact_normal_impulse_n_s
    };
    // The impulse in N s at 1e-9; without the contact it was 4.41e-3.
    let expected = 2.775_903_5e-3;
    for tolerance in [1e-4, 1e-5, 1e-6, 1e-7] {
        let impulse = impulse(tolerance);
        // Each of some hundred steps may be off by the tolerance.
        assert!(
            (impulse / expected - 1.0).abs() < 100.0 * tolerance.max(1e-7),
            "{tolerance}: {impulse:e}"
        );
    }
}

/// A stiff filament of three segments that bounces over bumps, drawn with `seed` and 1.5 mm apart,
/// a tenth of a segment.
fn over_bumps(seed: u64, tolerance: f64) -> Settings {
    let mut settings = Settings::paper(19.3, 1.23e-3);
    settings.tool.body_radius_m = 0.043;
    settings.filament.segments = 3;
    settings.filament.length_m = 0.0447;
    settings.filament.diameter_m = 6.8e-4;
    settings.filament.damping_ratio = 0.2;
    settings.contact.stiffness_n_m = 2.2e5;
    settings.contact.damping_s_m = 0.08;
    settings.contact.friction_coefficient = 0.1;
    settings.process.gravity_m_s2 = [0.0; 3];
    let mut random = fastrand::Rng::with_seed(seed);
    let mut point = |k: i32| [1.5e-3 * f64::from(k), 1.3e-4 * (2.0 * random.f64() - 1.0)];
    let control_points_m = (-20..=20).map(&mut point).collect();
    settings.workpiece.kind = WorkpieceKind::Profile(ProfileSettings {
        degree: 2,
        control_points_m,
        ..ProfileSettings::default()
    });
    settings.solver.relative_tolerance = tolerance;
    settings
}

#[test]
fn no_bump_of_a_spline_is_passed_over() {
    for seed in 0..16 {
        let [loose, tight] = [1e-5, 1e-8].map(|tolerance| {
            let metrics = simulate(&over_bumps(seed, tolerance))
                .expect("the pass ends")
                .metrics;
            metrics.contact_normal_impulse_n_s
        });
        // Each of some hundred steps may be off by the tolerance. A missed bump changes all that
        // follow, by up to 30 %.
        assert!(
            (loose / tight - 1.0).abs() < 1e-3,
            "{seed}: {loose:e} {tight:e}"
        );
    }
}

#[test]
fn the_profile_reaches_as_far_as_the_contact_radius() {
    let mut settings = case(6, 10.0, 1e-3);
    settings.contact.radius_m = 2e-3;
    // 1 mm below the tips of the undeformed filament.
    let control_points_m = [-0.04, -0.02, 0.0, 0.02, 0.04].map(|x| [x, -2e-3]).to_vec();
    settings.workpiece.kind = WorkpieceKind::Profile(ProfileSettings {
        control_points_m,
        ..ProfileSettings::default()
    });
    let simulation = simulate_with(
        &settings,
        Sampling {
            profile: true,
            ..Sampling::default()
        },
    )
    .expect("the pass ends");
    let impulse = simulation.metrics.contact_normal_impulse_n_s;
    let sum: f64 = simulation
        .profile
        .iter()
        .map(|cell| cell.normal_impulse_n_s_m * cell.length_m)
        .sum();
    assert!(
        impulse > 1e-4 && (sum / impulse - 1.0).abs() < 1e-12,
        "{impulse:e} {sum:e}"
    );
}

/// A surface all around the tool, on which the contact has no end.
#[derive(Clone, Debug)]
struct Around(Plane);

impl Workpiece for Around {
    fn surface(&self, [x, y, z]: [f64; 3], time: f64) -> Surface {
        let surface = self.0.surface([x, y, z], time);
        Surface {
            gap: 0.17 - x.hypot(y),
            normal: [-x / x.hypot(y), -y / x.hypot(y), 0.0],
            ..surface
        }
    }

    fn contact_arc(&self, tip: &dyn Fn(f64) -> [f64; 3]) -> Option<ContactArc> {
        self.0.contact_arc(tip)
    }
}

#[test]
fn a_tool_that_begins_inside_the_workpiece_is_refused() {
    let settings = case(6, 10.0, 1e-3);
    let tool = RotaryTool::of(&settings);
    let plane = Plane::of(
        &settings.workpiece,
        tool.radius(settings.filament.length_m) - 1e-3,
    );
    let pass = pass_with(&settings, tool, Around(plane)).expect("a contact arc is stated");
    let error = pass
        .simulate(Sampling::default())
        .expect_err("no angle is free");
    assert!(
        error.to_string().contains("start inside the workpiece"),
        "{error}"
    );
}

/// A plane that breaks a promise of [`Workpiece`].
#[derive(Clone, Debug)]
struct Broken {
    plane: Plane,
    /// Time in s until which nodes inside seem to be outside, as if the onset of their contact were
    /// missed.
    hidden_until: f64,
    /// Lean of the normal towards `x`, away from the gradient of the gap.
    lean: f64,
}

impl Broken {
    /// The energy residual of the pass over a plane that `change` breaks; `change` gets the times
    /// of the nominal contact.
    fn residual(
        settings: &Settings,
        change: impl FnOnce(&mut Self, [f64; 2]),
    ) -> Result<f64, SimulationError> {
        let plane = Plane::of(
            &settings.workpiece,
            settings.tool_radius_m() - settings.process.penetration_depth_m,
        );
        let mut broken = Self {
            plane,
            hidden_until: f64::NEG_INFINITY,
            lean: 0.0,
        };
        change(&mut broken, Pass::new(settings).nominal_times());
        let pass = pass_with(settings, RotaryTool::of(settings), broken).expect("the tips touch");
        pass.simulate(Sampling::default())
            .map(|simulation| simulation.metrics.energy_residual)
    }
}

impl Workpiece for Broken {
    fn surface(&self, position: [f64; 3], time: f64) -> Surface {
        let surface = self.plane.surface(position, time);
        let gap = if time < self.hidden_until {
            surface.gap.abs()
        } else {
            surface.gap
        };
        let leaning = add(surface.normal, [self.lean, 0.0, 0.0]);
        Surface {
            gap,
            normal: scale(1.0 / dot(leaning, leaning).sqrt(), leaning),
            ..surface
        }
    }

    fn is_planar(&self) -> bool {
        true
    }

    fn translates(&self) -> bool {
        true
    }

    fn contact_arc(&self, tip: &dyn Fn(f64) -> [f64; 3]) -> Option<ContactArc> {
        self.plane.contact_arc(tip)
    }
}

#[test]
fn a_missed_onset_is_an_error() {
    let settings = case(6, 10.0, 1e-3);
    let kept = Broken::residual(&settings, |_, _| ()).expect("it breaks nothing");
    assert!(kept < 1e-5, "{kept}");
    for part in [0.01, 0.1] {
        let hide = |broken: &mut Broken, [entry, exit]: [f64; 2]| {
            broken.hidden_until = entry + part * (exit - entry)
        };
        let error = Broken::residual(&settings, hide).expect_err("the force jumps");
        assert!(
            matches!(
                error,
                SimulationError::Integration(IntegrationError::Jump { .. })
            ),
            "{error}"
        );
    }
}

/// A plane whose normal leans until a pass has come to `end` (s).
#[derive(Clone, Debug)]
struct LeaningOnce {
    broken: Broken,
    end: f64,
    has_ended: Arc<AtomicBool>,
}

impl Workpiece for LeaningOnce {
    fn surface(&self, position: [f64; 3], time: f64) -> Surface {
        if time >= self.end {
            self.has_ended.store(true, Ordering::Relaxed);
        }
        if self.has_ended.load(Ordering::Relaxed) {
            self.broken.plane.surface(position, time)
        } else {
            self.broken.surface(position, time)
        }
    }

    fn is_planar(&self) -> bool {
        true
    }

    fn translates(&self) -> bool {
        true
    }

    fn contact_arc(&self, tip: &dyn Fn(f64) -> [f64; 3]) -> Option<ContactArc> {
        self.broken.contact_arc(tip)
    }
}

#[test]
fn a_pass_that_is_not_resolved_is_repeated_with_shorter_steps() {
    let mut settings = case(6, 10.0, 1e-3);
    let plane = Plane::of(
        &settings.workpiece,
        settings.tool_radius_m() - settings.process.penetration_depth_m,
    );
    let broken = Broken {
        plane,
        hidden_until: f64::NEG_INFINITY,
        lean: 0.1,
    };
    let leaning = LeaningOnce {
        broken,
        end: 0.99 * Pass::new(&settings).end_time(),
        has_ended: Arc::default(),
    };
    let tool = RotaryTool::of(&settings);
    let repeated = pass_with(&settings, tool, leaning)
        .expect("the tips touch")
        .simulate(Sampling::default())
        .expect("the second pass is resolved");
    settings.solver.relative_tolerance *= 0.1;
    let refined = pass_with(&settings, tool, plane)
        .expect("the tips touch")
        .simulate(Sampling::default())
        .expect("a pass");
    assert_eq!(repeated.metrics, refined.metrics);
}

#[test]
fn forces_along_another_normal_do_not_balance() {
    let settings = case(6, 10.0, 1e-3);
    for lean in [-0.01, 0.01, 0.1] {
        let error = Broken::residual(&settings, |broken, _| broken.lean = lean)
            .expect_err("energy comes or goes");
        assert!(
            matches!(error, SimulationError::Unbalanced { .. }),
            "{lean}: {error}"
        );
    }
}
