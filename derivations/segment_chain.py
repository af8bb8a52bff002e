"""Equations of motion of the segment chain, derived by CasADi from its energies.

Input: the number of segments, or `--kernels`, or `--operators`; the energies of the project's
model page.
Output: a JSON file of single-assignment operations (`graph_format.py`). It has the whole equations
of a chain (mass matrix, force, energies), in space or in the plane of rotation, or the kernels of
the solver's O(n) loops, or functions that only user-defined energies need.

Only energies, positions and directions are stated here; CasADi differentiates them. No derivative
is written by hand.

Energies (SI units, angles in radians)
--------------------------------------
Segment k points along e_k = (sin φ_k cos θ_k, sin φ_k sin θ_k, cos φ_k) from the node r_{k−1} to
r_k = r_{k−1} + h e_k; its centre is c_k = r_{k−1} + (h/2) e_k. The clamp is e_0 at r_0.

    E_kin    = Σ_k ½ m_k |ċ_k|² + ½ J_k |ė_k|²
    E_spring = Σ_k c_k S(u_k),   u_k = ½ |e_k − R(κ_k) e_{k−1}|²,   S(u) = ½ α²
    E_grav   = −Σ_k m_k g·c_k
    D        = Σ_k ½ d_k |ω_k − ω_{k−1}|²,   ω_k = e_k × (ė_k − Ω × e_k),   ω_0 = 0

Ω is the angular velocity of the brush body; the dampers see the filament from the body. R(κ) turns
a vector about z by κ. The spring of joint k is relaxed where e_k is e_{k−1} turned by κ_k.

Lagrange's equations, with the energies' dependence on time through the motion of the clamp:

    d/dt ∂E_kin/∂q̇ − ∂E_kin/∂q + ∂E_pot/∂q + ∂D/∂q̇ = 0   ⇔   M q̈ = f

The bending angle
-----------------
The chord of two unit vectors at the angle α is |e' − e| = 2 sin(α/2), hence

    S = ½ α² = 2 asin²(√(u/2)) = Σ_{k ≥ 1} 2^k u^k / (k² C(2k, k)),

from asin²(x) = ½ Σ (2x)^(2k) / (k² C(2k, k)). S is analytic in u at the straight joint u = 0, where
asin(√u) is not differentiable. The series therefore serves u < δ, and the closed form the rest. The
number `near` blends the two: 1 if u < δ and 0 elsewhere, which CasADi differentiates to zero. Where
`near` is 1, the closed form gets δ for u, so that it stays finite and drops out exactly. Its second
derivative loses digits by cancellation as 1/u; above δ it loses less than two.

The frame
---------
ṙ_0 leaves Lagrange's equations: they hold in every inertial frame (Galileo). The equations are
therefore taken in the frame in which the root, or the inner end of the segment, rests at the
moment: ṙ_0 is set to zero after all differentiation. Otherwise large terms would remain that differ
by roundings only. The energies depend on ṙ_0 and have it as an argument.

The body
--------
A segment that turns rigidly with the body has the rates q̇_r with (∂e/∂q) q̇_r = Ω × e. The
rates in the body, q̇ − q̇_r, give ė − Ω × e as the rate of e. As q̇_r does not depend on q̇, ∂D/∂q̇
is the derivative by them. The rates of the joints' kernels are therefore those in the body, and Ω
enters the kernel of q̇_r alone.

In the plane of rotation
------------------------
With φ_k = π/2, e_k = (cos θ_k, sin θ_k), ω_k = θ̇_k − Ω along z, and θ_k is the one coordinate of
a segment. Between two segments α = θ_{k+1} − θ_k − κ is known, so that E_spring = ½ c α². The clamp
is given by its direction alone, so that S(u) stays there.

The lateral variation is the motion that a small tilt τ of the clamp out of the plane causes:
φ_k = π/2 + η_k τ. Its equations are the derivatives of the spatial ones for φ along τ, with
φ = π/2 + ψ, and ψ = 0, ψ̇ = 0, ψ̈ = 0 after all differentiation.

Run from the repository root:

    python derivations/segment_chain.py --segments 2 --out derivations/graphs/chain_2.json
    python derivations/segment_chain.py --segments 2 --planar --out chain_2_planar.json
    python derivations/segment_chain.py --kernels --out derivations/graphs/kernels.json
    python derivations/segment_chain.py --kernels --out derivations/graphs/kernels.json --check
    python derivations/segment_chain.py --operators --out derivations/graphs/operators.json
"""

import argparse
import math
import os
import shlex
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from fractions import Fraction
from itertools import count, islice
from pathlib import Path

from graph_format import Graph, Input, Kernel, Output, file_text

