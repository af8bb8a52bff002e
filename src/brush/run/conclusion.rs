//! Results of a run: metrics, error estimate and balances.

use super::super::alone;
use super::super::error::BrushError;
use super::super::filaments;
use super::super::result::{
    BrushResult, BrushStatistics, EnergyBalance, FilamentResult, PairResult, Residuals,
};
use super::super::sector::{Account, Balance};
use super::super::stretch;
use super::BrushRun;
use crate::model::metrics::Metrics;
use crate::model::settings::Settings;
use crate::model::trim::differ;
use crate::simulation::standard_error_of_turns;

impl BrushRun {
    /// Returns the relative error estimate of the mean impulse: that of the steps, or the change
    /// with the tolerance if it is larger. Where filaments throw each other about, the sum may
    /// agree by chance: changes of single filaments count at least as random ones.
    fn step_error(&self) -> f64 {
        let share = |value: f64, whole: f64| if whole > 0.0 { value / whole } else { 0.0 };
        let [mut error, mut impulse] = [0.0; 2];
        for (group, sector) in &self.sectors {
            let weight = group.weight() as f64;
            error += weight * sector.impulse_error();
            impulse += weight
                * sector
                    .accounts()
                    .iter()
                    .map(Account::total_impulse)
                    .sum::<f64>();
        }
        // Columns that only one of both runs has followed cannot be compared.
        let [mut sum, mut squares, mut compared] = [0.0; 3];
        for (before, now) in self.checked.iter().flatten().zip(self.followed_impulses()) {
            sum += now - before;
            squares += (now - before).powi(2);
            compared += now;
        }
        let change = f64::abs(sum).max(squares.sqrt());
        share(error, impulse).max(share(change, compared))
    }

    /// Returns the results.
    ///
    /// # Errors
    /// If the metrics of a steady stretch are requested and there is none, or if a filament alone
    /// cannot be simulated.
    pub fn finish(mut self) -> Result<BrushResult, BrushError> {
        if self.has_settled {
            self.leave_out_resting();
        }
        let turn_impulses = match self.pass.tail_time() {
            Some(_) => Vec::new(),
            None => self.turn_impulses(),
        };
        let residuals = self.residuals();
        let step_error = self.step_error();
        let mut pairs = Vec::new();
        let mut statistics = BrushStatistics::default();
        for (group, sector) in &self.sectors {
            statistics += *sector.statistics();
            for shift in &group.shifts {
                pairs.extend(sector.pairs().iter().map(|(filaments, account)| {
                    let [filament, other] = filaments.map(|index| {
                        let [column, row] = self.arrangement.roots[group.members[index]].place();
                        [column, row + shift]
                    });
                    PairResult {
                        filament,
                        other,
                        impulse_n_s: account.impulse,
                        vector_impulse_n_s: account.vector_impulse,
                        peak_force_n: account.peak,
                        contact_time_s: account.time,
                        arc_length_m: if account.impulse > 0.0 {
                            account.moment / account.impulse
                        } else {
                            0.0
                        },
                        dissipated_j: account.dissipated,
                    }
                }));
            }
        }
        pairs.sort_by_key(|pair| [pair.filament, pair.other]);
        let mut energies = EnergyBalance::default();
        for (group, sector) in &self.sectors {
            let weight = group.weight() as f64;
            let [gain, work, dissipated] = sector.balance().energies();
            energies.gain_j += weight * gain;
            energies.work_j += weight * work;
            energies.dissipated_j += weight * dissipated;
        }
        let mut filaments = self.filaments(self.arrangement.columns);
        for pair in &pairs {
            for [column, row] in [pair.filament, pair.other] {
                filaments[column * self.arrangement.rows + row].press_impulse_n_s +=
                    pair.impulse_n_s;
            }
        }
        let stretch = stretch::find(
            &filaments,
            self.may_count(),
            &self.settings,
            &self.pass,
            &self.arrangement,
        )?;
        for filament in &mut filaments {
            filament.is_counted = (stretch.first..=stretch.last).contains(&filament.column);
        }
        let counted: Vec<Metrics> = filaments
            .iter()
            .filter(|filament| filament.is_counted)
            .map(|filament| filament.metrics.clone())
            .collect();
        let mut tool = Metrics::combined(&counted).ok_or(BrushError::NoFilament)?;
        if tool.unsteady_turns {
            tool.impulse_standard_error = standard_error_of_turns(&turn_impulses);
        }
        let alone = self.alone(&filaments)?;
        let impulse = alone.contact_normal_impulse_n_s;
        // Where no filament touches another, passes are the better model.
        let mean = tool.contact_normal_impulse_n_s;
        let model_error = if pairs.is_empty() && !tool.unsteady_turns && mean > 0.0 {
            (1.0 - impulse / mean).abs()
        } else {
            0.0
        };
        let impulse_error_estimate = step_error
            .max(model_error)
            .hypot(stretch.standard_error)
            .hypot(tool.impulse_standard_error);
        Ok(BrushResult {
            interaction_factor: if impulse > 0.0 { mean / impulse } else { 0.0 },
            filaments,
            tool,
            alone,
            stretch,
            columns: self.arrangement.columns,
            rows: self.arrangement.rows,
            filaments_around: self.arrangement.around,
            history: self.history,
            pairs,
            frames: self.frames,
            statistics,
            energies,
            residuals,
            impulse_error_estimate,
            turn_contact_normal_impulses_n_s: turn_impulses,
        })
    }

