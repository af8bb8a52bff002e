//! A row of filaments on its way over the workpiece, in fixed steps.

use std::error::Error;
use std::f64::consts::SQRT_2;
use std::fmt::{self, Display, Formatter};

use super::candidates::Layout;
use super::gmres::Vector;
use super::presses::PressLaw;
use super::row::{Bristle, Effort, Motion, NoConvergence, Row, WorkpieceLoad};
use crate::equations::{LANES, Lanes, Lanewise};
use crate::model::metrics::{ContactRecord, Metrics, tip_deflection};
use crate::model::settings::Turns;
use crate::simulation::{Form, Pass};
use crate::tool::{ClampMotion, Tool, Turning};

/// The middle stage of TR-BDF2 is at `γ = 2 − √2` of the step (Bank et al. 1985; Hosea and Shampine 1996).
const MIDDLE: f64 = 2.0 - SQRT_2;
/// Weight of a stage in itself.
const OWN: f64 = 0.5 * MIDDLE;
/// Weights of the first two stages in the last.
const OTHERS: f64 = 0.25 * SQRT_2;

/// What a row is made of, and how it is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowSettings {
    /// Number of filaments around.
    pub columns: usize,
    /// Angle between neighbouring filaments in rad.
    pub pitch: f64,
    /// Contact between filaments.
    pub law: PressLaw,
    /// Number of contact points of a segment, `N_q`.
    pub points: usize,
    /// Way of the tips in a step in m.
    pub step: f64,
    /// Largest last correction of a node's velocity, as a share of the brushing velocity.
    pub newton_tolerance: f64,
}

/// The result of a row.
#[derive(Clone, Debug, PartialEq)]
pub struct RowResult {
    /// The contact of each filament; column 0 meets the workpiece first.
    pub metrics: Vec<Metrics>,
    /// Steps taken.
    pub steps: usize,
    /// Steps repeated with half their length.
    pub halved_steps: usize,
    /// Work of the solutions.
    pub effort: Effort,
    /// Time simulated in s.
    pub end_time: f64,
}

/// One filament's contact so far.
#[derive(Clone, Debug)]
struct Account {
    record: ContactRecord,
    load: WorkpieceLoad,
    /// By how much the filament is behind the first, in s.
    delay: f64,
}

/// Why a row could not be simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RowError {
    /// The motion is not planar by symmetry.
    NotPlanar,
    /// The pass has several turns.
    Turns,
    /// The relaxed filaments overlap.
    Overlap {
        /// Distance of neighbouring roots in m.
        pitch: f64,
        /// The least that they need, in m.
        reach: f64,
    },
    /// The shortest step did not converge.
    NoConvergence {
        /// When, in s.
        time: f64,
    },
}

impl Error for RowError {}

impl Display for RowError {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotPlanar => {
                write!(f, "a row is simulated in the plane of rotation: leave out tilt, and gravity along z")
            }
            Self::Turns => write!(f, "a row is simulated for a single turn: leave out process.turns"),
            Self::Overlap { pitch, reach } => {
                write!(
                    f,
                    "the roots of neighbouring filaments are {pitch} m apart, less than their diameter of {reach} m"
                )
            }
            Self::NoConvergence { time } => {
                write!(f, "Newton's method does not converge at {time} s: filaments may fold, or cross each other")
            }
        }
    }
}

