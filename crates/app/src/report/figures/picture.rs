//! A figure, and what titles of figures say of a contact.

use crate::report::drawing::Canvas;
use crate::report::drawing::diagram::Diagram;
use crate::report::drawing::format::Format;
use bristle::model::parameters::Parameter;
use bristle::model::settings::Settings;
use bristle_study::grid::{DEPTH, SPEED, VELOCITY, equation};

/// A figure with the name of its file.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// File name without extension.
    pub name: String,
    /// The drawing.
    pub canvas: Canvas,
}

impl Picture {
    /// The figure of a diagram.
    pub(super) fn of(name: impl Into<String>, format: &Format, diagram: &Diagram) -> Self {
        Self {
            name: name.into(),
            canvas: diagram.draw_in(format),
        }
    }
}

/// A title with speed and depth of the contact.
pub(super) fn contact_title(title: &str, settings: &Settings) -> String {
    format!("{title}: {}", of_process(settings))
}

/// Rotational speed, velocity and depth.
pub(super) fn of_process(settings: &Settings) -> String {
    let process = &settings.process;
    let text = |path: &str, value| {
        Parameter::find(path).map_or_else(String::new, |parameter| equation(parameter, value))
    };
    let [speed, velocity, depth] = [
        (SPEED, settings.rotational_speed_rpm()),
        (VELOCITY, process.brushing_velocity_m_s),
        (DEPTH, process.penetration_depth_m),
    ]
    .map(|(path, value)| text(path, value));
    format!("{speed} ({velocity}), {depth}")
}
