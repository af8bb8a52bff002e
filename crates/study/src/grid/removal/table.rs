//! Work of passes over edges of some radii, by filaments that have lost some of their length.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use bristle::model::settings::{
    ChamferSettings, EdgeSettings, Settings, Side, UncertaintySettings, WorkpieceKind,
};
use bristle::simulation::{ProfileCell, Sampling, Simulation, Stop};
use parking_lot::Mutex;

use super::curve::MonotoneCubic;
use super::error::RemovalError;
use crate::grid::uncertainty::Scatter;
use crate::grid::{CaseResult, CaseSummary, Resources, Study, simulate_cases};

/// Depth that counts as zero, over that of new filaments.
const NEGLIGIBLE_DEPTH: f64 = 1e-9;

/// Points where work is known: radii and losses of length in m, ascending.
#[derive(Clone, Debug)]
pub struct WorkNodes {
    pub radii: Vec<f64>,
    pub losses: Vec<f64>,
}

/// Number of quantities that are interpolated.
const NUMBERS: usize = 4;

/// Work, force and penetration of one pass of one filament.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PassWork {
    /// Sliding work on each edge in J, in the order in which filaments meet them.
    pub edges: [f64; 2],
    /// Sliding work on the whole workpiece in J.
    pub whole: f64,
    /// Force of the tool in N.
    pub force: f64,
    /// Largest penetration of an edge in m.
    pub penetration: f64,
}

impl PassWork {
    /// Returns the interpolated quantities.
    fn numbers(&self) -> [f64; NUMBERS] {
        let [first, second] = self.edges;
        [first, second, self.whole, self.force]
    }

    fn of_numbers([first, second, whole, force]: [f64; NUMBERS]) -> Self {
        Self {
            edges: [first, second],
            whole,
            force,
            penetration: 0.0,
        }
    }

    /// Adds a `part` of another; the penetration is the larger one.
    fn plus(self, part: f64, other: &Self) -> Self {
        let (own, others) = (self.numbers(), other.numbers());
        let sum = Self::of_numbers(std::array::from_fn(|i| own[i] + part * others[i]));
        Self {
            penetration: self.penetration.max(other.penetration),
            ..sum
        }
    }
}

/// Returns the settings of a tool whose filaments have lost the length `loss` (m). The machine
/// keeps its speed and, unless it compensates, its distance. `None` if the filaments no longer
/// reach the workpiece.
fn worn(settings: &Settings, loss: f64) -> Option<Settings> {
    let mut worn = settings.clone();
    if loss == 0.0 {
        return Some(worn);
    }
    let (new, filament) = (&settings.filament, &mut worn.filament);
    let length_m = new.length_m - loss;
    // Waves stay where they are, and a taper ends where it is cut.
    filament.waviness_length_m = new
        .waviness_length_m
        .or((new.waviness_amplitude_m != 0.0).then_some(new.length_m));
    filament.tip_diameter_m = new
        .tip_diameter_m
        .map(|tip| new.diameter_m + (tip - new.diameter_m) * length_m / new.length_m);
    filament.length_m = length_m;
    worn.process.brushing_velocity_m_s = settings.angular_velocity_rad_s() * worn.tool_radius_m();
    if !settings.removal_or_default().compensate && settings.process.tool_force_n.is_none() {
        let depth = settings.process.penetration_depth_m;
        worn.process.penetration_depth_m = depth + worn.reach_m() - settings.reach_m();
        if worn.process.penetration_depth_m <= NEGLIGIBLE_DEPTH * depth {
            return None;
        }
    }
    Some(worn)
}

/// Mirrors the set-up in `x`: the tool turns in the other direction.
fn mirrored(mut settings: Settings) -> Settings {
    let Settings {
        tool,
        filament,
        workpiece,
        process,
        ..
    } = &mut settings;
    if let WorkpieceKind::Edge(EdgeSettings { side, offset_m, .. })
    | WorkpieceKind::Chamfer(ChamferSettings { side, offset_m, .. }) = &mut workpiece.kind
    {
        *side = match side {
            Side::Leaving => Side::Entering,
            Side::Entering => Side::Leaving,
        };
        *offset_m = 0.0 - *offset_m;
    }
    let mirrored = [
        &mut tool.skew_rad,
        &mut filament.waviness_amplitude_m,
        &mut workpiece.feed_velocity_m_s,
        &mut process.gravity_m_s2[0],
    ];
    for value in mirrored {
        *value = 0.0 - *value;
    }
    settings
}

