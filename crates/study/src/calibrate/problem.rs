//! Definition of a calibration: brushes, settings with their bounds, and measured points with their
//! standard deviations.

use std::fmt::Display;

use crate::grid::removal::edges_of;
use crate::grid::uncertainty::check;
use crate::grid::{SPEED, VELOCITY};
use crate::input::document::StatedBrush;
use crate::input::measured::{MeasuredPoint, MeasuredRadius, Quantity, Reading, Speed};
use bristle::brush::check_brush;
use bristle::model::metrics::Metrics;
use bristle::model::parameters::{Parameter, Violation};
use bristle::model::settings::{Settings, UncertaintySettings};

use crate::calibrate::edge::Radii;
use crate::calibrate::parameters::{FitError, Fitted, PRESTON, START};

/// Forces, torque and power of a tool, in the order of [`Quantity::FORCES`].
pub type Forces = [f64; 4];

/// Returns the forces of simulated metrics.
#[must_use]
pub fn forces_of(metrics: &Metrics) -> Forces {
    [
        metrics.tool_contact_normal_force_n,
        metrics.tool_tangential_force_n,
        metrics.tool_torque_n_m,
        metrics.tool_power_w,
    ]
}

/// Relative standard deviation that weighs points where the table states none: it only matters that
/// all points have the same.
const ASSUMED_STD: f64 = 0.03;

/// Largest number of standard deviations by which a radius may be below that at the start.
const MAX_STDS_BELOW_START: f64 = 3.0;

/// A force that was measured at a point, or the radius of an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Position of the point.
    pub point: usize,
    /// Position in [`Quantity::FORCES`]; their number for the radius of an edge.
    pub force: usize,
    /// Value in the unit of the quantity.
    pub value: f64,
    /// Standard deviation in the same unit; if the table states none, a share of the value.
    pub std: f64,
}

impl Observation {
    /// Returns the measured quantity.
    #[must_use]
    pub fn quantity(&self) -> Quantity {
        Quantity::FORCES
            .get(self.force)
            .copied()
            .unwrap_or(Quantity::EdgeRadius)
    }
}

/// A calibration that can be made.
#[derive(Clone, Debug)]
pub struct Problem {
    /// Brush, or the named tools.
    pub brushes: Vec<StatedBrush>,
    /// Settings that are fitted.
    pub fitted: Vec<Fitted>,
    /// Measured points.
    pub points: Vec<MeasuredPoint>,
    /// Measured values, at least as many as settings.
    pub observations: Vec<Observation>,
    /// Radii of an edge over time, if these were measured; there are no points then.
    pub radii: Option<Radii>,
    /// `true` if standard deviations are stated. Otherwise they follow from the residuals.
    pub has_std: bool,
}

impl Problem {
    /// Creates a calibration of `fitted` settings of `brushes` by measured `points`.
    ///
    /// # Errors
    /// If the points cannot determine the settings, or cannot be simulated.
    pub fn new(
        brushes: Vec<StatedBrush>,
        fitted: Vec<Fitted>,
        points: Vec<MeasuredPoint>,
    ) -> Result<Self, FitError> {
        check_fitted(&brushes, &fitted)?;
        let readings = points.iter().enumerate().flat_map(|(position, point)| {
            let readings = point.readings.iter().enumerate();
            readings.filter_map(move |(force, reading)| Some((position, point, force, (*reading)?)))
        });
        let readings: Vec<(usize, &MeasuredPoint, usize, Reading)> = readings.collect();
        let has_std = readings.iter().any(|(.., reading)| reading.std.is_some());
        let observation = |&(position, point, force, reading): &(
            usize,
            &MeasuredPoint,
            usize,
            Reading,
        )| {
            let (key, line, value) = (Quantity::FORCES[force].key(), point.line, reading.value);
            if value <= 0.0 {
                return Err(FitError(format!(
                    "line {line} of the measured forces: `{key}` is {value}: a force that is not above zero tells nothing about the \
                     filaments; leave the cell empty or measure at a greater depth"
                )));
            }
            let std = std_of(reading, has_std, key, line)?;
            Ok(Observation {
                point: position,
                force,
                value,
                std,
            })
        };
        let observations = readings
            .iter()
            .map(observation)
            .collect::<Result<Vec<_>, _>>()?;
        let (found, settings, needed) = (
            observations.len(),
            fitted.len(),
            fitted.len() + usize::from(!has_std),
        );
        if found < needed {
            return Err(FitError(format!(
                "{found} measured forces cannot determine {settings} settings: measure at least {needed} points, better 12, at speeds \
                 and depths that differ"
            )));
        }
        if let Some(point) = points
            .iter()
            .find(|point| brushes.len() > 1 && point.tool.is_none())
        {
            let line = point.line;
            return Err(FitError(format!(
                "line {line} of the measured forces does not name its tool: add a column `tool`"
            )));
        }
        let problem = Self {
            brushes,
            fitted,
            points,
            observations,
            radii: None,
            has_std,
        };
        let start = problem.stated();
        for point in &problem.points {
            let wrong = |error: &dyn Display| {
                FitError(format!(
                    "line {} of the measured forces cannot be simulated: {error}",
                    point.line
                ))
            };
            let settings = problem
                .settings(&ToolPlace::of(point), &start)
                .map_err(|violation| wrong(&violation))?;
            if settings.brush.is_some() {
                check_brush(&settings, None).map_err(|error| wrong(&error))?;
            }
        }
        Ok(problem)
    }

