//! What a brush has beyond the metrics of its tool: the effect of interaction, and the columns that it was taken from. What is checked
//! before a study of brushes begins.

use std::num::NonZeroUsize;

use bristle::brush::{BrushError, BrushResult, BrushStatistics, Stretch, check_brush};
use bristle::model::metrics::{BETWEEN_SWEEPING_AND_STRIKING, Metrics, RemovalLaw};
use bristle::model::record::{Column, Display, Level, Needs, Prominence, Record, Scope};
use bristle::model::settings::{Settings, UncertaintySettings, WorkpieceKind};
use bristle::simulation::Statistics;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::uncertainty::{ForceScatter, check};
use crate::{Study, run_study, tentative, thread_count};

/// Why a study of brushes is not begun.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum BrushStudyError {
    /// The brush of one case cannot be simulated.
    #[error("case {} of the study: {error}", .case + 1)]
    Case {
        /// Number of the case, counted from 0.
        case: usize,
        /// What is wrong with it.
        error: BrushError,
    },
    /// The cases that are simulated at once need more memory than they may.
    #[error(
        "{threads} cases at once need up to {} MB of memory, case {} the most, but {} MB are available: choose fewer `--threads`, \
         `brush.columns`, `brush.rows` or `filament.segments`",
        .needed.div_ceil(1_000_000), .case + 1, .limit / 1_000_000
    )]
    Memory {
        /// Number of cases that are simulated at once.
        threads: usize,
        /// Bytes that they need, if they are those that need the most.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
        /// Number of the case that needs the most, counted from 0.
        case: usize,
    },
}

/// Checks that the filaments of each case can be arranged, before any of them is simulated, and that the cases which so many `threads`
/// simulate at once need at most `memory` (bytes) together.
///
/// # Errors
/// The first case that cannot be simulated; or else the memory.
pub fn check_brushes(study: &Study, threads: Option<NonZeroUsize>, memory: Option<u64>) -> Result<(), BrushStudyError> {
    let needs = (0..study.case_count()).map(|case| {
        let needed = match (study.brush_memory(case), memory) {
            // The error says what is too large.
            (Ok(needed), Some(limit)) if needed > limit => check_brush(&tentative(study.settings(case)), memory),
            (needed, _) => needed,
        };
        needed.map(|needed| (needed, case)).map_err(|error| BrushStudyError::Case { case, error })
    });
    let mut needs = needs.collect::<Result<Vec<(u64, usize)>, _>>()?;
    needs.sort_unstable();
    let at_once = &needs[needs.len().saturating_sub(thread_count(threads))..];
    let needed = at_once.iter().fold(0_u64, |sum, (needed, _)| sum.saturating_add(*needed));
    match (memory, at_once) {
        (Some(limit), [.., (_, case)]) if needed > limit => {
            Err(BrushStudyError::Memory { threads: at_once.len(), needed, limit, case: *case })
        }
        _ => Ok(()),
    }
}

/// What results have, by which tables leave out the metrics that they do not have.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Having {
    /// Whether they are those of brushes, rather than of single filaments.
    pub brush: bool,
    /// Whether the depth was found for a given force.
    pub force: bool,
    /// Whether the workpiece has edges.
    pub edge: bool,
    /// What is known of removal.
    pub removal: RemovalLaw,
}

impl Having {
    /// The results of one contact or brush.
    #[must_use]
    pub fn of(settings: &Settings) -> Self {
        Self {
            brush: settings.brush.is_some(),
            force: settings.process.tool_force_n.is_some(),
            edge: matches!(settings.workpiece.kind, WorkpieceKind::Edge | WorkpieceKind::Chamfer),
            removal: RemovalLaw::of(settings),
        }
    }

    /// The results of a study: what some case has.
    #[must_use]
    pub fn of_study(study: &Study) -> Self {
        let having =
            study.each_tool_at_its_ends().map(|settings| Self::of(&settings)).fold(Self::default(), |all, one| {
                let (all_of, RemovalLaw { preston, wear, area_rate }) = (all.removal, one.removal);
                let removal = RemovalLaw {
                    preston: all_of.preston.or(preston),
                    wear: all_of.wear.or(wear),
                    area_rate: all_of.area_rate.or(area_rate),
                };
                Self { edge: all.edge || one.edge, removal, ..all }
            });
        Self { brush: study.has_brush(), force: study.is_pressed_on(), ..having }
    }

    /// Whether the results have what a metric needs.
    fn has(&self, needs: Needs) -> bool {
        let RemovalLaw { preston, wear, area_rate } = self.removal;
        match needs {
            Needs::Nothing => true,
            // How a lone filament answers a tilt of its clamp says little about one that others push and hold; and a brush has a
            // balance of its own.
            Needs::OneFilament => !self.brush,
            Needs::GivenForce => self.force,
            Needs::Edge => self.edge,
            Needs::Removal => preston.is_some(),
            Needs::RemovalFromPlane => preston.is_some() && area_rate.is_some(),
            Needs::RemovalAndWear => preston.is_some() && wear.is_some(),
        }
    }
}

/// The metrics of a contact that tables of such results have.
pub fn metric_columns(having: Having) -> impl Iterator<Item = &'static Column<Metrics>> + Clone {
    Metrics::COLUMNS.iter().filter(move |column| having.has(column.display.needs))
}

/// The metrics that each filament of a brush has.
pub fn filament_columns() -> impl Iterator<Item = &'static Column<Metrics>> + Clone {
    metric_columns(Having { brush: true, edge: true, ..Having::default() })
}

