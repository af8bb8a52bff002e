//! Figures of a calibration: measured against fitted forces, and the confidence ellipse of each
//! pair of settings.

use std::f64::consts::TAU;

use bristle::model::settings::Settings;
use bristle_study::calibrate::{Calibration, GrownEdge, Radii, estimate};
use bristle_study::grid::Setting;

use super::picture::{Picture, TOOL_RADIUS, brush_line};
use super::removal::unit_of_time;
use crate::report::drawing::diagram::{Curve, Diagram, Look};
use crate::report::drawing::format::Format;
use crate::report::drawing::scale::Axis;

/// Beginnings of the names of the figures.
const FITTED: &str = "calibration_";
const ELLIPSE: &str = "ellipse_";
/// Measured quantities: symbol or name, unit, and word in file names.
const FORCES: [[&str; 3]; 4] = [
    ["contact normal force F_n,w", "N", "force"],
    ["tangential force F_t,w", "N", "tangential_force"],
    ["torque M_w", "N m", "torque"],
    ["power P_w", "W", "power"],
];
/// Standard errors on either side that hold 95 %.
const BAND: f64 = 1.96;
/// 95 % quantile of the sum of two squared standard normal numbers.
const OF_ELLIPSE: f64 = 5.991;
/// Points of an ellipse.
const POINTS: usize = 180;
/// Maximum number of ellipses.
const MAX_ELLIPSES: usize = 10;

/// Draws the figures of a calibration. `calibration_force` and the like have measured over fitted
/// forces, with the 95 % band of the calibration. `calibration_radius` has radii over time,
/// `ellipse_A_B` the 95 % confidence region of two settings.
#[must_use]
pub fn calibration_figures(calibration: &Calibration, format: &Format) -> Vec<Picture> {
    let measured = |force: &usize| {
        calibration
            .problem
            .observations
            .iter()
            .any(|own| own.force == *force)
    };
    let forces = (0..FORCES.len())
        .filter(measured)
        .map(|force| fitted(calibration, force, format));
    let determined: Vec<usize> = (0..calibration.values.len())
        .filter(|&own| calibration.is_determined(own))
        .collect();
    let pairs = determined
        .iter()
        .flat_map(|&a| determined.iter().map(move |&b| [a, b]))
        .filter(|[a, b]| a < b);
    let radii = calibration
        .problem
        .radii
        .iter()
        .map(|radii| grown(calibration, radii, format));
    radii
        .chain(forces)
        .chain(
            pairs
                .take(MAX_ELLIPSES)
                .map(|pair| ellipse(calibration, pair, format)),
        )
        .collect()
}

/// Returns `true` if [`calibration_figures`] can make a figure of this name.
#[must_use]
pub fn is_of_calibration(name: &str) -> bool {
    name.starts_with(FITTED) || name.starts_with(ELLIPSE)
}

/// Draws radii over time: measured, fitted, and by the square root of time.
fn grown(calibration: &Calibration, radii: &Radii, format: &Format) -> Picture {
    let last = calibration.growth.last().map_or(0.0, |edge| edge.time_s);
    let (unit, second) = unit_of_time(last);
    let of = |value: &dyn Fn(&GrownEdge) -> f64| -> Vec<(f64, f64)> {
        calibration
            .growth
            .iter()
            .map(|edge| (edge.time_s / second, 1e3 * value(edge)))
            .collect()
    };
    let upper = of(&|edge| edge.radius_m + BAND * edge.error_m);
    let mut lower = of(&|edge| (edge.radius_m - BAND * edge.error_m).max(0.0));
    lower.reverse();
    let scale = calibration.variance.sqrt();
    let bars = calibration.problem.observations.iter().map(|own| {
        let ends = [own.value - own.std * scale, own.value + own.std * scale];
        (radii.time_s(own.point) / second, ends.map(|end| 1e3 * end))
    });
    let markers = calibration.problem.observations.iter();
    let diagram = Diagram::new(
        "Measured and fitted radii of the edge",
        with_stated(&estimates(calibration), calibration),
        [
            Axis::linear(format!("time in {unit}")),
            Axis::amount("radius R of the edge in mm"),
        ],
        vec![
            Curve::new("", Look::Band, [upper, lower].concat()),
            Curve::new(
                "fitted, ± 1.96 σ of the fit",
                Look::Line,
                of(&|edge| edge.radius_m),
            ),
            Curve::new(
                "square root of time",
                Look::Reference,
                of(&|edge| edge.square_root_m),
            ),
            Curve::new(
                "",
                Look::Bars,
                bars.flat_map(|(time, ends)| ends.map(|end| (time, end))),
            )
            .with_pen(1),
            Curve::new(
                measured_with(calibration),
                Look::Filled,
                markers.map(|own| (radii.time_s(own.point) / second, 1e3 * own.value)),
            )
            .with_pen(1),
        ],
    );
    Picture::of(format!("{FITTED}radius"), format, &diagram)
}

/// Returns the values of the fitted settings as text.
fn estimates(calibration: &Calibration) -> String {
    let determined = (0..calibration.values.len()).filter(|&own| calibration.is_determined(own));
    determined
        .map(|own| estimate(calibration, own))
        .collect::<Vec<_>>()
        .join(", ")
}

