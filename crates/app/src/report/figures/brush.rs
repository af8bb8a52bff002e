//! Figures of a brush: impulses of its filaments, forces of its tool over time, and places where
//! filaments press on each other.

use super::picture::{Picture, contact_title, with_brush};
use crate::report::drawing::diagram::{Curve, Diagram, Look};
use crate::report::drawing::ends;
use crate::report::drawing::format::Format;
use crate::report::drawing::scale::Axis;
use bristle::brush::{FilamentResult, PairResult, ToolSample};
use bristle::model::settings::Settings;
use bristle_study::grid::Interaction;

/// Names of the figures.
const IMPULSES: &str = "brush_impulses";
const FORCES: &str = "brush_forces";
const ALONG: &str = "brush_presses_along_filaments";
const OVER_COLUMNS: &str = "brush_presses_over_columns";

/// With more rows than this, a figure over the columns shows means with the band of all filaments
/// instead of one curve per row.
const MAX_ROWS: usize = 4;
/// Number of intervals along the filaments in which impulses are summed.
const INTERVALS: usize = 40;
/// Pen of the shaded columns, beyond those of the curves.
const SHADE: usize = 6;

/// A brush as its figures show it.
#[derive(Clone, Debug)]
pub struct Brush {
    /// Its settings.
    pub settings: Settings,
    /// Compared with one filament alone.
    pub interaction: Interaction,
    /// The filaments.
    pub filaments: Vec<FilamentResult>,
    /// The tool over time.
    pub history: Vec<ToolSample>,
    /// Pairs of filaments that touched.
    pub pairs: Vec<PairResult>,
}

/// Draws the figures of a brush: `brush_impulses` has `p_n` over the columns, `brush_forces` the
/// forces over time. If filaments touched each other, `brush_presses_along_filaments` and
/// `brush_presses_over_columns` show the places.
#[must_use]
pub fn brush_figures(brush: &Brush, format: &Format) -> Vec<Picture> {
    let mut pictures = vec![impulses(brush, format), forces(brush, format)];
    if !brush.pairs.is_empty() {
        pictures.extend([
            presses_along(brush, format),
            presses_over_columns(brush, format),
        ]);
    }
    pictures
}

/// Returns `true` if [`brush_figures`] can make a figure of this name.
#[must_use]
pub fn is_of_brush(name: &str) -> bool {
    [IMPULSES, FORCES, ALONG, OVER_COLUMNS].contains(&name)
}

/// Draws `p_n` over the columns, with the columns that count and the filament alone.
fn impulses(brush: &Brush, format: &Format) -> Picture {
    let value = |filament: &FilamentResult| 1e3 * filament.metrics.contact_normal_impulse_n_s;
    let alone = 1e3 * brush.interaction.contact_normal_impulse_alone_n_s;
    let Interaction {
        interaction_factor: factor,
        impulse_error_estimate,
        ..
    } = brush.interaction;
    let curves = [
        vec![
            counted(brush),
            Curve::new("one filament alone", Look::Reference, across(brush, alone)),
        ],
        over_columns(brush, value),
    ];
    let subtitle = format!(
        "interaction factor {factor:.3}; shaded: the columns that count, with a mean known to ± {:.2} %",
        100.0 * impulse_error_estimate
    );
    let diagram = Diagram::new(
        contact_title("Impulses of the filaments", &brush.settings),
        with_brush(&subtitle, &brush.settings),
        [
            Axis::count("column; 0 meets the workpiece first"),
            Axis::amount("p_n in mN s"),
        ],
        curves.concat(),
    );
    Picture::of(IMPULSES, format, &diagram)
}

/// Returns the columns that count as a curve.
fn counted(brush: &Brush) -> Curve {
    let Interaction {
        first_counted_column: first,
        last_counted_column: last,
        ..
    } = brush.interaction;
    let ends = [first as f64 - 0.5, last as f64 + 0.5];
    Curve::new("", Look::Stripe, ends.map(|end| (end, 0.0))).with_pen(SHADE)
}

/// Returns a level from the first to the last column.
fn across(brush: &Brush, level: f64) -> Vec<(f64, f64)> {
    vec![
        (0.0, level),
        (brush.interaction.columns.saturating_sub(1) as f64, level),
    ]
}

