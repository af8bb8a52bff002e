//! Draft of a sector: what can be simulated, and the memory that it takes.

use super::super::arrangement::{self, Arrangement};
use super::super::error::BrushError;
use super::super::filaments;
use super::super::stretch;
use crate::equations::lanes_are_compiled;
use crate::model::settings::{Settings, Turns};
use crate::simulation::{Form, Pass};

/// A sector that can be simulated, before its filaments are made.
pub(super) struct Draft {
    pub(super) pass: Pass,
    pub(super) arrangement: Arrangement,
    /// `true` if no filament leaves its plane of rotation or touches one in another plane.
    pub(super) is_planar: bool,
    /// `true` if the run ends once its stretch has settled, not after a number of columns.
    pub(super) ends_when_settled: bool,
    /// Number of contact points of a segment.
    pub(super) points: usize,
    /// Upper bound of the memory of the simulation in bytes, without frames.
    pub(super) memory: u64,
}

impl Draft {
    /// Drafts the sector that `settings` state, with another number of columns if one is given. It
    /// may need `memory` (bytes).
    pub(super) fn new(
        settings: &Settings,
        columns: Option<usize>,
        memory: Option<u64>,
    ) -> Result<Self, BrushError> {
        if !lanes_are_compiled() {
            return Err(BrushError::NoLanes);
        }
        let brush = settings.brush_or_default();
        let pass = Pass::deepest(settings);
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
            // Unneeded columns sleep, which costs little. They are far from closing the ring.
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

/// Checks that the filaments of the brush that `settings` state can be arranged, and that the
/// simulation needs at most `memory` (bytes), without simulating it. Returns an upper bound of the
/// memory in bytes, without frames.
///
/// # Errors
/// Those of [`BrushRun::new`](super::BrushRun::new).
///
/// # Panics
/// If the settings fail [`Settings::check`].
pub fn check_brush(settings: &Settings, memory: Option<u64>) -> Result<u64, BrushError> {
    Draft::new(settings, None, memory).map(|draft| draft.memory)
}

/// Returns an upper bound of the memory of a simulation in bytes, without frames: a linear function
/// from measurements.
pub fn memory_estimate(filaments: usize, segments: usize, points: usize) -> u64 {
    /// Bytes of a segment.
    const SEGMENT_BYTES: u64 = 4000;
    /// Bytes of a contact point.
    const POINT_BYTES: u64 = 500;
    /// Bytes of everything else.
    const OTHER_BYTES: u64 = 16 << 20;
    let (filaments, segments, points) = (filaments as u64, segments as u64, points as u64);
    let of_filament = segments.saturating_mul(
        points
            .saturating_mul(POINT_BYTES)
            .saturating_add(SEGMENT_BYTES),
    );
    filaments
        .saturating_mul(of_filament)
        .saturating_add(OTHER_BYTES)
}
