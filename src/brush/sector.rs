//! Coupled filaments on their way over the workpiece, in steps of TR-BDF2.
//!
//! Step-size control looks at the requested results. The embedded weights of the method, applied to
//! the forces at the three stages of a step, estimate its error in the impulse of each filament on
//! the workpiece (Hosea and Shampine, Applied Numerical Mathematics 20, 1996). Forces on the
//! workpiece do not show the action of filaments on each other before they touch it: rates of their
//! momentum do. They also include the forces of the clamp and of neighbours.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use super::bundle::{BrushState, Bundle, Effort, GroupState, Kinematics, NoConvergence};
use super::filaments::ToolFilament;
use super::gmres::Vector;
use super::group::{Budget, Exchange, WorkpieceLoad};
use super::pressing::FilamentPress;
use super::result::{BrushStatistics, ToolSample};
use super::settle::{FilamentPose, turned};
use super::team;
use crate::equations::linear::{add, dot, scale};
use crate::equations::{LANES, Lanes, Lanewise, Real};
use crate::integrate::hermite::{Knot, Weights};
use crate::integrate::tableau::TR_BDF2;
use crate::integrate::{Pace, RejectionCause, StepChange, StepControl, StepControlError};
use crate::model::metrics::{ContactRecord, tip_deflection};
use crate::model::settings::MAX_TURNS;
use crate::simulation::{CompletedTurns, ContactSum, EdgeWork};
use crate::tool::{ClampMotion, RotaryTool, Turning};
use crate::workpiece::Workpiece;

/// Share of the error of momenta in the error of a step, beside that of the impulses. Momenta are
/// not results: they show motions that the impulses do not show yet.
const MOMENTUM_SHARE: f64 = 0.2;
/// Shortest step as a share of the longest one.
const MIN_STEP_SHARE: f64 = 3e-5;
/// Steps at most double, as impacts come without notice. After a failure of Newton's method, the
/// active set keeps changing for some steps.
const STEP_CHANGE: StepChange = StepChange {
    growth: 2.0,
    growth_after_rejection: 1.0,
    failure: 0.25,
    growth_after_failure: 1.4,
    steps_after_failure: 4,
};
/// Share of a step or of an energy that rounding may cause.
const ROUNDING_SHARE: f64 = 1e-6;

/// Returns `Σ b_j x_j` of the values at the three stages of a step.
fn integral(values: [f64; 3]) -> f64 {
    (0..3).map(|j| TR_BDF2.weight(j) * values[j]).sum()
}

/// Returns `Σ (b̂_j − b_j) x_j`, the embedded error estimate of [`integral`].
fn integral_error(values: [f64; 3]) -> f64 {
    (0..3).map(|j| TR_BDF2.error_weight(j) * values[j]).sum()
}

/// Accuracy of the steps of a sector.
#[derive(Clone, Copy, Debug)]
pub struct Accuracy {
    /// Largest last correction of a node's velocity in m/s.
    pub newton: f64,
    /// Longest step in s.
    pub longest: f64,
}

/// Timetable of a filament in s.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Timetable {
    /// Start of its first turn. Its motion may begin earlier.
    pub begin: f64,
    /// Duration of a turn.
    pub turn: f64,
    /// Intervals in which the undeformed filament touches in the first turn.
    pub touches: Vec<[f64; 2]>,
}

/// Contact of one filament so far.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Account {
    /// Record of the current turn.
    pub record: ContactRecord,
    /// Records of the last completed turns.
    pub completed: CompletedTurns,
    /// Impulses of the turns before, in N s.
    pub impulses: Vec<f64>,
    timetable: Timetable,
    load: WorkpieceLoad,
    edge_work: EdgeWork,
}

/// Contact of two filaments so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PairAccount {
    /// `∫` of the normal force in N s.
    pub impulse: f64,
    /// `∫` of the force on the first filament in N s.
    pub vector_impulse: [f64; 3],
    /// Largest normal force in N.
    pub peak: f64,
    /// Time of contact in s.
    pub time: f64,
    /// `∫` of the normal force times the distance from the root, mean of both filaments, in N m s.
    pub moment: f64,
    /// Energy that damping and friction dissipated, in J.
    pub dissipated: f64,
}

/// Energy and momentum of a sector, and the fluxes into it, each integrated apart from the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Balance {
    /// Stock at the start.
    begin: [f64; 4],
    /// Present stock: energy in J, momentum in N s.
    now: [f64; 4],
    /// Work of the clamps and of a moving workpiece in J.
    work: f64,
    /// Energy that joints and contacts dissipated, in J.
    dissipated: f64,
    /// Work and dissipation without regard to sign, in J.
    turnover: f64,
    /// Impulse of clamps, workpiece and gravity in N s.
    impulse: [f64; 3],
    /// Impulse of the workpiece without regard to its direction, in N s.
    contact: f64,
    /// Exchange at the end of the last step.
    rates: Exchange,
}

