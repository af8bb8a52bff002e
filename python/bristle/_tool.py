"""Tools of any motion, as arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import cos, pi, sin
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from bristle import _arguments as arguments
from bristle import _bristle
from bristle._settings import Settings, require

Floats: TypeAlias = npt.NDArray[np.float64]

_MOST_SAMPLES = 10_000
"""The most samples of a turn: the series through them takes the square of their number."""

_PER_SPEED = 4
"""Samples of the clamp per value of a speed that varies, at least."""

_FEWEST_SAMPLES = 256
"""The fewest of them, and the number of values that a function is asked for."""


class Tool:
    """A tool that turns about ``z``, by the motion of one clamp, the same in all turns.

    Between the samples it goes along the Fourier series through them, so that a smooth
    motion is followed to rounding. `Tool.rotating` makes one whose speed varies.

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
            position_m: Where the filament is clamped at the times 0, 1/k, … (k - 1)/k of a
                turn, which are the angles 0, 2π/k, … 2π (k - 1)/k of a body at a constant
                rate: in m, of the shape (k, 3).
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

    @classmethod
    def rotating(
        cls, settings: Settings, speed: npt.ArrayLike | Callable[[Floats], npt.ArrayLike]
    ) -> Tool:
        """The round tool of the settings, at a speed that varies within each turn.

        The speed goes along the Fourier series through its values, and is the same in
        all turns. Its mean is that of the simulated settings, so that only ratios count.

        >>> import bristle, numpy as np
        >>> settings = bristle.Settings.paper(10.0, 1e-3)
        >>> tool = bristle.Tool.rotating(settings, lambda t: 1 - 0.2 * np.sin(2 * np.pi * t))
        >>> varied = bristle.simulate(settings, tool=tool).metrics
        >>> faster = settings.replace(process={"brushing_velocity_m_s": 12.0})
        >>> steady = bristle.simulate(faster).metrics
        >>> ratio = varied["contact_normal_impulse_n_s"] / steady["contact_normal_impulse_n_s"]
        >>> abs(ratio - 1) < 0.01
        True

        Args:
            settings: State the radius of the body and the tilt of the filaments.
            speed: Speed in any unit, at k equally spaced times 0, 1/k, … (k - 1)/k of a
                turn, of the shape (k,); or a function that takes an array of such times and
                returns as many values, or one for all of them.
                At time 0 the filament points along ``x``; a plane below the tool is three
                quarters of a turn away.

        Raises:
            TypeError: If these are no real numbers.
            ValueError: If there are fewer than 3 or more than 2500 values, or the speed is
                not positive throughout.
        """
        require(settings)
        if callable(speed):
            times = np.arange(_FEWEST_SAMPLES) / _FEWEST_SAMPLES
            values = arguments.floats("speed", speed(times))
            if values.ndim == 0:
                values = np.broadcast_to(values, times.shape)
        else:
            values = arguments.floats("speed", speed)
        most = _MOST_SAMPLES // _PER_SPEED
        if values.ndim != 1 or not 3 <= values.size <= most:
            raise ValueError(
                f"speed needs the shape (k,) with k from 3 to {most}, not {values.shape}"
            )
        count = values.size * max(_PER_SPEED, -(-_FEWEST_SAMPLES // values.size))
        terms = np.fft.rfft(values) * (count / values.size)
        if values.size % 2 == 0:
            # The highest order stands for one term of the transform, among more for two.
            terms[-1] *= 0.5
        if not np.fft.irfft(terms, count).min() > 0.0 or not np.isfinite(values).all():
            raise ValueError("speed must be positive and finite, also between its values")
        mean, orders = terms[0].real / count, np.arange(1, terms.size)
        lead = np.fft.irfft(np.append(0.0, terms[1:] / (1j * mean * orders)), count)
        angle = 2.0 * pi * np.arange(count) / count + lead - lead[0]
        radial = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
        tilt = settings.filament["lateral_tilt_rad"]
        along = cos(tilt) * radial + np.array([0.0, 0.0, sin(tilt)])
        return cls(settings.tool["body_radius_m"] * radial, along)

    @property
    def position_m(self) -> Floats:
        """Where the filament is clamped, in m, of the shape (k, 3)."""
        return self._position

    @property
    def direction(self) -> Floats:
        """Along which it is clamped, of the shape (k, 3)."""
        return self._direction

    def _body_angle_rad(self, phase_rad: Floats) -> Floats:
        """Angle of the clamp about ``z``, unwrapped, at phases of the turn, both in rad."""
        count = len(self._position)
        terms = [np.fft.rfft(self._position[:, axis]) for axis in (0, 1)]

        def azimuth(phase: Floats) -> Floats:
            x, y = (_series(each, count, phase) for each in terms)
            return np.arctan2(y, x)

        turn = np.linspace(0.0, 2.0 * pi, max(_FEWEST_SAMPLES, _PER_SPEED * count) + 1)
        along = np.unwrap(azimuth(turn))
        turns, within = np.divmod(phase_rad, 2.0 * pi)
        near = np.interp(within, turn, along) + turns * (along[-1] - along[0])
        angle = azimuth(phase_rad)
        unwrapped: Floats = angle + 2.0 * pi * np.round((near - angle) / (2.0 * pi))
        return unwrapped

    def __eq__(self, other: object) -> bool:
        """Returns ``True`` if all samples are equal."""
        return isinstance(other, Tool) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[bytes, bytes]:
        return self._position.tobytes(), self._direction.tobytes()

    def __repr__(self) -> str:
        return f"<Tool: {len(self._position)} samples of a turn>"

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (self._position, self._direction))


def _series(terms: npt.NDArray[np.complex128], count: int, phase_rad: Floats) -> Floats:
    """The Fourier series through ``count`` samples with these ``terms``, by Horner's rule."""
    unit = np.exp(1j * phase_rad)
    total = np.zeros_like(unit)
    for order in range(terms.size - 1, -1, -1):
        # The mean, and the highest order of an even number, stand for one term, others for two.
        weight = 1.0 if order == 0 or 2 * order == count else 2.0
        total = total * unit + weight * terms[order]
    return np.asarray(total.real / count)


def checked_tool(tool: Tool | None) -> _bristle.SampledTool | None:
    """Checks the type of what was passed as a tool."""
    if tool is not None and not isinstance(tool, Tool):
        raise TypeError(f"tool is a bristle.Tool, not {tool!r}")
    return None if tool is None else tool._sampled


def with_own_speed(metrics: Mapping[str, Any]) -> dict[str, Any]:
    """The rotational speed in metrics, which the settings state for the round tool."""
    rate = metrics["contact_angle_rad"] / metrics["nominal_contact_time_s"]
    return {"rotational_speed_rpm": rate * 30.0 / pi}
