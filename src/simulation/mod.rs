//! One filament's pass over the workpiece: integration through located contact events.

use crate::contact::ContactLaw;
use crate::equations::Chain;
use crate::integrate::tableau::{ESDIRK54, Tableau};
use crate::integrate::{IntegrationError, Statistics, Tolerances};
use crate::model::filament;
use crate::model::metrics::{ContactRecord, Metrics, NominalContact};
use crate::model::record::Record;
use crate::model::settings::Settings;
use crate::tool::RoundTool;
use crate::workpiece::Plane;

mod observers;
mod search;
mod side_by_side;
mod system;
mod trajectory;

pub use observers::{Sample, Sampling, Shape};
pub use side_by_side::{Case, Kind, sample_side_by_side, simulate_side_by_side};
pub use system::{ContactLoads, Filament, FilamentState, FilamentSystem, integral};
pub use trajectory::{Step, Trajectory, integrate};

use observers::{ContactObserver, Sampler};

/// The method of every pass (docs/integrators.md).
const METHOD: &Tableau = &ESDIRK54;

/// SHA-256 of all code between settings and metrics, in hexadecimal digits: builds that differ here may differ in a result.
pub const SOLVER_FINGERPRINT: &str = env!("BRISTLE_SOLVER");

/// The result of a pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulation {
    /// The metrics of the contact.
    pub metrics: Metrics,
    /// Work done.
    pub statistics: Statistics,
    /// Equally spaced samples, if they were asked for.
    pub history: Vec<Sample>,
    /// The filament at equally spaced times, if that was asked for.
    pub shapes: Vec<Shape>,
}

/// Why a pass could not be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// The integration stopped.
    #[error(transparent)]
    Integration(#[from] IntegrationError),
    /// A metric or a sample is infinite or not a number.
    #[error("the results of the pass are not finite; are the settings of extreme size?")]
    NotFinite,
}

/// Simulates one pass and reduces it to its metrics.
///
/// # Errors
/// If the integration cannot go on; nothing is returned that is not finite.
pub fn simulate(settings: &Settings) -> Result<Simulation, SimulationError> {
    simulate_with(settings, Sampling::default())
}

/// Simulates one pass and samples it at `samples` equally spaced times, the first and the last instant included.
///
/// The metrics are those of [`simulate`], to the tolerance: the samples are interpolated between steps and change
/// nothing.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_with_history(settings: &Settings, samples: usize) -> Result<Simulation, SimulationError> {
    simulate_with(settings, Sampling { samples, ..Sampling::default() })
}

/// Simulates one pass and reads off its steps what `sampling` asks for; see [`simulate_with_history`].
///
/// # Errors
/// As [`simulate`].
pub fn simulate_with(settings: &Settings, sampling: Sampling) -> Result<Simulation, SimulationError> {
    Pass::new(settings).run(sampling)
}

/// One pass of the filament of a round tool over a plane: what [`simulate`] integrates.
#[derive(Clone, Debug)]
pub struct Pass {
    chain: Chain<f64>,
    tool: RoundTool,
    law: ContactLaw,
    plane: Plane,
    nominal: NominalContact,
    filament_length: f64,
    filament_count: f64,
    tolerances: Tolerances,
    lead_angle: f64,
    tail_angle: f64,
}

impl Pass {
    /// The pass that `settings` state.
    pub fn new(settings: &Settings) -> Self {
        let Settings { tool, filament, contact, workpiece, process, solver, uncertainty: _ } = settings;
        let nominal = NominalContact::of(settings);
        let [x, y, _] = workpiece.normal;
        // The tips are deepest opposite to the normal; for the default plane that is β = −π/2.
        let deepest = (-y).atan2(-x);
        // A rate that is small for a vibrating filament, so that a slow tool does not ask for absurd digits.
        let slow_rate = 0.01 * filament::first_natural_frequency(filament);
        Self {
            chain: filament::chain(filament, process.gravity_m_s2),
            tool: RoundTool {
                body_radius: tool.body_radius_m,
                rate: nominal.rate(),
                initial_angle: deepest - nominal.contact_angle() / 2.0 - process.lead_angle_rad,
            },
            law: ContactLaw::from(contact),
            plane: Plane::of(workpiece, nominal.tool_radius, process.penetration_depth_m),
            nominal,
            filament_length: filament.length_m,
            filament_count: tool.filament_count,
            tolerances: Tolerances {
                relative: solver.relative_tolerance,
                angle_scale: 1.0,
                rate_scale: (nominal.brushing_velocity / filament.length_m).max(slow_rate),
            },
            lead_angle: process.lead_angle_rad,
            tail_angle: process.tail_angle_rad,
        }
    }

