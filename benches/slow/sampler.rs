//! Seeded random settings.

use bristle::model::settings::{
    ContactSettings, FilamentSettings, ProcessSettings, Settings, SolverSettings, ToolSettings,
    UncertaintySettings, WorkpieceKind, WorkpieceSettings,
};
use fastrand::Rng;

/// A distribution of settings.
pub struct Sampler {
    /// In one word.
    pub name: &'static str,
    /// In a line.
    pub meaning: &'static str,
    /// The next settings.
    pub draw: fn(&mut Rng) -> Settings,
}

/// All of them.
pub const SAMPLERS: &[Sampler] = &[
    Sampler {
        name: "undamped",
        meaning: "ordinary brushes with ζ = 0",
        draw: undamped,
    },
    Sampler {
        name: "ordinary",
        meaning: "ordinary brushes, ζ from 1e-6 to 0.3",
        draw: damped,
    },
    Sampler {
        name: "extreme",
        meaning: "anything within the ranges of the settings",
        draw: extreme,
    },
];

/// Young's modulus in Pa and density in kg/m³: nylon 6.12, PEEK, glass, brass, steel.
const MATERIALS: [[f64; 2]; 5] = [
    [3.0e9, 1110.0],
    [3.7e9, 1320.0],
    [72.0e9, 2500.0],
    [100.0e9, 8500.0],
    [207.0e9, 7850.0],
];

/// Uniform in the logarithm.
fn spread(random: &mut Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(random.f64())
}

fn undamped(random: &mut Rng) -> Settings {
    brush(random, 0.0)
}

fn damped(random: &mut Rng) -> Settings {
    let damping_ratio = spread(random, 1e-6, 0.3);
    brush(random, damping_ratio)
}

fn brush(random: &mut Rng, damping_ratio: f64) -> Settings {
    let [youngs_modulus_pa, density_kg_m3] = MATERIALS[random.usize(0..MATERIALS.len())];
    let length_m = spread(random, 0.012, 0.08);
    let exponent = if random.bool() {
        1.0
    } else {
        1.0 + 2.0 * random.f64()
    };
    let rubs = random.bool();
    let normal = match random.usize(0..4) {
        0 => [0.0, 1.0, random.f64() - 0.5],
        _ => [0.0, 1.0, 0.0],
    };
    Settings {
        tool: ToolSettings::new(spread(random, 0.02, 0.2), 0.02, 10_500.0),
        filament: FilamentSettings {
            segments: spread(random, 1.0, 401.0) as usize,
            density_kg_m3,
            youngs_modulus_pa,
            damping_ratio,
            ..FilamentSettings::new(length_m, spread(random, 1e-4, 1.5e-3))
        },
        contact: ContactSettings {
            stiffness_n_m: spread(random, 1e3, 1e8),
            exponent,
            damping_s_m: if random.bool() {
                0.0
            } else {
                spread(random, 1e-2, 10.0)
            },
            friction_coefficient: if rubs { random.f64() } else { 0.0 },
            friction_regularisation_m_s: spread(random, 1e-4, 1e-1),
            ..ContactSettings::default()
        },
        workpiece: WorkpieceSettings {
            kind: WorkpieceKind::plane(normal),
            ..WorkpieceSettings::default()
        },
        process: ProcessSettings::new(
            spread(random, 0.1, 60.0),
            spread(random, 1e-4, 1e-2).min(0.5 * length_m),
        ),
        solver: SolverSettings::default(),
        uncertainty: UncertaintySettings::default(),
        brush: None,
        removal: None,
    }
}

fn extreme(random: &mut Rng) -> Settings {
    let sign = |random: &mut Rng| if random.bool() { 1.0 } else { -1.0 };
    let length_m = spread(random, 1e-4, 10.0);
    Settings {
        tool: ToolSettings::new(spread(random, 1e-4, 100.0), 0.02, 10_500.0),
        filament: FilamentSettings {
            segments: random.usize(1..=400),
            density_kg_m3: spread(random, 1.0, 1e6),
            youngs_modulus_pa: spread(random, 1e3, 1e13),
            damping_ratio: if random.bool() {
                0.0
            } else {
                spread(random, 1e-12, 1e3)
            },
            lateral_tilt_rad: if random.bool() {
                0.0
            } else {
                2.0 * random.f64() - 1.0
            },
            ..FilamentSettings::new(length_m, length_m * spread(random, 1e-3, 0.5))
        },
        contact: ContactSettings {
            stiffness_n_m: spread(random, 1e-3, 1e15),
            exponent: 1.0 + 3.0 * random.f64(),
            damping_s_m: if random.bool() {
                0.0
            } else {
                spread(random, 1e-6, 1e6)
            },
            radius_m: if random.bool() {
                0.0
            } else {
                0.1 * random.f64() * length_m
            },
            friction_coefficient: if random.bool() {
                0.0
            } else {
                spread(random, 1e-3, 1e2)
            },
            friction_regularisation_m_s: spread(random, 1e-9, 1e3),
        },
        workpiece: WorkpieceSettings {
            kind: WorkpieceKind::plane([
                random.f64() - 0.5,
                random.f64() - 0.5,
                if random.bool() {
                    0.0
                } else {
                    random.f64() - 0.5
                },
            ]),
            feed_velocity_m_s: sign(random) * spread(random, 1e-3, 1e2),
        },
        process: ProcessSettings {
            gravity_m_s2: [0.0, -spread(random, 1e-3, 1e3), 0.0],
            lead_angle_rad: random.f64(),
            tail_angle_rad: random.f64(),
            ..ProcessSettings::new(
                spread(random, 1e-3, 1e4),
                length_m * spread(random, 1e-4, 0.9),
            )
        },
        solver: SolverSettings {
            relative_tolerance: spread(random, 1e-10, 1e-2),
            ..SolverSettings::default()
        },
        uncertainty: UncertaintySettings::default(),
        brush: None,
        removal: None,
    }
}