/// Returns a value of the filaments over the columns up to the last one that counts: one curve per
/// row, or the mean and the band of all.
fn over_columns(brush: &Brush, value: impl Fn(&FilamentResult) -> f64) -> Vec<Curve> {
    let of_column = |column: usize| {
        brush
            .filaments
            .iter()
            .filter(move |filament| filament.column == column)
    };
    let Interaction {
        last_counted_column: last,
        rows,
        ..
    } = brush.interaction;
    if rows <= MAX_ROWS {
        let curve = |row: usize| {
            let name = if rows == 1 {
                "filaments of the brush".to_owned()
            } else {
                format!("row {row}")
            };
            let of_row = brush
                .filaments
                .iter()
                .filter(|filament| filament.row == row && filament.column <= last);
            Curve::new(
                name,
                Look::Joined,
                of_row.map(|filament| (filament.column as f64, value(filament))),
            )
        };
        return (0..rows).map(curve).collect();
    }
    let (mut means, mut lower, mut upper) = (Vec::new(), Vec::new(), Vec::new());
    for column in 0..=last {
        let values: Vec<f64> = of_column(column).map(&value).collect();
        let at = column as f64;
        means.push((at, values.iter().sum::<f64>() / values.len() as f64));
        let [least, largest] = ends(values);
        lower.push((at, least));
        upper.push((at, largest));
    }
    upper.extend(lower.into_iter().rev());
    let band = Curve::new("", Look::Band, upper).with_pen(0);
    vec![
        band,
        Curve::new(format!("mean and range of {rows} rows"), Look::Line, means).with_pen(0),
    ]
}

/// Draws the forces of the sector over time.
fn forces(brush: &Brush, format: &Format) -> Picture {
    let over_time = |value: fn(&ToolSample) -> f64| -> Vec<(f64, f64)> {
        brush
            .history
            .iter()
            .map(|sample| (1e3 * sample.time_s, value(sample)))
            .collect()
    };
    let has_presses = brush
        .history
        .iter()
        .any(|sample| sample.press_force_n > 0.0);
    let presses = Curve::new(
        "of filaments on each other",
        Look::Line,
        over_time(|sample| sample.press_force_n),
    );
    let mut curves = vec![Curve::new(
        "on the workpiece",
        Look::Line,
        over_time(|sample| sample.contact_normal_force_n),
    )];
    curves.extend(has_presses.then_some(presses));
    let Interaction { columns, rows, .. } = brush.interaction;
    let subtitle = format!("sums over {columns} × {rows} filaments");
    let diagram = Diagram::new(
        contact_title("Normal forces of the sector", &brush.settings),
        with_brush(&subtitle, &brush.settings),
        [
            Axis::linear("time t in ms"),
            Axis::amount("normal force in N"),
        ],
        curves,
    );
    Picture::of(FORCES, format, &diagram)
}

/// Draws the places along their length at which filaments press on each other.
fn presses_along(brush: &Brush, format: &Format) -> Picture {
    let length = brush.settings.filament.length_m;
    let width = length / INTERVALS as f64;
    let mut sums = [0.0; INTERVALS];
    let Interaction {
        first_counted_column: first,
        last_counted_column: last,
        ..
    } = brush.interaction;
    let is_counted = |column: usize| (first..=last).contains(&column);
    for pair in brush
        .pairs
        .iter()
        .filter(|pair| is_counted(pair.filament[0]))
    {
        // Longer filaments than the nominal one end in the last interval.
        let interval = (pair.arc_length_m / width) as usize;
        sums[interval.min(INTERVALS - 1)] += pair.impulse_n_s;
    }
    let per_filament = brush
        .filaments
        .iter()
        .filter(|filament| filament.is_counted)
        .count()
        .max(1) as f64;
    let steps = sums.iter().enumerate().flat_map(|(interval, sum)| {
        let level = 1e3 * sum / per_filament;
        [0, 1].map(|end| (1e3 * width * (interval + end) as f64, level))
    });
    let outline: Vec<(f64, f64)> = [(0.0, 0.0)]
        .into_iter()
        .chain(steps)
        .chain([(1e3 * length, 0.0)])
        .collect();
    let subtitle = format!(
        "impulse per filament that counts, in {INTERVALS} parts of its length, by the mean place of each pair’s contact"
    );
    let diagram = Diagram::new(
        contact_title("Where filaments press on each other", &brush.settings),
        with_brush(&subtitle, &brush.settings),
        [
            Axis::linear("distance from the root in mm"),
            Axis::from_zero("impulse in mN s"),
        ],
        vec![
            Curve::new("", Look::Band, outline.clone()).with_pen(0),
            Curve::new("", Look::Line, outline).with_pen(0),
        ],
    );
    Picture::of(ALONG, format, &diagram)
}

/// Draws the impulse of the neighbours on each filament over the columns.
fn presses_over_columns(brush: &Brush, format: &Format) -> Picture {
    let value = |filament: &FilamentResult| 1e3 * filament.press_impulse_n_s;
    let diagram = Diagram::new(
        contact_title("Impulse of neighbours on each filament", &brush.settings),
        with_brush(
            "without regard to direction; shaded: the columns that count",
            &brush.settings,
        ),
        [
            Axis::count("column; 0 meets the workpiece first"),
            Axis::amount("impulse in mN s"),
        ],
        [vec![counted(brush)], over_columns(brush, value)].concat(),
    );
    Picture::of(OVER_COLUMNS, format, &diagram)
}
