//! Filaments with clamps of any motion, which touch each other.

use super::bundle::{BrushState, Bundle};
use super::candidates::Layout;
use super::group::BundleMember;
use super::presses::PressLaw;
use super::sector::TrBdf2Stepper;
use super::shortcuts::Shortcuts;
use crate::simulation::{Filament, Form};
use crate::tool::ClampMotion;
use crate::workpiece::Part;

/// Filaments in space with clamps of any motion, which touch each other and the workpiece: for
/// experiments that are not a brush.
pub struct Assembly<M> {
    bundle: Bundle<M>,
    motion: BrushState,
    stepper: TrBdf2Stepper,
}

/// Failure of Newton's method in a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepError;

impl std::error::Error for StepError {}

impl std::fmt::Display for StepError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Newton's method does not converge: the step is too long")
    }
}

impl<M: ClampMotion + Sync> Assembly<M> {
    /// Creates uniform filaments of the given `radii` (m), with equal numbers of segments, that
    /// press on each other under `law` with `points` contact points a segment. At time zero they
    /// have the `coordinates` about `z` and the rates of each segment, in rad and rad/s. Stages are
    /// solved once velocities change by less than `tolerance` (m/s).
    ///
    /// # Panics
    /// If there is no filament, or if their numbers of segments differ.
    pub fn new(
        filaments: Vec<Filament<M, Part>>,
        radii: &[f64],
        law: PressLaw,
        points: usize,
        coordinates: impl Fn(usize) -> [Vec<[f64; 2]>; 2],
        tolerance: f64,
    ) -> Self {
        let of_filament = |(filament, radius): (&Filament<M, Part>, &f64)| {
            vec![*radius; filament.chain.segments()]
        };
        let radii = filaments.iter().zip(radii).flat_map(of_filament).collect();
        let lengths = filaments
            .iter()
            .map(|filament| filament.chain.length)
            .collect();
        let layout = Layout::new(lengths, radii, points, None);
        let member = |(index, filament)| BundleMember {
            filament,
            contacts: [f64::NEG_INFINITY, f64::INFINITY],
            start: coordinates(index),
        };
        let members = filaments.into_iter().enumerate().map(member).collect();
        let shortcuts = Shortcuts {
            sleep: false,
            ..Shortcuts::ALL
        };
        let (bundle, motion) =
            Bundle::new(Form::Spatial, members, law, layout, [0.0, 0.0], shortcuts);
        Self {
            stepper: TrBdf2Stepper::new(&motion, tolerance),
            bundle,
            motion,
        }
    }

    /// Advances by `h` (s).
    ///
    /// # Errors
    /// If the step is too long.
    pub fn step(&mut self, h: f64) -> Result<(), StepError> {
        self.bundle.begin_step(&mut self.motion);
        self.stepper
            .middle_stage(&mut self.bundle, &self.motion, h)
            .map_err(|_| StepError)?;
        self.stepper
            .end_stage(&mut self.bundle, &self.motion, h)
            .map_err(|_| StepError)?;
        self.stepper.finish(&mut self.motion);
        Ok(())
    }

    /// Returns the time in s.
    pub fn time(&self) -> f64 {
        self.motion.time
    }

    /// Returns the position of a node in m; 0 is the root.
    pub fn node(&self, filament: usize, k: usize) -> [f64; 3] {
        self.bundle.node(filament, k)
    }

    /// Returns the forces between filaments in N: at each contact point, the force on the first
    /// filament, with the distances of both points from the roots in m.
    pub fn presses(&self) -> impl Iterator<Item = ([usize; 2], [f64; 3], [f64; 2])> {
        self.bundle.presses().map(|(filaments, press)| {
            let places =
                [&press.near.point, &press.near.nearest].map(|place| self.bundle.arc_length(place));
            (*filaments, press.force(), places)
        })
    }

    /// Returns the energy of the filaments and their contacts in J.
    pub fn energy(&mut self) -> f64 {
        self.bundle.evaluate(&self.motion).budget.energy
    }
}
