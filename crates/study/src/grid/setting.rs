//! Setting or named tools along an axis of a study, and texts of the values.

use std::borrow::Cow;
use std::sync::Arc;

use crate::text::number::{labels, short};
use crate::text::units::without_unit;
use bristle::model::parameters::Parameter;
use serde_json::{Value, json};

/// Path of the axis of named tools, and name of their column.
pub const TOOL: &str = "tool";

/// Path of the setting that changes fastest in a study.
pub const VELOCITY: &str = "process.brushing_velocity_m_s";
/// Path of the setting that states the velocity by the speed of the machine.
pub const SPEED: &str = "process.rotational_speed_rpm";
/// Path of the setting that changes next.
pub const DEPTH: &str = "process.penetration_depth_m";
/// Path of the setting that moves forces more than any other unknown.
pub const FRICTION: &str = "contact.friction_coefficient";
/// Path of the number of turns.
pub const TURNS: &str = "process.turns";
/// Path of the force with which a tool is pressed on.
pub const FORCE: &str = "process.tool_force_n";

/// Path of the setting that says where the workpiece is.
pub const OFFSET: &str = "workpiece.offset_m";
const SEGMENTS: &str = "filament.segments";

/// Setting with different values along an axis of a study.
#[derive(Clone, Debug)]
pub enum Setting {
    /// Number of the input file.
    Number(&'static Parameter),
    /// Several named tools. The values are positions in the list of names.
    Tool(Arc<[String]>),
}

impl PartialEq for Setting {
    fn eq(&self, other: &Self) -> bool {
        self.path() == other.path() && self.names() == other.names()
    }
}

impl Setting {
    /// Returns the dotted path of a number in the input file, or [`TOOL`].
    #[must_use]
    pub fn path(&self) -> &'static str {
        self.parameter().map_or(TOOL, |parameter| parameter.path)
    }

    /// Returns the section of the input file that has the setting.
    #[must_use]
    pub fn section(&self) -> &'static str {
        self.parameter().map_or(TOOL, Parameter::section)
    }

    /// Returns the number of the input file; `None` for named tools.
    #[must_use]
    pub fn parameter(&self) -> Option<&'static Parameter> {
        match self {
            Self::Number(parameter) => Some(parameter),
            Self::Tool(_) => None,
        }
    }

    /// Returns the names of the tools, whose positions are the values; `None` if values are
    /// numbers.
    #[must_use]
    pub fn names(&self) -> Option<&[String]> {
        match self {
            Self::Number(_) => None,
            Self::Tool(names) => Some(names),
        }
    }

    /// Returns the name in words.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.parameter().map_or("tool", |parameter| parameter.name)
    }

    /// Returns the unit in which people read values; empty for a pure number.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        self.parameter()
            .map_or("", |parameter| readable(parameter).0)
    }

    /// Returns the factor from the unit of the input file to [`Self::unit`].
    #[must_use]
    pub fn factor(&self) -> f64 {
        self.parameter()
            .map_or(1.0, |parameter| readable(parameter).1)
    }

    /// Returns MODEL's symbol, or else the key without its unit.
    #[must_use]
    pub fn symbol(&self) -> Cow<'static, str> {
        self.parameter().map_or(Cow::Borrowed(TOOL), symbol)
    }

    /// Returns the key within its section.
    #[must_use]
    pub fn key(&self) -> &'static str {
        self.parameter().map_or(TOOL, Parameter::key)
    }

    /// Returns a short word for file names.
    #[must_use]
    pub fn word(&self) -> &'static str {
        match self.path() {
            VELOCITY => "velocity",
            SPEED => "speed",
            DEPTH => "depth",
            OFFSET => "offset",
            _ => self.key(),
        }
    }

    /// Returns name, symbol and unit, for an axis.
    #[must_use]
    pub fn label(&self) -> String {
        let symbol = self.parameter().map_or("", |parameter| parameter.symbol);
        // The symbol or the key replaces a name that contains an explanation.
        let name = if self.name().contains(", ") {
            self.symbol()
        } else {
            Cow::Borrowed(self.name())
        };
        self.with_unit(format!("{name} {symbol}").trim_end())
    }

    /// Returns symbol and unit, for a column.
    #[must_use]
    pub fn heading(&self) -> String {
        self.with_unit(&self.symbol())
    }

    fn with_unit(&self, text: &str) -> String {
        let unit = self.unit();
        if unit.is_empty() {
            text.to_owned()
        } else {
            format!("{text} in {unit}")
        }
    }

    /// Formats a value with its unit, as in `10 m/s`, or the name of a tool.
    #[must_use]
    pub fn text(&self, value: f64) -> String {
        match self {
            Self::Number(parameter) => number_text(parameter, value),
            Self::Tool(names) => names[value as usize].clone(),
        }
    }

    /// Formats symbol and value, as in `v_b = 10 m/s` or `tool fine`.
    #[must_use]
    pub fn equation(&self, value: f64) -> String {
        match self {
            Self::Number(parameter) => equation(parameter, value),
            Self::Tool(_) => format!("{TOOL} {}", self.text(value)),
        }
    }

    /// Returns the name of a curve with this value: the name of a tool, or [`Setting::equation`].
    #[must_use]
    pub fn legend(&self, value: f64) -> String {
        match self {
            Self::Number(parameter) => equation(parameter, value),
            Self::Tool(_) => self.text(value),
        }
    }

    /// Formats values without their unit: numbers have equally many decimals.
    pub fn labels(&self, values: impl Iterator<Item = f64>) -> Vec<String> {
        match self {
            Self::Number(_) => labels(values.map(|value| value * self.factor())),
            Self::Tool(_) => values.map(|value| self.text(value)).collect(),
        }
    }

    /// Formats a value for file names.
    #[must_use]
    pub fn file_word(&self, value: f64) -> String {
        match self {
            Self::Number(_) => short(value),
            Self::Tool(_) => file_word(&self.text(value)),
        }
    }

    /// Converts a value to JSON: a number in SI units, or the name of a tool.
    #[must_use]
    pub fn json(&self, value: f64) -> Value {
        match self {
            Self::Number(_) => json!(value),
            Self::Tool(_) => json!(self.text(value)),
        }
    }
}

