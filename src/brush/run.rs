//! A brush from its settings to its results.

use std::f64::consts::TAU;

use super::alone;
use super::arrangement::{self, Arrangement, Root};
use super::error::BrushError;
use super::filaments;
use super::plan::{SectorPlan, begin};
use super::result::{
    BrushResult, BrushStatistics, EnergyBalance, FilamentResult, Frame, PairResult, Residuals,
    ToolSample,
};
use super::sector::{Account, Accuracy, Balance, Sector, SectorState};
use super::settle::{self, Settling};
use super::shortcuts::Shortcuts;
use super::stretch;
use super::team::Team;
use crate::equations::{LANES, lanes_are_compiled};
use crate::model::metrics::{ContactRecord, Metrics};
use crate::model::settings::{BrushSettings, Settings, Turns};
use crate::model::trim::differ;
use crate::simulation::{Form, Pass, Sampling, Stop, are_steady, standard_error_of_turns};

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
/// filaments bounce on short contacts. Longer steps would save no time, since they take more
/// iterations of Newton's method.
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

/// Largest number of nodes in all frames together.
const MAX_FRAME_NODES: usize = 1_000_000;

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

/// A sector that can be simulated, before its filaments are made.
struct Draft {
    pass: Pass,
    arrangement: Arrangement,
    /// `true` if no filament leaves its plane of rotation or touches one in another plane.
    is_planar: bool,
    /// `true` if the run ends once its stretch has settled, not after a number of columns.
    ends_when_settled: bool,
    /// Number of contact points of a segment.
    points: usize,
    /// Upper bound of the memory of the simulation in bytes, without frames.
    memory: u64,
}

impl Draft {
    /// Drafts the sector that `settings` state, with another number of columns if one is given. It
    /// may need `memory` (bytes).
    fn new(
        settings: &Settings,
        columns: Option<usize>,
        memory: Option<u64>,
    ) -> Result<Self, BrushError> {
        if !lanes_are_compiled() {
            return Err(BrushError::NoLanes);
        }
        let brush = settings.brush_or_default();
        let pass = Pass::deepest(settings);
        let rows = settings.brush_rows();
        let n = settings.filament.segments;
        let length = settings.filament.length_m / n as f64;
        let points = brush
            .contact_points
            .unwrap_or_else(|| (length / settings.filament.diameter_m).ceil().max(1.0) as usize);
        let diameter = settings
            .filament
            .diameter_m
            .max(settings.filament.tip_diameter_m());
        let is_planar = pass.form() == Form::Planar
            && brush.lateral_tilt_std_rad == 0.0
            && (brush.root_std_m == 0.0 || rows == 1)
            && arrangement::has_separate_rows(settings, diameter);
        let are_equal = is_planar && !filaments::differ(settings);
        let ends_when_settled =
            are_equal && brush.steady && brush.columns.is_none() && pass.turns() == Turns::Count(1);
        // Rows that are alike are simulated once.
        let distinct = if are_equal { rows.min(2) } else { rows };
        let memory_of =
            |columns: usize| memory_estimate(columns.saturating_mul(distinct), n, points);
        let columns = columns.or(brush.columns).unwrap_or_else(|| {
            let expected = stretch::default_columns(settings, &pass, rows);
            // Unneeded columns sleep, which costs little. They are far from closing the ring.
            let around = settings.tool.filament_count / rows as f64;
            let is_possible = |columns: &usize| {
                2.0 * *columns as f64 <= around
                    && memory.is_none_or(|limit| memory_of(*columns) <= limit)
            };
            Some(2 * expected)
                .filter(|columns| ends_when_settled && is_possible(columns))
                .unwrap_or(expected)
        });
        if columns == 0 {
            return Err(BrushError::NoFilament);
        }
        let (count, needed) = (columns.saturating_mul(distinct), memory_of(columns));
        if let Some(limit) = memory.filter(|limit| needed > *limit) {
            return Err(BrushError::Memory {
                needed,
                limit,
                filaments: count,
                segments: n,
            });
        }
        let arrangement = Arrangement::new(settings, columns, diameter)?;
        Ok(Self {
            pass,
            arrangement,
            is_planar,
            ends_when_settled,
            points,
            memory: needed,
        })
    }
}

