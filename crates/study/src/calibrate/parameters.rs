//! The settings that are fitted, within bounds, and the coordinates in which they are.

use crate::grid::Setting;
use crate::text::shown;
use crate::text::units::own_keys;
use bristle::model::parameters::Parameter;
use thiserror::Error;

/// Sections whose scalar settings can be fitted.
const SECTIONS: [&str; 4] = ["tool", "filament", "contact", "brush"];
/// Paths of the settings that radii tell: the Preston coefficient, and the radius at the start.
pub const PRESTON: &str = "removal.preston_m2_n";
pub const START: &str = "workpiece.edge_radius_m";
/// Settings that the radii of an edge over time tell.
const OF_EDGES: [&str; 2] = [PRESTON, START];
/// Longest key in a message, in characters.
const LONGEST_KEY: usize = 60;
/// A value closer to the end of its range than this share of it is at that end.
const AT_END: f64 = 1e-3;

/// A setting that is fitted.
#[derive(Clone, Copy, Debug)]
pub struct Fitted {
    /// The setting.
    pub parameter: &'static Parameter,
    /// Its least and its largest value.
    pub bounds: [f64; 2],
}

/// Why something cannot be fitted, in words.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{0}")]
pub struct FitError(pub(crate) String);

/// The error about a `key` that is none of a setting that can be fitted. `meant` is what may have
/// been meant, behind a semicolon.
fn unknown(key: &str, meant: &str) -> FitError {
    FitError(format!(
        "`{}` is no scalar setting of [tool], [filament], [contact] or [brush], nor {PRESTON} or {START}, which radii of an edge tell; \
         `bristle explain` lists them{meant}",
        shown(key, LONGEST_KEY)
    ))
}

impl Fitted {
    /// A setting between `bounds`, or else within its usual range.
    ///
    /// # Errors
    /// If it cannot be fitted between them.
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

    /// Reads `KEY` or `KEY=LOW..HIGH`. The key may end in another unit, in which the bounds then
    /// are.
    ///
    /// # Errors
    /// If it is not of this form, or cannot be fitted.
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

    /// Whether radii of an edge over time tell it, rather than forces.
    #[must_use]
    pub fn is_of_edges(&self) -> bool {
        OF_EDGES.contains(&self.parameter.path)
    }

    /// Whether its coordinate is its logarithm: all its values are positive.
    #[must_use]
    pub fn is_logarithmic(&self) -> bool {
        self.bounds[0] > 0.0
    }

    /// The coordinate of a value: its logarithm, or else the value over the width of its bounds.
    #[must_use]
    pub fn coordinate(&self, value: f64) -> f64 {
        if self.is_logarithmic() {
            value.ln()
        } else {
            value / self.width()
        }
    }

    /// The value of a coordinate, within its range.
    #[must_use]
    pub fn value(&self, coordinate: f64) -> f64 {
        let value = if self.is_logarithmic() {
            coordinate.exp()
        } else {
            coordinate * self.width()
        };
        value.clamp(self.bounds[0], self.bounds[1])
    }

    /// How fast its value grows with its coordinate.
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

    /// The bounds of its coordinate.
    #[must_use]
    pub fn limits(&self) -> [f64; 2] {
        self.bounds.map(|bound| self.coordinate(bound))
    }

    /// The end of its range at which a value is, if it is there.
    #[must_use]
    pub fn end(&self, value: f64) -> Option<&'static str> {
        let [low, high] = self.limits();
        let share = (self.coordinate(value) - low) / (high - low);
        match share {
            share if share < AT_END => Some("lower"),
            share if share > 1.0 - AT_END => Some("upper"),
            _ => None,
        }
    }

    /// The setting as one of an axis, with its symbol and its unit for people.
    #[must_use]
    pub fn setting(&self) -> Setting {
        Setting::Number(self.parameter)
    }
}
