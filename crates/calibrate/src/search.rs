//! Minima of the sum of squares within the bounds, from several starts.
//!
//! The boundary between striking and sweeping makes local minima. Starts are the values of the file and points of a scrambled Sobol sequence
//! over the whole range. Each goes downhill at a coarse tolerance by a trust region that respects the bounds (Branch, Coleman and Li 1999),
//! until it arrives at a minimum that is known, or finds another.

use std::cell::RefCell;

use nalgebra::{DMatrix, DVector};

use crate::model::Model;
use crate::parameters::Fitted;
use crate::problem::Observation;
use crate::simulator::{Interrupted, Precision};
use crate::statistics::Errors;
use basin::{
    BoxBounds, ConstraintDescription, ConstraintSet, ConstraintSolveError, Constraints, CostFunction, DenseMatrix,
    Executor, Jacobian, Residual, TrustRegionReflective,
};

/// The number of starts besides the values of the file: the best of so many points.
pub const STARTS: usize = 8;
const POINTS: usize = 32;
/// Seed of their sequence.
const SEED: u32 = 1;
/// Root mean square difference of forces, over their standard deviations, up to which two minima are one.
const SAME: f64 = 0.3;
/// The same over the forces, where standard deviations are smaller.
const SAME_RELATIVE: f64 = 0.02;

/// The share of the work that starts have, about.
const OF_STARTS: f64 = 0.6;

/// A minimum of the sum of squares.
#[derive(Clone, Debug)]
pub struct Minimum {
    /// Coordinates.
    pub x: Vec<f64>,
    /// Simulated forces.
    pub forces: Vec<f64>,
    /// Sum of squares.
    pub squares: f64,
    /// The number of starts that came here.
    pub starts: usize,
    /// Derivatives of the residuals near it.
    jacobian: DMatrix<f64>,
}

/// Why a descent ended early.
enum Ended {
    /// It came to a known minimum, by its position.
    Known(usize),
    Interrupted(Interrupted),
}

/// A descent from one start.
struct Descent<'a> {
    model: &'a Model<'a>,
    precision: Precision,
    lower: Vec<f64>,
    upper: Vec<f64>,
    known: &'a [Minimum],
    /// The coordinates that were simulated last, and their forces.
    last: RefCell<(Vec<f64>, Vec<f64>)>,
    /// The derivatives that were taken last.
    derivatives: RefCell<DMatrix<f64>>,
}

impl Descent<'_> {
    fn forces(&self, x: &[f64]) -> Result<Vec<f64>, Ended> {
        if self.last.borrow().0 != x {
            let forces = self.model.forces(&[x.to_vec()], self.precision).map_err(Ended::Interrupted)?;
            let forces = forces.into_iter().next().unwrap_or_default();
            *self.last.borrow_mut() = (x.to_vec(), forces);
        }
        Ok(self.last.borrow().1.clone())
    }
}

impl Constraints for &Descent<'_> {
    type Set = ConstraintSet<BoxBounds<Vec<f64>>>;
    fn constraints(&self) -> <Self::Set as ConstraintDescription>::Borrowed<'_> {
        ConstraintSet::new().with_bounds(BoxBounds::new(Some(&self.lower), Some(&self.upper)))
    }
}

impl CostFunction for &Descent<'_> {
    type Param = Vec<f64>;
    type Output = f64;
    type Error = Ended;
    fn cost(&self, x: &Vec<f64>) -> Result<f64, Ended> {
        Ok(0.5 * self.model.residuals(&self.forces(x)?).norm_squared())
    }
}

impl Residual for &Descent<'_> {
    type Param = Vec<f64>;
    type Output = Vec<f64>;
    type Error = Ended;
    fn residual(&self, x: &Vec<f64>) -> Result<Vec<f64>, Ended> {
        Ok(self.model.residuals(&self.forces(x)?).as_slice().to_vec())
    }
}

impl Jacobian for &Descent<'_> {
    type Jacobian = DenseMatrix;
    fn jacobian(&self, x: &Vec<f64>) -> Result<DenseMatrix, Ended> {
        let forces = self.forces(x)?;
        if let Some(known) = self.known.iter().position(|known| leads_to(self.model, known, x, &forces)) {
            return Err(Ended::Known(known));
        }
        let jacobian = self.model.jacobian(x, &forces, self.precision).map_err(Ended::Interrupted)?;
        *self.derivatives.borrow_mut() = jacobian.clone();
        Ok(DenseMatrix::from_fn(jacobian.nrows(), jacobian.ncols(), |row, column| jacobian[(row, column)]))
    }
}

