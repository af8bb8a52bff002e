//! Loads at the end of a stage.

use super::super::bundle::{BrushState, Bundle};
use super::super::group::{Budget, WorkpieceLoad};
use super::account::PressSum;
use crate::equations::Lanes;
use crate::equations::linear::scale;
use crate::tool::{RotaryTool, Turning};

/// Loads, presses and budget at the end of a stage.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct StageLoads {
    pub(super) loads: Vec<WorkpieceLoad>,
    /// Forces between filaments, in the order of the pairs.
    pub(super) presses: Vec<([usize; 2], PressSum)>,
    /// Rates of the momentum of all filaments in N, by group.
    pub(super) momentum_rates: Vec<[Lanes; 3]>,
    pub(super) budget: Budget,
}

impl StageLoads {
    /// Evaluates the bundle at the end of a stage.
    pub(super) fn take(&mut self, bundle: &mut Bundle<Turning<RotaryTool>>, motion: &BrushState) {
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