/// Failure of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepFailure {
    /// Time in s.
    pub time: f64,
    /// Filaments that cross each other, if this is the cause.
    pub crossing: Option<[usize; 2]>,
}

impl From<StepControlError<[usize; 2]>> for StepFailure {
    fn from(error: StepControlError<[usize; 2]>) -> Self {
        let (time, crossing) = match error {
            StepControlError::StepTooSmall {
                time,
                cause: RejectionCause::Refused(pair),
                ..
            }
            | StepControlError::Refused { time, reason: pair } => (time, Some(pair)),
            StepControlError::StepTooSmall { time, .. } | StepControlError::NotFinite { time } => {
                (time, None)
            }
        };
        Self { time, crossing }
    }
}

/// Largest count of steps or contacts in a state that is restored: more would overflow later.
const MAX_COUNT: usize = 1 << 48;

/// Coupled filaments.
pub struct Sector {
    bundle: Bundle<Turning<RotaryTool>>,
    motion: BrushState,
    stepper: TrBdf2Stepper,
    accounts: Vec<Account>,
    pairs: BTreeMap<[usize; 2], PairAccount>,
    /// Stage at the end of the last step.
    now: StageLoads,
    /// Memory for the stages of a step: the middle one, and that at its end.
    stages: [StageLoads; 2],
    statistics: BrushStatistics,
    balance: Balance,
    /// Error of the sum of all impulses that a step may add, over its length, in N.
    error_rate: f64,
    control: StepControl,
    /// Sum of the error estimates of all accepted steps, in N s.
    impulse_error: f64,
}

/// State of a sector.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SectorState {
    pub motion: BrushState,
    groups: Vec<GroupState>,
    pub accounts: Vec<Account>,
    pairs: BTreeMap<[usize; 2], PairAccount>,
    now: StageLoads,
    pub statistics: BrushStatistics,
    balance: Balance,
    pace: Pace,
    pub impulse_error: f64,
}

/// Reason to repeat a step.
enum Retry {
    /// A sleeping group was touched.
    Woken,
    /// The step is too long; or two filaments have crossed each other.
    Rejected(RejectionCause<[usize; 2]>),
}

impl From<NoConvergence> for Retry {
    fn from(_: NoConvergence) -> Self {
        Self::Rejected(RejectionCause::Newton)
    }
}

/// A step that can be accepted.
struct Attempt {
    effort: Effort,
    balance: Balance,
    /// Error estimate in N s.
    impulse_error: f64,
}

impl Sector {
    /// Creates a sector of filaments at the start of their motion. Steps are the longest ones until
    /// an error rate is [set](Self::set_error_rate).
    pub fn new(
        mut bundle: Bundle<Turning<RotaryTool>>,
        motion: BrushState,
        timetables: Vec<Timetable>,
        accuracy: Accuracy,
    ) -> Self {
        let accounts = timetables
            .into_iter()
            .zip(bundle.filaments())
            .map(|(timetable, filament)| Account {
                record: ContactRecord::of_turn(1),
                completed: CompletedTurns::default(),
                impulses: Vec::new(),
                load: WorkpieceLoad::none(),
                edge_work: EdgeWork::new(filament.workpiece.edges().len()),
                timetable,
            })
            .collect();
        let mut now = StageLoads::default();
        now.take(&mut bundle, &motion);
        let balance = Balance::new(&now.budget);
        Self {
            stepper: TrBdf2Stepper::new(&motion, accuracy.newton),
            bundle,
            motion,
            accounts,
            pairs: BTreeMap::new(),
            now,
            stages: Default::default(),
            statistics: BrushStatistics::default(),
            balance,
            control: StepControl::new(&TR_BDF2, accuracy.longest)
                .up_to(accuracy.longest)
                .down_to(MIN_STEP_SHARE * accuracy.longest)
                .changing_by(STEP_CHANGE),
            error_rate: f64::INFINITY,
            impulse_error: 0.0,
        }
    }

    /// Limits the error of the sum of all impulses that a step may add, over its length, in N.
    pub fn set_error_rate(&mut self, error_rate: f64) {
        self.error_rate = error_rate;
    }

    /// Returns the error estimate of the sum of all impulses so far, in N s.
    pub fn impulse_error(&self) -> f64 {
        self.impulse_error
    }

    /// Returns the contacts with the workpiece so far, by filament.
    pub fn accounts(&self) -> &[Account] {
        &self.accounts
    }

