//! Draws the picture of the README: one contact, and the contact time ratio of the paper's 120
//! contacts.
//!
//! ```text
//! cargo run --release -p bristle-report --example figure                # docs/contact.svg
//! cargo run --release -p bristle-report --example figure -- other.svg
//! ```

use std::error::Error;
use std::ops::Range;

use bristle::model::settings::Settings;
use bristle::simulation::Pass;
use bristle::tool::ClampMotion;
use bristle_grid::{CaseResult, Study, run_study};
use bristle_input::document::Document;
use bristle_report::drawing::{
    BLUE, Canvas, Color, FAINT, GREY, INK, Point, VERMILION, WHITE, axis, fine, labelled, stroke,
    text, viridis, whole,
};

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

const BODY: Color = Color(236, 238, 241);
const WORKPIECE: Color = Color(222, 218, 208);
const FILAMENT: Color = BLUE;
const TIP: Color = VERMILION;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

fn main() -> Result<()> {
    let path = std::env::args()
        .nth(1)
        .unwrap_or_else(|| "docs/contact.svg".into());
    let document = Document::parse(
        include_str!("../../../examples/zirconia.toml"),
        "examples/zirconia.toml",
    )?;
    let mut settings = document.settings()?;
    settings.process.brushing_velocity_m_s = VELOCITY_M_S;
    settings.process.penetration_depth_m = DEPTH_M;
    let contact = Contact::simulate(&settings)?;
    let study = document.study()?;
    let results = run_study(&study, None, || {})?;

    let mut canvas = Canvas::new(SIZE);
    draw_contact(&mut canvas, &contact);
    draw_map(&mut canvas, &study, &results)?;
    std::fs::write(&path, canvas.svg())?;
    eprintln!("wrote {path}");
    Ok(())
}

/// A diagram with equal distances for equal differences.
struct Chart {
    /// The first and the last coordinate of the canvas across, then down.
    frame: [i32; 4],
    x: Range<f64>,
    y: Range<f64>,
}

impl Chart {
    /// A diagram between `left` and `right` (pixels) with free room around it, and its title above
    /// it.
    fn new(
        canvas: &mut Canvas,
        title: &str,
        [left, right]: [i32; 2],
        [top, bottom]: [i32; 2],
        x: Range<f64>,
        y: Range<f64>,
    ) -> Self {
        canvas.text(title, text(14, INK), (fine(left), fine(14)));
        Self {
            frame: [fine(left), fine(right) - 1, fine(top), fine(bottom) - 1],
            x,
            y,
        }
    }

    fn at(&self, (x, y): (f64, f64)) -> Point {
        let [left, right, top, bottom] = self.frame;
        let part =
            |value: f64, range: &Range<f64>| (value - range.start) / (range.end - range.start);
        // So that rounding errors do not move what lies on a border.
        let across = (part(x, &self.x) * f64::from(right - left) + 1e-3).floor();
        let up = (part(y, &self.y) * f64::from(bottom - top) + 1e-3).floor();
        (left + across as i32, bottom - up as i32)
    }

    fn line(&self, points: &[(f64, f64)]) -> Vec<Point> {
        points.iter().map(|&point| self.at(point)).collect()
    }
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
        let radius = settings.tool_radius_m();
        let n = settings.filament.segments;
        let mut system = pass.system(false);
        let start = pass.start(&mut system);
        let [entry, _] = pass.nominal_times();
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
                let shape = std::iter::once(root)
                    .chain(nodes)
                    .map(millimetres)
                    .collect();
                shapes.push((1e3 * (time - entry), shape));
            }
        })?;
        Ok(Self {
            shapes,
            tip_path,
            axis_height: 1e3 * axis_height,
            body_radius: 1e3 * motion.tool.root_radius,
            tool_radius: 1e3 * radius,
        })
    }

    /// The lowest part of a circle about the tool's axis, as wide as `|x| ≤ half` (mm).
    fn circle(&self, radius: f64, half: f64) -> Vec<(f64, f64)> {
        let points = (-200..=200).map(|i| f64::from(i) / 200.0 * half);
        points
            .map(|x| (x, self.axis_height - (radius * radius - x * x).sqrt()))
            .collect()
    }
}

