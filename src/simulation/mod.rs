//! One filament's pass over the workpiece: integration through located contact events.
//!
//! [`simulate`] computes metrics from settings. It integrates a [`Pass`]: [`Pass::new`] takes the tool and the workpiece from
//! the settings, [`Pass::with`] takes any [`Tool`] and any [`Workpiece`]. [`simulate_side_by_side`] simulates many passes in
//! the lanes of the machine's vector units.

use std::f64::consts::TAU;

use crate::contact::{Approach, ContactLaw};
use crate::equations::linear::{add, scale};
use crate::equations::{Chain, Clamp, PolarAxis, sin_cos};
use crate::integrate::tableau::{ESDIRK54, Tableau};
use crate::integrate::{Stepper, Tolerances, Work};
use crate::model::filament;
use crate::model::metrics::{ContactRecord, Metrics, NominalContact};
use crate::model::record::Record;
use crate::model::settings::{Settings, Turns};
use crate::tool::{ClampMotion, RoundTool, Tool, Turning};
use crate::workpiece::{ContactArc, Part, Passage, ProfileCells, Workpiece};

mod balance;
mod crossing;
mod error;
mod form;
mod observers;
mod profile;
mod search;
mod side_by_side;
mod stop;
mod system;
mod trajectory;
mod turns;

pub use error::{IntegrationError, NoContactArc, Obstacle, SimulationError};
pub(crate) use form::Equations;
pub use form::Form;
pub use observers::{ContactObserver, NodeForce, Sample, Sampling, Shape};
pub(crate) use profile::EdgeWork;
pub use profile::ProfileCell;
pub use side_by_side::{Job, Kind, sample_side_by_side, simulate_side_by_side};
pub use stop::Stop;
pub(crate) use system::ContactSum;
pub use system::{COORDINATES, ContactLoads, Filament, FilamentState, FilamentSystem, integral};
pub use trajectory::{Step, Trajectory, integrate};
pub(crate) use turns::is_steady;

use observers::Sampler;
use profile::Ledger;
use turns::Itinerary;

/// The method of every pass (docs/integrators.md).
const METHOD: &Tableau = &ESDIRK54;

/// SHA-256 of all code between settings and metrics, in hexadecimal digits. Builds that differ here may differ in results.
pub const SOLVER_FINGERPRINT: &str = env!("BRISTLE_SOLVER");

/// The result of a pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulation {
    /// The metrics of the contact in the last turn.
    pub metrics: Metrics,
    /// The contact normal impulse `p_n` of each turn in N s.
    pub turn_contact_normal_impulses_n_s: Vec<f64>,
    /// The time at which the last turn ended, in s.
    pub end_time_s: f64,
    /// Work done in all turns.
    pub statistics: Statistics,
    /// Equally spaced samples, if requested.
    pub history: Vec<Sample>,
    /// The filament at equally spaced times, if requested.
    pub shapes: Vec<Shape>,
    /// Where along the profile of the workpiece the work is done, by arc length, if requested: all cells within the tool's reach.
    pub profile: Vec<ProfileCell>,
}

crate::record! {
    /// Work done by a pass.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub struct Statistics {
        steps: usize = ["", "", "accepted steps", "those that became part of the motion"],
        unresolved_steps: usize = [
            "", "", "unresolved steps",
            "accepted steps that miss the tolerance, because the pass had spent its effort"
        ],
        rejected_steps: usize = [
            "", "", "rejected steps",
            "repeated because the error estimate was too large, or the step met a pole of a segment's coordinates"
        ],
        newton_iterations: usize = ["", "", "Newton iterations", "each one residual and one linear solve"],
        newton_failures: usize = [
            "", "", "steps without convergence",
            "repeated because Newton's method did not converge, or met values that are not finite"
        ],
        factorisations: usize = ["", "", "factorisations", "those of the step matrix"],
        contact_events: usize = ["", "", "contact events located", "openings and closings of the contact"],
    }
    with {
        /// Segments switched to their other chart. Not written to files: it describes the coordinates, not the work.
        #[cfg_attr(feature = "serde", serde(skip))]
        pub chart_changes: usize,
    }
}

