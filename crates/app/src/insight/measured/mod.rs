//! Compares measured tool forces with simulated ones: the user's table in, deviations out.
//!
//! A force is compared where it was measured. Between the cases of a study, the simulated force is
//! interpolated linearly in velocity and depth. It is not extrapolated.

mod hints;

use std::io::{self, Write};

use bristle::model::settings::Settings;

use crate::insight::slices::{Slice, Varied, process_slices};
use bristle_study::grid::{CaseResult, CaseSummary, Setting, Study};
use bristle_study::input::measured::{Measurement, Quantity, Speed, same};
use bristle_study::input::table::MAX_ROWS;
use bristle_study::text::layout::{aligned, wrap};
use bristle_study::text::number::short;

pub use hints::unusual_points;

/// Maximum number of compared slices.
const MAX_SLICES: usize = 1000;
/// Maximum numbers of printed slices, and of printed points in each.
const MAX_PRINTED: (usize, usize) = (4, 40);
/// Width in N below which a band is printed with a decimal.
const NARROW_BAND_N: f64 = 10.0;
/// Force in N from which on forces are printed as powers of ten.
const MAX_PLAIN_FORCE_N: f64 = 1e5;
/// A simulated tool force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulatedForce {
    /// `F_n,w` in N.
    pub force_n: f64,
    /// Uncertainty of the force in N, from the number of filaments.
    pub uncertainty_n: f64,
    /// Interval in N that contains 95 % of the tools, where filaments scatter.
    pub band_n: Option<[f64; 2]>,
}

/// Reasons why there is no simulated force at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// A point outside the study.
    Outside,
    /// A simulation that the force depends on failed.
    Failed,
}

impl Missing {
    /// Returns the reason as text.
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
pub struct ComparedPoint {
    /// The measured force.
    pub measured: Measurement,
    /// Speed of the point as the study states it: the brushing velocity in m/s, or the rotational
    /// speed in rpm.
    pub across: f64,
    /// The simulated force at this point.
    pub simulated: Result<SimulatedForce, Missing>,
}

impl ComparedPoint {
    /// Returns the simulated minus the measured force in N, if there is a simulated force.
    #[must_use]
    pub fn difference_n(&self) -> Option<f64> {
        self.simulated
            .ok()
            .map(|simulated| simulated.force_n - self.measured.force_n)
    }

    /// Returns `true` if the simulated force lies within one standard deviation of the measured
    /// one, where both are known.
    #[must_use]
    pub fn is_within(&self) -> Option<bool> {
        Some(self.difference_n()?.abs() <= self.measured.std_n?)
    }
}

/// Deviation of simulated forces from measured ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceDeviation {
    /// Number of points compared.
    pub count: usize,
    /// Mean of simulated minus measured, in N.
    pub bias_n: f64,
    /// Root mean square of simulated minus measured, in N.
    pub rmse_n: f64,
    /// Number of points whose simulated force lies within one standard deviation of the measured
    /// one. `None` if some point has no standard deviation.
    pub within: Option<usize>,
}

/// Measured points compared with the study, at one value of each further sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceComparison {
    /// Further settings of the study, and their values.
    pub fixed: Vec<(Setting, f64)>,
    /// Values that distinguish this comparison from the others; empty if it is the only one.
    pub condition: String,
    /// Points in the order of the file.
    pub points: Vec<ComparedPoint>,
}

impl ForceComparison {
    /// Returns `true` if the simulated force has an interval at some point.
    fn has_bands(&self) -> bool {
        self.points
            .iter()
            .flat_map(|point| point.simulated)
            .any(|simulated| simulated.band_n.is_some())
    }

    /// Returns `true` if the number of filaments makes the simulated force uncertain at some point.
    fn has_uncertainty(&self) -> bool {
        self.points
            .iter()
            .flat_map(|point| point.simulated)
            .any(|simulated| simulated.uncertainty_n > 0.0)
    }

