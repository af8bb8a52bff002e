//! Time and work of passes that take long: without damping, slow, finely divided, stiff.
//!
//! ```text
//! cargo bench --bench slow                          # 60 passes of each sampler
//! cargo bench --bench slow -- 200 7                 # 200 of each, with the seed 7
//! cargo bench --bench slow -- 200 7 extreme         # of one sampler
//! ```
//!
//! Each pass runs alone. Times are those of the processor, where Linux counts them, so that other
//! programs do not matter. Two lines state a pass, its work and its settings; a last line sums up.

mod sampler;

use std::sync::LazyLock;
use std::time::Instant;

use bristle::integrate::tableau::ESDIRK54;
use bristle::integrate::{SecondOrderSystem, Stepper};
use bristle::model::settings::Settings;
use bristle::simulation::{Form, IntegrationError, Pass, Statistics};

use sampler::{SAMPLERS, Sampler};

/// No pass may take longer.
const LIMIT_S: f64 = 20.0;
/// A pass is given up after this time.
const PATIENCE_S: f64 = 25.0;

/// Time of the processor that this thread has used, in s; elsewhere than on Linux, time since the
/// first call.
fn processor_seconds() -> f64 {
    static BEGUN: LazyLock<Instant> = LazyLock::new(Instant::now);
    let begun = *BEGUN;
    let counted = std::fs::read_to_string("/proc/thread-self/schedstat");
    let nanoseconds = counted
        .ok()
        .and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(
        || begun.elapsed().as_secs_f64(),
        |nanoseconds| 1e-9 * nanoseconds,
    )
}

/// What became of a pass, in words.
enum Outcome {
    Done(String),
    Refused(String),
    Failed(String),
}

fn main() {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|argument| argument != "--bench")
        .collect();
    let count = arguments.first().map_or(60, |text| {
        text.parse()
            .expect("the first argument is a number of passes")
    });
    let seed = arguments.get(1).map_or(1, |text| {
        text.parse().expect("the second argument is a seed")
    });
    for sampler in SAMPLERS {
        if arguments.get(2).is_none_or(|name| name == sampler.name) {
            measure(sampler, count, seed);
        }
    }
}

/// Measures `count` passes and prints them.
fn measure(sampler: &Sampler, count: usize, seed: u64) {
    let mut random = fastrand::Rng::with_seed(seed);
    let (mut seconds, mut refused, mut failed) = (Vec::new(), 0, 0);
    println!("# {}: {}", sampler.name, sampler.meaning);
    for number in 0..count {
        let settings = (sampler.draw)(&mut random);
        let begun = processor_seconds();
        let (outcome, work) = run(&settings);
        let taken = processor_seconds() - begun;
        let text = match outcome {
            Outcome::Done(text) => text,
            Outcome::Refused(text) => {
                refused += 1;
                text
            }
            Outcome::Failed(text) => {
                failed += 1;
                text
            }
        };
        seconds.push(taken);
        let Statistics {
            steps,
            unresolved_steps,
            rejected_steps,
            newton_iterations,
            newton_failures,
            contact_events,
            ..
        } = work;
        println!(
            "{number:4} {taken:6.2} s, steps {steps} unresolved {unresolved_steps} rejected {rejected_steps} iterations {newton_iterations} failures {newton_failures} events {contact_events}; {text}\n       {}",
            brief(&settings)
        );
    }
    seconds.sort_by(f64::total_cmp);
    let late = seconds.iter().filter(|seconds| **seconds > LIMIT_S).count();
    println!(
        "# {}: {count} passes, median {:.3} s, longest {:.1} s, {late} above {} s, {refused} refused, {failed} failed",
        sampler.name,
        seconds[seconds.len() / 2],
        seconds[seconds.len() - 1],
        LIMIT_S,
    );
}

/// The settings that matter to the work, in one line.
fn brief(settings: &Settings) -> String {
    let (f, c, p) = (&settings.filament, &settings.contact, &settings.process);
    format!(
        "n {} l {:.3e} d {:.3e} rho {:.3e} E {:.3e} zeta {:.1e} tilt {:.1e}; k {:.2e} p {:.2} chi {:.1e} mu {:.2} vreg {:.1e}; v {:.2e} a {:.2e} tol {:.0e} normal {:?} g {:?}",
        f.segments,
        f.length_m,
        f.diameter_m,
        f.density_kg_m3,
        f.youngs_modulus_pa,
        f.damping_ratio,
        f.lateral_tilt_rad,
        c.stiffness_n_m,
        c.exponent,
        c.damping_s_m,
        c.friction_coefficient,
        c.friction_regularisation_m_s,
        p.brushing_velocity_m_s,
        p.penetration_depth_m,
        settings.solver.relative_tolerance,
        settings.workpiece.kind.normal(),
        p.gravity_m_s2
    )
}

/// Simulates one pass, with patience.
fn run(settings: &Settings) -> (Outcome, Statistics) {
    if let Err(violation) = settings.check() {
        return (
            Outcome::Refused(format!("refused: {violation}")),
            Statistics::default(),
        );
    }
    let pass = Pass::new(settings);
    let mut system = pass.system(false);
    let mut trajectory = pass.trajectory(&mut system);
    let mut observer = pass.observer();
    let solution = system.filament(0).stage_solution();
    let mut stepper = Stepper::new(&ESDIRK54, solution, system.blocks());
    stepper.set_tolerances(0, trajectory.tolerances());
    let begun = processor_seconds();
    let end = pass.end_time();
    let failed = |error: IntegrationError| Outcome::Failed(format!("FAILED: {error}"));
    loop {
        match trajectory.next_step(&system) {
            Ok(Some(step)) => {
                system.set_charts(&trajectory.start().charts);
                trajectory.prepare(0, &mut stepper);
                stepper.attempt(&mut system, step);
                if let Err(error) =
                    trajectory.conclude(0, &stepper, &mut system, |step| observer.observe(step))
                {
                    return (failed(error), trajectory.statistics());
                }
            }
            Ok(None) => break,
            Err(error) => return (failed(error), trajectory.statistics()),
        }
        if processor_seconds() - begun > PATIENCE_S {
            let share = 100.0 * (trajectory.start().time / end);
            return (
                Outcome::Failed(format!("GIVEN UP at {share:.1} % of the pass")),
                trajectory.statistics(),
            );
        }
    }
    let m = pass.metrics(observer.record());
    let form = if pass.form() == Form::Planar {
        "planar"
    } else {
        "spatial"
    };
    let text = format!(
        "{form} p_n {:.6e} t/t {:.6e} peak {:.5e} lateral {:.4e}",
        m.contact_normal_impulse_n_s,
        m.contact_time_ratio,
        m.peak_contact_normal_force_n,
        m.lateral_amplification
    );
    (Outcome::Done(text), trajectory.statistics())
}