impl Statistics {
    /// The `work` of the integrator, and the counts of the simulation itself.
    fn new(work: &Work, contact_events: usize, chart_changes: usize) -> Self {
        let Work { steps, unresolved_steps, rejected_steps, newton_iterations, newton_failures, factorisations } =
            *work;
        Self {
            steps,
            unresolved_steps,
            rejected_steps,
            newton_iterations,
            newton_failures,
            factorisations,
            contact_events,
            chart_changes,
        }
    }
}

/// Simulates one pass and reduces it to its metrics.
///
/// # Errors
/// If the integration cannot continue. All numbers returned are finite.
pub fn simulate(settings: &Settings) -> Result<Simulation, SimulationError> {
    simulate_with(settings, Sampling::default())
}

/// Simulates one pass and samples it at `samples` equally spaced times, including the first and the last instant.
///
/// The metrics are those of [`simulate`], to the tolerance. The samples are interpolated within steps and do not affect
/// the integration.
///
/// # Errors
/// As for [`simulate`].
pub fn simulate_with_history(settings: &Settings, samples: usize) -> Result<Simulation, SimulationError> {
    simulate_with(settings, Sampling { samples, ..Sampling::default() })
}

/// Simulates one pass and takes the samples that `sampling` requests; see [`simulate_with_history`].
///
/// # Errors
/// As for [`simulate`].
pub fn simulate_with(settings: &Settings, sampling: Sampling) -> Result<Simulation, SimulationError> {
    Pass::new(settings).simulate(sampling)
}

/// How far the nodes of a relaxed filament are ahead of those of a straight one and behind them, as angles about the tool axis in rad.
fn reach_around(clamp: &Clamp<f64>, chain: &Chain<f64>) -> [f64; 2] {
    let ([mut x, mut y, _], [direction_x, direction_y, _]) = (clamp.position, clamp.direction);
    let ([mut straight_x, mut straight_y], mut inclination) = ([x, y], 0.0);
    let [mut ahead, mut behind] = [0.0_f64; 2];
    for link in &chain.links {
        inclination += link.relaxed_angle.angle();
        let (sin, cos) = sin_cos(inclination);
        x += chain.length * (direction_x * cos - direction_y * sin);
        y += chain.length * (direction_y * cos + direction_x * sin);
        straight_x += chain.length * direction_x;
        straight_y += chain.length * direction_y;
        let angle = (straight_x * y - straight_y * x).atan2(straight_x * x + straight_y * y);
        (ahead, behind) = (ahead.max(angle), behind.max(-angle));
    }
    [ahead, behind]
}

/// Angles that differ by less are those of the same touch.
const ROUNDING_OF_ANGLES: f64 = 1e-9;
/// The largest part of a turn in rad in which a relaxed filament is not looked at while it touches.
const LOOKS: f64 = 1e-3;

/// By what angle in rad before `entry` the relaxed filament, turning rigidly, first touches the workpiece as it is at time zero, with the angle
/// `lead` before in which it is free. Zero if there is no such angle up to `farthest`: a pass that starts inside the workpiece is refused.
fn early_touch<T: Tool, W: Workpiece>(filament: &Filament<Turning<T>, W>, entry: f64, lead: f64, farthest: f64) -> f64 {
    let turning = &filament.motion;
    let length = filament.chain.length;
    let mut nodes = vec![[[0.0; 3]; 2]; filament.chain.segments() + 1];
    // How far the nodes and the centreline are from touching at an angle before entry, in m, and how far they are from the axis; less
    // than zero if they touch.
    let mut clearance = |early: f64| {
        let angle = entry - early;
        let [q, v] = turning.tool.undeformed(angle, turning.rate);
        nodes[0] = [turning.tool.clamp(angle, turning.rate).position, [0.0; 3]];
        let mut farthest = 0.0_f64;
        for (k, q) in filament.chain.relaxed(q).enumerate() {
            let [direction, ..] = PolarAxis::Z.direction([q, v, [0.0; 2]]);
            nodes[k + 1] = [add(nodes[k][0], scale(length, direction)), [0.0; 3]];
            let [x, y, _] = nodes[k + 1][0];
            farthest = farthest.max(x.hypot(y));
        }
        let clear = (0..filament.contacts()).map(|contact| {
            let Approach { penetration, margin, .. } = filament.touch(contact, &|node| nodes[node], None, 0.0).approach;
            if margin > 0.0 { -penetration } else { (-penetration).max(0.0) }
        });
        (clear.fold(f64::INFINITY, f64::min), farthest)
    };
    let (mut early, mut touched) = (0.0, None);
    loop {
        let (clear, radius) = clearance(early);
        if clear < 0.0 {
            touched = Some(early);
            if early > farthest {
                return 0.0;
            }
        } else if early - touched.unwrap_or(0.0) >= lead {
            break;
        }
        // A gap changes by no more than twice the way.
        early += (clear / (2.0 * radius)).clamp(LOOKS, LOOKS.max(lead));
    }
    let Some(touched) = touched else { return 0.0 };
    let (mut low, mut high) = (touched, touched + LOOKS);
    while high - low > ROUNDING_OF_ANGLES {
        let middle = (low + high) / 2.0;
        if clearance(middle).0 < 0.0 { low = middle } else { high = middle }
    }
    high
}

