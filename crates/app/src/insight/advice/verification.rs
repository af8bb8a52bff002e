//! The verification of a recommendation: simulations that change its depth or velocity until the
//! force is the wanted one.

use std::io;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;

use bristle::model::parameters::Parameter;
use bristle::model::settings::{Ends, Settings, Turns, UncertaintySettings};
use bristle::simulation::{Sampling, Stop};
use bristle_study::grid::{CaseResult, CaseSummary, Study, simulate_cases};
use bristle_study::input::first_file::ASSUMED_TILT_RAD;
use parking_lot::Mutex;
use serde::Serialize;

use super::limits::Limits;
use super::outcome::{OperatingPoint, Outcome};
use super::recommendation::Recommendation;
use super::suggestion::rounded;
use crate::insight::assumptions::Assumptions;
use crate::insight::rules::missing_brush;

/// Relative difference from the wanted force at which the search ends.
const FOUND: f64 = 0.01;
/// Maximum number of simulations of the search.
const MOST: usize = 4;
/// Rows of a brush in space, which repeat along the axis, and the tolerance of its impulse. With
/// tilts that nobody has measured, its filaments differ by more.
const ROWS: usize = 4;
const TOLERANCE: f64 = 1e-2;

/// Result of simulating a recommendation.
#[derive(Clone, Debug, Serialize)]
pub struct Verified {
    /// Force expected from the study, in N.
    pub expected_force_n: f64,
    /// `true` if filaments touched each other in the simulation.
    pub with_interaction: bool,
    /// Reason why the recommendation could not be simulated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// Result with tilted filaments, which leave their planes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub in_space: Option<InSpace>,
    /// Reason why the tilted filaments could not be simulated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub in_space_error: Option<String>,
}

/// The force of a brush whose filaments are tilted.
#[derive(Clone, Debug, Serialize)]
pub struct InSpace {
    /// Standard deviation of the tilts in rad.
    pub lateral_tilt_std_rad: f64,
    /// `true` if the input file does not state the deviation.
    pub is_assumed: bool,
    /// `F_n,w` in N.
    pub tool_contact_normal_force_n: f64,
    /// Its standard error in N, from the scatter over the filaments that count.
    pub standard_error_n: f64,
}

/// Simulates one case; `None` after a stop.
fn simulated(
    settings: &Settings,
    threads: Option<NonZeroUsize>,
    stop: &Stop,
) -> io::Result<Option<CaseResult>> {
    let study = match Study::new(settings.clone(), Vec::new()) {
        Ok(study) => study,
        Err(error) => return Ok(Some(Err(error.to_string()))),
    };
    let result = Mutex::new(None);
    let keep = |_, done| {
        *result.lock() = Some(done);
        ControlFlow::Continue(())
    };
    simulate_cases(
        &study,
        &[0],
        threads,
        stop,
        Sampling::default(),
        |_, _| {},
        keep,
    )?;
    Ok(result.into_inner())
}

impl Recommendation {
    /// Simulates the recommendation, with contact between filaments where they touch. Changes the
    /// depth, or else the velocity, until the force is the target, or its whole uncertainty is
    /// within the limit. Then simulates in space if filaments touch. After a stop, the
    /// recommendation stays unverified.
    ///
    /// # Errors
    /// If threads cannot be started.
    pub(super) fn verify(
        &mut self,
        limits: &Limits,
        threads: Option<NonZeroUsize>,
        stop: &Stop,
    ) -> io::Result<()> {
        let mut settings = self.settings.clone();
        if let Some(brush) = missing_brush(&settings) {
            settings.brush = Some(brush);
            // Neighbours decide how filaments arrive, and the band is that of the study, from brush
            // to brush.
            settings.process.turns = Some(Turns::Count(1));
            settings.uncertainty = UncertaintySettings::default();
        }
        let expected = self.outcome.clone();
        let mut verified = Verified {
            expected_force_n: expected.tool_contact_normal_force_n,
            with_interaction: settings.brush.is_some(),
            error: None,
            in_space: None,
            in_space_error: None,
        };
        let Some(changed) = Parameter::find(self.changed) else {
            return Ok(());
        };
        let goal = Goal::of(limits);
        // The value and what came out before, and the best ones, by how much they miss the goal.
        let mut before: Option<[f64; 2]> = None;
        let mut best: Option<(f64, Settings, Outcome, CaseSummary)> = None;
        for _ in 0..MOST {
            let summary = match simulated(&settings, threads, stop)? {
                Some(Ok(summary)) => summary,
                Some(Err(error)) => {
                    verified.error = best.is_none().then_some(error);
                    break;
                }
                None => return Ok(()),
            };
            let outcome = expected.simulated_as(&settings, &summary);
            let (value, reached, miss) = (
                changed.get(&settings),
                goal.reached(&outcome),
                goal.miss(&outcome),
            );
            if best.as_ref().is_none_or(|(least, ..)| miss < *least) {
                best = Some((miss, settings.clone(), outcome, summary));
            }
            if miss == 0.0 || reached <= 0.0 {
                break;
            }
            let next = match before {
                Some([value_before, reached_before]) if reached_before != reached => {
                    value
                        + (goal.aim() - reached) * (value - value_before)
                            / (reached - reached_before)
                }
                _ => value * goal.aim() / reached,
            };
            before = Some([value, reached]);
            // As finely as machines are set.
            let next = rounded(next.clamp(0.5 * value, 2.0 * value), f64::round);
            changed.set(&mut settings, next);
            if next == value
                || settings.check().is_err()
                || !limits.allow_point(&OperatingPoint::of(&settings))
            {
                break;
            }
        }
        if let Some((_, settings, outcome, summary)) = best {
            (self.place, self.outcome, self.settings) =
                (OperatingPoint::of(&settings), outcome, settings);
            self.weigh(limits);
            if !limits.allow(&self.place, &self.outcome) || !limits.hold_with_band(&self.outcome) {
                self.weaknesses
                    .push("beyond the limits, once simulated".to_owned());
            }
            self.weaknesses.extend(resonance(&self.settings));
            let brush = self.settings.brush_or_default();
            let tilt = brush.lateral_tilt_std_rad;
            // A few rows stand for all of them if they repeat along the axis.
            if verified.with_interaction && (tilt > 0.0 || brush.ends == Ends::Periodic) {
                let simulated = if tilt > 0.0 {
                    Some(InSpace::of(tilt, false, 1.0, summary))
                } else {
                    in_space(&self.settings, threads, stop)?
                };
                match simulated {
                    Some(Ok(in_space)) => verified.in_space = Some(in_space),
                    Some(Err(error)) => verified.in_space_error = Some(error),
                    None => return Ok(()),
                }
            }
        }
        self.verified = Some(verified);
        Ok(())
    }
}

