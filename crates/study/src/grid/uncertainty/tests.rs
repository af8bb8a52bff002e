//! Tests of sampled tools and of the reduction of their forces.

use bristle::model::settings::Settings;
use spec_math::cephes64::{ndtr, ndtri};

use super::indices::mean_and_variance;
use super::inputs::get;
use super::{ForceScatter, INPUTS, Input, MOVING, Scatter, quantile, scatter_text};

fn settings(uncertainty: &str) -> Settings {
    let text = format!(
        "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\nfilament_count = 1000\nfilament_count_uncertainty = 50\n\
         [filament]\nlength_m = 0.040\ndiameter_m = 1.0e-3\n[process]\nbrushing_velocity_m_s = 18.0\n\
         penetration_depth_m = 1.0e-3\n[uncertainty]\n{uncertainty}"
    );
    toml::from_str(&text).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn without_scattering_filaments_there_are_no_tools() {
    assert!(Scatter::of(&settings("samples = 64")).is_none());
    assert!(Scatter::of(&settings("damping_ratio_std = 1e-3")).is_some());
}

#[test]
fn inputs_have_their_means_and_deviations_and_are_independent() {
    let stds = "length_std_m = 1e-4\ndiameter_std_m = 2e-5\nyoungs_modulus_std_pa = 3e8\ndamping_ratio_std = 5e-3\n\
                waviness_amplitude_std_m = 2e-4\nwaviness_phase_std_rad = 0.5\n";
    let scatter =
        Scatter::of(&settings(&format!("{stds}samples = 4096\nseed = 9"))).expect("tools");
    let tools: Vec<Settings> = (0..scatter.count())
        .map(|tool| scatter.settings(tool).expect("a tool"))
        .collect();
    let column = |input: &Input| {
        tools
            .iter()
            .map(|tool| get(input.mean, tool))
            .collect::<Vec<_>>()
    };
    let columns: Vec<Vec<f64>> = INPUTS[..MOVING].iter().map(column).collect();
    let expected = [
        (0.04, 1e-4),
        (1e-3, 2e-5),
        (3e9, 3e8),
        (0.05, 5e-3),
        (0.0, 2e-4),
        (0.0, 0.5),
    ];
    for (values, (mean, std)) in columns.iter().zip(expected) {
        let (found_mean, variance) = mean_and_variance(values);
        assert!((found_mean - mean).abs() < 0.002 * std, "{found_mean}");
        assert!(
            (variance.sqrt() / std - 1.0).abs() < 0.005,
            "{}",
            variance.sqrt()
        );
    }
    for (a, (mean_a, std_a)) in columns.iter().zip(expected) {
        for (b, (mean_b, std_b)) in columns
            .iter()
            .zip(expected)
            .filter(|(b, _)| !std::ptr::eq(*b, a))
        {
            let products = a.iter().zip(b).map(|(a, b)| (a - mean_a) * (b - mean_b));
            let correlation = products.sum::<f64>() / (a.len() as f64 * std_a * std_b);
            assert!(correlation.abs() < 0.01, "{correlation}");
        }
    }
    // Settings that are not sampled keep their values.
    assert!(
        tools
            .iter()
            .all(|tool| tool.tool == settings("").tool && tool.process == settings("").process)
    );
}

/// The moments of a normal distribution without its part below zero are known (Johnson, Kotz
/// and Balakrishnan 1994).
#[test]
fn friction_is_cut_at_zero() {
    for (mean, std) in [(0.3_f64, 0.05), (0.1, 0.1), (0.0, 0.2)] {
        let text = format!(
            "friction_coefficient_std = {std}\nsamples = 16384\n[contact]\nfriction_coefficient = {mean}"
        );
        let scatter = Scatter::of(&settings(&text)).expect("tools");
        let friction = |tool| {
            scatter
                .settings(tool)
                .expect("a tool")
                .contact
                .friction_coefficient
        };
        let values: Vec<f64> = (0..scatter.count()).map(friction).collect();
        assert!(values.iter().all(|&value| value >= 0.0));
        let ratio = mean / std;
        let hazard = (-0.5 * ratio * ratio).exp() / std::f64::consts::TAU.sqrt() / ndtr(ratio);
        let (found, variance) = mean_and_variance(&values);
        assert!(
            (found - (mean + std * hazard)).abs() < 1e-3 * std,
            "{found}"
        );
        let expected = std * std * (1.0 - ratio * hazard - hazard * hazard);
        assert!(
            (variance / expected - 1.0).abs() < 2e-3,
            "{variance}, not {expected}"
        );
    }
    let text = |contact: &str| {
        scatter_text(&settings(&format!(
            "friction_coefficient_std = 0.1\n[contact]\n{contact}"
        )))
    };
    for (contact, beginning) in [
        ("friction_coefficient = 0.4", "µ ± 25 %, N_f"),
        ("", "µ ± 0.1, N_f"),
    ] {
        assert!(text(contact).starts_with(beginning), "{}", text(contact));
    }
}

#[test]
fn a_sampled_filament_keeps_its_taper() {
    let mut settings = settings("diameter_std_m = 2e-5");
    settings.filament.tip_diameter_m = Some(0.6e-3);
    let scatter = Scatter::of(&settings).expect("tools");
    for tool in 0..scatter.count() {
        let filament = scatter.settings(tool).expect("a tool").filament;
        assert!((filament.tip_diameter_m() / filament.diameter_m - 0.6).abs() < 1e-15);
    }
    assert_eq!(scatter_text(&settings), "d ± 2 %, N_f ± 5 %");
    settings.uncertainty.waviness_amplitude_std_m = 2e-4;
    assert_eq!(scatter_text(&settings), "d ± 2 %, A ± 0.0002 m, N_f ± 5 %");
}

#[test]
fn what_is_held_is_process_or_machine() {
    let tools = |hold: &str| {
        let scatter = Scatter::of(&settings(&format!(
            "length_std_m = 5e-4\nhold = \"{hold}\""
        )))
        .expect("tools");
        (0..scatter.count())
            .map(|tool| scatter.settings(tool))
            .collect::<Vec<_>>()
    };
    let (process, machine) = (tools("process"), tools("machine"));
    for (process, machine) in process.iter().zip(&machine) {
        let process = process
            .as_ref()
            .expect("each tool is set up to reach the workpiece");
        assert_eq!(process.process.penetration_depth_m, 1e-3);
        let longer = process.filament.length_m - 0.040;
        // Two standard deviations equal the depth.
        assert_eq!(machine.is_some(), longer > -1e-3);
        let Some(machine) = machine else { continue };
        assert!((machine.process.penetration_depth_m - 1e-3 - longer).abs() < 1e-15);
        assert!((machine.process.brushing_velocity_m_s / 18.0 - 1.0 - longer / 0.18).abs() < 1e-14);
    }
    assert!(machine.iter().any(Option::is_none));
}

/// A force per filament of `1 N · (1 + z/10)`, times 1000 ± 50 filaments.
#[test]
fn a_product_is_reduced_to_its_moments() {
    let scatter = Scatter::of(&settings("diameter_std_m = 2e-5\nsamples = 16384")).expect("tools");
    let rate = settings("").angular_velocity_rad_s();
    let impulse = |tool: usize| {
        let diameter = scatter.settings(tool).expect("a tool").filament.diameter_m;
        std::f64::consts::TAU / rate * (1.0 + 0.1 * (diameter - 1e-3) / 2e-5)
    };
    let mut impulses: Vec<Option<f64>> = (0..scatter.count())
        .map(|tool| Some(impulse(tool)))
        .collect();
    let reduced = scatter.reduce(&impulses).expect("no simulation failed");
    let variance = 0.01_f64 * 1e6 + 2500.0 + 0.01 * 2500.0;
    let near = |found: f64, expected: f64, tolerance: f64| {
        assert!(
            (found / expected - 1.0).abs() < tolerance,
            "{found}, not {expected}"
        );
    };
    near(reduced.tool_force_mean_n, 1000.0, 1e-4);
    near(reduced.tool_force_std_n, variance.sqrt(), 1e-3);
    near(reduced.sobol_diameter, 1e4 / variance, 1e-3);
    near(reduced.sobol_filament_count, 2500.0 / variance, 1e-3);
    assert_eq!(
        [
            reduced.sobol_length,
            reduced.sobol_youngs_modulus,
            reduced.sobol_damping_ratio
        ],
        [0.0; 3]
    );
    // The distribution is nearly normal, because the product of the deviations is small.
    near(
        reduced.tool_force_lower_95_n,
        1000.0 - 1.96 * variance.sqrt(),
        0.01,
    );
    near(
        reduced.tool_force_upper_95_n,
        1000.0 + 1.96 * variance.sqrt(),
        0.01,
    );

    impulses
        .iter_mut()
        .step_by(3)
        .for_each(|impulse| *impulse = None);
    let with_failures = scatter.reduce(&impulses).expect("most are there");
    assert_eq!(with_failures.failed_samples, 16384_usize.div_ceil(3));
    near(with_failures.tool_force_std_n, variance.sqrt(), 0.03);
    impulses
        .iter_mut()
        .skip(1)
        .step_by(3)
        .for_each(|impulse| *impulse = None);
    assert_eq!(scatter.reduce(&impulses), None);
}

/// The gradient of a force of `1 N · (1 + 3 z/100 + 4 z'/100)` leads to both ends.
#[test]
fn ends_of_the_band_are_the_most_probable_tools_there() {
    let stds = "diameter_std_m = 2e-5\nyoungs_modulus_std_pa = 3e8\ndamping_ratio_std = 5e-3";
    let scatter = Scatter::of(&settings(&format!("{stds}\nsamples = 16384"))).expect("tools");
    let deviations = |scatter: &Scatter, tool| {
        let filament = scatter.settings(tool).expect("a tool").filament;
        let [diameter, modulus] = [filament.diameter_m, filament.youngs_modulus_pa];
        [(diameter - 1e-3) / 2e-5, (modulus - 3e9) / 3e8]
    };
    let impulses: Vec<Option<f64>> = (0..scatter.count())
        .map(|tool| {
            let [diameter, modulus] = deviations(&scatter, tool);
            Some(1.0 + 0.03 * diameter + 0.04 * modulus)
        })
        .collect();
    let (ends, positions) = scatter.ends(&impulses).expect("a force that varies");
    let distance = ndtri(0.975);
    for (end, sign) in [-1.0, 1.0].into_iter().enumerate() {
        for (found, share) in deviations(&ends, end).into_iter().zip([0.6, 0.8]) {
            // The samples are uncorrelated to 0.002, as above.
            assert!((found - sign * share * distance).abs() < 0.01, "{found}");
        }
    }
    for (tool, position) in positions.into_iter().enumerate() {
        let [diameter, modulus] = deviations(&scatter, tool);
        let expected = (0.6 * diameter + 0.8 * modulus) / distance;
        assert!((position - expected).abs() < 0.02, "{position}");
    }
    assert!(scatter.ends(&vec![Some(0.0); scatter.count()]).is_none());
}

#[test]
fn no_force_has_no_scatter() {
    let scatter = Scatter::of(&settings("diameter_std_m = 2e-5")).expect("tools");
    assert_eq!(
        scatter.reduce(&[Some(0.0); 128]),
        Some(ForceScatter::default())
    );
}

#[test]
fn quantiles_are_interpolated() {
    let found = [0.0, 0.125, 0.25, 0.5, 0.625, 0.875, 1.0]
        .map(|share| quantile(&[1.0, 2.0, 4.0, 8.0], share));
    assert_eq!(found, [1.0, 1.0, 1.5, 3.0, 4.0, 8.0, 8.0]);
}
