//! Derivation of the equations of motion from the energies, step by step. The formulas are derived
//! as the page is written.

use std::io::{self, Write};

use crate::print::legend;
use crate::print::page::{PageForm, PrintedPage};
use crate::print::printer::{Printer, coordinate};
use crate::print::wording::{CYLINDER, PLANE, title};
use bristle_codegen::back::source::Origin;
use bristle_codegen::ir::graph::{Graph, NodeId};
use bristle_codegen::ir::kernel::{Kernel, Output, output_nodes, set_output_nodes};
use bristle_codegen::ir::unit::Unit;
use bristle_codegen::model::chain::{
    self, Body, Hinge, Motion, Parameters, RelaxedShape, STIFFNESS, Segment, VELOCITY, Vec3,
    vector_symbol,
};
use bristle_codegen::model::lagrange::whole_equations_of;
use bristle_codegen::model::whole::{NAMES, Purpose, whole_kernels};
use bristle_codegen::passes::dimension;
use bristle_codegen::passes::normal_form::{Style, normalise};

const AXES: [&str; 3] = ["x", "y", "z"];

/// A step of the derivation: named expressions of one graph.
struct DerivationStep {
    motion: Motion,
    graph: Graph,
    outputs: Vec<Output>,
}

impl DerivationStep {
    /// Reduces a step to sums of products, collected by the constants of the model.
    fn collected(
        motion: Motion,
        source: &Graph,
        parameters: &Parameters,
        mut outputs: Vec<Output>,
    ) -> Result<Self, String> {
        dimension::check(source, &outputs)?;
        let normalised = normalise(
            source,
            &output_nodes(&outputs),
            Style::Collected(&parameters.constants()),
        );
        set_output_nodes(&mut outputs, normalised.outputs);
        Ok(Self {
            motion,
            graph: normalised.graph,
            outputs,
        })
    }

    fn nodes(&self) -> Vec<NodeId> {
        output_nodes(&self.outputs)
    }

    fn write(&self, page: &mut PrintedPage<'_>) {
        let printer = Printer::closed(&self.graph, &self.nodes(), self.motion, page.notation());
        let outputs = self
            .outputs
            .iter()
            .flat_map(|output| printer.output(output));
        page.definitions(printer.named_definitions().chain(outputs));
    }
}

/// The components of a vector that moves in `motion`, named `head` and the axis.
fn components(motion: Motion, head: &str, unit: Unit, vector: Vec3) -> Vec<Output> {
    let component = |(axis, node)| Output::scalar(&format!("{head}{axis}"), "", unit, node);
    AXES.into_iter()
        .zip(vector)
        .take(motion.axes())
        .map(component)
        .collect()
}

/// The direction of one segment and its rate.
fn frames(motion: Motion) -> DerivationStep {
    let mut graph = Graph::new();
    let g = &mut graph;
    let segment = Segment::new(g, "k");
    let ([x, y, z], [x_rate, y_rate, z_rate]) = (segment.direction(g), segment.direction_rate(g));
    let [x, y, z, x_rate, y_rate, z_rate] =
        motion.specialise(g, &[segment], [x, y, z, x_rate, y_rate, z_rate]);
    let mut outputs = components(motion, "e_k_", Unit::ONE, [x, y, z]);
    outputs.extend(components(
        motion,
        "ė_k_",
        Unit::SECOND.powi(-1),
        [x_rate, y_rate, z_rate],
    ));
    DerivationStep {
        motion,
        graph,
        outputs,
    }
}

/// The energies of one segment and one joint in the form of the model.
fn stated() -> DerivationStep {
    // Rules would change the order of the terms.
    let mut graph = Graph::raw();
    let g = &mut graph;
    let (body, hinge, pull) = (Body::new(g, ""), Hinge::new(g, ""), chain::gravity(g));
    let position = vector_symbol(g, "base_position", "x", Unit::METRE);
    let velocity = vector_symbol(g, "base_velocity", "ẋ", VELOCITY);
    let inner = vector_symbol(g, "direction", "e", Unit::ONE);
    let inner_rate = vector_symbol(g, "direction_rate", "ė", Unit::SECOND.powi(-1));
    let outer = vector_symbol(g, "outer_direction", "e'", Unit::ONE);
    let outer_rate = vector_symbol(g, "outer_direction_rate", "ė'", Unit::SECOND.powi(-1));
    let unbent = vector_symbol(g, "unbent_direction", "ē'", Unit::ONE);
    let kinetic = chain::kinetic_energy(g, &body, velocity, inner_rate);
    let gravity = chain::gravity_energy(g, &body, pull, position, inner);
    let spring = chain::spring_energy(g, hinge.stiffness, inner, unbent);
    let dissipation = {
        let turning = chain::angular_velocity(g);
        let inner_in_body = chain::rate_in_body(g, turning, inner, inner_rate);
        let outer_in_body = chain::rate_in_body(g, turning, outer, outer_rate);
        chain::dissipation(
            g,
            hinge.damping,
            Some((inner, inner_in_body)),
            (outer, outer_in_body),
        )
    };
    let outputs = vec![
        Output::scalar("kinetic", "", Unit::JOULE, kinetic),
        Output::scalar("gravity", "", Unit::JOULE, gravity),
        Output::scalar("spring", "", Unit::JOULE, spring),
        Output::scalar("dissipation", "", Unit::WATT, dissipation),
    ];
    DerivationStep {
        motion: Motion::Spatial,
        graph,
        outputs,
    }
}

