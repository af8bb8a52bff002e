//! Is it right where filaments are sparse? And do shortcuts only save work?
//!
//! A brush is sparse where filaments touch each other only once they bend. It shows contacts
//! between groups of filaments that are computed side by side, and contacts of filaments that slept
//! before: results must not depend on where a group begins.

use bristle::brush::{BrushResult, BrushRun, RunOptions, Shortcuts, simulate_brush};
use bristle::equations::LANES;
use bristle::model::settings::{
    BrushSettings, FilamentSettings, ProcessSettings, Settings, ToolSettings, Turns, WorkpieceKind,
};

/// A planar row of a catalogue brush: filaments of 0.6 mm of PA 6.12 with 30 % SiC, 333 around, at
/// 1000 rpm and 1.5 mm.
fn sparse(columns: usize) -> Settings {
    let filament = FilamentSettings {
        segments: 8,
        youngs_modulus_pa: 4.31e9,
        density_kg_m3: 1327.0,
        damping_ratio: 0.05,
        ..FilamentSettings::new(0.030, 0.6e-3)
    };
    let process = ProcessSettings::new(1000.0 * std::f64::consts::TAU / 60.0 * 0.1, 1.5e-3);
    let brush = BrushSettings {
        columns: Some(columns),
        rows: Some(1),
        contact_points: Some(3),
        stiffness_n_m2: 6e7,
        steady: false,
        ..BrushSettings::default()
    };
    Settings {
        brush: Some(brush),
        ..Settings::new(ToolSettings::new(0.070, 1e-3, 333.0), filament, process)
    }
}

/// A sparse row on a plane that leans so little that filaments move in space, but not out of their
/// plane.
fn in_space(columns: usize) -> Settings {
    let mut settings = sparse(columns);
    settings.workpiece.kind = WorkpieceKind::plane([0.0, 1.0, 1e-9]);
    settings
}

/// A row of the paper's brush.
fn packed(columns: usize) -> Settings {
    let mut settings = Settings::paper(10.0, 1e-3);
    settings.filament.segments = 5;
    settings.tool.filament_count = 682.0;
    let brush = BrushSettings {
        columns: Some(columns),
        rows: Some(1),
        steady: false,
        ..BrushSettings::default()
    };
    Settings {
        brush: Some(brush),
        ..settings
    }
}

fn simulated(settings: &Settings) -> BrushResult {
    simulate_brush(settings, 1).expect("a brush")
}

fn without(settings: &Settings, shortcuts: Shortcuts) -> BrushResult {
    let options = RunOptions {
        shortcuts,
        ..RunOptions::default()
    };
    let mut run = BrushRun::new(settings, options).expect("a brush");
    while run.advance().expect("a step") {}
    run.finish().expect("a result")
}

fn impulses(result: &BrushResult) -> Vec<f64> {
    result
        .filaments
        .iter()
        .map(|filament| filament.metrics.contact_normal_impulse_n_s)
        .collect()
}

/// Impulses in mN s are of an explicit code that shares nothing with this one. The first filaments
/// meet an empty gap, and the last one has none behind it. In between no impulse depends on the
/// column, nor on its place in a group.
#[test]
fn a_sparse_row_is_that_of_an_independent_code() {
    let found = impulses(&simulated(&sparse(40)));
    let expected = |column: usize| match column {
        0 => 0.33308,
        1 => 0.27803,
        2 => 0.27098,
        3 => 0.26923,
        39 => 0.20993,
        _ => 0.26892,
    };
    for (column, impulse) in found.iter().enumerate() {
        let error = 1e3 * impulse / expected(column) - 1.0;
        assert!(error.abs() < 1e-3, "column {column}: {error:.1e}");
    }
    let steady = &found[LANES..4 * LANES];
    let mean_of = |lane: usize| steady.iter().skip(lane).step_by(LANES).sum::<f64>() / 3.0;
    let mean = steady.iter().sum::<f64>() / steady.len() as f64;
    for lane in 0..LANES {
        assert!(
            (mean_of(lane) / mean - 1.0).abs() < 5e-4,
            "lane {lane}: {} of {mean}",
            mean_of(lane)
        );
    }
}

/// A row without its first columns is the same row. Only its last column depends on its length.
#[test]
fn rows_do_not_depend_on_where_they_begin() {
    for settings in [sparse, in_space] {
        let whole = impulses(&simulated(&settings(14)));
        for left_out in 1..=LANES {
            let part = impulses(&simulated(&settings(14 - left_out)));
            let (last, before) = part.split_last().expect("columns");
            let before = before.iter().zip(&whole);
            for (column, (one, other)) in before.chain([(last, &whole[13])]).enumerate() {
                let error = one / other - 1.0;
                assert!(
                    error.abs() < 1e-3,
                    "{left_out} columns left out, column {column}: {error:.1e}"
                );
            }
        }
    }
}

/// The broad phase and the distance to the workpiece exclude only what the search would not find:
/// results are equal to the bit. Filaments that sleep or are left out have no equations, whose
/// solution has an error.
#[test]
fn shortcuts_only_save_work() {
    let mut rubbing = sparse(9);
    rubbing.contact.friction_coefficient = 0.4;
    rubbing
        .brush
        .as_mut()
        .expect("a brush")
        .friction_coefficient = 0.3;
    let mut turning = packed(9);
    turning.process.turns = Some(Turns::Count(2));
    let brushes = [
        ("sparse", sparse(9)),
        ("rubbing", rubbing),
        ("packed", packed(16)),
        ("turning", turning),
        ("in space", in_space(9)),
    ];
    for (name, mut settings) in brushes {
        // Equal bits need no short steps.
        settings.brush.as_mut().expect("a brush").tolerance = 1e-2;
        let all = simulated(&settings);
        let unbounded = [
            Shortcuts {
                broad_phase: false,
                ..Shortcuts::ALL
            },
            Shortcuts {
                clearance: false,
                ..Shortcuts::ALL
            },
        ];
        for shortcuts in unbounded {
            let result = without(&settings, shortcuts);
            assert!(impulses(&result) == impulses(&all), "{name}, {shortcuts:?}");
            assert_eq!(result.statistics, all.statistics, "{name}, {shortcuts:?}");
        }
        settings.brush.as_mut().expect("a brush").tolerance = 3e-4;
        let all = simulated(&settings);
        let awake = [
            Shortcuts {
                sleep: false,
                ..Shortcuts::ALL
            },
            Shortcuts {
                leave_out: false,
                ..Shortcuts::ALL
            },
        ];
        for shortcuts in awake {
            let result = without(&settings, shortcuts);
            for (column, (one, other)) in impulses(&result).iter().zip(impulses(&all)).enumerate() {
                let error = one / other - 1.0;
                assert!(
                    error.abs() < 2e-4,
                    "{name}, {shortcuts:?}, filament {column}: {error:.1e}"
                );
            }
        }
    }
}
