//! The findings of the paper, on its grid.

use std::sync::OnceLock;

use bristle::model::metrics::Metrics;
use bristle::model::parameters::Parameter;
use bristle::simulation::{Pass, simulate_with_history};
use bristle_study::grid::{DEPTH, Study, Sweep, VELOCITY, run_study};

use super::chains::{lesser, paper_case, paper_study, worse};
use super::tolerances::Tolerance;
use super::trial::{Failure, Trial, TrialResult};
use super::{sources, tolerances};

/// The metrics of a study over depth and velocity.
#[derive(Clone, Debug)]
struct PaperGrid {
    velocities: Vec<f64>,
    depths: Vec<f64>,
    /// Rows by depth, columns by velocity.
    metrics: Vec<Vec<Metrics>>,
}

impl PaperGrid {
    /// The grid of the paper with 25 segments, computed once for all findings.
    fn paper() -> Result<&'static Self, Failure> {
        static GRID: OnceLock<Result<PaperGrid, String>> = OnceLock::new();
        GRID.get_or_init(|| Self::new(25.0).map_err(|failure| failure.to_string()))
            .as_ref()
            .map_err(|message| message.clone().into())
    }

    /// The grid of the paper with `segments` segments.
    fn new(segments: f64) -> Result<Self, Failure> {
        let paper = paper_study()?;
        let parameter = Parameter::find("filament.segments").ok_or("no such setting")?;
        let mut axes = vec![Sweep::list(parameter, vec![segments])?];
        axes.extend(paper.sweeps().iter().cloned());
        let study = Study::new(paper.settings(0), axes)?;
        let values = |path: &str| {
            let axis = study.sweep(path);
            axis.map(|axis| axis.values().to_vec()).unwrap_or_default()
        };
        let (velocities, depths) = (values(VELOCITY), values(DEPTH));
        let results = run_study(&study, None, || ())?;
        let metrics = results
            .iter()
            .map(|result| result.as_ref().map(|summary| summary.metrics.clone()));
        let metrics: Vec<Metrics> = metrics.collect::<Result<_, _>>().map_err(String::clone)?;
        Ok(Self {
            metrics: metrics
                .chunks(velocities.len())
                .map(<[Metrics]>::to_vec)
                .collect(),
            velocities,
            depths,
        })
    }

    /// One metric at each depth, over the velocities.
    fn rows(&self, metric: fn(&Metrics) -> f64) -> Vec<Vec<f64>> {
        self.metrics
            .iter()
            .map(|row| row.iter().map(metric).collect())
            .collect()
    }

    /// One metric at each velocity, over the depths.
    fn columns(&self, metric: fn(&Metrics) -> f64) -> Vec<Vec<f64>> {
        (0..self.velocities.len())
            .map(|i| self.metrics.iter().map(|row| metric(&row[i])).collect())
            .collect()
    }

    /// The first depth, by index, at which a pass at a velocity is sweeping, `ε_tc > ½`; the number
    /// of depths if none is.
    fn tier(&self, velocity: usize) -> usize {
        self.metrics
            .iter()
            .position(|row| row[velocity].contact_time_ratio > 0.5)
            .unwrap_or(self.depths.len())
    }

    /// `true` if the pass is striking.
    fn strikes(&self, depth: usize, velocity: usize) -> bool {
        depth < self.tier(velocity)
    }
}

/// The smallest ratio of neighbours; NaN if there are none.
fn least_growth(values: &[f64]) -> f64 {
    values
        .windows(2)
        .map(|pair| pair[1] / pair[0])
        .reduce(lesser)
        .unwrap_or(f64::NAN)
}

/// The largest ratio of neighbours; NaN if there are none.
fn most_growth(values: &[f64]) -> f64 {
    values
        .windows(2)
        .map(|pair| pair[1] / pair[0])
        .reduce(worse)
        .unwrap_or(f64::NAN)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Slope and offset of the least-squares line through points.
fn line(x: &[f64], y: &[f64]) -> [f64; 2] {
    let (x_mean, y_mean) = (mean(x), mean(y));
    let products: f64 = x
        .iter()
        .zip(y)
        .map(|(x, y)| (x - x_mean) * (y - y_mean))
        .sum();
    let slope = products / x.iter().map(|x| (x - x_mean).powi(2)).sum::<f64>();
    [slope, y_mean - slope * x_mean]
}

/// The least and the largest value.
fn extremes(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [lesser(value, low), worse(value, high)]
    })
}

/// The largest distance of values from a straight line over `x`, divided by the range of the
/// values.
fn misfit(x: &[f64], y: &[f64]) -> f64 {
    let [slope, offset] = line(x, y);
    let distances = x.iter().zip(y).map(|(x, y)| (y - offset - slope * x).abs());
    let [low, high] = extremes(y.iter().copied());
    distances.fold(0.0, worse) / (high - low)
}