/// Simulates the filaments of one row, which touch each other and the workpiece. The filament, its tool and the workpiece are those of
/// `pass`; column 0 meets the workpiece first, at the times of the pass.
///
/// TR-BDF2 in steps of equal length, of which one is halved where Newton's method fails. Impulses are summed with the weights of
/// the method. Times of contact begin and end where the penetration passes zero between two steps.
///
/// # Errors
/// See [`RowError`].
///
/// # Panics
/// If there is no column, or no contact point.
pub fn simulate_row(pass: &Pass, settings: &RowSettings) -> Result<RowResult, RowError> {
    assert!(settings.columns > 0 && settings.points > 0, "a row has filaments, and a segment has contact points");
    if pass.form() != Form::Planar {
        return Err(RowError::NotPlanar);
    }
    if pass.turns() != Turns::Count(1) {
        return Err(RowError::Turns);
    }
    let template = pass.filament();
    let pitch = 2.0 * template.motion.tool.body_radius * (0.5 * settings.pitch).sin();
    if settings.columns > 1 && pitch < settings.law.reach {
        return Err(RowError::Overlap { pitch, reach: settings.law.reach });
    }
    let n = template.chain.segments();
    let rate = template.motion.rate;
    let bristles: Vec<Bristle> = (0..settings.columns)
        .map(|column| {
            let initial_angle = template.motion.initial_angle - column as f64 * settings.pitch;
            Bristle { motion: Turning { initial_angle, ..template.motion }, ..template.clone() }
        })
        .collect();
    let layout = Layout {
        filaments: settings.columns,
        segments: n,
        length: template.chain.length,
        points: settings.points,
        reach: settings.law.reach,
    };
    let starts: Vec<[Vec<[f64; 2]>; 2]> = bristles
        .iter()
        .map(|bristle| {
            let Turning { tool, rate, initial_angle } = &bristle.motion;
            let [q, v] = tool.undeformed(*initial_angle, *rate);
            [bristle.chain.relaxed(q).collect(), vec![v; n]]
        })
        .collect();
    let mut row = Row::new(pass.form(), bristles, settings.law, layout);
    let mut motion = row.start(|filament| starts[filament].clone());
    let mut accounts: Vec<Account> = (0..settings.columns)
        .map(|column| Account {
            record: ContactRecord { turn: 1, ..ContactRecord::default() },
            load: WorkpieceLoad { pressing: f64::NEG_INFINITY, ..WorkpieceLoad::default() },
            delay: column as f64 * settings.pitch / rate,
        })
        .collect();
    let velocity = pass.nominal().brushing_velocity;
    let length = settings.step / velocity;
    let end_time = pass.end_time() + accounts.last().map_or(0.0, |last| last.delay);
    let steps = (end_time / length).ceil() as usize;
    let length = end_time / steps as f64;
    let (mut result_steps, mut halved, mut effort) = (0, 0, Effort::default());
    let mut stepper = Stepper::new(&motion, settings.newton_tolerance * velocity);
    for step in 0..steps {
        let end = (step + 1) as f64 * length;
        let mut part = end - motion.time;
        while motion.time < end {
            let h = part.min(end - motion.time);
            match stepper.step(&mut row, &motion, h) {
                Ok(stages) => {
                    result_steps += 1;
                    effort += stages.effort;
                    let begin = motion.time;
                    std::mem::swap(&mut motion, &mut stepper.end);
                    if (end - motion.time).abs() < 1e-9 * length {
                        motion.time = end;
                    }
                    observe(&row, pass, &mut accounts, &stages, [begin, h]);
                }
                Err(NoConvergence) if h > 1e-4 * length => {
                    halved += 1;
                    part = 0.5 * h;
                }
                Err(NoConvergence) => return Err(RowError::NoConvergence { time: motion.time }),
            }
        }
    }
    let metrics = accounts.iter().map(|account| pass.metrics(&account.record)).collect();
    Ok(RowResult { metrics, steps: result_steps, halved_steps: halved, effort, end_time })
}

/// The loads at both stages of a step.
struct Stages {
    loads: [Vec<WorkpieceLoad>; 2],
    effort: Effort,
}

struct Stepper {
    tolerance: f64,
    middle: Motion,
    end: Motion,
    base: [Vector; 2],
}

impl Stepper {
    fn new(motion: &Motion, tolerance: f64) -> Self {
        let base = [motion.q.clone(), motion.v.clone()];
        Self { tolerance, middle: motion.clone(), end: motion.clone(), base }
    }