# The version in requirements.txt; another one may order the operations otherwise.
CASADI_VERSION = "3.8.2"
REQUIREMENTS = Path(__file__).with_name("requirements.txt")
INSTALL_COMMAND = (
    f"{shlex.quote(sys.executable)} -m pip install -r {shlex.quote(os.path.relpath(REQUIREMENTS))}"
)

try:
    import casadi
except ImportError:
    sys.exit(f"segment_chain.py needs CasADi, which is not installed: {INSTALL_COMMAND}")
if casadi.__version__ != CASADI_VERSION:
    sys.exit(
        f"segment_chain.py needs CasADi {CASADI_VERSION}, but {casadi.__version__} is installed: "
        f"{INSTALL_COMMAND}"
    )

LARGEST_SEGMENT_COUNT = 400

# δ: below it the series of S(u) serves, above it the closed form. u = 1/16 is α = 0.355 rad.
SERIES_LIMIT = Fraction(1, 16)
# Relative error of the first and the second derivative of S at u = δ.
SERIES_TOLERANCE = Fraction(1, 10**18)

SX = casadi.SX


# ---------------------------------------------------------------------------- subjects


class Motion(Enum):
    """Motion of a chain, which decides its coordinates."""

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


class Symbols:
    """The variables of one kernel, in order, with notation and unit."""

    def __init__(self) -> None:
        self.entries: list[tuple[SX, str, str]] = []

    def scalar(self, name: str, notation: str, unit: str) -> SX:
        """Adds a variable."""
        variable = SX.sym(name)
        self.entries.append((variable, notation, unit))
        return variable

    def vector(self, name: str, notation: str, unit: str, motion: Motion) -> SX:
        """Adds a variable for each component of a vector."""
        return casadi.vertcat(
            *(self.scalar(f"{name}_{axis}", f"{notation}{axis}", unit) for axis in motion.axes)
        )


@dataclass(frozen=True)
class Argument:
    """An argument of a derived function: local names and the expressions they stand for."""

    name: str
    doc: str
    elements: tuple[tuple[str, SX], ...]

    @classmethod
    def of_symbols(cls, name: str, doc: str, variables: SX) -> "Argument":
        """Creates an argument of variables under their own names."""
        return cls(name, doc, tuple((x.name(), x) for x in casadi.vertsplit(variables)))


@dataclass(frozen=True)
class Result:
    """A result of a derived function; `shape` is empty for a scalar."""

    name: str
    doc: str
    unit: str
    shape: tuple[int, ...]
    value: SX

    @classmethod
    def scalar(cls, name: str, doc: str, unit: str, value: SX) -> "Result":
        """Creates a result of one number."""
        return cls(name, doc, unit, (), value)

    @classmethod
    def vector(cls, name: str, doc: str, unit: str, value: SX) -> "Result":
        """Creates a result of a column."""
        return cls(name, doc, unit, (value.shape[0],), value)

    @classmethod
    def matrix(cls, name: str, doc: str, unit: str, value: SX) -> "Result":
        """Creates a result of rows and columns."""
        return cls(name, doc, unit, value.shape, value)


@dataclass(frozen=True)
class Derived:
    """A function as CasADi expressions."""

    name: str
    summary: str
    symbols: Symbols
    arguments: Sequence[Argument]
    results: Sequence[Result]


# ---------------------------------------------------------------------------- energies


def series_coefficients() -> list[Fraction]:
    """Returns the factors of u, u², … in S(u); the rest is below the tolerance for u ≤ δ.

    The ratio of consecutive terms of S'' is below δ/2·(1 + 1/k) < δ. The terms after the first
    omitted one are therefore less than 2 δ of it. S'' starts with 1/3; its terms are the largest.
    """
    coefficients: list[Fraction] = []
    for k in range(1, 1000):
        coefficient = Fraction(2**k, k**2 * math.comb(2 * k, k))
        tail = 2 * k * (k - 1) * coefficient * SERIES_LIMIT ** max(k - 2, 0)
        if k > 2 and tail < SERIES_TOLERANCE / 3:
            return coefficients
        coefficients.append(coefficient)
    raise RuntimeError("the series of the bending angle does not converge")


def half_angle_squared(u: SX) -> SX:
    """S(u) = ½ α² with u = 1 − cos α: analytic at u = 0, and exact there."""
    near = u < float(SERIES_LIMIT)
    far = 1 - near
    series = SX(0)
    for coefficient in reversed(series_coefficients()):
        series = u * (float(coefficient) + series)
    u_safe = near * float(SERIES_LIMIT) + far * u
    return near * series + far * (2 * casadi.asin(casadi.sqrt(u_safe / 2)) ** 2)


