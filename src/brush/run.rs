//! A brush from its settings to its results.

use std::f64::consts::TAU;

use super::alone;
use super::arrangement::{self, Arrangement, Root};
use super::error::BrushError;
use super::filaments;
use super::plan::{Plan, begin};
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
use crate::model::settings::{BrushSettings, Hold, Settings, Turns};
use crate::model::trim::differ;
use crate::simulation::{Form, Pass, Sampling, Stop, are_steady};

/// How a brush is simulated. Results do not depend on it, except for the frames that it requests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RunOptions {
    /// Number of threads.
    pub threads: usize,
    /// Number of frames, at most; fewer of large sectors.
    pub frames: usize,
    /// The memory that may be used, in bytes.
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

/// Path of the tips in the longest step, as a share of the shorter one of the filament and the
/// nominal contact: fast filaments bounce on short contacts. Longer steps would save no time, since
/// they take more iterations of Newton's method.
const LONGEST_STEP: f64 = 5e-3;
/// Longest steps between two samples of the history: a sample lies in the step that ends behind it.
const SAMPLE_STEPS: f64 = 1.25;
/// Samples between two states that can be restored.
const STRIDE: usize = 32;
/// Error of the impulse that a step may add, as a multiple of the tolerance. Estimates are bounds:
/// true errors are 5 to 50 times smaller (docs/methods.md).
const ERROR_BOUND: f64 = 3.0;
/// Largest last correction of Newton's method, as a share of the tolerance of a step.
const NEWTON_SHARE: f64 = 0.1;
/// Impulse of a filament that alone does not touch, as a share of its momentum.
const GRAZING_IMPULSE: f64 = 1e-3;
/// A local error estimate does not see that a motion amplifies errors, as that of few filaments may
/// that throw each other about, or vibrate from turn to turn. A brush of up to this number of
/// filaments takes little time. It is simulated twice, the second time at this share of its
/// tolerance, and the change is part of its error estimate.
const CHECKED_FILAMENTS: usize = 40;
const CHECKED_TOLERANCE: f64 = 0.25;

/// Nodes in all frames together, at most.
const MOST_NODES: usize = 1_000_000;

/// A brush on its way over the workpiece.
pub struct BrushRun {
    settings: Settings,
    brush: BrushSettings,
    pass: Pass,
    arrangement: Arrangement,
    sectors: Vec<(Group, Sector)>,
    /// By filament: the number of its sector, and of the filament in it that it is like.
    places: Vec<[usize; 2]>,
    options: RunOptions,
    team: Team,
    begin: f64,
    /// The expected end in s.
    end: f64,
    tolerance: f64,
    /// Impulse of one filament alone in N s, once it is known.
    impulse_alone: Option<f64>,
    /// Impulses of the followed filaments in N s at the tolerance that is checked.
    checked: Option<Vec<f64>>,
    form: Form,
    /// Number of contact points of a segment.
    points: usize,
    /// The settings of each filament.
    own: Vec<Settings>,
    /// What is left to do before the motion begins, where undeformed filaments are in each other,
    /// and the steps that it was expected to need.
    settling: Option<Settling>,
    settling_steps: usize,
    /// The time between two samples of the history in s.
    interval: f64,
    /// The number of columns that are followed to the end of their contact.
    followed: usize,
    /// Whether it ends once its stretch has settled, and whether it has.
    ends_when_settled: bool,
    has_settled: bool,
    /// Samples taken, and those up to the expected end.
    done: usize,
    samples: usize,
    /// Samples up to a turn later, in which a brush that still touches at the end must come free.
    max_samples: usize,
    history: Vec<ToolSample>,
    frames: Vec<Frame>,
    stop: Stop,
}

/// The state of a [`BrushRun`], from which it can go on. With the feature `serde` it can be
/// written, with every bit.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Checkpoint {
    columns: usize,
    tolerance: f64,
    checked: Option<Vec<f64>>,
    reached: Reached,
}

/// How far a brush has come.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum Reached {
    /// Its filaments settle, before the motion begins.
    Settling(Settling),
    /// It is on its way.
    Moving(Moving),
}

/// A brush on its way, as [`BrushRun`] has it.
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
    /// Whether no filament leaves its plane of rotation or touches one in another plane.
    is_planar: bool,
    /// Whether it ends once its stretch has settled, rather than after a number of columns.
    ends_when_settled: bool,
    /// Number of contact points of a segment.
    points: usize,
    /// Memory that its simulation needs at most, in bytes, without frames.
    memory: u64,
}

