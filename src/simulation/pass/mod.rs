//! A pass: a filament of a tool, over a workpiece.

mod assembly;
mod rigid;

use std::f64::consts::TAU;

use super::balance::{MAX_ENERGY_RESIDUAL, energy_residual, turns_rigidly};
use super::equilibrium::RigidShape;
use super::error::{IntegrationError, SimulationError};
use super::filament::Filament;
use super::form::{FilamentEquations, Form};
use super::kind::Kind;
use super::observers::{ContactObserver, Sample, Sampler, Sampling, Shape};
use super::profile::{Ledger, ProfileCell};
use super::result::Simulation;
use super::side_by_side::simulate_one;
use super::statistics::Statistics;
use super::step::Step;
use super::stop::Stop;
use super::system::{FilamentState, FilamentSystem};
use super::trajectory::Trajectory;
use super::turns::{Itinerary, start_of_turn};
use crate::equations::PolarAxis;
use crate::equations::linear::{add, dot, scale};
use crate::integrate::StepControlError::StepTooSmall;
use crate::integrate::tableau::{ESDIRK54, Tableau};
use crate::integrate::{RejectionCause, SecondOrderSystem, Stepper, Tolerances};
use crate::model::metrics::{ContactRecord, Metrics, NominalContact, RemovalLaw};
use crate::model::pose::Pose;
use crate::model::record::Record;
use crate::model::settings::{Settings, Turns};
use crate::tool::{ClampMotion, RotaryTool, Tool, Turning};
use crate::workpiece::{Part, ProfileCells, Workpiece};
use rigid::{ANGLE_TOLERANCE_RAD, Rigid};

/// Integration method of every pass (docs/methods.md).
pub(super) const METHOD: &Tableau = &ESDIRK54;

/// Longest cell of a profile, as a share of the free length: 0.25 mm of the paper's filament.
const CELL_SHARE: f64 = 1.0 / 160.0;
/// Tolerance of a pass that is repeated, as a share of the one at which it failed.
const REFINEMENT: f64 = 0.1;

/// Pass of a filament over a workpiece, as integrated by [`simulate`](super::simulate).
///
/// A pass starts with a relaxed filament that turns rigidly with the tool, at the lead angle before
/// nominal entry. Where that filament would touch earlier, the pass starts at the lead angle before
/// its first touch: wavy filaments reach ahead of straight ones, and a contact radius makes them
/// thicker. It ends at the tail angle after nominal exit, plus the angle by which a wavy filament
/// reaches behind a straight one. If the filament still touches there, the pass ends with the
/// contact. With several [`Turns`] it ends with the last one. After each contact the filament turns
/// on, vibrates freely, and returns in its actual state.
///
/// Where tool, workpiece and gravity make the motion planar ([`Tool::is_planar`],
/// [`Workpiece::is_planar`]), it is integrated in the plane of rotation. A result then depends
/// neither on rounding nor on a rotation of the set-up about `z`.
#[derive(Clone, Debug)]
pub struct Pass<T = RotaryTool, W = Part> {
    filament: Filament<Turning<T>, W>,
    form: Form,
    nominal: NominalContact,
    /// Times in s between which the undeformed filament touches the workpiece.
    touches: Vec<[f64; 2]>,
    /// `true` if that is the whole turn. The workpiece then rises in the turn before the first.
    all_round: bool,
    setting: PassConditions,
    filament_length: f64,
    filament_count: f64,
    tolerances: Tolerances,
    lead_angle: f64,
    tail_angle: f64,
    turns: Turns,
    stop: Option<Stop>,
    /// `true` if this pass repeats one that failed at a larger tolerance.
    is_refined: bool,
}

/// Properties in which a pass differs from one of any tool over any workpiece.
#[derive(Clone, Debug)]
struct PassConditions {
    /// Pose from the tool's frame, in which everything is computed, to the frame of the workpiece.
    pose: Pose,
    /// Shape at the start; `None` if that is the relaxed one.
    shape: Option<RigidShape>,
    /// `true` if the tool comes from the settings.
    is_rotary: bool,
    /// Largest distance from the axis, in m, of filaments on a trim along which they differ.
    reach: f64,
    /// Penetration depth in m, as the settings state it.
    depth: f64,
    /// Coefficients of removal and wear.
    removal: RemovalLaw,
}