def spring_energy(stiffness: SX, inner: SX, outer: SX) -> SX:
    """c S(u) between two directions, in J."""
    return stiffness * half_angle_squared(casadi.sumsqr(outer - inner) / 2)


def planar_spring_energy(stiffness: SX, inner: SX, outer: SX, relaxed_angle: SX) -> SX:
    """½ c (θ' − θ − κ)² between two azimuths, for an angle of less than π, in J."""
    return stiffness / 2 * (outer - inner - relaxed_angle) ** 2


def turned(vector: SX, sine: SX, cosine: SX) -> SX:
    """R(κ) of a vector with two or three components, by sine and cosine of κ."""
    x, y = vector[0], vector[1]
    return casadi.vertcat(cosine * x - sine * y, sine * x + cosine * y, vector[2:])


def rigid_rate(body_rate: SX, direction: SX) -> SX:
    """Ω × e in 1/s; in the plane Ω has its component along z alone."""
    if direction.shape[0] == 2:
        return body_rate * casadi.vertcat(-direction[1], direction[0])
    return casadi.cross(body_rate, direction)


def angular_velocity(direction: SX, rate_in_body: SX) -> SX:
    """ω = e × (ė − Ω × e) in rad/s; in the plane its component along z."""
    if direction.shape[0] == 2:
        return direction[0] * rate_in_body[1] - direction[1] * rate_in_body[0]
    return casadi.cross(direction, rate_in_body)


def dissipation(damping: SX, inner: tuple[SX, SX] | None, outer: tuple[SX, SX]) -> SX:
    """½ d |ω' − ω|² between two sides (e, ė − Ω × e), in W; the clamp, None, rests in the body."""
    bending_rate = angular_velocity(*outer)
    if inner is not None:
        bending_rate = bending_rate - angular_velocity(*inner)
    return damping / 2 * casadi.sumsqr(bending_rate)


def kinetic_energy(mass: SX, inertia: SX, centre_velocity: SX, direction_rate: SX) -> SX:
    """½ m |ċ|² + ½ J |ė|² of one segment in J."""
    return mass / 2 * casadi.sumsqr(centre_velocity) + inertia / 2 * casadi.sumsqr(direction_rate)


def gravity_energy(mass: SX, gravity: SX, centre: SX) -> SX:
    """−m g·c of one segment in J."""
    return -mass * casadi.dot(gravity, centre)


def direction_about_z(phi: SX, theta: SX) -> SX:
    """e for the polar angle φ from z and the azimuth θ about z."""
    return casadi.vertcat(
        casadi.sin(phi) * casadi.cos(theta), casadi.sin(phi) * casadi.sin(theta), casadi.cos(phi)
    )


def direction_near_plane(depression: SX, theta: SX) -> SX:
    """e for the polar angle φ = π/2 + ψ from z, whose sine is exactly 1 at ψ = 0."""
    return casadi.vertcat(
        casadi.cos(depression) * casadi.cos(theta),
        casadi.cos(depression) * casadi.sin(theta),
        -casadi.sin(depression),
    )


def direction_in_plane(theta: SX) -> SX:
    """e in the plane of rotation: φ = π/2."""
    return casadi.vertcat(casadi.cos(theta), casadi.sin(theta))


DIRECTION_OF = {Motion.SPATIAL: direction_about_z, Motion.PLANAR: direction_in_plane}


def sine_and_cosine(name: str, angle: SX) -> tuple[tuple[str, SX], ...]:
    """Returns the elements of an argument."""
    return (f"sin_{name}", casadi.sin(angle)), (f"cos_{name}", casadi.cos(angle))


