"""Edges that grow round, and filaments that wear."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from typing import TYPE_CHECKING, Any

from bristle import _arguments as arguments
from bristle import _bristle
from bristle._errors import warn_of_all
from bristle._progress import TellShare, of_share
from bristle._settings import Settings, checked
from bristle._table import Column, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bristle._figure import Placed

_Columns = tuple[Mapping[str, Column], Mapping[str, str]]


class Removal:
    """An edge that grows round, as `wear` returns it.

    Printed, it is the text of ``bristle wear``.
    """

    def __init__(
        self,
        settings: Settings,
        history: _Columns,
        edge_work: _Columns,
        numbers: Mapping[str, Any],
        text: str,
    ) -> None:
        self._settings = settings
        self._history = Table(*history, settings)
        self._edge_work = Table(*edge_work, settings)
        self._numbers = numbers
        self._text = text

    @property
    def settings(self) -> Settings:
        """Settings of the simulation."""
        return self._settings

    @property
    def history(self) -> Table:
        """Edge and brush at 201 times from the start to the end: ``removal.csv``."""
        return self._history

    @property
    def edge_work(self) -> Table:
        """One row per radius and length that was simulated: ``edge_work.csv``."""
        return self._edge_work

    @property
    def time_s(self) -> float:
        """The time at the end, in s."""
        return self._last("time_s")

    @property
    def turns(self) -> float:
        """Turns of the tool until the end."""
        return self._last("turns")

    @property
    def edge_radius_m(self) -> float:
        """The radius of the edge at the end, in m; of a chamfer, of the edge that filaments meet first."""
        return self._last("edge_radius_m")

    @property
    def removed_area_m2(self) -> float:
        """The area that is removed from the section of the edges, in m²."""
        return self._last("removed_area_m2")

    @property
    def filament_length_m(self) -> float:
        """The length of the filaments at the end, in m."""
        return self._last("filament_length_m")

    def _last(self, key: str) -> float:
        return float(self._history[key][-1])

    @property
    def preston_m2_n(self) -> float:
        """The Preston coefficient in m²/N, as stated, or found from what was observed."""
        return float(self._numbers["preston_m2_n"])

    @property
    def included_angles_rad(self) -> tuple[float, ...]:
        """The included angle of each edge in rad, in the order in which filaments meet them."""
        return tuple(self._numbers["included_angles_rad"])

    @property
    def life_s(self) -> float | None:
        """The time in s at which the force has fallen by ``removal.force_loss``.

        ``None`` if filaments do not wear, or their force does not fall.
        """
        life: float | None = self._numbers["life_s"]
        return life

    @property
    def change_when_refined(self) -> float:
        """Largest relative change of the radius as the simulated radii were doubled."""
        return float(self._numbers["change_when_refined"])

    @property
    def change_when_checked(self) -> float | None:
        """Largest relative change of radius, time and coefficient with more precision;
        ``None`` without ``check=True``."""
        change: float | None = self._numbers["change_when_checked"]
        return change

    def plot(self, *, ax: Placed = None) -> Figure:
        """The radius over time, with the radii that were simulated.

        Args:
            ax: Axes of matplotlib to draw on; by default those of a new figure.

        Returns:
            The figure of the axes, which a notebook shows; matplotlib must be installed.
        """
        from bristle._figure import beside, diagrams

        figure, [axes] = diagrams(ax, 1, (7.5, 4.5))
        time, history = self._history["time_s"], self._history
        if "edge_radius_lower_95_m" in history:
            low, high = (1e3 * history[f"edge_radius_{end}_95_m"] for end in ("lower", "upper"))
            axes.fill_between(time, low, high, alpha=0.2, label="95 % of the tools")
        names = {"edge_radius_m": "edge", "second_edge_radius_m": "second edge"}
        for key, label in names.items():
            if key in history:
                axes.plot(time, 1e3 * history[key], label=label)
        for radius in sorted(set(self._edge_work["edge_radius_m"].tolist())):
            reached = time[history["edge_radius_m"] >= radius * (1.0 - 1e-9)]
            if reached.size > 0:
                axes.plot(reached[0], 1e3 * radius, "s", mfc="none", color="C1")
        axes.set(xlabel="time in s", ylabel="radius of the edge in mm", ylim=(0.0, None))
        beside(axes)
        return figure

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return self._text


def wear(
    settings: Settings,
    *,
    threads: int | None = None,
    out: str | PathLike[str] | None = None,
    restart: bool = False,
    check: bool = False,
    progress: bool | TellShare = True,
) -> Removal:
    """Follows an edge that grows round and filaments that wear, as ``bristle wear`` does.

    Args:
        settings: The brush, an edge or a chamfer, and ``[removal]``: a coefficient or what one
            trial showed, and when to end.
        threads: Number of threads, by default one per core; changes no result.
        out: A directory for the files of ``bristle wear``, without figures of their own:
            ``removal.csv``, ``edge_work.csv``, ``removal.html``.
        restart: A removal keeps nothing from which another call would go on.
        check: Whether to follow the edge again, with passes at a tenth of their tolerance, for
            `Removal.change_when_checked`.
        progress: Whether to show progress, or a function that is called with the share of the
            present batch of passes that is done.

    Raises:
        SettingsError: If there is no edge, coefficient or goal, or the goal is never reached.
        OSError: If a file cannot be written.
    """
    threads = arguments.whole_or_none("threads", threads, 1)
    place = arguments.path_or_none("out", out)
    with of_share(progress, "the removal") as tell:
        found = _bristle.wear(checked(settings), (threads, place, check), tell)
    history, edge_work, numbers, text, warnings = found
    warn_of_all(warnings)
    return Removal(settings, history, edge_work, numbers, text)
