//! The seven findings of the paper (MODEL, "The paper's case"), each with a numeric criterion, on a reduced grid.
//!
//! n = 10 (25 for the findings about n and the measured size), a relative tolerance of 1e-4, whose error is below
//! 0.1 % in every metric used here.

mod common;

use std::sync::LazyLock;

use bristle::metrics::Metrics;
use bristle::simulation::simulate;

const VELOCITIES: [f64; 6] = [2.5, 7.5, 12.5, 17.5, 22.5, 30.0];
const DEPTHS: [f64; 6] = [0.5e-3, 1e-3, 2e-3, 3e-3, 4e-3, 5e-3];

fn metrics(segments: usize, velocity: f64, depth: f64) -> Metrics {
    let mut settings = common::case(segments, velocity, depth);
    settings.solver.relative_tolerance = 1e-4;
    simulate(&settings).expect("the pass ends").metrics
}

/// By depth, then by velocity.
static GRID: LazyLock<Vec<Vec<Metrics>>> = LazyLock::new(|| {
    DEPTHS.iter().map(|&depth| VELOCITIES.iter().map(|&velocity| metrics(10, velocity, depth)).collect()).collect()
});

/// Of one metric, the values over depth at each velocity.
fn columns(metric: fn(&Metrics) -> f64) -> Vec<Vec<f64>> {
    (0..VELOCITIES.len()).map(|i| GRID.iter().map(|row| metric(&row[i])).collect()).collect()
}

fn rows(metric: fn(&Metrics) -> f64) -> Vec<Vec<f64>> {
    GRID.iter().map(|row| row.iter().map(metric).collect()).collect()
}

fn rises(values: &[f64]) -> bool {
    values.windows(2).all(|pair| pair[1] > pair[0])
}

fn falls(values: &[f64]) -> bool {
    values.windows(2).all(|pair| pair[1] < pair[0])
}

/// The first depth at which the motion is sweeping (`ε_tc > 1/2`), by index; the number of depths if none is.
fn tier(velocity: usize) -> usize {
    GRID.iter().position(|row| row[velocity].contact_time_ratio > 0.5).unwrap_or(DEPTHS.len())
}

#[test]
fn deflection_grows_degressively_with_depth_and_with_striking_velocity() {
    for column in columns(|metrics| metrics.max_tip_deflection_m) {
        assert!(rises(&column[1..]), "{column:?}");
        // The slope over the last interval is less than half of the slope from zero to the first depth.
        let last = (column[5] - column[4]) / (DEPTHS[5] - DEPTHS[4]);
        assert!(last < 0.5 * column[0] / DEPTHS[0], "{column:?}");
    }
    for (depth, row) in rows(|metrics| metrics.max_tip_deflection_m).iter().enumerate() {
        let striking: Vec<f64> =
            (0..VELOCITIES.len()).filter(|&velocity| tier(velocity) > depth).map(|velocity| row[velocity]).collect();
        assert!(rises(&striking), "{striking:?}");
    }
}

#[test]
fn contact_time_falls_steeply_with_velocity_most_at_large_depth() {
    let rows = rows(|metrics| metrics.contact_time_s);
    assert!(rows.iter().all(|row| falls(row)), "{rows:?}");
    // A twelvefold velocity takes at least nine tenths of the time away, and more milliseconds at each larger depth.
    assert!(rows.iter().all(|row| row[5] < 0.1 * row[0]), "{rows:?}");
    let losses: Vec<f64> = rows.iter().map(|row| row[0] - row[5]).collect();
    assert!(rises(&losses), "{losses:?}");
}

#[test]
fn contact_time_ratio_has_a_tier_proportional_between_velocity_and_depth() {
    for (velocity, column) in columns(|metrics| metrics.contact_time_ratio).iter().enumerate() {
        let tier = tier(velocity);
        assert!(column[..tier].iter().all(|&ratio| ratio < 0.5), "striking below: {column:?}");
        assert!(column[tier..].iter().all(|&ratio| ratio > 0.5), "sweeping above: {column:?}");
    }
    assert_eq!(tier(0), 0, "slow contacts sweep at every depth");
    // The line moves to larger depths with velocity: between 1 and 4 mm at 30 m/s, in proportion before.
    let tiers: Vec<usize> = (0..VELOCITIES.len()).map(tier).collect();
    assert!(tiers.is_sorted(), "{tiers:?}");
    for (velocity, tier) in VELOCITIES.into_iter().zip(tiers).filter(|&(_, tier)| tier > 0) {
        let (below, above) = (DEPTHS[tier - 1] / velocity, DEPTHS[tier] / velocity);
        // 30 m/s at 3 to 3.5 mm is 1.1e-4 s; the line stays within a factor of two of that slope.
        assert!(below < 2.2e-4 && above > 0.55e-4, "{velocity} m/s: {below:.2e} to {above:.2e} s");
    }
}

