"""One contact of one filament."""

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
from bristle._metrics import Metrics, Statistics
from bristle._progress import TellShare, of_share
from bristle._settings import Settings, checked
from bristle._table import Table
from bristle._tool import Tool, checked_tool, with_own_speed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bristle._figure import Placed


@dataclass(frozen=True, eq=False)
class Shapes:
    """A filament of n segments at t equally spaced times."""

    times: npt.NDArray[np.float64]
    """Times in s, of the shape (t,)."""

    nodes: npt.NDArray[np.float64]
    """Nodes from the root to the tip, in m, of the shape (t, n + 1, 3)."""

    def __iter__(self) -> Iterator[npt.NDArray[np.float64]]:
        """Times and nodes, for ``times, nodes = …``."""
        return iter((self.times, self.nodes))


class Contact:
    """A simulated contact, as `simulate` returns it.

    Its arrays are made when they are first asked for. In a notebook it shows the page
    of the program, with the filament in motion.
    """

    def __init__(
        self,
        settings: Settings,
        simulated: _bristle.Simulated,
        tool: Tool | None = None,
    ) -> None:
        self._settings = settings
        self._simulated = simulated
        self._tool = tool

    @property
    def settings(self) -> Settings:
        """Settings of the simulation."""
        return self._settings

    @property
    def tool(self) -> Tool | None:
        """The tool that was simulated in place of the round one of the settings."""
        return self._tool

    @property
    def findings(self) -> tuple[Mapping[str, Any], ...]:
        """Findings with ``id``, ``quantity``, ``value``, ``limit``, ``statement``, and ``help``.

        ``bristle explain`` says what an id means.
        """
        return tuple(arguments.fixed(each) for each in json.loads(self._simulated.findings()))

    @cached_property
    def metrics(self) -> Metrics:
        """Everything that ``metrics.json`` has, with the same keys, in SI units.

        It cannot be written to; ``dict(contact.metrics)`` is a copy.
        """
        loaded = json.loads(self._simulated.metrics())
        if self._tool is not None:
            loaded.update(with_own_speed(loaded))
        metrics: Metrics = arguments.fixed(loaded)
        return metrics

    @cached_property
    def checked(self) -> Mapping[str, Any] | None:
        """Content of ``check.json``: the metrics with more precision; ``None`` without ``check=True``."""
        changes: Mapping[str, Any] | None = arguments.of_json(self._simulated.checked())
        return changes

    @cached_property
    def statistics(self) -> Statistics:
        """The work of the solver."""
        statistics: Statistics = arguments.fixed(self._simulated.statistics())
        return statistics

    @cached_property
    def history(self) -> Table:
        """Forces, deflection, tip and energies over time: ``history.csv``.

        One row per sample; ``docs/results.md`` lists the columns. The angle of the body of a
        `Tool` is that of its clamp about ``z``.
        """
        columns, units = self._simulated.history()
        if self._tool is not None:
            angles = self._tool._body_angle_rad(columns["base_angle_rad"])
            columns = {**columns, "base_angle_rad": angles}
        return Table(columns, units, self._settings, self._tool)

    @cached_property
    def profile(self) -> Table:
        """Where on the workpiece the work is done: ``profile.csv``.

        One row per cell along the profile; ``docs/results.md`` lists the columns.
        """
        return Table(*self._simulated.profile(), self._settings, self._tool)

    @cached_property
    def shapes(self) -> Shapes:
        """The filament at equally spaced times."""
        return Shapes(*self._simulated.shapes())

    def plot(self, *, ax: Placed = None) -> Figure:
        """Force and deflection over time, and the filament while it touches.

        Args:
            ax: Three axes of matplotlib to draw on; by default those of a new figure.

        Returns:
            The figure of the axes, which a notebook shows; matplotlib must be installed.
        """
        from bristle._figure import diagrams

        figure, (force, deflection, scene) = diagrams(ax, 3, (7.0, 8.0))
        history = self.history
        time_ms = 1e3 * history["time_s"]
        force.plot(time_ms, history["contact_normal_force_n"])
        force.set(xlabel="time in ms", ylabel="contact normal force in N")
        deflection.plot(time_ms, 1e3 * history["tip_deflection_m"])
        deflection.set(xlabel="time in ms", ylabel="tip deflection in mm")
        touching = history["time_s"][history["contact_normal_force_n"] > 0.0]
        times = self.shapes.times
        drawn = np.arange(times.size)
        if touching.size > 1:
            drawn = drawn[(times >= touching[0]) & (times <= touching[-1])]
        for nodes in self.shapes.nodes[drawn[:: max(1, drawn.size // 12)]]:
            scene.plot(1e3 * nodes[:, 0], 1e3 * nodes[:, 1], color="0.4", linewidth=0.8)
        scene.set(xlabel="x in mm", ylabel="y in mm", aspect="equal")
        return figure

    def _repr_html_(self) -> str | None:
        # The page draws a round tool.
        if self._tool is not None:
            return None
        return framed(self._simulated.page(self._settings.name), 900)

    def __repr__(self) -> str:
        impulse = self.metrics["contact_normal_impulse_n_s"]
        return f"<Contact: p_n = {impulse:.4g} N s>"

    def __reduce__(self) -> tuple[Any, ...]:
        return (_restored, (self._settings, self._simulated.state(), self._tool))


def _restored(
    settings: Settings, state: tuple[Any, ...], tool: Tool | None
) -> Contact:
    simulated = _bristle.Simulated.of_state(settings._input, state)
    return Contact(settings, simulated, tool)


def simulate(
    settings: Settings,
    *,
    samples: int | None = None,
    shapes: int = 301,
    tool: Tool | None = None,
    threads: int | None = None,
    out: str | PathLike[str] | None = None,
    restart: bool = False,
    check: bool = False,
    progress: bool | TellShare = True,
) -> Contact:
    """Simulates the contact of one filament, as ``bristle simulate`` does.

    Other threads of Python go on meanwhile; Ctrl-C stops it.

    >>> import bristle
    >>> contact = bristle.simulate(bristle.Settings.paper(10.0, 1e-3))
    >>> round(contact.metrics["contact_time_ratio"], 2)
    0.64

    Args:
        settings: What to simulate.
        samples: Number of equally spaced times of `Contact.history`, including
            the first and the last instant; by default that of the settings. Without
            any there is no `Contact.profile` either.
        shapes: Number of equally spaced times of `Contact.shapes`.
        tool: A tool in place of the round one. The workpiece lies as the settings say,
            at the depth of the round tool. Files of results have the round tool only.
        threads: One contact takes one thread, however many there may be.
        out: A directory for the files of ``bristle simulate``, without figures.
        restart: A contact keeps nothing from which another call would go on.
        check: Whether to simulate again at a tenth of the tolerance, for `Contact.checked`.
        progress: Whether to show progress, on a line of a terminal and elsewhere in a
            line now and then, or a function that is called with the share that is done.

    Raises:
        SettingsError: If the settings leave velocity or depth to a study.
        SimulationError: If the integration cannot continue.
        ValueError: If both ``tool`` and ``out`` are given.
        OSError: If a file cannot be written.
    """
    checked_input = checked(settings)
    sampled = checked_tool(tool)
    arguments.whole_or_none("threads", threads, 1)
    place = arguments.path_or_none("out", out)
    if tool is not None and place is not None:
        raise ValueError("files of results state no `tool=`: leave out `out`")
    samples = (
        settings.solver["samples"]
        if samples is None
        else arguments.whole("samples", samples, 0, arguments.MOST_TIMES)
    )
    shapes = arguments.whole("shapes", shapes, 0, arguments.MOST_TIMES)
    with of_share(progress, "the contact") as tell:
        simulated = _bristle.simulate(
            checked_input, samples, shapes, sampled, (place, check), tell
        )
    warn_of(simulated)
    return Contact(settings, simulated, tool)