impl<T: Tool + Clone, W: Workpiece + Clone> Pass<T, W> {
    /// Returns the pass integrated in space even if it is planar.
    ///
    /// This is for comparisons: if the motion is laterally unstable, rounding decides whether the
    /// filament leaves the plane.
    #[must_use]
    pub fn in_space(self) -> Self {
        Self {
            form: Form::Spatial,
            ..self
        }
    }

    /// Lets the pass end early with [`IntegrationError::Stopped`] once `stop` is requested.
    #[must_use]
    pub fn until(self, stop: &Stop) -> Self {
        Self {
            stop: Some(stop.clone()),
            ..self
        }
    }

    /// Returns this pass at a tenth of its tolerance, if shorter steps may mend `error` and it was
    /// not refined before.
    pub(super) fn refined(&self, error: &SimulationError) -> Option<Self> {
        let is_mendable = match error {
            SimulationError::Unbalanced { .. }
            | SimulationError::Integration(IntegrationError::Jump { .. }) => true,
            // Shorter steps do not lower an estimate that stays above the tolerance.
            SimulationError::Integration(IntegrationError::Step(StepTooSmall {
                cause, ..
            })) => *cause != RejectionCause::Error,
            _ => false,
        };
        (is_mendable && !self.is_refined).then(|| Self {
            tolerances: Tolerances {
                relative: REFINEMENT * self.tolerances.relative,
                ..self.tolerances
            },
            is_refined: true,
            ..self.clone()
        })
    }

    /// Returns the form of the equations: planar if the motion is planar by symmetry.
    pub fn form(&self) -> Form {
        self.form
    }

    /// Returns the workpiece.
    pub fn workpiece(&self) -> &W {
        &self.filament.workpiece
    }

    /// Returns the pose of the tool. The pass is in the frame of the tool; samples and metrics are
    /// in the frame of the workpiece.
    pub fn pose(&self) -> &Pose {
        &self.setting.pose
    }

    /// Returns the tool and its rotation.
    pub fn tool(&self) -> &Turning<T> {
        &self.filament.motion
    }

    /// Returns the filament, its contact law and the workpiece.
    pub fn filament(&self) -> &Filament<Turning<T>, W> {
        &self.filament
    }

    /// Returns the undeformed tool's passage over the workpiece.
    pub fn nominal(&self) -> &NominalContact {
        &self.nominal
    }

    /// Returns the turns of the pass.
    pub fn turns(&self) -> Turns {
        self.turns
    }

    /// Returns the properties that passes must share with this one to be simulated side by side.
    pub fn kind(&self) -> Kind {
        Kind::new(
            self.form,
            &self.filament,
            self.integrates_work(),
            self.axis(),
        )
    }

    /// Returns the polar axis of the coordinates at the start: `x` for filaments along `z`, or
    /// nearly so. Their chart then seldom changes during a turn.
    fn axis(&self) -> PolarAxis {
        let shape = self.setting.shape.as_ref();
        let is_straight = self.filament.chain.is_relaxed_straight();
        if is_straight && shape.is_some_and(RigidShape::is_axial) {
            PolarAxis::X
        } else {
            PolarAxis::Z
        }
    }

    /// Returns the equations to integrate; see [`FilamentSystem::new`].
    pub fn system(&self, tracks_energy: bool) -> FilamentSystem<Turning<T>, W> {
        FilamentSystem::side_by_side(self.form, vec![self.filament.clone()], tracks_energy)
    }

    /// Returns the system of this pass, with the integrals that `sampling` needs.
    pub(super) fn system_for(&self, sampling: Sampling) -> FilamentSystem<Turning<T>, W> {
        self.system(self.tracks_energy(sampling))
    }

    /// Returns `true` if all energies are integrated: `sampling` needs them, or the energy balance
    /// needs the work of the clamp.
    pub(super) fn tracks_energy(&self, sampling: Sampling) -> bool {
        sampling.tracks_energy() || self.integrates_work()
    }

