//! Residuals and their derivatives: simulated less measured forces over their standard deviations, as functions of coordinates.

use nalgebra::{DMatrix, DVector};

use crate::problem::{Forces, Observation, Place, Problem};
use crate::simulator::{Interrupted, Precision, Simulator};

/// The residuals of a problem.
pub struct Model<'a> {
    pub simulator: Simulator<'a>,
    /// What interaction makes of the force of each observation, where filaments are simulated alone; 1 if it is left out.
    pub factors: Vec<f64>,
}

impl<'a> Model<'a> {
    pub fn new(simulator: Simulator<'a>) -> Self {
        Self { factors: vec![1.0; simulator.problem.observations.len()], simulator }
    }

    pub fn problem(&self) -> &'a Problem {
        self.simulator.problem
    }

    /// The values of the fitted settings at a point of coordinates.
    pub fn values(&self, x: &[f64]) -> Vec<f64> {
        self.problem().fitted.iter().zip(x).map(|(fitted, x)| fitted.value(*x)).collect()
    }

    /// The simulated forces of all observations at several points of coordinates; not a number where a simulation failed.
    pub fn forces(&self, points: &[Vec<f64>], precision: Precision) -> Result<Vec<Vec<f64>>, Interrupted> {
        let Problem { points: measured, observations, .. } = self.problem();
        let places: Vec<(Place, Vec<f64>)> =
            points.iter().flat_map(|x| measured.iter().map(|point| (Place::of(point), self.values(x)))).collect();
        let forces = self.simulator.forces(&places, precision)?;
        let of_point = |forces: &[Option<Forces>]| {
            let force = |(observation, factor): (&Observation, &f64)| {
                let factor = if precision.interacts { 1.0 } else { *factor };
                forces[observation.point].map_or(f64::NAN, |forces| forces[observation.force] * factor)
            };
            observations.iter().zip(&self.factors).map(force).collect()
        };
        Ok(forces.chunks(measured.len()).map(of_point).collect())
    }

    /// The residuals of simulated forces.
    pub fn residuals(&self, forces: &[f64]) -> DVector<f64> {
        let observations = self.problem().observations.iter();
        DVector::from_iterator(forces.len(), observations.zip(forces).map(|(own, force)| (force - own.value) / own.std))
    }

    /// The derivatives of the residuals in the coordinates at `x`, where forces are `here`, by differences within the bounds.
    pub fn jacobian(&self, x: &[f64], here: &[f64], precision: Precision) -> Result<DMatrix<f64>, Interrupted> {
        let (mut points, widths) = self.stencil(x, precision.step);
        let mut ends: Vec<[Option<usize>; 2]> =
            (0..x.len()).map(|column| [Some(2 * column), Some(2 * column + 1)]).collect();
        if !precision.central {
            // Towards the end of the range that is farther away.
            let is_forwards =
                |column: usize| points[2 * column + 1][column] - x[column] >= x[column] - points[2 * column][column];
            ends = (0..x.len())
                .map(|column| if is_forwards(column) { [None, Some(column)] } else { [Some(column), None] })
                .collect();
            points = (0..x.len()).map(|column| points[2 * column + usize::from(is_forwards(column))].clone()).collect();
        }
        let forces = self.forces(&points, precision)?;
        let at = |end: Option<usize>| end.map_or(here, |end| &forces[end]);
        let observations = &self.problem().observations;
        Ok(DMatrix::from_fn(observations.len(), x.len(), |row, column| {
            let [below, above] = ends[column].map(at);
            let width = match ends[column] {
                [Some(_), Some(_)] => widths[column],
                [_, Some(end)] => points[end][column] - x[column],
                [Some(end), _] => x[column] - points[end][column],
                _ => f64::NAN,
            };
            (above[row] - below[row]) / (width * observations[row].std)
        }))
    }

    /// For each coordinate two points around `x`, and their distance.
    pub fn stencil(&self, x: &[f64], step: f64) -> (Vec<Vec<f64>>, Vec<f64>) {
        let (mut points, mut widths) = (Vec::new(), Vec::new());
        for (column, fitted) in self.problem().fitted.iter().enumerate() {
            let [low, high] = fitted.limits();
            let ends = [(x[column] - step).max(low), (x[column] + step).min(high)];
            widths.push(ends[1] - ends[0]);
            points.extend(ends.map(|end| {
                let mut point = x.to_vec();
                point[column] = end;
                point
            }));
        }
        (points, widths)
    }

    /// The Jacobian by central differences of one and two steps, extrapolated (Richardson), and the largest relative error of a column that
    /// their difference tells.
    pub fn precise_jacobian(&self, x: &[f64], precision: Precision) -> Result<(DMatrix<f64>, f64), Interrupted> {
        let fine = self.jacobian(x, &[], precision)?;
        let coarse = self.jacobian(x, &[], Precision { step: 2.0 * precision.step, ..precision })?;
        let correction = (&fine - coarse) / 3.0;
        let error = |column: usize| correction.column(column).norm() / fine.column(column).norm();
        let error = (0..x.len()).map(error).fold(0.0, f64::max);
        Ok((fine + correction, error))
    }
}
