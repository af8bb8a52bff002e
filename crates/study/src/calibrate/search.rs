//! Minima of the sum of squares within the bounds, from several starts.
//!
//! The boundary between striking and sweeping makes local minima. Starts are the values of the file
//! and the best points of a scrambled Sobol sequence over the whole range. All descend side by
//! side, which fills lanes, at a coarse precision. Where derivatives show that several lead to the
//! same minimum, only the lowest goes on.
//!
//! A descent takes Levenberg–Marquardt steps, cut at the bounds, damped by the rule of Nielsen
//! (1999). The forces of a step update the Jacobian (Broyden 1965). Differences are taken again
//! only where the Jacobian was wrong.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::calibrate::model::Model;
use crate::calibrate::parameters::Fitted;
use crate::calibrate::problem::Observation;
use crate::calibrate::simulator::{Interrupted, Precision};
use crate::calibrate::statistics::Errors;

/// Number of starts besides the values of the file, and number of points whose best are starts.
pub const STARTS: usize = 8;
const POINTS: usize = 32;
/// Seed of the sequence of points.
const SEED: u32 = 1;
/// Root mean square difference of forces, over their standard deviations, below which two minima
/// are one.
const MAX_RMS_DIFFERENCE: f64 = 0.3;
/// Least standard deviation in this difference, over the force.
const MIN_RELATIVE_STD: f64 = 0.02;
/// Approximate share of the starts in the work.
const WORK_SHARE_OF_STARTS: f64 = 0.4;

/// A minimum of the sum of squares, or the state of a descent to one.
#[derive(Clone, Debug)]
pub struct Minimum {
    /// Coordinates.
    pub x: Vec<f64>,
    /// Simulated forces.
    pub forces: Vec<f64>,
    /// Sum of squares.
    pub squares: f64,
    /// Number of starts that led here.
    pub starts: usize,
    /// Jacobian of the residuals near the point; without columns if there is none yet.
    pub jacobian: DMatrix<f64>,
}

/// Damping at the start of a descent, and the factor by which it grows at first.
const DAMPING: f64 = 1e-2;
const GROWTH: f64 = 2.0;
/// Successive rejected steps, with derivatives taken where they begin, after which a descent ends.
const MAX_MISSES: usize = 4;
/// Longest step in a coordinate: forces of filaments that sweep change by a factor of e.
const MAX_STEP: f64 = 1.0;
/// Fall of the sum of squares over that of the linear model: the least of an accepted step, and of
/// one with a good Jacobian.
const MIN_ACCEPTED_GAIN: f64 = 1e-3;
const MIN_GOOD_GAIN: f64 = 0.25;
/// Least weight of damping in a coordinate over the largest.
const MIN_WEIGHT: f64 = 1e-6;
/// Largest fall of a descent over that of its linear model. From the second number of steps on, a
/// descent is stopped if such a fall leads to no minimum near the lowest.
const MAX_FALL_RATIO: f64 = 2.0;
const MIN_TRIED_STEPS: usize = 3;
/// Damping that only keeps equations solvable.
const MIN_DAMPING: f64 = 1e-10;
/// Largest number of steps of a descent.
const MAX_STEPS: usize = 30;

struct Descent {
    at: Minimum,
    damping: f64,
    /// Factor by which damping grows next.
    growth: f64,
    /// Fall of the sum of squares by the linear model without damping.
    promise: f64,
    /// `true` if the derivatives are differences taken here.
    is_fresh: bool,
    /// `true` if differences are to be taken before the next step.
    is_blind: bool,
    /// `true` while the descent goes on.
    is_underway: bool,
    /// `true` if the descent was stopped far above the lowest.
    is_stopped: bool,
    /// Steps that were tried, and successive rejected steps with derivatives taken where they
    /// began.
    steps: usize,
    misses: usize,
}

/// A step that a descent tries.
struct DescentStep {
    change: DVector<f64>,
    /// Fall of the sum of squares by the linear model.
    falls: f64,
}

impl Descent {
    fn from(at: Minimum) -> Self {
        Self {
            damping: DAMPING,
            growth: GROWTH,
            promise: f64::INFINITY,
            is_fresh: false,
            is_blind: at.jacobian.ncols() == 0,
            is_underway: at.squares.is_finite(),
            is_stopped: false,
            steps: 0,
            misses: 0,
            at,
        }
    }

