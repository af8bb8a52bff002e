//! Errors of the simulation of a brush.

use std::error::Error;
use std::fmt::{self, Display, Formatter};

use crate::simulation::SimulationError;

/// Error of the simulation of a brush. Filaments are given as `[column, row]`.
#[derive(Clone, Debug, PartialEq)]
pub enum BrushError {
    /// There is no filament.
    NoFilament,
    /// The sector has more columns than the brush.
    TooManyColumns {
        /// Columns of the sector.
        columns: usize,
        /// Columns of the brush.
        around: usize,
    },
    /// The undeformed filaments overlap.
    Overlap {
        /// Distance of two roots in m.
        distance: f64,
        /// Least distance without overlap in m.
        reach: f64,
        /// Filaments.
        pair: [[usize; 2]; 2],
    },
    /// Filaments that lean on each other do not come to rest before they meet the workpiece.
    Restless {
        /// Largest speed of a node relative to the body in m/s.
        speed: f64,
    },
    /// The machine has no vector units that the equations are compiled for.
    NoLanes,
    /// The simulation needs more memory than allowed.
    Memory {
        /// Bytes needed.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
        /// Number of filaments.
        filaments: usize,
        /// Number of segments of each.
        segments: usize,
    },
    /// Threads could not be started.
    Threads,
    /// A saved state does not belong to this brush.
    Checkpoint,
    /// The shortest step did not converge.
    NoConvergence {
        /// Time in s.
        time: f64,
        /// Number of filaments.
        filaments: usize,
    },
    /// Two filaments go through each other.
    Crossing {
        /// Time in s.
        time: f64,
        /// Filaments.
        pair: [[usize; 2]; 2],
    },
    /// The sector has no steady stretch.
    TooFewColumns {
        /// Columns of the sector.
        columns: usize,
        /// Columns that should be enough.
        needed: usize,
        /// Columns of the brush.
        around: usize,
        /// Change of the mean impulse along the best stretch, over the mean; `None` if there are
        /// too few columns for any.
        change: Option<f64>,
    },
    /// A filament alone cannot be simulated.
    Alone(SimulationError),
    /// The simulation was asked to stop ([`Stop`](crate::simulation::Stop)).
    Stopped,
}

impl Error for BrushError {}

impl Display for BrushError {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let name = |[column, row]: &[usize; 2]| format!("column {column}, row {row}");
        match self {
            Self::NoFilament => write!(
                f,
                "there is no filament: `tool.filament_count` is less than one per row"
            ),
            Self::TooManyColumns { columns, around } => write!(
                f,
                "`brush.columns` is {columns}, but a row of the brush has {around} filaments around: `tool.filament_count` over \
                 `brush.rows`"
            ),
            Self::Overlap {
                distance,
                reach,
                pair: [a, b],
            } if a == b => write!(
                f,
                "rows repeat after {distance} m, less than the diameter of {reach} m: widen `tool.width_m`, or set `brush.ends` to \"free\""
            ),
            Self::Overlap {
                distance,
                reach,
                pair: [a, b],
            } => write!(
                f,
                "filaments overlap: the roots of {} and {} are {distance:.6} m apart, less than the diameter of {reach:.6} m. Fewer \
                 filaments (`tool.filament_count`) fit, or a number of rows (`brush.rows`) for which the pitch is equal both ways",
                name(a),
                name(b)
            ),
            Self::Restless { speed } => write!(
                f,
                "filaments that lean on each other do not come to rest before they meet the workpiece; some still move at {speed:.1e} m/s: \
                 choose a smaller `brush.lateral_tilt_std_rad`, a smaller waviness, or filaments farther apart"
            ),
            Self::NoLanes => {
                write!(
                    f,
                    "brushes are simulated with AVX2 instructions, which this machine does not have"
                )
            }
            Self::Memory {
                needed,
                limit,
                filaments,
                segments,
            } => write!(
                f,
                "{filaments} filaments of {segments} segments need about {} MB of memory, but {} MB may be used: choose fewer \
                 `brush.columns`, `brush.rows` or `filament.segments`",
                needed.div_ceil(1_000_000),
                limit / 1_000_000
            ),
            Self::Threads => write!(f, "threads cannot be started"),
            Self::Checkpoint => write!(f, "the saved state is not one of this brush"),
            Self::NoConvergence { time, filaments: 1 } => write!(
                f,
                "at {time:.6} s no step converges, however short: a smaller `brush.tolerance`, a softer contact \
                 (`contact.stiffness_n_m`) or more damping (`filament.damping_ratio`) may help"
            ),
            Self::NoConvergence { time, .. } => write!(
                f,
                "at {time:.6} s no step converges, however short: a smaller `brush.tolerance` or a lower `brush.stiffness_n_m2` may help"
            ),
            Self::Crossing { time, pair: [a, b] } => write!(
                f,
                "at {time:.6} s the filament in {} goes through the one in {}: choose a higher `brush.stiffness_n_m2` or a \
                 smaller `brush.tolerance`",
                name(a),
                name(b)
            ),
            Self::TooFewColumns {
                columns,
                needed,
                around,
                change,
            } => {
                let columns = if *columns == 1 {
                    "1 column is".to_owned()
                } else {
                    format!("{columns} columns are")
                };
                write!(f, "{columns} too few for a steady stretch")?;
                if let Some(change) = change {
                    write!(
                        f,
                        ": the mean impulse still changes by {:.1} % along it",
                        100.0 * change
                    )?;
                }
                f.write_str(". ")?;
                if needed <= around {
                    write!(f, "Set `brush.columns` to {needed} or more, or ")?;
                } else {
                    write!(
                        f,
                        "{needed} may be needed, of which a row has only {around}: set `process.turns`, or "
                    )?;
                }
                write!(
                    f,
                    "`brush.steady` to false for the metrics of the sector as it is"
                )
            }
            Self::Alone(error) => write!(f, "a filament alone: {error}"),
            Self::Stopped => write!(f, "the simulation was asked to stop"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_fit_the_number_of_filaments() {
        let told = |filaments| {
            BrushError::NoConvergence {
                time: 1e-3,
                filaments,
            }
            .to_string()
        };
        assert!(
            told(1).contains("`contact.stiffness_n_m`")
                && !told(1).contains("brush.stiffness_n_m2"),
            "{}",
            told(1)
        );
        assert!(told(2).contains("`brush.stiffness_n_m2`"), "{}", told(2));
        let told = |columns| {
            BrushError::TooFewColumns {
                columns,
                needed: 5,
                around: 9,
                change: Some(0.1),
            }
            .to_string()
        };
        assert!(told(1).starts_with("1 column is too few"), "{}", told(1));
        assert!(told(2).starts_with("2 columns are too few"), "{}", told(2));
    }
}
