//! What is fitted to what: brushes, settings with their bounds, and measured points with their standard deviations.

use bristle::brush::{BrushError, check_brush};
use bristle::model::metrics::Metrics;
use bristle::model::parameters::{Parameter, Violation};
use bristle::model::settings::{Settings, UncertaintySettings};
use bristle_grid::removal::{RemovalError, edges_of};
use bristle_grid::uncertainty::check;
use bristle_grid::{SPEED, VELOCITY};
use bristle_input::document::StatedBrush;
use bristle_input::measured::{MeasuredPoint, MeasuredRadius, Quantity, Reading, Speed};
use thiserror::Error;

use crate::edge::Radii;
use crate::parameters::{Fitted, PRESTON, START};

/// What a tool exerts, in the order of [`Quantity::FORCES`].
pub type Forces = [f64; 4];

/// The forces of simulated metrics.
#[must_use]
pub fn forces_of(metrics: &Metrics) -> Forces {
    [
        metrics.tool_contact_normal_force_n,
        metrics.tool_tangential_force_n,
        metrics.tool_torque_n_m,
        metrics.tool_power_w,
    ]
}

/// Relative standard deviation that weighs points where the table states none: what counts is that it is the same for all.
const ASSUMED_STD: f64 = 0.03;

/// How many standard deviations a radius may be below that at the start.
const BELOW: f64 = 3.0;

/// A force that was measured at a point, or the radius of an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// The position of its point.
    pub point: usize,
    /// Its position in [`Quantity::FORCES`]; their number if it is the radius of an edge.
    pub force: usize,
    /// Its value, in the unit of its quantity.
    pub value: f64,
    /// Its standard deviation, in the same unit; if the table states none, a share of the value.
    pub std: f64,
}

impl Observation {
    /// What it is.
    #[must_use]
    pub fn quantity(&self) -> Quantity {
        Quantity::FORCES.get(self.force).copied().unwrap_or(Quantity::EdgeRadius)
    }
}

/// A calibration that can be made.
#[derive(Clone, Debug)]
pub struct Problem {
    /// The brush, or the named tools.
    pub brushes: Vec<StatedBrush>,
    /// The settings that are fitted.
    pub fitted: Vec<Fitted>,
    /// Where was measured.
    pub points: Vec<MeasuredPoint>,
    /// What was measured, at least as many as settings.
    pub observations: Vec<Observation>,
    /// The radii of an edge over time, if they are what was measured; there are no points then.
    pub radii: Option<Radii>,
    /// Whether standard deviations are stated. If not, they follow from the residuals.
    pub has_std: bool,
}

