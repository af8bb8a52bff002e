//! Coupled filaments on their way over the workpiece, in steps of TR-BDF2.
//!
//! Step-size control looks at the requested results. The embedded weights of the method, applied to
//! the forces at the three stages of a step, estimate its error in the impulse of each filament on
//! the workpiece (Hosea and Shampine, Applied Numerical Mathematics 20, 1996). Forces on the
//! workpiece do not show the action of filaments on each other before they touch it: rates of their
//! momentum do. They also include the forces of the clamp and of neighbours.

mod account;
mod balance;
mod stage;
mod tr_bdf2;

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use super::bundle::{BrushState, Bundle, Effort, GroupState, NoConvergence};
use super::filaments::ToolFilament;
use super::gmres::Vector;
use super::group::WorkpieceLoad;
use super::pressing::FilamentPress;
use super::result::{BrushStatistics, ToolSample};
use super::settle::{FilamentPose, turned};
use super::team;
use crate::equations::linear::add;
use crate::equations::{LANES, Lanes, Lanewise, Real};
use crate::integrate::tableau::TR_BDF2;
use crate::integrate::{Pace, RejectionCause, StepChange, StepControl, StepControlError};
use crate::model::metrics::{ContactRecord, tip_deflection};
use crate::simulation::{CompletedTurns, EdgeWork};
use crate::tool::{ClampMotion, RotaryTool, Turning};
use crate::workpiece::Workpiece;
use account::PressSum;
pub use account::{Account, PairAccount, Timetable};
pub use balance::Balance;
use stage::StageLoads;
pub use tr_bdf2::TrBdf2Stepper;
use tr_bdf2::integral_error;

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

/// Accuracy of the steps of a sector.
#[derive(Clone, Copy, Debug)]
pub struct Accuracy {
    /// Largest last correction of a node's velocity in m/s.
    pub newton: f64,
    /// Longest step in s.
    pub longest: f64,
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
                filament.workpiece.edges(),
            );
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
