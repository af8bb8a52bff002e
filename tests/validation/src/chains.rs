//! The filaments, clamps and surfaces of the trials, and comparisons of their results.

use std::f64::consts::PI;

use bristle::contact::ContactLaw;
use bristle::equations::linear::{add, scale, sub};
use bristle::equations::{Chain, UniformChain};
use bristle::model::filament::chain;
use bristle::model::settings::{ContactSettings, FilamentSettings, Settings};
use bristle::simulation::{FilamentState, FilamentSystem, Sample, simulate_with_history};
use bristle::tool::{ClampMotion, FixedClamp};
use bristle::workpiece::{Plane, Workpiece};
use bristle_study::grid::Study;
use bristle_study::input::document::Document;
use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::trial::Failure;

/// The study of the paper, as users run it.
const STUDY: &str = include_str!("../../../examples/zirconia.toml");

/// The paper's 120 contacts.
pub fn paper_study() -> Result<Study, Failure> {
    let document = Document::parse(STUDY, "zirconia.toml")?;
    Ok(document.study()?)
}

/// The paper's filament at the brushing velocity `velocity` (m/s) and the penetration depth `depth`
/// (m).
pub fn paper_case(segments: usize, velocity: f64, depth: f64) -> Result<Settings, Failure> {
    let mut settings = paper_study()?.settings(0);
    settings.filament.segments = segments;
    settings.process.brushing_velocity_m_s = velocity;
    settings.process.penetration_depth_m = depth;
    Ok(settings)
}

/// An undamped filament with `l_f = E I = ρ A = 1`, so that its numbers match dimensionless
/// formulas.
pub fn unit_beam(segments: usize) -> FilamentSettings {
    FilamentSettings {
        segments,
        length_m: 1.0,
        diameter_m: 2.0 / PI.sqrt(),
        density_kg_m3: 1.0,
        youngs_modulus_pa: 4.0 * PI,
        tip_diameter_m: None,
        waviness_amplitude_m: 0.0,
        waviness_length_m: None,
        waviness_phase_rad: 0.0,
        lateral_tilt_rad: 0.0,
        damping_ratio: 0.0,
    }
}

/// Chain of the beam.
pub fn unit_chain(segments: usize) -> Chain<f64> {
    chain(&unit_beam(segments), [0.0; 3])
}

/// The chain without stiffness: a rope.
pub fn without_stiffness(mut chain: Chain<f64>) -> Chain<f64> {
    for link in &mut chain.links {
        link.stiffness = 0.0;
    }
    chain
}

/// Rods of length 1 m, connected in series from a fixed point. Each has the mass `mass` (kg) and
/// the moment of inertia `inertia` (kg m²) about its centre.
pub fn rods(segments: usize, mass: f64, inertia: f64, gravity: [f64; 3]) -> Chain<f64> {
    Chain::from(UniformChain {
        segments,
        length: 1.0,
        mass,
        inertia,
        root_stiffness: 0.0,
        joint_stiffness: 0.0,
        root_damping: 0.0,
        joint_damping: 0.0,
        gravity,
    })
}

/// A clamp at rest at the origin, along `x`.
pub const WALL: FixedClamp = FixedClamp {
    direction: [1.0, 0.0, 0.0],
};

/// The system of a chain without contact, with all integrals.
pub fn untouched<M: ClampMotion>(chain: Chain<f64>, motion: M) -> FilamentSystem<M, Plane> {
    let far = Plane::new([0.0, -1e6, 0.0], [0.0, 1.0, 0.0], [0.0; 3]);
    FilamentSystem::new(
        chain,
        motion,
        ContactLaw::from(&ContactSettings::default()),
        far,
        true,
    )
}

/// `E_kin + E_spring + E_grav` and the energy stored in closed contacts, in J.
pub fn mechanical_energy<M: ClampMotion, W: Workpiece>(
    system: &mut FilamentSystem<M, W>,
    state: &FilamentState,
) -> f64 {
    let energies = system.energies(state);
    energies.kinetic + energies.spring + energies.gravity + system.contact_energy(state)
}

