//! The derivatives of one segment and of one joint, over which the solver loops in O(n).
//!
//! A segment is seen from its inner end `x`, with the coordinates `(x, φ, θ)`. Lagrange's equations
//! for them give the force `p` that must act at `x` and the torques `τ` that must act on `(φ, θ)`:
//!
//! ```text
//! p = m ẍ + C q̈ + p_0 + F,   τ = Cᵀ ẍ + I q̈ + τ_0 + Gᵀ F,   ẍ' = ẍ + G q̈ + b,
//! ```
//!
//! where `F` is the force that the outer part of the chain needs at the segment's outer end `x'`. A
//! joint adds torques to the two segments that it connects. Its damper sees the rates in the body:
//! those of the segments less those of a segment that turns rigidly with it (`rigid_rates`).
//! Tangents are derivatives along `q̈` in an implicit step, whose coordinates and rates follow:
//! `δq = w_q δq̈`, `δq̇ = w_v δq̈`.
//!
//! The sines and cosines of the coordinates are inputs of the kernels, so that the solver computes
//! each once per segment.
//!
//! In the plane of rotation a segment has the one coordinate `θ`, and vectors have two
//! components. The same functions derive these kernels from the energies for `φ = π/2`; their names
//! begin with `planar_`. [`super::lateral`] adds the linearised equations of the motion out of that
//! plane.

use std::collections::BTreeMap;

use crate::ir::graph::{Graph, NodeId};
use crate::ir::kernel::{Kernel, KernelInput, Output};
use crate::ir::unit::Unit;
use crate::model::arguments::{COORDINATE, SIDE, joint_constants, segment_constants, weights};
use crate::model::chain::{
    self, ACCELERATION, ANGULAR_RATE, INERTIA, Motion, Segment, VELOCITY, vector_symbol,
};
use crate::model::elements::{
    Derivation, FreeSegment, InverseDynamics, MASS_LENGTH, RigidRates, TORQUE, azimuth_steps,
    clamp_inputs, rates, rates_in_body, side, sine_and_cosine, step_weights, transpose,
    trigonometry, unbent_azimuth, vector_input,
};
use crate::model::joint::{BLOCKS, Joint, RelaxedClamp, tangent_kernel};
use crate::model::lateral;
use crate::passes::calculus::{directional_derivative, gradient, jacobian};
use crate::passes::normal_form::Style;
use crate::passes::specialise::substitute;

/// Kernels for motion in space, in the order in which the solver uses them.
///
/// # Errors
/// If a term of the derivation makes no physical sense.
pub fn spatial_kernels() -> Result<Vec<Kernel>, String> {
    let mut kernels = of_motion(Motion::Spatial)?;
    kernels.push(rigid_rates()?);
    Ok(kernels)
}

/// Kernels for motion in the plane of rotation, then those of its lateral variation
/// ([`super::lateral`]).
///
/// # Errors
/// If a term of the derivation makes no physical sense.
pub fn planar_kernels() -> Result<Vec<Kernel>, String> {
    let mut kernels = of_motion(Motion::Planar)?;
    kernels.extend(lateral::kernels()?);
    Ok(kernels)
}

/// All kernels of the solver: [`spatial_kernels`], then [`planar_kernels`].
///
/// # Errors
/// If a term of the derivation makes no physical sense.
pub fn kernels() -> Result<Vec<Kernel>, String> {
    let mut kernels = spatial_kernels()?;
    kernels.extend(planar_kernels()?);
    Ok(kernels)
}

fn of_motion(motion: Motion) -> Result<Vec<Kernel>, String> {
    let derivations = [
        segment,
        segment_tangent,
        segment_energy,
        joint,
        joint_tangent,
        joint_energy,
        clamp,
        clamp_tangent,
        clamp_energy,
    ];
    derivations
        .into_iter()
        .map(|derive| derive(motion))
        .collect()
}

