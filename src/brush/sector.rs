//! Filaments that are coupled, on their way over the workpiece, in fixed steps.

use std::collections::BTreeMap;
use std::f64::consts::SQRT_2;

use super::bundle::{BrushState, Bundle, Effort, GroupState, Kinematics, NoConvergence};
use super::filaments::ToolFilament;
use super::gmres::Vector;
use super::group::{Budget, Exchange, WorkpieceLoad};
use super::pressing::Pair;
use super::result::{BrushStatistics, ToolSample};
use super::settle::{Pose, turned};
use super::team;
use crate::equations::linear::{add, dot, scale};
use crate::equations::{LANES, Lanes, Lanewise, Real};
use crate::model::metrics::{ContactRecord, tip_deflection};
use crate::model::settings::MAX_TURNS;
use crate::simulation::{ContactSum, EdgeWork};
use crate::tool::{ClampMotion, RotaryTool, Turning};
use crate::workpiece::Workpiece;

/// The middle stage of TR-BDF2 is at `γ = 2 − √2` of the step (Bank et al. 1985; Hosea and Shampine
/// 1996).
const MIDDLE: f64 = 2.0 - SQRT_2;
/// Weight of a stage in itself.
const OWN: f64 = 0.5 * MIDDLE;
/// Weights of the first two stages in the last.
const OTHERS: f64 = 0.25 * SQRT_2;
/// The share that rounding may cause.
const NEGLIGIBLE: f64 = 1e-6;
/// Weights of the beginning, the middle stage and the end in an integral over a step.
const WEIGHTS: [f64; 3] = [OTHERS, OTHERS, OWN];

/// When a filament passes, in s.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Timetable {
    /// Its first turn begins. Its motion may begin earlier.
    pub begin: f64,
    /// The time of a whole turn.
    pub turn: f64,
    /// Between which times the undeformed filament touches in the first turn.
    pub touches: Vec<[f64; 2]>,
}

/// One filament's contact so far.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Account {
    /// That of the current turn.
    record: ContactRecord,
    /// That of the turn before.
    completed: Option<ContactRecord>,
    /// The impulses of the turns before, in N s.
    pub impulses: Vec<f64>,
    timetable: Timetable,
    load: WorkpieceLoad,
    edge_work: EdgeWork,
}

/// How two filaments have pressed on each other so far.
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
    /// Energy that damping and friction took, in J.
    pub dissipated: f64,
}

/// What a sector has, and what went in and out so far, each integrated apart from the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Balance {
    /// At the start.
    begin: [f64; 4],
    /// Now: energy in J, momentum in N s.
    now: [f64; 4],
    /// Work of the clamps and of a moving workpiece in J.
    work: f64,
    /// Energy that joints and contacts took, in J.
    dissipated: f64,
    /// Work that went in or out, without regard to its sign, in J.
    turnover: f64,
    /// Impulse of clamps, workpiece and gravity in N s.
    impulse: [f64; 3],
    /// Impulse of the workpiece without regard to its direction, in N s.
    contact: f64,
    /// What was exchanged at the end of the last step.
    rates: Exchange,
}

/// Why a step was not possible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Failure {
    /// When, in s.
    pub time: f64,
    /// The filaments that cross each other, if that is why.
    pub crossing: Option<[usize; 2]>,
}

/// Filaments that are coupled.
pub struct Sector {
    bundle: Bundle<Turning<RotaryTool>>,
    motion: BrushState,
    stepper: Stepper,
    accounts: Vec<Account>,
    pairs: BTreeMap<[usize; 2], PairAccount>,
    /// What the last step ended with.
    now: Stage,
    /// Memory for the stages of a step: the middle one, and that at its end.
    stages: [Stage; 2],
    statistics: BrushStatistics,
    balance: Balance,
    /// The share of the energy that went in or out which its balance may lack.
    allowed: f64,
    /// The next step, as a share of the whole.
    share: f64,
}

/// The state of a sector.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SectorState {
    motion: BrushState,
    groups: Vec<GroupState>,
    accounts: Vec<Account>,
    pairs: BTreeMap<[usize; 2], PairAccount>,
    /// How filaments press on each other where the last step ended.
    presses: Vec<([usize; 2], PressSum)>,
    statistics: BrushStatistics,
    balance: Balance,
    share: f64,
}

