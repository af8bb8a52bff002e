//! What the paper found, on its grid.

use bristle::metrics::Metrics;
use bristle::parameters::Parameter;
use bristle::study::{Axis as StudyAxis, DEPTH, Study, VELOCITY, run_study};

use super::case::{Axis, Case, Check, Curve, Figure, Look};
use super::chains::paper_study;
use super::{Extent, Failure, Group, sources};

/// The group.
pub const GROUP: Group = Group {
    title: "The paper",
    purpose: "The findings of Uhlmann and Hoyer (2021), as docs/MODEL.md sums them up, each with numbers, on the grid of 120 \
        passes at n = 25 with the defaults that MODEL gives for what the paper leaves open.",
    cases: &[deflection, contact_time, tier, impulse, tool_force, segments, magnitude],
};

/// The metrics of a study over depth and velocity.
struct Grid {
    velocities: Vec<f64>,
    depths: Vec<f64>,
    /// By depth, then by velocity.
    metrics: Vec<Vec<Metrics>>,
}

impl Grid {
    /// That of the paper, with so many segments.
    fn new(segments: f64) -> Result<Self, Failure> {
        let unusable = |error: &dyn std::fmt::Display| Failure::Reference(error.to_string());
        let paper = paper_study()?;
        let parameter = Parameter::find("filament.segments").ok_or_else(|| unusable(&"no such setting"))?;
        let mut axes = vec![StudyAxis::list(parameter, vec![segments]).map_err(|error| unusable(&error))?];
        axes.extend(paper.axes().iter().cloned());
        let study = Study::new(paper.settings(0), axes).map_err(|error| unusable(&error))?;
        let values = |path: &str| {
            let axis = study.axes().iter().find(|axis| axis.parameter().path == path);
            axis.map(|axis| axis.values().to_vec()).unwrap_or_default()
        };
        let (velocities, depths) = (values(VELOCITY), values(DEPTH));
        let results = run_study(&study, None, || ()).map_err(|error| unusable(&error))?;
        let metrics = results.iter().map(|result| result.as_ref().map(|summary| summary.metrics.clone()));
        let metrics: Vec<Metrics> = metrics.collect::<Result<_, _>>().map_err(|error| unusable(&error))?;
        Ok(Self { metrics: metrics.chunks(velocities.len()).map(<[Metrics]>::to_vec).collect(), velocities, depths })
    }

    /// One metric at each depth, over the velocities.
    fn rows(&self, metric: fn(&Metrics) -> f64) -> Vec<Vec<f64>> {
        self.metrics.iter().map(|row| row.iter().map(metric).collect()).collect()
    }

    /// One metric at each velocity, over the depths.
    fn columns(&self, metric: fn(&Metrics) -> f64) -> Vec<Vec<f64>> {
        (0..self.velocities.len()).map(|i| self.metrics.iter().map(|row| metric(&row[i])).collect()).collect()
    }

    /// The first depth, by index, at which a pass at a velocity is sweeping, `ε_tc > ½`; the number of depths if none is.
    fn tier(&self, velocity: usize) -> usize {
        self.metrics.iter().position(|row| row[velocity].contact_time_ratio > 0.5).unwrap_or(self.depths.len())
    }

    /// True if the pass is striking.
    fn strikes(&self, depth: usize, velocity: usize) -> bool {
        depth < self.tier(velocity)
    }

    /// One metric over the velocities, a curve for each of five depths.
    fn curves(&self, metric: fn(&Metrics) -> f64) -> Vec<Curve> {
        let rows = self.rows(metric);
        const SHOWN_MM: [f64; 5] = [0.5, 1.0, 2.0, 3.0, 5.0];
        let is_shown = |depth: &usize| SHOWN_MM.iter().any(|shown| (1e3 * self.depths[*depth] - shown).abs() < 1e-6);
        let shown = (0..self.depths.len()).filter(is_shown);
        let curve = |depth: usize| {
            let points = self.velocities.iter().copied().zip(rows[depth].iter().copied());
            Curve::new(format!("a_e = {} mm", 1e3 * self.depths[depth]), Look::Joined, points.collect())
        };
        shown.map(curve).collect()
    }
}

/// The smallest ratio of neighbours.
fn least_growth(values: &[f64]) -> f64 {
    values.windows(2).map(|pair| pair[1] / pair[0]).fold(f64::INFINITY, f64::min)
}