    /// Removes spare columns of the stretch that nothing has reached.
    fn leave_out_resting(&mut self) {
        let touching = self
            .filaments(self.arrangement.columns)
            .into_iter()
            .filter(|filament| filament.metrics.contact_time_s > 0.0);
        let pressed = self.sectors.iter().flat_map(|(group, sector)| {
            let filaments = sector.pairs().keys().flatten();
            filaments.map(|index| self.arrangement.roots[group.members[*index]].column)
        });
        let reached = touching
            .map(|filament| filament.column)
            .chain(pressed)
            .max();
        let arrangement = &mut self.arrangement;
        arrangement.columns = reached.map_or(0, |last| last + 1).max(self.followed);
        let count = arrangement.columns * arrangement.rows;
        arrangement.roots.truncate(count);
        self.places.truncate(count);
        self.own.truncate(count);
        for frame in &mut self.frames {
            frame.nodes_m.truncate(count);
            frame.contact_normal_force_n.truncate(count);
            frame.press_force_n.truncate(count);
        }
    }

    /// Returns the mean metrics of the filaments that count, each alone. Equal ones are simulated
    /// once.
    fn alone(&self, filaments: &[FilamentResult]) -> Result<Metrics, BrushError> {
        let roots = self.arrangement.roots.iter().map(|root| root.z);
        let counted = self
            .own
            .iter()
            .cloned()
            .zip(roots)
            .zip(filaments)
            .filter(|(_, filament)| filament.is_counted);
        let mut own: Vec<(Settings, f64)> = counted.map(|(own, _)| own).collect();
        if !filaments::differ(&self.settings) {
            let along_trim = differ(&self.settings);
            own.iter_mut()
                .filter(|_| !along_trim)
                .for_each(|(_, z)| *z = 0.0);
            own.sort_by(|(_, a), (_, b)| a.total_cmp(b));
            own.dedup_by(|(_, a), (_, b)| a == b);
        }
        alone::metrics(&self.settings, &own, &self.stop, &self.team)
    }

    /// Returns the defects of the balances of energy and momentum.
    fn residuals(&self) -> Residuals {
        let relative = |of: &dyn Fn(&Balance) -> [f64; 2]| {
            let [mut lack, mut whole] = [0.0; 2];
            for (group, sector) in &self.sectors {
                let [own_lack, own_whole] = of(sector.balance());
                lack += group.weight() as f64 * own_lack;
                whole += group.weight() as f64 * own_whole;
            }
            if whole > 0.0 { lack / whole } else { 0.0 }
        };
        Residuals {
            energy: relative(&Balance::energy_defect),
            momentum: relative(&Balance::momentum_defect),
        }
    }
}
