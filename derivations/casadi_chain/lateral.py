"""Kernels of the lateral variation."""

from collections.abc import Sequence
from dataclasses import replace

import casadi
from casadi import SX

from casadi_chain.energies import Segment, direction_near_plane
from casadi_chain.expressions import Argument, Derived, Motion, Result, Symbols
from casadi_chain.joints import (
    ALONG_PLANAR_MOTION,
    BLOCKS,
    Joint,
    Pair,
    joint_to_clamp,
    tangent_kernel,
)
from casadi_chain.segments import FreeSegment, step_weights


def lateral_variables(symbols: Symbols, label: str = "") -> tuple[tuple[SX, SX], list[Argument]]:
    """η and η̇ of a segment."""
    end = f"_{label}" if label else ""
    variation = symbols.scalar(f"phi_variation{end}", f"η{label}", "rad")
    rate = symbols.scalar(f"phi_variation_rate{end}", f"η̇{label}", "rad s^-1")
    arguments = [
        Argument.of_symbols(variation.name(), "η", variation),
        Argument.of_symbols(rate.name(), "η̇ in 1/s", rate),
    ]
    return (variation, rate), arguments


class LateralSegment:
    """The spatial equations of a segment: τ_φ, and p and ẍ' along z, to be varied in the plane."""

    def __init__(self) -> None:
        """Adds the variables of the planar motion, but not those of the variation."""
        symbols = Symbols()
        segment = Segment.near_plane(symbols)
        self.free = FreeSegment(symbols, segment)
        base_acceleration = symbols.vector("base_acceleration", "ẍ", "m s^-2", Motion.PLANAR)
        outer_force = symbols.vector("outer_force", "F", "N", Motion.PLANAR)
        base_height, force_height = SX.sym("base_acceleration_z"), SX.sym("outer_force_z")
        # θ̈ has no part in these equations: ∂e/∂θ is perpendicular to ∂e/∂φ and to z.
        accelerations = casadi.vertcat(SX.sym("depression_acceleration"), 0)
        torque, base_force, outer_acceleration = self.free.inverse_dynamics(
            accelerations,
            casadi.vertcat(base_acceleration, base_height),
            casadi.vertcat(outer_force, force_height),
        )
        self.torque = torque[0]
        self._all = torque[0], base_force[2], outer_acceleration[2]
        self.arguments = [
            segment.trigonometry("angles"),
            segment.rates_argument("rates"),
            Argument.of_symbols("base_acceleration", "ẍ in m/s², along x and y", base_acceleration),
            Argument.of_symbols("outer_force", "F in N, along x and y", outer_force),
        ]
        # ψ, ψ̇, ψ̈.
        self._lateral = casadi.vertcat(segment.coordinates[0], segment.rates[0], accelerations[0])
        # All variables of the lateral motion: zero in the plane.
        self._vanishing = casadi.vertcat(self._lateral, base_height, force_height)

    def variation(self, expression: SX, direction: Sequence[SX | int]) -> SX:
        """The derivative of `expression` along `direction` of ψ, ψ̇, ψ̈, in the plane."""
        slope = casadi.jtimes(expression, self._lateral, casadi.vertcat(*direction))
        return casadi.substitute(slope, self._vanishing, SX.zeros(self._vanishing.shape[0]))

    def variations(self, direction: Sequence[SX | int]) -> list[SX]:
        """Returns the variations of τ_φ, p and ẍ'."""
        return [self.variation(each, direction) for each in self._all]


def lateral_segment_kernel() -> Derived:
    """`lateral_segment`: as `segment`, of the variation along z."""
    segment = LateralSegment()
    free = segment.free
    (variation, rate), variables = lateral_variables(free.symbols)
    inertia, coupling, reach_slope = segment.variations((0, 0, 1))
    bias, reach, reach_rate = (
        segment.variation(each, (variation, rate, 0))
        for each in (segment.torque, *(vector[2] for vector in free.reach))
    )
    results = [
        Result.matrix("inertia", "`I = ∂τ_φ/∂η̈`", "kg m^2", inertia),
        Result.matrix("coupling", "`C = ∂p_z/∂η̈ = ∂τ_φ/∂z̈`", "kg m", coupling),
        Result.vector("bias", "`τ_0`: `τ_φ` for `z̈ = 0`, `η̈ = 0`, `F_z = 0`", "N m", bias),
        Result.vector("reach", "`z' − z`, outer end less inner end", "m", reach),
        Result.vector("reach_rate", "`ż' − ż`", "m s^-1", reach_rate),
        Result.matrix("reach_jacobian", "`G = ∂z̈'/∂η̈`", "m", reach_slope),
    ]
    summary = (
        "Kinematics and inertia of one segment, seen from its inner end:\n"
        "`p_z = m z̈ + C η̈ + F_z`, `τ_φ = C z̈ + I η̈ + τ_0 + G F_z`, `z̈' = z̈ + G η̈`.\n"
        f"{ALONG_PLANAR_MOTION}"
    )
    arguments = [*segment.arguments, *variables, *free.constants()]
    return Derived("lateral_segment", summary, free.symbols, arguments, results)