/// Goal of the search for a velocity or depth.
enum Goal {
    /// A force in N.
    Force(f64),
    /// An uncertainty that is within a limit in N.
    Within(f64),
    Nothing,
}

impl Goal {
    fn of(limits: &Limits) -> Self {
        let within = limits.max_force_n.map_or(Self::Nothing, Self::Within);
        limits.target_force_n.map_or(within, Self::Force)
    }

    /// Returns the force that counts, in N.
    fn reached(&self, outcome: &Outcome) -> f64 {
        if let Self::Within(_) = self {
            outcome.ends()[1]
        } else {
            outcome.central_n()
        }
    }

    /// Returns the wanted value of this force, in N.
    fn aim(&self) -> f64 {
        match self {
            Self::Force(target) => *target,
            Self::Within(limit) => (1.0 - FOUND) * limit,
            Self::Nothing => 0.0,
        }
    }

    /// Returns the share by which an outcome misses the goal; zero if it reaches the goal.
    fn miss(&self, outcome: &Outcome) -> f64 {
        let off = self.reached(outcome) / self.aim() - 1.0;
        match self {
            Self::Force(_) if off.abs() > FOUND => off.abs(),
            Self::Within(_) if off > FOUND => off,
            _ => 0.0,
        }
    }
}

/// Returns a sentence if a contact is near a resonance of its filament.
fn resonance(settings: &Settings) -> Option<String> {
    let modulus = Parameter::find("filament.youngs_modulus_pa")?;
    let change = Assumptions::of_contact(settings, &[modulus]).resonance()?.1;
    Some(format!(
        "near resonance ({:+.0} % for 10 % more modulus)",
        100.0 * change
    ))
}

impl InSpace {
    /// Creates the result of a simulated `share` of the tool with these tilts.
    fn of(
        lateral_tilt_std_rad: f64,
        is_assumed: bool,
        share: f64,
        summary: CaseSummary,
    ) -> Result<Self, String> {
        let force = summary.metrics.tool_contact_normal_force_n / share;
        let interaction = summary.brush.ok_or("it has no filaments that touch")?;
        Ok(Self {
            lateral_tilt_std_rad,
            is_assumed,
            tool_contact_normal_force_n: force,
            standard_error_n: force * interaction.impulse_error_estimate,
        })
    }
}

/// Simulates a brush whose filaments leave their planes, in a few rows that repeat along the axis.
/// Tilts that are not stated are assumed. `None` after a stop.
fn in_space(
    settings: &Settings,
    threads: Option<NonZeroUsize>,
    stop: &Stop,
) -> io::Result<Option<Result<InSpace, String>>> {
    let mut settings = settings.clone();
    let rows = settings.brush_rows();
    let share = rows.min(ROWS) as f64 / rows as f64;
    settings.tool.width_m *= share;
    settings.tool.filament_count *= share;
    let brush = settings.brush.get_or_insert_default();
    brush.rows = Some(rows.min(ROWS));
    brush.lateral_tilt_std_rad = ASSUMED_TILT_RAD;
    brush.tolerance = brush.tolerance.max(TOLERANCE);
    let simulated = simulated(&settings, threads, stop)?;
    Ok(simulated.map(|result| {
        result.and_then(|summary| InSpace::of(ASSUMED_TILT_RAD, true, share, summary))
    }))
}
