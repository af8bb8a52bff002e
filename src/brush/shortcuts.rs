//! Work that a simulation may save.

/// Shortcuts of a simulation. Each only saves work: results agree without it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shortcuts {
    /// `true` if straight filaments sleep until something touches them.
    pub sleep: bool,
    /// `true` if filaments are left out once neither they nor those behind them can touch the
    /// workpiece again.
    pub leave_out: bool,
    /// `true` if the workpiece is not searched where a bound of the distance excludes contact.
    pub clearance: bool,
    /// `true` if the broad phase searches only pairs, points and segments that a bound of their
    /// distance does not exclude.
    pub broad_phase: bool,
}

impl Shortcuts {
    /// All shortcuts, which is the default.
    pub const ALL: Self = Self {
        sleep: true,
        leave_out: true,
        clearance: true,
        broad_phase: true,
    };
}

impl Default for Shortcuts {
    fn default() -> Self {
        Self::ALL
    }
}
