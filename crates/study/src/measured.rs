//! Compares measured tool forces with simulated ones: the user's table in, deviations out.
//!
//! A force is compared where it was measured. Between the cases of a study the simulated force is interpolated linearly in
//! velocity and depth. Outside of them it is not extrapolated.

use std::collections::HashMap;
use std::io::{self, Write};

use crate::results::{DataError, MAX_ROWS, Source};
use crate::slices::{Side, Slice, process_slices};
use crate::study::{CaseResult, CaseSummary, Study};
use crate::text::number::short;
use bristle::model::settings::Settings;
use bristle_text::shortened;

/// Columns of the table. Other columns are ignored.
pub const COLUMNS: [&str; 4] = ["brushing_velocity_m_s", "penetration_depth_m", "force_n", "std_n"];

/// What to do about a table that cannot be used.
const ADVICE: &str = "the table has the columns\n     brushing_velocity_m_s,penetration_depth_m,force_n,std_n,\n     \
    separated by commas, with decimal points, and one row per point";

/// The largest number of slices that are compared.
const MAX_SLICES: usize = 1000;
/// The largest size of a number in a table, in SI units; beyond it, or below its reciprocal, a velocity is a slip of the pen.
/// Sums and squares of such numbers are finite.
const LARGEST: f64 = 1e100;
/// The largest numbers of slices, and of points in each, that are printed.
const MAX_PRINTED: (usize, usize) = (4, 40);
/// Relative difference up to which values are the same: a file may round differently from a sweep.
const SAME: f64 = 1e-9;

/// A measured force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// Brushing velocity `v_b` in m/s.
    pub brushing_velocity_m_s: f64,
    /// Penetration depth `a_e` in m.
    pub penetration_depth_m: f64,
    /// Tool contact normal force `F_n,w` in N.
    pub force_n: f64,
    /// Its standard deviation in N.
    pub std_n: f64,
}

/// Reads a table of measured forces as CSV. Errors use `name` for the table.
///
/// # Errors
/// If a column is missing, a cell is not an allowed number, a point occurs twice, or there is no point.
pub fn read_measured(text: &str, name: &str) -> Result<Vec<Measurement>, DataError> {
    let source = Source { name, text: text.trim_start_matches('\u{feff}') };
    let table = source.table(ADVICE)?;
    let columns = table.columns(&COLUMNS)?;
    let mut points: Vec<Measurement> = Vec::new();
    let mut places = Places::default();
    for row in table.rows() {
        let mut numbers = [0.0; COLUMNS.len()];
        for (index, number) in numbers.iter_mut().enumerate() {
            let cell = row.get(columns[index]).unwrap_or_default();
            let wrong = |problem: String| Err(table.wrong(row, columns[index], problem));
            *number = match cell.parse() {
                Ok(read) if f64::is_finite(read) => read,
                _ => return wrong(format!("`{}` is not a finite number", shortened(cell))),
            };
            let (least, in_words) = match index {
                0 | 1 => (1.0 / LARGEST, "greater than 0, from 1e-100"),
                2 => (-LARGEST, "from -1e100"),
                _ => (0.0, "at least 0, from 0"),
            };
            if !(least..=LARGEST).contains(number) {
                return wrong(format!("`{}` must be {in_words} to 1e100", shortened(cell)));
            }
        }
        let [brushing_velocity_m_s, penetration_depth_m, force_n, std_n] = numbers;
        let point = Measurement { brushing_velocity_m_s, penetration_depth_m, force_n, std_n };
        if let Some(first) = places.take(&points, point) {
            let problem = format!("the same velocity and depth as in line {}", table.line(&table.rows()[first]));
            return Err(table.wrong(row, columns[0], problem));
        }
        points.push(point);
    }
    if points.is_empty() {
        return Err(source.error(1, None, "there is no point below the heading", ADVICE));
    }
    Ok(points)
}

/// The points of a table by velocity and depth, to find equal ones in constant time.
///
/// Points are kept in cells somewhat wider than [`SAME`]: a point equals only those in its own cell and the eight around it,
/// and few different points have room in a cell.
#[derive(Default)]
struct Places(HashMap<[u64; 2], Vec<usize>>);

