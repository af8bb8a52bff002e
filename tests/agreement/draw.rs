//! Random settings of brushes that can be built, and simplifications of them.

use std::f64::consts::TAU;

use bristle::model::settings::{
    ChamferSettings, EdgeSettings, FilamentSettings, ProcessSettings, ProfileSettings,
    RoundSettings, Settings, Side, ToolSettings, Turns, WorkpieceKind, WorkpieceSettings,
};
use fastrand::Rng;

/// Draws a number between two positive ones, evenly by its logarithm.
pub fn between(random: &mut Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(random.f64())
}

/// Draws a number from `−largest` to `largest`.
pub fn about_zero(random: &mut Rng, largest: f64) -> f64 {
    largest * (2.0 * random.f64() - 1.0)
}

/// `true` once in `times`.
pub fn once_in(random: &mut Rng, times: usize) -> bool {
    random.usize(..times) == 0
}

/// Draws settings of one filament alone that fit together.
pub fn settings(random: &mut Rng) -> Settings {
    loop {
        let settings = proposal(random);
        if settings.check().is_ok() {
            return settings;
        }
    }
}

fn proposal(random: &mut Rng) -> Settings {
    let length = between(random, 0.01, 0.08);
    // Modulus (Pa), density (kg/m³) and slenderness l_f/d of polymers, brass and steel.
    let [modulus, density, slenderness] = match random.usize(..6) {
        0 => [1.0e11, 8500.0, between(random, 60.0, 200.0)],
        1 => [2.1e11, 7850.0, between(random, 60.0, 200.0)],
        _ => [
            between(random, 8e8, 8e9),
            between(random, 900.0, 2000.0),
            between(random, 25.0, 80.0),
        ],
    };
    let mut filament = FilamentSettings::new(length, length / slenderness);
    filament.segments = *random
        .choice(&[1, 2, 3, 4, 4, 6, 6, 8, 8, 12, 25])
        .expect("numbers of segments");
    (filament.youngs_modulus_pa, filament.density_kg_m3) = (modulus, density);
    filament.damping_ratio = between(random, 0.01, 0.2);
    if once_in(random, 5) {
        filament.tip_diameter_m = Some(filament.diameter_m * between(random, 0.4, 1.5));
    }
    if once_in(random, 5) {
        filament.waviness_amplitude_m = about_zero(random, 0.02 * length);
        filament.waviness_length_m = Some(length * between(random, 0.4, 2.0));
        filament.waviness_phase_rad = TAU * random.f64();
    }
    if once_in(random, 6) {
        filament.lateral_tilt_rad = about_zero(random, 0.2);
    }
    let depth = (length * between(random, 0.008, 0.15)).max(1e-4);
    let mut process = ProcessSettings::new(between(random, 1.5, 40.0), depth);
    if once_in(random, 4) {
        process.gravity_m_s2 = [about_zero(random, 9.81), -9.81, 0.0];
    }
    let tool = ToolSettings::new(between(random, 0.02, 0.2), 0.02, 10_000.0);
    let mut settings = Settings::new(tool, filament, process);
    contact(&mut settings, random);
    settings.workpiece.kind = workpiece(&settings, random);
    if once_in(random, 5) {
        settings.workpiece.feed_velocity_m_s = about_zero(random, 0.5);
    }
    settings
}

fn contact(settings: &mut Settings, random: &mut Rng) {
    let contact = &mut settings.contact;
    contact.stiffness_n_m = between(random, 1e4, 1e6);
    if once_in(random, 5) {
        // The law is as stiff as a linear one at a tenth of a millimetre.
        contact.exponent = 1.0 + random.f64();
        contact.stiffness_n_m *= 1e-4_f64.powf(1.0 - contact.exponent);
    }
    if once_in(random, 4) {
        contact.damping_s_m = random.f64();
    }
    if once_in(random, 5) {
        contact.radius_m = between(random, 0.05, 1.0) * settings.filament.diameter_m;
    }
    if once_in(random, 2) {
        contact.friction_coefficient = between(random, 0.05, 0.6);
    }
}