    /// Returns bias, RMSE and number of points within one standard deviation. `None` if no point
    /// can be compared.
    #[must_use]
    pub fn deviation(&self) -> Option<ForceDeviation> {
        let differences: Vec<f64> = self
            .points
            .iter()
            .filter_map(ComparedPoint::difference_n)
            .collect();
        let count = differences.len();
        if count == 0 {
            return None;
        }
        // Simulated forces may be so large that their squares are infinite.
        let scale = differences
            .iter()
            .fold(f64::MIN_POSITIVE, |largest, difference| {
                difference.abs().max(largest)
            });
        let scaled = || differences.iter().map(|difference| difference / scale);
        let mean = |sum: f64| sum / count as f64;
        let within: Vec<bool> = self
            .points
            .iter()
            .filter_map(ComparedPoint::is_within)
            .collect();
        Some(ForceDeviation {
            count,
            bias_n: scale * mean(scaled().sum()),
            rmse_n: scale * mean(scaled().map(|difference| difference * difference).sum()).sqrt(),
            within: (within.len() == count)
                .then(|| within.iter().filter(|is_within| **is_within).count()),
        })
    }
}

/// Compares measured forces with those of a study, once for each combination of the settings swept
/// in addition to velocity and depth. Each named tool is compared with its own points. At most 1000
/// combinations are compared, evenly spread. More than 1000 points reduce this number, which limits
/// the comparison to a few million differences.
#[must_use]
pub fn compare(
    study: &Study,
    results: &[CaseResult],
    measured: &[Measurement],
) -> Vec<ForceComparison> {
    let slices = compared_slices(study, measured).into_iter();
    slices
        .map(|slice| ForceComparison {
            fixed: slice.fixed.clone(),
            condition: slice.condition(),
            points: points_of(study, &slice, measured)
                .map(|measured| {
                    let Measurement {
                        speed,
                        penetration_depth_m,
                        ..
                    } = measured;
                    let across = slice.at_speed(study, speed);
                    let simulated = tool_force(study, results, &slice, across, penetration_depth_m);
                    ComparedPoint {
                        measured,
                        across,
                        simulated,
                    }
                })
                .collect(),
        })
        .collect()
}

/// Returns the points that belong to the tool of a slice.
pub fn points_of<'m>(
    study: &Study,
    slice: &Slice,
    measured: &'m [Measurement],
) -> impl Iterator<Item = Measurement> + 'm {
    let tool = study.tool_of(slice.case(0, 0));
    measured
        .iter()
        .copied()
        .filter(move |point| point.tool.is_none_or(|own| own == tool))
}

/// Returns the slices that are compared with measured forces; none for a tool without a measured
/// force.
fn compared_slices(study: &Study, measured: &[Measurement]) -> Vec<Slice> {
    if measured.is_empty() {
        return Vec::new();
    }
    let slices = process_slices(study, (MAX_ROWS / measured.len()).clamp(2, MAX_SLICES)).chosen;
    slices
        .into_iter()
        .filter(|slice| points_of(study, slice, measured).next().is_some())
        .collect()
}

/// Returns the relative uncertainty of the tool force, from the number of filaments.
pub fn relative_uncertainty(settings: &Settings) -> f64 {
    let tool = &settings.tool;
    let ratio = tool.filament_count_uncertainty / tool.filament_count;
    if ratio.is_finite() { ratio } else { 0.0 }
}

/// Returns `F_n,w` in a slice, at a position on its horizontal side and a depth (m).
/// [`Slice::at_speed`] returns the position of a speed.
pub fn tool_force(
    study: &Study,
    results: &[CaseResult],
    slice: &Slice,
    across: f64,
    depth: f64,
) -> Result<SimulatedForce, Missing> {
    let at = |value: &dyn Fn(&CaseSummary) -> Option<f64>| {
        interpolate(results, slice, [across, depth], value)
    };
    let force_n = at(&|summary| Some(summary.metrics.tool_contact_normal_force_n))?;
    let end = |index: usize| at(&|summary| Some(summary.scatter.as_ref()?.band()[index])).ok();
    let [x, y] = [(&slice.x, across), (&slice.y, depth)]
        .map(|(side, at)| weights(side, at).map_or(0, |around| around[0].0));
    Ok(SimulatedForce {
        force_n,
        uncertainty_n: force_n.abs() * relative_uncertainty(&study.settings(slice.case(x, y))),
        band_n: end(0).zip(end(1)).map(|(lower, upper)| [lower, upper]),
    })
}

