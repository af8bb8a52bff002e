//! Minima of the sum of squares within the bounds, from several starts.
//!
//! The boundary between striking and sweeping makes local minima. Starts are the values of the file
//! and the best points of a scrambled Sobol sequence over the whole range. All go downhill side by
//! side, which fills lanes, at a coarse precision. Of those whose derivatives tell that they lead
//! to the same minimum, the lowest goes on.
//!
//! A descent takes Levenberg's and Marquardt's steps, cut at the bounds, damped by the rule of
//! Nielsen (1999). What the forces of a step tell updates the derivatives (Broyden 1965);
//! differences are taken again only where these were wrong.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::calibrate::model::Model;
use crate::calibrate::parameters::Fitted;
use crate::calibrate::problem::Observation;
use crate::calibrate::simulator::{Interrupted, Precision};
use crate::calibrate::statistics::Errors;

/// The number of starts besides the values of the file: the best of so many points.
pub const STARTS: usize = 8;
const POINTS: usize = 32;
/// Seed of their sequence.
const SEED: u32 = 1;
/// Root mean square difference of forces, over their standard deviations, up to which two minima
/// are one.
const SAME: f64 = 0.3;
/// The same over the forces, where standard deviations are smaller.
const SAME_RELATIVE: f64 = 0.02;
/// The share of the work that starts have, about.
const OF_STARTS: f64 = 0.4;

/// A minimum of the sum of squares, or where a descent to one is.
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
    /// Derivatives of the residuals near it; without columns if none were taken yet.
    pub jacobian: DMatrix<f64>,
}

/// Damping at the start of a descent, and the factor by which it grows at first.
const DAMPING: f64 = 1e-2;
const GROWTH: f64 = 2.0;
/// A descent ends after so many steps that are not taken, with derivatives taken where they begin.
const MISSES: usize = 4;
/// The longest step in a coordinate: forces of filaments that sweep change by a factor of e.
const LEAP: f64 = 1.0;
/// Fall of the sum of squares over what the derivatives tell, from which on a step is taken, and
/// from which on they are good.
const TAKEN: f64 = 1e-3;
const GOOD: f64 = 0.25;
/// Least weight of damping in a coordinate over the largest.
const LEAST_WEIGHT: f64 = 1e-6;
/// A descent may fall by so many times what its derivatives tell. From this number of steps on, it
/// is stopped if that leads to no minimum near the lowest.
const HOPE: f64 = 2.0;
const TRIED: usize = 3;
/// Damping that only keeps equations solvable.
const UNDAMPED: f64 = 1e-10;
/// The most steps of a descent.
const STEPS: usize = 30;

struct Descent {
    at: Minimum,
    damping: f64,
    /// The factor by which damping grows next.
    growth: f64,
    /// The fall of the sum of squares that the derivatives tell of, without damping.
    promise: f64,
    /// Whether the derivatives are differences taken here.
    is_fresh: bool,
    /// Whether differences are to be taken before the next step.
    is_blind: bool,
    /// Whether it goes on.
    is_underway: bool,
    /// Whether it was stopped far above the lowest.
    is_stopped: bool,
    /// Steps that were tried, and how many of them in succession were none with derivatives taken
    /// where they began.
    steps: usize,
    misses: usize,
}

/// A step that a descent tries.
struct Step {
    change: DVector<f64>,
    /// The fall of the sum of squares that the derivatives tell.
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