/// A tool.
struct ToolMember {
    /// Settings for each direction of rotation; empty if the tool does not reach the workpiece.
    directions: Vec<Settings>,
    /// Number of filaments.
    count: f64,
}

/// Key of a pass: the tool by number, and the bits of the radius of the edge and of the loss of
/// length, in m.
type PassKey = (usize, u64, u64);

bristle::record! {
    /// A simulated pass: the mean over sampled tools, and over both directions if they alternate.
    #[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
    pub struct SimulatedEdge {
        edge_radius_m: f64 = ["R", "m", "radius of the edge", ""],
        filament_length_loss_m: f64 = ["", "m", "loss of length of the filaments", ""],
        edge_sliding_work_j: f64 = ["W_e", "J", "sliding work on the edge", "of a chamfer, on the edge that filaments meet first"],
        second_edge_sliding_work_j: f64 = ["", "J", "sliding work on the second edge", "of a chamfer"],
        sliding_work_j: f64 = ["W_s", "J", "sliding work", ""],
        tool_contact_normal_force_n: f64 = ["F_n,w", "N", "contact normal force of the tool", ""],
        max_edge_penetration_m: f64 = ["", "m", "largest penetration of an edge", ""],
    }
}

/// Simulated passes of one tool, or of sampled tools where filaments scatter.
pub struct Passes<'a> {
    members: Vec<ToolMember>,
    has_two_edges: bool,
    resources: Resources,
    stop: &'a Stop,
    tell: &'a (dyn Fn(usize, usize) + Sync),
    known: BTreeMap<PassKey, PassWork>,
}

impl<'a> Passes<'a> {
    /// Creates an empty set of passes of the tools in `settings`.
    pub fn new(
        settings: &Settings,
        resources: Resources,
        stop: &'a Stop,
        tell: &'a (dyn Fn(usize, usize) + Sync),
    ) -> Self {
        let directions = |settings: Settings| match settings.removal_or_default().alternate {
            true => vec![settings.clone(), mirrored(settings)],
            false => vec![settings],
        };
        let members = match Scatter::of(settings) {
            None => vec![ToolMember {
                directions: directions(settings.clone()),
                count: settings.tool.filament_count,
            }],
            Some(scatter) => (0..scatter.count())
                .map(|tool| ToolMember {
                    directions: scatter.settings(tool).map_or_else(Vec::new, directions),
                    count: scatter.filament_count(tool),
                })
                .collect(),
        };
        let has_two_edges = matches!(settings.workpiece.kind, WorkpieceKind::Chamfer(_));
        Self {
            members,
            has_two_edges,
            resources,
            stop,
            tell,
            known: BTreeMap::new(),
        }
    }

    /// Returns the number of tools.
    pub fn members(&self) -> usize {
        self.members.len()
    }

    /// Returns the number of filaments of a tool.
    pub fn count(&self, member: usize) -> f64 {
        self.members[member].count
    }

    /// Simulates the missing passes at the `nodes`.
    pub fn simulate(&mut self, nodes: &WorkNodes) -> Result<(), RemovalError> {
        self.attempt(nodes)?
            .into_iter()
            .next()
            .map_or(Ok(()), |(_, failure)| Err(failure))
    }

    /// Simulates the missing passes; some may fail. Returns the least radius from which on none
    /// fails, or the failure at the largest radius.
    pub fn first_possible(&mut self, nodes: &WorkNodes) -> Result<f64, RemovalError> {
        let mut failures = self.attempt(nodes)?;
        let last = nodes.radii[nodes.radii.len() - 1];
        if let Some(at_last) = failures.iter().position(|(radius, _)| *radius == last) {
            return Err(failures.swap_remove(at_last).1);
        }
        let largest = failures
            .iter()
            .map(|(radius, _)| *radius)
            .fold(0.0, f64::max);
        Ok(*nodes
            .radii
            .iter()
            .find(|radius| **radius > largest)
            .expect("the last one can be simulated"))
    }