/// Why there is nothing to calibrate.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ProblemError {
    /// Nothing is to be fitted.
    #[error("state what is to be fitted, as in --fit filament.youngs_modulus_pa")]
    NothingToFit,
    /// A setting is named twice.
    #[error("`{0}` is to be fitted twice")]
    Twice(&'static str),
    /// Two settings of which each follows from the other.
    #[error("`{path}` and `{other}` cannot both be fitted: each follows from the other")]
    Both {
        /// The later one.
        path: &'static str,
        /// The other.
        other: &'static str,
    },
    /// The file states in another way what is to be fitted.
    #[error("the file states `{stated}`, from which `{path}` follows: fit `{stated}`, or state `{path}` instead")]
    Follows {
        /// What is to be fitted.
        path: &'static str,
        /// What the file states.
        stated: &'static str,
    },
    /// A setting of brushes whose filaments do not touch.
    #[error("`{0}` is a setting of filaments that touch: add a section [brush], or do not fit it")]
    NoBrush(&'static str),
    /// The tools have different values of a setting.
    #[error("the tools state different values of `{0}`, and a fit is of one value: calibrate them one by one")]
    Differs(&'static str),
    /// The table does not say which tool it was measured with.
    #[error("line {0} of the measured forces does not name its tool: add a column `tool`")]
    NoTool(u64),
    /// There are fewer forces than settings.
    #[error(
        "{found} measured forces cannot determine {settings} settings: measure at least {} points, better 12, at speeds and depths \
         that differ",
        .settings + usize::from(!.has_std)
    )]
    TooFew {
        /// The number of measured forces.
        found: usize,
        /// The number of settings.
        settings: usize,
        /// Whether they have standard deviations.
        has_std: bool,
    },
    /// A force that says nothing.
    #[error(
        "line {line} of the measured forces: `{key}` is {value}: a force that is not above zero tells nothing about the filaments; leave \
         the cell empty or measure at a greater depth"
    )]
    NoForce {
        /// Its line.
        line: u64,
        /// Its key.
        key: &'static str,
        /// Its value.
        value: f64,
    },
    /// A standard deviation of zero.
    #[error("line {line} of the measured table: the standard deviation of `{key}` is 0: nothing is known exactly")]
    NoStd {
        /// Its line.
        line: u64,
        /// Its key.
        key: &'static str,
    },
    /// Only some have a standard deviation.
    #[error(
        "line {line} of the measured table: `{key}` has no standard deviation, others have: state it, or relative_std = 0.03 under \
         [measured] for all that have none"
    )]
    SomeStd {
        /// Its line.
        line: u64,
        /// Its key.
        key: &'static str,
    },
    /// The filaments of a brush cannot be arranged.
    #[error("line {line} of the measured forces cannot be simulated: {error}")]
    Brush {
        /// Its line.
        line: u64,
        /// What is wrong with it.
        error: BrushError,
    },
    /// Forces and radii tell different settings.
    #[error(
        "radii of an edge over time do not tell `{0}`: fit it to forces first, then {PRESTON} to radii, with the file that the first fit writes"
    )]
    NotOfEdges(&'static str),
    /// There is no edge that can be followed.
    #[error("{0}")]
    Edge(RemovalError),
    /// The file states what one trial showed.
    #[error(
        "`removal.observed` states the radius of one trial: make it a row of the measured table, and leave it out of the file"
    )]
    Observed,
    /// The coefficient is unknown.
    #[error("state `{PRESTON}`, or fit it, too, as in --fit {PRESTON}")]
    NoCoefficient,
    /// There are fewer radii than settings.
    #[error(
        "{found} measured radii cannot determine {settings} settings: measure at least {} after some time, better 6, from early to late",
        .settings + usize::from(!.has_std)
    )]
    TooFewRadii {
        /// The number of measured radii.
        found: usize,
        /// The number of settings.
        settings: usize,
        /// Whether they have standard deviations.
        has_std: bool,
    },
    /// A radius below that at the start.
    #[error(
        "line {line} of the measured table: a radius of {radius:e} m is below that at the start, {start:e} m by `{START}`: an edge only grows \
         rounder; state a smaller one, or fit it, as in --fit {START}"
    )]
    BelowStart {
        /// Its line.
        line: u64,
        /// The radius in m.
        radius: f64,
        /// That at the start in m.
        start: f64,
    },
    /// A point that cannot be simulated.
    #[error("line {line} of the measured forces cannot be simulated: {violation}")]
    Point {
        /// Its line.
        line: u64,
        /// What is wrong with it.
        violation: Violation,
    },
}

