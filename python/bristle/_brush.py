"""Filaments that touch each other."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

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

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bristle._figure import Placed


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
        """Settings of the simulation."""
        return self._settings

    @property
    def findings(self) -> tuple[Mapping[str, Any], ...]:
        """Findings with ``id``, ``quantity``, ``value``, ``limit``, ``statement``, and ``help``.

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
    def checked(self) -> Mapping[str, Any] | None:
        """Content of ``check.json``: the metrics with more precision; ``None`` without ``check=True``."""
        changes: Mapping[str, Any] | None = arguments.of_json(self._simulated.checked())
        return changes

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

    def plot(self, *, time_s: float | None = None, ax: Placed = None) -> Figure:
        """Force over time, and the filaments at one time, seen along the axis of the tool.

        Args:
            time_s: The time of the filaments in s, of which the nearest frame is drawn; by
                default that of the largest force.
            ax: Two axes of matplotlib to draw on; by default those of a new figure.

        Returns:
            The figure of the axes, which a notebook shows; matplotlib must be installed.

        Raises:
            ValueError: If the brush was simulated without frames.
        """
        from bristle._figure import beside, diagrams

        history, frames = self.history, self.frames
        if frames.times.size == 0:
            raise ValueError("there are no frames to draw: simulate with `frames` of at least 1")
        normal = history["contact_normal_force_n"]
        asked = history["time_s"][normal.argmax()] if time_s is None else time_s
        frame = int(np.abs(frames.times - asked).argmin())
        figure, (force, scene) = diagrams(ax, 2, (7.5, 7.0))
        time_ms, drawn_ms = 1e3 * history["time_s"], 1e3 * frames.times[frame]
        force.plot(time_ms, normal, label="on the workpiece")
        force.plot(time_ms, history["press_force_n"], label="between filaments")
        force.axvline(drawn_ms, color="0.7", linewidth=0.8, label="filaments below")
        force.set(xlabel="time in ms", ylabel="force of the sector in N")
        beside(force)
        for nodes in 1e3 * frames.nodes[frame]:
            scene.plot(nodes[:, 0], nodes[:, 1], color="0.4", linewidth=0.8)
        scene.set(xlabel="x in mm", ylabel="y in mm", aspect="equal")
        scene.set_title(f"filaments at {drawn_ms:.3g} ms")
        return figure

    def _repr_html_(self) -> str:
        return framed(self._simulated.page(self._settings.name), 900)

    def __repr__(self) -> str:
        force = self.metrics["tool_contact_normal_force_n"]
        return f"<Brush: F_n,w = {force:.4g} N>"

    def __reduce__(self) -> tuple[Any, ...]:
        return (_restored, (self._settings, self._simulated.state()))


def _restored(settings: Settings, state: _bristle._BrushState) -> Brush:
    return Brush(settings, _bristle.SimulatedBrush.of_state(settings._input, state))


def brush(
    settings: Settings,
    *,
    threads: int | None = None,
    out: str | PathLike[str] | None = None,
    restart: bool = False,
    check: bool = False,
    progress: bool | TellShare = True,
    frames: int = 120,
    memory_bytes: int | None = None,
) -> Brush:
    """Simulates the filaments of the section ``[brush]``, as ``bristle simulate`` does.

    It can take minutes. The tool is the round one of the settings. Other threads of Python go on meanwhile; Ctrl-C stops it.

    Args:
        settings: What to simulate, with the section ``[brush]``.
        threads: Number of threads, by default one per core; changes no result.
        out: A directory for the files of ``bristle simulate``, without figures, and for the
            checkpoint, from which the same call goes on after Ctrl-C or a crash.
        restart: Whether to discard the checkpoint of an earlier call.
        check: Whether to simulate again at a quarter of the tolerance, for `Brush.checked`.
        progress: Whether to show progress, on a line of a terminal and elsewhere in a
            line now and then, or a function that is called with the share that is done.
        frames: Number of times of `Brush.frames`, at most.
        memory_bytes: Refuses a brush that needs more memory than this, in bytes.

    Raises:
        SettingsError: If there is no such brush, no steady stretch of columns, or ``out`` has a
            checkpoint that cannot be used.
        SimulationError: If a step is not possible.
        OSError: If a file cannot be written.
    """
    checked_input = checked(settings)
    threads = arguments.whole_or_none("threads", threads, 1)
    frames = arguments.whole("frames", frames, 0, arguments.MOST_TIMES)
    memory = arguments.whole_or_none("memory_bytes", memory_bytes, 0)
    place = arguments.path_or_none("out", out)
    with of_share(progress, "the brush") as tell:
        simulated = _bristle.brush(
            checked_input, (threads, memory), frames, (place, restart, check), tell
        )
    warn_of(simulated)
    return Brush(settings, simulated)
