//! Rotating beams.

use std::f64::consts::{FRAC_PI_2, PI};

use bristle::equations::{Chain, Clamp};
use bristle::integrate::Tolerances;
use bristle::integrate::tableau::ESDIRK54;
use bristle::model::filament::{chain, first_natural_frequency};
use bristle::model::settings::FilamentSettings;
use bristle::simulation::integrate;
use bristle::tool::{ClampMotion, radial_clamp};
use serde::Deserialize;

use super::chains::{
    extrapolated, extrapolated_twice, lesser, paper_case, trajectory_rows, unit_beam, unit_chain,
    untouched, worse,
};
use super::exact::beam::cantilever_root;
use super::exact::rotating_beam::{RotatingBeam, southwell};
use super::small_motion::{Direction, modes};
use super::trial::{Failure, Outcome, Trial};
use super::{sources, tolerances};

/// Numbers of segments of the extrapolated solutions.
const SEGMENTS: [usize; 3] = [25, 50, 100];
/// Number of modes compared.
const MODES: usize = 3;

/// The first frequencies of a chain that turns at `speed` on a hub of the radius `hub`.
fn chain_frequencies(
    chain: Chain<f64>,
    speed: f64,
    hub: f64,
    direction: Direction,
) -> [f64; MODES] {
    let modes = modes(chain, &radial_clamp(hub, 0.3, speed, 0.0), speed, direction);
    std::array::from_fn(|i| modes.get(i).map_or(f64::NAN, |mode| mode.frequency))
}

/// Flap and lag frequencies of a cantilever that turns at Ω on a hub of radius r (in L).
///
/// `w⁗ − (T w′)′ = ω² w` with `T = Ω² [½ (1 − ξ²) + r (1 − ξ)]`, by Ritz's method. The squares of
/// flap and lag differ by Ω² for a chain of any n. The first flap lies within Southwell's bounds.
pub fn frequencies(trial: &mut Trial) -> Outcome {
    const DIRECTIONS: [(Direction, &str); 2] =
        [(Direction::OutOfPlane, "flap"), (Direction::InPlane, "lag")];
    let paper = paper_case(25, 30.0, 1e-3)?;
    let ratio = paper.tool.body_radius_m / paper.filament.length_m;
    let hubs: [(f64, &str, &[f64]); 2] = [
        (0.0, "r = 0", &[0.0, 1.0, 2.0, 4.0, 8.0, 12.0]),
        (ratio, "r = r_g", &[1.0, 2.0, 4.0, 8.0]),
    ];
    for (hub, hub_name, speeds) in hubs {
        let of_beam = |speed: f64, direction| {
            let beam = RotatingBeam { speed, hub };
            if direction == Direction::OutOfPlane {
                beam.flap()
            } else {
                beam.lag()
            }
        };
        for &speed in speeds {
            let at = |segments: usize, direction| {
                chain_frequencies(unit_chain(segments), speed, hub, direction)
            };
            for (direction, name) in DIRECTIONS {
                let exact = of_beam(speed, direction);
                let computed = SEGMENTS.map(|segments| at(segments, direction));
                for i in 0..MODES {
                    let of_mode = computed.map(|frequencies| frequencies[i]);
                    let limit = extrapolated_twice(of_mode);
                    let subject = format!("{name} {}, Ω = {speed}, {hub_name}, n → ∞", i + 1);
                    trial.check(
                        subject,
                        "ω",
                        exact[i],
                        sources::WRIGHT,
                        limit,
                        tolerances::FREQUENCY,
                    );
                    if i == 0 && direction == Direction::OutOfPlane && speed > 0.0 {
                        let square = |factor: f64| {
                            (cantilever_root(1).powi(4) + factor * speed * speed).sqrt()
                        };
                        let bounds = [square(1.0), square(southwell(hub))];
                        let subject = format!("flap 1, Ω = {speed}, {hub_name}, n → ∞");
                        trial.check(
                            subject,
                            "ω",
                            bounds,
                            sources::SOUTHWELL,
                            limit,
                            tolerances::SOUTHWELL,
                        );
                    }
                    if i == 0 {
                        let subject = format!(
                            "{name} 1, Ω = {speed}, {hub_name}, n = {}, {}",
                            SEGMENTS[1], SEGMENTS[2]
                        );
                        trial.check_order(
                            subject,
                            "order of ω",
                            [of_mode[1], of_mode[2]],
                            exact[i],
                        );
                    }
                }
            }
            if speed > 0.0 {
                let [flap, lag] = DIRECTIONS.map(|(direction, _)| at(25, direction)[0]);
                let computed = (flap.powi(2) - lag.powi(2)) / speed.powi(2);
                let subject = format!("mode 1, Ω = {speed}, {hub_name}, n = 25");
                trial.check(
                    subject,
                    "(ω_flap² − ω_lag²)/Ω²",
                    1.0,
                    sources::EXACT,
                    computed,
                    tolerances::DIFFERENCES,
                );
            }
        }
    }
    check_paper_brush(trial)?;
    Ok(())
}

