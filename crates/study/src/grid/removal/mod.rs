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
use crate::grid::uncertainty::BAND;

mod course;
mod curve;
mod error;
mod growth;
mod search;
mod table;

pub use course::Course;
pub use error::RemovalError;
pub use growth::area_factor;
pub use table::SimulatedEdge;

use growth::End;
use search::{GrowthSearch, MAX_RADIUS_CHANGE, SHARP_RADIUS_M};
use table::Passes;

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