/// Replaces the characters of a name that not every file system allows.
pub(super) fn file_word(name: &str) -> String {
    name.chars()
        .map(|letter| {
            if letter.is_alphanumeric() || "-.".contains(letter) {
                letter
            } else {
                '_'
            }
        })
        .collect()
}

/// Returns the unit in which people read a number, and the factor to it.
fn readable(parameter: &Parameter) -> (&'static str, f64) {
    match parameter.unit {
        "m" => ("mm", 1e3),
        "Pa" => ("GPa", 1e-9),
        unit => (unit, 1.0),
    }
}

fn symbol(parameter: &'static Parameter) -> Cow<'static, str> {
    // People would read its symbol n as a rotational speed.
    if parameter.symbol.is_empty() || parameter.path == SEGMENTS {
        let key = parameter.key();
        return Cow::Owned(without_unit(key).unwrap_or(key).replace('_', " "));
    }
    Cow::Borrowed(parameter.symbol)
}

fn number_text(parameter: &Parameter, value: f64) -> String {
    let (unit, factor) = readable(parameter);
    format!("{} {unit}", short(value * factor))
        .trim_end()
        .to_owned()
}

/// Formats a number of the input file and its value, as in `v_b = 10 m/s`.
#[must_use]
pub fn equation(parameter: &'static Parameter, value: f64) -> String {
    format!("{} = {}", symbol(parameter), number_text(parameter, value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_as_people_write_them() {
        let texts = |path: &str, value: f64| {
            let setting = Setting::Number(Parameter::find(path).expect(path));
            (setting.equation(value), setting.heading(), setting.label())
        };
        let expected = [
            (
                DEPTH,
                2e-3,
                "a_e = 2 mm",
                "a_e in mm",
                "penetration depth a_e in mm",
            ),
            (
                SPEED,
                1200.0,
                "n_w = 1200 rpm",
                "n_w in rpm",
                "rotational speed n_w in rpm",
            ),
            (
                VELOCITY,
                10.0,
                "v_b = 10 m/s",
                "v_b in m/s",
                "brushing velocity v_b in m/s",
            ),
            (
                "filament.diameter_m",
                1.18e-3,
                "d = 1.18 mm",
                "d in mm",
                "diameter d in mm",
            ),
            (
                "filament.youngs_modulus_pa",
                3.3e9,
                "E = 3.3 GPa",
                "E in GPa",
                "Young’s modulus E in GPa",
            ),
            (
                "filament.segments",
                25.0,
                "segments = 25",
                "segments",
                "number of segments n",
            ),
            (
                "contact.friction_coefficient",
                0.3,
                "µ = 0.3",
                "µ",
                "coefficient of friction µ",
            ),
            (
                OFFSET,
                -0.01,
                "offset = -10 mm",
                "offset in mm",
                "offset of the workpiece along x in mm",
            ),
            (
                "brush.damping_s_m",
                0.1,
                "damping = 0.1 s/m",
                "damping in s/m",
                "contact damping between filaments in s/m",
            ),
        ];
        for (path, value, equation, heading, label) in expected {
            assert_eq!(
                texts(path, value),
                (equation.to_owned(), heading.to_owned(), label.to_owned())
            );
        }
        let tools = Setting::Tool(["fine", "no 2, coarse"].map(str::to_owned).into());
        assert_eq!(
            (tools.equation(0.0).as_str(), tools.legend(0.0).as_str()),
            ("tool fine", "fine")
        );
        assert_eq!(
            (tools.heading(), tools.label(), tools.file_word(1.0)),
            ("tool".into(), "tool".into(), "no_2__coarse".into())
        );
        assert_eq!(
            (tools.json(1.0), tools.labels([1.0].into_iter())),
            (json!("no 2, coarse"), vec!["no 2, coarse".to_owned()])
        );
    }
}
