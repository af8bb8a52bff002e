//! How the mean impulse of a steady stretch converges.

use bristle::brush::{BrushResult, FilamentResult, simulate_brush};
use bristle::model::metrics::tool_force;
use bristle::model::settings::{BrushSettings, Settings};

use super::rows::{AROUND, row, with};
use crate::group::{Extent, Failure};
use crate::trial::{Axis, Curve, Figure, Look, Trial};
use crate::{sources, tolerances};

/// Filaments of the paper's brush.
const PAPER_COUNT: f64 = 10_500.0;

/// A row long enough for a steady stretch, at 10 m/s.
fn steady_row(segments: usize, depth: f64) -> Result<Settings, Failure> {
    let mut settings = with(&row(segments, AROUND, 1)?, |brush| {
        (brush.columns, brush.steady) = (None, true)
    });
    settings.process.penetration_depth_m = depth;
    Ok(settings)
}

/// Force of the paper's brush in N if each filament had the impulse `impulse` (N s).
fn force(settings: &Settings, impulse: f64) -> f64 {
    tool_force(
        impulse,
        PAPER_COUNT,
        settings.process.brushing_velocity_m_s / settings.tool_radius_m(),
    )
}

/// Mean impulse of the stretch in N s.
fn mean(settings: &Settings) -> Result<f64, Failure> {
    Ok(simulate_brush(settings, 1)?.tool.contact_normal_impulse_n_s)
}

/// Number of segments of the rows whose forces are known.
const SEGMENTS: usize = 8;
/// The depth in m at which settings are changed.
const DEPTH: f64 = 1e-3;

pub fn steady(extent: Extent) -> Result<Trial, Failure> {
    // Depth in m, and the forces in N of the row and of a filament alone that docs/MODEL.md states.
    let known: &[_] = extent.choose(
        &[(DEPTH, 148.0, 165.0)],
        &[(DEPTH, 148.0, 165.0), (3e-3, 320.0, 290.0)],
    );
    let base = steady_row(SEGMENTS, DEPTH)?;
    let of_base = simulate_brush(&base, 1)?;
    let mut trial = Trial::new(
        "A steady stretch, and what it depends on",
        "A planar row of 682 filaments around, n = 8, at 10 m/s, without friction. `F_n,w = p̄_n N_f ω/(2π)` with the mean \
            impulse of the columns between entry and exit, and N_f = 10 500 as in the paper's brush. docs/MODEL.md states the forces, \
            from a prototype, another code. The mean at 1 mm is computed again with one setting changed at a time. Brushes of \
            several rows are staggered, 1.3 mm apart and periodic along the axis, and each filament is tilted out of its plane at random, \
            by 1e-3 rad.",
    );
    let mut curves = Vec::new();
    for &(depth, of_row, of_one) in known {
        let settings = steady_row(SEGMENTS, depth)?;
        let result = if settings == base {
            of_base.clone()
        } else {
            simulate_brush(&settings, 1)?
        };
        let subject = format!("a_e = {} mm, n = {SEGMENTS}", 1e3 * depth);
        for (quantity, known, impulse) in [
            ("F_n,w in N", of_row, result.tool.contact_normal_impulse_n_s),
            (
                "F_n,w in N, alone",
                of_one,
                result.alone.contact_normal_impulse_n_s,
            ),
        ] {
            let tolerance = tolerances::KNOWN_ROW;
            trial.check(
                &subject,
                quantity,
                known,
                sources::KNOWN_ROW,
                force(&settings, impulse),
                tolerance,
            );
        }
        curves.extend(along_columns(depth, &result));
    }
    trial.figures.push(Figure {
        name: "validation_columns",
        title: "Impulse of each filament of a planar row at 10 m/s".to_owned(),
        description: "Contact normal impulse over the column for two depths: the first filaments have more than later ones, a steady \
            stretch follows, and the last ones differ again; at 1 mm the stretch lies below the impulse of one filament alone, at 3 mm \
            above.",
        axes: [Axis::linear("column"), Axis::linear("p_n in mN s")],
        curves,
    });
    extent
        .choose(QUICK, FULL)
        .compare(&mut trial, &base, &of_base)?;
    Ok(trial)
}

/// The impulses over the columns, those that count, and that of a filament alone.
fn along_columns(depth: f64, result: &BrushResult) -> [Curve; 3] {
    let depth = format!("{} mm", 1e3 * depth);
    let place = |column: usize, impulse: f64| (column as f64, 1e3 * impulse);
    let all = result
        .filaments
        .iter()
        .map(|filament| (filament, filament.metrics.contact_normal_impulse_n_s));
    let counted = all.clone().filter(|(filament, _)| filament.is_counted);
    let points = |(filament, impulse): (&FilamentResult, f64)| place(filament.column, impulse);
    let alone = result.alone.contact_normal_impulse_n_s;
    [
        Curve::new(
            format!("one alone, {depth}"),
            Look::Reference,
            vec![
                place(0, alone),
                place(result.columns.saturating_sub(1), alone),
            ],
        ),
        Curve::new(format!("all, {depth}"), Look::Line, all.map(points)),
        Curve::new(
            format!("steady, {depth}"),
            Look::Markers,
            counted.map(points),
        ),
    ]
}

