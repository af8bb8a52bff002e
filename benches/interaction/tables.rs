//! The tables and numbers of the page.

use std::collections::BTreeMap;
use std::error::Error;
use std::f64::consts::TAU;

use bristle::brush::BrushResult;
use bristle::simulation::{Pass, SimulationError};

use bristle_benches::{fixed, table};
use bristle_input::packing::tip_spacing;

use crate::cases::{
    Case, DEPTHS, DIFFERING, FINER, OperatingPoint, ROUGH, Results, SPARSE, SPARSE_DEPTHS, SPATIAL,
    Scatter, TILTED, TILTS, TURNING, VELOCITIES, at, places,
};
use crate::numbers::{
    Presses, Tilted, by_column, impulse, impulse_alone, in_the_middle, sideways, standard_error,
    unsteady_columns,
};

/// A part of the impulse within which a column is steady.
pub const STEADY: f64 = 0.05;
/// A filament whose tip goes farther sideways than this has buckled, in m.
pub const BUCKLED: f64 = 4e-3;

/// The values of the places of the page.
///
/// # Errors
/// If a filament alone cannot be simulated.
pub fn all(results: &Results) -> Result<BTreeMap<&'static str, String>, Box<dyn Error>> {
    Ok(BTreeMap::from([
        ("forces", forces(results)),
        ("finer", finer(results)),
        ("space", space(results)),
        ("tilts", tilts(results)),
        ("sparse", sparse(results)),
        ("friction", friction(results)?),
        ("scatter", scatter(results)),
        ("buckling", buckling(results)?),
        ("spreading", spreading(results)),
        ("presses", presses(results)),
        ("turns", turns(results)),
        ("depth", depth(results)),
    ]))
}

fn whole(value: f64) -> String {
    format!("{value:.0}").replace('-', "−")
}

/// An impulse in mN s.
fn milli(impulse: f64) -> String {
    fixed(2, 1e3 * impulse)
}

fn per_cent(share: f64) -> String {
    format!("{} %", fixed(0, 100.0 * share))
}

fn place_of(place: OperatingPoint) -> String {
    format!("{} m/s, {} mm", place.velocity, place.depth_mm())
}

/// Force of the whole tool in N, of a brush and of filaments alone.
pub fn tool_forces(place: OperatingPoint, brush: &BrushResult) -> [f64; 2] {
    [impulse(brush), impulse_alone(brush)].map(|impulse| place.tool_force(impulse))
}

fn forces(results: &Results) -> String {
    let cell = |velocity, depth| {
        let row = results.row(velocity, depth);
        let [together, alone] = tool_forces(at(velocity, depth), row);
        format!(
            "{} / {} ({})",
            whole(together),
            whole(alone),
            fixed(2, together / alone)
        )
    };
    let row = |depth: u32| {
        let head = format!("{} mm", at(2, depth).depth_mm());
        [head]
            .into_iter()
            .chain(VELOCITIES.map(|velocity| cell(velocity, depth)))
            .collect()
    };
    table(
        &["a_e", "2 m/s", "10 m/s", "20 m/s", "30 m/s"],
        DEPTHS.map(row),
    )
}

fn finer(results: &Results) -> String {
    let row = |place: OperatingPoint| {
        let cells = |brush| tool_forces(place, brush).map(|force| fixed(1, force));
        let [coarse, fine] =
            [Case::Row(place), Case::Finer(place)].map(|case| cells(results.of(case)));
        [place_of(place)]
            .into_iter()
            .chain(coarse)
            .chain(fine)
            .collect()
    };
    table(&["", "n = 12", "alone", "n = 25", "alone"], FINER.map(row))
}

fn space(results: &Results) -> String {
    let row = |place: OperatingPoint| {
        let [planar, alone] = tool_forces(place, results.of(Case::Row(place)));
        let brush = results.space(place);
        let [force, error] = force_in_space(place, brush);
        let in_space = format!("{} ± {}", whole(force), whole(error));
        vec![
            place_of(place),
            whole(alone),
            whole(planar),
            in_space,
            per_cent(brush.stretch.scatter),
        ]
    };
    table(
        &[
            "",
            "alone",
            "planar row",
            "in space",
            "scatter of p_n in space",
        ],
        SPATIAL.map(row),
    )
}

