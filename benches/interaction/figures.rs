//! The figures of the page.

use std::error::Error;
use std::f64::consts::FRAC_PI_2;

use bristle::brush::BrushResult;
use bristle::simulation::{Pass, Sampling, SimulationError};
use bristle_report::drawing::Canvas;
use bristle_report::drawing::diagram::{Curve, Diagram, Look};
use bristle_report::drawing::scale::Axis;

use crate::cases::{Case, DEPTHS, FOLLOWED, OperatingPoint, Results, TURNING, VELOCITIES, at};
use crate::numbers::{Tilted, by_column, impulse_alone, lifts, sideways};
use crate::tables::tool_forces;

/// Where filaments are followed: intervals of the way of the clamp, and its ends in mm before and
/// after the lowest point.
const INTERVALS: usize = 160;
const WAY: [f64; 2] = [-50.0, 50.0];
/// Samples of a filament alone.
const SAMPLES: usize = 2000;

/// All figures, with the ends of their names.
///
/// # Errors
/// If a filament alone cannot be simulated.
pub fn all(results: &Results) -> Result<Vec<(&'static str, Canvas)>, Box<dyn Error>> {
    Ok(vec![
        (
            "slow",
            forces(
                results,
                "Force of the tool at 2 and 10 m/s",
                [VELOCITIES[0], VELOCITIES[1]],
            ),
        ),
        (
            "fast",
            forces(
                results,
                "Force of the tool at 20 and 30 m/s",
                [VELOCITIES[2], VELOCITIES[3]],
            ),
        ),
        ("columns", columns(results)),
        ("lifts", lifted(results)),
        ("way", way(results)?),
        ("buckling", buckling(results)?),
        ("turns", turns(results)),
    ])
}

fn forces(results: &Results, title: &str, velocities: [u32; 2]) -> Canvas {
    let curve = |velocity: u32, alone: usize, index: usize| {
        let points = DEPTHS.map(|depth| {
            let place = at(velocity, depth);
            (
                place.depth_mm(),
                tool_forces(place, results.row(velocity, depth))[alone],
            )
        });
        let name = format!("{velocity} m/s, {}", ["in the row", "alone"][alone]);
        Curve::new(name, Look::Joined, points).with_pen(index)
    };
    let [slow, fast] = velocities;
    Diagram {
        title: title.to_owned(),
        subtitle: "planar rows whose filaments touch each other, and the same filaments alone"
            .to_owned(),
        x: Axis::linear("a_e in mm"),
        y: Axis::from_zero("F_n,w in N"),
        curves: vec![
            curve(slow, 0, 0),
            curve(slow, 1, 1),
            curve(fast, 0, 2),
            curve(fast, 1, 3),
        ],
    }
    .draw()
}

/// Impulses over the columns relative to those of a filament alone.
fn columns(results: &Results) -> Canvas {
    let curve = |velocity: u32| {
        let row = results.row(velocity, 1000);
        let relative = by_column(row)
            .into_iter()
            .map(|impulse| impulse / impulse_alone(row));
        Curve::new(
            format!("{velocity} m/s"),
            Look::Line,
            (0..).map(f64::from).zip(relative),
        )
    };
    Diagram {
        title: "Impulse from column to column, a_e = 1 mm".to_owned(),
        subtitle: "relative to one filament alone; column 0 meets the workpiece first".to_owned(),
        x: Axis::linear("column"),
        y: Axis::from_zero("p_n over that of one filament alone"),
        curves: VELOCITIES.map(curve).into(),
    }
    .draw()
}

/// Impulses of neighbours along the normal over the columns.
fn lifted(results: &Results) -> Canvas {
    let curve = |place: OperatingPoint| {
        let row = results.of(Case::Row(place));
        let lifts = lifts(row).into_iter().map(|lift| lift / impulse_alone(row));
        let name = format!("{} m/s, {} mm", place.velocity, place.depth_mm());
        Curve::new(name, Look::Line, (0..).map(f64::from).zip(lifts))
    };
    Diagram {
        title: "Where neighbours lift filaments and where they press them down".to_owned(),
        subtitle:
            "impulse of both neighbours along the normal, over p_n alone; above zero they lift"
                .to_owned(),
        x: Axis::linear("column"),
        y: Axis::linear("impulse along the normal over p_n alone"),
        curves: [at(2, 1000), at(10, 1000), at(10, 3000), at(30, 1000)]
            .map(curve)
            .into(),
    }
    .draw()
}

/// The mean impulse of the filaments that count up to each place of their clamp's way, in mm and N
/// s.
fn followed(place: OperatingPoint, row: &BrushResult) -> Vec<(f64, f64)> {
    let settings = place.settings();
    let [from, to] = WAY;
    let width = (to - from) / INTERVALS as f64;
    let mut sums = vec![(0.0, 0); INTERVALS];
    for frame in &row.frames {
        for (filament, force) in row.filaments.iter().zip(&frame.contact_normal_force_n) {
            let interval = (millimetres(&settings, frame.tool_angle_rad - filament.root_angle_rad)
                - from)
                / width;
            let sum = (interval >= 0.0 && filament.is_counted)
                .then(|| sums.get_mut(interval as usize))
                .flatten();
            if let Some((sum, count)) = sum {
                *sum += f64::from(*force);
                *count += 1;
            }
        }
    }
    let time = 1e-3 * width / place.velocity();
    let ends = sums.iter().scan(0.0, |impulse, (sum, count)| {
        *impulse += time * sum / f64::from((*count).max(1));
        Some(*impulse)
    });
    (1..)
        .map(|end| from + width * f64::from(end))
        .zip(ends)
        .collect()
}