@dataclass(frozen=True)
class Segment:
    """Coordinates of one segment, the last of which is θ, their rates, and e as their function.

    `motion` decides which of them are arguments of kernels.
    """

    label: str
    motion: Motion
    coordinates: SX
    rates: SX
    direction_of: Callable[..., SX]

    @classmethod
    def new(
        cls,
        symbols: Symbols,
        motion: Motion,
        label: str = "",
        direction_of: Callable[..., SX] | None = None,
    ) -> "Segment":
        """Creates the variables `phi_<label>` and so on; without a label `phi`."""
        end = f"_{label}" if label else ""
        coordinates = [
            symbols.scalar(f"{name}{end}", f"{letter}{label}", "rad")
            for name, letter in motion.angles
        ]
        rates = [
            symbols.scalar(f"{name}_rate{end}", f"{letter}̇{label}", "rad s^-1")
            for name, letter in motion.angles
        ]
        variables = casadi.vertcat(*coordinates), casadi.vertcat(*rates)
        return cls(label, motion, *variables, direction_of or DIRECTION_OF[motion])

    @classmethod
    def near_plane(
        cls,
        symbols: Symbols,
        label: str = "",
        direction_of: Callable[[SX, SX], SX] = direction_near_plane,
    ) -> "Segment":
        """Puts ψ and ψ̇, for differentiation only, before θ and θ̇; no kernel has them."""
        planar = cls.new(symbols, Motion.PLANAR, label)
        return cls(
            label,
            Motion.PLANAR,
            casadi.vertcat(SX.sym("depression"), planar.coordinates),
            casadi.vertcat(SX.sym("depression_rate"), planar.rates),
            direction_of,
        )

    @property
    def theta(self) -> SX:
        """The azimuth."""
        return self.coordinates[-1]

    @property
    def sides(self) -> tuple[SX, SX]:
        """e and ė."""
        direction = self.direction_of(*casadi.vertsplit(self.coordinates))
        return direction, casadi.jtimes(direction, self.coordinates, self.rates)

    def turned(self, angle: SX) -> SX:
        """R(angle) e of a segment with the polar axis z: only its azimuth changes."""
        *polar, theta = casadi.vertsplit(self.coordinates)
        return self.direction_of(*polar, theta + angle)

    def trigonometry(self, name: str) -> Argument:
        """Sines and cosines of the coordinates as an argument."""
        angles = [angle for angle, _ in self.motion.angles]
        doc = "sin θ, cos θ" if self.motion is Motion.PLANAR else "sin φ, cos φ, sin θ, cos θ"
        return Argument(name, doc, self._trigonometry(*angles))

    def polar_trigonometry(self, name: str) -> Argument:
        """Sine and cosine of φ as an argument."""
        return Argument(name, "sin φ, cos φ", self._trigonometry("phi"))

    def _trigonometry(self, *angles: str) -> tuple[tuple[str, SX], ...]:
        end = f"_{self.label}" if self.label else ""
        variables = {"phi": self.coordinates[0], "theta": self.theta}
        pairs = [sine_and_cosine(f"{angle}{end}", variables[angle]) for angle in angles]
        return tuple(element for pair in pairs for element in pair)

    def rates_argument(self, name: str) -> Argument:
        """The rates as an argument, `name`; in the plane θ̇ under its own name."""
        if self.motion is Motion.SPATIAL:
            return Argument.of_symbols(name, "φ̇, θ̇ in rad/s", self.rates)
        return Argument.of_symbols(self.rates[-1].name(), "θ̇ in rad/s", self.rates[-1])

    def rates_in_body(self, name: str) -> Argument:
        """Returns `rates_argument` of a joint whose dampers see the rates from the body."""
        argument = self.rates_argument(name)
        doc = f"{argument.doc}, less those of a segment that turns rigidly with the body"
        return replace(argument, doc=doc)


# ---------------------------------------------------------------------------- whole equations


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


# ---------------------------------------------------------------------------- kernels: segment


def kernel(
    motion: Motion,
    name: str,
    summary: str,
    symbols: Symbols,
    arguments: Sequence[Argument],
    results: Sequence[Result],
) -> Derived:
    """Creates a kernel from its name and summary in space."""
    if motion is Motion.PLANAR:
        summary += "\nFor motion in the plane of rotation, where `φ = π/2` and `q = θ`."
    return Derived(motion.named(name), summary, symbols, arguments, results)


