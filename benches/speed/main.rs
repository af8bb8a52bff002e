//! Times of the parts of a simulation, measured by criterion.
//!
//! ```text
//! cargo bench --bench speed                    # all groups
//! cargo bench --bench speed -- accelerations   # one of them
//! ```
//!
//! `accelerations`, `implicit_step`: one evaluation at the state of a bent, turning filament.
//! `contact`: one pass of the paper's filament, v_b = 10 m/s, a_e = 1 mm, n = 25. `study`: the
//! paper's 120 passes, and the same with friction. `planar`: the planar equations against those in
//! space, and lanes against single states, as ratios from one run. `workpieces`: the 120 passes
//! over edges, curves and splines, and with friction, against those over a plane. `derivation`: the
//! equations, from energies to Rust.

mod planar;
mod workpieces;

use std::hint::black_box;
use std::num::NonZeroUsize;
use std::time::Instant;

use bristle::equations::{ChainDynamics, Clamp, Dynamics, LaneSet, NoLoads, StepWeights};
use bristle::model::filament;
use bristle::model::settings::Settings;
use bristle::simulation::simulate;
use bristle::tool::radial_clamp;
use bristle_codegen::back::languages::rust::emit;
use bristle_codegen::back::source::Origin;
use bristle_codegen::model::chain;
use bristle_codegen::model::kernels::kernels;
use bristle_codegen::model::whole::{Purpose, whole_kernels};
use bristle_equations::batch::{Batch, Member};
use bristle_study::grid::run_study;
use bristle_study::input::document::Document;
use criterion::{Criterion, criterion_group, criterion_main};

/// The origin stated in the emitted source.
const ORIGIN: Origin<'_> = Origin {
    title: "A benchmark.",
    maker: bristle_codegen::MAKER,
    again: "cargo bench",
};

const SEGMENT_COUNTS: [usize; 3] = [25, 100, 200];
/// The default tolerance, and one that gives the impulse to better than 0.1 %.
const TOLERANCES: [f64; 2] = [1e-6, 1e-3];

/// The text of the example with another tolerance.
fn example(relative_tolerance: f64) -> String {
    let file = include_str!("../../examples/zirconia.toml");
    let (before, rest) = file
        .split_once("relative_tolerance = ")
        .expect("the example states it");
    let (_, after) = rest.split_once('\n').expect("the line ends");
    format!("{before}relative_tolerance = {relative_tolerance:e}\n{after}")
}

/// The paper's filament at v_b = 10 m/s and a_e = 1 mm.
fn paper_case(relative_tolerance: f64) -> Settings {
    let file = example(relative_tolerance);
    Document::parse(&file, "zirconia.toml")
        .and_then(|document| document.settings())
        .expect("the example is right")
}

/// The filament of the paper in the middle of a contact: turning, bent by 0.6 rad and slightly out
/// of the plane.
struct PaperFilament {
    clamp: Clamp<f64>,
    dynamics: Dynamics<f64>,
    q: Vec<[f64; 2]>,
    v: Vec<[f64; 2]>,
    accelerations: Vec<[f64; 2]>,
}

impl PaperFilament {
    fn new(segments: usize) -> Self {
        let settings = paper_case(1e-6);
        let body_radius = settings.tool.body_radius_m;
        let (angle, rate) = (-1.55, 10.0 / (body_radius + settings.filament.length_m));
        let filament = bristle::model::settings::FilamentSettings {
            segments,
            ..settings.filament
        };
        let along = |k: usize| (k as f64 + 0.5) / segments as f64;
        let q = (0..segments).map(|k| {
            let bend = along(k).powf(1.5);
            [
                std::f64::consts::FRAC_PI_2 + 0.02 * bend,
                angle - 0.6 * bend,
            ]
        });
        let v = (0..segments).map(|k| [2.0 * along(k), rate * (1.0 - 2.0 * along(k))]);
        let (q, v) = (q.collect(), v.collect());
        Self {
            clamp: radial_clamp(body_radius, angle, rate, 0.0),
            dynamics: Dynamics::new(filament::chain(&filament, [0.0; 3])),
            q,
            v,
            accelerations: vec![[0.0; 2]; segments],
        }
    }

    /// The filament moving in the plane.
    fn planar(segments: usize) -> Self {
        let mut motion = Self::new(segments);
        for (q, v) in motion.q.iter_mut().zip(&mut motion.v) {
            (q[0], v[0]) = (std::f64::consts::FRAC_PI_2, 0.0);
        }
        motion
    }

    fn compute_accelerations(&mut self) {
        let Self {
            clamp,
            dynamics,
            q,
            v,
            accelerations,
        } = self;
        dynamics.accelerations(clamp.holding(q, v), &NoLoads, accelerations);
    }
}

fn accelerations(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("accelerations");
    for segments in SEGMENT_COUNTS {
        let mut state = PaperFilament::new(segments);
        group.bench_function(format!("n={segments}"), |bencher| {
            bencher.iter(|| {
                black_box(&mut state).compute_accelerations();
                black_box(&state.accelerations);
            });
        });
    }
    for segments in SEGMENT_COUNTS {
        batched_accelerations(&mut group, segments);
    }
    group.finish();
}

