//! Rounding of an edge by a brush, and wear of the filaments (MODEL, "Removal and wear").
//!
//! An edge stays a circular arc tangent to both faces. Its sliding work `W_e` comes from passes
//! over edges of a few radii and, where filaments wear, by filaments of a few lengths. Between
//! these it is interpolated smoothly in `ln R`. Then `dA/dN = k_P (N_f/b) W_e` is integrated, and
//! more radii are simulated until the result no longer changes.

use std::f64::consts::{PI, TAU};

use bristle::model::settings::{
    ObservedEdge, RemovalGoal, RemovalSettings, Settings, Side, WorkpieceKind,
};
use bristle::simulation::Stop;

use spec_math::cephes64::ndtri;

use crate::grid::Resources;
use crate::grid::uncertainty::{BAND, quantile};

mod curve;
mod error;
mod growth;
mod table;

pub use error::RemovalError;
pub use growth::area_factor;
pub use table::SimulatedEdge;

use growth::{End, Ended, Rates, Stage, grow, stage_at};
use table::{Passes, WorkNodes, WorkTable};

/// Relative change of the radius below which no more radii are simulated (MODEL).
const MAX_RADIUS_CHANGE: f64 = 5e-3;
/// Numbers of radii and of losses of length, finer from level to level.
const LEVELS: [[usize; 2]; 4] = [[5, 3], [9, 5], [17, 9], [33, 17]];
/// Radius in m of an edge that is as good as sharp: smaller edges have the work of this one.
const SHARP_RADIUS_M: f64 = 10e-6;
/// Radius of such an edge over that of the goal, where the goal is small.
const SHARP_SHARE_OF_GOAL: f64 = 0.05;
/// Factor by which the largest radius is raised where it is not known before.
const RADIUS_FACTOR: f64 = 4.0;
/// Largest share of their length that filaments may lose.
const MAX_LOSS_SHARE: f64 = 0.5;
/// Intervals between the rows of the result.
const ROWS: usize = 200;
/// Number of losses of length from which a life is computed.
const LOSSES_OF_LIFE: usize = 17;

bristle::record! {
    /// An edge and its brush at one time.
    #[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
    pub struct RemovalRow {
        turns: f64 = ["N", "", "turns of the tool", "from the start"],
        time_s: f64 = ["", "s", "time", "2π N/ω"],
        edge_radius_m: f64 = ["R", "m", "radius of the edge", "of a chamfer, of the edge that filaments meet first"],
        second_edge_radius_m: f64 = ["", "m", "radius of the second edge", "of a chamfer"],
        edge_radius_lower_95_m: f64 = ["", "m", "lower end of the 95 % band of R", "2.5 % of the sampled tools have less"],
        edge_radius_upper_95_m: f64 = ["", "m", "upper end of the 95 % band of R", "2.5 % of the sampled tools have more"],
        removed_area_m2: f64 = ["A", "m²", "area removed from the edges", "[cot(Θ/2) − (π − Θ)/2] R², less that at the start"],
        tool_contact_normal_force_n: f64 = ["F_n,w", "N", "contact normal force of the tool", ""],
        filament_length_m: f64 = ["l_f", "m", "length of the filaments", ""],
        edge_sliding_work_j: f64 = ["W_e", "J", "sliding work on edges", "of one filament, one pass"],
        sliding_work_j: f64 = ["W_s", "J", "sliding work", "of one filament, one pass"],
    }
}

/// 95 % interval that the standard deviation of an observed radius leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObservedInterval {
    /// Preston coefficient in m²/N.
    pub preston_m2_n: [f64; 2],
    /// Time in s after which the edge has its radius at the end.
    pub time_s: [f64; 2],
}

