"""Filaments that touch each other."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from bristle import _arguments as arguments
from bristle import _bristle
from bristle._errors import warn_of
from bristle._html import framed
from bristle._metrics import BrushMetrics
from bristle._progress import TellShare, of_share
from bristle._settings import Settings, checked
from bristle._table import Table


@dataclass(frozen=True, eq=False)
class Frames:
    """All k filaments of n segments at t equally spaced times."""

    times: npt.NDArray[np.float64]
    """Times in s, of the shape (t,)."""

    nodes: npt.NDArray[np.float32]
    """Nodes from root to tip, in m, of the shape (t, k, n + 1, 3)."""

    def __iter__(self) -> Iterator[npt.NDArray[np.float64] | npt.NDArray[np.float32]]:
        """Times and nodes, for ``times, nodes = …``."""
        return iter((self.times, self.nodes))


class Brush:
    """A simulated sector of a brush, as `brush` returns it.

    In a notebook it shows the page of the program, with the filaments in motion.
    """

    def __init__(self, settings: Settings, simulated: _bristle.SimulatedBrush) -> None:
        self._settings = settings
        self._simulated = simulated

    @property
    def settings(self) -> Settings:
        """What was simulated."""
        return self._settings

    @property
    def findings(self) -> tuple[Mapping[str, Any], ...]:
        """What is not as it seems: ``id``, ``quantity``, ``value``, ``limit``, ``statement``, and ``help``.

        ``bristle explain`` says what an id means.
        """
        return tuple(arguments.fixed(each) for each in json.loads(self._simulated.findings()))

    @cached_property
    def metrics(self) -> BrushMetrics:
        """Everything that ``metrics.json`` has, with the same keys, in SI units.

        It cannot be written to; ``dict(brush.metrics)`` is a copy.
        """
        metrics: BrushMetrics = arguments.fixed(json.loads(self._simulated.metrics()))
        return metrics

    @cached_property
    def filaments(self) -> Table:
        """One row per filament with its metrics: ``filaments.csv``."""
        return Table(*self._simulated.filaments(), self._settings)

    @cached_property
    def history(self) -> Table:
        """One row per step with the forces of the sector: ``history.csv``."""
        return Table(*self._simulated.history(), self._settings)

    @cached_property
    def contacts(self) -> Table:
        """One row per pair of filaments that touched: ``contacts.csv``."""
        return Table(*self._simulated.contacts(), self._settings)

    @cached_property
    def frames(self) -> Frames:
        """All filaments at equally spaced times."""
        return Frames(*self._simulated.frames())

    def _repr_html_(self) -> str:
        return framed(self._simulated.page(self._settings.name), 900)

    def __repr__(self) -> str:
        force = self.metrics["tool_contact_normal_force_n"]
        return f"<Brush: F_n,w = {force:.4g} N>"

    def __reduce__(self) -> tuple[Any, ...]:
        return (_restored, (self._settings, self._simulated.state()))


def _restored(settings: Settings, state: tuple[int, bytes, list[float]]) -> Brush:
    return Brush(settings, _bristle.SimulatedBrush.of_state(settings._input, state))


def brush(
    settings: Settings,
    *,
    threads: int | None = None,
    frames: int = 120,
    memory_bytes: int | None = None,
    progress: bool | TellShare = True,
) -> Brush:
    """Simulates the filaments of the section ``[brush]``, as ``bristle simulate`` does.

    It can take minutes. The tool is the round one of the settings. Other threads of Python go on meanwhile; Ctrl-C stops it.

    Args:
        settings: What to simulate, with the section ``[brush]``.
        threads: Number of threads, by default one per core; changes no result.
        frames: Number of times of `Brush.frames`, at most.
        memory_bytes: Refuses a brush that needs more memory than this, in bytes.
        progress: Whether to show progress, on a line of a terminal and elsewhere in a
            line now and then, or a function that is called with the share that is done.

    Raises:
        SettingsError: If there is no such brush, or no steady stretch of columns.
        SimulationError: If a step is not possible.
    """
    checked_input = checked(settings)
    threads = arguments.whole_or_none("threads", threads, 1)
    frames = arguments.whole("frames", frames, 0, arguments.MOST_TIMES)
    memory = arguments.whole_or_none("memory_bytes", memory_bytes, 0)
    with of_share(progress, "the brush") as tell:
        simulated = _bristle.brush(checked_input, threads, frames, memory, tell)
    warn_of(simulated)
    return Brush(settings, simulated)
