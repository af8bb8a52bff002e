"""Names and units of the arguments of the whole equations of a chain.

Nothing here says what the equations are.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum


class Motion(Enum):
    """How a chain moves, which decides its coordinates."""

    SPATIAL = "spatial"
    PLANAR = "planar"

    @property
    def axes(self) -> str:
        """The components of a vector."""
        return "xyz" if self is Motion.SPATIAL else "xy"

    @property
    def angles(self) -> tuple[tuple[str, str], ...]:
        """Name and letter of each coordinate of a segment."""
        theta = ("theta", "θ")
        return (("phi", "φ"), theta) if self is Motion.SPATIAL else (theta,)

    def named(self, name: str) -> str:
        """The name of a function whose name in space is `name`."""
        return name if self is Motion.SPATIAL else f"planar_{name}"


@dataclass(frozen=True)
class ChainArgument:
    """An argument of the three functions; `symbols` has name, notation and unit of each element."""

    name: str
    doc: str
    symbols: tuple[tuple[str, str, str], ...]


def chain_arguments(segments: int, motion: Motion) -> list[ChainArgument]:
    """The arguments that all three functions have, in order."""
    spatial, numbers = motion is Motion.SPATIAL, range(1, segments + 1)
    axes, turning = motion.axes, "xyz" if spatial else "z"

    def each(
        ends: Iterable[object], name: str, notation: str, unit: str, doc: str
    ) -> ChainArgument:
        symbols = tuple((f"{name}_{end}", f"{notation}{end}", unit) for end in ends)
        return ChainArgument(name, doc, symbols)

    angles = [(name, letter, k) for k in numbers for name, letter in motion.angles]
    q = tuple((f"{name}_{k}", f"{letter}{k}", "rad") for name, letter, k in angles)
    v = tuple((f"{name}_rate_{k}", f"{letter}̇{k}", "rad s^-1") for name, letter, k in angles)
    q_doc = "φ1, θ1, φ2, … in rad" if spatial else "θ1, θ2, … in rad"
    v_doc = "φ̇1, θ̇1, φ̇2, … in rad/s" if spatial else "θ̇1, θ̇2, … in rad/s"
    turning_doc = "Ω of the body in rad/s" if spatial else "Ω of the body in rad/s, along z"
    return [
        ChainArgument("q", q_doc, q),
        ChainArgument("v", v_doc, v),
        each(axes, "root_position", "r0", "m", "r0 in m"),
        each(axes, "root_velocity", "ṙ0", "m s^-1", "ṙ0 in m/s"),
        each(axes, "root_acceleration", "r̈0", "m s^-2", "r̈0 in m/s²"),
        each(axes, "clamp_direction", "e0", "1", "e0"),
        each(turning, "angular_velocity", "Ω", "rad s^-1", turning_doc),
        each(axes, "gravity", "g", "m s^-2", "g in m/s²"),
        ChainArgument("segment_length", "h in m", (("segment_length", "h", "m"),)),
        each(numbers, "segment_mass", "m", "kg", "m1, m2, … in kg"),
        each(numbers, "segment_inertia", "J", "kg m^2", "J1, J2, … in kg m²"),
        each(numbers, "joint_stiffness", "c", "N m", "c1, c2, … in N m"),
        each(numbers, "joint_damping", "d", "N m s", "d1, d2, … in N m s"),
        each(numbers, "relaxed_angle", "κ", "rad", "κ1, κ2, … in rad"),
    ]