/// Growth of an edge and wear of its brush over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Removal {
    /// Edge and brush over time, at equal steps of the square root of the turns.
    pub rows: Vec<RemovalRow>,
    /// Simulated passes.
    pub simulated: Vec<SimulatedEdge>,
    /// Preston coefficient `k_P` in m²/N: as stated, or from an observed edge.
    pub preston_m2_n: f64,
    /// Interval from the standard deviation of the observed radius; `None` without one.
    pub observed_interval: Option<ObservedInterval>,
    /// Included angle of each edge in rad, in the order in which filaments meet them.
    pub angles_rad: Vec<f64>,
    /// `true` if rows have a band.
    pub has_band: bool,
    /// Least radius in m over which passes were simulated. Smaller edges have its work.
    pub least_radius_m: f64,
    /// Largest relative change of the radius when the number of simulated radii was doubled.
    pub change_when_refined: f64,
    /// The time in s at which the force has fallen by `removal.force_loss`. `None` if filaments do
    /// not wear, or their force does not fall.
    pub life_s: Option<f64>,
}

impl Removal {
    /// Returns the largest relative change of final radius, final time and Preston coefficient,
    /// against another computation of the same edge.
    #[must_use]
    pub fn largest_change(&self, other: &Self) -> f64 {
        let numbers = |removal: &Self| {
            let end = removal.rows.last();
            [
                end.map_or(0.0, |row| row.edge_radius_m),
                end.map_or(0.0, |row| row.time_s),
                removal.preston_m2_n,
            ]
        };
        let changes = numbers(self)
            .into_iter()
            .zip(numbers(other))
            .filter(|(own, other)| own != other)
            .map(|(own, other)| (own - other).abs() / own.abs().max(other.abs()));
        changes.fold(0.0, f64::max)
    }

    /// Returns `true` if the radius still changed by more than MODEL allows in the last refinement.
    #[must_use]
    pub fn is_unresolved(&self) -> bool {
        self.change_when_refined >= MAX_RADIUS_CHANGE
    }

    /// Returns `true` if passes over edges smaller than the least simulated one cannot be
    /// simulated, because filaments dip through them.
    #[must_use]
    pub fn dips_through(&self) -> bool {
        let start = self.rows.first().map_or(0.0, |row| row.edge_radius_m);
        self.least_radius_m > start.max(SHARP_RADIUS_M)
    }

    /// Returns the simulated edge with the largest penetration over its radius, if that exceeds a
    /// half: the edge is softer than it is sharp.
    #[must_use]
    pub fn softest(&self) -> Option<&SimulatedEdge> {
        let part = |edge: &SimulatedEdge| edge.max_edge_penetration_m / edge.edge_radius_m;
        self.simulated
            .iter()
            .filter(|edge| part(edge) > 0.5)
            .max_by(|a, b| part(a).total_cmp(&part(b)))
    }
}

/// Follows the edge of the workpiece that `settings` state until the goal of `[removal]`. `tell`
/// receives the numbers of simulated and of all passes of a batch.
///
/// # Errors
/// If there is no edge, coefficient or goal, if the goal is never reached, or a pass cannot be
/// simulated.
pub fn remove(
    settings: &Settings,
    resources: Resources,
    stop: &Stop,
    tell: &(dyn Fn(usize, usize) + Sync),
) -> Result<Removal, RemovalError> {
    let removal = settings.removal_or_default();
    let angles = edges_of(settings)?;
    if removal.preston_m2_n.is_none() && removal.observed.is_none() {
        return Err(no_coefficient());
    }
    let goal = goal_of(settings, &removal)?;
    let radius = settings.workpiece.kind.edge_radius_m();
    for (path, goal) in [
        ("removal.until", goal.radius()),
        (
            "removal.observed",
            removal.observed.map(|edge| edge.edge_radius_m),
        ),
    ] {
        if let Some(goal) = goal.filter(|goal| *goal <= radius) {
            return Err(RemovalError::Failed(format!(
                "`{path}` is {goal:e} m, but the edge has a radius of {radius:e} m at the start, by `workpiece.edge_radius_m`: choose a \
                 larger one"
            )));
        }
    }
    if let Some(std) = removal.observed.and_then(|edge| edge.edge_radius_std_m)
        && observed_radii(&removal).is_some_and(|[least, _]| least <= radius)
    {
        return Err(RemovalError::Failed(format!(
            "`removal.observed` has a standard deviation of {std:e} m, with which the edge may not have grown at all: measure its \
             radius better, or brush it longer"
        )));
    }
    let mut search = GrowthSearch {
        settings,
        removal,
        angles,
        goal,
        passes: Passes::new(settings, resources, stop, tell),
    };
    let (growth, nodes, change) = search.refined()?;
    search.conclude(&growth, &nodes, change)
}

