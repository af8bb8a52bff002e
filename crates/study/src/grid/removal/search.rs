//! The search for passes that suffice, and the result that follows from them.

use std::f64::consts::TAU;

use bristle::model::settings::{ObservedEdge, RemovalSettings, Settings};

use super::error::RemovalError;
use super::growth::{End, Ended, Rates, Stage, area_factor, grow, stage_at};
use super::table::{Passes, WorkNodes, WorkTable};
use super::{ObservedInterval, Removal, RemovalRow, no_coefficient, observed_radii};
use crate::grid::uncertainty::{BAND, quantile};

/// Relative change of the radius below which no more radii are simulated (MODEL).
pub(super) const MAX_RADIUS_CHANGE: f64 = 5e-3;
/// Numbers of radii and of losses of length, finer from level to level.
const LEVELS: [[usize; 2]; 4] = [[5, 3], [9, 5], [17, 9], [33, 17]];
/// Radius in m of an edge that is as good as sharp: smaller edges have the work of this one.
pub(super) const SHARP_RADIUS_M: f64 = 10e-6;
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
pub(super) struct GrowthSearch<'a> {
    pub(super) settings: &'a Settings,
    pub(super) removal: RemovalSettings,
    pub(super) angles: Vec<f64>,
    pub(super) goal: End,
    pub(super) passes: Passes<'a>,
}

/// Growth computed from simulated passes.
pub(super) struct Growth {
    pub(super) preston: f64,
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
    pub(super) fn refined(&mut self) -> Result<(Growth, WorkNodes, f64), RemovalError> {
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
    pub(super) fn factors(&self) -> [f64; 2] {
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

    pub(super) fn conclude(
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