    /// A step of `h` (s) from `start`, into `self.end`.
    fn step(&mut self, row: &mut Row, start: &Motion, h: f64) -> Result<Stages, NoConvergence> {
        let own = OWN * h;
        let weights = [own * own, own];
        let Self { tolerance, middle, end, base: [base_q, base_v] } = self;
        set_sum(base_v, &start.v, &[(own, &start.accelerations)]);
        set_sum(base_q, &start.q, &[(own, &start.v), (own, base_v)]);
        middle.time = start.time + MIDDLE * h;
        middle.accelerations.clone_from(&start.accelerations);
        let mut effort = row.solve_stage(middle, [base_q, base_v], weights, *tolerance)?;
        let first = row.loads().to_vec();
        let others = OTHERS * h;
        set_sum(base_v, &start.v, &[(others, &start.accelerations), (others, &middle.accelerations)]);
        set_sum(base_q, &start.q, &[(others, &start.v), (others, &middle.v), (own, base_v)]);
        end.time = start.time + h;
        end.accelerations.clone_from(&middle.accelerations);
        effort += row.solve_stage(end, [base_q, base_v], weights, *tolerance)?;
        Ok(Stages { loads: [first, row.loads().to_vec()], effort })
    }
}

/// `start + Σ factor · vector`
fn set_sum(result: &mut Vector, start: &Vector, terms: &[(f64, &Vector)]) {
    for (k, (block, start)) in result.iter_mut().zip(start).enumerate() {
        for i in 0..2 {
            let mut value = start[i];
            for (factor, vector) in terms {
                value = value + Lanes::<LANES>::from_lanes(|_| *factor) * vector[k][i];
            }
            block[i] = value;
        }
    }
}

/// Adds a step from `begin` over `h` (s) to the accounts.
fn observe(row: &Row, pass: &Pass, accounts: &mut [Account], stages: &Stages, [begin, h]: [f64; 2]) {
    for (index, account) in accounts.iter_mut().enumerate() {
        let [middle, end] = [&stages.loads[0][index], &stages.loads[1][index]];
        let mean = |of: &dyn Fn(&WorkpieceLoad) -> f64| h * (OTHERS * (of(&account.load) + of(middle)) + OWN * of(end));
        let record = &mut account.record;
        record.impulse += mean(&|load| load.normal);
        record.vector_impulse = std::array::from_fn(|i| record.vector_impulse[i] + mean(&|load| load.force[i]));
        record.angular_impulse += mean(&|load| load.moment);
        record.edge_impulse += mean(&|load| load.on_edges);
        record.friction_work += mean(&|load| load.friction_power);
        record.peak_force = record.peak_force.max(middle.normal).max(end.normal);
        record.edge_penetration = record.edge_penetration.max(end.edge_penetration);
        let part = contact_part(account.load.pressing, end.pressing);
        if part[1] > part[0] {
            record.time += h * (part[1] - part[0]);
            record.count += usize::from(part[0] > 0.0 || account.load.pressing <= 0.0);
            let times = part.map(|part| begin + part * h);
            for touch in pass.touches() {
                let [entry, exit] = touch.map(|time| time + account.delay);
                record.nominal_time += (times[1].min(exit) - times[0].max(entry)).max(0.0);
            }
        }
        let bristle = &row.bristles()[index];
        let clamp = bristle.motion.at(begin + h);
        let tip = row.tip(index);
        let length = bristle.chain.length * bristle.chain.segments() as f64;
        record.max_deflection = record.max_deflection.max(tip_deflection(tip, clamp.position, clamp.direction, length));
        account.load = *end;
    }
}

/// Between which parts of a step a filament touches that presses by `start` and `end` (m) at its ends.
fn contact_part(start: f64, end: f64) -> [f64; 2] {
    match (start > 0.0, end > 0.0) {
        (true, true) => [0.0, 1.0],
        (false, false) => [0.0, 0.0],
        (false, true) => [if start.is_finite() { start / (start - end) } else { 1.0 }, 1.0],
        (true, false) => [0.0, start / (start - end)],
    }
}
