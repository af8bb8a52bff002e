"""Arguments of functions, checked with messages that name them."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from operator import index
from os import PathLike, fsdecode
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

MOST_TIMES = 1_000_000
"""The most times of a history, of shapes or of frames."""

_LARGEST = 2**63 - 1
"""The largest whole number that the compiled part takes."""


def whole(name: str, value: object, least: int, most: int = _LARGEST) -> int:
    """A whole number within limits.

    Raises:
        TypeError: If it is no whole number.
        ValueError: If it is outside of the limits.
    """
    try:
        number = index(value)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"{name} must be a whole number, not {value!r}") from None
    if not least <= number <= most:
        limits = f"at least {least}" if number < least else f"at most {most}"
        raise ValueError(f"{name} must be {limits}, not {shortened(number)}")
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


def shortened(value: object) -> str:
    """A value in a message; an integer of many digits has no text in Python."""
    if isinstance(value, int) and abs(value) > _LARGEST:
        return f"an integer of {value.bit_length()} bits"
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:80]}…"


def floats(name: str, values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Floats next to each other and aligned in memory, of real numbers of any kind.

    Raises:
        TypeError: If they are no real numbers.
        ValueError: If some are masked.
    """
    if np.ma.is_masked(values):
        raise ValueError(f"{name} has masked elements: fill them, or leave them out")
    numbers = np.asarray(values)
    if not np.can_cast(numbers.dtype, np.float64, "same_kind"):
        raise TypeError(f"{name} must be real numbers, not of the type {numbers.dtype}")
    return np.require(numbers, np.float64, ["C", "ALIGNED"]).reshape(numbers.shape)


def fixed(value: Any) -> Any:
    """A value that cannot be changed."""
    if isinstance(value, Mapping):
        return MappingProxyType({key: fixed(item) for key, item in value.items()})
    if isinstance(value, list):
        return tuple(fixed(item) for item in value)
    return value


def path_or_none(name: str, value: str | PathLike[str] | None) -> str | None:
    """A path that is not empty, or ``None``."""
    return None if value is None else path(name, value)


def of_json(text: str | None) -> Any:
    """Returns the read-only value of a JSON text; ``None`` without a text."""
    return None if text is None else fixed(json.loads(text))


def path(name: str, value: str | PathLike[str]) -> str:
    """A path that is not empty.

    Raises:
        ValueError: If it is.
    """
    decoded = fsdecode(value)
    if not decoded:
        raise ValueError(f"{name} is empty; the current directory is '.'")
    return decoded
