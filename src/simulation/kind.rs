//! Kinds of passes that can be simulated side by side.

use super::filament::Filament;
use super::form::Form;
use crate::equations::PolarAxis;
use crate::integrate::StageSolution;
use crate::tool::ClampMotion;
use crate::workpiece::Workpiece;

/// Properties that passes must share to be simulated side by side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Kind {
    form: Form,
    segments: usize,
    contacts: usize,
    solution: StageSolution,
    /// `true` if the work of clamp and workpiece is integrated.
    integrates_work: bool,
    /// `true` if coordinates are about `x` at the start, rather than about `z`.
    about_x: bool,
}

impl Kind {
    /// Returns the polar axis of all coordinates at the start.
    pub(super) fn axis(self) -> PolarAxis {
        if self.about_x {
            PolarAxis::X
        } else {
            PolarAxis::Z
        }
    }

    pub(super) fn new<M: ClampMotion, W: Workpiece>(
        form: Form,
        filament: &Filament<M, W>,
        integrates_work: bool,
        axis: PolarAxis,
    ) -> Self {
        Self {
            about_x: axis == PolarAxis::X,
            form,
            segments: filament.chain.segments(),
            contacts: filament.contacts(),
            solution: filament.stage_solution(),
            integrates_work,
        }
    }
}