/// The derivation of the equations of a chain from the energies, for readers.
pub struct Walkthrough {
    segments: usize,
    motion: Motion,
    shape: RelaxedShape,
    coordinates: Vec<String>,
    frames: DerivationStep,
    centres: DerivationStep,
    stated: DerivationStep,
    energies: DerivationStep,
    momenta: DerivationStep,
    mass_matrix: DerivationStep,
    /// The parts of the generalised force and their sum, each with its introduction.
    forces: [(&'static str, DerivationStep); 5],
}

impl Walkthrough {
    /// Derives the equations of `motion` of a chain of `segments` segments of `shape`.
    ///
    /// # Errors
    /// If a term of the derivation makes no physical sense.
    ///
    /// # Panics
    /// If `segments` is zero.
    pub fn new(segments: usize, motion: Motion, shape: RelaxedShape) -> Result<Self, String> {
        let mut whole = whole_equations_of(segments, motion, shape);
        let parts = whole.parts();
        let (frames, stated) = (frames(motion), stated());
        let centres = centre_velocities(segments, motion, shape)?;
        let collected = |name: &str, unit: Unit, nodes: Vec<NodeId>| {
            let outputs = vec![Output::vector(name, "", unit, nodes)];
            DerivationStep::collected(motion, &whole.graph, &whole.parameters, outputs)
        };
        let angular_momentum = Unit::KILOGRAM.times(Unit::METRE.powi(2)).per(Unit::SECOND);
        let momenta = collected("p", angular_momentum, parts.momenta)?;
        let inertial = collected("f_inertial", STIFFNESS, parts.inertial)?;
        let spring = collected("f_spring", STIFFNESS, parts.spring)?;
        let gravity = collected("f_gravity", STIFFNESS, parts.gravity)?;
        let damping = collected("f_damping", STIFFNESS, parts.damping)?;
        let kernels = whole_kernels(segments, motion, Purpose::ReadingOf(shape))?;
        let kernels: [Kernel; NAMES.len()] = kernels.try_into().expect("one kernel for each name");
        let [mass_matrix, force, energies] =
            kernels.map(|Kernel { graph, outputs, .. }| DerivationStep {
                motion,
                graph,
                outputs,
            });

        let forces = [
            (
                "Inertial forces, `∂E_kin/∂q − dp/dt` without the terms in `q̈`:",
                inertial,
            ),
            ("Springs, `−∂E_spring/∂q`:", spring),
            ("Gravity, `−∂E_grav/∂q`:", gravity),
            ("Dampers, `−∂D/∂q̇`:", damping),
            ("Their sum, collected by the constants:", force),
        ];
        let coordinates = (0..whole.force.len())
            .map(|i| coordinate(motion, i))
            .collect();
        Ok(Self {
            segments,
            motion,
            shape,
            coordinates,
            frames,
            centres,
            stated,
            energies,
            momenta,
            mass_matrix,
            forces,
        })
    }

    /// Writes the derivation as Markdown. `maker` has made it with the command `again`.
    ///
    /// # Errors
    /// If `out` cannot be written to.
    pub fn write(&self, out: &mut dyn Write, maker: &str, again: &str) -> io::Result<()> {
        let Self {
            segments,
            motion,
            shape,
            ..
        } = *self;
        let origin = Origin {
            title: &format!("{}, step by step", title(segments, motion)),
            maker,
            again,
        };
        let mut page = PrintedPage::new(out, PageForm::Markdown, origin);
        page.prose(
            "From the energies of the segments and joints to `M(q) q̈ = f(q, q̇, t) + Q`. All formulas on this page are \
         derived and written by the program; components refer to the inertial frame.",
        );
        page.heading("Symbols and units");
        let [.., (_, force)] = &self.forces;
        let steps = [
            &self.frames,
            &self.stated,
            &self.centres,
            &self.energies,
            &self.momenta,
            &self.mass_matrix,
            force,
        ];
        page.legend(&legend::rows(steps.map(|step| (&step.graph, step.nodes()))));

        page.heading("Frames and coordinates");
        let angles = match motion {
            Motion::Spatial => {
                "The coordinates are the polar angle from `+z` and the azimuth about `z` of each segment"
            }
            Motion::Planar => {
                "The filament stays in the plane of rotation, where the polar angle from `+z` is `φ = π/2`. The coordinates are \
             the azimuths about `z` of the segments"
            }
        };
        page.prose(&format!(
        "The inertial frame has its origin on the tool axis and `z` along it. {angles}: `q = ({})`. They are absolute: \
         segment `k` points along `e_k` whatever the others do. This vector and its rate are",
        self.coordinates.join(", ")
    ));
        self.frames.write(&mut page);

        page.heading("Velocities of the centres");
        page.prose(
            "Segment `k` starts where the one before it ends. Its centre is half a length further on: \
         `ċ_k = ṙ_0 + h (ė_1 + … + ė_l) + ½ h ė_k` with `l = k − 1`. In components:",
        );
        self.centres.write(&mut page);

        page.heading("Energies");
        page.prose(
        "These are the energies of a segment with the inner end `x` and the direction `e`, and of a joint between `e` and `e'`. \
         The angular velocities in `D` are those that are seen from the body, which turns at `Ω`: `e × (ė − Ω × e)`. The spring is relaxed where `e'` is `e` turned about `z` by the relaxed \
         angle `κ`: `ē'` is `e'` turned back by it. At the clamp joint `e_0` takes the place of `e`, \
         and its angular velocity in the body is zero.",
    );
        self.stated.write(&mut page);
        if motion == Motion::Planar {
            page.prose(PLANE);
        }
        if shape.is_straight {
            page.prose("The filament is straight: every `κ = 0`, and `ē'` is `e'`.");
        }
        if shape.is_cylinder {
            page.prose(CYLINDER);
        }
        let joints = match motion {
            Motion::Spatial => "`u1`, `u2`, … belong to the joints, from the clamp outwards.",
            Motion::Planar => "`u1` belongs to the clamp joint.",
        };
        page.prose(&format!(
        "Summed over the chain, with the directions and velocities from above inserted, expanded and collected by the \
         constants, they are as follows. {joints}"
    ));
        self.energies.write(&mut page);

        page.heading("Lagrange's equations");
        page.prose(
            "With `L = E_kin − E_spring − E_grav` each coordinate has the equation \
         `d/dt(∂L/∂q̇) − ∂L/∂q + ∂D/∂q̇ = Q`, where `Q` contains the forces of contact and friction. Only the \
         kinetic energy depends on the rates, through the momenta `p = ∂E_kin/∂q̇`:",
        );
        self.momenta.write(&mut page);

        page.heading("Mass matrix");
        page.prose(
            "The momenta are linear in the rates. Their coefficients, `M = ∂p/∂q̇`, are the factors of `q̈` in `dp/dt`. \
         `M` is symmetric: entries below the diagonal are left out, and so are those that are zero.",
        );
        self.mass_matrix.write(&mut page);

        page.heading("Generalised force");
        page.prose(
            "The remaining terms of Lagrange's equations form the right-hand side: \
         `f = f_inertial + f_spring + f_gravity + f_damping`.",
        );
        for (sentence, part) in &self.forces {
            page.prose(sentence);
            part.write(&mut page);
        }
        page.finish()
    }
}

/// `ċ_k` of each segment.
fn centre_velocities(
    segments: usize,
    motion: Motion,
    shape: RelaxedShape,
) -> Result<DerivationStep, String> {
    let mut graph = Graph::new();
    let g = &mut graph;
    let parameters = Parameters::new(g, segments, shape);
    let mut velocity = chain::ClampSymbols::new(g).velocity;
    let mut outputs = Vec::new();
    for (k, body) in (1..).zip(&parameters.bodies) {
        let segment = Segment::new(g, &k.to_string());
        let rate = segment.direction_rate(g);
        let rate = motion.specialise(g, &[segment], rate);
        let end = chain::outer_end(g, body, velocity, rate);
        let half = g.ratio(1, 2);
        let centre = std::array::from_fn(|i| {
            let sum = g.add(velocity[i], end[i]);
            g.mul(half, sum)
        });
        outputs.extend(components(motion, &format!("ċ_{k}_"), VELOCITY, centre));
        velocity = end;
    }
    DerivationStep::collected(motion, &graph, &parameters, outputs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_formula_of_the_page_is_in_its_place() {
        let common = [
            "\\dot e_{k,x} &= ",
            "E_{\\mathrm{kin}} &= ",
            "f_{\\mathrm{spring},\\theta_{1}} &= ",
        ];
        let spatial = ["\\dot c_{1,z} &= ", "p_{\\varphi_{1}} &= "];
        for motion in [Motion::Spatial, Motion::Planar] {
            let mut page = Vec::new();
            let walkthrough = Walkthrough::new(1, motion, RelaxedShape::default())
                .expect("the derivation is sound");
            walkthrough
                .write(&mut page, "a test", "command")
                .expect("memory can be written to");
            let page = String::from_utf8(page).expect("a page is text");
            for part in common {
                assert!(page.contains(part), "{motion:?}: {part}");
            }
            for part in spatial {
                assert_eq!(
                    page.contains(part),
                    motion == Motion::Spatial,
                    "{motion:?}: {part}"
                );
            }
        }
    }
}
