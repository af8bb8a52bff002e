//! Growth of edges and wear of filaments, turn by turn.

use bristle::model::filament::cross_section;
use bristle::model::settings::Settings;

use super::table::{WorkNodes, WorkTable};

/// Largest growth of an area in a step, over the area plus a tenth of the least one.
const MAX_AREA_GROWTH: f64 = 0.02;
/// Largest loss of length in a step, over the largest loss of the table.
const MAX_LOSS_SHARE: f64 = 0.005;
/// Growth rate, over the fastest one so far, below which an edge no longer grows.
const NEGLIGIBLE_RATE: f64 = 1e-9;
/// Largest number of steps.
const MAX_STEPS: usize = 100_000;

/// Returns `c` of the area `A(R) = c R²` that rounding a corner of the included angle `angle` (rad)
/// to the radius `R` removes.
pub fn area_factor(angle: f64) -> f64 {
    1.0 / (angle / 2.0).tan() - (std::f64::consts::PI - angle) / 2.0
}

/// Corners and filaments at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage {
    /// Turns of the tool.
    pub turns: f64,
    /// Radius of each edge in m.
    pub radii: [f64; 2],
    /// Loss of length of the filaments in m.
    pub loss: f64,
}

impl Stage {
    /// Returns the radius of the larger edge in m.
    pub fn larger(&self) -> f64 {
        self.radii[0].max(self.radii[1])
    }
}

/// Condition that ends the growth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// Radius of the larger edge in m.
    Radius(f64),
    /// Number of turns.
    Turns(f64),
    /// Force over that at the start; or else the loss of all that can be lost.
    Force(f64),
}

impl End {
    /// Returns the radius at which the growth ends, if it ends at one.
    pub fn radius(self) -> Option<f64> {
        if let Self::Radius(radius) = self {
            Some(radius)
        } else {
            None
        }
    }
}

/// Reason why the growth ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// The condition is met.
    Done,
    /// Nothing grows any more.
    Stopped,
    /// The filaments have lost all that the table covers.
    Worn,
    /// The larger edge exceeds the largest radius of the table.
    Largest,
}

/// Coefficients of the growth besides the work of passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// `c` of each edge; zero for an edge that is absent.
    pub factors: [f64; 2],
    /// Radius of the edges at the start in m.
    pub radius: f64,
    /// Area that a turn takes from an edge per work of a pass, `k_P N_f/b`, in m²/J.
    pub area_per_work: f64,
    /// Length that a pass takes from a filament per work, `k_w/(π d²/4)`, in m/J.
    pub loss_per_work: f64,
    /// Largest loss and the largest radius of the table in m.
    pub largest: [f64; 2],
    /// Radius in m below which work does not change.
    pub least_radius: f64,
}

impl Rates {
    /// Returns the rates of a tool with `count` filaments and this `preston` coefficient (m²/N).
    pub fn new(
        settings: &Settings,
        count: f64,
        preston: f64,
        factors: [f64; 2],
        nodes: &WorkNodes,
    ) -> Self {
        let wear = settings
            .removal_or_default()
            .filament_wear_m2_n
            .unwrap_or(0.0);
        Self {
            factors,
            radius: settings.workpiece.kind.edge_radius_m(),
            area_per_work: preston * count / settings.tool.width_m,
            loss_per_work: wear / cross_section(settings.filament.tip_diameter_m()),
            largest: [
                nodes.losses[nodes.losses.len() - 1],
                nodes.radii[nodes.radii.len() - 1],
            ],
            least_radius: nodes.radii[0],
        }
    }

    /// Returns the rates for edges that may grow beyond the table, where work is that at its end.
    pub fn unlimited(self) -> Self {
        let [loss, _] = self.largest;
        Self {
            largest: [loss, f64::INFINITY],
            ..self
        }
    }

    fn radii(&self, areas: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|edge| {
            if self.factors[edge] > 0.0 {
                (areas[edge] / self.factors[edge]).sqrt()
            } else {
                0.0
            }
        })
    }
}

