//! Is it right? Results computed side by side in vector lanes have the same bits as alone.

use std::f64::consts::FRAC_PI_2;

use crate::common::{RandomState, case, filament as paper_filament, random_state, side_by_side};
use crate::poses::cup;
use crate::shape::shaped;
use crate::turns::turning;
use crate::{profile, workpieces};
use bristle::equations::PolarAxis;
use bristle::model::filament;
use bristle::model::settings::{Settings, Turns};
use bristle::simulation::{
    Job, Kind, Pass, Sampling, Simulation, SimulationError, simulate, simulate_side_by_side,
};
use bristle_equations::batch::{Batch, Member};
use fastrand::Rng;

/// Chains with different constants, bent and straight; some joints are far beyond the range of the
/// power series.
fn states(rng: &mut Rng, segments: usize, count: usize) -> Vec<RandomState> {
    (0..count)
        .map(|i| {
            let mut state = random_state(rng, segments);
            let mut settings = paper_filament(segments);
            settings.length_m *= 0.5 + rng.f64();
            settings.youngs_modulus_pa *= 0.1 + rng.f64();
            settings.damping_ratio *= rng.f64();
            state.chain = filament::chain(&settings, state.chain.gravity);
            match i % 3 {
                // A straight filament with joints at rest.
                0 => state.q.fill([1.3, 0.2]),
                // A sharp bend in the middle.
                1 => state.q[segments / 2..].iter_mut().for_each(|q| q[1] += 1.5),
                _ => {}
            }
            state
        })
        .collect()
}

fn members(states: &[RandomState]) -> Vec<Member<'_>> {
    states
        .iter()
        .map(|state| Member {
            chain: &state.chain,
            clamp: &state.clamp,
            q: &state.q,
            v: &state.v,
        })
        .collect()
}

fn batch(states: &[RandomState]) -> Vec<Vec<[f64; 2]>> {
    let segments = states[0].q.len();
    let mut accelerations = vec![[f64::NAN; 2]; segments * states.len()];
    Batch::new(segments)
        .accelerations(&members(states), &mut accelerations)
        .expect("no state is at a pole");
    accelerations.chunks(segments).map(<[_]>::to_vec).collect()
}

#[test]
fn states_of_a_batch_have_the_same_results_as_alone() {
    let mut rng = Rng::with_seed(21);
    for segments in [1, 2, 25, 100] {
        for count in [1, 7, 8, 9, 24, 29] {
            let states = states(&mut rng, segments, count);
            for (i, (accelerations, state)) in batch(&states).iter().zip(&states).enumerate() {
                assert!(
                    accelerations
                        .as_flattened()
                        .iter()
                        .all(|value| value.is_finite())
                );
                assert_eq!(
                    *accelerations,
                    state.accelerations(PolarAxis::Z),
                    "n = {segments}, {i} of {count}"
                );
            }
        }
    }
}

#[test]
fn a_state_at_a_pole_is_refused_by_its_number() {
    let mut rng = Rng::with_seed(24);
    let mut states = states(&mut rng, 4, 11);
    states[9].q[2][0] = 0.0;
    let mut accelerations = vec![[7.0; 2]; 4 * 11];
    let error = Batch::new(4)
        .accelerations(&members(&states), &mut accelerations)
        .expect_err("a pole");
    assert_eq!(
        (error.member, error.pole.segment, error.pole.axis),
        (10, 3, PolarAxis::Z)
    );
    assert_eq!(
        error.to_string(),
        "state 10 of the batch: segment 3 with φ = 0.0 stands at a pole (sin φ = 0) of its coordinates about z, \
         where its azimuth has no meaning"
    );
    assert!(
        accelerations.iter().all(|pair| *pair == [7.0; 2]),
        "something was computed"
    );
    // An empty batch is valid.
    Batch::new(4)
        .accelerations(&[], &mut [])
        .expect("nothing to refuse");
}

/// A small study: passes with different length, stiffness and depth, more than there are lanes.
fn passes(friction: f64) -> Vec<Settings> {
    let mut passes = Vec::new();
    for (i, velocity) in [30.0, 7.5, 20.0, 12.5].into_iter().enumerate() {
        for depth in [5e-3, 0.5e-3, 2.5e-3] {
            let mut settings = case(7, velocity, depth);
            settings.contact.friction_coefficient = friction;
            settings.contact.stiffness_n_m *= 1.0 + i as f64;
            settings.solver.relative_tolerance = 1e-5;
            passes.push(settings);
        }
    }
    passes
}