/// Compares findings of the paper: subject, quantity, number, and the bounds within which it must
/// lie.
fn find<const N: usize>(
    trial: &mut Trial,
    findings: [(&str, &'static str, f64, &'static Tolerance); N],
) {
    for (subject, quantity, computed, bounds) in findings {
        trial.check_within(subject, quantity, sources::PAPER, computed, bounds);
    }
}

/// Finding 1: the tip deflection grows degressively with depth, and with velocity once striking.
///
/// At the smallest depth it saturates at the highest velocities, so single steps may fall by 1 %.
pub fn deflection(trial: &mut Trial) -> TrialResult {
    let grid = PaperGrid::paper()?;
    let metric = |metrics: &Metrics| metrics.max_tip_deflection_m;
    let columns = grid.columns(metric);
    let growth = columns
        .iter()
        .map(|column| least_growth(column))
        .fold(f64::INFINITY, lesser);
    let last = grid.depths.len() - 1;
    let bend = |column: &Vec<f64>| {
        let final_slope =
            (column[last] - column[last - 1]) / (grid.depths[last] - grid.depths[last - 1]);
        final_slope / (column[0] / grid.depths[0])
    };
    let degression = columns.iter().map(bend).fold(0.0, worse);
    let (mut whole, mut step) = (f64::INFINITY, f64::INFINITY);
    for (depth, row) in grid.rows(metric).iter().enumerate() {
        let striking: Vec<f64> = (0..row.len())
            .filter(|&velocity| grid.strikes(depth, velocity))
            .map(|velocity| row[velocity])
            .collect();
        if striking.len() > 1 {
            whole = lesser(striking[striking.len() - 1] / striking[0], whole);
            step = lesser(least_growth(&striking), step);
        }
    }
    find(
        trial,
        [
            (
                "from one depth to the next, at every velocity",
                "least growth of s_n,max",
                growth,
                tolerances::GROWS,
            ),
            (
                "slope at 5 mm over that below 0.5 mm, largest",
                "slope ratio",
                degression,
                tolerances::DEGRESSIVE,
            ),
            (
                "striking, from the lowest to the highest velocity",
                "least growth of s_n,max",
                whole,
                tolerances::GROWS,
            ),
            (
                "striking, from one velocity to the next",
                "least growth of s_n,max",
                step,
                tolerances::HARDLY_FALLS,
            ),
        ],
    );
    Ok(())
}

/// Finding 2: the contact time falls steeply with velocity, most at large depth.
pub fn contact_time(trial: &mut Trial) -> TrialResult {
    let grid = PaperGrid::paper()?;
    let rows = grid.rows(|metrics| metrics.contact_time_s);
    let last = grid.velocities.len() - 1;
    let fall = rows.iter().map(|row| most_growth(row)).fold(0.0, worse);
    let whole = rows.iter().map(|row| row[last] / row[0]).fold(0.0, worse);
    let losses: Vec<f64> = rows.iter().map(|row| row[0] - row[last]).collect();
    find(
        trial,
        [
            (
                "from one velocity to the next, at every depth",
                "largest ratio of t_c",
                fall,
                tolerances::FALLS,
            ),
            (
                "30 m/s over 2.5 m/s, largest",
                "ratio of t_c",
                whole,
                tolerances::STEEP,
            ),
            (
                "loss from 2.5 to 30 m/s, from one depth to the next",
                "least growth",
                least_growth(&losses),
                tolerances::GROWS,
            ),
        ],
    );
    Ok(())
}

/// Finding 3: the contact time ratio has a tier, nearly proportional between velocity and depth.
///
/// The tier is the depth at which `ε_tc = ½`, interpolated at each velocity.
pub fn tier(trial: &mut Trial) -> TrialResult {
    let grid = PaperGrid::paper()?;
    let ratios = grid.columns(|metrics| metrics.contact_time_ratio);
    let (mut misplaced, mut velocities, mut depths) = (0, Vec::new(), Vec::new());
    for (velocity, column) in ratios.iter().enumerate() {
        let tier = grid.tier(velocity);
        misplaced += column[tier..]
            .iter()
            .filter(|&&ratio| ratio.is_nan() || ratio < 0.5)
            .count();
        if tier > 0 && tier < column.len() {
            let share = (0.5 - column[tier - 1]) / (column[tier] - column[tier - 1]);
            velocities.push(grid.velocities[velocity]);
            depths
                .push(grid.depths[tier - 1] + share * (grid.depths[tier] - grid.depths[tier - 1]));
        }
    }
    let slopes: Vec<f64> = velocities
        .iter()
        .zip(&depths)
        .map(|(velocity, depth)| depth / velocity)
        .collect();
    let relative = slopes.iter().map(|slope| slope / mean(&slopes));
    let [least, most] = extremes(relative);
    let corner = |depth: usize, velocity: usize| grid.metrics[depth][velocity].contact_time_ratio;
    let (deepest, fastest) = (grid.depths.len() - 1, grid.velocities.len() - 1);
    find(
        trial,
        [
            (
                "passes above the line that strike",
                "number",
                misplaced as f64,
                tolerances::NONE,
            ),
            (
                "slowest and deepest pass",
                "ε_tc",
                corner(deepest, 0),
                tolerances::SWEEPS,
            ),
            (
                "passes at 25 m/s and 0.5 mm",
                "ε_tc",
                corner(0, fastest - 2),
                tolerances::STRIKES,
            ),
            (
                "line ε_tc = ½, worst distance from a straight one",
                "over its range",
                misfit(&velocities, &depths),
                tolerances::STRAIGHT,
            ),
            (
                "a_e/v_b on the line, least over mean",
                "ratio",
                least,
                tolerances::NEARLY_PROPORTIONAL,
            ),
            (
                "a_e/v_b on the line, largest over mean",
                "ratio",
                most,
                tolerances::NEARLY_PROPORTIONAL,
            ),
        ],
    );
    Ok(())
}