impl Sector {
    /// Filaments at the start of their motion, with their timetables. A stage is solved once
    /// velocities change by less than `tolerance` (m/s). The balance of the energies may lack the
    /// share `allowed` of what went in or out.
    pub fn new(
        mut bundle: Bundle<Turning<RotaryTool>>,
        motion: BrushState,
        timetables: Vec<Timetable>,
        tolerance: f64,
        allowed: f64,
    ) -> Self {
        let accounts = timetables
            .into_iter()
            .zip(bundle.filaments())
            .map(|(timetable, filament)| Account {
                record: ContactRecord::of_turn(1),
                completed: None,
                impulses: Vec::new(),
                load: WorkpieceLoad::none(),
                edge_work: EdgeWork::new(filament.workpiece.edges().len()),
                timetable,
            })
            .collect();
        let mut now = Stage::default();
        now.take(&mut bundle, &motion);
        let balance = Balance::new(&now.budget);
        Self {
            stepper: Stepper::new(&motion, tolerance),
            bundle,
            motion,
            accounts,
            pairs: BTreeMap::new(),
            now,
            stages: Default::default(),
            statistics: BrushStatistics::default(),
            balance,
            allowed,
            share: 1.0,
        }
    }

    /// The contacts with the workpiece so far, by filament.
    pub fn accounts(&self) -> &[Account] {
        &self.accounts
    }

    /// How filaments have pressed on each other so far.
    pub fn pairs(&self) -> &BTreeMap<[usize; 2], PairAccount> {
        &self.pairs
    }

    /// The filaments.
    pub fn bundle(&self) -> &Bundle<Turning<RotaryTool>> {
        &self.bundle
    }

