//! Compares measured tool forces with simulated ones: the user's table in, deviations out.
//!
//! A force is compared where it was measured. Between the cases of a study, the simulated force is
//! interpolated linearly in velocity and depth. It is not extrapolated.

mod hints;
mod table;
#[cfg(test)]
mod tests;

use bristle::model::settings::Settings;

use crate::insight::slices::{Slice, Varied, process_slices};
use bristle_study::grid::{CaseResult, CaseSummary, Setting, Study};
use bristle_study::input::measured::{Measurement, same};
use bristle_study::input::table::MAX_ROWS;

pub use hints::unusual_points;
pub use table::{comparison_table, write_comparison};

/// Maximum number of compared slices.
const MAX_SLICES: usize = 1000;

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
