//! What a brush has beyond the metrics of its tool: the effect of interaction, and the columns that it was taken from. What is checked
//! before a study of brushes begins.

use std::num::NonZeroUsize;

use bristle::brush::{BrushError, BrushResult, BrushStatistics, Stretch, check_brush};
use bristle::model::metrics::Metrics;
use bristle::model::record::{Column, Display, Prominence, Record, Scope};
use bristle::model::settings::Settings;
use bristle::simulation::Statistics;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{CaseResult, Study, thread_count};
use bristle_text::layout::warning;

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
        let needed = check_brush(&study.settings(case), memory);
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

/// The metrics of a contact that a brush does not have. How a lone filament answers a tilt of its clamp says little about one that others
/// push and hold; and a brush has a balance of its own.
pub const NOT_OF_BRUSHES: &[&str] = &["lateral_amplification", "laterally_unstable", "energy_residual"];

/// The metrics of a contact that results have: those of brushes, or of single filaments.
pub fn metric_columns(of_brushes: bool) -> impl Iterator<Item = &'static Column<Metrics>> {
    Metrics::COLUMNS.iter().filter(move |column| !of_brushes || !NOT_OF_BRUSHES.contains(&column.key))
}

/// Drawn in figures whose file names start with `file_name`, and shown in the tables of a terminal.
const fn headline(file_name: &'static str, unit: &'static str, scope: Scope) -> Display {
    Display { prominence: Prominence::Headline, file_name, unit, scope, ..Display::DETAIL }
}

bristle::record! {
    /// A brush compared with one filament alone, and the stretch of columns from which its metrics were taken.
    #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
    pub struct Interaction {
        interaction_factor: f64 =
            ["", "", "interaction factor", "p_n in the brush over that of one filament alone, zero if that is zero"]
            => headline("interaction_factor", "", Scope::Filament),
        contact_normal_impulse_alone_n_s: f64 =
            ["", "N s", "contact normal impulse of a filament alone", "p_n without interaction"],
        tool_contact_normal_force_alone_n: f64 = [
            "F_n,w alone", "N", "contact normal force of the tool without interaction",
            "p_n of one filament alone times N_f ω/(2π)"
        ] => headline("tool_force_alone", "N", Scope::Tool),
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
            "largest change of p_n of a turn of one filament by itself, from its error-controlled pass to the steps of the brush, over it"
        ],
        energy_residual: f64 = [
            "", "", "residual of the energy",
            "energy that is lacking in the balance of the brush, over that which was put in and taken"
        ],
        momentum_residual: f64 = [
            "", "", "residual of the momentum",
            "momentum that is lacking in the balance of the brush, over that of the filaments and the impulse of the workpiece on them"
        ],
        overlap_at_start_m: f64 = [
            "", "m", "overlap of filaments before they move",
            "largest depth; they are pushed apart, which is not part of the process"
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
            overlap_at_start_m: result.overlap_m,
            krylov_vectors: result.statistics.effort.krylov_vectors,
        }
    }
}

/// The warnings about one brush, for a terminal 80 columns wide.
#[must_use]
pub fn brush_warnings(settings: &Settings, interaction: &Interaction) -> Vec<String> {
    let tolerance = settings.brush_or_default().tolerance;
    let Interaction { step_error, overlap_at_start_m: overlap, .. } = *interaction;
    let mut warnings = Vec::new();
    if is_coarse(settings, interaction) {
        warnings.push(warning(&format!(
            "the steps are too long: with them, p_n of one filament by itself is off by {step_error:.1e}, more than `brush.tolerance` = \
             {tolerance:e}. Forces of the brush may be off by as much or more."
        )));
    }
    if overlap > 0.0 {
        warnings.push(warning(&format!(
            "filaments overlap by up to {:.2} µm before they move, because of their tilts or shapes, and are pushed apart. Filaments \
             farther apart, or smaller tilts (`brush.lateral_tilt_std_rad`), avoid that.",
            1e6 * overlap
        )));
    }
    warnings
}

/// Whether the steps of a brush miss its tolerance.
fn is_coarse(settings: &Settings, interaction: &Interaction) -> bool {
    interaction.step_error > settings.brush_or_default().tolerance
}

/// The warnings about the brushes of a study, for a terminal 80 columns wide.
#[must_use]
pub fn study_warnings(study: &Study, results: &[CaseResult]) -> Vec<String> {
    let interactions = || {
        let of_case = |(case, result): (usize, &CaseResult)| Some((case, result.as_ref().ok()?.brush.clone()?));
        results.iter().enumerate().filter_map(of_case)
    };
    let largest = |of: &dyn Fn(&Interaction) -> f64, is_one: &dyn Fn(usize, &Interaction) -> bool| {
        let cases: Vec<(usize, f64)> =
            interactions().filter(|(case, each)| is_one(*case, each)).map(|(case, each)| (case, of(&each))).collect();
        // Of equal ones the first.
        let worst = cases.iter().rev().max_by(|a, b| a.1.total_cmp(&b.1)).copied();
        worst.map(|(case, value)| (cases.len(), case + 1, value))
    };
    let coarse = largest(&|each| each.step_error, &|case, each| is_coarse(&study.settings(case), each));
    let overlapping = largest(&|each| each.overlap_at_start_m, &|_, each| each.overlap_at_start_m > 0.0);
    let total = results.len();
    let coarse = coarse.map(|(count, row, error)| {
        warning(&format!(
            "in {count} of {total} brushes the steps are too long for `brush.tolerance`: p_n of one filament by itself is off by up to \
             {error:.1e} (row {row} of runs.csv)."
        ))
    });
    let overlapping = overlapping.map(|(count, row, overlap)| {
        warning(&format!(
            "in {count} of {total} brushes filaments overlap before they move, by up to {:.2} µm (row {row} of runs.csv), and are pushed \
             apart.",
            1e6 * overlap
        ))
    });
    coarse.into_iter().chain(overlapping).collect()
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
