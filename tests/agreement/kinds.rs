//! Kinds of pairs: how random settings become two simulations that must have the same metrics.

use std::f64::consts::{FRAC_PI_2, TAU};

use bristle::model::settings::{
    BrushSettings, ChamferSettings, EdgeSettings, ProfileSettings, Settings, Side, ToolKind, Turns,
    WorkpieceKind,
};
use fastrand::Rng;

use crate::draw::{about_zero, between, once_in};
use crate::pairs::{MAX_ERROR_RATIO, Pair, Run, at};

/// The pairs of one kind.
pub struct PairKind {
    pub name: &'static str,
    /// Number of pairs in the short run.
    pub count: usize,
    /// Adapts random settings to this kind.
    pub adapt: fn(&mut Settings, &mut Rng),
    /// Makes the pair from such settings.
    pub pair: fn(&Settings, &mut Rng) -> Pair,
}

/// All kinds.
pub const KINDS: &[PairKind] = &[
    PairKind {
        name: "tolerances",
        count: 50,
        adapt: |_, _| (),
        pair: tolerances,
    },
    PairKind {
        name: "turns-and-tolerances",
        count: 10,
        adapt: several_turns,
        pair: tolerances,
    },
    PairKind {
        name: "poses",
        count: 20,
        adapt: posed,
        pair: tolerances,
    },
    PairKind {
        name: "edges",
        count: 20,
        adapt: over_an_edge,
        pair: tolerances,
    },
    PairKind {
        name: "starts",
        count: 60,
        adapt: rests,
        pair: starts,
    },
    PairKind {
        name: "turned",
        count: 60,
        adapt: on_a_plane,
        pair: turned,
    },
    PairKind {
        name: "mirrored",
        count: 10,
        adapt: in_space,
        pair: mirrored,
    },
    PairKind {
        name: "planar-and-in-space",
        count: 30,
        adapt: planar_and_fast,
        pair: planar_and_in_space,
    },
    PairKind {
        name: "same-shapes",
        count: 60,
        adapt: on_a_plane,
        pair: same_shapes,
    },
    PairKind {
        name: "shifted",
        count: 5,
        adapt: with_profile,
        pair: shifted,
    },
    PairKind {
        name: "longer",
        count: 3,
        adapt: several_turns,
        pair: longer,
    },
    PairKind {
        name: "at-rest",
        count: 20,
        adapt: settling,
        pair: at_rest,
    },
    PairKind {
        name: "brush-of-one",
        count: 20,
        adapt: |_, _| (),
        pair: brush_of_one,
    },
    PairKind {
        name: "brush-of-one-and-turns",
        count: 2,
        adapt: several_turns_of_brushes,
        pair: brush_of_one,
    },
    PairKind {
        name: "brush-far-apart",
        count: 3,
        adapt: far_apart,
        pair: brush_far_apart,
    },
    PairKind {
        name: "brush-tolerances",
        count: 8,
        adapt: few_filaments,
        pair: brush_tolerances,
    },
    PairKind {
        name: "brush-shortcuts",
        count: 4,
        adapt: two_groups,
        pair: brush_shortcuts,
    },
];

/// Makes a filament turn rigidly until it touches, over a workpiece that is constant in time.
fn rests(settings: &mut Settings, _: &mut Rng) {
    settings.process.gravity_m_s2 = [0.0; 3];
    let filament = &mut settings.filament;
    (
        filament.waviness_amplitude_m,
        filament.waviness_phase_rad,
        filament.waviness_length_m,
    ) = (0.0, 0.0, None);
    filament.lateral_tilt_rad = 0.0;
    if !settings.workpiece.kind.is_plane() {
        settings.workpiece.feed_velocity_m_s = 0.0;
    }
}

fn on_a_plane(settings: &mut Settings, _: &mut Rng) {
    settings.workpiece.kind = WorkpieceKind::default();
}

/// Adds turns at a speed at which a turn is not much longer than a contact.
fn several_turns(settings: &mut Settings, random: &mut Rng) {
    let velocity = &mut settings.process.brushing_velocity_m_s;
    *velocity = velocity.max(between(random, 8.0, 40.0));
    settings.tool.body_radius_m = settings.tool.body_radius_m.min(0.08);
    settings.process.turns = Some(if once_in(random, 3) {
        Turns::Steady
    } else {
        Turns::Count(random.usize(2..5))
    });
    settings.filament.damping_ratio = settings.filament.damping_ratio.max(0.05);
    settings.workpiece.feed_velocity_m_s = 0.0;
    if settings.check().is_err() {
        on_a_plane(settings, random);
    }
}

