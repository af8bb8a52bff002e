//! A brush from its settings to its results.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use super::alone::{self, Trial};
use super::arrangement::{self, Arrangement, Root};
use super::error::BrushError;
use super::filaments;
use super::plan::{Plan, STRIDE, begin};
use super::result::{
    BrushResult, BrushStatistics, EnergyBalance, FilamentResult, Frame, PairResult, Residuals,
    ToolSample,
};
use super::sector::{Account, Balance, Sector, SectorState};
use super::settle::{self, Settling};
use super::shortcuts::Shortcuts;
use super::stretch;
use super::team::Team;
use crate::equations::{LANES, lanes_are_compiled};
use crate::model::metrics::{ContactRecord, Metrics};
use crate::model::settings::{BrushSettings, Hold, MAX_TURNS, Settings, Turns};
use crate::model::trim::differ;
use crate::simulation::{Form, Pass, Stop, is_steady};

/// How a brush is simulated. Results do not depend on it, except for the frames that it requests,
/// and for halved steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RunOptions {
    /// Number of threads.
    pub threads: usize,
    /// Number of frames, at most; fewer of large sectors.
    pub frames: usize,
    /// The memory that may be used, in bytes.
    pub memory: Option<u64>,
    /// How many times the steps are halved, to check a result.
    pub halvings: u8,
    /// Shortcuts, for tests that switch them off.
    pub shortcuts: Shortcuts,
}

impl Default for RunOptions {
    fn default() -> Self {
        Self {
            threads: 1,
            frames: 0,
            memory: None,
            halvings: 0,
            shortcuts: Shortcuts::ALL,
        }
    }
}

/// How precisely the steps of a brush are computed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Precision {
    /// The way of the tips in a step in m.
    step: f64,
    /// Largest last correction of a node's velocity, as a share of the brushing velocity.
    newton: f64,
    /// The share of the energy that goes in or out which its balance may lack.
    lacking: f64,
    /// The largest relative difference of an impulse of a filament alone from that of its
    /// error-controlled pass.
    error: f64,
}

impl Precision {
    /// The first one that is tried: shorter where the nominal contact is short against the
    /// filament, because fast filaments bounce there, and where filaments rub on each other. Longer
    /// steps than those of a tolerance of 1e-3 are not faster: they take more iterations
    /// (docs/methods.md).
    fn first(settings: &Settings, pass: &Pass) -> Self {
        /// In tolerances: a fifth of what is an error at the end.
        const LACKING: f64 = 2.0;
        /// Steps are no longer at looser tolerances: the way of the tips then, in m, and the
        /// correction that may be the last, as a share.
        const LOOSEST: f64 = 1e-3;
        const STEP: f64 = 2e-4;
        const NEWTON: f64 = 3e-4;
        /// The power of the tolerance with which these fall.
        const BY_TOLERANCE: f64 = 2.0 / 3.0;
        /// A contact is short below this multiple of the filament. Steps fall with this power of
        /// it, down to the least share.
        const SHORT: f64 = 0.9;
        const BY_CONTACT: f64 = 1.5;
        const LEAST: f64 = 0.3;
        /// The share of the step that is left by friction between filaments.
        const RUBBING: f64 = 0.8;
        let brush = settings.brush_or_default();
        let nominal = pass.nominal();
        let contact_length = nominal.tool_radius * nominal.contact_angle;
        let share = (brush.tolerance / LOOSEST).min(1.0).powf(BY_TOLERANCE);
        let short = (contact_length / (SHORT * settings.filament.length_m))
            .clamp(LEAST, 1.0)
            .powf(BY_CONTACT);
        let rubbing = if brush.friction_coefficient > 0.0 {
            RUBBING
        } else {
            1.0
        };
        Self {
            step: STEP * share * short * rubbing,
            newton: NEWTON * share,
            lacking: LACKING * brush.tolerance,
            error: f64::INFINITY,
        }
    }

