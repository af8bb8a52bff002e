//! Draws the picture of the README: one contact, and the contact time ratio of the paper's 120 contacts.
//!
//! ```text
//! cargo run --release -p bristle-report --example figure                # docs/contact.svg
//! cargo run --release -p bristle-report --example figure -- other.svg
//! ```

use bristle::model::metrics::NominalContact;
use bristle::model::settings::Settings;
use bristle::simulation::Pass;
use bristle::tool::ClampMotion;
use bristle_report::drawing::{
    Area, BLUE, FAINT, GREY, INK, Result, VERMILION, axis, centred, chart, fine, labelled, pixels, right_of, stroke,
    svg, text, whole,
};
use bristle_study::document::Document;
use bristle_study::study::{CaseResult, Study, run_study};
use plotters::element::DashedPathElement;
use plotters::prelude::*;

/// Size of the picture in pixels, and where its left panel ends.
const SIZE: (i32, i32) = (1000, 400);
const SPLIT: i32 = 500;

/// The contact on the left.
const VELOCITY_M_S: f64 = 10.0;
const DEPTH_M: f64 = 3.0e-3;
/// Time between two shapes of the filament in s.
const INTERVAL_S: f64 = 0.5e-3;
/// Every so many shapes a time is written at the root.
const LABELLED: usize = 4;

const BODY: RGBColor = RGBColor(236, 238, 241);
const WORKPIECE: RGBColor = RGBColor(222, 218, 208);
const FILAMENT: RGBColor = BLUE;
const TIP: RGBColor = VERMILION;

fn main() -> Result<()> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "docs/contact.svg".into());
    let document = Document::parse(include_str!("../../../examples/zirconia.toml"), "examples/zirconia.toml")?;
    let mut settings = document.settings()?;
    settings.process.brushing_velocity_m_s = VELOCITY_M_S;
    settings.process.penetration_depth_m = DEPTH_M;
    let contact = Contact::simulate(&settings)?;
    let study = document.study()?;
    let results = run_study(&study, None, || {})?;

    let picture = svg(SIZE, |root| {
        let (left, right) = root.split_horizontally(fine(SPLIT));
        draw_contact(&left, &contact)?;
        draw_map(&right, &study, &results)
    })?;
    std::fs::write(&path, &picture)?;
    eprintln!("wrote {path}");
    Ok(())
}

/// A filament on its way over the workpiece: `x` along the surface and `y` above it, in mm.
struct Contact {
    /// Time since nominal entry in ms, and the nodes from root to tip.
    shapes: Vec<(f64, Vec<(f64, f64)>)>,
    tip_path: Vec<(f64, f64)>,
    axis_height: f64,
    body_radius: f64,
    tool_radius: f64,
}

impl Contact {
    fn simulate(settings: &Settings) -> Result<Self> {
        let mut settings = settings.clone();
        settings.process.tail_angle_rad = 0.05;
        let pass = Pass::new(&settings);
        let motion = pass.tool();
        let radius = NominalContact::of(&settings).tool_radius;
        let n = settings.filament.segments;
        let mut system = pass.system(false);
        let start = pass.start(&mut system);
        let [entry, ..] = pass.times();
        let axis_height = radius - settings.process.penetration_depth_m;
        let millimetres = |[x, y, _]: [f64; 3]| (1e3 * x, 1e3 * (y + axis_height));
        let (mut shapes, mut tip_path) = (Vec::new(), Vec::new());
        pass.integrate(&mut system, start, |step| {
            tip_path.push(millimetres(step.end_nodes[n - 1].value));
            while let time = entry + shapes.len() as f64 * INTERVAL_S
                && time <= step.end.time
            {
                let s = (time - step.start.time) / step.length();
                let root = motion.at(time).position;
                let nodes = (0..n).map(|node| step.node(node, s).0);
                let shape = std::iter::once(root).chain(nodes).map(millimetres).collect();
                shapes.push((1e3 * (time - entry), shape));
            }
        })?;
        Ok(Self {
            shapes,
            tip_path,
            axis_height: 1e3 * axis_height,
            body_radius: 1e3 * motion.tool.body_radius,
            tool_radius: 1e3 * radius,
        })
    }

    /// The lowest part of a circle about the tool's axis, as wide as `|x| ≤ half` (mm).
    fn circle(&self, radius: f64, half: f64) -> Vec<(f64, f64)> {
        let points = (-200..=200).map(|i| f64::from(i) / 200.0 * half);
        points.map(|x| (x, self.axis_height - (radius * radius - x * x).sqrt())).collect()
    }
}