/// Adds turns of a brush, whose steps are as short beside the workpiece as on it: two turns of a
/// small tool, or few until they are steady.
fn several_turns_of_brushes(settings: &mut Settings, random: &mut Rng) {
    several_turns(settings, random);
    settings.tool.body_radius_m = settings.tool.body_radius_m.min(0.03);
    match settings.process.turns() {
        Turns::Steady => settings.filament.damping_ratio = settings.filament.damping_ratio.max(0.3),
        Turns::Count(_) => settings.process.turns = Some(Turns::Count(2)),
    }
}

/// Poses the filament in the middle of the trim of a tilted round brush, a cup or a cone.
fn posed(settings: &mut Settings, random: &mut Rng) {
    let tool = &mut settings.tool;
    tool.positions = Some(1);
    tool.skew_rad = about_zero(random, 0.5);
    let tilt = about_zero(random, 0.3);
    let upright = match random.usize(..3) {
        0 => 0.0,
        1 => {
            tool.kind = ToolKind::Cup;
            FRAC_PI_2
        }
        _ => {
            tool.kind = ToolKind::Cone;
            let angle = between(random, 0.3, 1.4);
            tool.filament_angle_rad = Some(angle);
            FRAC_PI_2 - angle
        }
    };
    tool.tilt_rad = Some(upright + tilt);
}

fn in_space(settings: &mut Settings, random: &mut Rng) {
    settings.filament.lateral_tilt_rad = about_zero(random, 0.2);
    settings.process.gravity_m_s2[2] = about_zero(random, 9.81);
}

fn planar_and_fast(settings: &mut Settings, random: &mut Rng) {
    settings.filament.lateral_tilt_rad = 0.0;
    let velocity = &mut settings.process.brushing_velocity_m_s;
    *velocity = velocity.max(between(random, 8.0, 40.0));
}

/// Makes long filaments enter over round edges, so that contacts begin on a face and continue
/// around the edge.
fn over_an_edge(settings: &mut Settings, random: &mut Rng) {
    let (side, edge_radius_m) = loop {
        match &mut settings.workpiece.kind {
            WorkpieceKind::Edge(edge) => break (&mut edge.side, &mut edge.edge_radius_m),
            WorkpieceKind::Chamfer(chamfer) => {
                break (&mut chamfer.side, &mut chamfer.edge_radius_m);
            }
            _ => *settings = crate::draw::settings(random),
        }
    };
    (*side, *edge_radius_m) = (Side::Entering, between(random, 1e-3, 6e-3));
    settings.filament.damping_ratio = between(random, 0.005, 0.05);
    let velocity = &mut settings.process.brushing_velocity_m_s;
    *velocity = velocity.max(between(random, 5.0, 40.0));
}

fn with_profile(settings: &mut Settings, random: &mut Rng) {
    while !matches!(settings.workpiece.kind, WorkpieceKind::Profile(_)) {
        *settings = crate::draw::settings(random);
    }
}

/// Tilts a filament that settles before it touches.
fn settling(settings: &mut Settings, random: &mut Rng) {
    rests(settings, random);
    on_a_plane(settings, random);
    settings.filament.lateral_tilt_rad = about_zero(random, 0.4);
    settings.filament.damping_ratio = between(random, 0.3, 1.0);
    settings.process.lead_angle_rad = 3.0;
    // In half of the lead angle even the slowest of these motions decays by e^−20.
    let frequency = bristle::model::filament::first_natural_frequency(&settings.filament);
    let rate = 1.5 * 0.3 * frequency / 20.0;
    settings.process.brushing_velocity_m_s = rate * settings.tool_radius_m();
}

/// Makes filaments rest until others arrive much later.
fn far_apart(settings: &mut Settings, random: &mut Rng) {
    several_turns_of_brushes(settings, random);
    rests(settings, random);
    if once_in(random, 2) {
        settings.process.turns = Some(Turns::default());
    }
}

/// Packs filaments in half of all cases; else changes tool and filaments so that they are sparse.
/// Returns their distance at the roots in m.
fn pitch(settings: &mut Settings, random: &mut Rng) -> f64 {
    let diameter = |settings: &Settings| {
        settings
            .filament
            .diameter_m
            .max(settings.filament.tip_diameter_m())
    };
    if random.bool() {
        return diameter(settings) * between(random, 1.05, 1.5);
    }
    settings.tool.body_radius_m = settings
        .tool
        .body_radius_m
        .min(between(random, 0.015, 0.08));
    let thinner = between(random, 0.4, 1.0);
    settings.filament.diameter_m *= thinner;
    settings.filament.tip_diameter_m = settings.filament.tip_diameter_m.map(|tip| tip * thinner);
    let at_tips = diameter(settings) * between(random, 1.5, 6.0);
    let share = settings.tool.body_radius_m / settings.tool_radius_m();
    (at_tips * share).max(1.05 * diameter(settings))
}

