//! How the mean impulse of a steady stretch converges.

use bristle::brush::{BrushResult, simulate_brush};
use bristle::model::metrics::tool_force;
use bristle::model::settings::{BrushSettings, Settings};

use super::rows::{AROUND, row, with};
use crate::trial::{Axis, Check, Curve, Figure, Look, Trial};
use crate::{Extent, Failure, sources, tolerances};

/// Filaments of the paper's brush.
const PAPER_COUNT: f64 = 10_500.0;

/// A row long enough for a steady stretch, at 10 m/s.
fn steady_row(segments: usize, depth: f64) -> Result<Settings, Failure> {
    let mut settings = with(&row(segments, AROUND, 1)?, |brush| (brush.columns, brush.steady) = (None, true));
    settings.process.penetration_depth_m = depth;
    Ok(settings)
}

/// Force of the paper's brush in N if each filament had the impulse `impulse` (N s).
fn force(settings: &Settings, impulse: f64) -> f64 {
    tool_force(impulse, PAPER_COUNT, settings.process.brushing_velocity_m_s / settings.tool_radius_m())
}

/// Mean impulse of the stretch in N s.
fn mean(settings: &Settings) -> Result<f64, Failure> {
    Ok(simulate_brush(settings, 1)?.tool.contact_normal_impulse_n_s)
}

pub fn steady(extent: Extent) -> Result<Trial, Failure> {
    const SEGMENTS: usize = 8;
    // Depth in m, and the forces in N of the row and of a filament alone that docs/MODEL.md states.
    let known: &[(f64, f64, f64)] = &[(1e-3, 148.0, 165.0), (3e-3, 320.0, 290.0)];
    let (mut checks, mut curves) = (Vec::new(), Vec::new());
    for &(depth, of_row, of_one) in known {
        let settings = steady_row(SEGMENTS, depth)?;
        let result = simulate_brush(&settings, 1)?;
        let subject = format!("a_e = {} mm, n = {SEGMENTS}", 1e3 * depth);
        let (quantity, computed) = ("F_n,w in N", force(&settings, result.tool.contact_normal_impulse_n_s));
        checks.push(Check::value(
            subject.clone(),
            quantity,
            of_row,
            sources::KNOWN_ROW,
            computed,
            tolerances::KNOWN_ROW,
        ));
        let (quantity, computed) = ("F_n,w in N, alone", force(&settings, result.alone.contact_normal_impulse_n_s));
        checks.push(Check::value(subject, quantity, of_one, sources::KNOWN_ROW, computed, tolerances::KNOWN_ROW));
        curves.extend(along_columns(depth, &result));
    }
    let figure = Figure {
        name: "validation_columns",
        title: "Impulse of each filament of a planar row at 10 m/s".to_owned(),
        description: "Contact normal impulse over the column for two depths: the first filaments have more than later ones, a steady \
            stretch follows, and the last ones differ again; at 1 mm the stretch lies below the impulse of one filament alone, at 3 mm \
            above."
            .to_owned(),
        x: Axis::linear("column"),
        y: Axis::linear("p_n in mN s"),
        curves,
    };
    let mut figures = vec![figure];
    if extent == Extent::Full {
        let (more, of_tolerance) = studies(SEGMENTS)?;
        checks.extend(more);
        figures.push(of_tolerance);
    }
    Ok(Trial {
        title: "A steady stretch, and what it depends on",
        text: "A planar row of 682 filaments around, n = 8, at 10 m/s, without friction. `F_n,w = p̄_n N_f ω/(2π)` with the mean \
            impulse of the columns between entry and exit, and N_f = 10 500 as in the paper's brush. docs/MODEL.md states the forces, \
            from a prototype that was another code. In the full suite the mean is computed again at 1 mm with one setting changed at a time: \
            each is compared with the finest or with the default. Brushes of several rows are staggered 1.3 mm apart and periodic along the \
            axis, and each filament is tilted out of its plane at random, by 1e-3 rad."
            .to_owned(),
        checks,
        figures,
    })
}

/// The impulses over the columns, those that count, and that of a filament alone.
fn along_columns(depth: f64, result: &BrushResult) -> [Curve; 3] {
    let depth = format!("{} mm", 1e3 * depth);
    let place = |column: usize, impulse: f64| (column as f64, 1e3 * impulse);
    let all = result.filaments.iter().map(|filament| (filament, filament.metrics.contact_normal_impulse_n_s));
    let counted = all.clone().filter(|(filament, _)| filament.is_counted);
    let points = |(filament, impulse): (&bristle::brush::FilamentResult, f64)| place(filament.column, impulse);
    let alone = result.alone.contact_normal_impulse_n_s;
    [
        Curve::new(
            format!("one alone, {depth}"),
            Look::Reference,
            vec![place(0, alone), place(result.columns.saturating_sub(1), alone)],
        ),
        Curve::new(format!("all, {depth}"), Look::Line, all.map(points).collect()),
        Curve::new(format!("steady, {depth}"), Look::Markers, counted.map(points).collect()),
    ]
}