    /// Returns the contacts between filaments so far.
    pub fn pairs(&self) -> &BTreeMap<[usize; 2], PairAccount> {
        &self.pairs
    }

    /// Returns the filaments.
    pub fn bundle(&self) -> &Bundle<Turning<RotaryTool>> {
        &self.bundle
    }

    /// Returns the pose of each filament.
    pub fn poses(&self) -> Vec<FilamentPose> {
        let n = self.bundle.segments();
        let BrushState {
            time,
            q,
            v,
            accelerations,
        } = &self.motion;
        let segment = |at: usize, lane: usize, angle: f64| {
            let block = |vector: &Vector| vector[at].map(|value| value.lane(lane));
            let motion = [block(q), block(v), block(accelerations)];
            let [e, rate, _] = self.bundle.chart(at / n).direction(motion);
            [turned(e, -angle), turned(rate, -angle)]
        };
        let filaments = self.bundle.filaments().iter().enumerate();
        let pose = |(index, filament): (usize, &ToolFilament)| {
            let angle = filament.motion.rate * time;
            (0..n)
                .map(|k| segment(index / LANES * n + k, index % LANES, angle))
                .collect()
        };
        filaments.map(pose).collect()
    }

    /// Returns the work done so far.
    pub fn statistics(&self) -> &BrushStatistics {
        &self.statistics
    }

    /// Returns the balance of energy and momentum.
    pub fn balance(&self) -> &Balance {
        &self.balance
    }

    /// Places all filaments at `time` (s) in the last step, and returns them.
    pub fn placed_at(&mut self, time: f64) -> &Bundle<Turning<RotaryTool>> {
        let state = self.stepper.interpolated(&self.motion, time);
        self.bundle.place_all(&state);
        &self.bundle
    }

    /// Forgets factorisations: later results do not depend on them.
    pub fn forget(&mut self) {
        self.bundle.forget();
    }

    /// Advances until a step ends at `time` (s) or later, but not after `end` (s). Returns the
    /// forces at `time`.
    ///
    /// # Errors
    /// If the shortest step fails.
    pub fn advance(&mut self, time: f64, end: f64) -> Result<ToolSample, StepFailure> {
        while self.motion.time < time {
            if self.bundle.begin_step(&mut self.motion) {
                self.now.take(&mut self.bundle, &self.motion);
                self.balance.go_on_with(&self.now.budget);
            }
            let proposal = self.control.propose(self.motion.time, end);
            let h = proposal.step;
            if self.bundle.wake(&self.motion, h) {
                self.now.take(&mut self.bundle, &self.motion);
                self.balance.go_on_with(&self.now.budget);
            }
            let outcome = match self.attempt(h) {
                Ok(attempt) => Ok(attempt),
                Err(Retry::Woken) => continue,
                Err(Retry::Rejected(cause)) => Err(cause),
            };
            let error = outcome
                .as_ref()
                .map(|attempt| attempt.impulse_error / (self.error_rate * h));
            let is_accepted =
                self.control
                    .judge(self.motion.time, proposal, error.map_err(|cause| *cause))?;
            let Ok(attempt) = outcome else {
                self.statistics.newton_failures += 1;
                continue;
            };
            self.statistics.effort += attempt.effort;
            if is_accepted {
                self.accept(h, attempt);
                if proposal.limited {
                    self.motion.time = end;
                }
            } else {
                self.statistics.rejected_steps += 1;
            }
        }
        Ok(self.sample(time))
    }

    /// Attempts a step of `h` (s).
    fn attempt(&mut self, h: f64) -> Result<Attempt, Retry> {
        let Self {
            bundle,
            motion,
            stepper,
            stages: [middle, end],
            ..
        } = self;
        let mut effort = stepper.middle_stage(bundle, motion, h)?;
        middle.take(bundle, &stepper.middle);
        if bundle.has_woken() {
            return Err(Retry::Woken);
        }
        effort += stepper.end_stage(bundle, motion, h)?;
        if let Some(crossing) = crossing(bundle) {
            return Err(Retry::Rejected(RejectionCause::Refused(crossing)));
        }
        end.take(bundle, &stepper.end);
        if bundle.has_woken() {
            return Err(Retry::Woken);
        }
        let mut balance = self.balance;
        balance.add(&self.stages[0].budget, &self.stages[1].budget, h);
        let impulse_error = self.step_error(h);
        if !impulse_error.is_finite() {
            return Err(Retry::Rejected(RejectionCause::NotFinite));
        }
        Ok(Attempt {
            effort,
            balance,
            impulse_error,
        })
    }