/// Finding 4: the impulse falls with velocity, most at large depth, and is low below the tier.
///
/// From 15 m/s on, both kinds of motion occur. There the least impulse is that of a striking pass,
/// and the deepest sweep has at least a quarter more.
pub fn impulse(trial: &mut Trial) -> TrialResult {
    let grid = PaperGrid::paper()?;
    let metric = |metrics: &Metrics| metrics.contact_normal_impulse_n_s;
    let rows = grid.rows(metric);
    let last = grid.velocities.len() - 1;
    let mut fall = 0.0;
    for (depth, row) in rows.iter().enumerate() {
        let sweeping: Vec<f64> = (0..row.len())
            .filter(|&velocity| !grid.strikes(depth, velocity))
            .map(|velocity| row[velocity])
            .collect();
        fall = worse(most_growth(&sweeping), fall);
    }
    let whole = rows.iter().map(|row| row[last] / row[0]).fold(0.0, worse);
    let losses: Vec<f64> = rows.iter().map(|row| row[0] - row[last]).collect();
    let (mut above, mut rise) = (0, f64::INFINITY);
    for (velocity, column) in grid.columns(metric).iter().enumerate() {
        if grid.velocities[velocity] < 15.0 {
            continue;
        }
        let least = (0..column.len())
            .min_by(|&a, &b| column[a].total_cmp(&column[b]))
            .unwrap_or(0);
        above += usize::from(!grid.strikes(least, velocity));
        rise = lesser(column[column.len() - 1] / column[least], rise);
    }
    find(
        trial,
        [
            (
                "sweeping, from one velocity to the next",
                "largest ratio of p_n",
                fall,
                tolerances::FALLS,
            ),
            (
                "30 m/s over 2.5 m/s, largest",
                "ratio of p_n",
                whole,
                tolerances::MOST_LOST,
            ),
            (
                "loss from 2.5 to 30 m/s, from one depth to the next",
                "least growth",
                least_growth(&losses),
                tolerances::GROWS,
            ),
            (
                "velocities from 15 m/s whose least p_n is above the line",
                "number",
                above as f64,
                tolerances::NONE,
            ),
            (
                "p_n at 5 mm over the least below the line",
                "least ratio",
                rise,
                tolerances::DISTINCT,
            ),
        ],
    );
    Ok(())
}

