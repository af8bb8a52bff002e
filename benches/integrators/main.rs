//! Compares integrators by work and error: `cargo bench --bench integrators`.
//!
//! Each method integrates the paper's contacts with the library's residual, factorisation and solve, and with the same
//! location of events. Work is the number of calls, weighted by their cost. Errors are those of the metrics, compared with
//! our own solution at a relative tolerance of 1e-9. Writes `docs/work_precision.csv` and `docs/work_precision.svg`, which
//! `docs/integrators.md` discusses.
//!
//! `cargo bench --bench integrators -- --costs` measures the costs; `cargo test --bench integrators` only checks the order
//! of convergence of each method.

mod bdf;
mod esdirk;
mod generalized_alpha;
mod newton;
mod orders;
mod pass;
mod plot;
mod rosenbrock;
mod system;
mod tableaux;

use std::error::Error;
use std::fmt::Write;
use std::fs;
use std::hint::black_box;
use std::sync::Mutex;
use std::thread;
use std::time::Instant;

use bristle::equations::{LaneSet, StepWeights};
use bristle::integrate::SecondOrderSystem;
use bristle::integrate::tableau::{ESDIRK43, ESDIRK54, Tableau};
use bristle::model::metrics::ContactRecord;
use bristle::model::settings::Settings;
use bristle_input::document::Document;

use bdf::Bdf;
use esdirk::{Controller, Esdirk, EsdirkSettings, Predictor};
use generalized_alpha::GeneralizedAlpha;
use newton::{MAX_ITERATIONS, NewtonSettings};
use pass::{Landing, Method, PassSettings, run};
use rosenbrock::{RosenbrockMethod, rodas3, rodas4, rodas4p, ros34pw2};
use system::{Problem, Work};
use tableaux::{ESDIRK32, TR_BDF2};

type Maker = Box<dyn Fn(&Problem) -> Box<dyn Method> + Sync>;

/// A method and its settings.
struct Candidate {
    name: String,
    /// Its name in the diagram. Methods without one appear in the table only.
    label: Option<&'static str>,
    pass: PassSettings,
    tolerances: &'static [f64],
    make: Maker,
}

/// The result of a candidate at one tolerance, over all cases.
struct Row {
    name: String,
    label: Option<&'static str>,
    tolerance: f64,
    /// Cases integrated to their end.
    cases: usize,
    failures: usize,
    /// Mean weighted work of a contact in µs.
    work: f64,
    /// Median error of the impulse.
    median: f64,
    /// Largest error of the impulse.
    worst: f64,
    /// Largest errors of contact time, peak force and deflection.
    others: [f64; 3],
    /// Cases with a wrong number of contacts.
    miscounted: usize,
    total: Work,
    distribution: [usize; MAX_ITERATIONS],
}

const LOOSE: [f64; 5] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5];
const SHORT: [f64; 3] = [1e-2, 1e-3, 1e-4];

