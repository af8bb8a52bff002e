//! Turns: the filament turns on after its pass, vibrates freely, and comes back as it is.

use crate::common::case;
use bristle::model::settings::{MAX_TURNS, RoundSettings, Settings, Turns, WorkpieceKind};
use bristle::simulation::{Pass, Sampling, Simulation, simulate, simulate_with};

pub fn turning(segments: usize, velocity: f64, depth: f64, turns: Turns) -> Settings {
    let mut settings = case(segments, velocity, depth);
    settings.process.turns = Some(turns);
    settings
}

fn simulated(settings: &Settings) -> Simulation {
    simulate(settings).expect("the pass ends")
}

/// Compares with the impulses of a converged planar simulation (MODEL, "Turns") of ten segments.
#[test]
fn a_fast_brush_needs_several_turns() {
    let Simulation {
        metrics,
        turn_contact_normal_impulses_n_s: impulses,
        end_time_s,
        ..
    } = simulated(&turning(10, 30.0, 1e-3, Turns::Count(4)));
    assert_eq!(
        (impulses.len(), metrics.turns, metrics.unsteady_turns),
        (4, 4, false)
    );
    for (impulse, expected) in impulses.iter().zip([1.64e-3, 3.04e-3, 3.58e-3, 3.69e-3]) {
        assert!((impulse / expected - 1.0).abs() < 5e-3, "{impulses:?}");
    }
    assert_eq!(metrics.contact_normal_impulse_n_s, impulses[3]);
    let turn = std::f64::consts::TAU * 0.18 / 30.0;
    assert!(
        (end_time_s / turn - 4.0).abs() < 1e-12,
        "all turns are whole"
    );
    let alone = simulated(&turning(10, 30.0, 1e-3, Turns::Count(1)));
    assert_eq!(
        alone.turn_contact_normal_impulses_n_s,
        [alone.metrics.contact_normal_impulse_n_s]
    );
    // In a single turn the filament touches no more after the tail angle. In several, it swings
    // ahead and touches before the next nominal entry: the rest of the first impulse.
    let ahead = 1.0 - alone.metrics.contact_normal_impulse_n_s / impulses[0];
    assert!((0.03..0.06).contains(&ahead), "{ahead}");
    let mut longer = turning(10, 30.0, 1e-3, Turns::Count(1));
    longer.process.tail_angle_rad = 3.0;
    let found = simulated(&longer).metrics.contact_normal_impulse_n_s;
    assert!(
        (found / alone.metrics.contact_normal_impulse_n_s - 1.0).abs() < 1e-6,
        "{found}"
    );
}

#[test]
fn a_slow_brush_comes_back_at_rest() {
    let [one, two] = [1, 2].map(|turns| simulated(&turning(10, 10.0, 1e-3, Turns::Count(turns))));
    let change =
        two.metrics.contact_normal_impulse_n_s / one.metrics.contact_normal_impulse_n_s - 1.0;
    assert!(change != 0.0 && change.abs() < 0.02, "{change}");
    // All counts of a metric cover the last turn only.
    let time = two.metrics.contact_time_s / one.metrics.contact_time_s;
    assert!(
        (time - 1.0).abs() < 0.1 && two.metrics.contact_count < 2 * one.metrics.contact_count,
        "{time}"
    );
    assert!(two.statistics.steps > one.statistics.steps);
    assert!(two.statistics.contact_events > one.statistics.contact_events);
    let ratio = two.metrics.contact_time_ratio / one.metrics.contact_time_ratio;
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
}

#[test]
fn turns_end_when_they_are_steady() {
    let steady = simulated(&turning(10, 20.0, 1e-3, Turns::Steady));
    let impulses = &steady.turn_contact_normal_impulses_n_s;
    let change = |pair: &[f64]| (pair[1] / pair[0] - 1.0).abs();
    let pairs: Vec<&[f64]> = impulses.windows(2).collect();
    let (last, earlier) = pairs.split_last().expect("two turns");
    assert!(
        change(last) < 1.001e-3 && earlier.iter().all(|pair| change(pair) > 0.999e-3),
        "{impulses:?}"
    );
    assert!(!steady.metrics.unsteady_turns && (3..MAX_TURNS).contains(&steady.metrics.turns));
    // A stated number gives the same turns.
    let counted = simulated(&turning(10, 20.0, 1e-3, Turns::Count(steady.metrics.turns)));
    assert_eq!(counted, steady);
}

#[test]
fn turns_without_contact_are_steady() {
    // The workpiece is out of reach of the tip.
    let mut settings = turning(5, 10.0, 1e-6, Turns::Steady);
    settings.workpiece.kind = WorkpieceKind::Cylinder(RoundSettings {
        offset_m: 0.1,
        radius_m: 0.05,
    });
    let Simulation {
        metrics,
        turn_contact_normal_impulses_n_s: impulses,
        ..
    } = simulated(&settings);
    assert_eq!(
        (impulses, metrics.turns, metrics.unsteady_turns),
        (vec![0.0, 0.0], 2, false)
    );
}