    /// Returns `true` if the energy balance needs the integrated work of the clamp.
    fn integrates_work(&self) -> bool {
        !turns_rigidly(&self.filament)
    }

    /// Returns the start at time zero: the filament turns rigidly with the body, relaxed or in
    /// relative equilibrium.
    pub fn start(&self, system: &mut FilamentSystem<Turning<T>, W>) -> FilamentState {
        let [q, v] = self.start_coordinates();
        system.state_about(self.axis(), 0.0, q, v)
    }

    /// Returns the coordinates and rates at the start, about `z`.
    fn start_coordinates(&self) -> [Vec<[f64; 2]>; 2] {
        let rigid = Rigid {
            filament: &self.filament,
            shape: self.setting.shape.as_ref(),
        };
        let (mut q, mut v) = rigid.coordinates(self.filament.motion.initial_angle);
        if self.form == Form::Planar {
            // Along a clamp tilted by τ: φ = π/2 − τ.
            v[0] = 0.0;
            q.iter_mut().for_each(|q| q[0] = -1.0);
        }
        let rates = vec![v; q.len()];
        [q, rates]
    }

    /// Returns the largest angular acceleration of a segment at the start, in the tool's turning
    /// frame and over its squared rate. It is zero in a relative equilibrium, and for filaments
    /// that start relaxed.
    fn equilibrium_residual(&self) -> f64 {
        if self.setting.shape.is_none() {
            return 0.0;
        }
        let start = self.start(&mut self.system(false));
        let square = self.filament.motion.rate.powi(2);
        let bends = (0..start.q.len()).map(|k| {
            let motion = [start.q[k], start.v[k], start.accelerations[k]];
            let [[x, y, _], _, bend] = start.chart.direction(motion);
            let relative = add(bend, scale(square, [x, y, 0.0]));
            dot(relative, relative).sqrt() / square
        });
        bends.fold(0.0, f64::max)
    }

    /// Returns the end of the pass in s: the end of its last turn or the tail angle of a single
    /// one. A pass can end earlier if it becomes steady, and later if the filament of a single turn
    /// still touches the workpiece.
    pub fn end_time(&self) -> f64 {
        self.tail_time().unwrap_or_else(|| {
            let turns = self.turns.at_most() + self.turns_before();
            start_of_turn(turns, self.turn_time())
        })
    }

    /// Returns the time of the tail angle in s, if a single turn ends there or with the contact that
    /// goes on. `None` if turns are whole.
    pub fn tail_time(&self) -> Option<f64> {
        (self.turns == Turns::Count(1) && !self.all_round).then(|| self.pass_time())
    }

    /// Returns the number of turns before the first that counts: one if the workpiece rises to
    /// filaments that touch it all round.
    fn turns_before(&self) -> usize {
        usize::from(self.all_round)
    }

    /// Returns the duration of a turn of the tool in s.
    pub fn turn_time(&self) -> f64 {
        TAU / self.filament.motion.rate
    }

    /// Returns the time in s from the beginning of a turn to its tail angle.
    fn pass_time(&self) -> f64 {
        if self.all_round {
            return self.turn_time();
        }
        (self.lead_angle + self.nominal.window.angle + self.tail_angle) / self.filament.motion.rate
    }

    /// Returns the times of nominal entry and nominal exit in s, in the first turn. All
    /// [touches](Pass::touches) lie between them. Without touches the tips pass the plane `y = 0`
    /// at these times.
    pub fn nominal_times(&self) -> [f64; 2] {
        match (self.touches().first(), self.touches().last()) {
            (Some([entry, _]), Some([_, exit])) => [*entry, *exit],
            _ => [0.0, self.nominal.window.angle]
                .map(|angle| (self.lead_angle + angle) / self.filament.motion.rate),
        }
    }

    /// Returns the times in s between which the undeformed filament touches the workpiece in the
    /// first turn. Touches of later turns are a whole number of turns later, also where the
    /// workpiece has moved on.
    pub fn touches(&self) -> Vec<[f64; 2]> {
        let before = start_of_turn(self.turns_before(), self.turn_time());
        self.touches
            .iter()
            .map(|touch| touch.map(|time| before + time))
            .collect()
    }

