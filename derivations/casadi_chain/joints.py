"""Kernels of a joint between two segments, and of the clamp joint."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import casadi
from casadi import SX

from casadi_chain.energies import (
    Segment,
    direction_about_z,
    dissipation,
    planar_spring_energy,
    sine_and_cosine,
    spring_energy,
)
from casadi_chain.expressions import Argument, Derived, Motion, Result, Symbols, kernel
from casadi_chain.segments import along_step, step_weights

# Domain of the lateral kernels.
ALONG_PLANAR_MOTION = (
    "Lateral variation of a motion in the plane of rotation: "
    "`q = η = ∂φ/∂τ`, where `τ` is the tilt of the clamp."
)


@dataclass(frozen=True)
class Joint:
    """Energy and dissipation function of a joint between `sides`, as functions of coordinates."""

    symbols: Symbols
    sides: int
    coordinates: SX
    rates: SX
    # Arguments of the kernels.
    state: list[Argument]
    constants: list[Argument]
    spring: SX
    dissipation: SX
    # Variables that the kernels do not have, and their values after all differentiation.
    known: tuple[SX, SX] | None = None

    @property
    def arguments(self) -> list[Argument]:
        """The state and the constants."""
        return [*self.state, *self.constants]

    def torques(self) -> SX:
        """−∂E_spring/∂q − ∂D/∂q̇ in N m."""
        return self._with_known(-self._resistance())

    def tangent(self, coordinate_weight: SX, rate_weight: SX) -> SX:
        """Minus the derivative of the torques along q̈, in N m s²."""
        step = [(self.coordinates, coordinate_weight), (self.rates, rate_weight)]
        size = self.coordinates.shape[0]
        return self._with_known(along_step(self._resistance(), step, size))

    def variation(self, variables: SX, direction: SX) -> SX:
        """The derivative of the torques when `variables` change along `direction`."""
        return self._with_known(casadi.jtimes(-self._resistance(), variables, direction))

    def energies(self) -> list[Result]:
        """E_spring and D."""
        return [
            Result.scalar("spring", "`E_spring`", "J", self.spring),
            Result.scalar("dissipation", "`D`", "W", self.dissipation),
        ]

    def _resistance(self) -> SX:
        return casadi.gradient(self.spring, self.coordinates) + casadi.gradient(
            self.dissipation, self.rates
        )

    def _with_known(self, expression: SX) -> SX:
        return expression if self.known is None else casadi.substitute(expression, *self.known)


def joint_constants(symbols: Symbols) -> tuple[SX, SX, list[Argument]]:
    """c and d, and both as arguments."""
    stiffness = symbols.scalar("joint_stiffness", "c", "N m")
    damping = symbols.scalar("joint_damping", "d", "N m s")
    arguments = [
        Argument.of_symbols("joint_stiffness", "c in N m", stiffness),
        Argument.of_symbols("joint_damping", "d in N m s", damping),
    ]
    return stiffness, damping, arguments


def unbent_azimuth(segment: Segment, relaxed_angle: SX) -> Argument:
    """Sine and cosine of θ − κ as an argument."""
    name, doc = f"unbent_{segment.label}", "sin(θ − κ), cos(θ − κ), with the relaxed angle κ"
    return Argument(name, doc, sine_and_cosine(name, segment.theta - relaxed_angle))


class Pair:
    """Two segments, the constants of the joint between them, and its relaxed angle κ."""

    def __init__(self, symbols: Symbols, inner: Segment, outer: Segment) -> None:
        self.symbols, self.inner, self.outer = symbols, inner, outer
        self.coordinates = casadi.vertcat(inner.coordinates, outer.coordinates)
        self.rates = casadi.vertcat(inner.rates, outer.rates)
        self.stiffness, self.damping, self.constants = joint_constants(symbols)
        self.relaxed_angle = symbols.scalar("relaxed_angle", "κ", "rad")

    @classmethod
    def new(cls, motion: Motion, direction_of: Callable[..., SX] | None = None) -> "Pair":
        """Creates the previous segment and the next one, with the same axis."""
        symbols, labels = Symbols(), ("previous", "next")
        return cls(symbols, *(Segment.new(symbols, motion, each, direction_of) for each in labels))

    def azimuth_step(self) -> Argument:
        """Sine and cosine of θ − θ' as an argument."""
        name, doc = "azimuth_step", "sin(θ − θ'), cos(θ − θ'), with θ' of the next segment"
        return Argument(name, doc, sine_and_cosine(name, self.inner.theta - self.outer.theta))

    def unbent_step(self) -> Argument:
        """Sine and cosine of θ − θ' + κ as an argument."""
        name, doc = "unbent_step", "sin(θ − θ' + κ), cos(θ − θ' + κ), with the relaxed angle κ"
        step = self.inner.theta + self.relaxed_angle - self.outer.theta
        return Argument(name, doc, sine_and_cosine(name, step))

    def joint(self, angles: list[Argument], inner_direction: SX, outer_direction: SX) -> Joint:
        """Creates the joint from arguments of angles and the two directions of the spring."""
        sides = self.inner, self.outer
        return Joint(
            self.symbols,
            2,
            self.coordinates,
            self.rates,
            [*angles, *(side.rates_in_body(f"{side.label}_rates") for side in sides)],
            self.constants,
            spring_energy(self.stiffness, inner_direction, outer_direction),
            dissipation(self.damping, self.inner.sides, self.outer.sides),
        )


