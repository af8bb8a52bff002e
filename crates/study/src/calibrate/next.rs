//! Next measurement: the points of a grid of speeds and depths that shrink the determinant of the
//! covariance most (D-optimal).

use nalgebra::DMatrix;

use crate::grid::{DEPTH, SPEED, VELOCITY};
use crate::input::measured::Speed;
use bristle::model::parameters::Parameter;

use crate::calibrate::model::Model;
use crate::calibrate::problem::{Observation, Problem, ToolPlace};
use crate::calibrate::search::Minimum;
use crate::calibrate::simulator::{Interrupted, Precision};
use crate::calibrate::statistics::Errors;

/// Number of speeds and of depths of the grid.
const GRID: [usize; 2] = [8, 6];
/// Number of points that are named.
const NAMED_POINTS: usize = 3;

/// Largest values at which the next measurement is possible.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeasurementLimits {
    /// Rotational speed in rpm; without one, the fastest point.
    pub max_rpm: Option<f64>,
    /// Penetration depth in m; without one, the deepest point.
    pub max_depth_m: Option<f64>,
}

/// A point to measure at next.
#[derive(Clone, Debug, PartialEq)]
pub struct Next {
    /// Tool, speed and depth.
    pub place: ToolPlace,
    /// Speed as brushing velocity in m/s and as rotational speed in rpm.
    pub speeds: [f64; 2],
    /// Factor by which the determinant of the covariance becomes smaller.
    pub gain: f64,
    /// Standard errors of the coordinates with this point, over those without it.
    pub shrinks: Vec<f64>,
}

/// Returns the best points to measure at next.
pub fn next(
    model: &Model<'_>,
    minimum: &Minimum,
    errors: &Errors,
    reach: MeasurementLimits,
    precision: Precision,
) -> Result<Vec<Next>, Interrupted> {
    let problem = model.problem();
    let values = model.values(&minimum.x);
    let places = grid(problem, &values, reach);
    let stds = relative_stds(problem);
    let stencil = model.stencil(&minimum.x, precision);
    let points = &stencil.points;
    let evaluations: Vec<(ToolPlace, Vec<f64>)> = places
        .iter()
        .flat_map(|place| {
            std::iter::once(&minimum.x)
                .chain(points)
                .map(|x| (*place, model.values(x)))
        })
        .collect();
    let forces = model.simulator.forces(&evaluations, precision)?;
    // A setting that nothing determines is somewhere in its range.
    let information = errors
        .covariance()
        .try_inverse()
        .unwrap_or_else(|| DMatrix::zeros(values.len(), values.len()));
    let of_range = DMatrix::from_fn(values.len(), values.len(), |row, column| {
        let [low, high] = problem.fitted[row].limits();
        if row == column {
            (high - low).powi(-2)
        } else {
            0.0
        }
    });
    let before = information + of_range;
    let Some(covariance) = before.clone().try_inverse() else {
        return Ok(Vec::new());
    };
    let mut found: Vec<Next> = Vec::new();
    for (place, forces) in places.into_iter().zip(forces.chunks(1 + points.len())) {
        let Some(forces) = forces.iter().copied().collect::<Option<Vec<_>>>() else {
            continue;
        };
        let measured: Vec<(usize, f64)> = stds
            .iter()
            .enumerate()
            .filter_map(|(force, std)| Some((force, (*std)?)))
            .collect();
        let rows = DMatrix::from_fn(measured.len(), values.len(), |row, column| {
            let (force, std) = measured[row];
            let here = forces[0][force];
            stencil.derivative(column, here, |point| forces[1 + point][force]) / (std * here.abs())
        });
        if rows.iter().any(|derivative| !derivative.is_finite()) {
            continue;
        }
        let gain = (DMatrix::identity(measured.len(), measured.len())
            + &rows * &covariance * rows.transpose())
        .determinant();
        let Some(after) = (&before + rows.transpose() * &rows).try_inverse() else {
            continue;
        };
        let shrinks = (0..values.len())
            .map(|column| (after[(column, column)] / covariance[(column, column)]).sqrt());
        let Ok(settings) = problem.settings(&place, &values) else {
            continue;
        };
        let speed = |path| Parameter::find(path).map_or(0.0, |parameter| parameter.get(&settings));
        found.push(Next {
            place,
            speeds: [VELOCITY, SPEED].map(speed),
            gain,
            shrinks: shrinks.collect(),
        });
    }
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    found.truncate(NAMED_POINTS);
    Ok(found)
}

/// Returns the median relative standard deviation of each force that is measured.
fn relative_stds(problem: &Problem) -> [Option<f64>; 4] {
    std::array::from_fn(|force| {
        let own = problem
            .observations
            .iter()
            .filter(|observation| observation.force == force);
        let mut stds: Vec<f64> = own
            .map(|Observation { std, value, .. }| std / value)
            .collect();
        stds.sort_by(f64::total_cmp);
        stds.get(stds.len() / 2).copied()
    })
}

/// Returns the candidate places.
fn grid(problem: &Problem, values: &[f64], reach: MeasurementLimits) -> Vec<ToolPlace> {
    let largest = |value: &dyn Fn(&ToolPlace) -> f64| {
        problem
            .points
            .iter()
            .map(|point| value(&ToolPlace::of(point)))
            .fold(0.0, f64::max)
    };
    let depth = reach
        .max_depth_m
        .unwrap_or_else(|| largest(&|place| place.penetration_depth_m));
    let [speeds, depths] = GRID;
    let mut places = Vec::new();
    for tool in 0..problem.brushes.len() {
        let Some(first) = problem
            .points
            .iter()
            .find(|point| point.tool.unwrap_or(0) == tool)
        else {
            continue;
        };
        let is_velocity = matches!(first.speed, Speed::Velocity(_));
        let speed = |value: f64| {
            if is_velocity {
                Speed::Velocity(value)
            } else {
                Speed::Rotational(value)
            }
        };
        // The velocity of the largest rotational speed.
        let of_rpm = |rpm: f64| {
            let place = ToolPlace {
                tool,
                speed: Speed::Rotational(rpm),
                penetration_depth_m: first.penetration_depth_m,
            };
            let settings = problem.settings(&place, values).ok()?;
            Some(if is_velocity {
                settings.process.brushing_velocity_m_s
            } else {
                rpm
            })
        };
        let fastest = reach
            .max_rpm
            .and_then(of_rpm)
            .unwrap_or_else(|| largest(&|place| place.speed.value()));
        for row in 1..=depths {
            for column in 1..=speeds {
                places.push(ToolPlace {
                    tool,
                    speed: speed(fastest * column as f64 / speeds as f64),
                    penetration_depth_m: depth * row as f64 / depths as f64,
                });
            }
        }
    }
    let parameter = Parameter::find(DEPTH).expect("the table has the depth");
    places.retain(|place| {
        parameter.check(place.penetration_depth_m).is_ok()
            && problem.settings(place, values).is_ok()
    });
    places
}
