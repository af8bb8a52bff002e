//! Order of outcomes by the goal.

use std::cmp::Ordering;

use bristle::model::metrics::SWEEPING_RATIO;

use super::limits::Limits;
use super::outcome::{Most, Outcome};

/// Relative difference below which a force counts as the target.
pub(super) const NEAR: f64 = 0.05;

/// Compares two outcomes; the better one is less. Outcomes near the target, or entirely within the
/// limit of the force, come first. Among them laterally stable ones precede, then sweeping ones.
/// Next counts the uncertainty nearest to the target, or the highest force, each to 5 %. Last
/// counts the distance from the line between sweeping and striking.
pub(super) fn rank(limits: &Limits, a: &Outcome, b: &Outcome) -> Ordering {
    coarse_rank(limits, a, b).then(distance(b).total_cmp(&distance(a)))
}

/// Returns the distance of an outcome from the line between sweeping and striking.
fn distance(outcome: &Outcome) -> f64 {
    (outcome.contact_time_ratio - SWEEPING_RATIO).abs()
}

/// Compares two outcomes like [`rank`], without the distance from the line.
pub(super) fn coarse_rank(limits: &Limits, a: &Outcome, b: &Outcome) -> Ordering {
    let key = |outcome: &Outcome| {
        let force = outcome.central_n();
        let (off, last) = match limits.target_force_n {
            Some(target) => {
                let off = (force - target).abs();
                let worst = outcome
                    .ends()
                    .map(|end| (end - target).abs())
                    .into_iter()
                    .fold(0.0, f64::max);
                // Those that are far are ranked by how far.
                (
                    if off > NEAR * target { off } else { 0.0 },
                    (worst / (NEAR * target)).round(),
                )
            }
            None => {
                let most = outcome.removal_power_w(limits.most()).unwrap_or(force);
                (
                    f64::from(u8::from(!limits.hold_with_band(outcome))),
                    -(most.ln() / NEAR).round(),
                )
            }
        };
        // Strikes may remove more.
        let strikes = outcome.contact_time_ratio <= SWEEPING_RATIO && limits.most() == Most::Force;
        let flaws = [outcome.laterally_unstable, strikes].map(|flaw| f64::from(u8::from(flaw)));
        [off, flaws[0], flaws[1], last]
    };
    let pairs = key(a).into_iter().zip(key(b));
    pairs
        .map(|(a, b)| a.total_cmp(&b))
        .find(|order| order.is_ne())
        .unwrap_or(Ordering::Equal)
}
