//! Filaments that touch each other and the workpiece (docs/MODEL.md, "Filaments that touch").
//!
//! [`simulate_row`] simulates filaments that follow each other around the tool. Contact is ten thousand times as stiff as a filament in
//! bending, so that all filaments are solved together, implicitly: Newton's method, whose linear equations are solved by the
//! generalised minimal residual method, with each filament's own O(n) factorisation as preconditioner. docs/design.md says why.
//!
//! ```
//! use bristle::brush::{PressLaw, RowSettings, simulate_row};
//! use bristle::model::settings::Settings;
//! use bristle::simulation::Pass;
//!
//! let mut settings = Settings::paper(10.0, 1e-3);
//! settings.filament.segments = 5;
//! let row = RowSettings {
//!     columns: 3,
//!     pitch: std::f64::consts::TAU / 682.0,
//!     law: PressLaw::of(&settings),
//!     points: 3,
//!     step: 2e-4,
//!     newton_tolerance: 3e-4,
//! };
//! let result = simulate_row(&Pass::new(&settings), &row)?;
//! let [first, _, last] = &result.metrics[..] else { unreachable!("three filaments") };
//! assert!(first.contact_normal_impulse_n_s > last.contact_normal_impulse_n_s);
//! # Ok::<(), bristle::brush::RowError>(())
//! ```

mod candidates;
mod field;
mod gmres;
mod presses;
mod row;
mod sector;

pub use presses::PressLaw;
pub use row::Effort;
pub use sector::{RowError, RowResult, RowSettings, simulate_row};