fn few_filaments(settings: &mut Settings, random: &mut Rng) {
    let pitch = pitch(settings, random);
    // Periodic rows have the distance of columns.
    let rows = random.usize(1..4);
    settings.tool.width_m = pitch * rows as f64;
    settings.tool.filament_count =
        rows as f64 * (TAU * settings.tool.body_radius_m / pitch).floor();
    let columns = if rows == 1 { random.usize(1..4) } else { 1 };
    let mut brush = BrushSettings {
        columns: Some(columns),
        rows: Some(rows),
        steady: false,
        ..BrushSettings::default()
    };
    if once_in(random, 2) {
        brush.friction_coefficient = between(random, 0.05, 0.5);
    }
    if once_in(random, 4) {
        brush.lateral_tilt_std_rad = 1e-3;
    }
    settings.brush = Some(brush);
}

/// A row of straight filaments in more than one group of lanes, with few segments, as each pair is
/// searched.
fn two_groups(settings: &mut Settings, random: &mut Rng) {
    rests(settings, random);
    let pitch = pitch(settings, random);
    settings.filament.segments = settings.filament.segments.min(4);
    settings.filament.damping_ratio = settings.filament.damping_ratio.max(0.05);
    settings.tool.width_m = pitch;
    settings.tool.filament_count = (TAU * settings.tool.body_radius_m / pitch)
        .floor()
        .max(18.0);
    settings.process.brushing_velocity_m_s = settings.process.brushing_velocity_m_s.max(4.0);
    let mut brush = BrushSettings {
        columns: Some(random.usize(9..=12)),
        rows: Some(1),
        contact_points: Some(3),
        steady: false,
        ..BrushSettings::default()
    };
    if once_in(random, 2) {
        brush.friction_coefficient = between(random, 0.05, 0.5);
    }
    settings.brush = Some(brush);
}

fn tolerances(settings: &Settings, random: &mut Rng) -> Pair {
    let relative = between(random, 1e-7, 1e-5);
    let runs = [relative, 0.1 * relative].map(|relative| Run::Alone(at(settings, relative)));
    Pair::new(runs, MAX_ERROR_RATIO * relative)
}

fn starts(settings: &Settings, random: &mut Rng) -> Pair {
    let mut earlier = settings.clone();
    earlier.process.lead_angle_rad += 0.1 + 0.4 * random.f64();
    Pair::alone(settings, &earlier, 1e-6)
}

fn turned(settings: &Settings, random: &mut Rng) -> Pair {
    let turned_by = TAU * random.f64();
    let mut turned = settings.clone();
    let turn = |[x, y, z]: [f64; 3]| {
        let (sin, cos) = turned_by.sin_cos();
        [cos * x - sin * y, sin * x + cos * y, z]
    };
    turned.workpiece.kind = WorkpieceKind::plane(turn(settings.workpiece.kind.normal()));
    turned.process.gravity_m_s2 = turn(settings.process.gravity_m_s2);
    Pair {
        turned_by,
        ..Pair::alone(settings, &turned, 1e-6)
    }
}

fn mirrored(settings: &Settings, _: &mut Rng) -> Pair {
    let mut mirrored = settings.clone();
    mirrored.filament.lateral_tilt_rad *= -1.0;
    mirrored.process.gravity_m_s2[2] *= -1.0;
    Pair {
        is_mirrored: true,
        ..Pair::alone(settings, &mirrored, 1e-6)
    }
}

fn planar_and_in_space(settings: &Settings, _: &mut Rng) -> Pair {
    let settings = at(settings, 1e-6);
    Pair::new(
        [Run::Alone(settings.clone()), Run::InSpace(settings)],
        MAX_ERROR_RATIO * 1e-6,
    )
}