    /// Returns the next step within `limits`; none if the linear model falls by less than `least`.
    fn step(
        &mut self,
        residuals: &DVector<f64>,
        limits: &[[f64; 2]],
        least: f64,
    ) -> Option<DescentStep> {
        let Minimum { x, jacobian, .. } = &self.at;
        let gradient = jacobian.tr_mul(residuals);
        // A coordinate that would leave its range at an end stays there.
        let is_free = |&column: &usize| {
            let [low, high] = limits[column];
            !(x[column] <= low && gradient[column] > 0.0
                || x[column] >= high && gradient[column] < 0.0)
        };
        let free: Vec<usize> = (0..x.len()).filter(is_free).collect();
        let own = jacobian.select_columns(&free);
        let (normal, gradient) = (own.tr_mul(&own), gradient.select_rows(&free));
        let largest = normal.diagonal().max();
        let weights = normal
            .diagonal()
            .map(|weight| weight.max(MIN_WEIGHT * largest));
        let solution = |damping: f64| {
            let damped = &normal + DMatrix::from_diagonal(&(&weights * damping));
            Cholesky::new(damped).map(|factors| -factors.solve(&gradient))
        };
        let falls =
            |change: &DVector<f64>| -2.0 * change.dot(&gradient) - (&own * change).norm_squared();
        self.promise = if free.is_empty() {
            0.0
        } else {
            falls(&solution(MIN_DAMPING)?)
        };
        if self.promise < least {
            return None;
        }
        let mut change = solution(self.damping)?;
        while change.amax() > MAX_STEP {
            self.damping *= 2.0;
            change = solution(self.damping)?;
        }
        for (change, &column) in change.iter_mut().zip(&free) {
            *change = (x[column] + *change).clamp(limits[column][0], limits[column][1]) - x[column];
        }
        let falls = falls(&change);
        let mut whole = DVector::zeros(x.len());
        free.iter()
            .zip(&change)
            .for_each(|(&column, change)| whole[column] = *change);
        Some(DescentStep {
            change: whole,
            falls,
        })
    }

    /// Accepts or rejects the end of a step, with the change of the residuals.
    fn take(
        &mut self,
        DescentStep { change, falls }: &DescentStep,
        end: Minimum,
        residuals: &DVector<f64>,
    ) {
        self.steps += 1;
        let is_simulated = end.squares.is_finite();
        // The linear model of a step that was cut at the bounds may not fall.
        let gain = if is_simulated && *falls > 0.0 {
            (self.at.squares - end.squares) / falls
        } else {
            f64::NEG_INFINITY
        };
        if gain > MIN_ACCEPTED_GAIN {
            self.damping *= (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0);
            self.growth = GROWTH;
            self.misses = 0;
            let mut jacobian = std::mem::replace(&mut self.at.jacobian, DMatrix::zeros(0, 0));
            jacobian +=
                (residuals - &jacobian * change) * change.transpose() / change.norm_squared();
            self.is_blind = gain < MIN_GOOD_GAIN;
            self.is_fresh = false;
            self.at = Minimum { jacobian, ..end };
        } else {
            self.damping *= self.growth;
            self.growth *= 2.0;
            self.is_blind = !self.is_fresh && is_simulated;
            self.misses += usize::from(!self.is_blind);
        }
        self.is_underway = self.misses < MAX_MISSES && self.steps < MAX_STEPS;
    }
}

/// Advances all descents that are under way by one step, side by side. Returns `false` if none is.
fn advance(
    model: &Model<'_>,
    descents: &mut [Descent],
    precision: Precision,
) -> Result<bool, Interrupted> {
    let limits = model.limits();
    let mut blind: Vec<&mut Descent> = descents
        .iter_mut()
        .filter(|descent| descent.is_underway && descent.is_blind)
        .collect();
    let at: Vec<(&[f64], &[f64])> = blind
        .iter()
        .map(|descent| (&descent.at.x[..], &descent.at.forces[..]))
        .collect();
    let jacobians = model.jacobians(&at, precision)?;
    for (descent, jacobian) in blind.iter_mut().zip(jacobians) {
        descent.is_underway = jacobian.iter().all(|derivative| derivative.is_finite());
        (descent.is_blind, descent.is_fresh, descent.at.jacobian) = (false, true, jacobian);
    }
    let mut tried: Vec<(&mut Descent, DescentStep)> = Vec::new();
    for descent in descents.iter_mut().filter(|descent| descent.is_underway) {
        let residuals = model.residuals(&descent.at.forces);
        match descent.step(
            &residuals,
            &limits,
            precision.arrival * model.unit(descent.at.squares),
        ) {
            Some(step) => tried.push((descent, step)),
            None => descent.is_underway = false,
        }
    }
    let end = |(descent, step): &(&mut Descent, DescentStep)| {
        descent
            .at
            .x
            .iter()
            .zip(&step.change)
            .map(|(x, change)| x + change)
            .collect()
    };
    let ends = evaluated(model, tried.iter().map(end).collect(), precision)?;
    let is_any = !tried.is_empty();
    for ((descent, step), mut end) in tried.into_iter().zip(ends) {
        let change = model.residuals(&end.forces) - model.residuals(&descent.at.forces);
        end.starts = descent.at.starts;
        descent.take(&step, end, &change);
    }
    Ok(is_any)
}