/// The largest ratio of neighbours.
fn most_growth(values: &[f64]) -> f64 {
    values.windows(2).map(|pair| pair[1] / pair[0]).fold(0.0, f64::max)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Slope and offset of the straight line through points, by least squares.
fn line(x: &[f64], y: &[f64]) -> [f64; 2] {
    let (x_mean, y_mean) = (mean(x), mean(y));
    let products: f64 = x.iter().zip(y).map(|(x, y)| (x - x_mean) * (y - y_mean)).sum();
    let slope = products / x.iter().map(|x| (x - x_mean).powi(2)).sum::<f64>();
    [slope, y_mean - slope * x_mean]
}

fn range(values: &[f64]) -> f64 {
    let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(low, high), &value| (low.min(value), high.max(value)));
    high - low
}

/// The worst distance of values from a straight line over `x`, over their range.
fn misfit(x: &[f64], y: &[f64]) -> f64 {
    let [slope, offset] = line(x, y);
    let distances = x.iter().zip(y).map(|(x, y)| (y - offset - slope * x).abs());
    distances.fold(0.0, f64::max) / range(y)
}

/// A criterion: `computed` has to lie between bounds.
fn criterion(subject: &str, quantity: &'static str, bounds: [f64; 2], computed: f64) -> Check {
    Check::between(subject.to_owned(), quantity, bounds, sources::PAPER, computed)
}

const ABOVE_ONE: [f64; 2] = [1.0 + 1e-9, f64::INFINITY];
const BELOW_ONE: [f64; 2] = [0.0, 1.0 - 1e-9];

fn deflection(_: Extent) -> Result<Case, Failure> {
    let grid = Grid::new(25.0)?;
    let metric = |metrics: &Metrics| metrics.max_tip_deflection_m;
    let columns = grid.columns(metric);
    let growth = columns.iter().map(|column| least_growth(column)).fold(f64::INFINITY, f64::min);
    let last = grid.depths.len() - 1;
    let bend = |column: &Vec<f64>| {
        let final_slope = (column[last] - column[last - 1]) / (grid.depths[last] - grid.depths[last - 1]);
        final_slope / (column[0] / grid.depths[0])
    };
    let degression = columns.iter().map(bend).fold(0.0, f64::max);
    let (mut whole, mut step) = (f64::INFINITY, f64::INFINITY);
    for (depth, row) in grid.rows(metric).iter().enumerate() {
        let striking: Vec<f64> =
            (0..row.len()).filter(|&velocity| grid.strikes(depth, velocity)).map(|velocity| row[velocity]).collect();
        if striking.len() > 1 {
            whole = whole.min(striking[striking.len() - 1] / striking[0]);
            step = step.min(least_growth(&striking));
        }
    }
    let checks = vec![
        criterion("from one depth to the next, at every velocity", "least growth of s_n,max", ABOVE_ONE, growth),
        criterion("slope at 5 mm over that below 0.5 mm, largest", "slope ratio", [0.0, 0.5], degression),
        criterion("striking, from the lowest to the highest velocity", "least growth of s_n,max", ABOVE_ONE, whole),
        criterion("striking, from one velocity to the next", "least growth of s_n,max", [0.99, f64::INFINITY], step),
    ];
    let figure = Figure {
        name: "validation_paper_deflection",
        title: "Finding 1: largest tip deflection".to_owned(),
        description:
            "Tip deflection over the brushing velocity for five depths: flat while sweeping, rising once striking, and \
            closer together at larger depths."
                .to_owned(),
        x: Axis::linear("brushing velocity v_b in m/s"),
        y: Axis::linear("s_n,max in mm"),
        curves: grid.curves(|metrics| 1e3 * metrics.max_tip_deflection_m),
    };
    Ok(Case {
        title: "1. Tip deflection grows degressively with depth, and with velocity once striking",
        text: "Striking are passes with `ε_tc < ½`. At the smallest depth the deflection saturates at the highest velocities \
            (−0.7 % over the last step), so single steps may fall by 1 %."
            .to_owned(),
        checks,
        figures: vec![figure],
    })
}

