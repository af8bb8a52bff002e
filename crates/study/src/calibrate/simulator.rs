//! Forces of the tools of a problem, simulated side by side.

use std::io;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::grid::removal::RemovalError;
use crate::grid::{CaseResult, Resources, Study, simulate_cases};
use bristle::model::settings::{Settings, UncertaintySettings};
use bristle::simulation::{Sampling, Stop};
use parking_lot::Mutex;
use thiserror::Error;

use crate::calibrate::problem::{Forces, Problem, ToolPlace, forces_of};
use crate::text::number::short;

/// Reason why a calibration has no result.
#[derive(Debug, Error)]
pub enum Interrupted {
    /// Stop on request.
    #[error("the calibration was stopped")]
    Stopped,
    /// Description of forces or radii that cannot be simulated or kept.
    #[error("{0}")]
    Failed(String),
}

impl From<io::Error> for Interrupted {
    fn from(error: io::Error) -> Self {
        Self::Failed(format!("cannot start threads: {error}"))
    }
}

impl From<RemovalError> for Interrupted {
    fn from(error: RemovalError) -> Self {
        match error {
            RemovalError::Stopped => Self::Stopped,
            RemovalError::Failed(words) => Self::Failed(words),
        }
    }
}

/// Observer of a calibration, which may keep simulated forces. Any thread calls it.
pub trait Observer: Sync {
    /// Receives the share of the work that is done.
    fn done(&self, _share: f64) {}

    /// Returns the forces of an earlier simulation of a brush.
    fn recall(&self, _settings: &Settings) -> Option<Forces> {
        None
    }

    /// Keeps the forces of a brush; breaks on failure.
    fn keep(&self, _settings: &Settings, _forces: &Forces) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Observer that watches nothing and keeps nothing.
pub struct SilentObserver;

impl Observer for SilentObserver {}

/// Resources, cancellation and progress reporting of a calibration.
#[derive(Clone, Copy)]
pub struct CalibrationContext<'a> {
    /// Threads and memory.
    pub resources: Resources,
    /// Stop at the next step of each simulation.
    pub stop: &'a Stop,
    /// Observer of the calibration.
    pub observer: &'a dyn Observer,
    /// Number of starts besides the stated values, [`STARTS`](crate::calibrate::STARTS) unless
    /// these are known to be near the minimum.
    pub starts: usize,
}

/// Precision of the simulations and of the derivatives of a stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precision {
    /// Relative tolerance of passes.
    pub tolerance: f64,
    /// Step of differences in a coordinate.
    pub step: f64,
    /// `true` if differences are central, `false` if they are one-sided.
    pub central: bool,
    /// Largest number of segments.
    pub segments: usize,
    /// `true` if filaments that touch interact.
    pub interacts: bool,
    /// Relative change of the sum of squares at which a descent has arrived.
    pub arrival: f64,
}

/// Simulates the tools of a problem.
pub struct Simulator<'a> {
    pub problem: &'a Problem,
    pub means: CalibrationContext<'a>,
    /// Number of brushes that were simulated or recalled.
    brushes: AtomicUsize,
    /// Place and error of the last brush that could not be simulated, behind the words that say so.
    failure: Mutex<Option<String>>,
}

impl<'a> Simulator<'a> {
    pub fn new(problem: &'a Problem, means: CalibrationContext<'a>) -> Self {
        Self {
            problem,
            means,
            brushes: AtomicUsize::new(0),
            failure: Mutex::new(None),
        }
    }

    /// Returns the error about a brush that could not be simulated.
    pub fn failure(&self) -> Interrupted {
        let failure = self.failure.lock().take();
        let failure = failure.as_deref();
        let why = failure.unwrap_or(": its settings contradict each other");
        Interrupted::Failed(format!("a brush cannot be simulated{why}"))
    }

    /// The place of a simulation in words: speed, depth, and the `values` of the fitted settings.
    fn words(&self, settings: &Settings, values: &[f64]) -> String {
        let process = &settings.process;
        let (speed, depth_mm) = (
            short(process.brushing_velocity_m_s),
            short(1e3 * process.penetration_depth_m),
        );
        let fitted = self.problem.fitted.iter().zip(values);
        let fitted: Vec<String> = fitted
            .map(|(fitted, value)| format!("{} = {}", fitted.parameter.path, short(*value)))
            .collect();
        format!(
            "at {speed} m/s and {depth_mm} mm with {}",
            fitted.join(", ")
        )
    }

