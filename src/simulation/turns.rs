//! The turns of a pass: after its contact the filament turns on, vibrates freely, and returns in
//! its actual state.
//!
//! Each turn begins at the lead angle before nominal entry and lasts for a whole turn of the tool,
//! also the last one: a vibrating filament may swing ahead and touch the workpiece early, so that
//! its contact spans two turns. A single turn ends at the tail angle after nominal exit, or later
//! with the contact.

use super::batches::Batches;
use super::system::integral::NORMAL_IMPULSE;
use super::trajectory::Trajectory;
use crate::model::metrics::{ContactRecord, Metrics};
use crate::model::settings::{MAX_STEADY_CHANGE, MAX_TURNS, Turns};

/// Number of last turns over which metrics are averaged if the impulse does not become steady.
const MAX_AVERAGED_TURNS: usize = MAX_TURNS / 2;

/// Returns the start of a turn in s, if each lasts `turn_time` (s). Turns are counted from 0.
pub(super) fn start_of_turn(turn: usize, turn_time: f64) -> f64 {
    turn as f64 * turn_time
}

/// Progress of a pass through its turns.
#[derive(Clone, Debug)]
pub(super) struct Itinerary {
    turns: Turns,
    /// Turns that do not count, before the first.
    before: usize,
    /// Durations in s of a whole turn, and from its beginning to the tail angle.
    turn_time: f64,
    pass_time: f64,
    leg: Leg,
    /// Normal impulse in N s when the turn began.
    earlier: f64,
    /// Normal impulse in N s of each turn so far.
    impulses: Vec<f64>,
}

/// Part of a turn.
#[derive(Clone, Copy, Debug)]
enum Leg {
    /// Turns that do not count.
    Before,
    /// Beginning to tail angle.
    Pass,
    /// Rest of the contact after the tail angle.
    Contact,
    /// Rest of the turn.
    Flight,
}

impl Itinerary {
    /// Creates an itinerary at its beginning, with the number of turns `before` the first that
    /// counts. A turn lasts `turn_time` (s), and `pass_time` (s) to its tail angle.
    pub fn new(turns: Turns, before: usize, turn_time: f64, pass_time: f64) -> Self {
        let impulses = Vec::with_capacity(turns.at_most());
        let leg = if before > 0 { Leg::Before } else { Leg::Pass };
        Self {
            turns,
            before,
            turn_time,
            pass_time,
            leg,
            earlier: 0.0,
            impulses,
        }
    }

    /// Extends a trajectory that has reached its end. Returns `false` at the end of the last turn.
    pub fn proceed(&mut self, trajectory: &mut Trajectory) -> bool {
        let next_turn = start_of_turn(self.before + self.impulses.len() + 1, self.turn_time);
        let is_single = self.turns.at_most() == 1;
        match self.leg {
            Leg::Before => {
                self.leg = Leg::Pass;
                self.earlier = trajectory.start().integrals[NORMAL_IMPULSE];
                trajectory.go_on(
                    start_of_turn(self.before, self.turn_time) + self.pass_time,
                    false,
                );
            }
            Leg::Pass if !is_single => {
                self.leg = Leg::Flight;
                trajectory.go_on(next_turn, false);
            }
            Leg::Pass if trajectory.is_touching() => {
                self.leg = Leg::Contact;
                trajectory.go_on(next_turn, true);
            }
            Leg::Pass | Leg::Contact | Leg::Flight => {
                let total = trajectory.start().integrals[NORMAL_IMPULSE];
                // The sum of a contact whose force underflows can be less than zero.
                self.impulses.push((total - self.earlier).max(0.0));
                if self.is_over() {
                    return false;
                }
                self.earlier = total;
                self.leg = Leg::Pass;
                trajectory.go_on(next_turn + self.pass_time, false);
            }
        }
        true
    }

    /// Returns `true` if no turn is left.
    fn is_over(&self) -> bool {
        // An impulse that is not finite will not become steady.
        let has_settled = || {
            are_steady(&self.impulses)
                || self
                    .impulses
                    .last()
                    .is_some_and(|impulse| !impulse.is_finite())
        };
        self.impulses.len() >= self.turns.at_most()
            || (self.turns == Turns::Steady && has_settled())
    }

    /// Returns `true` if the turns should have become steady, but have not.
    pub fn is_unsteady(&self) -> bool {
        self.turns == Turns::Steady && !are_steady(&self.impulses)
    }

    /// Returns the normal impulse in N s of each turn.
    pub fn into_impulses(self) -> Vec<f64> {
        self.impulses
    }
}

/// Returns `true` if the last two turns have the same normal impulse (N s), or all have none: a
/// filament that has once touched can swing over the workpiece for some turns, and return.
pub(crate) fn are_steady(impulses: &[f64]) -> bool {
    match *impulses {
        [.., before, last] if last > 0.0 => (last - before).abs() < MAX_STEADY_CHANGE * last,
        [_, _, ..] => impulses.iter().all(|impulse| *impulse == 0.0),
        _ => false,
    }
}