class FreeSegment:
    """One segment whose inner end x moves freely."""

    def __init__(self, symbols: Symbols, segment: Segment) -> None:
        """Adds all variables but those of the inner end's motion."""
        self.symbols, self.segment = symbols, segment
        # For differentiation; an argument of the energies only.
        self.base_velocity = SX.sym("base_velocity", segment.sides[0].shape[0])
        self.length = symbols.scalar("segment_length", "h", "m")
        self.mass = symbols.scalar("segment_mass", "m", "kg")
        self.inertia = symbols.scalar("segment_inertia", "J", "kg m^2")

    @classmethod
    def new(cls, motion: Motion) -> "FreeSegment":
        """Creates a segment in space or in the plane."""
        symbols = Symbols()
        return cls(symbols, Segment.new(symbols, motion))

    @property
    def kinetic(self) -> SX:
        """E_kin in J."""
        direction_rate = self.segment.sides[1]
        centre_velocity = self.base_velocity + self.length / 2 * direction_rate
        return kinetic_energy(self.mass, self.inertia, centre_velocity, direction_rate)

    @property
    def reach(self) -> tuple[SX, SX]:
        """h e and h ė."""
        direction, direction_rate = self.segment.sides
        return self.length * direction, self.length * direction_rate

    def at_rest(self, expression: SX) -> SX:
        """Changes to the inertial frame in which the inner end rests at the moment."""
        rest = SX.zeros(self.base_velocity.shape[0])
        return casadi.substitute(expression, self.base_velocity, rest)

    def inverse_dynamics(
        self, accelerations: SX, base_acceleration: SX, outer_force: SX
    ) -> tuple[SX, SX, SX]:
        """The torques τ, the force p at the inner end, and the acceleration of the outer end."""
        q, v = self.segment.coordinates, self.segment.rates

        def time_derivative(expression: SX) -> SX:
            return casadi.jtimes(
                expression,
                casadi.vertcat(q, v, self.base_velocity),
                casadi.vertcat(v, accelerations, base_acceleration),
            )

        reach, reach_rate = self.reach
        torque = (
            time_derivative(casadi.gradient(self.kinetic, v))
            - casadi.gradient(self.kinetic, q)
            # Gᵀ F: the outer force does work on δ(h e).
            + casadi.gradient(casadi.dot(reach, outer_force), q)
        )
        base_force = time_derivative(casadi.gradient(self.kinetic, self.base_velocity))
        outer_acceleration = base_acceleration + time_derivative(reach_rate)
        return self.at_rest(torque), self.at_rest(base_force), self.at_rest(outer_acceleration)

    def constants(self) -> list[Argument]:
        """h, m and J as arguments."""
        return [
            Argument.of_symbols("segment_length", "h in m", self.length),
            Argument.of_symbols("segment_mass", "m in kg", self.mass),
            Argument.of_symbols("segment_inertia", "J in kg m²", self.inertia),
        ]


def segment_kernel(motion: Motion) -> Derived:
    """`segment`: kinematics and inertia of one segment."""
    free = FreeSegment.new(motion)
    q, v = free.segment.coordinates, free.segment.rates
    size, axes = len(motion.angles), len(motion.axes)
    reach, reach_rate = free.reach
    base_momentum = casadi.gradient(free.kinetic, free.base_velocity)
    inertia, momentum = casadi.hessian(free.kinetic, v)
    bias = free.at_rest(casadi.jtimes(momentum, q, v) - casadi.gradient(free.kinetic, q))
    bias_doc = "`τ_0 = d/dt(∂E_kin/∂q̇) − ∂E_kin/∂q` for `ẍ = 0`, `q̈ = 0`"
    coupling, base_bias = casadi.jacobian(base_momentum, v), casadi.jtimes(base_momentum, q, v)
    base_bias_doc = "`p_0 = d/dt(∂E_kin/∂ẋ)` for `ẍ = 0`, `q̈ = 0`"
    slopes, reach_bias = casadi.jacobian(reach, q), casadi.jtimes(reach_rate, q, v)
    results = [
        Result.matrix("inertia", f"`I = ∂²E_kin/∂q̇²`, {size} × {size}", "kg m^2", inertia),
        Result.matrix("coupling", f"`C = ∂²E_kin/∂ẋ∂q̇`, {axes} × {size}", "kg m", coupling),
        Result.vector("bias", bias_doc, "N m", bias),
        Result.vector("base_bias", base_bias_doc, "N", base_bias),
        Result.vector("reach", "`h e`, outer end less inner end", "m", reach),
        Result.vector("reach_rate", "`h ė`", "m s^-1", reach_rate),
        Result.matrix("reach_jacobian", f"`G = ∂(h e)/∂q`, {axes} × {size}", "m", slopes),
        Result.vector("reach_bias", "`b = h ë` for `q̈ = 0`", "m s^-2", reach_bias),
    ]
    arguments = [
        free.segment.trigonometry("angles"),
        free.segment.rates_argument("rates"),
        *free.constants(),
    ]
    summary = (
        "Kinematics and inertia of one segment, seen from its inner end `x`:\n"
        "`p = m ẍ + C q̈ + p_0 + F`, `τ = Cᵀ ẍ + I q̈ + τ_0 + Gᵀ F`, `ẍ' = ẍ + G q̈ + b`,\n"
        "from `E_kin = ½ m |ẋ + ½ h ė|² + ½ J |ė|²`."
    )
    return kernel(motion, "segment", summary, free.symbols, arguments, results)


def along_step(expression: SX, variables: Sequence[tuple[SX, SX | int]], coordinates: int) -> SX:
    """Returns derivatives along the acceleration of each coordinate; a column a coordinate.

    `variables` has vectors with one element a coordinate, and their weights of the acceleration.
    """
    of_all = casadi.vertcat(*(variable for variable, _ in variables))
    unit_steps = casadi.horzsplit(SX.eye(coordinates))
    steps = [casadi.vertcat(*(weight * step for _, weight in variables)) for step in unit_steps]
    return casadi.horzcat(*(casadi.jtimes(expression, of_all, step) for step in steps))