fn segment(motion: Motion) -> Result<Kernel, String> {
    let InverseDynamics {
        mut free,
        base_acceleration,
        accelerations,
        outer_force,
        torque,
        base_force,
        reach_acceleration,
    } = InverseDynamics::new(motion);
    let g = &mut free.graph;
    let inertia = jacobian(g, &torque, &accelerations);
    let coupling = jacobian(g, &base_force, &accelerations);
    let reach_jacobian = jacobian(g, &reach_acceleration, &accelerations);
    let zero = g.integer(0);
    let at_rest = accelerations
        .iter()
        .chain(&base_acceleration)
        .chain(&outer_force)
        .map(|symbol| (*symbol, zero))
        .collect();
    let bias = substitute(g, &torque, &at_rest);
    let base_bias = substitute(g, &base_force, &at_rest);
    let reach_bias = substitute(g, &reach_acceleration, &at_rest);
    let outputs = vec![
        Output::matrix("inertia", "`I = ∂²E_kin/∂q̇²`", INERTIA, inertia),
        Output::matrix("coupling", "`C = ∂²E_kin/∂ẋ∂q̇`", MASS_LENGTH, coupling),
        Output::vector(
            "bias",
            "`τ_0 = d/dt(∂E_kin/∂q̇) − ∂E_kin/∂q` for `ẍ = 0`, `q̈ = 0`",
            TORQUE,
            bias,
        ),
        Output::vector(
            "base_bias",
            "`p_0 = d/dt(∂E_kin/∂ẋ)` for `ẍ = 0`, `q̈ = 0`",
            Unit::NEWTON,
            base_bias,
        ),
        Output::vector(
            "reach",
            "`h e`, outer end less inner end",
            Unit::METRE,
            free.reach,
        ),
        Output::vector("reach_rate", "`h ė`", VELOCITY, free.reach_rate),
        Output::matrix(
            "reach_jacobian",
            "`G = ∂(h e)/∂q`",
            Unit::METRE,
            reach_jacobian,
        ),
        Output::vector(
            "reach_bias",
            "`b = h ë` for `q̈ = 0`",
            ACCELERATION,
            reach_bias,
        ),
    ];
    let summary = "Kinematics and inertia of one segment, seen from its inner end `x`:\n\
                   `p = m ẍ + C q̈ + p_0 + F`, `τ = Cᵀ ẍ + I q̈ + τ_0 + Gᵀ F`, `ẍ' = ẍ + G q̈ + b`,\n\
                   from `E_kin = ½ m |ẋ + ½ h ė|² + ½ J |ė|²`.";
    Derivation {
        graph: free.graph,
        outputs,
    }
    .kernel_for(motion, "segment", summary, Some(Style::Cheap), |graph| {
        let moving = vec![
            trigonometry(graph, motion, "angles", ""),
            rates(graph, motion, "rates", ""),
        ];
        [moving, segment_constants(graph)].concat()
    })
}

fn segment_tangent(motion: Motion) -> Result<Kernel, String> {
    let InverseDynamics {
        mut free,
        accelerations,
        torque,
        base_force,
        reach_acceleration,
        ..
    } = InverseDynamics::new(motion);
    let [coordinates, rates_of] = free.variables();
    let g = &mut free.graph;
    let (coordinate_weight, rate_weight) = step_weights(g);
    let one = g.integer(1);
    let mut along_step = |outputs: &[NodeId]| {
        let mut columns = Vec::new();
        for i in 0..coordinates.len() {
            let direction = BTreeMap::from([
                (coordinates[i], coordinate_weight),
                (rates_of[i], rate_weight),
                (accelerations[i], one),
            ]);
            columns.push(directional_derivative(g, outputs, &direction));
        }
        transpose(&columns)
    };
    let outputs = vec![
        Output::matrix("torque", "`∂τ/∂q̈`", INERTIA, along_step(&torque)),
        Output::matrix(
            "base_force",
            "`∂p/∂q̈`",
            MASS_LENGTH,
            along_step(&base_force),
        ),
        Output::matrix(
            "outer_acceleration",
            "`∂ẍ'/∂q̈`",
            Unit::METRE,
            along_step(&reach_acceleration),
        ),
    ];
    let derivation = Derivation {
        graph: free.graph,
        outputs,
    };
    let plain = motion.name_for("segment");
    let summary = format!(
        "Tangent of one segment: how `τ`, `p` and `ẍ'` of [`{plain}`] change with its own `q̈` when\n\
         `δq = w_q δq̈` and `δq̇ = w_v δq̈`, for fixed `ẍ` and `F`."
    );
    derivation.kernel_for(
        motion,
        "segment_tangent",
        &summary,
        Some(Style::Cheap),
        |graph| {
            let inputs = vec![
                trigonometry(graph, motion, "angles", ""),
                rates(graph, motion, "rates", ""),
                match motion {
                    Motion::Spatial => {
                        let names = ["phi_acceleration", "theta_acceleration"];
                        KernelInput::symbols(graph, "accelerations", "φ̈, θ̈ in rad/s²", &names)
                    }
                    Motion::Planar => KernelInput::symbols(
                        graph,
                        "theta_acceleration",
                        "θ̈ in rad/s²",
                        &["theta_acceleration"],
                    ),
                },
                vector_input(graph, motion, "base_acceleration", "ẍ in m/s²"),
                vector_input(graph, motion, "outer_force", "F in N"),
            ];
            [inputs, segment_constants(graph), weights(graph)].concat()
        },
    )
}

