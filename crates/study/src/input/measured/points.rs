//! Measured points and radii, as tables state them.

use bristle::model::settings::Settings;

use crate::input::columns::Quantity;

/// Relative difference up to which values are the same: a file may round differently from a sweep.
const MAX_RELATIVE_DIFFERENCE: f64 = 1e-9;

/// The speed of the tool at a measured point, as its table states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Speed {
    /// Brushing velocity `v_b` in m/s.
    Velocity(f64),
    /// Rotational speed `n_w` in rpm.
    Rotational(f64),
}

impl Speed {
    /// Returns the number, in the unit of its kind.
    #[must_use]
    pub fn value(self) -> f64 {
        match self {
            Self::Velocity(value) | Self::Rotational(value) => value,
        }
    }

    /// Returns the quantity of the speed.
    #[must_use]
    pub fn quantity(self) -> Quantity {
        match self {
            Self::Velocity(_) => Quantity::Velocity,
            Self::Rotational(_) => Quantity::RotationalSpeed,
        }
    }

    /// Returns the speed of a tool with these `settings`, stated by the other quantity if that is
    /// asked for.
    #[must_use]
    pub fn stated_by(self, quantity: Quantity, settings: &Settings) -> Self {
        let mut settings = settings.clone();
        match (self, quantity) {
            (Self::Velocity(velocity), Quantity::RotationalSpeed) => {
                settings.process.brushing_velocity_m_s = velocity;
                Self::Rotational(settings.rotational_speed_rpm())
            }
            (Self::Rotational(speed), Quantity::Velocity) => {
                settings.set_rotational_speed_rpm(speed);
                Self::Velocity(settings.process.brushing_velocity_m_s)
            }
            _ => self,
        }
    }
}

/// A measured force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// Speed of the tool.
    pub speed: Speed,
    /// Rotational speed in rpm that the table states beside the velocity. The velocity counts.
    pub second_speed_rpm: Option<f64>,
    /// Penetration depth `a_e` in m.
    pub penetration_depth_m: f64,
    /// Tool contact normal force `F_n,w` in N.
    pub force_n: f64,
    /// Standard deviation in N, if it is known.
    pub std_n: Option<f64>,
    /// Position of the tool of this measurement among the named tools of the study; `None` if the
    /// table does not say.
    pub tool: Option<usize>,
}

/// Number in a cell, with its standard deviation if the table has one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Value, in the unit of its quantity's key.
    pub value: f64,
    /// Standard deviation, in the same unit.
    pub std: Option<f64>,
}

/// A measured point, with all its readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredPoint {
    /// Speed of the tool.
    pub speed: Speed,
    /// Rotational speed in rpm that the table states beside the velocity. The velocity counts.
    pub second_speed_rpm: Option<f64>,
    /// Penetration depth `a_e` in m.
    pub penetration_depth_m: f64,
    /// Readings of [`Quantity::FORCES`].
    pub readings: [Option<Reading>; 4],
    /// Position of the tool, as in [`Measurement::tool`].
    pub tool: Option<usize>,
    /// Line in the table, counted from 1; 0 without a table.
    pub line: u64,
}

impl MeasuredPoint {
    /// Returns the normal force alone, which a point has if [`read_measured`] has read it.
    pub(super) fn measurement(&self) -> Option<Measurement> {
        let Self {
            speed,
            second_speed_rpm,
            penetration_depth_m,
            tool,
            ..
        } = *self;
        let [
            Some(Reading {
                value: force_n,
                std: std_n,
            }),
            ..,
        ] = self.readings
        else {
            return None;
        };
        Some(Measurement {
            speed,
            second_speed_rpm,
            penetration_depth_m,
            force_n,
            std_n,
            tool,
        })
    }
}

/// Time or turns for which an edge was brushed, as a table states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Brushed {
    /// Time in s.
    Time(f64),
    /// Turns of the tool.
    Turns(f64),
}

/// The radius of an edge that was measured after some time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredRadius {
    /// Time or turns until the measurement.
    pub brushed: Brushed,
    /// Radius in m.
    pub radius: Reading,
    /// Line in the table, counted from 1; 0 without a table.
    pub line: u64,
}

/// Returns `true` if two values are the same except for rounding.
pub fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= MAX_RELATIVE_DIFFERENCE * a.abs().max(b.abs())
}