def step_weights(symbols: Symbols) -> tuple[SX, SX, list[Argument]]:
    """w_q and w_v: δq = w_q δq̈, δq̇ = w_v δq̈."""
    coordinate_weight = symbols.scalar("coordinate_weight", "w_q", "s^2")
    rate_weight = symbols.scalar("rate_weight", "w_v", "s")
    arguments = [
        Argument.of_symbols("coordinate_weight", "w_q in s²: δq = w_q δq̈", coordinate_weight),
        Argument.of_symbols("rate_weight", "w_v in s: δq̇ = w_v δq̈", rate_weight),
    ]
    return coordinate_weight, rate_weight, arguments


def segment_tangent_kernel(motion: Motion) -> Derived:
    """`segment_tangent`: derivatives of a segment's torques and forces by its acceleration."""
    free = FreeSegment.new(motion)
    symbols = free.symbols
    q, v = free.segment.coordinates, free.segment.rates
    size, axes = len(motion.angles), len(motion.axes)
    accelerations = casadi.vertcat(
        *(
            symbols.scalar(f"{name}_acceleration", f"{letter}̈", "rad s^-2")
            for name, letter in motion.angles
        )
    )
    base_acceleration = symbols.vector("base_acceleration", "ẍ", "m s^-2", motion)
    outer_force = symbols.vector("outer_force", "F", "N", motion)
    coordinate_weight, rate_weight, weights = step_weights(symbols)
    torque, base_force, outer_acceleration = free.inverse_dynamics(
        accelerations, base_acceleration, outer_force
    )

    def tangent(expression: SX) -> SX:
        step = [(q, coordinate_weight), (v, rate_weight), (accelerations, 1)]
        return along_step(expression, step, size)

    results = [
        Result.matrix("torque", f"`∂τ/∂q̈`, {size} × {size}", "kg m^2", tangent(torque)),
        Result.matrix("base_force", f"`∂p/∂q̈`, {axes} × {size}", "kg m", tangent(base_force)),
        Result.matrix(
            "outer_acceleration", f"`∂ẍ'/∂q̈`, {axes} × {size}", "m", tangent(outer_acceleration)
        ),
    ]
    spatial = motion is Motion.SPATIAL
    name = "accelerations" if spatial else "theta_acceleration"
    doc = "φ̈, θ̈ in rad/s²" if spatial else "θ̈ in rad/s²"
    arguments = [
        free.segment.trigonometry("angles"),
        free.segment.rates_argument("rates"),
        Argument.of_symbols(name, doc, accelerations),
        Argument.of_symbols("base_acceleration", "ẍ in m/s²", base_acceleration),
        Argument.of_symbols("outer_force", "F in N", outer_force),
        *free.constants(),
        *weights,
    ]
    summary = (
        f"Tangent of one segment: how `τ`, `p` and `ẍ'` of [`{motion.named('segment')}`] change "
        "with its own `q̈` when\n"
        "`δq = w_q δq̈` and `δq̇ = w_v δq̈`, for fixed `ẍ` and `F`."
    )
    return kernel(motion, "segment_tangent", summary, symbols, arguments, results)


def segment_energy_kernel(motion: Motion) -> Derived:
    """`segment_energy`: kinetic and potential energy of one segment."""
    free = FreeSegment.new(motion)
    base_position = free.symbols.vector("base_position", "x", "m", motion)
    base_velocity = free.symbols.vector("base_velocity", "ẋ", "m s^-1", motion)
    gravity = free.symbols.vector("gravity", "g", "m s^-2", motion)
    centre = base_position + free.length / 2 * free.segment.sides[0]
    kinetic = casadi.substitute(free.kinetic, free.base_velocity, base_velocity)
    results = [
        Result.scalar("kinetic", "`E_kin`", "J", kinetic),
        Result.scalar("gravity", "`E_grav`", "J", gravity_energy(free.mass, gravity, centre)),
    ]
    arguments = [
        free.segment.trigonometry("angles"),
        free.segment.rates_argument("rates"),
        Argument.of_symbols("base_position", "x in m", base_position),
        Argument.of_symbols("base_velocity", "ẋ in m/s", base_velocity),
        Argument.of_symbols("gravity", "g in m/s²", gravity),
        *free.constants(),
    ]
    summary = "Energies of one segment: `½ m |ẋ + ½ h ė|² + ½ J |ė|²` and `−m g·(x + ½ h e)`."
    return kernel(motion, "segment_energy", summary, free.symbols, arguments, results)


# ---------------------------------------------------------------------------- kernels: joints


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


