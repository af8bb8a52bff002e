"""The equations of motion: accelerations, all terms at one state, and their text."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import FunctionType
from typing import Any, Literal, TypeAlias, overload

import numpy as np
import numpy.typing as npt

from bristle import _arguments as arguments
from bristle import _bristle
from bristle._settings import Settings, checked

Floats: TypeAlias = npt.NDArray[np.float64]


def accelerations(
    settings: Settings,
    q: npt.ArrayLike,
    v: npt.ArrayLike,
    *,
    base_angle_rad: npt.ArrayLike = 0.0,
    base_rate_rad_s: npt.ArrayLike = 0.0,
    base_acceleration_rad_s2: npt.ArrayLike = 0.0,
    gravity_m_s2: Sequence[float] | None = None,
) -> Floats:
    """Accelerations of many states, without contact, in the lanes of vector units.

    They are those of the O(n) recursion that the integrator uses (``docs/MODEL.md``).

    >>> import bristle, numpy as np
    >>> settings = bristle.Settings.paper(10.0, 1e-3)
    >>> q = np.full((1000, 25, 2), [np.pi / 2, 0.0])
    >>> bristle.accelerations(settings, q, np.zeros_like(q)).shape
    (1000, 25, 2)

    Args:
        settings: State tool and filament; the number of segments is that of ``q``.
        q: Polar angles φ and azimuths θ of k states with n segments, in rad, of the
            shape (k, n, 2).
        v: Their rates, in rad/s, of the same shape.
        base_angle_rad: Angle β of the brush body, in rad: one, or one per state.
        base_rate_rad_s: Its rate ω, in rad/s.
        base_acceleration_rad_s2: Its acceleration, in rad/s².
        gravity_m_s2: Acceleration of free fall, in m/s²; by default that of the
            settings.

    Returns:
        Accelerations of ``q``, in rad/s², of the shape (k, n, 2); NaN where a state is.

    Raises:
        ValueError: If a shape does not fit, or a segment is at a pole (sin φ = 0).
    """
    checked_input = checked(settings)
    angles, rates = arguments.floats("q", q), arguments.floats("v", v)
    if angles.ndim != 3 or angles.shape[2] != 2 or angles.shape != rates.shape:
        raise ValueError(
            f"q and v need one shape (k, n, 2), but have {angles.shape} and "
            f"{rates.shape}"
        )
    bases = {
        "base_angle_rad": base_angle_rad,
        "base_rate_rad_s": base_rate_rad_s,
        "base_acceleration_rad_s2": base_acceleration_rad_s2,
    }
    base = [
        np.ascontiguousarray(
            np.broadcast_to(arguments.floats(name, values), angles.shape[:1])
        )
        for name, values in bases.items()
    ]
    default = settings.process["gravity_m_s2"]
    gravity = arguments.floats(
        "gravity_m_s2", default if gravity_m_s2 is None else gravity_m_s2
    )
    if gravity.shape != (3,):
        raise ValueError(f"gravity_m_s2 needs the shape (3,), but has {gravity.shape}")
    return _bristle.accelerations(
        checked_input, angles, rates, base, gravity.tolist()
    )


@dataclass(frozen=True, eq=False)
class Evaluation:
    """The equations of n segments at one state, without contact, from `evaluate`."""

    mass_matrix: Floats
    """M, in kg m², of the shape (2 n, 2 n)."""

    accelerations: Floats
    """Accelerations of q, in rad/s², of the shape (2 n,)."""

    kinetic_energy_j: float
    """Kinetic energy, in J."""

    potential_energy_j: float
    """Energy of springs and gravity, in J."""

    dissipation_w: float
    """The dissipation function, in W."""

    tip_position_m: Floats
    """The tip, in m, of the shape (3,)."""


def evaluate(settings: Settings, state: Mapping[str, Any]) -> Evaluation:
    """Mass matrix, accelerations and energies at one state: ``bristle evaluate``.

    Args:
        settings: State tool and filament.
        state: ``base_angle`` (rad), ``base_rate`` (rad/s), ``base_acceleration``
            (rad/s²), ``gravity`` (m/s², 3 numbers), ``q`` (φ1, θ1, φ2, … in rad) and
            ``v`` (rad/s), as in the state file of the program.

    Raises:
        ValueError: If the state is not right, or the equations are singular there.
    """
    checked_input = checked(settings)
    if not isinstance(state, Mapping):
        raise TypeError(f"state is a mapping of keys, not {state!r}")
    numbers = {key: arguments.floats(key, value) for key, value in state.items()}
    for key, value in numbers.items():
        if not np.isfinite(value).all():
            raise ValueError(f"{key} is not finite: {value}")
    plain = {key: value.tolist() for key, value in numbers.items()}
    values = json.loads(_bristle.evaluate(checked_input, json.dumps(plain)))
    arrays = ("mass_matrix", "accelerations", "tip_position_m")
    return Evaluation(**{**values, **{key: np.array(values[key]) for key in arrays}})


@overload
def derive(
    segments: int | Settings | None = 2,
    *,
    planar: bool = False,
    uniform: bool = False,
    straight: bool = False,
    format: Literal["math", "latex", "markdown", "rust", "rust-f64", "json", "numpy"] = "math",
    fragment: bool = False,
    width_mm: float | None = None,
) -> str: ...
@overload
def derive(
    segments: int | Settings | None = 2,
    *,
    planar: bool = False,
    uniform: bool = False,
    straight: bool = False,
    format: Literal["c", "matlab"],
    fragment: bool = False,
    width_mm: float | None = None,
) -> dict[str, str]: ...
@overload
def derive(
    segments: int | Settings | None = 2,
    *,
    planar: bool = False,
    uniform: bool = False,
    straight: bool = False,
    format: Literal["sympy"],
    fragment: bool = False,
    width_mm: float | None = None,
) -> dict[str, Any]: ...
def derive(
    segments: int | Settings | None = 2,
    *,
    planar: bool = False,
    uniform: bool = False,
    straight: bool = False,
    format: str = "math",
    fragment: bool = False,
    width_mm: float | None = None,
) -> str | dict[str, str] | dict[str, Any]:
    """The equations of motion as text, or as matrices of SymPy: ``bristle derive``.

    >>> import bristle
    >>> equations = bristle.derive(1, planar=True, format="sympy")
    >>> equations["planar_mass_matrix"].shape
    (1, 1)

    Args:
        segments: Number of segments. Or settings, for the equations of their filament:
            ``planar`` if it stays in the plane of rotation, ``uniform`` if it is a
            cylinder, ``straight`` if it has no waves. ``None`` for the kernels of one
            segment and one joint that the solver loops over.
        planar: Whether the filament moves in the plane of rotation.
        uniform: Whether it is a cylinder, with one mass, inertia, stiffness and
            damping; for ``"math"``, ``"latex"``, ``"markdown"`` and ``"sympy"``.
        straight: Whether it has no relaxed angles, in these formats.
        format: ``"math"``, ``"latex"``, ``"markdown"``, ``"rust"``,
            ``"rust-f64"``, ``"numpy"``, ``"json"``, the graph (``docs/library.md``),
            ``"c"``, ``"matlab"`` or ``"sympy"``, which must be installed.
        fragment: Whether LaTeX has the equations alone, for a paper: with vectors,
            matrices and labels, without preamble and sentences.
        width_mm: Width of the text of the paper in mm, in type of 10 pt; by default
            121, as in LaTeX's ``article``.

    Returns:
        A text; of C and MATLAB the texts of several files by their names; of SymPy the
        matrices by the names of the functions that make them (``docs/library.md``).

    Raises:
        ValueError: If there is no such format, number of segments or width, or the
            equations do not have the shape in this format.
    """
    stated = checked(segments) if isinstance(segments, Settings) else None
    number = (
        arguments.whole_or_none("segments", segments, 1) if stated is None else None
    )
    text, files = _bristle.derive(
        stated, number, planar, uniform, straight, format, fragment, width_mm
    )
    if text is None:
        return files
    if format != "sympy":
        return text
    module: dict[str, Any] = {"__name__": "equations"}
    exec(compile(text, "<equations>", "exec"), module)
    return {
        name: value()
        for name, value in module.items()
        if isinstance(value, FunctionType)
        and value.__module__ == "equations"
        and not name.startswith("_")
    }