def joint_between_segments() -> Joint:
    """Creates the joint as the energies are stated."""
    pair = Pair.new(Motion.SPATIAL)
    angles = [pair.inner.trigonometry("previous"), pair.outer.trigonometry("next")]
    angles.append(unbent_azimuth(pair.outer, pair.relaxed_angle))
    return pair.joint(angles, pair.inner.sides[0], pair.outer.turned(-pair.relaxed_angle))


def joint_in_turned_frame() -> Joint:
    """Creates the joint in a resting frame turned by ψ about z.

    E_spring and D do not depend on ψ, so that their derivatives may be taken at fixed ψ. With
    ψ = θ' afterwards, the azimuths enter by θ − θ' and by θ − θ' + κ only.
    """
    frame = SX.sym("frame")
    pair = Pair.new(Motion.SPATIAL, lambda phi, theta: direction_about_z(phi, theta - frame))
    angles = [pair.inner.polar_trigonometry("previous"), pair.outer.polar_trigonometry("next")]
    angles += [pair.azimuth_step(), pair.unbent_step()]
    joint = pair.joint(angles, pair.inner.turned(pair.relaxed_angle), pair.outer.sides[0])
    return replace(joint, known=(frame, pair.outer.theta))


def planar_joint() -> Joint:
    """Creates the joint in the plane, where its angle is known."""
    pair = Pair.new(Motion.PLANAR)
    previous, following = pair.inner, pair.outer
    theta_doc = "θ' in rad, less than π from θ + κ"
    angles = previous.theta, following.theta, pair.relaxed_angle
    return Joint(
        pair.symbols,
        2,
        pair.coordinates,
        pair.rates,
        [
            Argument.of_symbols("theta_previous", "θ in rad", previous.theta),
            Argument.of_symbols("theta_next", theta_doc, following.theta),
            Argument.of_symbols("relaxed_angle", "κ in rad", pair.relaxed_angle),
            previous.rates_argument("previous_rates"),
            following.rates_argument("next_rates"),
        ],
        pair.constants,
        planar_spring_energy(pair.stiffness, *angles),
        # ω = θ̇, stated: CasADi does not see that e × ė reduces to it.
        pair.damping / 2 * (following.rates - previous.rates) ** 2,
    )


def clamp_joint(motion: Motion) -> tuple[Joint, SX, SX]:
    """Creates the joint between the clamp and the first segment.

    Also returns e_0 turned about z by the relaxed angle of the joint, and its rate.
    """
    symbols = Symbols()
    relaxed = symbols.vector("relaxed_direction", "ē0", "1", motion)
    rate = symbols.vector("relaxed_direction_rate", "ē̇0", "s^-1", motion)
    return joint_to_clamp(symbols, relaxed, Segment.new(symbols, motion, "next")), relaxed, rate


def joint_to_clamp(symbols: Symbols, relaxed: SX, following: Segment) -> Joint:
    """The joint between a clamp and the segment that follows; the kernel's arguments first."""
    stiffness, damping, constants = joint_constants(symbols)
    axes = len(following.motion.axes)
    outer = following.sides
    relaxed_doc = "ē0, which is e0 turned about z by the relaxed angle"
    return Joint(
        symbols,
        1,
        following.coordinates,
        following.rates,
        [
            Argument.of_symbols("relaxed_direction", relaxed_doc, relaxed[:axes]),
            following.trigonometry("next"),
            following.rates_in_body("next_rates"),
        ],
        constants,
        spring_energy(stiffness, relaxed, outer[0]),
        dissipation(damping, None, outer),
    )


