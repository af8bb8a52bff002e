//! Rotating beams.

use bristle::equations::Chain;
use bristle::model::filament::{chain, first_natural_frequency};
use bristle::model::settings::FilamentSettings;
use bristle::tool::radial_clamp;

use super::chains::{extrapolated_twice, paper_case, unit_chain};
use super::exact::beam::cantilever_root;
use super::exact::rotating_beam::{RotatingBeam, southwell};
use super::small_motion::{Direction, modes};
use super::trial::{Failure, Trial, TrialResult};
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
pub fn frequencies(trial: &mut Trial) -> TrialResult {
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
