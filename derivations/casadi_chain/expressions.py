"""Functions as CasADi expressions: their symbols, arguments and results."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import casadi
from casadi import SX


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
