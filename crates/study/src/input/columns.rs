//! Contents of the columns of a table of measured values, and format of the table.

use crate::grid::{DEPTH, SPEED, VELOCITY};
use crate::text::units::{NamedUnit, TIMES, TORQUES, TURNS, own_keys, units_of};

/// Largest size of a number in a table, in the unit of its key. A larger velocity, or one below the
/// reciprocal, is a slip of the pen. Sums and squares of such numbers are finite.
pub const LARGEST: f64 = 1e100;

/// Declares the quantities in columns, their list and their keys.
macro_rules! quantities {
    ($($quantity:ident = $key:literal: $what:literal,)*) => {
        /// Quantity in a column.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Quantity {
            $(#[doc = $what] $quantity,)*
        }

        impl Quantity {
            /// All quantities.
            pub const ALL: [Self; [$($key),*].len()] = [$(Self::$quantity),*];

            /// Returns the name of the column, which ends with its unit, and of the key in the
            /// input file.
            #[must_use]
            pub fn key(self) -> &'static str {
                match self {
                    $(Self::$quantity => $key,)*
                }
            }
        }
    };
}

quantities! {
    Velocity = "brushing_velocity_m_s": "Brushing velocity.",
    RotationalSpeed = "rotational_speed_rpm": "Rotational speed, instead of the velocity.",
    Depth = "penetration_depth_m": "Penetration depth.",
    Force = "force_n": "Tool contact normal force.",
    Std = "std_n": "Its standard deviation, which a table may leave out.",
    Tangential = "tangential_force_n": "Tangential force of the tool, for a calibration.",
    TangentialStd = "tangential_force_std_n": "Its standard deviation.",
    Torque = "torque_n_m": "Torque of the tool, for a calibration.",
    TorqueStd = "torque_std_n_m": "Its standard deviation.",
    Power = "power_w": "Power of the tool, for a calibration.",
    PowerStd = "power_std_w": "Its standard deviation.",
    Time = "time_s": "Time for which an edge was brushed, for a calibration.",
    Turns = "turns": "Turns of the tool, instead of the time.",
    EdgeRadius = "edge_radius_m": "Radius of the edge after it.",
    EdgeRadiusStd = "edge_radius_std_m": "Its standard deviation.",
}

impl Quantity {
    /// Forces, torque and power of a tool. In [`Self::ALL`] the standard deviation follows each.
    pub const FORCES: [Self; 4] = [Self::Force, Self::Tangential, Self::Torque, Self::Power];

    /// Returns the standard deviation of one of [`Self::FORCES`].
    pub(crate) fn std(self) -> Self {
        Self::ALL[self as usize + 1]
    }

    /// Returns the position in [`Self::FORCES`] of the quantity, or of its force.
    pub(crate) fn force(self) -> Option<usize> {
        Self::FORCES
            .iter()
            .position(|&force| force == self || force.std() == self)
    }

    pub(crate) fn is_std(self) -> bool {
        self == Self::EdgeRadiusStd
            || self
                .force()
                .is_some_and(|force| Self::FORCES[force] != self)
    }

    /// Returns `true` for the two quantities that state the speed of the tool.
    #[must_use]
    pub fn is_speed(self) -> bool {
        matches!(self, Self::Velocity | Self::RotationalSpeed)
    }

    /// Returns the quantity that a key names, and the unit of the key: the quantity's own, or
    /// another.
    #[must_use]
    pub fn of_key(key: &str) -> Option<(Self, &'static NamedUnit)> {
        let of_own = |quantity: Self| {
            let unit = quantity
                .own_units()
                .iter()
                .find(|unit| unit.key_of(quantity.key()).as_deref() == Some(key));
            unit.map(|unit| (quantity, unit))
        };
        let quantity = |own: &str| Self::ALL.into_iter().find(|quantity| quantity.key() == own);
        let own = Self::ALL.into_iter().find_map(of_own);
        own.or_else(|| own_keys(key).find_map(|(own, unit)| Some((quantity(&own)?, unit))))
    }

