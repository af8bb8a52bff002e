//! Checks before a study of brushes begins, and the metrics that results have. An
//! [`Interaction`](crate::grid::Interaction) has further figures of a brush.

use std::num::NonZeroUsize;

use bristle::brush::check_brush;
use bristle::model::metrics::{Metrics, RemovalLaw};
use bristle::model::record::{Column, Needs, Record};
use bristle::model::settings::{Settings, WorkpieceKind};
use thiserror::Error;

use crate::grid::case::tentative;
use crate::grid::scheduler::thread_count;
use crate::grid::study::Study;

/// Reason why a study of brushes is not begun, in words.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{0}")]
pub struct BrushStudyError(String);

/// Checks that the filaments of each case can be arranged, before any case is simulated. Cases that
/// `threads` simulate at once may need at most `memory` (bytes) together.
///
/// # Errors
/// The first case that cannot be simulated; or else the memory.
pub fn check_brushes(
    study: &Study,
    threads: Option<NonZeroUsize>,
    memory: Option<u64>,
) -> Result<(), BrushStudyError> {
    let needs = (0..study.case_count()).map(|case| {
        let needed = match (study.brush_memory(case), memory) {
            // The error says what is too large.
            (Ok(needed), Some(limit)) if needed > limit => {
                check_brush(&tentative(study.settings(case)), memory)
            }
            (needed, _) => needed,
        };
        let wrong = |error| BrushStudyError(format!("case {} of the study: {error}", case + 1));
        needed.map(|needed| (needed, case)).map_err(wrong)
    });
    let mut needs = needs.collect::<Result<Vec<(u64, usize)>, _>>()?;
    needs.sort_unstable();
    let at_once = &needs[needs.len().saturating_sub(thread_count(threads))..];
    let needed = at_once
        .iter()
        .fold(0_u64, |sum, (needed, _)| sum.saturating_add(*needed));
    match (memory, at_once) {
        (Some(limit), [.., (_, case)]) if needed > limit => Err(BrushStudyError(format!(
            "{} cases at once need up to {} MB of memory, case {} the most, but {} MB may be used: choose fewer `--threads`, \
             `brush.columns`, `brush.rows` or `filament.segments`",
            at_once.len(),
            needed.div_ceil(1_000_000),
            case + 1,
            limit / 1_000_000
        ))),
        _ => Ok(()),
    }
}

/// Properties of results, by which tables leave out the metrics that results do not have.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Having {
    /// `true` if the results are those of brushes, rather than of single filaments.
    pub brush: bool,
    /// `true` if the depth was found for a given force.
    pub force: bool,
    /// `true` if the workpiece has edges.
    pub edge: bool,
    /// Known coefficients of removal.
    pub removal: RemovalLaw,
}

impl Having {
    /// Returns the properties of one contact or brush.
    #[must_use]
    pub fn of(settings: &Settings) -> Self {
        Self {
            brush: settings.brush.is_some(),
            force: settings.process.tool_force_n.is_some(),
            edge: matches!(
                settings.workpiece.kind,
                WorkpieceKind::Edge(_) | WorkpieceKind::Chamfer(_)
            ),
            removal: RemovalLaw::of(settings),
        }
    }

    /// Returns the properties that some case of a study has.
    #[must_use]
    pub fn of_study(study: &Study) -> Self {
        let having = study
            .each_tool_at_its_ends()
            .map(|settings| Self::of(&settings))
            .fold(Self::default(), |all, one| {
                let (
                    all_of,
                    RemovalLaw {
                        preston,
                        wear,
                        area_rate,
                    },
                ) = (all.removal, one.removal);
                let removal = RemovalLaw {
                    preston: all_of.preston.or(preston),
                    wear: all_of.wear.or(wear),
                    area_rate: all_of.area_rate.or(area_rate),
                };
                Self {
                    edge: all.edge || one.edge,
                    removal,
                    ..all
                }
            });
        Self {
            brush: study.has_brush(),
            force: study.is_pressed_on(),
            ..having
        }
    }

    /// Returns `true` if the results have what a metric needs.
    fn has(&self, needs: Needs) -> bool {
        let RemovalLaw {
            preston,
            wear,
            area_rate,
        } = self.removal;
        match needs {
            Needs::Nothing => true,
            // The response of a lone filament to a tilt of its clamp says little about one that
            // others push and hold. A brush has a balance of its own.
            Needs::OneFilament => !self.brush,
            Needs::GivenForce => self.force,
            Needs::Edge => self.edge,
            Needs::Removal => preston.is_some(),
            Needs::RemovalFromPlane => preston.is_some() && area_rate.is_some(),
            Needs::RemovalAndWear => preston.is_some() && wear.is_some(),
        }
    }
}

/// Returns the metrics that tables of results with these properties have.
pub fn metric_columns(having: Having) -> impl Iterator<Item = &'static Column<Metrics>> + Clone {
    Metrics::COLUMNS
        .iter()
        .filter(move |column| having.has(column.display.needs))
}

/// Returns the metrics that each filament of a brush has.
pub fn filament_columns() -> impl Iterator<Item = &'static Column<Metrics>> + Clone {
    metric_columns(Having {
        brush: true,
        edge: true,
        ..Having::default()
    })
}