fn draw_contact(area: &Area<'_>, contact: &Contact) -> Result<()> {
    let margins @ [left, right, top, bottom] = [60, 20, 40, 46];
    let (width, height) = (SPLIT - left - right, SIZE.1 - top - bottom);
    let half = 44.0;
    let scale = 2.0 * half / f64::from(width);
    let (x, y) = (-half..half, -9.0..f64::from(height) * scale - 9.0);
    let title = format!("A filament every 0.5 ms at v_b = {VELOCITY_M_S} m/s, a_e = {} mm", 1e3 * DEPTH_M);
    let mut chart = chart(area, &title, margins, x.clone(), y.clone())?;

    let workpiece = Rectangle::new([(-half, y.start), (half, 0.0)], WORKPIECE.filled());
    chart.draw_series([workpiece])?;
    let rim = contact.circle(contact.body_radius, half);
    let mut body = rim.clone();
    body.extend([(half, y.end), (-half, y.end)]);
    chart.draw_series([Polygon::new(body, BODY.filled())])?;
    chart.draw_series([PathElement::new(rim, stroke(FAINT, 10))])?;
    let nominal = contact.circle(contact.tool_radius, half);
    chart.draw_series([DashedPathElement::new(nominal, fine(5), fine(4), stroke(FAINT, 10))])?;
    chart.draw_series([PathElement::new([(-half, 0.0), (half, 0.0)], stroke(INK, 10))])?;

    for (_, shape) in &contact.shapes {
        chart.draw_series([PathElement::new(shape.clone(), stroke(FILAMENT, 13))])?;
    }
    chart.draw_series([PathElement::new(contact.tip_path.clone(), stroke(TIP, 13))])?;
    let tips = contact.shapes.iter().filter_map(|(_, shape)| shape.last());
    chart.draw_series(tips.map(|&tip| Circle::new(tip, fine(2), TIP.filled())))?;

    let times = contact.shapes.iter().step_by(LABELLED).map(|(time, shape)| {
        let (x, y) = shape[0];
        Text::new(format!("{time} ms"), (x, y + 2.2), centred(text(11, INK)))
    });
    chart.draw_series(times)?;
    let label = |label, at, color| Text::new(label, at, right_of(text(12, color)));
    chart.draw_series([
        label("brush body", (-half + 2.0, y.end - 3.0), INK),
        label("workpiece", (-half + 2.0, -5.5), INK),
        label("filament", (-half + 2.0, 26.0), FILAMENT),
    ])?;
    chart.draw_series([
        Text::new("tip", (half - 4.0, 5.0), centred(text(12, TIP))),
        Text::new("tip of the undeformed tool", (0.0, -5.5), centred(text(12, GREY))),
    ])?;
    // The way that the tool turns.
    let (from, to, above) = (-half + 22.0, -half + 36.0, y.end - 3.0);
    chart.draw_series([
        PathElement::new([(from, above), (to, above)], stroke(INK, 12)),
        PathElement::new([(to - 2.0, above + 1.0), (to, above), (to - 2.0, above - 1.0)], stroke(INK, 12)),
    ])?;

    let pixel = pixels(area, &chart);
    let ticks = labelled((-4..=4).map(|i| f64::from(i) * 10.0), whole);
    axis(area, ("along the surface in mm", (left + width / 2, SIZE.1 - 12)), &ticks, false, |x| pixel((x, y.start)))?;
    let heights = labelled((0..=5).map(|i| f64::from(i) * 10.0), whole);
    axis(area, ("above the surface in mm", (16, top + height / 2)), &heights, true, |y| pixel((-half, y)))?;
    Ok(())
}

fn draw_map(area: &Area<'_>, study: &Study, results: &[CaseResult]) -> Result<()> {
    let margins @ [left, right, top, bottom] = [60, 84, 40, 46];
    let (width, height) = (SIZE.0 - SPLIT - left - right, SIZE.1 - top - bottom);
    let (dv, da) = (2.5, 0.5);
    let (x, y) = (1.25..31.25, 0.25..5.25);
    let mut chart = chart(area, "Contact time ratio ε_tc: from striking to sweeping", margins, x.clone(), y.clone())?;
    let cell = |v: f64, a: f64| [(v - dv / 2.0, a - da / 2.0), (v + dv / 2.0, a + da / 2.0)];
    // A cell reaches a little below the one that is drawn after it, so that no seam shows.
    let overlap =
        |[low, (right, above)]: [(f64, f64); 2]| [low, ((right + 0.05).min(x.end), (above + 0.01).min(y.end))];
    for (case, result) in results.iter().enumerate() {
        let process = study.settings(case).process;
        let ratio = result.as_ref().map_err(Clone::clone)?.metrics.contact_time_ratio;
        let cell = cell(process.brushing_velocity_m_s, 1e3 * process.penetration_depth_m);
        chart.draw_series([Rectangle::new(overlap(cell), color_of(ratio).filled())])?;
    }
    // The contact on the left.
    let [(left_v, low), (right_v, high)] = cell(VELOCITY_M_S, 1e3 * DEPTH_M);
    let frame = [(left_v, low), (right_v, low), (right_v, high), (left_v, high), (left_v, low), (right_v, low)];
    chart.draw_series([PathElement::new(frame, stroke(WHITE, 20))])?;

    let pixel = pixels(area, &chart);
    let velocities = labelled((1..=6).map(|i| 5.0 * f64::from(i)), whole);
    let depths = labelled((1..=5).map(f64::from), whole);
    let name = "brushing velocity v_b in m/s";
    axis(area, (name, (left + width / 2, SIZE.1 - 12)), &velocities, false, |x| pixel((x, y.start)))?;
    axis(area, ("penetration depth a_e in mm", (20, top + height / 2)), &depths, true, |y| pixel((x.start, y)))?;

    // The colour bar.
    let (bar, bar_width) = (left + width + 22, 14);
    let level = |ratio: f64| fine(top + height) - (ratio * f64::from(fine(height))).round() as i32;
    let steps = 100;
    for step in 0..steps {
        let [low, middle] = [0.0, 0.5].map(|part| (f64::from(step) + part) / f64::from(steps));
        let corners = [(fine(bar), level(1.0)), (fine(bar + bar_width), level(low))];
        area.draw(&Rectangle::new(corners, color_of(middle).filled()))?;
    }
    for i in 0..=5 {
        let ratio = f64::from(i) / 5.0;
        let edge = fine(bar + bar_width);
        area.draw(&PathElement::new([(edge, level(ratio)), (edge + fine(4), level(ratio))], stroke(INK, 10)))?;
        let style = right_of(text(11, INK));
        area.draw_text(&format!("{ratio:.1}"), &style, (edge + fine(7), level(ratio)))?;
    }
    Ok(())
}

/// Viridis: even steps of brightness, readable without colour vision.
fn color_of(ratio: f64) -> RGBColor {
    ViridisRGB.get_color(ratio)
}