    /// Returns the path of the setting that is measured, if it is one.
    pub(crate) fn path(self) -> Option<&'static str> {
        match self {
            Self::Velocity => Some(VELOCITY),
            Self::RotationalSpeed => Some(SPEED),
            Self::Depth => Some(DEPTH),
            _ => None,
        }
    }

    /// Returns the units. The first is that of the key.
    pub(crate) fn units(self) -> impl Iterator<Item = &'static NamedUnit> {
        let own = self.own_units();
        own.iter()
            .chain(units_of(self.key()).filter(move |_| own.is_empty()))
    }

    /// Returns the units, if the key does not tell them: it ends like that of another quantity, or
    /// they are of tables only.
    fn own_units(self) -> &'static [NamedUnit] {
        match self {
            Self::Torque | Self::TorqueStd => &TORQUES,
            Self::Time => &TIMES,
            Self::Turns => &TURNS,
            _ => &[],
        }
    }

    /// Returns the names of the units.
    pub fn unit_names(self) -> impl Iterator<Item = &'static str> {
        self.units().flat_map(|unit| unit.names.iter().copied())
    }

    /// Returns the unit with a name.
    pub(crate) fn unit(self, name: &str) -> Option<&'static NamedUnit> {
        self.units().find(|unit| unit.names.contains(&name))
    }

    /// Returns the unit as people write it, which may be RPM or KN.
    pub(crate) fn unit_written(self, name: &str) -> Option<&'static NamedUnit> {
        let is_it = |unit: &&NamedUnit| unit.names.iter().any(|own| own.eq_ignore_ascii_case(name));
        self.unit(name).or_else(|| self.units().find(is_it))
    }

    /// Returns the unit in which a number would be between two others, if it is not that of the
    /// key.
    pub fn unit_between(
        self,
        number: f64,
        [least, largest]: [f64; 2],
    ) -> Option<&'static NamedUnit> {
        self.units()
            .find(|unit| !unit.is_own() && (least..=largest).contains(&unit.to_own(number)))
    }

    /// Returns the least number that a cell may have, and the limits in words.
    pub(crate) fn least(self) -> (f64, &'static str) {
        match self {
            Self::Velocity | Self::RotationalSpeed | Self::Depth | Self::EdgeRadius => {
                (1.0 / LARGEST, "greater than 0, from 1e-100")
            }
            Self::Time | Self::Turns => (0.0, "at least 0, from 0"),
            _ if self.is_std() => (0.0, "at least 0, from 0"),
            _ => (-LARGEST, "from -1e100"),
        }
    }
}

/// A column that the input file names.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnName {
    /// Heading in the table.
    pub heading: String,
    /// Unit. If there is none, that in the heading, or that of the key.
    pub unit: Option<&'static NamedUnit>,
}

/// Format of a table, as far as the input file states it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableFormat {
    /// Separator of the cells of a row: one of [`SEPARATORS`](crate::input::cells::SEPARATORS).
    pub separator: Option<char>,
    /// Separator of decimals: a point or a comma.
    pub decimal: Option<char>,
    /// Columns that have other headings than their keys, each quantity at most once.
    pub columns: Vec<(Quantity, ColumnName)>,
    /// Heading of the column with the names of tools, if it is not [`TOOL`](crate::grid::TOOL).
    pub tool: Option<String>,
    /// Names of the tools that the study compares.
    pub tools: Vec<String>,
    /// Standard deviation over the value, for values without their own.
    pub relative_std: Option<f64>,
}

impl TableFormat {
    /// Returns the column of a quantity, if the input file names it.
    pub(crate) fn named(&self, quantity: Quantity) -> Option<&ColumnName> {
        self.columns
            .iter()
            .find(|(named, _)| *named == quantity)
            .map(|(_, column)| column)
    }
}

/// Returns the unit in a heading such as `Fz [kN]`, `Fz (kN)`, `Fz / kN` or `Fz in kN`.
pub(crate) fn unit_in(heading: &str) -> Option<&str> {
    let bracketed = [('[', ']'), ('(', ')')]
        .into_iter()
        .find_map(|(open, close)| {
            let (_, rest) = heading.rsplit_once(open)?;
            rest.split_once(close).map(|(unit, _)| unit)
        });
    let after = || {
        [" / ", " in "]
            .into_iter()
            .find_map(|word| heading.split_once(word))
            .map(|(_, unit)| unit)
    };
    bracketed.or_else(after).map(str::trim)
}
