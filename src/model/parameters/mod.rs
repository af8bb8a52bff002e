//! The scalar settings in one table: path, unit and range.
//!
//! The checks of an input file, the sweeps of a study and the JSON schema all read this table, so
//! they cannot disagree. Conditions on vectors and between settings are in [`Settings::check`].

mod range;
mod table;

use std::error::Error;
use std::fmt::{self, Display};

use crate::model::settings::Settings;
pub use range::Range;
pub use table::PARAMETERS;

/// Largest number of segments of a filament.
pub const MAX_SEGMENTS: usize = 400;

/// Largest number of filaments along a trim.
pub const MAX_POSITIONS: usize = 65;

/// Largest number of columns of a sector.
pub const MAX_COLUMNS: usize = 100_000;
/// Largest number of rows of a brush.
pub const MAX_ROWS: usize = 10_000;

/// Smallest number of sampled tools of a case: a few per coefficient of the sensitivity indices.
pub const MIN_SAMPLES: usize = 64;
/// Largest number of sampled tools of a case: the length of the sequence of samples.
pub const MAX_SAMPLES: usize = 1 << 16;

/// Scalar setting of an input file, which a study can sweep.
#[derive(Debug)]
pub struct Parameter {
    /// Dotted path in the input file: section and key.
    pub path: &'static str,
    /// Unit; empty for a dimensionless number.
    pub unit: &'static str,
    /// MODEL's symbol, with an underscore before a subscript; empty where MODEL has none.
    pub symbol: &'static str,
    /// Name in words.
    pub name: &'static str,
    /// Allowed values.
    pub range: Range,
    /// Word that may replace a number; empty if none.
    pub word: &'static str,
    /// `true` if the setting has no default.
    pub required: bool,
    /// Path of the setting to which this one converts, with other settings of the tool; empty if
    /// none. A file gives one of the two, and the other follows.
    pub instead_of: &'static str,
    /// Other names under which people look for the setting.
    pub also: &'static [&'static str],
    /// Default in words, where it is no fixed number; otherwise empty.
    pub default: &'static str,
    /// Source of the default; empty if nothing needs to be said.
    pub source: &'static str,
    /// `true` if the default is a property of some brush, filament or pair of materials that
    /// decides the force.
    pub decides_force: bool,
    /// Values of usual brushes, if values outside are likely a slip.
    pub usual: Option<Usual>,
    read: fn(&Settings) -> Option<f64>,
    absent: fn() -> f64,
    set: fn(&mut Settings, f64),
}