    /// Creates a calibration of `fitted` settings by the `radii` of an edge over time, which a tool
    /// with these `settings` has brushed.
    ///
    /// # Errors
    /// If the radii cannot determine the settings, or there is no such edge.
    pub fn of_radii(
        settings: Settings,
        mut fitted: Vec<Fitted>,
        radii: Vec<MeasuredRadius>,
    ) -> Result<Self, FitError> {
        if let Some(other) = fitted.iter().find(|fitted| !fitted.is_of_edges()) {
            return Err(FitError(format!(
                "radii of an edge over time do not tell `{}`: fit it to forces first, then {PRESTON} to radii, with the file that the \
                 first fit writes",
                other.parameter.path
            )));
        }
        let brushes = vec![StatedBrush {
            name: String::new(),
            settings,
            followed: Vec::new(),
        }];
        check_fitted(&brushes, &fitted)?;
        let settings = &brushes[0].settings;
        edges_of(settings).map_err(|error| FitError(error.to_string()))?;
        let removal = settings.removal_or_default();
        if removal.observed.is_some() {
            let words = "`removal.observed` states the radius of one trial: make it a row of the measured table, and leave it out of the file";
            return Err(FitError(words.to_owned()));
        }
        let fits = |path: &str| fitted.iter().any(|fitted| fitted.parameter.path == path);
        if !fits(PRESTON) && removal.preston_m2_n.is_none() {
            return Err(FitError(format!(
                "state `{PRESTON}`, or fit it, too, as in --fit {PRESTON}"
            )));
        }
        let (has_std, start) = (
            radii.iter().any(|own| own.radius.std.is_some()),
            settings.workpiece.kind.edge_radius_m(),
        );
        let observation = |(point, own): (usize, &MeasuredRadius)| {
            let (line, value) = (own.line, own.radius.value);
            let std = std_of(own.radius, has_std, Quantity::EdgeRadius.key(), line)?;
            if !fits(START) && value + MAX_STDS_BELOW_START * std < start {
                return Err(FitError(format!(
                    "line {line} of the measured table: a radius of {value:e} m is below that at the start, {start:e} m by `{START}`: an \
                     edge only grows rounder; state a smaller one, or fit it, as in --fit {START}"
                )));
            }
            Ok(Observation {
                point,
                force: Quantity::FORCES.len(),
                value,
                std,
            })
        };
        let observations = radii
            .iter()
            .enumerate()
            .map(observation)
            .collect::<Result<Vec<_>, _>>()?;
        let radii = Radii::new(radii, settings);
        let (found, settings, needed) = (
            observations.len(),
            fitted.len(),
            fitted.len() + usize::from(!has_std),
        );
        let has_grown = observations
            .iter()
            .any(|own| radii.turns[own.point] > 0.0 && own.value > start * f64::from(!fits(START)));
        if found < needed || !has_grown {
            return Err(FitError(format!(
                "{found} measured radii cannot determine {settings} settings: measure at least {needed} after some time, better 6, from \
                 early to late"
            )));
        }
        // The radius at the start is below the largest one.
        let largest = observations.iter().map(|own| own.value).fold(0.0, f64::max);
        for own in fitted.iter_mut().filter(|own| own.parameter.path == START) {
            own.bounds[1] = own.bounds[1].min(largest);
        }
        Ok(Self {
            brushes,
            fitted,
            points: Vec::new(),
            observations,
            radii: Some(radii),
            has_std,
        })
    }