/// Integrates areas and loss by the work in `table` until `end`, by the classical Runge–Kutta
/// method of order 4: their rates hardly change. Returns the stages, from the start on.
pub fn grow(table: &WorkTable, rates: &Rates, end: End) -> (Vec<Stage>, Ended) {
    let areas = rates
        .factors
        .map(|factor| factor * rates.radius * rates.radius);
    let mut state = [areas[0], areas[1], 0.0];
    let stage = |turns: f64, [first, second, loss]: [f64; 3]| Stage {
        turns,
        radii: rates.radii([first, second]),
        loss,
    };
    let mut stages = vec![stage(0.0, state)];
    let rate = |[first, second, loss]: [f64; 3]| {
        let radii = rates.radii([first.max(0.0), second.max(0.0)]);
        let grown = |edge: usize| match rates.factors[edge] > 0.0 {
            true => {
                rates.area_per_work
                    * table
                        .edge(edge, radii[edge].max(rates.least_radius), loss)
                        .max(0.0)
            }
            false => 0.0,
        };
        let worn = if rates.loss_per_work > 0.0 {
            rates.loss_per_work
                * table
                    .at(radii[0].max(radii[1]).max(rates.least_radius), loss)
                    .whole
                    .max(0.0)
        } else {
            0.0
        };
        [grown(0), grown(1), worn]
    };
    let force = |stage: &Stage| {
        table
            .at(stage.larger().max(rates.least_radius), stage.loss)
            .force
    };
    let (first_force, least_area) = (
        force(&stages[0]),
        rates
            .factors
            .map(|factor| factor * rates.least_radius.powi(2)),
    );
    let mut fastest = 0.0_f64;
    for _ in 0..MAX_STEPS {
        let last = stages[stages.len() - 1];
        let now = rate(state);
        fastest = fastest.max(now[0]).max(now[1]);
        let [largest_loss, largest_radius] = rates.largest;
        let is_growing = now[..2]
            .iter()
            .any(|rate| *rate > NEGLIGIBLE_RATE * fastest);
        // Turns until an area or the loss has changed by its limit.
        let mut step = f64::INFINITY;
        for edge in 0..2 {
            if now[edge] > 0.0 {
                step =
                    step.min(MAX_AREA_GROWTH * (state[edge] + 0.1 * least_area[edge]) / now[edge]);
            }
        }
        if now[2] > 0.0 && largest_loss > 0.0 {
            step = step.min(MAX_LOSS_SHARE * largest_loss / now[2]);
        }
        let ended = match end {
            End::Turns(turns) if last.turns >= turns => Some(Ended::Done),
            End::Radius(goal) if last.larger() >= goal => Some(Ended::Done),
            End::Force(part) if force(&last) <= part * first_force => Some(Ended::Done),
            End::Radius(_) if !is_growing => Some(Ended::Stopped),
            _ if largest_loss > 0.0 && last.loss >= largest_loss * (1.0 - 1e-12) => {
                Some(Ended::Worn)
            }
            End::Turns(_) | End::Radius(_) if last.larger() > largest_radius => {
                Some(Ended::Largest)
            }
            End::Force(_) if now[2] <= 0.0 => Some(Ended::Stopped),
            _ => None,
        };
        if let Some(ended) = ended {
            return (stages, ended);
        }
        if let End::Turns(turns) = end {
            step = step.min(turns - last.turns);
        }
        let mut next = advance(&rate, state, now, step);
        let reaches = |next: [f64; 3]| match end {
            End::Radius(goal) => stage(last.turns, next).larger() >= goal,
            End::Force(part) => force(&stage(last.turns + step, next)) <= part * first_force,
            End::Turns(_) => false,
        };
        if reaches(next) {
            let (mut low, mut high) = (0.0, step);
            for _ in 0..60 {
                let middle = (low + high) / 2.0;
                if reaches(advance(&rate, state, now, middle)) {
                    high = middle
                } else {
                    low = middle
                }
            }
            step = high;
            next = advance(&rate, state, now, step);
        }
        state = next;
        stages.push(stage(last.turns + step, state));
    }
    (stages, Ended::Stopped)
}

/// Returns the state after a step of `step` turns.
fn advance(
    rate: &impl Fn([f64; 3]) -> [f64; 3],
    state: [f64; 3],
    now: [f64; 3],
    step: f64,
) -> [f64; 3] {
    let moved =
        |rate: [f64; 3], part: f64| std::array::from_fn(|i| state[i] + part * step * rate[i]);
    let second = rate(moved(now, 0.5));
    let third = rate(moved(second, 0.5));
    let fourth = rate(moved(third, 1.0));
    std::array::from_fn(|i| {
        state[i] + step / 6.0 * (now[i] + 2.0 * second[i] + 2.0 * third[i] + fourth[i])
    })
}

/// Interpolates the stage after `turns`: areas and losses are linear between stages.
pub fn stage_at(stages: &[Stage], turns: f64) -> Stage {
    let after = stages.partition_point(|stage| stage.turns <= turns);
    let (Some(right), Some(left)) = (
        stages.get(after),
        after.checked_sub(1).map(|before| &stages[before]),
    ) else {
        return stages[after.saturating_sub(1).min(stages.len() - 1)];
    };
    let share = (turns - left.turns) / (right.turns - left.turns);
    let between = |a: f64, b: f64| a + share * (b - a);
    let radius = |edge: usize| between(left.radii[edge].powi(2), right.radii[edge].powi(2)).sqrt();
    Stage {
        turns,
        radii: [radius(0), radius(1)],
        loss: between(left.loss, right.loss),
    }
}

#[cfg(test)]
mod tests {

    use serde::Deserialize;