/// Times accelerations of many states side by side, per state.
fn batched_accelerations(
    group: &mut criterion::BenchmarkGroup<'_, criterion::measurement::WallTime>,
    segments: usize,
) {
    const STATES: usize = 64;
    let states: Vec<PaperFilament> = (0..STATES).map(|_| PaperFilament::new(segments)).collect();
    let members: Vec<Member<'_>> = states
        .iter()
        .map(
            |PaperFilament {
                 clamp,
                 dynamics,
                 q,
                 v,
                 ..
             }| Member {
                chain: dynamics.chain(),
                clamp,
                q,
                v,
            },
        )
        .collect();
    let mut batch = Batch::new(segments);
    let mut accelerations = vec![[0.0; 2]; STATES * segments];
    group.bench_function(format!("n={segments}, per state in a batch"), |bencher| {
        bencher.iter_custom(|iterations| {
            let batches = iterations.div_ceil(STATES as u64);
            let start = Instant::now();
            for _ in 0..batches {
                batch
                    .accelerations(black_box(&members), &mut accelerations)
                    .expect("no state is at a pole");
                black_box(&accelerations);
            }
            start
                .elapsed()
                .mul_f64(iterations as f64 / (batches * STATES as u64) as f64)
        });
    });
}

fn implicit_step(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("implicit_step");
    for segments in SEGMENT_COUNTS {
        let mut state = PaperFilament::new(segments);
        state.compute_accelerations();
        let mut correction = vec![[0.0; 2]; segments];
        // γΔ of a step of 10 µs.
        let diagonal = 0.248e-5;
        let weights = StepWeights {
            coordinates: diagonal * diagonal,
            rates: diagonal,
        };
        group.bench_function(format!("n={segments}, residual and solve"), |bencher| {
            let PaperFilament {
                clamp,
                dynamics,
                q,
                v,
                accelerations,
            } = &mut state;
            dynamics.residual(
                clamp.holding(q, v),
                accelerations,
                &NoLoads,
                &mut correction,
            );
            dynamics.factorise(
                clamp.holding(q, v),
                accelerations,
                &NoLoads,
                weights,
                LaneSet::first(1),
            );
            bencher.iter(|| {
                let dynamics = black_box(&mut *dynamics);
                dynamics.residual(
                    clamp.holding(q, v),
                    accelerations,
                    &NoLoads,
                    &mut correction,
                );
                dynamics.solve(black_box(&mut correction));
            });
        });
        group.bench_function(
            format!("n={segments}, residual, factorise and solve"),
            |bencher| {
                let PaperFilament {
                    clamp,
                    dynamics,
                    q,
                    v,
                    accelerations,
                } = &mut state;
                bencher.iter(|| {
                    let dynamics = black_box(&mut *dynamics);
                    dynamics.residual(
                        clamp.holding(q, v),
                        accelerations,
                        &NoLoads,
                        &mut correction,
                    );
                    dynamics.factorise(
                        clamp.holding(q, v),
                        accelerations,
                        &NoLoads,
                        weights,
                        LaneSet::first(1),
                    );
                    dynamics.solve(black_box(&mut correction));
                });
            },
        );
    }
    group.finish();
}

fn contact(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("contact");
    group.sample_size(30);
    for tolerance in TOLERANCES {
        let settings = paper_case(tolerance);
        group.bench_function(
            format!("v_b = 10 m per s, a_e = 1 mm, tolerance {tolerance:e}"),
            |bencher| {
                bencher.iter(|| simulate(black_box(&settings)).expect("the case can be simulated"));
            },
        );
    }
    group.finish();
}

fn whole_study(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("study");
    group.sample_size(20);
    for tolerance in TOLERANCES {
        let file = example(tolerance);
        let study = Document::parse(&file, "zirconia.toml").and_then(|document| document.study());
        let study = study.expect("the example is a study");
        for threads in [1, 2] {
            group.bench_function(
                format!("120 contacts, tolerance {tolerance:e}, threads {threads}"),
                |bencher| {
                    bencher.iter(|| {
                        run_study(&study, NonZeroUsize::new(threads), || ())
                            .expect("the threads start")
                    });
                },
            );
        }
        let rough = file.replacen(
            "friction_coefficient = 0.0",
            "friction_coefficient = 0.3",
            1,
        );
        let study = Document::parse(&rough, "zirconia.toml").and_then(|document| document.study());
        let study = study.expect("the example with friction is a study");
        group.bench_function(
            format!("120 contacts with friction, tolerance {tolerance:e}, threads 1"),
            |bencher| {
                bencher.iter(|| {
                    run_study(&study, NonZeroUsize::new(1), || ()).expect("the threads start")
                });
            },
        );
    }
    group.finish();
}

fn derivation(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("derivation");
    group.sample_size(10);
    group.bench_function("kernels, derived", |bencher| bencher.iter(kernels));
    group.bench_function("kernels, derived and emitted", |bencher| {
        bencher.iter(|| {
            emit(&kernels().expect("the derivation is sound"), ORIGIN)
                .expect("the kernels can be emitted")
        });
    });
    for (name, purpose) in [
        ("to read", Purpose::Reading),
        ("to compute", Purpose::Computing),
    ] {
        group.bench_function(format!("whole equations n=25 {name}, derived"), |bencher| {
            bencher.iter(|| whole_kernels(black_box(25), chain::Motion::Spatial, purpose));
        });
        group.bench_function(
            format!("whole equations n=25 {name}, derived and emitted"),
            |bencher| {
                bencher.iter(|| {
                    emit(
                        &whole_kernels(black_box(25), chain::Motion::Spatial, purpose)
                            .expect("the derivation is sound"),
                        ORIGIN,
                    )
                    .expect("they can be emitted")
                });
            },
        );
    }
    group.finish();
}

criterion_group!(
    benches,
    accelerations,
    implicit_step,
    contact,
    whole_study,
    planar::planar,
    workpieces::workpieces,
    derivation
);
criterion_main!(benches);