impl Places {
    /// Adds the next point, whose position is the number of `points`. If one of them has the same velocity and depth, returns
    /// the position of the first.
    fn take(&mut self, points: &[Measurement], point: Measurement) -> Option<usize> {
        let at = |point: &Measurement| [point.brushing_velocity_m_s, point.penetration_depth_m];
        let [velocity, depth] = at(&point).map(cell);
        let same = |&position: &usize| at(&points[position]).iter().zip(at(&point)).all(|(a, b)| same(*a, b));
        let around = (velocity - 1..=velocity + 1)
            .flat_map(|velocity| (depth - 1..=depth + 1).map(move |depth| [velocity, depth]));
        let first = around.filter_map(|key| self.0.get(&key)).flatten().copied().filter(same).min();
        self.0.entry([velocity, depth]).or_default().push(points.len());
        first
    }
}

/// The number of the cell of a positive number that is not subnormal. The bits of such numbers increase with them, and leaving
/// out the last 24 of 52 makes cells of 2⁻²⁸ of a power of two.
fn cell(number: f64) -> u64 {
    number.to_bits() >> 24
}

/// Whether two values are the same except for rounding.
pub fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME * a.abs().max(b.abs())
}

/// A simulated tool force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Simulated {
    /// `F_n,w` in N.
    pub force_n: f64,
    /// Its uncertainty in N, from that of the number of filaments.
    pub uncertainty_n: f64,
    /// The band in N that contains 95 % of the tools, where filaments scatter.
    pub band_n: Option<[f64; 2]>,
}

/// Why there is no simulated force at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// The point lies outside the study.
    Outside,
    /// A simulation that the force depends on failed.
    Failed,
}

impl Missing {
    /// As text.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Outside => "outside the study",
            Self::Failed => "the simulation failed",
        }
    }
}

/// A measured force and the simulated one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// The measured force.
    pub measured: Measurement,
    /// The simulated force at this point.
    pub simulated: Result<Simulated, Missing>,
}

impl Point {
    /// Simulated minus measured force in N, where there is a simulated force.
    #[must_use]
    pub fn difference_n(&self) -> Option<f64> {
        self.simulated.ok().map(|simulated| simulated.force_n - self.measured.force_n)
    }

    /// Whether the simulated force lies within one standard deviation of the measured one.
    #[must_use]
    pub fn is_within(&self) -> Option<bool> {
        self.difference_n().map(|difference| difference.abs() <= self.measured.std_n)
    }
}

/// How far simulated forces deviate from measured ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Number of points compared.
    pub count: usize,
    /// Mean of simulated minus measured, in N.
    pub bias_n: f64,
    /// Root mean square of simulated minus measured, in N.
    pub rmse_n: f64,
    /// Number of points at which the simulated force lies within one standard deviation of the measured one.
    pub within: usize,
}

/// Measured points compared with the study, at one value of each further sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Path and value of each further sweep.
    pub fixed: Vec<(&'static str, f64)>,
    /// The values that distinguish this comparison from the others; empty if it is the only one.
    pub condition: String,
    /// The points in the order of the file.
    pub points: Vec<Point>,
}

impl Comparison {
    /// Whether the simulated force has a band at some point.
    fn has_bands(&self) -> bool {
        self.points.iter().flat_map(|point| point.simulated).any(|simulated| simulated.band_n.is_some())
    }

    /// Bias, RMSE and number of points within one standard deviation. `None` if no point can be compared.
    #[must_use]
    pub fn deviation(&self) -> Option<Deviation> {
        let differences: Vec<f64> = self.points.iter().filter_map(Point::difference_n).collect();
        let count = differences.len();
        if count == 0 {
            return None;
        }
        // Simulated forces may be so large that their squares are infinite.
        let scale = differences.iter().fold(f64::MIN_POSITIVE, |largest, difference| difference.abs().max(largest));
        let scaled = || differences.iter().map(|difference| difference / scale);
        let mean = |sum: f64| sum / count as f64;
        Some(Deviation {
            count,
            bias_n: scale * mean(scaled().sum()),
            rmse_n: scale * mean(scaled().map(|difference| difference * difference).sum()).sqrt(),
            within: self.points.iter().filter(|point| point.is_within() == Some(true)).count(),
        })
    }
}