fn candidates() -> Vec<Candidate> {
    let plain = PassSettings::default();
    let mut list = Vec::new();
    let mut add = |name: String, label, pass, tolerances, make: Maker| {
        list.push(Candidate { name, label, pass, tolerances, make });
    };
    let esdirk = |settings: EsdirkSettings| -> Maker {
        Box::new(move |problem| Box::new(Esdirk::new(settings, problem.tolerances, problem.pairs())))
    };
    let once = |tableau: &'static Tableau| EsdirkSettings {
        newton: NewtonSettings::once(),
        predictor: Predictor::Stages(2),
        ..EsdirkSettings::new(tableau)
    };
    let labels = [
        (&TR_BDF2, None, Some("TR-BDF2, one iteration")),
        (&ESDIRK32, None, None),
        (&ESDIRK43, Some("ESDIRK4(3), Newton's method converged"), Some("ESDIRK4(3), one iteration")),
        (&ESDIRK54, None, Some("ESDIRK5(4), one iteration")),
    ];
    for (tableau, converged, single) in labels {
        add(format!("{} converged", tableau.name), converged, plain, &LOOSE, esdirk(EsdirkSettings::new(tableau)));
        add(format!("{} once", tableau.name), single, plain, &LOOSE, esdirk(once(tableau)));
    }

    for (method, label) in
        [(rodas3 as fn() -> _, None), (rodas4, None), (rodas4p, Some("RODASP")), (ros34pw2, Some("ROS34PW2"))]
    {
        let make = move |problem: &Problem| -> Box<dyn Method> {
            Box::new(RosenbrockMethod::new(method(), problem.tolerances, problem.pairs()))
        };
        add(method().name.to_owned(), label, plain, &LOOSE[..4], Box::new(make));
    }
    for (newton, way, label) in [
        (NewtonSettings::default(), "converged", None),
        (NewtonSettings::once(), "once", Some("generalised-α, one iteration")),
    ] {
        let make = move |problem: &Problem| -> Box<dyn Method> {
            Box::new(GeneralizedAlpha::new(0.8, newton, problem.tolerances, problem.pairs()))
        };
        add(format!("generalised-alpha 0.8 {way}"), label, plain, &LOOSE, Box::new(make));
    }
    // BDF restarts with order 1, for which the step is too long.
    let restarting = PassSettings { after_event: 0.05, ..plain };
    for (newton, way, label) in [
        (NewtonSettings::default(), "converged", None),
        (NewtonSettings { keep: 1.3, ..NewtonSettings::default() }, "converged, matrix kept", Some("BDF 1 to 5")),
        (NewtonSettings::once(), "once", None),
    ] {
        let make = move |problem: &Problem| -> Box<dyn Method> {
            Box::new(Bdf::new(newton, problem.tolerances, problem.pairs()))
        };
        add(format!("BDF {way}"), label, restarting, &LOOSE, Box::new(make));
    }

    // Variants of the best method.
    let best = once(&ESDIRK54);
    let newton = best.newton;
    for (variant, settings, pass) in [
        ("a second iteration", EsdirkSettings { newton: NewtonSettings { fixed: 2, ..newton }, ..best }, plain),
        ("rejects above 10", EsdirkSettings { newton: NewtonSettings { reject: 10.0, ..newton }, ..best }, plain),
        ("rejects above 100", EsdirkSettings { newton: NewtonSettings { reject: 100.0, ..newton }, ..best }, plain),
        ("predictor: previous stage", EsdirkSettings { predictor: Predictor::Previous, ..best }, plain),
        ("predictor: quadratic", EsdirkSettings { predictor: Predictor::Stages(3), ..best }, plain),
        ("predictor: cubic", EsdirkSettings { predictor: Predictor::Stages(4), ..best }, plain),
        ("controller: H211b", EsdirkSettings { controller: Controller::H211b, ..best }, plain),
        ("controller: predictive", EsdirkSettings { controller: Controller::Predictive, ..best }, plain),
        ("filtered error", EsdirkSettings { filtered: true, ..best }, plain),
        ("lands by interpolant", best, PassSettings { landing: Landing::Interpolate, ..plain }),
        ("switches 100 times later", best, PassSettings { location: 1e-2, ..plain }),
        ("a third of the step after events", best, PassSettings { after_event: 0.3, ..plain }),
        ("impulse off the interpolant", best, PassSettings { quadrature: true, ..plain }),
    ] {
        add(format!("{} once, {variant}", ESDIRK54.name), None, pass, &SHORT, esdirk(settings));
    }
    for keep in [1.1, 1.3] {
        for (newton, way) in [(newton, "once"), (NewtonSettings::default(), "converged")] {
            let settings = EsdirkSettings { newton: NewtonSettings { keep, ..newton }, ..best };
            let name = format!("{} {way}, matrix kept within {keep}", ESDIRK54.name);
            add(name, None, plain, &SHORT, esdirk(settings));
        }
    }
    list
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    orders::check_all();
    // Cargo passes `--bench` when it runs a benchmark.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return Ok(());
    }
    let document = Document::parse(include_str!("../../examples/zirconia.toml"), "examples/zirconia.toml")?;
    let study = document.study()?;
    let cases: Vec<Settings> = (0..study.case_count()).map(|case| study.settings(case)).collect();
    if arguments.iter().any(|argument| argument == "--costs") {
        measure_costs(&cases[0]);
        return Ok(());
    }
    let precise = EsdirkSettings::new(&ESDIRK54);
    let reference: Vec<ContactRecord> = in_parallel(&cases, |settings| {
        let problem = Problem::new(settings, 1e-9);
        let mut method = Esdirk::new(precise, problem.tolerances, problem.pairs());
        run(&problem, PassSettings::default(), &mut method).expect("the reference reaches its end").0
    });
    let mut rows = Vec::new();
    for candidate in candidates() {
        for &tolerance in candidate.tolerances {
            let row = compare(&candidate, tolerance, &cases, &reference);
            println!(
                "{:60} {tolerance:.0e}  work {:8.0} µs  error {:.1e}, at worst {:.1e}  miscounted {:3}  failed {:3}",
                row.name, row.work, row.median, row.worst, row.miscounted, row.failures
            );
            rows.push(row);
        }
    }
    fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/work_precision.csv"), table(&rows))?;
    fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/work_precision.svg"), plot::draw(&rows))?;
    Ok(())
}

/// The results of `simulate` for all cases, in their order, computed on all cores.
fn in_parallel<R: Send>(cases: &[Settings], simulate: impl Fn(&Settings) -> R + Sync) -> Vec<R> {
    let next = Mutex::new(cases.iter().enumerate());
    let mut results = Vec::new();
    thread::scope(|scope| {
        let work = || {
            let mut results = Vec::new();
            loop {
                let Some((i, case)) = next.lock().expect("nothing panics while holding the list").next() else {
                    return results;
                };
                results.push((i, simulate(case)));
            }
        };
        let threads = thread::available_parallelism().map_or(1, |threads| threads.get());
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        for thread in threads {
            results.extend(thread.join().expect("no case panics"));
        }
    });
    results.sort_by_key(|(i, _)| *i);
    results.into_iter().map(|(_, result)| result).collect()
}

