//! Growth of an edge by a fit, and the square root of time, fitted to the same radii.

use nalgebra::DVector;

use crate::calibrate::FINE;
use crate::calibrate::edge::Radii;
use crate::calibrate::model::Model;
use crate::calibrate::problem::Problem;
use crate::calibrate::search::{self, Minimum};
use crate::calibrate::simulator::{CalibrationContext, Interrupted, Precision, Simulator};
use crate::calibrate::statistics::Errors;

/// Intervals between the reported times of the growth of an edge.
const GROWTH_INTERVALS: usize = 100;

/// Square root of time `R² = R_0² + c² t`, fitted to the same radii in place of the simulated
/// growth.
#[derive(Clone, Debug, PartialEq)]
pub struct SquareRoot {
    /// `c` in m/√s.
    pub c_m_per_sqrt_s: f64,
    /// Sum of squared residuals over their standard deviations.
    pub chi_squared: f64,
    /// Radius in m by this law at each observation.
    pub radii: Vec<f64>,
    /// Slope of measured less these radii, in standard deviations over the logarithm of time,
    /// divided by its standard error.
    pub trend: f64,
}

/// An edge at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrownEdge {
    /// The time in s.
    pub time_s: f64,
    /// Radius in m by the fit.
    pub radius_m: f64,
    /// Standard error in m that the calibration leaves the radius.
    pub error_m: f64,
    /// Radius in m by the square root of time.
    pub square_root_m: f64,
}

/// Fits the square root of time to the radii. Returns it with its problem and its values of the
/// fitted settings.
pub(super) fn by_square_root(
    problem: &Problem,
    radii: &Radii,
    means: CalibrationContext<'_>,
) -> Result<Option<(SquareRoot, Problem, Vec<f64>)>, Interrupted> {
    let problem = Problem {
        radii: Some(radii.by_square_root()),
        ..problem.clone()
    };
    let model = Model::new(Simulator::new(&problem, means));
    let Some(best) = search::minima(&model, FINE)?.minima.into_iter().next() else {
        return Ok(None);
    };
    let values = model.values(&best.x);
    let residuals = -model.residuals(&best.forces);
    let later: Vec<(f64, f64)> = radii
        .turns
        .iter()
        .zip(&residuals)
        .filter(|(turns, _)| **turns > 0.0)
        .map(|(turns, own)| (turns.ln(), *own))
        .collect();
    let root = SquareRoot {
        c_m_per_sqrt_s: problem
            .radii
            .as_ref()
            .map_or(0.0, |radii| radii.speed_of_root(&problem.fitted, &values)),
        chi_squared: best.squares,
        radii: best.forces,
        trend: trend(&later),
    };
    Ok(Some((root, problem, values)))
}

/// Returns the slope of points over its standard error, by least squares; zero for fewer than
/// three.
fn trend(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(&|point| point.0), mean(&|point| point.1));
    let (xx, xy) = (
        mean(&|point| (point.0 - x).powi(2)),
        mean(&|point| (point.0 - x) * (point.1 - y)),
    );
    let rest = mean(&|point| (point.1 - y - xy / xx * (point.0 - x)).powi(2));
    if points.len() < 3 || rest == 0.0 {
        0.0
    } else {
        xy / xx / (rest / (count - 2.0) / xx).sqrt()
    }
}

/// Returns the growth from the start to the last radius, with its standard error.
pub(super) fn grown(
    model: &Model<'_>,
    radii: &Radii,
    best: &Minimum,
    errors: &Errors,
    (_, rooted, values_of_root): &(SquareRoot, Problem, Vec<f64>),
) -> Vec<GrownEdge> {
    let fitted = &model.problem().fitted;
    let last = radii.turns.last().copied().unwrap_or_default();
    let turns: Vec<f64> = (0..=GROWTH_INTERVALS)
        .map(|i| last * (i as f64 / GROWTH_INTERVALS as f64).powi(2))
        .collect();
    let here = radii.after(fitted, &model.values(&best.x), &turns);
    let stencil = model.stencil(
        &best.x,
        Precision {
            central: true,
            ..FINE
        },
    );
    let around: Vec<Vec<f64>> = stencil
        .points
        .iter()
        .map(|x| radii.after(fitted, &model.values(x), &turns))
        .collect();
    let of_root = rooted.radii.as_ref().map_or_else(Vec::new, |radii| {
        radii.after(fitted, values_of_root, &turns)
    });
    let covariance = errors.covariance();
    let edge = |(i, turns): (usize, &f64)| {
        let slopes = DVector::from_fn(fitted.len(), |column, _| {
            stencil.derivative(column, here[i], |point| around[point][i])
        });
        GrownEdge {
            time_s: turns * radii.second_per_turn,
            radius_m: here[i],
            error_m: (&covariance * &slopes).dot(&slopes).max(0.0).sqrt(),
            square_root_m: of_root[i],
        }
    };
    turns.iter().enumerate().map(edge).collect()
}
