//! Studies whose filaments scatter: sampled tools are simulated like any other, and their forces
//! obey known mechanics.

use bristle::simulation::simulate;
use bristle_app::report::drawing::format::Format;
use bristle_app::report::figures::study_figures;
use bristle_app::report::tables::study_tables;
use bristle_study::grid::uncertainty::Scatter;
use bristle_study::grid::{CaseResult, CaseSummary, Study, run_study};
use bristle_study::text::layout::WIDTH;

use crate::program::{self, Workspace, brush, has, is_near, lacks, words};

const FILE: &str = concat!(
    brush!(8, "filament_count_uncertainty = 600\n"),
    "
[solver]
relative_tolerance = 1e-4

[study]
brushing_velocity_m_s = [1.0, 20.0]
penetration_depth_m = [2.0e-3]
"
);
const UNCERTAINTY: &str = "
[uncertainty]
diameter_std_m = 0.02e-3
youngs_modulus_std_pa = 0.2e9
samples = 64
";

fn summaries(study: &Study) -> Vec<CaseSummary> {
    run_study(study, None, || {})
        .expect("threads")
        .into_iter()
        .map(|result| result.expect("a pass"))
        .collect()
}

#[test]
fn tools_of_a_study_are_simulated_as_alone() {
    let study = program::study(&format!("{FILE}{UNCERTAINTY}"));
    for (case, summary) in summaries(&study).iter().enumerate() {
        let settings = study.settings(case);
        let scatter = Scatter::of(&settings).expect("filaments scatter");
        let impulse = |tool| {
            let settings = scatter.settings(tool).expect("it reaches the workpiece");
            simulate(&settings)
                .map(|simulation| simulation.metrics.contact_normal_impulse_n_s)
                .ok()
        };
        let impulses: Vec<Option<f64>> = (0..scatter.count()).map(impulse).collect();
        assert_eq!(summary.scatter, scatter.reduce(&impulses));
        assert_eq!(
            summary.metrics,
            simulate(&settings).expect("a pass").metrics
        );
    }
}

#[test]
fn cases_with_and_without_scatter_mix() {
    let file = FILE
        .replace("segments = 8", "segments = 2")
        .replace("1e-4", "1e-2");
    let study = program::study(&format!(
        "{file}\"uncertainty.diameter_std_m\" = [0.0, 0.02e-3]\n[uncertainty]\nsamples = 64\n"
    ));
    let summaries = summaries(&study);
    assert!(
        summaries
            .iter()
            .map(|summary| summary.scatter.is_some())
            .eq([false, false, true, true])
    );
    let results: Vec<CaseResult> = summaries.into_iter().map(Ok).collect();
    let tables = study_tables(&study, &results, None, WIDTH);
    lacks(&tables, &["failed"]);
    let without_band = tables.lines().filter(|line| line.ends_with('–')).count();
    assert_eq!(without_band, 2, "{tables}");
    let pictures = study_figures(&study, &results, &[], &Format::default()).pictures;
    let names = pictures.iter().map(|picture| picture.name.as_str());
    let names: Vec<&str> = names.filter(|name| name.starts_with("scatter_")).collect();
    assert_eq!(
        names,
        ["scatter_over_velocity", "scatter_over_diameter_std_m"]
    );
}

/// A slowly bent filament is a spring: its force is proportional to `E I`, and thus to `E d⁴`.
#[test]
fn a_slow_filament_scatters_as_a_spring() {
    let file = FILE.replace("[1.0, 20.0]", "[1.0]");
    let study = program::study(&format!(
        "{file}{}",
        UNCERTAINTY.replace("samples = 64", "samples = 256")
    ));
    let summary = summaries(&study).remove(0);
    let scatter = summary.scatter.expect("filaments scatter");
    // Moments of E/E_0 and of (d/d_0)⁴ from those of normal distributions, then of the product with
    // N_f.
    let (e, d, n) = (0.2 / 3.0, 0.02 / 1.18, 600.0 / 10_500.0);
    let mean_d4 = 1.0 + 6.0 * d * d + 3.0 * f64::powi(d, 4);
    let second_d4 = 1.0
        + 28.0 * d * d
        + 210.0 * f64::powi(d, 4)
        + 420.0 * f64::powi(d, 6)
        + 105.0 * f64::powi(d, 8);
    let second = (1.0 + e * e) * second_d4 * (1.0 + n * n);
    let variance = second - mean_d4 * mean_d4;
    let expected = [
        (
            scatter.tool_force_mean_n / summary.metrics.tool_contact_normal_force_n,
            mean_d4,
            0.001,
        ),
        (
            scatter.tool_force_std_n / scatter.tool_force_mean_n,
            variance.sqrt() / mean_d4,
            0.005,
        ),
        (
            scatter.sobol_diameter,
            (second_d4 - mean_d4 * mean_d4) / variance,
            0.01,
        ),
        (
            scatter.sobol_youngs_modulus,
            e * e * mean_d4 * mean_d4 / variance,
            0.01,
        ),
        (
            scatter.sobol_filament_count,
            n * n * mean_d4 * mean_d4 / variance,
            0.01,
        ),
    ];
    for (found, expected, tolerance) in expected {
        is_near(found, expected, tolerance);
    }
    assert_eq!(
        (scatter.sobol_length, scatter.sobol_damping_ratio),
        (0.0, 0.0)
    );
}

#[test]
fn a_study_with_scatter_resumes_and_is_redrawn() {
    let directory = Workspace::with(&format!(
        "{FILE}{UNCERTAINTY}\n[measured]\nfile = \"forces.csv\"\n"
    ));
    let measured = "brushing_velocity_m_s,penetration_depth_m,force_n,std_n\n20.0,2.0e-3,250,20\n";
    directory.write("forces.csv", measured);
    let told = words(&directory.printed("study case.toml --out whole"));
    has(
        &told,
        &["95 % of the tools", "The scatter of F_n,w comes from: "],
    );
    has(
        &directory.read("whole/measured_comparison.csv"),
        &[",simulated_lower_95_n,simulated_upper_95_n,"],
    );

    // The journal of a study that was stopped after its first case.
    let journal = directory.read("whole/journal.jsonl");
    let begun: String = journal.split_inclusive('\n').take(2).collect();
    directory.make("resumed");
    directory.write("resumed/journal.jsonl", begun);
    let said = directory.said("study case.toml --out resumed --threads 1");
    has(&said, &["1 of 2 cases"]);
    directory.run("report whole --out again");
    let [whole, again] = ["whole", "again"].map(|out| directory.files(&format!("{out}/figures")));
    assert!(whole == again, "figures differ");
    let [whole, resumed] = ["whole", "resumed"].map(|out| directory.results(out));
    assert!(whole.contains_key("figures/sobol_over_velocity.svg"));
    assert!(whole == resumed, "results differ");
}
