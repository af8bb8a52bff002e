//! A brush from its settings to its results.

mod checkpoint;
mod columns;
mod conclusion;
mod draft;
mod frames;
mod members;
mod settling;

use std::f64::consts::TAU;

use super::arrangement::Arrangement;
use super::error::BrushError;
use super::filaments;
use super::plan::{SectorPlan, begin};
use super::result::{FilamentResult, Frame, ToolSample};
use super::sector::{Account, Accuracy, Sector};
use super::settle::Settling;
use super::shortcuts::Shortcuts;
use super::stretch;
use super::team::Team;
use crate::equations::LANES;
use crate::model::metrics::ContactRecord;
use crate::model::settings::{BrushSettings, Settings, Turns};
use crate::simulation::{Form, Pass, Sampling, Stop, are_steady};
pub use checkpoint::Checkpoint;
use draft::Draft;
pub use draft::{check_brush, memory_estimate};
use members::{SectorMembers, coupled};

/// Options of a simulation. Results do not depend on them, except for the frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RunOptions {
    /// Number of threads.
    pub threads: usize,
    /// Largest number of frames; large sectors have fewer.
    pub frames: usize,
    /// Memory that may be used, in bytes.
    pub memory: Option<u64>,
    /// Shortcuts, for tests that switch them off.
    pub shortcuts: Shortcuts,
}

impl Default for RunOptions {
    fn default() -> Self {
        Self {
            threads: 1,
            frames: 0,
            memory: None,
            shortcuts: Shortcuts::ALL,
        }
    }
}

/// Path of the tips in the longest step, over the shorter of filament and nominal contact: fast
/// filaments bounce on short contacts. No contact counts as shorter than a filament is thick; one
/// that just grazes the workpiece may have no nominal contact at all. Longer steps would save no
/// time, since they take more iterations of Newton's method.
const MAX_STEP_SHARE: f64 = 5e-3;
/// Time between two samples of the history in longest steps. A sample lies in the step that ends
/// behind it.
const STEPS_PER_SAMPLE: f64 = 1.25;
/// Samples between two states that can be restored.
const CHECKPOINT_STRIDE: usize = 32;
/// Error of the impulse that a step may add, as a multiple of the tolerance. Estimates are bounds:
/// true errors are 5 to 50 times smaller (docs/methods.md).
const ERROR_BOUND: f64 = 3.0;
/// Largest last correction of Newton's method, as a share of the tolerance of a step.
const NEWTON_SHARE: f64 = 0.1;
/// Assumed impulse of a filament that alone does not touch, as a share of its momentum.
const GRAZING_IMPULSE: f64 = 1e-3;
/// Largest brush, in filaments, that is simulated twice, as this takes little time. The second
/// time, its tolerance has the share `CHECKED_TOLERANCE`; the change is part of the error estimate.
/// Local error estimates do not see that a motion amplifies errors. Few filaments may: they throw
/// each other about, or vibrate from turn to turn.
const MAX_CHECKED_FILAMENTS: usize = 40;
const CHECKED_TOLERANCE: f64 = 0.25;

/// A brush on its way over the workpiece.
pub struct BrushRun {
    settings: Settings,
    brush: BrushSettings,
    pass: Pass,
    arrangement: Arrangement,
    sectors: Vec<(SectorMembers, Sector)>,
    /// Sector of each filament, and the number of the filament in it that is like it.
    places: Vec<[usize; 2]>,
    options: RunOptions,
    team: Team,
    begin: f64,
    /// Expected end in s.
    end: f64,
    tolerance: f64,
    /// Impulse of one filament alone in N s, once it is known.
    impulse_alone: Option<f64>,
    /// Impulses of the followed filaments in N s at the tolerance that is checked.
    checked: Option<Vec<f64>>,
    form: Form,
    /// Number of contact points of a segment.
    points: usize,
    /// Settings of each filament.
    own: Vec<Settings>,
    /// Settling before the motion begins, if undeformed filaments overlap, and its expected number
    /// of steps.
    settling: Option<Settling>,
    settling_steps: usize,
    /// Time between two samples of the history in s.
    interval: f64,
    /// Number of columns that are followed to the end of their contact.
    followed: usize,
    /// `true` if the run ends once its stretch has settled, and `true` once it has.
    ends_when_settled: bool,
    has_settled: bool,
    /// Numbers of samples taken, and up to the expected end.
    done: usize,
    samples: usize,
    /// Number of samples up to a turn later: by then, a brush that still touches at the end is
    /// free.
    max_samples: usize,
    history: Vec<ToolSample>,
    frames: Vec<Frame>,
    stop: Stop,
}