def rigid_rates_kernel() -> Derived:
    """`rigid_rates`: motion of a segment that turns rigidly with the body."""
    symbols = Symbols()
    segment = Segment.new(symbols, Motion.SPATIAL)
    body_rate = symbols.vector("angular_velocity", "Ω", "rad s^-1", Motion.SPATIAL)
    direction = segment.sides[0]
    # Ω × e = (∂e/∂q) q̇_r. The columns of ∂e/∂q are perpendicular, of the lengths 1 and sin φ.
    by_coordinates = casadi.jacobian(direction, segment.coordinates)
    along = by_coordinates.T @ rigid_rate(body_rate, direction)
    sine = casadi.sin(segment.coordinates[0])
    rates = casadi.vertcat(along[0], along[1] / sine**2)
    slopes = casadi.jacobian(rates, segment.coordinates)
    return Derived(
        "rigid_rates",
        "Rates of a segment that turns rigidly with the body, `Ω × e = (∂e/∂q) q̇_r`, and how they "
        "change with its coordinates.\n"
        "In the chart about x the components of `Ω` are in the order y, z, x.",
        symbols,
        [
            segment.trigonometry("angles"),
            Argument.of_symbols("angular_velocity", "Ω of the body in rad/s", body_rate),
        ],
        [
            Result.vector("rates", "`q̇_r`", "rad s^-1", rates),
            Result.matrix("slopes", "`∂q̇_r/∂q`, 2 × 2", "rad s^-1", slopes),
        ],
    )


# ---------------------------------------------------------------------------- kernels: lateral

# Domain of the lateral kernels.
ALONG_PLANAR_MOTION = (
    "Lateral variation of a motion in the plane of rotation: "
    "`q = η = ∂φ/∂τ`, where `τ` is the tilt of the clamp."
)


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


def solver_kernels() -> list[Derived]:
    """All kernels, in the order in which the solver meets them: in space, planar, lateral."""

    def of_motion(motion: Motion) -> list[Derived]:
        return [
            segment_kernel(motion),
            segment_tangent_kernel(motion),
            segment_energy_kernel(motion),
            *joint_kernels(motion),
            *clamp_kernels(motion),
        ]

    return [
        *of_motion(Motion.SPATIAL),
        rigid_rates_kernel(),
        *of_motion(Motion.PLANAR),
        lateral_segment_kernel(),
        lateral_segment_tangent_kernel(),
        *lateral_joint_kernels(),
        *lateral_clamp_kernels(),
    ]


# ---------------------------------------------------------------------------- operators


def operators_kernel() -> Derived:
    """`operators`: functions that only user-defined energies need, with their gradients."""
    symbols = Symbols()
    a, b = (symbols.scalar(name, name, "1") for name in "ab")
    values = casadi.vertcat(
        casadi.exp(a),
        casadi.log(a),
        casadi.tanh(a),
        casadi.fabs(a - b),
        casadi.atan2(a, b),
        a**b,
        a**2.5,
    )
    variables = casadi.vertcat(a, b)
    return Derived(
        "operators",
        "Functions of `a` and `b`: `exp a, ln a, tanh a, |a − b|, atan2(a, b), a^b, a^(5/2)`.",
        symbols,
        [Argument.of_symbols("variables", "a, b", variables)],
        [
            Result.vector("values", "their values", "1", values),
            Result.matrix("gradients", "by `a, b`", "1", casadi.jacobian(values, variables)),
        ],
    )


# ---------------------------------------------------------------------------- export


# CasADi's instructions on operands, and the format's operations.
INSTRUCTIONS = {
    casadi.OP_ADD: "add",
    casadi.OP_SUB: "sub",
    casadi.OP_MUL: "mul",
    casadi.OP_DIV: "div",
    casadi.OP_NEG: "neg",
    casadi.OP_SQRT: "sqrt",
    casadi.OP_SIN: "sin",
    casadi.OP_COS: "cos",
    casadi.OP_ASIN: "asin",
    casadi.OP_EXP: "exp",
    casadi.OP_LOG: "ln",
    casadi.OP_TANH: "tanh",
    casadi.OP_FABS: "abs",
    casadi.OP_ATAN2: "atan2",
    casadi.OP_POW: "pow",
    casadi.OP_CONSTPOW: "pow",
    casadi.OP_LT: "less_than",
}


