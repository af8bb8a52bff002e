//! Filaments that touch each other and the workpiece (docs/MODEL.md, "Filaments that touch").
//!
//! [`simulate_brush`] simulates a sector of a brush; [`BrushRun`] does so in parts, which can be
//! stopped and resumed. Contact is ten thousand times as stiff as a filament in bending. All
//! filaments are therefore solved together, implicitly, by Newton's method. Its linear equations
//! are solved by the generalised minimal residual method, with each filament's own O(n)
//! factorisation as preconditioner. docs/methods.md ("Filaments that touch") says why.
//!
//! ```
//! use bristle::brush::simulate_brush;
//! use bristle::model::settings::{BrushSettings, Settings};
//!
//! let mut settings = Settings::paper(10.0, 1e-3);
//! settings.filament.segments = 5;
//! let brush = BrushSettings { columns: Some(3), rows: Some(1), steady: false, ..BrushSettings::default() };
//! settings.tool.filament_count = 682.0;
//! settings.brush = Some(brush);
//! let result = simulate_brush(&settings, 1)?;
//! let [first, _, last] = &result.filaments[..] else { unreachable!("three filaments") };
//! assert!(first.metrics.contact_normal_impulse_n_s > last.metrics.contact_normal_impulse_n_s);
//! # Ok::<(), bristle::brush::BrushError>(())
//! ```

mod alone;
mod arrangement;
mod assembly;
mod bundle;
mod candidates;
mod error;
mod field;
mod filaments;
mod gmres;
mod group;
mod plan;
mod presses;
mod pressing;
mod result;
mod run;
mod sector;
mod settle;
mod shortcuts;
mod stretch;
mod team;

pub use assembly::{Assembly, StepError};
pub use bundle::Effort;
pub use error::BrushError;
pub use presses::PressLaw;
pub use result::{
    BrushResult, BrushStatistics, EnergyBalance, FilamentResult, Frame, PairResult, Residuals,
    Stretch, ToolSample,
};
pub use run::{BrushRun, Checkpoint, RunOptions, check_brush, memory_estimate};
pub use shortcuts::Shortcuts;

use crate::model::settings::Settings;

/// Simulates the sector of a brush that `settings` state, on `threads` threads.
///
/// # Errors
/// See [`BrushError`].
pub fn simulate_brush(settings: &Settings, threads: usize) -> Result<BrushResult, BrushError> {
    let mut run = BrushRun::new(
        settings,
        RunOptions {
            threads,
            ..RunOptions::default()
        },
    )?;
    while run.advance()? {}
    run.finish()
}