/// Returns points with their forces and sums of squares, which are NaN where a point cannot be
/// simulated.
pub fn evaluated(
    model: &Model<'_>,
    points: Vec<Vec<f64>>,
    precision: Precision,
) -> Result<Vec<Minimum>, Interrupted> {
    let forces = model.forces(&points, precision)?;
    let minimum = |(x, forces): (Vec<f64>, Vec<f64>)| {
        let squares = model.residuals(&forces).norm_squared();
        Minimum {
            x,
            forces,
            squares,
            starts: 1,
            jacobian: DMatrix::zeros(0, 0),
        }
    };
    Ok(points.into_iter().zip(forces).map(minimum).collect())
}

/// Returns `true` if a descent leads to the same minimum as a lower one: its residuals are those of
/// the linear model there.
fn leads_to(model: &Model<'_>, lower: &Minimum, from: &Minimum) -> bool {
    /// Share of the change of the residuals that the linear model may miss.
    const MAX_MISSED_SHARE: f64 = 0.2;
    let change = model.residuals(&from.forces) - model.residuals(&lower.forces);
    let step = DVector::from_iterator(
        from.x.len(),
        from.x.iter().zip(&lower.x).map(|(a, b)| a - b),
    );
    lower.jacobian.ncols() == from.x.len()
        && (&change - &lower.jacobian * step).norm() < MAX_MISSED_SHARE * change.norm()
}

/// Returns `true` if two sets of forces are those of one minimum.
fn is_same(model: &Model<'_>, these: &[f64], those: &[f64]) -> bool {
    let observations = &model.problem().observations;
    let difference = |((own, this), that): ((&Observation, &f64), &f64)| {
        ((this - that) / own.std.max(MIN_RELATIVE_STD * own.value)).powi(2)
    };
    let sum: f64 = observations
        .iter()
        .zip(these)
        .zip(those)
        .map(difference)
        .sum();
    (sum / observations.len() as f64).sqrt() < MAX_RMS_DIFFERENCE
}

/// Minima to which the starts lead.
pub struct Search {
    /// Different minima at a coarse precision, the lowest first.
    pub minima: Vec<Minimum>,
    /// Number of starts that were stopped, because their derivatives promised no minimum near the
    /// lowest.
    pub stopped: usize,
    /// Number of starts that cannot be simulated.
    pub failed: usize,
}

/// Finds the minima to which the starts lead.
pub fn minima(model: &Model<'_>, precision: Precision) -> Result<Search, Interrupted> {
    let starts = starts(model, precision)?;
    let all = starts.len();
    let mut descents: Vec<Descent> = starts.into_iter().map(Descent::from).collect();
    while advance(model, &mut descents, precision)? {
        descents = joined(model, descents);
        let highest = model.highest(descents[0].at.squares);
        for descent in descents
            .iter_mut()
            .filter(|descent| descent.is_underway && descent.steps >= MIN_TRIED_STEPS)
        {
            descent.is_stopped = descent.at.squares - MAX_FALL_RATIO * descent.promise > highest;
            descent.is_underway &= !descent.is_stopped;
        }
        let ended = all
            - descents
                .iter()
                .filter(|descent| descent.is_underway)
                .count();
        model
            .simulator
            .tell(WORK_SHARE_OF_STARTS * ended as f64 / all as f64);
    }
    let (stopped, others): (Vec<Descent>, Vec<Descent>) = joined(model, descents)
        .into_iter()
        .partition(|descent| descent.is_stopped);
    let stopped = stopped.iter().map(|descent| descent.at.starts).sum();
    let found: Vec<Minimum> = others
        .into_iter()
        .map(|descent| descent.at)
        .filter(|at| at.squares.is_finite())
        .collect();
    let failed = all - stopped - found.iter().map(|minimum| minimum.starts).sum::<usize>();
    Ok(Search {
        minima: found,
        stopped,
        failed,
    })
}

/// Joins descents to the same minimum, and sorts them, the lowest first.
fn joined(model: &Model<'_>, mut descents: Vec<Descent>) -> Vec<Descent> {
    descents.sort_by(|a, b| a.at.squares.total_cmp(&b.at.squares));
    let mut kept: Vec<Descent> = Vec::new();
    for descent in descents {
        let same = |lower: &&mut Descent| {
            is_same(model, &lower.at.forces, &descent.at.forces)
                || descent.is_underway && leads_to(model, &lower.at, &descent.at)
        };
        match kept.iter_mut().find(same) {
            Some(lower) => lower.at.starts += descent.at.starts,
            None => kept.push(descent),
        }
    }
    kept
}

