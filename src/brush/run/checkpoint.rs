//! State of a run to resume from.

use super::super::error::BrushError;
use super::super::result::{Frame, ToolSample};
use super::super::sector::SectorState;
use super::super::settle::Settling;
use super::{BrushRun, CHECKED_TOLERANCE, RunOptions};
use crate::model::settings::Settings;

/// State of a [`BrushRun`] to resume from. With the feature `serde` it can be written, with every
/// bit.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Checkpoint {
    columns: usize,
    tolerance: f64,
    checked: Option<Vec<f64>>,
    reached: Reached,
}

/// Progress of a brush.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum Reached {
    /// Its filaments settle, before the motion begins.
    Settling(Settling),
    /// It is on its way.
    Moving(Moving),
}

/// State of a [`BrushRun`] on its way.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Moving {
    begin: f64,
    followed: usize,
    done: usize,
    sectors: Vec<SectorState>,
    history: Vec<ToolSample>,
    frames: Vec<Frame>,
}

impl BrushRun {
    /// Returns the state, from which [`BrushRun::resume`] goes on with the same bits.
    pub fn checkpoint(&self) -> Checkpoint {
        let moving = || {
            Reached::Moving(Moving {
                begin: self.begin,
                followed: self.followed,
                done: self.done,
                sectors: self
                    .sectors
                    .iter()
                    .map(|(_, sector)| sector.state())
                    .collect(),
                history: self.history.clone(),
                frames: self.frames.clone(),
            })
        };
        Checkpoint {
            columns: self.arrangement.columns,
            tolerance: self.tolerance,
            checked: self.checked.clone(),
            reached: self.settling.clone().map_or_else(moving, Reached::Settling),
        }
    }

    /// Resumes from a state of the same brush, which [`BrushRun::checkpoint`] returned.
    ///
    /// # Errors
    /// As for [`BrushRun::new`], or if the state does not belong to this brush.
    pub fn resume(
        settings: &Settings,
        options: RunOptions,
        checkpoint: Checkpoint,
    ) -> Result<Self, BrushError> {
        let Checkpoint {
            columns,
            tolerance,
            checked,
            reached,
        } = checkpoint;
        let stated = settings.brush_or_default().tolerance;
        let expected = match checked {
            Some(_) => CHECKED_TOLERANCE * stated,
            None => stated,
        };
        let mut impulses = checked.iter().flatten();
        if tolerance != expected || !impulses.all(|impulse| impulse.is_finite()) {
            return Err(BrushError::Checkpoint);
        }
        let mut run = Self {
            checked,
            ..Self::of_columns(settings, options, Some(columns), tolerance)?
        };
        let restored = match reached {
            Reached::Settling(settling) => {
                run.settling.as_mut().and_then(|own| own.restore(settling))
            }
            Reached::Moving(state) => run.restore(state),
        };
        restored.map(|()| run).ok_or(BrushError::Checkpoint)
    }

    /// Restores a motion. Returns `None` if it does not belong to this brush.
    fn restore(&mut self, state: Moving) -> Option<()> {
        let Moving {
            begin,
            followed,
            done,
            sectors,
            history,
            frames,
        } = state;
        let (count, nodes) = (
            self.arrangement.roots.len(),
            self.settings.filament.segments + 1,
        );
        let is_whole = |frame: &Frame| {
            let lengths = [
                frame.nodes_m.len(),
                frame.contact_normal_force_n.len(),
                frame.press_force_n.len(),
            ];
            lengths == [count; 3] && frame.nodes_m.iter().all(|filament| filament.len() == nodes)
        };
        // Settled filaments may need to begin earlier, by less than a turn.
        let earliest = self.begin - self.pass.turn_time();
        let fits = (earliest..=self.begin.abs()).contains(&begin)
            && followed <= self.arrangement.columns
            && history.len() == done
            && sectors.len() == self.sectors.len()
            && frames.iter().all(is_whole);
        if !fits {
            return None;
        }
        (self.settling, self.followed) = (None, followed);
        self.begin_at(begin);
        self.done = Some(done).filter(|done| *done <= self.max_samples)?;
        // A step ends less than a sample behind the one that lies in it.
        let now = self.sample_time(done);
        let times = now - self.interval..=now + self.interval;
        for ((_, sector), state) in self.sectors.iter_mut().zip(sectors) {
            sector.restore(state, &times)?;
        }
        (self.history, self.frames) = (history, frames);
        self.look_whether_settled();
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::settings::BrushSettings;

    /// The digest of a checkpoint file is no secret, so its values must be checked, too.
    #[test]
    fn states_with_values_out_of_range_are_refused() {
        let mut settings = Settings::paper(10.0, 1e-3);
        settings.filament.segments = 3;
        settings.tool.filament_count = 682.0;
        settings.brush = Some(BrushSettings {
            columns: Some(3),
            rows: Some(1),
            steady: false,
            tolerance: 1e-2,
            ..BrushSettings::default()
        });
        let mut run = BrushRun::new(&settings, RunOptions::default()).expect("a brush");
        while run.done() < 0.3 {
            assert!(run.advance().expect("steps"));
        }
        let resumes = |change: &dyn Fn(&mut Moving)| {
            let mut state = run.checkpoint();
            let Reached::Moving(moving) = &mut state.reached else {
                panic!("the brush moves")
            };
            change(moving);
            BrushRun::resume(&settings, RunOptions::default(), state).is_ok()
        };
        assert!(resumes(&|_| ()));
        let changes: [&dyn Fn(&mut Moving); 12] = [
            &|moving| moving.begin = -1e300,
            &|moving| moving.begin = f64::NAN,
            &|moving| moving.done = 0,
            &|moving| moving.followed = 1000,
            &|moving| moving.sectors[0].motion.time = -1e300,
            &|moving| moving.sectors[0].motion.time = f64::INFINITY,
            &|moving| moving.sectors[0].impulse_error = f64::INFINITY,
            &|moving| moving.sectors[0].statistics.steps = usize::MAX,
            &|moving| moving.sectors[0].statistics.effort.newton_iterations = usize::MAX,
            &|moving| moving.sectors[0].accounts[0].record.turn = 0,
            &|moving| moving.sectors[0].accounts[0].record.turn = 3,
            &|moving| moving.sectors[0].accounts[0].record.count = usize::MAX,
        ];
        for (number, change) in changes.iter().enumerate() {
            assert!(!resumes(change), "change {number}");
        }
    }
}
