//! A figure, and the words of titles and subtitles about contact and brush.

use crate::report::drawing::Canvas;
use crate::report::drawing::diagram::Diagram;
use crate::report::drawing::format::Format;
use bristle::model::parameters::Parameter;
use bristle::model::settings::Settings;
use bristle_study::grid::{DEPTH, SPEED, VELOCITY, equation};
use bristle_study::input::friction::FRICTION;
use bristle_study::text::number::short;

/// The settings of a brush that figures state, besides the radius of the tool.
const OF_BRUSH: [&str; 5] = [
    FRICTION,
    "filament.length_m",
    "filament.diameter_m",
    "filament.youngs_modulus_pa",
    "tool.filament_count",
];

/// Stands for the radius of the tool among paths of settings.
pub(super) const TOOL_RADIUS: &str = "R";

/// A figure with the name of its file.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// File name without extension.
    pub name: String,
    /// The drawing.
    pub canvas: Canvas,
}

impl Picture {
    /// Draws a diagram.
    pub(super) fn of(name: impl Into<String>, format: &Format, diagram: &Diagram) -> Self {
        Self {
            name: name.into(),
            canvas: diagram.draw_in(format),
        }
    }
}

/// Returns a title with speed and depth of the contact.
pub(super) fn contact_title(title: &str, settings: &Settings) -> String {
    format!("{title}: {}", of_process(settings))
}

/// Returns a line of a subtitle with friction and brush. It has the settings that all `cases`
/// share, except those whose paths the figure `omits`.
pub(super) fn brush_line(cases: &[Settings], omits: impl Fn(&str) -> bool) -> String {
    let common = |value: &dyn Fn(&Settings) -> f64| {
        let (first, others) = cases.split_first()?;
        let own = value(first);
        others
            .iter()
            .all(|other| value(other) == own)
            .then_some(own)
    };
    let stated = OF_BRUSH.into_iter().filter(|path| !omits(path));
    let stated = stated.filter_map(|path| {
        let parameter = Parameter::find(path)?;
        let value = common(&|settings| parameter.get(settings))?;
        Some(equation(parameter, value))
    });
    let radius = common(&Settings::tool_radius_m).filter(|_| !omits(TOOL_RADIUS));
    let radius = radius.map(|radius| format!("R = {} mm", short(1e3 * radius)));
    stated.chain(radius).collect::<Vec<_>>().join(", ")
}

/// Adds the line of friction and brush of one contact to a subtitle.
pub(super) fn with_brush(subtitle: &str, settings: &Settings) -> String {
    let line = brush_line(std::slice::from_ref(settings), |_| false);
    format!("{subtitle}\n{line}")
}

/// Returns rotational speed, velocity and depth as text.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_state_friction_and_the_brush_without_what_varies() {
        let mut one = Settings::paper(10.0, 1e-3);
        one.contact.friction_coefficient = 0.2;
        let alone = brush_line(std::slice::from_ref(&one), |_| false);
        let of_brush = "d = 1.18 mm, E = 3 GPa, N_f = 10500";
        assert_eq!(
            alone,
            format!("µ = 0.2, l_f = 40 mm, {of_brush}, R = 180 mm")
        );
        let mut longer = one.clone();
        longer.filament.length_m += 0.01;
        assert_eq!(
            brush_line(&[one, longer], |path| path == FRICTION),
            of_brush
        );
    }
}