    /// The next step within `limits`; none if the derivatives tell of a fall of less than `least`.
    fn step(&mut self, residuals: &DVector<f64>, limits: &[[f64; 2]], least: f64) -> Option<Step> {
        let Minimum { x, jacobian, .. } = &self.at;
        let gradient = jacobian.tr_mul(residuals);
        // What is at an end of its range and would leave it stays there.
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
            .map(|weight| weight.max(LEAST_WEIGHT * largest));
        let solution = |damping: f64| {
            let damped = &normal + DMatrix::from_diagonal(&(&weights * damping));
            Cholesky::new(damped).map(|factors| -factors.solve(&gradient))
        };
        let falls =
            |change: &DVector<f64>| -2.0 * change.dot(&gradient) - (&own * change).norm_squared();
        self.promise = if free.is_empty() {
            0.0
        } else {
            falls(&solution(UNDAMPED)?)
        };
        if self.promise < least {
            return None;
        }
        let mut change = solution(self.damping)?;
        while change.amax() > LEAP {
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
        Some(Step {
            change: whole,
            falls,
        })
    }

    /// Takes the forces at the end of a step, with the change of the residuals.
    fn take(&mut self, Step { change, falls }: &Step, end: Minimum, residuals: &DVector<f64>) {
        self.steps += 1;
        let is_simulated = end.squares.is_finite();
        // A step that was cut at the bounds may promise nothing.
        let gain = if is_simulated && *falls > 0.0 {
            (self.at.squares - end.squares) / falls
        } else {
            f64::NEG_INFINITY
        };
        if gain > TAKEN {
            self.damping *= (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0);
            self.growth = GROWTH;
            self.misses = 0;
            let mut jacobian = std::mem::replace(&mut self.at.jacobian, DMatrix::zeros(0, 0));
            jacobian +=
                (residuals - &jacobian * change) * change.transpose() / change.norm_squared();
            self.is_blind = gain < GOOD;
            self.is_fresh = false;
            self.at = Minimum { jacobian, ..end };
        } else {
            self.damping *= self.growth;
            self.growth *= 2.0;
            self.is_blind = !self.is_fresh && is_simulated;
            self.misses += usize::from(!self.is_blind);
        }
        self.is_underway = self.misses < MISSES && self.steps < STEPS;
    }
}

/// Goes one step further in all descents that are under way, side by side. False if none is.
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
    let mut tried: Vec<(&mut Descent, Step)> = Vec::new();
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
    let end = |(descent, step): &(&mut Descent, Step)| {
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

/// Points with their forces and sums of squares, which are not numbers where they cannot be
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

/// Whether a descent leads to the same minimum as a lower one: the residuals are those that the
/// derivatives there tell.
fn leads_to(model: &Model<'_>, lower: &Minimum, from: &Minimum) -> bool {
    /// Share of the change of the residuals that the derivatives may miss.
    const MISSED: f64 = 0.2;
    let change = model.residuals(&from.forces) - model.residuals(&lower.forces);
    let step = DVector::from_iterator(
        from.x.len(),
        from.x.iter().zip(&lower.x).map(|(a, b)| a - b),
    );
    lower.jacobian.ncols() == from.x.len()
        && (&change - &lower.jacobian * step).norm() < MISSED * change.norm()
}

/// Whether two sets of forces are those of one minimum.
fn is_same(model: &Model<'_>, these: &[f64], those: &[f64]) -> bool {
    let observations = &model.problem().observations;
    let difference = |((own, this), that): ((&Observation, &f64), &f64)| {
        ((this - that) / own.std.max(SAME_RELATIVE * own.value)).powi(2)
    };
    let sum: f64 = observations
        .iter()
        .zip(these)
        .zip(those)
        .map(difference)
        .sum();
    (sum / observations.len() as f64).sqrt() < SAME
}

/// What the starts lead to.
pub struct Search {
    /// Different minima at a coarse precision, the lowest first.
    pub minima: Vec<Minimum>,
    /// The number of starts that were stopped, as their derivatives promised no minimum near the
    /// lowest.
    pub stopped: usize,
    /// The number of starts that cannot be simulated.
    pub failed: usize,
}

/// The minima to which the starts lead.
pub fn minima(model: &Model<'_>, precision: Precision) -> Result<Search, Interrupted> {
    let starts = starts(model, precision)?;
    let all = starts.len();
    let mut descents: Vec<Descent> = starts.into_iter().map(Descent::from).collect();
    while advance(model, &mut descents, precision)? {
        descents = joined(model, descents);
        let highest = model.highest(descents[0].at.squares);
        for descent in descents
            .iter_mut()
            .filter(|descent| descent.is_underway && descent.steps >= TRIED)
        {
            descent.is_stopped = descent.at.squares - HOPE * descent.promise > highest;
            descent.is_underway &= !descent.is_stopped;
        }
        let ended = all
            - descents
                .iter()
                .filter(|descent| descent.is_underway)
                .count();
        model.simulator.tell(OF_STARTS * ended as f64 / all as f64);
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

/// The descents that lead to different minima, the lowest first.
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

/// The same minima at a finer precision, side by side; none where it cannot be simulated.
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

/// Where descents end that begin at points with their forces at this precision, side by side. Those
/// that cannot be simulated end nowhere, and those that are not going to be the lowest.
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
        descents.retain(|descent| descent.at.squares - HOPE * descent.promise <= lowest);
    }
    let ends = descents.into_iter().map(|descent| descent.at);
    Ok(ends.filter(|end| end.squares.is_finite()).collect())
}

/// A lower minimum near one where contacts begin or end, which bend the forces: the best of
/// descents from points around it, some standard errors by the `jacobian` away. `None` if there is
/// none.
pub fn lower(
    model: &Model<'_>,
    minimum: &Minimum,
    jacobian: &DMatrix<f64>,
    precision: Precision,
) -> Result<Option<Minimum>, Interrupted> {
    /// The points that are tried, how far they are, and from how many of them a descent begins.
    const TRIED: u32 = 48;
    const REACH: f64 = 4.0;
    const DESCENTS: usize = 4;
    /// Least relative fall of the sum of squares that counts.
    const FALL: f64 = 1e-3;
    let limits = model.limits();
    let errors = Errors::of(jacobian, 1.0);
    let point = |index: u32| -> Vec<f64> {
        let coordinate = |(dimension, [low, high]): (usize, &[f64; 2])| {
            let share = 2.0 * f64::from(sobol_burley::sample(index, dimension as u32, SEED)) - 1.0;
            (minimum.x[dimension] + share * REACH * errors.standard_error(dimension))
                .clamp(*low, *high)
        };
        limits.iter().enumerate().map(coordinate).collect()
    };
    let points = evaluated(model, (0..TRIED).map(point).collect(), precision)?;
    let starts = lowest(points, DESCENTS).map(|start| Minimum {
        jacobian: jacobian.clone(),
        ..start
    });
    let found = descended(model, starts.collect(), precision)?;
    let best = lowest(found, 1)
        .next()
        .filter(|found| found.squares < (1.0 - FALL) * minimum.squares);
    Ok(best.map(|found| Minimum {
        starts: minimum.starts,
        ..found
    }))
}

/// The lowest of some points that can be simulated.
fn lowest(mut points: Vec<Minimum>, count: usize) -> impl Iterator<Item = Minimum> {
    points.retain(|point| point.squares.is_finite());
    points.sort_by(|a, b| a.squares.total_cmp(&b.squares));
    points.into_iter().take(count)
}

/// The values of the file, and the best of points that fill the range.
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