#[test]
fn what_never_becomes_steady_says_so() {
    // With little damping the vibration of each turn is carried into the next ones.
    let mut settings = turning(2, 20.0, 3e-3, Turns::Steady);
    settings.filament.damping_ratio = 0.01;
    settings.solver.relative_tolerance = 1e-5;
    let Simulation {
        metrics,
        turn_contact_normal_impulses_n_s: impulses,
        ..
    } = simulated(&settings);
    assert_eq!(
        (impulses.len(), metrics.turns, metrics.unsteady_turns),
        (MAX_TURNS, MAX_TURNS, true),
        "{impulses:?}"
    );
    let late = &impulses[MAX_TURNS / 2..];
    let mean = late.iter().sum::<f64>() / late.len() as f64;
    assert!((metrics.contact_normal_impulse_n_s / mean - 1.0).abs() < 1e-9);
    assert!((1e-3..0.5).contains(&metrics.impulse_standard_error));
}

#[test]
fn a_pass_does_not_end_while_the_filament_touches() {
    let with_tail = |tail: f64, turns: usize| {
        let mut settings = turning(10, 1.0, 3e-3, Turns::Count(turns));
        settings.process.tail_angle_rad = tail;
        simulate_with(
            &settings,
            Sampling {
                samples: 7,
                ..Sampling::default()
            },
        )
        .expect("the pass ends")
    };
    let (short, long) = (with_tail(0.0, 1), with_tail(0.15, 1));
    let nominal_end = Pass::new(&turning(10, 1.0, 3e-3, Turns::Count(1))).nominal_times()[1];
    assert!(short.end_time_s > nominal_end && short.end_time_s < long.end_time_s);
    let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-4, "{a}, not {b}");
    near(short.metrics.contact_time_s, long.metrics.contact_time_s);
    near(
        short.metrics.contact_normal_impulse_n_s,
        long.metrics.contact_normal_impulse_n_s,
    );
    // The samples reach to the end, which is known only then.
    assert_eq!(short.history.len(), 7);
    assert_eq!(short.history[6].time_s, short.end_time_s);
    near(
        short.history[6].contact_normal_impulse_n_s,
        short.metrics.contact_normal_impulse_n_s,
    );
    let twice = with_tail(0.0, 2);
    assert_eq!(twice.turn_contact_normal_impulses_n_s.len(), 2);
    near(
        twice.turn_contact_normal_impulses_n_s[0],
        short.metrics.contact_normal_impulse_n_s,
    );
}

#[test]
fn a_contact_lasts_one_turn_at_most() {
    // A brush in a bore that is hardly wider: the filament touches everywhere but opposite the
    // bottom.
    let mut settings = turning(5, 5.0, 1e-3, Turns::Count(2));
    settings.workpiece.kind = WorkpieceKind::bore(0.1801);
    settings.process.tail_angle_rad = 0.0;
    let Simulation {
        end_time_s,
        turn_contact_normal_impulses_n_s: impulses,
        ..
    } = simulated(&settings);
    assert!(
        end_time_s <= 2.0 * Pass::new(&settings).turn_time(),
        "{end_time_s}"
    );
    assert!(impulses.iter().all(|&impulse| impulse > 0.0));
}

#[test]
fn samples_cover_all_turns() {
    let sampling = Sampling {
        samples: 101,
        shapes: 11,
        ..Sampling::default()
    };
    for turns in [Turns::Count(3), Turns::Steady] {
        let settings = turning(5, 15.0, 1e-3, turns);
        let mut told = Vec::new();
        let pass = Pass::new(&settings);
        let sampled = pass
            .simulate_telling(sampling, |share| told.push(share))
            .expect("the pass ends");
        assert!(told.is_sorted() && told.iter().all(|share| (0.0..=1.0).contains(share)));
        assert_eq!((sampled.history.len(), sampled.shapes.len()), (101, 11));
        for (index, sample) in sampled.history.iter().enumerate() {
            assert!((sample.time_s / sampled.end_time_s - index as f64 / 100.0).abs() < 1e-12);
        }
        let (last, total) = (
            &sampled.history[100],
            sampled.turn_contact_normal_impulses_n_s.iter().sum::<f64>(),
        );
        assert!((last.contact_normal_impulse_n_s / total - 1.0).abs() < 1e-12);
        let alongside = simulate_with(
            &settings,
            Sampling {
                alongside: true,
                ..sampling
            },
        )
        .expect("the pass ends");
        let plain = simulated(&settings);
        assert_eq!(
            (&alongside.metrics, alongside.statistics),
            (&plain.metrics, plain.statistics)
        );
        assert_eq!(alongside.history.len(), 101);
        let few = Sampling {
            samples: 2,
            ..sampling
        };
        let few = simulate_with(&settings, few).expect("the pass ends");
        assert_eq!(few.metrics, sampled.metrics, "metrics depend on samples");
    }
}