    /// The longest steps, by halves of the first ones, in which a filament alone has the impulses
    /// of its error-controlled pass to the relative `brush.tolerance`. If there are none, those
    /// with the smallest error.
    ///
    /// Where filaments have tilts of their own, it has a tilt of one standard deviation.
    ///
    /// # Errors
    /// If its pass cannot be simulated.
    fn find(settings: &Settings) -> Result<Self, BrushError> {
        /// The share of the tolerance that this may take: where filaments touch each other, they
        /// take other steps.
        const SHARE: f64 = 0.5;
        /// Halves that are tried.
        const MOST: usize = 7;
        /// Tolerance of the pass, as a share of that of the brush.
        const CLOSER: f64 = 0.01;
        let brush = settings.brush_or_default();
        let mut typical = Settings {
            brush: None,
            ..settings.clone()
        };
        typical.filament.lateral_tilt_rad += brush.lateral_tilt_std_rad;
        let tolerance = &mut typical.solver.relative_tolerance;
        *tolerance = tolerance.min(CLOSER * brush.tolerance);
        let trial = Trial::new(typical)?;
        let velocity = settings.process.brushing_velocity_m_s;
        let mut next = Self::first(settings, trial.pass());
        let mut best = next;
        for _ in 0..=MOST {
            next.error = trial.error(next.step / velocity, next.newton * velocity, next.lacking);
            if next.error < best.error {
                best = next;
            }
            if next.error <= SHARE * brush.tolerance {
                break;
            }
            next = Self {
                step: 0.5 * next.step,
                newton: 0.5 * next.newton,
                ..next
            };
        }
        if best.error.is_finite() {
            Ok(best)
        } else {
            Err(BrushError::NoConvergence {
                time: 0.0,
                filaments: 1,
            })
        }
    }

    /// Half the step, so many times, or twice the step if they are negative. The energy that a step
    /// lacks falls with the third power of its length.
    fn halved(self, times: i32) -> Self {
        let share = 0.5_f64.powi(times);
        Self {
            step: share * self.step,
            newton: share * self.newton,
            lacking: share * share * self.lacking,
            ..self
        }
    }
}

/// How the steps of a brush follow from what its filaments do to each other: errors grow with each
/// strike, and where filaments rub on each other. A [`Trial`] shows nothing of that.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Refinement {
    /// Whether the brush begins anew in steps half as long until its impulses no longer change.
    goes_on: bool,
    /// The columns of the brush, as long as a sample of them is simulated.
    whole: Option<usize>,
    /// The columns of the brush that are expected to count.
    counted: usize,
    /// The changes of its impulses by all times that it has ended so far. The first one is
    /// infinite.
    changes: Vec<f64>,
    /// Impulses of its filaments in N s, by turn, in steps twice as long. Empty before it has been
    /// simulated in such.
    coarser: Vec<Vec<f64>>,
}

impl Refinement {
    /// The most filaments that are solved for a brush that is its own sample. Means over more of
    /// them differ less, and take longer.
    const FEW: usize = 5 * LANES;
    /// The share of the tolerance by which its impulses may change.
    const SHARE: f64 = 0.2;
    /// Halves that are tried, and of a sample whose filaments differ, or whose changes do not fall
    /// by half: such may be small by chance.
    const MOST: usize = 4;
    const MOST_OF_SAMPLE: usize = 2;

    /// Of a brush that is simulated for the first time.
    fn new(goes_on: bool, counted: usize) -> Self {
        Self {
            goes_on,
            whole: None,
            counted,
            changes: Vec::new(),
            coarser: Vec::new(),
        }
    }

    /// The columns of a sample of a brush that solves so many filaments in `columns`.
    fn sample(solved: usize, columns: usize) -> usize {
        /// At least: what the first ones do to each other is less than what comes later.
        const LEAST: usize = 12;
        (Self::FEW * columns)
            .div_ceil(solved)
            .max(LEAST)
            .min(columns)
    }

    /// After these `impulses` in N s, by turn and filament, of `columns`, to the relative
    /// `tolerance`. Whether filaments `are_equal` in a plane decides how often a sample is tried.
    fn after(
        &self,
        impulses: Vec<Vec<f64>>,
        columns: usize,
        tolerance: f64,
        are_equal: bool,
    ) -> Self {
        let change = self.change(&impulses, columns as f64 / self.counted as f64);
        let changes: Vec<f64> = self.changes.iter().copied().chain([change]).collect();
        let helps = are_equal
            && self
                .changes
                .last()
                .is_some_and(|before| change <= 0.5 * before);
        let most = if self.whole.is_some() && !helps {
            Self::MOST_OF_SAMPLE
        } else {
            Self::MOST
        };
        let goes_on = !Self::is_small(change, tolerance) && changes.len() <= most;
        Self {
            goes_on,
            changes,
            coarser: impulses,
            ..*self
        }
    }