/// Draws a workpiece of any kind, within the reach of the tool.
fn workpiece(settings: &Settings, random: &mut Rng) -> WorkpieceKind {
    let (radius, depth) = (
        settings.tool_radius_m(),
        settings.process.penetration_depth_m,
    );
    let half_length = (2.0 * radius * depth).sqrt();
    let kinds = [
        "plane", "edge", "edge", "chamfer", "cylinder", "bore", "profile",
    ];
    let kind = random.choice(kinds).expect("kinds of workpiece");
    if kind == "plane" {
        return WorkpieceKind::default();
    }
    let offset_m = about_zero(random, 0.8 * half_length);
    match kind {
        "cylinder" => WorkpieceKind::Cylinder(RoundSettings {
            offset_m,
            radius_m: between(random, 5e-3, 0.5),
        }),
        "bore" => {
            let radius_m = radius * (1.0 + between(random, 0.05, 3.0));
            WorkpieceKind::Bore(RoundSettings { offset_m, radius_m })
        }
        "profile" => {
            let degree = random.usize(2..=4);
            let pitch = between(random, 0.1, 0.6) * half_length;
            let count = ((1.3 * radius / pitch) as isize).min(60);
            let bump = 0.15 * pitch.min(depth);
            // The outermost points are beyond the reach of the tool.
            let control_points_m = (-count..=count)
                .map(|k| {
                    let beyond = if k.abs() == count {
                        2.0 * radius / (count as f64 * pitch)
                    } else {
                        1.0
                    };
                    [beyond * k as f64 * pitch, about_zero(random, bump)]
                })
                .collect();
            WorkpieceKind::Profile(ProfileSettings {
                offset_m,
                degree,
                control_points_m,
                closed: false,
            })
        }
        _ => {
            let edge_radius_m = between(random, 1e-4, 4e-3);
            let included_angle_rad = 1.0 + 1.2 * random.f64();
            let side = if random.bool() {
                Side::Leaving
            } else {
                Side::Entering
            };
            if kind == "edge" {
                return WorkpieceKind::Edge(EdgeSettings {
                    offset_m,
                    included_angle_rad,
                    edge_radius_m,
                    side,
                });
            }
            WorkpieceKind::Chamfer(ChamferSettings {
                offset_m,
                included_angle_rad,
                edge_radius_m,
                side,
                chamfer_width_m: between(random, 1e-3, 1.5e-2),
                chamfer_angle_rad: 0.1 + 1.2 * random.f64(),
            })
        }
    }
}

/// A change that removes a part of the settings.
type Simplification = fn(&mut Settings);

/// Simplifications that are tried one after the other, to find the settings that a failure needs.
pub const SIMPLIFICATIONS: &[Simplification] = &[
    |settings| settings.contact.friction_coefficient = 0.0,
    |settings| settings.contact.damping_s_m = 0.0,
    |settings| {
        let contact = &mut settings.contact;
        contact.stiffness_n_m *= 1e-4_f64.powf(contact.exponent - 1.0);
        contact.exponent = 1.0;
    },
    |settings| settings.contact.radius_m = 0.0,
    |settings| settings.filament.tip_diameter_m = None,
    |settings| {
        let filament = &mut settings.filament;
        (
            filament.waviness_amplitude_m,
            filament.waviness_phase_rad,
            filament.waviness_length_m,
        ) = (0.0, 0.0, None);
    },
    |settings| settings.filament.lateral_tilt_rad = 0.0,
    |settings| settings.process.gravity_m_s2 = [0.0; 3],
    |settings| settings.workpiece.feed_velocity_m_s = 0.0,
    |settings| settings.workpiece = WorkpieceSettings::default(),
    |settings| settings.process.turns = None,
    |settings| {
        if settings.process.turns().at_most() > 2 {
            settings.process.turns = Some(Turns::Count(2));
        }
    },
    |settings| settings.filament.segments = settings.filament.segments.min(4),
    |settings| settings.filament.segments = settings.filament.segments.min(2),
    |settings| settings.filament.segments = 1,
];