    /// The pose of each filament.
    pub fn poses(&self) -> Vec<Pose> {
        let n = self.bundle.segments();
        let (
            charts,
            BrushState {
                time,
                q,
                v,
                accelerations,
            },
        ) = (self.bundle.charts(), &self.motion);
        let segment = |at: usize, lane: usize, angle: f64| {
            let block = |vector: &Vector| vector[at].map(|value| value.lane(lane));
            let [e, rate, _] = charts[at].direction([block(q), block(v), block(accelerations)]);
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

    /// Work done so far.
    pub fn statistics(&self) -> &BrushStatistics {
        &self.statistics
    }

    /// The balance of energy and momentum.
    pub fn balance(&self) -> &Balance {
        &self.balance
    }

    /// The filaments, once those are placed, too, of which nothing is computed now.
    pub fn placed(&mut self) -> &Bundle<Turning<RotaryTool>> {
        self.bundle.place_sleeping(&self.motion);
        &self.bundle
    }

    /// Forgets what was found on the way here: what follows does not depend on it.
    pub fn forget(&mut self) {
        self.bundle.forget();
    }

    /// Goes on to `end` (s), in one step of `length` (s) or, where that fails or misses the energy
    /// by too much, in shorter ones.
    ///
    /// # Errors
    /// If the shortest step fails.
    pub fn advance(&mut self, end: f64, length: f64) -> Result<ToolSample, Failure> {
        /// The shortest step, as a share of the whole.
        const SHORTEST: f64 = 1e-4;
        /// The same for steps that only miss the energy: the balance of the whole motion tells
        /// where that is not enough.
        const SHORT: f64 = 1.0 / 256.0;
        if self.bundle.begin_step(&mut self.motion) {
            self.balance
                .go_on_with(&self.bundle.evaluate(&self.motion).budget);
        }
        while self.motion.time < end {
            let h = (self.share * length).min(end - self.motion.time);
            if self.bundle.wake(&self.motion, h) {
                self.balance
                    .go_on_with(&self.bundle.evaluate(&self.motion).budget);
            }
            let allowed = if h > SHORT * length {
                self.allowed
            } else {
                f64::INFINITY
            };
            match self.attempt(h, allowed) {
                Ok((effort, is_calm)) => {
                    self.statistics.steps += 1;
                    self.statistics.effort += effort;
                    self.stepper.finish(&mut self.motion);
                    if (end - self.motion.time).abs() < 1e-9 * length {
                        self.motion.time = end;
                    }
                    // What failed may be over.
                    if is_calm {
                        self.share = (2.0 * self.share).min(1.0);
                    }
                }
                Err(_) if self.bundle.has_woken() => {}
                Err(_) if h > SHORTEST * length => {
                    self.statistics.halved_steps += 1;
                    self.share = 0.5 * h / length;
                }
                Err(crossing) => {
                    return Err(Failure {
                        time: self.motion.time,
                        crossing,
                    });
                }
            }
        }
        Ok(self.sample())
    }

    /// Tries a step of `h` (s), after which the balance of the energies may lack the share
    /// `allowed`. Returns whether steps may be longer. If the step is not possible, returns the
    /// filaments that cross each other, if that is why.
    fn attempt(&mut self, h: f64, allowed: f64) -> Result<(Effort, bool), Option<[usize; 2]>> {
        /// Of what the balance may still lack: a step of twice the length lacks about eight times
        /// as much.
        const CALM: f64 = 0.1;
        /// While so few filaments have touched, a step may lack this share of what one of them may:
        /// their mean does not hide an impact that is badly resolved.
        const FEW: usize = 3;
        const OF_ONE: f64 = 0.3;
        let Self {
            bundle,
            motion,
            stepper,
            accounts,
            pairs,
            now,
            stages: [middle, end],
            balance,
            ..
        } = self;
        let mut effort = stepper
            .middle_stage(bundle, motion, h)
            .map_err(|NoConvergence| None)?;
        middle.take(bundle, &stepper.middle);
        if bundle.has_woken() {
            return Err(None);
        }
        effort += stepper
            .end_stage(bundle, motion, h)
            .map_err(|NoConvergence| None)?;
        if let Some(crossing) = crossing(bundle) {
            return Err(Some(crossing));
        }
        end.take(bundle, &stepper.end);
        if bundle.has_woken() {
            return Err(None);
        }
        let mut next = *balance;
        next.add(&middle.budget, &end.budget, h);
        let lack = next.energy_lack() - balance.energy_lack();
        let whole = allowed * next.energy_defect()[1];
        let touched = accounts
            .iter()
            .filter(|account| account.has_touched())
            .take(FEW + 1)
            .count();
        let most = if touched > FEW {
            whole
        } else {
            OF_ONE * whole / touched.max(1) as f64
        };
        let left = (whole - next.energy_lack().abs()).min(most - lack.abs());
        // What earlier steps lack too much is not for this one to make good.
        let own = allowed * (next.turnover - balance.turnover) + next.rounding();
        if !(left >= 0.0 || lack.abs() <= own) {
            return Err(None);
        }
        let is_calm = lack.abs() <= CALM * left.max(own);
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
        let groups = accounts
            .chunks_mut(LANES)
            .enumerate()
            .map(|(group, accounts)| (group, (group, accounts)));
        team::for_each(groups, |(group, accounts)| {
            accounts
                .iter_mut()
                .enumerate()
                .for_each(|(lane, account)| observe(group * LANES + lane, account));
        });
        for (stage, weight) in [&*now, middle, end].into_iter().zip(WEIGHTS) {
            for (filaments, press) in &stage.presses {
                pairs.entry(*filaments).or_default().add(press, h * weight);
            }
        }
        *balance = next;
        std::mem::swap(now, end);
        Ok((effort, is_calm))
    }

    /// The forces where the last step ended.
    fn sample(&self) -> ToolSample {
        let mut sample = ToolSample {
            time_s: self.motion.time,
            ..ToolSample::default()
        };
        for account in &self.accounts {
            sample.contact_normal_force_n += account.load.sum.normal;
            sample.contact_force_n = add(sample.contact_force_n, account.load.sum.force);
            sample.contact_moment_n_m += account.load.sum.moment;
            sample.touching_filaments += usize::from(account.load.pressing > 0.0);
        }
        for (_, press) in &self.now.presses {
            sample.press_force_n += press.normal;
            sample.touching_pairs += 1;
        }
        sample
    }

    /// By filament, where the last step ended: normal force on the workpiece, and of other
    /// filaments, in N.
    pub fn forces(&self) -> [Vec<f64>; 2] {
        let workpiece: Vec<f64> = self
            .accounts
            .iter()
            .map(|account| account.load.sum.normal)
            .collect();
        let mut others = vec![0.0; workpiece.len()];
        for (filaments, press) in &self.now.presses {
            for &filament in filaments {
                others[filament] += press.normal;
            }
        }
        [workpiece, others]
    }

    /// The state, from which a sector of the same filaments goes on with the same bits.
    pub fn state(&self) -> SectorState {
        SectorState {
            motion: self.motion.clone(),
            groups: self.bundle.states(),
            accounts: self.accounts.clone(),
            pairs: self.pairs.clone(),
            presses: self.now.presses.clone(),
            statistics: self.statistics,
            balance: self.balance,
            share: self.share,
        }
    }

    /// Goes back to a state. `None` if it is not one of such a sector.
    pub fn restore(&mut self, state: SectorState) -> Option<()> {
        let SectorState {
            motion,
            groups,
            accounts,
            pairs,
            presses,
            statistics,
            balance,
            share,
        } = state;
        let lengths =
            |motion: &BrushState| [&motion.q, &motion.v, &motion.accelerations].map(Vec::len);
        let is_own = |(account, own): (&Account, &Account)| {
            account.timetable == own.timetable
                && account.edge_work.edges() == own.edge_work.edges()
                && account.impulses.len() <= MAX_TURNS
        };
        let mut filaments = pairs
            .keys()
            .chain(presses.iter().map(|(filaments, _)| filaments))
            .flatten();
        let fits = lengths(&motion) == lengths(&self.motion)
            && accounts.len() == self.accounts.len()
            && accounts.iter().zip(&self.accounts).all(is_own)
            && filaments.all(|filament| *filament < accounts.len())
            && (share > 0.0 && share <= 1.0);
        if !fits {
            return None;
        }
        self.bundle.restore(groups)?;
        (self.motion, self.accounts, self.pairs, self.now.presses) =
            (motion, accounts, pairs, presses);
        (self.statistics, self.balance, self.share) = (statistics, balance, share);
        Some(())
    }
}

impl Account {
    /// Whether the filament touches the workpiece in its first turn.
    pub fn is_touching(&self) -> bool {
        self.load.pressing > 0.0 && self.record.turn == 1
    }

    /// Whether it has touched the workpiece, in any turn.
    fn has_touched(&self) -> bool {
        self.impulses
            .iter()
            .chain([&self.record.impulse])
            .any(|impulse| *impulse > 0.0)
    }

    /// The last turn that has ended, or the first one.
    pub fn last(&self) -> &ContactRecord {
        self.completed.as_ref().unwrap_or(&self.record)
    }

    /// The impulses of its turns in N s at the end. A single turn may not have been closed by
    /// another: `is_single` takes it as it is.
    pub fn turns(&self, is_single: bool) -> &[f64] {
        if is_single {
            std::slice::from_ref(&self.last().impulse)
        } else {
            &self.impulses
        }
    }

    /// Adds a step from `begin` over `h` (s), with the loads at its middle stage and at its end.
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
            h * (OTHERS * (of(&start.sum) + of(&middle.sum)) + OWN * of(&end.sum))
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
        for (load, weight) in [(&start, OTHERS), (middle, OTHERS), (end, OWN)] {
            let Some(worked) = load.worked else { continue };
            // Work is spread over the way along an edge, and stays in place where the step begins
            // or ends off it.
            let here =
                |other: &WorkpieceLoad| other.worked.filter(|other| other.edge == worked.edge);
            let places = [&start, end].map(|other| here(other).unwrap_or(worked).place);
            self.edge_work
                .add(worked.edge, places, h * weight * worked.power);
        }
        record.max_deflection = record.max_deflection.max(deflection);
        self.load = *end;
    }

    /// Ends the turn if a step of `h` (s) that ends at `end` (s) is the first to reach its end: so
    /// the last turn ends with the simulation.
    fn end_turn(&mut self, end: f64, h: f64) {
        let Timetable { begin, turn, .. } = &self.timetable;
        if end < begin + self.record.turn as f64 * turn - NEGLIGIBLE * h {
            return;
        }
        self.impulses.push(self.record.impulse);
        self.completed = Some(self.record);
        self.record = ContactRecord::of_turn(self.record.turn + 1);
        self.edge_work.clear();
    }
}

/// Between which parts of a step a filament touches that presses by `start` and `end` (m) at its
/// ends.
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

/// How one filament presses on another.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct PressSum {
    normal: f64,
    /// On the filament of the smaller number.
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