/// Finding 5: the tool force is high at high velocity, linear in depth only when slow, and has a
/// maximum along the tier.
///
/// At 1, 2 and 3 mm the force has a local maximum on the tier, at least 2 % above that at the next
/// velocity, with one contact more than at 30 m/s.
pub fn tool_force(trial: &mut Trial) -> TrialResult {
    let grid = PaperGrid::paper()?;
    let metric = |metrics: &Metrics| metrics.tool_contact_normal_force_n;
    let columns = grid.columns(metric);
    let last = columns.len() - 1;
    let fast = columns
        .iter()
        .zip(&grid.velocities)
        .filter(|(_, velocity)| **velocity >= 22.5);
    let fast = fast
        .map(|(column, _)| misfit(&grid.depths, column))
        .fold(f64::INFINITY, lesser);
    find(
        trial,
        [
            (
                "mean at 30 m/s over mean at 2.5 m/s",
                "ratio of F_n,w",
                mean(&columns[last]) / mean(&columns[0]),
                tolerances::GROWS,
            ),
            (
                "distance from a straight line in a_e, 2.5 m/s",
                "over its range",
                misfit(&grid.depths, &columns[0]),
                tolerances::STRAIGHT,
            ),
            (
                "the same, least from 22.5 m/s on",
                "over its range",
                fast,
                tolerances::BENT,
            ),
        ],
    );
    let mut peaks = Vec::new();
    for (depth, row) in grid.rows(metric).iter().enumerate() {
        if ![1e-3, 2e-3, 3e-3]
            .iter()
            .any(|shown| (grid.depths[depth] / shown - 1.0).abs() < 1e-6)
        {
            continue;
        }
        let is_peak = |i: &usize| row[*i] > row[i - 1] && row[*i] > 1.02 * row[i + 1];
        let subject = format!(
            "a_e = {} mm, where F_n,w has a maximum",
            1e3 * grid.depths[depth]
        );
        let Some(peak) = (1..row.len() - 1).rev().find(is_peak) else {
            trial.check_within(
                &subject,
                "v_b in m/s",
                sources::PAPER,
                f64::NAN,
                tolerances::ALONG_TIER,
            );
            continue;
        };
        let metrics = &grid.metrics[depth];
        let (ratio, count) = (
            metrics[peak].contact_time_ratio,
            metrics[peak].contact_count,
        );
        trial.check_within(
            &subject,
            "ε_tc",
            sources::PAPER,
            ratio,
            tolerances::ALONG_TIER,
        );
        let more = count as f64 - metrics[last].contact_count as f64;
        trial.check_within(
            &subject,
            "contacts more than at 30 m/s",
            sources::PAPER,
            more,
            tolerances::ONE_MORE,
        );
        let late = last_contact(grid.velocities[peak], grid.depths[depth])?;
        trial.check_within(
            &subject,
            "begin of the last contact over t_d",
            sources::PAPER,
            late,
            tolerances::LATE,
        );
        peaks.push(grid.velocities[peak]);
    }
    find(
        trial,
        [
            (
                "depths with such a maximum, less two",
                "number",
                peaks.len() as f64 - 2.0,
                tolerances::ONE_MORE,
            ),
            (
                "v_b of that maximum, from one depth to the next",
                "least growth",
                least_growth(&peaks),
                tolerances::GROWS,
            ),
        ],
    );
    Ok(())
}

/// The start of the last contact of a pass, measured from nominal entry and divided by the nominal
/// contact time.
fn last_contact(velocity: f64, depth: f64) -> Result<f64, Failure> {
    let settings = paper_case(25, velocity, depth)?;
    let [entry, exit] = Pass::new(&settings).nominal_times();
    let history = simulate_with_history(&settings, 5001)?.history;
    let begins = history
        .windows(2)
        .rev()
        .find(|pair| pair[0].contact_normal_force_n == 0.0 && pair[1].contact_normal_force_n > 0.0);
    Ok(begins.map_or(f64::NAN, |pair| (pair[1].time_s - entry) / (exit - entry)))
}

/// Finding 6: more than 25 segments make no noticeable difference.
pub fn segments(trial: &mut Trial) -> TrialResult {
    let (paper, fine) = (PaperGrid::paper()?, &PaperGrid::new(50.0)?);
    let pairs = || {
        paper
            .metrics
            .iter()
            .flatten()
            .zip(fine.metrics.iter().flatten())
    };
    let change = |metric: fn(&Metrics) -> f64| {
        pairs()
            .map(|(paper, fine)| (metric(paper) / metric(fine) - 1.0).abs())
            .fold(0.0, worse)
    };
    let ratio = pairs()
        .map(|(paper, fine)| (paper.contact_time_ratio - fine.contact_time_ratio).abs())
        .fold(0.0, worse);
    let subject = "n = 25 against n = 50, largest of 120 passes";
    find(
        trial,
        [
            (
                subject,
                "change of F_n,w",
                change(|metrics| metrics.tool_contact_normal_force_n),
                tolerances::UNNOTICEABLE,
            ),
            (
                subject,
                "change of s_n,max",
                change(|metrics| metrics.max_tip_deflection_m),
                tolerances::UNNOTICEABLE,
            ),
            (
                subject,
                "change of ε_tc",
                ratio,
                tolerances::UNNOTICEABLE_RATIO,
            ),
        ],
    );
    Ok(())
}

/// Finding 7: the tool force has the magnitude of measured forces. The paper has no table of them.
pub fn magnitude(trial: &mut Trial) -> TrialResult {
    let grid = PaperGrid::paper()?;
    let [low, high] = extremes(
        grid.metrics
            .iter()
            .flatten()
            .map(|metrics| metrics.tool_contact_normal_force_n),
    );
    find(
        trial,
        [
            (
                "least of 120 passes",
                "F_n,w in N",
                low,
                tolerances::MAGNITUDE,
            ),
            (
                "largest of 120 passes",
                "F_n,w in N",
                high,
                tolerances::MAGNITUDE,
            ),
        ],
    );
    Ok(())
}