/// Compares measured forces with those of a study: once for each combination of the settings swept in addition to velocity
/// and depth. Of more than 1000 combinations, 1000 are compared, evenly spread; fewer if there are more than 1000 points, so
/// that there are some million differences at most.
#[must_use]
pub fn compare(study: &Study, results: &[CaseResult], measured: &[Measurement]) -> Vec<Comparison> {
    let limit = (MAX_ROWS / measured.len().max(1)).clamp(2, MAX_SLICES);
    let slices = process_slices(study, limit).chosen.into_iter();
    slices
        .map(|slice| Comparison {
            fixed: slice.fixed.iter().map(|&(parameter, value)| (parameter.path, value)).collect(),
            condition: slice.condition(),
            points: measured
                .iter()
                .map(|&measured| {
                    let Measurement { brushing_velocity_m_s, penetration_depth_m, .. } = measured;
                    let across = slice.at_velocity(study, brushing_velocity_m_s);
                    let simulated = tool_force(study, results, &slice, across, penetration_depth_m);
                    Point { measured, simulated }
                })
                .collect(),
        })
        .collect()
}

/// Relative uncertainty of the tool force: that of the number of filaments.
pub fn relative_uncertainty(settings: &Settings) -> f64 {
    let tool = &settings.tool;
    let ratio = tool.filament_count_uncertainty / tool.filament_count;
    if ratio.is_finite() { ratio } else { 0.0 }
}

/// `F_n,w` in a slice, at a position on its horizontal side, which is [`Slice::at_velocity`] of a velocity, and a depth (m).
pub fn tool_force(
    study: &Study,
    results: &[CaseResult],
    slice: &Slice,
    across: f64,
    depth: f64,
) -> Result<Simulated, Missing> {
    let at = |value: &dyn Fn(&CaseSummary) -> Option<f64>| interpolate(results, slice, [across, depth], value);
    let force_n = at(&|summary| Some(summary.metrics.tool_contact_normal_force_n))?;
    let end = |index: usize| at(&|summary| Some(summary.scatter.as_ref()?.band()[index])).ok();
    Ok(Simulated {
        force_n,
        uncertainty_n: force_n.abs() * relative_uncertainty(&study.settings(slice.case(0, 0))),
        band_n: end(0).zip(end(1)).map(|(lower, upper)| [lower, upper]),
    })
}

/// A value of the cases of a slice, interpolated linearly along each side.
fn interpolate(
    results: &[CaseResult],
    slice: &Slice,
    [x, y]: [f64; 2],
    value: impl Fn(&CaseSummary) -> Option<f64>,
) -> Result<f64, Missing> {
    let across = weights(&slice.x, x).ok_or(Missing::Outside)?;
    let up = weights(&slice.y, y).ok_or(Missing::Outside)?;
    let mut sum = 0.0;
    for &(row, part_up) in up.iter().filter(|(_, part)| *part != 0.0) {
        for &(column, part_across) in across.iter().filter(|(_, part)| *part != 0.0) {
            let summary = results[slice.case(column, row)].as_ref().map_err(|_| Missing::Failed)?;
            sum += part_up * part_across * value(summary).ok_or(Missing::Failed)?;
        }
    }
    Ok(sum)
}

/// Positions of the two values around `at`, with their weights. `None` outside.
fn weights(side: &Side, at: f64) -> Option<[(usize, f64); 2]> {
    let values = &side.values;
    let above = values.partition_point(|&value| value <= at);
    let around = [above.checked_sub(1), Some(above).filter(|&above| above < values.len())];
    if let Some(position) = around.into_iter().flatten().find(|&position| same(values[position], at)) {
        return Some([(position, 1.0), (position, 0.0)]);
    }
    let [Some(below), Some(above)] = around else { return None };
    let part = (at - values[below]) / (values[above] - values[below]);
    Some([(below, 1.0 - part), (above, part)])
}

/// A force with this many decimals, or as a power of ten if it would not fit into a table.
fn newtons(force: f64, decimals: usize) -> String {
    if force.abs() < 1e8 { format!("{force:.decimals$}") } else { format!("{force:.2e}") }
}

/// A difference of forces, with its sign.
fn signed(difference: f64) -> String {
    let sign = if difference.is_sign_negative() { "" } else { "+" };
    format!("{sign}{}", newtons(difference, 1))
}

