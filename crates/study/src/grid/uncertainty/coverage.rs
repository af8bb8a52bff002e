//! Tests of intervals: their ends against many samples, and the share of true forces inside.

use bristle::model::settings::Settings;
use spec_math::cephes64::ndtri;

use super::ForceScatter;
use super::scatter::standard_normal;
use crate::grid::{CaseResult, Study, run_study};

/// Coefficient of friction and its standard deviation that first files state on dry steel and on wet
/// wood.
const DRY_STEEL: [f64; 2] = [0.4, 0.1];
const WET_WOOD: [f64; 2] = [0.35, 0.125];
/// Relative standard deviation of the modulus that first files state.
const MODULUS_SPREAD: f64 = 0.22;

/// Returns the brush of a first file, whose filaments are alone and have few segments.
fn first_brush(
    [friction, std]: [f64; 2],
    [length_m, diameter_m]: [f64; 2],
    velocity_m_s: f64,
) -> Settings {
    let mut settings = Settings::paper(velocity_m_s, 2e-3);
    settings.filament.segments = 4;
    settings.filament.length_m = length_m;
    settings.filament.diameter_m = diameter_m;
    settings.contact.friction_coefficient = friction;
    settings.uncertainty.friction_coefficient_std = std;
    settings.uncertainty.youngs_modulus_std_pa =
        MODULUS_SPREAD * settings.filament.youngs_modulus_pa;
    settings
}

fn results(cases: Vec<Settings>) -> Vec<CaseResult> {
    run_study(&Study::of_cases(cases), None, || ()).expect("threads")
}

fn scatters(cases: Vec<Settings>) -> Vec<ForceScatter> {
    results(cases)
        .into_iter()
        .map(|result| result.expect("a case").scatter.expect("a distribution"))
        .collect()
}

/// Brushes that sweep, strike and are near the line between both.
fn brushes() -> [Settings; 3] {
    [
        first_brush(DRY_STEEL, [0.040, 1.18e-3], 5.0),
        first_brush(WET_WOOD, [0.035, 1.0e-3], 15.0),
        first_brush(DRY_STEEL, [0.030, 0.6e-3], 25.0),
    ]
}

/// An end of an interval is off by at most 0.13 of its width, as docs/trust.md says of all inputs.
#[test]
fn few_samples_give_the_interval_of_many() {
    let many = brushes().map(|mut settings| {
        settings.uncertainty.samples = 512;
        settings.uncertainty.seed = 2;
        settings
    });
    let (few, many) = (scatters(brushes().into()), scatters(many.into()));
    for (few, many) in few.iter().zip(&many) {
        let [lower, upper] = many.band();
        let width = upper - lower;
        let medians = [few, many].map(|scatter| scatter.tool_force_median_n);
        for (found, expected) in few
            .band()
            .into_iter()
            .zip([lower, upper])
            .chain([medians.into()])
        {
            let off = (found - expected).abs() / width;
            assert!(
                off < 0.13,
                "{found} N instead of {expected} N, {off} of the width"
            );
        }
    }
}

/// True brushes have any friction of the stated range, and moduli with the stated deviation.
#[test]
fn intervals_contain_95_percent_of_true_forces() {
    const TRUE_BRUSHES: u32 = 100;
    const SEED: u32 = 62;
    // Known ranges of friction, of which first files state the middles.
    let ranges = [[0.2, 0.6], [0.1, 0.6], [0.2, 0.6]];
    for (stated, [least, largest]) in brushes().into_iter().zip(ranges) {
        let band = scatters(vec![stated.clone()])[0].band();
        let truth = |index: u32| {
            let mut brush = stated.clone();
            brush.uncertainty = Settings::paper(1.0, 1e-3).uncertainty;
            let share = f64::from(sobol_burley::sample(index, 0, SEED));
            brush.contact.friction_coefficient = least + share * (largest - least);
            brush.filament.youngs_modulus_pa *=
                1.0 + MODULUS_SPREAD * standard_normal(index, 1, SEED);
            brush
        };
        let forces = results((0..TRUE_BRUSHES).map(truth).collect());
        let inside = forces
            .iter()
            .map(|result| {
                let metrics = &result.as_ref().expect("a true brush").metrics;
                metrics.tool_contact_normal_force_n
            })
            .filter(|force| (band[0]..=band[1]).contains(force))
            .count();
        assert!(
            (90..=99).contains(&inside),
            "{inside} of {TRUE_BRUSHES} are in {band:?} N"
        );
    }
}

/// The two halves of a normal distribution meet at the median, and end at 2.5 and 97.5 %.
#[test]
fn shares_below_a_force_follow_from_the_interval() {
    let quantiles = [40.0, 60.0, 100.0];
    for (force, expected) in [(40.0, 0.025), (60.0, 0.5), (100.0, 0.975)] {
        let share = super::share_below(force, quantiles);
        assert!((share - expected).abs() < 1e-12, "{share}");
    }
    let upper_quartile = 60.0 + 40.0 * ndtri(0.75) / ndtri(0.975);
    assert!((super::share_below(upper_quartile, quantiles) - 0.75).abs() < 1e-12);
}