    /// Simulates missing passes, and returns the failures with their radii.
    fn attempt(
        &mut self,
        WorkNodes { radii, losses }: &WorkNodes,
    ) -> Result<Vec<(f64, RemovalError)>, RemovalError> {
        let (mut found, mut keys, mut cases, mut failures) =
            (BTreeMap::new(), Vec::new(), Vec::new(), Vec::new());
        for (member, own) in self.members.iter().enumerate() {
            for (&radius, &loss) in radii
                .iter()
                .flat_map(|radius| losses.iter().map(move |loss| (radius, loss)))
            {
                let key = (member, radius.to_bits(), loss.to_bits());
                if self.known.contains_key(&key) {
                    continue;
                }
                found.insert(key, PassWork::default());
                for (direction, settings) in own.directions.iter().enumerate() {
                    let Some(mut settings) = worn(settings, loss) else {
                        continue;
                    };
                    settings.workpiece.kind.set_edge_radius_m(radius);
                    if settings.brush.is_none() {
                        // A sampled tool is not sampled again.
                        settings.uncertainty = UncertaintySettings::default();
                    }
                    if let Err(error) = settings.check() {
                        failures.push((radius, RemovalError::of_pass(radius, loss, error)));
                        found.remove(&key);
                        break;
                    }
                    keys.push((key, direction));
                    cases.push(settings);
                }
            }
        }
        let works = if cases.is_empty() {
            Vec::new()
        } else {
            self.run(cases)?
        };
        for ((key, direction), work) in keys.into_iter().zip(works) {
            let (member, radius, loss) = key;
            match work {
                Ok(mut work) => {
                    if self.has_two_edges && direction == 1 {
                        work.edges.reverse();
                    }
                    let part = 1.0 / self.members[member].directions.len() as f64;
                    if let Some(sum) = found.get_mut(&key) {
                        *sum = sum.plus(part, &work);
                    }
                }
                Err(error) => {
                    let [radius, loss] = [radius, loss].map(f64::from_bits);
                    failures.push((radius, RemovalError::of_pass(radius, loss, error)));
                    found.remove(&key);
                }
            }
        }
        self.known.append(&mut found);
        Ok(failures)
    }

    /// Simulates cases side by side.
    fn run(&self, cases: Vec<Settings>) -> Result<Vec<Result<PassWork, String>>, RemovalError> {
        let study = Study::of_cases(cases);
        let count = study.case_count();
        let (works, shares, done) = (
            Mutex::new(vec![None; count]),
            Mutex::new(vec![None; count]),
            Mutex::new(0),
        );
        let sampling = Sampling {
            profile: self.has_two_edges,
            alongside: true,
            ..Sampling::default()
        };
        let on_pass = |case: usize, simulation: &Simulation| {
            shares.lock()[case] = Some(shares_of_edges(&simulation.profile));
        };
        let on_case = |case: usize, result: CaseResult| {
            works.lock()[case] = Some(result);
            let mut done = done.lock();
            *done += 1;
            (self.tell)(*done, count);
            ControlFlow::Continue(())
        };
        let all: Vec<usize> = (0..count).collect();
        simulate_cases(
            &study,
            &all,
            self.resources,
            self.stop,
            sampling,
            on_pass,
            on_case,
        )?;
        if self.stop.is_requested() {
            return Err(RemovalError::Stopped);
        }
        let shares = shares.into_inner();
        let works = works.into_inner().into_iter().zip(shares);
        Ok(works
            .map(|(result, shares)| {
                let summary = result.expect("every case is done")?;
                let edges = if self.has_two_edges {
                    shares.unwrap_or_default()
                } else {
                    [1.0, 0.0]
                };
                Ok(work_of(&summary, edges))
            })
            .collect())
    }

    /// Returns the simulated work at the `nodes` as curves: of one tool, or the mean of all.
    pub fn table(
        &self,
        member: Option<usize>,
        WorkNodes { radii, losses }: &WorkNodes,
    ) -> WorkTable {
        let members = member.map_or(0..self.members(), |member| member..member + 1);
        let part = 1.0 / members.len() as f64;
        let at = |radius: f64, loss: f64| {
            let works = members
                .clone()
                .map(|member| self.known[&(member, radius.to_bits(), loss.to_bits())]);
            works.fold(PassWork::default(), |sum, work| sum.plus(part, &work))
        };
        let x: Vec<f64> = radii.iter().map(|radius| radius.ln()).collect();
        let row = |&loss: &f64| {
            let works: Vec<[f64; NUMBERS]> = radii
                .iter()
                .map(|&radius| at(radius, loss).numbers())
                .collect();
            std::array::from_fn(|i| {
                MonotoneCubic::through(x.clone(), works.iter().map(|numbers| numbers[i]).collect())
            })
        };
        WorkTable {
            losses: losses.clone(),
            rows: losses.iter().map(row).collect(),
        }
    }

