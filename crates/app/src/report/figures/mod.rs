//! Figures of results: metrics of a study over its settings, comparisons with measured forces, one
//! contact over time.
//!
//! Results in, named figures out. They correspond to figures 3 to 7 of Uhlmann and Hoyer (2021).

mod brush;
mod calibration;
mod contact;
mod convergence;
mod force;
mod metric;
mod panes;
mod picture;
mod preferred;
mod profile;
mod removal;
mod slice_view;
mod study;
#[cfg(test)]
mod tests;
mod worked;

pub use brush::{Brush, brush_figures, is_of_brush};
pub use calibration::{calibration_figures, is_of_calibration};
pub use contact::{contact_figures, is_of_contact};
pub use convergence::{convergence_figures, is_of_convergence};
pub use picture::Picture;
pub use preferred::main_figures;
pub use profile::drawn_shapes;
pub use removal::{corner_outline, is_of_removal, removal_figures, unit_of_time};
pub use study::{Pictures, is_of_study, study_figures};
