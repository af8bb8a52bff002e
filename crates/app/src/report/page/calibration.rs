//! The page of a calibration, without a script.

use bristle_study::calibrate::{Calibration, estimate, lines};
use bristle_study::grid::{DEPTH, Setting};
use bristle_study::input::measured::{MeasuredPoint, Speed};
use bristle_study::text::number::{short, significant};
use bristle_study::text::shown;

use super::brush::drawings;
use super::{LONGEST_NAME, STYLE, document, escape_html, fill, lead_and_items};
use crate::report::drawing::format::Format;
use crate::report::figures::{calibration_figures, unit_of_time};

const TEMPLATE: &str = include_str!("calibration.html");
/// The table of points to measure at next.
const NEXT: &str = "  <section class=\"tables\" aria-labelledby=\"next-title\">
    <h2 id=\"next-title\">Where to measure next</h2>
    <table><thead><tr><th scope=\"col\">Point</th><th scope=\"col\" class=\"number\">Determinant of the covariance</th></tr></thead><tbody>
{}</tbody></table>
  </section>
";
/// Maximum number of forces in the table.
const MAX_FORCES: usize = 200;

/// Returns the page of a calibration of the input file `name`.
#[must_use]
pub fn calibration_page(name: &str, calibration: &Calibration) -> String {
    let name = escape_html(&shown(name, LONGEST_NAME));
    let [lead, rest] = lead_and_items(&lines(calibration));
    let settings: String = (0..calibration.values.len())
        .map(|own| setting_row(calibration, own))
        .collect();
    let measured = calibration.problem.measured();
    let trust = format!(
        "The errors follow from how the {measured} change with the settings, which is known to {} %. If that is much above 1 %, {measured} bend within \
         the errors{}.",
        significant(100.0 * calibration.derivative_error),
        if calibration.problem.radii.is_some() {
            ""
        } else {
            ", because one contact more or less begins there"
        }
    );
    let next: String = calibration
        .next
        .iter()
        .map(|next| {
            let words = escape_html(&calibration.next_words(next));
            format!(
                "<tr><td>{words}</td><td class=\"number\">÷ {}</td></tr>\n",
                significant(next.gain)
            )
        })
        .collect();
    let next = if next.is_empty() {
        next
    } else {
        NEXT.replace("{}", &next)
    };
    let figures = drawings(&calibration_figures(calibration, &Format::default()));
    let forces: String = (0..calibration.forces.len().min(MAX_FORCES))
        .map(|row| force_row(calibration, row))
        .collect();
    let body = [
        ("name", &*name),
        ("measured", measured),
        ("lead", &lead),
        ("rest", &rest),
        ("settings", &settings),
        ("trust", &trust),
        ("next", &next),
        ("figures", &figures),
        ("forces", &forces),
    ];
    document(
        &format!("{name}: calibration"),
        STYLE,
        "",
        &fill(TEMPLATE, &body),
    )
}

fn setting_row(calibration: &Calibration, own: usize) -> String {
    let fitted = &calibration.problem.fitted[own];
    let setting = fitted.setting();
    let cell = |[low, high]: [f64; 2]| {
        let [low, high] = [low, high].map(|end| short(end * setting.factor()));
        format!("{low} to {high} {}", setting.unit())
    };
    let value = if calibration.is_determined(own) {
        let text = estimate(calibration, own);
        text.split_once(" = ")
            .map_or(text.clone(), |(_, value)| value.to_owned())
    } else {
        "not determined".to_owned()
    };
    format!(
        "<tr><th scope=\"row\">{}</th><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td></tr>\n",
        escape_html(setting.name()),
        escape_html(&setting.symbol()),
        escape_html(&value),
        escape_html(
            calibration.intervals[own]
                .map_or_else(String::new, cell)
                .trim_end()
        ),
        escape_html(cell(fitted.bounds).trim_end()),
    )
}

fn force_row(calibration: &Calibration, row: usize) -> String {
    let own = calibration.problem.observations[row];
    let at = match &calibration.problem.radii {
        Some(radii) => {
            let time = radii.time_s(own.point);
            let (unit, second) = unit_of_time(time);
            format!(
                "{} {unit}, {} turns",
                significant(time / second),
                significant(radii.turns[own.point])
            )
        }
        None => place(calibration, &calibration.problem.points[own.point]),
    };
    let std = own.std * calibration.variance.sqrt();
    format!(
        "<tr><td>{}</td><td><code>{}</code></td><td class=\"number\">{} ± {}</td><td class=\"number\">{}</td><td class=\"number\">{:+.1}</td></tr>\n",
        escape_html(&at),
        own.quantity().key(),
        significant(own.value),
        significant(std),
        significant(calibration.forces[row]),
        calibration.residual(row)
    )
}

/// Returns tool, speed and depth of a measured force as text.
fn place(calibration: &Calibration, point: &MeasuredPoint) -> String {
    let depth = Setting::Number(
        bristle::model::parameters::Parameter::find(DEPTH).expect("the table has the depth"),
    );
    let speed = match point.speed {
        Speed::Velocity(velocity) => format!("{} m/s", short(velocity)),
        Speed::Rotational(speed) => format!("{} rpm", short(speed)),
    };
    let tool = calibration
        .tool_name(point.tool.unwrap_or(0))
        .map_or_else(String::new, |name| format!("{name}, "));
    format!("{tool}{speed}, {}", depth.text(point.penetration_depth_m))
}