def torques_kernel(
    name: str,
    summary: str,
    joint: Joint,
    sides: Sequence[tuple[str, str]],
    motion: Motion = Motion.SPATIAL,
) -> Derived:
    """The torques on each side; `sides` has the output's name and the segment's."""
    torques = casadi.vertsplit(joint.torques(), joint.coordinates.shape[0] // joint.sides)
    what = "torques on `(φ, θ)`" if torques[0].shape[0] == 2 else "torque on `θ`"
    results = [
        Result.vector(side, f"{what} of the {words}", "N m", torque)
        for torque, (side, words) in zip(torques, sides, strict=True)
    ]
    return kernel(motion, name, summary, joint.symbols, joint.arguments, results)


def tangent_kernel(
    name: str,
    subject: str,
    joint: Joint,
    blocks: Sequence[tuple[str, str]],
    motion: Motion = Motion.SPATIAL,
    is_lateral: bool = False,
) -> Derived:
    """The tangent of the kernel `name`, block by block.

    `blocks` has the output's name and its words, by rows; `subject` is the joint in words.
    """
    coordinate_weight, rate_weight, weights = step_weights(joint.symbols)
    tangent = joint.tangent(coordinate_weight, rate_weight)
    size = joint.coordinates.shape[0] // joint.sides
    what = "torque" if size == 1 else "torques"
    found = [block for row in casadi.blocksplit(tangent, size, size) for block in row]
    results = [
        Result.matrix(name_of_block, f"{what} on the {words}", "N m s^2", block)
        for block, (name_of_block, words) in zip(found, blocks, strict=True)
    ]
    x, rate, acceleration = ("η", "η̇", "η̈") if is_lateral else ("q", "q̇", "q̈")
    torques = "torque" if is_lateral and len(blocks) == 1 else "torques"
    more = "" if len(blocks) == 1 else f" Each block is {size} × {size}."
    more = f"\n{ALONG_PLANAR_MOTION}" if is_lateral else more
    summary = (
        f"Tangent of {subject}: minus the derivative of the {torques} of "
        f"[`{motion.named(name)}`] along `{acceleration}`, when\n"
        f"`δ{x} = w_q δ{acceleration}` and `δ{rate} = w_v δ{acceleration}`.{more}"
    )
    arguments = [*joint.arguments, *weights]
    return kernel(motion, f"{name}_tangent", summary, joint.symbols, arguments, results)


# The blocks of the tangent of a joint between two segments.
BLOCKS = [
    ("previous_previous", "previous segment along its `q̈`"),
    ("previous_next", "previous segment along the next one's `q̈`"),
    ("next_previous", "next segment along the previous one's `q̈`"),
    ("next_next", "next segment along its `q̈`"),
]


def joint_kernels(motion: Motion) -> list[Derived]:
    """`joint`, `joint_tangent`, `joint_energy`."""
    if motion is Motion.SPATIAL:
        joint, energy = joint_in_turned_frame(), joint_between_segments()
        tangent = joint_in_turned_frame()
        energies = (
            "`E_spring = c S(u)`, `u = ½|e' − ē|² = 1 − cos α`, `S = ½α²`, with `e` turned about z by "
            "the relaxed angle `κ` to `ē`,\nand `D = ½ d |ω' − ω|²`, `ω = e × ė` with the rates in the body."
        )
    else:
        joint, energy = planar_joint(), planar_joint()
        energies = "`E_spring = ½ c (θ' − θ − κ)²` and `D = ½ d (θ̇' − θ̇)²`."
        # The torques are linear: their derivative does not depend on the state.
        tangent = replace(planar_joint(), state=[])
    return [
        torques_kernel(
            "joint",
            "Torques of a joint, `−∂E_spring/∂q − ∂D/∂q̇`, on the two segments that it "
            f"connects, from\n{energies}",
            joint,
            [("previous", "previous segment"), ("next", "next segment")],
            motion,
        ),
        tangent_kernel("joint", "a joint", tangent, BLOCKS, motion),
        kernel(
            motion,
            "joint_energy",
            f"Energy and dissipation function of a joint, from\n{energies}",
            energy.symbols,
            energy.arguments,
            energy.energies(),
        ),
    ]


def clamp_kernels(motion: Motion) -> list[Derived]:
    """`clamp`, `clamp_tangent`, `clamp_energy`."""
    energy, relaxed, relaxed_rate = clamp_joint(motion)
    power = casadi.dot(casadi.gradient(energy.spring, relaxed), relaxed_rate)
    power_doc = "`∂E_spring/∂ē0·ē̇0`, what the turning clamp puts into the spring"
    rate = Argument.of_symbols("relaxed_direction_rate", "ē̇0 in 1/s", relaxed_rate)
    block = [("next_next", "first segment along its `q̈`")]
    return [
        torques_kernel(
            "clamp",
            "Torques of the clamp joint on the first segment, `−∂E_spring/∂q − ∂D/∂q̇`, as in "
            f"[`{motion.named('joint')}`], with\n"
            "the clamp's `ē0` and `ω0 = 0` on the inner side.",
            clamp_joint(motion)[0],
            [("next", "first segment")],
            motion,
        ),
        tangent_kernel("clamp", "the clamp joint", clamp_joint(motion)[0], block, motion),
        kernel(
            motion,
            "clamp_energy",
            "Energy and dissipation function of the clamp joint, and the power of its turning "
            "against the spring.",
            energy.symbols,
            [*energy.arguments, rate],
            [*energy.energies(), Result.scalar("power", power_doc, "W", power)],
        ),
    ]