    /// Integrates all turns of the pass in `system` from `start`; see
    /// [`integrate`](super::integrate).
    ///
    /// Steps end where turns do.
    ///
    /// # Errors
    /// If a step cannot be taken.
    pub fn integrate(
        &self,
        system: &mut FilamentSystem<Turning<T>, W>,
        start: FilamentState,
        mut observe: impl FnMut(&Step<'_>),
    ) -> Result<(FilamentState, Statistics), IntegrationError> {
        let mut trajectory = self.trajectory_from(system, start);
        let mut itinerary = self.itinerary();
        let solution = system.filament(0).stage_solution();
        let mut stepper = Stepper::new(METHOD, solution, system.blocks());
        stepper.set_tolerances(0, self.tolerances);
        loop {
            trajectory.finish(system, &mut stepper, &mut observe)?;
            if !itinerary.proceed(&mut trajectory) {
                return Ok(trajectory.into_end());
            }
        }
    }

    pub(super) fn itinerary(&self) -> Itinerary {
        Itinerary::new(
            self.turns,
            self.turns_before(),
            self.turn_time(),
            self.pass_time(),
        )
    }

    /// Creates an observer that reduces the steps of the last turn of this pass to the data for its
    /// metrics.
    pub fn observer(&self) -> ContactObserver<Turning<T>, W> {
        ContactObserver::new(
            self.filament.clone(),
            self.form,
            self.filament_length,
            self.touches.clone(),
        )
        .by_turns(self.turns_before(), self.turn_time())
        .with_lateral_tilt(self.setting.shape.is_none() && self.setting.pose == Pose::UPRIGHT)
    }

    /// Computes the metrics from the record of this pass's observer.
    pub fn metrics(&self, record: &ContactRecord) -> Metrics {
        let vector_impulse = self.setting.pose.from_tool(record.vector_impulse);
        let record = ContactRecord {
            vector_impulse,
            ..*record
        };
        let metrics = Metrics::new(
            &self.nominal,
            &record,
            self.filament_count,
            &self.setting.removal,
        );
        Metrics {
            penetration_depth_m: self.setting.depth,
            ..metrics
        }
    }

    /// Simulates the pass and takes the samples that `sampling` requests.
    ///
    /// # Errors
    /// If the integration cannot continue. All numbers returned are finite.
    pub fn simulate(&self, sampling: Sampling) -> Result<Simulation, SimulationError> {
        self.simulate_telling(sampling, |_| ())
    }

    /// Simulates as [`Pass::simulate`] does, and tells after each step the share of the pass that
    /// is done, from 0 to 1. For steady turns the share assumes the largest number of turns. If
    /// they are sampled, a first run finds their end.
    ///
    /// # Errors
    /// As for [`Pass::simulate`].
    pub fn simulate_telling(
        &self,
        sampling: Sampling,
        mut tell: impl FnMut(f64),
    ) -> Result<Simulation, SimulationError> {
        let mut share = 0.0_f64;
        simulate_one(self.clone(), sampling, &mut |done| {
            share = share.max(done);
            tell(share);
        })
    }

    /// Returns the part of the workpiece's profile that the filament can touch during the pass;
    /// `None` if there is no profile.
    pub fn profile(&self) -> Option<ProfileCells> {
        let workpiece = &self.filament.workpiece;
        let [x, y, _] = workpiece.surface([0.0; 3], 0.0).velocity;
        // A filament reaches no farther than stretched out, plus its contact radius.
        let [root_x, root_y, _] = self.filament.motion.at(0.0).position;
        let stretched = (root_x.hypot(root_y) + self.filament_length).max(self.setting.reach);
        let radius = self.nominal.tool_radius;
        let radius = if stretched > radius * (1.0 + ANGLE_TOLERANCE_RAD) {
            stretched
        } else {
            radius
        };
        self.outline(radius + self.filament.law.radius + self.end_time() * x.hypot(y))
    }

    /// The profile of the workpiece within the distance `reach` (m) of the tool axis; none if it
    /// has no profile.
    pub fn outline(&self, reach: f64) -> Option<ProfileCells> {
        let longest = CELL_SHARE * self.filament_length;
        self.filament.workpiece.profile(reach, longest)
    }

    /// Returns the likely end of the pass in s, if it is known. Samples are equally spaced up to
    /// it.
    pub(super) fn expected_end(&self) -> Option<f64> {
        (self.turns != Turns::Steady).then(|| self.end_time())
    }

    pub(super) fn sampler(&self, sampling: Sampling, end_time: Option<f64>) -> Sampler {
        let profile = sampling.profile.then(|| self.profile()).flatten();
        Sampler::new(
            self.form,
            self.filament.chain.clone(),
            sampling,
            end_time,
            profile,
        )
    }

    /// Creates the trajectory of the pass in `system`, from its start to the tail angle of the
    /// first turn.
    pub fn trajectory(&self, system: &mut FilamentSystem<Turning<T>, W>) -> Trajectory {
        let start = self.start(system);
        self.trajectory_from(system, start)
    }

    /// Creates that trajectory from another `start`.
    fn trajectory_from(
        &self,
        system: &mut FilamentSystem<Turning<T>, W>,
        start: FilamentState,
    ) -> Trajectory {
        let end = if self.all_round {
            self.turn_time()
        } else {
            self.pass_time()
        };
        Trajectory::new(system, start, end, METHOD, self.tolerances)
            .must_be_free()
            .until(self.stop.clone())
    }

    /// Returns the results of a pass whose last turn has ended.
    pub(super) fn conclude(
        &self,
        observer: &ContactObserver<Turning<T>, W>,
        trajectory: &Trajectory,
        itinerary: Itinerary,
        sampler: Sampler,
    ) -> Result<Simulation, SimulationError> {
        let shape = self.setting.shape.as_ref();
        if shape.is_some_and(|shape| !shape.is_equilibrium) {
            return Err(SimulationError::NoEquilibrium);
        }
        let energy_residual = energy_residual(
            &self.filament,
            &mut FilamentEquations::new(self.form, self.filament.chain.clone()),
            &self.start_coordinates(),
            self.tolerances.relative,
            observer,
            trajectory,
            self.tracks_energy(sampler.sampling),
        );
        let equilibrium_residual = self.equilibrium_residual();
        let metrics_of = |record: &ContactRecord| {
            self.metrics(&ContactRecord {
                energy_residual,
                equilibrium_residual,
                ..*record
            })
        };
        let mean = itinerary
            .is_unsteady()
            .then(|| observer.completed_turns().mean(metrics_of));
        let metrics = mean
            .flatten()
            .unwrap_or_else(|| metrics_of(observer.record()));
        let Sampler {
            mut history,
            mut shapes,
            ledger,
            sampling,
            ..
        } = sampler;
        if self.setting.pose != Pose::UPRIGHT {
            history
                .iter_mut()
                .for_each(|sample| sample.turn(&self.setting.pose));
            shapes
                .iter_mut()
                .for_each(|shape| shape.turn(&self.setting.pose));
        }
        let mut profile = ledger.map_or_else(Vec::new, Ledger::into_cells);
        let finite = history.iter().all(Sample::is_finite)
            && shapes.iter().all(Shape::is_finite)
            && profile.iter().all(ProfileCell::is_finite);
        if !metrics.is_finite() || !(finite || sampling.alongside) {
            return Err(SimulationError::NotFinite);
        }
        if !finite {
            history.clear();
            shapes.clear();
            profile.clear();
        }
        let limit = MAX_ENERGY_RESIDUAL.max(10.0 * self.tolerances.relative);
        if energy_residual > limit {
            return Err(SimulationError::Unbalanced {
                residual: energy_residual,
                limit,
                is_rotary: self.setting.is_rotary,
            });
        }
        Ok(Simulation {
            metrics,
            turn_contact_normal_impulses_n_s: itinerary.into_impulses(),
            end_time_s: trajectory.start().time,
            statistics: trajectory.statistics(),
            history,
            shapes,
            profile,
            positions: Vec::new(),
        })
    }
}

impl Kind {
    /// Returns the kind of the pass that `settings` state.
    pub fn of(settings: &Settings) -> Self {
        Pass::new(settings).kind()
    }
}