/// One pass of a filament over a workpiece, as integrated by [`simulate`].
///
/// It starts with a relaxed filament that turns rigidly with the tool, at the lead angle before nominal entry, or before the first touch of
/// that filament where this is earlier: a wavy one reaches ahead of a straight one, and its contact radius makes one thicker. It ends at the
/// tail angle after nominal exit, later by as much as a wavy filament reaches behind a straight one, or, if the filament still touches the
/// workpiece there, when it no longer does. With several [`Turns`] it goes on to the end of the last one:
/// after each contact, the filament turns on, vibrates freely, and comes back as it is.
///
/// Where tool, workpiece and gravity make the motion planar ([`Tool::is_planar`], [`Workpiece::is_planar`]), it is integrated in
/// the plane of rotation, and a result depends neither on rounding nor on how the set-up is turned about `z`.
#[derive(Clone, Debug)]
pub struct Pass<T = RoundTool, W = Part> {
    filament: Filament<Turning<T>, W>,
    form: Form,
    nominal: NominalContact,
    /// The times in s between which the undeformed filament touches the workpiece.
    touches: Vec<[f64; 2]>,
    filament_length: f64,
    filament_count: f64,
    tolerances: Tolerances,
    lead_angle: f64,
    tail_angle: f64,
    turns: Turns,
    stop: Option<Stop>,
}

impl Pass {
    /// The pass of the round tool and the workpiece that `settings` state.
    ///
    /// # Panics
    /// If the settings fail [`Settings::check`] because their workpiece is not possible.
    pub fn new(settings: &Settings) -> Self {
        let tool = RoundTool::of(settings);
        let (part, passage) = Part::of(settings).unwrap_or_else(|violation| panic!("{violation}"));
        Self::assemble(settings, tool, part, settings.tool_radius_m(), passage, true)
    }
}

impl<T: Tool + Clone, W: Workpiece + Clone> Pass<T, W> {
    /// The pass of `tool` over `workpiece`. `settings` state everything else.
    ///
    /// The tool turns at `ω = v_b/R`, with `v_b` from the settings and the tool's own radius. The settings of the body's
    /// radius, the workpiece and the penetration depth are not used.
    ///
    /// # Errors
    /// If the undeformed tips have no [contact arc](Workpiece::contact_arc) on the workpiece.
    pub fn with(settings: &Settings, tool: T, workpiece: W) -> Result<Self, NoContactArc> {
        let length = settings.filament.length_m;
        let tip = |angle: f64| {
            let clamp = tool.clamp(angle, 0.0);
            add(clamp.position, scale(length, clamp.direction))
        };
        let arc = workpiece.contact_arc(&tip).ok_or(NoContactArc)?;
        let radius = tool.radius(length);
        Ok(Self::assemble(settings, tool, workpiece, radius, arc.into(), false))
    }