    /// Whether a change is small enough to end with.
    fn is_small(change: f64, tolerance: f64) -> bool {
        change <= Self::SHARE * tolerance
    }

    /// After the last impulses. From here on only the number of runs before counts, for the
    /// progress: a sample is one.
    fn ended(&self) -> Self {
        let times = if self.whole.is_some() {
            1
        } else {
            self.changes.len().max(1)
        };
        Self {
            changes: vec![0.0; times],
            ..Self::new(false, self.counted)
        }
    }

    /// By how many halves the steps of the whole are longer than the last ones of its sample. If
    /// its last change is small, the steps before were short enough. If shorter ones do not help
    /// and a warning is due anyway, the first ones are as right, and faster.
    fn back(&self, tolerance: f64) -> usize {
        let [before, last] = [2, 1].map(|back| self.changes[self.changes.len() - back]);
        let has_helped = before <= tolerance || last <= 0.5 * before;
        if Self::is_small(last, tolerance) {
            1
        } else if last <= tolerance && has_helped {
            0
        } else {
            self.changes.len() - 1
        }
    }

    /// The error that is expected at the end: the last change. That may be small by chance where
    /// changes do not fall, or were only two: then the largest of the later half.
    fn error(&self, tolerance: f64) -> f64 {
        let (count, last) = (self.changes.len(), self.changes[self.changes.len() - 1]);
        let falls = self.changes.is_sorted_by(|before, after| before > after);
        let is_last = Self::is_small(last, tolerance) || (count > 3 && falls);
        let later = if is_last { count } else { count / 2 };
        self.changes[later..].iter().copied().fold(last, f64::max)
    }

    /// The largest relative change of a turn's mean from coarser steps to these `impulses`: the
    /// change that it has, or, if that is larger, the one that it would have if single filaments
    /// changed with random signs. Means of two runs may agree where filaments do not. `share` is
    /// the number of columns over the number of those that count, over which random changes
    /// average. Infinite if there were no coarser steps.
    fn change(&self, impulses: &[Vec<f64>], share: f64) -> f64 {
        let change = |(coarser, finer): (&Vec<f64>, &Vec<f64>)| {
            let changes = || {
                coarser
                    .iter()
                    .zip(finer)
                    .map(|(coarser, finer)| finer - coarser)
            };
            let random: f64 = changes().map(|change| change * change).sum();
            let common = (changes().sum::<f64>().powi(2) - random).max(0.0);
            let change = (common + share * random).sqrt();
            let whole: f64 = finer.iter().sum::<f64>().max(coarser.iter().sum());
            if change == 0.0 { 0.0 } else { change / whole }
        };
        let changes = self.coarser.iter().zip(impulses).map(change);
        if self.coarser.is_empty() {
            f64::INFINITY
        } else {
            changes.fold(0.0, f64::max)
        }
    }
}