impl BrushRun {
    /// Creates the brush that `settings` state, before its first contact.
    ///
    /// # Errors
    /// If there is no such brush, or if the simulation needs more memory than allowed.
    ///
    /// # Panics
    /// If the settings fail [`Settings::check`].
    pub fn new(settings: &Settings, options: RunOptions) -> Result<Self, BrushError> {
        let tolerance = settings.brush_or_default().tolerance;
        Self::of_columns(settings, options, None, tolerance)
    }

    /// Creates the brush with `columns` columns, else those of the settings or the default, at
    /// `tolerance`.
    fn of_columns(
        settings: &Settings,
        options: RunOptions,
        columns: Option<usize>,
        tolerance: f64,
    ) -> Result<Self, BrushError> {
        let brush = settings.brush_or_default();
        let Draft {
            pass,
            arrangement,
            is_planar,
            ends_when_settled,
            points,
            ..
        } = Draft::new(settings, columns, options.memory)?;
        if columns.is_none() && brush.columns.is_some() {
            stretch::check_columns(settings, &pass, &arrangement)?;
        }
        let own: Vec<Settings> = arrangement
            .roots
            .iter()
            .map(|root| filaments::settings_of(settings, root))
            .collect();
        let (groups, places) = coupled(&arrangement, is_planar, filaments::differ(settings));
        let form = if is_planar {
            Form::Planar
        } else {
            Form::Spatial
        };
        let begin = begin(&pass, &arrangement, &own, &|_| None)?;
        let team = Team::new(
            options.threads,
            groups
                .iter()
                .map(|group| group.members.len().div_ceil(LANES))
                .sum(),
            // Loops over the filaments of a planar row are too short for several threads.
            !is_planar,
        );
        // In a single turn, the columns behind those that may count need not come to the end of
        // their contact, unless they were asked for.
        let followed = match pass.turns() {
            _ if ends_when_settled => stretch::expected_to_count(settings, &pass, &arrangement),
            Turns::Count(1) if brush.columns.is_none() => {
                stretch::columns_that_may_count(settings, &pass, &arrangement)
            }
            _ => arrangement.columns,
        };
        let mut run = Self {
            settings: settings.clone(),
            brush,
            arrangement,
            sectors: Vec::new(),
            places,
            options,
            team: team.map_err(|_| BrushError::Threads)?,
            begin,
            end: begin,
            interval: STEPS_PER_SAMPLE * longest_step(settings, &pass),
            tolerance,
            impulse_alone: None,
            checked: None,
            done: 0,
            form,
            points,
            own,
            settling: None,
            settling_steps: 0,
            samples: 0,
            followed,
            ends_when_settled,
            has_settled: false,
            max_samples: 0,
            history: Vec::new(),
            frames: Vec::new(),
            stop: Stop::default(),
            pass,
        };
        run.begin_at(begin);
        let sector = |group: &SectorMembers| run.plan(&run.own).sector(&group.members, None);
        let sectors: Vec<Sector> = groups.iter().map(sector).collect();
        // Filaments that overlap when undeformed settle first.
        if sectors
            .iter()
            .any(|sector| sector.bundle().presses().next().is_some())
        {
            let settling = run.settling(&groups, &sectors);
            run.settling_steps = settling.steps()[1];
            run.settling = Some(settling);
        }
        run.sectors = groups.into_iter().zip(sectors).collect();
        Ok(run)
    }

    /// Returns the plan of its sectors, with filaments that have settings of their `own`.
    fn plan<'a>(&'a self, own: &'a [Settings]) -> SectorPlan<'a> {
        SectorPlan {
            settings: &self.settings,
            pass: &self.pass,
            arrangement: &self.arrangement,
            own,
            form: self.form,
            points: self.points,
            begin: self.begin,
            accuracy: self.accuracy(self.interval / STEPS_PER_SAMPLE),
            shortcuts: self.options.shortcuts,
        }
    }