fn contact_time(_: Extent) -> Result<Case, Failure> {
    let grid = Grid::new(25.0)?;
    let rows = grid.rows(|metrics| metrics.contact_time_s);
    let last = grid.velocities.len() - 1;
    let fall = rows.iter().map(|row| most_growth(row)).fold(0.0, f64::max);
    let whole = rows.iter().map(|row| row[last] / row[0]).fold(0.0, f64::max);
    let losses: Vec<f64> = rows.iter().map(|row| row[0] - row[last]).collect();
    let checks = vec![
        criterion("from one velocity to the next, at every depth", "largest ratio of t_c", BELOW_ONE, fall),
        criterion("30 m/s over 2.5 m/s, largest", "ratio of t_c", [0.0, 0.1], whole),
        criterion(
            "loss from 2.5 to 30 m/s, from one depth to the next",
            "least growth",
            ABOVE_ONE,
            least_growth(&losses),
        ),
    ];
    let figure = Figure {
        name: "validation_paper_time",
        title: "Finding 2: contact time".to_owned(),
        description:
            "Contact time over the brushing velocity for five depths, logarithmic: all fall by more than a decade."
                .to_owned(),
        x: Axis::linear("brushing velocity v_b in m/s"),
        y: Axis::logarithmic("t_c in ms"),
        curves: grid.curves(|metrics| 1e3 * metrics.contact_time_s),
    };
    Ok(Case {
        title: "2. Contact time falls steeply with velocity, most at large depth",
        text: "The paper's \"highly regressive decrease\": twelve times the velocity leaves less than a tenth of the time, and takes \
            more milliseconds at each larger depth."
            .to_owned(),
        checks,
        figures: vec![figure],
    })
}

fn tier(_: Extent) -> Result<Case, Failure> {
    let grid = Grid::new(25.0)?;
    let ratios = grid.columns(|metrics| metrics.contact_time_ratio);
    let (mut misplaced, mut velocities, mut depths) = (0, Vec::new(), Vec::new());
    for (velocity, column) in ratios.iter().enumerate() {
        let tier = grid.tier(velocity);
        misplaced += column[tier..].iter().filter(|&&ratio| ratio < 0.5).count();
        if tier > 0 && tier < column.len() {
            let share = (0.5 - column[tier - 1]) / (column[tier] - column[tier - 1]);
            velocities.push(grid.velocities[velocity]);
            depths.push(grid.depths[tier - 1] + share * (grid.depths[tier] - grid.depths[tier - 1]));
        }
    }
    let slopes: Vec<f64> = velocities.iter().zip(&depths).map(|(velocity, depth)| depth / velocity).collect();
    let relative = slopes.iter().map(|slope| slope / mean(&slopes));
    let (least, most) = relative.fold((f64::MAX, 0.0_f64), |(least, most), slope| (least.min(slope), most.max(slope)));
    let corner = |depth: usize, velocity: usize| grid.metrics[depth][velocity].contact_time_ratio;
    let (deepest, fastest) = (grid.depths.len() - 1, grid.velocities.len() - 1);
    let mut checks = vec![
        criterion("passes above the line that strike", "number", [0.0, 0.0], misplaced as f64),
        criterion("slowest and deepest pass", "ε_tc", [0.9, 1.0], corner(deepest, 0)),
        criterion("passes at 25 m/s and 0.5 mm", "ε_tc", [0.0, 0.4], corner(0, fastest - 2)),
        criterion(
            "line ε_tc = ½, worst distance from a straight one",
            "over its range",
            [0.0, 0.1],
            misfit(&velocities, &depths),
        ),
    ];
    let bounds = [0.5, 2.0];
    checks.push(criterion("a_e/v_b on the line, least over mean", "ratio", bounds, least));
    checks.push(criterion("a_e/v_b on the line, largest over mean", "ratio", bounds, most));
    let millimetres = depths.iter().map(|depth| 1e3 * depth);
    let figure = Figure {
        name: "validation_paper_tier",
        title: "Finding 3: the line between striking and sweeping, ε_tc = ½".to_owned(),
        description: "Penetration depth over brushing velocity where the contact time ratio is one half: nearly a straight line, from \
            0.7 mm at 10 m/s to 4.4 mm at 30 m/s."
            .to_owned(),
        x: Axis::linear("brushing velocity v_b in m/s"),
        y: Axis::linear("penetration depth a_e in mm"),
        curves: vec![
            Curve::new("ε_tc = ½", Look::Joined, velocities.iter().copied().zip(millimetres).collect()),
            Curve::new(
                "straight line",
                Look::Reference,
                velocities.iter().map(|x| (*x, 1e3 * (line(&velocities, &depths)[0] * x + line(&velocities, &depths)[1]))).collect(),
            ),
        ],
    };
    Ok(Case {
        title: "3. Contact time ratio has a tier, nearly proportional between velocity and depth",
        text: "The depth at which `ε_tc = ½`, interpolated at each velocity. The paper calls the line \"approximately proportional\"; \
            here it is straight, and a_e/v_b on it stays within a factor of two of its mean."
            .to_owned(),
        checks,
        figures: vec![figure],
    })
}