fn draw_contact(canvas: &mut Canvas, contact: &Contact) {
    let [left, right, top, bottom] = [60, SPLIT - 20, 40, SIZE.1 - 46];
    let half = 44.0;
    let scale = 2.0 * half / f64::from(right - left);
    let (x, y) = (-half..half, -9.0..f64::from(bottom - top) * scale - 9.0);
    let title = format!(
        "A filament every 0.5 ms at v_b = {VELOCITY_M_S} m/s, a_e = {} mm",
        1e3 * DEPTH_M
    );
    let chart = Chart::new(canvas, &title, [left, right], [top, bottom], x, y.clone());

    canvas.rectangle(
        [(-half, y.start), (half, 0.0)].map(|corner| chart.at(corner)),
        WORKPIECE,
    );
    let rim = contact.circle(contact.body_radius, half);
    let mut body = rim.clone();
    body.extend([(half, y.end), (-half, y.end)]);
    canvas.polygon(chart.line(&body), BODY);
    canvas.line(chart.line(&rim), stroke(FAINT, 10));
    let nominal = chart.line(&contact.circle(contact.tool_radius, half));
    canvas.dashed(&nominal, [5, 4].map(fine), stroke(FAINT, 10));
    canvas.line(chart.line(&[(-half, 0.0), (half, 0.0)]), stroke(INK, 10));

    for (_, shape) in &contact.shapes {
        canvas.line(chart.line(shape), stroke(FILAMENT, 13));
    }
    canvas.line(chart.line(&contact.tip_path), stroke(TIP, 13));
    for &tip in contact.shapes.iter().filter_map(|(_, shape)| shape.last()) {
        canvas.circle(chart.at(tip), fine(2), TIP);
    }

    for (time, shape) in contact.shapes.iter().step_by(LABELLED) {
        let (x, y) = shape[0];
        canvas.text(
            &format!("{time} ms"),
            text(11, INK).centred(),
            chart.at((x, y + 2.2)),
        );
    }
    for (label, at, color) in [
        ("brush body", (-half + 2.0, y.end - 3.0), INK),
        ("workpiece", (-half + 2.0, -5.5), INK),
        ("filament", (-half + 2.0, 26.0), FILAMENT),
    ] {
        canvas.text(label, text(12, color).right(), chart.at(at));
    }
    canvas.text("tip", text(12, TIP).centred(), chart.at((half - 4.0, 5.0)));
    canvas.text(
        "tip of the undeformed tool",
        text(12, GREY).centred(),
        chart.at((0.0, -5.5)),
    );
    // The direction in which the tool turns.
    let (from, to, above) = (-half + 22.0, -half + 36.0, y.end - 3.0);
    canvas.line(chart.line(&[(from, above), (to, above)]), stroke(INK, 12));
    canvas.line(
        chart.line(&[
            (to - 2.0, above + 1.0),
            (to, above),
            (to - 2.0, above - 1.0),
        ]),
        stroke(INK, 12),
    );

    let ticks = labelled((-4..=4).map(|i| f64::from(i) * 10.0), whole);
    let name = ("along the surface in mm", ((left + right) / 2, SIZE.1 - 12));
    axis(canvas, name, &ticks, false, |x| chart.at((x, y.start)));
    let heights = labelled((0..=5).map(|i| f64::from(i) * 10.0), whole);
    let name = ("above the surface in mm", (16, (top + bottom) / 2));
    axis(canvas, name, &heights, true, |y| chart.at((-half, y)));
}

fn draw_map(canvas: &mut Canvas, study: &Study, results: &[CaseResult]) -> Result<()> {
    let [left, right, top, bottom] = [SPLIT + 60, SIZE.0 - 84, 40, SIZE.1 - 46];
    let (dv, da) = (2.5, 0.5);
    let (x, y) = (1.25..31.25, 0.25..5.25);
    let title = "Contact time ratio ε_tc: from striking to sweeping";
    let chart = Chart::new(
        canvas,
        title,
        [left, right],
        [top, bottom],
        x.clone(),
        y.clone(),
    );
    let cell = |v: f64, a: f64| [(v - dv / 2.0, a - da / 2.0), (v + dv / 2.0, a + da / 2.0)];
    // A cell extends slightly below the one that is drawn after it, so that no seam shows.
    let overlap = |[low, (right, above)]: [(f64, f64); 2]| {
        [low, ((right + 0.05).min(x.end), (above + 0.01).min(y.end))]
    };
    for (case, result) in results.iter().enumerate() {
        let process = study.settings(case).process;
        let ratio = result
            .as_ref()
            .map_err(Clone::clone)?
            .metrics
            .contact_time_ratio;
        let cell = cell(
            process.brushing_velocity_m_s,
            1e3 * process.penetration_depth_m,
        );
        canvas.rectangle(overlap(cell).map(|corner| chart.at(corner)), viridis(ratio));
    }
    // The contact on the left.
    let [(left_v, low), (right_v, high)] = cell(VELOCITY_M_S, 1e3 * DEPTH_M);
    let frame = [
        (left_v, low),
        (right_v, low),
        (right_v, high),
        (left_v, high),
        (left_v, low),
        (right_v, low),
    ];
    canvas.line(chart.line(&frame), stroke(WHITE, 20));

    let velocities = labelled((1..=6).map(|i| 5.0 * f64::from(i)), whole);
    let depths = labelled((1..=5).map(f64::from), whole);
    let name = (
        "brushing velocity v_b in m/s",
        ((left + right) / 2, SIZE.1 - 12),
    );
    axis(canvas, name, &velocities, false, |v| chart.at((v, y.start)));
    let name = (
        "penetration depth a_e in mm",
        (SPLIT + 20, (top + bottom) / 2),
    );
    axis(canvas, name, &depths, true, |a| chart.at((x.start, a)));

    // The colour bar.
    let (bar, bar_width) = (right + 22, 14);
    let level = |ratio: f64| fine(bottom) - (ratio * f64::from(fine(bottom - top))).round() as i32;
    let steps = 100;
    for step in 0..steps {
        let [low, middle] = [0.0, 0.5].map(|part| (f64::from(step) + part) / f64::from(steps));
        let corners = [(fine(bar), level(1.0)), (fine(bar + bar_width), level(low))];
        canvas.rectangle(corners, viridis(middle));
    }
    for i in 0..=5 {
        let ratio = f64::from(i) / 5.0;
        let edge = fine(bar + bar_width);
        canvas.line(
            [(edge, level(ratio)), (edge + fine(4), level(ratio))],
            stroke(INK, 10),
        );
        canvas.text(
            &format!("{ratio:.1}"),
            text(11, INK).right(),
            (edge + fine(7), level(ratio)),
        );
    }
    Ok(())
}
