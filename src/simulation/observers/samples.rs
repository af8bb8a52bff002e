//! Samples and shapes of a filament in the course of a pass.

use crate::tool::Pose;

crate::record! {
    /// Row of a time history.
    #[derive(Clone, Debug, Default, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Sample {
        time_s: f64 = ["t", "s", "time", "zero at the start of the pass"],
        base_angle_rad: f64 = ["β", "rad", "angle of the brush body", ""],
        contact_normal_force_n: f64 = ["F_n", "N", "contact normal force", "sum over the nodes"],
        contact_tangential_force_n: f64 = ["F_t", "N", "friction", "magnitude of the sum over the nodes"],
        tip_deflection_m: f64 = ["s_n", "m", "tip deflection", "distance of the tip from the undeformed filament"],
        tip_x_m: f64 = ["x", "m", "tip position along x", ""],
        tip_y_m: f64 = ["y", "m", "tip position along y", ""],
        tip_z_m: f64 = ["z", "m", "tip position along z", ""],
        kinetic_energy_j: f64 = ["E_kin", "J", "kinetic energy", ""],
        potential_energy_j: f64 = ["E_pot", "J", "potential energy", "of springs and gravity"],
        dissipated_energy_j: f64 =
            ["", "J", "dissipated energy", "taken so far by joint dampers, contact damping and friction"],
        contact_normal_impulse_n_s: f64 = [
            "", "N s", "contact normal impulse so far",
            "∫ F_n dt over all turns; its rise over the time between two samples is the mean of F_n there"
        ],
        peak_contact_normal_force_n: f64 = [
            "", "N", "largest contact normal force since the sample before",
            "impacts are shorter than the time between samples"
        ],
    }
}

/// Samples taken of a pass in addition to its metrics. The default is none, which costs nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sampling {
    /// Number of samples at equally spaced times, including the first and the last instant.
    pub samples: usize,
    /// Number of shapes of the filament at equally spaced times, including the first and the last
    /// instant.
    pub shapes: usize,
    /// `true` if the shapes have velocities and contact forces, too.
    pub loads: bool,
    /// `true` if the work along the profile of the workpiece is requested.
    pub profile: bool,
    /// `true` if metrics and statistics must equal those without samples to the bit. The impulse
    /// and the dissipated energies of the samples are then integrated less exactly, with an error
    /// far below the tolerance. If the metrics are finite but a sample is not, all samples are left
    /// out.
    pub alongside: bool,
}

impl Sampling {
    /// Returns `true` if the energies of the samples have to be integrated.
    pub(in crate::simulation) fn tracks_energy(self) -> bool {
        self.samples > 0 && !self.alongside
    }
}

/// Filament at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Time in s; zero at the start of the pass.
    pub time_s: f64,
    /// Positions of the root and of all nodes, to the tip, in m.
    pub nodes_m: Vec<[f64; 3]>,
    /// Velocities of the same points in m/s; empty without [`Sampling::loads`].
    pub velocities_m_s: Vec<[f64; 3]>,
    /// Contact forces on the same points; empty without [`Sampling::loads`].
    pub forces: Vec<NodeForce>,
}

/// Contact force on a node. A force at a point of a segment acts on both its ends.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodeForce {
    /// Share of the node in `F_n` in N.
    pub normal: f64,
    /// Share of the node in the whole force, with friction, in N.
    pub force: [f64; 3],
}

impl Sample {
    /// Turns its vectors from the frame of a tool to that of the workpiece.
    pub(in crate::simulation) fn turn(&mut self, pose: &Pose) {
        [self.tip_x_m, self.tip_y_m, self.tip_z_m] =
            pose.from_tool([self.tip_x_m, self.tip_y_m, self.tip_z_m]);
    }
}

impl Shape {
    /// Turns its vectors from the frame of a tool to that of the workpiece.
    pub(in crate::simulation) fn turn(&mut self, pose: &Pose) {
        let vectors = self.nodes_m.iter_mut().chain(&mut self.velocities_m_s);
        for vector in vectors.chain(self.forces.iter_mut().map(|node| &mut node.force)) {
            *vector = pose.from_tool(*vector);
        }
    }

    /// Returns `true` if every value is a finite number.
    pub(in crate::simulation) fn is_finite(&self) -> bool {
        let vectors = self.nodes_m.iter().chain(&self.velocities_m_s);
        let forces = self.forces.iter();
        vectors
            .chain(forces.clone().map(|node| &node.force))
            .flatten()
            .all(|value| value.is_finite())
            && forces.map(|node| node.normal).all(f64::is_finite)
    }
}
