//! The whole equations of a chain as named kernels, ready to be printed, emitted or exchanged.

use crate::ir::graph::{Graph, NodeId};
use crate::ir::kernel::{Kernel, KernelInput, Output, output_nodes, set_output_nodes};
use crate::ir::unit::Unit;
use crate::model::chain::{Body, Hinge, INERTIA, Motion, RelaxedShape, STIFFNESS, Vec3};
use crate::model::lagrange::{WholeEquations, whole_equations_of};
use crate::passes::dimension;
use crate::passes::normal_form::{Style, normalise};

/// Use of the whole equations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Sums of products, collected by the constants of the model.
    Reading,
    /// Sums of products for filaments of one shape, without the constants that it determines.
    ReadingOf(RelaxedShape),
    /// The shared structure of the derivation: O(n²) operations for `M`, O(n) for `f` and the
    /// energies.
    Computing,
}

/// The names of the whole equations of motion in space. [`Motion::name_for`] gives those of other
/// motions.
pub const NAMES: [&str; 3] = ["mass_matrix", "force", "energies"];

/// Derives the functions [`NAMES`] of a chain of `segments` segments.
///
/// Each takes all inputs, so that all are called alike.
///
/// # Errors
/// If a term of the derivation makes no physical sense.
///
/// # Panics
/// If `segments` is zero.
pub fn whole_kernels(
    segments: usize,
    motion: Motion,
    purpose: Purpose,
) -> Result<Vec<Kernel>, String> {
    let shape = match purpose {
        Purpose::ReadingOf(shape) => shape,
        Purpose::Reading | Purpose::Computing => RelaxedShape::default(),
    };
    whole_equations_of(segments, motion, shape).kernels(purpose)
}

impl WholeEquations {
    /// Derives the functions [`NAMES`] of these equations.
    ///
    /// Each takes all inputs, so that all are called alike.
    ///
    /// # Errors
    /// If a term of the derivation makes no physical sense.
    pub fn kernels(&self, purpose: Purpose) -> Result<Vec<Kernel>, String> {
        let (motion, shape, segments) = (self.motion, self.shape, self.segments.len());
        let size = self.force.len();
        let coordinates = match motion {
            Motion::Spatial => "φ1, θ1, φ2, …",
            Motion::Planar => "θ1, θ2, …",
        };
        let mass_matrix = Output::matrix(
            "mass_matrix",
            &format!("`M`, {size} × {size}, symmetric, rows and columns `{coordinates}`"),
            INERTIA,
            self.mass_matrix.clone(),
        );
        let force = Output::vector(
            "force",
            "`f` of `M q̈ = f + Q`, without contact",
            STIFFNESS,
            self.force.clone(),
        );
        let mut energies = vec![
            Output::scalar("kinetic", "`E_kin`", Unit::JOULE, self.kinetic_energy),
            Output::scalar("spring", "`E_spring`", Unit::JOULE, self.spring_energy),
            Output::scalar("gravity", "`E_grav`", Unit::JOULE, self.gravity_energy),
            Output::scalar("dissipation", "`D`", Unit::WATT, self.dissipation),
        ];
        let has_other = !self.graph.is_zero(self.other_energy);
        if has_other {
            energies.push(Output::scalar(
                "other",
                "`E_other`",
                Unit::JOULE,
                self.other_energy,
            ));
        }
        let plural = if segments == 1 { "" } else { "s" };
        let planar = match motion {
            Motion::Spatial => "",
            Motion::Planar => "planar ",
        };
        let chain = format!("of a {planar}chain of {segments} segment{plural}");
        let other = if has_other { " + E_other" } else { "" };
        let relaxed = if shape.is_straight {
            ",\n"
        } else {
            "\n(`α` from `e` turned about `z` by `κ`), "
        };
        let [mass_matrix_name, force_name, energies_name] = NAMES;
        [
            (mass_matrix_name, format!("Mass matrix {chain}: `M = ∂²E_kin/∂q̇²`."), vec![mass_matrix]),
            (
                force_name,
                format!(
                    "Generalised force {chain}: `f = −d/dt(∂E_kin/∂q̇) + ∂E_kin/∂q − ∂E_pot/∂q − ∂D/∂q̇`,\n\
                     the first term without its part in `q̈`, `E_pot = E_spring + E_grav{other}`."
                ),
                vec![force],
            ),
            (
                energies_name,
                format!(
                    "Energies and dissipation function {chain}: `E_kin = Σ ½ m |ċ|² + ½ J |ė|²`, `E_spring = Σ ½ c α²`{relaxed}\
                     `E_grav = −Σ m g·c` (`c` are the centres here), `D = Σ ½ d |ω' − ω|²`,\n\
                     `ω = e × (ė − Ω × e)`, zero at the clamp."
                ),
                energies,
            ),
        ]
        .into_iter()
        .map(|(name, summary, outputs)| {
            self.kernel(&motion.name_for(name), &summary, outputs, purpose)
        })
        .collect()
    }