    /// Returns the error estimate of the sum of all impulses after a step of `h` (s), in N s.
    ///
    /// Errors of filaments that strike together add up, others like random ones: the estimate has
    /// both sums.
    fn step_error(&self, h: f64) -> f64 {
        let [middle, end] = &self.stages;
        let (mut sum, mut squares) = (0.0, 0.0);
        for ((account, middle), end) in self.accounts.iter().zip(&middle.loads).zip(&end.loads) {
            let normal = [&account.load, middle, end].map(|load| load.sum.normal);
            let error = h * integral_error(normal);
            sum += error;
            squares += error * error;
        }
        let mut of_momenta = Lanes::ZERO;
        let rates = [&self.now, middle, end].map(|stage| stage.momentum_rates.as_flattened());
        for (start, (middle, end)) in rates[0].iter().zip(rates[1].iter().zip(rates[2])) {
            let weighted = [start, middle, end].into_iter().enumerate();
            let error = weighted.fold(Lanes::ZERO, |sum, (j, rate)| {
                sum + Lanes::from_f64(h * TR_BDF2.error_weight(j)) * *rate
            });
            of_momenta = of_momenta + error * error;
        }
        let of_momenta: f64 = (0..LANES).map(|lane| of_momenta.lane(lane)).sum();
        f64::abs(sum) + squares.sqrt() + MOMENTUM_SHARE * of_momenta.sqrt()
    }

    /// Accepts a step of `h` (s).
    fn accept(&mut self, h: f64, attempt: Attempt) {
        let Self {
            bundle,
            motion,
            accounts,
            pairs,
            now,
            stages: [middle, end],
            ..
        } = self;
        let (bundle, begin) = (&*bundle, motion.time);
        let observe = |index: usize, account: &mut Account| {
            if bundle.is_asleep(index / LANES) {
                account.end_turn(begin + h, h);
                return;
            }
            let filament = &bundle.filaments()[index];
            let clamp = filament.motion.at(begin + h);
            let n = filament.chain.segments();
            let tip = bundle.node(index, n);
            let length = filament.chain.length * n as f64;
            let deflection = tip_deflection(tip, clamp.position, clamp.direction, length);
            account.observe(
                [&middle.loads[index], &end.loads[index]],
                [begin, h],
                deflection,
            );
            if end.loads[index].worked.is_some() {
                account.record.edge_evenness =
                    account.edge_work.evenness(filament.workpiece.edges());
            }
            account.end_turn(begin + h, h);
        };
        let groups = accounts.chunks_mut(LANES).enumerate();
        team::for_each(groups, |(group, accounts)| {
            accounts
                .iter_mut()
                .enumerate()
                .for_each(|(lane, account)| observe(group * LANES + lane, account));
        });
        for (j, stage) in [&*now, middle, end].into_iter().enumerate() {
            for (filaments, press) in &stage.presses {
                pairs
                    .entry(*filaments)
                    .or_default()
                    .add(press, h * TR_BDF2.weight(j));
            }
        }
        std::mem::swap(now, end);
        self.balance = attempt.balance;
        self.impulse_error += attempt.impulse_error;
        self.statistics.steps += 1;
        self.stepper.finish(&mut self.motion);
    }

    /// Returns the place of `time` (s) in the last step, from 0 to 1.
    fn share(&self, time: f64) -> f64 {
        let [start, end] = [self.stepper.end.time, self.motion.time];
        (time - start) / (end - start)
    }

    /// Returns the stages at the ends of the last step.
    fn last_step(&self) -> [&StageLoads; 2] {
        let [_, start] = &self.stages;
        [start, &self.now]
    }

    /// Returns the forces at `time` (s) in the last step: those of the workpiece at the
    /// interpolated motion; those between filaments are linear along the step.
    fn sample(&mut self, time: f64) -> ToolSample {
        let state = self.stepper.interpolated(&self.motion, time);
        let contacts = self.bundle.contacts(&state);
        let share = self.share(time);
        let [start, end] = self.last_step().map(|stage| &stage.presses);
        let normal = |presses: &[([usize; 2], PressSum)]| -> f64 {
            presses.iter().map(|(_, press)| press.normal).sum()
        };
        let mut sample = ToolSample {
            time_s: time,
            press_force_n: (1.0 - share) * normal(start) + share * normal(end),
            touching_pairs: if share < 0.5 { start.len() } else { end.len() },
            ..ToolSample::default()
        };
        for (account, (sum, pressing)) in self.accounts.iter_mut().zip(contacts) {
            account.record.peak_force = account.record.peak_force.max(sum.normal);
            sample.contact_normal_force_n += sum.normal;
            sample.contact_force_n = add(sample.contact_force_n, sum.force);
            sample.contact_moment_n_m += sum.moment;
            sample.touching_filaments += usize::from(pressing > 0.0);
        }
        sample
    }