/// Checks that the filaments of the brush that `settings` state can be arranged, and that the
/// simulation needs at most `memory` (bytes), without simulating it. Returns an upper bound of the
/// memory in bytes, without frames.
///
/// # Errors
/// Those of [`BrushRun::new`].
///
/// # Panics
/// If the settings fail [`Settings::check`].
pub fn check_brush(settings: &Settings, memory: Option<u64>) -> Result<u64, BrushError> {
    Draft::new(settings, None, memory).map(|draft| draft.memory)
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

    /// Prepares settling, as undeformed filaments overlap in these `sectors`.
    fn settling(&self, groups: &[SectorMembers], sectors: &[Sector]) -> Settling {
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
    fn settle(&mut self, mut settling: Settling) -> Result<(), BrushError> {
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
            Turns::Count(1) if self.done >= self.samples && self.is_touching() => self.max_samples,
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

    /// Follows another group of columns that may count to the end of their contact, if there are
    /// more.
    fn follow_more(&mut self) {
        self.followed = (self.followed + LANES).min(self.may_count());
        self.begin_at(self.begin);
    }

    /// Checks whether the stretch of the columns that have passed has settled.
    fn look_whether_settled(&mut self) {
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
    fn may_count(&self) -> usize {
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
            time < end || self.sectors[number].1.accounts()[index].is_touching()
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

    /// Returns the impulses of the followed filaments in N s, in all turns together, column by
    /// column.
    fn followed_impulses(&self) -> Vec<f64> {
        let impulse = |(_, &[number, index]): (&Root, &[usize; 2])| {
            self.sectors[number].1.accounts()[index].total_impulse()
        };
        self.arrangement
            .roots
            .iter()
            .zip(&self.places)
            .take_while(|(root, _)| root.column < self.followed)
            .map(impulse)
            .collect()
    }

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

    /// Returns the columns that a steady stretch is expected to need, if there are too few and the
    /// settings state no number.
    fn missing_columns(&self) -> Option<usize> {
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

    /// Returns `true` if a filament that is followed to the end of its contact still touches.
    fn is_touching(&self) -> bool {
        self.arrangement
            .roots
            .iter()
            .zip(&self.places)
            .any(|(root, &[number, index])| {
                root.column < self.followed
                    && self.sectors[number].1.accounts()[index].is_touching()
            })
    }

    /// Returns the next sample after `sample` at which a frame is taken.
    fn next_frame(&self, sample: usize) -> Option<usize> {
        let nodes = self.arrangement.roots.len() * (self.settings.filament.segments + 1);
        let frames = self.options.frames.min(MAX_FRAME_NODES / nodes);
        let stride = self.samples.div_ceil(frames.max(1)).max(1);
        (frames > 0)
            .then(|| (sample / stride + 1) * stride)
            .filter(|next| *next <= self.samples)
    }

    fn frame(&mut self) -> Frame {
        let roots = &self.arrangement.roots;
        let n = self.settings.filament.segments;
        let time_s = self.sample_time(self.done);
        let forces: Vec<[Vec<f64>; 2]> = self
            .sectors
            .iter_mut()
            .map(|(_, sector)| sector.forces(time_s))
            .collect();
        let force = |kind: usize| {
            self.places
                .iter()
                .map(|&[number, index]| forces[number][kind][index] as f32)
                .collect()
        };
        let placed: Vec<_> = self
            .sectors
            .iter_mut()
            .map(|(group, sector)| (group, sector.placed_at(time_s)))
            .collect();
        let nodes = |(filament, &[number, index]): (usize, &[usize; 2])| {
            let (group, bundle) = &placed[number];
            let height = roots[filament].z - roots[group.members[index]].z;
            let node = |k| {
                let [x, y, z] = bundle.node(index, k);
                self.pass
                    .pose()
                    .from_tool([x, y, z + height])
                    .map(|component| component as f32)
            };
            (0..=n).map(node).collect()
        };
        Frame {
            time_s,
            tool_angle_rad: self.pass.tool().angle(time_s),
            nodes_m: self.places.iter().enumerate().map(nodes).collect(),
            contact_normal_force_n: force(0),
            press_force_n: force(1),
        }
    }

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

    /// Returns the results.
    ///
    /// # Errors
    /// If the metrics of a steady stretch are requested and there is none, or if a filament alone
    /// cannot be simulated.
    pub fn finish(mut self) -> Result<BrushResult, BrushError> {
        if self.has_settled {
            self.leave_out_resting();
        }
        let turn_impulses = self.turn_impulses();
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
        let impulse_error_estimate = step_error
            .hypot(stretch.standard_error)
            .hypot(tool.impulse_standard_error);
        Ok(BrushResult {
            interaction_factor: if impulse > 0.0 {
                tool.contact_normal_impulse_n_s / impulse
            } else {
                0.0
            },
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
    let nominal = pass.nominal();
    let path = (nominal.tool_radius * nominal.contact_angle).min(settings.filament.length_m);
    MAX_STEP_SHARE * path / settings.process.brushing_velocity_m_s
}

/// Filaments that are solved together.
struct SectorMembers {
    /// Numbers in the arrangement, column by column.
    members: Vec<usize>,
    /// Rows by which filaments like these are behind them; zero for these themselves.
    shifts: Vec<usize>,
}

impl SectorMembers {
    /// Returns the number of times that its filaments count.
    fn weight(&self) -> usize {
        self.shifts.len()
    }
}

/// Returns the filaments that are solved together, and the place of each filament in them: the
/// number of a group, and of its filament.
fn coupled(
    arrangement: &Arrangement,
    is_planar: bool,
    differ: bool,
) -> (Vec<SectorMembers>, Vec<[usize; 2]>) {
    let (count, rows) = (arrangement.roots.len(), arrangement.rows);
    if !is_planar {
        let all = SectorMembers {
            members: (0..count).collect(),
            shifts: vec![0],
        };
        return (vec![all], (0..count).map(|index| [0, index]).collect());
    }
    // Rows of equal filaments at equal angles are alike.
    let angle = |row: usize| arrangement.roots[row].angle;
    let mut groups: Vec<SectorMembers> = Vec::new();
    let mut numbers = Vec::new();
    for row in 0..rows {
        let is_like = |group: &SectorMembers| angle(group.members[0]) == angle(row);
        let like = if differ {
            None
        } else {
            groups.iter().position(is_like)
        };
        let number = like.unwrap_or(groups.len());
        if number == groups.len() {
            groups.push(SectorMembers {
                members: (row..count).step_by(rows).collect(),
                shifts: Vec::new(),
            });
        }
        let first = groups[number].members[0];
        groups[number].shifts.push(row - first);
        numbers.push(number);
    }
    (
        groups,
        (0..count)
            .map(|index| [numbers[index % rows], index / rows])
            .collect(),
    )
}

/// Returns an upper bound of the memory of a simulation in bytes, without frames: a linear function
/// from measurements.
pub fn memory_estimate(filaments: usize, segments: usize, points: usize) -> u64 {
    /// Bytes of a segment.
    const SEGMENT_BYTES: u64 = 4000;
    /// Bytes of a contact point.
    const POINT_BYTES: u64 = 500;
    /// Bytes of everything else.
    const OTHER_BYTES: u64 = 16 << 20;
    let (filaments, segments, points) = (filaments as u64, segments as u64, points as u64);
    let of_filament = segments.saturating_mul(
        points
            .saturating_mul(POINT_BYTES)
            .saturating_add(SEGMENT_BYTES),
    );
    filaments
        .saturating_mul(of_filament)
        .saturating_add(OTHER_BYTES)
}

#[cfg(test)]
mod tests {
    use super::*;

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