/// The deviations as a table for people.
#[must_use]
pub fn comparison_table(comparisons: &[Comparison]) -> String {
    let mut text = String::new();
    for comparison in comparisons.iter().take(MAX_PRINTED.0) {
        text.push_str("F_n,w in N: simulated and measured");
        if !comparison.condition.is_empty() {
            text.push_str(&format!(", {}", comparison.condition));
        }
        let heading = if comparison.has_bands() { "simulated, 95 %" } else { "simulated ± N_f" };
        text.push_str(&format!(
            "\n  v_b in m/s  a_e in mm      measured ± std  {heading:>18}  difference  within std\n"
        ));
        for point @ Point { measured, simulated } in comparison.points.iter().take(MAX_PRINTED.1) {
            let pair = |value: f64, spread: f64| format!("{} ± {}", newtons(value, 1), newtons(spread, 1));
            let velocity = short(measured.brushing_velocity_m_s);
            let depth = short(1e3 * measured.penetration_depth_m);
            let left = pair(measured.force_n, measured.std_n);
            let right = match simulated {
                Ok(Simulated { force_n, uncertainty_n, band_n }) => {
                    let within = if point.is_within() == Some(true) { "yes" } else { "no" };
                    let simulated = match band_n {
                        Some([lower, upper]) => {
                            format!("{} [{} … {}]", newtons(*force_n, 1), newtons(*lower, 0), newtons(*upper, 0))
                        }
                        None => pair(*force_n, *uncertainty_n),
                    };
                    format!("{simulated:>18}  {:>10}  {within:>10}", signed(force_n - measured.force_n))
                }
                Err(missing) => missing.name().to_owned(),
            };
            text.push_str(&format!("  {velocity:>10}  {depth:>9}  {left:>18}  {right}\n"));
        }
        if comparison.points.len() > MAX_PRINTED.1 {
            text.push_str(&format!("  … and {} more points\n", comparison.points.len() - MAX_PRINTED.1));
        }
        text.push_str(&match comparison.deviation() {
            Some(Deviation { count, bias_n, rmse_n, within }) => format!(
                "  {count} of {} points compared: bias {} N, RMSE {} N, within ± std {within} ({:.0} %)\n",
                comparison.points.len(),
                signed(bias_n),
                newtons(rmse_n, 1),
                100.0 * within as f64 / count as f64
            ),
            None => "  no point can be compared\n".to_owned(),
        });
    }
    if comparisons.len() > MAX_PRINTED.0 {
        text.push_str(&format!("… and {} more comparisons\n", comparisons.len() - MAX_PRINTED.0));
    }
    text
}

