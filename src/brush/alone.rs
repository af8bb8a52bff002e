//! Each filament of a brush alone: the reference of the interaction factor.

use super::error::BrushError;
use super::team::Team;
use crate::model::metrics::{ContactRecord, Metrics};
use crate::model::settings::Settings;
use crate::simulation::{
    IntegrationError, Job, Kind, Pass, SimulationError, Stop, Unreachable, simulate_side_by_side,
};

impl From<Unreachable> for BrushError {
    fn from(error: Unreachable) -> Self {
        Self::Alone(error.into())
    }
}

impl From<SimulationError> for BrushError {
    /// Converts the error of a filament alone.
    fn from(error: SimulationError) -> Self {
        match error {
            SimulationError::Integration(IntegrationError::Stopped) => Self::Stopped,
            error => Self::Alone(error),
        }
    }
}

/// Returns the pass of a filament at `s` (m) along the trim, with settings of its `own`. Body and
/// workpiece stay where they are in the brush that `settings` state. `None` if the filament does
/// not reach the workpiece.
fn pass_of(settings: &Settings, (own, s): &(Settings, f64), stop: &Stop) -> Option<Pass> {
    let mut own = Settings {
        brush: None,
        ..own.clone()
    };
    own.process.brushing_velocity_m_s = settings.angular_velocity_rad_s() * own.tool_radius_m();
    own.process.penetration_depth_m += own.reach_m() - settings.reach_m();
    (own.process.penetration_depth_m > 0.0).then(|| Pass::at(&own, *s).until(stop))
}

/// Returns the mean metrics of the filaments `own` (settings, place along the trim in m), each
/// alone. Turns, tilts and constants are those in the brush.
///
/// # Errors
/// If a filament cannot be simulated.
pub fn metrics(
    settings: &Settings,
    own: &[(Settings, f64)],
    stop: &Stop,
    team: &Team,
) -> Result<Metrics, BrushError> {
    /// Filaments per task of a thread: enough to fill the lanes for most of the time.
    const TASK_SIZE: usize = 64;
    type Each = Result<Metrics, SimulationError>;
    let nominal = Pass::new(settings);
    let mut results: Vec<Option<Each>> = vec![None; own.len()];
    team.run(
        own.chunks(TASK_SIZE).zip(results.chunks_mut(TASK_SIZE)),
        |(own, results)| {
            let mut waiting = Vec::new();
            for (number, own) in own.iter().enumerate() {
                match pass_of(settings, own, stop) {
                    Some(pass) => waiting.push(Job { number, pass }),
                    None => results[number] = Some(Ok(nominal.metrics(&ContactRecord::of_turn(1)))),
                }
            }
            let is_next =
                |kind: Option<Kind>, job: &Job| kind.is_none_or(|kind| job.pass.kind() == kind);
            let take = |kind| waiting.pop_if(|job| is_next(kind, job));
            simulate_side_by_side(take, |number, result| {
                results[number] = Some(result.map(|simulation| simulation.metrics));
            });
        },
    );
    let all = results
        .into_iter()
        .flatten()
        .collect::<Result<Vec<_>, _>>()?;
    Metrics::combined(&all).ok_or(BrushError::NoFilament)
}