/// Adds a line with friction and brush to a subtitle, without settings that are fitted.
fn with_stated(subtitle: &str, calibration: &Calibration) -> String {
    let problem = &calibration.problem;
    let brushes: Vec<Settings> = problem
        .brushes
        .iter()
        .map(|brush| brush.settings.clone())
        .collect();
    let is_fitted = |path: &str| problem.fitted.iter().any(|own| own.parameter.path == path);
    // R is the radius of the edge among radii.
    let omits_radius = problem.radii.is_some() || is_fitted("filament.length_m");
    let line = brush_line(&brushes, |path| {
        is_fitted(path) || path == TOOL_RADIUS && omits_radius
    });
    format!("{subtitle}\n{line}")
}

/// Returns the meaning of the error bars.
fn measured_with(calibration: &Calibration) -> &'static str {
    match calibration.problem.has_std {
        true => "measured ± standard deviation",
        false => "measured ± scatter of the residuals",
    }
}

/// Draws measured over fitted forces.
fn fitted(calibration: &Calibration, force: usize, format: &Format) -> Picture {
    let [name, unit, word] = FORCES[force];
    let scale = calibration.variance.sqrt();
    let observations = calibration
        .problem
        .observations
        .iter()
        .enumerate()
        .filter(|(_, own)| own.force == force);
    let mut points: Vec<[f64; 4]> = observations
        .map(|(row, own)| {
            [
                calibration.forces[row],
                own.value,
                own.std * scale,
                calibration.force_errors[row],
            ]
        })
        .collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let line: Vec<(f64, f64)> = points
        .iter()
        .map(|[fitted, ..]| (*fitted, *fitted))
        .collect();
    let upper = points
        .iter()
        .map(|[fitted, _, _, error]| (*fitted, fitted + BAND * error));
    let lower = points
        .iter()
        .rev()
        .map(|[fitted, _, _, error]| (*fitted, fitted - BAND * error));
    let bars = points
        .iter()
        .flat_map(|[fitted, value, std, _]| [(*fitted, value - std), (*fitted, value + std)]);
    let diagram = Diagram::new(
        "Measured and fitted forces",
        with_stated(&estimates(calibration), calibration),
        [
            Axis::amount(format!("fitted {name} in {unit}")),
            Axis::amount(format!("measured {name} in {unit}")),
        ],
        vec![
            Curve::new("", Look::Band, upper.chain(lower)),
            Curve::new(
                "measured = fitted, ± 1.96 σ of the fit",
                Look::Reference,
                line,
            ),
            Curve::new("", Look::Bars, bars).with_pen(1),
            Curve::new(
                measured_with(calibration),
                Look::Filled,
                points.iter().map(|[fitted, value, ..]| (*fitted, *value)),
            )
            .with_pen(1),
        ],
    );
    Picture::of(format!("{FITTED}{word}"), format, &diagram)
}

/// Draws the confidence region of two settings.
fn ellipse(calibration: &Calibration, [a, b]: [usize; 2], format: &Format) -> Picture {
    let fitted = [a, b].map(|own| &calibration.problem.fitted[own]);
    let settings: [Setting; 2] = fitted.map(|own| own.setting());
    let centre = [a, b].map(|own| calibration.values[own]);
    let errors = [a, b].map(|own| calibration.errors.standard_error(own));
    let correlation = calibration.errors.correlation(a, b);
    let point = |index: usize| {
        let angle = TAU * index as f64 / POINTS as f64;
        let (along, across) = (angle.cos(), angle.sin());
        let unit = [
            along,
            correlation * along + (1.0 - correlation * correlation).max(0.0).sqrt() * across,
        ];
        let at = |side: usize| {
            let coordinate = fitted[side].coordinate(centre[side])
                + OF_ELLIPSE.sqrt() * errors[side] * unit[side];
            settings[side].factor() * fitted[side].value(coordinate)
        };
        (at(0), at(1))
    };
    let shown = [0, 1].map(|side| settings[side].factor() * centre[side]);
    let mut curves = vec![
        Curve::new("95 % of both", Look::Line, (0..=POINTS).map(point)),
        Curve::new("estimate", Look::Markers, vec![(shown[0], shown[1])]),
    ];
    if let [Some(of_a), Some(of_b)] = [a, b].map(|own| calibration.intervals[own]) {
        let [of_a, of_b] = [(of_a, &settings[0]), (of_b, &settings[1])]
            .map(|(ends, own)| ends.map(|end| end * own.factor()));
        let corners = [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)].map(|(x, y)| (of_a[x], of_b[y]));
        curves.push(Curve::new("95 % of each", Look::Reference, corners));
    }
    let subtitle = format!(
        "{}, {}, correlation {correlation:.2}",
        estimate(calibration, a),
        estimate(calibration, b)
    );
    let diagram = Diagram::new(
        "Confidence ellipse",
        with_stated(&subtitle, calibration),
        [
            Axis::linear(settings[0].label()),
            Axis::linear(settings[1].label()),
        ],
        curves,
    );
    let name = format!(
        "{ELLIPSE}{}_{}",
        fitted[0].parameter.key(),
        fitted[1].parameter.key()
    );
    Picture::of(name, format, &diagram)
}