    /// Goes on with other filaments of the sector.
    fn go_on_with(&mut self, part: &Budget) {
        let stock = part.stock();
        self.begin = std::array::from_fn(|i| self.begin[i] + stock[i] - self.now[i]);
        self.now = stock;
        self.rates = part.exchange;
    }

    /// Adds a step of `h` (s), with what its middle stage and its end have.
    fn add(&mut self, middle: &Budget, end: &Budget, h: f64) {
        let rates = [self.rates, middle.exchange, end.exchange];
        let sum = |of: &dyn Fn(&Exchange) -> f64| {
            h * rates
                .iter()
                .zip(WEIGHTS)
                .map(|(rates, weight)| weight * of(rates))
                .sum::<f64>()
        };
        let [work, taken] = [sum(&|rates| rates.work), sum(&|rates| rates.taken)];
        self.work += work;
        self.dissipated += taken;
        self.turnover += sum(&|rates| rates.work.abs() + rates.taken.abs());
        self.impulse = std::array::from_fn(|i| self.impulse[i] + sum(&|rates| rates.force[i]));
        self.contact += sum(&|rates| rates.strength);
        self.now = end.stock();
        self.rates = end.exchange;
    }

    /// Energies that were gained, put in, and taken so far, in J.
    pub fn energies(&self) -> [f64; 3] {
        [self.now[0] - self.begin[0], self.work, self.dissipated]
    }