/// States a plane, or an edge, as a workpiece of another kind whose other faces are out of reach.
fn same_shapes(settings: &Settings, random: &mut Rng) -> Pair {
    let far = 3.0 * settings.tool_radius_m();
    let [mut one, mut other] = [settings.clone(), settings.clone()];
    let (side, sense) = if random.bool() {
        (Side::Leaving, 1.0)
    } else {
        (Side::Entering, -1.0)
    };
    let edge = EdgeSettings {
        side,
        edge_radius_m: between(random, 1e-4, 4e-3),
        ..EdgeSettings::default()
    };
    other.workpiece.kind = match random.usize(..3) {
        0 => WorkpieceKind::Edge(EdgeSettings {
            offset_m: sense * far,
            ..edge
        }),
        1 => WorkpieceKind::Profile(ProfileSettings {
            control_points_m: (-3..=3).map(|k| [f64::from(k) * far, 0.0]).collect(),
            degree: random.usize(1..=4),
            ..ProfileSettings::default()
        }),
        _ => {
            let bend = 0.3 + 0.9 * random.f64();
            let half_length =
                (2.0 * settings.tool_radius_m() * settings.process.penetration_depth_m).sqrt();
            let offset_m = about_zero(random, 0.8 * half_length);
            let included_angle_rad = std::f64::consts::PI - bend;
            one.workpiece.kind = WorkpieceKind::Edge(EdgeSettings {
                offset_m,
                included_angle_rad,
                ..edge
            });
            // The first corner of the chamfer is before the corner of its unchamfered faces.
            let turn = bend + 0.2;
            WorkpieceKind::Chamfer(ChamferSettings {
                offset_m: offset_m + sense * far * (turn - bend).sin() / turn.sin(),
                included_angle_rad: std::f64::consts::PI - turn,
                edge_radius_m: edge.edge_radius_m,
                side,
                chamfer_width_m: far,
                chamfer_angle_rad: bend,
            })
        }
    };
    Pair::alone(&one, &other, 1e-6)
}

fn shifted(settings: &Settings, random: &mut Rng) -> Pair {
    let mut shifted = settings.clone();
    let shift = about_zero(random, 0.05);
    if let WorkpieceKind::Profile(profile) = &mut shifted.workpiece.kind {
        profile.offset_m += shift;
        profile
            .control_points_m
            .iter_mut()
            .for_each(|[x, _]| *x -= shift);
    }
    Pair::alone(settings, &shifted, 1e-6)
}

/// Compares the first turns of runs of different length.
fn longer(settings: &Settings, random: &mut Rng) -> Pair {
    let [mut one, mut other] = [settings.clone(), settings.clone()];
    let turns = random.usize(2..4);
    (one.process.turns, other.process.turns) =
        (Some(Turns::Count(turns)), Some(Turns::Count(turns + 1)));
    Pair::alone(&one, &other, 1e-6)
}

/// Compares a settled filament, which turns rigidly and dissipates nothing in any direction, with
/// rest.
fn at_rest(settings: &Settings, _: &mut Rng) -> Pair {
    // A joint that saw the turning of the body would dissipate some hundredths of the energy of its
    // springs; a hundredth is allowed.
    Pair::new([Run::Settled(at(settings, 1e-8)), Run::AtRest], 1e-4)
}

/// A brush at its own tolerance; filaments alone are exact compared with it.
fn with_brush(settings: &Settings, brush: BrushSettings, filament_count: f64) -> Run {
    let mut settings = settings.clone();
    settings.tool.filament_count = filament_count;
    settings.brush = Some(BrushSettings {
        rows: Some(1),
        steady: false,
        ..brush
    });
    Run::Brush(settings)
}

fn brush_of_one(settings: &Settings, random: &mut Rng) -> Pair {
    let tolerance = if once_in(random, 4) { 1e-4 } else { 1e-3 };
    let brush = BrushSettings {
        columns: Some(1),
        tolerance,
        ..BrushSettings::default()
    };
    Pair::new(
        [
            with_brush(settings, brush, 100.0),
            Run::Alone(at(settings, 1e-7)),
        ],
        tolerance,
    )
}

fn brush_far_apart(settings: &Settings, _: &mut Rng) -> Pair {
    let brush = BrushSettings {
        columns: Some(2),
        ..BrushSettings::default()
    };
    let tolerance = brush.tolerance;
    // Filaments are a third of a turn apart: when thrown back, they reach neighbours an eighth of a
    // turn behind.
    Pair::new(
        [
            with_brush(settings, brush, 3.0),
            Run::Alone(at(settings, 1e-7)),
        ],
        tolerance,
    )
}

fn brush_tolerances(settings: &Settings, _: &mut Rng) -> Pair {
    let runs = [1e-3, 1e-4].map(|tolerance| {
        let mut settings = settings.clone();
        settings.brush = settings
            .brush
            .map(|brush| BrushSettings { tolerance, ..brush });
        Run::Brush(settings)
    });
    Pair::new(runs, 1.1e-3)
}

fn brush_shortcuts(settings: &Settings, _: &mut Rng) -> Pair {
    Pair::new(
        [
            Run::Brush(settings.clone()),
            Run::Exhaustive(settings.clone()),
        ],
        1e-3,
    )
}