/// Interpolates a value of the cases of a slice linearly along each side.
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
            let summary = results[slice.case(column, row)]
                .as_ref()
                .map_err(|_| Missing::Failed)?;
            sum += part_up * part_across * value(summary).ok_or(Missing::Failed)?;
        }
    }
    Ok(sum)
}

/// Returns the positions of the two values around `at`, with their weights. `None` outside.
fn weights(side: &Varied, at: f64) -> Option<[(usize, f64); 2]> {
    let values = &side.values;
    let above = values.partition_point(|&value| value <= at);
    let around = [
        above.checked_sub(1),
        Some(above).filter(|&above| above < values.len()),
    ];
    if let Some(position) = around
        .into_iter()
        .flatten()
        .find(|&position| same(values[position], at))
    {
        return Some([(position, 1.0), (position, 0.0)]);
    }
    let [Some(below), Some(above)] = around else {
        return None;
    };
    let part = (at - values[below]) / (values[above] - values[below]);
    Some([(below, 1.0 - part), (above, part)])
}

/// Returns a force with this number of decimals, or as a power of ten if it would not fit into a
/// table.
fn newtons(force: f64, decimals: usize) -> String {
    if force.abs() < MAX_PLAIN_FORCE_N {
        format!("{force:.decimals$}")
    } else {
        format!("{force:.2e}")
    }
}

/// Returns a difference between forces, with its sign.
fn signed(difference: f64) -> String {
    let sign = if difference.is_sign_negative() {
        ""
    } else {
        "+"
    };
    format!("{sign}{}", newtons(difference, 1))
}

/// Returns the deviations as a table for people, with prose in lines of at most `width` columns.
#[must_use]
pub fn comparison_table(comparisons: &[ForceComparison], width: usize) -> String {
    let mut text = String::new();
    for comparison in comparisons.iter().take(MAX_PRINTED.0) {
        let condition = match comparison.condition.as_str() {
            "" => String::new(),
            condition => format!(", {condition}"),
        };
        wrap(
            width,
            &mut text,
            "",
            &format!("F_n,w in N: simulated and measured{condition}"),
        );
        let first = comparison.points.first().map(|point| point.measured);
        let [speed, unit] = match first.map(|first| first.speed) {
            Some(Speed::Rotational(_)) => ["n_w", "rpm"],
            _ => ["v_b", "m/s"],
        };
        let has_std = first.is_some_and(|first| first.std_n.is_some());
        let std = if has_std { "± std" } else { "" };
        let spread = match (comparison.has_bands(), comparison.has_uncertainty()) {
            (true, _) => "95 %",
            (false, true) => "± N_f",
            (false, false) => "",
        };
        let headings = [
            [
                speed,
                "a_e",
                "measured",
                "simulated",
                "difference",
                "within",
            ],
            [unit, "mm", std, spread, "", "std"],
        ]
        .map(|heading| heading.map(str::to_owned));
        let points = comparison
            .points
            .iter()
            .take(MAX_PRINTED.1)
            .map(row_of_point);
        let shown = if has_std {
            headings[0].len()
        } else {
            headings[0].len() - 1
        };
        let rows: Vec<Vec<String>> = headings
            .into_iter()
            .chain(points)
            .map(|row| row[..shown].to_vec())
            .collect();
        aligned(&rows)
            .iter()
            .for_each(|line| text.push_str(&format!("{}\n", line.trim_end())));
        if comparison.points.len() > MAX_PRINTED.1 {
            text.push_str(&format!(
                "  … and {} more points\n",
                comparison.points.len() - MAX_PRINTED.1
            ));
        }
        let verdict = match comparison.deviation() {
            Some(ForceDeviation {
                count,
                bias_n,
                rmse_n,
                within,
            }) => {
                let within = within.map_or_else(String::new, |within| {
                    format!(
                        ", within ± std {within} ({:.0} %)",
                        100.0 * within as f64 / count as f64
                    )
                });
                format!(
                    "{count} of {} points compared: bias {} N, RMSE {} N{within}",
                    comparison.points.len(),
                    signed(bias_n),
                    newtons(rmse_n, 1)
                )
            }
            None => "no point can be compared".to_owned(),
        };
        wrap(width, &mut text, "  ", &verdict);
    }
    if comparisons.len() > MAX_PRINTED.0 {
        text.push_str(&format!(
            "… and {} more comparisons\n",
            comparisons.len() - MAX_PRINTED.0
        ));
    }
    text
}