    use super::super::curve::MonotoneCubic;
    use super::*;

    /// Edges that grow by a given work, from SciPy: `derivations/reference_removal.py`.
    #[derive(Deserialize)]
    struct Reference {
        cases: Vec<ReferenceCase>,
        constants: Constants,
        work_on_edge: WorkOnEdge,
    }

    #[derive(Deserialize)]
    struct ReferenceCase {
        included_angle_rad: f64,
        area_over_square: f64,
        turns: Vec<f64>,
        radii_m: Vec<f64>,
    }

    #[derive(Deserialize)]
    struct Constants {
        preston_m2_n: f64,
        filament_count: f64,
        width_m: f64,
        start_radius_m: f64,
    }

    #[derive(Deserialize)]
    struct WorkOnEdge {
        work_j: f64,
        radius_m: f64,
        slope: f64,
        bend: f64,
    }

    /// Rates without growth or wear.
    const RATES: Rates = Rates {
        factors: [0.0; 2],
        radius: 0.0,
        area_per_work: 0.0,
        loss_per_work: 0.0,
        largest: [0.0, 1.0],
        least_radius: 1e-5,
    };

    #[test]
    fn edges_grow_as_an_integrator_of_scipy_says() {
        let text = include_str!("../../../../../tests/data/reference_removal.json");
        let Reference {
            cases,
            constants,
            work_on_edge: own,
        } = serde_json::from_str(text).expect("the reference");
        let work = |radius: f64| {
            let x = (radius / own.radius_m).ln();
            own.work_j * (own.slope * x + own.bend * x * x).exp()
        };
        let radii: Vec<f64> = (0..=200)
            .map(|i| 1e-5 * 1e3_f64.powf(f64::from(i) / 200.0))
            .collect();
        let table = WorkTable::of_work(&radii, work);
        assert_eq!(cases.len(), 5);
        for case in cases {
            let factor = area_factor(case.included_angle_rad);
            assert!(
                (factor / case.area_over_square - 1.0).abs() < 1e-10,
                "{factor} {}",
                case.area_over_square
            );
            let rates = Rates {
                factors: [factor, 0.0],
                radius: constants.start_radius_m,
                area_per_work: constants.preston_m2_n * constants.filament_count
                    / constants.width_m,
                ..RATES
            };
            for (turns, expected) in case.turns.iter().zip(&case.radii_m) {
                let (stages, ended) = grow(&table, &rates, End::Turns(*turns));
                let [radius, _] = stages[stages.len() - 1].radii;
                assert!(
                    ended == Ended::Done && (radius / expected - 1.0).abs() < 2e-5,
                    "{radius} {expected}"
                );
                // The inverse: the turns until that radius.
                let (stages, _) = grow(&table, &rates, End::Radius(*expected));
                let found = stages[stages.len() - 1].turns;
                assert!((found / turns - 1.0).abs() < 1e-4, "{found} {turns}");
            }
        }
    }

    #[test]
    fn constant_work_makes_the_square_of_the_radius_grow_evenly() {
        let table = WorkTable::of_work(&[1e-5, 1e-2], |_| 1e-4);
        let rates = Rates {
            factors: [0.25, 0.0],
            area_per_work: 1e-7,
            ..RATES
        };
        let (stages, _) = grow(&table, &rates, End::Turns(1e3));
        for stage in &stages {
            let expected = (1e-11 * stage.turns / 0.25).sqrt();
            assert!(
                (stage.radii[0] - expected).abs() <= 1e-12 * expected,
                "{stage:?}"
            );
        }
        let middle = stage_at(&stages, 500.0).radii[0];
        assert!((middle / (1e-11 * 500.0 / 0.25_f64).sqrt() - 1.0).abs() < 1e-12);
        let (stages, ended) = grow(
            &WorkTable::of_work(&[1e-5, 1e-2], |_| 0.0),
            &rates,
            End::Radius(1e-4),
        );
        assert!(ended == Ended::Stopped && stages.len() == 1);
    }

    #[test]
    fn filaments_wear_by_their_work() {
        let curves = |work: f64| {
            [0.0, 0.0, work, 10.0].map(|value| MonotoneCubic::through(vec![0.0], vec![value]))
        };
        // Work that falls in proportion to the loss decays exponentially.
        let table = WorkTable::of_rows(vec![0.0, 1e-3], vec![curves(1e-3), curves(0.0)]);
        let rates = Rates {
            radius: 1e-4,
            loss_per_work: 1e-3,
            largest: [1e-3, 1.0],
            least_radius: 1e-4,
            ..RATES
        };
        let (stages, _) = grow(&table, &rates, End::Turns(2e3));
        let last = stages[stages.len() - 1];
        assert!(
            (last.loss / (1e-3 * (1.0 - (-2.0_f64).exp())) - 1.0).abs() < 1e-6,
            "{last:?}"
        );
    }
}