/// Refines minima at a finer precision, side by side. Minima that cannot be simulated are left out.
pub fn refined(
    model: &Model<'_>,
    minima: Vec<Minimum>,
    precision: Precision,
) -> Result<Vec<Minimum>, Interrupted> {
    let points = minima.iter().map(|minimum| minimum.x.clone()).collect();
    let found = evaluated(model, points, precision)?.into_iter().zip(minima);
    let start = |(
        found,
        Minimum {
            starts, jacobian, ..
        },
    )| Minimum {
        starts,
        jacobian,
        ..found
    };
    descended(model, found.map(start).collect(), precision)
}

/// Returns the ends of descents from points with their forces at this precision, side by side.
/// Descents that cannot be simulated are left out, as are those that will not be the lowest.
pub fn descended(
    model: &Model<'_>,
    starts: Vec<Minimum>,
    precision: Precision,
) -> Result<Vec<Minimum>, Interrupted> {
    let mut descents: Vec<Descent> = starts.into_iter().map(Descent::from).collect();
    while advance(model, &mut descents, precision)? {
        let lowest = descents
            .iter()
            .map(|descent| descent.at.squares)
            .fold(f64::INFINITY, f64::min);
        descents.retain(|descent| descent.at.squares - MAX_FALL_RATIO * descent.promise <= lowest);
    }
    let ends = descents.into_iter().map(|descent| descent.at);
    Ok(ends.filter(|end| end.squares.is_finite()).collect())
}

/// Finds a lower minimum near one where contacts begin or end, which bend the forces. Descents
/// begin at points around it, some standard errors by the `jacobian` away. `None` if there is none.
pub fn lower(
    model: &Model<'_>,
    minimum: &Minimum,
    jacobian: &DMatrix<f64>,
    precision: Precision,
) -> Result<Option<Minimum>, Interrupted> {
    /// Number of points, their largest distance in standard errors, and number of descents from the
    /// best of them.
    const TRIED_POINTS: u32 = 48;
    const MAX_STANDARD_ERRORS: f64 = 4.0;
    const DESCENTS: usize = 4;
    /// Least relative fall of the sum of squares that counts.
    const MIN_RELATIVE_FALL: f64 = 1e-3;
    let limits = model.limits();
    let errors = Errors::of(jacobian, 1.0);
    let point = |index: u32| -> Vec<f64> {
        let coordinate = |(dimension, [low, high]): (usize, &[f64; 2])| {
            let share = 2.0 * f64::from(sobol_burley::sample(index, dimension as u32, SEED)) - 1.0;
            (minimum.x[dimension] + share * MAX_STANDARD_ERRORS * errors.standard_error(dimension))
                .clamp(*low, *high)
        };
        limits.iter().enumerate().map(coordinate).collect()
    };
    let points = evaluated(model, (0..TRIED_POINTS).map(point).collect(), precision)?;
    let starts = lowest(points, DESCENTS).map(|start| Minimum {
        jacobian: jacobian.clone(),
        ..start
    });
    let found = descended(model, starts.collect(), precision)?;
    let best = lowest(found, 1)
        .next()
        .filter(|found| found.squares < (1.0 - MIN_RELATIVE_FALL) * minimum.squares);
    Ok(best.map(|found| Minimum {
        starts: minimum.starts,
        ..found
    }))
}

/// Returns the `count` lowest of the points that can be simulated.
fn lowest(mut points: Vec<Minimum>, count: usize) -> impl Iterator<Item = Minimum> {
    points.retain(|point| point.squares.is_finite());
    points.sort_by(|a, b| a.squares.total_cmp(&b.squares));
    points.into_iter().take(count)
}

/// Returns the values of the file, and the best of points that fill the range.
fn starts(model: &Model<'_>, precision: Precision) -> Result<Vec<Minimum>, Interrupted> {
    let problem = model.problem();
    let stated = problem
        .fitted
        .iter()
        .zip(problem.stated())
        .map(|(fitted, value)| fitted.coordinate(value));
    let point = |index: usize| {
        let coordinate = |(dimension, fitted): (usize, &Fitted)| {
            let [low, high] = fitted.limits();
            low + (high - low)
                * f64::from(sobol_burley::sample(index as u32, dimension as u32, SEED))
        };
        problem.fitted.iter().enumerate().map(coordinate).collect()
    };
    let count = if model.simulator.means.starts > 0 {
        POINTS
    } else {
        0
    };
    let points = std::iter::once(stated.collect())
        .chain((0..count).map(point))
        .collect();
    let mut points = evaluated(model, points, precision)?;
    let others = points.split_off(1);
    Ok(points
        .into_iter()
        .chain(lowest(others, model.simulator.means.starts))
        .collect())
}