/// Returns the ends in m of the 95 % interval of the radius that was observed; `None` without a
/// standard deviation.
fn observed_radii(removal: &RemovalSettings) -> Option<[f64; 2]> {
    let ObservedEdge {
        edge_radius_m,
        edge_radius_std_m,
        ..
    } = removal.observed?;
    let half = ndtri(BAND[1]) * edge_radius_std_m?;
    Some([edge_radius_m - half, edge_radius_m + half])
}

fn no_coefficient() -> RemovalError {
    let words = "state `removal.preston_m2_n`, or what one trial showed: `removal.observed = { edge_radius_m = …, time_s = … }`";
    RemovalError::Failed(words.to_owned())
}

/// Returns the included angles in rad of the edges that can be followed, in the order in which
/// filaments meet them.
///
/// If there is no edge, or the work on edges is not known.
pub fn edges_of(settings: &Settings) -> Result<Vec<f64>, RemovalError> {
    let wrong = |words: &str| Err(RemovalError::Failed(words.to_owned()));
    match &settings.workpiece.kind {
        WorkpieceKind::Edge(edge) => Ok(vec![edge.included_angle_rad]),
        // Dividing it would take the work along the profile.
        WorkpieceKind::Chamfer(_) if settings.brush.is_some() => wrong(
            "the work of filaments that touch is not divided between the two edges of a chamfer: leave [brush] out, or choose \
             `workpiece.kind = \"edge\"`",
        ),
        WorkpieceKind::Chamfer(chamfer) => {
            let [top, other] = [
                PI - chamfer.chamfer_angle_rad,
                chamfer.included_angle_rad + chamfer.chamfer_angle_rad,
            ];
            Ok(if chamfer.side == Side::Leaving {
                vec![top, other]
            } else {
                vec![other, top]
            })
        }
        _ => wrong("`workpiece.kind` has no edge that grows round: choose \"edge\" or \"chamfer\""),
    }
}

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

/// Returns the condition that ends the removal.
fn goal_of(settings: &Settings, removal: &RemovalSettings) -> Result<End, RemovalError> {
    let turns_per_second = settings.angular_velocity_rad_s() / TAU;
    match (removal.until, removal.edge_feed_velocity_m_s) {
        (Some(RemovalGoal::EdgeRadiusM(radius)), _) => Ok(End::Radius(radius)),
        (Some(RemovalGoal::Turns(turns)), _) => Ok(End::Turns(turns)),
        (Some(RemovalGoal::TimeS(time)), _) => Ok(End::Turns(time * turns_per_second)),
        (None, Some(feed)) => Ok(End::Turns(settings.tool.width_m / feed * turns_per_second)),
        (None, None) => Err(RemovalError::Failed(
            "state when to end: `removal.until = { edge_radius_m = … }`, or `turns`, or `time_s`; or \
             `removal.edge_feed_velocity_m_s`, for one pass along the edge"
                .to_owned(),
        )),
    }
}

impl WorkNodes {
    fn new([least, largest]: [f64; 2], loss: f64, level: [usize; 2]) -> Self {
        let [radii, losses] =
            level.map(|count| (0..count).map(move |i| i as f64 / (count - 1) as f64));
        // The ends are exact, and the nodes of a level are among those of the next.
        let radius = |share: f64| match share {
            0.0 => least,
            1.0 => largest,
            _ => least * (largest / least).powf(share),
        };
        Self {
            radii: radii.map(radius).collect(),
            losses: if loss > 0.0 {
                losses.map(|share| share * loss).collect()
            } else {
                vec![0.0]
            },
        }
    }
}

/// The search for a result.
struct GrowthSearch<'a> {
    settings: &'a Settings,
    removal: RemovalSettings,
    angles: Vec<f64>,
    goal: End,
    passes: Passes<'a>,
}

