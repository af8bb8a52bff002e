//! The result of a brush.

use std::ops::AddAssign;

use crate::equations::linear::{add, scale};
use crate::model::metrics::Metrics;

use super::bundle::Effort;

/// One filament of a brush.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FilamentResult {
    /// Column; 0 meets the workpiece first.
    pub column: usize,
    /// Row; 0 has the least `z`.
    pub row: usize,
    /// Angle of its root about the tool axis, behind that of column 0, in rad.
    pub root_angle_rad: f64,
    /// `z` of its root in m.
    pub root_z_m: f64,
    /// `true` if the metrics of the tool count it.
    pub is_counted: bool,
    /// Its contact with the workpiece.
    pub metrics: Metrics,
    /// Impulse with which other filaments press on it, without regard to direction, in N s.
    pub press_impulse_n_s: f64,
}

/// Forces of the tool at one time: sums over all filaments of the sector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ToolSample {
    /// Time in s.
    pub time_s: f64,
    /// Contact normal force in N.
    pub contact_normal_force_n: f64,
    /// Force of the workpiece on the filaments in N.
    pub contact_force_n: [f64; 3],
    /// Moment of that force about the tool axis in N m.
    pub contact_moment_n_m: f64,
    /// Sum of the forces with which filaments press on each other in N.
    pub press_force_n: f64,
    /// Number of filaments that touch the workpiece.
    pub touching_filaments: usize,
    /// Number of pairs of filaments that touch.
    pub touching_pairs: usize,
}

/// Contact of two filaments over the whole simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PairResult {
    /// Column and row of one.
    pub filament: [usize; 2],
    /// Column and row of the other.
    pub other: [usize; 2],
    /// Impulse of the normal force between them, in N s.
    pub impulse_n_s: f64,
    /// Impulse of the force on the filament, friction included, in N s.
    pub vector_impulse_n_s: [f64; 3],
    /// Largest normal force in N.
    pub peak_force_n: f64,
    /// Time of contact in s.
    pub contact_time_s: f64,
    /// Mean distance of the contact from the roots along both filaments, weighted by the force, in
    /// m.
    pub arc_length_m: f64,
    /// Work of friction and damping between them in J.
    pub dissipated_j: f64,
}

/// All filaments at one time.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Frame {
    /// Time in s.
    pub time_s: f64,
    /// Angle `β` of the filament in column 0 in rad.
    pub tool_angle_rad: f64,
    /// Nodes by filament, from root to tip, in m.
    pub nodes_m: Vec<Vec<[f32; 3]>>,
    /// Contact normal force on the workpiece in N, by filament.
    pub contact_normal_force_n: Vec<f32>,
    /// Sum of the forces of other filaments in N, by filament.
    pub press_force_n: Vec<f32>,
}

/// Steady stretch of columns.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stretch {
    /// First column that counts.
    pub first: usize,
    /// Last column that counts.
    pub last: usize,
    /// Relative standard error of the mean `p_n`, by batch means over the columns.
    pub standard_error: f64,
}

/// Result of a brush.
#[derive(Clone, Debug, PartialEq)]
pub struct BrushResult {
    /// Filaments, column by column.
    pub filaments: Vec<FilamentResult>,
    /// Means over the filaments that count (largest values of extremes); forces of the whole tool.
    pub tool: Metrics,
    /// Means over the same filaments, each alone.
    pub alone: Metrics,
    /// Mean `p_n` over that of one filament alone; zero if that is zero.
    pub interaction_factor: f64,
    /// Columns that count.
    pub stretch: Stretch,
    /// Number of columns.
    pub columns: usize,
    /// Number of rows.
    pub rows: usize,
    /// Number of filaments around in a row, as a mean: `N_f/rows`.
    pub filaments_around: f64,
    /// Forces of the tool over time.
    pub history: Vec<ToolSample>,
    /// Pairs of filaments that touched, by filament.
    pub pairs: Vec<PairResult>,
    /// Sector at equally spaced times.
    pub frames: Vec<Frame>,
    /// Work done.
    pub statistics: BrushStatistics,
    /// Mean contact normal impulse of each turn in N s; empty for a single pass.
    pub turn_contact_normal_impulses_n_s: Vec<f64>,
    /// Balance of the energies.
    pub energies: EnergyBalance,
    /// Relative defects of the balances of energy and momentum.
    pub residuals: Residuals,
    /// Relative error estimate of the mean `p_n`: that of the steps, and the standard error of the
    /// mean over columns, added in squares.
    pub impulse_error_estimate: f64,
}

/// Relative defects of the balances of energy and momentum, each integrated apart from the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Residuals {
    /// Energy defect over the energy put in and taken, in either direction.
    pub energy: f64,
    /// Momentum defect over the momentum of the filaments and the impulse of the workpiece on them.
    /// Forces between filaments are not part of the sum: they must be opposite.
    pub momentum: f64,
}

/// Balance of the energies of a sector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergyBalance {
    /// Growth of the energy of filaments and contacts in J.
    pub gain_j: f64,
    /// Work of the clamps and of a moving workpiece in J.
    pub work_j: f64,
    /// Energy that joints, contact damping and friction dissipated, in J.
    pub dissipated_j: f64,
}

impl ToolSample {
    /// Adds the forces of another sector, `weight` times.
    pub(super) fn add(&mut self, other: &Self, weight: usize) {
        let times = weight as f64;
        self.time_s = other.time_s;
        self.contact_normal_force_n += times * other.contact_normal_force_n;
        self.contact_force_n = add(self.contact_force_n, scale(times, other.contact_force_n));
        self.contact_moment_n_m += times * other.contact_moment_n_m;
        self.press_force_n += times * other.press_force_n;
        self.touching_filaments += weight * other.touching_filaments;
        self.touching_pairs += weight * other.touching_pairs;
    }
}

impl AddAssign for BrushStatistics {
    fn add_assign(&mut self, other: Self) {
        self.steps += other.steps;
        self.rejected_steps += other.rejected_steps;
        self.newton_failures += other.newton_failures;
        self.effort += other.effort;
    }
}

/// Work done by the simulation of a brush.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BrushStatistics {
    /// Steps.
    pub steps: usize,
    /// Rejected steps: their error estimate was too large.
    pub rejected_steps: usize,
    /// Steps repeated because Newton's method did not converge, or because filaments crossed.
    pub newton_failures: usize,
    /// Iterations of Newton's method and vectors of the linear solutions.
    pub effort: Effort,
}