    /// The workpiece.
    pub fn workpiece(&self) -> &Plane {
        &self.plane
    }

    /// The motion of the tool.
    pub fn tool(&self) -> &RoundTool {
        &self.tool
    }

    /// The filament and what it meets; see [`FilamentSystem::new`].
    pub fn system(&self, tracks_energy: bool) -> FilamentSystem<RoundTool, Plane> {
        FilamentSystem::side_by_side(vec![self.filament()], tracks_energy)
    }

    /// The filament and what it meets, with the integrals that `sampling` needs.
    fn system_for(&self, sampling: Sampling) -> FilamentSystem<RoundTool, Plane> {
        self.system(sampling.tracks_energy()).tracking_dissipation(sampling.tracks_dissipation())
    }

    /// The start: straight, turning rigidly with the body, at time zero.
    pub fn start(&self, system: &mut FilamentSystem<RoundTool, Plane>) -> FilamentState {
        let n = self.chain.segments;
        let q = vec![[std::f64::consts::FRAC_PI_2, self.tool.initial_angle]; n];
        system.state(0.0, q, vec![[0.0, self.tool.rate]; n])
    }

    /// Time of nominal entry, of nominal exit, and of the end, in s.
    pub fn times(&self) -> [f64; 3] {
        let exit = self.lead_angle + self.nominal.contact_angle();
        [self.lead_angle, exit, exit + self.tail_angle].map(|angle| angle / self.tool.rate)
    }

    /// Integrates the pass in `system` from `start` to its end; see [`integrate`].
    ///
    /// # Errors
    /// If a step cannot be taken.
    pub fn integrate(
        &self,
        system: &mut FilamentSystem<RoundTool, Plane>,
        start: FilamentState,
        observe: impl FnMut(&Step<'_>),
    ) -> Result<(FilamentState, Statistics), IntegrationError> {
        let [_, _, end_time] = self.times();
        integrate(system, start, end_time, METHOD, self.tolerances, observe)
    }

    /// The filament, and what it meets.
    fn filament(&self) -> Filament<RoundTool, Plane> {
        Filament { chain: self.chain, motion: self.tool, law: self.law, workpiece: self.plane }
    }

    fn observer(&self) -> ContactObserver<RoundTool, Plane> {
        let [nominal_entry, nominal_exit, _] = self.times();
        ContactObserver {
            filament: self.filament(),
            filament_length: self.filament_length,
            nominal_entry,
            nominal_exit,
            record: ContactRecord::default(),
            was_closed: false,
            seen_until: f64::NAN,
            deflection_there: 0.0,
        }
    }

    fn sampler(&self, sampling: Sampling) -> Sampler {
        let [_, _, end_time] = self.times();
        Sampler::new(self.chain, sampling, end_time)
    }

    /// The start of a trajectory in `system`.
    fn trajectory(&self, system: &mut FilamentSystem<RoundTool, Plane>) -> Trajectory {
        let start = self.start(system);
        let [_, _, end_time] = self.times();
        Trajectory::new(system, start, end_time, METHOD, self.tolerances)
    }

    fn conclude(
        &self,
        record: &ContactRecord,
        statistics: Statistics,
        sampler: Sampler,
    ) -> Result<Simulation, SimulationError> {
        let metrics = Metrics::new(&self.nominal, record, self.filament_count);
        let Sampler { mut history, mut shapes, sampling, .. } = sampler;
        let finite = history.iter().all(Sample::is_finite) && shapes.iter().all(Shape::is_finite);
        if !metrics.is_finite() || !(finite || sampling.alongside) {
            return Err(SimulationError::NotFinite);
        }
        if !finite {
            history.clear();
            shapes.clear();
        }
        Ok(Simulation { metrics, statistics, history, shapes })
    }

    fn run(&self, sampling: Sampling) -> Result<Simulation, SimulationError> {
        let mut system = self.system_for(sampling);
        let start = self.start(&mut system);
        let mut observer = self.observer();
        let mut sampler = self.sampler(sampling);
        let (_, statistics) = self.integrate(&mut system, start, |step| {
            observer.observe(step);
            sampler.observe(step, &observer);
        })?;
        self.conclude(&observer.record, statistics, sampler)
    }
}