    /// Returns the accuracy of steps of at most `longest` (s).
    fn accuracy(&self, longest: f64) -> Accuracy {
        Accuracy {
            newton: NEWTON_SHARE * self.tolerance * self.settings.process.brushing_velocity_m_s,
            longest,
        }
    }

    /// Sets the error rate of each sector by the tolerance and the expected impulse of its
    /// filaments: that of filaments alone.
    ///
    /// # Errors
    /// If a filament alone cannot be simulated.
    fn allow_errors(&mut self) -> Result<(), BrushError> {
        let impulse = match self.impulse_alone {
            Some(impulse) => impulse,
            None => self.expected_impulse()?,
        };
        self.impulse_alone = Some(impulse);
        let duration = match self.pass.turns() {
            Turns::Count(1) => self.end - self.begin,
            Turns::Count(_) | Turns::Steady => self.pass.turn_time(),
        };
        let share = self.followed as f64 / self.arrangement.columns as f64;
        let error_rate = ERROR_BOUND * self.tolerance * impulse * share / duration;
        for (group, sector) in &mut self.sectors {
            sector.set_error_rate(group.members.len() as f64 * error_rate);
        }
        Ok(())
    }

    /// Returns the impulse in N s of a filament alone.
    ///
    /// # Errors
    /// If it cannot be simulated.
    fn expected_impulse(&self) -> Result<f64, BrushError> {
        let alone = self.pass.simulate(Sampling::default())?;
        let impulse = alone.metrics.contact_normal_impulse_n_s;
        if impulse > 0.0 {
            return Ok(impulse);
        }
        let filament = &self.settings.filament;
        let mass = filament.density_kg_m3 * filament.root_area_m2() * filament.length_m;
        Ok(GRAZING_IMPULSE * mass * self.settings.process.brushing_velocity_m_s)
    }

    /// Returns `true` if the brush is simulated a second time at a smaller tolerance.
    fn is_checked(&self) -> bool {
        let solved = self.sectors.iter().map(|(group, _)| group.members.len());
        solved.sum::<usize>() <= MAX_CHECKED_FILAMENTS
    }

    /// Sets the start to `begin` (s), and the end to where the followed filaments have passed.
    fn begin_at(&mut self, begin: f64) {
        let rate = self.pass.tool().rate;
        let end = self.pass.end_time() + self.arrangement.latest_of(self.followed) / rate;
        self.begin = begin;
        self.end = end;
        self.samples = ((end - begin) / self.interval).ceil() as usize;
        self.max_samples = self.samples + (TAU / rate / self.interval).ceil() as usize;
    }

    /// Returns the time of a sample in s. The last one is at the expected end.
    fn sample_time(&self, sample: usize) -> f64 {
        if sample == self.samples {
            self.end
        } else {
            self.begin + sample as f64 * self.interval
        }
    }

    /// Ends the run early with [`BrushError::Stopped`] once `stop` is requested. The run cannot go
    /// on then, and has no state to resume from.
    #[must_use]
    pub fn until(self, stop: &Stop) -> Self {
        Self {
            stop: stop.clone(),
            pass: self.pass.until(stop),
            ..self
        }
    }

    /// Returns the number of columns of the brush.
    pub fn columns(&self) -> usize {
        self.arrangement.columns
    }

    /// Returns the number of rows.
    pub fn rows(&self) -> usize {
        self.arrangement.rows
    }

    /// Returns the share of the time that is done, from 0 to 1.
    pub fn done(&self) -> f64 {
        /// Share of the first simulation if the result is checked: steps get shorter with the
        /// tolerance.
        const FIRST_SHARE: f64 = 0.4;
        let settled = self
            .settling
            .as_ref()
            .map_or(self.settling_steps, |settling| settling.steps()[0]);
        let all = self.settling_steps + self.samples;
        let done = ((settled + self.done) as f64 / all as f64).min(1.0);
        match (self.is_checked(), &self.checked) {
            (false, _) => done,
            (true, None) => FIRST_SHARE * done,
            (true, Some(_)) => FIRST_SHARE + (1.0 - FIRST_SHARE) * done,
        }
    }

