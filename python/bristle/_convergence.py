"""Dependence of a result on the precision of its computation."""

from __future__ import annotations

import json
from collections.abc import Mapping
from os import PathLike
from typing import TYPE_CHECKING, Any

from bristle import _arguments as arguments
from bristle import _bristle
from bristle._progress import TellShare, of_share
from bristle._settings import Settings, checked

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bristle._figure import Placed


class Convergence:
    """Metrics over numbers of segments and tolerances, as `converge` returns them.

    Printed, it is the text of ``bristle simulate --converge``.
    """

    def __init__(self, settings: Settings, numbers: Mapping[str, Any], text: str) -> None:
        self._settings = settings
        self._numbers = numbers
        self._text = text

    @property
    def settings(self) -> Settings:
        """The settings as they were stated."""
        return self._settings

    @property
    def numbers(self) -> Mapping[str, Any]:
        """The contents of ``converge.json``.

        ``numbers["series"]`` has, for each setting, its ``values`` from coarse to fine and, by
        metric, ``values``, ``limit``, ``order`` and the relative ``error`` as stated.
        """
        return self._numbers

    def error(self, metric: str) -> float | None:
        """The sum of the relative errors of a metric as stated, or ``None`` if it is not known."""
        errors = [series["metrics"][metric]["error"] for series in self._numbers["series"]]
        return None if None in errors else float(sum(errors))

    def plot(
        self, metric: str = "tool_contact_normal_force_n", *, ax: Placed = None
    ) -> Figure:
        """A metric over each setting, with its limit where one is known.

        Args:
            metric: The name of a metric.
            ax: Axes of matplotlib to draw on, one per setting; by default those of a new figure.

        Returns:
            The figure of the axes, which a notebook shows; matplotlib must be installed.
        """
        from bristle._figure import beside, diagrams

        series = self._numbers["series"]
        figure, all_axes = diagrams(ax, len(series), (7.5, 3.5 * len(series)))
        for axes, each in zip(all_axes, series, strict=True):
            numbers = each["metrics"][metric]
            axes.plot(each["values"], numbers["values"], "o-", markersize=3, label="simulated")
            if numbers["limit"] is not None:
                axes.axhline(numbers["limit"], color="0.5", linewidth=1, label="limit")
            axes.axvline(each["stated"], color="0.8", linewidth=1, label="as stated")
            axes.set(xlabel=each["setting"], ylabel=metric, xscale="log")
            beside(axes)
        return figure

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return self._text


def converge(
    settings: Settings,
    *,
    threads: int | None = None,
    out: str | PathLike[str] | None = None,
    progress: bool | TellShare = True,
) -> Convergence:
    """Judges the number of segments and the tolerances, as ``bristle simulate --converge`` does.

    Args:
        settings: The contact, or with ``[brush]`` the filaments that touch.
        threads: Number of threads, by default one per core; changes no result.
        out: A directory for ``converge.csv`` and ``converge.json``.
        progress: Whether to show progress, or a function that is called with the share of the
            cases that is done.

    Raises:
        SettingsError: If the settings cannot be simulated, or have no force.
        OSError: If a file cannot be written.
    """
    threads = arguments.whole_or_none("threads", threads, 1)
    place = arguments.path_or_none("out", out)
    with of_share(progress, "the convergence") as tell:
        numbers, text = _bristle.converge(checked(settings), (threads, place), tell)
    return Convergence(settings, arguments.fixed(json.loads(numbers)), text)