/// Force of the whole tool in N of a brush in space, with its standard error.
pub fn force_in_space(place: OperatingPoint, brush: &BrushResult) -> [f64; 2] {
    let force = place.tool_force(impulse(brush));
    [force, force * standard_error(brush)]
}

fn tilts(results: &Results) -> String {
    let row = |place: OperatingPoint| {
        let planar = whole(tool_forces(place, results.of(Case::Row(place)))[0]);
        let cells = TILTS.map(|tilt| {
            let [force, error] = force_in_space(place, results.of(Case::Space { place, tilt }));
            format!("{} ± {}", whole(force), whole(error))
        });
        [place_of(place), planar].into_iter().chain(cells).collect()
    };
    let heads = TILTS.map(|tilt| format!("{tilt} mrad"));
    let heads: Vec<&str> = ["", "planar row"]
        .into_iter()
        .chain(heads.iter().map(String::as_str))
        .collect();
    table(&heads, TILTED.map(row))
}

/// The mean distance of the tips over their diameter, of a whole brush with so many filaments
/// around.
fn spacing(around: u32) -> f64 {
    let mut settings = at(10, 1000).settings();
    // The pitch is as equal both ways as it can be.
    let pitch = TAU * settings.tool.body_radius_m / f64::from(around);
    settings.tool.filament_count = f64::from(around) * settings.tool.width_m / pitch;
    tip_spacing(&settings)
}

/// The interaction factors of rows with so many filaments around, at one velocity.
pub fn sparse_factors(results: &Results, around: u32, velocity: u32) -> [f64; 2] {
    SPARSE_DEPTHS.map(|depth| {
        results
            .of(Case::Sparse {
                place: at(velocity, depth),
                around,
            })
            .interaction_factor
    })
}

fn sparse(results: &Results) -> String {
    let row = |around: u32| {
        let cells = VELOCITIES.map(|velocity| {
            sparse_factors(results, around, velocity)
                .map(|each| fixed(2, each))
                .join(" / ")
        });
        [fixed(2, spacing(around))]
            .into_iter()
            .chain(cells)
            .collect()
    };
    table(
        &["tips apart by, in d", "2 m/s", "10 m/s", "20 m/s", "30 m/s"],
        SPARSE.map(row),
    )
}

fn friction(results: &Results) -> Result<String, SimulationError> {
    let mut rows = Vec::new();
    for place in ROUGH {
        let rough = |workpiece, filaments| {
            results.of(Case::Rough {
                place,
                workpiece,
                filaments,
            })
        };
        let brushes = [
            results.of(Case::Row(place)),
            rough(false, true),
            rough(true, false),
            rough(true, true),
        ];
        let alone =
            [brushes[0], brushes[2]].map(|brush| whole(place.tool_force(impulse_alone(brush))));
        let cells = brushes.map(|brush| whole(place.tool_force(impulse(brush))));
        rows.push(
            [place_of(place)]
                .into_iter()
                .chain(alone)
                .chain(cells)
                .collect(),
        );
    }
    let heads = [
        "",
        "alone",
        "alone, µ_w",
        "row",
        "row, µ_f",
        "row, µ_w",
        "row, µ_w and µ_f",
    ];
    Ok(table(&heads, rows))
}

fn scatter(results: &Results) -> String {
    let row = |scatter: Scatter| {
        let [near, apart] = [false, true].map(|apart| {
            results.of(Case::Differing {
                place: DIFFERING,
                scatter,
                apart,
            })
        });
        let cells = [near, apart].map(|brush| {
            let force = DIFFERING.tool_force(impulse(brush));
            [
                format!(
                    "{} ± {}",
                    whole(force),
                    fixed(1, force * standard_error(brush))
                ),
                per_cent(brush.stretch.scatter),
            ]
        });
        [scatter.name().to_owned()]
            .into_iter()
            .chain(cells.concat())
            .collect()
    };
    let heads = [
        "differs",
        "in contact: F_n,w",
        "scatter of p_n",
        "apart: F_n,w",
        "scatter of p_n",
    ];
    table(&heads, Scatter::ALL.map(row))
}