impl Problem {
    /// A calibration of `fitted` settings of `brushes` by measured `points`.
    ///
    /// # Errors
    /// If the points cannot determine the settings, or cannot be simulated.
    pub fn new(
        brushes: Vec<StatedBrush>,
        fitted: Vec<Fitted>,
        points: Vec<MeasuredPoint>,
    ) -> Result<Self, ProblemError> {
        check_fitted(&brushes, &fitted)?;
        let readings = points.iter().enumerate().flat_map(|(position, point)| {
            let readings = point.readings.iter().enumerate();
            readings.filter_map(move |(force, reading)| Some((position, point, force, (*reading)?)))
        });
        let readings: Vec<(usize, &MeasuredPoint, usize, Reading)> = readings.collect();
        let has_std = readings.iter().any(|(.., reading)| reading.std.is_some());
        let observation = |&(position, point, force, reading): &(usize, &MeasuredPoint, usize, Reading)| {
            let (key, line, value) = (Quantity::FORCES[force].key(), point.line, reading.value);
            if value <= 0.0 {
                return Err(ProblemError::NoForce { line, key, value });
            }
            let std = std_of(reading, has_std, key, line)?;
            Ok(Observation { point: position, force, value, std })
        };
        let observations = readings.iter().map(observation).collect::<Result<Vec<_>, _>>()?;
        let needed = fitted.len() + usize::from(!has_std);
        if observations.len() < needed {
            return Err(ProblemError::TooFew { found: observations.len(), settings: fitted.len(), has_std });
        }
        if let Some(point) = points.iter().find(|point| brushes.len() > 1 && point.tool.is_none()) {
            return Err(ProblemError::NoTool(point.line));
        }
        let problem = Self { brushes, fitted, points, observations, radii: None, has_std };
        let start = problem.stated();
        for point in &problem.points {
            let wrong = |violation| ProblemError::Point { line: point.line, violation };
            let settings = problem.settings(&ToolPlace::of(point), &start).map_err(wrong)?;
            if settings.brush.is_some() {
                check_brush(&settings, None).map_err(|error| ProblemError::Brush { line: point.line, error })?;
            }
        }
        Ok(problem)
    }

    /// A calibration of `fitted` settings by the `radii` of an edge over time, which a tool with these `settings` has brushed.
    ///
    /// # Errors
    /// If the radii cannot determine the settings, or there is no such edge.
    pub fn of_radii(
        settings: Settings,
        mut fitted: Vec<Fitted>,
        radii: Vec<MeasuredRadius>,
    ) -> Result<Self, ProblemError> {
        if let Some(other) = fitted.iter().find(|fitted| !fitted.is_of_edges()) {
            return Err(ProblemError::NotOfEdges(other.parameter.path));
        }
        let brushes = vec![StatedBrush { name: String::new(), settings, followed: Vec::new() }];
        check_fitted(&brushes, &fitted)?;
        let settings = &brushes[0].settings;
        edges_of(settings).map_err(ProblemError::Edge)?;
        let removal = settings.removal_or_default();
        if removal.observed.is_some() {
            return Err(ProblemError::Observed);
        }
        let fits = |path: &str| fitted.iter().any(|fitted| fitted.parameter.path == path);
        if !fits(PRESTON) && removal.preston_m2_n.is_none() {
            return Err(ProblemError::NoCoefficient);
        }
        let (has_std, start) =
            (radii.iter().any(|own| own.radius.std.is_some()), settings.workpiece.kind.edge_radius_m());
        let observation = |(point, own): (usize, &MeasuredRadius)| {
            let (line, value) = (own.line, own.radius.value);
            let std = std_of(own.radius, has_std, Quantity::EdgeRadius.key(), line)?;
            if !fits(START) && value + BELOW * std < start {
                return Err(ProblemError::BelowStart { line, radius: value, start });
            }
            Ok(Observation { point, force: Quantity::FORCES.len(), value, std })
        };
        let observations = radii.iter().enumerate().map(observation).collect::<Result<Vec<_>, _>>()?;
        let radii = Radii::new(radii, settings);
        let found = observations.len();
        let has_grown =
            observations.iter().any(|own| radii.turns[own.point] > 0.0 && own.value > start * f64::from(!fits(START)));
        if found < fitted.len() + usize::from(!has_std) || !has_grown {
            return Err(ProblemError::TooFewRadii { found, settings: fitted.len(), has_std });
        }
        // The radius at the start is below the largest one.
        let largest = observations.iter().map(|own| own.value).fold(0.0, f64::max);
        for own in fitted.iter_mut().filter(|own| own.parameter.path == START) {
            own.bounds[1] = own.bounds[1].min(largest);
        }
        Ok(Self { brushes, fitted, points: Vec::new(), observations, radii: Some(radii), has_std })
    }