/// A staggered brush of `rows` rows, as dense around as the row, whose filaments are tilted at
/// random out of their planes.
fn tilted(row: &Settings, rows: usize) -> Settings {
    const PITCH_M: f64 = 1.3e-3;
    let mut settings = with(row, |brush| {
        (brush.rows, brush.lateral_tilt_std_rad) = (Some(rows), 1e-3)
    });
    settings.tool.filament_count = AROUND * rows as f64;
    settings.tool.width_m = PITCH_M * rows as f64;
    settings
}

/// What is changed, one after the other.
struct Changes {
    /// Numbers of contact points per segment, instead of the default.
    points: &'static [usize],
    /// Contact stiffnesses in N/m² instead of the default, with a finer time step, as stiffer
    /// impacts are shorter.
    stiffnesses: &'static [f64],
    /// Numbers of columns, as multiples of half the default number.
    half_columns: &'static [usize],
    /// Numbers of segments, and that which they are compared with.
    segments: (&'static [usize], usize),
    /// Tolerances, and that which they are compared with.
    tolerances: (&'static [f64], f64),
    /// Numbers of rows of tilted filaments, and that which they are compared with.
    rows: Option<(&'static [usize], usize)>,
}

const QUICK: Changes = Changes {
    points: &[10],
    stiffnesses: &[2e8],
    half_columns: &[],
    segments: (&[4], 8),
    tolerances: (&[3e-3], 1e-3),
    rows: None,
};

const FULL: Changes = Changes {
    points: &[3, 10, 20],
    stiffnesses: &[2e8, 9e8],
    half_columns: &[3, 4],
    segments: (&[8, 12, 16], 24),
    tolerances: (&[3e-3, 1e-3, 3e-4, 1e-4, 3e-5], 1e-5),
    rows: Some((&[2, 4], 8)),
};

impl Changes {
    /// Adds the changes of the mean of `base`, whose result is given, and their diagram over the
    /// tolerance.
    fn compare(
        &self,
        trial: &mut Trial,
        base: &Settings,
        of_base: &BrushResult,
    ) -> Result<(), Failure> {
        let (columns, reference) = (of_base.columns, of_base.tool.contact_normal_impulse_n_s);
        let mean = |settings: &Settings| {
            if settings == base {
                Ok(reference)
            } else {
                mean(settings)
            }
        };
        let mut compare = |subject: String, mean: f64, reference: f64, tolerance| {
            trial.check(
                subject,
                "change of p̄_n",
                0.0,
                sources::CONVERGENCE,
                mean / reference - 1.0,
                tolerance,
            );
        };
        let other = |change: &dyn Fn(&mut BrushSettings)| mean(&with(base, change));
        for &points in self.points {
            let changed = other(&|brush| brush.contact_points = Some(points))?;
            compare(
                format!("N_q = {points} instead of the default"),
                changed,
                reference,
                tolerances::STEADY,
            );
        }
        for &stiffness in self.stiffnesses {
            let changed =
                other(&|brush| (brush.stiffness_n_m2, brush.tolerance) = (stiffness, 3e-4))?;
            compare(
                format!("k_l = {stiffness:e} N/m² instead of 6e7"),
                changed,
                reference,
                tolerances::STIFFER_ROW,
            );
        }
        for factor in self.half_columns {
            let more = factor * columns / 2;
            let changed = other(&|brush| brush.columns = Some(more))?;
            compare(
                format!("{more} columns instead of {columns}"),
                changed,
                reference,
                tolerances::STEADY,
            );
        }
        let of_segments = |segments: usize| mean(&steady_row(segments, DEPTH)?);
        let (numbers, most) = self.segments;
        let fine = of_segments(most)?;
        for &segments in numbers {
            let (changed, subject) = (
                of_segments(segments)?,
                format!("n = {segments} instead of {most}"),
            );
            compare(subject, changed, fine, tolerances::STEADY_COARSE);
        }
        if let Some((numbers, most)) = self.rows {
            let many = mean(&tilted(base, most))?;
            for &rows in numbers {
                let changed = mean(&tilted(base, rows))?;
                let subject = format!("{rows} rows of tilted filaments instead of {most}");
                compare(subject, changed, many, tolerances::STEADY_COARSE);
            }
        }
        let (coarser, finest) = self.tolerances;
        let limit = other(&|brush| brush.tolerance = finest)?;
        let mut course = Vec::new();
        for &tolerance in coarser {
            let change = other(&|brush| brush.tolerance = tolerance)? / limit - 1.0;
            course.push((tolerance, change.abs()));
            let subject = format!("tolerance {tolerance:e} instead of {finest:e}");
            let (quantity, allowed) = ("change of p̄_n / tolerance", tolerances::STEADY_TOLERANCE);
            trial.check(
                subject,
                quantity,
                0.0,
                sources::CONTROL,
                change / tolerance,
                allowed,
            );
        }
        let ends =
            [coarser.first(), coarser.last()].map(|end| end.map_or((1.0, 1.0), |end| (*end, *end)));
        trial.figures.push(Figure {
            name: "validation_row_tolerance",
            title: "Error of the mean impulse over the tolerance of the brush".to_owned(),
            description: "Change of the mean impulse of the steady stretch from that at the finest tolerance, over the tolerance, both \
                logarithmic: it lies near or below the tolerance, and falls with it.",
            axes: [Axis::logarithmic("tolerance of the brush"), Axis::logarithmic("relative change of p̄_n")],
            curves: vec![
                Curve::new(format!("n = {SEGMENTS}, 1 mm"), Look::Joined, course),
                Curve::new("error = tolerance", Look::Reference, ends),
            ],
        });
        Ok(())
    }
}
