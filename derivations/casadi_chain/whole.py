"""Whole equations of a chain."""

from collections.abc import Iterable

import casadi
from casadi import SX

from casadi_chain.energies import (
    DIRECTION_OF,
    Segment,
    dissipation,
    gravity_energy,
    kinetic_energy,
    planar_spring_energy,
    rigid_rate,
    spring_energy,
    turned,
)
from casadi_chain.expressions import Argument, Derived, Motion, Result, Symbols


def chain_arguments(symbols: Symbols, segments: int, motion: Motion) -> list[Argument]:
    """Returns the arguments that all three functions of a chain have, in order."""
    spatial, numbers = motion is Motion.SPATIAL, range(1, segments + 1)
    axes, turning = motion.axes, "xyz" if spatial else "z"

    def each(ends: Iterable[object], name: str, notation: str, unit: str, doc: str) -> Argument:
        found = [symbols.scalar(f"{name}_{end}", f"{notation}{end}", unit) for end in ends]
        return Argument.of_symbols(name, doc, casadi.vertcat(*found))

    def of_angles(rate: str, dot: str, unit: str) -> SX:
        found = [
            symbols.scalar(f"{name}{rate}_{k}", f"{letter}{dot}{k}", unit)
            for k in numbers
            for name, letter in motion.angles
        ]
        return casadi.vertcat(*found)

    q_doc = "φ1, θ1, φ2, … in rad" if spatial else "θ1, θ2, … in rad"
    v_doc = "φ̇1, θ̇1, φ̇2, … in rad/s" if spatial else "θ̇1, θ̇2, … in rad/s"
    turning_doc = "Ω of the body in rad/s" if spatial else "Ω of the body in rad/s, along z"
    return [
        Argument.of_symbols("q", q_doc, of_angles("", "", "rad")),
        Argument.of_symbols("v", v_doc, of_angles("_rate", "̇", "rad s^-1")),
        each(axes, "root_position", "r0", "m", "r0 in m"),
        each(axes, "root_velocity", "ṙ0", "m s^-1", "ṙ0 in m/s"),
        each(axes, "root_acceleration", "r̈0", "m s^-2", "r̈0 in m/s²"),
        each(axes, "clamp_direction", "e0", "1", "e0"),
        each(turning, "angular_velocity", "Ω", "rad s^-1", turning_doc),
        each(axes, "gravity", "g", "m s^-2", "g in m/s²"),
        Argument.of_symbols("segment_length", "h in m", symbols.scalar("segment_length", "h", "m")),
        each(numbers, "segment_mass", "m", "kg", "m1, m2, … in kg"),
        each(numbers, "segment_inertia", "J", "kg m^2", "J1, J2, … in kg m²"),
        each(numbers, "joint_stiffness", "c", "N m", "c1, c2, … in N m"),
        each(numbers, "joint_damping", "d", "N m s", "d1, d2, … in N m s"),
        each(numbers, "relaxed_angle", "κ", "rad", "κ1, κ2, … in rad"),
    ]


def whole_equations(segments: int, motion: Motion) -> list[Derived]:
    """Mass matrix, force and energies of a chain, as functions of the same arguments."""
    symbols = Symbols()
    arguments = chain_arguments(symbols, segments, motion)
    variables = {
        argument.name: casadi.vertcat(*(variable for _, variable in argument.elements))
        for argument in arguments
    }
    q, v = variables["q"], variables["v"]
    root_velocity, root_acceleration = variables["root_velocity"], variables["root_acceleration"]
    length = variables["segment_length"]
    size = len(motion.angles)

    kinetic, spring, weight, dissipated = SX(0), SX(0), SX(0), SX(0)
    node, node_velocity = variables["root_position"], root_velocity
    body_rate = variables["angular_velocity"]
    inner_direction, inner = variables["clamp_direction"], None
    for k in range(segments):
        own = slice(size * k, size * (k + 1))
        segment = Segment(str(k + 1), motion, q[own], v[own], DIRECTION_OF[motion])
        direction, direction_rate = segment.sides
        centre = node + length / 2 * direction
        centre_velocity = node_velocity + length / 2 * direction_rate
        mass, inertia = variables["segment_mass"][k], variables["segment_inertia"][k]
        kinetic += kinetic_energy(mass, inertia, centre_velocity, direction_rate)
        weight += gravity_energy(mass, variables["gravity"], centre)
        stiffness, relaxed_angle = variables["joint_stiffness"][k], variables["relaxed_angle"][k]
        if motion is Motion.PLANAR and k > 0:
            spring += planar_spring_energy(stiffness, q[k - 1], q[k], relaxed_angle)
        else:
            relaxed = turned(inner_direction, casadi.sin(relaxed_angle), casadi.cos(relaxed_angle))
            spring += spring_energy(stiffness, relaxed, direction)
        outer = (direction, direction_rate - rigid_rate(body_rate, direction))
        dissipated += dissipation(variables["joint_damping"][k], inner, outer)
        node, node_velocity = node + length * direction, node_velocity + length * direction_rate
        inner_direction, inner = direction, outer

    # Lagrange's equations. M = ∂²E_kin/∂q̇²; the momenta change with q, q̇ and ṙ_0, and the terms
    # without q̈ go to the right.
    mass_matrix, momenta = casadi.hessian(kinetic, v)
    momenta_rate = casadi.jtimes(
        momenta, casadi.vertcat(q, root_velocity), casadi.vertcat(v, root_acceleration)
    )
    force = (
        casadi.gradient(kinetic, q)
        - momenta_rate
        - casadi.gradient(spring + weight, q)
        - casadi.gradient(dissipated, v)
    )
    force = casadi.substitute(force, root_velocity, SX.zeros(len(motion.axes)))

    planar = "planar " if motion is Motion.PLANAR else ""
    chain = f"a {planar}chain of {segments} segment{'' if segments == 1 else 's'}"
    coordinates = "φ1, θ1, φ2, …" if motion is Motion.SPATIAL else "θ1, θ2, …"
    rows = f"{q.numel()} × {q.numel()}"
    matrix_doc = f"`M`, {rows}, symmetric, rows and columns `{coordinates}`"
    results = {
        "mass_matrix": [Result.matrix("mass_matrix", matrix_doc, "kg m^2", mass_matrix)],
        "force": [Result.vector("force", "`f` of `M q̈ = f + Q`, without contact", "N m", force)],
        "energies": [
            Result.scalar("kinetic", "`E_kin`", "J", kinetic),
            Result.scalar("spring", "`E_spring`", "J", spring),
            Result.scalar("gravity", "`E_grav`", "J", weight),
            Result.scalar("dissipation", "`D`", "W", dissipated),
        ],
    }
    summaries = (
        f"Mass matrix of {chain}: `M = ∂²E_kin/∂q̇²`.",
        f"Generalised force of {chain}: "
        "`f = −d/dt(∂E_kin/∂q̇) + ∂E_kin/∂q − ∂E_pot/∂q − ∂D/∂q̇`,\n"
        "the first term without its part in `q̈`, `E_pot = E_spring + E_grav`.",
        f"Energies and dissipation function of {chain}.",
    )
    return [
        Derived(motion.named(name), summary, symbols, arguments, of_function)
        for (name, of_function), summary in zip(results.items(), summaries, strict=True)
    ]