/// Growth computed from simulated passes.
struct Growth {
    preston: f64,
    stages: Vec<Stage>,
    ended: Ended,
}

impl Growth {
    /// Returns the last stage.
    fn end(&self) -> Stage {
        self.stages[self.stages.len() - 1]
    }
}

impl GrowthSearch<'_> {
    /// Refines the passes until the radius no longer changes, or to the last level. Returns the
    /// growth, the nodes, and the last relative change of the radius.
    fn refined(&mut self) -> Result<(Growth, WorkNodes, f64), RemovalError> {
        let nodes = self.nodes()?;
        let mut coarse = self.follow(None, &nodes)?;
        let (mut finest, mut change) = (nodes, f64::INFINITY);
        for level in &LEVELS[1..] {
            let nodes = WorkNodes::new(
                [finest.radii[0], finest.radii[finest.radii.len() - 1]],
                finest.losses[finest.losses.len() - 1],
                *level,
            );
            let fine = self.follow(None, &nodes)?;
            change = change_of(&coarse, &fine);
            (coarse, finest) = (fine, nodes);
            if change < MAX_RADIUS_CHANGE {
                break;
            }
        }
        if let (Some(goal), Ended::Stopped | Ended::Worn | Ended::Largest) =
            (self.goal.radius(), coarse.ended)
        {
            return Err(self.unreached(goal, &coarse));
        }
        Ok((coarse, finest, change))
    }

    /// Returns the factors of the areas.
    fn factors(&self) -> [f64; 2] {
        let factor = |edge: usize| {
            self.angles
                .get(edge)
                .map_or(0.0, |angle| area_factor(*angle))
        };
        [factor(0), factor(1)]
    }

    /// Returns the largest loss of length that makes sense, in m.
    fn largest_loss(&self) -> f64 {
        let settings = self.settings;
        let half = MAX_LOSS_SHARE * settings.filament.length_m;
        if self.removal.compensate || settings.process.tool_force_n.is_some() {
            return half;
        }
        // Depth falls nearly in proportion to length.
        let shorter = |loss: f64| {
            let mut worn = settings.clone();
            worn.filament.length_m -= loss;
            settings.reach_m() - worn.reach_m()
        };
        half.min(settings.process.penetration_depth_m * half / shorter(half))
    }

    /// Returns the largest radius in m up to `wanted` that the workpiece can have.
    fn possible(&self, least: f64, wanted: f64) -> Result<f64, RemovalError> {
        let with = |radius: f64| {
            let mut settings = self.settings.clone();
            settings.workpiece.kind.set_edge_radius_m(radius);
            settings
        };
        let fits = |radius: f64| {
            with(radius).check().is_ok() && has_edges(&with(radius), self.angles.len())
        };
        if fits(wanted) {
            return Ok(wanted);
        }
        with(least)
            .check()
            .map_err(|violation| RemovalError::of_pass(least, 0.0, violation))?;
        if !fits(least) {
            return Err(RemovalError::of_pass(
                least,
                0.0,
                "it is a face rather than an edge: choose fewer segments",
            ));
        }
        let (mut low, mut high) = (least, wanted);
        while high / low > 1.0 + 1e-6 {
            let middle = (low * high).sqrt();
            if fits(middle) {
                low = middle
            } else {
                high = middle
            }
        }
        Ok(low)
    }

    /// Returns the nodes of the coarsest level, which the growth does not leave.
    fn nodes(&mut self) -> Result<WorkNodes, RemovalError> {
        let radius = self.settings.workpiece.kind.edge_radius_m();
        let observed = match (self.removal.observed, observed_radii(&self.removal)) {
            (_, Some([_, largest])) => largest,
            (observed, None) => observed.map_or(0.0, |edge| edge.edge_radius_m),
        };
        let goal = self.goal.radius().unwrap_or(0.0).max(observed);
        let sharp = if goal > 0.0 {
            SHARP_RADIUS_M.min(SHARP_SHARE_OF_GOAL * goal)
        } else {
            SHARP_RADIUS_M
        };
        let least = radius.max(sharp);
        let mut largest = if goal > 0.0 {
            goal
        } else {
            RADIUS_FACTOR * least
        };
        // Filaments dip through an edge whose radius is below their penetration.
        let most = self.possible(least, largest)?;
        let new = WorkNodes::new([least, most], 0.0, LEVELS[1]);
        let mut least = self.passes.first_possible(&new)?;
        largest = largest.max(least);
        let most = self.largest_loss();
        let mut loss = 0.0;
        loop {
            let possible = self.possible(least, largest)?;
            if loss > 0.0 {
                // Shorter filaments strike elsewhere, and may dip through a larger edge.
                let worn = WorkNodes::new([least, possible], loss, LEVELS[1]);
                least = self.passes.first_possible(&worn)?;
            }
            let nodes = WorkNodes::new([least, possible], loss, LEVELS[0]);
            let growth = self.follow(None, &nodes)?;
            if growth.ended == Ended::Largest && possible == largest && self.goal.radius().is_none()
            {
                largest *= RADIUS_FACTOR;
                continue;
            }
            if self.removal.filament_wear_m2_n.is_some() {
                // The loss with new filaments, and half as much again: the first guess has no loss.
                let lost = match loss == 0.0 {
                    true => 1.5 * self.loss_of(&nodes, growth.end().turns),
                    false if growth.ended == Ended::Worn => 2.0 * loss,
                    false => 0.0,
                };
                if lost > loss && loss < most {
                    loss = lost.min(most);
                    continue;
                }
            }
            return Ok(nodes);
        }
    }

    /// Returns the length in m that new filaments lose in `turns` turns.
    fn loss_of(&self, nodes: &WorkNodes, turns: f64) -> f64 {
        let table = self.passes.table(None, nodes);
        let work = nodes
            .radii
            .iter()
            .map(|radius| table.at(*radius, 0.0).whole)
            .fold(0.0, f64::max);
        turns * work * Rates::new(self.settings, 0.0, 0.0, self.factors(), nodes).loss_per_work
    }

    /// Simulates missing passes at the nodes, and follows the growth of one tool, or of the mean of
    /// all.
    fn follow(&mut self, member: Option<usize>, nodes: &WorkNodes) -> Result<Growth, RemovalError> {
        self.passes.simulate(nodes)?;
        let table = self.passes.table(member, nodes);
        let count = member.map_or(self.settings.tool.filament_count, |member| {
            self.passes.count(member)
        });
        let rates = |preston: f64| Rates::new(self.settings, count, preston, self.factors(), nodes);
        let preston = match (self.removal.preston_m2_n, self.removal.observed) {
            (Some(preston), _) => preston,
            (None, Some(observed)) => self.preston_of(&table, observed, &rates)?,
            (None, None) => return Err(no_coefficient()),
        };
        let (stages, ended) = grow(&table, &rates(preston), self.goal);
        Ok(Growth {
            preston,
            stages,
            ended,
        })
    }

    /// Returns the Preston coefficient in m²/N with which an edge has the observed radius at the
    /// observed time.
    fn preston_of(
        &self,
        table: &WorkTable,
        observed: ObservedEdge,
        rates: &impl Fn(f64) -> Rates,
    ) -> Result<f64, RemovalError> {
        let ObservedEdge {
            edge_radius_m: goal,
            time_s,
            ..
        } = observed;
        let turns = time_s * self.settings.angular_velocity_rad_s() / TAU;
        // Without wear, the dose decides: these are the turns with a coefficient of one.
        let unit = Rates {
            loss_per_work: 0.0,
            ..rates(1.0)
        };
        let (stages, ended) = grow(table, &unit, End::Radius(goal));
        let growth = Growth {
            preston: 1.0,
            stages,
            ended,
        };
        if ended != Ended::Done {
            return Err(self.unreached(goal, &growth));
        }
        let mut preston = growth.end().turns / turns;
        if rates(1.0).loss_per_work == 0.0 {
            return Ok(preston);
        }
        // With wear, the radius rises with the coefficient.
        let radius = |preston: f64| {
            let (stages, _) = grow(table, &rates(preston), End::Turns(turns));
            stages[stages.len() - 1].larger()
        };
        let (mut low, mut high) = (preston, preston);
        for _ in 0..40 {
            if radius(high) >= goal {
                break;
            }
            (low, high) = (high, 2.0 * high);
        }
        for _ in 0..60 {
            preston = (low * high).sqrt();
            if radius(preston) >= goal {
                high = preston
            } else {
                low = preston
            }
        }
        Ok(preston)
    }

    fn unreached(&self, goal: f64, growth: &Growth) -> RemovalError {
        let last = growth.end();
        let why = match growth.ended {
            // Without a loss, filaments missed the edge from the start.
            Ended::Worn | Ended::Stopped if last.loss > 0.0 => {
                format!("then the filaments have lost {:.2e} m, and no longer reach the edge", last.loss)
            }
            Ended::Largest => "a rounder one does not fit the workpiece, or is a face for filaments of so many segments".to_owned(),
            _ => "filaments do no work on it there; check `workpiece.offset_m`, `workpiece.side` and the penetration depth".to_owned(),
        };
        let largest = last.larger();
        RemovalError::Failed(format!(
            "an edge radius of {goal:e} m is never reached; the largest is {largest:.3e} m: {why}"
        ))
    }

    fn conclude(
        &mut self,
        growth: &Growth,
        nodes: &WorkNodes,
        change: f64,
    ) -> Result<Removal, RemovalError> {
        let end = growth.end().turns;
        let table = self.passes.table(None, nodes);
        let (factors, least) = (self.factors(), nodes.radii[0]);
        let start: f64 = factors
            .iter()
            .map(|factor| factor * self.settings.workpiece.kind.edge_radius_m().powi(2))
            .sum();
        let second_per_turn = TAU / self.settings.angular_velocity_rad_s();
        let bands = self.bands(growth, nodes)?;
        let row = |i: usize| {
            let turns = if i == ROWS {
                end
            } else {
                end * (i as f64 / ROWS as f64).powi(2)
            };
            let Stage { radii, loss, .. } = stage_at(&growth.stages, turns);
            let [at_first, at_second] = radii.map(|radius| table.at(radius.max(least), loss));
            let area: f64 = (0..2).map(|edge| factors[edge] * radii[edge].powi(2)).sum();
            let larger = if radii[1] > radii[0] {
                at_second
            } else {
                at_first
            };
            let mut band: Vec<f64> = bands
                .iter()
                .map(|stages| stage_at(stages, turns).radii[0])
                .collect();
            band.sort_by(f64::total_cmp);
            let [lower, upper] = if band.is_empty() {
                [0.0; 2]
            } else {
                BAND.map(|share| quantile(&band, share))
            };
            RemovalRow {
                turns,
                time_s: turns * second_per_turn,
                edge_radius_m: radii[0],
                second_edge_radius_m: radii[1],
                edge_radius_lower_95_m: lower,
                edge_radius_upper_95_m: upper,
                removed_area_m2: (area - start).max(0.0),
                tool_contact_normal_force_n: larger.force,
                filament_length_m: self.settings.filament.length_m - loss,
                edge_sliding_work_j: at_first.edges[0] + at_second.edges[1],
                sliding_work_j: larger.whole,
            }
        };
        let rows = (0..=ROWS).map(row).collect();
        let life_s = self.life(nodes)?.map(|turns| turns * second_per_turn);
        Ok(Removal {
            rows,
            simulated: self.passes.simulated(),
            preston_m2_n: growth.preston,
            observed_interval: self.observed_interval(growth, nodes)?,
            angles_rad: self.angles.clone(),
            has_band: !bands.is_empty(),
            least_radius_m: least,
            change_when_refined: change,
            life_s,
        })
    }

    /// Returns the interval by the standard deviation of the observed radius; `None` without one.
    fn observed_interval(
        &self,
        growth: &Growth,
        nodes: &WorkNodes,
    ) -> Result<Option<ObservedInterval>, RemovalError> {
        let (Some(observed), Some([least, largest])) =
            (self.removal.observed, observed_radii(&self.removal))
        else {
            return Ok(None);
        };
        let table = self.passes.table(None, nodes);
        let count = self.settings.tool.filament_count;
        let rates = |preston: f64| Rates::new(self.settings, count, preston, self.factors(), nodes);
        let goal = growth.end().larger();
        let second_per_turn = TAU / self.settings.angular_velocity_rad_s();
        let mut interval = ObservedInterval {
            preston_m2_n: [0.0; 2],
            time_s: [0.0; 2],
        };
        // The larger the observed edge, the sooner another one is as large.
        for (end, edge_radius_m) in [least, largest].into_iter().enumerate() {
            let observed = ObservedEdge {
                edge_radius_m,
                ..observed
            };
            let preston = self.preston_of(&table, observed, &rates)?;
            let (stages, ended) = grow(&table, &rates(preston), End::Radius(goal));
            let growth = Growth {
                preston,
                stages,
                ended,
            };
            if growth.ended != Ended::Done {
                return Err(self.unreached(goal, &growth));
            }
            interval.preston_m2_n[end] = preston;
            interval.time_s[1 - end] = growth.end().turns * second_per_turn;
        }
        Ok(Some(interval))
    }

    /// Returns the growth by each sampled tool; empty if none is sampled.
    fn bands(
        &mut self,
        growth: &Growth,
        nodes: &WorkNodes,
    ) -> Result<Vec<Vec<Stage>>, RemovalError> {
        if self.passes.members() == 1 {
            return Ok(Vec::new());
        }
        let end = End::Turns(growth.end().turns);
        let all = (0..self.passes.members()).map(|member| {
            let table = self.passes.table(Some(member), nodes);
            let count = self.passes.count(member);
            let rates = Rates::new(self.settings, count, growth.preston, self.factors(), nodes);
            grow(&table, &rates.unlimited(), end).0
        });
        Ok(all.collect())
    }

    /// Returns the turns after which the force has fallen by `removal.force_loss`, on an edge of
    /// the largest simulated radius.
    fn life(&mut self, nodes: &WorkNodes) -> Result<Option<f64>, RemovalError> {
        if self.removal.filament_wear_m2_n.is_none() || self.settings.process.tool_force_n.is_some()
        {
            return Ok(None);
        }
        let radii = vec![nodes.radii[nodes.radii.len() - 1]];
        let WorkNodes { losses, .. } =
            WorkNodes::new([radii[0]; 2], self.largest_loss(), [2, LOSSES_OF_LIFE]);
        let own = WorkNodes { radii, losses };
        self.passes.simulate(&own)?;
        let table = self.passes.table(None, &own);
        let rates = Rates::new(self.settings, 0.0, 0.0, [0.0; 2], &own);
        let (stages, ended) = grow(&table, &rates, End::Force(1.0 - self.removal.force_loss));
        Ok((ended == Ended::Done).then(|| stages[stages.len() - 1].turns))
    }
}

/// Returns `true` if the workpiece has `count` edges, rather than faces.
fn has_edges(settings: &Settings, count: usize) -> bool {
    use bristle::workpiece::{Part, Workpiece};
    Part::of(settings).is_ok_and(|(part, _)| part.edges().len() == count)
}

/// Returns the largest relative change of the radius from a coarse to a fine growth, at the same
/// turns of both.
fn change_of(coarse: &Growth, fine: &Growth) -> f64 {
    const COMPARISONS: usize = 50;
    let end = fine.end().turns;
    let changes = (1..=COMPARISONS).map(|i| {
        let turns = end * (i as f64 / COMPARISONS as f64).powi(2);
        let [a, b] = [coarse, fine].map(|growth| stage_at(&growth.stages, turns).radii);
        (0..2)
            .map(|edge| {
                if b[edge] > 0.0 {
                    (a[edge] / b[edge] - 1.0).abs()
                } else {
                    0.0
                }
            })
            .fold(0.0, f64::max)
    });
    changes.fold(0.0, f64::max)
}