/// Returns a point as a row of the table: speed, depth, measured and simulated force, difference,
/// and `yes` for a force within the standard deviation.
fn row_of_point(point: &ComparedPoint) -> [String; 6] {
    let Measurement {
        speed,
        penetration_depth_m,
        force_n,
        std_n,
        ..
    } = point.measured;
    let pair = |value: f64, spread: f64| format!("{} ± {}", newtons(value, 1), newtons(spread, 1));
    let measured = std_n.map_or_else(|| newtons(force_n, 1), |std| pair(force_n, std));
    let simulated = match point.simulated {
        Ok(SimulatedForce {
            force_n,
            band_n: Some([lower, upper]),
            ..
        }) => {
            let decimals = usize::from(upper - lower < NARROW_BAND_N);
            format!(
                "{} [{} … {}]",
                newtons(force_n, 1),
                newtons(lower, decimals),
                newtons(upper, decimals)
            )
        }
        Ok(SimulatedForce {
            force_n,
            uncertainty_n: 0.0,
            band_n: None,
        }) => newtons(force_n, 1),
        Ok(SimulatedForce {
            force_n,
            uncertainty_n,
            band_n: None,
        }) => pair(force_n, uncertainty_n),
        Err(missing) => missing.name().to_owned(),
    };
    let difference = point.difference_n().map(signed).unwrap_or_default();
    let within = point
        .is_within()
        .map_or("", |is_within| if is_within { "yes" } else { "no" });
    [
        short(speed.value()),
        short(1e3 * penetration_depth_m),
        measured,
        simulated,
        difference,
        within.to_owned(),
    ]
}