/// Drawn in figures whose file names start with `file_name`, and shown in the tables of a terminal.
const fn headline(file_name: &'static str, unit: &'static str, scope: Scope) -> Display {
    Display { prominence: Prominence::Headline, file_name, unit, scope, ..Display::DETAIL }
}

/// The line between interaction that raises the force and that lowers it.
const NO_EFFECT: Level = Level {
    of: "interaction_factor",
    value: 1.0,
    meaning: "line: 1, above which interaction raises the force",
    in_curves: "",
};

bristle::record! {
    /// A brush compared with one filament alone, and the stretch of columns from which its metrics were taken.
    #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
    pub struct Interaction {
        interaction_factor: f64 =
            ["", "", "interaction factor", "p_n in the brush over that of one filament alone, zero if that is zero"]
            => Display { level: Some(NO_EFFECT), ..headline("interaction_factor", "", Scope::Filament) },
        contact_normal_impulse_alone_n_s: f64 =
            ["", "N s", "contact normal impulse of a filament alone", "p_n without interaction"],
        tool_contact_normal_force_alone_n: f64 = [
            "F_n,w alone", "N", "contact normal force of the tool without interaction",
            "p_n of one filament alone times N_f ω/(2π)"
        ] => Display {
            level: Some(BETWEEN_SWEEPING_AND_STRIKING),
            ..headline("tool_force_alone", "N", Scope::Tool)
        },
        columns: usize = ["", "", "columns", "filaments of a row, one behind the other around the tool"],
        rows: usize = ["", "", "rows", "rows of filaments along the axis"],
        first_counted_column: usize = ["", "", "first column that counts", "column 0 meets the workpiece first"],
        last_counted_column: usize =
            ["", "", "last column that counts", "the metrics are means over the filaments from the first to the last"],
        impulse_scatter: f64 = [
            "", "", "scatter of the impulse",
            "standard deviation of p_n over the filaments that count, over the mean"
        ],
        impulse_drift: f64 = [
            "", "", "drift of the impulse",
            "by how much the mean p_n of the first half of the columns that count differs from that of the last, over the mean"
        ],
        impulse_change_with_more_columns: f64 = [
            "", "", "change of the impulse with 25 % more columns",
            "estimate of how much the mean p_n would change, over the mean"
        ],
        step_error: f64 = [
            "", "", "error of the steps",
            "largest change of p_n of a turn of one filament by itself, from its error-controlled pass to the steps of the brush, over it. For several filaments also what halved steps change in the mean p_n of a turn, or would change if single filaments changed with random signs; the largest of these"
        ],
        energy_residual: f64 = [
            "", "", "residual of the energy",
            "energy that is lacking in the balance of the brush, over that which was put in and taken"
        ],
        momentum_residual: f64 = [
            "", "", "residual of the momentum",
            "momentum that is lacking in the balance of the brush, over that of the filaments and the impulse of the workpiece on them"
        ],
        krylov_vectors: usize =
            ["", "", "vectors of the linear solutions", "iterations of the generalised minimal residual method"],
    }
}

impl Interaction {
    /// That of a brush.
    #[must_use]
    pub fn of(result: &BrushResult) -> Self {
        let Stretch { first, last, scatter, drift, change_with_more_columns } = result.stretch;
        Self {
            interaction_factor: result.interaction_factor,
            contact_normal_impulse_alone_n_s: result.alone.contact_normal_impulse_n_s,
            tool_contact_normal_force_alone_n: result.alone.tool_contact_normal_force_n,
            columns: result.columns,
            rows: result.rows,
            first_counted_column: first,
            last_counted_column: last,
            impulse_scatter: scatter,
            impulse_drift: drift,
            impulse_change_with_more_columns: change_with_more_columns,
            step_error: result.step_error,
            energy_residual: result.residuals.energy,
            momentum_residual: result.residuals.momentum,
            krylov_vectors: result.statistics.effort.krylov_vectors,
        }
    }
}

/// The distribution that a calibration leaves of the force of a brush with the metrics `tool`: that of a filament alone, times the effect
/// of interaction. `None` if nothing is calibrated, or it cannot be sampled.
#[must_use]
pub fn calibration_band(settings: &Settings, tool: &Metrics) -> Option<ForceScatter> {
    let calibration = Some(settings.uncertainty.calibration.clone()?);
    let UncertaintySettings { samples, seed, .. } = settings.uncertainty;
    let uncertainty = UncertaintySettings { samples, seed, calibration, ..UncertaintySettings::default() };
    let alone = Settings { brush: None, uncertainty, ..settings.clone() };
    check(&alone).ok()?;
    let study = Study::of_cases(vec![alone]);
    let result = run_study(&study, NonZeroUsize::new(1), || ()).ok()?.pop()?.ok()?;
    let factor = tool.tool_contact_normal_force_n / result.metrics.tool_contact_normal_force_n;
    Some(result.scatter?.times(factor)).filter(|_| factor.is_finite())
}

/// The mean impulse of each turn of a brush, in N s. A single pass is one turn.
#[must_use]
pub fn turn_impulses(result: &BrushResult) -> Vec<f64> {
    match &result.turn_contact_normal_impulses_n_s[..] {
        [] => vec![result.tool.contact_normal_impulse_n_s],
        impulses => impulses.to_vec(),
    }
}

/// The work of a brush as that of one simulation. Its steps are repeated where Newton's method fails.
#[must_use]
pub fn statistics(brush: &BrushStatistics) -> Statistics {
    Statistics {
        steps: brush.steps,
        newton_failures: brush.halved_steps,
        newton_iterations: brush.effort.newton_iterations,
        ..Statistics::default()
    }
}
