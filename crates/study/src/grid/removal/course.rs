//! Growth of an edge for any coefficient, for a calibration.

use bristle::model::settings::{ObservedEdge, RemovalSettings, Settings};
use bristle::simulation::Stop;

use super::edges_of;
use super::error::RemovalError;
use super::growth::{End, Rates, grow, stage_at};
use super::search::{Growth, GrowthSearch};
use super::table::{Passes, WorkTable};
use crate::grid::Resources;

/// Growth of an edge, for any coefficient and radius at the start: the simulated passes suffice for
/// all of them.
#[derive(Clone, Debug)]
pub struct Course {
    table: WorkTable,
    rates: Rates,
    preston: f64,
    /// Largest relative change of the radius when the number of simulated radii was doubled.
    pub change_when_refined: f64,
}

impl Course {
    /// Simulates passes over edges with radii from that in `settings` to one that was `observed`.
    /// `tell` receives the numbers of simulated and of all passes of a batch.
    ///
    /// # Errors
    /// If there is no edge, if the observed radius is never reached, or a pass cannot be simulated.
    pub fn up_to(
        observed: ObservedEdge,
        settings: &Settings,
        resources: Resources,
        stop: &Stop,
        tell: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Self, RemovalError> {
        let angles = edges_of(settings)?;
        let removal = RemovalSettings {
            preston_m2_n: None,
            observed: Some(observed),
            ..settings.removal_or_default()
        };
        let passes = Passes::new(settings, resources, stop, tell);
        let mut search = GrowthSearch {
            settings,
            removal,
            angles,
            goal: End::Radius(observed.edge_radius_m),
            passes,
        };
        let (Growth { preston, .. }, nodes, change_when_refined) = search.refined()?;
        let count = settings.tool.filament_count;
        let rates = Rates::new(settings, count, preston, search.factors(), &nodes);
        Ok(Self {
            table: search.passes.table(None, &nodes),
            rates: rates.unlimited(),
            preston,
            change_when_refined,
        })
    }

    /// Returns the Preston coefficient in m²/N that leads to the observed radius.
    #[must_use]
    pub fn preston_m2_n(&self) -> f64 {
        self.preston
    }

    /// Returns the radius in m of the larger edge after each of the `turns`, which ascend. The
    /// Preston coefficient is in m²/N, the radius at the start in m.
    #[must_use]
    pub fn radii(&self, preston_m2_n: f64, start_m: f64, turns: &[f64]) -> Vec<f64> {
        let area_per_work = self.rates.area_per_work * (preston_m2_n / self.preston);
        let rates = Rates {
            radius: start_m,
            area_per_work,
            ..self.rates
        };
        let end = turns.last().copied().unwrap_or(0.0);
        let (stages, _) = grow(&self.table, &rates, End::Turns(end));
        turns
            .iter()
            .map(|turns| stage_at(&stages, *turns).larger())
            .collect()
    }
}
