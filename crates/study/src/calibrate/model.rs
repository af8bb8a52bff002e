//! Residuals and their Jacobian: simulated less measured forces over their standard deviations, as
//! functions of coordinates.

use nalgebra::{DMatrix, DVector};

use crate::calibrate::parameters::Fitted;
use crate::calibrate::problem::{Forces, Observation, Problem, ToolPlace};
use crate::calibrate::simulator::{Interrupted, Precision, Simulator};

/// The residuals of a problem.
pub struct Model<'a> {
    pub simulator: Simulator<'a>,
    /// Force with interaction over that of filaments alone, for each observation; 1 if interaction
    /// is left out.
    pub factors: Vec<f64>,
}

impl<'a> Model<'a> {
    pub fn new(simulator: Simulator<'a>) -> Self {
        Self {
            factors: vec![1.0; simulator.problem.observations.len()],
            simulator,
        }
    }

    pub fn problem(&self) -> &'a Problem {
        self.simulator.problem
    }

    /// Returns the bounds of the coordinates.
    pub fn limits(&self) -> Vec<[f64; 2]> {
        self.problem().fitted.iter().map(Fitted::limits).collect()
    }

    /// Returns the values of the fitted settings at a point of coordinates.
    pub fn values(&self, x: &[f64]) -> Vec<f64> {
        self.problem()
            .fitted
            .iter()
            .zip(x)
            .map(|(fitted, x)| fitted.value(*x))
            .collect()
    }

    /// Simulates the forces of all observations at several points of coordinates; NaN where a
    /// simulation failed.
    pub fn forces(
        &self,
        points: &[Vec<f64>],
        precision: Precision,
    ) -> Result<Vec<Vec<f64>>, Interrupted> {
        let Problem {
            points: measured,
            observations,
            fitted,
            radii,
            ..
        } = self.problem();
        if let Some(radii) = radii {
            return Ok(points
                .iter()
                .map(|x| radii.after(fitted, &self.values(x), &radii.turns))
                .collect());
        }
        let places: Vec<(ToolPlace, Vec<f64>)> = points
            .iter()
            .flat_map(|x| {
                measured
                    .iter()
                    .map(|point| (ToolPlace::of(point), self.values(x)))
            })
            .collect();
        let forces = self.simulator.forces(&places, precision)?;
        let of_point = |forces: &[Option<Forces>]| {
            let force = |(observation, factor): (&Observation, &f64)| {
                let factor = if precision.interacts { 1.0 } else { *factor };
                forces[observation.point]
                    .map_or(f64::NAN, |forces| forces[observation.force] * factor)
            };
            observations.iter().zip(&self.factors).map(force).collect()
        };
        Ok(forces.chunks(measured.len()).map(of_point).collect())
    }

    /// Returns the residuals of simulated forces.
    pub fn residuals(&self, forces: &[f64]) -> DVector<f64> {
        let observations = self.problem().observations.iter();
        DVector::from_iterator(
            forces.len(),
            observations
                .zip(forces)
                .map(|(own, force)| (force - own.value) / own.std),
        )
    }

    /// Returns the unit of a sum of squares: the variance of a residual, which is 1 if standard
    /// deviations are stated and explain it.
    pub fn unit(&self, squares: f64) -> f64 {
        let mean = squares / self.problem().observations.len() as f64;
        if self.problem().has_std {
            mean.max(1.0)
        } else {
            mean
        }
    }

    /// Returns the sum of squares up to which a minimum at a coarse precision may turn out to be
    /// the lowest.
    pub fn highest(&self, lowest: f64) -> f64 {
        /// Limit over the lowest sum, or over that of residuals of one standard deviation.
        const MAX_SQUARES_RATIO: f64 = 4.0;
        MAX_SQUARES_RATIO * lowest.max(self.problem().observations.len() as f64)
    }

    /// Returns the Jacobian of the residuals at several points, each with the forces there, by
    /// differences within the bounds.
    pub fn jacobians(
        &self,
        at: &[(&[f64], &[f64])],
        precision: Precision,
    ) -> Result<Vec<DMatrix<f64>>, Interrupted> {
        let stencils: Vec<Stencil> = at.iter().map(|(x, _)| self.stencil(x, precision)).collect();
        let points: Vec<Vec<f64>> = stencils
            .iter()
            .flat_map(|stencil| stencil.points.clone())
            .collect();
        let forces = self.forces(&points, precision)?;
        let mut forces = &forces[..];
        let observations = &self.problem().observations;
        let jacobian = |((_, here), stencil): (&(&[f64], &[f64]), Stencil)| {
            let (own, others) = forces.split_at(stencil.points.len());
            forces = others;
            DMatrix::from_fn(observations.len(), stencil.sides.len(), |row, column| {
                stencil.derivative(column, here[row], |point| own[point][row])
                    / observations[row].std
            })
        };
        Ok(at.iter().zip(stencils).map(jacobian).collect())
    }

    /// Returns the points around `x` from which derivatives are taken: two for each coordinate, or
    /// one, towards the farther end of the range.
    pub fn stencil(&self, x: &[f64], Precision { step, central, .. }: Precision) -> Stencil {
        let mut stencil = Stencil {
            points: Vec::new(),
            sides: Vec::new(),
        };
        for (column, fitted) in self.problem().fitted.iter().enumerate() {
            let [low, high] = fitted.limits();
            let ends = [(x[column] - step).max(low), (x[column] + step).min(high)];
            let [below, above] = [x[column] - ends[0], ends[1] - x[column]];
            let mut point = |is_taken: bool, end: f64| {
                is_taken.then(|| {
                    let mut point = x.to_vec();
                    point[column] = end;
                    stencil.points.push(point);
                    stencil.points.len() - 1
                })
            };
            let sides = [
                point(central || below > above, ends[0]),
                point(central || above >= below, ends[1]),
            ];
            let width = sides[0].map_or(0.0, |_| below) + sides[1].map_or(0.0, |_| above);
            stencil.sides.push((sides, width));
        }
        stencil
    }

    /// Returns the Jacobian at a point with these forces by central differences of one and two
    /// steps, extrapolated (Richardson), and the largest relative error of a column.
    pub fn precise_jacobian(
        &self,
        x: &[f64],
        forces: &[f64],
        precision: Precision,
    ) -> Result<(DMatrix<f64>, f64), Interrupted> {
        let jacobian = |step: f64| {
            let found = self.jacobians(
                &[(x, forces)],
                Precision {
                    step,
                    central: true,
                    ..precision
                },
            )?;
            Ok::<_, Interrupted>(found.into_iter().next().expect("one for each point"))
        };
        let (fine, coarse) = (jacobian(precision.step)?, jacobian(2.0 * precision.step)?);
        let correction = (&fine - coarse) / 3.0;
        let error = |column: usize| correction.column(column).norm() / fine.column(column).norm();
        let error = (0..x.len()).map(error).fold(0.0, f64::max);
        Ok((fine + correction, error))
    }
}

/// Points around a point, between which differences are taken.
pub struct Stencil {
    pub points: Vec<Vec<f64>>,
    /// Positions of the points below and above in each coordinate, none for the middle, and their
    /// distance.
    sides: Vec<([Option<usize>; 2], f64)>,
}

impl Stencil {
    /// Returns the derivative in a coordinate of a quantity that is `here` in the middle, and `at`
    /// each of the points.
    pub fn derivative(&self, column: usize, here: f64, at: impl Fn(usize) -> f64) -> f64 {
        let (sides, width) = self.sides[column];
        let [below, above] = sides.map(|point| point.map_or(here, &at));
        (above - below) / width
    }
}
