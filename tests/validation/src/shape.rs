//! Filaments that are neither straight nor uniform, compared with tapered and curved beams.

use bristle::equations::Chain;
use bristle::model::filament::{chain, first_natural_frequency};
use bristle::model::settings::FilamentSettings;
use bristle::tool::ClampMotion;

use super::chains::{WALL, extrapolated, extrapolated_twice, unit_beam};
use super::equilibrium::{Load, RestingChain, equilibrium};
use super::exact::taper::{first_frequency, turn_by_moment};
use super::small_motion::{Direction, modes};
use super::trial::{Failure, Trial, TrialResult};
use super::{sources, tolerances};

/// First frequency of a truncated cone, whose modes are Bessel functions of order 2.
///
/// The damping of joints refers to the frequency of the beam, which the program computes by
/// iteration.
pub fn cone(trial: &mut Trial) -> TrialResult {
    const TAPERS: [f64; 4] = [0.1, 0.3, 0.5, 0.8];
    let filament = |taper: f64, segments: usize| {
        let beam = unit_beam(segments);
        FilamentSettings {
            tip_diameter_m: Some(taper * beam.diameter_m),
            ..beam
        }
    };
    let at = |taper: f64, segments: usize, direction: Direction| {
        let modes = modes(
            chain(&filament(taper, segments), [0.0; 3]),
            &WALL.at(0.0),
            0.0,
            direction,
        );
        modes[0].frequency
    };
    for taper in TAPERS {
        let exact = first_frequency(taper);
        let of_segments = |segments: usize| at(taper, segments, Direction::InPlane);
        let computed = extrapolated_twice([25, 50, 100].map(of_segments));
        let subject = |what: &str| format!("d_tip/d = {taper}, {what}");
        let (source, tolerance) = (sources::NAGULESWARAN, tolerances::FREQUENCY);
        trial.check(subject("n → ∞"), "Ω_1", exact, source, computed, tolerance);
        trial.check_order(
            subject("n = 50, 100"),
            "order of Ω_1",
            [of_segments(50), of_segments(100)],
            exact,
        );
        let of_beam = first_natural_frequency(&filament(taper, 25));
        trial.check(
            subject("for the damping"),
            "Ω_1",
            exact,
            source,
            of_beam,
            tolerance,
        );
        let difference = at(taper, 25, Direction::OutOfPlane) / of_segments(25) - 1.0;
        let quantity = "ω out of plane over in plane − 1";
        trial.check(
            subject("n = 25"),
            quantity,
            0.0,
            sources::SYMMETRY,
            difference,
            tolerances::DIFFERENCES,
        );
    }
    Ok(())
}

/// A wavy, tapered filament of length 1.
fn wavy(segments: usize) -> FilamentSettings {
    let beam = unit_beam(segments);
    FilamentSettings {
        tip_diameter_m: Some(TAPER * beam.diameter_m),
        waviness_amplitude_m: AMPLITUDE,
        waviness_length_m: Some(WAVE),
        waviness_phase_rad: PHASE,
        ..beam
    }
}

const TAPER: f64 = 0.7;
const AMPLITUDE: f64 = 0.02;
const WAVE: f64 = 0.6;
const PHASE: f64 = 0.5;

/// The tip of the beam under an end moment: the integral of its direction, by Simpson's rule.
fn tip_of_beam(turn: f64) -> [f64; 2] {
    const PARTS: usize = 2000;
    let direction = |share: f64| {
        let slope = AMPLITUDE * std::f64::consts::TAU / WAVE
            * (std::f64::consts::TAU * share / WAVE + PHASE).cos();
        let (sin, cos) = (slope.asin() + turn_by_moment(TAPER, turn, share)).sin_cos();
        [cos, sin]
    };
    let mut tip = [0.0; 2];
    for i in 0..=2 * PARTS {
        let weight = if i == 0 || i == 2 * PARTS {
            1.0
        } else {
            [2.0, 4.0][i % 2]
        } / (6.0 * PARTS as f64);
        let [x, y] = direction(i as f64 / (2 * PARTS) as f64);
        tip = [tip[0] + weight * x, tip[1] + weight * y];
    }
    tip
}

/// Tip of a wavy, tapered filament under an end moment `M`, which adds `∫ M/(E I) ds` to the
/// relaxed angle: the integral of `(cos θ, sin θ)`.
pub fn curved(trial: &mut Trial) -> TrialResult {
    const TURNS: [f64; 4] = [0.0, 0.5, 1.0, 2.0];
    const COARSE: usize = 100;
    const FINE: usize = 200;
    let tip = |segments: usize, turn: f64| -> Result<[f64; 2], Failure> {
        let chain: Chain<f64> = chain(&wavy(segments), [0.0; 3]);
        let RestingChain { tip: [x, y, _], .. } = equilibrium(
            chain,
            Load {
                force: [0.0; 3],
                moment: turn,
            },
            16,
        )?;
        Ok([x, y])
    };
    for turn in TURNS {
        let (exact, coarse, fine) = (tip_of_beam(turn), tip(COARSE, turn)?, tip(FINE, turn)?);
        for (i, quantity) in ["x/L of the tip", "y/L of the tip"].into_iter().enumerate() {
            let computed = extrapolated(coarse[i], fine[i]);
            let subject = format!("M = {turn} E I/L, n → ∞");
            trial.check(
                subject,
                quantity,
                exact[i],
                sources::CURVED_BEAM,
                computed,
                tolerances::SHAPE,
            );
        }
        let subject = format!("M = {turn} E I/L, n = {COARSE}, {FINE}");
        trial.check_order(subject, "order of x", [coarse[0], fine[0]], exact[0]);
    }
    Ok(())
}