/// Contact force in N in a slow pass, when the tool is at `angle` (rad).
pub fn force_at(settings: &Settings, angle: f64) -> Result<f64, Failure> {
    let history = simulate_with_history(settings, 10_001)?.history;
    let before = |sample: &Sample| sample.base_angle_rad < angle;
    let after = history.partition_point(before);
    let [Some(a), Some(b)] = [after.checked_sub(1), Some(after)].map(|index| history.get(index?))
    else {
        return Err("the pass does not reach the angle".into());
    };
    let [a, b] = [a, b].map(|sample| (sample.base_angle_rad, sample.contact_normal_force_n));
    Ok(a.1 + (b.1 - a.1) * (angle - a.0) / (b.0 - a.0))
}

/// The component along `z` of a vector product.
pub fn axial(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// The momentum of a filament, and its angular momentum about `z` through the origin, including the
/// rotation of the segments about their centres. `root` and `nodes` are positions and velocities.
pub fn momentum(
    chain: &Chain<f64>,
    root: [[f64; 3]; 2],
    nodes: impl IntoIterator<Item = [[f64; 3]; 2]>,
) -> ([f64; 3], f64) {
    let (mut linear, mut angular) = ([0.0; 3], 0.0);
    let [mut inner, mut inner_rate] = root;
    for (link, [outer, outer_rate]) in chain.links.iter().zip(nodes) {
        // Position and velocity of a centre are the means of those of the segment's ends.
        let (centre, rate) = (
            scale(0.5, add(inner, outer)),
            scale(0.5, add(inner_rate, outer_rate)),
        );
        let (e, e_rate) = (sub(outer, inner), sub(outer_rate, inner_rate));
        linear = add(linear, scale(link.mass, rate));
        angular += link.mass * axial(centre, rate)
            + link.inertia / chain.length.powi(2) * axial(e, e_rate);
        (inner, inner_rate) = (outer, outer_rate);
    }
    (linear, angular)
}

/// The limit of solutions whose errors fall as n⁻², from those of n and 2n (Richardson).
pub fn extrapolated(coarse: f64, fine: f64) -> f64 {
    fine + (fine - coarse) / 3.0
}

/// The limit from three solutions, of n/2, n and 2n, which also removes the error of n⁻⁴.
pub fn extrapolated_twice([half, coarse, fine]: [f64; 3]) -> f64 {
    let (first, second) = (extrapolated(half, coarse), extrapolated(coarse, fine));
    second + (second - first) / 15.0
}

/// The point between 0 and 1 at which `f` changes its sign, if it does.
pub fn crossing(f: impl Fn(f64) -> f64) -> Option<f64> {
    let (mut low, mut high) = (0.0, 1.0);
    let rises = f(low) < 0.0;
    if rises == (f(high) < 0.0) {
        return None;
    }
    for _ in 0..50 {
        let middle = (low + high) / 2.0;
        if (f(middle) < 0.0) == rises {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(low)
}

/// The larger of two errors; NaN counts as the largest.
pub fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// The smaller of two numbers; NaN counts as the smallest.
pub fn lesser(a: f64, b: f64) -> f64 {
    if a.is_nan() || a < b { a } else { b }
}

/// The rows of a trajectory committed as CSV, with comments above its header.
pub fn trajectory_rows<T: DeserializeOwned>(text: &str) -> Result<Vec<T>, Failure> {
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    Ok(reader.deserialize().collect::<Result<_, _>>()?)
}

/// The cases of a reference committed as JSON.
pub fn cases_of<T: DeserializeOwned>(text: &str) -> Result<Vec<T>, Failure> {
    #[derive(Deserialize)]
    struct ChainCases<T> {
        cases: Vec<T>,
    }

    let ChainCases { cases } = serde_json::from_str(text)?;
    Ok(cases)
}