fn impulse(_: Extent) -> Result<Case, Failure> {
    let grid = Grid::new(25.0)?;
    let metric = |metrics: &Metrics| metrics.contact_normal_impulse_n_s;
    let rows = grid.rows(metric);
    let last = grid.velocities.len() - 1;
    let mut fall = 0.0_f64;
    for (depth, row) in rows.iter().enumerate() {
        let sweeping: Vec<f64> =
            (0..row.len()).filter(|&velocity| !grid.strikes(depth, velocity)).map(|velocity| row[velocity]).collect();
        fall = fall.max(most_growth(&sweeping));
    }
    let whole = rows.iter().map(|row| row[last] / row[0]).fold(0.0, f64::max);
    let losses: Vec<f64> = rows.iter().map(|row| row[0] - row[last]).collect();
    let (mut above, mut rise) = (0, f64::INFINITY);
    for (velocity, column) in grid.columns(metric).iter().enumerate() {
        if grid.velocities[velocity] < 15.0 {
            continue;
        }
        let least = (0..column.len()).min_by(|&a, &b| column[a].total_cmp(&column[b])).unwrap_or(0);
        above += usize::from(!grid.strikes(least, velocity));
        rise = rise.min(column[column.len() - 1] / column[least]);
    }
    let checks = vec![
        criterion("sweeping, from one velocity to the next", "largest ratio of p_n", BELOW_ONE, fall),
        criterion("30 m/s over 2.5 m/s, largest", "ratio of p_n", [0.0, 0.4], whole),
        criterion(
            "loss from 2.5 to 30 m/s, from one depth to the next",
            "least growth",
            ABOVE_ONE,
            least_growth(&losses),
        ),
        criterion("velocities from 15 m/s whose least p_n is above the line", "number", [0.0, 0.0], above as f64),
        criterion("p_n at 5 mm over the least below the line", "least ratio", [1.25, f64::INFINITY], rise),
    ];
    let figure = Figure {
        name: "validation_paper_impulse",
        title: "Finding 4: contact normal impulse of a filament".to_owned(),
        description: "Impulse over the brushing velocity for five depths: falling steeply, most at large depths, to a low level where \
            passes strike."
            .to_owned(),
        x: Axis::linear("brushing velocity v_b in m/s"),
        y: Axis::linear("p_n in mN s"),
        curves: grid.curves(|metrics| 1e3 * metrics.contact_normal_impulse_n_s),
    };
    Ok(Case {
        title: "4. Impulse falls with velocity, most at large depth, and is low below the tier",
        text: "While passes sweep, the impulse falls from each velocity to the next; from 15 m/s on, where both kinds of motion \
            occur, the least impulse at a velocity is that of a striking pass, and the deepest sweep has a quarter more at least."
            .to_owned(),
        checks,
        figures: vec![figure],
    })
}

fn tool_force(_: Extent) -> Result<Case, Failure> {
    let grid = Grid::new(25.0)?;
    let metric = |metrics: &Metrics| metrics.tool_contact_normal_force_n;
    let columns = grid.columns(metric);
    let last = columns.len() - 1;
    let fast = columns.iter().zip(&grid.velocities).filter(|(_, velocity)| **velocity >= 22.5);
    let fast = fast.map(|(column, _)| misfit(&grid.depths, column)).fold(f64::INFINITY, f64::min);
    let mut checks = vec![
        criterion(
            "mean at 30 m/s over mean at 2.5 m/s",
            "ratio of F_n,w",
            ABOVE_ONE,
            mean(&columns[last]) / mean(&columns[0]),
        ),
        criterion(
            "distance from a straight line in a_e, 2.5 m/s",
            "over its range",
            [0.0, 0.1],
            misfit(&grid.depths, &columns[0]),
        ),
        criterion("the same, least from 22.5 m/s on", "over its range", [0.12, f64::INFINITY], fast),
    ];
    let mut peaks = Vec::new();
    for (depth, row) in grid.rows(metric).iter().enumerate() {
        if !(0.9e-3..3.1e-3).contains(&grid.depths[depth]) || grid.depths[depth] * 1e3 % 1.0 > 1e-6 {
            continue;
        }
        let is_peak = |i: &usize| row[*i] > row[i - 1] && row[*i] > 1.02 * row[i + 1];
        let subject = format!("a_e = {} mm, where F_n,w has a maximum", 1e3 * grid.depths[depth]);
        let Some(peak) = (1..row.len() - 1).rev().find(is_peak) else {
            checks.push(criterion(&subject, "v_b in m/s", [2.5, 30.0], f64::NAN));
            continue;
        };
        let metrics = &grid.metrics[depth];
        let (ratio, count) = (metrics[peak].contact_time_ratio, metrics[peak].contact_count);
        checks.push(criterion(&subject, "ε_tc", [0.3, 0.6], ratio));
        let more = count as f64 - metrics[last].contact_count as f64;
        checks.push(criterion(&subject, "contacts more than at 30 m/s", [1.0, f64::INFINITY], more));
        peaks.push(grid.velocities[peak]);
    }
    checks.push(criterion(
        "v_b of that maximum, from one depth to the next",
        "least growth",
        ABOVE_ONE,
        least_growth(&peaks),
    ));
    let figure = Figure {
        name: "validation_paper_force",
        title: "Finding 5: contact normal force of the tool".to_owned(),
        description: "Tool force over the brushing velocity for five depths: flat at low velocities, with a local maximum that moves to \
            higher velocities at larger depths, and rising beyond."
            .to_owned(),
        x: Axis::linear("brushing velocity v_b in m/s"),
        y: Axis::linear("F_n,w in N"),
        curves: grid.curves(metric),
    };
    Ok(Case {
        title: "5. Tool force: high at high velocity, linear in depth only when slow, a maximum along the tier",
        text: "At 1, 2 and 3 mm the tool force has a local maximum, 2 % at least above the next velocity, on the tier, where the \
            filament makes a contact more near the end of its pass than it does at 30 m/s; it moves to higher velocities with the \
            depth."
            .to_owned(),
        checks,
        figures: vec![figure],
    })
}