/// The paper's brush at its highest velocity.
fn check_paper_brush(trial: &mut Trial) -> Result<(), Failure> {
    let settings = paper_case(25, 30.0, 1e-3)?;
    let length = settings.filament.length_m;
    let speed = settings.process.brushing_velocity_m_s / (settings.tool.body_radius_m + length);
    let unit = first_natural_frequency(&settings.filament) / cantilever_root(1).powi(2);
    let flap = |segments: usize| {
        let filament = FilamentSettings {
            segments,
            ..settings.filament.clone()
        };
        let chain = chain(&filament, [0.0; 3]);
        chain_frequencies(
            chain,
            speed,
            settings.tool.body_radius_m,
            Direction::OutOfPlane,
        )[0] / unit
    };
    let exact = RotatingBeam {
        speed: speed / unit,
        hub: settings.tool.body_radius_m / length,
    }
    .flap()[0];
    let (subject, computed) = (
        "the paper's brush at 30 m/s, n → ∞",
        extrapolated_twice(SEGMENTS.map(flap)),
    );
    trial.check(
        subject,
        "ω of flap 1",
        exact,
        sources::WRIGHT,
        computed,
        tolerances::FREQUENCY,
    );
    Ok(())
}

/// A clamp at the axis that is accelerated to 6 rad/s in 15 s (Simo and Vu-Quoc 1986).
#[derive(Clone, Copy, Debug)]
struct SpinUp;

impl SpinUp {
    /// ψ, ψ̇ and ψ̈ at `time`.
    fn angle(time: f64) -> [f64; 3] {
        const DURATION: f64 = 15.0;
        if time >= DURATION {
            return [6.0 * time - 45.0, 6.0, 0.0];
        }
        let (rate, wave) = (6.0 / DURATION, 2.0 * PI / DURATION);
        let (sin, cos) = (wave * time).sin_cos();
        [
            rate * (time * time / 2.0 + (cos - 1.0) / (wave * wave)),
            rate * (time - sin / wave),
            rate * (1.0 - cos),
        ]
    }
}

impl ClampMotion for SpinUp {
    fn at(&self, time: f64) -> Clamp<f64> {
        let [angle, rate, acceleration] = Self::angle(time);
        radial_clamp(0.0, angle, rate, acceleration)
    }
}

/// A row of the spin-up.
#[derive(Deserialize)]
struct SpinUpRow {
    time_s: f64,
    tip_along_m: f64,
    tip_across_m: f64,
}

/// Tip of the beam of Simo and Vu-Quoc (1986), clamped at the axis and turned by [`SpinUp`].
///
/// The published beam stretches, but the chain does not. The reference therefore has a hundred
/// times the axial stiffness; its error is 5e-6 m.
pub fn spin_up(trial: &mut Trial) -> Outcome {
    const DATA: &str = include_str!("../../../benches/peers/trajectories/spin_up.csv");
    const LENGTH: f64 = 10.0;
    let rows: Vec<SpinUpRow> = trajectory_rows(DATA)?;
    let end = rows.last().map_or(0.0, |row| row.time_s);
    // E I = 1.4e4 N m², ρ A = 1.2 kg/m; any diameter.
    let diameter: f64 = 0.1;
    let beam = |segments: usize| FilamentSettings {
        length_m: LENGTH,
        diameter_m: diameter,
        density_kg_m3: 1.2 / (PI * diameter.powi(2) / 4.0),
        youngs_modulus_pa: 1.4e4 / (PI * diameter.powi(4) / 64.0),
        ..unit_beam(segments)
    };
    // Tip along and across the clamp's direction, at the instants of the rows.
    let course = |segments: usize| -> Result<Vec<[f64; 2]>, Failure> {
        let mut system = untouched(chain(&beam(segments), [0.0; 3]), SpinUp);
        let start = system.state(
            0.0,
            vec![[FRAC_PI_2, 0.0]; segments],
            vec![[0.0; 2]; segments],
        );
        let tolerances = Tolerances::of_motion(1e-9, 0.1, 1.0);
        let mut course = Vec::new();
        integrate(&mut system, start, end, &ESDIRK54, tolerances, |step| {
            while let Some(row) = rows
                .get(course.len())
                .filter(|row| row.time_s <= step.end.time)
            {
                let ([x, y, _], _) =
                    step.node(segments - 1, (row.time_s - step.start.time) / step.length());
                let (sin, cos) = SpinUp::angle(row.time_s)[0].sin_cos();
                course.push([x * cos + y * sin - LENGTH, y * cos - x * sin]);
            }
        })?;
        Ok(course)
    };
    let (coarse, fine) = (course(25)?, course(50)?);
    let limit: Vec<[f64; 2]> = coarse
        .iter()
        .zip(&fine)
        .map(|(coarse, fine)| [0, 1].map(|i| extrapolated(coarse[i], fine[i])))
        .collect();
    if limit.len() != rows.len() {
        return Err("the spin-up ends before its reference".into());
    }
    let expected = |row: &SpinUpRow| [row.tip_along_m, row.tip_across_m];
    for (i, quantity) in ["tip along, over L", "tip across, over L"]
        .into_iter()
        .enumerate()
    {
        let differences = rows
            .iter()
            .zip(&limit)
            .map(|(row, limit)| (expected(row)[i] - limit[i]).abs() / LENGTH);
        let subject = format!("largest difference at {} instants, n → ∞", rows.len());
        trial.check(
            subject,
            quantity,
            0.0,
            sources::SIMO,
            differences.fold(0.0, worse),
            tolerances::SPIN_UP,
        );
    }
    let deepest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, lesser) / LENGTH;
    let (exact, computed) = (
        deepest(&mut rows.iter().map(|row| row.tip_across_m)),
        deepest(&mut limit.iter().map(|tip| tip[1])),
    );
    let subject = "n → ∞".to_owned();
    trial.check(
        subject,
        "largest lag of the tip, over L",
        exact,
        sources::SIMO,
        computed,
        tolerances::SPIN_UP,
    );
    Ok(())
}