impl Draft {
    /// The sector that `settings` state, with another number of columns if one is given. It may
    /// need `memory` (bytes).
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
        if settings.uncertainty.scatters() && settings.uncertainty.hold != Hold::Machine {
            return Err(BrushError::Hold);
        }
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
            // Columns that are not needed rest, which costs little. They are far from closing the
            // ring.
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

/// Checks that the filaments of the brush that `settings` state can be arranged, without simulating
/// them, and that the simulation needs at most `memory` (bytes). Returns the memory that it needs
/// at most, in bytes, without frames.
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
    /// The brush that `settings` state, before its first contact.
    ///
    /// # Errors
    /// If there is no such brush, or if the simulation needs more memory than it may.
    ///
    /// # Panics
    /// If the settings fail [`Settings::check`].
    pub fn new(settings: &Settings, options: RunOptions) -> Result<Self, BrushError> {
        let tolerance = settings.brush_or_default().tolerance;
        Self::of_columns(settings, options, None, tolerance)
    }

    /// The brush with another number of columns than that which the settings state, or the default,
    /// at another tolerance.
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
        let begin = begin(&pass, &arrangement, &own, &|_| None);
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
            interval: SAMPLE_STEPS * longest_step(settings, &pass),
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
        let sector = |group: &Group| run.plan(&run.own).sector(&group.members, None);
        let sectors: Vec<Sector> = groups.iter().map(sector).collect();
        // Filaments that undeformed are in each other settle first.
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

    /// What its sectors are made from, with filaments that have settings of their `own`.
    fn plan<'a>(&'a self, own: &'a [Settings]) -> Plan<'a> {
        Plan {
            settings: &self.settings,
            pass: &self.pass,
            arrangement: &self.arrangement,
            own,
            form: self.form,
            points: self.points,
            begin: self.begin,
            accuracy: self.accuracy(self.interval / SAMPLE_STEPS),
            shortcuts: self.options.shortcuts,
        }
    }

    /// Accuracy of steps that are not longer than `longest` (s).
    fn accuracy(&self, longest: f64) -> Accuracy {
        Accuracy {
            newton: NEWTON_SHARE * self.tolerance * self.settings.process.brushing_velocity_m_s,
            longest,
        }
    }

    /// Allows each sector its share of the error: the tolerance of the impulse that its filaments
    /// are expected to have, which is that of filaments alone.
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

    /// The impulse in N s of a filament alone.
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

    /// `true` if the brush is simulated a second time at a smaller tolerance.
    fn is_checked(&self) -> bool {
        let solved = self.sectors.iter().map(|(group, _)| group.members.len());
        solved.sum::<usize>() <= CHECKED_FILAMENTS
    }

    /// Begins at a time (s), and ends where the filaments that are followed have passed.
    fn begin_at(&mut self, begin: f64) {
        let rate = self.pass.tool().rate;
        let end = self.pass.end_time() + self.arrangement.latest_of(self.followed) / rate;
        self.begin = begin;
        self.end = end;
        self.samples = ((end - begin) / self.interval).ceil() as usize;
        self.max_samples = self.samples + (TAU / rate / self.interval).ceil() as usize;
    }

    /// The time of a sample in s. The last one is at the expected end.
    fn sample_time(&self, sample: usize) -> f64 {
        if sample == self.samples {
            self.end
        } else {
            self.begin + sample as f64 * self.interval
        }
    }