    /// Counts a brush, and reports the share of the work that is done.
    fn count(&self) {
        /// Descents with interaction that are expected.
        const EXPECTED_DESCENTS: usize = 3;
        let done = 1 + self.brushes.fetch_add(1, Ordering::Relaxed);
        let settings = self.problem.fitted.len();
        let expected =
            self.problem.points.len() * (2 + EXPECTED_DESCENTS * (1 + 2 * settings) + 4 * settings);
        self.means
            .observer
            .done((done as f64 / expected as f64).min(0.95));
    }

    /// Reports the share of the work that is done, for filaments alone.
    pub fn tell(&self, share: f64) {
        if !self.problem.has_brush() && self.problem.radii.is_none() {
            self.means.observer.done(share);
        }
    }

    /// Returns the forces at `places`, each with its values of the fitted settings; `None` where
    /// there is no simulation.
    pub fn forces(
        &self,
        places: &[(ToolPlace, Vec<f64>)],
        precision: Precision,
    ) -> Result<Vec<Option<Forces>>, Interrupted> {
        let CalibrationContext {
            resources,
            stop,
            observer,
            ..
        } = self.means;
        let mut forces: Vec<Option<Forces>> = vec![None; places.len()];
        let (mut positions, mut cases) = (Vec::new(), Vec::new());
        for (position, (place, values)) in places.iter().enumerate() {
            let Ok(settings) = self.problem.settings(place, values) else {
                continue;
            };
            let settings = at(settings, precision);
            match settings
                .brush
                .as_ref()
                .and_then(|_| observer.recall(&settings))
            {
                Some(known) => {
                    forces[position] = Some(known);
                    self.count();
                }
                None => {
                    positions.push(position);
                    cases.push(settings);
                }
            }
        }
        // Brushes are simulated one by one, and all cases of a study are brushes or none is.
        let (brushes, alone): (Vec<usize>, Vec<usize>) =
            (0..cases.len()).partition(|&case| cases[case].brush.is_some());
        let found = Mutex::new(vec![None; cases.len()]);
        let mut is_kept = true;
        for own in [brushes, alone].into_iter().filter(|own| !own.is_empty()) {
            let study = Study::of_cases(own.iter().map(|&case| cases[case].clone()).collect());
            let flow = Mutex::new(ControlFlow::Continue(()));
            let done = |number: usize, result: CaseResult| {
                let case = own[number];
                let forces = result
                    .as_ref()
                    .ok()
                    .map(|summary| forces_of(&summary.metrics));
                found.lock()[case] = forces;
                if cases[case].brush.is_none() {
                    return ControlFlow::Continue(());
                }
                if let Err(error) = result {
                    let (_, values) = &places[positions[case]];
                    let at = self.words(&cases[case], values);
                    *self.failure.lock() = Some(format!(" {at}: {error}"));
                }
                let kept = forces.map_or(ControlFlow::Continue(()), |forces| {
                    observer.keep(&cases[case], &forces)
                });
                self.count();
                if kept.is_break() {
                    *flow.lock() = kept;
                }
                kept
            };
            let all: Vec<usize> = (0..own.len()).collect();
            simulate_cases(
                &study,
                &all,
                resources,
                stop,
                Sampling::default(),
                |_, _| {},
                done,
            )?;
            is_kept &= flow.into_inner().is_continue();
        }
        if stop.is_requested() {
            return Err(Interrupted::Stopped);
        }
        if !is_kept {
            let words = "what was simulated cannot be kept";
            return Err(Interrupted::Failed(words.to_owned()));
        }
        for (position, found) in positions.into_iter().zip(found.into_inner()) {
            forces[position] = found;
        }
        Ok(forces)
    }
}

/// Returns settings that are simulated with a precision.
fn at(
    mut settings: Settings,
    Precision {
        tolerance,
        interacts,
        segments,
        ..
    }: Precision,
) -> Settings {
    if !interacts {
        settings.brush = None;
        settings.uncertainty = UncertaintySettings::default();
        settings.filament.segments = settings.filament.segments.min(segments);
    }
    if settings.brush.is_none() {
        settings.solver.relative_tolerance = tolerance;
    }
    settings
}