fn segment_energy(motion: Motion) -> Result<Kernel, String> {
    let free = FreeSegment::new(motion);
    let mut graph = free.graph;
    let base = vector_symbol(&mut graph, "base_position", "x", Unit::METRE);
    let (direction, pull) = (
        free.segment.direction(&mut graph),
        chain::gravity(&mut graph),
    );
    let gravity = chain::gravity_energy(&mut graph, &free.body, pull, base, direction);
    let [gravity] = motion.specialise(&mut graph, &[free.segment], [gravity]);
    let outputs = vec![
        Output::scalar("kinetic", "`E_kin`", Unit::JOULE, free.kinetic_energy),
        Output::scalar("gravity", "`E_grav`", Unit::JOULE, gravity),
    ];
    let summary = "Energies of one segment: `E_kin = ½ m |ẋ + ½ h ė|² + ½ J |ė|²` and `E_grav = −m g·(x + ½ h e)`.";
    Derivation { graph, outputs }.kernel_for(motion, "segment_energy", summary, None, |graph| {
        let inputs = vec![
            trigonometry(graph, motion, "angles", ""),
            rates(graph, motion, "rates", ""),
            vector_input(graph, motion, "base_position", "x in m"),
            vector_input(graph, motion, "base_velocity", "ẋ in m/s"),
            vector_input(graph, motion, "gravity", "g in m/s²"),
        ];
        [inputs, segment_constants(graph)].concat()
    })
}

/// Inputs of a joint between two segments. Only the difference of the azimuths enters, because the
/// energies do not change when both sides turn about `z`.
fn joint_inputs(graph: &mut Graph, motion: Motion) -> Vec<KernelInput> {
    let angles = match motion {
        Motion::Spatial => {
            let [previous, next] = ["previous", "next"].map(|name| {
                let polar = Segment::new(graph, name).phi;
                let angles = sine_and_cosine(graph, &format!("phi_{name}"), polar);
                KernelInput::new(name, "sin φ, cos φ", angles).in_group(&SIDE, name, "angles")
            });
            let [plain, unbent] = azimuth_steps(graph);
            vec![previous, next, plain, unbent]
        }
        Motion::Planar => vec![
            KernelInput::symbols(graph, "theta_previous", "θ in rad", &["theta_previous"])
                .in_group(&COORDINATE, "previous", "value"),
            KernelInput::symbols(
                graph,
                "theta_next",
                "θ' in rad, less than π from θ + κ",
                &["theta_next"],
            )
            .in_group(&COORDINATE, "next", "value"),
            KernelInput::symbols(graph, "relaxed_angle", "κ in rad", &["relaxed_angle"]),
        ],
    };
    let rates = ["previous", "next"].map(|label| match motion {
        Motion::Spatial => rates_in_body(graph, motion, &format!("{label}_rates"), label),
        // Only the difference of both rates enters.
        Motion::Planar => rates(graph, motion, "", label).in_group(&COORDINATE, label, "rate"),
    });
    [angles, rates.into(), joint_constants(graph)].concat()
}

