"""Figures of studies, with the names and units of the program's figures."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from bristle._table import Column, Description, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from bristle._figure import Placed

_MOST_CURVES = 10
"""The most curves of a diagram, as many as matplotlib has colours."""

_DECADES = 100.0
"""Least ratio of the values of a setting that are drawn on a logarithmic axis."""

_SUBSCRIPT = re.compile(r"(\w+)_([\w,]+)")

_FORCE = "tool_contact_normal_force_n"
_BAND = ("tool_force_lower_95_n", "tool_force_upper_95_n")
"""The metric that has a band where filaments scatter, and the columns of its ends."""


@dataclass(frozen=True, eq=False)
class _Side:
    """An axis of a study as figures show it."""

    label: str
    values: npt.NDArray[Any]
    """Numbers in the unit of figures, in ascending order, or names."""
    positions: npt.NDArray[np.intp]
    """Positions of these values along the axis."""

    @property
    def has_names(self) -> bool:
        return self.values.dtype.kind == "U"

    def words(self, position: int) -> str:
        """A value in a legend; in a name, matplotlib must not find a formula."""
        value = self.values[position]
        return value.replace("$", r"\$") if self.has_names else f"{value:.4g}"


def drawn(
    runs: Table,
    axes: Mapping[str, Column],
    descriptions: Mapping[str, Description],
    metric: str,
    ax: Placed,
) -> Figure:
    """A metric as curves over the longest axis, or as a map of two axes that are long."""
    metrics = [
        name
        for name, column in runs.items()
        if column.dtype.kind != "U" and name not in axes
    ]
    if metric not in metrics:
        near = [name for name in metrics if metric in name][:4]
        near = near or get_close_matches(metric, metrics, 4, 0.5)
        meant = f"did you mean {', '.join(near)}? " if near else ""
        raise ValueError(
            f"the study has no metric {metric!r}: {meant}`Study.runs` has them all"
        )
    sides = [_side(values, descriptions[name]) for name, values in axes.items()]

    def rank(side: int) -> tuple[bool, bool, int]:
        """Numbers before names, the longest first, and single values last."""
        size = sides[side].values.size
        return size == 1, sides[side].has_names, -size

    ranked = sorted(range(len(sides)), key=rank)
    over, *others = (sides[side] for side in ranked)
    curves = prod(side.values.size for side in others)
    is_map = curves > _MOST_CURVES
    if is_map and (len(others) > 1 or others[0].has_names):
        raise ValueError(
            f"there would be {curves} curves over {list(axes)[ranked[0]]}, at most "
            f"{_MOST_CURVES}: choose cases from `Study.to_xarray`"
        )

    def on_grid(name: str) -> npt.NDArray[np.float64]:
        """A column by its sides in this order."""
        values = _in_unit(runs[name], descriptions[name])
        grid = values.reshape([side.values.size for side in sides])
        return grid[np.ix_(*(side.positions for side in sides))].transpose(ranked)

    from bristle._figure import beside, diagrams

    figure, [diagram] = diagrams(ax, 1, (7.5, 4.5))
    label = _label(descriptions[metric])
    diagram.set(xlabel=over.label, ylabel=others[0].label if is_map else label)
    if is_map:
        mesh = diagram.pcolormesh(over.values, others[0].values, on_grid(metric).T)
        figure.colorbar(mesh, ax=diagram, label=label)
    else:
        has_band = metric == _FORCE and _BAND[0] in runs
        columns = [metric, *_BAND] if has_band else [metric]
        _draw_curves(diagram, over, others, [on_grid(name) for name in columns])
        if others:
            beside(diagram, ", ".join(side.label for side in others))
    return figure


def _side(values: Column, description: Description) -> _Side:
    label = _label(description)
    if values.dtype.kind == "U":
        return _Side(label, values, np.arange(values.size))
    positions = np.argsort(values)
    return _Side(label, _in_unit(values[positions], description), positions)


def _in_unit(values: Column, description: Description) -> npt.NDArray[np.float64]:
    """Numbers in the unit of figures."""
    return np.asarray(description["factor"] * values, np.float64)


def _label(description: Description) -> str:
    return _SUBSCRIPT.sub(r"$\1_{\\mathrm{\2}}$", description["label"])


def _draw_curves(
    axes: Axes, over: _Side, others: list[_Side], grids: list[npt.NDArray[np.float64]]
) -> None:
    """Draws one curve for each combination of the others, with its band if it has one."""
    shape = [side.values.size for side in others]
    at: Any = over.values
    if over.has_names:
        at = [over.words(place) for place in range(at.size)]
    is_joined = not over.has_names and over.values.size > 1
    for place in np.ndindex(*shape):
        label = ", ".join(side.words(k) for side, k in zip(others, place, strict=True))
        curve, *ends = (grid[:, *place] for grid in grids)
        # Nothing lies between names.
        style = "o-" if is_joined else "o"
        (line,) = axes.plot(at, curve, style, markersize=3, label=label)
        if ends:
            lower, upper = ends
            if is_joined:
                axes.fill_between(at, lower, upper, color=line.get_color(), alpha=0.2)
            else:
                axes.vlines(at, lower, upper, color=line.get_color(), alpha=0.4)
    if not over.has_names and 0.0 < _DECADES * over.values[0] <= over.values[-1]:
        axes.set_xscale("log")