    /// Derives the function `name` of any expressions in [`WholeEquations::graph`], with the
    /// arguments of the whole equations.
    ///
    /// # Errors
    /// If a term makes no physical sense.
    pub fn kernel(
        &self,
        name: &str,
        summary: &str,
        mut outputs: Vec<Output>,
        purpose: Purpose,
    ) -> Result<Kernel, String> {
        dimension::check(&self.graph, &outputs)?;
        let nodes = output_nodes(&outputs);
        let (graph, nodes) = match purpose {
            Purpose::Reading | Purpose::ReadingOf(_) => {
                let own = self.constants.iter();
                let own = own.filter_map(|(name, _)| self.graph.find_symbol(name));
                let constants: Vec<NodeId> =
                    self.parameters.constants().into_iter().chain(own).collect();
                let normalised = normalise(&self.graph, &nodes, Style::Collected(&constants));
                (normalised.graph, normalised.outputs)
            }
            Purpose::Computing => self.graph.extract(&nodes),
        };
        set_output_nodes(&mut outputs, nodes);
        dimension::check(&graph, &outputs)?;
        let inputs = self.inputs(&graph);
        Ok(Kernel {
            name: name.into(),
            summary: summary.into(),
            graph,
            inputs,
            outputs,
        })
    }

    /// The arguments of the whole equations, the same for each function, as symbols of `graph`.
    pub fn inputs(&self, graph: &Graph) -> Vec<KernelInput> {
        let group = |name: &str, doc: &str, symbols: Vec<NodeId>| {
            let names = symbols
                .into_iter()
                .filter_map(|symbol| self.graph.symbol_name(symbol));
            KernelInput::symbols(graph, name, doc, &names.collect::<Vec<_>>())
        };
        let Self {
            motion,
            parameters,
            clamp,
            ..
        } = self;
        let vector = |name: &str, doc: &str, symbols: Vec3| {
            group(name, doc, symbols[..motion.axes()].to_vec())
        };
        // A cylinder has one constant for all segments; the joint of its clamp has twice that of a
        // joint.
        let constants = |name: &str, letter: char, unit: &str, symbols: Vec<NodeId>| {
            if self.shape.is_cylinder {
                KernelInput::symbols(graph, name, &format!("{letter} in {unit}"), &[name])
            } else {
                group(name, &format!("{letter}1, {letter}2, … in {unit}"), symbols)
            }
        };
        let bodies = |name: &str, letter: char, unit: &str, of: fn(&Body) -> NodeId| {
            let symbols = parameters.bodies.iter().map(of).collect();
            constants(name, letter, unit, symbols)
        };
        let hinges = |name: &str, letter: char, unit: &str, of: fn(&Hinge) -> NodeId| {
            let symbols = parameters.hinges.iter().map(of).collect();
            constants(name, letter, unit, symbols)
        };
        let [coordinates, rates] = self.variables();
        let [coordinates_doc, rates_doc] = match motion {
            Motion::Spatial => ["φ1, θ1, φ2, … in rad", "φ̇1, θ̇1, φ̇2, … in rad/s"],
            Motion::Planar => ["θ1, θ2, … in rad", "θ̇1, θ̇2, … in rad/s"],
        };
        let inputs = vec![
            group("q", coordinates_doc, coordinates),
            group("v", rates_doc, rates),
            vector("root_position", "r0 in m", clamp.position),
            vector("root_velocity", "ṙ0 in m/s", clamp.velocity),
            vector("root_acceleration", "r̈0 in m/s²", clamp.acceleration),
            vector("clamp_direction", "e0", clamp.direction),
            match motion {
                Motion::Spatial => group(
                    "angular_velocity",
                    "Ω of the body in rad/s",
                    clamp.angular_velocity.to_vec(),
                ),
                Motion::Planar => group(
                    "angular_velocity",
                    "Ω of the body in rad/s, along z",
                    vec![clamp.angular_velocity[2]],
                ),
            },
            vector("gravity", "g in m/s²", parameters.gravity),
            group(
                "segment_length",
                "h in m",
                vec![parameters.bodies[0].length],
            ),
            bodies("segment_mass", 'm', "kg", |body| body.mass),
            bodies("segment_inertia", 'J', "kg m²", |body| body.inertia),
            hinges("joint_stiffness", 'c', "N m", |hinge| hinge.stiffness),
            hinges("joint_damping", 'd', "N m s", |hinge| hinge.damping),
        ];
        let relaxed = (!self.shape.is_straight).then(|| {
            let angles = parameters.hinges.iter().map(|hinge| hinge.relaxed_angle);
            group("relaxed_angle", "κ1, κ2, … in rad", angles.collect())
        });
        let own = self.constants.iter();
        let own = own.map(|(name, doc)| KernelInput::symbols(graph, name, doc, &[name]));
        inputs.into_iter().chain(relaxed).chain(own).collect()
    }
}
