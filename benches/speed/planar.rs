//! The planar equations against those in space, and lanes against single states, measured
//! alternately in one run.
//!
//! A machine's speed varies while it runs. Each subject is therefore run in turn, and the shortest
//! times are compared.

use std::hint::black_box;
use std::time::{Duration, Instant};

use bristle::equations::{
    Chain, ChainDynamics, Clamp, Compiled, Dynamics, LANES, Lanes, NoLoads, PlanarDynamics,
    lanes_are_compiled,
};
use bristle::model::settings::Settings;
use bristle::simulation::{Job, Pass, simulate_side_by_side};
use bristle_equations::batch::{Batch, Member};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion};

use crate::PaperFilament;
use crate::workpieces::contacts;

const SEGMENTS: usize = 25;

/// Prints the ratio of the times of both subjects of each comparison.
pub fn planar(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("planar");
    group.sample_size(10);
    let settings = contacts(|_| ());
    let planar = || study(&settings, std::convert::identity);
    let spatial = || study(&settings, Pass::in_space);
    compare(
        &mut group,
        "study of 120 contacts, one thread: planar against in space",
        1,
        &mut { planar },
        &mut { spatial },
    );
    let motion = PaperFilament::planar(SEGMENTS);
    forms::<f64>(
        &mut group,
        "accelerations, one state: planar against in space",
        &motion,
    );
    if lanes_are_compiled() {
        forms::<Lanes>(
            &mut group,
            "accelerations, eight lanes: planar against in space",
            &motion,
        );
        lanes(&mut group, &motion);
    }
    group.finish();
}

/// Simulates the contacts of `settings` in lanes, with equations of the given form.
pub fn study(settings: &[Settings], form: fn(Pass) -> Pass) {
    let mut jobs = settings.iter().enumerate().map(|(number, settings)| Job {
        number,
        pass: form(Pass::new(settings)),
    });
    simulate_side_by_side(
        |_| jobs.next(),
        |_, result| {
            black_box(result.expect("the case can be simulated"));
        },
    );
}

/// Compares both forms of the equations at one state, which is the same in every lane.
fn forms<T: Compiled>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    motion: &PaperFilament,
) {
    let lanes = |blocks: &[[f64; 2]]| {
        blocks
            .iter()
            .map(|block| block.map(T::from_f64))
            .collect::<Vec<_>>()
    };
    let chain = Chain::<T>::from_lanes(|_| motion.dynamics.chain());
    let (clamp, q, v) = (
        Clamp::<T>::from_lanes(|_| motion.clamp),
        lanes(&motion.q),
        lanes(&motion.v),
    );
    let (mut planar, mut spatial) = (PlanarDynamics::new(chain.clone()), Dynamics::new(chain));
    let mut results = [(); 2].map(|()| q.clone());
    let [of_planar, of_spatial] = &mut results;
    compare(
        group,
        name,
        64,
        &mut || {
            planar.accelerations(
                black_box(&clamp).holding(&q, &v),
                &NoLoads,
                black_box(of_planar),
            )
        },
        &mut || {
            spatial.accelerations(
                black_box(&clamp).holding(&q, &v),
                &NoLoads,
                black_box(of_spatial),
            )
        },
    );
}

/// Compares eight states in a batch, gathered into lanes, with eight states one by one.
fn lanes(group: &mut BenchmarkGroup<'_, WallTime>, motion: &PaperFilament) {
    let PaperFilament {
        clamp,
        dynamics,
        q,
        v,
        ..
    } = motion;
    let (mut batch, mut single, chain) = (Batch::new(SEGMENTS), dynamics.clone(), dynamics.chain());
    let members = [Member { chain, clamp, q, v }; LANES];
    let (mut in_lanes, mut alone) = ([[0.0; 2]; LANES * SEGMENTS], [[0.0; 2]; SEGMENTS]);
    compare(
        group,
        "accelerations of eight states: in lanes against one by one",
        8,
        &mut || {
            batch
                .accelerations(black_box(&members), black_box(&mut in_lanes))
                .expect("no state is at a pole")
        },
        &mut || {
            for _ in 0..LANES {
                single.accelerations(
                    black_box(clamp).holding(q, v),
                    &NoLoads,
                    black_box(&mut alone),
                );
            }
        },
    );
}

/// Measures `fast` by criterion, `repetitions` calls at a time, and prints how much longer `slow`
/// takes.
pub fn compare<'a>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    repetitions: u32,
    fast: &'a mut dyn FnMut(),
    slow: &'a mut dyn FnMut(),
) {
    let mut shortest = [Duration::MAX; 2];
    group.bench_function(name, |bencher| {
        bencher.iter_custom(|iterations| {
            let mut total = Duration::ZERO;
            for _ in 0..iterations {
                let times = [&mut *fast, &mut *slow].map(|subject| {
                    let start = Instant::now();
                    (0..repetitions).for_each(|_| subject());
                    start.elapsed() / repetitions
                });
                shortest = [shortest[0].min(times[0]), shortest[1].min(times[1])];
                total += times[0];
            }
            total
        });
    });
    // A filter may exclude the benchmark.
    if shortest[0] < Duration::MAX {
        let [fast, slow] = shortest.map(|time| time.as_secs_f64());
        println!(
            "{name}: {:.2} µs against {:.2} µs, ratio {:.2}",
            1e6 * fast,
            1e6 * slow,
            slow / fast
        );
    }
}