    /// What is left to do before the motion begins, if undeformed filaments are in each other in
    /// these `sectors`.
    fn settling(&self, groups: &[Group], sectors: &[Sector]) -> Settling {
        let n = self.settings.filament.segments;
        let common = vec![self.settings.clone(); self.own.len()];
        let regular: Vec<Sector> = groups
            .iter()
            .map(|group| self.plan(&common).sector(&group.members, None))
            .collect();
        // How far tips are from where they would be without deviations of their own.
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

    /// Lets filaments settle for a rung. The motion begins with their pose once they are at rest.
    fn settle(&mut self, mut settling: Settling) -> Result<(), BrushError> {
        let calm = Settling::calm(&self.settings);
        let grown: Vec<Settings> = self
            .own
            .iter()
            .map(|own| settling.grown(&calm, own))
            .collect();
        let start = self.begin - settle::STEPS as f64 * settling.length;
        let plan = Plan {
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
        let times: Vec<f64> = (1..=settle::STEPS)
            .map(|step| start + step as f64 * settling.length)
            .collect();
        self.advance_sectors(&times, times[settle::STEPS - 1])?;
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
        self.begin_at(begin(&self.pass, &self.arrangement, &self.own, &pose));
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

    /// The same brush, which ends early with [`BrushError::Stopped`] once `stop` is requested. It
    /// cannot go on then, and has no state to resume from.
    #[must_use]
    pub fn until(self, stop: &Stop) -> Self {
        Self {
            stop: stop.clone(),
            pass: self.pass.until(stop),
            ..self
        }
    }

    /// Number of columns of the brush.
    pub fn columns(&self) -> usize {
        self.arrangement.columns
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.arrangement.rows
    }

    /// The share of the time that is done, from 0 to 1.
    pub fn done(&self) -> f64 {
        /// Share of a simulation whose result is checked: steps get shorter with the tolerance.
        const FIRST: f64 = 0.4;
        let settled = self
            .settling
            .as_ref()
            .map_or(self.settling_steps, |settling| settling.steps()[0]);
        let all = self.settling_steps + self.samples;
        let done = ((settled + self.done) as f64 / all as f64).min(1.0);
        match (self.is_checked(), &self.checked) {
            (false, _) => done,
            (true, None) => FIRST * done,
            (true, Some(_)) => FIRST + (1.0 - FIRST) * done,
        }
    }

    /// Goes on for some steps. Returns false at the end.
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
        let to = ((self.done / STRIDE + 1) * STRIDE).min(end);
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

    /// Follows another group of columns to the end of their contact, as far as there are more that
    /// may count.
    fn follow_more(&mut self) {
        self.followed = (self.followed + LANES).min(self.may_count());
        self.begin_at(self.begin);
    }

    /// Looks whether the stretch of the columns that have passed has settled.
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

    /// The number of columns, from the first one, that may count.
    fn may_count(&self) -> usize {
        match self.has_settled {
            true => self.followed,
            false => stretch::columns_that_may_count(&self.settings, &self.pass, &self.arrangement),
        }
    }

    /// The number of columns, from the first one, that have passed the workpiece.
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

    /// Goes on to a sample.
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

    /// Lets all sectors go on to some `times` (s), but not beyond `end` (s), and returns the forces
    /// at each.
    fn advance_sectors(&mut self, times: &[f64], end: f64) -> Result<Vec<ToolSample>, BrushError> {
        let stop = &self.stop;
        let advance = |(_, sector): &mut (Group, Sector)| -> Result<Vec<ToolSample>, _> {
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

    /// Begins anew at the end: with more columns if there are too few for a steady stretch and the
    /// settings do not state how many, or at a smaller tolerance to check the result. Returns false
    /// otherwise.
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

    /// Impulses of the filaments that are followed to the end of their contact, in N s, in all turns
    /// together, column by column.
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

    /// Error estimate of the mean impulse, over it: that of the steps, or the change with the
    /// tolerance where that is larger. Where filaments throw each other about, the sum may agree by
    /// chance: at least, changes of single filaments count as random ones.
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
        // Columns that only one of both has followed cannot be compared.
        let [mut sum, mut squares, mut compared] = [0.0; 3];
        for (before, now) in self.checked.iter().flatten().zip(self.followed_impulses()) {
            sum += now - before;
            squares += (now - before).powi(2);
            compared += now;
        }
        let change = f64::abs(sum).max(squares.sqrt());
        share(error, impulse).max(share(change, compared))
    }

    /// The number of columns that a steady stretch is expected to need, if there are too few and
    /// the settings do not state how many.
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

    /// The sample at which all filaments have ended so many turns.
    fn end_of_turn(&self, turns: usize) -> usize {
        let latest = self.arrangement.latest() / self.pass.tool().rate;
        ((latest + turns as f64 * self.pass.turn_time() - self.begin) / self.interval).ceil()
            as usize
    }

    /// Mean contact normal impulses of the turns so far in N s, as far as all filaments have ended
    /// them.
    fn turn_impulses(&self) -> Vec<f64> {
        let of = |turn: usize| self.impulses(|account| account.impulses.get(turn).copied());
        let mean = |impulses: Vec<f64>| impulses.iter().sum::<f64>() / self.places.len() as f64;
        (0..).map_while(of).map(mean).collect()
    }

    /// Impulses of all solved filaments in N s, which `of` reads, each times the number of
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

    /// Whether the turns, which were to become steady, have done so.
    fn has_steady_turns(&self) -> bool {
        self.pass.turns() == Turns::Steady && are_steady(&self.turn_impulses())
    }

    /// Whether a filament that is followed to the end of its contact still touches.
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

    /// The next sample after `sample` at which a frame is taken.
    fn next_frame(&self, sample: usize) -> Option<usize> {
        let nodes = self.arrangement.roots.len() * (self.settings.filament.segments + 1);
        let frames = self.options.frames.min(MOST_NODES / nodes);
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

    /// The state, from which [`BrushRun::resume`] goes on with the same bits.
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

    /// Goes on from a state of the same brush, which [`BrushRun::checkpoint`] returned.
    ///
    /// # Errors
    /// As for [`BrushRun::new`], or if the state is not that of this brush.
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

    /// Goes back to a motion. `None` if it is not one of this brush.
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
        let fits = begin.is_finite()
            && begin <= self.begin.abs()
            && followed <= self.arrangement.columns
            && sectors.len() == self.sectors.len()
            && frames.iter().all(is_whole);
        if !fits {
            return None;
        }
        (self.settling, self.followed) = (None, followed);
        self.begin_at(begin);
        self.done = Some(done).filter(|done| *done <= self.max_samples)?;
        for ((_, sector), state) in self.sectors.iter_mut().zip(sectors) {
            sector.restore(state)?;
        }
        (self.history, self.frames) = (history, frames);
        self.look_whether_settled();
        Some(())
    }

    /// The results.
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
        let tool = Metrics::combined(&counted).ok_or(BrushError::NoFilament)?;
        let alone = self.alone(&filaments)?;
        let impulse = alone.contact_normal_impulse_n_s;
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
            impulse_error_estimate: step_error.hypot(stretch.standard_error),
            turn_contact_normal_impulses_n_s: turn_impulses,
        })
    }

    /// Leaves out the columns that were laid out in case that the stretch needs them, and that
    /// nothing has reached.
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

    /// The mean metrics of the filaments that count, each alone. Equal ones are simulated once.
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

    /// By how much energy and momentum fail to balance.
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

    /// The filaments of the first columns with their contacts, without how others press on them.
    fn filaments(&self, columns: usize) -> Vec<FilamentResult> {
        let is_unsteady = self.pass.turns() == Turns::Steady && !self.has_steady_turns();
        let metrics = |&[number, index]: &[usize; 2]| {
            let (_, sector) = &self.sectors[number];
            self.pass.metrics(&ContactRecord {
                is_unsteady,
                ..*sector.accounts()[index].last()
            })
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

/// The longest step in s.
fn longest_step(settings: &Settings, pass: &Pass) -> f64 {
    let nominal = pass.nominal();
    let path = (nominal.tool_radius * nominal.contact_angle).min(settings.filament.length_m);
    LONGEST_STEP * path / settings.process.brushing_velocity_m_s
}

/// Filaments that are solved together.
struct Group {
    /// Their numbers in the arrangement, column by column.
    members: Vec<usize>,
    /// By how many rows the filaments are behind these that are like them; zero for these
    /// themselves.
    shifts: Vec<usize>,
}

impl Group {
    /// How many times its filaments count.
    fn weight(&self) -> usize {
        self.shifts.len()
    }
}

/// The filaments that are solved together, and the place of each filament in them: the number of a
/// group, and of its filament in it.
fn coupled(
    arrangement: &Arrangement,
    is_planar: bool,
    differ: bool,
) -> (Vec<Group>, Vec<[usize; 2]>) {
    let (count, rows) = (arrangement.roots.len(), arrangement.rows);
    if !is_planar {
        let all = Group {
            members: (0..count).collect(),
            shifts: vec![0],
        };
        return (vec![all], (0..count).map(|index| [0, index]).collect());
    }
    // Rows of equal filaments at equal angles are alike.
    let angle = |row: usize| arrangement.roots[row].angle;
    let mut groups: Vec<Group> = Vec::new();
    let mut numbers = Vec::new();
    for row in 0..rows {
        let is_like = |group: &Group| angle(group.members[0]) == angle(row);
        let like = if differ {
            None
        } else {
            groups.iter().position(is_like)
        };
        let number = like.unwrap_or(groups.len());
        if number == groups.len() {
            groups.push(Group {
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

/// The memory in bytes that a simulation needs at most, without frames: a linear function of what
/// was measured.
pub fn memory_estimate(filaments: usize, segments: usize, points: usize) -> u64 {
    /// Of a segment.
    const SEGMENT: u64 = 4000;
    /// Of a contact point.
    const POINT: u64 = 500;
    /// Of everything else.
    const REST: u64 = 16 << 20;
    let (filaments, segments, points) = (filaments as u64, segments as u64, points as u64);
    let of_filament = segments.saturating_mul(points.saturating_mul(POINT).saturating_add(SEGMENT));
    filaments.saturating_mul(of_filament).saturating_add(REST)
}
