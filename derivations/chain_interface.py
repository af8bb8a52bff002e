"""Names, units and shapes of the whole equations of a chain: what every derivation of them exports.

Nothing here says what the equations are: that is each derivation's own.
"""

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


@dataclass(frozen=True)
class ChainOutput:
    """A result; `shape` is empty for a scalar."""

    name: str
    doc: str
    unit: str
    shape: tuple[int, ...]


@dataclass(frozen=True)
class ChainFunction:
    """One of the three functions."""

    name: str
    summary: str
    outputs: tuple[ChainOutput, ...]


def chain_arguments(segments: int, motion: Motion) -> list[ChainArgument]:
    """The arguments that all three functions have, in order."""

    def vector(name: str, notation: str, unit: str, doc: str) -> ChainArgument:
        symbols = tuple((f"{name}_{axis}", f"{notation}{axis}", unit) for axis in motion.axes)
        return ChainArgument(name, doc, symbols)

    def numbered(name: str, notation: str, unit: str, doc: str) -> ChainArgument:
        symbols = tuple((f"{name}_{k}", f"{notation}{k}", unit) for k in range(1, segments + 1))
        return ChainArgument(name, doc, symbols)

    coordinates, rates = [], []
    for k in range(1, segments + 1):
        coordinates += [(f"{name}_{k}", f"{letter}{k}", "rad") for name, letter in motion.angles]
        rates += [
            (f"{name}_rate_{k}", f"{letter}̇{k}", "rad s^-1") for name, letter in motion.angles
        ]
    spatial = motion is Motion.SPATIAL
    return [
        ChainArgument(
            "q", "φ1, θ1, φ2, … in rad" if spatial else "θ1, θ2, … in rad", tuple(coordinates)
        ),
        ChainArgument(
            "v", "φ̇1, θ̇1, φ̇2, … in rad/s" if spatial else "θ̇1, θ̇2, … in rad/s", tuple(rates)
        ),
        vector("root_position", "r0", "m", "r0 in m"),
        vector("root_velocity", "ṙ0", "m s^-1", "ṙ0 in m/s"),
        vector("root_acceleration", "r̈0", "m s^-2", "r̈0 in m/s²"),
        vector("clamp_direction", "e0", "1", "e0"),
        ChainArgument(
            "angular_velocity",
            "Ω of the body in rad/s" if spatial else "Ω of the body in rad/s, along z",
            tuple(
                (f"angular_velocity_{axis}", f"Ω{axis}", "rad s^-1")
                for axis in ("xyz" if spatial else "z")
            ),
        ),
        vector("gravity", "g", "m s^-2", "g in m/s²"),
        ChainArgument("segment_length", "h in m", (("segment_length", "h", "m"),)),
        numbered("segment_mass", "m", "kg", "m1, m2, … in kg"),
        numbered("segment_inertia", "J", "kg m^2", "J1, J2, … in kg m²"),
        numbered("joint_stiffness", "c", "N m", "c1, c2, … in N m"),
        numbered("joint_damping", "d", "N m s", "d1, d2, … in N m s"),
        numbered("relaxed_angle", "κ", "rad", "κ1, κ2, … in rad"),
    ]


def chain_functions(segments: int, motion: Motion) -> list[ChainFunction]:
    """The functions and their results, in order."""
    planar = "planar " if motion is Motion.PLANAR else ""
    chain = f"a {planar}chain of {segments} segment{'' if segments == 1 else 's'}"
    size = len(motion.angles) * segments
    coordinates = "φ1, θ1, φ2, …" if motion is Motion.SPATIAL else "θ1, θ2, …"
    matrix_doc = f"`M`, {size} × {size}, symmetric, rows and columns `{coordinates}`"
    return [
        ChainFunction(
            motion.named("mass_matrix"),
            f"Mass matrix of {chain}: `M = ∂²E_kin/∂q̇²`.",
            (ChainOutput("mass_matrix", matrix_doc, "kg m^2", (size, size)),),
        ),
        ChainFunction(
            motion.named("force"),
            f"Generalised force of {chain}: "
            "`f = −d/dt(∂E_kin/∂q̇) + ∂E_kin/∂q − ∂E_pot/∂q − ∂D/∂q̇`,\n"
            "the first term without its part in `q̈`, `E_pot = E_spring + E_grav`.",
            (ChainOutput("force", "`f` of `M q̈ = f + Q`, without contact", "N m", (size,)),),
        ),
        ChainFunction(
            motion.named("energies"),
            f"Energies and dissipation function of {chain}.",
            (
                ChainOutput("kinetic", "`E_kin`", "J", ()),
                ChainOutput("spring", "`E_spring`", "J", ()),
                ChainOutput("gravity", "`E_grav`", "J", ()),
                ChainOutput("dissipation", "`D`", "W", ()),
            ),
        ),
    ]