/// Writes `measured_comparison.csv`: a heading, then one row per point.
pub fn write_comparison(out: impl Write, comparisons: &[ForceComparison]) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    let further = comparisons
        .first()
        .map_or(&[][..], |comparison| &comparison.fixed);
    let bands = if comparisons.iter().any(ForceComparison::has_bands) {
        &["simulated_lower_95_n", "simulated_upper_95_n"][..]
    } else {
        &[]
    };
    let first = comparisons
        .first()
        .and_then(|comparison| comparison.points.first());
    let names = [
        first
            .map_or(Quantity::Velocity, |point| point.measured.speed.quantity())
            .key(),
        "penetration_depth_m",
        "measured_force_n",
        "measured_std_n",
        "simulated_force_n",
        "simulated_uncertainty_n",
    ];
    let further = further.iter().map(|(setting, _)| setting.path());
    let verdict = ["difference_n", "within_std", "status"];
    writer.write_record(
        further
            .chain(names)
            .chain(bands.iter().copied())
            .chain(verdict),
    )?;
    for comparison in comparisons {
        for point in &comparison.points {
            let Measurement {
                speed,
                penetration_depth_m,
                force_n,
                std_n,
                ..
            } = point.measured;
            let number = |number: f64| format!("{number:?}");
            let of_axis = |(setting, value): &(Setting, f64)| match setting.names() {
                Some(_) => setting.text(*value),
                None => number(*value),
            };
            let mut row: Vec<String> = comparison.fixed.iter().map(of_axis).collect();
            row.extend([speed.value(), penetration_depth_m, force_n].map(number));
            let simulated = point.simulated.ok();
            let optional = |value: Option<f64>| value.map_or_else(String::new, number);
            row.push(optional(std_n));
            row.push(optional(simulated.map(|simulated| simulated.force_n)));
            row.push(optional(simulated.map(|simulated| simulated.uncertainty_n)));
            let band = simulated.and_then(|simulated| simulated.band_n);
            row.extend((0..bands.len()).map(|end| optional(band.map(|band| band[end]))));
            row.push(optional(point.difference_n()));
            let within = point
                .is_within()
                .map(|within| if within { "yes" } else { "no" });
            row.push(within.unwrap_or_default().to_owned());
            row.push(
                point
                    .simulated
                    .map_or_else(Missing::name, |_| "ok")
                    .to_owned(),
            );
            writer.write_record(&row)?;
        }
    }
    writer.flush()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::insight::testing::{self, metrics_of, with_force};
    use bristle_study::grid::{DEPTH, Sweep, VELOCITY};
    use bristle_study::text::layout::WIDTH;

    /// Returns a study with two velocities and three depths at unequal distances.
    pub(super) fn study() -> Study {
        let text = "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\nfilament_count = 1000\n\
             filament_count_uncertainty = 100\n[filament]\nlength_m = 0.040\ndiameter_m = 1.18e-3\n[study]\n\
             brushing_velocity_m_s = [20.0, 10.0]\npenetration_depth_m = [1e-3, 2e-3, 4e-3]";
        testing::study(text)
    }

    /// Returns forces of 10 N s/m · v_b + 10⁵ N/m · a_e; the case `failed` is an error.
    fn results(study: &Study, failed: Option<usize>) -> Vec<CaseResult> {
        let case = |case: usize| {
            let process = study.settings(case).process;
            let force = 10.0 * process.brushing_velocity_m_s + 1e5 * process.penetration_depth_m;
            match failed {
                Some(number) if number == case => Err("failed".to_owned()),
                _ => with_force(force, 0.0),
            }
        };
        (0..study.case_count()).map(case).collect()
    }

    pub(super) fn point(
        velocity: f64,
        penetration_depth_m: f64,
        force_n: f64,
        std_n: impl Into<Option<f64>>,
    ) -> Measurement {
        Measurement {
            speed: Speed::Velocity(velocity),
            second_speed_rpm: None,
            penetration_depth_m,
            force_n,
            std_n: std_n.into(),
            tool: None,
        }
    }

    #[test]
    fn forces_are_interpolated_within_the_study_only() {
        let study = study();
        assert_eq!(
            study.sweeps().iter().map(Sweep::path).collect::<Vec<_>>(),
            [DEPTH, VELOCITY]
        );
        let force = |velocity, depth, failed| {
            let comparison = compare(
                &study,
                &results(&study, failed),
                &[point(velocity, depth, 0.0, 0.0)],
            );
            comparison[0].points[0]
                .simulated
                .map(|simulated| simulated.force_n)
        };
        let near = |found: Result<f64, Missing>, expected: f64| {
            assert!(
                (found.expect("a force") - expected).abs() < 1e-9,
                "{found:?}, not {expected}"
            );
        };
        near(force(10.0, 1e-3, None), 200.0);
        near(force(20.0, 4e-3, None), 600.0);
        // Bilinear interpolation reproduces a linear function.
        near(force(12.5, 3e-3, None), 425.0);
        near(force(10.0 * (1.0 + 1e-12), 1e-3, None), 200.0);
        for (velocity, depth) in [(9.9, 2e-3), (20.1, 2e-3), (15.0, 0.9e-3), (15.0, 4.1e-3)] {
            assert_eq!(force(velocity, depth, None), Err(Missing::Outside));
        }
        // Case 0 is at 20 m/s and 1 mm. It matters only where it has a weight.
        assert_eq!(force(15.0, 1e-3, Some(0)), Err(Missing::Failed));
        near(force(10.0, 1e-3, Some(0)), 200.0);
        near(force(15.0, 3e-3, Some(0)), 450.0);
    }

    #[test]
    fn rotational_speeds_are_compared_at_their_velocity() {
        let study = study();
        let mut settings = study.settings(0);
        settings.process.brushing_velocity_m_s = 12.5;
        let speed = Speed::Rotational(settings.rotational_speed_rpm());
        let measured = [Measurement {
            speed,
            ..point(0.0, 3e-3, 400.0, 30.0)
        }];
        let comparisons = compare(&study, &results(&study, None), &measured);
        let found = comparisons[0].points[0];
        assert!(
            (found.across - 12.5).abs() < 1e-12 && found.is_within() == Some(true),
            "{found:?}"
        );
        let table = comparison_table(&comparisons, WIDTH);
        assert!(
            table.contains("\n    n_w  a_e ") && table.contains("\n    rpm   mm "),
            "{table}"
        );
        let mut written = Vec::new();
        write_comparison(&mut written, &comparisons).expect("memory takes what is written to it");
        assert!(written.starts_with(b"rotational_speed_rpm,penetration_depth_m,measured_force_n,"));
    }

    #[test]
    fn deviations_are_those_computed_by_hand() {
        let study = study();
        // The simulated forces are 200, 300 and 400, the differences −10, +20 and +5. The last
        // point is outside.
        let measured = [
            point(10.0, 1e-3, 210.0, 10.0),
            point(20.0, 1e-3, 280.0, 19.0),
            point(20.0, 2e-3, 395.0, 6.0),
            point(30.0, 2e-3, 1.0, 1.0),
        ];
        let comparisons = compare(&study, &results(&study, None), &measured);
        assert_eq!(comparisons.len(), 1);
        let deviation = comparisons[0].deviation().expect("three points");
        assert_eq!((deviation.count, deviation.within), (3, Some(2)));
        assert!((deviation.bias_n - 5.0).abs() < 1e-9);
        assert!((deviation.rmse_n - 175.0_f64.sqrt()).abs() < 1e-9);
        let uncertainty = comparisons[0].points[0]
            .simulated
            .expect("a force")
            .uncertainty_n;
        assert!(
            (uncertainty - 20.0).abs() < 1e-9,
            "a tenth, like that of the filaments"
        );
        let table = comparison_table(&comparisons, WIDTH);
        assert!(
            table.contains(
                "3 of 4 points compared: bias +5.0 N, RMSE 13.2 N, within ± std 2 (67 %)"
            ),
            "{table}"
        );

        let unsure = measured.map(|point| Measurement {
            std_n: None,
            ..point
        });
        let comparisons = compare(&study, &results(&study, None), &unsure);
        assert_eq!(
            comparisons[0].deviation(),
            Some(ForceDeviation {
                within: None,
                ..deviation
            })
        );
        let table = comparison_table(&comparisons, WIDTH);
        assert!(
            table.contains("RMSE 13.2 N\n") && !table.contains("std"),
            "{table}"
        );

        let outside = compare(&study, &results(&study, None), &measured[3..]);
        assert_eq!(outside[0].deviation(), None);
        assert!(comparison_table(&outside, WIDTH).contains("no point can be compared"));
    }

    #[test]
    fn large_forces_have_a_finite_deviation() {
        let study = study();
        let mut results = results(&study, None);
        for (index, result) in results.iter_mut().enumerate() {
            let sign = if index.is_multiple_of(2) { 1.0 } else { -1.0 };
            metrics_of(result).tool_contact_normal_force_n = sign * 1e308;
        }
        let measured = [
            point(20.0, 1e-3, -bristle_study::input::measured::LARGEST, 0.0),
            point(10.0, 1e-3, bristle_study::input::measured::LARGEST, 0.0),
        ];
        let comparisons = compare(&study, &results, &measured);
        let deviation = comparisons[0].deviation().expect("two points");
        assert!(
            deviation.rmse_n == 1e308 && deviation.bias_n.abs() <= 1e308,
            "{deviation:?}"
        );
        let table = comparison_table(&comparisons, WIDTH);
        assert!(
            table.contains("RMSE 1.00e308 N")
                && table.lines().all(|line| line.chars().count() <= WIDTH),
            "{table}"
        );
    }
}
