//! Intervals by the profile of the sum of squares: all values of a setting for which some values of
//! the other settings fit nearly as well.
//!
//! The ends of all intervals are sought side by side. At each end the Jacobian of the minimum
//! corrects the other settings, and gives the further fall of the sum of squares. Then the end
//! moves to where the profile, as a parabola through the minimum, has the value of the level of
//! confidence.

use nalgebra::{DMatrix, DVector};

use crate::calibrate::model::Model;
use crate::calibrate::search::Minimum;
use crate::calibrate::simulator::{Interrupted, Precision};
use crate::calibrate::statistics::Errors;

/// Relative error of the distance from the minimum at which an end is found.
const MAX_RELATIVE_ERROR: f64 = 0.02;
/// Largest number of corrections of an end.
const MAX_CORRECTIONS: usize = 8;
/// Largest factor by which the distance from the minimum changes in one correction.
const MAX_STRETCH: f64 = 2.0;

/// One end of an interval that is sought.
struct IntervalEnd {
    setting: usize,
    x: DVector<f64>,
    is_found: bool,
}

/// Returns the intervals of the coordinates of `settings` in which the profile exceeds the least
/// sum of squares by at most `excess`.
pub fn intervals(
    model: &Model<'_>,
    minimum: &Minimum,
    jacobian: &DMatrix<f64>,
    errors: &Errors,
    excess: f64,
    settings: &[usize],
    precision: Precision,
) -> Result<Vec<[f64; 2]>, Interrupted> {
    let limits = model.limits();
    let best = DVector::from_column_slice(&minimum.x);
    let forces = model.forces(std::slice::from_ref(&minimum.x), precision)?;
    let least = model.residuals(&forces[0]).norm_squared();
    let end = |setting: usize, side: f64| {
        let column = errors.unscaled.column(setting);
        let step = column * (side * excess.sqrt() / column[setting].sqrt());
        IntervalEnd {
            setting,
            x: within(&best + step, &limits),
            is_found: false,
        }
    };
    let mut ends: Vec<IntervalEnd> = settings
        .iter()
        .flat_map(|&setting| [end(setting, -1.0), end(setting, 1.0)])
        .collect();
    for _ in 0..MAX_CORRECTIONS {
        let sought: Vec<usize> = (0..ends.len()).filter(|&end| !ends[end].is_found).collect();
        if sought.is_empty() {
            break;
        }
        let points: Vec<Vec<f64>> = sought
            .iter()
            .map(|&end| ends[end].x.as_slice().to_vec())
            .collect();
        for (end, forces) in sought.into_iter().zip(model.forces(&points, precision)?) {
            let residuals = model.residuals(&forces);
            let IntervalEnd {
                setting,
                x,
                is_found,
            } = &mut ends[end];
            if !residuals.norm_squared().is_finite() {
                *x = &best + (&*x - &best) * 0.5;
                continue;
            }
            let (correction, falls) = of_others(jacobian, &residuals, *setting);
            let above = residuals.norm_squared() - falls - least;
            let stretch = if above > 0.0 {
                (excess / above).sqrt()
            } else {
                MAX_STRETCH
            };
            let [low, high] = limits[*setting];
            let is_at_limit = x[*setting] <= low || x[*setting] >= high;
            *is_found = ((stretch - 1.0).abs() < MAX_RELATIVE_ERROR
                && falls < 2.0 * MAX_RELATIVE_ERROR * excess)
                || (is_at_limit && stretch > 1.0);
            if !*is_found {
                let corrected = &*x + correction;
                *x = within(
                    &best + (corrected - &best) * stretch.clamp(1.0 / MAX_STRETCH, MAX_STRETCH),
                    &limits,
                );
            }
        }
    }
    Ok(ends
        .chunks(2)
        .map(|ends| [ends[0].x[ends[0].setting], ends[1].x[ends[1].setting]])
        .collect())
}

/// Returns the step of all coordinates but one that minimises the linearised residuals, and the
/// fall of the sum of squares by this step.
fn of_others(
    jacobian: &DMatrix<f64>,
    residuals: &DVector<f64>,
    setting: usize,
) -> (DVector<f64>, f64) {
    let mut step = DVector::zeros(jacobian.ncols());
    if jacobian.ncols() == 1 {
        return (step, 0.0);
    }
    let others = jacobian.clone().remove_column(setting);
    let solution = others.clone().svd(true, true).solve(residuals, 1e-12);
    let Ok(solution) = solution else {
        return (step, 0.0);
    };
    let falls = (&others * &solution).norm_squared();
    for (row, value) in solution.iter().enumerate() {
        step[row + usize::from(row >= setting)] = -value;
    }
    (step, falls)
}

fn within(x: DVector<f64>, limits: &[[f64; 2]]) -> DVector<f64> {
    DVector::from_iterator(
        x.len(),
        x.iter()
            .zip(limits)
            .map(|(x, [low, high])| x.clamp(*low, *high)),
    )
}
