//! Figures of one contact: its history, its turns, and work along the profile.

use bristle::model::settings::{MAX_TURNS, Settings};
use bristle::simulation::{Pass, ProfileCell, Sample, Shape};
use bristle::tool::places;

use super::picture::{Picture, contact_title, of_process, with_brush};
use super::profile::{self, PROFILE_DRAWN, PROFILE_UNROLLED};
use crate::report::drawing::diagram::{Curve, Diagram, Look, draw_axes, left_of};
use crate::report::drawing::format::Format;
use crate::report::drawing::heading::Heading;
use crate::report::drawing::pens::pen;
use crate::report::drawing::scale::{Axis, AxisScale};
use crate::report::drawing::{
    BLUE, Canvas, CanvasPoint, Color, GREY, INK, Pen, VERMILION, fine, stroke, text,
};
use crate::report::view::{height, is_all_round, is_upright, root, sampled_pass};

/// Name of the figure of one contact over time.
const HISTORY_FIGURE: &str = "history";

/// Draws the figures of one contact. `history` has force and tip deflection over time. `turns` has
/// the `impulses` of its turns in N s, if there are several. `profile_unrolled` has impulse and
/// friction work along the profile of the workpiece. `profile_drawn` has the filament in `shapes`
/// ([`drawn_shapes`](super::drawn_shapes)) on the workpiece, with the work. Both need a contact.
#[must_use]
pub fn contact_figures(
    settings: &Settings,
    history: &[Sample],
    impulses: &[f64],
    profile: &[ProfileCell],
    shapes: &[Shape],
    format: &Format,
) -> Vec<Picture> {
    let drawn = [
        turns_figure(settings, impulses, format),
        profile::unrolled(settings, profile, format),
        profile::drawn(settings, profile, shapes, format),
    ];
    std::iter::once(history_figure(settings, history, format))
        .chain(drawn.into_iter().flatten())
        .collect()
}

/// Returns `true` if [`contact_figures`] can make a figure of this name.
#[must_use]
pub fn is_of_contact(name: &str) -> bool {
    [
        HISTORY_FIGURE,
        TURNS_FIGURE,
        PROFILE_UNROLLED,
        PROFILE_DRAWN,
    ]
    .contains(&name)
}

/// Width of the figure of a history; height of its panels on a screen, of more than two panels, and
/// at least, in pixels.
const HISTORY: i32 = 760;
const PANEL: i32 = 190;
const LOW_PANEL: i32 = 130;
const MIN_PANEL: i32 = 120;
/// Pixels between the heading and the panels, between them, and below them.
const ABOVE: i32 = 10;
const BETWEEN: i32 = 26;
const BELOW: i32 = 54;
/// Background of times in contact.
const CONTACT: Color = Color(225, 232, 240);

/// A quantity over time.
struct Panel {
    label: &'static str,
    color: Color,
    points: Vec<(f64, f64)>,
    /// `true` if its axis begins at zero.
    from_zero: bool,
}

/// Returns force and tip deflection over the `times` of a history (ms). Tools that are not upright
/// radial ones also have the heights of tip and root.
fn panels(settings: &Settings, pass: &Pass, history: &[Sample], times: &[f64]) -> Vec<Panel> {
    let panel = |label, color, from_zero, value: &dyn Fn(&Sample) -> f64| Panel {
        label,
        color,
        points: times
            .iter()
            .copied()
            .zip(history.iter().map(value))
            .collect(),
        from_zero,
    };
    let mut panels = vec![
        panel("F_n in N", VERMILION, true, &|sample| {
            sample.contact_normal_force_n
        }),
        panel("s_n in mm", BLUE, true, &|sample| {
            1e3 * sample.tip_deflection_m
        }),
    ];
    if !is_upright(settings) {
        let above = |point, sample: &Sample| 1e3 * height(settings, pass, point, sample.time_s);
        let tip = |sample: &Sample| above([sample.tip_x_m, sample.tip_y_m, sample.tip_z_m], sample);
        let root = |sample: &Sample| above(root(pass, sample.base_angle_rad), sample);
        panels.extend([
            panel("tip in mm", INK, false, &tip),
            panel("root in mm", INK, false, &root),
        ]);
    }
    panels
}

