//! Is it physics? Filaments that are neither straight nor uniform.

use std::f64::consts::FRAC_PI_2;

use bristle::equations::{ChainDynamics, Clamp, Dynamics, NoLoads, PlanarDynamics};
use bristle::model::filament::relaxed_deflection;
use bristle::model::settings::{FilamentSettings, Settings};
use bristle::simulation::Pass;
use bristle::tool::radial_clamp;
use fastrand::Rng;

use crate::common::{case, largest, random_state, tolerance};

/// A wavy, tapered filament in a case of the paper.
pub fn shaped(segments: usize, velocity: f64, depth: f64) -> Settings {
    let mut settings = case(segments, velocity, depth);
    settings.filament = FilamentSettings {
        tip_diameter_m: Some(0.7 * settings.filament.diameter_m),
        waviness_amplitude_m: 0.4e-3,
        waviness_length_m: Some(15e-3),
        waviness_phase_rad: 0.8,
        ..settings.filament
    };
    settings
}

#[test]
fn the_start_is_relaxed_and_follows_the_wave() {
    for tilt in [0.0, 0.3] {
        let mut settings = shaped(20, 10.0, 1e-3);
        settings.filament.lateral_tilt_rad = tilt;
        let pass = Pass::new(&settings);
        for pass in [pass.clone(), pass.in_space()] {
            let mut system = pass.system(false);
            let start = pass.start(&mut system);
            let energies = system.energies(&start);
            assert!(energies.spring < 1e-28, "{energies:?}");
            assert!(
                tilt != 0.0 || energies.dissipation < 1e-20 * energies.kinetic,
                "{energies:?}"
            );
        }
        // The nodes lie on the wave across the clamp direction.
        let length = settings.filament.length_m;
        for (k, across) in pass_nodes(&settings).into_iter().enumerate() {
            let wave = relaxed_deflection(&settings.filament, (k + 1) as f64 * length / 20.0);
            assert!(
                (across - wave * tilt.cos()).abs() < 1e-16,
                "node {k}: {across} {wave}"
            );
        }
    }
}

/// The distance of each node from the plane through the tool axis and the clamp, at the start of a
/// pass, in the direction of rotation.
fn pass_nodes(settings: &Settings) -> Vec<f64> {
    let pass = Pass::new(settings).in_space();
    let start = pass.start(&mut pass.system(false));
    let chain = &pass.filament().chain;
    let mut dynamics = Dynamics::new(chain.clone());
    let angle = pass.tool().initial_angle;
    let clamp = radial_clamp(settings.tool.body_radius_m, angle, 0.0, 0.0);
    dynamics.place(clamp.holding(&start.q, &start.v));
    let [x, y, _] = clamp.direction;
    dynamics
        .positions()
        .iter()
        .map(|node| x * node[1] - y * node[0])
        .collect()
}

#[test]
fn planar_equations_are_the_spatial_ones_at_random_states() {
    let mut rng = Rng::with_seed(31);
    for segments in [1, 2, 5, 25].repeat(5) {
        let mut state = random_state(&mut rng, segments);
        state.chain.gravity[2] = 0.0;
        for (q, v) in state.q.iter_mut().zip(&mut state.v) {
            (q[0], v[0]) = (FRAC_PI_2, 0.0);
        }
        let [along_x, along_y, _] = &mut state.clamp.angular_velocity;
        (*along_x, *along_y) = (0.0, 0.0);
        let clamp: &Clamp<f64> = &state.clamp;
        let [mut spatial, mut planar] = [(); 2].map(|()| vec![[0.0; 2]; segments]);
        Dynamics::new(state.chain.clone()).accelerations(
            clamp.holding(&state.q, &state.v),
            &NoLoads,
            &mut spatial,
        );
        let mut in_plane = PlanarDynamics::new(state.chain.clone());
        in_plane.accelerations(clamp.holding(&state.q, &state.v), &NoLoads, &mut planar);
        let scale = largest(spatial.as_flattened());
        for (spatial, planar) in spatial.iter().zip(&planar) {
            assert!(
                (spatial[1] - planar[1]).abs() < 1e-9 * scale,
                "n = {segments}: {spatial:?} {planar:?}"
            );
        }
        let mut in_space = Dynamics::new(state.chain);
        in_space.place(clamp.holding(&state.q, &state.v));
        in_plane.place(clamp.holding(&state.q, &state.v));
        let at = clamp.holding(&state.q, &state.v);
        let [a, b] = [in_space.energies(at), in_plane.energies(at)].map(|energies| {
            [
                energies.spring,
                energies.dissipation,
                energies.clamp_torque_power,
            ]
        });
        for (a, b) in a.into_iter().zip(b) {
            assert!(
                (a - b).abs() <= tolerance::AGREEMENT * a.abs().max(1e-3),
                "{a} {b}"
            );
        }
    }
}

#[test]
fn impossible_shapes_are_refused() {
    let refused = |change: fn(&mut FilamentSettings)| {
        let mut settings = shaped(10, 10.0, 1e-3);
        change(&mut settings.filament);
        settings.check().expect_err("impossible").to_string()
    };
    let steep = refused(|filament| filament.waviness_amplitude_m = 5e-3);
    assert!(
        steep.contains("`filament.waviness_amplitude_m` is 0.005") && steep.contains("between ±"),
        "{steep}"
    );
    assert!(
        refused(|filament| filament.waviness_length_m = Some(0.0))
            .contains("`filament.waviness_length_m`")
    );
    assert!(
        refused(|filament| filament.tip_diameter_m = Some(0.05))
            .contains("less than filament.length_m")
    );
    assert!(refused(|filament| filament.tip_diameter_m = Some(1e-6)).contains("a thousandth"));
}