    /// Returns the normal forces on the workpiece and of other filaments in N, by filament, at
    /// `time` (s) in the last step.
    pub fn forces(&mut self, time: f64) -> [Vec<f64>; 2] {
        let state = self.stepper.interpolated(&self.motion, time);
        let contacts = self.bundle.contacts(&state);
        let workpiece = contacts.iter().map(|(sum, _)| sum.normal).collect();
        let mut others = vec![0.0; contacts.len()];
        let share = self.share(time);
        for (stage, share) in self.last_step().into_iter().zip([1.0 - share, share]) {
            for (pair, press) in &stage.presses {
                for &filament in pair {
                    others[filament] += share * press.normal;
                }
            }
        }
        [workpiece, others]
    }

    /// Returns the state, from which a sector of the same filaments goes on with the same bits.
    pub fn state(&self) -> SectorState {
        SectorState {
            motion: self.motion.clone(),
            groups: self.bundle.states(),
            accounts: self.accounts.clone(),
            pairs: self.pairs.clone(),
            now: self.now.clone(),
            statistics: self.statistics,
            balance: self.balance,
            pace: self.control.pace(),
            impulse_error: self.impulse_error,
        }
    }

    /// Restores a state. Returns `None` if it does not fit this sector at one of the `times` (s).
    pub fn restore(&mut self, state: SectorState, times: &RangeInclusive<f64>) -> Option<()> {
        let SectorState {
            motion,
            groups,
            accounts,
            pairs,
            now,
            statistics,
            balance,
            pace,
            impulse_error,
        } = state;
        let lengths =
            |motion: &BrushState| [&motion.q, &motion.v, &motion.accelerations].map(Vec::len);
        let is_own = |(account, own): (&Account, &Account)| {
            account.timetable == own.timetable
                && account.edge_work.edges() == own.edge_work.edges()
                && account.has_consistent_turns()
        };
        let of_stage = now.presses.iter().map(|(filaments, _)| filaments);
        let mut filaments = pairs.keys().chain(of_stage).flatten();
        let fits = times.contains(&motion.time)
            && lengths(&motion) == lengths(&self.motion)
            && accounts.len() == self.accounts.len()
            && accounts.iter().zip(&self.accounts).all(is_own)
            && now.loads.len() == accounts.len()
            && now.momentum_rates.len() == self.now.momentum_rates.len()
            && filaments.all(|filament| *filament < accounts.len())
            && impulse_error >= 0.0
            && impulse_error.is_finite()
            && statistics.are_countable();
        if !fits || !self.control.restore(pace) {
            return None;
        }
        self.bundle.restore(groups)?;
        (self.motion, self.accounts, self.pairs, self.now) = (motion, accounts, pairs, now);
        (self.statistics, self.balance, self.impulse_error) = (statistics, balance, impulse_error);
        Some(())
    }
}

impl Account {
    /// Returns `true` if turns are numbered without gaps, and the completed ones have impulses.
    fn has_consistent_turns(&self) -> bool {
        let completed = self.impulses.len();
        completed <= MAX_TURNS
            && self.record.turn == completed + 1
            && self.completed.last().map_or(0, |record| record.turn) == completed
            && self.record.count <= MAX_COUNT
    }

    /// Returns `true` if the filament touches the workpiece in its first turn.
    pub fn is_touching(&self) -> bool {
        self.load.pressing > 0.0 && self.record.turn == 1
    }

    /// Returns the last turn that has ended, or the first one.
    pub fn last(&self) -> &ContactRecord {
        self.completed.last().unwrap_or(&self.record)
    }

    /// Returns the impulse of all turns so far in N s.
    pub fn total_impulse(&self) -> f64 {
        self.impulses.iter().sum::<f64>() + self.record.impulse
    }