/// Returns the relative standard error of the mean of the last `impulses` of turns, at most
/// [`MAX_AVERAGED_TURNS`].
pub(crate) fn standard_error_of_turns(impulses: &[f64]) -> f64 {
    let first = impulses.len().saturating_sub(MAX_AVERAGED_TURNS);
    Batches::new(&impulses[first..]).standard_error()
}

/// Records of the last completed turns, at most [`MAX_AVERAGED_TURNS`], the oldest first.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct CompletedTurns(Vec<ContactRecord>);

impl CompletedTurns {
    /// Adds the record of a turn.
    pub fn push(&mut self, record: ContactRecord) {
        if self.0.len() == MAX_AVERAGED_TURNS {
            self.0.remove(0);
        }
        self.0.push(record);
    }

    /// Returns the record of the last turn.
    pub fn last(&self) -> Option<&ContactRecord> {
        self.0.last()
    }

    /// Returns the mean metrics of turns that do not become steady, with the standard error of
    /// their impulse. `None` if there are no turns.
    pub fn mean(&self, metrics_of: impl Fn(&ContactRecord) -> Metrics) -> Option<Metrics> {
        let turns: Vec<Metrics> = self.0.iter().map(metrics_of).collect();
        let impulses: Vec<f64> = self.0.iter().map(|record| record.impulse).collect();
        Some(Metrics {
            unsteady_turns: true,
            impulse_standard_error: standard_error_of_turns(&impulses),
            ..Metrics::combined(&turns)?
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impulses_are_steady_within_a_thousandth_of_the_later_one() {
        assert!(
            [[0.0, 0.0], [0.9991, 1.0], [1.0009, 1.0]]
                .iter()
                .all(|pair| are_steady(pair))
        );
        assert!(
            ![[0.9989, 1.0], [1.0, 0.0], [0.0, 1e-300]]
                .iter()
                .any(|pair| are_steady(pair))
        );
        assert!(
            !are_steady(&[1.0, 0.0, 0.0]),
            "it has swung over the workpiece"
        );
        assert!(!are_steady(&[1.0]));
    }

    #[test]
    fn turns_end_when_they_are_steady_or_many() {
        let after = |turns: Turns, impulses: &[f64]| Itinerary {
            impulses: impulses.to_vec(),
            ..Itinerary::new(turns, 0, 1.0, 0.1)
        };
        assert!(after(Turns::Count(1), &[1.0]).is_over());
        assert!(
            !after(Turns::Count(3), &[1.0; 2]).is_over()
                && after(Turns::Count(3), &[1.0; 3]).is_over()
        );
        assert!(
            !after(Turns::Steady, &[0.0]).is_over() && after(Turns::Steady, &[0.0; 2]).is_over()
        );
        assert!(after(Turns::Steady, &[1.0, f64::NAN]).is_over());
        let alternating: Vec<f64> = (0..MAX_TURNS).map(|turn| (turn % 2) as f64).collect();
        assert!(!after(Turns::Steady, &alternating[1..]).is_over());
        assert!(
            after(Turns::Steady, &alternating).is_over()
                && after(Turns::Steady, &alternating).is_unsteady()
        );
        assert!(!after(Turns::Steady, &[1.0; MAX_TURNS]).is_unsteady());
        assert!(!after(Turns::Count(2), &[1.0, 2.0]).is_unsteady());
    }

    #[test]
    fn unsteady_turns_have_the_mean_of_the_last_ones_and_its_standard_error() {
        let metrics_of = |record: &ContactRecord| Metrics {
            contact_normal_impulse_n_s: record.impulse,
            peak_contact_normal_force_n: record.peak_force,
            turns: record.turn,
            ..Metrics::default()
        };
        let mut turns = CompletedTurns::default();
        assert_eq!(turns.mean(metrics_of), None);
        // The first half does not count: means of five turns are 2.6 or 2.4 in turn.
        for turn in 1..=MAX_TURNS {
            turns.push(ContactRecord {
                impulse: if turn <= 25 {
                    1e3
                } else {
                    2.0 + (turn % 2) as f64
                },
                peak_force: turn as f64,
                ..ContactRecord::of_turn(turn)
            });
        }
        let mean = turns.mean(metrics_of).expect("there are turns");
        // 12 turns of 3 (27, 29, …) and 13 of 2 (26, 28, …); √(0.012/5) of the batch means.
        assert!((mean.contact_normal_impulse_n_s - 2.48).abs() < 1e-12);
        let expected = (0.012_f64 / 5.0).sqrt() / 2.48;
        assert!((mean.impulse_standard_error / expected - 1.0).abs() < 1e-9);
        assert!(mean.unsteady_turns && mean.turns == MAX_TURNS);
        assert_eq!(mean.peak_contact_normal_force_n, 50.0);
    }
}