/// How far the tip of an undeformed filament is beyond the lowest point of its circle, in mm along
/// it.
fn millimetres(settings: &bristle::model::settings::Settings, angle: f64) -> f64 {
    1e3 * settings.tool_radius_m() * (angle + FRAC_PI_2)
}

fn way(results: &Results) -> Result<Canvas, SimulationError> {
    let mut curves = Vec::new();
    for (index, place) in FOLLOWED.into_iter().enumerate() {
        let row = results.of(Case::Row(place));
        let settings = place.settings();
        let alone = Pass::new(&settings).simulate(Sampling {
            samples: SAMPLES,
            ..Sampling::default()
        })?;
        let scale = impulse_alone(row);
        let scaled = |points: Vec<(f64, f64)>| points.into_iter().map(move |(x, y)| (x, y / scale));
        let single = alone.history.iter();
        let single = single.map(|sample| {
            (
                millimetres(&settings, sample.base_angle_rad),
                sample.contact_normal_impulse_n_s,
            )
        });
        let name = |what: &str| format!("{} m/s, {} mm, {what}", place.velocity, place.depth_mm());
        curves.push(
            Curve::new(name("in the row"), Look::Line, scaled(followed(place, row)))
                .with_pen(2 * index),
        );
        curves.push(
            Curve::new(name("alone"), Look::Line, scaled(single.collect())).with_pen(2 * index + 1),
        );
    }
    let diagram = Diagram {
        title: "Impulse so far along the way of a filament".to_owned(),
        subtitle: "relative to p_n of one filament alone".to_owned(),
        x: Axis::linear("way of the undeformed tip from the lowest point in mm"),
        y: Axis::from_zero("impulse so far over p_n alone"),
        curves,
    };
    Ok(diagram.draw())
}

/// The impulse of each filament over how far its tip goes sideways.
fn buckling(results: &Results) -> Result<Canvas, SimulationError> {
    let mut curves = Vec::new();
    for (index, place) in [at(2, 1000), at(10, 3000)].into_iter().enumerate() {
        let brush = results.space(place);
        let points = sideways(brush)
            .into_iter()
            .zip(&brush.filaments)
            .filter(|(_, filament)| filament.is_counted);
        let impulse =
            |filament: &bristle::brush::FilamentResult| filament.metrics.contact_normal_impulse_n_s;
        let relative =
            points.map(|(way, filament)| (1e3 * way, impulse(filament) / impulse_alone(brush)));
        let name = |what: &str| format!("{} m/s, {} mm, {what}", place.velocity, place.depth_mm());
        curves.push(Curve::new(name("in the brush"), Look::Markers, relative).with_pen(index));
        let tilted = Tilted::at(place)?;
        let point = (1e3 * tilted.sideways, tilted.impulse / impulse_alone(brush));
        curves.push(Curve::new(name("alone, tilted"), Look::Markers, [point]).with_pen(index + 2));
    }
    let diagram = Diagram {
        title: "Filaments of a brush in space that leave their planes".to_owned(),
        subtitle: "clamps tilted by 1 mrad (standard deviation); impulses over that of a filament alone without tilt"
            .to_owned(),
        x: Axis::from_zero("largest |z| of the tip from its root in mm"),
        y: Axis::from_zero("p_n over that of one filament alone"),
        curves,
    };
    Ok(diagram.draw())
}

/// Impulses over the columns in the first and in the last turn.
fn turns(results: &Results) -> Canvas {
    let place = TURNING[1];
    let [single, turned] = [Case::Row(place), Case::Turning(place)].map(|case| results.of(case));
    let points = |values: Vec<f64>| {
        (0..)
            .map(f64::from)
            .zip(values.into_iter().map(|value| 1e3 * value))
    };
    let level = |impulse: f64| {
        vec![
            (0.0, 1e3 * impulse),
            (turned.columns as f64 - 1.0, 1e3 * impulse),
        ]
    };
    Diagram {
        title: format!(
            "Turn after turn at {} m/s, a_e = {} mm",
            place.velocity,
            place.depth_mm()
        ),
        subtitle: "impulses of the filaments of a row, and of one filament alone".to_owned(),
        x: Axis::linear("column; 0 meets the workpiece first"),
        y: Axis::from_zero("p_n in mN s"),
        curves: vec![
            Curve::new(
                "alone, first turn",
                Look::Reference,
                level(impulse_alone(single)),
            ),
            Curve::new(
                "alone, third turn",
                Look::Reference,
                level(impulse_alone(turned)),
            ),
            Curve::new("row, first turn", Look::Line, points(by_column(single))),
            Curve::new("row, third turn", Look::Line, points(by_column(turned))),
        ],
    }
    .draw()
}
