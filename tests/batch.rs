//! Is it right? Batches in vector lanes against single states, and the lanes against each other.

mod common;

use bristle::equations::{Batch, Dynamics, LANES, Lanes, Member, NoLoads, PolarAxis, Real, kernels};
use bristle::filament;
use common::{RandomState, filament as paper_filament, largest, random_state};
use fastrand::Rng;

/// Sines differ by one rounding, 1.1e-16, and the stiff joints of a bent chain carry that to all accelerations alike.
const LANES_AGREE: f64 = 1e-13;

/// Chains of different constants, bent and straight, some of the joints far beyond the power series.
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
                // Straight, and with the joints at rest.
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
    states.iter().map(|state| Member { chain: &state.chain, clamp: &state.clamp, q: &state.q, v: &state.v }).collect()
}

fn batch(states: &[RandomState]) -> Vec<Vec<[f64; 2]>> {
    let segments = states[0].q.len();
    let mut accelerations = vec![[f64::NAN; 2]; segments * states.len()];
    Batch::new(segments).accelerations(&members(states), &mut accelerations).expect("no state is at a pole");
    accelerations.chunks(segments).map(<[_]>::to_vec).collect()
}

fn single(state: &RandomState) -> Vec<[f64; 2]> {
    let mut accelerations = vec![[0.0; 2]; state.q.len()];
    let mut dynamics = Dynamics::new(state.chain);
    dynamics.accelerations(&state.clamp, &state.q, &state.v, &NoLoads, &mut accelerations);
    accelerations
}

/// Largest difference over the largest acceleration.
fn difference(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    let differences: Vec<f64> = a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a - b).collect();
    assert!(a.as_flattened().iter().all(|value| value.is_finite()));
    largest(&differences) / largest(b.as_flattened())
}

#[test]
fn a_batch_gives_what_its_states_give_alone() {
    let mut rng = Rng::with_seed(21);
    let mut worst = 0.0_f64;
    for segments in [1, 2, 25, 100] {
        for count in [1, 7, 8, 9, 24, 29] {
            let states = states(&mut rng, segments, count);
            for (i, (accelerations, state)) in batch(&states).iter().zip(&states).enumerate() {
                let difference = difference(accelerations, &single(state));
                assert!(difference < LANES_AGREE, "n = {segments}, {i} of {count}: {difference:.1e}");
                worst = worst.max(difference);
            }
        }
    }
    println!("largest difference: {worst:.1e}");
}

#[test]
fn a_state_gives_the_same_bits_at_every_place_of_every_batch() {
    let mut rng = Rng::with_seed(22);
    for segments in [1, 2, 25] {
        let mut states = states(&mut rng, segments, 2 * LANES + 3);
        let together = batch(&states);
        for (state, accelerations) in states.iter().zip(&together) {
            assert_eq!(&batch(std::slice::from_ref(state))[0], accelerations);
        }
        states.rotate_left(5);
        let rotated = batch(&states);
        assert_eq!(rotated[..], [&together[5..], &together[..5]].concat()[..]);
    }
}

/// What the machine's widest instructions compute, against those that every machine has, and against fewer lanes.
#[test]
fn instructions_and_number_of_lanes_change_no_bit() {
    fn narrow<const N: usize>(state: &RandomState) -> Vec<[f64; 2]> {
        let lanes = |values: &[[f64; 2]]| values.iter().map(|pair| pair.map(Lanes::<N>::from_f64)).collect::<Vec<_>>();
        let all = |vector: [f64; 3]| vector.map(Lanes::<N>::from_f64);
        let (chain, clamp) = (&state.chain, &state.clamp);
        let chain = bristle::equations::Chain {
            segments: chain.segments,
            length: Lanes::from_f64(chain.length),
            mass: Lanes::from_f64(chain.mass),
            inertia: Lanes::from_f64(chain.inertia),
            root_stiffness: Lanes::from_f64(chain.root_stiffness),
            joint_stiffness: Lanes::from_f64(chain.joint_stiffness),
            root_damping: Lanes::from_f64(chain.root_damping),
            joint_damping: Lanes::from_f64(chain.joint_damping),
            gravity: all(chain.gravity),
        };
        let clamp = bristle::equations::Clamp {
            position: all(clamp.position),
            velocity: all(clamp.velocity),
            acceleration: all(clamp.acceleration),
            direction: all(clamp.direction),
            direction_rate: all(clamp.direction_rate),
        };
        let mut accelerations = lanes(&state.v);
        Dynamics::new(chain).accelerations(&clamp, &lanes(&state.q), &lanes(&state.v), &NoLoads, &mut accelerations);
        accelerations.into_iter().map(|pair| pair.map(|lanes| lanes.0[N - 1])).collect()
    }
    let mut rng = Rng::with_seed(23);
    for segments in [1, 2, 25] {
        let states = states(&mut rng, segments, LANES);
        for (state, accelerations) in states.iter().zip(batch(&states)) {
            assert_eq!(narrow::<1>(state), accelerations);
            assert_eq!(narrow::<4>(state), accelerations);
            assert_eq!(narrow::<8>(state), accelerations);
        }
    }
}

#[test]
fn a_state_at_a_pole_is_refused_by_its_number() {
    let mut rng = Rng::with_seed(24);
    let mut states = states(&mut rng, 4, 11);
    states[9].q[2][0] = 0.0;
    let mut accelerations = vec![[7.0; 2]; 4 * 11];
    let error = Batch::new(4).accelerations(&members(&states), &mut accelerations).expect_err("a pole");
    assert_eq!((error.member, error.pole.segment, error.pole.axis), (10, 3, PolarAxis::Z));
    assert_eq!(
        error.to_string(),
        "state 10 of the batch: segment 3 with φ = 0.0 stands at a pole (sin φ = 0) of its coordinates about z, \
         where its azimuth has no meaning"
    );
    assert!(accelerations.iter().all(|pair| *pair == [7.0; 2]), "nothing is computed");
    // An empty batch is one, too.
    Batch::new(4).accelerations(&[], &mut []).expect("nothing to refuse");
}

/// The kernels that no batch uses yet, and their functions, compile for lanes and agree with `f64`.
#[test]
fn tangents_in_lanes_are_those_of_one_lane() {
    let pairs: [[f64; 2]; 5] = [[0.9, 0.4], [0.8, 0.6], [0.3, 0.95], [20.0, -3.0], [5.0, 70.0]];
    fn tangent<T: Real>(pairs: [[f64; 2]; 5]) -> kernels::JointTangent<T> {
        let [a, b, c, d, e] = pairs.map(|pair| pair.map(T::from_f64));
        let [stiffness, damping, coordinates, rates] = [0.7, 0.3, 1e-3, 0.1].map(T::from_f64);
        kernels::joint_tangent(a, b, c, d, e, stiffness, damping, coordinates, rates)
    }
    let (lanes, alone) = (tangent::<Lanes<4>>(pairs), tangent::<f64>(pairs));
    for row in 0..2 {
        for column in 0..2 {
            let expected = alone.previous_next[row][column];
            for value in lanes.previous_next[row][column].0 {
                assert!((value - expected).abs() < LANES_AGREE * expected.abs(), "{value} {expected}");
            }
        }
    }
}
