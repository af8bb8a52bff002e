//! Settings that are fitted within bounds, and their coordinates.

use crate::grid::Setting;
use crate::text::shown;
use crate::text::units::own_keys;
use bristle::model::parameters::Parameter;
use thiserror::Error;

/// Sections whose scalar settings can be fitted.
const SECTIONS: [&str; 4] = ["tool", "filament", "contact", "brush"];
/// Paths of the settings that radii determine: the Preston coefficient, and the radius at the
/// start.
pub const PRESTON: &str = "removal.preston_m2_n";
pub const START: &str = "workpiece.edge_radius_m";
/// Settings that the radii of an edge over time determine.
const OF_EDGES: [&str; 2] = [PRESTON, START];
/// Longest key in a message, in characters.
const LONGEST_KEY: usize = 60;
/// Share of its range within which a value is at the end of the range.
const END_SHARE: f64 = 1e-3;

/// A setting that is fitted.
#[derive(Clone, Copy, Debug)]
pub struct Fitted {
    /// The setting.
    pub parameter: &'static Parameter,
    /// Least and largest value.
    pub bounds: [f64; 2],
}

/// Reason why something cannot be fitted, in words.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{0}")]
pub struct FitError(pub(crate) String);

/// Returns the error about a `key` without a setting that can be fitted. `meant` suggests another
/// key, behind a semicolon.
fn unknown(key: &str, meant: &str) -> FitError {
    FitError(format!(
        "`{}` is no scalar setting of [tool], [filament], [contact] or [brush], nor {PRESTON} or {START}, which radii of an edge tell; \
         `bristle explain` lists them{meant}",
        shown(key, LONGEST_KEY)
    ))
}

impl Fitted {
    /// Creates a fitted setting between `bounds`, or else within its usual range.
    ///
    /// # Errors
    /// If the setting cannot be fitted within this range.
    pub fn new(parameter: &'static Parameter, bounds: Option<[f64; 2]>) -> Result<Self, FitError> {
        if !SECTIONS.contains(&parameter.section()) && !OF_EDGES.contains(&parameter.path) {
            return Err(unknown(parameter.path, ""));
        }
        let path = parameter.path;
        if parameter.range.whole {
            return Err(FitError(format!(
                "`{path}` is a whole number, which cannot be fitted"
            )));
        }
        let usual = parameter.usual.map(|usual| [usual.least, usual.largest]);
        let no_range = || {
            FitError(format!(
                "`{path}` has no usual range: state one, as in --fit {path}=LOW..HIGH"
            ))
        };
        let [low, high] = bounds.or(usual).ok_or_else(no_range)?;
        if !(low < high && parameter.range.contains(low) && parameter.range.contains(high)) {
            let allowed = parameter.allowed();
            return Err(FitError(format!(
                "the bounds {low} and {high} of `{path}` must be {allowed}, the first one lower"
            )));
        }
        Ok(Self {
            parameter,
            bounds: [low, high],
        })
    }

    /// Reads `KEY` or `KEY=LOW..HIGH`. The key may end in another unit, which the bounds then have.
    ///
    /// # Errors
    /// If the text has another form, or the setting cannot be fitted.
    pub fn parse(text: &str) -> Result<Self, FitError> {
        let (key, bounds) = match text.split_once('=') {
            Some((key, bounds)) => (key.trim(), Some(bounds)),
            None => (text.trim(), None),
        };
        let found = own_keys(key).find_map(|(own, unit)| Some((Parameter::find(&own)?, unit)));
        let Some((parameter, unit)) = found else {
            let meant = crate::input::document::setting_meant(key);
            let meant = if meant.is_empty() {
                meant
            } else {
                format!("; {meant}")
            };
            return Err(unknown(key, &meant));
        };
        let form = || {
            FitError(format!(
                "`{}` is not a setting, as in filament.youngs_modulus_pa, or one with bounds, as in filament.damping_ratio=0.01..0.2",
                shown(text, LONGEST_KEY)
            ))
        };
        let bounds = bounds.map(|bounds| {
            let (low, high) = bounds.split_once("..").ok_or_else(form)?;
            // A key without a unit states a number, not per cent.
            let to_own = |number: f64| {
                if unit.suffix.is_empty() {
                    number
                } else {
                    unit.to_own(number)
                }
            };
            let number = |text: &str| text.trim().parse().map(to_own).map_err(|_| form());
            Ok([number(low)?, number(high)?])
        });
        Self::new(parameter, bounds.transpose()?)
    }

    /// Returns `true` if radii of an edge determine the setting, rather than forces.
    #[must_use]
    pub fn is_of_edges(&self) -> bool {
        OF_EDGES.contains(&self.parameter.path)
    }

    /// Returns `true` if the coordinate is the logarithm: all values are positive.
    #[must_use]
    pub fn is_logarithmic(&self) -> bool {
        self.bounds[0] > 0.0
    }

    /// Returns the coordinate of a value: its logarithm, or else the value over the width of its
    /// bounds.
    #[must_use]
    pub fn coordinate(&self, value: f64) -> f64 {
        if self.is_logarithmic() {
            value.ln()
        } else {
            value / self.width()
        }
    }

    /// Returns the value of a coordinate, within the bounds.
    #[must_use]
    pub fn value(&self, coordinate: f64) -> f64 {
        let value = if self.is_logarithmic() {
            coordinate.exp()
        } else {
            coordinate * self.width()
        };
        value.clamp(self.bounds[0], self.bounds[1])
    }

    /// Returns the derivative of the value in its coordinate.
    #[must_use]
    pub fn slope(&self, value: f64) -> f64 {
        if self.is_logarithmic() {
            value
        } else {
            self.width()
        }
    }

    fn width(&self) -> f64 {
        self.bounds[1] - self.bounds[0]
    }

    /// Returns the bounds of the coordinate.
    #[must_use]
    pub fn limits(&self) -> [f64; 2] {
        self.bounds.map(|bound| self.coordinate(bound))
    }

    /// Returns the end of the range at which a value is, if it is at one.
    #[must_use]
    pub fn end(&self, value: f64) -> Option<&'static str> {
        let [low, high] = self.limits();
        let share = (self.coordinate(value) - low) / (high - low);
        match share {
            share if share < END_SHARE => Some("lower"),
            share if share > 1.0 - END_SHARE => Some("upper"),
            _ => None,
        }
    }

    /// Returns the setting as one of an axis, with its symbol and its unit for people.
    #[must_use]
    pub fn setting(&self) -> Setting {
        Setting::Number(self.parameter)
    }
}