/// Whether a descent leads from `x`, where there are these forces, to a minimum: it is there, or where the residuals are those that the
/// derivatives at the minimum tell.
fn leads_to(model: &Model<'_>, minimum: &Minimum, x: &[f64], forces: &[f64]) -> bool {
    /// Share of the change of the residuals that the derivatives may miss.
    const MISSED: f64 = 0.2;
    if is_same(model, &minimum.forces, forces) {
        return true;
    }
    let change = model.residuals(forces) - model.residuals(&minimum.forces);
    let step = DVector::from_iterator(x.len(), x.iter().zip(&minimum.x).map(|(a, b)| a - b));
    minimum.jacobian.ncols() == x.len() && (&change - &minimum.jacobian * step).norm() < MISSED * change.norm()
}

/// Whether two sets of forces are those of one minimum.
fn is_same(model: &Model<'_>, these: &[f64], those: &[f64]) -> bool {
    let observations = &model.problem().observations;
    let difference = |((own, this), that): ((&Observation, &f64), &f64)| {
        ((this - that) / own.std.max(SAME_RELATIVE * own.value)).powi(2)
    };
    let sum: f64 = observations.iter().zip(these).zip(those).map(difference).sum();
    (sum / observations.len() as f64).sqrt() < SAME
}

/// Relative change of the coordinates over that of the sum of squares, at which a descent has arrived.
const STEP_OF_ARRIVAL: f64 = 0.01;
/// The most steps of a descent.
const STEPS: u64 = 30;

/// Goes downhill from `start`. `None` if it cannot be simulated there.
fn descend(
    model: &Model<'_>,
    start: &[f64],
    precision: Precision,
    known: &[Minimum],
) -> Result<Option<Result<Minimum, usize>>, Interrupted> {
    let limits: Vec<[f64; 2]> = model.problem().fitted.iter().map(|fitted| fitted.limits()).collect();
    let descent = Descent {
        model,
        precision,
        lower: limits.iter().map(|[low, _]| *low).collect(),
        upper: limits.iter().map(|[_, high]| *high).collect(),
        known,
        last: RefCell::default(),
        derivatives: RefCell::new(DMatrix::zeros(0, 0)),
    };
    let descent = &descent;
    let solver = TrustRegionReflective::new()
        .with_absolute_scaled_gradient_tolerance(1e-12)
        .with_relative_step_tolerance::<Vec<f64>, f64>(STEP_OF_ARRIVAL * precision.arrival)
        .with_relative_cost_change_tolerance(precision.arrival);
    let result = match Executor::from_start(descent, solver, start.to_vec()).max_iter(STEPS).run() {
        Ok(result) => result,
        Err(ConstraintSolveError::Evaluation(Ended::Known(position))) => return Ok(Some(Err(position))),
        Err(ConstraintSolveError::Evaluation(Ended::Interrupted(interrupted))) => return Err(interrupted),
        Err(_) => return Ok(None),
    };
    let squares = 2.0 * result.cost();
    if !squares.is_finite() {
        return Ok(None);
    }
    let x = result.param().clone();
    let forces = model.forces(std::slice::from_ref(&x), precision)?.into_iter().next().unwrap_or_default();
    Ok(Some(Ok(Minimum { x, forces, squares, starts: 1, jacobian: descent.derivatives.take() })))
}

/// The minima to which the starts lead, the least first, at a coarse precision; and the number of starts that cannot be simulated.
pub fn minima(model: &Model<'_>, precision: Precision) -> Result<(Vec<Minimum>, usize), Interrupted> {
    let mut found: Vec<Minimum> = Vec::new();
    let mut failed = 0;
    let starts = starts(model, precision)?;
    for (number, start) in starts.iter().enumerate() {
        match descend(model, start, precision, &found)? {
            None => failed += 1,
            Some(Err(known)) => found[known].starts += 1,
            Some(Ok(minimum)) => match found.iter().position(|known| is_same(model, &known.forces, &minimum.forces)) {
                Some(known) => {
                    let starts = found[known].starts + 1;
                    if minimum.squares < found[known].squares {
                        found[known] = minimum;
                    }
                    found[known].starts = starts;
                }
                None => found.push(minimum),
            },
        }
        model.simulator.tell(OF_STARTS * (number + 1) as f64 / starts.len() as f64);
    }
    found.sort_by(|a, b| a.squares.total_cmp(&b.squares));
    Ok((found, failed))
}