/// Draws one contact over time, with force and tip deflection (Fig. 3 of the paper).
pub(super) fn history_figure(settings: &Settings, history: &[Sample], format: &Format) -> Picture {
    let milliseconds = |time: f64| 1e3 * time;
    let pass = sampled_pass(settings);
    let all_round = is_all_round(&pass);
    let touches = !pass.touches().is_empty();
    let [entry, exit] = pass.nominal_times();
    let last_time = history.last().map_or(0.0, |sample| sample.time_s);
    let begun = (0..MAX_TURNS)
        .map(|turn| turn as f64 * pass.turn_time())
        .take_while(|&begun| begun < last_time);
    let nominal: Vec<(f64, &str)> = begun
        .filter(|_| touches || is_upright(settings))
        // One turn ends where the next begins if the filament touches all round.
        .flat_map(|begun| {
            [(begun + entry, "entry"), (begun + exit, "exit")]
                .into_iter()
                .take(if all_round { 1 } else { 2 })
        })
        .map(|(time, name)| (milliseconds(time), name))
        .collect();
    // Those of several turns would hide each other.
    let are_named = nominal.len() == 2 && !all_round;
    let times: Vec<f64> = history
        .iter()
        .map(|sample| milliseconds(sample.time_s))
        .collect();
    let x = AxisScale::exact(Axis::linear("time t in ms"), times.iter().copied());
    let panels = panels(settings, &pass, history, &times);
    let forces = panels[0].points.clone();
    let panels: Vec<(AxisScale, Panel)> = panels
        .into_iter()
        .map(|panel| {
            let axis = if panel.from_zero {
                Axis::from_zero
            } else {
                Axis::linear
            };
            (
                AxisScale::new(axis(panel.label), panel.points.iter().map(|(_, y)| *y)),
                panel,
            )
        })
        .collect();
    let left = panels
        .iter()
        .map(|(scale, ..)| left_of(format, scale))
        .max()
        .unwrap_or(0);
    let page = format.width(HISTORY);
    let right = page - 24;
    let title = contact_title("One contact", settings);
    let mut subtitle = match all_round {
        false => "shaded: in contact; dashed: nominal entry and exit of the undeformed filament",
        true => "shaded: in contact; dashed: the beginnings of the turns, before which the workpiece comes up",
    }
    .to_owned();
    if panels.len() > 2 {
        subtitle.push_str("; tip and root: their heights above the workpiece");
    }
    if places(settings).len() > 1 {
        subtitle.push_str("; all of the filament in the middle of the trim");
    }
    let subtitle = with_brush(&subtitle, settings);
    let heading = Heading::new(format, &title, &subtitle, [left, page]);
    let panel = if panels.len() > 2 { LOW_PANEL } else { PANEL };
    let panel = format.height(panel, HISTORY, MIN_PANEL);
    let first = heading.height() + ABOVE;
    let count = panels.len() as i32;
    let mut canvas = Canvas::on(
        format,
        (page, first + count * panel + (count - 1) * BETWEEN + BELOW),
    );
    heading.draw(&mut canvas);
    for (row, (scale, Panel { points, color, .. })) in (0..).zip(&panels) {
        let top = first + row * (panel + BETWEEN);
        let frame = [left, top, right, top + panel];
        draw_contact(&mut canvas, &x, &forces, frame);
        let last = row + 1 == count;
        let mut x = x.clone();
        if !last {
            x.axis.label = "".into();
            x.ticks.iter_mut().for_each(|(_, label)| label.clear());
        }
        draw_axes(&mut canvas, [&x, scale], frame);
        for &(time, name) in &nominal {
            if (0.0..=1.0).contains(&x.part(time)) {
                let at = x.place(time, left, right);
                let line = Pen {
                    color: GREY,
                    tenths: 10,
                    dash: (5, 4),
                    ..pen(0)
                };
                line.line(&mut canvas, &[(at, fine(top)), (at, fine(top + panel))]);
                if row == 0 && are_named {
                    canvas.text(name, text(11, GREY).centred(), (at, fine(top - 8)));
                }
            }
        }
        let places = points
            .iter()
            .map(|&(time, y)| (x.place(time, left, right), scale.place(y, top + panel, top)));
        let mut line: Vec<CanvasPoint> = places.collect();
        line.dedup();
        canvas.line(line, stroke(*color, 14));
    }
    Picture {
        name: HISTORY_FIGURE.to_owned(),
        canvas,
    }
}

/// Name of the figure of the turns of one contact.
const TURNS_FIGURE: &str = "turns";

/// Draws the contact normal impulses of all turns of one contact in N s; the figure is named
/// [`TURNS_FIGURE`]. `None` for a single turn.
pub(super) fn turns_figure(
    settings: &Settings,
    impulses: &[f64],
    format: &Format,
) -> Option<Picture> {
    if impulses.len() < 2 {
        return None;
    }
    let points = (1..)
        .zip(impulses)
        .map(|(turn, impulse)| (f64::from(turn), 1e3 * impulse));
    let diagram = Diagram::new(
        "Contact normal impulse turn by turn",
        with_brush(&of_process(settings), settings),
        [Axis::count("turn"), Axis::amount("p_n in mN s")],
        vec![Curve::new("", Look::Joined, points)],
    );
    Some(Picture::of(TURNS_FIGURE, format, &diagram))
}

/// Shades the times in contact.
fn draw_contact(
    canvas: &mut Canvas,
    x: &AxisScale,
    forces: &[(f64, f64)],
    [left, top, right, bottom]: [i32; 4],
) {
    let mut marked: Vec<(i32, i32)> = Vec::new();
    for pair in forces
        .windows(2)
        .filter(|pair| pair.iter().any(|(_, force)| *force > 0.0))
    {
        let [from, to] = [pair[0].0, pair[1].0].map(|time| x.place(time, left, right));
        match marked.last_mut() {
            // Gaps below half a pixel are shaded too.
            Some((_, end)) if from - *end <= fine(1) / 2 => *end = to,
            _ => marked.push((from, to)),
        }
    }
    for (from, to) in marked {
        canvas.rectangle([(from, fine(top)), (to, fine(bottom))], CONTACT);
    }
}