/// The share of its quantity that a balance may lack, so that a result is no error.
fn allowed_residual(brush: &BrushSettings) -> f64 {
    /// At least, and as a multiple of the tolerance.
    const LEAST: f64 = 1e-3;
    const TOLERANCES: f64 = 10.0;
    (TOLERANCES * brush.tolerance).max(LEAST)
}

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
    precision: Precision,
    form: Form,
    /// Number of contact points of a segment.
    points: usize,
    /// The settings of each filament.
    own: Vec<Settings>,
    /// What is left to do before the motion begins, where undeformed filaments are in each other,
    /// and the steps that it was expected to need.
    settling: Option<Settling>,
    settling_steps: usize,
    /// The time of a step in s.
    length: f64,
    refinement: Refinement,
    /// The number of columns that are followed to the end of their contact.
    followed: usize,
    /// Whether it ends once its stretch has settled, and whether it has.
    ends_when_settled: bool,
    has_settled: bool,
    /// Steps done, and those up to the expected end.
    done: usize,
    steps: usize,
    /// Steps of one turn, in which a brush that still touches at the end must come free.
    most_steps: usize,
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
    precision: Precision,
    refinement: Refinement,
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
        Self::of_columns(settings, options, None, None)?.or_sample()
    }

    /// A sample of its columns, if one shows which steps it needs.
    fn or_sample(self) -> Result<Self, BrushError> {
        let columns = self.arrangement.columns;
        let solved = self
            .sectors
            .iter()
            .map(|(group, _)| group.members.len())
            .sum();
        let sample = Refinement::sample(solved, columns);
        if !self.refinement.goes_on || sample == columns {
            return Ok(self);
        }
        let refinement = Refinement {
            whole: Some(columns),
            ..self.refinement.clone()
        };
        self.again(sample, self.precision, refinement)
    }

    /// The same with so many columns and in other steps, from the beginning.
    fn again(
        &self,
        columns: usize,
        precision: Precision,
        refinement: Refinement,
    ) -> Result<Self, BrushError> {
        let run = Self::of_columns(&self.settings, self.options, Some(columns), Some(precision))?;
        let followed = if refinement.whole.is_some() {
            columns
        } else {
            run.followed
        };
        let mut run = Self {
            refinement,
            followed,
            ..run.until(&self.stop)
        };
        run.begin_at(run.begin);
        Ok(run)
    }

    /// The same with another number of columns than that which the settings state, or the default,
    /// and with a precision that is known.
    fn of_columns(
        settings: &Settings,
        options: RunOptions,
        columns: Option<usize>,
        precision: Option<Precision>,
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
        let solved: usize = groups.iter().map(|group| group.members.len()).sum();
        let is_refined = solved > 1;
        // Impulses in steps of different lengths are compared at the same end.
        let is_sample = Refinement::sample(solved, arrangement.columns) == arrangement.columns;
        let ends_when_settled = ends_when_settled && !(is_refined && is_sample);
        let counted = stretch::expected_in(settings, &pass, &arrangement);
        let precision = match precision {
            Some(precision) => precision,
            None => {
                let halvings = if is_refined { 0 } else { options.halvings };
                Precision::find(settings)?.halved(halvings.into())
            }
        };
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
            length: precision.step / settings.process.brushing_velocity_m_s,
            done: 0,
            precision,
            refinement: Refinement::new(is_refined, counted),
            form,
            points,
            own,
            settling: None,
            settling_steps: 0,
            steps: 0,
            followed,
            ends_when_settled,
            has_settled: false,
            most_steps: 0,
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
            tolerance: self.precision.newton * self.settings.process.brushing_velocity_m_s,
            lacking: self.precision.lacking,
            shortcuts: self.options.shortcuts,
        }
    }

    /// Begins at a time (s), and ends where the filaments that are followed have passed.
    fn begin_at(&mut self, begin: f64) {
        let rate = self.pass.tool().rate;
        let end = self.pass.end_time() + self.arrangement.latest_of(self.followed) / rate;
        self.begin = begin;
        self.steps = ((end - begin) / self.length).ceil() as usize;
        self.most_steps = self.steps + (TAU / rate / self.length).ceil() as usize;
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
            lacking: f64::INFINITY,
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
        self.advance_sectors(start, settling.length, 1..=settle::STEPS)?;
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

    /// Number of columns of the brush, also while a sample of them is simulated.
    pub fn columns(&self) -> usize {
        self.refinement.whole.unwrap_or(self.arrangement.columns)
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.arrangement.rows
    }

    /// What share of the steps is done, from 0 to 1. Of a brush that may begin anew in shorter
    /// steps, which is not known before, each time takes half of what is left, and a sample half of
    /// all.
    pub fn done(&self) -> f64 {
        let settled = self
            .settling
            .as_ref()
            .map_or(self.settling_steps, |settling| settling.steps()[0]);
        let done =
            ((settled + self.done) as f64 / (self.settling_steps + self.steps) as f64).min(1.0);
        let left = 0.5_f64.powi(self.refinement.changes.len() as i32);
        let done = 1.0 - left
            + left
                * if self.refinement.goes_on {
                    0.5 * done
                } else {
                    done
                };
        if self.refinement.whole.is_some() {
            0.5 * done
        } else {
            done
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
        if self.ends_when_settled && self.done >= self.steps && !self.has_settled {
            self.follow_more();
        }
        let end = match turns {
            _ if self.has_settled || self.has_steady_turns() => self.done,
            Turns::Count(1) if self.done >= self.steps && self.is_touching() => self.most_steps,
            Turns::Count(_) => self.steps,
            // Each turn may be the last.
            Turns::Steady => self
                .end_of_turn(self.turn_impulses().len() + 1)
                .min(self.steps),
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

    /// Follows more columns to the end of their contact, as far as there are more that may count.
    fn follow_more(&mut self) {
        const MORE: usize = 8;
        self.followed = (self.followed + MORE).min(self.may_count());
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
        let time = self.begin + self.done as f64 * self.length;
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

    /// Goes on to a step.
    fn advance_to(&mut self, to: usize) -> Result<(), BrushError> {
        let mut samples = self.advance_sectors(self.begin, self.length, self.done + 1..=to)?;
        self.history.append(&mut samples);
        self.done = to;
        Ok(())
    }

    /// Lets all sectors go on by `steps` of `length` (s), counted from `begin` (s), and returns the
    /// forces at the end of each.
    fn advance_sectors(
        &mut self,
        begin: f64,
        length: f64,
        steps: RangeInclusive<usize>,
    ) -> Result<Vec<ToolSample>, BrushError> {
        let stop = &self.stop;
        let advance = |(_, sector): &mut (Group, Sector)| -> Result<Vec<ToolSample>, _> {
            let steps = steps.clone().take_while(|_| !stop.is_requested());
            steps
                .map(|step| sector.advance(begin + step as f64 * length, length))
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

    /// At the end: begins anew with more columns if there are too few for a steady stretch, and the
    /// settings do not state how many, or in shorter steps where its own were not short enough.
    /// Returns false otherwise.
    fn begin_anew(&mut self) -> Result<bool, BrushError> {
        if let Some(columns) = self.missing_columns() {
            let precision = (!self.refinement.goes_on).then_some(self.precision);
            let again = Self::of_columns(&self.settings, self.options, Some(columns), precision)?
                .until(&self.stop);
            *self = match precision {
                Some(_) => Self {
                    refinement: self.refinement.clone(),
                    ..again
                },
                None => again.or_sample()?,
            };
            return Ok(true);
        }
        if !self.refinement.goes_on {
            return Ok(false);
        }
        let (columns, tolerance) = (self.arrangement.columns, self.brush.tolerance);
        let whole = self.refinement.whole;
        let are_equal = self.form == Form::Planar && !filaments::differ(&self.settings);
        let refinement = self
            .refinement
            .after(self.turns(), columns, tolerance, are_equal);
        if refinement.goes_on {
            *self = self.again(columns, self.precision.halved(1), refinement)?;
            return Ok(true);
        }
        self.precision.error = self.precision.error.max(refinement.error(tolerance));
        if whole.is_some() {
            self.precision = self.precision.halved(-(refinement.back(tolerance) as i32));
        }
        self.refinement = refinement.ended();
        if whole.is_none() && self.options.halvings == 0 {
            return Ok(false);
        }
        let precision = self.precision.halved(self.options.halvings.into());
        *self = self.again(whole.unwrap_or(columns), precision, self.refinement.clone())?;
        Ok(true)
    }

    /// The number of columns that a steady stretch is expected to need, if there are too few and
    /// the settings do not state how many.
    fn missing_columns(&self) -> Option<usize> {
        if self.brush.columns.is_some() || self.has_settled || self.refinement.whole.is_some() {
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

    /// The step at which all filaments have ended so many turns.
    fn end_of_turn(&self, turns: usize) -> usize {
        let latest = self.arrangement.latest() / self.pass.tool().rate;
        ((latest + turns as f64 * self.pass.turn_time() - self.begin) / self.length).ceil() as usize
    }

    /// Mean contact normal impulses of the turns so far in N s, as far as all filaments have ended
    /// them.
    fn turn_impulses(&self) -> Vec<f64> {
        let of = |turn: usize| self.impulses(|account| account.impulses.get(turn).copied());
        let mean = |impulses: Vec<f64>| impulses.iter().sum::<f64>() / self.places.len() as f64;
        (0..).map_while(of).map(mean).collect()
    }

    /// The contact normal impulses of filaments in N s, by turn, at the end.
    fn turns(&self) -> Vec<Vec<f64>> {
        let is_single = self.pass.turns() == Turns::Count(1);
        (0..)
            .map_while(|turn| self.impulses(|account| account.turns(is_single).get(turn).copied()))
            .collect()
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
        self.pass.turns() == Turns::Steady
            && matches!(self.turn_impulses()[..], [.., before, last] if is_steady(before, last))
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

    /// The next step after `step` at which a frame is taken.
    fn next_frame(&self, step: usize) -> Option<usize> {
        let nodes = self.arrangement.roots.len() * (self.settings.filament.segments + 1);
        let frames = self.options.frames.min(MOST_NODES / nodes);
        let stride = self.steps.div_ceil(frames.max(1)).max(1);
        (frames > 0)
            .then(|| (step / stride + 1) * stride)
            .filter(|next| *next <= self.steps)
    }

    fn frame(&mut self) -> Frame {
        let roots = &self.arrangement.roots;
        let n = self.settings.filament.segments;
        let forces: Vec<[Vec<f64>; 2]> = self
            .sectors
            .iter()
            .map(|(_, sector)| sector.forces())
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
            .map(|(group, sector)| (group, sector.placed()))
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
        let time_s = self.begin + self.done as f64 * self.length;
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
            precision: self.precision,
            refinement: self.refinement.clone(),
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
            precision,
            refinement,
            reached,
        } = checkpoint;
        let is_precise = precision.step > 0.0 && precision.newton > 0.0 && precision.lacking > 0.0;
        if !is_precise || refinement.coarser.len() > MAX_TURNS || refinement.whole == Some(0) {
            return Err(BrushError::Checkpoint);
        }
        let mut run = Self {
            refinement,
            ..Self::of_columns(settings, options, Some(columns), Some(precision))?
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
        self.done = Some(done).filter(|done| *done <= self.most_steps)?;
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
        let residuals = self.residuals()?;
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
            step_error: self.precision.error,
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
    ///
    /// # Errors
    /// If one of them does so by more than the tolerance can explain.
    fn residuals(&self) -> Result<Residuals, BrushError> {
        let relative = |of: &dyn Fn(&Balance) -> [f64; 2]| {
            let [mut lack, mut whole] = [0.0; 2];
            for (group, sector) in &self.sectors {
                let [own_lack, own_whole] = of(sector.balance());
                lack += group.weight() as f64 * own_lack;
                whole += group.weight() as f64 * own_whole;
            }
            if whole > 0.0 { lack / whole } else { 0.0 }
        };
        let residuals = Residuals {
            energy: relative(&Balance::energy_defect),
            momentum: relative(&Balance::momentum_defect),
        };
        let allowed = allowed_residual(&self.brush);
        for (quantity, residual) in [
            ("energy", residuals.energy),
            ("momentum", residuals.momentum),
        ] {
            // What is not a number is not resolved either.
            if residual.is_nan() || residual > allowed {
                return Err(BrushError::Unresolved {
                    quantity,
                    residual,
                    allowed,
                });
            }
        }
        Ok(residuals)
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

#[cfg(test)]
mod tests {
    use super::Refinement;

    #[test]
    fn the_whole_takes_the_longest_steps_that_its_sample_allows() {
        let back = |changes: &[f64]| {
            let changes = [&[f64::INFINITY], changes].concat();
            Refinement {
                whole: Some(80),
                changes,
                ..Refinement::new(false, 80)
            }
            .back(1e-3)
        };
        // Halving them changed little.
        assert_eq!([back(&[1e-4]), back(&[1.3e-3, 1.5e-4])], [1, 1]);
        // Nothing is to be warned of, or each change is much less than the one before.
        assert_eq!([back(&[3.9e-4, 2.7e-4]), back(&[2.2e-3, 6.7e-4])], [0, 0]);
        // Filaments throw each other about, whatever the steps.
        assert_eq!([back(&[1.1e-3, 8.2e-4]), back(&[8e-3, 2.4e-2])], [2, 2]);
    }
}