    /// The energy that the balance lacks, in J; negative where it has too much.
    fn energy_lack(&self) -> f64 {
        let [gain, work, dissipated] = self.energies();
        work - dissipated - gain
    }

    /// What a step may lack because energies are rounded, in J: while nothing touches, that can be
    /// more than is turned over.
    fn rounding(&self) -> f64 {
        /// Of the last digit.
        const DIGITS: f64 = 64.0;
        DIGITS * f64::EPSILON * self.begin[0].abs().max(self.now[0].abs())
    }

    /// What the balance of the energies lacks, and what it is compared with, in J.
    pub fn energy_defect(&self) -> [f64; 2] {
        // What turns freely has no turnover but that of rounding.
        [
            self.energy_lack().abs(),
            self.turnover + NEGLIGIBLE * self.begin[0].abs(),
        ]
    }

    /// What the balance of the momentum lacks, and what it is compared with, in N s.
    pub fn momentum_defect(&self) -> [f64; 2] {
        let lack: [f64; 3] =
            std::array::from_fn(|i| self.now[i + 1] - self.begin[i + 1] - self.impulse[i]);
        let [_, own @ ..] = self.begin;
        [dot(lack, lack).sqrt(), self.contact + dot(own, own).sqrt()]
    }
}

impl Budget {
    /// Energy and momentum.
    fn stock(&self) -> [f64; 4] {
        let [x, y, z] = self.momentum;
        [self.energy, x, y, z]
    }
}

/// Two filaments one of which is so deep in the other that they may cross in the next step, or have
/// crossed in the last one. A step is so short that filaments that were apart before it cannot have
/// passed each other beyond that.
fn crossing(bundle: &Bundle<Turning<RotaryTool>>) -> Option<[usize; 2]> {
    /// The least distance of the centrelines, as a share of the reach.
    const LEAST: f64 = 0.5;
    let is_deep = |(_, press): &&Pair| press.near.square() < (LEAST * press.near.reach).powi(2);
    bundle
        .presses()
        .find(is_deep)
        .map(|(filaments, _)| *filaments)
}

/// What a stage ended with.
#[derive(Debug, Default)]
struct Stage {
    loads: Vec<WorkpieceLoad>,
    /// The forces between filaments, in the order of the pairs.
    presses: Vec<([usize; 2], PressSum)>,
    budget: Budget,
}

impl Stage {
    /// Evaluates all at the end of a stage.
    fn take(&mut self, bundle: &mut Bundle<Turning<RotaryTool>>, motion: &BrushState) {
        let found = bundle.evaluate(motion);
        self.budget = found.budget;
        found.take_loads(&mut self.loads);
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
pub struct Stepper {
    tolerance: f64,
    middle: BrushState,
    end: BrushState,
    base: [Vector; 2],
}

impl Stepper {
    /// Memory for steps from `motion`, whose stages are solved once velocities change by less than
    /// `tolerance` (m/s).
    pub fn new(motion: &BrushState, tolerance: f64) -> Self {
        let base = [motion.q.clone(), motion.v.clone()];
        Self {
            tolerance,
            middle: motion.clone(),
            end: motion.clone(),
            base,
        }
    }

    /// The middle stage of a step of `h` (s) from `start`.
    pub fn middle_stage<M: ClampMotion + Sync>(
        &mut self,
        bundle: &mut Bundle<M>,
        start: &BrushState,
        h: f64,
    ) -> Result<Effort, NoConvergence> {
        let (own, blocks, first) = (OWN * h, bundle.segments(), bundle.first_coordinate());
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
        middle.time = start.time + MIDDLE * h;
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

    /// The stage at its end.
    pub fn end_stage<M: ClampMotion + Sync>(
        &mut self,
        bundle: &mut Bundle<M>,
        start: &BrushState,
        h: f64,
    ) -> Result<Effort, NoConvergence> {
        let (own, others) = (OWN * h, OTHERS * h);
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

    /// Puts the end of the step into `motion`.
    pub fn finish(&mut self, motion: &mut BrushState) {
        std::mem::swap(motion, &mut self.end);
    }
}

/// `start + Σ factor · vector`, where a group has so many `blocks`, from the coordinate `from` of
/// each on.
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
        groups.map(|(group, parts)| (group, (group * blocks, parts))),
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