    /// Adds a step from `begin` over `h` (s), with the loads at its middle stage and its end.
    fn observe(
        &mut self,
        [middle, end]: [&WorkpieceLoad; 2],
        [begin, h]: [f64; 2],
        deflection: f64,
    ) {
        let Timetable { turn, touches, .. } = &self.timetable;
        let turned = (self.record.turn - 1) as f64 * turn;
        let start = self.load;
        let mean = |of: &dyn Fn(&ContactSum) -> f64| {
            h * integral([&start, middle, end].map(|load| of(&load.sum)))
        };
        let record = &mut self.record;
        record.impulse += mean(&|sum| sum.normal);
        record.vector_impulse =
            std::array::from_fn(|i| record.vector_impulse[i] + mean(&|sum| sum.force[i]));
        record.angular_impulse += mean(&|sum| sum.moment);
        record.edge_impulse += mean(&|sum| sum.on_edges);
        record.friction_work += mean(&|sum| sum.friction_power);
        record.sliding_work += mean(&|sum| sum.sliding_power);
        record.edge_work = std::array::from_fn(|order| {
            record.edge_work[order] + mean(&|sum| sum.edge_power[order])
        });
        record.peak_force = record.peak_force.max(middle.sum.normal).max(end.sum.normal);
        record.penetration = record
            .penetration
            .max(middle.penetration)
            .max(end.penetration);
        record.contact_nodes = record
            .contact_nodes
            .max(middle.contact_nodes)
            .max(end.contact_nodes);
        record.edge_penetration = record.edge_penetration.max(end.edge_penetration);
        let part = contact_part(start.pressing, end.pressing);
        if part[1] > part[0] {
            record.add_time(
                h * (part[1] - part[0]),
                part.map(|part| begin + part * h),
                touches,
                turned,
            );
            record.count += usize::from(part[0] > 0.0 || start.pressing <= 0.0);
        }
        for (j, load) in [&start, middle, end].into_iter().enumerate() {
            let Some(worked) = load.worked else { continue };
            // Work is spread over the path along an edge. It stays in place where the step begins
            // or ends off the edge.
            let here =
                |other: &WorkpieceLoad| other.worked.filter(|other| other.edge == worked.edge);
            let places = [&start, end].map(|other| here(other).unwrap_or(worked).place);
            self.edge_work
                .add(worked.edge, places, h * TR_BDF2.weight(j) * worked.power);
        }
        record.max_deflection = record.max_deflection.max(deflection);
        self.load = *end;
    }

    /// Ends the turn if a step of `h` (s) to `end` (s) is the first to reach its end. The last turn
    /// thus ends with the simulation.
    fn end_turn(&mut self, end: f64, h: f64) {
        let Timetable { begin, turn, .. } = &self.timetable;
        if end < begin + self.record.turn as f64 * turn - ROUNDING_SHARE * h {
            return;
        }
        self.impulses.push(self.record.impulse);
        self.completed.push(self.record);
        self.record = ContactRecord::of_turn(self.record.turn + 1);
        self.edge_work.clear();
    }
}

/// Returns the part of a step in which a filament touches that presses by `start` and `end` (m) at
/// its ends.
fn contact_part(start: f64, end: f64) -> [f64; 2] {
    match (start > 0.0, end > 0.0) {
        (true, true) => [0.0, 1.0],
        (false, false) => [0.0, 0.0],
        (false, true) => [
            if start.is_finite() {
                start / (start - end)
            } else {
                1.0
            },
            1.0,
        ],
        (true, false) => [
            0.0,
            if end.is_finite() {
                start / (start - end)
            } else {
                0.0
            },
        ],
    }
}

/// Sum of the presses between two filaments.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct PressSum {
    normal: f64,
    /// Force on the filament of the smaller number in N.
    force: [f64; 3],
    moment: f64,
    dissipated: f64,
}

impl PressSum {
    fn add(&mut self, other: &Self) {
        self.normal += other.normal;
        self.force = add(self.force, other.force);
        self.moment += other.moment;
        self.dissipated += other.dissipated;
    }
}

impl PairAccount {
    fn add(&mut self, press: &PressSum, time: f64) {
        self.impulse += time * press.normal;
        self.vector_impulse = add(self.vector_impulse, scale(time, press.force));
        self.peak = self.peak.max(press.normal);
        self.time += time;
        self.moment += time * press.moment;
        self.dissipated += time * press.dissipated;
    }
}

impl BrushStatistics {
    /// Returns `true` if counting on from here cannot overflow.
    fn are_countable(&self) -> bool {
        let Effort {
            newton_iterations,
            krylov_vectors,
            factorisations,
        } = self.effort;
        let of_steps = [self.steps, self.rejected_steps, self.newton_failures];
        let of_effort = [newton_iterations, krylov_vectors, factorisations];
        let mut counts = of_steps.into_iter().chain(of_effort);
        counts.all(|count| count <= MAX_COUNT)
    }
}

impl Balance {
    fn new(budget: &Budget) -> Self {
        let begin = budget.stock();
        Self {
            begin,
            now: begin,
            rates: budget.exchange,
            ..Self::default()
        }
    }

    /// Continues with other filaments of the sector.
    fn go_on_with(&mut self, part: &Budget) {
        let stock = part.stock();
        self.begin = std::array::from_fn(|i| self.begin[i] + stock[i] - self.now[i]);
        self.now = stock;
        self.rates = part.exchange;
    }