    fn assemble(
        settings: &Settings,
        tool: T,
        workpiece: W,
        tool_radius: f64,
        passage: Passage,
        is_round: bool,
    ) -> Self {
        let Settings { tool: brush, filament, contact, process, solver, workpiece: _, uncertainty: _, brush: _ } =
            settings;
        let nominal = NominalContact::new(tool_radius, process.brushing_velocity_m_s, &passage);
        let ContactArc { middle, angle } = passage.window;
        // A rate that is small for a vibrating filament, so that a slow tool does not require absurd precision.
        let slow_rate = 0.01 * filament::first_natural_frequency(filament);
        let planar = tool.is_planar() && workpiece.is_planar() && process.gravity_m_s2[2] == 0.0;
        let chain = filament::chain(filament, process.gravity_m_s2);
        // A straight, thin filament of a tool from the settings touches no earlier than the undeformed one: it is the undeformed one.
        let is_nominal = is_round
            && contact.radius_m == 0.0
            && filament.lateral_tilt_rad == 0.0
            && filament.waviness_amplitude_m == 0.0;
        let [ahead, behind] = reach_around(&tool.clamp(middle, 0.0), &chain);
        let tail_angle = process.tail_angle_rad + behind;
        let entry = middle - angle / 2.0;
        let initial_angle = entry - (process.lead_angle_rad + ahead);
        let law = ContactLaw::from(contact);
        let filament_length = filament.length_m;
        let mut filament =
            Filament { chain, motion: Turning { tool, rate: nominal.rate(), initial_angle }, law, workpiece };
        let lead_angle = process.lead_angle_rad
            + match is_nominal {
                true => ahead,
                false => {
                    let farthest = TAU - angle - tail_angle - process.lead_angle_rad;
                    let early = early_touch(&filament, entry, process.lead_angle_rad, farthest);
                    if early > ahead + ROUNDING_OF_ANGLES { early } else { ahead }
                }
            };
        filament.motion.initial_angle = entry - lead_angle;
        let time = |angle: f64| (lead_angle + angle) / nominal.rate();
        Self {
            form: if planar { Form::Planar } else { Form::Spatial },
            filament,
            nominal,
            touches: passage.touches.iter().map(|touch| touch.map(time)).collect(),
            filament_length,
            filament_count: brush.filament_count,
            tolerances: Tolerances {
                relative: solver.relative_tolerance,
                coordinate_scale: 1.0,
                rate_scale: (nominal.brushing_velocity / filament_length).max(slow_rate),
            },
            lead_angle,
            tail_angle,
            turns: process.turns,
            stop: None,
        }
    }

    /// The same pass, integrated in space even if it is planar.
    ///
    /// For comparisons: where the motion is laterally unstable, rounding decides whether the filament then leaves the plane.
    #[must_use]
    pub fn in_space(self) -> Self {
        Self { form: Form::Spatial, ..self }
    }

    /// The same pass, which ends early with [`IntegrationError::Stopped`] once `stop` is requested.
    #[must_use]
    pub fn until(self, stop: &Stop) -> Self {
        Self { stop: Some(stop.clone()), ..self }
    }

    /// The form of the equations: planar if the motion is planar by symmetry.
    pub fn form(&self) -> Form {
        self.form
    }

    /// The workpiece.
    pub fn workpiece(&self) -> &W {
        &self.filament.workpiece
    }

    /// The tool and its rotation.
    pub fn tool(&self) -> &Turning<T> {
        &self.filament.motion
    }

    /// The filament, its contact law and the workpiece.
    pub fn filament(&self) -> &Filament<Turning<T>, W> {
        &self.filament
    }

    /// The undeformed tool's passage over the workpiece.
    pub fn nominal(&self) -> &NominalContact {
        &self.nominal
    }

    /// The turns that it takes.
    pub fn turns(&self) -> Turns {
        self.turns
    }

    /// The properties that passes must share with this one to be simulated side by side.
    pub fn kind(&self) -> Kind {
        Kind::new(self.form, &self.filament, self.integrates_work())
    }

    /// The equations to integrate; see [`FilamentSystem::new`].
    pub fn system(&self, tracks_energy: bool) -> FilamentSystem<Turning<T>, W> {
        FilamentSystem::side_by_side(self.form, vec![self.filament.clone()], tracks_energy)
    }

    /// The system of this pass, with the integrals that `sampling` needs.
    fn system_for(&self, sampling: Sampling) -> FilamentSystem<Turning<T>, W> {
        self.system(self.tracks_energy(sampling))
    }

    /// Whether all energies are integrated: because `sampling` needs them, or their balance the work of the clamp.
    fn tracks_energy(&self, sampling: Sampling) -> bool {
        sampling.tracks_energy() || self.integrates_work()
    }

    /// Whether the work of the clamp has to be integrated for the balance of the energies.
    fn integrates_work(&self) -> bool {
        !balance::turns_rigidly(&self.filament)
    }

    /// The start at time zero: in the relaxed shape, and turning rigidly with the body.
    pub fn start(&self, system: &mut FilamentSystem<Turning<T>, W>) -> FilamentState {
        let [q, v] = self.start_coordinates();
        system.state(0.0, q, v)
    }

