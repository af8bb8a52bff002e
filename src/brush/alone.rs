//! The filaments of a brush each alone: what interaction is measured against, and what the time
//! step is measured by.

use super::arrangement::{Arrangement, Root};
use super::error::BrushError;
use super::plan::{Plan, STRIDE, begin};
use super::sector::Account;
use super::shortcuts::Shortcuts;
use super::team::Team;
use crate::model::metrics::{ContactRecord, Metrics};
use crate::model::settings::{Settings, Turns};
use crate::simulation::{
    IntegrationError, Job, Kind, Pass, Sampling, Simulation, SimulationError, Stop, Unreachable,
    simulate_side_by_side,
};

impl From<Unreachable> for BrushError {
    fn from(error: Unreachable) -> Self {
        Self::Alone(error.into())
    }
}

impl From<SimulationError> for BrushError {
    /// That of a filament alone.
    fn from(error: SimulationError) -> Self {
        match error {
            SimulationError::Integration(IntegrationError::Stopped) => Self::Stopped,
            error => Self::Alone(error),
        }
    }
}

/// The pass of a filament with settings of its `own` on the machine that `settings` state, as in a
/// brush: body and workpiece stay where they are. It is at `s` (m) along the trim. None if it does
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

/// The mean metrics of filaments with the settings `own`, each alone and at its place along the
/// trim (m): their turns, tilts and constants are those in the brush.
///
/// # Errors
/// If one of them cannot be simulated.
pub fn metrics(
    settings: &Settings,
    own: &[(Settings, f64)],
    stop: &Stop,
    team: &Team,
) -> Result<Metrics, BrushError> {
    /// Filaments that a thread takes at once: enough to fill the lanes for most of the time.
    const AT_ONCE: usize = 64;
    type Each = Result<Metrics, SimulationError>;
    let nominal = Pass::new(settings);
    let mut results: Vec<Option<Each>> = vec![None; own.len()];
    team.run(
        own.chunks(AT_ONCE).zip(results.chunks_mut(AT_ONCE)),
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

/// A filament alone, by which the steps of a brush are tried.
pub struct Trial {
    settings: Settings,
    pass: Pass,
    /// Its error-controlled pass.
    expected: Simulation,
}

impl Trial {
    /// A filament with these settings.
    ///
    /// # Errors
    /// If its pass cannot be simulated.
    pub fn new(settings: Settings) -> Result<Self, BrushError> {
        let pass = Pass::deepest(&settings);
        let expected = pass.simulate(Sampling::default())?;
        Ok(Self {
            settings,
            pass,
            expected,
        })
    }

    /// Its pass.
    pub fn pass(&self) -> &Pass {
        &self.pass
    }

    /// The largest relative error of an impulse of a turn in steps of `length` (s) that end with
    /// corrections of `tolerance` (m/s), and that may lack the share `lacking` of the energy.
    /// Infinite if that is not possible.
    pub fn error(&self, length: f64, tolerance: f64, lacking: f64) -> f64 {
        let Self {
            settings,
            pass,
            expected,
        } = self;
        let root = Root {
            column: 0,
            row: 0,
            angle: 0.0,
            z: pass.tool().tool.height,
        };
        let arrangement = Arrangement {
            columns: 1,
            rows: 1,
            around: 1.0,
            roots: vec![root],
            period: None,
        };
        let own = [settings.clone()];
        let plan = Plan {
            settings,
            pass,
            arrangement: &arrangement,
            own: &own,
            form: pass.form(),
            points: 0,
            begin: begin(pass, &arrangement, &own, &|_| None),
            tolerance,
            lacking,
            shortcuts: Shortcuts::ALL,
        };
        let impulses = &expected.turn_contact_normal_impulses_n_s;
        let scale = impulses
            .iter()
            .fold(0.0, |largest: f64, impulse| largest.max(*impulse));
        let Some(found) = turn_impulses(&plan, length, impulses.len()) else {
            return f64::INFINITY;
        };
        let difference = |(found, expected): (&f64, &f64)| {
            let scale = if *expected > 0.0 { *expected } else { scale };
            // Where only one of both touches, all of it is wrong.
            let whole = if scale > 0.0 { scale } else { *found };
            if found == expected {
                0.0
            } else {
                (found - expected).abs() / whole
            }
        };
        found
            .iter()
            .zip(impulses)
            .map(difference)
            .fold(0.0, f64::max)
    }
}

/// The contact normal impulses in N s of the turns of the only filament, in steps of `length` (s).
/// `None` if a step is not possible.
fn turn_impulses(plan: &Plan<'_>, length: f64, turns: usize) -> Option<Vec<f64>> {
    let pass = plan.pass;
    let mut sector = plan.sector(&[0], None);
    let is_single = turns == 1 && pass.turns() == Turns::Count(1);
    let end = if is_single {
        pass.end_time()
    } else {
        turns as f64 * pass.turn_time()
    };
    let steps = ((end - plan.begin) / length).ceil() as usize;
    let most = steps + (pass.turn_time() / length).ceil() as usize;
    for step in 1..=most {
        if step > steps && !(is_single && sector.accounts().iter().any(Account::is_touching)) {
            break;
        }
        sector
            .advance(plan.begin + step as f64 * length, length)
            .ok()?;
        // As a run does, so that a brush of one filament takes the same steps to the last digit.
        if step % STRIDE == 0 || step == steps {
            sector.forget();
        }
    }
    Some(sector.accounts()[0].turns(turns == 1).to_vec())
}
