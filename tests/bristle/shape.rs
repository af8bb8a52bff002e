//! Is it physics? Filaments that are neither straight nor uniform.

use std::f64::consts::FRAC_PI_2;

use bristle::equations::{ChainDynamics, Clamp, Dynamics, NoLoads, PlanarDynamics};
use bristle::model::filament::{self, relaxed_deflection};
use bristle::model::metrics::Metrics;
use bristle::model::record::Record;
use bristle::model::settings::{FilamentSettings, Settings};
use bristle::simulation::{Pass, Sampling, integral};
use bristle::tool::radial_clamp;
use fastrand::Rng;

use crate::common::{balance, case, largest, metrics, random_state, side_by_side, tolerance};

/// A wavy, tapered filament in a case of the paper.
fn shaped(segments: usize, velocity: f64, depth: f64) -> Settings {
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
        // Across the clamp direction the nodes lie on the wave.
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
fn a_relaxed_filament_at_rest_stays_at_rest() {
    let settings = shaped(12, 10.0, 1e-3);
    let chain = filament::chain(&settings.filament, [0.0; 3]);
    let clamp = radial_clamp(0.14, 0.4, 0.0, 0.0);
    let mut azimuth = 0.4;
    let azimuths = chain.links.iter().map(|link| {
        azimuth += link.relaxed_angle.angle();
        [FRAC_PI_2, azimuth]
    });
    let (q, rest) = (azimuths.collect::<Vec<_>>(), [[0.0; 2]; 12]);
    let mut accelerations = rest;
    // A bend of one joint by a radian, for comparison.
    let mut bent = q.clone();
    bent[6][1] += 1.0;
    Dynamics::new(chain.clone()).accelerations(
        clamp.holding(&bent, &rest),
        &NoLoads,
        &mut accelerations,
    );
    let scale = largest(accelerations.as_flattened());
    Dynamics::new(chain.clone()).accelerations(
        clamp.holding(&q, &rest),
        &NoLoads,
        &mut accelerations,
    );
    assert!(
        largest(accelerations.as_flattened()) < 1e-13 * scale,
        "{accelerations:?}"
    );
    PlanarDynamics::new(chain).accelerations(
        clamp.holding(&q, &rest),
        &NoLoads,
        &mut accelerations,
    );
    assert!(
        accelerations
            .iter()
            .all(|[_, azimuth]| azimuth.abs() < 1e-13 * scale),
        "{accelerations:?}"
    );
}

#[test]
fn planar_equations_are_the_spatial_ones_at_random_states() {
    let mut rng = Rng::with_seed(31);
    for segments in [1, 2, 5, 25] {
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
fn a_pass_is_the_same_in_the_plane_in_space_and_beside_straight_filaments() {
    let mut settings = shaped(10, 15.0, 2e-3);
    let alone = metrics(&settings);
    assert!(alone.contact_normal_impulse_n_s > 0.0);
    let straight = case(10, 15.0, 2e-3);
    let beside = side_by_side(
        Sampling::default(),
        [&straight, &settings, &straight].map(Pass::new),
    )
    .swap_remove(1);
    assert_eq!(beside.expect("the pass ends").metrics, alone);

    settings.solver.relative_tolerance = 1e-8;
    let [planar, spatial] = [Pass::new(&settings), Pass::new(&settings).in_space()].map(|pass| {
        pass.simulate(Default::default())
            .expect("the pass ends")
            .metrics
    });
    let Metrics {
        lateral_amplification,
        energy_residual,
        ..
    } = planar;
    let spatial = Metrics {
        lateral_amplification,
        energy_residual,
        ..spatial
    };
    for column in Metrics::COLUMNS {
        let (a, b) = (column.get(&planar), column.get(&spatial));
        assert!(
            (a - b).abs() <= 2e-6 * a.abs().max(b.abs()),
            "{}: {a} {b}",
            column.key
        );
    }
}

#[test]
fn energy_is_conserved() {
    // Undamped, with an elastic contact: what the tool puts in is what the filament gains.
    let mut settings = shaped(8, 20.0, 1e-3);
    settings.filament.damping_ratio = 0.0;
    settings.solver.relative_tolerance = 1e-8;
    let (rise, end) = balance(&settings);
    let work = end.integrals[integral::WORK];
    assert!(
        (rise - work).abs() < tolerance::ENERGY_BALANCE * work.abs(),
        "{rise} {work}"
    );
}

#[test]
fn a_tapered_cantilever_bends_as_the_beam_does() {
    // Under a small force at the tip: L³/(3 E I_root) d_root/d_tip.
    let error = |segments: usize| {
        let mut filament = case(segments, 10.0, 1e-3).filament;
        filament.tip_diameter_m = Some(0.4 * filament.diameter_m);
        let chain = filament::chain(&filament, [0.0; 3]);
        let levers = (0..segments).map(|k| filament.length_m - k as f64 * chain.length);
        let compliance: f64 = levers
            .zip(&chain.links)
            .map(|(lever, link)| lever.powi(2) / link.stiffness)
            .sum();
        let stiffness = filament::bending_stiffness(&filament, filament.diameter_m);
        compliance / (filament.length_m.powi(3) / (3.0 * stiffness) / 0.4) - 1.0
    };
    let [coarse, fine] = [50, 100].map(error);
    assert!(
        fine.abs() < 1e-3 && ((coarse / fine).log2() - 2.0).abs() < 0.1,
        "{coarse} {fine}"
    );
}

#[test]
fn the_relaxed_shape_converges_to_the_wave() {
    let settings = shaped(10, 10.0, 1e-3).filament;
    // Along the clamp direction the tip lies at the integral of cos γ, with sin γ = y_0'.
    let reach = |segments: usize| {
        let filament = FilamentSettings {
            segments,
            ..settings.clone()
        };
        let cosines =
            filament::sines_of_inclinations(&filament).map(|sine| (1.0 - sine * sine).sqrt());
        cosines.sum::<f64>() / segments as f64
    };
    let exact = reach(20_000);
    let [coarse, fine] = [20, 40].map(|segments| reach(segments) - exact);
    assert!(
        ((coarse / fine).log2() - 2.0).abs() < 0.1,
        "{coarse} {fine}"
    );
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
