//! The turns of a pass: the filament turns on after its contact, vibrates freely, and comes back as
//! it is.
//!
//! Each turn begins at the lead angle before nominal entry and lasts for a whole turn of the tool,
//! also the last one: a filament that vibrates may swing ahead and touch the workpiece before it is
//! due, so that its contact spans two turns. A single turn ends at the tail angle after nominal
//! exit or, if the filament still touches the workpiece there, when it no longer does.

use super::system::integral::NORMAL_IMPULSE;
use super::trajectory::Trajectory;
use crate::model::settings::Turns;

/// The impulse is steady if it changes by less than this share of it from one turn to the next.
const STEADY: f64 = 1e-3;

/// The time at which a turn begins in s, if each lasts `turn_time` (s). Turns are counted from 0.
pub(super) fn start_of_turn(turn: usize, turn_time: f64) -> f64 {
    turn as f64 * turn_time
}

/// Where a pass is on its way through its turns.
#[derive(Clone, Debug)]
pub(super) struct Itinerary {
    turns: Turns,
    /// Turns that do not count, before the first.
    before: usize,
    /// Times in s for a whole turn, and from its beginning to the tail angle.
    turn_time: f64,
    pass_time: f64,
    leg: Leg,
    /// The normal impulse in N s when the turn began.
    earlier: f64,
    /// The normal impulse in N s of each turn so far.
    impulses: Vec<f64>,
}

/// The parts of a turn.
#[derive(Clone, Copy, Debug)]
enum Leg {
    /// The turns that do not count.
    Before,
    /// From its beginning to the tail angle.
    Pass,
    /// On from there as long as the filament touches.
    Contact,
    /// On to the end of the turn.
    Flight,
}

impl Itinerary {
    /// At the beginning, with the number of turns `before` the first that counts. A turn lasts
    /// `turn_time` (s), and `pass_time` (s) to its tail angle.
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

    /// Sends a trajectory that has reached its end on. Returns false at the end of the last turn.
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

    /// Whether the turns so far are all.
    fn is_over(&self) -> bool {
        // What is not finite will not become steady either.
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

    /// Whether the turns should have become steady, but have not.
    pub fn is_unsteady(&self) -> bool {
        self.turns == Turns::Steady && !are_steady(&self.impulses)
    }

    /// The normal impulse in N s of each turn.
    pub fn into_impulses(self) -> Vec<f64> {
        self.impulses
    }
}

/// `true` if the last two of the turns with these normal impulses (N s) have the same one. Two turns
/// without contact have.
pub(crate) fn are_steady(impulses: &[f64]) -> bool {
    matches!(*impulses, [.., before, last] if last == before || (last - before).abs() < STEADY * last)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::settings::MAX_TURNS;

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
}
