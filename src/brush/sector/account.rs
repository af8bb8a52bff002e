//! Contacts of a filament with the workpiece and with other filaments, summed over the steps.

use super::super::group::WorkpieceLoad;
use super::tr_bdf2::StepPart;
use super::{MAX_COUNT, ROUNDING_SHARE};
use crate::equations::linear::{add, scale};
use crate::integrate::tableau::TR_BDF2;
use crate::model::metrics::ContactRecord;
use crate::model::settings::MAX_TURNS;
use crate::simulation::{CompletedTurns, ContactSum, EdgeWork};
use crate::workpiece::Edge;

/// Timetable of a filament in s.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Timetable {
    /// Start of its first turn. Its motion may begin earlier.
    pub begin: f64,
    /// Duration of a turn.
    pub turn: f64,
    /// Tail angle of a single turn, see [`Pass::tail_time`](crate::simulation::Pass::tail_time).
    pub tail: Option<f64>,
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
    pub(super) timetable: Timetable,
    pub(super) load: WorkpieceLoad,
    pub(super) edge_work: EdgeWork,
}

impl Account {
    /// Returns `true` if turns are numbered without gaps, and the completed ones have impulses.
    pub(super) fn has_consistent_turns(&self) -> bool {
        let completed = self.impulses.len();
        completed <= MAX_TURNS
            && self.record.turn == completed + 1
            && self.completed.last().map_or(0, |record| record.turn) == completed
            && self.record.count <= MAX_COUNT
    }

    /// Returns `true` until the first turn ends.
    pub fn is_in_first_turn(&self) -> bool {
        self.record.turn == 1
    }

    /// Returns the last turn that has ended, or the first one.
    pub fn last(&self) -> &ContactRecord {
        self.completed.last().unwrap_or(&self.record)
    }

    /// Returns the impulse of all turns so far in N s.
    pub fn total_impulse(&self) -> f64 {
        self.impulses.iter().sum::<f64>() + self.record.impulse
    }

    /// Adds a step from `begin` over `h` (s), with the loads at its middle stage and its end, and
    /// the tip deflection (m) there, over a workpiece with these `edges`. A turn that ends within
    /// the step takes its part of it: a filament that swings ahead presses in two turns. A single
    /// turn takes all of the contact that goes on.
    pub(super) fn observe(
        &mut self,
        loads: [&WorkpieceLoad; 2],
        times @ [begin, h]: [f64; 2],
        deflection: f64,
        edges: &[Edge],
    ) {
        let ended = (self.end_of_turn() - begin) / h;
        let [_, end] = loads;
        let [entry, exit] = contact_part(self.load.pressing, end.pressing);
        let goes_on = self.timetable.tail.is_some() && (entry..exit).contains(&ended.max(0.0));
        if ended < 1.0 - ROUNDING_SHARE && !goes_on {
            let [before, after] = StepPart::split(ended);
            self.add(loads, times, edges, &before);
            self.begin_turn();
            self.add(loads, times, edges, &after);
        } else {
            self.add(loads, times, edges, &StepPart::whole());
        }
        self.record.max_deflection = self.record.max_deflection.max(deflection);
        self.load = *end;
        self.end_turn(begin + h, h);
    }

    /// Adds a part of a step to the current turn.
    fn add(
        &mut self,
        [middle, end]: [&WorkpieceLoad; 2],
        [begin, h]: [f64; 2],
        edges: &[Edge],
        part: &StepPart,
    ) {
        let Timetable { turn, touches, .. } = &self.timetable;
        let turned = (self.record.turn - 1) as f64 * turn;
        let start = self.load;
        let mean = |of: &dyn Fn(&ContactSum) -> f64| {
            h * part.integral([&start, middle, end].map(|load| of(&load.sum)))
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
        let [from, to] = part.shares;
        let stages = [(TR_BDF2.node(1), middle), (1.0, end)];
        for (_, load) in stages.iter().filter(|(at, _)| (from..=to).contains(at)) {
            record.peak_force = record.peak_force.max(load.sum.normal);
            record.penetration = record.penetration.max(load.penetration);
            record.contact_nodes = record.contact_nodes.max(load.contact_nodes);
            record.edge_penetration = record.edge_penetration.max(load.edge_penetration);
        }
        let [entry, exit] = contact_part(start.pressing, end.pressing);
        let touching = [entry.max(from), exit.min(to)];
        if touching[1] > touching[0] {
            // A contact that goes on from the turn before counts in this one, too.
            let is_new = entry > from || start.pressing <= 0.0 || record.time == 0.0;
            record.count += usize::from(is_new);
            record.add_time(
                h * (touching[1] - touching[0]),
                touching.map(|share| begin + share * h),
                touches,
                turned,
            );
        }
        for (j, load) in [&start, middle, end].into_iter().enumerate() {
            let Some(worked) = load.worked else { continue };
            // Work is spread over the path along an edge. It stays in place where the step begins
            // or ends off the edge.
            let here =
                |other: &WorkpieceLoad| other.worked.filter(|other| other.edge == worked.edge);
            let places = [&start, end].map(|other| here(other).unwrap_or(worked).place);
            self.edge_work
                .add(worked.edge, places, h * part.weights[j] * worked.power);
        }
        if end.worked.is_some() {
            self.record.edge_evenness = self.edge_work.evenness(edges);
        }
    }

    /// Returns the end of the current turn in s. After a single turn, the filament is out of use.
    fn end_of_turn(&self) -> f64 {
        let Timetable {
            begin, turn, tail, ..
        } = &self.timetable;
        match tail {
            Some(tail) if self.is_in_first_turn() => *tail,
            Some(_) => f64::INFINITY,
            None => begin + self.record.turn as f64 * turn,
        }
    }

    /// Ends the turn if a step of `h` (s) to `end` (s) reaches its end, and no contact prolongs it.
    pub(super) fn end_turn(&mut self, end: f64, h: f64) {
        let goes_on = self.timetable.tail.is_some() && self.load.pressing > 0.0;
        if end >= self.end_of_turn() - ROUNDING_SHARE * h && !goes_on {
            self.begin_turn();
        }
    }

    /// Begins the next turn.
    fn begin_turn(&mut self) {
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

impl PairAccount {
    pub(super) fn add(&mut self, press: &PressSum, time: f64) {
        self.impulse += time * press.normal;
        self.vector_impulse = add(self.vector_impulse, scale(time, press.force));
        self.peak = self.peak.max(press.normal);
        self.time += time;
        self.moment += time * press.moment;
        self.dissipated += time * press.dissipated;
    }
}

/// Sum of the presses between two filaments.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct PressSum {
    pub(super) normal: f64,
    /// Force on the filament of the smaller number in N.
    pub(super) force: [f64; 3],
    pub(super) moment: f64,
    pub(super) dissipated: f64,
}

impl PressSum {
    pub(super) fn add(&mut self, other: &Self) {
        self.normal += other.normal;
        self.force = add(self.force, other.force);
        self.moment += other.moment;
        self.dissipated += other.dissipated;
    }
}
