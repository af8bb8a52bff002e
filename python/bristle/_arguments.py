"""Arguments of functions, checked with messages that name them."""

from __future__ import annotations

import math
from operator import index
from os import PathLike, fsdecode

MOST_TIMES = 1_000_000
"""The most times of a history, of shapes or of frames."""


def whole(name: str, value: object, least: int, most: int | None = None) -> int:
    """A whole number within limits.

    Raises:
        TypeError: If it is no whole number.
        ValueError: If it is outside of the limits.
    """
    try:
        number = index(value)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"{name} must be a whole number, not {value!r}") from None
    if number < least or (most is not None and number > most):
        limits = f"at least {least}" if most is None else f"from {least} to {most}"
        raise ValueError(f"{name} must be {limits}, not {number}")
    return number


def whole_or_none(name: str, value: object, least: int) -> int | None:
    """A whole number, or ``None``."""
    return None if value is None else whole(name, value, least)


def positive(name: str, value: float) -> float:
    """A finite number above zero.

    Raises:
        ValueError: If it is not.
    """
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"{name} must be a positive number, not {value!r}")
    return value


def path(name: str, value: str | PathLike[str]) -> str:
    """A path that is not empty.

    Raises:
        ValueError: If it is.
    """
    decoded = fsdecode(value)
    if not decoded:
        raise ValueError(f"{name} is empty; the current directory is '.'")
    return decoded