/// A staggered brush of `rows` rows, as dense around as the row, whose filaments are tilted at random out of their planes.
fn tilted(row: &Settings, rows: usize) -> Settings {
    const PITCH_M: f64 = 1.3e-3;
    let mut settings = with(row, |brush| (brush.rows, brush.lateral_tilt_std_rad) = (Some(rows), 1e-3));
    settings.tool.filament_count = AROUND * rows as f64;
    settings.tool.width_m = PITCH_M * rows as f64;
    settings
}

/// Changes of the mean with one setting at a time.
fn studies(segments: usize) -> Result<(Vec<Check>, Figure), Failure> {
    let base = steady_row(segments, 1e-3)?;
    let columns = simulate_brush(&base, 1)?.columns;
    let reference = mean(&base)?;
    let mut checks = Vec::new();
    let mut compare = |subject: String, mean: f64, reference: f64, tolerance| {
        let (quantity, source) = ("change of p̄_n", sources::CONVERGENCE);
        checks.push(Check::value(subject, quantity, 0.0, source, mean / reference - 1.0, tolerance));
    };
    let other = |change: &dyn Fn(&mut BrushSettings)| mean(&with(&base, change));
    for points in [3, 10, 20] {
        let changed = other(&|brush| brush.contact_points = Some(points))?;
        compare(format!("N_q = {points} instead of 5"), changed, reference, tolerances::STEADY);
    }
    for stiffness in [2e8, 9e8] {
        // Impacts of stiffer contacts are shorter.
        let changed = other(&|brush| (brush.stiffness_n_m2, brush.tolerance) = (stiffness, 3e-4))?;
        compare(format!("k_l = {stiffness:e} N/m² instead of 6e7"), changed, reference, tolerances::STEADY);
    }
    for factor in [3, 4] {
        let columns = factor * columns / 2;
        let changed = other(&|brush| brush.columns = Some(columns))?;
        compare(format!("{columns} columns instead of the default"), changed, reference, tolerances::STEADY);
    }
    let of_segments = |segments: usize| mean(&steady_row(segments, 1e-3)?);
    let fine = of_segments(24)?;
    for (segments, mean) in [(8, reference), (12, of_segments(12)?), (16, of_segments(16)?)] {
        compare(format!("n = {segments} instead of 24"), mean, fine, tolerances::STEADY_SEGMENTS);
    }
    let [two, four, eight] = [2, 4, 8].map(|rows| mean(&tilted(&base, rows)));
    let eight = eight?;
    for (rows, mean) in [(2, two?), (4, four?)] {
        let subject = format!("{rows} staggered, tilted rows instead of 8");
        compare(subject, mean, eight, tolerances::STEADY_ROWS);
    }
    let finest = other(&|brush| brush.tolerance = 1e-5)?;
    let mut course = Vec::new();
    for tolerance in [3e-3, 1e-3, 3e-4, 1e-4, 3e-5] {
        let mean = other(&|brush| brush.tolerance = tolerance)?;
        course.push((tolerance, (mean / finest - 1.0).abs()));
        if tolerance <= 1e-3 {
            let subject = format!("tolerance {tolerance:e} instead of 1e-5, over the tolerance");
            let (quantity, source) = ("change of p̄_n", sources::CONTROL);
            let ratio = (mean / finest - 1.0) / tolerance;
            checks.push(Check::value(subject, quantity, 0.0, source, ratio, tolerances::STEADY_TOLERANCE));
        }
    }
    let figure = Figure {
        name: "validation_row_tolerance",
        title: "Error of the mean impulse over the tolerance of the brush".to_owned(),
        description: "Change of the mean impulse of the steady stretch from that at 1e-5, over the tolerance, both logarithmic: it lies \
            near or below the tolerance, and falls with it."
            .to_owned(),
        x: Axis::logarithmic("tolerance of the brush"),
        y: Axis::logarithmic("relative change of p̄_n"),
        curves: vec![
            Curve::new("n = 8, 1 mm", Look::Joined, course),
            Curve::new("error = tolerance", Look::Reference, vec![(3e-5, 3e-5), (3e-3, 3e-3)]),
        ],
    };
    Ok((checks, figure))
}