    /// Adds a step of `h` (s), with the budgets of its middle stage and its end.
    fn add(&mut self, middle: &Budget, end: &Budget, h: f64) {
        let rates = [self.rates, middle.exchange, end.exchange];
        let sum = |of: &dyn Fn(&Exchange) -> f64| h * integral(rates.map(|rates| of(&rates)));
        let [work, taken] = [sum(&|rates| rates.work), sum(&|rates| rates.taken)];
        self.work += work;
        self.dissipated += taken;
        self.turnover += sum(&|rates| rates.work.abs() + rates.taken.abs());
        self.impulse = std::array::from_fn(|i| self.impulse[i] + sum(&|rates| rates.force[i]));
        self.contact += sum(&|rates| rates.strength);
        self.now = end.stock();
        self.rates = end.exchange;
    }

    /// Returns the energies gained, put in, and dissipated so far, in J.
    pub fn energies(&self) -> [f64; 3] {
        [self.now[0] - self.begin[0], self.work, self.dissipated]
    }

    /// Returns the energy that the balance lacks in J; negative for an excess.
    fn energy_lack(&self) -> f64 {
        let [gain, work, dissipated] = self.energies();
        work - dissipated - gain
    }

    /// Returns the energy defect and its reference, in J.
    pub fn energy_defect(&self) -> [f64; 2] {
        // A freely turning sector has no turnover but that of rounding.
        [
            self.energy_lack().abs(),
            self.turnover + ROUNDING_SHARE * self.begin[0].abs(),
        ]
    }

    /// Returns the momentum defect and its reference, in N s.
    pub fn momentum_defect(&self) -> [f64; 2] {
        let lack: [f64; 3] =
            std::array::from_fn(|i| self.now[i + 1] - self.begin[i + 1] - self.impulse[i]);
        let [_, own @ ..] = self.begin;
        [dot(lack, lack).sqrt(), self.contact + dot(own, own).sqrt()]
    }
}

impl Budget {
    /// Returns energy and momentum.
    fn stock(&self) -> [f64; 4] {
        let [x, y, z] = self.momentum;
        [self.energy, x, y, z]
    }
}

/// Returns two filaments that overlap so deeply that they may cross in the next step, or have
/// crossed in the last one. Steps are too short for filaments that were apart to pass beyond this
/// depth.
fn crossing(bundle: &Bundle<Turning<RotaryTool>>) -> Option<[usize; 2]> {
    /// Least distance of the centrelines as a share of the reach.
    const MIN_DISTANCE_SHARE: f64 = 0.5;
    let is_deep = |(_, press): &&FilamentPress| {
        press.near.square() < (MIN_DISTANCE_SHARE * press.near.reach).powi(2)
    };
    bundle
        .presses()
        .find(is_deep)
        .map(|(filaments, _)| *filaments)
}

/// Loads, presses and budget at the end of a stage.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct StageLoads {
    loads: Vec<WorkpieceLoad>,
    /// Forces between filaments, in the order of the pairs.
    presses: Vec<([usize; 2], PressSum)>,
    /// Rates of the momentum of all filaments in N, by group.
    momentum_rates: Vec<[Lanes; 3]>,
    budget: Budget,
}

impl StageLoads {
    /// Evaluates the bundle at the end of a stage.
    fn take(&mut self, bundle: &mut Bundle<Turning<RotaryTool>>, motion: &BrushState) {
        let found = bundle.evaluate(motion);
        self.budget = found.budget;
        found.take_loads(&mut self.loads);
        found.take_momentum_rates(&mut self.momentum_rates);
        self.presses.clear();
        self.presses
            .extend(bundle.presses().map(|([own, other], press)| {
                let (pair, sign) = if own < other {
                    ([*own, *other], 1.0)
                } else {
                    ([*other, *own], -1.0)
                };
                let [point, nearest] =
                    [&press.near.point, &press.near.nearest].map(|place| bundle.arc_length(place));
                let sum = PressSum {
                    normal: press.normal_force,
                    force: scale(sign, press.force()),
                    moment: press.normal_force * 0.5 * (point + nearest),
                    dissipated: press.dissipated,
                };
                (pair, sum)
            }));
        self.presses.sort_unstable_by_key(|(pair, _)| *pair);
        self.presses.dedup_by(|(pair, sum), (last, total)| {
            let is_same = pair == last;
            if is_same {
                total.add(sum);
            }
            is_same
        });
    }
}

/// Steps of TR-BDF2.
pub struct TrBdf2Stepper {
    tolerance: f64,
    middle: BrushState,
    end: BrushState,
    base: [Vector; 2],
}