    /// The coordinates and rates at the start, about `z`.
    fn start_coordinates(&self) -> [Vec<[f64; 2]>; 2] {
        let Turning { tool, rate, initial_angle } = &self.filament.motion;
        let [mut q, mut v] = tool.undeformed(*initial_angle, *rate);
        if self.form == Form::Planar {
            // Along a clamp tilted by τ: φ = π/2 − τ.
            (q[0], v[0]) = (-1.0, 0.0);
        }
        [self.filament.chain.relaxed(q).collect(), vec![v; self.filament.chain.segments()]]
    }

    /// The time in s at which the pass ends: that of its turns or, of a single one, that to the tail angle. It can end earlier if it
    /// becomes steady, and later if the filament of a single turn still touches the workpiece.
    pub fn end_time(&self) -> f64 {
        match self.turns.at_most() {
            0 | 1 => self.pass_time(),
            turns => turns::start_of_turn(turns, self.turn_time()),
        }
    }

    /// The time of a whole turn of the tool in s.
    pub fn turn_time(&self) -> f64 {
        TAU / self.filament.motion.rate
    }

    /// The time in s from the beginning of a turn to its tail angle.
    fn pass_time(&self) -> f64 {
        (self.lead_angle + self.nominal.window.angle + self.tail_angle) / self.filament.motion.rate
    }

    /// The times of nominal entry and nominal exit in s, in the first turn: between them lie all [touches](Pass::touches). Without
    /// any they are those at which the tips pass the plane `y = 0`.
    pub fn nominal_times(&self) -> [f64; 2] {
        match (self.touches.first(), self.touches.last()) {
            (Some([entry, _]), Some([_, exit])) => [*entry, *exit],
            _ => [0.0, self.nominal.window.angle].map(|angle| (self.lead_angle + angle) / self.filament.motion.rate),
        }
    }

    /// The times in s between which the undeformed filament touches the workpiece in the first turn. Those of later turns are a
    /// whole number of turns later, also where the workpiece has moved on.
    pub fn touches(&self) -> &[[f64; 2]] {
        &self.touches
    }