fn compare(candidate: &Candidate, tolerance: f64, cases: &[Settings], reference: &[ContactRecord]) -> Row {
    let results = in_parallel(cases, |settings| {
        let problem = Problem::new(settings, tolerance);
        let mut method = (candidate.make)(&problem);
        let result = run(&problem, candidate.pass, method.as_mut());
        (result, method.distribution())
    });
    let mut errors: [Vec<f64>; 4] = Default::default();
    let (mut total, mut work, mut miscounted, mut distribution) = (Work::default(), 0.0, 0, [0; MAX_ITERATIONS]);
    for ((result, iterations), expected) in results.iter().zip(reference) {
        let Some((record, case_work)) = result else { continue };
        let pairs = [
            (record.impulse, expected.impulse),
            (record.time, expected.time),
            (record.peak_force, expected.peak_force),
            (record.max_deflection, expected.max_deflection),
        ];
        for (errors, (value, expected)) in errors.iter_mut().zip(pairs) {
            errors.push((value / expected - 1.0).abs());
        }
        miscounted += usize::from(record.count != expected.count);
        work += case_work.cost();
        total.add(case_work);
        for (sum, count) in distribution.iter_mut().zip(iterations) {
            *sum += count;
        }
    }
    for errors in &mut errors {
        errors.sort_by(f64::total_cmp);
    }
    let ended = errors[0].len();
    let worst = |errors: &[f64]| errors.last().copied().unwrap_or(f64::NAN);
    Row {
        name: candidate.name.clone(),
        label: candidate.label,
        tolerance,
        cases: ended,
        failures: cases.len() - ended,
        work: work / ended as f64,
        median: errors[0].get(ended / 2).copied().unwrap_or(f64::NAN),
        worst: worst(&errors[0]),
        others: [worst(&errors[1]), worst(&errors[2]), worst(&errors[3])],
        miscounted,
        total,
        distribution,
    }
}

/// All rows as CSV; calls and steps are means per contact.
fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "method,relative_tolerance,failed_cases,work_us,impulse_error_median,impulse_error_worst,\
         contact_time_error_worst,peak_force_error_worst,deflection_error_worst,miscounted_cases,steps,rejected,\
         newton_failures,events,landings,residuals,factorisations,solves,placements,one_iteration_share,\
         two_iterations_share\n",
    );
    for row in rows {
        let Work { steps, rejected, failed, events, landings, residuals, factorisations, solves, placements, .. } =
            row.total;
        let Row { name, tolerance, failures, work, median, worst, others: [time, force, deflection], .. } = row;
        write!(
            text,
            "\"{name}\",{tolerance:.0e},{failures},{work:.0},{median:.2e},{worst:.2e},{time:.2e},{force:.2e},{deflection:.2e},{}",
            row.miscounted
        )
        .expect("a string takes everything");
        for count in [steps, rejected, failed, events, landings, residuals, factorisations, solves, placements] {
            write!(text, ",{:.1}", count as f64 / row.cases as f64).expect("a string takes everything");
        }
        let stages: usize = row.distribution.iter().sum();
        for count in &row.distribution[..2] {
            write!(text, ",{:.3}", *count as f64 / stages.max(1) as f64).expect("a string takes everything");
        }
        text.push('\n');
    }
    text
}

/// Measures the values of [`system::COSTS`] and prints them: the fastest of many blocks of calls, at the start of a pass.
fn measure_costs(settings: &Settings) {
    let problem = Problem::new(settings, 1e-6);
    let (mut system, start) = problem.start();
    let mut result = vec![[0.0; 2]; problem.pairs()];
    let weights = StepWeights { coordinates: 1e-12, rates: 1e-6 };
    let (time, q, v, a) = (start.time, &start.q, &start.v, &start.accelerations);
    system.inner.set_closed(0, problem.pairs() - 1, true);
    let mut measure = |name: &str, call: &mut dyn FnMut(&mut system::Filament, &mut [[f64; 2]])| {
        let block = |system: &mut system::Filament, result: &mut [[f64; 2]]| {
            let start = Instant::now();
            for _ in 0..1000 {
                call(black_box(system), black_box(result));
            }
            start.elapsed().as_secs_f64() * 1e3
        };
        let mut block = block;
        let fastest = (0..200).map(|_| block(&mut system, &mut result)).fold(f64::INFINITY, f64::min);
        println!("{name:16} {fastest:.2} µs");
    };
    measure("residual", &mut |system, result| system.residual(time, q, v, a, result));
    measure("factorisation", &mut |system, _| system.factorise(time, q, v, a, weights, LaneSet::first(1)));
    measure("solve", &mut |system, result| {
        result.fill([1e-9; 2]);
        system.solve(result);
    });
    measure("accelerations", &mut |system, result| system.accelerations(time, q, v, result));
    measure("placement", &mut |system, _| {
        black_box(system.rates(time, q, v, a));
    });
}
