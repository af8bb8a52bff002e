//! Radii of an edge over time, and the laws by which they are fitted (MODEL, "Removal and wear").

use std::f64::consts::TAU;

use crate::grid::Resources;
use crate::grid::removal::{Course, RemovalError};
use crate::input::measured::{Brushed, MeasuredRadius};
use bristle::model::settings::{ObservedEdge, Settings};
use bristle::simulation::Stop;

use crate::calibrate::parameters::{Fitted, PRESTON, START};

/// The radii of an edge over time.
#[derive(Clone, Debug)]
pub struct Radii {
    /// Measured radii, in the order of time.
    pub points: Vec<MeasuredRadius>,
    /// Turns of the tool until each radius.
    pub turns: Vec<f64>,
    /// Time of a turn in s.
    pub second_per_turn: f64,
    /// Stated coefficient in m²/N and radius at the start in m, used where they are not fitted.
    pub stated: [f64; 2],
    /// Coefficient in m²/N that leads to the largest radius, once that is known.
    pub(crate) guess: Option<f64>,
    pub(crate) law: Law,
}

/// Law of the growth of an edge.
#[derive(Clone, Debug)]
pub(crate) enum Law {
    /// Nothing is simulated yet.
    Unknown,
    /// Work of simulated passes.
    Simulated(Box<Course>),
    /// Square root of time: `R² = R_0² + r k_P N`, by its `r` in N.
    SquareRoot(f64),
}

impl Radii {
    pub(crate) fn new(points: Vec<MeasuredRadius>, settings: &Settings) -> Self {
        let second_per_turn = TAU / settings.angular_velocity_rad_s();
        let turns = |point: &MeasuredRadius| match point.brushed {
            Brushed::Time(time) => time / second_per_turn,
            Brushed::Turns(turns) => turns,
        };
        let preston = settings
            .removal_or_default()
            .preston_m2_n
            .unwrap_or_default();
        let stated = [preston, settings.workpiece.kind.edge_radius_m()];
        Self {
            turns: points.iter().map(turns).collect(),
            points,
            second_per_turn,
            stated,
            guess: None,
            law: Law::Unknown,
        }
    }

    /// Returns the time in s of a point.
    #[must_use]
    pub fn time_s(&self, point: usize) -> f64 {
        self.turns[point] * self.second_per_turn
    }

    /// Returns the largest radius in m, and its time.
    fn largest(&self) -> ObservedEdge {
        let later = (0..self.points.len()).filter(|&point| self.turns[point] > 0.0);
        let largest = later.max_by(|&a, &b| {
            self.points[a]
                .radius
                .value
                .total_cmp(&self.points[b].radius.value)
        });
        let point = largest.expect("a problem has a radius after the start");
        ObservedEdge {
            edge_radius_m: self.points[point].radius.value,
            edge_radius_std_m: None,
            time_s: self.time_s(point),
        }
    }

    /// Simulates the growth of the edge from the least radius that it may have had at the start.
    /// `tell` receives the numbers of simulated and of all passes of a batch.
    pub(crate) fn follow(
        &mut self,
        settings: &Settings,
        fitted: &[Fitted],
        resources: Resources,
        stop: &Stop,
        tell: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<(), RemovalError> {
        let mut settings = settings.clone();
        if let Some(start) = fitted.iter().find(|fitted| fitted.parameter.path == START) {
            settings.workpiece.kind.set_edge_radius_m(start.bounds[0]);
        }
        let course = Course::up_to(self.largest(), &settings, resources, stop, tell)?;
        self.guess = Some(course.preston_m2_n());
        self.law = Law::Simulated(Box::new(course));
        Ok(())
    }

    /// Returns the radii, to be fitted by the square root of time.
    pub(crate) fn by_square_root(&self) -> Self {
        let ObservedEdge {
            edge_radius_m,
            time_s,
            ..
        } = self.largest();
        let rate =
            edge_radius_m.powi(2) / (self.guess.unwrap_or(1.0) * time_s / self.second_per_turn);
        Self {
            law: Law::SquareRoot(rate),
            ..self.clone()
        }
    }

    /// Returns the largest relative change of the simulated radius when the number of simulated
    /// radii was doubled.
    #[must_use]
    pub fn change_when_refined(&self) -> f64 {
        if let Law::Simulated(course) = &self.law {
            course.change_when_refined
        } else {
            0.0
        }
    }

    /// Returns the coefficient in m²/N and the radius at the start in m for these values of the
    /// fitted settings.
    fn constants(&self, fitted: &[Fitted], values: &[f64]) -> [f64; 2] {
        let value = |path: &str| {
            fitted
                .iter()
                .position(|fitted| fitted.parameter.path == path)
        };
        let [preston, start] = [PRESTON, START].map(|path| value(path).map(|own| values[own]));
        [
            preston.unwrap_or(self.stated[0]),
            start.unwrap_or(self.stated[1]),
        ]
    }

    /// Returns the radii in m after `turns`, which ascend, for these values of the fitted settings.
    pub(crate) fn after(&self, fitted: &[Fitted], values: &[f64], turns: &[f64]) -> Vec<f64> {
        let [preston, start] = self.constants(fitted, values);
        match &self.law {
            Law::Simulated(course) => course.radii(preston, start, turns),
            Law::SquareRoot(rate) => turns
                .iter()
                .map(|turns| (start * start + rate * preston * turns).sqrt())
                .collect(),
            Law::Unknown => vec![f64::NAN; turns.len()],
        }
    }

    /// Returns `c` of `R² = R_0² + c² t` in m/√s, by the square root of time.
    pub(crate) fn speed_of_root(&self, fitted: &[Fitted], values: &[f64]) -> f64 {
        let [preston, _] = self.constants(fitted, values);
        if let Law::SquareRoot(rate) = self.law {
            (rate * preston / self.second_per_turn).sqrt()
        } else {
            0.0
        }
    }
}