/// Kernel of the torques of `joint` on its `sides`, each given by the names of the output and of
/// the segment.
fn torques_kernel(
    name: &str,
    summary: &str,
    mut joint: Joint,
    sides: &[(&str, &str)],
    inputs: impl FnOnce(&mut Graph) -> Vec<KernelInput>,
) -> Result<Kernel, String> {
    let what = match joint.motion {
        Motion::Spatial => "torques on `(φ, θ)`",
        Motion::Planar => "torque on `θ`",
    };
    let torques = joint.torques();
    let torques = torques.chunks(torques.len() / sides.len());
    let output = |(&(side, segment), torques): (&(&str, &str), &[NodeId])| {
        Output::vector(
            side,
            &format!("{what} of the {segment}"),
            TORQUE,
            torques.to_vec(),
        )
    };
    let outputs = sides.iter().zip(torques).map(output).collect();
    Derivation {
        graph: joint.graph,
        outputs,
    }
    .kernel_for(joint.motion, name, summary, Some(Style::Cheap), inputs)
}

/// The sides of a joint between two segments.
const SIDES: [(&str, &str); 2] = [("previous", "previous segment"), ("next", "next segment")];

/// The energy and dissipation function of a joint between two segments in the plane.
const PLANAR_ENERGIES: &str = "`E_spring = ½ c (θ' − θ − κ)²` and `D = ½ d (θ̇' − θ̇)²`.";

fn joint(motion: Motion) -> Result<Kernel, String> {
    let energies = match motion {
        Motion::Spatial => {
            "`E_spring = c S(u)`, `u = ½|ē' − e|² = 1 − cos α`, `S = ½α²`, with `e'` turned back about `z` by the relaxed angle `κ` \
             to `ē'`, and\n`D = ½ d |ω' − ω|²`, `ω = e × ė` with the rates in the body."
        }
        Motion::Planar => PLANAR_ENERGIES,
    };
    let summary = format!(
        "Torques of a joint, `−∂E_spring/∂q − ∂D/∂q̇`, on the two segments that it connects, from\n{energies}"
    );
    torques_kernel(
        "joint",
        &summary,
        Joint::between_segments(motion),
        &SIDES,
        |graph| joint_inputs(graph, motion),
    )
}

fn joint_tangent(motion: Motion) -> Result<Kernel, String> {
    let (plain, size) = (motion.name_for("joint"), motion.coordinates_per_segment());
    let summary = format!(
        "Tangent of a joint: minus the derivative of the torques of [`{plain}`] along `q̈`, when\n\
         `δq = w_q δq̈` and `δq̇ = w_v δq̈`. Each block is {size} × {size}."
    );
    let tangent = Joint::between_segments(motion).tangent();
    tangent_kernel(
        motion,
        "joint_tangent",
        &summary,
        tangent,
        &BLOCKS,
        |graph| match motion {
            Motion::Spatial => joint_inputs(graph, motion),
            // The torques are linear, so the state does not enter.
            Motion::Planar => joint_constants(graph),
        },
    )
}

fn energies(joint: &Joint) -> Vec<Output> {
    vec![
        Output::scalar("spring", "`E_spring`", Unit::JOULE, joint.spring_energy),
        Output::scalar("dissipation", "`D`", Unit::WATT, joint.dissipation),
    ]
}

