//! Balance of energy and momentum of a sector.
//!
//! A pass has another balance (`simulation/balance.rs`): it compares the final state with the
//! contact record, because no contact loses energy to another filament. Filaments of a sector press
//! on each other, and its awake filaments change during a run. Therefore all fluxes into a sector
//! are integrated here, step by step.

use super::super::group::{Budget, Exchange};
use super::ROUNDING_SHARE;
use super::tr_bdf2::StepPart;
use crate::equations::linear::dot;

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

impl Balance {
    pub(super) fn new(budget: &Budget) -> Self {
        let begin = budget.stock();
        Self {
            begin,
            now: begin,
            rates: budget.exchange,
            ..Self::default()
        }
    }

    /// Continues with other filaments of the sector.
    pub(super) fn go_on_with(&mut self, part: &Budget) {
        let stock = part.stock();
        self.begin = std::array::from_fn(|i| self.begin[i] + stock[i] - self.now[i]);
        self.now = stock;
        self.rates = part.exchange;
    }

    /// Adds a step of `h` (s), with the budgets of its middle stage and its end.
    pub(super) fn add(&mut self, middle: &Budget, end: &Budget, h: f64) {
        let rates = [self.rates, middle.exchange, end.exchange];
        let step = StepPart::whole();
        let sum = |of: &dyn Fn(&Exchange) -> f64| h * step.integral(rates.map(|rates| of(&rates)));
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