/// The share of the filaments that count whose tips go farther sideways than [`BUCKLED`], and how
/// far they go on average, in m.
pub fn buckled(brush: &BrushResult) -> [f64; 2] {
    let ways = sideways(brush).into_iter().zip(&brush.filaments);
    let ways: Vec<f64> = ways
        .filter_map(|(way, filament)| filament.is_counted.then_some(way))
        .collect();
    let count = ways.len() as f64;
    let buckled = ways.iter().filter(|way| **way > BUCKLED).count() as f64;
    [buckled / count, ways.iter().sum::<f64>() / count]
}

fn buckling(results: &Results) -> Result<String, SimulationError> {
    let mut rows = Vec::new();
    for place in SPATIAL {
        let Tilted {
            impulse: tilted,
            sideways,
        } = Tilted::at(place)?;
        let straight = impulse_alone(results.of(Case::Row(place)));
        let [share, way] = buckled(results.space(place));
        rows.push(vec![
            place_of(place),
            whole(place.tool_force(straight)),
            whole(place.tool_force(tilted)),
            fixed(1, 1e3 * sideways),
            fixed(1, 1e3 * way),
            per_cent(share),
        ]);
    }
    let heads = [
        "",
        "alone, no tilt: N",
        "alone, tilted: N",
        "its z in mm",
        "in the brush: mean z in mm",
        "above 4 mm",
    ];
    Ok(table(&heads, rows))
}

fn spreading(results: &Results) -> String {
    let row = |place: OperatingPoint| {
        let row = results.of(Case::Row(place));
        let [before, after] = unsteady_columns(row, STEADY);
        let impulses = by_column(row);
        vec![
            place_of(place),
            fixed(0, contact_columns(place)),
            before.to_string(),
            after.to_string(),
            fixed(2, impulses[0] / impulse(row)),
            fixed(2, impulses[row.columns - 1] / impulse(row)),
        ]
    };
    let heads = [
        "",
        "columns in a contact",
        "columns at the front",
        "columns at the end",
        "first p_n",
        "last p_n",
    ];
    table(&heads, places([1000, 3000]).map(row))
}

/// How many columns pass while an undeformed filament touches.
fn contact_columns(place: OperatingPoint) -> f64 {
    let settings = place.settings();
    let angle = Pass::new(&settings).nominal().contact_angle;
    angle * settings.tool.filament_count / TAU
}

fn presses(results: &Results) -> String {
    let row = |place: OperatingPoint| {
        let row = results.of(Case::Row(place));
        let presses = Presses::of(row)?;
        Some(vec![
            place_of(place),
            milli(impulse(row)),
            milli(presses.impulse),
            milli(presses.lift_ahead),
            fixed(1, presses.peak),
            fixed(1, 1e3 * presses.time),
            fixed(2, presses.arc_length / place.settings().filament.length_m),
        ])
    };
    let heads = [
        "",
        "p_n in mN s",
        "impulse of a pair in mN s",
        "of it upwards on the one ahead",
        "peak force in N",
        "time in ms",
        "place s/l_f",
    ];
    table(&heads, places([1000, 3000]).filter_map(row))
}

fn turns(results: &Results) -> String {
    let row = |place: OperatingPoint| {
        let [single, turned] =
            [Case::Row(place), Case::Turning(place)].map(|case| results.of(case));
        let [mean, least, largest] = in_the_middle(turned);
        vec![
            place_of(place),
            milli(impulse_alone(single)),
            milli(impulse_alone(turned)),
            fixed(2, impulse_alone(turned) / impulse_alone(single)),
            milli(impulse(single)),
            format!("{} ({} to {})", milli(mean), milli(least), milli(largest)),
            fixed(2, mean / impulse(single)),
        ]
    };
    let heads = [
        "",
        "alone: first turn",
        "third",
        "ratio",
        "in the row: first turn",
        "third, with its range",
        "ratio",
    ];
    table(&heads, TURNING.map(row))
}

fn depth(results: &Results) -> String {
    let row = |velocity: u32| {
        let [shallow, deep] = [DEPTHS[0], DEPTHS[3]]
            .map(|depth| tool_forces(at(velocity, depth), results.row(velocity, depth)));
        let ratio = |index: usize| deep[index] / shallow[index];
        vec![
            format!("{velocity} m/s"),
            fixed(2, ratio(1)),
            fixed(2, ratio(0)),
        ]
    };
    table(
        &[
            "v_b",
            "F_n,w at 3 mm over that at 0.5 mm: alone",
            "in the row",
        ],
        VELOCITIES.map(row),
    )
}
