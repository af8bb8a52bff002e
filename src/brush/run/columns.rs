//! Columns that a steady stretch needs: those followed to the end, and those missing.

use super::super::arrangement::Root;
use super::super::error::BrushError;
use super::super::stretch;
use super::BrushRun;
use crate::equations::LANES;

impl BrushRun {
    /// Follows another group of columns that may count to the end of their contact, if there are
    /// more.
    pub(super) fn follow_more(&mut self) {
        self.followed = (self.followed + LANES).min(self.may_count());
        self.begin_at(self.begin);
    }

    /// Checks whether the stretch of the columns that have passed has settled.
    pub(super) fn look_whether_settled(&mut self) {
        if !self.ends_when_settled {
            return;
        }
        let passed = self.passed().min(self.may_count());
        let filaments = self.filaments(passed);
        if stretch::has_settled(&filaments, &self.settings, &self.pass, &self.arrangement) {
            (self.followed, self.has_settled) = (passed, true);
        }
    }

    /// Returns the number of columns, from the first one, that may count.
    pub(super) fn may_count(&self) -> usize {
        match self.has_settled {
            true => self.followed,
            false => stretch::columns_that_may_count(&self.settings, &self.pass, &self.arrangement),
        }
    }

    /// Returns the number of columns, from the first one, that have passed the workpiece.
    fn passed(&self) -> usize {
        let time = self.sample_time(self.done);
        let is_on_its_way = |(root, &[number, index]): (&Root, &[usize; 2])| {
            let end = self.pass.end_time() + root.angle / self.pass.tool().rate;
            time < end || self.sectors[number].1.accounts()[index].is_in_first_turn()
        };
        let next = self
            .arrangement
            .roots
            .iter()
            .zip(&self.places)
            .position(is_on_its_way);
        next.map_or(self.arrangement.columns, |filament| {
            self.arrangement.roots[filament].column
        })
    }

    /// Returns the columns that a steady stretch is expected to need, if there are too few and the
    /// settings state no number.
    pub(super) fn missing_columns(&self) -> Option<usize> {
        if self.brush.columns.is_some() || self.has_settled {
            return None;
        }
        let filaments = self.filaments(self.arrangement.columns);
        match stretch::find(
            &filaments,
            self.may_count(),
            &self.settings,
            &self.pass,
            &self.arrangement,
        ) {
            Err(BrushError::TooFewColumns {
                columns,
                needed,
                around,
                ..
            }) if columns < around => Some(needed.min(around)),
            _ => None,
        }
    }
}