def exported(derived: Derived) -> Kernel:
    """Converts CasADi's instructions to single-assignment form.

    The expressions of the arguments' elements are outputs of the function, too, so that their
    operations are known.
    """
    elements = [expression for argument in derived.arguments for _, expression in argument.elements]
    # CasADi stores by columns, the format by rows.
    values = [casadi.vec(casadi.densify(result.value).T) for result in derived.results]
    function = casadi.Function(
        derived.name,
        [casadi.vertcat(*(variable for variable, _, _ in derived.symbols.entries))],
        [casadi.vertcat(*elements), casadi.vertcat(*values)],
    )

    graph = Graph()
    symbols = [
        graph.symbol(variable.name(), notation, unit)
        for variable, notation, unit in derived.symbols.entries
    ]
    registers: dict[int, int] = {}
    # The operations of both outputs.
    found: tuple[dict[int, int], dict[int, int]] = {}, {}
    for k in range(function.n_instructions()):
        code = function.instruction_id(k)
        operands, targets = function.instruction_input(k), function.instruction_output(k)
        if code == casadi.OP_OUTPUT:
            found[targets[0]][targets[1]] = registers[operands[0]]
            continue
        if code == casadi.OP_INPUT:
            operation = symbols[operands[1]]
        elif code == casadi.OP_CONST:
            operation = graph.number(float(function.instruction_constant(k)))
        else:
            nodes = [registers[operand] for operand in operands]
            if code in INSTRUCTIONS:
                operation = graph.operation(INSTRUCTIONS[code], *nodes)
            elif code == casadi.OP_SQ:
                operation = graph.power(nodes[0], 2)
            elif code == casadi.OP_TWICE:
                operation = graph.operation("mul", graph.number(2.0), nodes[0])
            elif code == casadi.OP_INV:
                operation = graph.operation("div", graph.number(1.0), nodes[0])
            elif code == casadi.OP_SIGN:
                zero = graph.number(0.0)
                positive = graph.operation("less_than", zero, nodes[0])
                negative = graph.operation("less_than", nodes[0], zero)
                operation = graph.operation("sub", positive, negative)
            else:
                reason = f"the format has no operation for CasADi's instruction {code}"
                raise RuntimeError(f"kernel {derived.name}: {reason}")
        registers[targets[0]] = operation

    inputs, outputs = [], []
    of_elements, of_values = (map(each.__getitem__, count()) for each in found)
    for argument in derived.arguments:
        bound = tuple((name, next(of_elements)) for name, _ in argument.elements)
        inputs.append(Input(argument.name, argument.doc, bound))
    for result in derived.results:
        operations = tuple(islice(of_values, math.prod(result.shape)))
        outputs.append(Output(result.name, result.doc, result.unit, result.shape, operations))
    return Kernel(derived.name, derived.summary, graph, tuple(inputs), tuple(outputs))


def main() -> None:
    """Runs the command line."""
    parser = argparse.ArgumentParser(
        description="Derive equations of motion from the chain's energies with CasADi."
    )
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--segments", type=int, help="number of segments of the whole equations")
    what.add_argument("--kernels", action="store_true", help="all kernels of the solver")
    what.add_argument(
        "--operators", action="store_true", help="functions for energies of one's own"
    )
    parser.add_argument(
        "--planar", action="store_true", help="with --segments: in the plane of rotation"
    )
    parser.add_argument("--out", required=True, metavar="FILE", help="- for the standard output")
    parser.add_argument(
        "--check", action="store_true", help="exit with 1 if FILE is not what is derived now"
    )
    arguments = parser.parse_args()
    if arguments.check and arguments.out == "-":
        parser.error("--check compares with a file, so --out cannot be -")
    if arguments.planar and arguments.segments is None:
        parser.error("--kernels derives the planar kernels, too; --planar belongs to --segments")
    if arguments.segments is not None and not 1 <= arguments.segments <= LARGEST_SEGMENT_COUNT:
        parser.error(f"possible are 1 to {LARGEST_SEGMENT_COUNT} segments")

    motion = Motion.PLANAR if arguments.planar else Motion.SPATIAL
    if arguments.kernels:
        choice, derived = "--kernels", solver_kernels()
    elif arguments.operators:
        choice, derived = "--operators", [operators_kernel()]
    else:
        choice = f"--segments {arguments.segments}" + (" --planar" if arguments.planar else "")
        derived = whole_equations(arguments.segments, motion)
    command = f"derivations/segment_chain.py {choice}"
    kernels = [exported(function) for function in derived]
    text = file_text(f"{command}, CasADi {casadi.__version__}", kernels)
    if arguments.out == "-":
        sys.stdout.buffer.write(text.encode())
        return
    path = Path(arguments.out)
    try:
        if not arguments.check:
            path.write_text(text, encoding="utf-8", newline="\n")
        elif path.read_bytes() != text.encode():
            sys.exit(f"{path} is stale. To make it again: python {command} --out {path}")
    except OSError as error:
        sys.exit(f"segment_chain.py: {path}: {error.strerror}")


if __name__ == "__main__":
    main()
