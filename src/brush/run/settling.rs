//! Settling of filaments that overlap when undeformed, before the motion begins.

use super::super::error::BrushError;
use super::super::plan::{SectorPlan, begin};
use super::super::sector::Sector;
use super::super::settle::{self, Settling};
use super::{BrushRun, SectorMembers};
use crate::model::settings::Settings;

impl BrushRun {
    /// Prepares settling, as undeformed filaments overlap in these `sectors`.
    pub(super) fn settling(&self, groups: &[SectorMembers], sectors: &[Sector]) -> Settling {
        let n = self.settings.filament.segments;
        let common = vec![self.settings.clone(); self.own.len()];
        let regular: Vec<Sector> = groups
            .iter()
            .map(|group| self.plan(&common).sector(&group.members, None))
            .collect();
        // Distance of tips from where they would be without deviations of their own.
        let way = |(regular, sector): (&Sector, &Sector)| {
            let tips = (0..sector.bundle().filaments().len()).map(|index| {
                let [a, b] = [regular, sector].map(|sector| sector.bundle().node(index, n));
                let [x, y, z]: [f64; 3] = std::array::from_fn(|i| a[i] - b[i]);
                x.hypot(y).hypot(z)
            });
            tips.fold(0.0, f64::max)
        };
        let way = regular.iter().zip(sectors).map(way).fold(0.0, f64::max);
        Settling::new(
            &self.settings,
            way,
            regular.iter().map(Sector::poses).collect(),
        )
    }

    /// Lets filaments settle for a load increment. The motion begins with their pose once they are
    /// at rest.
    pub(super) fn settle(&mut self, mut settling: Settling) -> Result<(), BrushError> {
        let calm = Settling::calm(&self.settings);
        let grown: Vec<Settings> = self
            .own
            .iter()
            .map(|own| settling.grown(&calm, own))
            .collect();
        let start = self.begin - settle::STEPS_PER_RUNG as f64 * settling.length;
        let plan = SectorPlan {
            settings: &calm,
            begin: start,
            accuracy: self.accuracy(settling.length),
            ..self.plan(&grown)
        };
        let sectors = self.sectors.iter().zip(&settling.poses);
        let sectors: Vec<Sector> = sectors
            .map(|((group, _), poses)| plan.sector(&group.members, Some(poses)))
            .collect();
        self.sectors
            .iter_mut()
            .zip(sectors)
            .for_each(|((_, sector), calm)| *sector = calm);
        let times: Vec<f64> = (1..=settle::STEPS_PER_RUNG)
            .map(|step| start + step as f64 * settling.length)
            .collect();
        self.advance_sectors(&times, times[settle::STEPS_PER_RUNG - 1])?;
        let poses = self
            .sectors
            .iter()
            .map(|(_, sector)| sector.poses())
            .collect();
        let segment = |group: usize, index: usize| {
            self.sectors[group].1.bundle().filaments()[index]
                .chain
                .length
        };
        let is_at_rest = settling.take(poses, segment, self.pass.tool().rate, &self.settings);
        if !is_at_rest {
            if settling.is_hopeless() {
                return Err(BrushError::Restless {
                    speed: settling.speed,
                });
            }
            self.settling = Some(settling);
            return Ok(());
        }
        let pose = |filament: usize| {
            let [number, index] = self.places[filament];
            let [q, _] = settle::coordinates(&settling.poses[number][index], 0.0);
            Some(q)
        };
        self.begin_at(begin(&self.pass, &self.arrangement, &self.own, &pose)?);
        let plan = self.plan(&self.own);
        let sectors = self.sectors.iter().enumerate();
        let sectors: Vec<Sector> = sectors
            .map(|(number, (group, _))| plan.sector(&group.members, Some(&settling.poses[number])))
            .collect();
        self.sectors
            .iter_mut()
            .zip(sectors)
            .for_each(|((_, sector), settled)| *sector = settled);
        Ok(())
    }
}