impl Parameter {
    /// Finds a setting by its dotted path.
    #[must_use]
    pub fn find(path: &str) -> Option<&'static Self> {
        PARAMETERS.iter().find(|parameter| parameter.path == path)
    }

    /// Returns the settings of which a file gives exactly one, or at most one: this one and its
    /// alternatives.
    pub fn group(&self) -> impl Iterator<Item = &'static Self> {
        let path = if self.instead_of.is_empty() {
            self.path
        } else {
            self.instead_of
        };
        PARAMETERS
            .iter()
            .filter(move |parameter| parameter.path == path || parameter.instead_of == path)
    }

    /// Returns the section of the input file that contains the setting.
    #[must_use]
    pub fn section(&self) -> &'static str {
        self.path.split_once('.').map_or("", |(section, _)| section)
    }

    /// Returns the setting's key within its section.
    #[must_use]
    pub fn key(&self) -> &'static str {
        self.path.split_once('.').map_or(self.path, |(_, key)| key)
    }

    /// Reads the setting; `None` if workpieces of the stated kind do not have it.
    #[must_use]
    pub fn read(&self, settings: &Settings) -> Option<f64> {
        (self.read)(settings)
    }

    /// Reads the setting, with the default instead of `None`.
    #[must_use]
    pub fn get(&self, settings: &Settings) -> f64 {
        self.read(settings).unwrap_or_else(self.absent)
    }

    /// Changes the setting, if the settings have it, without checks. A count takes the integer part
    /// of the value.
    pub fn set(&self, settings: &mut Settings, value: f64) {
        (self.set)(settings, value);
    }

    /// Formats a value with the fewest digits that read back the same, without a fraction if the
    /// setting is a count.
    #[must_use]
    pub fn format(&self, value: f64) -> String {
        match value {
            _ if self.range.whole && value.fract() == 0.0 => format!("{value}"),
            _ if value.abs() >= MIN_SCIENTIFIC => format!("{value:e}"),
            _ => format!("{value:?}"),
        }
    }

    /// Returns the allowed values, in words and with their unit.
    #[must_use]
    pub fn allowed(&self) -> String {
        let numbers = self.numbers();
        if self.word.is_empty() {
            numbers
        } else {
            format!("{numbers} or \"{}\"", self.word)
        }
    }

    /// Returns the unit after a comma, as in ", in m"; nothing if there is none.
    #[must_use]
    pub fn in_unit(&self) -> String {
        if self.unit.is_empty() {
            String::new()
        } else {
            format!(", in {}", self.unit)
        }
    }

    /// Returns the allowed numbers, in words and with their unit.
    fn numbers(&self) -> String {
        format!("{}{}", self.range, self.in_unit())
    }

    /// Checks that the settings have this setting, unless the value is the default.
    ///
    /// # Errors
    /// If workpieces of the stated kind do not have it.
    pub fn check_presence(&self, settings: &Settings, value: f64) -> Result<(), Violation> {
        let absent = || {
            let allowed = left_out(settings.workpiece.kind.name());
            Violation {
                path: self.path,
                value: self.format(value),
                allowed,
            }
        };
        if self.read(settings).is_some() || value == (self.absent)() {
            Ok(())
        } else {
            Err(absent())
        }
    }

    /// Checks one value of the setting on its own.
    pub fn check(&self, value: f64) -> Result<(), Violation> {
        if self.range.contains(value) {
            Ok(())
        } else {
            Err(Violation {
                path: self.path,
                value: self.format(value),
                allowed: self.numbers(),
            })
        }
    }

    const fn required(mut self) -> Self {
        self.required = true;
        self
    }

    const fn changed_by(mut self, set: fn(&mut Settings, f64)) -> Self {
        self.set = set;
        self
    }

    const fn or(mut self, word: &'static str) -> Self {
        self.word = word;
        self
    }

    const fn also(mut self, names: &'static [&'static str]) -> Self {
        self.also = names;
        self
    }

    const fn default_is(mut self, words: &'static str) -> Self {
        self.default = words;
        self
    }

    const fn source(mut self, source: &'static str) -> Self {
        self.source = source;
        self
    }

    const fn decides_force(mut self) -> Self {
        self.decides_force = true;
        self
    }

    const fn or_default(mut self, absent: fn() -> f64) -> Self {
        self.absent = absent;
        self
    }

    const fn usually(mut self, least: f64, largest: f64, slip: &'static str) -> Self {
        self.usual = Some(Usual {
            least,
            largest,
            slip,
        });
        self
    }

    const fn instead_of(mut self, path: &'static str) -> Self {
        self.instead_of = path;
        self
    }
}

/// Returns the allowed state of a setting that workpieces of a kind do not have.
#[must_use]
pub fn left_out(kind: &str) -> String {
    format!("left out: a workpiece of kind `{kind}` has none")
}

/// Usual values of a setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Usual {
    /// Smallest usual value.
    pub least: f64,
    /// Largest usual value.
    pub largest: f64,
    /// Slip that most likely leads to another value, such as "millimetres typed as metres".
    pub slip: &'static str,
}

/// Smallest number that is shown as a power of ten.
const MIN_SCIENTIFIC: f64 = 1e7;

/// Setting outside its range.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Violation {
    /// Dotted path of the setting.
    pub path: &'static str,
    /// Value found.
    pub value: String,
    /// Allowed values, in words.
    pub allowed: String,
}

impl Violation {
    /// Creates the violation of the setting at `path`, which has this `value`.
    pub(crate) fn of(
        path: &'static str,
        value: impl fmt::Debug,
        allowed: impl Into<String>,
    ) -> Self {
        Self {
            path,
            value: format!("{value:?}"),
            allowed: allowed.into(),
        }
    }
}

impl Display for Violation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            path,
            value,
            allowed,
        } = self;
        write!(formatter, "`{path}` is {value}, but must be {allowed}")
    }
}

impl Error for Violation {}