/// Takes the passes in order, so that one of another kind lets the lanes run dry.
fn in_turn(passes: &[Settings]) -> Vec<Result<Simulation, SimulationError>> {
    let mut queue: Vec<usize> = (0..passes.len()).rev().collect();
    let mut results = vec![None; passes.len()];
    let take = |kind: Option<Kind>| {
        let &number = queue.last()?;
        if kind.is_some_and(|kind| kind != Kind::of(&passes[number])) {
            return None;
        }
        queue.pop();
        Some(Job::new(number, &passes[number]))
    };
    simulate_side_by_side(take, |number, result| {
        assert!(
            results[number].replace(result).is_none(),
            "a case is reported once"
        );
    });
    results
        .into_iter()
        .map(|result| result.expect("every case is reported"))
        .collect()
}

#[test]
fn passes_side_by_side_have_the_same_bits_as_alone() {
    for friction in [0.0, 0.3] {
        let mut passes = passes(friction);
        // Out of the plane some lanes leave their charts, and continue alone.
        passes[4].process.gravity_m_s2 = [0.0, 0.0, 3e5];
        let together = in_turn(&passes);
        for (settings, result) in passes.iter().zip(&together) {
            assert_eq!(*result, simulate(settings), "{settings:?}");
        }
        let changes = together.iter().map(|result| {
            result
                .as_ref()
                .map_or(0, |pass| pass.statistics.chart_changes)
        });
        assert!(changes.sum::<usize>() > 0, "no lane left its charts");
        passes.rotate_left(5);
        let rotated = in_turn(&passes);
        assert_eq!(rotated[..], [&together[5..], &together[..5]].concat()[..]);
    }
}

#[test]
fn kinds_do_not_mix_and_an_error_ends_only_its_case() {
    let mut passes = [passes(0.0), passes(0.2)].concat();
    passes[3].filament.segments = 9;
    // No derivation of the equations makes sense of a NaN.
    passes[7].filament.youngs_modulus_pa = f64::NAN;
    let results = in_turn(&passes);
    for (i, (settings, result)) in passes.iter().zip(&results).enumerate() {
        assert_eq!(*result, simulate(settings));
        assert_eq!(result.is_err(), i == 7, "{i}: {result:?}");
    }
}

/// Compares passes of every kind: edges and curves, cups, wavy filaments beside straight ones,
/// turns, and passes that end later than expected.
#[test]
fn sampled_passes_of_all_kinds_side_by_side_have_the_same_bits_as_alone() {
    let mut all = workpieces::passes();
    all.extend(profile::all());
    for velocity in [5.0, 12.0, 20.0] {
        let mut cup = cup(6);
        cup.tool.tilt_rad = Some(FRAC_PI_2 - 0.1);
        cup.process.brushing_velocity_m_s = velocity;
        cup.contact.friction_coefficient = 0.2;
        all.extend([cup, shaped(10, velocity, 2e-3), case(10, velocity, 2e-3)]);
        for turns in [Turns::Count(1), Turns::Count(3), Turns::Steady] {
            all.push(turning(5, velocity, 1e-3, turns));
        }
        let mut slow = turning(5, 0.1 * velocity, 1e-3, Turns::Count(2));
        slow.process.tail_angle_rad = 0.0;
        all.push(slow);
    }
    let sampled = Sampling {
        samples: 31,
        shapes: 3,
        loads: true,
        profile: true,
        alongside: true,
    };
    let [plain, sampled] = [Sampling::default(), sampled].map(|sampling| {
        let alone = all.iter().map(|settings| {
            let result = Pass::new(settings).simulate(sampling);
            result.unwrap_or_else(|error| panic!("{error}: {settings:?}"))
        });
        let alone: Vec<Simulation> = alone.collect();
        let together = side_by_side(sampling, all.iter().map(Pass::new));
        for ((settings, alone), result) in all.iter().zip(&alone).zip(together) {
            assert!(result.is_ok_and(|result| result == *alone), "{settings:?}");
        }
        alone
    });
    for ((settings, plain), sampled) in all.iter().zip(&plain).zip(&sampled) {
        assert_eq!(plain.metrics, sampled.metrics, "{settings:?}");
        assert_eq!(plain.statistics, sampled.statistics, "{settings:?}");
    }
}