/// The same minimum at a finer precision. Where residuals are far below their standard deviations, as those of forces without noise, the descent
/// goes on: what it gains is a large share of them.
pub fn refined(model: &Model<'_>, minimum: &Minimum, precision: Precision) -> Result<Option<Minimum>, Interrupted> {
    /// Mean square residual of such forces, and when the descent then arrives.
    const EXACT: f64 = 0.01;
    const ARRIVAL: f64 = 1e-6;
    let mut refined = descend(model, &minimum.x, precision, &[])?.and_then(Result::ok);
    let is_exact = |found: &Minimum| found.squares < EXACT * found.forces.len() as f64 && !precision.interacts;
    if let Some(exact) = refined.take_if(|found| is_exact(found)) {
        refined = descend(model, &exact.x, Precision { arrival: ARRIVAL, ..precision }, &[])?.and_then(Result::ok);
    }
    Ok(refined.map(|refined| Minimum { starts: minimum.starts, ..refined }))
}

/// A lower minimum near one where contacts begin or end, which bend the forces: the best of descents from points around it, some standard
/// errors away. `None` if there is none.
pub fn lower(
    model: &Model<'_>,
    minimum: &Minimum,
    errors: &Errors,
    precision: Precision,
) -> Result<Option<Minimum>, Interrupted> {
    /// The points that are tried, how far they are, and from how many of them a descent begins.
    const TRIED: u32 = 48;
    const REACH: f64 = 4.0;
    const DESCENTS: usize = 4;
    /// Least relative fall of the sum of squares that counts.
    const FALL: f64 = 1e-3;
    let limits: Vec<[f64; 2]> = model.problem().fitted.iter().map(|fitted| fitted.limits()).collect();
    let point = |index: u32| -> Vec<f64> {
        let coordinate = |(dimension, [low, high]): (usize, &[f64; 2])| {
            let share = 2.0 * f64::from(sobol_burley::sample(index, dimension as u32, SEED)) - 1.0;
            (minimum.x[dimension] + share * REACH * errors.standard_error(dimension)).clamp(*low, *high)
        };
        limits.iter().enumerate().map(coordinate).collect()
    };
    let points: Vec<Vec<f64>> = (0..TRIED).map(point).collect();
    let forces = model.forces(&points, precision)?;
    let mut ranked: Vec<(f64, Vec<f64>)> =
        forces.iter().map(|forces| model.residuals(forces).norm_squared()).zip(points).collect();
    ranked.retain(|(squares, _)| squares.is_finite());
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best: Option<Minimum> = None;
    for (_, start) in ranked.iter().take(DESCENTS) {
        let found = descend(model, start, precision, &[])?.and_then(Result::ok);
        best = found.into_iter().chain(best).min_by(|a, b| a.squares.total_cmp(&b.squares));
    }
    Ok(best
        .filter(|found| found.squares < (1.0 - FALL) * minimum.squares)
        .map(|found| Minimum { starts: minimum.starts, ..found }))
}

/// The values of the file, and the best of points that fill the range.
fn starts(model: &Model<'_>, precision: Precision) -> Result<Vec<Vec<f64>>, Interrupted> {
    let problem = model.problem();
    let stated = problem.fitted.iter().zip(problem.stated()).map(|(fitted, value)| fitted.coordinate(value));
    let point = |index: usize| {
        let coordinate = |(dimension, fitted): (usize, &Fitted)| {
            let [low, high] = fitted.limits();
            low + (high - low) * f64::from(sobol_burley::sample(index as u32, dimension as u32, SEED))
        };
        problem.fitted.iter().enumerate().map(coordinate).collect()
    };
    let count = if model.simulator.means.starts > 0 { POINTS } else { 0 };
    let points: Vec<Vec<f64>> = (0..count).map(point).collect();
    let forces = model.forces(&points, precision)?;
    let squares = forces.iter().map(|forces| model.residuals(forces).norm_squared());
    let mut ranked: Vec<(f64, Vec<f64>)> = squares.zip(points).filter(|(squares, _)| squares.is_finite()).collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(std::iter::once(stated.collect())
        .chain(ranked.into_iter().take(model.simulator.means.starts).map(|(_, point)| point))
        .collect())
}