fn joint_energy(motion: Motion) -> Result<Kernel, String> {
    let joint = Joint::between_segments(motion);
    let derivation = Derivation {
        outputs: energies(&joint),
        graph: joint.graph,
    };
    let formulas = match motion {
        Motion::Spatial => {
            "`E_spring = c S(½|ē' − e|²)` and `D = ½ d |ω' − ω|²`, `ω = e × ė` with the rates in the body."
        }
        Motion::Planar => PLANAR_ENERGIES,
    };
    let summary = format!("Energy and dissipation function of a joint: {formulas}");
    let style = if motion == Motion::Spatial {
        None
    } else {
        Some(Style::Cheap)
    };
    derivation.kernel_for(
        motion,
        "joint_energy",
        &summary,
        style,
        |graph| match motion {
            Motion::Spatial => {
                let inputs = vec![
                    side(graph, "previous"),
                    side(graph, "next"),
                    unbent_azimuth(graph, "next"),
                    rates_in_body(graph, motion, "previous_rates", "previous"),
                    rates_in_body(graph, motion, "next_rates", "next"),
                ];
                [inputs, joint_constants(graph)].concat()
            }
            Motion::Planar => joint_inputs(graph, motion),
        },
    )
}

/// Kernel of the motion of a segment that turns rigidly with the body.
fn rigid_rates() -> Result<Kernel, String> {
    let RigidRates {
        graph,
        rates,
        slopes,
    } = RigidRates::new();
    let outputs = vec![
        Output::vector("rates", "`q̇_r`", ANGULAR_RATE, rates),
        Output::matrix("slopes", "`∂q̇_r/∂q`, 2 × 2", ANGULAR_RATE, slopes),
    ];
    let summary = "Rates of a segment that turns rigidly with the body, `Ω × e = (∂e/∂q) q̇_r`, and how they change with its coordinates.\n\
                   In the chart about x the components of `Ω` are in the order y, z, x.";
    Derivation { graph, outputs }.kernel("rigid_rates", summary, Some(Style::Cheap), |graph| {
        vec![
            trigonometry(graph, Motion::Spatial, "angles", ""),
            vector_input(
                graph,
                Motion::Spatial,
                "angular_velocity",
                "Ω of the body in rad/s",
            ),
        ]
    })
}

fn clamp(motion: Motion) -> Result<Kernel, String> {
    let plain = motion.name_for("joint");
    let summary = format!(
        "Torques of the clamp joint on the first segment, `−∂E_spring/∂q − ∂D/∂q̇`, as in [`{plain}`], with\n\
         the clamp's `ē0` and `ω0 = 0` on the inner side."
    );
    let sides = [("next", "first segment")];
    torques_kernel(
        "clamp",
        &summary,
        Joint::at_clamp(motion),
        &sides,
        |graph| clamp_inputs(graph, motion),
    )
}

fn clamp_tangent(motion: Motion) -> Result<Kernel, String> {
    let plain = motion.name_for("clamp");
    let summary = format!(
        "Tangent of the clamp joint: minus the derivative of the torques of [`{plain}`] along `q̈`, when\n\
         `δq = w_q δq̈` and `δq̇ = w_v δq̈`."
    );
    let blocks = [("next_next", "the first segment along its `q̈`")];
    tangent_kernel(
        motion,
        "clamp_tangent",
        &summary,
        Joint::at_clamp(motion).tangent(),
        &blocks,
        |graph| clamp_inputs(graph, motion),
    )
}

fn clamp_energy(motion: Motion) -> Result<Kernel, String> {
    let mut joint = Joint::at_clamp(motion);
    let g = &mut joint.graph;
    let RelaxedClamp {
        direction,
        direction_rate,
    } = joint.clamp;
    let elastic = gradient(g, joint.spring_energy, &direction[..motion.axes()]);
    let power = g.dot(&elastic, &direction_rate);
    let mut outputs = energies(&joint);
    outputs.push(Output::scalar(
        "power",
        "`∂E_spring/∂ē0·ē̇0`, what the turning clamp puts into the spring",
        Unit::WATT,
        power,
    ));
    let summary = "Energy and dissipation function of the clamp joint, `c S(½|e' − ē0|²)` and `½ d |ω'|²`, and the power of\n\
                   its turning against the spring, `∂E_spring/∂ē0·ē̇0`.";
    Derivation {
        graph: joint.graph,
        outputs,
    }
    .kernel_for(motion, "clamp_energy", summary, None, |graph| {
        let mut inputs = clamp_inputs(graph, motion);
        inputs.push(vector_input(
            graph,
            motion,
            "relaxed_direction_rate",
            "ē̇0 in 1/s",
        ));
        inputs
    })
}