    /// Returns the word for the measurements.
    #[must_use]
    pub fn measured(&self) -> &'static str {
        if self.radii.is_some() {
            "radii"
        } else {
            "forces"
        }
    }

    /// Returns the word for one measurement.
    #[must_use]
    pub fn measured_once(&self) -> &'static str {
        if self.radii.is_some() {
            "radius"
        } else {
            "force"
        }
    }

    /// Returns the values of the fitted settings in the file, within their bounds; for radii, first
    /// estimates.
    #[must_use]
    pub fn stated(&self) -> Vec<f64> {
        let least = self
            .observations
            .iter()
            .map(|own| own.value)
            .fold(f64::INFINITY, f64::min);
        let value = |fitted: &Fitted| {
            let [low, high] = fitted.bounds;
            let stated = fitted.parameter.get(&self.brushes[0].settings);
            let value = match (&self.radii, fitted.parameter.path) {
                (Some(radii), PRESTON) => radii.guess.unwrap_or(stated),
                (Some(_), START) => least / 2.0,
                _ => stated,
            };
            value.clamp(low, high)
        };
        self.fitted.iter().map(value).collect()
    }

    /// Returns `true` if filaments touch in some brush.
    #[must_use]
    pub fn has_brush(&self) -> bool {
        self.radii.is_none()
            && self
                .brushes
                .iter()
                .any(|brush| brush.settings.brush.is_some())
    }

    /// Returns the settings of a place with some values of the fitted settings.
    ///
    /// # Errors
    /// If the settings contradict each other.
    pub fn settings(&self, place: &ToolPlace, values: &[f64]) -> Result<Settings, Violation> {
        let brush = &self.brushes[place.tool];
        let mut settings = brush.settings.clone();
        if settings.brush.is_none() {
            settings.uncertainty = UncertaintySettings::default();
        }
        for (fitted, value) in self.fitted.iter().zip(values) {
            fitted.parameter.set(&mut settings, *value);
        }
        let is_fitted = |parameter: &Parameter| {
            self.fitted
                .iter()
                .any(|fitted| std::ptr::eq(fitted.parameter, parameter))
        };
        for (parameter, value) in brush
            .followed
            .iter()
            .filter(|(parameter, _)| !is_fitted(parameter))
        {
            parameter.set(&mut settings, *value);
        }
        // A fitted setting may itself follow from other fitted ones.
        for (fitted, value) in self
            .fitted
            .iter()
            .zip(values)
            .filter(|(fitted, _)| !fitted.parameter.instead_of.is_empty())
        {
            fitted.parameter.set(&mut settings, *value);
        }
        let (path, speed) = match place.speed {
            Speed::Velocity(speed) => (VELOCITY, speed),
            Speed::Rotational(speed) => (SPEED, speed),
        };
        let parameter = Parameter::find(path).expect("the table has velocity and speed");
        parameter.check(speed)?;
        parameter.set(&mut settings, speed);
        // The depth is that of the point, also where the file states a force.
        let settings = settings.at_depth(place.penetration_depth_m);
        check(&settings)?;
        Ok(settings)
    }
}

/// Tool, speed and depth of a simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolPlace {
    /// Position of the tool.
    pub tool: usize,
    /// Speed of the tool.
    pub speed: Speed,
    /// Penetration depth `a_e` in m.
    pub penetration_depth_m: f64,
}

impl ToolPlace {
    /// Returns the place of a measured point.
    #[must_use]
    pub fn of(point: &MeasuredPoint) -> Self {
        Self {
            tool: point.tool.unwrap_or(0),
            speed: point.speed,
            penetration_depth_m: point.penetration_depth_m,
        }
    }
}

/// Returns the standard deviation of a reading, or a share of its value if no reading has one.
fn std_of(reading: Reading, has_std: bool, key: &str, line: u64) -> Result<f64, FitError> {
    let wrong = |what: String| {
        Err(FitError(format!(
            "line {line} of the measured table: {what}"
        )))
    };
    match reading.std {
        Some(0.0) => wrong(format!(
            "the standard deviation of `{key}` is 0: nothing is known exactly"
        )),
        None if has_std => wrong(format!(
            "`{key}` has no standard deviation, others have: state it, or relative_std = 0.03 under [measured] for all that have none"
        )),
        std => Ok(std.unwrap_or(ASSUMED_STD * reading.value)),
    }
}

/// Checks that the settings can be fitted together, and to all brushes.
fn check_fitted(brushes: &[StatedBrush], fitted: &[Fitted]) -> Result<(), FitError> {
    let wrong = |what: String| Err(FitError(what));
    if fitted.is_empty() {
        return wrong(
            "state what is to be fitted, as in --fit filament.youngs_modulus_pa".to_owned(),
        );
    }
    for (position, Fitted { parameter, .. }) in fitted.iter().enumerate() {
        let path = parameter.path;
        if fitted[..position]
            .iter()
            .any(|other| other.parameter.path == path)
        {
            return wrong(format!("`{path}` is to be fitted twice"));
        }
        let is_same = |other: &&Fitted| {
            parameter
                .group()
                .any(|same| same.path == other.parameter.path)
        };
        if let Some(other) = fitted[..position].iter().find(is_same) {
            let other = other.parameter.path;
            return wrong(format!(
                "`{path}` and `{other}` cannot both be fitted: each follows from the other"
            ));
        }
        for StatedBrush {
            settings, followed, ..
        } in brushes
        {
            if let Some((stated, _)) = followed
                .iter()
                .find(|(stated, _)| stated.instead_of == path)
            {
                let stated = stated.path;
                return wrong(format!(
                    "the file states `{stated}`, from which `{path}` follows: fit `{stated}`, or state `{path}` instead"
                ));
            }
            if parameter.section() == "brush" && settings.brush.is_none() {
                return wrong(format!(
                    "`{path}` is a setting of filaments that touch: add a section [brush], or do not fit it"
                ));
            }
            if parameter.get(settings) != parameter.get(&brushes[0].settings) {
                return wrong(format!(
                    "the tools state different values of `{path}`, and a fit is of one value: calibrate them one by one"
                ));
            }
        }
    }
    Ok(())
}