    /// Advances by some steps. Returns `false` at the end.
    ///
    /// # Errors
    /// If a step is not possible.
    pub fn advance(&mut self) -> Result<bool, BrushError> {
        if let Some(settling) = self.settling.take() {
            return self.settle(settling).map(|()| true);
        }
        let turns = self.pass.turns();
        if self.ends_when_settled && self.done >= self.samples && !self.has_settled {
            self.follow_more();
        }
        self.allow_errors()?;
        let end = match turns {
            _ if self.has_settled || self.has_steady_turns() => self.done,
            Turns::Count(1) if self.done >= self.samples && self.is_prolonged() => self.max_samples,
            Turns::Count(_) => self.samples,
            // Each turn may be the last.
            Turns::Steady => self
                .end_of_turn(self.turn_impulses().len() + 1)
                .min(self.samples),
        };
        let to = ((self.done / CHECKPOINT_STRIDE + 1) * CHECKPOINT_STRIDE).min(end);
        if self.done >= to {
            return self.begin_anew();
        }
        while self.done < to {
            let next = self.next_frame(self.done);
            self.advance_to(next.map_or(to, |frame| to.min(frame)))?;
            if next == Some(self.done) {
                let frame = self.frame();
                self.frames.push(frame);
            }
        }
        self.sectors
            .iter_mut()
            .for_each(|(_, sector)| sector.forget());
        self.look_whether_settled();
        Ok(true)
    }

    /// Advances to a sample.
    fn advance_to(&mut self, to: usize) -> Result<(), BrushError> {
        let times: Vec<f64> = (self.done + 1..=to)
            .map(|sample| self.sample_time(sample))
            .collect();
        let end = if to <= self.samples {
            self.end
        } else {
            self.sample_time(self.max_samples)
        };
        let mut samples = self.advance_sectors(&times, end)?;
        self.history.append(&mut samples);
        self.done = to;
        Ok(())
    }

    /// Advances all sectors to some `times` (s), but not beyond `end` (s). Returns the forces at
    /// each.
    fn advance_sectors(&mut self, times: &[f64], end: f64) -> Result<Vec<ToolSample>, BrushError> {
        let stop = &self.stop;
        let advance = |(_, sector): &mut (SectorMembers, Sector)| -> Result<Vec<ToolSample>, _> {
            times
                .iter()
                .take_while(|_| !stop.is_requested())
                .map(|time| sector.advance(*time, end))
                .collect()
        };
        let mut results: Vec<_> = self.sectors.iter().map(|_| Ok(Vec::new())).collect();
        let parts = self.sectors.iter_mut().zip(&mut results);
        self.team
            .run(parts, |(sector, result)| *result = advance(sector));
        if self.stop.is_requested() {
            return Err(BrushError::Stopped);
        }
        let mut sum: Vec<ToolSample> = Vec::new();
        for ((group, _), result) in self.sectors.iter().zip(results) {
            let samples = result.map_err(|failure| {
                let place = |index: usize| self.arrangement.roots[group.members[index]].place();
                match failure.crossing {
                    Some(pair) => BrushError::Crossing {
                        time: failure.time,
                        pair: pair.map(place),
                    },
                    None => BrushError::NoConvergence {
                        time: failure.time,
                        filaments: self.arrangement.roots.len(),
                    },
                }
            })?;
            sum.resize_with(samples.len(), ToolSample::default);
            sum.iter_mut()
                .zip(&samples)
                .for_each(|(sum, sample)| sum.add(sample, group.weight()));
        }
        Ok(sum)
    }