impl TrBdf2Stepper {
    /// Allocates memory for steps from `motion`. Stages are solved once velocities change by less
    /// than `tolerance` (m/s).
    pub fn new(motion: &BrushState, tolerance: f64) -> Self {
        let base = [motion.q.clone(), motion.v.clone()];
        Self {
            tolerance,
            middle: motion.clone(),
            end: motion.clone(),
            base,
        }
    }

    /// Solves the middle stage of a step of `h` (s) from `start`.
    pub fn middle_stage<M: ClampMotion + Sync>(
        &mut self,
        bundle: &mut Bundle<M>,
        start: &BrushState,
        h: f64,
    ) -> Result<Effort, NoConvergence> {
        let (own, blocks, first) = (
            TR_BDF2.gamma * h,
            bundle.segments(),
            bundle.first_coordinate(),
        );
        let Self {
            tolerance,
            middle,
            base: [base_q, base_v],
            ..
        } = self;
        set_sum(
            [blocks, first],
            base_v,
            &start.v,
            &[(own, &start.accelerations)],
        );
        set_sum(
            [blocks, first],
            base_q,
            &start.q,
            &[(own, &start.v), (own, base_v)],
        );
        set_sum(
            [blocks, 0],
            &mut middle.accelerations,
            &start.accelerations,
            &[],
        );
        middle.time = start.time + TR_BDF2.node(1) * h;
        bundle.solve_stage(
            middle,
            Kinematics {
                base: [base_q, base_v],
                weights: [own * own, own],
                first,
            },
            *tolerance,
        )
    }

    /// Solves the stage at the end of the step.
    pub fn end_stage<M: ClampMotion + Sync>(
        &mut self,
        bundle: &mut Bundle<M>,
        start: &BrushState,
        h: f64,
    ) -> Result<Effort, NoConvergence> {
        let (own, others) = (TR_BDF2.gamma * h, TR_BDF2.weight(0) * h);
        let (blocks, first) = (bundle.segments(), bundle.first_coordinate());
        let Self {
            tolerance,
            middle,
            end,
            base: [base_q, base_v],
        } = self;
        let by_accelerations = [
            (others, &start.accelerations),
            (others, &middle.accelerations),
        ];
        set_sum([blocks, first], base_v, &start.v, &by_accelerations);
        let by_velocities = [(others, &start.v), (others, &middle.v), (own, &*base_v)];
        set_sum([blocks, first], base_q, &start.q, &by_velocities);
        set_sum(
            [blocks, 0],
            &mut end.accelerations,
            &middle.accelerations,
            &[],
        );
        end.time = start.time + h;
        bundle.solve_stage(
            end,
            Kinematics {
                base: [base_q, base_v],
                weights: [own * own, own],
                first,
            },
            *tolerance,
        )
    }

    /// Moves the end of the step into `motion`, and keeps its start.
    pub fn finish(&mut self, motion: &mut BrushState) {
        std::mem::swap(motion, &mut self.end);
    }

    /// Returns coordinates and rates at `time` (s) in the last step, which has ended at `motion`,
    /// by Hermite interpolation.
    fn interpolated(&self, motion: &BrushState, time: f64) -> BrushState {
        let (start, h) = (&self.end, motion.time - self.end.time);
        let weights = Weights::new(h, (time - start.time) / h);
        let knot = |state: &BrushState, at: usize, i: usize| Knot {
            value: state.q[at][i].0,
            rate: state.v[at][i].0,
            acceleration: state.accelerations[at][i].0,
        };
        let mut state = motion.clone();
        state.time = time;
        for (at, (q, v)) in state.q.iter_mut().zip(&mut state.v).enumerate() {
            for (i, (q, v)) in q.iter_mut().zip(v).enumerate() {
                let (value, rate) = weights.interpolate(&knot(start, at, i), &knot(motion, at, i));
                (*q, *v) = (Lanes(value), Lanes(rate));
            }
        }
        state
    }
}

/// Computes `start + Σ factor · vector`, in groups of `blocks` blocks, from the coordinate `from`
/// of each block on.
fn set_sum(
    [blocks, from]: [usize; 2],
    result: &mut Vector,
    start: &Vector,
    terms: &[(f64, &Vector)],
) {
    let groups = result
        .chunks_mut(blocks)
        .zip(start.chunks(blocks))
        .enumerate();
    team::for_each(
        groups.map(|(group, parts)| (group * blocks, parts)),
        |(first, (result, start))| {
            for (k, (block, start)) in result.iter_mut().zip(start).enumerate() {
                for i in from..2 {
                    let mut value = start[i];
                    for (factor, vector) in terms {
                        value = value + Lanes::from_f64(*factor) * vector[first + k][i];
                    }
                    block[i] = value;
                }
            }
        },
    );
}