#[test]
fn impulse_falls_with_velocity_most_at_large_depth_and_is_low_below_the_tier() {
    let rows = rows(|metrics| metrics.contact_normal_impulse_n_s);
    for (depth, row) in rows.iter().enumerate() {
        let sweeping: Vec<f64> =
            (0..VELOCITIES.len()).filter(|&velocity| tier(velocity) <= depth).map(|velocity| row[velocity]).collect();
        assert!(falls(&sweeping), "{sweeping:?}");
        assert!(row[5] < 0.4 * row[0], "{row:?}");
    }
    let losses: Vec<f64> = rows.iter().map(|row| row[0] - row[5]).collect();
    assert!(rises(&losses), "{losses:?}");
    // Where both kinds of motion occur, the least impulse is struck, and the deepest sweep has a quarter more.
    for (velocity, column) in columns(|metrics| metrics.contact_normal_impulse_n_s).iter().enumerate() {
        if VELOCITIES[velocity] < 15.0 {
            continue;
        }
        let least = (0..DEPTHS.len()).min_by(|&a, &b| column[a].total_cmp(&column[b])).expect("there are depths");
        assert!(least < tier(velocity), "{column:?}");
        assert!(column[5] > 1.25 * column[least], "{column:?}");
    }
}

#[test]
fn tool_force_is_high_at_high_velocity_linear_in_depth_only_when_slow() {
    let columns = columns(|metrics| metrics.tool_contact_normal_force_n);
    let mean = |column: &[f64]| column.iter().sum::<f64>() / column.len() as f64;
    assert!(mean(&columns[5]) > mean(&columns[0]), "{columns:?}");
    // Straight line through the depths: the worst residual against the range of the values.
    let misfit = |column: &[f64]| {
        let (x, y) = (mean(&DEPTHS), mean(column));
        let slope = DEPTHS.iter().zip(column).map(|(d, f)| (d - x) * (f - y)).sum::<f64>()
            / DEPTHS.iter().map(|d| (d - x).powi(2)).sum::<f64>();
        let residuals = DEPTHS.iter().zip(column).map(|(d, f)| (f - y - slope * (d - x)).abs());
        let (low, high) = column.iter().fold((f64::MAX, f64::MIN), |(low, high), &f| (low.min(f), high.max(f)));
        residuals.fold(0.0, f64::max) / (high - low)
    };
    assert!(misfit(&columns[0]) < 0.1, "{columns:?}");
    assert!(columns[4..].iter().all(|column| misfit(column) > 0.15), "{columns:?}");
}

#[test]
fn tool_force_has_a_local_maximum_along_the_tier_from_a_second_contact() {
    let velocities: Vec<f64> = (3..=12).map(|i| 2.5 * f64::from(i)).collect();
    let mut peak_velocities = Vec::new();
    for depth in [1e-3, 2e-3, 3e-3] {
        let row: Vec<Metrics> = velocities.iter().map(|&velocity| metrics(10, velocity, depth)).collect();
        let forces: Vec<f64> = row.iter().map(|metrics| metrics.tool_contact_normal_force_n).collect();
        let rising_again = |i: &usize| forces[*i] > forces[i - 1] && forces[*i] > 1.02 * forces[i + 1];
        let peak = (1..forces.len() - 1).find(rising_again).unwrap_or_else(|| panic!("no maximum in {forces:?}"));
        // On the tier: between the plateau of sweeping and that of striking, and with more contacts than the latter.
        let ratio = row[peak].contact_time_ratio;
        assert!((0.3..0.6).contains(&ratio), "ε_tc = {ratio} at {} m/s", velocities[peak]);
        let striking = row.last().expect("there are velocities");
        assert!(striking.contact_time_ratio < 0.35, "the row crosses the tier");
        let (peak_count, striking_count) = (row[peak].contact_count, striking.contact_count);
        assert!(peak_count > striking_count, "{depth} m: {peak_count} and {striking_count} contacts, {forces:?}");
        peak_velocities.push(velocities[peak]);
    }
    assert!(rises(&peak_velocities), "it moves along the line: {peak_velocities:?}");
}

#[test]
fn more_than_25_segments_change_nothing_noticeable() {
    for (velocity, depth) in [(10.0, 1e-3), (2.5, 5e-3), (30.0, 5e-3)] {
        let (paper, fine) = (metrics(25, velocity, depth), metrics(50, velocity, depth));
        let change = paper.tool_contact_normal_force_n / fine.tool_contact_normal_force_n - 1.0;
        assert!(change.abs() < 5e-3, "{change:.1e}");
    }
}

#[test]
fn tool_force_lies_in_the_measured_order_of_magnitude() {
    for metrics in GRID.iter().flatten() {
        let force = metrics.tool_contact_normal_force_n;
        assert!((50.0..800.0).contains(&force), "{force} N");
    }
}