    /// Restarts the run: with more columns if a steady stretch needs them and the settings state no
    /// number, or at a smaller tolerance to check the result. Returns `false` otherwise.
    fn begin_anew(&mut self) -> Result<bool, BrushError> {
        let begins = |columns, tolerance| -> Result<Self, BrushError> {
            let run = Self::of_columns(&self.settings, self.options, Some(columns), tolerance)?;
            Ok(Self {
                impulse_alone: self.impulse_alone,
                ..run.until(&self.stop)
            })
        };
        if let Some(columns) = self.missing_columns() {
            *self = begins(columns, self.brush.tolerance)?;
            return Ok(true);
        }
        if !self.is_checked() || self.checked.is_some() {
            return Ok(false);
        }
        let tolerance = CHECKED_TOLERANCE * self.tolerance;
        *self = Self {
            checked: Some(self.followed_impulses()),
            ..begins(self.arrangement.columns, tolerance)?
        };
        Ok(true)
    }

    /// Returns the impulses of the followed filaments in N s as results state them, column by
    /// column.
    fn followed_impulses(&self) -> Vec<f64> {
        let filaments = self.filaments(self.followed).into_iter();
        filaments
            .map(|filament| filament.metrics.contact_normal_impulse_n_s)
            .collect()
    }

    /// Returns the sample at which all filaments have ended `turns` turns.
    fn end_of_turn(&self, turns: usize) -> usize {
        let latest = self.arrangement.latest() / self.pass.tool().rate;
        ((latest + turns as f64 * self.pass.turn_time() - self.begin) / self.interval).ceil()
            as usize
    }

    /// Returns the mean contact normal impulse in N s of each turn that all filaments have ended.
    fn turn_impulses(&self) -> Vec<f64> {
        let of = |turn: usize| self.impulses(|account| account.impulses.get(turn).copied());
        let mean = |impulses: Vec<f64>| impulses.iter().sum::<f64>() / self.places.len() as f64;
        (0..).map_while(of).map(mean).collect()
    }

    /// Returns the impulses in N s that `of` reads of all solved filaments, each times the
    /// filaments like it. `None` if one has none.
    fn impulses(&self, of: impl Fn(&Account) -> Option<f64>) -> Option<Vec<f64>> {
        let accounts = self.sectors.iter().flat_map(|(group, sector)| {
            let weight = group.weight() as f64;
            sector
                .accounts()
                .iter()
                .map(move |account| (weight, account))
        });
        accounts
            .map(|(weight, account)| of(account).map(|impulse| weight * impulse))
            .collect()
    }

    /// Returns `true` if the run goes on until its turns are steady, and they are.
    fn has_steady_turns(&self) -> bool {
        self.pass.turns() == Turns::Steady && are_steady(&self.turn_impulses())
    }

    /// Returns `true` if a filament that is followed to the end of its contact still touches, once
    /// all have reached their tail angles.
    fn is_prolonged(&self) -> bool {
        self.arrangement
            .roots
            .iter()
            .zip(&self.places)
            .any(|(root, &[number, index])| {
                root.column < self.followed
                    && self.sectors[number].1.accounts()[index].is_in_first_turn()
            })
    }

    /// Returns the filaments of the first columns with their contacts, without the presses of
    /// others.
    fn filaments(&self, columns: usize) -> Vec<FilamentResult> {
        let is_unsteady = self.pass.turns() == Turns::Steady && !self.has_steady_turns();
        let metrics_of = |record: &ContactRecord| self.pass.metrics(record);
        let metrics = |&[number, index]: &[usize; 2]| {
            let account = &self.sectors[number].1.accounts()[index];
            let mean = is_unsteady.then(|| account.completed.mean(metrics_of));
            mean.flatten().unwrap_or_else(|| metrics_of(account.last()))
        };
        self.arrangement
            .roots
            .iter()
            .zip(&self.places)
            .take(columns * self.arrangement.rows)
            .map(|(root, place)| FilamentResult {
                column: root.column,
                row: root.row,
                root_angle_rad: root.angle,
                root_z_m: root.z,
                is_counted: false,
                metrics: metrics(place),
                press_impulse_n_s: 0.0,
            })
            .collect()
    }
}

/// Returns the longest step in s.
fn longest_step(settings: &Settings, pass: &Pass) -> f64 {
    let (nominal, filament) = (pass.nominal(), &settings.filament);
    let contact = (nominal.tool_radius * nominal.contact_angle).max(filament.diameter_m);
    MAX_STEP_SHARE * contact.min(filament.length_m) / settings.process.brushing_velocity_m_s
}