    /// Returns all simulated passes, each the mean of all tools, by radius and loss.
    pub fn simulated(&self) -> Vec<SimulatedEdge> {
        let mut sums: BTreeMap<(u64, u64), PassWork> = BTreeMap::new();
        let part = 1.0 / self.members() as f64;
        for ((_, radius, loss), work) in &self.known {
            let sum = sums.entry((*radius, *loss)).or_default();
            *sum = sum.plus(part, work);
        }
        let simulated = sums
            .into_iter()
            .map(|((radius, loss), work)| SimulatedEdge {
                edge_radius_m: f64::from_bits(radius),
                filament_length_loss_m: f64::from_bits(loss),
                edge_sliding_work_j: work.edges[0],
                second_edge_sliding_work_j: work.edges[1],
                sliding_work_j: work.whole,
                tool_contact_normal_force_n: work.force,
                max_edge_penetration_m: work.penetration,
            });
        simulated.collect()
    }
}

fn work_of(summary: &CaseSummary, shares: [f64; 2]) -> PassWork {
    let metrics = &summary.metrics;
    PassWork {
        edges: shares.map(|share| share * metrics.edge_sliding_work_j),
        whole: metrics.sliding_work_j,
        force: metrics.tool_contact_normal_force_n,
        penetration: metrics.max_edge_penetration_m,
    }
}

/// Returns the shares of two edges in their work; both zero without work.
fn shares_of_edges(profile: &[ProfileCell]) -> [f64; 2] {
    let edges = profile
        .chunk_by(|a, b| a.on_edge == b.on_edge)
        .filter(|cells| cells[0].on_edge);
    let works: Vec<f64> = edges
        .map(|cells| {
            cells
                .iter()
                .map(|cell| cell.sliding_work_j_m * cell.length_m)
                .sum()
        })
        .collect();
    let whole: f64 = works.iter().sum();
    let share = |edge: usize| {
        if whole > 0.0 {
            works.get(edge).map_or(0.0, |work| work / whole)
        } else {
            0.0
        }
    };
    [share(0), share(1)]
}

/// The work of a pass, smooth over the logarithm of the radius of the edge and over the loss of
/// length.
#[derive(Clone, Debug)]
pub struct WorkTable {
    losses: Vec<f64>,
    /// Curves of the interpolated quantities, by loss.
    rows: Vec<[MonotoneCubic; NUMBERS]>,
}

impl WorkTable {
    /// Creates a table of these rows, by loss.
    #[cfg(test)]
    pub fn of_rows(losses: Vec<f64>, rows: Vec<[MonotoneCubic; NUMBERS]>) -> Self {
        Self { losses, rows }
    }

    /// Creates a table of work on one edge, over its radius (m).
    #[cfg(test)]
    pub fn of_work(radii: &[f64], work: impl Fn(f64) -> f64) -> Self {
        let x: Vec<f64> = radii.iter().map(|radius| radius.ln()).collect();
        let on_edge = MonotoneCubic::through(
            x.clone(),
            radii.iter().map(|radius| work(*radius)).collect(),
        );
        let none = MonotoneCubic::through(vec![x[0]], vec![0.0]);
        Self::of_rows(vec![0.0], vec![[on_edge, none.clone(), none.clone(), none]])
    }

    /// Returns the work over an edge of the radius `radius` (m) by filaments that have lost the
    /// length `loss` (m).
    pub fn at(&self, radius: f64, loss: f64) -> PassWork {
        let x = radius.ln();
        PassWork::of_numbers(std::array::from_fn(|i| self.number(i, x, loss)))
    }

    /// Returns the work on one edge alone, by number.
    pub fn edge(&self, edge: usize, radius: f64, loss: f64) -> f64 {
        self.number(edge, radius.ln(), loss)
    }

    fn number(&self, i: usize, x: f64, loss: f64) -> f64 {
        let along = self.rows.iter().map(|row| row[i].at(x)).collect();
        MonotoneCubic::through(self.losses.clone(), along).at(loss)
    }
}
