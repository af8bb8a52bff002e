"""Energies, directions and coordinates of a segment and a joint."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction

import casadi
from casadi import SX

from casadi_chain.expressions import Argument, Motion, Symbols

# δ: below it the series of S(u) serves, above it the closed form. u = 1/16 is α = 0.355 rad.
SERIES_LIMIT = Fraction(1, 16)
# Relative error of the first and the second derivative of S at u = δ.
SERIES_TOLERANCE = Fraction(1, 10**18)


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