    /// What was measured, in words.
    #[must_use]
    pub fn measured(&self) -> &'static str {
        if self.radii.is_some() { "radii" } else { "forces" }
    }

    /// One of them.
    #[must_use]
    pub fn measured_once(&self) -> &'static str {
        if self.radii.is_some() { "radius" } else { "force" }
    }

    /// The values of the fitted settings in the file, within their bounds. Radii tell where to begin.
    #[must_use]
    pub fn stated(&self) -> Vec<f64> {
        let least = self.observations.iter().map(|own| own.value).fold(f64::INFINITY, f64::min);
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

    /// Whether filaments touch in some brush.
    #[must_use]
    pub fn has_brush(&self) -> bool {
        self.radii.is_none() && self.brushes.iter().any(|brush| brush.settings.brush.is_some())
    }

    /// The settings of a place with some values of the fitted settings.
    ///
    /// # Errors
    /// If they contradict each other.
    pub fn settings(&self, place: &ToolPlace, values: &[f64]) -> Result<Settings, Violation> {
        let brush = &self.brushes[place.tool];
        let mut settings = brush.settings.clone();
        if settings.brush.is_none() {
            settings.uncertainty = UncertaintySettings::default();
        }
        for (fitted, value) in self.fitted.iter().zip(values) {
            fitted.parameter.set(&mut settings, *value);
        }
        let is_fitted =
            |parameter: &Parameter| self.fitted.iter().any(|fitted| std::ptr::eq(fitted.parameter, parameter));
        for (parameter, value) in brush.followed.iter().filter(|(parameter, _)| !is_fitted(parameter)) {
            parameter.set(&mut settings, *value);
        }
        // What is fitted may itself follow from others that are.
        for (fitted, value) in
            self.fitted.iter().zip(values).filter(|(fitted, _)| !fitted.parameter.instead_of.is_empty())
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

/// Where a tool is simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolPlace {
    /// The position of the tool.
    pub tool: usize,
    /// Its speed.
    pub speed: Speed,
    /// Penetration depth `a_e` in m.
    pub penetration_depth_m: f64,
}

impl ToolPlace {
    /// That of a measured point.
    #[must_use]
    pub fn of(point: &MeasuredPoint) -> Self {
        Self { tool: point.tool.unwrap_or(0), speed: point.speed, penetration_depth_m: point.penetration_depth_m }
    }
}

/// The standard deviation of a reading, or a share of its value if none `has_std`.
fn std_of(reading: Reading, has_std: bool, key: &'static str, line: u64) -> Result<f64, ProblemError> {
    match reading.std {
        Some(0.0) => Err(ProblemError::NoStd { line, key }),
        None if has_std => Err(ProblemError::SomeStd { line, key }),
        std => Ok(std.unwrap_or(ASSUMED_STD * reading.value)),
    }
}

/// Checks that the settings can be fitted together, and to all brushes.
fn check_fitted(brushes: &[StatedBrush], fitted: &[Fitted]) -> Result<(), ProblemError> {
    if fitted.is_empty() {
        return Err(ProblemError::NothingToFit);
    }
    for (position, Fitted { parameter, .. }) in fitted.iter().enumerate() {
        let path = parameter.path;
        if fitted[..position].iter().any(|other| other.parameter.path == path) {
            return Err(ProblemError::Twice(path));
        }
        let is_same = |other: &&Fitted| parameter.group().any(|same| same.path == other.parameter.path);
        if let Some(other) = fitted[..position].iter().find(is_same) {
            return Err(ProblemError::Both { path, other: other.parameter.path });
        }
        for StatedBrush { settings, followed, .. } in brushes {
            if let Some((stated, _)) = followed.iter().find(|(stated, _)| stated.instead_of == path) {
                return Err(ProblemError::Follows { path, stated: stated.path });
            }
            if parameter.section() == "brush" && settings.brush.is_none() {
                return Err(ProblemError::NoBrush(path));
            }
            if parameter.get(settings) != parameter.get(&brushes[0].settings) {
                return Err(ProblemError::Differs(path));
            }
        }
    }
    Ok(())
}