def lateral_segment_tangent_kernel() -> Derived:
    """`lateral_segment_tangent`: derivatives of torque and force by the acceleration."""
    segment = LateralSegment()
    free = segment.free
    coordinate_weight, rate_weight, weights = step_weights(free.symbols)
    step = (coordinate_weight, rate_weight, 1)
    torque, base_force, outer_acceleration = segment.variations(step)
    results = [
        Result.matrix("torque", "`∂τ_φ/∂η̈`", "kg m^2", torque),
        Result.matrix("base_force", "`∂p_z/∂η̈`", "kg m", base_force),
        Result.matrix("outer_acceleration", "`∂z̈'/∂η̈`", "m", outer_acceleration),
    ]
    summary = (
        "Tangent of one segment: how `τ_φ`, `p_z` and `z̈'` of [`lateral_segment`] change with its "
        "own `η̈` when\n"
        f"`δη = w_q δη̈` and `δη̇ = w_v δη̈`, for fixed `z̈` and `F_z`.\n{ALONG_PLANAR_MOTION}"
    )
    arguments = [*segment.arguments, *free.constants(), *weights]
    return Derived("lateral_segment_tangent", summary, free.symbols, arguments, results)


def lateral_joint() -> Joint:
    """The spatial joint as a function of the polar angles alone, in the plane.

    In a frame turned about z, as in `joint_in_turned_frame`.
    """
    symbols = Symbols()
    frame = SX.sym("frame")

    def direction(depression: SX, theta: SX) -> SX:
        return direction_near_plane(depression, theta - frame)

    previous = Segment.near_plane(symbols, "previous", direction)
    following = Segment.near_plane(symbols, "next", direction)
    pair = Pair(symbols, previous, following)
    angles = [pair.azimuth_step(), pair.unbent_step()]
    polar = casadi.vertcat(previous.coordinates[0], following.coordinates[0])
    polar_rates = casadi.vertcat(previous.rates[0], following.rates[0])
    in_plane = casadi.vertcat(SX.zeros(4), following.theta)
    return replace(
        pair.joint(angles, previous.turned(pair.relaxed_angle), following.sides[0]),
        coordinates=polar,
        rates=polar_rates,
        known=(casadi.vertcat(polar, polar_rates, frame), in_plane),
    )


def lateral_clamp() -> tuple[Joint, SX]:
    """The spatial clamp joint as a function of the polar angle alone, in the plane, and e_0z."""
    symbols = Symbols()
    in_plane = symbols.vector("relaxed_direction", "ē0", "1", Motion.PLANAR)
    height = SX.sym("clamp_direction_z")
    following = Segment.near_plane(symbols, "next")
    joint = joint_to_clamp(symbols, casadi.vertcat(in_plane, height), following)
    polar, polar_rate = following.coordinates[0], following.rates[0]
    known = casadi.vertcat(polar, polar_rate, height), SX.zeros(3)
    return replace(joint, coordinates=polar, rates=polar_rate, known=known), height


def lateral_joint_kernels() -> list[Derived]:
    """`lateral_joint`, `lateral_joint_tangent`."""
    joint = lateral_joint()
    (previous, previous_rate), previous_arguments = lateral_variables(joint.symbols, "previous")
    (following, following_rate), next_arguments = lateral_variables(joint.symbols, "next")
    torques = joint.variation(
        casadi.vertcat(joint.coordinates, joint.rates),
        casadi.vertcat(previous, following, previous_rate, following_rate),
    )
    results = [
        Result.vector("previous", "torque on `φ` of the previous segment", "N m", torques[0]),
        Result.vector("next", "torque on `φ` of the next segment", "N m", torques[1]),
    ]
    return [
        Derived(
            "lateral_joint",
            "Torques of a joint on the polar angles of the two segments that it connects.\n"
            f"{ALONG_PLANAR_MOTION}",
            joint.symbols,
            [*joint.state, *previous_arguments, *next_arguments, *joint.constants],
            results,
        ),
        tangent_kernel("lateral_joint", "a joint", lateral_joint(), BLOCKS, is_lateral=True),
    ]


def lateral_clamp_kernels() -> list[Derived]:
    """`lateral_clamp`, `lateral_clamp_tangent`."""
    block = [("next_next", "first segment along its `η̈`")]
    joint, height = lateral_clamp()
    (variation, rate), variables = lateral_variables(joint.symbols, "next")
    torque = joint.variation(
        casadi.vertcat(joint.coordinates, joint.rates, height),
        casadi.vertcat(variation, rate, 1),
    )
    return [
        Derived(
            "lateral_clamp",
            "Torque of the clamp joint on the polar angle of the first segment. The clamp itself "
            f"varies by `∂e0z/∂τ = 1`.\n{ALONG_PLANAR_MOTION}",
            joint.symbols,
            [*joint.arguments, *variables],
            [Result.vector("next", "torque on `φ` of the first segment", "N m", torque)],
        ),
        tangent_kernel(
            "lateral_clamp", "the clamp joint", lateral_clamp()[0], block, is_lateral=True
        ),
    ]