/// Writes `measured_comparison.csv`: a heading, then one row per point.
pub fn write_comparison(out: impl Write, comparisons: &[Comparison]) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    let further = comparisons.first().map_or(&[][..], |comparison| &comparison.fixed);
    let bands = if comparisons.iter().any(Comparison::has_bands) {
        &["simulated_lower_95_n", "simulated_upper_95_n"][..]
    } else {
        &[]
    };
    let names = [
        "brushing_velocity_m_s",
        "penetration_depth_m",
        "measured_force_n",
        "measured_std_n",
        "simulated_force_n",
        "simulated_uncertainty_n",
    ];
    let further = further.iter().map(|(path, _)| *path);
    let verdict = ["difference_n", "within_std", "status"];
    writer.write_record(further.chain(names).chain(bands.iter().copied()).chain(verdict))?;
    for comparison in comparisons {
        for point in &comparison.points {
            let Measurement { brushing_velocity_m_s, penetration_depth_m, force_n, std_n } = point.measured;
            let number = |number: f64| format!("{number:?}");
            let mut row: Vec<String> = comparison.fixed.iter().map(|(_, value)| number(*value)).collect();
            row.extend([brushing_velocity_m_s, penetration_depth_m, force_n, std_n].map(number));
            let simulated = point.simulated.ok();
            let optional = |value: Option<f64>| value.map_or_else(String::new, number);
            row.push(optional(simulated.map(|simulated| simulated.force_n)));
            row.push(optional(simulated.map(|simulated| simulated.uncertainty_n)));
            let band = simulated.and_then(|simulated| simulated.band_n);
            row.extend((0..bands.len()).map(|end| optional(band.map(|band| band[end]))));
            row.push(optional(point.difference_n()));
            let within = point.is_within().map(|within| if within { "yes" } else { "no" });
            row.push(within.unwrap_or_default().to_owned());
            row.push(point.simulated.map_or_else(Missing::name, |_| "ok").to_owned());
            writer.write_record(&row)?;
        }
    }
    writer.flush()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::Document;
    use crate::study::{CaseSummary, DEPTH, VELOCITY};
    use bristle::model::metrics::Metrics;

    /// Two velocities, three depths that are not evenly spaced.
    fn study() -> Study {
        let text = "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\nfilament_count = 1000\n\
             filament_count_uncertainty = 100\n[filament]\nlength_m = 0.040\ndiameter_m = 1.18e-3\n[study]\n\
             brushing_velocity_m_s = [20.0, 10.0]\npenetration_depth_m = [1e-3, 2e-3, 4e-3]";
        Document::parse(text, "case.toml").and_then(|document| document.study()).expect("a study")
    }

    /// A force of 10 N s/m · v_b + 10⁵ N/m · a_e. The case `failed` is one that failed.
    fn results(study: &Study, failed: Option<usize>) -> Vec<CaseResult> {
        let case = |case: usize| {
            let process = study.settings(case).process;
            let force = 10.0 * process.brushing_velocity_m_s + 1e5 * process.penetration_depth_m;
            let metrics = Metrics { tool_contact_normal_force_n: force, ..Metrics::default() };
            match failed {
                Some(number) if number == case => Err("failed".to_owned()),
                _ => Ok(CaseSummary { metrics, ..CaseSummary::default() }),
            }
        };
        (0..study.case_count()).map(case).collect()
    }

    fn point(brushing_velocity_m_s: f64, penetration_depth_m: f64, force_n: f64, std_n: f64) -> Measurement {
        Measurement { brushing_velocity_m_s, penetration_depth_m, force_n, std_n }
    }

    #[test]
    fn forces_are_interpolated_within_the_study_only() {
        let study = study();
        assert_eq!(study.sweeps().iter().map(|sweep| sweep.parameter().path).collect::<Vec<_>>(), [DEPTH, VELOCITY]);
        let force = |velocity, depth, failed| {
            let comparison = compare(&study, &results(&study, failed), &[point(velocity, depth, 0.0, 0.0)]);
            comparison[0].points[0].simulated.map(|simulated| simulated.force_n)
        };
        let near = |found: Result<f64, Missing>, expected: f64| {
            assert!((found.expect("a force") - expected).abs() < 1e-9, "{found:?}, not {expected}");
        };
        near(force(10.0, 1e-3, None), 200.0);
        near(force(20.0, 4e-3, None), 600.0);
        // Bilinear interpolation reproduces a linear function.
        near(force(12.5, 3e-3, None), 425.0);
        near(force(10.0 * (1.0 + 1e-12), 1e-3, None), 200.0);
        for (velocity, depth) in [(9.9, 2e-3), (20.1, 2e-3), (15.0, 0.9e-3), (15.0, 4.1e-3)] {
            assert_eq!(force(velocity, depth, None), Err(Missing::Outside));
        }
        // Case 0 is at 20 m/s and 1 mm. It counts only where it has a weight.
        assert_eq!(force(15.0, 1e-3, Some(0)), Err(Missing::Failed));
        near(force(10.0, 1e-3, Some(0)), 200.0);
        near(force(15.0, 3e-3, Some(0)), 450.0);
    }

    #[test]
    fn deviations_are_those_computed_by_hand() {
        let study = study();
        // The simulated forces are 200, 300 and 400, the differences −10, +20 and +5. The last point is outside.
        let measured = [
            point(10.0, 1e-3, 210.0, 10.0),
            point(20.0, 1e-3, 280.0, 19.0),
            point(20.0, 2e-3, 395.0, 6.0),
            point(30.0, 2e-3, 1.0, 1.0),
        ];
        let comparisons = compare(&study, &results(&study, None), &measured);
        assert_eq!(comparisons.len(), 1);
        let deviation = comparisons[0].deviation().expect("three points");
        assert_eq!((deviation.count, deviation.within), (3, 2));
        assert!((deviation.bias_n - 5.0).abs() < 1e-9);
        assert!((deviation.rmse_n - 175.0_f64.sqrt()).abs() < 1e-9);
        let uncertainty = comparisons[0].points[0].simulated.expect("a force").uncertainty_n;
        assert!((uncertainty - 20.0).abs() < 1e-9, "a tenth, like that of the filaments");
        let table = comparison_table(&comparisons);
        assert!(table.contains("3 of 4 points compared: bias +5.0 N, RMSE 13.2 N, within ± std 2 (67 %)"), "{table}");

        let outside = compare(&study, &results(&study, None), &measured[3..]);
        assert_eq!(outside[0].deviation(), None);
        assert!(comparison_table(&outside).contains("no point can be compared"));
    }

    #[test]
    fn equal_points_are_found_wherever_they_are() {
        let heading = "brushing_velocity_m_s,penetration_depth_m,force_n,std_n\n";
        let table = |rows: &str| read_measured(&format!("{heading}{rows}"), "forces.csv");
        let error = |rows: &str| table(rows).expect_err("refused").to_string();
        // From cell to cell and across powers of two.
        for number in -2000..2000 {
            let (velocity, depth) = (f64::from(number) * 0.1137, f64::from(number) * -0.0713);
            let [velocity, depth] = [velocity, depth].map(f64::exp);
            let rows = |relative: f64| {
                let [fast, deep] = [velocity * (1.0 + relative), depth * (1.0 - relative)];
                format!("7,3,0,0\n{velocity:?},{depth:?},1,1\n{fast:?},{deep:?},1,1\n")
            };
            let expected = "forces.csv:4, column brushing_velocity_m_s: the same velocity and depth as in line 3";
            assert!(error(&rows(0.9e-9)).starts_with(expected));
            assert!(table(&rows(1.1e-9)).is_ok());
        }
    }

    /// Reading took a minute when each point was compared with all others.
    #[test]
    fn long_tables_are_read_in_linear_time() {
        let rows = |count: usize| {
            let row = |index: usize| format!("{}.5,{}e-6,1.0,0.1\n", index % 1000 + 1, index / 1000 + 1);
            let heading = COLUMNS.join(",") + "\n";
            (0..count).fold(heading, |text, index| text + &row(index))
        };
        let seconds = |count: usize| {
            let text = rows(count);
            let start = std::time::Instant::now();
            let points = read_measured(&text, "forces.csv").expect("points");
            assert_eq!(points.len(), count);
            start.elapsed().as_secs_f64()
        };
        let (few, many) = (seconds(20_000), seconds(200_000));
        assert!(many < 40.0 * few.max(0.1), "{few} s, then {many} s for ten times as many points");
        let error = read_measured(&rows(MAX_ROWS + 1), "forces.csv").expect_err("too many").to_string();
        assert!(error.starts_with("forces.csv:1000002: more than 1000000 rows"), "{error}");
        let wide = format!("{}\n1,1,1,1\n{}", COLUMNS.join(","), ",".repeat(100_000));
        let error = read_measured(&wide, "forces.csv").expect_err("too wide").to_string();
        assert!(error.starts_with("forces.csv:3: a line of more than 65536 bytes"), "{error}");
    }

    #[test]
    fn large_forces_have_a_finite_deviation() {
        let study = study();
        let mut results = results(&study, None);
        for (index, result) in results.iter_mut().enumerate() {
            let sign = if index.is_multiple_of(2) { 1.0 } else { -1.0 };
            result.as_mut().expect("a result").metrics.tool_contact_normal_force_n = sign * 1e308;
        }
        let measured = [point(20.0, 1e-3, -LARGEST, 0.0), point(10.0, 1e-3, LARGEST, 0.0)];
        let comparisons = compare(&study, &results, &measured);
        let deviation = comparisons[0].deviation().expect("two points");
        assert!(deviation.rmse_n == 1e308 && deviation.bias_n.abs() <= 1e308, "{deviation:?}");
        let table = comparison_table(&comparisons);
        assert!(table.contains("RMSE 1.00e308 N") && table.lines().all(|line| line.chars().count() <= 100), "{table}");
        for force in ["1e101", "-1e308", "1e400", "NaN"] {
            let text = format!("{}\n1,1,{force},0\n", COLUMNS.join(","));
            let error = read_measured(&text, "forces.csv").expect_err("too large").to_string();
            assert!(error.starts_with("forces.csv:2, column force_n"), "{error}");
        }
    }

    #[test]
    fn columns_of_one_name_are_refused_with_their_numbers() {
        let text = "force_n,brushing_velocity_m_s,date,force_n,penetration_depth_m,std_n,date\n1,1,1,1,1,1,1\n";
        let error = read_measured(text, "forces.csv").expect_err("two columns of forces").to_string();
        assert!(error.starts_with("forces.csv:1: columns 1 and 4 are both named `force_n`\n"), "{error}");
        assert!(read_measured(&text.replacen("force_n", "old", 1), "forces.csv").is_ok(), "other columns are ignored");
    }

    #[test]
    fn tables_may_have_further_columns_and_a_byte_order_mark() {
        let text = "\u{feff}force_n, std_n, date, penetration_depth_m, brushing_velocity_m_s\r\n1.5,0,now,2e-3,5\r\n";
        assert_eq!(read_measured(text, "forces.csv"), Ok(vec![point(5.0, 2e-3, 1.5, 0.0)]));
    }
}
