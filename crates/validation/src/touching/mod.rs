//! Filaments that touch each other.

mod convergence;
mod pairs;
mod rows;

use super::group::Group;

/// The group.
pub const GROUP: Group = Group {
    title: "Filaments that touch",
    purpose: "First pairs of filaments at rest: with how much force they press on each other, and how they bend then. Then sectors of a \
        brush that pass a workpiece: compared with other codes, their balances and symmetries, and how the mean impulse converges.",
    trials: &[
        pairs::straight,
        pairs::cantilevers,
        pairs::over_filament,
        rows::cvodes,
        rows::space,
        rows::mujoco,
        rows::balance,
        rows::momentum,
        rows::alone,
        rows::symmetries,
        convergence::steady,
    ],
};
