"""Tools of any motion, as arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from bristle import _arguments as arguments
from bristle import _bristle

Floats = npt.NDArray[np.float64]

_MOST_SAMPLES = 10_000
"""The most samples of a turn: the series through them takes the square of their number."""


class Tool:
    """A tool that turns about ``z`` at a constant rate, by the motion of one clamp.

    Between the samples it goes along the Fourier series through them, so that a smooth
    motion is followed to rounding.

    Dampers see the filament from the body. Where the samples turn rigidly about ``z``, so does the
    body; of another motion it is assumed not to turn about the filament.

    >>> import bristle, numpy as np
    >>> angle = 2 * np.pi * np.arange(64) / 64
    >>> radial = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> settings = bristle.Settings.paper(10.0, 1e-3)
    >>> tool = bristle.Tool(position_m=0.14 * radial, direction=radial)
    >>> contact = bristle.simulate(settings, tool=tool)
    >>> alone = bristle.simulate(settings).metrics["contact_normal_impulse_n_s"]
    >>> abs(contact.metrics["contact_normal_impulse_n_s"] / alone - 1) < 1e-3
    True
    """

    def __init__(self, position_m: npt.ArrayLike, direction: npt.ArrayLike) -> None:
        """Checks the samples.

        Args:
            position_m: Where the filament is clamped while the body is at the angles 0,
                2π/k, … 2π (k - 1)/k: in m, of the shape (k, 3).
            direction: Along which it is clamped, of the shape (k, 3) and any length.

        Raises:
            TypeError: If they are no real numbers.
            ValueError: If a shape does not fit, there are fewer than 3 or more than
                10 000 samples, some are masked, or a direction is zero.
        """
        for name, samples in (("position_m", position_m), ("direction", direction)):
            shape = np.shape(samples)
            if shape and shape[0] > _MOST_SAMPLES:
                raise ValueError(
                    f"{name} has {shape[0]} samples, at most {_MOST_SAMPLES}"
                )
        self._position = arguments.floats("position_m", position_m).copy()
        self._direction = arguments.floats("direction", direction).copy()
        shape = self._position.shape
        if shape != self._direction.shape or len(shape) != 2 or shape[1] != 3:
            raise ValueError(
                "position_m and direction need one shape (k, 3), but have "
                f"{shape} and {self._direction.shape}"
            )
        self._sampled = _bristle.SampledTool(self._position, self._direction)
        self._position.flags.writeable = False
        self._direction.flags.writeable = False

    @property
    def position_m(self) -> Floats:
        """Where the filament is clamped, in m, of the shape (k, 3)."""
        return self._position

    @property
    def direction(self) -> Floats:
        """Along which it is clamped, of the shape (k, 3)."""
        return self._direction

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (self._position, self._direction))