    /// Integrates all turns of the pass in `system` from `start`; see [`integrate`].
    ///
    /// Steps end where turns do.
    ///
    /// # Errors
    /// If a step cannot be taken.
    pub fn integrate(
        &self,
        system: &mut FilamentSystem<Turning<T>, W>,
        start: FilamentState,
        observe: impl FnMut(&Step<'_>),
    ) -> Result<(FilamentState, Statistics), IntegrationError> {
        let (trajectory, _) = self.follow(system, start, observe)?;
        Ok(trajectory.into_end())
    }

    /// [`Pass::integrate`], with the course through the turns.
    fn follow(
        &self,
        system: &mut FilamentSystem<Turning<T>, W>,
        start: FilamentState,
        mut observe: impl FnMut(&Step<'_>),
    ) -> Result<(Trajectory, Itinerary), IntegrationError> {
        let mut trajectory = self.trajectory_from(system, start);
        let mut stepper = Stepper::new(METHOD, self.filament.stage_solution(), self.filament.chain.segments());
        stepper.set_tolerances(0, self.tolerances);
        let mut itinerary = self.itinerary();
        loop {
            trajectory.finish(system, &mut stepper, &mut observe)?;
            if !itinerary.proceed(&mut trajectory) {
                return Ok((trajectory, itinerary));
            }
        }
    }

    fn itinerary(&self) -> Itinerary {
        Itinerary::new(self.turns, self.turn_time(), self.pass_time())
    }

    /// An observer that reduces the steps of the last turn of this pass to the data for its metrics.
    pub fn observer(&self) -> ContactObserver<Turning<T>, W> {
        ContactObserver::new(self.filament.clone(), self.form, self.filament_length, self.touches.clone())
            .by_turns(self.turn_time())
    }

    /// The metrics from the record of this pass's observer.
    pub fn metrics(&self, record: &ContactRecord) -> Metrics {
        Metrics::new(&self.nominal, record, self.filament_count)
    }

    /// Simulates the pass and takes the samples that `sampling` requests.
    ///
    /// # Errors
    /// If the integration cannot continue. All numbers returned are finite.
    pub fn simulate(&self, sampling: Sampling) -> Result<Simulation, SimulationError> {
        self.simulate_telling(sampling, |_| ())
    }

    /// [`Pass::simulate`], which tells after each step what share of the pass is done, from 0 to 1. Turns that are followed until
    /// they are steady count as many; if they are sampled, they are first followed to find out when they end.
    ///
    /// # Errors
    /// As for [`Pass::simulate`].
    pub fn simulate_telling(
        &self,
        sampling: Sampling,
        mut tell: impl FnMut(f64),
    ) -> Result<Simulation, SimulationError> {
        let (mut end_time, mut share) = (self.expected_end(), 0.0_f64);
        loop {
            let mut system = self.system_for(sampling);
            let start = self.start(&mut system);
            let mut observer = self.observer();
            let mut sampler = self.sampler(sampling, end_time);
            let duration = end_time.unwrap_or(self.end_time());
            let (trajectory, itinerary) = self.follow(&mut system, start, |step| {
                observer.observe(step);
                sampler.observe(step, &observer);
                share = share.max((step.end.time / duration).min(1.0));
                tell(share);
            })?;
            let ended = trajectory.start().time;
            if sampler.covers(ended) {
                return self.conclude(&observer, &trajectory, itinerary, sampler);
            }
            // The same again, now that its end is known.
            end_time = Some(ended);
        }
    }

    /// The part of the profile of the workpiece that the filament can touch during the pass; none if the workpiece has no profile.
    pub fn profile(&self) -> Option<ProfileCells> {
        let workpiece = &self.filament.workpiece;
        let [x, y, _] = workpiece.surface([0.0; 3], 0.0).velocity;
        // A filament reaches no farther than stretched out, and its contact radius beyond.
        let [root_x, root_y, _] = self.filament.motion.at(0.0).position;
        let stretched = root_x.hypot(root_y) + self.filament_length;
        let radius = self.nominal.tool_radius;
        let radius = if stretched > radius * (1.0 + ROUNDING_OF_ANGLES) { stretched } else { radius };
        workpiece.profile(radius + self.filament.law.radius + self.end_time() * x.hypot(y))
    }

    /// The time in s at which the pass will end, if that is likely to be known. Samples are taken at equal distances up to there.
    fn expected_end(&self) -> Option<f64> {
        (self.turns != Turns::Steady).then(|| self.end_time())
    }

    fn sampler(&self, sampling: Sampling, end_time: Option<f64>) -> Sampler {
        let profile = sampling.profile.then(|| self.profile()).flatten();
        Sampler::new(self.form, self.filament.chain.clone(), sampling, end_time, profile)
    }

    /// The trajectory of the pass in `system`, at its start, as far as the tail angle of the first turn.
    pub fn trajectory(&self, system: &mut FilamentSystem<Turning<T>, W>) -> Trajectory {
        let start = self.start(system);
        self.trajectory_from(system, start)
    }

    /// The same from another `start`.
    fn trajectory_from(&self, system: &mut FilamentSystem<Turning<T>, W>, start: FilamentState) -> Trajectory {
        Trajectory::new(system, start, self.pass_time(), METHOD, self.tolerances)
            .must_be_free()
            .until(self.stop.clone())
    }

    /// The results of a pass whose last turn has ended.
    fn conclude(
        &self,
        observer: &ContactObserver<Turning<T>, W>,
        trajectory: &Trajectory,
        itinerary: Itinerary,
        sampler: Sampler,
    ) -> Result<Simulation, SimulationError> {
        let energy_residual = self.energy_residual(observer, trajectory, self.tracks_energy(sampler.sampling));
        let record = ContactRecord { is_unsteady: itinerary.is_unsteady(), energy_residual, ..*observer.record() };
        let metrics = self.metrics(&record);
        let Sampler { mut history, mut shapes, ledger, sampling, .. } = sampler;
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
        let limit = balance::LARGEST_RESIDUAL.max(10.0 * self.tolerances.relative);
        if energy_residual > limit {
            return Err(SimulationError::Unbalanced { residual: energy_residual, limit });
        }
        Ok(Simulation {
            metrics,
            turn_contact_normal_impulses_n_s: itinerary.into_impulses(),
            end_time_s: trajectory.start().time,
            statistics: trajectory.statistics(),
            history,
            shapes,
            profile,
        })
    }
}