fn segments(_: Extent) -> Result<Case, Failure> {
    let (paper, fine) = (Grid::new(25.0)?, Grid::new(50.0)?);
    let pairs = || paper.metrics.iter().flatten().zip(fine.metrics.iter().flatten());
    let change = |metric: fn(&Metrics) -> f64| {
        pairs().map(|(paper, fine)| (metric(paper) / metric(fine) - 1.0).abs()).fold(0.0, f64::max)
    };
    let ratio =
        pairs().map(|(paper, fine)| (paper.contact_time_ratio - fine.contact_time_ratio).abs()).fold(0.0, f64::max);
    let subject = "n = 25 against n = 50, largest of 120 passes";
    let checks = vec![
        criterion(subject, "change of F_n,w", [0.0, 5e-3], change(|metrics| metrics.tool_contact_normal_force_n)),
        criterion(subject, "change of s_n,max", [0.0, 5e-3], change(|metrics| metrics.max_tip_deflection_m)),
        criterion(subject, "change of ε_tc", [0.0, 0.01], ratio),
    ];
    let mut curves = paper.curves(|metrics| metrics.tool_contact_normal_force_n);
    for curve in &mut curves {
        (curve.name, curve.look) = (format!("{}, n = 25", curve.name), Look::Markers);
    }
    for curve in fine.curves(|metrics| metrics.tool_contact_normal_force_n) {
        curves.push(Curve { name: format!("{}, n = 50", curve.name), look: Look::Reference, ..curve });
    }
    let figure = Figure {
        name: "validation_paper_segments",
        title: "Finding 6: tool force for n = 25 and n = 50".to_owned(),
        description:
            "Tool force over the brushing velocity for five depths: that of 25 segments lies on the lines of 50."
                .to_owned(),
        x: Axis::linear("brushing velocity v_b in m/s"),
        y: Axis::linear("F_n,w in N"),
        curves,
    };
    Ok(Case {
        title: "6. More than 25 segments change nothing noticeable",
        text: "\"Noticeable\" is half a percent in force and deflection, and 0.01 in the contact time ratio."
            .to_owned(),
        checks,
        figures: vec![figure],
    })
}

fn magnitude(_: Extent) -> Result<Case, Failure> {
    let grid = Grid::new(25.0)?;
    let forces: Vec<f64> = grid.metrics.iter().flatten().map(|metrics| metrics.tool_contact_normal_force_n).collect();
    let (low, high) = forces.iter().fold((f64::MAX, f64::MIN), |(low, high), &force| (low.min(force), high.max(force)));
    let checks = vec![
        criterion("least of 120 passes", "F_n,w in N", [10.0, 1000.0], low),
        criterion("largest of 120 passes", "F_n,w in N", [10.0, 1000.0], high),
    ];
    Ok(Case {
        title: "7. Tool force lies in the order of magnitude of measured ones",
        text: "Tens to hundreds of newtons. The paper's measurements are figures without a table, and Young's modulus and damping \
            are assumptions: more than the order of magnitude cannot be claimed."
            .to_owned(),
        checks,
        figures: vec![],
    })
}
